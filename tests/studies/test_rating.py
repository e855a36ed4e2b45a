"""Ratings under load spectra: limits, invariances, hand calculations, through the public face."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from trains import BEARING, spur_pair, write

from flexgear.model.bearings import RollingElements
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case
from flexgear.model.load_cases import LoadCase
from flexgear.results.rating_files import rating_rows, rating_summary
from flexgear.results.report.study_tables import rating_tables, rating_verdicts
from flexgear.solve.bin_loads import loads_in_bin
from flexgear.studies import rating as study
from flexgear.studies.compare import lives
from flexgear.studies.measures import chosen_measures, measured
from flexgear.studies.rating import rate
from flexgear.views.study_charts import safety_chart

RATED = 5e6 / (12.1 * math.pi / 30)  # N m, of the first input
FROZEN = {
    "rating.k_gamma": 1.1,
    "rating.k_v": 1.05,
    "rating.k_h_beta": 1.2,
    "rating.k_f_beta": 1.15,
    "rating.k_h_alpha": 1.0,
    "rating.k_f_alpha": 1.0,
    "rating.gear_meshes": (),
}


def _cases(*states):
    """Load cases of (name, hours, share of rated torque)."""
    return tuple(
        LoadCase(name=name, hours=hours, torque=share * RATED) for name, hours, share in states
    )


@cache
def _train():
    return load_case(
        "nrel-5mw", {"rating.gear_mesh_cycles": 2, "rating.positions_per_gear_mesh": 4}
    )


@cache
def _rated(*states, **changes):
    return rate(_train().with_(load_cases=_cases(*states), **changes), workers=1)


def _frozen(*states):
    return _rated(*states, **FROZEN)


def _damages(rating):
    return {part.name: part.damage_sum for part in rating.parts if not part.missing}


def test_equilibria_share_evenly_without_errors():
    """No errors, weight or moments: cycle means of all planets are equal, K_γ = 1."""
    rating = _rated(("rated", 1000.0, 1.0), **{"rating.gear_meshes": ()})
    for gear_mesh in rating.gear_meshes:
        k_gamma = gear_mesh.factors[0]["K_γ"]
        assert k_gamma.value == pytest.approx(1.0, abs=1e-9)
        assert k_gamma.source.startswith("computed")


def test_reversed_torque_loads_the_other_flanks():
    """A planet's flank that presses the sun under rated torque presses the ring when reversed."""
    case = _train().with_(
        load_cases=(
            *_cases(("drive", 1000.0, 1.0)),
            LoadCase(name="coast", hours=10.0, torque=-0.5 * RATED, back_driven=True),
        ),
        **FROZEN,
    )
    parts = {part.name: part for part in rate(case, workers=1).parts}
    assert parts["stage_1.sun flank"].load[1] == 0.0
    assert parts["stage_1.sun coast flank"].load[0] == 0.0
    to_sun, to_ring = (parts[f"stage_1.planet flank to the {x}"].load for x in ("sun", "ring"))
    assert to_sun[0] == pytest.approx(parts["stage_1.sun flank"].load[0], rel=0.2)
    assert to_sun[1] == pytest.approx(to_ring[0] * math.sqrt(0.5), rel=1e-6)


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


def test_what_the_norm_does_not_know_is_refused_before_anything_is_solved(monkeypatch):
    monkeypatch.setattr(study, "_solved", None)
    case = _train().with_(**{"stages.stage_1.sun.rating.vickers_hardness": 500.0})
    with pytest.raises(InputError, match="no flank strength of case_hardened MQ beyond"):
        rate(case, workers=1)


def test_a_load_at_rest_and_one_without_torque(monkeypatch):
    """At rest nothing is worn and the stress is static; without torque nothing is loaded, not even
    rows of rollers in their gap by rounding."""
    rows = RollingElements(
        count=24, rows=1, spacing=0.2, diameter=0.06, length=0.1, pitch_diameter=0.5, clearance=4e-5
    )
    case = _train().with_(
        load_cases=(
            LoadCase(name="parked", hours=500.0, torque=RATED, speed=0.0),
            LoadCase(name="idle", hours=500.0, torque=0.0),
        ),
        **FROZEN,
        **{"stages.stage_1.planet_bearing.elements": rows},
    )

    def with_rounding(train, load_bin):
        loads = loads_in_bin(train, load_bin)
        noise = {name: force + 1e-11 for name, force in loads.supports.items()}
        assert load_bin.name != "idle" or not loads.groups
        return replace(loads, supports=noise) if load_bin.name == "idle" else loads

    monkeypatch.setattr(study, "loads_in_bin", with_rounding)
    rating = rate(case, workers=1)
    assert any("F_2" in p.factors[0] for p in rating.parts if p.factors)
    for part in rating.parts:
        if part.missing:  # the supports of the carriers have no data, and carry nothing here
            assert part.alike.endswith("carrier_support") and not part.load.any()
            continue
        assert part.damage_sum == 0.0 and part.life == math.inf
        assert part.load[0] > 0.0 and part.load[1] == pytest.approx(0.0, abs=1e-6)
    assert not any("together" in why for why in rating.not_assessed.values())
    once = _frozen(("a", 1000.0, 1.0))
    for part, turning in zip(rating.parts, once.parts, strict=True):
        if part.kind == "root":
            assert part.safety[0] > turning.safety[0]


