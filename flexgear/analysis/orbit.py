r"""Force elements of one stage over a gear-mesh period, acting on few channels.

At a steady mean speed the rows of the tooth pairs of a stage repeat with the gear-mesh frequency:
positions of contact, stiffness and errors of the base pitch pass through one period while the train
rotates by one pitch. All slower rotations are fixed at angle zero (see ``gear_mesh_cycle``, also
for teeth that are blocks). The rows V_j (n, n_c) of sample j on the channels of a ``ModalSystem``,
at N samples of a period, are reduced to q channels,

    V_j = W_j B,   B (q, n_c) an orthonormal basis of each gear mesh's rows, W_j (n, q).

With the motion u (q,) of these channels a force element has the displacement δ = W_j u + e − B' F
and the rate W_j u̇ + ω e'. e: offset by errors and gaps; e': its derivative by the gear-mesh angle;
B' F: what neighbouring rows yield under the forces F. Its forces on the channels are −W_jᵀ F. Gear
meshes of other stages are mean springs; bearings and supports are taken at angle zero. Causes with
the period of a turn (runout, pitch deviations of single teeth, loads that turn against a frame) are
neglected and listed in ``left_out``.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from flexgear.analysis.gear_mesh_cycle import cycle_angles, mean_channel_springs
from flexgear.analysis.kernels.contact_newton import first_memory
from flexgear.analysis.kernels.samples import evaluate_laws
from flexgear.analysis.orbit_rows import RowCollector
from flexgear.arrays import Array, Ints
from flexgear.coupling.kernels.elements import law_functions
from flexgear.coupling.laws import LAW_NUMBERS
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import PairData
from flexgear.model.errors import FlexgearError

ROUNDING = 1e-9  # rate of a row over the fastest rotation, below which it does not turn
WITHIN = 64  # positions within a step over which tangents are averaged
AT_ONCE = 8  # of them in one call of the laws: numba takes 0.8 ms a call for their types
JUMP = 0.02  # change of a tangent within a step over the largest one, beyond which it is averaged
MAX_ITERATIONS = 40  # for the forces of rows of one sample that are coupled by flexibility


@dataclass(frozen=True)
class ChannelSprings:
    """Linear springs: rows (s, n_c) on the channels, stiffness (s,) N/m and damping (s,) N s/m;
    number (s,): of the bearing row of a damper, −1 for others."""

    rows: Array
    stiffness: Array
    damping: Array
    number: Ints


@dataclass(frozen=True)
class OrbitElements:
    """Force elements at N samples of a period, with at most n rows at a sample.

    Channels are in G groups, of a flank or bearing each, of at most p channels and r rows; rows act
    on the channels of their group alone, n = G r.

    channels (q, n_c): B; source (q,): flank of each channel, or −1 − number of a bearing row;
    groups (G, p): channels of each group, q where it has fewer; rows (N, G, r, p): W; offset
    (N, n): e, m; error_slope (N, n): e', m/rad of the angle of the period; owner (N, n): flank of a
    row, −1 for bearings, −2 without a row; nominal (2, N, n): stiffness N/m and damping N s/m of
    rows of carrying flanks and bearings; elements (E, 4), parameters (E, ·): see ``evaluate_laws``,
    with a sample for every group; between (N, G, r, r): flexibility B' between neighbouring rows,
    m/N, or
    (0, 0, 0, 0); springs: linear rows; load (2, n_c): constant forces on the channels, and forces
    proportional to the square of speed, at rated speed; frequency: of the period at rated speed,
    Hz; flanks (M,): 1 for flanks with rows; gear_meshes: number of gear-mesh periods in the period.
    """

    modal: ModalSystem
    stage: int
    channels: Array
    source: Ints
    groups: Ints
    rows: Array
    offset: Array
    error_slope: Array
    owner: Ints
    nominal: Array
    elements: Ints
    parameters: Array
    between: Array
    springs: ChannelSprings
    load: Array
    frequency: float
    flanks: Ints
    left_out: tuple[str, ...]
    gear_meshes: int = 1

    @property
    def samples(self) -> int:
        """Number N of samples."""
        return len(self.rows)

    def repeated(self, times: int) -> Self:
        """The elements over a period that is ``times`` as long."""
        elements = np.tile(self.elements, (times, 1))
        samples = self.samples * len(self.groups)
        elements[:, 1] += np.repeat(samples * np.arange(times), len(self.elements))
        return replace(
            self,
            rows=np.tile(self.rows, (times, 1, 1, 1)),
            offset=np.tile(self.offset, (times, 1)),
            error_slope=np.tile(times * self.error_slope, (times, 1)),
            owner=np.tile(self.owner, (times, 1)),
            nominal=np.tile(self.nominal, (1, times, 1)),
            elements=elements,
            parameters=np.tile(self.parameters, (times, 1)),
            between=np.tile(self.between, (times, 1, 1, 1)),
            frequency=self.frequency / times,
            gear_meshes=times * self.gear_meshes,
        )

    @property
    def bearing_rows(self) -> Ints:
        """Numbers of the bearing rows that are the last channels, in the order of these."""
        return -1 - self.source[self.source < 0]

    @cached_property
    def _functions(self) -> tuple[object, ...]:
        return law_functions(self.modal.system.pairs)

    @cached_property
    def _space(self) -> tuple[Any, ...]:
        widest = max(1, int(self.elements[:, 3].max(initial=1)))
        return tuple(
            (np.zeros((2, r)), np.zeros((2, r)), np.zeros((2, r, r))) for r in range(1, widest + 1)
        )

    def mean_row(self, m: int) -> Array:
        """Mean row (q,) of the tooth pairs of flank m over the period: closing of the gear mesh."""
        of_flank = self.owner.reshape(self.rows.shape[:3]) == m
        total = np.einsum("jgr,jgrp->gp", of_flank, self.rows)
        return scattered(total[None] / max(of_flank.sum(), 1), self.groups, len(self.channels))[0]

    def row_motions(self, motion: Array) -> Array:
        """W u (N, n) of motions u (N, q) of the channels."""
        products = self.rows @ gathered(motion, self.groups)[..., None]
        return np.asarray(products.reshape(self.offset.shape))

    def row_forces(self, motion: Array, rate: Array, omega: float) -> tuple[Array, Array, Array]:
        """Forces F (N, n) N, tangents ∂F/∂δ and ∂F/∂δ̇ (2, N, G, r, r), and displacements δ (N, n)
        of the rows for the motion u and its rate (N, q); omega: frequency of the period, rad/s."""
        closing_rate = self.row_motions(rate) + omega * self.error_slope
        free = self.row_motions(motion) + self.offset
        shape = self.rows.shape[:3]
        delta = np.stack([x.reshape(-1, shape[2]) for x in (free, closing_rate)], axis=2)
        force, tangent = self._laws(delta)
        if self.between.size:
            between = self.between.reshape(-1, *self.between.shape[2:])
            initial, eye = delta[:, :, 0].copy(), np.eye(shape[2])
            for _ in range(MAX_ITERATIONS):
                gap = delta[:, :, 0] - initial + products(between, force)
                matrix = eye + between @ tangent[0]
                delta[:, :, 0] -= np.linalg.solve(matrix, gap[:, :, None])[:, :, 0]
                before = force
                force, tangent = self._laws(delta)
                if np.abs(force - before).max() <= 1e-13 * np.abs(force).max():
                    break
            tangent = np.linalg.inv(eye + tangent[0] @ between) @ tangent
        tangent = tangent.reshape(2, *shape, shape[2])
        return force.reshape(free.shape), tangent, delta[:, :, 0].reshape(free.shape)

    def _laws(self, delta: Array) -> tuple[Array, Array]:
        count, r, _ = delta.shape
        force, tangent = np.zeros((count, r)), np.zeros((2, count, r, r))
        evaluate_laws(
            self._functions, self.elements, self.parameters, delta, force, tangent, self._space
        )
        return force, tangent

    @cached_property
    def linear_tangents(self) -> Array:
        """Tangents (2, N, G, p, p) on the channels with all pairs on the path of the carrying
        flanks in contact, and bearings with their nominal stiffness."""
        shape = self.rows.shape[:3]
        stiffness, damping = (x.reshape(shape)[..., None] * np.eye(shape[2]) for x in self.nominal)
        if self.between.size:
            condensed = np.linalg.inv(np.eye(shape[2]) + stiffness @ self.between)
            stiffness, damping = condensed @ stiffness, condensed @ damping
        return np.array([self.on_channels(stiffness), self.on_channels(damping)])

    def on_channels(self, tangent: Array) -> Array:
        """Wᵀ T W (N, G, p, p) of tangents T (N, G, r, r) between rows."""
        return np.asarray(self.rows.swapaxes(2, 3) @ (tangent @ self.rows))

    def tangents_around(self, motion: Array, rate: Array, period: float) -> Array:
        """Tangents (2, N, G, p, p) on the channels for u and its rate (N, q) over a period, s;
        where contact begins or ends within a step around a sample, their mean over the step."""
        step, omega = period / self.samples, 2 * np.pi / period
        tangent = self.row_forces(motion, rate, omega)[1]
        begin, end = (self.row_forces(motion + t * rate, rate, omega)[1]
                      for t in (-0.5 * step, 0.5 * step))  # fmt: skip
        largest = np.abs(tangent).max(axis=(1, 2, 3, 4), keepdims=True)
        at = np.flatnonzero((np.abs(end - begin) > JUMP * largest).any(axis=(0, 2, 3, 4)))
        if at.size:
            around = step * ((np.arange(WITHIN) + 0.5) / WITHIN - 0.5).reshape(-1, AT_ONCE, 1, 1)
            part, rates = self.at_samples(at).repeated(AT_ONCE), np.tile(rate[at], (AT_ONCE, 1))
            motions = ((motion[at] + t * rate[at]).reshape(rates.shape) for t in around)
            # `repeated` elements have a period so many times as long: omega is as much lower
            inside = [part.row_forces(u, rates, omega / AT_ONCE)[1] for u in motions]
            by_position = np.mean(inside, axis=0).reshape(2, AT_ONCE, len(at), *tangent.shape[2:])
            tangent[:, at] = by_position.mean(axis=1)
        return np.array([self.on_channels(t) for t in tangent])

    def at_samples(self, at: Ints) -> Self:
        """The elements at the samples numbered ``at`` alone."""
        groups, place = len(self.groups), np.full(self.samples, -1)
        place[at] = np.arange(len(at))
        sample, group = np.divmod(self.elements[:, 1], groups)
        elements = self.elements.copy()
        elements[:, 1] = groups * place[sample] + group
        selected = place[sample] >= 0
        return replace(
            self,
            rows=self.rows[at],
            offset=self.offset[at],
            error_slope=self.error_slope[at],
            owner=self.owner[at],
            nominal=self.nominal[:, at],
            elements=elements[selected],
            parameters=self.parameters[selected],
            between=self.between[at] if self.between.size else self.between,
        )

    def channel_forces(self, force: Array) -> Array:
        """Wᵀ F (N, q): forces of the rows (N, n) on the channels, against the motion u."""
        by_group = force.reshape(self.rows.shape[:3])[..., None, :] @ self.rows
        return scattered(by_group[..., 0, :], self.groups, len(self.channels))

    def by_rate_of_errors(self, tangent: Array) -> Array:
        """∂(Wᵀ F)/∂ω (N, q) of tangents ∂F/∂δ̇ (N, G, r, r) by the rate ω e' of errors."""
        slope = self.error_slope.reshape(self.rows.shape[:3])[..., None]
        return self.channel_forces((tangent @ slope).reshape(self.offset.shape))


