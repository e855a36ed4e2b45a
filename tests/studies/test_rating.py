"""Ratings under load spectra: limits, invariances, hand calculations, through the public face."""

import math
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from flexgear.cli.compare_command import lines_of
from flexgear.gears.rating.pair import gear_pair
from flexgear.gears.rating.sheet import sheet_of, value_of
from flexgear.model.bearings import RollingElements
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case
from flexgear.model.load_cases import LoadCase
from flexgear.results.rating_files import rating_rows, rating_summary
from flexgear.results.report.study_tables import rating_tables, rating_verdicts
from flexgear.results.report.wording import words
from flexgear.solve import bin_loads
from flexgear.solve.bin_loads import dynamic_factors, groups_of, loads_in_bin
from flexgear.solve.model import assemble
from flexgear.studies import rating as study
from flexgear.studies import rating_gears
from flexgear.studies.compare import lives
from flexgear.studies.measures import chosen_measures, measured
from flexgear.studies.rating import rate
from flexgear.views.study_charts import damage_chart, safety_chart

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
    """No errors, weight or moments: cycle means of all planets are equal, K_γ = 1. K_v of method B
    has a remark where it exceeds 2, as it does at low load."""
    rating = _rated(("rated", 1000.0, 1.0), ("idle", 1000.0, 1e-4), **{"rating.gear_meshes": ()})
    for gear_mesh in rating.gear_meshes:
        k_gamma = gear_mesh.factors[0]["K_γ"]
        assert k_gamma.value == pytest.approx(1.0, abs=1e-9)
        assert k_gamma.source.startswith("computed")
        rated, idle = (sheet["K_v"] for sheet in gear_mesh.factors)
        assert rated.value < 2.0 < idle.value
        assert ["would part" in line.source for line in (rated, idle)] == [False, True]


def test_reversed_torque_loads_the_other_flanks():
    """A planet's flank that presses the sun under rated torque presses the ring when reversed."""
    case = _train().with_(
        load_cases=(
            *_cases(("drive", 1000.0, 1.0)),
            LoadCase(name="coast", hours=10.0, torque=-0.5 * RATED, back_driven=True),
        ),
        **FROZEN,
        **{"stages.stage_3.pinion.rating.mean_stress_ratio": 0.99},
    )
    rating = rate(case, workers=1)
    parts = {part.name: part for part in rating.parts}
    assert parts["stage_1.sun flank"].load[1] == 0.0
    assert parts["stage_1.sun coast flank"].load[0] == 0.0
    to_sun, to_ring = (parts[f"stage_1.planet flank to the {x}"].load for x in ("sun", "ring"))
    assert to_sun[0] == pytest.approx(parts["stage_1.sun flank"].load[0], rel=0.2)
    assert to_sun[1] == pytest.approx(to_ring[0] * math.sqrt(0.5), rel=1e-6)
    sheet = parts["stage_1.sun root"].factors[0]  # R = −1.2 · 0.5, ISO 6336-3, annex B
    mean = 0.8 - 0.15 * sheet["Y_S"].value
    expected = 1 / (1 + 0.6 * (1 - mean) / (1 + mean))
    assert sheet["Y_M"].value == pytest.approx(expected, rel=1e-5) and expected < 0.9
    assert sheet["R"].value == pytest.approx(-0.6) and "not counted" in sheet["R"].source
    rows = {row.label: row.value for row in rating_tables(rating, parts=False)[0].rows}
    of_root = [label for label, text in rows.items() if "senses, whose changes are not" in text]
    assert f"Y_M {expected:.3g} by" in rows["stage 1 sun root"]
    assert of_root and not any("planet" in label or "pinion" in label for label in of_root)
    free = parts["stage_3.pinion root"].factors[0]["Y_M"]
    assert (free.value, free.source) == (pytest.approx(1, abs=0.004), "key mean_stress_ratio")


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


