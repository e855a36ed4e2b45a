"""Natural modes of the coupled train with linear gear meshes, their types and strain energies.

(K + K_g) φ = ω² M φ, K_g the stiffness of the contact rows, without damping. ``springs_at`` gives
all tooth pairs on the carrying flanks at one position of the train. Springs under a load, and their
means over a gear-mesh cycle: ``gear_mesh_cycle``.

With ΦᵀMΦ = I the kinetic energy of a mode is split by bodies and in each body by its rigid motions
(translation x, y, axial motion z, tilting rx, ry, rotation rz) and the rest, deformation. The parts
are M-orthogonal (tilting and rotation about the centre of mass), so that shares are not negative
and sum to one. The motion of the central members (sun, ring, carrier) decides the type:

    rotational, axial, translational, tilting   this motion only
    rotational-axial, translational-tilting     two motions that helical gears couple
    elastic                                     most of their energy is deformation
    planet                                      no motion
    mixed                                       anything else

A flexible member deforms a little in every mode; deformation below half of the central energy does
not decide the type.

Source: Lin & Parker 1999, J. Vib. Acoust. 121:316 (planar); Eritenel & Parker 2009, J. Sound Vib.
325:397 (three-dimensional, helical).
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg

from flexgear.analysis.flank_cycle import FlankCycle
from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import Rows, pair_rows, row_motions, row_stiffness
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.pair_data import BEARING, SUPPORT, carrying_flanks
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName
from flexgear.structures.bodies import Body


@dataclass(frozen=True)
class RowSprings:
    """Springs with the energy ½ qᵀ Rᵀ K R q: rows R (n, d), matrix K (n, n) N/m."""

    rows: Array
    matrix: Array

    @property
    def stiffness(self) -> Array:
        """Stiffness matrix Rᵀ K R (d, d) of all coordinates."""
        return np.asarray(self.rows.T @ (self.matrix @ self.rows))


@dataclass(frozen=True)
class ContactSprings:
    """Springs of all contact rows.

    gear_meshes (M,): of every flank, without rows where it carries no load; others: of supports
    and bearings, by the kind of their rows; cycles: stiffness over the cycle by flank, where the
    springs are means over gear-mesh cycles."""

    gear_meshes: tuple[RowSprings, ...]
    others: Mapping[int, RowSprings]
    cycles: Mapping[int, FlankCycle] = field(default_factory=dict)

    @cached_property
    def stiffness(self) -> Array:
        """Stiffness matrix (d, d) of all springs."""
        springs = (*self.gear_meshes, *self.others.values())
        rows = np.vstack([s.rows for s in springs])
        return RowSprings(rows, linalg.block_diag(*(s.matrix for s in springs))).stiffness


def springs_at(system: System, input_angles: Array | float = 0.0) -> ContactSprings:
    """Springs of all tooth pairs on the carrying flanks with nominal stiffness; input_angles:
    independent rotations (F,), or the first of them, rad."""
    rows, n = rows_at(system, input_angles)
    vectors, stiffness = row_motions(rows, n, system.blocks), row_stiffness(rows, n)
    owner = np.where(rows.row["kind"][:n] >= 0, rows.row["owner"][:n], -1)
    rows_of_gear_mesh = [np.flatnonzero(owner == m) for m in range(len(system.pairs.s0))]
    return ContactSprings(
        tuple(RowSprings(vectors[at], stiffness[np.ix_(at, at)]) for at in rows_of_gear_mesh),
        other_springs(system, rows, n),
    )


def other_springs(system: System, rows: Rows, n: int) -> dict[int, RowSprings]:
    """Springs of the supports and bearings among the first n rows, with nominal stiffness."""
    kinds, vectors = rows.row["kind"][:n], row_motions(rows, n, system.blocks)
    return {
        kind: RowSprings(vectors[at], np.diag(rows.row["stiffness"][at]))
        for kind in (SUPPORT, BEARING)
        if len(at := np.flatnonzero(kinds == kind))
    }


def rows_at(system: System, input_angles: float | Array = 0.0) -> tuple[Rows, int]:
    """Rows of the carrying flanks and their number; input_angles: see ``springs_at``."""
    rows, angles = pair_rows(system.pairs), np.zeros(len(system.input_rows))
    rotations = np.atleast_1d(np.asarray(input_angles, dtype=float))
    angles[: len(rotations)] = rotations
    n, _ = build_rows(system.pairs, rows, system.theta(angles), carrying_flanks(system.pairs))
    return rows, n


@dataclass(frozen=True)
class Modes:
    """Undamped modes: frequencies (m,) Hz, rising; shapes (d, m) with ΦᵀMΦ = I; energy: share of
    kinetic energy (m,) by body."""

    frequencies: Array
    shapes: Array
    energy: dict[str, Array]


def modes(system: System, contact: Array, limit_hz: float | None = None) -> Modes:
    """Undamped modes up to ``limit_hz`` (None: all), rigid rotations of the train first; contact:
    stiffness (d, d) of the contact rows.

    Frequencies of the rigid rotations are set to zero if they are below 1e-3 of the first elastic
    one.
    """
    k = system.stiffness + contact
    free = len(system.input_rows)
    values, shapes = _lowest(0.5 * (k + k.T), system.mass, free, limit_hz)
    omega = np.sqrt(np.clip(values, 0.0, None))
    if 0 < free < len(omega) and omega[free - 1] < 1e-3 * omega[free]:
        omega[:free] = 0.0
    frequencies = omega / (2 * np.pi)
    keep = len(frequencies) if limit_hz is None else int(np.sum(frequencies <= limit_hz))
    shapes = shapes[:, :keep]
    energies = body_energies(system.mass, system.bodies, shapes)
    return Modes(frequencies[:keep], shapes, dict(energies.items()))


def _lowest(
    stiffness: Array, mass: Array, free: int, limit_hz: float | None
) -> tuple[Array, Array]:
    """ω² and shapes up to the limit, but at least one more mode than rigid motions."""
    if limit_hz is None:
        return linalg.eigh(stiffness, mass)  # type: ignore[no-any-return]
    top = 2 * np.pi * float(limit_hz)
    values, shapes = linalg.eigh(stiffness, mass, subset_by_value=(-np.inf, top * top))
    if len(values) <= free < len(mass):
        values, shapes = linalg.eigh(stiffness, mass, subset_by_index=(0, free))
    return values, shapes


MOTIONS = ("translational", "axial", "rotational", "tilting")
_DOFS = {"translational": (0, 1), "axial": (2,), "rotational": (5,), "tilting": (3, 4)}
PARTS = (*MOTIONS, "elastic", "planet")
PAIRS = (("rotational", "axial"), ("translational", "tilting"))
AT_REST = 1e-6  # energy share of the central members below which they do not move
PURE = 1e-3  # share of the rigid energy of the central members below which a motion is neglected
EQUAL = 1e-6  # relative difference of repeated frequencies


@dataclass(frozen=True)
class ModeTypes:
    """Types of m modes.

    kinds (m,): type of each mode; shares: energy (m,) by part, with sum 1 ("planet": all planets,
    other parts: central members); bodies: energy (m,) by body, with sum 1; groups: indices of modes
    of one frequency; shapes (d, m): the modes, those of repeated frequencies combined to pure
    types where the solver had mixed them."""

    kinds: tuple[str, ...]
    shares: dict[str, Array]
    bodies: dict[BodyName, Array]
    groups: tuple[tuple[int, ...], ...]
    shapes: Array

    @property
    def multiplicity(self) -> NDArray[np.int64]:
        """For each mode, number of modes with its frequency and type, (m,)."""
        count = np.ones(len(self.kinds), dtype=np.int64)
        for group in self.groups:
            for i in group:
                count[i] = sum(self.kinds[j] == self.kinds[i] for j in group)
        return count


def _placed_bodies(bodies: Sequence[Body]) -> Iterator[tuple[Body, slice]]:
    """Bodies with coordinates, and the slice of these."""
    start = 0
    for body in bodies:
        if body.size:
            yield body, slice(start, start + body.size)
        start += body.size


def body_energies(mass: Array, bodies: Sequence[Body], shapes: Array) -> dict[BodyName, Array]:
    """Share (m,) of each body with coordinates in the kinetic energy of M-orthonormal modes."""
    return {
        body.name: np.einsum("im,im->m", shapes[at], mass[at, at] @ shapes[at])
        for body, at in _placed_bodies(bodies)
    }


def classify(
    frequencies: ArrayLike, shapes: Array, mass: Array, bodies: Sequence[Body], *, rigid: int
) -> ModeTypes:
    """Types of modes with frequencies (m,) rising and M-orthonormal shapes (d, m).

    rigid: number of rigid motions, which come first; bodies: in the order of their coordinates.
    Eigenvalue solvers return an arbitrary basis for a repeated frequency; where modes of different
    types have one frequency the basis is changed so that each mode has one type.
    FlexgearError where the mass matrix couples bodies, so that energy cannot be assigned.
    """
    f = np.asarray(frequencies, dtype=float)
    parts = _motions(mass, bodies, shapes)
    groups = repeated(f, rigid)
    shapes = shapes.copy()
    for group in groups[1:] if rigid else groups:
        if len(group) == 1:
            continue
        at = list(group)
        of_group = {part: motion[:, at] for part, motion in parts.items()}
        basis = _separated(of_group)
        separated = {part: motion @ basis for part, motion in of_group.items()}
        # a planet mode mixed into a rotational one looks like two rotational modes
        if Counter(_kinds(_shares(separated))) != Counter(_kinds(_shares(of_group))):
            shapes[:, at] = shapes[:, at] @ basis
            for part, motion in separated.items():
                parts[part][:, at] = motion
    shares = _shares(parts)
    kinds = _kinds(shares)
    kinds[:rigid] = ["rigid"] * rigid
    energies = body_energies(mass, bodies, shapes)
    lost = np.abs(sum(energies.values()) - 1.0).max(initial=0.0)
    if lost > 1e-6:
        raise FlexgearError(
            f"modes cannot be classified: {lost:.2g} of their kinetic energy belongs to no single "
            "body (a mass couples bodies, or the shapes are not M-orthonormal)"
        )
    return ModeTypes(tuple(kinds), shares, energies, groups, shapes)


def repeated(f: Array, rigid: int) -> tuple[tuple[int, ...], ...]:
    """Groups of successive modes with frequencies f within 1e-6; the first ``rigid`` are one group,
    that of the rigid motions."""
    breaks = np.flatnonzero(np.diff(f) > EQUAL * f[1:]) + 1
    groups = np.split(np.arange(len(f)), [rigid, *breaks[breaks > rigid]])
    return tuple(tuple(g.tolist()) for g in groups if len(g))


def strain_shares(
    contributions: Mapping[str, tuple[Array, Array]], shapes: Array
) -> dict[str, Array]:
    """Share (m,) of every spring in the strain energy ½ φᵀ Rᵀ K R φ of every mode, by name.

    contributions: rows R (k, d) and matrix K (k, k) of links, supports, gear meshes and stiffness
    of bodies, by name. Shares sum to one; in rigid modes all are zero.
    """
    energy = {
        name: np.sum((motion := rows @ shapes) * (matrix @ motion), axis=0)
        for name, (rows, matrix) in contributions.items()
    }
    total = np.sum(list(energy.values()), axis=0) if energy else np.zeros(shapes.shape[1])
    strained = total > 1e-12 * total.max(initial=0.0)
    return {
        name: np.divide(value, total, out=np.zeros_like(total), where=strained)
        for name, value in energy.items()
    }


def planar_rows(mass: Array, bodies: Sequence[Body]) -> tuple[Array, Array]:
    """Rows (n, 2, d) of the mean motions x, y of the n movable central members; masses (n,), kg."""
    rows, masses = [], []
    for body, at in _placed_bodies(bodies):
        plane, body_mass = body.rigid_motions[:, :2], mass[at, at]
        if body.name.part == "planet" or not np.all(np.abs(plane).max(axis=0) > 0):
            continue
        inertia = plane.T @ body_mass @ plane
        row = np.zeros((2, len(mass)))
        row[:, at] = np.linalg.solve(inertia, plane.T @ body_mass)
        rows.append(row)
        masses.append(0.5 * np.trace(inertia))
    return np.array(rows).reshape(-1, 2, len(mass)), np.array(masses)


def _motions(mass: Array, bodies: Sequence[Body], shapes: Array) -> dict[str, Array]:
    """Motions y (k, m) by part of modes φ (d, m): |y|² is the share of the part in φᵀ M φ."""
    motions: dict[str, list[Array]] = {p: [np.zeros((0, shapes.shape[1]))] for p in PARTS}
    for body, at in _placed_bodies(bodies):
        lower = linalg.cholesky(mass[at, at], lower=True)
        rest = lower.T @ shapes[at]  # y = Lᵀ q, where qᵀ M q = |y|²
        if body.name.part == "planet":
            motions["planet"].append(rest)
            continue
        bases = np.zeros((len(lower), 0))
        for motion in MOTIONS:  # translation first, so that rotations are about the centre of mass
            rigid = lower.T @ body.rigid_motions[:, _DOFS[motion]]
            u, size, _ = np.linalg.svd(rigid - bases @ (bases.T @ rigid), full_matrices=False)
            basis = u[:, size > 1e-9 * max(float(np.linalg.norm(rigid)), np.finfo(float).tiny)]
            motions[motion].append(basis.T @ rest)
            rest, bases = rest - basis @ (basis.T @ rest), np.hstack([bases, basis])
        motions["elastic"].append(rest)
    return {p: np.vstack(y) for p, y in motions.items()}


def _shares(parts: Mapping[str, Array]) -> dict[str, Array]:
    return {p: np.sum(motion**2, axis=0) for p, motion in parts.items()}


def _kinds(shares: Mapping[str, Array]) -> list[str]:
    by_mode = np.stack(list(shares.values()), axis=1)
    return [_kind(dict(zip(shares, values, strict=True))) for values in by_mode]


def _kind(shares: Mapping[str, float]) -> str:
    """Type of a mode from the energy shares of its parts."""
    rigid = sum(shares[p] for p in MOTIONS)
    if rigid + shares["elastic"] < AT_REST:
        return "planet"
    if shares["elastic"] > rigid:
        return "elastic"
    moving = {p for p in MOTIONS if shares[p] > PURE * rigid}
    if len(moving) == 1:
        return moving.pop()
    for pair in PAIRS:
        if moving == set(pair):
            return "-".join(pair)
    return "mixed"


def _separated(parts: Mapping[str, Array]) -> Array:
    """Basis (g, g) of the space of g modes of one frequency with motions (k, g) by part, of one
    type each if possible.

    In this space the energy of each part is a quadratic form. These forms are diagonalised one
    after the other: first the central energy, whose null space are planet modes, then deformation,
    pairs of motions, and single motions.
    """
    forms = {part: motion.T @ motion for part, motion in parts.items()}
    spaces = [np.eye(len(forms["planet"]))]
    for group in (PARTS[:-1], ("elastic",), *PAIRS, *((p,) for p in MOTIONS)):
        form = sum((forms[p] for p in group[1:]), forms[group[0]])
        spaces = [part for space in spaces for part in split_space(space, form)]
    return np.hstack(spaces)


def split_space(space: Array, form: Array) -> list[Array]:
    """Subspaces of a space (g, n) with equal energy by a form (g, g), by rising energy."""
    values, vectors = np.linalg.eigh(space.T @ form @ space)
    edges = np.flatnonzero(np.diff(values) > 1e-6) + 1
    return np.split(space @ vectors, edges, axis=1)
