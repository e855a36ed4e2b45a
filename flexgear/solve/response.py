"""Frequency response of a stage with all branches: forces and motions over speed or torque.

Curves of steady states that repeat with the gear mesh (``analysis.continuation``), with their
stability, as a dataset; and what of it a summary says: peaks, jumps, where teeth lose contact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from flexgear.analysis.continuation import Cut, Range, curves
from flexgear.analysis.harmonic_balance import SAMPLES, Balance, Orbit, converge
from flexgear.analysis.orbit import OrbitElements, orbit_elements
from flexgear.analysis.orbit_motion import recovery_of
from flexgear.analysis.orbit_receptance import CondensedTrain, condensed_train
from flexgear.analysis.stability import fewer_steps, monodromy, multipliers, vibrating
from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError, InputError, echo
from flexgear.model.read import nearest
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.solve.angles import RATED_SHARES, lead_speed
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.dataset import result_attrs, support_names
from flexgear.solve.model import Model
from flexgear.solve.turning_points import turning_points

MEASURES = ("maximum", "minimum", "mean", "rms")
RANGE = (0.2, 1.5)  # of rated speed, where nothing is asked for
FEWEST, MOST = 20, 40  # harmonics where none are asked for
FLANK_SAMPLES, FINE_SAMPLES = 512, 64  # a harmonic: of all flanks together, and at most
HIGHER = 2.0  # times the gear mesh's own frequency that harmonics reach at the lowest speed
LEAST_STEPS = (
    256  # of a period in which small disturbances are followed, if there are so many samples
)
BESIDE = 0.03  # of the range: what is beside a turning point
DOUBLING = "response, a state with twice as many harmonics"
REVERSED = (
    "shares of the rated ones are positive: turn round torques or speeds in the case, whose rated "
    "ones say which flanks carry"
)
STABLE = 1e-5  # by which a multiplier of a stable state may exceed one: undamped modes have one


CUTS = {
    "forces": "teeth hammer with forces that rise without bound; more damping limits them",
    "steps": "no steady state was found further on; try more harmonics or more damping",
    "states": "it has too many steady states; take a shorter range",
    "stopped": "stopped by the user; it goes on, and further curves were not looked for",
}  # what ends a curve within the range


@dataclass(frozen=True)
class State(Orbit):
    """A steady state without its arrays over time, with its row of the dataset by names of
    variables."""

    values: dict[str, Any]


def response(
    model: Model,
    *,
    speeds: tuple[float, float] | None = None,
    torques: tuple[float, float] | None = None,
    speed: float = 1.0,
    torque: float = 1.0,
    stage: str = "",
    harmonics: int | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Steady states over speeds at one torque, or over torques at one speed, all over rated.

    stage: whose gear meshes excite; the only one, or the first that turns; harmonics: of the
    gear-mesh frequency, H. InputError for a range through zero, a stage that is not there or does
    not turn; FlexgearError where no steady state was found.
    """
    span = _range(speeds, torques, speed, torque)
    number = _stage_number(model, stage)
    count = _harmonics(model, number, span, harmonics)
    elements = _elements(model, number, count)
    train = condensed_train(elements, count)
    figures = _Figures(model, train, span, progress)
    branches, states, cuts = list[int](), list[State](), list[Cut]()
    resonance = model.pace.resonance / elements.frequency
    try:
        for k, curve in enumerate(curves(train, span, figures.take, resonance), 1):
            of_curve = [state for state in curve.states if isinstance(state, State)]
            states += of_curve
            branches += [k] * len(of_curve)
            cuts += curve.cuts
            figures.end_curve()
    except KeyboardInterrupt:  # between two curves
        if not states:
            raise
        cuts.append(Cut(span.value(states[-1].point), "stopped"))
    if not states:
        raise FlexgearError(
            "no steady state was found in this range: try another one, more --harmonics, or give "
            "the gear meshes damping"
        )
    return _dataset(figures, states, np.array(branches), cuts, progress)


