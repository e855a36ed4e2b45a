"""Frequency response of a stage with all branches: forces and motions over speed or torque.

Curves of steady states with the period of the gear mesh (``analysis.continuation``) and of those
with twice the period that branch off, as a dataset.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexgear.analysis.continuation import Curve, branch, curves, ends_at, leaving_branch
from flexgear.analysis.curve_follower import Cut, state_between
from flexgear.analysis.harmonic_balance import SAMPLES, Balance, Orbit, converge
from flexgear.analysis.orbit import OrbitElements, orbit_elements
from flexgear.analysis.orbit_receptance import CondensedTrain, Range, condensed_train
from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError, InputError, echo
from flexgear.model.read import nearest
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.solve.angles import RATED_SHARES, REVERSED, lead_speed, range_words, share_range
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.dataset import result_attrs
from flexgear.solve.model import Model
from flexgear.solve.stability import turning_stages
from flexgear.solve.state_figures import MEASURES, START, Figures, State
from flexgear.solve.turning_points import (
    BRANCH,
    DOUBLED,
    TURNING,
    stability_changes,
    turning_points,
)

RANGE = (0.2, 1.5)  # speeds over rated speed by default
DOUBLINGS, MAX_DOUBLINGS = 1, 3  # of the gear-mesh period
MIN_HARMONICS, MAX_HARMONICS = 20, 40  # by default
FLANK_SAMPLES, MAX_SAMPLES = 512, 64  # per harmonic: of all flanks together, and of a period
BAND = 2.0  # highest harmonic at the lowest speed over the natural frequency of the gear mesh
PRECISE, MOST_ADDED = 5e-4, 8  # relative change of λ at a loss of stability; states there, at most
NEAR = 0.03  # distance over the range within which a state is near a turning point
FINER = "response, a state with twice as many harmonics"

CUTS = {
    "forces": "teeth hammer with forces that rise without bound; more damping limits them",
    "steps": "no steady state was found further on; try more harmonics or more damping",
    "states": "it has too many steady states; take a shorter range",
    "stopped": "stopped by the user; a range from there on has the rest, and maybe more curves",
}  # why a curve ends within the range


def response(
    model: Model,
    speeds: tuple[float, float] | None = None,
    *,
    torques: tuple[float, float] | None = None,
    speed: float = 1.0,
    torque: float = 1.0,
    stage: str = "",
    harmonics: int | None = None,
    doublings: int = DOUBLINGS,
    progress: Progress = silent,
) -> xr.Dataset:
    """Steady states over speed or torque, stable and unstable, with their turning points.

    speeds: lowest and highest over rated speed, at the share ``torque`` of rated torque; torques:
    lowest and highest over rated torque, at the share ``speed`` of rated speed. stage: the one
    whose gear meshes excite the train. harmonics: number of harmonics of the gear-mesh frequency;
    if left out enough to pass the natural frequency of gears on their gear mesh. doublings: number
    of successive period doublings that are followed. InputError for a range that includes zero and
    for a stage that is unknown or does not turn; FlexgearError where no steady state was found.
    """
    span = _range(speeds, torques, speed, torque)
    if not 0 <= doublings <= MAX_DOUBLINGS:
        remedy = f"from 0 to {MAX_DOUBLINGS}, e.g. 1"
        raise InputError("--doublings", str(doublings), "is out of range", remedy)
    number = _stage_number(model, stage)
    count = _harmonics(model, number, span, harmonics)
    progress(START, 0.0)
    # fewer samples per harmonic for many gear meshes; coast flanks where contact is one-sided
    one_sided = model.system.pairs.one_sided
    flanks = sum(label.stage == number for label in model.system.gear_meshes)
    per_harmonic = int(np.clip(FLANK_SAMPLES // flanks, SAMPLES, MAX_SAMPLES))
    elements = orbit_elements(model.modal, number, per_harmonic * count, one_sided)
    train = condensed_train(elements, count)
    figures = Figures(model, train, span, progress)
    resonance = model.pace.resonance / elements.frequency
    record = _Record()
    try:
        for curve in curves(train, span, figures.take, resonance, figures.beyond):
            record.add(curve)
            record.locate_changes(figures)
            figures.end_curve()
        if record.states:
            _add_leaving(figures, figures, record)
        for _ in range(doublings if record.states else 0):
            of_one, harmonics = figures.train.elements, figures.train.harmonics
            doubled = condensed_train(of_one.repeated(2), 2 * harmonics)
            longer = Figures(model, doubled, span, progress, figures.curve)
            _add_leaving(figures, longer, record)
            figures = longer
    except KeyboardInterrupt:  # interrupts within a curve end the curve
        if not record.states:
            raise
        record.cuts.append(Cut(span.value(record.states[-1].point), "stopped"))
    if not record.states:
        raise FlexgearError(
            "no steady state was found in this range: try another one, more --harmonics, or give "
            "the gear meshes damping"
        )
    return _dataset(figures, train, record, progress)


def _range(
    speeds: Sequence[float] | None, torques: Sequence[float] | None, speed: float, torque: float
) -> Range:
    """The range of speeds or torques; InputError where it is not one of positive numbers."""
    if speeds is not None and torques is not None:
        problem = "is given beside a range of speeds"
        remedy = "take one of them out: one is followed, the other fixed"
        raise InputError("--torque-range", range_words(torques), problem, remedy)
    over, ends = ("speed", speeds or RANGE) if torques is None else ("torque", torques)
    other, fixed = ("torque", torque) if torques is None else ("speed", speed)
    unused = speed if torques is None else torque
    if unused != 1.0:
        problem, remedy = f"is fixed, but the {over} is followed", f"give a range of {over}s alone"
        raise InputError(f"--{over}", f"{unused:g}", problem, remedy)
    low, high = share_range(over, ends)
    least, most = RATED_SHARES
    if not least <= fixed <= most:
        remedy = REVERSED if fixed < 0.0 else "e.g. 1, the rated one"
        problem = "is not positive" if fixed <= 0.0 else f"is not within {least:g} and {most:g}"
        raise InputError(f"--{other}", f"{fixed:g}", problem, remedy)
    return Range("load" if over == "torque" else "speed", low, high, fixed)


def _stage_number(model: Model, stage: str) -> int:
    names, turning = ([s.name for s in of] for of in (model.case.stages, turning_stages(model)))
    if not stage:
        return names.index(turning[0])
    if stage not in names:
        raise InputError(
            "--stage", echo(stage), "is not a stage of the case", nearest(stage, names)
        )
    if stage not in turning:
        raise InputError("--stage", echo(stage), "does not turn", "name one that does")
    return names.index(stage)


def _harmonics(model: Model, stage: int, span: Range, count: int | None) -> int:
    """Number of harmonics: ``count``, or by default up to ``BAND`` times the natural frequency of
    the gear mesh at the lowest speed. InputError for a number out of range."""
    if count is not None:
        if not 1 <= count <= 200:
            raise InputError("--harmonics", str(count), "is not from 1 to 200", "e.g. 20")
        return count
    lowest = span.low if span.over == "speed" else span.fixed
    base = model.flow.stages[stage].gear_mesh_frequency * lowest
    harmonics = math.ceil(BAND * model.pace.resonance / base)
    return int(np.clip(harmonics, MIN_HARMONICS, MAX_HARMONICS))


class _Record:
    """States of all curves in succession. branches: number of the curve of each state; leaving: by
    the index of a state, number of the curve that branches off after it."""

    def __init__(self) -> None:
        self.states, self.branches, self.cuts = list[State](), list[int](), list[Cut]()
        self.leaving = dict[int, int]()

    def add(self, curve: Curve) -> int:
        """Add a curve; returns its number, from 1."""
        number = max(self.branches, default=0) + 1
        states = [state for state in curve.states if isinstance(state, State)]
        self.states += states
        self.branches += [number] * len(states)
        self.cuts += curve.cuts
        return number

    def locate_changes(self, figures: Figures) -> None:
        """Insert states of the last curve, which are of the train of ``figures``, at its changes of
        stability away from turning points, until these move by less than ``PRECISE`` of λ. Between
        distant states the modulus of a multiplier is far from linear."""
        span, previous = figures.span, np.zeros(0)
        for _ in range(MOST_ADDED):
            parameter = np.array([span.value(state.point) for state in self.states])
            changes = [
                x for x in stability_changes(parameter, np.array(self.branches), self.arrays())
                if self.branches[x.before] == self.branches[-1] and x.kind != TURNING
            ]  # fmt: skip
            values = np.array([x.value for x in changes])
            for change in reversed(changes):
                if np.isclose(change.value, previous, rtol=PRECISE, atol=0.0).any():
                    continue
                before, after = self.states[change.before : change.before + 2]
                orbit = state_between(figures.train, span, before, after, change.value)
                distance = np.linalg.norm(after.unknown - before.unknown)
                if orbit is not None and all(
                    np.linalg.norm(orbit.unknown - x.unknown) <= distance for x in (before, after)
                ):  # else a state of another curve
                    self.states.insert(change.before + 1, figures.take(orbit))
                    self.branches.append(self.branches[-1])
            previous = values

    @property
    def stopped(self) -> bool:
        """Whether the user ended the search."""
        return any(cut.reason == "stopped" for cut in self.cuts)

    @property
    def longest(self) -> int:
        """Longest period of a state, in gear-mesh periods."""
        return max(state.values["response_period"] for state in self.states)

    def arrays(self) -> dict[str, Array]:
        """Variables over all states; amplitudes by the harmonics of the longest period."""
        out = {}
        for name in self.states[0].values:
            rows = [(s.values[name], s.values["response_period"]) for s in self.states]
            if name.endswith("_amplitude"):
                out[name] = np.array([np.kron(v, np.eye(self.longest // n)[-1:]) for v, n in rows])
            else:
                out[name] = np.array([v for v, _ in rows])
        return out


def _add_leaving(figures: Figures, longer: Figures, record: _Record) -> None:
    """Add to ``record`` the curves of the train of ``longer`` that branch off those of ``figures``:
    of twice the period, or of the same where both are the same."""
    train, span, period = figures.train, figures.span, figures.train.elements.gear_meshes
    kind = BRANCH if longer is figures else DOUBLED
    parameter, branches = np.array([span.value(s.point) for s in record.states]), record.branches
    ends = list[tuple[int, Orbit]]()
    for change in stability_changes(parameter, np.array(branches), record.arrays()):
        before, after = record.states[change.before : change.before + 2]
        if record.stopped or change.kind != kind or before.values["response_period"] != period:
            continue
        start = leaving_branch(train, longer.train, span, before, after, change.value)
        if start is None:
            continue
        same = (k for k, end in ends if ends_at(longer.train, span, end, start[0]))
        number = next(same, 0)
        if not number:
            left = [s for s, n in zip(record.states, branches, strict=True)
                    if kind == BRANCH and n == branches[change.before]]  # fmt: skip
            curve = branch(longer.train, span, *start, longer.take, left)
            if not curve.states:
                continue
            number = record.add(curve)
            record.locate_changes(longer)
            ends += [(number, curve.states[0]), (number, curve.states[-1])]
            longer.end_curve()
        record.leaving[change.before] = number


def _dataset(
    figures: Figures, train: CondensedTrain, record: _Record, progress: Progress
) -> xr.Dataset:
    """Dataset of all states; train: the one with the period of a gear mesh."""
    model, elements, span, states = figures.model, train.elements, figures.span, record.states
    speed = np.array([s.point.speed for s in states])
    load = np.array([s.point.load for s in states])
    parameter, branches = speed if span.over == "speed" else load, np.array(record.branches)
    arrays: dict[str, Any] = record.arrays()
    arrays |= {
        "response_speed_share": speed,
        "response_torque_share": load,
        "response_speed": speed * abs(lead_speed(model.case, model.flow)),
        "gear_mesh_frequency": speed * elements.frequency,
        "response_branch": branches,
    }
    arrays |= turning_points(parameter, branches, arrays, record.leaving)
    progress(FINER, 0.0)
    typical = None if record.stopped else _typical(states, parameter, arrays)
    change = _harmonics_change(train, typical)
    progress(FINER, 1.0)
    stage = model.case.stages[elements.stage].name
    linear = model.case.view(stage).gear_mesh.contact_law == "linear"
    attrs = {
        "stage": stage,
        "over": "speed" if span.over == "speed" else "torque",
        "harmonics": train.harmonics,
        "samples": elements.samples,
        "complete": int(not record.cuts),
        "cut": "\n".join(f"at {cut.value:.4g}: {CUTS[cut.reason]}" for cut in record.cuts),
        "left_out": "; ".join(elements.left_out),
        "doubling_change": change,
        "without_contact": "teeth pull, as contact is linear" if linear else "teeth lose contact",
    }
    names = tuple(model.gear_meshes.names[g] for g in figures.gear_meshes)
    labels = {"support": figures.supports, "measure": list(MEASURES)}
    labels |= {} if model.sensors is None else model.sensors.labels
    if record.longest > 1:
        orders = np.arange(1, train.harmonics * record.longest + 1) / record.longest
        labels["gear_mesh_order"] = orders.tolist()
    return labelled_dataset(
        "point", np.arange(len(states)), arrays, result_attrs(model, **attrs), labels, names
    )


def _typical(states: list[State], parameter: Array, arrays: dict[str, Any]) -> State | None:
    """The stable state with the largest force, of those with the period of a gear mesh that are not
    near a turning point; None where there is none."""
    turning = arrays["turning_point_parameter"]
    distance = np.abs(parameter[:, None] - turning).min(axis=1, initial=np.inf)
    eligible = (arrays["stable"] == 1) & (arrays["response_period"] == 1)
    eligible &= distance > NEAR * np.ptp(parameter)
    if not eligible.any():
        return None
    force = arrays["response_gear_mesh_force"][:, :, 0].max(axis=1)
    return states[int(np.argmax(np.where(eligible, force, -np.inf)))]


def _harmonics_change(train: CondensedTrain, state: State | None) -> float:
    """Largest change of a channel's motion over its range when the state is solved with twice as
    many harmonics; NaN without a state or convergence. Ranges below a millionth of the largest
    motion are rounding, in a train that its gear meshes do not excite."""
    if state is None:
        return math.nan
    old = train.elements
    flanks = bool((old.flanks > train.modal.system.pairs.carries).any())
    elements: OrbitElements = orbit_elements(old.modal, old.stage, 2 * old.samples, flanks)
    finer = condensed_train(elements, 2 * train.harmonics)
    balance = Balance(elements, finer.at(state.point))
    # (q', q) from the motion of old channels to that of new ones, flank by flank
    basis_change = np.zeros((len(elements.channels), len(old.channels)))
    for source in np.unique(elements.source):
        rows, columns = (np.flatnonzero(e.source == source) for e in (elements, old))
        part = elements.channels[rows] @ np.linalg.pinv(old.channels[columns])
        basis_change[np.ix_(rows, columns)] = part
    f, a = Balance(old, train.at(state.point)).parts(state.unknown)
    unknown = balance.unknowns(f @ np.linalg.pinv(basis_change), a)
    orbit = converge(balance, state.point, unknown)
    if orbit is None:
        return math.nan
    motion = state.waves.motion @ basis_change.T
    change = np.abs(orbit.waves.motion[::2] - motion).max(axis=0)
    rounding = 1e-6 * np.abs(motion).max()
    return float(np.max(change / np.maximum(np.ptp(motion, axis=0), rounding)))
