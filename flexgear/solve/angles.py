"""Positions at which a train is solved: rated motions of its stages, gear-mesh and error cycles.

The reference member is the first port of given speed that is not zero. At rated speeds all other
rotations are proportional to its rotation, which so is a measure of time.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.springs import invariant_part
from flexgear.gears.error_cycle import (
    AngleSamples,
    ErrorCycle,
    TrainTurn,
    error_cycle,
    error_sources,
    exact_rate,
    sample_train_angles,
    train_cycle,
)
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.tooth_faults import faulty_gears
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.member import PlanetBearing

ALL_CYCLES = 25_000  # largest error cycle of a linear train, in gear-mesh cycles, solved completely
SPREAD_CYCLES = 4_000  # gear-mesh cycles of a linear train with a longer error cycle
SOLVED_CYCLES = 120  # gear-mesh cycles of a train that is solved position by position
LONGEST = 10**15  # gear-mesh cycles above which an error cycle counts as endless

RATED_SHARES = 1e-3, 1e3  # limits of speeds and torques over the rated ones
REVERSED = (
    "shares of rated speed and torque are positive: turn round torques or speeds in the case, "
    "whose rated ones determine which flanks carry"
)


def share_range(over: str, ends: Sequence[float]) -> tuple[float, float]:
    """Lower and upper end of a range of speeds or torques over rated ones. over: "speed" or
    "torque", for messages. InputError unless the ends are positive, rising and plausible."""
    low, high = sorted(map(float, ends))
    least, most = RATED_SHARES
    if ends[0] > ends[1] and low > 0.0:
        remedy = f"write {range_words((low, high))}"
        raise InputError(f"--{over}-range", range_words(ends), f"falls in {over}", remedy)
    if most < high or 0.0 < low < least:
        problem = f"is not within {least:g} and {most:g} times the rated {over}"
    elif not (math.isfinite(low) and math.isfinite(high)) or low <= 0.0 <= high:
        problem = f"goes through zero {over}, or touches it"
    else:
        problem = "is below zero" if low < 0.0 else "" if low < high else "is no range"
    if problem:
        remedy = "take a range of one sign, over rated, e.g. 0.2 1.5"
        raise InputError(
            f"--{over}-range", range_words(ends), problem, REVERSED if high < 0.0 else remedy
        )
    return low, high


def range_words(ends: Sequence[float]) -> str:
    """The text of a range: "0.2 to 1.5"."""
    return " to ".join(f"{x:g}" for x in ends)


@dataclass(frozen=True)
class StageMotion:
    """Rated motion of a stage. theta: speed of its angle, rad/s; carrier: speed of its carrier,
    rad/s; turn: its error cycle, and its rotation per rotation of the reference member;
    gear_mesh_frequency: Hz."""

    name: str
    theta: float
    carrier: float
    turn: TrainTurn
    gear_mesh_frequency: float

    @property
    def cycle(self) -> ErrorCycle:
        """The cycle after which the errors of the stage repeat."""
        return self.turn.cycle

    @property
    def error_period(self) -> float:
        """Common period of the errors of the stage, s; inf at zero speed."""
        return self.cycle.gear_meshes / self.gear_mesh_frequency if self.theta else math.inf

    @property
    def turn_period(self) -> float:
        """Time of one turn of the stage's angle, s; inf at zero speed."""
        return 2 * math.pi / abs(self.theta) if self.theta else math.inf


def stage_motions(case: Case, flow: PowerFlow) -> tuple[StageMotion, ...]:
    """Rated motion of every stage."""
    lead = lead_speed(case, flow)
    housing = _anisotropic_in_space(case)
    motions = []
    for stage in case.stages:
        speed = {part: flow.speed[f"{stage.name}.{part}"] for part in stage.members}
        carrier = speed.get("carrier", 0.0)
        theta = speed["gear"] if stage.kind == "parallel" else carrier - speed["ring"]
        theta = 0.0 if abs(theta) < 1e-9 * max(map(abs, speed.values())) else theta
        turns = exact_rate(carrier, theta) if theta else Fraction(0)
        errors = stage.errors
        sources = (*error_sources(errors, housing=housing), *faulty_gears(case.view(stage.name)))
        if stage.form("ring") == "fe":  # its stiffness varies with the position of bolts
            sources = (*sources, "ring")
        motions.append(
            StageMotion(
                stage.name,
                theta,
                carrier,
                TrainTurn(error_cycle(stage, sources, turns), exact_rate(theta, lead)),
                flow.stage(stage.name).gear_mesh_frequency,
            )
        )
    return tuple(motions)


