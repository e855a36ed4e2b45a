"""Errors common to all pairs of a gear mesh, and their rates.

At the angles θ (A,) the error of the flanks of a gear mesh is

    e = e₀ + Σ_h A_h sin(r_h θ_h + φ_h) + Σ_l A_l sin(2π l s/p_bt + φ_l),    s = s0 + (ds/dθ) θ :

offset, runouts and waves over the base pitch. Dampers act on the rate of approach of the flanks,
Vᵀu̇ + ė. Changes due to movement of the contact over the flanks (V, gaps of modifications,
deviations between teeth) have no rate, as no body approaches another when load passes from pair to
pair.
"""

import math

from flexgear.compiled import INNER, UNCOUNTED, njit


@njit(**INNER)
def common_error(gear_mesh, runout, harmonic, theta, base):
    """Error common to all pairs of a gear mesh, m; base: path coordinate s of pair 0, m."""
    total = gear_mesh.error_offset
    for h in range(runout.shape[0]):
        wave = runout[h]
        if wave.amplitude != 0.0:
            total += wave.amplitude * math.sin(wave.rate * theta[wave.angle] + wave.phase)
    for h in range(harmonic.shape[0]):
        wave = harmonic[h]
        if wave.amplitude != 0.0:
            angle = 2 * math.pi * (h + 1) * base / gear_mesh.pitch + wave.phase
            total += wave.amplitude * math.sin(angle)
    return total


@njit(**UNCOUNTED)
def error_rates(gears, theta, speeds, active_flanks, out):
    """Fills out (M,) with rates of ``common_error``, m/s, at angles theta (A,) and speeds (A,),
    rad/s, for gear meshes with 1 in active_flanks (M,)."""
    for m in range(gears.gear_mesh.shape[0]):
        if active_flanks[m] == 0:
            continue
        gear_mesh, runout, harmonic = gears.gear_mesh[m], gears.runout[m], gears.harmonic[m]
        total = 0.0
        for h in range(runout.shape[0]):
            wave = runout[h]
            if wave.amplitude != 0.0:
                turning = wave.amplitude * wave.rate * speeds[wave.angle]
                total += turning * math.cos(wave.rate * theta[wave.angle] + wave.phase)
        base = gear_mesh.s0 + gear_mesh.rate * theta[gear_mesh.angle]
        rolling = gear_mesh.rate * speeds[gear_mesh.angle]
        for h in range(harmonic.shape[0]):
            wave = harmonic[h]
            if wave.amplitude != 0.0:
                turns = 2 * math.pi * (h + 1) / gear_mesh.pitch
                total += wave.amplitude * turns * rolling * math.cos(turns * base + wave.phase)
        out[m] = total


@njit(**INNER)
def error_rate(rows, i, rates):
    """Error rate of row i from rates (M,) of gear meshes; zero for other rows."""
    return rates[rows.row[i].owner] if rows.row[i].kind >= 0 else 0.0
