"""What the first screen of a report says of a summary."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from flexgear.solve.verdicts import verdicts


def shared(k: float) -> dict[str, Any]:
    """Figures of a group of gear meshes of four planets."""
    return {"instantaneous": k, "iec_61400_4": 1.25}


SUMMARY: dict[str, Any] = {
    "kind": "stage",
    "warnings": ["ring: static error 3 %, above 2 %"],
    "stages": {"stage": {"ring_gear_mesh_force_n": 788e3, "sun_gear_mesh_force_n": 788e3}},
    "load_sharing": {
        "quasi_static": {
            "flexible": {"stage": {"complete": True, "stage ring": shared(1.21)}},
            "rigid": {"stage": {"stage ring": shared(9.0)}},
        },
        "transient": {"flexible": {"stage ring": shared(1.23)}},
    },
    "kinematics": {"carrier_speed_rpm": 11.27},
    "steady": {
        "carrier_speed_rpm_mean": 11.27,
        "tooth_displacement_peak_um": {"x": 36.8, "y": 118.4, "z": 12.5},
        "load_sharing": {"flexible": {"mean": 1.02}, "rigid": {"mean": 1.0}},
    },
    "transient": {
        "gear_mesh_force": {"stage ring": {"min_n": 7e5, "mean_n": 788e3, "max_n": 8e5}},
        "displacement_um_max": {"stage.sun": 21.3, "stage.carrier": 3.0},
    },
    "reduction": {"ring": {"static_error": 0.03}, "carrier": {"static_error": 0.01}},
    "equilibrium_closure_max": 1e-12,
    "energy_residual": 0.002,
}  # fmt: skip


def found(**changes: Any) -> dict[str, Any]:
    """Verdicts by subject, of the summary with parts in the place of its own."""
    return {v.subject: v for v in verdicts({**copy.deepcopy(SUMMARY), **changes})}


def test_load_sharing_is_held_to_the_standard():
    """The largest of the case as it is, whichever analysis it comes from; variants do not count."""
    said = found()["Load sharing, ring"]
    assert (said.level, said.figure) == ("good", "K = 1.230")
    assert "1.25" in said.sentence
    assert "IEC 61400-4" in said.sentence
    worse = copy.deepcopy(SUMMARY["load_sharing"])
    worse["transient"]["flexible"]["stage ring"]["instantaneous"] = 1.26
    assert found(load_sharing=worse)["Load sharing, ring"].level == "bad"
    worse["transient"]["flexible"]["stage ring"]["iec_61400_4"] = None
    none = found(load_sharing=worse)["Load sharing, ring"]
    assert (none.level, "no value" in none.sentence) == ("note", True)


@pytest.mark.parametrize(
    ("mean", "level"), [(788e3, "good"), (-780.5e3, "good"), (760e3, "watch"), (700e3, "bad")]
)
def test_forces_are_held_to_the_power_flow(mean, level):
    force = {"stage ring": {"mean_n": mean}}
    transient = {**SUMMARY["transient"], "gear_mesh_force": force}
    assert found(transient=transient)["Mean gear-mesh force, ring"].level == level


def test_warnings_errors_and_what_bending_changes():
    said = found()
    assert said["Warning"].level == "watch"
    assert (said["Reduced ring"].level, said["Reduced carrier"].level) == ("watch", "good")
    assert said["Flexible beside rigid"].figure == "+2.00 %"
    assert said["Largest way off the axis"].figure == "21.3 µm"
    assert said["Ring tooth"].figure == "118.4 µm"
    assert said["Carrier speed"].level == "good"
    assert found(equilibrium_closure_max=1e-3)["Equilibria"].level == "bad"
    assert found(energy_residual=0.2)["Energy account"].level == "bad"
    assert "Energy account" not in found(energy_residual=None)
