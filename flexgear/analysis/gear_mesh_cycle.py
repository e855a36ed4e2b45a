r"""Gear meshes as linear springs under a load: at a position, or their mean over a gear-mesh cycle.

At a position of the train the loaded tooth pairs, linearised about the equilibrium under given
torques, are springs Vᵀ K V with K = (I + T B)⁻¹ T: V (n, d) rows of the pairs, T (n, n) tangents of
their laws, zero for pairs without contact, B (n, n) flexibility between neighbouring pairs. As the
gears turn, pairs enter and leave with the gear-mesh frequency. The mean over the cycle of a stage,

    K̄ = 1/P Σ_p V(ψ_p)ᵀ K(ψ_p) V(ψ_p),   ψ_p = 2π p/P,

gives to first order the stiffness for vibration. Slower rotations (supports fixed in the housing
seen from a turning frame, bolts of a ring) are kept at angle zero, not averaged.

Rows move with the planets. The teeth of an FE ring pass through the gear mesh instead: rows on them
are turned back by the ring's advance (``flank_ends``). N equal planets then have equal springs to
the ring whatever the position of its teeth, and planet and translational modes keep their repeated
frequencies. P is a multiple of N for the same reason.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from flexgear.analysis.equilibrium import Equilibrium, revolution
from flexgear.analysis.flank_cycle import FlankCycle
from flexgear.analysis.flank_ends import FlankEnds
from flexgear.analysis.line_loads import line_loads
from flexgear.analysis.modes import ContactSprings, RowSprings, other_springs
from flexgear.arrays import Array, Ints
from flexgear.coupling.kernels.elements import Rows, between_rows, packed, pair_rows
from flexgear.coupling.kernels.pairs import build_rows, fill_rows
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import PairData, carrying_flanks
from flexgear.coupling.system import System

POSITIONS = 120  # in a gear-mesh cycle, rounded up to a multiple of the number of planets
WITHIN = 8  # positions in each part of a cycle of which the mean is taken
UNLOADED = 1e-9  # load over the largest load below which a gear mesh is unloaded
FLAT = 1e-10  # stiffness over the largest below which a motion of rigid ends closes no row
LEAST_EIGENVALUE = 1e-14  # over the largest, below which rows are dropped from a sum of squares


@dataclass(frozen=True)
class _FlankRows:
    """R rows of a flank at P positions (``count``), of tooth pairs in contact.

    position (R,): position of each row, rising; motion (R, c): the rows on the motions ``columns``
    (c,) of the blocks; rigid (c, e): the motions of rigid ends; stiffness (R, R): K of all
    positions, N/m; root: A with Aᵀ A = K, block by block; damping (R,) N s/m; load (R,) N in the
    equilibria.
    """

    count: int
    position: Ints
    columns: Ints
    motion: Array
    rigid: Array
    stiffness: sparse.csr_array
    root: sparse.csr_array
    damping: Array
    load: Array

    @cached_property
    def rows(self) -> Array:
        """The least number of rows (n, c) with Σ rowᵀ row = Σ_p Vᵀ K V."""
        rows = self.root @ self.motion
        if len(rows) > rows.shape[1]:
            return np.asarray(np.linalg.qr(rows, mode="r"))
        values, vectors = np.linalg.eigh(rows @ rows.T)
        significant = values > LEAST_EIGENVALUE * values[-1]
        return np.asarray(vectors[:, significant].T @ rows)

    def cycle(self, blocks: Array) -> FlankCycle:
        """Stiffness, damping and force at each position; blocks (c, d): motions of ``columns``."""
        at = (self.position, np.arange(len(self.position)))
        total = sparse.csr_array((np.ones(len(at[0])), at), shape=(self.count, len(at[0])))
        row_sums = self.stiffness.sum(axis=1)
        force = total @ (row_sums[:, None] * self.motion)
        rows = self.motion @ self.rigid
        mean = np.linalg.pinv(rows.T @ (self.stiffness @ rows), FLAT) @ (rows.T @ self.load)
        load = total @ ((self.stiffness @ (rows @ mean))[:, None] * self.motion)
        return FlankCycle(
            total @ row_sums, total @ self.damping, force, self.rigid @ mean, load, blocks
        )


def springs_under_load(modal: ModalSystem, input_angles: Array) -> ContactSprings:
    """Springs at independent rotations (F,) rad under the rated torques."""
    system, angles = modal.system, np.asarray(input_angles, dtype=float)[None]
    theta, every = system.theta(angles), np.ones(len(system.pairs.s0), dtype=bool)
    flanks = _flank_rows(system, theta, every, revolution(modal, angles, system.rated_torque))
    return _springs(system, flanks, theta[0], cycles=False)


def mean_springs(system: System, modal: ModalSystem | None) -> ContactSprings:
    """Mean springs over a cycle of each stage, with all slower rotations at zero.

    modal: modes of the system, for the equilibria under rated torques in which pairs touch. None:
    a train without load, in which all pairs in the zone of contact touch. Pairs of an unloaded gear
    mesh are always taken as touching.
    """
    flanks: dict[int, _FlankRows] = {}
    for stage in sorted({label.stage for label in system.gear_meshes}):
        flanks |= _cycle_rows(system, stage, modal)
    return _springs(system, flanks, np.zeros(len(system.angles)), cycles=True)


def mean_channel_springs(modal: ModalSystem, left_out: int) -> list[tuple[Ints, Array, float]]:
    """Mean springs under rated torques of all flanks but those of the stage ``left_out``: channels
    (c,), rows (n, c) with K̄ = Σ rowᵀ row, and damping over stiffness, s."""
    system, out = modal.system, list[tuple[Ints, Array, float]]()
    for stage in sorted({label.stage for label in system.gear_meshes} - {left_out}):
        for flank in _cycle_rows(system, stage, modal).values():
            ratio = float(flank.damping.sum() / flank.stiffness.sum())
            out.append((flank.columns, flank.rows / math.sqrt(flank.count), ratio))
    return out


@dataclass(frozen=True)
class StageCycle:
    """Stiffness and damping (P, n, n) of the gear meshes of a stage in n modes, as means over P
    equal parts of its gear-mesh cycle, in the order of time at rated speed."""

    stiffness: Array
    damping: Array


def stage_cycle(system: System, modal: ModalSystem | None, stage: int, shapes: Array) -> StageCycle:
    """Stiffness and damping of the gear meshes of a stage (number from 0) over one gear-mesh
    period, in modes ``shapes`` (d, n); modal: see ``mean_springs``.

    The mean over a part is taken over ``WITHIN`` positions, so that a pair that enters contact
    within the part contributes in proportion to its time in contact.
    """
    of_stage = _flanks_of(system, stage)
    count = _count(system, of_stage)
    angle = int(system.pairs.angle[np.flatnonzero(of_stage)[0]])
    backwards = system.angles[angle] @ system.rolling @ system.rated_input_speeds < 0.0
    theta = cycle_angles(system, of_stage, count * WITHIN, -1.0 if backwards else 1.0)
    stiffness, damping = np.zeros((2, count, shapes.shape[1], shapes.shape[1]))
    flanks = _flank_rows(system, theta, of_stage, _under_load(system, modal, theta))
    for flank in flanks.values():
        motion = flank.motion @ (system.blocks[flank.columns] @ shapes)
        forces = (flank.stiffness @ motion, flank.damping[:, None] * motion)
        ends = np.searchsorted(flank.position, WITHIN * np.arange(count + 1))
        for part, (start, stop) in enumerate(pairwise(ends)):
            for total, force in zip((stiffness, damping), forces, strict=True):
                total[part] += motion[start:stop].T @ force[start:stop] / WITHIN
    return StageCycle(stiffness, damping)


def _flanks_of(system: System, stage: int) -> NDArray[np.bool_]:
    """Whether each flank (M,) belongs to a stage (number from 0)."""
    return np.array([label.stage == stage for label in system.gear_meshes])


def _cycle_rows(system: System, stage: int, modal: ModalSystem | None) -> dict[int, _FlankRows]:
    """Rows of the flanks of a stage over its cycle; modal: see ``mean_springs``."""
    of_stage = _flanks_of(system, stage)
    theta = cycle_angles(system, of_stage, _count(system, of_stage))
    speeds = system.rated_input_speeds  # none in free vibration
    if len(speeds) and system.theta(speeds) @ theta[1] < 0.0:
        theta[1:] -= len(theta) * theta[1]  # the same phases at positions of the mirror image
    return _flank_rows(system, theta, of_stage, _under_load(system, modal, theta))


def _count(system: System, of_stage: NDArray[np.bool_]) -> int:
    """``POSITIONS``, rounded up to a multiple of the number of planets."""
    planets = {
        label.planet
        for label, included in zip(system.gear_meshes, of_stage, strict=True)
        if included
    }
    return len(planets) * math.ceil(POSITIONS / len(planets))


def _under_load(system: System, modal: ModalSystem | None, theta: Array) -> Equilibrium | None:
    """Equilibria at positions (P, A) under rated torques; None without ``modal``."""
    if modal is None:
        return None
    at_zero = np.zeros((len(theta), len(system.input_rows)))
    return revolution(modal, at_zero, system.rated_torque, theta=theta)


def cycle_angles(
    system: System, of_stage: NDArray[np.bool_], count: int, sense: float = 1.0
) -> Array:
    """Angles (P, A) over a gear-mesh cycle of the flanks ``of_stage`` (M,), other angles zero;
    sense: 1 for a rising angle, −1 for a falling one."""
    pairs = system.pairs
    m = int(np.flatnonzero(of_stage)[0])
    theta = np.zeros((count, len(system.angles)))
    angle, planet_angle = int(pairs.angle[m]), int(pairs.planet_turns[m])
    theta[:, angle] = sense * abs(pairs.pitch[m] / pairs.rate[m]) / count * np.arange(count)
    if planet_angle >= 0:  # FE planets turn in a fixed ratio
        row = system.angles[angle]
        ratio = float(system.angles[planet_angle] @ row) / float(row @ row)
        theta[:, planet_angle] = ratio * theta[:, angle]
    return theta


class _TrainRows(NamedTuple):
    """Rows of a train at P positions, joined in ``rows`` without elements and active dofs.

    starts (P + 1,): first row of each position; pair_position (n,): position of each tooth pair;
    between: B of each position, an empty list without coupling of pairs."""

    rows: Rows
    starts: Ints
    pair_position: Ints
    between: list[Array]


def _train_rows(
    system: System, theta: Array, of_stage: NDArray[np.bool_], active: Ints | None
) -> _TrainRows:
    """Rows at positions (P, A) of those flanks ``of_stage`` (M,) that carry rated load or are
    ``active`` (P, M)."""
    work, elements = pair_rows(system.pairs), packed(system.pairs)
    carrying = carrying_flanks(system.pairs)
    parts, starts, between = [], [0], []
    for p, angles in enumerate(np.ascontiguousarray(theta)):
        flanks = carrying if active is None else active[p] | carrying
        n, _, pairs = fill_rows(elements, angles, np.where(of_stage, flanks, 0), work)
        pair = work.pair[:pairs].copy()
        pair["row"] += starts[-1]
        parts.append((work.row[:n].copy(), work.blocks[:n].copy(), work.coef[:n].copy(), pair,
                      np.full(pairs, p)))  # fmt: skip
        between.append(between_rows(work, n))
        starts.append(starts[-1] + n)
    row, blocks, coef, pair, position = (
        np.concatenate(part, dtype=part[0].dtype)  # without dtype NumPy promotes records slowly
        for part in zip(*parts, strict=True)
    )
    between = between if row["following"].any() else []
    rows = work._replace(row=row, blocks=blocks, coef=coef, pair=pair)
    return _TrainRows(rows, np.array(starts), position, between)


def _flank_rows(
    system: System, theta: Array, of_stage: NDArray[np.bool_], result: Equilibrium | None
) -> dict[int, _FlankRows]:
    """Rows of the flanks ``of_stage`` (M,) over positions (P, A), of pairs that touch in the
    equilibria ``result``; of all pairs where it is None."""
    train = _train_rows(system, theta, of_stage, None if result is None else result.active_flanks)
    stiffness = _stiffness(train, result, _unloaded(system.pairs, result))
    root, touching = _root(stiffness, train.starts), stiffness.count_nonzero(axis=1) > 0
    position = np.repeat(np.arange(len(theta)), np.diff(train.starts))
    flanks, rows, load = {}, train.rows, _row_loads(train, result)
    for m in np.unique(rows.row["owner"][touching]).tolist():
        at = np.flatnonzero(touching & (rows.row["owner"] == m))
        p, ends = position[at], FlankEnds(system.pairs, m)
        flanks[m] = _FlankRows(
            len(theta), p, ends.columns, ends.coefficients(rows, at, theta[p], theta[0]),
            ends.rigid, stiffness[at][:, at], root[at][:, at], rows.row["damping"][at], load[at],
        )  # fmt: skip
    return flanks


def _row_loads(train: _TrainRows, result: Equilibrium | None) -> Array:
    """Forces (R,) N of all rows in the equilibria; zero without."""
    load = np.zeros(len(train.rows.row))
    if result is not None:
        pair = train.rows.pair
        first, *of_pair = (pair[name].astype(int) for name in ("row", "gear_mesh", "slot"))
        place = (train.pair_position, *of_pair)
        load[first] = result.pair_load[place]
        sliced = pair["rows"] == 2
        if sliced.any():
            far = result.far_load[place][sliced]
            load[first[sliced]] -= far
            load[first[sliced] + 1] = far
    return load


def _unloaded(pairs: PairData, result: Equilibrium | None) -> NDArray[np.bool_]:
    """Whether each flank (M,) is without load although it carries rated load."""
    if result is None:
        return np.ones(len(pairs.s0), dtype=bool)
    load = np.abs(result.pair_load).max(axis=(0, 2), initial=0.0)
    return (pairs.carries == 1) & (load <= UNLOADED * load.max(initial=0.0))


def _stiffness(
    train: _TrainRows, result: Equilibrium | None, unloaded: NDArray[np.bool_]
) -> sparse.csr_array:
    """K (R, R) N/m of all rows: nominal stiffness for flanks that are ``unloaded`` (M,) and for
    two-sided pairs, else the tangents of the pairs' laws in the equilibria."""
    row, pair, p, count = train.rows.row, train.rows.pair, train.pair_position, len(train.rows.row)
    first, flank, slot = (pair[name].astype(int) for name in ("row", "gear_mesh", "slot"))
    by_law = ~unloaded[flank] & ((row["sided"][first] != 0) | (pair["rows"] == 2))
    nominal = ~by_law
    if result is not None:
        nominal |= (pair["rows"] == 1) & (result.pair_load[p, flank, slot] > 0.0)
    at = np.concatenate([first[nominal & (pair["rows"] > k)] + k for k in (0, 1)])
    stiffness = np.zeros(count)
    stiffness[at] = row["stiffness"][at]
    tangent = sparse.diags_array(stiffness, format="csr")
    sliced = np.flatnonzero(by_law & (pair["rows"] == 2))
    lines = line_loads(result) if result is not None and len(sliced) else None
    if lines is not None:
        by_pair = np.nan_to_num(lines.tangent[p[sliced], flank[sliced], slot[sliced]])
        at = first[sliced][:, None] + np.arange(2)
        places = (np.repeat(at, 2, axis=1).ravel(), np.tile(at, 2).ravel())
        tangent += sparse.csr_array((by_pair.ravel(), places), shape=(count, count))
    if train.between:
        blocks = zip(_position_blocks(tangent, train.starts), train.between, strict=True)
        coupled = [np.linalg.solve(np.eye(len(t)) + t @ b, t) for t, b in blocks]
        tangent = _block_diagonal(coupled)
    tangent.eliminate_zeros()
    return tangent


