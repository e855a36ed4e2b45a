r"""Gear meshes as linear springs under a load: at a position, or their mean over a gear-mesh cycle.

At a position of the train the rows of the tooth pairs that carry, linearised about the equilibrium
under the given torques, are springs Vᵀ K V with K = (I + T B)⁻¹ T: T tangents of the pairs'
laws, zero of pairs that do not touch, B what neighbouring pairs yield to each other. As the gears
turn, pairs come and go with the gear-mesh frequency. What vibrates as fast or faster than that
follows, to first order, the mean

    K̄ = 1/P Σ_p V(ψ_p)ᵀ K(ψ_p) V(ψ_p),   ψ_p = 2π p/P,

over the cycle of each stage, all else standing still: what turns slower than teeth pass (supports
that stand against a turning frame, bolts of a ring) is taken as it is, not smeared.

Rows move with the planets. The teeth of an FE ring pass through the gear mesh instead, so that the
mean is taken at a place that stands still against the planets: rows on teeth are turned back by
the ring's advance δ, as those on the teeth of FE planets are by theirs,

    u(φ_j − δ) = Σ_m D(φ_m − φ_j + δ) R(φ_j − φ_m) u_m,

with the Dirichlet kernel D of z teeth, the band-limited interpolation of a field given at z equal
places: it commutes with every matrix that is the same from tooth to tooth. N equal planets then see
a ring alike wherever its teeth stand, and pairs of planet and translational modes stay pairs.
P is a multiple of N, for the same reason.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium, revolution
from flexgear.analysis.line_loads import LineLoads, line_loads
from flexgear.analysis.modes import ContactSprings, FlankCycle, Springs, other_springs
from flexgear.arrays import Array, Ints
from flexgear.coupling.kernels.elements import Rows, between_rows, packed, pair_rows
from flexgear.coupling.kernels.pairs import build_rows, fill_rows
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import PairData, carrying_flanks
from flexgear.coupling.system import System

POSITIONS = 120  # of a gear-mesh cycle, or the next multiple of the number of planets
WITHIN = 8  # positions of a part of the cycle that counts by its mean
UNLOADED = 1e-9  # of the largest load: a gear mesh with less has none
NOTHING = 1e-14  # of the largest square of a row: what is left out of a sum of thousands


class _Samples:
    """Springs of a flank over P positions: rows (n, c) with Σ rowᵀ row = Σ_p Vᵀ K V on ``columns``
    (c,) of the blocks' motions; stiffness, damping (P,) and force (P, c): see ``FlankCycle``."""

    def __init__(self, columns: Ints, count: int) -> None:
        self.columns, self._parts = columns, list[Array]()
        self.stiffness, self.damping = np.zeros((2, count))
        self.force = np.zeros((count, len(columns)))

    def add(self, p: int, matrix: Array, damping: float, coefficients: Array) -> None:
        """Enter position p: K (n, n) and rows (n, c) that it acts on."""
        self._parts.append(_root(matrix) @ coefficients)
        self.stiffness[p], self.damping[p] = matrix.sum(), damping
        self.force[p] = matrix.sum(axis=0) @ coefficients

    @cached_property
    def rows(self) -> Array:
        """As few as there can be."""
        return _fewest(np.vstack(self._parts))


def springs_under_load(modal: ModalSystem, input_angles: Array) -> ContactSprings:
    """Springs at independent rotations (F,) rad under the rated torques."""
    system, at = modal.system, np.asarray(input_angles, dtype=float)[None]
    theta, every = system.theta(at), np.ones(len(system.pairs.s0), dtype=bool)
    result = revolution(modal, at, system.rated_torque)
    samples = _samples(system, theta, every, result)
    return _springs(system, samples, theta[0], cycles=False)


def mean_springs(system: System, modal: ModalSystem | None) -> ContactSprings:
    """Mean springs over a cycle of each stage, at zero of all that turns slower.

    modal: of the system, for the equilibria under rated torques that say which pairs touch; None of
    a train without load, of which all pairs in the zone of contact do. So do those of a gear mesh
    that the torques leave unloaded.
    """
    samples: dict[int, _Samples] = {}
    for stage in sorted({label.stage for label in system.gear_meshes}):
        of_stage = np.array([label.stage == stage for label in system.gear_meshes])
        samples |= _cycle_samples(system, of_stage, modal)
    return _springs(system, samples, np.zeros(len(system.angles)), cycles=True)