def _dynamic(share=1.0, **changes):
    """K_v by group, from the motion of the train."""
    keys = {"rating.dynamic_factor": "train", "rating.limits": "none", **changes}
    of_share = LoadCase(name="a", hours=1.0, torque=share * RATED, back_driven=share < 0.0)
    rating = rate(_train().with_(load_cases=(of_share,), **keys), workers=1)
    factors = {g.name: g.factors[0]["K_v"] for g in rating.gear_meshes}
    assert all(f.source.startswith("computed") for f in factors.values())
    silent = "stages.stage_3.gear_mesh.model" not in changes  # a K_v of 1 is no verdict
    assert {p.holds for p in rating.parts if p.kind == "root"} == ({None} if silent else {True})
    assert ("stage_3 pinion, K_v" in rating.not_assessed) == silent
    assert all("; ISO 6336-1:2019 method B: 1." in f.source for f in factors.values())
    return {name: f.value for name, f in factors.items()}


def test_no_transient_is_computed_where_nothing_excites_or_keys_state_k_v(monkeypatch):
    """It would take minutes at low speed."""
    monkeypatch.setattr(bin_loads, "simulate", None)
    assert set(_dynamic().values()) == {1.0}
    varies = {"stages.stage_3.gear_mesh.model": "rectangular", "rating.dynamic_factor": "train"}
    load = LoadCase(name="a", hours=1.0, torque=RATED)
    stated = _train().with_(load_cases=(load,), **{**varies, "rating.k_v": 1.2})
    assert {g.factors[0]["K_v"].value for g in rate(stated, workers=1).gear_meshes} == {1.2}


def test_bolts_of_an_fe_ring_excite_a_train_whose_teeth_do_not():
    """Planets of the star pass 12 bolts at the frequency of the lowest mode."""
    keys = {"solver.fidelity": "quick", "stage.gear_mesh.model": "constant", "stage.errors": ""}
    case = load_case("star-ring", keys)
    model = assemble(case)
    groups = groups_of(model.gear_meshes.names, 1)
    mean = {group: float(model.mean_forces[at].max()) for group, at in groups.items()}
    assert all(1.03 < k_v < 1.1 for k_v in dynamic_factors(case, mean).values())


def test_dynamic_factor_of_the_train():
    """A stage whose stiffness jumps with the number of pairs vibrates, and those behind its long
    shafts hardly do."""
    waves = {"stages.stage_3.gear_mesh.model": "rectangular"}
    machines = {
        "drive": {"kind": "ramp", "times": (0.0, 1.0), "torques": (RATED, 3 * RATED)},
        "output.brake_torque": 2 * RATED / 97,
        "loads": (
            {"member": "stage_1.carrier", "times": (0.0, 1.0), "moments": ((0, 0, 0), (0, 0, 1e6))},
        ),
    }
    for share in (0.6, -0.6):  # what the case states for its own transients does not count
        expected = _dynamic(share, **waves)
        assert _dynamic(share, **waves, **machines) == pytest.approx(expected, rel=1e-6)
    waved = _dynamic(**waves)
    assert waved["stage_3 pinion"] > 1.2
    assert max(v for name, v in waved.items() if "stage_3" not in name) < 1.05


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
    missing = {of: why for of, _, quantity, why, *_ in rows if quantity == "not assessed"}
    assert {p.name for p in rating.parts if p.missing} | {"shafts"} <= missing.keys()
    assert missing["scuffing"] == summary["not_assessed"]["scuffing"]
    estimated = replace(rating.ranked[0], estimates={"static_rating": "by ISO 76"})
    (row,) = (r for r in rating_rows(replace(rating, parts=(estimated,))) if r[2] == "no verdict")
    assert row[0] == estimated.name and row[3] == "static_rating by ISO 76"
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


