"""Transient under a drive torque: plans steps, runs the kernel in chunks, hands samples on.

The run starts from static equilibrium at the starting torque plus rigid rolling. At every jump of
the torque the step sequence restarts with a consistent acceleration, so that the average-
acceleration rule keeps its order; windows around jumps may use a finer step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.energy import ENERGIES, Ledger
from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.kernel import (
    BETA,
    GAMMA,
    Samples,
    State,
    StepData,
    Work,
    advance,
    consistent_acceleration,
)
from flexgear.analysis.ladder import control
from flexgear.analysis.near import Near, near_channels
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import SLOTS, PairRows, extra_rows, pair_rows
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]
Torque = Callable[[Array], Array]
CHUNK = 500
BESIDE = 1e-3  # of a step: how far beside a jump its two torques are read


@dataclass(frozen=True)
class Drive:
    """Given torques over time: torque(t) with t (k,) s -> (k,) N·m on the first port, or (k, P − 1)
    on all ports but the braked one; and the times they jump."""

    torque: Torque
    jumps: tuple[float, ...] = ()


@dataclass(frozen=True)
class FineWindow:
    """A span of time with a finer step, s."""

    start: float
    stop: float
    time_step: float


class Sink(Protocol):
    """Takes chunks of samples: name -> array with the samples along the first axis."""

    def append(self, samples: dict[str, Array]) -> None:
        """Take one chunk."""


class Collector:
    """A sink that keeps everything in memory."""

    def __init__(self) -> None:
        self._chunks: list[dict[str, Array]] = []

    def append(self, samples: dict[str, Array]) -> None:
        """Take one chunk."""
        self._chunks.append(samples)

    def arrays(self) -> dict[str, Array]:
        """All samples joined."""
        if not self._chunks:
            return {}
        return {k: np.concatenate([c[k] for c in self._chunks]) for k in self._chunks[0]}


@dataclass(frozen=True)
class Transient:
    """Samples of one run, first axis time.

    time (t,) s; eta (t, n); theta (t, A) rad used to place the pairs; masters (t, F, 2)
    independent rotations, rad, and their speeds, rad/s; torques (t, P) given torques and the
    brake's, N·m; output_speed rad/s; pair_load, pair_stiffness, pair_position (t, M, S);
    pair_tooth 0-based, −1 none; support_load (t, extra rows); direction (t, n_c, 3) of bearings
    with clearance; wanted (t, M); energy: name -> (t,) J (zero if not tracked); steps: number of
    steps taken.
    """

    modal: ModalSystem
    time: Array
    eta: Array
    theta: Array
    masters: Array
    torques: Array
    output_speed: Array
    pair_load: Array
    pair_tooth: NDArray[np.int16]
    pair_stiffness: Array
    pair_position: Array
    support_load: Array
    direction: Array
    wanted: NDArray[np.int64]
    energy: dict[str, Array]
    steps: int

    @property
    def carrier_angle(self) -> Array:
        """First independent rotation (t,), rad: the mean pin's in a single stage."""
        return np.asarray(self.masters[:, 0, 0])

    @property
    def carrier_speed(self) -> Array:
        """Its speed (t,), rad/s."""
        return np.asarray(self.masters[:, 0, 1])

    @property
    def input_torque(self) -> Array:
        """Torque on the first port (t,), N·m."""
        return np.asarray(self.torques[:, 0])

    @property
    def output_torque(self) -> Array:
        """Torque the brake takes (t,), N·m."""
        return np.asarray(self.torques[:, -1])


def step_data(modal: ModalSystem, sizes: float | Sequence[float]) -> StepData:
    """Constant arrays of one step size or a ladder of them (s): modal factors, receptances."""
    h = np.atleast_1d(np.asarray(sizes, dtype=float))
    omega2, p, brake = modal.omega**2, modal.channel_modes, modal.system.brake
    inverse = 1.0 / (1.0 + GAMMA * h[:, None] * modal.damping + BETA * h[:, None] ** 2 * omega2)
    displacement = np.empty((len(h), *modal.residual.shape))
    for r, size in enumerate(h):
        displacement[r] = (p * (BETA * size**2 * inverse[r])) @ p.T + modal.residual
    return StepData(
        h=h,
        omega2=omega2,
        damping=modal.damping,
        inverse=inverse,
        angles=modal.angles,
        masters=modal.masters,
        gyroscopic=modal.gyroscopic,
        centripetal=modal.centripetal,
        ports=len(modal.system.ports),
        channel_modes=np.ascontiguousarray(p),
        residual=modal.residual,
        displacement=displacement,
        brake_torque=brake.rated_torque,
        brake_speed=brake.rated_speed,
        brake_exponent=brake.exponent,
    )


