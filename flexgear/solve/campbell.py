"""Campbell diagram: frequencies over speed, what excites a train, and what meets where."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.analysis.excitation import (
    ABSENT,
    MIXED,
    UNEVEN,
    Loaded,
    decay,
    excited_index,
    folded,
    resonant_force,
)
from flexgear.analysis.linear_dynamics import Campbell, crossings, whirl_sense
from flexgear.analysis.linear_dynamics import campbell as whirl_over_speed
from flexgear.analysis.modes import Modes, planar_rows
from flexgear.arrays import Array, Ints
from flexgear.gears.expected_lines import PASS, pass_lines, shaft_lines
from flexgear.model.machine import machines_of
from flexgear.model.names import GEAR_MESH, PLANET_PASS, SHAFT, ExcitationName
from flexgear.results.labelled_dataset import coordinate, labelled_dataset
from flexgear.solve.dataset import result_attrs, result_labels
from flexgear.solve.model import Model
from flexgear.solve.modes import nodal_index

SHARE = 0.1  # of the stage's largest harmonic of gear-mesh stiffness
LEAST = 1e-3  # of the mean stiffness
RESOLVED = 4  # positions of the cycle for a harmonic that counts
USUAL = (1, 2, 3)  # orders of gear meshes whose stiffness tells none
TURNS = (1, 2)  # orders of a shaft's turn: unbalance and eccentricity, misalignment
SAME = 1e-9  # relative, of frequencies that are one


@dataclass(frozen=True)
class Excitation:
    """A line of the Campbell diagram.

    order: of the base frequency, Hz at rated speed; label: its name; share: amplitude of the
    gear-mesh stiffness over its mean, NaN where nothing is known of it; index: k that it drives in
    a stage of equal planets, −1 where it drives none of equal parts.
    """

    order: float
    base: float
    label: ExcitationName
    share: float = math.nan
    index: int = -1

    @property
    def slope(self) -> float:
        """Frequency at rated speed, Hz."""
        return self.order * self.base


def excitations(
    model: Model, highest_hz: float, orders: tuple[float, ...] | None = None
) -> tuple[Excitation, ...]:
    """All lines up to ``highest_hz`` at rated speed.

    orders: of all gear meshes; those that their stiffness shows unless given: at least a tenth of
    the stage's largest harmonic and a thousandth of the mean. Where there is none (constant
    stiffness, or overlap that makes it so), the first three.
    """
    excited: list[Excitation] = []
    for number, stage in enumerate(model.case.stages):
        base = model.flow.stages[number].gear_mesh_frequency
        if base <= 0.0:
            continue
        shares, gear = _shares(model, number), stage.pinion or stage.sun
        assert gear is not None  # a stage is parallel or has a sun
        least = max(SHARE * shares[1:].max(initial=0.0), LEAST)
        excited_orders = [float(o) for o in range(1, len(shares)) if shares[o] >= least]
        chosen = (excited_orders or USUAL) if orders is None else orders
        usual = [o for o in chosen if o == 1 or o * base <= highest_hz]
        for order in usual:
            share = float(shares[int(order)]) if order in range(len(shares)) else math.nan
            index = excited_index(order, gear.teeth, stage.planets)
            name = ExcitationName.of(GEAR_MESH, stage.name, order)
            excited.append(Excitation(float(order), base, name, share, index))
    return (*excited, *_turning(model))


def _shares(model: Model, stage: int) -> np.ndarray:
    """Largest |k_l|/k̄ of any gear mesh of a stage by order from 0 on."""
    shares = [
        np.abs(cycle.harmonic_stiffness()) / cycle.stiffness.mean()
        for m, cycle in model.mean_springs.cycles.items()
        if model.system.gear_meshes[m].stage == stage
    ]
    if not shares:
        return np.zeros(1)
    largest = np.max(shares, axis=0)
    return largest[: 1 + 2 * (len(largest) - 1) // RESOLVED]


def _turning(model: Model) -> Iterator[Excitation]:
    """Shafts that turn, those of one speed once, and planets that pass a place of their ring."""
    bases = list[float]()
    for stage, flow in zip(model.case.stages, model.flow.stages, strict=True):
        for line in shaft_lines(stage, flow):
            base = line.frequency
            if base == 0.0 or any(abs(base - other) <= SAME * base for other in bases):
                continue
            bases.append(base)
            for order in TURNS:
                name = ExcitationName.of(SHAFT, stage.name, order, line.label)
                yield Excitation(float(order), base, name)
        if stage.kind == "planetary":
            for line in pass_lines(stage, flow, flow.ring_speed):
                if line.row == PASS and line.frequency > 0.0:
                    name = ExcitationName.of(PLANET_PASS, stage.name, 1)
                    yield Excitation(1.0, line.frequency, name)


def operating_factors(model: Model) -> tuple[float, ...]:
    """Speeds over the rated ones at which the case runs for long: rated, and where the speed of a
    port is given or controlled its constant speed, each of its steps, the last one of a series."""
    factors = {1.0}
    for port, machine in zip(model.case.ports, machines_of(model.case), strict=True):
        rated = model.flow.speed[port.member]
        if machine is None or not machine.follows_speed or rated == 0.0:
            continue
        if machine.kind == "constant":
            held = [machine.steady(rated)]
        else:
            held = list(machine.values if machine.kind == "steps" else machine.values[-1:])
        factors |= {float(f"{abs(speed / rated):.9g}") for speed in held if speed != 0.0}
    return tuple(sorted(factors))


HIGHEST = 1.2  # of the highest speed at which the case runs, where a diagram ends
STEPS = 12  # of speed in a diagram
MOST_MODES = 60  # that are followed over speed
MARGIN = 0.1  # of a natural frequency: what an excitation keeps off it
ALIKE = 1e-3  # relative, of frequencies of one pair
NOTHING = 1e-9  # of the mean stiffness: a harmonic that is rounding
IDEAL, ERRORS = "ideal", "errors"
UNCOUPLED = 1e-9  # of the mean gear-mesh force: the rounding of modes that gear meshes cannot reach


# A mode that an excitation lies near at an operating speed, by the names of variables meeting_…
# index: min(k, N − k) of the mode in the excitation's stage, or why it has none; cause: IDEAL where
# a stage of equal planets is excited, ERRORS where it takes something unequal; force: amplitude of
# a gear mesh over its mean force if they met exactly, and where it takes errors if a single
# planet's teeth pushed; NaN where the stiffness or the damping tells none.
MEETING = {
    "factor": float, "excitation": str, "mode": int, "frequency": float, "away": float,
    "index": int, "cause": str, "force": float,
}  # fmt: skip


def campbell(
    model: Model,
    *,
    factors: ArrayLike | None = None,
    orders: ArrayLike | None = None,
    limit_hz: float | None = None,
    margin: float = MARGIN,
) -> xr.Dataset:
    """Frequencies over speed factors, orders of gear meshes and shafts, and where they meet.

    In the frames in which bodies are described, with the mean stiffness of the gear meshes; where
    the train has no gyroscopic terms the frequencies do not depend on speed. factors: of rated
    speed, from rest to a fifth above the highest at which the case runs; orders: of gear meshes,
    those that their stiffness shows unless given (see ``excitations``); limit_hz: highest
    frequency at rest that is followed; margin: share of a natural frequency within which an
    excitation at an operating speed is a meeting.
    """
    operating = operating_factors(model)
    if factors is None:
        factors = np.linspace(0.0, HIGHEST * operating[-1], STEPS + 1)
    chosen = None if orders is None else tuple(np.ravel(orders).astype(float))
    rest = model.natural_modes(limit_hz)
    diagram = _over_speed(model, np.unique(np.asarray(factors, dtype=float)), limit_hz)
    highest = limit_hz or float(diagram.frequencies.max(initial=0.0))
    lines = excitations(model, highest, chosen)
    met = crossings(diagram, [line.slope for line in lines])
    count = diagram.frequencies.shape[1]
    rest = Modes(rest.frequencies[:count], rest.shapes[:, :count], rest.energy)
    index = nodal_index(model, rest.shapes)
    meetings = list(_meetings(model, rest, diagram, lines, index, operating, margin))
    data = labelled_dataset(
        "speed_factor",
        diagram.factors,
        {
            "campbell_frequency": diagram.frequencies,
            "whirl": diagram.sense,
            "campbell_nodal_index": index,
            "excitation_slope": [line.slope for line in lines],
            "excitation_share": [line.share for line in lines],
            "excitation_index": np.array([line.index for line in lines], dtype=np.int64),
            "crossing_factor": [c.factor for c in met],
            "crossing_frequency": [c.frequency for c in met],
            "crossing_mode": np.array([c.mode + 1 for c in met], dtype=np.int64),
            "crossing_excitation": np.array([lines[c.line].label for c in met], dtype=str),
            **{
                f"meeting_{name}": np.array([row[k] for row in meetings], dtype=kind)
                for k, (name, kind) in enumerate(MEETING.items())
            },
        },
        result_attrs(
            model,
            gyroscopic=int(model.system.gyroscopic is not None),
            margin=margin,
            operating_factors=list(operating),
            planets=[stage.planets for stage in model.case.stages],
        ),
        {**result_labels(model), "excitation": [line.label for line in lines]},
    )
    of_lines: dict[str, list[str] | list[float]] = {
        "excitation_stage": [line.label.stage for line in lines],
        "excitation_kind": [line.label.kind for line in lines],
        "excitation_order": [line.order for line in lines],
    }
    coords = {name: coordinate(name, "excitation", values) for name, values in of_lines.items()}
    return data.assign_coords(coords)


def _over_speed(model: Model, factors: Array, limit_hz: float | None) -> Campbell:
    """Whirl modes over speed; without forces of turning frames those at rest serve for all."""
    system, rest = model.system, model.natural_modes(limit_hz)
    planes, weights = planar_rows(system.mass, system.bodies)
    nothing = np.zeros_like(system.mass)
    turning = nothing if system.gyroscopic is None else system.gyroscopic
    pushing = nothing if system.centripetal is None else system.centripetal
    count = max(len(rest.frequencies), 1) if limit_hz else min(system.size, MOST_MODES)
    if np.any(turning) or np.any(pushing):
        return whirl_over_speed(
            system.mass,
            system.stiffness + model.mean_springs.stiffness,
            turning,
            pushing,
            factors,
            count=count,
            planes=planes,
            weights=weights,
        )
    times, frequencies = np.ones((len(factors), 1)), rest.frequencies[:count]
    sense = whirl_sense(rest.shapes[:, :count].astype(complex), planes, weights)
    return Campbell(factors, frequencies * times, sense * times)


def _meetings(
    model: Model,
    rest: Modes,
    diagram: Campbell,
    lines: Sequence[Excitation],
    index: Ints,
    operating: Sequence[float],
    margin: float,
) -> Iterator[tuple[Any, ...]]:
    """Rows of ``MEETING`` at the operating speeds, by stage and order, one for every mode."""
    structural = model.structural_decay(rest.shapes)
    rates = decay(structural, rest, model.mean_springs.cycles)
    for number, stage in enumerate(model.case.stages):
        lines_of_stage = [line for line in lines if line.label.stage == stage.name]
        groups = _groups(rest.frequencies, index[:, number])
        force, alone = _forces(model, stage.name, rest, rates, lines_of_stage, groups)
        for factor in operating:
            at_speed = [np.interp(factor, diagram.factors, f) for f in diagram.frequencies.T]
            for i, line in enumerate(lines_of_stage):
                for g, group in enumerate(groups):
                    natural = float(np.mean([at_speed[j] for j in group]))
                    excited = factor * line.slope
                    away = excited / natural - 1.0
                    k = int(index[group[0], number])
                    if abs(away) <= margin and k != ABSENT:
                        cause = _cause(line, k, stage.planets)
                        raised = float((force if cause == IDEAL else alone)[i, g])
                        if raised < UNCOUPLED:  # no tooth moves in it
                            continue
                        raised = raised if raised < math.inf else math.nan
                        for mode in group:
                            yield factor, line.label, mode + 1, excited, away, k, cause, raised


def _groups(frequencies: Array, index: Ints) -> list[Ints]:
    """Indices of elastic modes of one frequency and nodal index."""
    groups: list[list[int]] = []
    for i in np.flatnonzero(frequencies > 0.0):
        last = groups[-1] if groups else []
        near = bool(last) and frequencies[i] - frequencies[last[0]] <= ALIKE * frequencies[i]
        if near and index[i] == index[last[0]]:
            last.append(int(i))
        else:
            groups.append([int(i)])
    return [np.array(group, dtype=np.int64) for group in groups]


def _cause(excitation: Excitation, index: int, planets: int) -> str:
    """Whether a stage whose planets are equal excites modes of that index."""
    if excitation.label.kind != GEAR_MESH:
        return ERRORS
    free = index in (MIXED, UNEVEN)
    return IDEAL if free or index == folded(excitation.index, planets) else ERRORS


def _forces(
    model: Model,
    stage: str,
    rest: Modes,
    rates: Array,
    lines: Sequence[Excitation],
    groups: Sequence[Ints],
) -> tuple[Array, Array]:
    """``resonant_force`` of the lines of a stage (lines, groups), NaN of those without a share: of
    all planets together, and the largest that one of them raises alone."""
    out, alone = np.full((2, len(lines), len(groups)), math.nan)
    cycles, loaded = model.mean_springs.cycles, []
    for g, name in enumerate(model.gear_meshes.names):
        m = int(model.gear_meshes.carrying[g])
        if name.stage == stage and m in cycles and model.mean_forces[g] > 0.0:
            loaded.append(Loaded(cycles[m], float(model.mean_forces[g]), name.planet))
    exciting = [i for i, line in enumerate(lines) if line.share >= NOTHING]
    if loaded and exciting and groups:
        orders = [int(lines[i].order) for i in exciting]
        out[exciting] = resonant_force(rest, rates, loaded, orders, groups)
        single = [
            resonant_force(rest, rates, loaded, orders, groups, alone=planet)
            for planet in sorted({line.planet for line in loaded})
        ]
        alone[exciting] = np.max(single, axis=0)
    return out, alone


def crossing_rows(data: xr.Dataset) -> list[dict[str, Any]]:
    """Crossings of a Campbell diagram as plain rows."""
    keys = {"speed_factor": "factor", "frequency_hz": "frequency"}
    keys |= {"mode": "mode", "excitation": "excitation"}
    columns = (data[f"crossing_{name}"].to_numpy().tolist() for name in keys.values())
    return [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]
