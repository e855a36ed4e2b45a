"""Ratings of stages: missing data, dynamic factor, faults, hub moments, positions, halves."""

import math

import numpy as np
import pytest
from trains import BEARING, spur_pair, write

from flexgear.model.load import load_case
from flexgear.model.load_cases import LoadCase
from flexgear.results.report.study_tables import rating_verdicts
from flexgear.studies.rating import rate


def test_parts_without_data_are_named_as_not_assessed():
    rigid = {f"stage.{body}.flexible": False for body in ("ring.fe", "carrier.fe", "sun.shaft")}
    few = {"rating.gear_mesh_cycles": 1, "rating.positions_per_gear_mesh": 2}
    case = load_case("wind-5mw", rigid | few)
    rating = rate(case, workers=1)
    assert not [part for part in rating.parts if part.kind != "bearing"]
    assert "K_Hβ is not known" in rating.not_assessed["stage sun"]
    for name in ("micropitting", "scuffing", "shafts", "lubrication", "wear", "damage and life"):
        assert name in rating.not_assessed
    for name, key in (
        ("planet_bearings", "planet_bearing"),
        ("carrier_far", "carrier.bearing_far"),
    ):
        missing = rating.not_assessed[f"stage.{name}"]
        assert missing == f"stage.{key}.dynamic_rating_kn is missing"
    forced = rate(case.with_(**{"rating.k_h_beta": 1.2, "rating.k_v": 1.1}), workers=1)
    assert forced.not_assessed["stage.ring root"] == (
        "stage.ring.rating.steel, grade, root_rz_um are missing"
    )
    assert all(p.missing for p in forced.parts)
    assert all(p.load[0] > 0 for p in forced.parts if p.kind != "bearing")  # stresses are known


def test_with_all_that_is_said_to_be_missing_everything_is_assessed():
    """What a first rating names is all that a second one needs."""
    few = {"rating.gear_mesh_cycles": 1, "rating.positions_per_gear_mesh": 2}
    values = {
        "steel": "through_hardened", "grade": "MQ", "vickers_hardness": 300, "flank_rz_um": 5,
        "root_rz_um": 20, "yield_strength_mpa": 700, "accuracy_grade": 6, "rim_factor": 1.1,
        "viscosity_40_mm2_per_s": 220,
    }  # fmt: skip
    bare = rate(load_case("pitch-drive", few), workers=1)
    first, headline = bare.not_assessed, rating_verdicts(bare)[0]
    assert (headline.subject, headline.figure) == ("Gears", "not assessed")
    assert "K_Hβ is not known" in headline.sentence and "stands below" in headline.sentence
    changes, section = dict[str, object](few), ""
    for text in (why for name, why in first.items() if name.endswith((" sun", " ring"))):
        assert all(f"{factor} is not known" in text for factor in ("K_Hβ", "K_v", "K_Hα"))
        for key in text.rpartition("; ")[2].removesuffix(" are missing").split(", "):
            section = key.rpartition(".")[0] or section
            changes[f"{section}.{key.rpartition('.')[2]}"] = values[key.rpartition(".")[2]]
            if key == f"{section}.steel":  # the kind that is chosen here needs two more
                for more in ("vickers_hardness", "yield_strength_mpa"):
                    changes[f"{section}.{more}"] = values[more]
    second = rate(load_case("pitch-drive", {**changes, "rating.k_h_beta": 1.2}), workers=1)
    assert len(second.parts) > 24
    assert not [p.name for p in second.parts if p.missing and p.kind != "bearing"]


@pytest.mark.parametrize(("share", "ratio"), [(0.7, 0.02), (1.25, 0.02), (1.25, 0.005)])
def test_dynamic_factor_of_an_oscillator_in_steady_motion(tmp_path, share, ratio):
    """m δ̈ + c δ̇ + k δ = F₀ + m ë with e = 0.15 F₀/k sin(w ω₀ t): K_v = 1 + 0.15 w² √(1 + (2ζw)²)/
    √((1 − w²)² + (2ζw)²); vibration from the start, almost as large, has no part in it."""
    gear = 'teeth = 50, equivalent_mass_kg = 2, kinematics = "torsional"'
    static = 100.0 / (0.1 * math.cos(math.radians(20))) / 4e8  # F₀/k
    text = spur_pair(
        gear, gear, f"""model = "constant"
contact_law = "one-sided"
damping_law = "always"
damping_ratio = {ratio}
sun_stiffness_n_per_m = 4e8""",
        backlash=400, speed=share * 2e4 / (100 * math.pi) * 60, torque=100.0,
        output='machine = { law = "torque" }',
        sections=f"""[stages.errors]
sun_gear_mesh_um = {0.15e6 * static}
[damping]
ratio = 0.0""",
    )  # fmt: skip
    rules = {"dynamic_factor": "train", "k_h_beta": 1.0, "k_h_alpha": 1.0, "k_f_alpha": 1.0}
    case = load_case(write(tmp_path, text)).with_(
        load_cases=(LoadCase(name="a", hours=1.0, torque=100.0),),
        **{f"rating.{key}": value for key, value in rules.items()},
    )
    damping = 2 * ratio * share
    vibration = 0.15 * share**2 * math.hypot(1, damping) / math.hypot(1 - share**2, damping)
    (gear_mesh,) = rate(case, workers=1).gear_meshes
    assert gear_mesh.factors[0]["K_v"].value == pytest.approx(1 + vibration, rel=5e-3)