def start_state(
    modal: ModalSystem,
    torque: float | Array,
    *,
    carrier_angle: float = 0.0,
    carrier_speed: float | None = None,
) -> State:
    """Equilibrium under given torques at ``carrier_angle`` plus rolling, rad and rad/s.

    torque: of the first port, or (P,) of all. The speed is that of the first independent
    rotation; it defaults to the one at which the brake law takes the torque, the others then
    follow in their rated proportion. The train's output torque of equilibrium and the brake's at
    that speed are then equal.
    """
    system, pairs = modal.system, modal.system.pairs
    given = np.asarray(torque, dtype=float)
    at_rest = revolution(modal, np.array([carrier_angle]), given[None] if given.ndim else given)
    speeds = system.rated_master_speeds
    if carrier_speed is None and system.brake.rated_torque == 0.0:
        share = 1.0
    elif carrier_speed is None:
        brake = system.brake
        ratio = float(at_rest.output_torque[0]) / brake.rated_torque
        share = 1.0
        if brake.exponent != 0.0:
            share = np.sign(ratio) * abs(ratio) ** (1 / brake.exponent)
            share *= brake.rated_speed / float(system.output @ system.rolling @ speeds)
    else:
        share = carrier_speed / speeds[0]
    n, count = modal.modes.shape[1], len(pairs.s0)
    touched = np.zeros((count, 8), dtype=np.uint8)
    for m in range(count):
        base = pairs.s0[m] + pairs.rate[m] * at_rest.theta[0, pairs.angle[m]]
        for s in range(SLOTS):
            if at_rest.pair_load[0, m, s] > 0:
                k = round((at_rest.pair_position[0, m, s] - base) / pairs.pitch[m])
                touched[m, k % 8] = 1
    return State(
        eta=at_rest.eta[0] + modal.rolling @ at_rest.masters[0],
        velocity=modal.rolling @ (speeds * share),
        acceleration=np.zeros(n),
        touched=touched,
        wanted=at_rest.wanted[0].copy(),
        torques=np.zeros(len(system.ports)),
        energy=np.zeros(len(ENERGIES)),
    )


@dataclass(frozen=True)
class Space:
    """Work space of the steps of one run; arrays are overwritten."""

    rows: PairRows
    near: Near
    work: Work
    ledger: Ledger


def work_space(modal: ModalSystem, track_energy: bool = False) -> Space:
    """Empty work space, with the account of energy or without."""
    rows = pair_rows(modal.system.pairs)
    count, nc, n = len(rows.kind), len(modal.channels), modal.modes.shape[1]
    size, ports = count + 2 + -(count + 2) % 8, len(modal.system.ports)  # whole blocks of 8
    near = near_channels(modal, *rows.blocks.shape)
    work = Work(
        **{name: np.zeros((size, size)) for name in ("matrix", "matrix_r", "small")},
        **{
            name: np.zeros(size)
            for name in ("right", "x", "delta", "rate", "damping", "brake", "brake_r")
        },
        active=np.zeros(size, dtype=np.int64),
        theta=np.zeros(len(modal.angles)),
        torques=np.zeros(ports),
        **{
            name: np.zeros(n)
            for name in ("acceleration", "free", "free_v", "push", "turning", "error")
        },
        motion=np.zeros(nc),
    )
    ledger = Ledger(
        rows=pair_rows(modal.system.pairs),
        booked=np.full(1 if track_energy else 0, -1, dtype=np.int64),
        old=np.zeros(nc),
        damping_load=np.zeros(count),
        fresh=np.zeros(count),
    )
    return Space(rows, near, work, ledger)


def _samples(modal: ModalSystem, count: int) -> Samples:
    pairs = modal.system.pairs
    meshes, system = len(pairs.s0), modal.system
    shape = (count, meshes, SLOTS)
    return Samples(
        eta=np.zeros((count, modal.modes.shape[1])),
        theta=np.zeros((count, len(system.angles))),
        masters=np.zeros((count, len(system.masters), 2)),
        torques=np.zeros((count, len(system.ports))),
        output_speed=np.zeros(count),
        pair_load=np.zeros(shape),
        pair_tooth=np.full(shape, -1, dtype=np.int16),
        pair_stiffness=np.zeros(shape),
        pair_position=np.zeros(shape),
        support_load=np.zeros((count, extra_rows(pairs))),
        direction=np.zeros((count, len(pairs.clearance_stiffness), 3)),
        energy=np.zeros((count, len(ENERGIES))),
        wanted=np.zeros((count, meshes), dtype=np.int64),
    )


