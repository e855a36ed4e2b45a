r"""Force elements of one stage over a period of its gear meshes, on few channels.

At a steady mean speed the rows of the tooth pairs of a stage repeat with the gear-mesh frequency:
places of contact, stiffness and errors of the base pitch run through one period while the train
rolls by one pitch, all that turns slower than teeth pass standing still (as in ``gear_mesh_cycle``,
which also says how teeth that are blocks of their own are held in place). With the rows V_j
(n, n_c) of sample j over the channels of a ``ModalSystem``, N samples of a period,

    V_j = W_j B,   B (q, n_c) an orthonormal basis of each gear mesh's rows, W_j (n, q),

a force element sees δ = W_j u + e − Σ B' F' of the motion u (q,) of these channels, at the rate
W_j u̇ + ω e', e' per radian of the gear-mesh angle, and acts on them by −W_jᵀ F. Gear meshes of
other stages are their mean springs; bearings and supports are as they stand at angle zero. Causes
that repeat once a turn (runout, pitch deviations of single teeth, loads that turn against a frame)
are left out: ``left_out``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

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

DIRECTIONS = 1e-9  # of the largest singular value: directions of rows that count
# the same where teeth are blocks: flexibility, which goes with the square, is right to 1e-4
TOOTH_DIRECTIONS = 1e-2
WITHIN = 8  # places of a step over which tangents are averaged
LOCAL_TRIES = 40  # of the rows of one sample that yield to each other


@dataclass(frozen=True)
class Springs:
    """Linear rows (s, n_c) over the channels: stiffness (s,) N/m and damping (s,) N s/m."""

    rows: Array
    stiffness: Array
    damping: Array


@dataclass(frozen=True)
class OrbitElements:
    """Force elements over N samples of a period, n rows at most at one of them.

    channels (q, n_c): B; source (q,): flank of each, or −1 − the number of a bearing row; rows
    (N, n, q): W; offset (N, n) m; error_slope (N, n): e', m/rad; owner (N, n): flank m of a row, −1
    of bearings, −2 where there is no row; nominal (2, N, n): stiffness N/m and damping N s/m of
    rows that carry; elements (E, 4), parameters (E, p): see ``evaluate_laws``;
    between (N, n, n) m/N: by which rows yield to each other, or (0, 0, 0); springs: linear rows;
    load (2, n_c): constant forces on the channels, and what grows with the square of speed, at the
    rated one; frequency: of the period at rated speed, Hz; flanks (M,) 1 where rows were filled;
    gear_meshes: gear-mesh periods that the period has, the angle of ``error_slope`` being that of
    the period.
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
    springs: Springs
    load: Array
    frequency: float
    flanks: Ints
    left_out: tuple[str, ...]
    gear_meshes: int = 1

    @property
    def samples(self) -> int:
        """N."""
        return len(self.rows)

    def repeated(self, times: int) -> OrbitElements:
        """The same over several of its periods."""
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
        """Numbers, among rows that are no tooth pairs, of those that are the last channels."""
        return -1 - self.source[self.source < 0]

    @cached_property
    def _functions(self) -> tuple[object, ...]:
        return law_functions(self.modal.system.pairs)

    @cached_property
    def _space(self) -> tuple[Any, ...]:
        most = max(1, int(self.elements[:, 3].max(initial=1)))
        return tuple(
            (np.zeros((2, r)), np.zeros((2, r)), np.zeros((2, r, r))) for r in range(1, most + 1)
        )

    def mean_row(self, m: int) -> Array:
        """Mean row (q,) of a flank's tooth pairs over the period: closing of the gear mesh."""
        rows = self.owner == m
        return np.asarray(self.rows[rows].mean(axis=0))

    def row_forces(self, motion: Array, rate: Array, omega: float) -> tuple[Array, Array, Array]:
        """Forces (N, n) N, tangents (2, N, n, n) to displacement and rate, and displacements (N, n)
        of the rows under the motion u and its rate (N, q) at a gear-mesh frequency, rad/s."""
        closing_rate = products(self.rows, rate) + omega * self.error_slope
        delta = np.stack([products(self.rows, motion) + self.offset, closing_rate], axis=2)
        force, tangent = self._laws(delta)
        if not self.between.size:
            return force, tangent, delta[:, :, 0]
        free, eye = delta[:, :, 0].copy(), np.eye(delta.shape[1])
        for _ in range(LOCAL_TRIES):
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
        """Tangents (2, N, q, q) on the channels with all pairs of the carrying flanks on their path
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
        """Tangents (2, N, q, q) on the channels under u and its rate (N, q) over a period, s, each
        the mean over a step around its sample, within which rows may begin or cease to touch."""
        around = period / self.samples * ((np.arange(WITHIN) + 0.5) / WITHIN - 0.5)
        omega = 2 * np.pi / period
        tangents = [self.row_forces(motion + t * rate, rate, omega)[1] for t in around]
        return np.array([self.on_channels(t) for t in np.mean(tangents, axis=0)])

    def channel_forces(self, force: Array) -> Array:
        """Wᵀ F (N, q) of forces (N, n) of the rows: what resists the motion u."""
        return np.einsum("jnq,jn->jq", self.rows, force)


def products(matrices: Array, vectors: Array) -> Array:
    """(N, n) of matrices (N, n, q) and vectors (N, q)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def orbit_elements(
    modal: ModalSystem, stage: int, samples: int, coast: bool = False
) -> OrbitElements:
    """Elements of a stage (number); coast: with the flanks that carry no rated load. FlexgearError
    where a bearing or damper depends on the speed of its shaft."""
    system, pairs = modal.system, periodic(modal.system.pairs)
    if first_memory(_taking_turns(pairs), system.rolling_rates)[:, 1].any():
        raise FlexgearError(
            "periodic states have no shaft speeds, which plain bearings and dampers "
            "against turning take: run transients, or take these out"
        )
    in_stage = np.array([label.stage == stage for label in system.gear_meshes])
    flanks = np.where(in_stage & ((pairs.carries == 1) | coast), 1, 0).astype(np.int64)
    m = int(np.flatnonzero(in_stage)[0])
    rated = system.theta(system.rated_input_speeds)[pairs.angle[m]]
    theta = cycle_angles(system, in_stage, samples, -1.0 if rated < 0.0 else 1.0)
    filled = _Filling(modal, pairs, flanks, (theta[1] - theta[0]) * samples / (2 * np.pi))
    for j in range(samples):
        filled.add(j, np.ascontiguousarray(theta[j]), theta[0])
    channels, rows, owner, (offset, slope, *nominal) = filled.condensed()
    return OrbitElements(
        modal=modal,
        stage=stage,
        channels=channels,
        source=np.array([*filled.source, *(-1 - row for row in filled.bearing_rows)], np.int64),
        rows=rows,
        offset=offset,
        error_slope=slope,
        owner=owner,
        nominal=np.array(nominal),
        elements=np.vstack(filled.elements).astype(np.int64),
        parameters=np.vstack(filled.parameters),
        between=filled.between(rows.shape[1]),
        springs=_springs(modal, filled, stage),
        load=_loads(modal, pairs),
        frequency=abs(float(rated * pairs.rate[m] / pairs.pitch[m])),
        flanks=flanks,
        left_out=_left_out(modal, stage),
    )


