"""Parametric instability of a train over speed: growth rates, and bands of speed with what acts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from flexgear.analysis.excitation import PeriodicTrain, acting_modes
from flexgear.arrays import Array, Ints
from flexgear.model.errors import InputError
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.solve.angles import share_range
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.campbell import HIGHEST, MAX_MODES, operating_factors
from flexgear.solve.dataset import result_attrs, result_labels
from flexgear.solve.linear import structural_damping
from flexgear.solve.model import Model

SPEEDS = 121  # evenly spread over the range
LOWEST = 0.1  # of the highest speed, where a range begins unless given
ORDERS = 8  # of the gear-mesh frequency, whose bands are expected
EDGE = 1e-5  # of a speed, to which the end of a band is found


@dataclass(frozen=True)
class Band:
    """A range of speed factors in which vibration of a stage grows. peak: where fastest; growth
    there, 1/s; modes: numbers (i, j) from 1; order: l of l ω_z ≈ ω_i + ω_j."""

    stage: str
    lower: float
    upper: float
    peak: float
    growth: float
    modes: tuple[int, int]
    order: int


def stability(
    model: Model,
    speeds: tuple[float, float] | None = None,
    *,
    count: int = SPEEDS,
    limit_hz: float | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Growth of free vibration under varying gear-mesh stiffness, stage by stage.

    Stage by stage the stiffness of its gear meshes varies over their cycle, of the tooth pairs that
    touch under rated torque without errors, and all other gear meshes have their mean; no pair
    comes loose. speeds: of rated speed, lowest and highest, up to a fifth above the highest at
    which the case runs if left out; count: of speeds, with more where bands are expected; limit_hz:
    highest natural frequency of the modes that are kept, at most ``MAX_MODES`` of them. InputError
    for a range or limit that cannot be.
    """
    model.case.require_load()
    first, last = speed_range(model, speeds)
    numbers, shapes, omega = kept_modes(model, limit_hz)
    stages = [s for s in model.flow.stages if s.gear_mesh_frequency > 0.0]
    trains = [train_in_modes(model, s.name, shapes, omega) for s in stages]
    factors = np.unique(
        np.concatenate(
            [np.linspace(first, last, count), *(_near(t, first, last, count) for t in trains)]
        )
    )
    growth = np.zeros((len(factors), len(trains)))
    largest = np.zeros_like(growth)
    bands: list[Band] = []
    for g, (stage, train) in enumerate(zip(stages, trains, strict=True)):
        for k, factor in enumerate(factors):
            growth[k, g], multiplier, _ = train.fastest(float(factor))
            largest[k, g] = abs(multiplier)
            progress("speeds", (g + (k + 1) / len(factors)) / len(trains))
        name = stage.name
        bands += [replace(b, stage=name) for b in _bands(train, factors, growth[:, g], numbers)]
    return labelled_dataset(
        "speed_factor",
        factors,
        {
            "growth_rate": growth,
            "largest_multiplier": largest,
            "stage_gear_mesh_frequency": [s.gear_mesh_frequency for s in stages],
            "kept_frequency": omega / (2 * np.pi),
            "band_stage": np.array([b.stage for b in bands], dtype=str),
            "band_lower_factor": [b.lower for b in bands],
            "band_upper_factor": [b.upper for b in bands],
            "band_peak_factor": [b.peak for b in bands],
            "band_growth_rate": [b.growth for b in bands],
            "band_modes": np.array([b.modes for b in bands], dtype=np.int64).reshape(-1, 2),
            "band_order": np.array([b.order for b in bands], dtype=np.int64),
        },
        result_attrs(model, operating_factors=list(operating_factors(model))),
        {
            **result_labels(model),
            "turning_stage": [s.name for s in stages],
            "kept_mode": numbers.tolist(),
        },
    )


def speed_range(model: Model, speeds: tuple[float, float] | None) -> tuple[float, float]:
    """Lowest and highest speed factor."""
    highest = HIGHEST * operating_factors(model)[-1]
    if speeds is None:
        return LOWEST * highest, highest
    return share_range("speed", speeds)


