"""Parametric instability of a train over speed: growth rates, bands of speed, and their modes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy import linalg
from scipy.optimize import minimize_scalar

from flexgear.analysis.excitation import PeriodicTrain, acting_modes
from flexgear.arrays import Array, Ints
from flexgear.coupling.system import orthonormal_rigid
from flexgear.gears.power_flow import StageFlow
from flexgear.model.arguments import Count, Positive
from flexgear.model.errors import InputError
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.solve.angles import share_range
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.campbell import HIGHEST, MAX_MODES, operating_factors
from flexgear.solve.dataset import result_attrs, result_labels
from flexgear.solve.model import Model

SPEEDS = 121  # number of equally spaced speeds
LOWEST = 0.1  # lowest over highest speed of the default range
ORDERS = 8  # highest order of the gear-mesh frequency with expected bands
EDGE = 1e-5  # relative accuracy of the ends of a band
PEAK = 0.01  # accuracy of the speed of fastest growth, over the width of its band
STRONG = 0.1  # variation of a mode's stiffness over its mean, above which the mode is tried alone
LEAST_YIELD = 1e-6  # flexibility of further modes times gear-mesh stiffness that is not neglected
LEAST_SHARE = 1e-9  # of further modes in a static motion that is not rounding
AROUND = np.linspace(0.95, 1.05, 101)  # of l ω_z = 2 ω_i, where it is tried


@dataclass(frozen=True)
class Band:
    """A range of speed factors in which vibration by a stage grows. peak: factor of fastest growth;
    growth: rate there, 1/s; modes: numbers (i, j) from 1; order: l in l ω_z ≈ ω_i + ω_j."""

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
    count: Count = SPEEDS,
    limit_hz: Positive | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Parametric instability by the varying gear-mesh stiffness: speeds at which free vibration
    grows, its growth rate, and its modes.

    The analysis is linear. For each stage the stiffness of its gear meshes varies over their cycle,
    with the tooth pairs that touch under rated torque without errors, and all other gear meshes
    have their mean stiffness; contact is not lost. At most 60 modes vibrate; all others follow the
    forces of the stage's gear meshes without inertia. speeds: lowest and highest over rated speed;
    if left out up to a fifth above the highest speed of the case; count: number of speeds, beside
    those of expected bands; limit_hz: highest natural frequency of the modes used. InputError for
    an invalid range or limit.
    """
    model.case.require_load()
    first, last = speed_range(model, speeds)
    numbers, shapes, omega = kept_modes(model, limit_hz)
    stages = turning_stages(model)
    trains = [_with_following(model, s.name, shapes, omega) for s in stages]
    in_bands = (_in_bands(train, first, last, count) for train in trains)
    factors = np.unique(np.concatenate([np.linspace(first, last, count), *in_bands]))
    growth = np.zeros((len(factors), len(trains)))
    largest = np.zeros_like(growth)
    bands: list[Band] = []
    for g, (stage, train) in enumerate(zip(stages, trains, strict=True)):
        for k, factor in enumerate(factors):
            growth[k, g], multiplier, _ = train.fastest(float(factor))
            largest[k, g] = abs(multiplier)
            progress("speeds", (g + (k + 1) / len(factors)) / len(trains))
        bands += _bands(stage.name, train, factors, growth[:, g], numbers)
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


def turning_stages(model: Model) -> list[StageFlow]:
    """Stages whose gears turn against one another at rated speeds; InputError if there is none."""
    turning = [s for s in model.flow.stages if s.gear_mesh_frequency > 0.0]
    if not turning:
        remedy = "give rated speeds at which gears turn against one another"
        raise InputError(model.case.source, "inputs", "turn no gear mesh", remedy)
    return turning


def speed_range(model: Model, speeds: tuple[float, float] | None) -> tuple[float, float]:
    """Lowest and highest speed factor: ``speeds``, or the default range of a model."""
    highest = HIGHEST * operating_factors(model)[-1]
    if speeds is None:
        return LOWEST * highest, highest
    return share_range("speed", speeds)


