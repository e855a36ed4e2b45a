"""Where the flanks of two rolling gears are, and how far apart; from the involute alone.

Planet at the origin, gear's centre on the x axis: at +a outside, at −a for a ring. The +y flanks
of the planet's teeth press the gear's teeth above them: at s on the line of action T + s n with
T = r_b (cos α, −sin α), n = (sin α, cos α), and s grows as the planet turns by +s/r_b. Tooth j of
the planet (counted counter-clockwise from the middle one) meets tooth −j of an external gear, j of
a ring.

A slave node P and its foot on the mate: the distance along the tangent from P to the mate's base
circle, which is normal to the mate's flank; with R, θ of P about the mate's centre and the flank's
half angle δ, in the mate's frame, gap = r_b (±θ − δ(R)) exactly.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from cut_teeth.gear import Gear
from numpy.typing import NDArray

from flexgear.arrays import Array, Complex
from plane_contact.sector import LOADED, Sector, flank_points

Relief = Callable[[Array], Array]  # material missing (m) at a roll length (m)


@dataclass(frozen=True)
class Place:
    """A gear's centre and the direction of its middle tooth, m and rad."""

    centre: complex
    angle: float


@dataclass(frozen=True)
class Pair:
    """Two gears on their centre distance; working: transverse angle, rad."""

    planet: Gear
    gear: Gear
    distance: float
    working: float

    @property
    def offset(self) -> float:
        """a sin α, between the base tangent points."""
        return self.distance * math.sin(self.working)

    @property
    def path(self) -> tuple[float, float]:
        """s_lo and s_hi."""
        return self.planet.path_of_contact(self.gear, self.working)

    @property
    def mate_step(self) -> int:
        """Tooth of the gear per tooth of the planet."""
        return 1 if self.gear.internal else -1

    @property
    def gear_side(self) -> int:
        """Which flank of the gear's teeth touches, in its own frame."""
        return -1 if self.gear.internal else 1

    def places(self, s: float) -> tuple[Place, Place]:
        """Planet and gear when their middle teeth touch at s."""
        base = self.planet.base_radius
        contact = base * np.exp(-1j * self.working) + s * 1j * np.exp(-1j * self.working)
        planet = Place(0j, self._tooth(self.planet, contact, 1))
        if self.gear.internal:
            centre = complex(-self.distance)
            return planet, Place(centre, self._tooth(self.gear, contact - centre, -1))
        centre = complex(self.distance)
        return planet, Place(centre, self._tooth(self.gear, contact - centre, 1))

    @staticmethod
    def _tooth(tooth: Gear, seen: complex, side: int) -> float:
        """Direction of the tooth whose flank passes through a point seen from its centre."""
        return float(np.angle(seen)) - side * float(tooth.half_angle(abs(seen)))


@dataclass(frozen=True)
class Candidates:
    """Slave nodes that may touch, with their feet; (n,) each unless said otherwise.

    gap m; point: of touch, m, and direction: of the force on the gear, as complex numbers in the
    pair's frame; arc: along the slave's flank, m. Of planet and gear each: nodes (n, 3), weights
    (n, 3) and force (n, 2) in the body's frame, so that the force on that body is p · weight ·
    force at its nodes, numbered through all chains. pair: index of the tooth pair.
    """

    gap: Array
    point: Complex
    direction: Complex
    arc: Array
    nodes: tuple[NDArray[np.int64], NDArray[np.int64]]
    weights: tuple[Array, Array]
    force: tuple[Array, Array]
    pair: NDArray[np.int64]

    @property
    def lever(self) -> Array:
        """Of the unit force about the planet, m."""
        return np.asarray((np.conj(self.point) * self.direction).imag)


