"""Transient under machines at the ports: plans steps, runs them in chunks, passes samples on.

The run starts from static equilibrium plus rigid rotation of the train (``start``). At every jump
of a prescribed torque or speed the steps restart with a consistent acceleration, so that the
average-acceleration rule keeps its order; windows around jumps may have finer steps.

**Spurious energy.** Average acceleration conserves the energy of a linear system. Where contact
opens or closes within a step, the energy has an error of second order in the step, of either sign.
Without damping of the gear meshes this error remains, harder impacts have larger errors, and loads
may grow without limit. The residual of the energy balance (``energy.LEFT_OVER``) shows this: in
runs that converge it is about a thousandth of the elastic energy, or negative; otherwise it soon
exceeds the elastic energy several times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Solution, revolution
from flexgear.analysis.kernels.energy import ENERGIES, LEFT_OVER
from flexgear.analysis.kernels.step import RUNAWAY, advance
from flexgear.analysis.kernels.step_arrays import Samples, State, StepData
from flexgear.analysis.start import start_state
from flexgear.analysis.step_plan import Plan, Stepping
from flexgear.analysis.step_space import (
    consistent_acceleration,
    empty_samples,
    step_data,
    work_space,
)
from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import law_functions
from flexgear.coupling.machines import GivenSpeed
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import first_sizes
from flexgear.gears.error_cycle import longest_time_step
from flexgear.model.errors import FlexgearError

Prescribed = Callable[[Array], Array]
NO_JUMP = 1e-5  # change of a torque over the largest one below which it does not jump
BESIDE = 1e-3  # distance over a step at which values before and after a jump are evaluated


@dataclass(frozen=True)
class Drive:
    """Values prescribed to machines at the ports and to loads, as functions of times t (k,), s.

    prescribed(t): torque on the first port (k,), N·m, the others in rated proportion; or (k, P)
    torques, N·m, or speeds, rad/s, by the kind of each machine (ignored for brakes). rates(t):
    their rates of change (k, P) next to jumps, zero if left out. loads(t): factors (k, L) on the
    vectors of load histories (``PairData.load_history``), which are continuous; constant if left
    out.
    """

    prescribed: Prescribed
    rates: Prescribed | None = None
    loads: Prescribed | None = None


class Sink(Protocol):
    """Receiver of chunks of samples: arrays by name, with the samples along the first axis."""

    def append(self, samples: dict[str, Array]) -> None:
        """Receive one chunk."""


class Collector:
    """A sink that stores all samples in memory."""

    def __init__(self) -> None:
        self._chunks: list[dict[str, Array]] = []

    def append(self, samples: dict[str, Array]) -> None:
        """Receive one chunk."""
        self._chunks.append(samples)

    def arrays(self) -> dict[str, Array]:
        """All samples, by name."""
        if not self._chunks:
            return {}
        return {k: np.concatenate([c[k] for c in self._chunks]) for k in self._chunks[0]}


@dataclass(frozen=True)
class Transient(Solution):
    """Samples of one run.

    time (t,): s; input_motion (t, F, 2): independent rotations, rad, and their speeds, rad/s;
    speeds (t, P): of the ports, rad/s; energy: terms of the energy balance (t,) by name, J, zero if
    not tracked; steps: number of steps by size; is_output (t,): False for samples for sensors only.
    """

    time: Array
    input_motion: Array
    speeds: Array
    energy: dict[str, Array]
    steps: Steps
    is_output: NDArray[np.bool_]

    @property
    def input_angles(self) -> Array:
        """Independent rotations (t, F), rad."""
        return self.input_motion[:, :, 0]

    def outputs(self) -> Transient:
        """The transient without the samples that are for sensors only."""
        if self.is_output.all():
            return self
        arrays: dict[str, Any] = {
            f.name: value[self.is_output]
            for f in fields(self)
            if isinstance(value := getattr(self, f.name), np.ndarray)
        }
        energy = {name: values[self.is_output] for name, values in self.energy.items()}
        return replace(self, **arrays, energy=energy)


def prescribed_values(modal: ModalSystem, drive: Drive, times: Array) -> Array:
    """Prescribed values (k, P) of the machines at times (k,), s; see ``Drive``."""
    prescribed = np.asarray(drive.prescribed(times), dtype=np.float64)
    if prescribed.ndim == 1:
        prescribed = modal.system.proportional_torques(prescribed)
    return np.ascontiguousarray(prescribed)


def largest_rated_load(modal: ModalSystem) -> float:
    """Largest load of a tooth pair in equilibrium at rated torque, N."""
    return float(revolution(modal, 0.0, modal.system.rated_torque).pair_load.max())


@dataclass(frozen=True)
class Steps:
    """Numbers of steps taken, of steps repeated at half the size, and of steps by size, s."""

    taken: int
    refused: int
    by_size: dict[float, int]


def transient(
    modal: ModalSystem,
    drive: Drive,
    stepping: Stepping,
    *,
    start: State | None = None,
    sink: Sink,
    track_energy: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Steps:
    """Run over the time of ``stepping`` and pass samples to ``sink``. start: the initial state,
    updated in place to the final one; equilibrium if left out. track_energy: with the energy
    balance.

    Raises FlexgearError where a step has no solution, where the motion diverges or is not finite,
    and for steps too long for the gear-mesh period (``gears.error_cycle.longest_time_step``).
    """
    adaptive = stepping.adaptive
    if start is None:
        start = start_state(modal, prescribed_values(modal, drive, np.full(1, stepping.start))[0])
    _refuse_start(modal, start, stepping.time_step if adaptive is None else adaptive.longest)
    plans = stepping.plans() if adaptive is None else stepping.plans(largest_rated_load(modal))
    sizes = max((len(p.sizes) for p in plans), default=1)
    run = _Run(modal, drive, start, track_energy, sizes, sink)
    total, done, refused = sum(p.ticks for p in plans), 0, 0
    by_size: dict[float, int] = {}
    for plan in plans:
        for ticks in run.through(plan):
            done += ticks
            if progress is not None:
                progress(done / total)
        refused += int(plan.control.counts["refused"][0])
        for h, count in zip(plan.sizes, plan.control.by_level, strict=True):
            by_size[float(h)] = by_size.get(float(h), 0) + int(count)
    return Steps(sum(by_size.values()), refused, by_size)


def _refuse_start(modal: ModalSystem, start: State, time_step: float) -> None:
    """FlexgearError for a start that is not finite or a time step too long for its speed."""
    if not all(np.isfinite(part).all() for part in (start.eta, start.velocity)):
        raise FlexgearError("the motion to start from is not finite")
    pairs, system = modal.system.pairs, modal.system
    rated, first = system.theta(system.rated_input_speeds), modal.angles @ start.velocity
    speeds = np.maximum(np.abs(rated), np.abs(first))[pairs.angle]
    frequency = float((speeds * np.abs(pairs.rate) / pairs.pitch).max(initial=0.0))
    longest = longest_time_step(frequency)
    if time_step > longest * (1 + 1e-9):
        raise FlexgearError(
            f"a time step of {time_step:.3g} s is too long for a gear-mesh period of "
            f"{1 / frequency:.3g} s: take {longest:.3g} s or less"
        )


def _ran_away(modal: ModalSystem, time: float, step: float) -> FlexgearError:
    """The error for a diverging motion, with its likely cause and a remedy."""
    remedy = f"lower the time step of {step:.3g} s"
    if undamped_contact(modal):
        remedy += (
            ", or give the gear meshes damping: undamped teeth that part and hammer gain energy "
            "from pairs that come into contact under load"
        )
    return FlexgearError(
        f"the time stepping ran away at t = {time:.6g} s (motion is not finite, holds more than "
        f"{RUNAWAY:g} times the energy there was, or gains energy from nothing): {remedy}"
    )


class _Run:
    """A run: its state and work space from one time interval to the next."""

    def __init__(
        self, modal: ModalSystem, drive: Drive, state: State, energy: bool, sizes: int, sink: Sink
    ) -> None:
        self.modal, self.drive, self.state, self.sink = modal, drive, state, sink
        self.energy, self.energy_gain = energy, EnergyGain() if undamped_contact(modal) else None
        machines = enumerate(modal.system.machines)
        self.speed_ports = [p for p, machine in machines if isinstance(machine, GivenSpeed)]
        self.continues = bool(state.acceleration.any())  # from the last step of another run
        self.space = work_space(modal, energy or self.energy_gain is not None, sizes)
        self.step_data: dict[tuple[float, ...], StepData] = {}

    def through(self, plan: Plan) -> Iterator[int]:
        """Run one time interval; yields the number of ticks of each chunk."""
        h, laws = float(plan.sizes[0]), law_functions(self.modal.system.pairs)
        key = tuple(float(f"{size:.12g}") for size in plan.sizes)
        if key not in self.step_data:
            self.step_data[key] = step_data(self.modal, plan.sizes)
        data = self.step_data[key]
        self._restart(plan, data)
        for begin in range(0, plan.ticks, plan.chunk):
            end = min(begin + plan.chunk, plan.ticks)
            times = plan.start + h * np.arange(begin + 1, end + 1, dtype=np.float64)
            prescribed = self._prescribed_until(times, BESIDE * h if end == plan.ticks else 0.0)
            samples = empty_samples(self.modal, end // plan.every - begin // plan.every)
            status, saved = advance(
                data, laws, prescribed, begin, self.state, self.space, samples, plan.control,
            )  # fmt: skip
            if status < 0:
                raise _ran_away(self.modal, times[-status - 1], float(plan.sizes[-1]))
            if status:
                raise FlexgearError(
                    f"the contact problem has no solution at t = {times[status - 1]:.6f} s; "
                    "a smaller time step may help"
                )
            if saved:
                index = (np.arange(begin // plan.every, end // plan.every) + 1) * plan.every
                sample_times = plan.start + h * index.astype(np.float64)
                self._refuse_gain(sample_times, samples.energy, float(plan.sizes[-1]))
                is_output = index % (plan.every * plan.sparse) == 0
                self.sink.append(by_name(sample_times, samples, is_output))
            yield end - begin

    def _restart(self, plan: Plan, data: StepData) -> None:
        """Set the acceleration at the start of a time interval: that by its forces, or where the
        run continues another without a jump of torque, that of the last step."""
        continues, self.continues, state = self.continues, False, self.state
        acceleration, ports = state.acceleration.copy(), state.ports.copy()
        first = self._prescribed_at(plan.start, BESIDE * float(plan.sizes[0]))
        if consistent_acceleration(self.modal, data, state, first, self.space):
            raise FlexgearError(f"no consistent contact state at t = {plan.start:.6f} s")
        jump = np.abs(state.ports["torque"] - ports["torque"]).max(initial=0.0)
        if continues and jump <= NO_JUMP * np.abs(ports["torque"]).max(initial=0.0):
            state.acceleration[:], state.ports[:] = acceleration, ports

    def _prescribed_at(self, start: float, beside: float) -> Array:
        """Values (P + L,) of machines and loads for the step of zero duration at ``start``, after a
        jump there: evaluated ``beside`` s later; for given speeds their rates of change."""
        after, rates = np.array([start + beside]), self._rates(start + beside)
        prescribed: Array = prescribed_values(self.modal, self.drive, after)[0] - beside * rates
        prescribed[self.speed_ports] = rates[self.speed_ports]
        return np.r_[prescribed, self._loads(np.array([start]))[0]]

    def _prescribed_until(self, times: Array, beside: float) -> Array:
        """Values (k, P + L) of machines and loads at the ends of steps; the last ones before a jump
        there: evaluated ``beside`` s earlier."""
        before = times.copy()
        before[-1] -= beside
        prescribed = prescribed_values(self.modal, self.drive, before)
        prescribed[-1] += beside * self._rates(before[-1])
        return np.hstack([prescribed, self._loads(times)])

    def _loads(self, times: Array) -> Array:
        """Factors (k, L) on the vectors of load histories at times (k,), s."""
        if self.drive.loads is None:
            first = first_sizes(self.modal.system.pairs)
            return np.broadcast_to(first, (len(times), len(first)))
        return np.asarray(self.drive.loads(times), dtype=np.float64)

    def _rates(self, time: float) -> Array:
        """Rates of change (P,) of the prescribed values of machines, zero where not given."""
        if self.drive.rates is None:
            return np.zeros(len(self.modal.system.ports))
        return np.asarray(self.drive.rates(np.array([time]))[0])

    def _refuse_gain(self, times: Array, energy: Array, step: float) -> None:
        """FlexgearError where time steps generate energy; sets the energy balance (n, 9) to zero
        if it is not to be saved."""
        if self.energy_gain is None:
            return
        index = self.energy_gain.first_excess(energy)
        if index is not None:
            raise _ran_away(self.modal, times[index], step)
        if not self.energy:
            energy[:] = 0.0


def by_name(time: Array, samples: Samples, is_output: NDArray[np.bool_]) -> dict[str, Array]:
    """A chunk of samples at times (t,), s, by the names of the fields of ``Transient``."""
    arrays = samples._asdict() | samples.pairs._asdict()
    arrays |= {"time": time, "is_output": is_output}
    del arrays["pairs"]
    return arrays


def collected(modal: ModalSystem, arrays: dict[str, Array], steps: Steps) -> Transient:
    """The ``Transient`` from the arrays of a ``Collector`` or of a stored run."""
    energy = {name: arrays["energy"][:, i] for i, name in enumerate(ENERGIES)}
    return Transient(modal=modal, steps=steps, **{**arrays, "energy": energy})  # type: ignore[arg-type]


def run_in_memory(
    modal: ModalSystem, drive: Drive, stepping: Stepping, start: State | None = None, *,
    track_energy: bool = False,
) -> Transient:  # fmt: skip
    """The ``Transient`` of a run whose samples are all stored in memory; see ``transient``."""
    sink = Collector()
    steps = transient(modal, drive, stepping, start=start, sink=sink, track_energy=track_energy)
    return collected(modal, sink.arrays(), steps)


SIGNS = np.array([LEFT_OVER[name] for name in ENERGIES])
ELASTIC = [ENERGIES.index(name) for name in ("elastic", "pair_elastic")]
DISSIPATED = [ENERGIES.index(name) for name in ("damping_work", "pair_damping_work")]
ROUNDING = 1e-9  # over the largest term of the energy balance
MAX_GAIN = 3.0  # spurious energy over the mean elastic energy: three times as much doubles loads


def undamped_contact(modal: ModalSystem) -> bool:
    """Whether contact of teeth is one-sided and without damping."""
    pairs = modal.system.pairs
    damped = pairs.damping.any() or pairs.constant_damping.any()
    return bool(pairs.one_sided and not damped)


class EnergyGain:
    """Monitors the residual of a run's energy balance over its samples."""

    def __init__(self) -> None:
        self._first = self._elastic = 0.0
        self._samples = 0

    def first_excess(self, energy: Array) -> int | None:
        """Add energy balances (n, 9), J, of the next samples. Returns the index of the first one at
        which the run has gained more than ``MAX_GAIN`` times its mean elastic energy so far plus
        the energy dissipated by damping; None where there is none."""
        residual, elastic = energy @ SIGNS, energy[:, ELASTIC].sum(axis=1)
        if not self._samples and len(residual):
            self._first = float(residual[0])
        total = self._elastic + np.cumsum(elastic)
        mean = total / (self._samples + np.arange(1, len(residual) + 1))
        if len(residual):
            self._elastic, self._samples = float(total[-1]), self._samples + len(residual)
        rounding = ROUNDING * np.abs(energy).max(axis=1)
        allowed = MAX_GAIN * mean + energy[:, DISSIPATED].sum(axis=1) + rounding
        over = np.flatnonzero(residual - self._first > allowed)
        return int(over[0]) if len(over) else None