def test_a_rating_is_that_of_sound_teeth(tmp_path):
    """A pit raises the pressure of the teeth beside it in equilibria, not in a rating."""
    steel = 'rating = { steel = "case_hardened", grade = "MQ", vickers_hardness = 700, '
    steel += "core_rockwell_hardness = 30, flank_ra_um = 0.8, root_rz_um = 20, accuracy_grade = 6 }"
    text = spur_pair(
        f"teeth = 30, {steel}, {BEARING}", f"teeth = 60, {steel}, {BEARING}",
        'model = "face_load"\ncontact_law = "one-sided"\nslices = 4',
        sections="[lubricant]\nviscosity_40_mm2_per_s = 320\ntemperature_c = 65",
    )  # fmt: skip
    pit = 'kind = "spall"\ngear = "pinion"\ntooth = 1\nflank = "drive"\ndepth_um = 99\n'
    sound, faulty = (
        rate(load_case(write(tmp_path, text + more)), workers=1)
        for more in ("", f"[[faults]]\n{pit}")
    )
    assert "faults" in faulty.not_assessed and "faults" not in sound.not_assessed
    before, after = (next(p for p in r.parts if p.kind == "flank") for r in (sound, faulty))
    assert after.direct["S_direct"].value == before.direct["S_direct"].value
    assert after.load == pytest.approx(before.load, rel=1e-12)


def test_a_hub_moment_loads_planets_unevenly_and_its_sense_does_not_matter():
    """Weight of a rotor on the carrier: K_γ above one; turned about the axis by a planet pitch or
    mirrored nothing changes but which planet bears it."""
    case = load_case(
        "wind-5mw",
        {
            "stage.ring.fe.flexible": False,
            "stage.carrier.fe.flexible": False,
            "stage.sun.shaft.flexible": False,
            "rating.gear_mesh_cycles": 5,
            "rating.positions_per_gear_mesh": 4,
            "rating.k_h_beta": 1.2,
            "rating.k_v": 1.05,
            "stage.errors": None,
        },
    )
    rated = 4e6
    states = [
        LoadCase(name=f"{k}", hours=1.0, torque=rated, moment=moment)
        for k, moment in enumerate(((0.0, 0.0, 0.0), (1e6, 0.0, 0.0), (-1e6, 0.0, 0.0)))
    ]
    rating = rate(case.with_(load_cases=tuple(states)), workers=1)
    ring = next(g for g in rating.gear_meshes if g.name == "stage ring")
    alone, one, other = ring.largest_k_gamma
    assert alone == pytest.approx(1.0, abs=3e-3)
    assert one > alone + 0.005, ring.largest_k_gamma
    assert other == pytest.approx(one, rel=0.02)


def test_positions_are_enough_as_doubling_them_shows():
    """Of gear-mesh cycles and of positions in each, under a hub moment."""
    case = load_case(
        "wind-5mw",
        {
            **{f"stage.{b}.flexible": "false" for b in ("ring.fe", "carrier.fe", "sun.shaft")},
            "stage.gear_mesh.model": "face_load",
            "stage.gear_mesh.slices": "7",
            "rating.k_v": "1.05",
        },
    ).with_(load_cases=(LoadCase(name="m", hours=1.0, torque=4e6, moment=(1e6, 5e5, 0.0)),))

    def largest(**keys):
        rating = rate(
            case.with_(**{f"rating.{key}": value for key, value in keys.items()}), workers=1
        )
        factors = [gear_mesh.factors[0] for gear_mesh in rating.gear_meshes]
        products = [lines["K_γ"].value * lines["K_Hβ"].value for lines in factors]
        return np.array(products), rating.halving[0]

    usual, halving = largest()
    for doubled in ("gear_mesh_cycles", 14), ("positions_per_gear_mesh", 16):
        change = abs(largest(**dict([doubled]))[0] / usual - 1).max()
        assert change < 0.02 and change < halving < 0.05
    four, eight = (largest(gear_mesh_cycles=1, positions_per_gear_mesh=n) for n in (4, 8))
    assert eight[1] == pytest.approx(abs(four[0] / eight[0] - 1).max(), rel=1e-3)


def test_halves_that_share_the_load_unevenly_have_it_in_their_factor():
    """An axial force on a sun that floats axially is the difference of both halves' axial forces,
    T tan β/r each at equal shares."""
    keys = {
        "stage.errors": {}, "stage.sun.support": {"radial_n_per_m": 1e9},
        "rating.gear_mesh_cycles": 1, "rating.positions_per_gear_mesh": 2,
    }  # fmt: skip
    train = load_case("herringbone", keys)
    radius = 0.5 * 23 * 0.022 / math.cos(math.radians(25))
    force, torque = 20e3, 1e5
    share = force * radius / (torque * math.tan(math.radians(25)))
    states = [
        LoadCase(name="even", hours=10.0, torque=torque),
        LoadCase(name="thrust", hours=10.0, torque=torque, force=(0.0, 0.0, force)),
    ]
    factors = {"rating.k_h_beta": 1.2, "rating.k_v": 1.0, "rating.k_h_alpha": 1.0}
    rating = rate(train.with_(load_cases=tuple(states), **factors), workers=1)
    sun = [g.largest_k_gamma for g in rating.gear_meshes if g.name.kind == "sun"]
    even, thrust = np.sort(sun, axis=0).T
    assert even == pytest.approx([1.0, 1.0], abs=1e-6)
    assert thrust == pytest.approx([1.0 - share, 1.0 + share], rel=1e-4)