def kept_modes(model: Model, limit_hz: float | None) -> tuple[Ints, Array, Array]:
    """Numbers (n,) from 1, shapes (d, n) and ω (n,) of the elastic modes that are kept."""
    flexible = not all(body.rigid for body in model.system.bodies)
    reached = model.pace.reduction_limit if flexible else math.inf
    if limit_hz is not None and not 0.0 < limit_hz <= reached:
        problem = "is not positive"
        if limit_hz > reached:
            problem = f"is beyond what the modes of the bodies reach, {reached:.4g} Hz"
        remedy = (
            "e.g. 500" if reached == math.inf else "lower it, or raise solver.reduction_limit_hz"
        )
        raise InputError("--limit-hz", f"{limit_hz:g}", problem, remedy)
    if limit_hz is None and flexible:
        limit_hz = model.pace.band
    rest = model.natural_modes(limit_hz)
    elastic = np.flatnonzero(rest.frequencies > 0.0)[:MAX_MODES]
    if not len(elastic) or (limit_hz is not None and rest.frequencies[elastic[0]] > limit_hz):
        raise InputError(
            "--limit-hz", f"{limit_hz:g}", "no natural mode lies below", "raise it, see modes"
        )
    return (
        elastic.astype(np.int64) + 1,
        rest.shapes[:, elastic],
        2 * np.pi * rest.frequencies[elastic],
    )


def train_in_modes(model: Model, stage: str, shapes: Array, omega: Array) -> PeriodicTrain:
    """The train in modes, with the gear meshes of one stage over their cycle."""
    system, contact = model.system, model.mean_springs
    number = [s.name for s in model.case.stages].index(stage)
    cycle = model.stage_cycle(number, shapes)
    of_others = [
        springs
        for label, springs in zip(system.gear_meshes, contact.gear_meshes, strict=True)
        if label.stage != number
    ]
    constant = shapes.T @ system.stiffness @ shapes
    damping = shapes.T @ structural_damping(model.modal) @ shapes
    for springs in (*of_others, *contact.others.values()):
        rows = springs.rows @ shapes
        constant += rows.T @ springs.matrix @ rows
    for m, label in enumerate(system.gear_meshes):
        if label.stage != number and m in contact.cycles:
            flank = contact.cycles[m]
            row = (flank.force.mean(axis=0) @ flank.blocks) @ shapes / flank.stiffness.mean()
            damping += flank.damping.mean() * np.outer(row, row)
    turning = (system.gyroscopic, system.centripetal)
    nothing = np.zeros_like(constant)
    gyroscopic, centripetal = (nothing if a is None else shapes.T @ a @ shapes for a in turning)
    rate = 2 * np.pi * model.flow.stage(stage).gear_mesh_frequency
    return PeriodicTrain(
        omega, constant + cycle.stiffness, damping + cycle.damping, gyroscopic, centripetal, rate
    )


def _near(train: PeriodicTrain, first: float, last: float, count: int) -> Array:
    """At most ``most`` speed factors within the widest expected bands."""
    centres, widths = train.expected(ORDERS)
    at = np.flatnonzero((centres > first) & (centres < last))
    widest = at[np.argsort(-widths[at])][: count // 3]
    return np.concatenate([centres[widest] + share * widths[widest] for share in (-0.5, 0.0, 0.5)])


def _bands(train: PeriodicTrain, factors: Array, growth: Array, numbers: Ints) -> Iterator[Band]:
    """Bands between speeds without growth, those at the ends of the range as far as it goes."""
    unstable = np.concatenate([[False], growth > 0.0, [False]])
    starts = np.flatnonzero(~unstable[:-1] & unstable[1:])
    stops = np.flatnonzero(unstable[:-1] & ~unstable[1:])
    for a, b in zip(starts, stops, strict=True):
        lower = factors[a] if a == 0 else _edge(train, factors[a - 1], factors[a])
        upper = factors[b - 1] if b == len(factors) else _edge(train, factors[b], factors[b - 1])
        peak = float(factors[a:b][np.argmax(growth[a:b])])
        rate, _, energy = train.fastest(peak)
        i, j, order = acting_modes(train.omega, energy, train.rate * peak)
        modes = int(numbers[i]), int(numbers[j])
        yield Band("", float(lower), float(upper), peak, rate, modes, order)


def _edge(train: PeriodicTrain, stable: float, unstable: float) -> float:
    """Speed factor at which growth begins between two."""
    while abs(unstable - stable) > EDGE * unstable:
        middle = 0.5 * (stable + unstable)
        if train.fastest(middle)[0] > 0.0:
            unstable = middle
        else:
            stable = middle
    return unstable
