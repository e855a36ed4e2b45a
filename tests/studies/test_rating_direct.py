"""The direct path of a rating: limits towards the norm, sectors of a ring, what is written."""

import math
from dataclasses import replace

import numpy as np
import pytest
from gears.rated_gears import PLANETARY, case_of
from scipy.optimize import brentq
from trains import BEARING, spur_pair, write

from flexgear.gears.rating.sheet import BEYOND
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.load import load_case
from flexgear.model.load_cases import LoadCase
from flexgear.results.rating_files import rating_rows, rating_summary
from flexgear.results.report.study_tables import DIRECT, rating_tables
from flexgear.solve.bin_loads import loads_in_bin
from flexgear.solve.stresses import GroupStresses, HeldRoots
from flexgear.studies import rating as study
from flexgear.studies import rating_direct
from flexgear.studies.rating import rate
from flexgear.views.study_charts import ring_safety_chart

SUPPORT = "support = { radial_n_per_m = 1e9 }\n"
HELD_STAGE = PLANETARY.replace("[stage.carrier]\n", f"[stage.carrier]\n{SUPPORT}").replace(
    "profile_shift = 0.2\nbore", f"{SUPPORT}profile_shift = 0.2\nbore"
)
HELD = HeldRoots(held=3e8, even=2e8, pair_load=1e4)


pytestmark = pytest.mark.usefixtures("cache")


