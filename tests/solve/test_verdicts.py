"""What the first screen of a report says of a summary."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from flexgear.solve.verdicts import verdicts


def shared(k: float) -> dict[str, Any]:
    """Figures of a group of gear meshes of four planets."""
    return {"instantaneous": k, "iec_61400_4": 1.25}


WINDOW = {"window_s": [0.3, 5.0], "settled": True}
SUMMARY: dict[str, Any] = {
    "kind": "stage",
    "warnings": ["ring: static error 3 %, above 2 %"],
    "stages": {"stage": {"ring_gear_mesh_force_n": 788e3, "sun_gear_mesh_force_n": 788e3}},
    "load_sharing": {
        "quasi_static": {
            "flexible": {"stage": {"complete": True, "stage ring": shared(1.21)}},
            "rigid": {"stage": {"stage ring": shared(9.0)}},
        },
        "transient": {
            "flexible": {"stage ring": shared(1.23), **WINDOW},
            "rigid": {"stage ring": shared(1.15), **WINDOW},
        },
    },
    "kinematics": {"carrier_speed_rpm": 11.27, "sun_speed_rpm": 50.1},
    "steady": {
        "carrier_speed_rpm_mean": 11.27,
        "radial_harmonics_um": [3.0, 9.0, 0.1, 0.2, 0.1, 21.3, 0.1],
        "tooth_displacement_peak_um": {"x": 36.8, "y": 118.4, "z": 12.5},
        **WINDOW,
    },
    "transient": {
        **WINDOW,
        "gear_mesh_force": {"stage ring": {"min_n": 7e5, "mean_n": 788e3, "max_n": 8e5}},
        "displacement_um_max": {"stage.sun": 21.3, "stage.carrier": 3.0},
    },
    "reduction": {"ring": {"static_error": 0.03}, "carrier": {"static_error": 0.01}},
    "equilibrium_closure_max": 1e-12,
    "energy_residual": 0.002,
    "system": {
        "kept_modes": 102, "modes_limit_hz": 1329.0, "modes_band_hz": 500.0, "modes_estimate": 0.009
    },
    "harmonic": {"largest_difference": 2e-9},
}  # fmt: skip


def found(**changes: Any) -> dict[str, Any]:
    """Verdicts by subject, of the summary with parts in the place of its own."""
    return {v.subject: v for v in verdicts({**copy.deepcopy(SUMMARY), **changes})}


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
    said = found()["Load sharing"]
    assert (said.level, said.figure) == ("good", "K = 1.210 in equilibria, 1.230 in time")
    for words in ("Within the 1.25 that IEC 61400-4", "from 0.3 to 5 s, settled", "Vibration"):
        assert words in said.sentence
    assert found(load_sharing=sharing(1.26, 1.1))["Load sharing"].level == "bad"
    above = found(load_sharing=sharing(1.24, 1.3))["Load sharing"]
    assert (above.level, above.sentence[:15]) == ("watch", "In part above t")
    assert found(load_sharing=sharing(None, 1.3))["Load sharing"].level == "bad"
    none = found(load_sharing=sharing(None, 1.3, None))["Load sharing"]
    assert (none.level, "no value" in none.sentence) == ("note", True)


def test_equal_factors_in_equilibria_and_in_time_need_no_reason():
    said = found(load_sharing=sharing(1.0002, 1.0003))["Load sharing"]
    assert said.figure == "K = 1.0002 in equilibria, 1.0003 in time"
    assert "ibration" not in said.sentence
    assert "at the worst instant" in found()["Definition"].sentence


@pytest.mark.parametrize(
    ("mean", "level"), [(788e3, "good"), (-780.5e3, "good"), (760e3, "watch"), (700e3, "bad")]
)
def test_forces_are_held_to_the_power_flow(mean, level):
    force = {"stage ring": {"min_n": 0.9 * mean, "mean_n": mean, "max_n": 1.1 * mean}}
    transient = {**SUMMARY["transient"], "gear_mesh_force": force}
    said = found(transient=transient)["Mean gear-mesh forces"]
    assert said.level == level
    assert "from 0.3 to 5 s, settled." in said.sentence


def test_largest_values_name_their_window():
    """The settled part of a run, or all of it where it has not settled."""
    said = found()
    assert said["Largest distance from the axis"].sentence == "Sun, from 0.3 to 5 s, settled."
    assert said["Ring tooth"].sentence.endswith("along y, from 0.3 to 5 s, settled.")
    unsettled = {"window_s": [0.0, 5.0], "settled": False}
    whole = found(transient={**SUMMARY["transient"], **unsettled})
    assert whole["Largest distance from the axis"].sentence == "Sun, over all 5 s, not settled."


def test_checks_within_limits_are_one_line():
    said = found(reduction={"ring": {"static_error": 0.013}})
    assert said["Solution"].level == "good"
    assert said["Solution"].sentence == (
        "Speeds are those of the power flow; forces balance; reduced ring errs by 1.3 % in "
        "statics; 0.2 % of the energy is not accounted for; modes that are left out err by at most "
        "0.9 % up to 500 Hz; harmonic solution and transient differ by less than 0.01 % of the "
        "largest force."
    )
    assert not {"Equilibria", "Reduced ring", "Energy balance", "Modes kept"} & set(said)


def test_warnings_errors_and_what_bending_changes():
    said = found()
    assert said["Warning"].level == "watch"
    assert said["Reduced ring"].level == "watch"
    assert "reduced carrier errs by 1 % in statics" in said["Solution"].sentence
    assert said["Load sharing, rigid bodies"].figure == "K = 1.150 in time"
    assert said["Largest distance from the axis"].figure == "21.3 µm"
    assert said["Ring tooth"].figure == "118.4 µm"
    assert said["Ring shape"].figure == "21.3 µm" and "wave, 5 round" in said["Ring shape"].sentence
    assert found(equilibrium_closure_max=1e-3)["Equilibria"].level == "bad"
    assert found(energy_residual=0.2)["Energy balance"].level == "bad"
    assert "Energy balance" not in found(energy_residual=None)
    slow = {**SUMMARY["steady"], "carrier_speed_rpm_mean": 10.0}
    assert found(steady=slow)["Pins against ring"].level == "bad"
    system = {**SUMMARY["system"], "modes_estimate": None}
    assert found(system=system)["Modes kept"].level == "watch"


def test_what_is_left_out_stands_beside_its_figure_and_nowhere_else():
    text = "Ring shape, 21.3 µm: left out are planet rims that go oval (up to 111 µm)."
    beside = [{"figure": "Ring shape", "sentence": text}]
    said = found(neglected=beside, warnings=["something else", text])
    assert said["Ring shape"].level == "watch"
    assert said["Ring shape"].sentence.endswith(
        "equilibrium. Left out are planet rims that go oval (up to 111 µm)."
    )
    every = verdicts({**SUMMARY, "neglected": beside, "warnings": ["something else", text]})
    assert [v.sentence for v in every if v.subject == "Warning"] == ["something else"]
