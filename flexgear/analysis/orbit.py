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

from flexgear.analysis.flank_ends import FlankEnds
from flexgear.analysis.gear_mesh_cycle import cycle_angles, mean_channel_springs
from flexgear.analysis.kernels.contact_newton import first_memory
from flexgear.analysis.kernels.samples import evaluate_laws
from flexgear.arrays import Array, Ints
from flexgear.coupling.kernels.elements import Rows, between_rows, law_functions, packed, pair_rows
from flexgear.coupling.kernels.pair_errors import error_rates
from flexgear.coupling.kernels.pairs import fill_rows
from flexgear.coupling.laws import LAW_NUMBERS
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import LOAD, SUPPORT, PairData
from flexgear.model.errors import FlexgearError

LEAST_SINGULAR = 1e-9  # singular values over the largest, below which directions are dropped
# where teeth are blocks: flexibility, proportional to the square, is then exact to 1e-4
LEAST_SINGULAR_OF_TEETH = 1e-2
WITHIN = 8  # positions within a step over which tangents are averaged
MAX_ITERATIONS = 40  # for the forces of rows of one sample that are coupled by flexibility


@dataclass(frozen=True)
class ChannelSprings:
    """Linear springs: rows (s, n_c) on the channels, stiffness (s,) N/m and damping (s,) N s/m."""

    rows: Array
    stiffness: Array
    damping: Array


