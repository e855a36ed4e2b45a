"""Error cycle of a stage, after which all errors repeat, and its sampling.

The unit is the gear-mesh cycle: rotation of the carrier by one ring tooth relative to the ring, in
which sun, planets and ring each turn by one tooth relative to the carrier. An error of the sun
repeats after z_s cycles, one of a planet after z_p, one of the ring after z_r; one that is fixed in
space (ring offset, gravity, a support of unequal stiffness) after |z_r / ν|, where ν is the
absolute rotation of the carrier over that relative to the ring (1 if the ring is held). The same
teeth of sun, planet and ring meet again after

    C = lcm(z_s, z_p, z_r) gear-mesh cycles = C / z_r turns of the carrier.

In a parallel stage the cycle is rotation of the gear by one tooth, C = lcm(z_pinion, z_gear). The
error cycle of a train is the least common multiple over its stages, which may be millions of turns;
it is then sampled by whole gear-mesh cycles w_i = i g mod C with g prime to C and near C / 1.618…,
so that any z consecutive samples meet each of the z phases of an error exactly once.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.gears.radii import gears_by_role
from flexgear.model.errors import FlexgearError
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.stage import Stage

SOURCES = ("sun", "planet", "ring", "housing")  # a pinion is a "sun", its gear a "planet"
CANDIDATES = 64  # multipliers g that are tried
MAX_CYCLES = 10**8  # gear-mesh cycles; beyond, angles in double precision lose the phase


@dataclass(frozen=True)
class ErrorCycle:
    """Period of all errors of a stage. gear_meshes: in gear-mesh cycles; per_turn: gear-mesh cycles
    in one turn of the stage angle θ (carrier relative to ring, or gear of a parallel stage)."""

    gear_meshes: int
    per_turn: int

    @property
    def turns(self) -> Fraction:
        """Period of the errors in turns of θ."""
        return Fraction(self.gear_meshes, self.per_turn)


@dataclass(frozen=True)
class TrainTurn:
    """Error cycle of a stage in a train, and turns of its θ per turn of the input coordinate."""

    cycle: ErrorCycle
    rate: Fraction


@dataclass(frozen=True)
class AngleSamples:
    """Sampled angles of θ or of the input coordinate, in whole gear-mesh cycles. angles: (w ·
    per_gear_mesh,) rad, rising, cycle after cycle; gear_mesh: (w,) numbers of the cycles in the
    error cycle."""

    angles: Array
    gear_mesh: NDArray[np.int64]
    per_gear_mesh: int


def error_cycle(
    stage: Stage, sources: Iterable[str] = SOURCES, carrier_turns: Fraction = Fraction(1)
) -> ErrorCycle:
    """Error cycle of a stage under errors of the given sources. carrier_turns: absolute turns of
    the carrier per turn of θ (1: ring held; 0: carrier held, so errors that are fixed in space are
    constant). Raises FlexgearError for an unknown source."""
    sources = tuple(sources)
    unknown = [s for s in sources if s not in SOURCES]
    if unknown:
        raise FlexgearError(f"{unknown[0]!r} is no source of errors; take {', '.join(SOURCES)}")
    teeth = {role: gear.teeth for role, gear in gears_by_role(stage).items()}
    per_turn = teeth.get("ring", teeth["planet"])
    periods = [Fraction(teeth[s]) for s in sources if s in teeth]
    # axes of a parallel stage are fixed in the housing, so the periods of its gears cover "housing"
    if "housing" in sources and "ring" in teeth and carrier_turns != 0:
        periods.append(Fraction(per_turn) / abs(carrier_turns))
    return ErrorCycle(int(_common([Fraction(1), *periods])), per_turn)


def error_sources(errors: GearErrors, *, housing: bool = False) -> tuple[str, ...]:
    """Sources with an error other than zero; housing: whether a cause that is not in ``errors`` is
    fixed in space."""
    sources = {
        "sun": errors.sun_eccentricity or errors.sun_pitch,
        "planet": any(errors.planet_eccentricity) or errors.planet_pitch,
        "ring": errors.ring_eccentricity or errors.ring_pitch,
        "housing": housing or errors.ring_offset,
    }
    return tuple(s for s in SOURCES if sources[s])


def train_cycle(turns: Sequence[TrainTurn]) -> Fraction:
    """Common period of the errors of all stages, in turns of the input coordinate."""
    moving = [t for t in turns if t.rate != 0]
    if not moving:
        raise FlexgearError("no stage of the train turns: there is no error cycle")
    return _common([t.cycle.turns / abs(t.rate) for t in moving])


def exact_rate(speed: float, lead: float) -> Fraction:
    """Ratio speed / lead as a fraction of tooth numbers, with denominators up to a million. Two
    independent input speeds have no common period; their ratio is rounded to the nearest such
    fraction, whose error only matters beyond a million turns."""
    return Fraction(speed / lead).limit_denominator()


def sample_train_angles(
    turns: Sequence[TrainTurn], window: int, per_gear_mesh: int, most: int
) -> AngleSamples:
    """Input angles that sample the error cycle of a train.

    window: index of the stage whose gear-mesh cycles are sampled, with ``per_gear_mesh`` positions
    in each; most: largest number of these cycles, which are spread over the error cycle of the
    train. Raises FlexgearError if the stage does not turn, or without positions or cycles.
    """
    sampled = turns[window]
    if sampled.rate == 0:
        raise FlexgearError("the stage whose gear-mesh cycles are to be sampled does not turn")
    step = 1 / (abs(sampled.rate) * sampled.cycle.per_turn)
    count = int(train_cycle(turns) / step)
    if count > MAX_CYCLES:
        count = max(MAX_CYCLES // sampled.cycle.gear_meshes, 1) * sampled.cycle.gear_meshes
    if per_gear_mesh < 1 or most < 1:
        raise FlexgearError("sampling needs at least one position and one gear-mesh cycle")
    chosen = np.arange(count) if count <= most else spread(count, most)
    within = np.arange(per_gear_mesh) / per_gear_mesh
    angles = 2 * math.pi * float(step) * (chosen[:, None] + within).ravel()
    return AngleSamples(angles, chosen.astype(np.int64), per_gear_mesh)


def spread(count: int, most: int) -> NDArray[np.int64]:
    """``most`` different numbers below ``count``, rising: i g mod count, g prime to count.

    g is the multiplier nearest to count/φ (golden section) whose largest gap is below three mean
    gaps, else the best of ``CANDIDATES``: a multiplier near count/φ may also be near a simple
    fraction of count, which gives uneven gaps.
    """
    golden = round(count * (math.sqrt(5) - 1) / 2)
    multipliers = (
        x for d in range(count) for x in dict.fromkeys((golden + d, golden - d))
        if x > 0 and math.gcd(x, count) == 1
    )  # fmt: skip
    steps = np.arange(most, dtype=np.int64)
    best, widest = steps, math.inf
    for g in islice(multipliers, CANDIDATES):
        positions = np.sort(steps * g % count)
        gap = float(np.diff(np.append(positions, positions[0] + count)).max())
        if gap < widest:
            best, widest = positions, gap
        if gap * most < 3 * count:
            break
    return best


def _common(periods: Sequence[Fraction]) -> Fraction:
    """Least common multiple of fractions: lcm of numerators over gcd of denominators."""
    return Fraction(
        math.lcm(*(p.numerator for p in periods)), math.gcd(*(p.denominator for p in periods))
    )


LEAST_STEPS = 4  # time steps in a gear-mesh period


def longest_time_step(gear_mesh_frequency: float) -> float:
    """A quarter of a gear-mesh period, s; infinite at zero speed. Longer steps would miss pairs
    that come into contact and leave it between two steps, and the variation of stiffness in a
    period."""
    return 1.0 / (LEAST_STEPS * gear_mesh_frequency) if gear_mesh_frequency else math.inf
