"""What the first screen of a report says of a summary; stresses and lives beside their limits."""

import copy
import re
from typing import Any

import pytest
from summary_samples import CASE, DROP, FLOW, SUMMARY, WINDOW, shared
from trains import spur_pair, write

from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.load import load_case
from flexgear.results.report.parts import Verdict
from flexgear.solve.headlines import HEADLINES, headlines, verdicts
from flexgear.solve.run import run


def verdicts_of(case: Case, summary: dict[str, Any]) -> list[Verdict]:
    """Verdicts on a summary, with the headlines that a run would give it."""
    flow = power_flow(case)
    return verdicts(case, {**summary, "headlines": headlines(case, flow, summary)})


def by_subject(**changes: Any) -> dict[str, Any]:
    """Verdicts by subject, of the summary with parts in the place of its own."""
    return {v.subject: v for v in verdicts_of(CASE, {**copy.deepcopy(SUMMARY), **changes})}


def solution(**changes: Any) -> dict[str, Any]:
    """Levels of checks outside limits, by the beginning of their figures."""
    summary = {**copy.deepcopy(SUMMARY), **changes}
    rows = [r for r in headlines(CASE, FLOW, summary) if r["name"] == "solution"]
    return {row["figure"].partition(":")[0]: row["level"] for row in rows}


def sharing(still: float | None, moving: float, assumed: float | None = 1.25) -> dict[str, Any]:
    """Load sharing in equilibria and in time."""
    return {
        "quasi_static": {
            "lumped": {"stage": {"stage ring": {**shared(0), "instantaneous": still}}}
        },
        "transient": {
            "lumped": {"stage ring": {"instantaneous": moving, "iec_61400_4": assumed}, **WINDOW},
        },
    }


def test_load_sharing_is_held_to_the_standard():
    """Equilibria count, dynamics are beside them; variants of the case do not count."""
    verdict = by_subject()["Load sharing"]
    assert (verdict.level, verdict.figure) == ("good", "K = 1.210 in equilibria, 1.230 in time")
    for words in ("Within the 1.25 that IEC 61400-4", "from 0.3 to 5 s, settled", "Vibration"):
        assert words in verdict.sentence
    assert by_subject(load_sharing=sharing(1.26, 1.1))["Load sharing"].level == "bad"
    above = by_subject(load_sharing=sharing(1.24, 1.3))["Load sharing"]
    assert (above.level, above.sentence[:15]) == ("watch", "In part above t")
    assert by_subject(load_sharing=sharing(None, 1.3))["Load sharing"].level == "bad"
    none = by_subject(load_sharing=sharing(None, 1.3, None))["Load sharing"]
    assert (none.level, "no value" in none.sentence) == ("note", True)


def test_equal_factors_in_equilibria_and_in_time_need_no_reason():
    verdict = by_subject(load_sharing=sharing(1.0002, 1.0003))["Load sharing"]
    assert verdict.figure == "K = 1.0002 in equilibria, 1.0003 in time"
    assert "ibration" not in verdict.sentence


def test_an_even_share_without_errors_is_no_praise():
    nearly = sharing(1.01, 1.02)
    assert by_subject(load_sharing=nearly)["Load sharing"].level == "good"
    without = by_subject(load_sharing=nearly, errors_given=False)["Load sharing"]
    assert without.level == "note" and "No errors given" in without.sentence
    even = by_subject(load_sharing=sharing(1.0, 1.0))["Load sharing"]
    assert even.level == "note" and "the case has no errors that differ" in even.sentence
    vibrates = by_subject(load_sharing=sharing(1.00001, 1.0006))["Load sharing"]
    assert vibrates.level == "note" and "Apart from vibration" in vibrates.sentence
    assert (
        by_subject(load_sharing=sharing(1.3, 1.3), errors_given=False)["Load sharing"].level
        == "bad"
    )


def test_a_factor_that_is_missing_in_time_has_its_reason():
    """As where flanks part at a resonance."""
    parted = {
        "quasi_static": {"lumped": {"stage": {"stage ring": shared(1.02)}}},
        "transient": {"lumped": {"stage ring": {**shared(1.0), "instantaneous": None}, **WINDOW}},
    }
    verdict = by_subject(load_sharing=parted)["Load sharing"]
    assert verdict.figure == "K = 1.020 in equilibria"
    assert "settled: the planets carry no load at times." in verdict.sentence


