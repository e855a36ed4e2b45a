"""Summary of a run of the bundled stage, as headlines read it."""

from typing import Any

from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case


def shared(k: float) -> dict[str, Any]:
    """Figures of a group of gear meshes of four planets."""
    return {"instantaneous": k, "iec_61400_4": 1.25}


WINDOW = {"window_s": [0.3, 5.0], "settled": True}
CASE = load_case("wind-5mw")
FLOW = power_flow(CASE)
SUMMARY: dict[str, Any] = {
    "warnings": ["stage.ring: static error 3 %, above 2 %", "time steps are long"],
    "stages": {
        "stage": {
            "ring_gear_mesh_force_n": 788e3,
            "sun_gear_mesh_force_n": 788e3,
            "nominal_root_stress_mpa": {"sun": 243.0, "ring": 206.0},
            "planet_bearing_force_n": 1469e3,
            "pin_speed_rpm": 11.27,
        }
    },
    "torque_steps": {},
    "errors_given": True,
    "equilibrium_window": "one turn of the carrier",
    "motion_um_max": {"stage.sun": 21.3, "stage.carrier": 3.0},
    "resonance": {
        "met": [], "margin": 0.1, "speed_factors": [1.0], "orders": {}, "unknown_spectrum": []
    },
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
    "steady": {"stage": {
        "carrier_speed_rpm_mean": 11.27,
        "radial_harmonics_um": [3.0, 9.0, 0.1, 0.2, 0.1, 21.3, 0.1],
        "tooth_displacement_peak_um": {"x": 36.8, "y": 118.4, "z": 12.5},
    }},
    "transient": {
        **WINDOW,
        "gear_mesh_force": {"stage ring": {"min_n": 7e5, "mean_n": 788e3, "max_n": 8e5}},
        "displacement_um_max": {"stage.sun": 21.3, "stage.carrier": 3.0},
    },
    "reduction": {"stage.ring": {"static_error": 0.03}, "stage.carrier": {"static_error": 0.01}},
    "equilibrium_closure_max": 1e-12,
    "energy_residual": 0.002,
    "system": {
        "kept_modes": 102, "modes_limit_hz": 1329.0, "modes_band_hz": 500.0, "modes_estimate": 0.009
    },
}  # fmt: skip


DROP = {
    "gear_mesh_force": {"stage ring": {"min_n": 7e4, "mean_n": 6.7e5, "max_n": 1.2e6}},
    "load_sharing": {"stage ring": 1.26},
    **WINDOW,
}


DROPS = {"torque_steps": {"0.2e6": {"flexible": DROP}}}