@pytest.mark.parametrize("coasts", [False, True])
def test_with_the_stresses_of_the_norm_its_safeties_come_out(tmp_path, monkeypatch, coasts):
    """Every place under the norm's own stress, in all passes alike, fillets of planets pressed 1.2
    times as much as they are stretched: safety, damage and life are those of the norm, whatever K_A
    and K_v and the least safety of extreme loads are; where some load cases coast, too, of suns and
    rings, which have Y_M < 1 then."""
    coast = LoadCase(name="c", hours=40.0, torque=-6e3, back_driven=True)
    states = (("a", 20000.0, 9e3), ("b", 300.0, 13e3))
    case = case_of(
        tmp_path,
        HELD_STAGE,
        load_cases=(
            *(LoadCase(name=name, hours=hours, torque=t) for name, hours, t in states),
            LoadCase(name="x", extreme=True, torque=18e3),
            *([coast] if coasts else []),
        ),
        **{
            "rating.application_factor": 1.2, "rating.k_v": 1.1, "rating.k_h_beta": 1.3,
            "rating.gear_mesh_cycles": 2, "rating.positions_per_gear_mesh": 2,
            "rating.least_static_root_safety": 2.5,  # so that the extreme load governs roots
        },
    )  # fmt: skip
    by_norm = rate(case, workers=1)
    stress = {p.name: p.load for p in by_norm.parts}

    def with_stresses(train, load_bin):
        loads = loads_in_bin(train, load_bin)
        b, beside = [x.name for x in train.bins].index(load_bin.name), 1.2 * 1.1

        def of(kind, group):
            side, before = group, ""
            if load_bin.name == "c":
                side, before = "ring" if group == "sun" else "sun", "coast "
            mates = [f"stage.planet {kind} to the {side}", f"stage.{group} {before}{kind}"]
            return [stress[name][b] for name in mates]

        groups = {}
        for name, group in loads.groups.items():
            pressure = max(of("flank", name.kind)) / math.sqrt(beside) * np.ones((3, 2, 4, 5))
            tension = np.array(of("root", name.kind))[:, None] * np.ones((3, 2, 2, 6)) / beside
            pressed = -1.2 * np.array(of("root", "ring" if name.kind == "sun" else "sun"))
            groups[name] = replace(
                group,
                stresses=GroupStresses(
                    azimuth=np.array([[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]),
                    path=np.full(4, 0.02),
                    pressure=pressure,
                    tension=tension,
                    compression=pressed[:, None] * np.ones((3, 2, 2, 6)) / beside,
                    lowest=np.zeros(0),
                ),
            )
        return replace(loads, groups=groups)

    monkeypatch.setattr(study, "loads_in_bin", with_stresses)
    monkeypatch.setattr(rating_direct, "roots_in_bin", lambda *_: HELD)
    rating = rate(case, workers=1)
    of_both_sides = [name for name in rating.not_assessed if name.endswith(", direct path")]
    assert len(of_both_sides) == (4 if coasts else 0)
    assert not by_norm.not_assessed.keys() & set(of_both_sides)  # has no stresses at all
    compared = 0
    for part, norm in zip(rating.parts, by_norm.parts, strict=True):
        if part.kind == "bearing" or (coasts and part.name.startswith("stage.planet ")):
            continue
        figures = {symbol: f.value for symbol, f in part.direct.items()}
        causes = [v for s, v in figures.items() if s.startswith("by ")]
        assert math.prod(causes) == pytest.approx(figures["σ_direct/σ"], rel=1e-9)
        # of two flanks under one pressure that with Z_B or Z_D above one has the norm's
        if part.kind == "root" or figures["σ_direct/σ"] == pytest.approx(1.0, rel=1e-9):
            compared += 1
            assert figures["S_direct"] == pytest.approx(norm.least_safety, rel=1e-9)
            assert figures["D_direct"] == pytest.approx(norm.damage_sum, rel=1e-9)
            assert figures["L_direct"] == pytest.approx(norm.life, rel=1e-9)
            assert figures["S_Hmin" if part.kind == "flank" else "S_Fmin"] == norm.limit
            assert norm.limit == (2.5 if part.kind == "root" and "coast" not in part.name else 1.0)
    assert compared >= 6
    # what is written says the same
    data, summary = rating.dataset(), rating_summary(rating)
    sun = {p.name: p for p in rating.parts}["stage.sun root"]
    value = sun.direct["S_direct"].value
    assert data["direct_safety"].sel(part=sun.name) == pytest.approx(value)
    assert summary["parts"][sun.name]["direct_path"]["S_direct"] == pytest.approx(value)
    sources = {r[5] for r in rating_rows(rating) if r[2] == "S_direct"}
    assert sources == {BEYOND}
    assert len(next(t for t in rating_tables(rating) if t.title == DIRECT).rows) == 8


def test_pressure_of_spur_teeth_is_largest_at_the_end_of_single_contact(tmp_path):
    """p² = w E/(2π (1 − ν²)) (1/ρ₁ + 1/ρ₂), w = T/(r_b b), one base pitch before the end of the
    path at the pinion's tip; inv α_w = inv α + 2 (0.3 + 0.1) tan α/(18 + 90). Positions are those
    of a rating without further keys."""
    steel = 'steel = "case_hardened", grade = "MQ", flank_rz_um = 4, root_rz_um = 16'
    gears = [
        f"teeth = {z}, profile_shift = {x}, {BEARING}, rating = {{ {steel} }}"
        for z, x in ((18, 0.3), (90, 0.1))
    ]
    path = 'model = "face_load"\npath_only = true\nslices = 3'
    text = spur_pair(*gears, path, sections="[lubricant]\nviscosity_40_mm2_per_s = 220")
    load = LoadCase(name="a", hours=1000.0, torque=500.0)
    case = load_case(write(tmp_path, text)).with_(load_cases=(load,), **{"rating.k_v": 1.0})
    alpha = math.radians(20)
    involute = math.tan(alpha) - alpha + 0.8 * math.tan(alpha) / 108
    working = brentq(lambda a: math.tan(a) - a - involute, 0.1, 1.0)
    base, tip = np.array([36, 180]) * math.cos(alpha), np.array([36 + 5.2, 180 + 4.4])
    roll, between = np.sqrt(tip**2 - base**2), base.sum() * math.tan(working)
    inner = roll[0] - 4 * math.pi * math.cos(alpha)
    outer = between - inner
    line_load = 500e3 / base[1] / 40
    modulus = 1e-6 * case.material.young_modulus / (1 - case.material.poisson_ratio**2)
    pressure = math.sqrt(line_load * modulus / (2 * math.pi) * (1 / inner + 1 / outer))
    parts = {part.name: part for part in rate(case, workers=1).parts}
    for gear in ("pinion", "gear"):
        largest = parts[f"stage_1.{gear} flank"].direct["σ_direct"].value
        assert largest == pytest.approx(pressure, rel=0.012)


def test_a_hub_moment_that_stands_loads_one_sector_of_a_ring():
    """Turned by a planet pitch, the sector goes with it; sun and planets average over all."""
    steel = {"steel": "case_hardened", "grade": "MQ", "flank_rz_um": "6", "root_rz_um": "20"}
    gears = ("sun", "planet", "ring")
    keys = {f"stage.{g}.rating.{k}": v for g in gears for k, v in steel.items()}
    case = load_case(
        "wind-5mw",
        {
            **{f"stage.{b}.flexible": "false" for b in ("ring.fe", "carrier.fe", "sun.shaft")},
            **keys,
            "stage.gear_mesh.model": "face_load",
            "stage.gear_mesh.slices": "7",
            "lubricant.viscosity_40_mm2_per_s": "320",
            "rating.gear_mesh_cycles": "6",
            "rating.positions_per_gear_mesh": "4",
            "rating.k_v": "1.05",
        },
    ).with_(**{"stage.errors": GearErrors()})
    turn = 2 * math.pi / 5

    def rated(angle):
        moment = (2e6 * math.cos(angle), 2e6 * math.sin(angle), 0.0)
        state = LoadCase(name="m", hours=1e5, torque=4e6, moment=moment)
        rating = rate(case.with_(load_cases=(state,)), workers=1)
        parts = {p.name: p for p in rating.parts}
        figures = {n: {s: f.value for s, f in p.direct.items()} for n, p in parts.items()}
        return {n: figures[f"stage.{n} flank"] for n in ("sun", "ring")}, rating.dataset()

    (first, data), (second, _) = rated(0.0), rated(turn)
    # tooth by tooth: the weakest is that of the part, and all teeth of one ring are there
    safety, azimuth = data["direct_tooth_safety"], data["ring_tooth_azimuth"]
    assert set(data["ring_tooth_part"].to_numpy()) == {"stage.ring flank"}
    assert len(safety) == 93
    assert float(safety.min()) == pytest.approx(first["ring"]["S_direct"], rel=1e-12)
    weakest = math.degrees(float(azimuth[int(np.argmin(safety.to_numpy()))]))
    assert weakest == pytest.approx(first["ring"]["φ"])
    assert float(safety.max()) > 1.05 * float(safety.min())
    (axes,) = ring_safety_chart(data).axes
    drawn, norm = axes.lines
    assert axes.get_ylim()[1] > 1.04 * max(float(safety.max()), norm.get_ydata()[0])
    assert drawn.get_ydata() == pytest.approx(safety.to_numpy())
    assert norm.get_ydata() == pytest.approx(float(data["safety"].sel(part="stage.ring flank")))
    moved = math.remainder(second["ring"]["φ"] - first["ring"]["φ"] - 72.0, 360.0)
    assert abs(moved) < 15.0
    for name in ("sun", "ring"):
        assert second[name]["S_direct"] == pytest.approx(first[name]["S_direct"], rel=0.02)
    assert {"s/g", "z/b", "φ"} <= set(first["ring"]) and "φ" not in first["sun"]


def test_no_planet_is_named_where_all_are_loaded_alike(tmp_path):
    """24 + 96 teeth over three planets: all of them mesh in phase, and their loads differ by
    rounding alone, unless a pin stands off."""
    stage = HELD_STAGE + '[stage.gear_mesh]\nmodel = "face_load"\nslices = 3\n'
    few = {"rating.k_v": 1.1, "rating.gear_mesh_cycles": 2, "rating.positions_per_gear_mesh": 2}
    state = (LoadCase(name="a", hours=20000.0, torque=9e3),)

    def texts(more=""):
        rating = rate(case_of(tmp_path, stage + more, load_cases=state, **few), workers=1)
        every, direct = rating_tables(rating, parts=False)[:2]
        assert direct.title == DIRECT
        factors = rating.gear_meshes[0].factors[0]
        assert ("planet" in factors["K_γ"].source) is bool(more)
        return [
            [row.value for row in table.rows if row.label.startswith("planet ")]
            for table in (every, direct)
        ]

    alike, places = texts()
    assert len(alike) == 4 and all("; 3 planets alike; " in text for text in alike)
    assert not any(", planet " in text for text in places)
    uneven, places = texts("[stage.errors]\npin_tangential_um = [60, 0, 0]\n")
    assert all("3 planets, worst is planet 1; " in text for text in uneven)
    assert all(text.endswith(", planet 1") for text in places)