@pytest.mark.parametrize(
    ("start", "words"), [(0.3, "1.200 in time."), (0.5, "time from 0.5 to 1 s,")]
)
def test_a_factor_of_rigid_bodies_has_its_window_where_it_is_another(start, words):
    alike = {"quasi_static": {}, "transient": {
        name: {"stage ring": shared(k), **WINDOW, "window_s": [begin, 1.0]}
        for name, k, begin in (("flexible", 1.02, 0.3), ("rigid", 1.2, start))
    }}  # fmt: skip
    sentence = by_subject(load_sharing=alike)["Load sharing"].sentence
    assert words in sentence[sentence.index("With rigid bodies K") :]


def test_both_halves_of_a_double_helical_stage_are_looked_at():
    halves = {"stage ring left": shared(1.02), "stage ring right": shared(1.31)}
    both = {
        "quasi_static": {"lumped": {"stage": halves}},
        "transient": {"lumped": {**halves, **WINDOW}},
    }
    verdict = by_subject(load_sharing=both)["Load sharing"]
    assert verdict.level == "bad" and verdict.figure.startswith("K = 1.310")
    assert "K within each half: left half 1.020, right half 1.310." in verdict.sentence


def test_the_power_flow_gives_the_sum_of_both_halves_not_their_shares():
    """Halves that carry 62 % and 38 % of the rated force are a fact of load sharing, no fault of
    the solution; a sum that differs from the power flow is one."""
    force = {
        f"stage {kind} {side}": {"min_n": x * 788e3, "mean_n": x * 788e3, "max_n": x * 788e3}
        for kind in ("sun", "ring")
        for side, x in (("left", 1.24), ("right", 0.76))
    }
    running = {**SUMMARY["transient"], "gear_mesh_force": force}
    assert "Mean gear-mesh force" not in solution(transient=running)
    halves = {"stage ring left": shared(1.0), "stage ring right": shared(1.0)}
    both = {
        "quasi_static": {"lumped": {"stage": halves}},
        "transient": {"lumped": {**halves, **WINDOW}},
    }
    sentence = by_subject(load_sharing=both, transient=running)["Load sharing"].sentence
    assert "The left half carries 62 % of the load at the" in sentence
    force["stage sun left"] = {"min_n": 9e5, "mean_n": 1.4 * 788e3, "max_n": 1e6}
    wrong = {**SUMMARY["transient"], "gear_mesh_force": force}
    assert solution(transient=wrong)["Mean gear-mesh force"] == "bad"


def test_the_largest_force_is_that_of_all_transients():
    steady = by_subject()["Largest gear-mesh force"]
    assert (steady.level, steady.figure) == ("note", "1.015 × nominal")  # 800 over 788 kN
    rigid = {**DROP, "gear_mesh_force": {"stage ring": {"min_n": 0, "mean_n": 1, "max_n": 9e9}}}
    drops = {"0.2e6": {"flexible": DROP, "rigid": rigid}}  # variants of the case do not count
    verdict = by_subject(torque_steps=drops)["Largest gear-mesh force"]
    assert (verdict.level, verdict.figure) == ("watch", "1.523 × nominal")  # above 1.25
    for words in ("1.2 MN at ring, in the torque drop to 200 kN m", "1.015 × in time from 0.3"):
        assert words in verdict.sentence
    assert "leaves 1.218 to K_A and K_v" in verdict.sentence  # 1.523/1.25
    assert "K = 1.260 in the torque drop" in by_subject(torque_steps=drops)["Load sharing"].sentence
    assert by_subject(torque_steps=drops)["Load sharing"].level == "watch"


def test_what_excites_gear_meshes_is_named_beside_the_peak():
    def sentence(*relieved: str, **options: Any) -> str:
        relief = {"amount": 2e-5, "length": 2e-3}
        changes = {f"stages.stage.{part}.modifications.tip_relief": relief for part in relieved}
        changes |= {f"stages.stage.{k.replace('__', '.')}": v for k, v in options.items()}
        case = CASE.with_(**changes)
        lines = verdicts_of(case, copy.deepcopy(SUMMARY))
        return next(v.sentence for v in lines if v.subject == "Largest gear-mesh force")

    spur = {"helix_angle": 0.0}
    assert "(planet, sun, ring) take up load at once" in sentence(**spur)
    assert "(planet, ring) take up load at once" in sentence("sun", **spur)
    assert "slices along the face" in sentence(**spur)
    assert "_" not in sentence(**spur)  # words of the reader, no keys of the file
    assert "at once" not in sentence("sun", "planet", "ring", **spur)
    assert "at once" not in sentence()  # helical
    assert "at once" not in sentence(**spur, gear_mesh__model="face_load")
    constant = sentence(**spur, gear_mesh__model="constant")
    assert "is constant in this model, so that" in constant
    assert "each tooth pair (key per_pair) computes it." in constant
    assert "is constant" not in sentence(**spur) + sentence()