def _position_blocks(matrix: sparse.csr_array, starts: Ints) -> Iterator[Array]:
    """Diagonal blocks (n, n) of a matrix, one for each position."""
    for start, stop in pairwise(starts.tolist()):
        yield matrix[start:stop, start:stop].toarray()


def _block_diagonal(blocks: Sequence[ArrayLike]) -> sparse.csr_array:
    """Sparse array; of dense blocks SciPy makes a matrix, whose * is a matrix product."""
    return sparse.csr_array(sparse.block_diag(blocks))


def _root(matrix: sparse.csr_array, starts: Ints) -> sparse.csr_array:
    """Symmetric A with A A = K, for each position's block; diagonal where K is diagonal."""
    diagonal = matrix.diagonal()
    if matrix.count_nonzero() == np.count_nonzero(diagonal):
        return sparse.diags_array(np.sqrt(diagonal), format="csr")
    roots = []
    for block in _position_blocks(matrix, starts):
        values, vectors = np.linalg.eigh(0.5 * (block + block.T))
        roots.append((vectors * np.sqrt(np.clip(values, 0.0, None))) @ vectors.T)
    return _block_diagonal(roots)


def _springs(
    system: System, flanks: dict[int, _FlankRows], theta: Array, cycles: bool
) -> ContactSprings:
    """Mean springs of every flank over its positions, and all other springs at angles ``theta``
    (A,); cycles: whether the stiffness at each position is included."""
    springs, by_position = {}, {}
    for m, flank in flanks.items():
        blocks = system.blocks[flank.columns]
        springs[m] = RowSprings(flank.rows @ blocks, np.eye(len(flank.rows)) / flank.count)
        if cycles:
            by_position[m] = flank.cycle(blocks)
    no_spring = RowSprings(np.zeros((0, system.size)), np.zeros((0, 0)))
    rows = pair_rows(system.pairs)
    n, _ = build_rows(system.pairs, rows, theta, carrying_flanks(system.pairs))
    gear_meshes = tuple(springs.get(m, no_spring) for m in range(len(system.pairs.s0)))
    return ContactSprings(gear_meshes, other_springs(system, rows, n), by_position)