def test_pictures_of_parts_that_are_not_assessed_praise_nothing():
    rating = _frozen(("a", 5000.0, 1.0))

    def note(factor):
        parts = tuple(replace(p, damage=factor * p.damage) for p in rating.parts)
        figure = damage_chart(replace(rating, parts=parts).dataset())
        return [text.get_text() for text in figure.axes[0].texts]

    assert note(0.0) == ["No bin damages any part that is assessed"]
    assert note(np.nan) == ["No part is assessed"]


def test_equal_parts_are_one_row_that_names_the_worst():
    """Bearings of planets, alike and not; those that are not assessed, too. The chart of damage has
    their common name where they are alike."""
    rating = _frozen(("a", 5000.0, 1.0))

    def rows(parts):
        changed = replace(rating, parts=tuple(parts))
        tables = rating_tables(changed)
        first = {row.label: row.value for row in tables[0].rows}
        folded = [t for t in tables if t.folded and t.section == "rating"]
        return first, {t.title: len(t.rows) for t in folded}, rating_verdicts(changed)

    def labels(parts):
        (legend,) = damage_chart(replace(rating, parts=tuple(parts)).dataset()).legends
        return [text.get_text() for text in legend.get_texts()]

    first, folded, _ = rows(rating.parts)
    assert "3 planets alike" in first["stage 1 planet bearings"]
    assert any(x.startswith("stage 1 planet bearings: ") for x in labels(rating.parts))
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
    changed = (worse.get(p.name, lambda p: p)(p) for p in rating.parts)
    assert any(x.startswith("stage 1 planet bearing 2: ") for x in labels(changed))
    assert "3 planets, worst is planet 3; " in first["stage 1 planet root to the sun"]
    changed = replace(rating, parts=tuple(worse.get(p.name, lambda p: p)(p) for p in rating.parts))
    lines = lines_of(changed, rating)
    assert not any(name.startswith("stage_1.planet_bearing_") for name in lines)
    assert lines["stage_1.planet_bearings"].startswith(
        "3 planets, worst is planet 2 against 3 planets alike; load reserve "
    )
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
    rating = rate(case, workers=1)
    both = lives(rating, rating)
    for figures in both.values():
        assert figures["load_reserve"] == figures["reference_load_reserve"]
        assert figures.get("life_ratio", 1.0) == 1.0


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


def test_a_part_within_its_limits_has_no_verdict_where_computed_stress_is_above_them():
    """Nor has its stage, whichever part of it is the weakest by the standard."""
    rating = _frozen(("a", 50000.0, 0.5))
    before = {v.subject: v for v in rating_verdicts(rating)}["Tooth bending, stage 1"]
    roots = [p for p in rating.ranked if (p.stage, p.kind) == ("stage_1", "root")]
    safe = roots[-1].required + 0.01
    assert before.level == "good" and all(p.holds for p in roots)
    for part in (roots[0], roots[-1]):
        for direct, level in ((safe, "good"), (safe - 0.02, "watch")):
            other = replace(part, direct=sheet_of({"S_direct": direct, "σ_direct/σ": 1.0}))
            parts = tuple(other if p is part else p for p in rating.parts)
            doubtful = replace(rating, parts=parts)
            verdict = {v.subject: v for v in rating_verdicts(doubtful)}["Tooth bending, stage 1"]
            assert verdict.level == level and other.holds is (True if level == "good" else None)
            assert (f"ISO 6336: {words(part.alike)} {direct:.3g}" in verdict.sentence) is (
                level == "watch"
            )
            rows = {row.label: row.value for row in rating_tables(doubtful, parts=False)[0].rows}
            assert f"{direct:.3g} by the direct path" in str(rows[words(part.alike)])
    # a part outside limits is told behind a weaker one without a verdict
    poor = {p.name: replace(p, required=20.0) for p in roots}
    poor[roots[0].name] = replace(poor[roots[0].name], estimates={"something": "guessed"})
    failing = replace(rating, parts=tuple(poor.get(p.name, p) for p in rating.parts))
    verdict = {v.subject: v for v in rating_verdicts(failing)}["Tooth bending, stage 1"]
    assert verdict.level == "bad" and "no verdict: something" in verdict.sentence
    assert f"{words(roots[1].alike)} S_F " in verdict.sentence.partition("Outside limits: ")[2]