def mean_channel_springs(modal: ModalSystem, left_out: int) -> list[tuple[Ints, Array, float]]:
    """Mean springs under rated torques of the gear meshes of all stages but one, on the channels:
    columns (c,), rows (n, c) with K̄ = rowᵀ row, and damping over stiffness, s."""
    system, out = modal.system, list[tuple[Ints, Array, float]]()
    for stage in sorted({label.stage for label in system.gear_meshes} - {left_out}):
        of_stage = np.array([label.stage == stage for label in system.gear_meshes])
        for sample in _cycle_samples(system, of_stage, modal).values():
            ratio = float(sample.damping.sum() / sample.stiffness.sum())
            rows = sample.rows / math.sqrt(len(sample.stiffness))
            out.append((sample.columns, rows, ratio))
    return out


@dataclass(frozen=True)
class StageCycle:
    """Gear meshes of a stage in n modes over P equal parts of its gear-mesh cycle, each with its
    mean over the part: stiffness (P, n, n) and damping (P, n, n), in the order in which a train at
    rated speed runs through them."""

    stiffness: Array
    damping: Array


def stage_cycle(system: System, modal: ModalSystem | None, stage: int, shapes: Array) -> StageCycle:
    """Stiffness of the gear meshes of a stage (number from 0) over one gear-mesh period, in modes
    ``shapes`` (d, n); modal: see ``mean_springs``.

    Each part's mean is of ``WITHIN`` positions, so that a pair that comes into contact within a
    part counts by its share of it.
    """
    of_stage = np.array([label.stage == stage for label in system.gear_meshes])
    count, ends = _count(system, of_stage), _ends(system.pairs)
    turn = int(system.pairs.angle[np.flatnonzero(of_stage)[0]])
    backwards = system.angles[turn] @ system.rolling @ system.rated_input_speeds < 0.0
    theta = cycle_angles(system, of_stage, count * WITHIN, -1.0 if backwards else 1.0)
    result = _under_load(system, modal, theta)
    motion = [system.blocks[end.columns] @ shapes for end in ends]
    stiffness, damping = np.zeros((2, count, shapes.shape[1], shapes.shape[1]))
    for at in _positions(system, theta, of_stage, result, ends):
        rows = at.rows @ motion[at.flank]
        stiffness[at.p // WITHIN] += rows.T @ at.matrix @ rows / WITHIN
        damping[at.p // WITHIN] += (rows.T * at.damping) @ rows / WITHIN
    return StageCycle(stiffness, damping)


def _cycle_samples(
    system: System, of_stage: NDArray[np.bool_], modal: ModalSystem | None
) -> dict[int, _Samples]:
    """Spring factors of the flanks ``of_stage`` (M,) over a cycle, under rated torques or none."""
    theta = cycle_angles(system, of_stage, _count(system, of_stage))
    return _samples(system, theta, of_stage, _under_load(system, modal, theta))


def _samples(
    system: System, theta: Array, of_stage: NDArray[np.bool_], result: Equilibrium | None
) -> dict[int, _Samples]:
    """Spring factors of the flanks ``of_stage`` (M,) over positions (P, A); of the pairs that
    touch in an equilibrium, where there is one."""
    ends = _ends(system.pairs)
    samples: dict[int, _Samples] = {}
    for at in _positions(system, theta, of_stage, result, ends):
        of_flank = samples.setdefault(at.flank, _Samples(ends[at.flank].columns, len(theta)))
        of_flank.add(at.p, at.matrix, float(at.damping.sum()), at.rows)
    return samples


def _count(system: System, of_stage: NDArray[np.bool_]) -> int:
    """``POSITIONS``, or the next multiple of the number of planets."""
    planets = {
        label.planet for label, here in zip(system.gear_meshes, of_stage, strict=True) if here
    }
    return len(planets) * math.ceil(POSITIONS / len(planets))


def _under_load(system: System, modal: ModalSystem | None, theta: Array) -> Equilibrium | None:
    """Equilibria at the positions (P, A) under rated torques, or none."""
    if modal is None:
        return None
    at_zero = np.zeros((len(theta), len(system.input_rows)))
    return revolution(modal, at_zero, system.rated_torque, theta=theta)


def cycle_angles(
    system: System, of_stage: NDArray[np.bool_], count: int, sense: float = 1.0
) -> Array:
    """Angles (P, A) over a gear-mesh cycle of the flanks ``of_stage`` (M,), all others 0; sense: −1
    for falling ones."""
    pairs = system.pairs
    m = int(np.flatnonzero(of_stage)[0])
    theta = np.zeros((count, len(system.angles)))
    turn, planets_turn = int(pairs.angle[m]), int(pairs.planet_turns[m])
    theta[:, turn] = sense * abs(pairs.pitch[m] / pairs.rate[m]) / count * np.arange(count)
    if planets_turn >= 0:  # FE planets, in a fixed ratio
        row = system.angles[turn]
        ratio = float(system.angles[planets_turn] @ row) / float(row @ row)
        theta[:, planets_turn] = ratio * theta[:, turn]
    return theta


class _Position(NamedTuple):
    """Rows of a flank at position p: K (n, n), rows (n, c) on ``FlankEnds.columns``, damping (n,),
    0 of rows that do not touch."""

    flank: int
    p: int
    matrix: Array
    rows: Array
    damping: Array


def _ends(pairs: PairData) -> list[FlankEnds]:
    return [FlankEnds(pairs, m) for m in range(len(pairs.s0))]


def _positions(
    system: System,
    theta: Array,
    of_stage: NDArray[np.bool_],
    result: Equilibrium | None,
    ends: Sequence[FlankEnds],
) -> Iterator[_Position]:
    """Every flank ``of_stage`` (M,) that has a spring at one of the positions (P, A)."""
    pairs, work = system.pairs, pair_rows(system.pairs)
    elements, carrying = packed(pairs), carrying_flanks(pairs)
    lines = None if result is None else line_loads(result)
    unloaded = _unloaded(pairs, result)
    for p, angles in enumerate(np.ascontiguousarray(theta)):
        flanks = carrying if result is None else result.active_flanks[p] | carrying
        flanks = np.where(of_stage, flanks, 0)
        n, _, count = fill_rows(elements, angles, flanks, work)
        tangents = _tangents(work, n, count, p, result, lines, unloaded)
        for m, at in _of_flanks(work, n):
            matrix = tangents[np.ix_(at, at)]
            if matrix.any():
                rows = ends[m].coefficients(work, at, angles, theta[0])
                damping = np.where(matrix.any(axis=1), work.row["damping"][at], 0.0)
                yield _Position(m, p, matrix, rows, damping)


def _of_flanks(rows: Rows, n: int) -> Iterator[tuple[int, Ints]]:
    """Every flank among the first n rows, and its rows."""
    owner = np.where(rows.row["kind"][:n] >= 0, rows.row["owner"][:n], -1)
    for m in np.unique(owner[owner >= 0]):
        yield int(m), np.flatnonzero(owner == m).astype(np.int64)


def _unloaded(pairs: PairData, result: Equilibrium | None) -> NDArray[np.bool_]:
    """Flanks (M,) that should carry and do not."""
    if result is None:
        return np.ones(len(pairs.s0), dtype=bool)
    load = np.abs(result.pair_load).max(axis=(0, 2), initial=0.0)
    return (pairs.carries == 1) & (load <= UNLOADED * load.max(initial=0.0))


def _tangents(
    rows: Rows,
    n: int,
    count: int,
    p: int,
    result: Equilibrium | None,
    lines: LineLoads | None,
    unloaded: NDArray[np.bool_],
) -> Array:
    """K (n, n) N/m of the first n rows with so many tooth pairs at position p."""
    tangent = np.zeros((n, n))
    for pair in rows.pair[:count]:
        i, m, slot = int(pair["row"]), int(pair["mesh"]), int(pair["slot"])
        if unloaded[m] or result is None or (rows.row["sided"][i] == 0 and pair["rows"] == 1):
            rows_of_pair = slice(i, i + int(pair["rows"]))
            tangent[rows_of_pair, rows_of_pair] = np.diag(rows.row["stiffness"][rows_of_pair])
        elif pair["rows"] == 2:
            assert lines is not None  # pairs with two rows have slices
            tangent[i : i + 2, i : i + 2] = np.nan_to_num(lines.tangent[p, m, slot])
        elif result.pair_load[p, m, slot] > 0.0:
            tangent[i, i] = rows.row["stiffness"][i]
    if rows.row["following"][:n].any():
        return np.asarray(np.linalg.solve(np.eye(n) + tangent @ between_rows(rows, n), tangent))
    return tangent


def _root(matrix: Array) -> Array:
    """A with Aᵀ A = K."""
    if len(matrix) == 1:
        return np.sqrt(matrix)
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray((vectors * np.sqrt(np.clip(values, 0.0, None))).T)


def _fewest(rows: Array) -> Array:
    """Fewer rows with the same sum of squares rowᵀ row."""
    if len(rows) > rows.shape[1]:
        return np.asarray(np.linalg.qr(rows, mode="r"))
    values, vectors = np.linalg.eigh(rows @ rows.T)
    significant = values > NOTHING * values[-1]
    return np.asarray(vectors[:, significant].T @ rows)


@dataclass(frozen=True)
class _Teeth:
    """Teeth of a gear that are blocks from ``first`` on, at angles ``place`` (z,) rad; turns: angle
    by which they pass their gear mesh, backwards where sense is 1, −1: they stand."""

    first: int
    place: Array
    turns: int
    sense: float

    def advance(self, angles: Array, start: Array) -> float:
        """How far they have gone back between two sets of angles (A,), rad."""
        if self.turns < 0:
            return 0.0
        return self.sense * float(angles[self.turns] - start[self.turns])

    def turned_back(self, wrench: Array, tooth: int, advance: float) -> Array:
        """A wrench (6,) on a tooth as one on all teeth (6 z,) that moves it back by ``advance``."""
        count = len(self.place)
        if advance == 0.0:
            out = np.zeros((count, 6))
            out[tooth] = wrench
            return out.ravel()
        away = self.place - self.place[tooth]
        share = _kernel(away + advance, count)
        c, s = share * np.cos(away), share * np.sin(away)
        x, y, z = wrench[0::3], wrench[1::3], wrench[2::3]
        out = np.empty((count, 6))
        out[:, 0::3] = np.outer(c, x) - np.outer(s, y)
        out[:, 1::3] = np.outer(s, x) + np.outer(c, y)
        out[:, 2::3] = np.outer(share, z)
        return out.ravel()


class FlankEnds:
    """Blocks that a flank's rows act on: its planet's and its gear's, and all teeth of either whose
    teeth are blocks."""

    def __init__(self, pairs: PairData, m: int) -> None:
        gear, planet = int(pairs.gear_block[m]), int(pairs.planet_tooth_block[m])
        self.teeth: list[_Teeth] = []
        if pairs.per_tooth[m]:
            place = _angles(pairs.tooth_position, gear, int(pairs.gear_teeth[m]))
            self.teeth.append(_Teeth(gear, place, int(pairs.turns[m]), 1.0))
        if pairs.planet_turns[m] >= 0:
            place = _angles(pairs.tooth_position, planet, int(pairs.planet_teeth[m]))
            self.teeth.append(_Teeth(planet, place, int(pairs.planet_turns[m]), -1.0))
        alone = [int(pairs.planet_block[m]), *([] if pairs.per_tooth[m] else [gear])]
        blocks = [*alone, *(t.first + k for t in self.teeth for k in range(len(t.place)))]
        self.columns = (6 * np.array(blocks)[:, None] + np.arange(6)).ravel().astype(np.int64)
        starts = np.cumsum([6 * len(alone), *(6 * len(t.place) for t in self.teeth)]).tolist()
        self._of_teeth = [slice(a, b) for a, b in pairwise(starts)]
        self._of_block = {block: slice(6 * k, 6 * k + 6) for k, block in enumerate(alone)}

    def coefficients(self, rows: Rows, at: Ints, angles: Array, start: Array) -> Array:
        """Rows ``at`` on ``columns`` (n, c), teeth turned back by their advance since ``start``."""
        out = np.zeros((len(at), len(self.columns)))
        for row, i in zip(out, at, strict=True):
            for a in range(int(rows.row["width"][i])):
                block, wrench = int(rows.blocks[i, a]), rows.coef[i, a]
                if block in self._of_block:
                    row[self._of_block[block]] += wrench
                    continue
                for teeth, columns in zip(self.teeth, self._of_teeth, strict=True):
                    if 0 <= block - teeth.first < len(teeth.place):
                        advance = teeth.advance(angles, start)
                        row[columns] += teeth.turned_back(wrench, block - teeth.first, advance)
        return out


def _angles(positions: Array, first: int, teeth: int) -> Array:
    """Angles (z,) of the tooth nodes from block ``first`` on, rad."""
    place = positions[first : first + teeth]
    return np.arctan2(place[:, 1], place[:, 0])


def _kernel(x: Array, count: int) -> Array:
    """Dirichlet kernel of ``count`` equal places, 1 at x = 0 and 0 at the others."""
    below = count * (np.sin(0.5 * x) if count % 2 else np.tan(0.5 * x))
    here = np.abs(np.sin(0.5 * x)) < 1e-12
    return np.where(here, 1.0, np.sin(0.5 * count * x) / np.where(here, 1.0, below))


def _springs(
    system: System, samples: dict[int, _Samples], theta: Array, cycles: bool
) -> ContactSprings:
    """Means over the positions of ``samples``; other springs at angles (A,)."""
    d, springs, over = system.size, {}, {}
    for m, sample in samples.items():
        blocks, count = system.blocks[sample.columns], len(sample.stiffness)
        springs[m] = Springs(sample.rows @ blocks, np.eye(len(sample.rows)) / count)
        if cycles:
            over[m] = FlankCycle(sample.stiffness, sample.damping, sample.force, blocks)
    nothing = Springs(np.zeros((0, d)), np.zeros((0, 0)))
    rows = pair_rows(system.pairs)
    n, _ = build_rows(system.pairs, rows, theta, carrying_flanks(system.pairs))
    flanks = tuple(springs.get(m, nothing) for m in range(len(system.pairs.s0)))
    return ContactSprings(flanks, other_springs(system, rows, n), over)
