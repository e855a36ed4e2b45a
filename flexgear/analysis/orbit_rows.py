"""Rows of the force elements of one stage over a gear-mesh period, reduced to few channels.

The rows of a flank, and those of a bearing, are a group: they act on channels of their own.
"""

from typing import NamedTuple

import numpy as np

from flexgear.analysis.flank_ends import FlankEnds
from flexgear.arrays import Array, Ints
from flexgear.coupling.kernels.elements import Rows, between_rows, packed, pair_rows
from flexgear.coupling.kernels.pair_errors import error_rates
from flexgear.coupling.kernels.pairs import fill_rows
from flexgear.coupling.laws import LAW_NUMBERS
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import LOAD, SUPPORT, PairData

DAMPER = -100  # kind of the rows of dampers
LEAST_SINGULAR = 1e-9  # singular values over the largest, below which directions are dropped
# where teeth are blocks: flexibility, proportional to the square, is then exact to 1e-4
LEAST_SINGULAR_OF_TEETH = 1e-2


class Condensed(NamedTuple):
    """Channels, groups, rows, owner, elements and between of ``OrbitElements``; numbers (4, N, n):
    offsets, slopes of errors, nominal stiffness and damping of the rows."""

    channels: Array
    groups: Ints
    rows: Array
    owner: Ints
    numbers: Array
    elements: Ints
    between: Array


