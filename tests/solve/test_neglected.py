"""What is left out stands beside every figure that is not ten times as large."""

import math

import pytest

from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.model.names import BodyName
from flexgear.results.report.wording import with_unit
from flexgear.solve.result_warnings import Length, beside_lengths, neglected

CASE = load_case("wind-5mw")
FLOW = power_flow(CASE)
RIM, PIN = 125.57e-6, 18.99e-6  # m, as `flexgear check` says


def sentences(value, share=1.0, stage="stage"):
    one = Length("Ring shape", stage, value, "")
    return list(beside_lengths(CASE, FLOW, [one], share))


@pytest.mark.parametrize(
    ("value", "effects"),
    [
        (33e-6, ["rim", "pin"]),
        (9.9 * PIN, ["rim", "pin"]),
        (10.1 * PIN, ["rim"]),
        (9.9 * RIM, ["rim"]),
        (10.1 * RIM, []),
    ],
)
def test_a_tenth_of_a_figure_is_worth_a_sentence(value, effects):
    found = sentences(value)
    assert [list(one["effects_um"]) for one in found] == ([effects] if effects else [])
    for one in found:
        beside = f"{with_unit(value, 'm')}: the model neglects ovalising planet rims (up to 126 µm)"
        assert beside in one["sentence"]


def test_effects_grow_with_the_torque_and_are_those_of_the_stage():
    value = 9.9 * RIM
    assert not sentences(value, 0.5)
    half = sentences(0.5 * value, 0.5)[0]["effects_um"]["rim"]
    assert half == pytest.approx(0.5e6 * RIM, rel=1e-3)
    assert not sentences(value, stage="another")


def summary(k, far):
    """Of a run, with one K and one distance, µm."""
    group = {"instantaneous": k, "iec_61400_4": 1.35}
    return {
        "load_sharing": {
            "quasi_static": {"flexible": {"stage": {"stage ring": group}}},
            "transient": {"flexible": {"stage ring": group, "window_s": [0, 1], "settled": True}},
        },
        "transient": {"displacement_um_max": {"stage.sun": far}, "window_s": [0, 1]},
    }


def test_softer_paths_stand_beside_load_sharing():
    """Rim and pin add c = δ/F to 1/k of both gear meshes: 2 × 125.6 + 2 × 19 cos 20.2° µm to
    788 kN (1/7.96 + 1/10.8) mm/GN."""
    (far, sharing) = neglected(CASE, FLOW, summary(1.02, 14.4))
    assert far["sentence"].startswith(
        "Largest displacement from the axis, 14.4 µm: the model neglects"
    )
    teeth = 788.28e3 * (1 / 7.955e9 + 1 / 10.79e9)
    more = 2 * RIM + 2 * PIN * math.cos(math.radians(20.1587))
    assert (
        f"deflect by {1e6 * teeth:.3g} µm; these effects add up to {1e6 * more:.3g} µm"
        in (sharing["sentence"])
    )
    assert (sharing["figure"], sharing["load_sharing"]) == ("Load sharing", 1.02)


def test_an_even_share_and_a_large_figure_need_no_word():
    assert neglected(CASE, FLOW, summary(1.0002, 2000.0)) == []
    assert neglected(CASE, FLOW, summary(1.0002, 0.0)) == []


def test_rims_of_fe_planets_are_neglected_where_they_are_rigid():
    case = CASE.with_(**{"stage.planet.fe.tie": "root"})
    shape = [Length("Ring shape", "stage", 33e-6, "")]
    (flexible,) = beside_lengths(case, FLOW, shape)
    (rigid,) = beside_lengths(case, FLOW, shape, rigid={BodyName.of("stage", "planet")})
    assert list(flexible["effects_um"]) == ["pin"] and list(rigid["effects_um"]) == ["rim", "pin"]
