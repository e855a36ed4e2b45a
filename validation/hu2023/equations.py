"""The paper's 43 equations as plain matrices with corrected signs, without the package.

Coordinates stage by stage (eq. 10): sun u (first stage) or u, H, V; planets (u, ξ, η); carrier
(u, X, Y); u = r θ, r the base radius of a gear and the centre distance of a carrier. All in the
frame of the stage's carrier, planets with absolute displacements. η_i = φ_i − α_w:

    sun gear mesh    u_s − u_p − ξ sin α_w − η cos α_w − H sin η_i + V cos η_i
    ring gear mesh   u_p + ξ sin α_n − η cos α_n
    planet bearing   X cos φ + Y sin φ − ξ   and   −X sin φ + Y cos φ + u_c − η

Forces follow by virtual work, so they balance, which those of eqs. 3, 5, 12-15 as printed do not
(source.md). A spline of stiffness K_uc joins u_c of a stage to the next sun's rotation; the last
one holds u_c.
"""

from dataclasses import dataclass, field

import numpy as np
from linear import Linear

from flexgear.arrays import Array

PLANETS = 3


@dataclass(frozen=True)
class Stage:
    """Tables 2 and 3, and what the paper leaves out (chosen): stiffness of planet bearings, masses
    and J/r² of gears; SI. sun_support: radial stiffness of the sun, None where it cannot move."""

    teeth: tuple[int, int, int]  # sun, planet, ring
    module: float
    angles: tuple[float, float]  # α_w, α_n, rad
    carrier_support: float
    spline: float
    stiffness: tuple[float, float]  # sun, ring gear mesh
    carrier_mass: float
    sun_support: float | None = 0.0
    bearing: float = 1e9
    sun: tuple[float, float] = (1.0, 1.0)
    planet: tuple[float, float] = (1.0, 1.0)
    carrier_inertia: float = 1.0  # J/r_c², kg

    @property
    def base_radius(self) -> float:
        """Of the sun, m, from the standard pressure angle of 20°."""
        return 0.5 * self.module * self.teeth[0] * float(np.cos(np.radians(20.0)))

    @property
    def center_distance(self) -> float:
        """(r_bs + r_bp)/cos α_w, m."""
        both = self.base_radius * (1 + self.teeth[1] / self.teeth[0])
        return both / float(np.cos(self.angles[0]))

    @property
    def ratio(self) -> float:
        """Speed of the sun over that of the carrier."""
        return 1 + self.teeth[2] / self.teeth[0]

    @property
    def cycles(self) -> int:
        """Gear-mesh cycles until all gears stand as at the start."""
        return int(np.lcm.reduce(self.teeth))

    @property
    def size(self) -> int:
        """Coordinates: 13 with a sun that only turns, 15 else."""
        return (1 if self.sun_support is None else 3) + 3 * PLANETS + 3


def printed_stages() -> tuple[Stage, ...]:
    """Tables 2 and 3."""
    degrees = np.radians
    return (
        Stage((12, 30, 75), 2.5e-3, (degrees(26.24), degrees(16.04)), 1.5e9, 1.3e9,
              (8.16e8, 1.11e9), 2.28, None),
        Stage((18, 28, 75), 2.5e-3, (degrees(22.54), degrees(19.32)), 1.52e9, 1.32e9,
              (2.09e9, 2.52e9), 4.15),
        Stage((16, 23, 65), 4e-3, (degrees(26.07), degrees(14.69)), 1.7e9, 1.41e9,
              (3.17e9, 3.91e9), 13.98),
    )  # fmt: skip


