"""The paper's equations as plain matrices, written down without the package.

Coordinates q = (x, y, u) of carrier, ring and sun, then (ζ, η, u) of planets 1 … N; u = r θ, all in
the frame of the carrier, which stands still. Compressions with ψ_n = 2π(n − 1)/N, α on both sides:

    sun n      y_s cos(ψ−α) − x_s sin(ψ−α) + u_s − ζ sin α − η cos α + u
    ring n     y_r cos(ψ+α) − x_r sin(ψ+α) + u_r + ζ sin α − η cos α − u
    bearing n  x_c cos ψ + y_c sin ψ − ζ   and   −x_c sin ψ + y_c cos ψ + u_c − η

K = Σ k δ'δ + supports. u of the equivalent masses I/r² makes radii drop out.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from flexgear.arrays import Array

CARRIER, RING, SUN = 0, 3, 6  # first coordinate of each
CENTRAL = 9  # coordinates before the planets'


@dataclass(frozen=True)
class Parameters:
    """The example: masses kg, I/r² kg, stiffness N/m, working pressure angle rad."""

    sun: tuple[float, float] = (0.4, 0.39)
    ring: tuple[float, float] = (2.35, 3.00)
    carrier: tuple[float, float] = (5.43, 6.29)
    planet: tuple[float, float] = (0.66, 0.61)
    gear_mesh: float = 5e8
    bearing: float = 1e8
    ring_torsion: float = 1e9
    angle: float = float(np.radians(24.6))


def matrices(planets: int, p: Parameters) -> tuple[Array, Array]:
    """M and K, both (9 + 3N, 9 + 3N)."""
    size = CENTRAL + 3 * planets
    pairs = (p.carrier, p.ring, p.sun, *[p.planet] * planets)
    mass = np.diag([value for m, i in pairs for value in (m, m, i)])
    stiffness = np.zeros((size, size))
    for first in (CARRIER, RING, SUN):
        stiffness[[first, first + 1], [first, first + 1]] = p.bearing
    stiffness[RING + 2, RING + 2] = p.ring_torsion
    for n in range(planets):
        rows = compressions(n, planets, p.angle)
        values = np.array([p.gear_mesh, p.gear_mesh, p.bearing, p.bearing])
        stiffness += rows.T @ (values[:, None] * rows)
    return mass, stiffness


def compressions(n: int, planets: int, angle: float) -> Array:
    """(4, d) rows of planet n: sun, ring, radial and tangential bearing."""
    rows = np.zeros((4, CENTRAL + 3 * planets))
    psi = 2 * np.pi * n / planets
    s, c = np.sin(angle), np.cos(angle)
    columns = slice(CENTRAL + 3 * n, CENTRAL + 3 * n + 3)
    rows[0, SUN : SUN + 3] = -np.sin(psi - angle), np.cos(psi - angle), 1
    rows[0, columns] = -s, -c, 1
    rows[1, RING : RING + 3] = -np.sin(psi + angle), np.cos(psi + angle), 1
    rows[1, columns] = s, -c, -1
    rows[2, CARRIER : CARRIER + 3] = np.cos(psi), np.sin(psi), 0
    rows[2, columns] = -1, 0, 0
    rows[3, CARRIER : CARRIER + 3] = -np.sin(psi), np.cos(psi), 1
    rows[3, columns] = 0, -1, 0
    return rows


def modes(planets: int, p: Parameters) -> tuple[Array, Array]:
    """Frequencies in Hz (ascending, rigid one 0) and mass-normalised modes as columns."""
    mass, stiffness = matrices(planets, p)
    squares, shapes = eigh(stiffness, mass)
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi), shapes


def mode_types(planets: int, p: Parameters, shapes: Array) -> list[str]:
    """Type of every mode by its kinetic energy: central u, central x and y, or planets only."""
    mass, _ = matrices(planets, p)
    energy = np.diag(mass)[:, None] * shapes**2
    turning = energy[[CARRIER + 2, RING + 2, SUN + 2]].sum(axis=0)
    moving = energy[:CENTRAL].sum(axis=0) - turning
    kinds = []
    for turn, move in zip(turning, moving, strict=True):
        if turn + move < 1e-6:
            kinds.append("planet")
        else:
            kinds.append("rotational" if turn > move else "translational")
    return kinds