def test_a_force_that_passes_zero_is_said():
    parts = {"stage ring": {"min_n": -1e3, "mean_n": 788e3, "max_n": 8e5}}
    answers = by_subject(transient={**SUMMARY["transient"], "gear_mesh_force": parts})
    assert answers["Largest gear-mesh force"].level == "watch"
    assert "passes zero: flanks part" in answers["Largest gear-mesh force"].sentence
    linear = CASE.with_(**{"stages.stage.gear_mesh.contact_law": "linear"})
    summary = SUMMARY | {"transient": {**SUMMARY["transient"], "gear_mesh_force": parts}}
    (verdict,) = [v for v in verdicts_of(linear, summary) if v.subject == "Largest gear-mesh force"]
    assert "passes zero: teeth pull" in verdict.sentence


def test_a_pair_of_gears_is_said_to_have_no_planets_and_no_sun(tmp_path):
    text = spur_pair(gear_mesh='model = "per_pair"', speed=100)
    result = run(load_case(write(tmp_path, text), {"solver.duration_s": "0.05"}))
    by_name = {row["name"]: row for row in result.summary["headlines"]}
    assert "load_sharing" not in by_name
    words = " ".join(row["sentence"] for row in by_name.values()).lower()
    assert not re.search(r"\bsun\b|\bplanets? share|equal planets", words)


def test_what_the_case_does_not_rate_is_not_assessed():
    answers = by_subject()
    for subject in ("Root stress", "Flank pressure", "Bearing life"):
        assert answers[subject].level == "open" and "Not assessed" in answers[subject].sentence
        assert "flexgear rate" not in answers[subject].sentence
    assert answers["Root stress"].figure == "243 MPa"
    assert answers["Bearing life"].figure == "no rating given"
    assert "planet bearing (1.469 MN)" in answers["Bearing life"].sentence


def test_stresses_of_gears_with_steels_are_assessed_by_rate():
    steel = {"stage.planet.rating.steel": "case_hardened"}
    answers = {
        v.subject: v for v in verdicts_of(load_case("wind-5mw", steel), copy.deepcopy(SUMMARY))
    }
    for subject in ("Root stress", "Flank pressure"):
        assert answers[subject].sentence.endswith("`flexgear rate` assesses it by the steels.")


def test_the_shortest_life_is_the_headline():
    stage = {**SUMMARY["stages"]["stage"], "nominal_planet_bearing_life_h": 90000.0}
    stage["bearing_life_h"] = {"planet_bearing_1": 9e4, "carrier_bearing_drive": 7e4}
    verdict = by_subject(stages={"stage": stage})["Bearing life"]
    assert verdict.level == "note" and verdict.figure.startswith("70")
    assert "Carrier bearing drive, under the constant load" in verdict.sentence


def test_deflections_are_held_to_what_is_small():
    """A tenth of the module of 18 mm."""
    assert by_subject()["Deflections"].level == "good"
    assert by_subject(motion_um_max={"stage.sun": 1e-9})["Deflections"].figure == "0 of 1.8 mm"
    verdict = by_subject(motion_um_max={"stage.sun": 1900.0})["Deflections"]
    assert (verdict.level, verdict.figure) == ("bad", "1.9 mm of 1.8 mm")
    assert (
        "106 % of the limit for small displacements beside the module of 18 mm" in verdict.sentence
    )


@pytest.mark.parametrize(
    ("mean", "level"), [(788e3, None), (-780.5e3, None), (760e3, "watch"), (700e3, "bad")]
)
def test_forces_are_held_to_the_power_flow(mean, level):
    force = {"stage ring": {"min_n": 0.9 * mean, "mean_n": mean, "max_n": 1.1 * mean}}
    transient = {**SUMMARY["transient"], "gear_mesh_force": force}
    assert solution(transient=transient).get("Mean gear-mesh force") == level


def test_checks_within_limits_are_one_line():
    answers = by_subject(reduction={"ring": {"static_error": 0.013}})
    assert answers["Solution"].level == "good"
    assert answers["Solution"].sentence == (
        "Mean forces agree with the power flow; speeds agree with the power flow; forces "
        "balance; static error of the reduced ring 1.3 %; energy balance closes within 0.2 %; "
        "error of the modal truncation at most 0.9 % up to 500 Hz."
    )
    assert solution(reduction={}) == {"checks within limits": "good"}