def gathered(values: Array, groups: Ints) -> Array:
    """Values (N, G, p) of the channels of each group, 0 beyond, of values (N, q) of all."""
    return np.concatenate([values, np.zeros((len(values), 1))], axis=1)[:, groups]


def scattered(values: Array, groups: Ints, count: int) -> Array:
    """Values (N, q) of ``count`` channels, from those of each group (N, G, p): ``gathered``
    inverted. groups: channels (G, p) of each group, ``count`` where it has fewer than p."""
    out = np.zeros((len(values), count + 1))
    out[:, groups] = values
    return out[:, :count]


def group_products(tangents: Array, values: Array, groups: Ints) -> Array:
    """Products (N, q) of tangents (N, G, p, p) of groups with values (N, q) of their channels."""
    by_group = (tangents @ gathered(values, groups)[..., None])[..., 0]
    return scattered(by_group, groups, values.shape[1])


def products(matrices: Array, vectors: Array) -> Array:
    """Matrix-vector products (N, n) of matrices (N, n, q) and vectors (N, q)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def orbit_elements(
    modal: ModalSystem, stage: int, samples: int, coast: bool = False
) -> OrbitElements:
    """Force elements of a stage (number from 0) at ``samples`` samples; coast: also of the flanks
    without rated load. FlexgearError where a bearing or damper depends on its shaft's speed."""
    system, pairs = modal.system, periodic(modal.system.pairs)
    rates = first_memory(_without_axial_dampers(pairs), system.rolling_rates)[:, 1]
    if np.abs(rates).max(initial=0.0) > ROUNDING * np.abs(system.rolling_rates).max():
        raise FlexgearError(
            "periodic states have no shaft speeds, on which the forces of plain bearings and of "
            "dampers against rotation depend: run transients, or remove them from the case"
        )
    in_stage = np.array([label.stage == stage for label in system.gear_meshes])
    flanks = np.where(in_stage & ((pairs.carries == 1) | coast), 1, 0).astype(np.int64)
    m = int(np.flatnonzero(in_stage)[0])
    rated = system.theta(system.rated_input_speeds)[pairs.angle[m]]
    theta = cycle_angles(system, in_stage, samples, -1.0 if rated < 0.0 else 1.0)
    collected = RowCollector(modal, pairs, flanks, (theta[1] - theta[0]) * samples / (2 * np.pi))
    for j in range(samples):
        collected.add(j, np.ascontiguousarray(theta[j]), theta[0])
    condensed = collected.condensed()
    offset, slope, *nominal = condensed.numbers
    return OrbitElements(
        modal=modal,
        stage=stage,
        channels=condensed.channels,
        source=np.array(
            [*collected.source, *(-1 - row for row in collected.bearing_rows)], np.int64
        ),
        groups=condensed.groups,
        rows=condensed.rows,
        offset=offset,
        error_slope=slope,
        owner=condensed.owner,
        nominal=np.array(nominal),
        elements=condensed.elements,
        parameters=np.vstack(collected.parameters),
        between=condensed.between,
        springs=_springs(modal, collected, stage),
        load=_loads(modal, pairs),
        frequency=abs(float(rated * pairs.rate[m] / pairs.pitch[m])),
        flanks=flanks,
        left_out=_left_out(modal, stage),
    )