@dataclass(frozen=True)
class Drive:
    """The whole drive: stages, power and speed of the first sun, damping ratio of eqs. 7 and 8."""

    stages: tuple[Stage, ...] = field(default_factory=printed_stages)
    power: float = 6.4e3
    speed: float = 1600 * np.pi / 30
    damping_ratio: float = 0.007

    @property
    def angles(self) -> Array:
        """φ_i, rad."""
        return 2 * np.pi * np.arange(PLANETS) / PLANETS

    def sun_speed(self, j: int) -> float:
        """ω_s of stage j from 0, rad/s."""
        return self.speed / float(np.prod([s.ratio for s in self.stages[:j]]))

    def torque(self, j: int) -> float:
        """On the sun of stage j, N m."""
        return self.power / self.sun_speed(j)

    def mean_force(self, j: int) -> float:
        """T/(N r_bs) of stage j, N."""
        return self.torque(j) / (PLANETS * self.stages[j].base_radius)

    def first(self, j: int) -> int:
        """First coordinate of stage j."""
        return sum(s.size for s in self.stages[:j])

    def carrier(self, j: int) -> int:
        """First coordinate of carrier j."""
        return self.first(j) + self.stages[j].size - 3

    def gear_meshes(self, j: int, kind: str) -> slice:
        """Rows of the "sun" or "ring" gear meshes of stage j."""
        start = 2 * PLANETS * j + (PLANETS if kind == "ring" else 0)
        return slice(start, start + PLANETS)


def stage_rows(stage: Stage) -> tuple[Array, Array]:
    """Rows (2N, size) of the gear meshes and (2N, size) of the planet bearings of one stage."""
    gear, bearing = np.zeros((2, 2 * PLANETS, stage.size))
    lead = stage.size - 3 * PLANETS - 3
    aw, an = stage.angles
    for i in range(PLANETS):
        phi = 2 * np.pi * i / PLANETS
        columns = slice(lead + 3 * i, lead + 3 * i + 3)
        gear[i, :lead] = (1, -np.sin(phi - aw), np.cos(phi - aw))[:lead]
        gear[i, columns] = -1, -np.sin(aw), -np.cos(aw)
        gear[PLANETS + i, columns] = 1, np.sin(an), -np.cos(an)
        bearing[2 * i, -3:] = 0, np.cos(phi), np.sin(phi)
        bearing[2 * i, columns] = 0, -1, 0
        bearing[2 * i + 1, -3:] = 1, -np.sin(phi), np.cos(phi)
        bearing[2 * i + 1, columns] = 0, 0, -1
    return gear, bearing


def stage_masses(stage: Stage) -> Array:
    """Diagonal of the mass matrix of one stage (eq. 11), kg."""
    m, i = stage.sun
    sun = [i] if stage.sun_support is None else [i, m, m]
    m, i = stage.planet
    return np.array([*sun, *[i, m, m] * PLANETS, stage.carrier_inertia, *[stage.carrier_mass] * 2])


def matrices(drive: Drive) -> Linear:
    """The coupled drive, gear meshes damped by eqs. 7 and 8 with a fixed ring of infinite mass."""
    size = sum(s.size for s in drive.stages)
    count = 2 * PLANETS * len(drive.stages)
    rows, mass, stiffness = np.zeros((count, size)), np.zeros(size), np.zeros((size, size))
    k, c = np.zeros(count), np.zeros(count)
    for j, stage in enumerate(drive.stages):
        columns = slice(drive.first(j), drive.first(j) + stage.size)
        gear, bearing = stage_rows(stage)
        mass[columns] = stage_masses(stage)
        rows[2 * PLANETS * j : 2 * PLANETS * (j + 1), columns] = gear
        stiffness[columns, columns] += stage.bearing * bearing.T @ bearing
        carrier = drive.carrier(j)
        stiffness[[carrier + 1, carrier + 2], [carrier + 1, carrier + 2]] += stage.carrier_support
        if stage.sun_support:
            float_ = [columns.start + 1, columns.start + 2]
            stiffness[float_, float_] += stage.sun_support
        spline = np.zeros(size)
        spline[carrier] = 1.0
        if j + 1 < len(drive.stages):
            spline[drive.first(j + 1)] = -stage.center_distance / drive.stages[j + 1].base_radius
        stiffness += stage.spline * np.outer(spline, spline)
        sun, planet = stage.sun[0], stage.planet[0]
        for kind, value, reduced in (
            ("sun", stage.stiffness[0], sun * planet / (sun + planet)),
            ("ring", stage.stiffness[1], planet),
        ):
            k[drive.gear_meshes(j, kind)] = value
            c[drive.gear_meshes(j, kind)] = 2 * drive.damping_ratio * np.sqrt(value * reduced)
    stiffness += rows.T @ (k[:, None] * rows)
    load = np.zeros(size)
    load[0] = drive.torque(0) / drive.stages[0].base_radius
    return Linear(np.diag(mass), rows.T @ (c[:, None] * rows), stiffness, rows, k, c, load)