def _dynamic(**changes):
    """K_v by group, from the motion of the train."""
    keys = {"rating.dynamic_factor": "train", "rating.limits": "none", **changes}
    rating = rate(_train().with_(load_cases=_cases(("a", 1.0, 1.0)), **keys), workers=1)
    factors = {g.name: g.factors[0]["K_v"] for g in rating.gear_meshes}
    assert all(f.source.startswith("computed") for f in factors.values())
    assert all("; ISO 6336-1:2019 method B: 1." in f.source for f in factors.values())
    return {name: f.value for name, f in factors.items()}


def test_dynamic_factor_of_the_train():
    """Where nothing excites, K_v = 1; a stage whose stiffness jumps with the number of pairs
    vibrates, and those behind its long shafts hardly do."""
    assert list(_dynamic().values()) == pytest.approx([1.0] * 5, abs=1e-5)
    waved = _dynamic(**{"stages.stage_3.gear_mesh.model": "rectangular"})
    assert waved["stage_3 pinion"] > 1.2
    assert max(v for name, v in waved.items() if "stage_3" not in name) < 1.05


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


def test_labels_of_reserves_near_the_limit_are_not_struck_through():
    data = _frozen(("a", 1000.0, 1.0)).dataset()
    (axes,) = safety_chart(data).axes
    (limit,) = axes.lines
    assert limit.get_xdata()[0] == 1.0 and axes.texts
    for label in axes.texts:
        assert label.get_zorder() > limit.get_zorder()
        assert label.get_bbox_patch().get_facecolor() == (1.0, 1.0, 1.0, 1.0)


def test_outputs_hold_every_part_and_bin():
    rating = _frozen(("a", 1000.0, 1.0), ("b", 100.0, 1.2))
    data, summary = rating.dataset(), rating_summary(rating)
    for part in rating.parts:
        values = data.sel(part=part.name)
        assert values["damage"].to_numpy() == pytest.approx(part.damage, nan_ok=True)
        if part.missing:
            assert summary["parts"][part.name]["not_assessed"] == part.missing
            continue
        assert summary["parts"][part.name]["damage_sum"] == pytest.approx(part.damage_sum)
        assert values["safety"] == pytest.approx(part.least_safety)
    rows = list(rating_rows(rating))
    pairs = {(of, b) for of, b, quantity, *_ in rows if quantity == "damage"}
    assert pairs == {(p.name, b.name) for p in rating.ranked for b in rating.bins}
    assert np.isfinite(data["load_factor"].to_numpy()).all()


def test_bearings_by_hand():
    """L = (C/P)^{10/3}, two bearings share F = 2 F_t cos… of a planet: damage = turns/L, S_0 = 2
    C_0/F; the load case with most of both is named."""
    rating = _frozen(("a", 5000.0, 1.0), ("b", 100.0, 1.5))
    planet = {p.name: p for p in rating.parts}["stage_1.planet_bearing_2"]
    tangential = 1.1 * RATED / 3 / 0.863  # of the pin of a planet, times the key k_gamma
    force = planet.load[0]
    assert force == pytest.approx(tangential, rel=0.01)  # radial forces are small beside it
    assert force > tangential
    rpm = 56 / 17 * 12.1
    lives = [1e6 * (5500e3 / (share * force / 2)) ** (10 / 3) for share in (1.0, 1.5)]
    damage = [60 * hours * rpm / life for hours, life in zip((5000, 100), lives, strict=True)]
    assert planet.damage == pytest.approx(damage, rel=1e-9)
    assert planet.life == pytest.approx(5100 / sum(damage), rel=1e-9)
    assert planet.safety == pytest.approx([2 * 11e6 / force, 2 * 11e6 / force / 1.5], rel=1e-6)
    assert planet.required == 5100.0 and planet.worst_bin == 0


def test_equal_parts_are_one_row_that_names_the_worst():
    """Bearings of planets, alike and not; those that are not assessed, too."""
    rating = _frozen(("a", 5000.0, 1.0))

    def rows(parts):
        changed = replace(rating, parts=tuple(parts))
        tables = rating_tables(changed)
        first = {row.label: row.value for row in tables[0].rows}
        folded = [t for t in tables if t.folded and t.section == "rating"]
        return first, {t.title: len(t.rows) for t in folded}, rating_verdicts(changed)

    first, folded, _ = rows(rating.parts)
    assert "3 planets alike" in first["stage 1 planet bearings"]
    assert not any(label.startswith("stage 1 planet bearing ") for label in first)
    assert folded["stage 1 planet bearings, one by one"] == 3
    worse = {
        "stage_1.planet_bearing_2": lambda p: replace(
            p, load=1.2 * p.load, damage=2 * p.damage, life=p.life / 2
        ),
        "stage_1.planet root to the sun": lambda p: replace(p, planets=(3,)),
    }
    first, _, verdicts = rows(worse.get(p.name, lambda p: p)(p) for p in rating.parts)
    assert "3 planets, worst is planet 2; " in first["stage 1 planet bearings"]
    assert "3 planets, worst is planet 3; " in first["stage 1 planet root to the sun"]
    bearings = next(v for v in verdicts if v.subject == "Bearing life, stage 1")
    assert bearings.sentence.startswith("stage 1 planet bearings: 3 planets, worst is planet 2; ")