class RowCollector:
    """Collects the rows of all samples, then reduces them to channels; speeds (A,): derivatives of
    the train's angles by the gear-mesh angle."""

    def __init__(self, modal: ModalSystem, pairs: PairData, flanks: Ints, speeds: Array) -> None:
        self.modal, self.pairs, self.flanks, self.speeds = modal, pairs, flanks, speeds
        self.data, self.work = packed(pairs), pair_rows(pairs)
        self.ends = {int(m): FlankEnds(pairs, int(m)) for m in np.flatnonzero(flanks)}
        # per sample (e, 4): number of the law, sample, first row in the sample, number of rows
        self.elements: list[Ints] = []
        self.parameters: list[Array] = []
        self.coefficients: dict[int, list[Array]] = {m: [] for m in self.ends}
        # per sample: flank or −3 − bearing row (n,); offset, slope of error, stiffness, damping
        self.row_data: list[tuple[Ints, Array]] = []
        self.source: list[int] = []  # flank of every channel
        self.bearing_rows: dict[int, Array] = {}
        # of supports and dampers: row, stiffness, damping, and bearing row or −1
        self.linear_rows: list[tuple[Array, float, float, int]] = []
        self.flexibilities: dict[int, Array] = {}  # between rows (n, n), by sample

    def add(self, j: int, angles: Array, start: Array) -> None:
        """Add sample j at angles (A,); start (A,): angles of sample 0."""
        work = self.work
        n, count, _ = fill_rows(self.data, angles, self.flanks, work)
        kinds = work.row["kind"][:n].copy()
        element, damped = work.element[:count], np.zeros(n)
        for e in np.flatnonzero(element["law"] == LAW_NUMBERS["dampers"]):
            first, rows = int(element["first"][e]), int(element["rows"][e])
            damped[first : first + rows] = work.parameters[e, :rows]
            kinds[first : first + rows] = DAMPER
        taken = np.flatnonzero((kinds != SUPPORT) & (kinds != LOAD) & (kinds != DAMPER))
        row, of_teeth = work.row[taken], kinds[taken] >= 0
        owner = row["owner"].astype(np.int64)
        flank, slopes = np.where(of_teeth, owner, 0), np.zeros(len(self.flanks))
        error_rates(self.data.gears, angles, self.speeds, self.flanks, slopes)
        carries = np.where(of_teeth, self.pairs.carries[flank], 1.0)
        springs = carries * np.array([row["stiffness"], row["damping"]])
        numbers = np.vstack([row["offset"], of_teeth * slopes[flank], springs])
        self.row_data.append((np.where(of_teeth, owner, -3 - owner), numbers))
        for m in np.unique(owner[of_teeth]).tolist():
            at = taken[of_teeth & (owner == m)]
            self.coefficients[m].append(self.ends[m].coefficients(work, at, angles, start))
        for i, number in zip(taken[~of_teeth], owner[~of_teeth].tolist(), strict=True):
            self.bearing_rows.setdefault(number, self._on_channels(work, int(i)))
        selected = np.isin(element["first"], taken)
        place = np.searchsorted(taken, element["first"])
        columns = np.column_stack([element["law"], 0 * place + j, place, element["rows"]])
        self.elements.append(columns[selected])
        self.parameters.append(work.parameters[:count][selected])
        if work.row["following"][:n].any():
            self.flexibilities[j] = between_rows(work, n)[np.ix_(taken, taken)]
        if j == 0:
            for i in np.flatnonzero((kinds == SUPPORT) | (damped > 0.0)).tolist():
                turning = kinds[i] == SUPPORT
                stiffness = float(work.row["stiffness"][i]) if turning else 0.0
                number = -1 if turning else int(work.row["owner"][i])
                row = self._on_channels(work, i)
                self.linear_rows.append((row, stiffness, float(damped[i]), number))

    def _on_channels(self, work: Rows, i: int) -> Array:
        row = np.zeros(len(self.modal.channels))
        for a in range(int(work.row["width"][i])):
            at = 6 * int(work.blocks[i, a])
            row[at : at + 6] += work.coef[i, a]
        return row

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

    def condensed(self) -> Condensed:
        """All rows in groups."""
        owner = np.concatenate([owners for owners, _ in self.row_data])
        counts = np.array([len(owners) for owners, _ in self.row_data])
        sample, starts = np.repeat(np.arange(len(counts)), counts), np.cumsum(counts) - counts
        elements = np.vstack(self.elements).astype(np.int64)
        first = starts[elements[:, 1]] + elements[:, 2]
        label = owner.copy()  # of a group: the first row of its element
        for k in range(int(elements[:, 3].max(initial=1))):
            at = first[elements[:, 3] > k]
            label[at + k] = owner[at]
        channels, groups, shares = self._channels(owner, label)
        group = np.searchsorted(sorted(groups), label)
        count = len(groups)
        slot = _rank(sample * count + group)
        r, p = int(slot.max(initial=0)) + 1, max(map(len, groups.values()), default=0)
        shape = len(counts), count, r
        at_row = sample, group, slot
        numbers, owners = np.zeros((4, *shape)), np.full(shape, -2, dtype=np.int64)
        numbers[:, *at_row] = np.concatenate([values for _, values in self.row_data], axis=1)
        owners[at_row] = np.where(owner < -2, -1, owner)
        rows = np.zeros((*shape, p))
        for m, part in shares.items():
            at_flank = tuple(x[owner == m] for x in at_row)
            rows[*at_flank, : part.shape[1]] = part
        bearing = owner < -2
        rows[*(x[bearing] for x in at_row), slot[bearing]] = 1.0
        between = np.zeros((*shape, r) if self.flexibilities else (0, 0, 0, 0))
        for j, flexibility in self.flexibilities.items():
            a, b = (starts[j] + x for x in np.nonzero(flexibility))
            between[j, group[a], slot[a], slot[b]] = flexibility[a - starts[j], b - starts[j]]
        elements[:, 1], elements[:, 2] = sample[first] * count + group[first], slot[first]
        padded = [[*groups[x], *[len(channels)] * (p - len(groups[x]))] for x in sorted(groups)]
        return Condensed(
            channels=channels,
            groups=np.array(padded, np.int64).reshape(count, p),
            rows=rows,
            owner=owners.reshape(len(counts), -1),
            numbers=numbers.reshape(4, len(counts), -1),
            elements=elements,
            between=between,
        )

    def _channels(
        self, owner: Ints, label: Ints
    ) -> tuple[Array, dict[int, list[int]], dict[int, Array]]:
        """Channels (q, n_c), those of each group by its label, and for each flank its rows (·, k)
        on its k channels, in the order of samples."""
        channels, shares = [np.zeros((0, len(self.modal.channels)))], dict[int, Array]()
        groups = dict[int, list[int]]()
        for m, parts in self.coefficients.items():
            if not parts:
                continue
            vectors = np.vstack(parts)
            directions = self._directions(m, vectors)
            part = np.zeros((directions.shape[1], len(self.modal.channels)))
            part[:, self.ends[m].columns] = directions.T @ vectors
            channels.append(part)
            groups[m] = list(range(len(self.source), len(self.source) + len(part)))
            shares[m] = directions
            self.source += [m] * len(part)
        labels = dict(zip(owner.tolist(), label.tolist(), strict=True))
        for place, number in enumerate(self.bearing_rows, len(self.source)):
            groups.setdefault(labels[-3 - number], []).append(place)
        channels += [row[None] for row in self.bearing_rows.values()]
        return np.vstack(channels), groups, shares


def _rank(keys: Ints) -> Ints:
    """Number of earlier equal keys, of each key."""
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    begins = np.flatnonzero(np.diff(ordered, prepend=-1) != 0)
    counts = np.diff(np.append(begins, len(keys)))
    out = np.empty(len(keys), dtype=np.int64)
    out[order] = np.arange(len(keys)) - np.repeat(begins, counts)
    return out