@dataclass(frozen=True)
class Rolling:
    """Candidates of a pair with two meshed sectors.

    relief: of planet and gear at roll lengths; window: gaps (m) up to which nodes are looked at;
    path_only: pairs off the path of contact are left out.
    """

    pair: Pair
    sectors: tuple[Sector, Sector]
    relief: tuple[Relief, Relief]
    window: float
    path_only: bool = False

    def candidates(self, s: float) -> Candidates:
        """When the middle teeth are at s; of both loaded neighbours, too."""
        places = self.pair.places(s)
        low, high = self.pair.path
        by_pair = []
        for k, j in enumerate(LOADED):
            at = s + j * self.pair.planet.base_pitch
            if self.path_only and not low <= at <= high:
                continue
            slave = 0 if at > 0.5 * (low + high) else 1  # whose tip is the nearer one
            by_pair.append((k, self._of_pair(j, slave, places)))
        parts = [(k, c) for k, c in by_pair if len(c[0])]
        gap, point, direction, arc = (np.concatenate([c[i] for _, c in parts]) for i in range(4))
        sides = [
            tuple(np.concatenate([c[i][b] for _, c in parts]) for b in (0, 1)) for i in (4, 5, 6)
        ]
        pair = np.concatenate([np.full(len(c[0]), k) for k, c in parts])
        return Candidates(gap, point, direction, arc, sides[0], sides[1], sides[2], pair)

    def _of_pair(self, j: int, slave: int, places: tuple[Place, Place]):
        numbers = (j, self.pair.mate_step * j)
        sectors, sides = self.sectors, (1, self.pair.gear_side)
        sector, mate = sectors[slave], sectors[1 - slave]
        arc = with_middles(sector.arc)
        radius, half = flank_points(sector.tooth, arc)
        turn = places[slave].angle + numbers[slave] * sector.tooth.pitch_angle
        point = places[slave].centre + radius * np.exp(1j * (turn + sides[slave] * half))
        other = places[1 - slave]
        mate_turn = other.angle + numbers[1 - slave] * mate.tooth.pitch_angle
        seen = (point - other.centre) * np.exp(-1j * mate_turn)
        side = sides[1 - slave]
        at = abs(seen)
        roll = np.sqrt(np.maximum(at**2 - mate.tooth.base_radius**2, 0.0))
        gap = mate.tooth.base_radius * (side * np.angle(seen) - mate.tooth.half_angle(at))
        own_roll = np.sqrt(2 * sector.tooth.base_radius * arc)
        gap = gap + self.relief[slave](own_roll) + self.relief[1 - slave](roll)
        foot = roll**2 / (2 * mate.tooth.base_radius)
        ends = sorted((mate.arc[0], mate.arc[-1]))
        keep = (foot >= ends[0]) & (foot <= ends[1]) & (gap < self.window)
        # the force on the mate, into its tooth, along the tangent to its base circle
        radial = -mate.tooth.outward * roll / at
        along = -side * mate.tooth.base_radius / at
        force = (radial + 1j * along) * (point - other.centre) / at
        on_gear = -force if slave == 1 else force
        nodes, weights = foot_on(mate.arc, LOADED.index(numbers[1 - slave]), foot[keep])
        count = len(arc)
        mine = np.full((keep.sum(), 3), LOADED.index(numbers[slave]) * count)
        mine += np.flatnonzero(keep)[:, None]
        whole = np.tile([1.0, 0.0, 0.0], (len(mine), 1))
        by_slave = {slave: (mine, whole, -force[keep]), 1 - slave: (nodes, weights, force[keep])}
        out = [tuple(by_slave[b][i] for b in (0, 1)) for i in (0, 1)]
        forces = tuple(components(by_slave[b][2] * np.exp(-1j * places[b].angle)) for b in (0, 1))
        return gap[keep], point[keep], on_gear[keep], arc[keep], out[0], out[1], forces


def with_middles(arc: Array) -> Array:
    out = np.empty(2 * len(arc) - 1)
    out[::2], out[1::2] = arc, 0.5 * (arc[1:] + arc[:-1])
    return out


def foot_on(places: Array, chain: int, at: Array) -> tuple[NDArray[np.int64], Array]:
    """Nodes (n, 3) of the facets at places along a chain whose vertices have equal steps, and their
    shape functions."""
    facets = len(places) - 1
    place = (at - places[0]) / (places[-1] - places[0]) * facets
    facet = np.clip(place.astype(int), 0, facets - 1)
    t = place - facet
    first = chain * (2 * facets + 1) + 2 * facet
    weights = np.column_stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])
    return first[:, None] + np.arange(3), weights


def components(values: Complex) -> Array:
    return np.column_stack([values.real, values.imag])
