"""Plain journal bearing between planet and pin: oil film of a short bearing.

Rows are motions x, y of the planet relative to the pin, and its rotation relative to the pin. The
film between bore and pin has the thickness h = c − x cos ψ − y sin ψ, with ψ from the side opposite
to the displacement. With the mean speed ω̄ of both surfaces in the frame of x, y, Reynolds' equation
of a short bearing gives

    p = 6 η (a cos ψ + b sin ψ)/h³ (L²/4 − z²),   (a, b) = (ẋ + ω̄ y, ẏ − ω̄ x),

for squeeze and wedge together. Where p is negative oil cavitates and p = 0 (Gümbel), so that the
half circle about the direction α of (a, b) carries. Integration, with u = (cos ψ, sin ψ), gives

    F = η R L³ A (a, b),   A = ∫ u uᵀ/h³ dψ from α − π/2 to α + π/2,

and the film always dissipates, F · (a, b) ≥ 0. With p, q the components of (x, y)/c along α and
across, all integrals are derivatives of G = ∫ dθ/(1 − p cos θ − q sin θ) = 2 T/s,
s² = 1 − p² − q², T = arctan2(s, −p): A has G_pp/2, G_pq/2, G_qq/2 over c³.

The pin is stationary in the frame of x, y and the planet rotates, so that ω̄ is half the planet's
speed. The drag torque on both is that of shear, 2π η R³ L ω/(c √(1 − ε²)), and half of the moment
of F.

Beyond ε = 1 − h_min/c surfaces touch: the film is that at this limit, and the radial stiffness of
the bearing acts on the excess. Not modelled: heating of the oil, deformation of the surfaces, tilt,
and length: films longer than half of the diameter carry less than by the theory of short bearings.
Parameters: η Pa·s, R, L, c, h_min m, radial stiffness N/m.

Source: Reynolds' equation of short bearings by Ocvirk (NACA TN 2808, 1952); integrals derived here.
"""

import math

import numpy as np

from flexgear.arrays import Array
from flexgear.compiled import INNER, njit
from flexgear.coupling.laws.basic import clear
from flexgear.coupling.laws.law import CENTERING, Law, compiled_law
from flexgear.model.bearings import Bearing
from flexgear.model.member import PlanetBearing
from flexgear.model.section import Missing

VISCOSITY, RADIUS, LENGTH, CLEARANCE, LEAST_FILM, STIFFNESS = range(6)
LEAST_TANGENT = 1e-6  # of a film without load, over the radial stiffness


@njit(**INNER)
def _integrals(p, q):
    """Integrals of the half film: ½ G_pp, ½ G_pq, ½ G_qq, ½ G_ppp, ½ G_ppq, ½ G_pqq."""
    s2, w = 1.0 - p * p - q * q, 1.0 - q * q
    s = math.sqrt(s2)
    t, s3, s4 = math.atan2(s, -p), s * s2, s2 * s2
    s5, s6, s7 = s2 * s3, s2 * s4, s3 * s4
    both, t_q = 1.0 / s3 + 3.0 * p * p / s5, p * q / (s * w)
    return (
        3.0 * p / s4 + t * both,
        3.0 * q / s4 - q / (w * s2) + 3.0 * p * q * t / s5,
        p / (s2 * w)
        + p * q * q * (3.0 / (s4 * w) + 2.0 / (s2 * w * w))
        + t * (1.0 / s3 + 3.0 * q * q / s5),
        4.0 / s4 + 15.0 * p * p / s6 + t * p * (9.0 / s5 + 15.0 * p * p / s7),
        12.0 * p * q / s6 + t_q * both + 3.0 * q * t * (1.0 / s5 + 5.0 * p * p / s7),
        3.0 / s4
        + 12.0 * q * q / s6
        - 1.0 / (w * s2)
        - 2.0 * q * q * (1.0 / (w * w * s2) + 1.0 / (w * s4))
        + 3.0 * p * (t * (1.0 / s5 + 5.0 * q * q / s7) + q * t_q / s5),
    )


@njit(**INNER)
def _film(parameters, x, y, a, b, force, tangent):
    """Sets the force F of the film at (x, y) under (a, b), and adds ∂F/∂(x, y) at constant (a, b)
    and ∂F/∂(a, b) to ``tangent``."""
    c, size = parameters[CLEARANCE], math.sqrt(a * a + b * b)
    scale = parameters[VISCOSITY] * parameters[RADIUS] * parameters[LENGTH] ** 3 / c**3
    nx, ny = (a / size, b / size) if size > 0.0 else (1.0, 0.0)
    along, across = (x * nx + y * ny) / c, (y * nx - x * ny) / c
    pp, pq, qq, ppp, ppq, pqq = _integrals(along, across)
    axes = ((nx, -ny), (ny, nx))
    rate, slope = ((pp, pq), (pq, qq)), ((ppp, ppq), (ppq, pqq))
    for i in range(2):
        force[i] = scale * size * (axes[i][0] * pp + axes[i][1] * pq)
        for j in range(2):
            for k in range(2):
                for m in range(2):
                    turn = axes[i][k] * axes[j][m]
                    tangent[0, i, j] += scale * size / c * turn * slope[k][m]
                    tangent[1, i, j] += scale * turn * rate[k][m]


