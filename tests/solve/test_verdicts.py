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


def sharing(still: float | None, moving: float, assumed: float | None = 1.25) -> dict[str, Any]:
    """Load sharing in equilibria and in time."""
    return {
        "quasi_static": {
            "lumped": {"stage": {"stage ring": {**shared(0), "instantaneous": still}}}
        },
        "transient": {
            "lumped": {"stage ring": {"instantaneous": moving, "iec_61400_4": assumed}},
        },
    }


def test_load_sharing_is_held_to_the_standard():
    """Equilibria count, dynamics are beside them; variants of the case do not count."""
    said = found()["Load sharing, ring"]
    assert (said.level, said.figure) == ("good", "K = 1.210")
    for words in ("1.25", "IEC 61400-4", "1.230"):
        assert words in said.sentence
    assert found(load_sharing=sharing(1.26, 1.1))["Load sharing, ring"].level == "bad"
    assert found(load_sharing=sharing(1.24, 1.3))["Load sharing, ring"].level == "watch"
    assert found(load_sharing=sharing(None, 1.3))["Load sharing, ring"].level == "bad"
    none = found(load_sharing=sharing(None, 1.3, None))["Load sharing, ring"]
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