def test_reliability_falls_with_time_and_is_of_all_parts():
    short, long = _frozen(("a", 1000.0, 1.2)), _frozen(("a", 100000.0, 1.2))
    assert 0.0 < long.reliability < short.reliability <= 1.0


def test_measures_of_a_sweep_and_of_two_designs():
    """A key K_γ raises stresses of roots by itself, those of flanks by its root: load reserves fall
    with it. A case against itself lives as long."""
    reserves = {}
    for k_gamma in (1.0, 1.25):
        keys = {**FROZEN, "rating.k_gamma": k_gamma, "load_cases": _cases(("a", 5000.0, 1.1))}
        case = _train().with_(**keys)
        figures = measured((case, ("life",), 1), case)
        reserves[k_gamma] = figures["load_reserve"].to_series().to_dict()
        assert (figures["life"] <= 1e7).all()
    for name, reserve in reserves[1.0].items():
        assert reserves[1.25][name] == pytest.approx(reserve / 1.25, rel=1e-9)
    with pytest.raises(InputError, match="--measure: life: needs load cases"):
        chosen_measures(case.with_(load_cases=()), ["life"])
    bare = case.with_(load_cases=(LoadCase(name="x", extreme=True, torque=RATED),))
    with pytest.raises(FlexgearError, match="no load case has a duration"):
        measured((bare, ("life",), 1), bare)
    both = lives(case, case, workers=1)
    for figures in both.values():
        assert figures["load_reserve"] == figures["reference_load_reserve"]
        assert figures.get("life_ratio", 1.0) == 1.0


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
        return [lines["K_γ"].value * lines["K_Hβ"].value for lines in factors]

    usual = largest()
    assert largest(gear_mesh_cycles=14) == pytest.approx(usual, rel=0.02)
    assert largest(positions_per_gear_mesh=16) == pytest.approx(usual, rel=0.02)


@pytest.mark.usefixtures("cache")
def test_a_stopped_rating_goes_on(monkeypatch):
    """Bins that were solved before the stop are not solved again, and the end forgets them."""
    case = _train().with_(
        load_cases=_cases(("a", 10.0, 1.0), ("b", 10.0, 0.9), ("c", 10.0, 0.8)), **FROZEN
    )
    solved = []

    def solve(train, load_bin):
        if len(solved) == 2:
            solved.append("stop")
            raise KeyboardInterrupt
        solved.append(load_bin.name)
        return loads_in_bin(train, load_bin)

    monkeypatch.setattr(study, "loads_in_bin", solve)
    with pytest.raises(KeyboardInterrupt):
        rate(case, workers=1)
    assert study.finished(case) == 2
    rating = rate(case, workers=1)
    assert solved == ["a", "b", "stop", "c"]
    assert study.finished(case) == 0
    monkeypatch.undo()
    assert _damages(rating) == _damages(rate(case, workers=1))


def test_damage_rises_by_the_slopes_of_the_curves():
    """Case-hardened, beyond the knees with a life factor of 0.85 at 1e10 cycles: stresses of roots
    grow with the load, those of flanks with its root."""
    low, high = _frozen(("a", 50000.0, 0.5)), _frozen(("a", 50000.0, 0.505))
    flank = math.log(1e10 / 5e7) / math.log(1 / 0.85) / 2
    root = math.log(1e10 / 3e6) / math.log(1 / 0.85)
    slopes = {"flank": flank, "root": root}
    for one, other in zip(low.parts, high.parts, strict=True):
        if one.name in ("stage_3.pinion flank", "stage_3.pinion root"):
            slope = math.log(other.damage_sum / one.damage_sum) / math.log(1.01)
            assert slope == pytest.approx(slopes[one.kind], rel=1e-6)
    assert flank == pytest.approx(16.3, abs=0.05)
    assert root == pytest.approx(50.0, abs=0.1)


def test_extreme_loads_damage_nothing_and_count_for_safety():
    case = _train().with_(
        load_cases=(
            *_cases(("a", 1000.0, 1.0)),
            LoadCase(name="x", extreme=True, torque=4 * RATED),
        ),
        **FROZEN,
    )
    with_it, without = rate(case, workers=1), _frozen(("a", 1000.0, 1.0))
    assert _damages(with_it) == pytest.approx(_damages(without), rel=1e-12)
    for part, other in zip(with_it.parts, without.parts, strict=True):
        assert part.missing == other.missing
        assert part.missing or part.least_safety <= other.least_safety
        assert part.governing_bin in (None, 1)


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