def _taking_turns(pairs: PairData) -> PairData:
    """Pairs without the dampers that have no coefficient about the axis."""
    dampers = pairs.bearing_law == LAW_NUMBERS["dampers"]
    takes = ~dampers | np.array([c[-1] != 0.0 for c in pairs.bearing_parameters], bool)
    fields = ("bearing_law", "bearing_block", "bearing_angle", "bearing_parameters",
              "bearing_turned")  # fmt: skip
    return pairs._replace(**{name: getattr(pairs, name)[takes] for name in fields})


def periodic(pairs: PairData) -> PairData:
    """Pairs without errors and faults that repeat once a turn, and with stationary rollers."""
    return pairs._replace(
        gear_table=np.zeros_like(pairs.gear_table),
        planet_table=np.zeros_like(pairs.planet_table),
        error_gear=np.zeros_like(pairs.error_gear),
        error_planet=np.zeros_like(pairs.error_planet),
        runout_amplitude=np.zeros_like(pairs.runout_amplitude),
        bearing_turned=np.full_like(pairs.bearing_turned, -1),
    )


def _left_out(modal: ModalSystem, stage: int) -> tuple[str, ...]:
    """Neglected causes that do not repeat with the gear mesh, one phrase each."""
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


class _Filling:
    """Rows of one sample after the other; speeds (A,): of the angles, per radian of the gear-mesh
    angle."""

    def __init__(self, modal: ModalSystem, pairs: PairData, flanks: Ints, speeds: Array) -> None:
        self.modal, self.pairs, self.flanks, self.speeds = modal, pairs, flanks, speeds
        self.data, self.work = packed(pairs), pair_rows(pairs)
        self.ends = {int(m): FlankEnds(pairs, int(m)) for m in np.flatnonzero(flanks)}
        self.elements: list[Array] = []
        self.parameters: list[Array] = []
        self.coefficients: dict[int, list[Array]] = {m: [] for m in self.ends}
        self.of_rows: list[tuple[Ints, Array]] = []  # flank or −3 − bearing row, its numbers
        self.source: list[int] = []  # flank of every channel
        self.bearing_rows: dict[int, Array] = {}
        self.support_rows: list[tuple[Array, float]] = []
        self._yields: list[Array] = []

    def add(self, j: int, angles: Array, start: Array) -> None:
        """Enter sample j, at the angles (A,), with those of sample 0."""
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
        self.of_rows.append((np.where(of_teeth, owner, -3 - owner), numbers))
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
            self._yields.append(between_rows(work, n)[np.ix_(taken, taken)])
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
        """(N, n, n), or nothing where no row yields to another."""
        if not self._yields:
            return np.zeros((0, 0, 0))
        out = np.zeros((len(self._yields), n, n))
        for matrix, part in zip(out, self._yields, strict=True):
            matrix[: len(part), : len(part)] = part
        return out

    def _directions(self, m: int, rows: Array) -> Array:
        """Orthonormal shares U (rows, k) with rows ≈ U Uᵀ rows, of rows (rows, c) of a flank.

        Where teeth are blocks they are measured by the motion that their forces cause: U are the
        first singular vectors of rows S^½ beside those of the rigid motions, S flexibility.
        """
        if not self.ends[m].teeth:
            u, s, _ = np.linalg.svd(rows, full_matrices=False)
            return np.asarray(u[:, s > DIRECTIONS * s[0]])
        at, r = self.ends[m].columns, self.modal.rigid_count
        p = self.modal.channel_modes[at]
        flexible = (p[:, r:] / self.modal.omega[r:] ** 2) @ p[:, r:].T
        flexible += self.modal.residual[np.ix_(at, at)]
        values, vectors = np.linalg.eigh(flexible)
        elastic = rows @ (vectors * np.sqrt(np.maximum(values, 0.0)))
        rigid = rows @ p[:, :r]
        size = np.linalg.norm(elastic) / (np.linalg.norm(rigid) or 1.0)
        u, s, _ = np.linalg.svd(np.hstack([elastic, size * rigid]), full_matrices=False)
        return np.asarray(u[:, s > TOOTH_DIRECTIONS * s[0]])

    def condensed(self) -> tuple[Array, Array, Ints, Array]:
        """Channels (q, n_c), rows (N, n, q), owners (N, n), and offsets, slopes of errors, nominal
        stiffness and damping (4, N, n)."""
        n = max((len(owner) for owner, _ in self.of_rows), default=0)
        owners = np.full((len(self.of_rows), n), -2, dtype=np.int64)
        numbers = np.zeros((4, *owners.shape))
        for j, (owner, values) in enumerate(self.of_rows):
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


def _springs(modal: ModalSystem, filled: _Filling, stage: int) -> Springs:
    """Turning supports at angle zero, and mean springs of the gear meshes of other stages."""
    springs = [(row, k, 0.0) for row, k in filled.support_rows]
    for columns, of_flank, damping in mean_channel_springs(modal, stage):
        full = np.zeros((len(of_flank), len(modal.channels)))
        full[:, columns] = of_flank
        springs += [(row, 1.0, damping) for row in full]
    rows = np.reshape([row for row, _, _ in springs], (-1, len(modal.channels)))
    return Springs(rows, *np.reshape([numbers for _, *numbers in springs], (-1, 2)).T)


def _loads(modal: ModalSystem, pairs: PairData) -> Array:
    """Constant forces (2, n_c) on the channels: by loads that do not turn, and of these what grows
    with the square of speed, at rated speed; torques of ports are no part of it."""
    out = np.zeros((2, len(modal.channels)))
    for block, vector, size, angle, grows in zip(
        pairs.load_block, pairs.load_vector, pairs.load_size, pairs.load_angle, pairs.load_grows,
        strict=True,
    ):  # fmt: skip
        if angle < 0:
            out[int(grows), 6 * block : 6 * block + 6] += size * vector
    return out