def _without_axial_dampers(pairs: PairData) -> PairData:
    """The pair data without dampers that have no coefficient for rotation about the axis."""
    dampers = pairs.bearing_law == LAW_NUMBERS["dampers"]
    remains = ~dampers | np.array([c[-1] != 0.0 for c in pairs.bearing_parameters], bool)
    fields = ("bearing_law", "bearing_block", "bearing_angle", "bearing_parameters",
              "bearing_turned")  # fmt: skip
    return pairs._replace(**{name: getattr(pairs, name)[remains] for name in fields})


def periodic(pairs: PairData) -> PairData:
    """The pair data with stationary rollers, without errors and faults that repeat once a turn."""
    return pairs.sound._replace(
        error_gear=np.zeros_like(pairs.error_gear),
        error_planet=np.zeros_like(pairs.error_planet),
        runout_amplitude=np.zeros_like(pairs.runout_amplitude),
        bearing_turned=np.full_like(pairs.bearing_turned, -1),
    )


def _left_out(modal: ModalSystem, stage: int) -> tuple[str, ...]:
    """Neglected causes that do not have the period of the gear mesh, one phrase each."""
    pairs, words = modal.system.pairs, []
    if pairs.error_gear.any() or pairs.error_planet.any():
        words.append("pitch deviations of single teeth")
    if pairs.gear_table.any() or pairs.planet_table.any():
        words.append("faults of teeth")
    if (pairs.bearing_turned >= 0).any():
        words.append("rollers that pass defects of their bearings")
    if pairs.runout_amplitude.any():
        words.append("runout of gears and carriers")
    if np.any((pairs.load_angle >= 0) & (pairs.load_size != 0)):
        words.append("loads that turn against the frame of their member")
    if len({label.stage for label in modal.system.gear_meshes}) > 1:
        words.append("excitation by the gear meshes of other stages, which are mean springs")
    if (pairs.turns >= 0).any() or (pairs.planet_turns >= 0).any():
        words.append("the turning of elastic gears against their gear meshes")
    return tuple(words)