def given_torques(modal: ModalSystem, drive: Drive, times: Array) -> Array:
    """(k, P − 1) torques on all ports but the braked one; a single one scales the rated others."""
    torque = np.asarray(drive.torque(times), dtype=np.float64)
    if torque.ndim == 1:
        rated = modal.system.rated_port_torques[:-1]
        others = np.outer(torque / modal.system.rated_torque, rated)
        others[:, 0] = torque
        torque = others
    return np.ascontiguousarray(torque)


def _start_torque(modal: ModalSystem, drive: Drive) -> float | Array:
    torque = np.asarray(drive.torque(np.array([0.0])), dtype=float)[0]
    return float(torque) if np.ndim(torque) == 0 else np.append(torque, 0.0)


@dataclass(frozen=True)
class Segment:
    """Equal steps between two times without a jump inside."""

    start: float
    time_step: float
    steps: int


def plan_segments(
    duration: float, time_step: float, jumps: Sequence[float], windows: Sequence[FineWindow]
) -> list[Segment]:
    """Cut [0, duration] at jumps and window edges; each piece gets a whole number of steps."""
    cuts = {0.0, duration, *jumps}
    for w in windows:
        cuts.update((w.start, w.stop))
    edges = sorted(c for c in cuts if 0.0 <= c <= duration)
    segments = []
    for a, b in pairwise(edges):
        if b - a < 1e-12:
            continue
        middle = 0.5 * (a + b)
        h = min([time_step, *(w.time_step for w in windows if w.start <= middle <= w.stop)])
        steps = max(1, int(np.ceil((b - a) / h - 1e-9)))
        segments.append(Segment(a, (b - a) / steps, steps))
    return segments


def transient(
    modal: ModalSystem,
    drive: Drive,
    *,
    duration: float,
    time_step: float,
    output_interval: float,
    windows: Sequence[FineWindow] = (),
    start: State | None = None,
    sink: Sink,
    track_energy: bool = False,
    progress: Callable[[float], None] | None = None,
) -> int:
    """Run from 0 to ``duration`` s; samples go to ``sink`` about every ``output_interval`` s.

    There is a sample at least once between two jumps or window edges.

    Returns the number of steps taken. Raises FlexgearError where a step has no solution.
    """
    if start is None:
        start = start_state(modal, _start_torque(modal, drive))
    pairs, space = modal.system.pairs, work_space(modal, track_energy)
    known: dict[float, StepData] = {}
    ladder = control(1)
    segments = plan_segments(duration, time_step, drive.jumps, windows)
    total, taken = sum(s.steps for s in segments), 0
    for segment in segments:
        h = segment.time_step
        data = known.setdefault(h, step_data(modal, h))
        times: Array = segment.start + h * np.arange(segment.steps + 1, dtype=np.float64)
        # the torque just after a jump, and just before the next one
        inside = times.copy()
        inside[0] += BESIDE * h
        inside[-1] -= BESIDE * h
        torque = given_torques(modal, drive, inside)
        if consistent_acceleration(
            data, 0, pairs, space.rows, start, torque[0], space.near, space.work, space.ledger
        ):
            raise FlexgearError(f"no consistent contact state at t = {segment.start:.6f} s")
        every = min(max(1, round(output_interval / h)), segment.steps)
        for first in range(0, segment.steps, CHUNK):
            last = min(first + CHUNK, segment.steps)
            saves = last // every - first // every
            samples = _samples(modal, saves)
            status, saved = advance(
                data, pairs, space.rows, start, torque[first + 1 : last + 1], every, first,
                samples, space.near, space.work, space.ledger, ladder,
            )  # fmt: skip
            if status:
                raise FlexgearError(
                    f"the contact problem has no solution at t = {times[first + status]:.6f} s; "
                    "a smaller time step may help"
                )
            if saved:
                index = (np.arange(first // every, last // every) + 1) * every
                sink.append(_named(times[index], samples))
            taken += last - first
            if progress is not None:
                progress(taken / total)
    return taken


def _named(time: Array, samples: Samples) -> dict[str, Array]:
    return {**samples._asdict(), "time": time}


def collected(modal: ModalSystem, arrays: dict[str, Array], steps: int) -> Transient:
    """A ``Transient`` from the arrays of a ``Collector`` (or of a stored run)."""
    a = dict(arrays)
    energy = a.pop("energy")
    return Transient(
        modal=modal,
        energy={name: energy[:, i] for i, name in enumerate(ENERGIES)},
        steps=steps,
        **a,  # type: ignore[arg-type]
    )
