"""Variables of frequency responses: steady states along curves over speed or torque."""

from __future__ import annotations

from flexgear.results.quantities import Quantity, S

_JUMP = "of a turning point beside which steady states are stable"

RESPONSE_QUANTITIES: dict[str, Quantity] = {
    "response_speed_share": Quantity((S,), "1", "speed over rated speed"),
    "response_torque_share": Quantity((S,), "1", "torques over rated torques"),
    "response_speed": Quantity((S,), "rad/s", "speed of the reference member"),
    "gear_mesh_frequency": Quantity((S,), "Hz", "frequency of the gear meshes of the stage"),
    "response_branch": Quantity((S,), "1", "number of the curve, from 1"),
    "stable": Quantity((S,), "1", "1: a small disturbance dies out, 0: it grows"),
    "multiplier_real": Quantity(
        (S,), "1", "Floquet multiplier of largest modulus over a gear-mesh period, real part"
    ),
    "multiplier_imag": Quantity((S,), "1", "its imaginary part"),
    "response_gear_mesh_force": Quantity(
        (S, "gear_mesh", "measure"), "N", "normal force, drive flank less coast flank"
    ),
    "response_gear_mesh_force_amplitude": Quantity(
        (S, "gear_mesh", "gear_mesh_order"), "N", "amplitude of the force by order"
    ),
    "response_transmission_error": Quantity(
        (S, "gear_mesh", "measure"),
        "m",
        "approach of both gears along the line of action, bodies' motion included: dynamic "
        "transmission error",
    ),
    "response_transmission_error_amplitude": Quantity(
        (S, "gear_mesh", "gear_mesh_order"), "m", "amplitude of the same by order"
    ),
    "response_bearing_force": Quantity(
        (S, "support", "measure"), "N", "radial force that a bearing or support carries"
    ),
    "response_bearing_force_amplitude": Quantity(
        (S, "support", "gear_mesh_order"), "N", "amplitude of the same by order"
    ),
    "lost_contact_share": Quantity(
        (S, "gear_mesh"), "1", "share of the period in which no pair of the drive flank touches"
    ),
    "back_contact_share": Quantity(
        (S, "gear_mesh"), "1", "share of the period in which the coast flank carries"
    ),
    "turning_point_parameter": Quantity(
        ("turning_point",), "1", f"speed or torque over the rated one {_JUMP}"
    ),
    "turning_point_force": Quantity(("turning_point",), "N", "largest gear-mesh force there"),
    "turning_point_sense": Quantity(
        ("turning_point",), "1", "1: a rising sweep jumps there, -1: a falling one"
    ),
    "turning_point_target_force": Quantity(
        ("turning_point",),
        "N",
        "largest gear-mesh force of the steady state to which it jumps",
        missing="where no stable steady state, or more than one, waits there",
    ),
    "stability_change_parameter": Quantity(
        ("stability_change",), "1", "speed or torque over the rated one where stability changes"
    ),
    "stability_change_kind": Quantity(
        ("stability_change",),
        "1",
        "0: turning point, multiplier +1; 1: doubled period, multiplier -1; 2: second frequency, "
        "a pair of complex multipliers",
    ),
}
