"""Errors that all pairs of a gear mesh share, and their rates.

At the angles θ (A,) the flanks of a gear mesh stand out by

    e = e₀ + Σ_h A_h sin(r_h θ_h + φ_h) + A sin(2π s/p_bt + φ),    s = s0 + (ds/dθ) θ :

an offset, runouts and a wave of the base pitch. Dampers take the rate at which flanks approach each
other, Vᵀu̇ + ė. What changes as the contact moves over the flanks (V, gaps of modifications,
deviations from tooth to tooth) has no rate: pairs hand their load over while no body approaches.
"""

from __future__ import annotations

import math

from flexgear.compiled import INNER, UNCOUNTED, njit


@njit(**INNER)
def common_error(gear_mesh, runout, theta, base):
    """Error that all pairs of a gear mesh share, m: offset, runouts, wave of the base pitch."""
    total = gear_mesh.error_offset
    for h in range(runout.shape[0]):
        wave = runout[h]
        if wave.amplitude != 0.0:
            total += wave.amplitude * math.sin(wave.rate * theta[wave.angle] + wave.phase)
    if gear_mesh.error_amplitude != 0.0:
        angle = 2 * math.pi * base / gear_mesh.pitch + gear_mesh.error_phase
        total += gear_mesh.error_amplitude * math.sin(angle)
    return total


@njit(**UNCOUNTED)
def error_rates(gears, theta, speeds, out):
    """Rates (M,), m/s, of the errors that all pairs of a gear mesh share, ``common_error``, at the
    angles theta (A,) and their speeds (A,), rad/s, into ``out``."""
    for m in range(gears.gear_mesh.shape[0]):
        gear_mesh, runout, total = gears.gear_mesh[m], gears.runout[m], 0.0
        for h in range(runout.shape[0]):
            wave = runout[h]
            if wave.amplitude != 0.0:
                turning = wave.amplitude * wave.rate * speeds[wave.angle]
                total += turning * math.cos(wave.rate * theta[wave.angle] + wave.phase)
        if gear_mesh.error_amplitude != 0.0:
            turns = 2 * math.pi / gear_mesh.pitch
            rolling = gear_mesh.rate * speeds[gear_mesh.angle]
            angle = (
                turns * (gear_mesh.s0 + gear_mesh.rate * theta[gear_mesh.angle])
                + gear_mesh.error_phase
            )
            total += gear_mesh.error_amplitude * turns * rolling * math.cos(angle)
        out[m] = total


@njit(**INNER)
def error_rate(rows, i, rates):
    """The one of these rates (M,) that row i has; zero of rows that are no gear mesh's."""
    return rates[rows.row[i].owner] if rows.row[i].kind >= 0 else 0.0