def test_a_thin_fe_rim_that_nothing_counts_leaves_no_verdict(monkeypatch):
    """Y_B is 1 of flexible FE bodies, whose bending the direct path has, if it is computed."""

    def of_thin_ring(*stage):
        pair = gear_pair(*stage)
        gears = {n: replace(g, rim_left_out=n == "ring") for n, g in pair.gears.items()}
        return replace(pair, gears=gears)

    monkeypatch.setattr(rating_gears, "gear_pair", of_thin_ring)
    rating = rate(_train().with_(load_cases=_cases(("a", 50000.0, 0.5)), **FROZEN), workers=1)
    parts = {p.name: p for p in rating.parts}
    root, flank = (parts[f"stage_1.ring {kind}"] for kind in ("root", "flank"))
    assert root.holds is None and root.reserve > 1.0 and flank.holds
    assert 'root_stress = "fe"' in rating.not_assessed["stage_1.ring root, bending of the rim"]
    weak = rating.case.with_(**{"stages.stage_1.ring.rating.root_strength": 3e7})
    failing = rate(weak, workers=1)
    assert {p.name: p for p in failing.parts}[root.name].holds is False


def test_extreme_loads_damage_nothing_and_count_for_safety():
    """By their own least safeties and load factors, where the case states some."""
    extreme = LoadCase(name="x", extreme=True, torque=4 * RATED)
    case = _train().with_(load_cases=(*_cases(("a", 1000.0, 1.0)), extreme), **FROZEN)
    with_it, without = rate(case, workers=1), _frozen(("a", 1000.0, 1.0))
    assert _damages(with_it) == pytest.approx(_damages(without), rel=1e-12)
    for part, other in zip(with_it.parts, without.parts, strict=True):
        assert part.missing == other.missing
        assert part.missing or part.least_safety <= other.least_safety
        assert part.governing_bin in (None, 1)
    of_ring = {"stage": "stage_1", "kind": "ring"}
    factors = ({**of_ring, "k_h_beta": 1.5, "application_factor": 1.1},)
    other = LoadCase(name="x", extreme=True, torque=4 * RATED, k_v=1.2, gear_meshes=factors)
    limited = rate(
        case.with_(
            load_cases=(*_cases(("a", 1000.0, 1.0)), other),
            **{"rating.least_static_flank_safety": 0.9, "rating.least_static_root_safety": 1.0},
        ),
        workers=1,
    )
    limits = {"flank": (1.25, 0.9, 0.5), "root": (1.56, 1.0, 1.0)}
    for part, before in zip(limited.parts, with_it.parts, strict=True):
        if part.missing or part.kind == "bearing":
            continue
        lasting, static, power = limits[part.kind]
        ratio = 1.2 / 1.05  # K_v
        if part.stage == "stage_1" and re.search(r"\.ring |ring$", part.name):
            ratio *= 1.1 * (1.5 / 1.2 if part.kind == "flank" else 1.0)  # K_A, K_Hβ
        assert part.load[1] / before.load[1] == pytest.approx(ratio**power, rel=1e-9)
        assert part.load[0] == before.load[0] and part.required == lasting
        shares = part.whole_safety / lasting, part.safety[1] / static
        assert part.reserve == pytest.approx(min(shares) ** (1 / power), rel=1e-9)
        assert part.limit == (static if shares[1] < shares[0] else lasting)
        assert value_of(part.factors[1], f"S_{'H' if part.kind == 'flank' else 'F'}min") == static
    extremes = next(v for v in rating_verdicts(limited) if v.subject == "Extreme loads")
    assert extremes.figure.endswith((" of 0.9", " of 1"))
