"""Campbell diagram: natural frequencies over speed, excitations, and their intersections."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.excitation import (
    ABSENT,
    MIXED,
    UNEVEN,
    LoadedGearMesh,
    decay,
    excited_index,
    folded,
    resonant_force,
)
from flexgear.analysis.flank_cycle import harmonics
from flexgear.analysis.linear_dynamics import Campbell, crossings, whirl_sense
from flexgear.analysis.linear_dynamics import campbell as whirl_over_speed
from flexgear.analysis.modes import Modes, planar_rows
from flexgear.arrays import Array, Ints
from flexgear.gears.expected_lines import PASS, TURN, bolt_counts, pass_lines, shaft_lines
from flexgear.model.arguments import Numbers, Positive
from flexgear.model.errors import InputError
from flexgear.model.machine import machines_of
from flexgear.model.names import BOLT_PASS, GEAR_MESH, PLANET_PASS, SHAFT, ExcitationName
from flexgear.results.labelled_dataset import coordinate, labelled_dataset
from flexgear.solve.angles import lead_speed, one_turn, stage_motions
from flexgear.solve.dataset import result_attrs, result_labels
from flexgear.solve.model import Model, rated_rotations
from flexgear.solve.modes import nodal_index

SHARE = 0.1  # least harmonic of gear-mesh stiffness over the stage's largest
LEAST = 1e-3  # least harmonic of gear-mesh stiffness over the mean
RESOLVED = 4  # least number of positions in a period of a harmonic
USUAL = (1, 2, 3)  # orders of gear meshes with constant stiffness
TURNS = (1, 2)  # orders of a shaft: unbalance and eccentricity, misalignment
SAME = 1e-9  # relative difference of equal frequencies


@dataclass(frozen=True)
class Excitation:
    """A line of the Campbell diagram.

    order: multiple of the frequency ``base``, Hz at rated speed; label: its name; share: amplitude
    of the gear-mesh stiffness over its mean, NaN if unknown; index: nodal index k excited in a
    stage of equal planets, −1 for excitations that equal planets do not have.
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
    """All excitation lines up to ``highest_hz`` at rated speed.

    orders: of all gear meshes. If left out, orders whose harmonic of gear-mesh stiffness is at
    least a tenth of the stage's largest and a thousandth of the mean; the first three if there are
    none (constant stiffness).
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
        for order in (o for o in chosen if o == 1 or o * base <= highest_hz):
            share = float(shares[int(order)]) if order in range(len(shares)) else math.nan
            index = excited_index(order, gear.teeth, stage.planets)
            name = ExcitationName.of(GEAR_MESH, stage.name, order)
            excited.append(Excitation(float(order), base, name, share, index))
    return (*excited, *_shaft_excitations(model))


def _shares(model: Model, stage: int) -> np.ndarray:
    """Largest |k_l|/k̄ of all gear meshes of a stage (number from 0), for orders l = 0, 1, …"""
    shares = [
        np.abs(harmonics(cycle.stiffness)) / cycle.stiffness.mean()
        for m, cycle in model.mean_springs.cycles.items()
        if model.system.gear_meshes[m].stage == stage
    ]
    if not shares:
        return np.zeros(1)
    largest = np.max(shares, axis=0)
    return largest[: 1 + 2 * (len(largest) - 1) // RESOLVED]


def _shaft_excitations(model: Model) -> Iterator[Excitation]:
    """Excitations by rotating shafts, one for each speed, by planets passing a place of their ring,
    and by what they feel of N_b bolts of an FE ring, which equal planets excite at k = N_b mod N.
    """
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
            rigid = {name.part for name in model.system.rigid_bodies if name.stage == stage.name}
            for count in () if "ring" in rigid else bolt_counts(stage):
                base = abs(flow.carrier_speed - flow.ring_speed) / TURN
                name = ExcitationName.of(BOLT_PASS, stage.name, count)
                if base > 0.0:
                    index = count % stage.planets
                    yield Excitation(float(count), base, name, index=index)


def operating_factors(model: Model) -> tuple[float, ...]:
    """Operating speeds over rated ones: 1, and for ports of given or controlled speed the constant
    speed, the speed of each step, or the last speed of a series."""
    factors = {1.0}
    for port, machine in zip(model.case.ports, machines_of(model.case), strict=True):
        rated = model.flow.speed[port.member]
        if machine is None or not machine.follows_speed or rated == 0.0:
            continue
        if machine.kind == "constant":
            speeds = [machine.steady(rated)]
        else:
            speeds = list(machine.values if machine.kind == "steps" else machine.values[-1:])
        factors |= {float(f"{abs(speed / rated):.9g}") for speed in speeds if speed != 0.0}
    return tuple(sorted(factors))


HIGHEST = 1.2  # highest speed of a diagram over the highest operating speed
STEPS = 12  # of speed in a diagram
MAX_MODES = 60  # that are followed over speed
MARGIN = 0.1  # least distance of an excitation from a natural frequency, over this frequency
ALIKE = 1e-3  # relative difference of frequencies of one group of modes
ROUNDING = 1e-9  # harmonic of the stiffness over its mean
IDEAL, ERRORS = "ideal", "errors"
UNCOUPLED = 1e-9  # force over the mean force, below which gear meshes do not excite a mode


# Types of the variables meeting_…, for modes near an excitation at an operating speed. index:
# nodal index min(k, N − k) of the mode in the excitation's stage, or a code (see ``excitation``);
# cause: IDEAL if the excitation occurs with equal planets, ERRORS if only with differences; force:
# amplitude of a gear mesh over its mean force at exact resonance, for ERRORS by the teeth of a
# single planet; NaN without variation of stiffness or without damping.
MEETING = {
    "factor": float, "excitation": str, "mode": int, "frequency": float, "away": float,
    "index": int, "cause": str, "force": float,
}  # fmt: skip


def campbell(
    model: Model,
    factors: Numbers | None = None,
    *,
    orders: Numbers | None = None,
    limit_hz: Positive | None = None,
    margin: Positive = MARGIN,
) -> xr.Dataset:
    """Frequencies over speed, orders of gear meshes and shafts, and their intersections.

    Frequencies are those in the frames of the bodies, with the mean stiffness of the gear meshes;
    without gyroscopic terms they do not depend on speed. factors: (s,) speeds over rated speed; if
    left out from zero to a fifth above the highest speed of the case; orders: of gear meshes, if
    left out those in their stiffness; limit_hz: highest frequency at zero speed; margin: share of a
    natural frequency within which an excitation at an operating speed counts as a resonance.
    """
    operating = operating_factors(model)
    if factors is None:
        factors = np.linspace(0.0, HIGHEST * operating[-1], STEPS + 1)
    chosen = None if orders is None else tuple(np.ravel(orders).astype(float))
    if chosen and not min(chosen) > 0.0:
        problem = "is no order of a gear mesh"
        raise InputError("--orders", f"{min(chosen):g}", problem, "give orders above zero")
    rest = model.natural_modes(limit_hz)
    diagram = _over_speed(model, np.unique(np.asarray(factors, dtype=float)), limit_hz)
    highest = limit_hz or float(diagram.frequencies.max(initial=0.0))
    lines = excitations(model, highest, chosen)
    intersections = crossings(diagram, [line.slope for line in lines])
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
            "crossing_factor": [c.factor for c in intersections],
            "crossing_frequency": [c.frequency for c in intersections],
            "crossing_mode": np.array([c.mode + 1 for c in intersections], dtype=np.int64),
            "crossing_excitation": np.array([lines[c.line].label for c in intersections], str),
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
    properties: dict[str, list[str] | list[float]] = {
        "excitation_stage": [line.label.stage for line in lines],
        "excitation_kind": [line.label.kind for line in lines],
        "excitation_order": [line.order for line in lines],
    }
    coords = {name: coordinate(name, "excitation", values) for name, values in properties.items()}
    return data.assign_coords(coords)


def _over_speed(model: Model, factors: Array, limit_hz: float | None) -> Campbell:
    """Whirl modes over speed factors; without gyroscopic and centripetal terms, modes at rest."""
    system, rest = model.system, model.natural_modes(limit_hz)
    planes, weights = planar_rows(system.mass, system.bodies)
    zero = np.zeros_like(system.mass)
    gyroscopic = zero if system.gyroscopic is None else system.gyroscopic
    centripetal = zero if system.centripetal is None else system.centripetal
    count = max(len(rest.frequencies), 1) if limit_hz else min(system.size, MAX_MODES)
    if np.any(gyroscopic) or np.any(centripetal):
        return whirl_over_speed(
            system.mass,
            system.stiffness + model.mean_springs.stiffness,
            gyroscopic,
            centripetal,
            factors,
            count=count,
            planes=planes,
            weights=weights,
        )
    ones, frequencies = np.ones((len(factors), 1)), rest.frequencies[:count]
    sense = whirl_sense(rest.shapes[:, :count].astype(complex), planes, weights)
    return Campbell(factors, frequencies * ones, sense * ones)


def _meetings(
    model: Model,
    rest: Modes,
    diagram: Campbell,
    lines: Sequence[Excitation],
    index: Ints,
    operating: Sequence[float],
    margin: float,
) -> Iterator[tuple[Any, ...]]:
    """Values of ``MEETING`` for every mode near an excitation at an operating speed."""
    structural = model.structural_decay(rest.shapes)
    rates = decay(structural, rest, model.mean_springs.cycles)
    for number, stage in enumerate(model.case.stages):
        lines_of_stage = [line for line in lines if line.label.stage == stage.name]
        groups = _groups(rest.frequencies, index[:, number])
        force, alone = _forces(model, stage.name, rest, rates, lines_of_stage, groups)
        bolts = [i for i, k in enumerate(lines_of_stage) if k.label.kind == BOLT_PASS]
        passing = set(bolts if _loaded(model, stage.name) else ())
        for factor in operating:
            at_speed = [np.interp(factor, diagram.factors, f) for f in diagram.frequencies.T]
            for i, line in enumerate(lines_of_stage):
                for g, group in enumerate(groups):
                    natural = float(np.mean([at_speed[j] for j in group]))
                    excited = factor * line.slope
                    distance = excited / natural - 1.0
                    k = int(index[group[0], number])
                    if abs(distance) <= margin and k != ABSENT:
                        cause = _cause(line, k, stage.planets)
                        if i in passing:
                            passing.remove(i)
                            force[i] = _bolt_force(model, number, line, rest, rates, groups)
                        size = float((force if cause == IDEAL else alone)[i, g])
                        if size < UNCOUPLED:
                            continue
                        size = size if size < math.inf else math.nan
                        for mode in group:
                            yield factor, line.label, mode + 1, excited, distance, k, cause, size


def _groups(frequencies: Array, index: Ints) -> list[Ints]:
    """Groups of elastic modes with equal frequency and nodal index, by their indices."""
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
    """IDEAL if a stage with equal planets excites modes of a nodal index, else ERRORS."""
    if excitation.label.kind not in (GEAR_MESH, BOLT_PASS):
        return ERRORS
    no_index = index in (MIXED, UNEVEN)
    return IDEAL if no_index or index == folded(excitation.index, planets) else ERRORS


def _forces(
    model: Model,
    stage: str,
    rest: Modes,
    rates: Array,
    lines: Sequence[Excitation],
    groups: Sequence[Ints],
) -> tuple[Array, Array]:
    """``resonant_force`` (lines, groups) by the lines of a stage, NaN for lines without variation
    of stiffness: by all planets together, and the largest one by a single planet."""
    out, alone = np.full((2, len(lines), len(groups)), math.nan)
    loaded = _loaded(model, stage)
    exciting = [i for i, line in enumerate(lines) if line.share >= ROUNDING]
    if loaded and exciting and groups:
        orders = [int(lines[i].order) for i in exciting]
        out[exciting] = resonant_force(rest, rates, loaded, orders, groups)
        single = [
            resonant_force(rest, rates, loaded, orders, groups, alone=planet)
            for planet in sorted({line.planet for line in loaded})
        ]
        alone[exciting] = np.max(single, axis=0)
    return out, alone


def _loaded(model: Model, stage: str) -> list[LoadedGearMesh]:
    """The gear meshes of a stage that carry load."""
    cycles, loaded = model.mean_springs.cycles, []
    for g, name in enumerate(model.gear_meshes.names):
        m = int(model.gear_meshes.carrying[g])
        if name.stage == stage and m in cycles and model.mean_forces[g] > 0.0:
            loaded.append(LoadedGearMesh(cycles[m], float(model.mean_forces[g]), name.planet))
    return loaded


POSITIONS = 4  # equilibria in a gear-mesh cycle, for the pass of bolts


def _bolt_force(
    model: Model, number: int, line: Excitation, rest: Modes, rates: Array, groups: Sequence[Ints]
) -> Array:
    """Amplitude of gear-mesh force over its mean at exact resonance with the pass of bolts, the
    largest of all gear meshes of a stage (number from 0) by groups of modes (g,).

    Equilibria at rated torque over a common period of teeth and bolts are, in modes, η(θ) with the
    harmonic η_b of the pass. A mode then moves by ω η_b/γ, which causes k̄ |Σ_j v̄ᵀφ_j ω_j η_bj/γ_j|.
    """
    stage, motion = model.case.stages[number], stage_motions(model.case, model.flow)[number]
    teeth, bolts = motion.cycle.per_turn, round(line.order)
    at = one_turn(
        motion, lead_speed(model.case, model.flow), POSITIONS, teeth // math.gcd(teeth, bolts)
    )
    equilibria = revolution(
        model.modal, rated_rotations(model.system, at), model.system.rated_torque
    )
    motions = equilibria.eta @ (rest.shapes.T @ (model.system.mass @ model.modal.modes)).T
    passes = np.exp(-2j * np.pi * bolts * np.arange(len(at)) / (POSITIONS * teeth))
    harmonic = 2.0 * passes @ motions / len(at)
    with np.errstate(divide="ignore", invalid="ignore"):
        resonant = 2 * np.pi * rest.frequencies * harmonic / rates
    loaded = _loaded(model, stage.name)
    closing = np.stack(
        [x.cycle.stiffness.mean() / x.force * x.cycle.closing(rest.shapes) for x in loaded]
    )
    sums = [np.abs(closing[:, group] @ resonant[group]).max() for group in groups]
    return np.nan_to_num(np.array(sums), nan=np.inf)


def crossing_rows(data: xr.Dataset) -> list[dict[str, Any]]:
    """Crossings of a Campbell diagram, one dictionary each."""
    keys = {"speed_factor": "factor", "frequency_hz": "frequency"}
    keys |= {"mode": "mode", "excitation": "excitation"}
    columns = (data[f"crossing_{name}"].to_numpy().tolist() for name in keys.values())
    return [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]