@njit(**INNER)
def _touching(parameters, x, y, inside, force, tangent):
    """Adds contact of the surfaces at (x, y) beyond the least film; returns its potential. inside:
    radius at which surfaces touch, m. Tangents of the film are restricted to changes of direction;
    force and tangent of the contact are added."""
    size, k = math.sqrt(x * x + y * y), parameters[STIFFNESS]
    over, share = size - inside, inside / size
    n = (x / size, y / size)
    for i in range(2):
        radial = tangent[0, i, 0] * n[0] + tangent[0, i, 1] * n[1]
        for j in range(2):
            tangent[0, i, j] = share * (tangent[0, i, j] - radial * n[j])
            tangent[0, i, j] += k * (share * n[i] * n[j] + (over / size if i == j else 0.0))
        force[0, i] += k * over * n[i]
        force[1, i] = k * over * n[i]
    return 0.5 * k * over * over


@compiled_law
def _journal(parameters, motion, force, tangent):
    """Forces along x and y, and drag about z, with tangents."""
    x, y, c = motion[0, 0], motion[0, 1], parameters[CLEARANCE]
    speed = motion[1, 2]  # of the planet against the pin
    mean, size, inside = 0.5 * speed, math.sqrt(x * x + y * y), c - parameters[LEAST_FILM]
    share = inside / size if size > inside else 1.0
    film_x, film_y = share * x, share * y
    a, b = motion[1, 0] + mean * film_y, motion[1, 1] - mean * film_x
    clear(force, tangent)
    _film(parameters, film_x, film_y, a, b, force[0], tangent)
    # (a, b) depends on film_x, film_y and the speed
    eccentric = (film_x, film_y)
    for i in range(2):
        by_x, by_y = tangent[1, i, 0], tangent[1, i, 1]
        tangent[0, i, 0] -= mean * by_y
        tangent[0, i, 1] += mean * by_x
        tangent[1, i, 2] = 0.5 * (by_x * film_y - by_y * film_x)
    # drag: shear and half of the moment of the film's force
    open_film = math.sqrt(1.0 - (film_x * film_x + film_y * film_y) / (c * c))
    shear = 2.0 * math.pi * parameters[VISCOSITY] * parameters[RADIUS] ** 3 * parameters[LENGTH]
    shear /= c * open_film
    force[0, 2] = shear * speed - 0.5 * (film_x * force[0, 1] - film_y * force[0, 0])
    tangent[1, 2, 2] = shear
    for j in range(2):
        tangent[0, 2, j] = shear * speed * eccentric[j] / (c * c * open_film * open_film)
        tangent[0, 2, j] -= 0.5 * (film_x * tangent[0, 1, j] - film_y * tangent[0, 0, j])
        tangent[1, 2, j] = -0.5 * (film_x * tangent[1, 1, j] - film_y * tangent[1, 0, j])
    tangent[0, 2, 0] -= 0.5 * force[0, 1]
    tangent[0, 2, 1] += 0.5 * force[0, 0]
    tangent[1, 2, 2] -= 0.5 * (film_x * tangent[1, 1, 2] - film_y * tangent[1, 0, 2])
    energy = 0.0
    if size > inside:
        energy = _touching(parameters, x, y, inside, force, tangent)
        drag_along = (tangent[0, 2, 0] * x + tangent[0, 2, 1] * y) / (size * size)
        tangent[0, 2, 0] = share * (tangent[0, 2, 0] - drag_along * x)
        tangent[0, 2, 1] = share * (tangent[0, 2, 1] - drag_along * y)
    for i in range(2):
        tangent[0, i, i] += LEAST_TANGENT * parameters[STIFFNESS] if a == 0.0 and b == 0.0 else 0.0
    return energy


def _nominal(parameters: Array) -> Array:
    return np.array([parameters[STIFFNESS], parameters[STIFFNESS], 0.0])


def _stated_by(bearing: Bearing, viscosity: float | None) -> list[float] | None:
    film = bearing.journal if isinstance(bearing, PlanetBearing) else None
    if film is None:
        return None
    oil = film.viscosity if film.viscosity is not None else viscosity
    if oil is None:
        remedy = "add it, or density_kg_per_m3 and temperature_c of the lubricant"
        raise Missing("journal.viscosity_mpa_s", remedy=remedy)
    sizes = [0.5 * film.diameter, film.length, film.clearance, film.least_film]
    return [oil, *sizes, (1.0 - CENTERING) * bearing.stiffness[0]]


JOURNAL = Law("journal", _journal, (0, 1, 5), _nominal, _stated_by)