def test_checks_outside_limits_stand_alone():
    assert solution()["Reduced ring"] == "watch"
    assert solution(equilibrium_closure_max=1e-3)["Equilibria"] == "bad"
    assert solution(energy_residual=0.2)["Energy balance"] == "bad"
    assert "Energy balance" not in solution(energy_residual=None)
    slow = {**SUMMARY["steady"]["stage"], "carrier_speed_rpm_mean": 10.0}
    assert solution(steady={"stage": slow})["Pins against ring"] == "bad"
    system = {**SUMMARY["system"], "modes_estimate": None}
    assert solution(system=system)["Modes kept"] == "watch"


def test_the_worst_comes_first_and_warnings_before_what_needs_no_attention():
    summary = {**SUMMARY, "equilibrium_closure_max": 1e-3, "load_sharing": sharing(1.24, 1.3)}
    every = verdicts_of(CASE, summary)
    levels = [v.level for v in every if v.subject != "Warning"]
    assert levels[:2] == ["bad", "watch"]
    count = levels.count("bad") + levels.count("watch")
    assert set(levels[count:]) <= {"open", "note", "good"}
    assert every[count].subject == "Warning" and every[count].sentence == "time steps are long"
    assert every[count + 1 :] and "Warning" not in {v.subject for v in every[count + 1 :]}
    (ring,) = [v for v in every if "static error 3 %" in v.sentence]  # once, and with its place
    assert (ring.figure, ring.level) == ("Reduced ring: 3 %", "watch")


def test_neglected_effects_are_one_answer():
    text = "Ring shape, 21.3 µm: the model neglects ovalising planet rims (up to 111 µm)."
    row = {"figure": "Ring shape", "stage": "stage", "value_um": 21.3, "effects_um": {"rim": 111.0}}
    answers = by_subject(neglected=[{**row, "sentence": text}], warnings=["something else"])
    assert answers["Neglected effects"].level == "watch"
    assert answers["Neglected effects"].figure == "up to 111 µm"
    assert "Ovalising planet rims up to 111 µm" in answers["Neglected effects"].sentence
    assert "ring shape 21.3 µm" in answers["Neglected effects"].sentence
    assert answers["Warning"].sentence == "something else"
    assert by_subject()["Neglected effects"].level == "good"


def test_uneven_load_along_the_face_is_on_the_first_screen():
    """A face that carries in its middle only has no load at its ends that could warn."""
    for factor, level in ((1.42, "note"), (12.75, "watch")):
        flanks = {
            "stage ring 1 drive": {"k_h_beta": 1.1},
            "stage sun 2 drive": {"k_h_beta": factor},
        }
        answer = by_subject(face_load={"flexible": flanks, "rigid": {}})["Load along the face"]
        assert (answer.level, answer.figure) == (level, f"K_Hβ = {factor:.3f}")
        assert "at sun 2 drive" in answer.sentence
        assert ("flexgear modify" in answer.sentence) == (level == "watch")


def test_every_headline_has_an_answer_or_its_data_are_missing():
    names = {row["name"] for row in headlines(CASE, FLOW, SUMMARY)}
    silent = {h.name for h in HEADLINES} - names
    assert silent == {"face_load", "transmission_error", "faults"}  # this summary has none


def test_the_worst_stage_is_in_front_and_the_others_beside_it():
    """A stage whose planets have a value of the standard beside one that has none."""
    case = load_case("grc-750kw")
    stages = ("lss", "iss", "hss")
    stage_figures = {
        stage: {"sun_gear_mesh_force_n": 1e5, "ring_gear_mesh_force_n": 1e5} for stage in stages
    }
    largest = {"lss": 1.02e5, "iss": 1.01e5, "hss": 1.005e5}
    forces = {
        f"{stage} sun": {"min_n": 9e4, "mean_n": 1e5, "max_n": size}
        for stage, size in largest.items()
    }
    group = {"lss ring": {"instantaneous": 1.005, "iec_61400_4": 1.1}}
    summary = {
        **copy.deepcopy(SUMMARY),
        "stages": stage_figures,
        "transient": {**WINDOW, "gear_mesh_force": forces, "displacement_um_max": {}},
        "load_sharing": {"quasi_static": {}, "transient": {"flexible": {**group, **WINDOW}}},
        "steady": {},
    }
    lines = verdicts_of(case, summary)
    first = next(v for v in lines if v.subject.startswith("Largest gear-mesh force"))
    assert (first.subject, first.figure) == ("Largest gear-mesh force, lss", "1.020 × nominal")
    assert "Iss: 1.010 × nominal." in first.sentence
    assert "Hss: 1.0050 × nominal." in first.sentence