@dataclass(frozen=True)
class OrbitElements:
    """Force elements at N samples of a period, with at most n rows at a sample.

    channels (q, n_c): B; source (q,): flank of each channel, or −1 − number of a bearing row; rows
    (N, n, q): W; offset (N, n): e, m; error_slope (N, n): e', m/rad of the angle of the period;
    owner (N, n): flank of a row, −1 for bearings, −2 without a row; nominal (2, N, n): stiffness
    N/m and damping N s/m of rows of carrying flanks and bearings; elements (E, 4), parameters
    (E, p): see ``evaluate_laws``; between (N, n, n): flexibility B' between neighbouring rows, m/N,
    or (0, 0, 0); springs: linear rows; load (2, n_c): constant forces on the channels, and forces
    proportional to the square of speed, at rated speed; frequency: of the period at rated speed,
    Hz; flanks (M,): 1 for flanks with rows; gear_meshes: number of gear-mesh periods in the period.
    """

    modal: ModalSystem
    stage: int
    channels: Array
    source: Ints
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
        elements[:, 1] += np.repeat(self.samples * np.arange(times), len(self.elements))
        return replace(
            self,
            rows=np.tile(self.rows, (times, 1, 1)),
            offset=np.tile(self.offset, (times, 1)),
            error_slope=np.tile(times * self.error_slope, (times, 1)),
            owner=np.tile(self.owner, (times, 1)),
            nominal=np.tile(self.nominal, (1, times, 1)),
            elements=elements,
            parameters=np.tile(self.parameters, (times, 1)),
            between=np.tile(self.between, (times, 1, 1)),
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
        rows = self.owner == m
        return np.asarray(self.rows[rows].mean(axis=0))

    def row_forces(self, motion: Array, rate: Array, omega: float) -> tuple[Array, Array, Array]:
        """Forces F (N, n) N, tangents ∂F/∂δ and ∂F/∂δ̇ (2, N, n, n), and displacements δ (N, n) of
        the rows for the motion u and its rate (N, q); omega: frequency of the period, rad/s."""
        closing_rate = products(self.rows, rate) + omega * self.error_slope
        delta = np.stack([products(self.rows, motion) + self.offset, closing_rate], axis=2)
        force, tangent = self._laws(delta)
        if not self.between.size:
            return force, tangent, delta[:, :, 0]
        free, eye = delta[:, :, 0].copy(), np.eye(delta.shape[1])
        for _ in range(MAX_ITERATIONS):
            gap = delta[:, :, 0] - free + products(self.between, force)
            matrix = eye + self.between @ tangent[0]
            delta[:, :, 0] -= np.linalg.solve(matrix, gap[:, :, None])[:, :, 0]
            before = force
            force, tangent = self._laws(delta)
            if np.abs(force - before).max() <= 1e-13 * np.abs(force).max():
                break
        condensed = np.linalg.inv(eye + tangent[0] @ self.between)
        return force, condensed @ tangent, delta[:, :, 0]

    def _laws(self, delta: Array) -> tuple[Array, Array]:
        count, n = self.offset.shape
        force, tangent = np.zeros((count, n)), np.zeros((2, count, n, n))
        evaluate_laws(
            self._functions, self.elements, self.parameters, delta, force, tangent, self._space
        )
        return force, tangent

    @cached_property
    def linear_tangents(self) -> Array:
        """Tangents (2, N, q, q) on the channels with all pairs on the path of the carrying flanks
        in contact, and bearings with their nominal stiffness."""
        stiffness, damping = (np.einsum("jn,nm->jnm", x, np.eye(x.shape[1])) for x in self.nominal)
        if self.between.size:
            condensed = np.linalg.inv(np.eye(len(stiffness[0])) + stiffness @ self.between)
            stiffness, damping = condensed @ stiffness, condensed @ damping
        return np.array([self.on_channels(stiffness), self.on_channels(damping)])

    def on_channels(self, tangent: Array) -> Array:
        """Wᵀ T W (N, q, q) of tangents T (N, n, n) between rows."""
        return np.asarray(self.rows.transpose(0, 2, 1) @ (tangent @ self.rows))

    def tangents_around(self, motion: Array, rate: Array, period: float) -> Array:
        """Tangents (2, N, q, q) on the channels for u and its rate (N, q) over a period, s, each
        averaged over a step around its sample, within which contact may begin or end."""
        around = period / self.samples * ((np.arange(WITHIN) + 0.5) / WITHIN - 0.5)
        omega = 2 * np.pi / period
        tangents = [self.row_forces(motion + t * rate, rate, omega)[1] for t in around]
        return np.array([self.on_channels(t) for t in np.mean(tangents, axis=0)])

    def channel_forces(self, force: Array) -> Array:
        """Wᵀ F (N, q): forces of the rows (N, n) on the channels, against the motion u."""
        return np.einsum("jnq,jn->jq", self.rows, force)


def products(matrices: Array, vectors: Array) -> Array:
    """Matrix-vector products (N, n) of matrices (N, n, q) and vectors (N, q)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def orbit_elements(
    modal: ModalSystem, stage: int, samples: int, coast: bool = False
) -> OrbitElements:
    """Force elements of a stage (number from 0) at ``samples`` samples; coast: also of the flanks
    without rated load. FlexgearError where a bearing or damper depends on its shaft's speed."""
    system, pairs = modal.system, periodic(modal.system.pairs)
    if first_memory(_without_axial_dampers(pairs), system.rolling_rates)[:, 1].any():
        raise FlexgearError(
            "periodic states have no shaft speeds, on which the forces of plain bearings and of "
            "dampers against rotation depend: run transients, or remove them from the case"
        )
    in_stage = np.array([label.stage == stage for label in system.gear_meshes])
    flanks = np.where(in_stage & ((pairs.carries == 1) | coast), 1, 0).astype(np.int64)
    m = int(np.flatnonzero(in_stage)[0])
    rated = system.theta(system.rated_input_speeds)[pairs.angle[m]]
    theta = cycle_angles(system, in_stage, samples, -1.0 if rated < 0.0 else 1.0)
    collected = _RowCollector(modal, pairs, flanks, (theta[1] - theta[0]) * samples / (2 * np.pi))
    for j in range(samples):
        collected.add(j, np.ascontiguousarray(theta[j]), theta[0])
    channels, rows, owner, (offset, slope, *nominal) = collected.condensed()
    return OrbitElements(
        modal=modal,
        stage=stage,
        channels=channels,
        source=np.array(
            [*collected.source, *(-1 - row for row in collected.bearing_rows)], np.int64
        ),
        rows=rows,
        offset=offset,
        error_slope=slope,
        owner=owner,
        nominal=np.array(nominal),
        elements=np.vstack(collected.elements).astype(np.int64),
        parameters=np.vstack(collected.parameters),
        between=collected.between(rows.shape[1]),
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
    return pairs._replace(
        gear_table=np.zeros_like(pairs.gear_table),
        planet_table=np.zeros_like(pairs.planet_table),
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
        words.append("faults of single teeth")
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


class _RowCollector:
    """Collects the rows of all samples, then reduces them to channels; speeds (A,): derivatives of
    the train's angles by the gear-mesh angle."""

    def __init__(self, modal: ModalSystem, pairs: PairData, flanks: Ints, speeds: Array) -> None:
        self.modal, self.pairs, self.flanks, self.speeds = modal, pairs, flanks, speeds
        self.data, self.work = packed(pairs), pair_rows(pairs)
        self.ends = {int(m): FlankEnds(pairs, int(m)) for m in np.flatnonzero(flanks)}
        self.elements: list[Array] = []
        self.parameters: list[Array] = []
        self.coefficients: dict[int, list[Array]] = {m: [] for m in self.ends}
        # per sample: flank or −3 − bearing row (n,); offset, slope of error, stiffness, damping
        self.row_data: list[tuple[Ints, Array]] = []
        self.source: list[int] = []  # flank of every channel
        self.bearing_rows: dict[int, Array] = {}
        self.support_rows: list[tuple[Array, float]] = []  # row and stiffness
        self._flexibilities: list[Array] = []  # between neighbouring rows, per sample

    def add(self, j: int, angles: Array, start: Array) -> None:
        """Add sample j at angles (A,); start (A,): angles of sample 0."""
        work = self.work
        n, count, _ = fill_rows(self.data, angles, self.flanks, work)
        kinds = work.row["kind"][:n]
        taken = np.flatnonzero((kinds != SUPPORT) & (kinds != LOAD))
        row, of_teeth = work.row[taken], kinds[taken] >= 0
        owner = row["owner"].astype(np.int64)
        flank, slopes = np.where(of_teeth, owner, 0), np.zeros(len(self.flanks))
        error_rates(self.data.gears, angles, self.speeds, slopes)
        carries = np.where(of_teeth, self.pairs.carries[flank], 1.0)
        springs = carries * np.array([row["stiffness"], row["damping"]])
        numbers = np.vstack([row["offset"], of_teeth * slopes[flank], springs])
        self.row_data.append((np.where(of_teeth, owner, -3 - owner), numbers))
        for m in np.unique(owner[of_teeth]).tolist():
            at = taken[of_teeth & (owner == m)]
            self.coefficients[m].append(self.ends[m].coefficients(work, at, angles, start))
        for i, number in zip(taken[~of_teeth], owner[~of_teeth].tolist(), strict=True):
            self.bearing_rows.setdefault(number, self._on_channels(work, int(i)))
        element = work.element[:count]
        selected = np.isin(element["first"], taken)
        first = np.searchsorted(taken, element["first"])
        columns = np.column_stack([element["law"], 0 * first + j, first, element["rows"]])
        self.elements.append(columns[selected])
        self.parameters.append(work.parameters[:count][selected])
        if work.row["following"][:n].any():
            self._flexibilities.append(between_rows(work, n)[np.ix_(taken, taken)])
        if j == 0:
            for i in np.flatnonzero(kinds == SUPPORT):
                row = self._on_channels(work, int(i))
                self.support_rows.append((row, float(work.row["stiffness"][i])))

    def _on_channels(self, work: Rows, i: int) -> Array:
        row = np.zeros(len(self.modal.channels))
        for a in range(int(work.row["width"][i])):
            at = 6 * int(work.blocks[i, a])
            row[at : at + 6] += work.coef[i, a]
        return row

    def between(self, n: int) -> Array:
        """Flexibility (N, n, n) m/N between neighbouring rows; (0, 0, 0) without coupling."""
        if not self._flexibilities:
            return np.zeros((0, 0, 0))
        out = np.zeros((len(self._flexibilities), n, n))
        for matrix, part in zip(out, self._flexibilities, strict=True):
            matrix[: len(part), : len(part)] = part
        return out

    def _directions(self, m: int, rows: Array) -> Array:
        """Orthonormal U (r, k) with rows ≈ U Uᵀ rows, for the rows (r, c) of flank m.

        Where teeth are blocks, rows are weighted by the motion that their forces cause: U are the
        first singular vectors of [rows S^½, rows Z], S the elastic flexibility of the channels, Z
        their rigid motions.
        """
        if not self.ends[m].teeth:
            u, s, _ = np.linalg.svd(rows, full_matrices=False)
            return np.asarray(u[:, s > LEAST_SINGULAR * s[0]])
        at, r = self.ends[m].columns, self.modal.rigid_count
        p = self.modal.channel_modes[at]
        flexible = (p[:, r:] / self.modal.omega[r:] ** 2) @ p[:, r:].T
        flexible += self.modal.residual[np.ix_(at, at)]
        values, vectors = np.linalg.eigh(flexible)
        elastic = rows @ (vectors * np.sqrt(np.maximum(values, 0.0)))
        rigid = rows @ p[:, :r]
        size = np.linalg.norm(elastic) / (np.linalg.norm(rigid) or 1.0)
        u, s, _ = np.linalg.svd(np.hstack([elastic, size * rigid]), full_matrices=False)
        return np.asarray(u[:, s > LEAST_SINGULAR_OF_TEETH * s[0]])

    def condensed(self) -> tuple[Array, Array, Ints, Array]:
        """Channels (q, n_c), rows (N, n, q), owners (N, n), and offsets, slopes of errors, nominal
        stiffness and damping (4, N, n)."""
        n = max((len(owner) for owner, _ in self.row_data), default=0)
        owners = np.full((len(self.row_data), n), -2, dtype=np.int64)
        numbers = np.zeros((4, *owners.shape))
        for j, (owner, values) in enumerate(self.row_data):
            owners[j, : len(owner)], numbers[:, j, : len(owner)] = owner, values
        channels, blocks = [np.zeros((0, len(self.modal.channels)))], list[tuple[int, Array]]()
        for m, parts in self.coefficients.items():
            if not parts:
                continue
            vectors = np.vstack(parts)
            shares = self._directions(m, vectors)
            part = np.zeros((shares.shape[1], len(self.modal.channels)))
            part[:, self.ends[m].columns] = shares.T @ vectors
            channels.append(part)
            blocks.append((m, shares))
            self.source += [m] * len(part)
        blocks += [(-3 - number, np.ones((1, 1))) for number in self.bearing_rows]
        channels += [row[None] for row in self.bearing_rows.values()]
        rows, q = np.zeros((*owners.shape, sum(map(len, channels)))), 0
        for number, shares in blocks:
            rows[owners == number, q : q + shares.shape[1]] = shares
            q += shares.shape[1]
        return np.vstack(channels), rows, np.where(owners < -2, -1, owners), numbers


def _springs(modal: ModalSystem, collected: _RowCollector, stage: int) -> ChannelSprings:
    """Supports in turning frames at angle zero, and mean springs of other stages' gear meshes."""
    springs = [(row, k, 0.0) for row, k in collected.support_rows]
    for columns, flank_rows, damping in mean_channel_springs(modal, stage):
        full = np.zeros((len(flank_rows), len(modal.channels)))
        full[:, columns] = flank_rows
        springs += [(row, 1.0, damping) for row in full]
    rows = np.reshape([row for row, _, _ in springs], (-1, len(modal.channels)))
    return ChannelSprings(rows, *np.reshape([numbers for _, *numbers in springs], (-1, 2)).T)


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
