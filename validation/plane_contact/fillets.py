"""Root fillets of a spur tooth's +y half, from the end of the involute to the root circle.

The arc is flexgear's (``gears.tooth``). The trochoid is what a rack of module m with tip radius ρ_f
cuts: the centre C of its tip rounding rolls with the reference circle, and the envelope lies ρ_f
beyond it on the line from the pitch point I,

    P = C + ρ_f (C − I)/|C − I|,   C − I = (X, −(h_f − ρ_f)),   0 ≤ X ≤ (h_f − ρ_f)/tan α,

turned back by (X − u)/r, u = π m/4 − H tan α − ρ_f (1 − sin α)/cos α being the distance of C from
the middle of the tool's tooth, H the tool's addendum over its middle line, h_f = H − x m the
dedendum below the reference circle. Source: ISO 6336-3:2006, 6.2 (E, G, θ) in other words; no
undercut.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.tooth import ToothGeometry

Points = NDArray[np.complex128]


def arc(tooth: ToothGeometry, count: int) -> Points:
    """(count + 1,) points, one more where the flank goes on radially below the base circle."""
    fillet = tooth.fillet
    centre = complex(*fillet.centre)
    half = float(tooth.half_angle(fillet.contact_radius))
    start = fillet.contact_radius * np.exp(1j * half)
    end = tooth.root_radius * np.exp(1j * fillet.end)
    first, last = np.angle([start - centre, end - centre])
    turn = (last - first + math.pi) % (2 * math.pi) - math.pi
    bend = centre + fillet.radius * np.exp(1j * (first + turn * np.linspace(0, 1, count + 1)))
    if tooth.base_radius > fillet.contact_radius:
        bend = np.concatenate([[tooth.base_radius * np.exp(1j * half)], bend])
    return bend


def trochoid(tooth: ToothGeometry, count: int) -> Points:
    """(count + 1,) points at equal steps of arc length. ValueError for a ring: no rack cuts it."""
    if tooth.internal:
        raise ValueError("no rack cuts a ring")
    alpha, rho, r = tooth.transverse_angle, tooth.fillet_radius, tooth.reference_radius
    module = 2 * r / tooth.teeth
    shift = (tooth.thickness - module * math.pi / 2) / (2 * math.tan(alpha))
    below = r - tooth.root_radius
    addendum = below + shift
    u = module * math.pi / 4 - addendum * math.tan(alpha)
    u -= rho * (1 - math.sin(alpha)) / math.cos(alpha)
    x = np.linspace((below - rho) / math.tan(alpha), 0.0, 4001)
    centre = x - 1j * (below - rho)
    point = centre + rho * centre / abs(centre) + 1j * r
    space = point * np.exp(1j * (x - u) / r)  # middle of the space upward
    line = space * np.exp(-1j * (math.pi / 2 - math.pi / tooth.teeth))
    along = np.concatenate([[0.0], np.cumsum(abs(np.diff(line)))])
    at = np.linspace(0.0, along[-1], count + 1)
    return np.interp(at, along, line.real) + 1j * np.interp(at, along, line.imag)


SHAPES = {"arc": arc, "trochoid": trochoid}