def kept_modes(
    model: Model, limit_hz: float | None, most: int | None = MAX_MODES
) -> tuple[Ints, Array, Array]:
    """Numbers (n,) from 1, shapes (d, n) and ω (n,), rad/s, of the elastic modes up to a limit, or
    by default up to the band of interest, and at most ``most``. InputError for an invalid limit."""
    flexible = not all(body.rigid for body in model.system.bodies)
    highest = model.pace.reduction_limit if flexible else math.inf
    if limit_hz is not None and not 0.0 < limit_hz <= highest:
        problem, remedy = "is not positive", "e.g. 500"
        if limit_hz > highest:
            problem = f"is beyond what the modes of the bodies reach, {highest:.4g} Hz"
            remedy = "lower it, or raise solver.reduction_limit_hz"
        raise InputError("--limit-hz", f"{limit_hz:g}", problem, remedy)
    if limit_hz is None and flexible:
        limit_hz = model.pace.band
    rest = model.natural_modes(limit_hz)
    elastic = np.flatnonzero(rest.frequencies > 0.0)[:most]
    if not len(elastic) or (limit_hz is not None and rest.frequencies[elastic[0]] > limit_hz):
        raise InputError(
            "--limit-hz", f"{limit_hz:g}", "no natural mode lies below", "raise it, see modes"
        )
    return (
        elastic.astype(np.int64) + 1,
        rest.shapes[:, elastic],
        2 * np.pi * rest.frequencies[elastic],
    )


def following_shapes(model: Model, rows: Array, shapes: Array, omega: Array) -> Array:
    """Static motion (d, r) of a train with mean gear-mesh stiffness under unit forces on rows
    (r, d), which rolling does not move, in all modes but ``shapes`` (d, n) of ω (n,), rad/s:

        Ψ = (K̄⁻¹ − Φ ω⁻² Φᵀ) Vᵀ,  M-orthogonal to the rolling of the train and to Φ.
    """
    system = model.system
    rolling = omega[0] * system.mass @ orthonormal_rigid(system.mass, system.rolling)
    stiffness = system.stiffness + model.mean_springs.stiffness + rolling @ rolling.T
    static = linalg.solve(stiffness, rows.T, assume_a="sym")
    return np.asarray(static - (shapes / omega**2) @ (rows @ shapes).T)


def following_modes(
    model: Model, forces: Array, shapes: Array, omega: Array
) -> tuple[Array, Array]:
    """Shapes (d, r) and frequencies (r,), rad/s, of the train in the motions that forces (f, d)
    cause statically in all modes but ``shapes`` (``following_shapes``)."""
    scale = np.abs(forces).max(axis=1, keepdims=True)
    forces = np.divide(forces, scale, out=np.zeros_like(forces), where=scale > 0.0)
    follow = following_shapes(model, forces, shapes, omega)
    yields = forces @ follow  # Ψᵀ K̄ Ψ
    values, vectors = np.linalg.eigh(0.5 * (yields + yields.T))
    total = yields + (forces @ shapes / omega**2) @ (forces @ shapes).T
    yielding = values > LEAST_SHARE * np.abs(total).max()
    follow = follow @ (vectors[:, yielding] / np.sqrt(values[yielding]))
    inertia, vectors = np.linalg.eigh(follow.T @ model.system.mass @ follow)
    return follow @ vectors / np.sqrt(inertia), 1 / np.sqrt(inertia)


def _with_following(model: Model, stage: str, shapes: Array, omega: Array) -> PeriodicTrain:
    """The train in modes (see ``train_in_modes``), the others of which follow the gear meshes of
    the stage statically."""
    number = model.case.stage_index(stage)
    springs = zip(model.system.gear_meshes, model.mean_springs.gear_meshes, strict=True)
    of_stage = [s for label, s in springs if label.stage == number]
    rows = np.concatenate([np.sqrt(np.diag(s.matrix))[:, None] * s.rows for s in of_stage])
    follow = following_shapes(model, rows, shapes, omega)
    yields = rows @ follow  # share of the closing of the gear meshes, of mean stiffness
    values, vectors = np.linalg.eigh(0.5 * (yields + yields.T))
    yielding = values > LEAST_YIELD
    follow = follow @ (vectors[:, yielding] / np.sqrt(values[yielding]))
    every = np.concatenate([omega, np.ones(follow.shape[1])])  # Ψᵀ K̄ Ψ = 1
    return train_in_modes(model, stage, np.hstack([shapes, follow]), every).with_following(
        len(omega)
    )


