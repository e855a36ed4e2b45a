"""The brake at the output."""

from __future__ import annotations

from numba import njit

from flexgear.coupling.compiled import INNER

STICK = 1e-3  # share of rated speed below which a constant brake torque fades


@njit(**INNER)
def brake_line(brake_torque, brake_speed, exponent, speed):
    """Brake torque and its slope at an output speed: T = T_r sign(ω)|ω/ω_r|ⁿ.

    A constant torque (n = 0) fades linearly below a thousandth of the rated speed, so that it
    never drives a train at rest. Rated to stand still (ω_r = 0) it is what holds the train, T_r.
    """
    if brake_speed == 0.0:
        return brake_torque, 0.0
    if exponent == 1.0:
        slope = brake_torque / brake_speed
        return slope * speed, slope
    ratio = abs(speed) / brake_speed
    sign = 1.0 if speed >= 0.0 else -1.0
    if exponent == 0.0 and ratio < STICK:
        slope = brake_torque / (STICK * brake_speed)
        return slope * speed, slope
    torque = sign * brake_torque * ratio**exponent
    slope = 0.0
    if ratio != 0.0:
        slope = exponent * brake_torque / brake_speed * ratio ** (exponent - 1.0)
    return torque, slope