def lead_speed(case: Case, flow: PowerFlow) -> float:
    """Rated speed of the reference member, rad/s; 1 where no port of given speed turns."""
    return next((flow.speed[m] for m in given_speeds(case) if flow.speed[m] != 0), 1.0)


def reference_member(case: Case, flow: PowerFlow) -> str:
    """Member of the first port of given speed that is not zero; of the first port without one."""
    turning = (member for member in given_speeds(case) if flow.speed[member] != 0)
    return next(turning, case.ports[0].member if case.ports else "")


def lead_angles(case: Case, flow: PowerFlow, angles: Array, of: str = "") -> Array:
    """Rotations (p,) of the reference member at which a stage or member has turned by ``angles``
    (p,), rad. of: name of a stage or member, the first input if left out.

    The rotation of a stage is that of its carrier relative to its ring, or of the gear of a
    parallel stage; that of a member is its rotation in space; both are positive in the rated sense.
    For a member that does not turn ``angles`` are returned.
    """
    speeds = {m.name: m.theta for m in stage_motions(case, flow)} | flow.speed
    of = of or (case.inputs[0].member if case.inputs else "")
    speed = speeds[of] if of else 0.0
    rate = abs(lead_speed(case, flow) / speed) if speed else 1.0
    return rate * np.asarray(angles, dtype=float)


def given_speeds(case: Case) -> list[str]:
    """Members of the ports with given speed, whose rotations are the independent ones."""
    return [port.member for port in case.ports if port.speed is not None]


def _anisotropic_in_space(case: Case) -> bool:
    """Whether weight, loads, supports or joints have fixed directions in space."""
    loads = any(load.frame == "fixed" and load.points[:, [0, 1, 3, 4]].any() for load in case.loads)
    bearings = [bearing for stage in case.stages for bearing in stage.bearings.values()]
    uneven = any(_is_uneven(b.matrix) for b in bearings if not isinstance(b, PlanetBearing))
    sideways = any(j.is_shaft or j.matrix[[0, 1, 3, 4]].any() for j in case.joints)
    return any(case.gravity) or loads or uneven or sideways


def _is_uneven(stiffness: Array) -> bool:
    """Whether a support's stiffness (6, 6) depends on rotation about the axis."""
    rest = stiffness - invariant_part(stiffness)
    return bool(np.abs(rest).max() > 1e-9 * np.abs(stiffness).max())


def samples_of_stage(
    case: Case, motions: tuple[StageMotion, ...], stage: int, cycles: int | None, linear: bool,
    per_gear_mesh: int | None = None,
) -> AngleSamples:  # fmt: skip
    """Angles of the reference member over whole gear-mesh cycles of a stage (number from 0), spread
    over the error cycle of the train.

    cycles: largest number of cycles; None: all up to ``ALL_CYCLES`` for a linear train, else
    ``SOLVED_CYCLES``. per_gear_mesh: positions in a cycle, by default those of the solver.
    FlexgearError for a stage without relative rotation.
    """
    if motions[stage].theta == 0:
        raise FlexgearError(
            f"{motions[stage].name} turns as one piece, so its load sharing has no cycle"
        )
    limit = cycles
    if limit is None and linear:
        every = cycles_of_train(motions, stage)
        limit = ALL_CYCLES if every is not None and every <= ALL_CYCLES else SPREAD_CYCLES
    if limit is None:
        limit = SOLVED_CYCLES
    per_gear_mesh = per_gear_mesh or case.solver.positions_per_gear_mesh
    return sample_train_angles([m.turn for m in motions], stage, per_gear_mesh, limit)


def one_turn(motion: StageMotion, lead: float, per_gear_mesh: int, max_cycles: int) -> Array:
    """Angles of the reference member over one turn of a stage's angle, or ``max_cycles`` gear-mesh
    cycles if less, rad; lead: its rated speed, rad/s; per_gear_mesh: positions in a cycle."""
    cycles = min(motion.cycle.per_turn, max_cycles)
    step = 2 * math.pi / (motion.cycle.per_turn * per_gear_mesh) * abs(lead / motion.theta)
    return np.asarray(step * np.arange(cycles * per_gear_mesh))


def cycles_of_train(motions: tuple[StageMotion, ...], stage: int) -> int | None:
    """Number of gear-mesh cycles of a stage (number from 0) after which the errors of all stages
    repeat; None if it is endless or the stage does not turn."""
    motion = motions[stage]
    if motion.theta == 0:
        return None
    turns = train_cycle([m.turn for m in motions]) * abs(motion.turn.rate)
    count = int(turns * motion.cycle.per_turn)
    return count if count < LONGEST else None