def train_in_modes(model: Model, stage: str, shapes: Array, omega: Array) -> PeriodicTrain:
    """The train in modes with shapes (d, n) and frequencies omega (n,), rad/s, and with the
    stiffness of the gear meshes of one stage over their cycle."""
    system, contact = model.system, model.mean_springs
    number = [s.name for s in model.case.stages].index(stage)
    cycle = model.stage_cycle(number, shapes)
    other_gear_meshes = [
        springs
        for label, springs in zip(system.gear_meshes, contact.gear_meshes, strict=True)
        if label.stage != number
    ]
    constant = shapes.T @ system.stiffness @ shapes
    damping = shapes.T @ model.modal.structural_damping @ shapes
    for springs in (*other_gear_meshes, *contact.others.values()):
        rows = springs.rows @ shapes
        constant += rows.T @ springs.matrix @ rows
    for m, label in enumerate(system.gear_meshes):
        if label.stage != number and m in contact.cycles:
            flank = contact.cycles[m]
            row = flank.closing(shapes)
            damping += flank.damping.mean() * np.outer(row, row)
    zero = np.zeros_like(constant)
    gyroscopic, centripetal = (
        zero if a is None else shapes.T @ a @ shapes
        for a in (system.gyroscopic, system.centripetal)
    )
    rate = 2 * np.pi * model.flow.stage(stage).gear_mesh_frequency
    return PeriodicTrain(
        omega, constant + cycle.stiffness, damping + cycle.damping, gyroscopic, centripetal, rate
    )


def _in_bands(train: PeriodicTrain, first: float, last: float, count: int) -> Array:
    """At most ``count`` speed factors within the widest bands expected to first order, three in
    each, and those within the bands of single modes of strong variation, to any order."""
    centres, widths = train.expected(ORDERS)
    inside = np.flatnonzero((centres > first) & (centres < last))
    widest = inside[np.argsort(-widths[inside])][: count // 3]
    factors = [centres[widest] + share * widths[widest] for share in (-0.5, 0.0, 0.5)]
    orders = range(1, ORDERS + 1)
    variation = np.max([np.abs(np.diag(train.variation(order))) for order in orders], axis=0)
    for i in np.flatnonzero(variation > STRONG * train.omega**2):
        alone = train.mode(int(i))
        for order in orders:
            near = 2.0 * train.omega[i] / (order * train.rate) * AROUND
            near = near[(near > first) & (near < last)]
            growing = near[[alone.fastest(float(f))[0] > 0.0 for f in near]]
            factors.append(growing[[0, len(growing) // 2, -1]] if len(growing) else growing)
    return np.concatenate(factors)


def _bands(
    stage: str, train: PeriodicTrain, factors: Array, growth: Array, numbers: Ints
) -> Iterator[Band]:
    """Bands of speeds with growth (``growth`` at ``factors``) by a stage, cut at the ends of the
    range; numbers: of the modes."""
    unstable = np.concatenate([[False], growth > 0.0, [False]])
    starts = np.flatnonzero(~unstable[:-1] & unstable[1:])
    stops = np.flatnonzero(unstable[:-1] & ~unstable[1:])
    for a, b in zip(starts, stops, strict=True):
        lower = factors[a] if a == 0 else _edge(train, factors[a - 1], factors[a])
        upper = factors[b - 1] if b == len(factors) else _edge(train, factors[b], factors[b - 1])
        k = a + int(np.argmax(growth[a:b]))
        ends = factors[k - 1] if k > a else lower, factors[k + 1] if k < b - 1 else upper
        between = minimize_scalar(
            lambda factor: -train.fastest(factor)[0], bounds=ends, method="bounded",
            options={"xatol": PEAK * (upper - lower)},
        ).x  # fmt: skip
        peak = max(float(factors[k]), float(between), key=lambda factor: train.fastest(factor)[0])
        rate, _, energy = train.fastest(peak)
        action = energy * (train.decay + 2.0 * rate) / train.omega
        i, j, order = acting_modes(train.omega, action, train.rate * peak)
        modes = int(numbers[i]), int(numbers[j])
        yield Band(stage, float(lower), float(upper), peak, rate, modes, order)


def _edge(train: PeriodicTrain, stable: float, unstable: float) -> float:
    """Speed factor at which growth begins, between a stable and an unstable one, by bisection."""
    while abs(unstable - stable) > EDGE * unstable:
        middle = 0.5 * (stable + unstable)
        if train.fastest(middle)[0] > 0.0:
            unstable = middle
        else:
            stable = middle
    return unstable