def _range(
    speeds: Sequence[float] | None, torques: Sequence[float] | None, speed: float, torque: float
) -> Range:
    """The range; InputError where it is no range of positive numbers."""
    if speeds is not None and torques is not None:
        raise InputError(
            "--torque-range", _words(torques), "is given beside a range of speeds",
            "take one of them out: one is followed, the other fixed",
        )  # fmt: skip
    over, ends = ("speed", speeds or RANGE) if torques is None else ("torque", torques)
    other, fixed = ("torque", torque) if torques is None else ("speed", speed)
    unused = speed if torques is None else torque
    if unused != 1.0:
        problem, remedy = f"is fixed, but the {over} is followed", f"give a range of {over}s alone"
        raise InputError(f"--{over}", f"{unused:g}", problem, remedy)
    low, high = sorted(map(float, ends))
    least, most = RATED_SHARES
    if most < high or 0.0 < low < least:
        problem = f"is not within {least:g} and {most:g} times the rated {over}"
    elif not (math.isfinite(low) and math.isfinite(high)) or low <= 0.0 <= high:
        problem = f"goes through zero {over}, or touches it"
    else:
        problem = "is below zero" if low < 0.0 else "" if low < high else "is no range"
    if problem:
        remedy = "take a range of one sign, over rated, e.g. 0.2 1.5"
        raise InputError(
            f"--{over}-range", _words(ends), problem, REVERSED if high < 0.0 else remedy
        )
    if not least <= fixed <= most:
        remedy = REVERSED if fixed < 0.0 else "e.g. 1, the rated one"
        problem = "is not positive" if fixed <= 0.0 else f"is not within {least:g} and {most:g}"
        raise InputError(f"--{other}", f"{fixed:g}", problem, remedy)
    return Range("load" if over == "torque" else "speed", low, high, fixed)


def _words(ends: Sequence[float]) -> str:
    return " ".join(f"{x:g}" for x in ends)


def _stage_number(model: Model, stage: str) -> int:
    names = [s.name for s in model.case.stages]
    turning = [k for k, s in enumerate(model.flow.stages) if s.gear_mesh_frequency > 0.0]
    if not turning:
        raise InputError(model.case.source, "inputs", "turn no gear mesh", "give a rated speed")
    if not stage:
        return turning[0]
    if stage not in names:
        raise InputError(
            "--stage", echo(stage), "is not a stage of the case", nearest(stage, names)
        )
    if names.index(stage) not in turning:
        raise InputError("--stage", echo(stage), "does not turn", "name one that does")
    return names.index(stage)


def _harmonics(model: Model, stage: int, span: Range, count: int | None) -> int:
    """``count``; if left out, as many as reach well above the natural frequency of the gear mesh
    at the lowest speed."""
    if count is not None:
        if not 1 <= count <= 200:
            raise InputError("--harmonics", str(count), "is not from 1 to 200", "e.g. 20")
        return count
    lowest = span.low if span.over == "speed" else span.fixed
    base = model.flow.stages[stage].gear_mesh_frequency * lowest
    return int(np.clip(math.ceil(HIGHER * model.pace.resonance / base), FEWEST, MOST))