def _springs(modal: ModalSystem, collected: RowCollector, stage: int) -> ChannelSprings:
    """Linear springs and dampers on the channels: supports in turning frames (at angle zero),
    dampers of bearings and ports, and the mean springs of the gear meshes of other stages."""
    springs = list(collected.linear_rows)
    for columns, flank_rows, damping in mean_channel_springs(modal, stage):
        full = np.zeros((len(flank_rows), len(modal.channels)))
        full[:, columns] = flank_rows
        springs += [(row, 1.0, damping, -1) for row in full]
    rows = np.reshape([row for row, *_ in springs], (-1, len(modal.channels)))
    numbers = np.reshape([numbers for _, *numbers in springs], (-1, 3)).T
    return ChannelSprings(rows, numbers[0], numbers[1], numbers[2].astype(np.int64))


def _loads(modal: ModalSystem, pairs: PairData) -> Array:
    """Forces (2, n_c) on the channels by loads that do not turn: constant ones, and those that grow
    with the square of speed, at rated speed; without torques of ports."""
    out = np.zeros((2, len(modal.channels)))
    for block, vector, size, angle, grows in zip(
        pairs.load_block, pairs.load_vector, pairs.load_size, pairs.load_angle, pairs.load_grows,
        strict=True,
    ):  # fmt: skip
        if angle < 0:
            out[int(grows), 6 * block : 6 * block + 6] += size * vector
    return out