def _elements(model: Model, stage: int, harmonics: int) -> OrbitElements:
    """Force elements over as many samples a harmonic as the number of gear meshes allows; with
    coast flanks where pairs only push."""
    one_sided = model.system.pairs.one_sided
    flanks = sum(label.stage == stage for label in model.system.gear_meshes)
    each = int(np.clip(FLANK_SAMPLES // flanks, SAMPLES, FINE_SAMPLES))
    return orbit_elements(model.modal, stage, each * harmonics, one_sided)


class _Figures:
    """Figures of every state of one train as it is found. Reports how much of the range each curve
    has passed; how many curves there are is not known before they are found."""

    def __init__(
        self, model: Model, train: CondensedTrain, span: Range, progress: Progress
    ) -> None:
        self.model, self.train, self.span, self._progress = model, train, span, progress
        elements = train.elements
        stage = model.case.stages[elements.stage].name
        self.gear_meshes = model.gear_meshes.of_stage(stage)
        carrying = model.gear_meshes.carrying[self.gear_meshes]
        opposite = model.system.pairs.opposite[carrying]
        self.rows = np.array([elements.mean_row(int(m)) for m in carrying])
        self.drive = elements.owner[:, :, None] == carrying
        self.coast = (elements.owner[:, :, None] == opposite) & (opposite >= 0)
        self.supports = support_names(model)
        self._curve, self._passed = 1, (math.inf, -math.inf)

    def end_curve(self) -> None:
        """Report the end of a curve; the next state is one of the next curve."""
        self._progress(f"response, curve {self._curve}", 1.0)
        self._curve, self._passed = self._curve + 1, (math.inf, -math.inf)

    def take(self, orbit: Orbit) -> State:
        """A state with its figures, without its arrays over time."""
        value, (low, high) = self.span.value(orbit.point), self._passed
        low, high = self._passed = min(low, value), max(high, value)
        share = (high - low) / (self.span.high - self.span.low)
        self._progress(f"response, curve {self._curve}", min(share, 0.999))
        values = {**self._stability(orbit), **self._of_gear_meshes(orbit), **self._recovered(orbit)}
        return State(**vars(orbit.light), values=values)

    def _stability(self, orbit: Orbit) -> dict[str, Any]:
        period = 1.0 / (self.train.elements.frequency * orbit.point.speed)
        elements, waves = self.train.elements, orbit.waves
        tangents = elements.tangents_around(*waves, period)
        steps = fewer_steps(tangents, max(SAMPLES * self.train.harmonics, LEAST_STEPS))
        largest = multipliers(monodromy(vibrating(self.train, orbit.point), period, steps))
        first = largest[0] if len(largest) else 0.0
        return {
            "stable": int(abs(first) <= 1.0 + STABLE),
            "multiplier_real": float(np.real(first)),
            "multiplier_imag": float(np.imag(first)),
        }

    def _of_gear_meshes(self, orbit: Orbit) -> dict[str, Any]:
        force = np.einsum("jn,jnm->jm", orbit.force, self.drive)
        coast_force = np.einsum("jn,jnm->jm", orbit.force, self.coast)
        closed = (orbit.displacement[:, :, None] > 0.0) & self.drive
        closing = orbit.waves.motion @ self.rows.T
        return {
            **_measured("response_gear_mesh_force", force - coast_force, self.train.harmonics),
            **_measured("response_transmission_error", closing, self.train.harmonics),
            "lost_contact_share": 1.0 - closed.any(axis=1).mean(axis=0),
            "back_contact_share": (coast_force > 0.0).mean(axis=0),
        }

    def _recovered(self, orbit: Orbit) -> dict[str, Any]:
        """Of bearings and sensors."""
        sensors, harmonics, out = self.model.sensors, self.train.harmonics, dict[str, Any]()
        if not self.supports and sensors is None:
            return out
        balance = Balance(self.train.elements, self.train.at(orbit.point))
        recovery = recovery_of(self.train, balance, orbit, self.model.outputs)
        if self.supports:
            forces = np.stack([recovery.link_force(name)[:, :2] for name in self.supports], axis=1)
            size = np.linalg.norm(forces, axis=2)
            out |= _measured("response_bearing_force", size, harmonics)
        if sensors is not None:
            signals = sensors.periodic(recovery, balance.receptance.omega)
            out |= _measured("response_sensor", signals, harmonics)
        return out


def _measured(name: str, values: Array, harmonics: int) -> dict[str, Array]:
    """Measures (k, 4) and amplitudes (k, H) of values (N, k) over a period."""
    mean = values.mean(axis=0)
    rms = np.sqrt(np.mean((values - mean) ** 2, axis=0))
    spectrum = 2.0 * np.abs(np.fft.rfft(values, axis=0))[1 : harmonics + 1] / len(values)
    measures = np.stack([values.max(axis=0), values.min(axis=0), mean, rms], axis=1)
    return {name: measures, f"{name}_amplitude": spectrum.T}


def _dataset(
    figures: _Figures, states: list[State], branches: Array, cuts: list[Cut], progress: Progress
) -> xr.Dataset:
    model, elements, span = figures.model, figures.train.elements, figures.span
    speed = np.array([s.point.speed for s in states])
    load = np.array([s.point.load for s in states])
    arrays = {name: np.array([s.values[name] for s in states]) for name in states[0].values}
    arrays |= {
        "response_speed_share": speed,
        "response_torque_share": load,
        "response_speed": speed * abs(lead_speed(model.case, model.flow)),
        "gear_mesh_frequency": speed * elements.frequency,
        "response_branch": branches,
    }
    parameter = speed if span.over == "speed" else load
    arrays |= turning_points(parameter, branches, arrays)
    stopped = any(cut.reason == "stopped" for cut in cuts)
    progress(DOUBLING, 0.0)
    change = math.nan if stopped else _doubling(figures.train, _typical(states, parameter, arrays))
    progress(DOUBLING, 1.0)
    attrs = {
        "stage": model.case.stages[elements.stage].name,
        "over": "speed" if span.over == "speed" else "torque",
        "harmonics": figures.train.harmonics,
        "samples": elements.samples,
        "complete": int(not cuts),
        "cut": "\n".join(f"at {cut.value:.4g}: {CUTS[cut.reason]}" for cut in cuts),
        "left_out": "; ".join(elements.left_out),
        "doubling_change": change,
    }
    names = tuple(model.gear_meshes.names[g] for g in figures.gear_meshes)
    labels = {"support": figures.supports, "measure": list(MEASURES)}
    labels |= {} if model.sensors is None else model.sensors.labels
    return labelled_dataset(
        "point", np.arange(len(states)), arrays, result_attrs(model, **attrs), labels, names
    )


def _typical(states: list[State], parameter: Array, arrays: dict[str, Any]) -> State | None:
    """The stable state of the largest force that is not beside a turning point."""
    turning = arrays["turning_point_parameter"]
    distance = np.abs(parameter[:, None] - turning).min(axis=1, initial=np.inf)
    free = (arrays["stable"] == 1) & (distance > BESIDE * np.ptp(parameter))
    if not free.any():
        return None
    force = arrays["response_gear_mesh_force"][:, :, 0].max(axis=1)
    return states[int(np.argmax(np.where(free, force, -np.inf)))]


def _between_bases(new: OrbitElements, old: OrbitElements) -> Array:
    """Motion of new channels by that of old ones (q', q), flank by flank."""
    out = np.zeros((len(new.channels), len(old.channels)))
    for source in np.unique(new.source):
        at, of = np.flatnonzero(new.source == source), np.flatnonzero(old.source == source)
        out[np.ix_(at, of)] = new.channels[at] @ np.linalg.pinv(old.channels[of])
    return out


def _doubling(train: CondensedTrain, state: State | None) -> float:
    """Largest change of a channel's motion over its range as harmonics double in a state; NaN
    without one, or where none is near with twice as many. Ranges below a millionth of the largest
    motion are rounding, of a train that its gear meshes do not excite."""
    if state is None:
        return math.nan
    old = train.elements
    flanks = bool((old.flanks > train.modal.system.pairs.carries).any())
    elements: OrbitElements = orbit_elements(old.modal, old.stage, 2 * old.samples, flanks)
    finer = condensed_train(elements, 2 * train.harmonics)
    balance = Balance(elements, finer.at(state.point))
    mixed = _between_bases(elements, old)
    f, a = Balance(old, train.at(state.point)).parts(state.unknown)
    unknown = balance.together(f @ np.linalg.pinv(mixed), a)
    orbit = converge(balance, state.point, unknown)
    if orbit is None:
        return math.nan
    motion = state.waves.motion @ mixed.T
    away = np.abs(orbit.waves.motion[::2] - motion).max(axis=0)
    rounding = 1e-6 * np.abs(motion).max()
    return float(np.max(away / np.maximum(np.ptp(motion, axis=0), rounding)))
