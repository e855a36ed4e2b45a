r"""Craig-Bampton reduction with averaging ties.

The interface q = B u is a constraint, not a set of mesh dofs. With a few temporary springs S at
some interface nodes, K_s = K + B^T S B is regular, and the springs' energy depends on q alone, so

    F = B K_s^{-1} B^T,   Psi = K_s^{-1} B^T F^{-1},   K_bb = F^{-1} - S

are the constraint modes (B Psi = I, K Psi = B^T K_bb) and the stiffness of the free body exactly.
Fixed-interface modes solve K phi = omega^2 M phi with B phi = 0; the constrained solve is

    y = K_s^{-1} g,   x = y - Psi (B y).

Reduced matrices on [q, eta]: K = diag(K_bb, omega^2), M = [Psi Phi]^T M [Psi Phi].
Rounding leaves K_bb R of rigid motions R about 1e-9 of |K_bb| |R|; the reduction projects it
away, K_bb <- P K_bb P with P = I - R (R^T R)^{-1} R^T, and reports its size.

A body that repeats by sectors is condensed sector by sector where the numbers of sectors to try
are given, with the same result: `cyclic_condensation.py`.
Source: Craig, Bampton 1968, AIAA J. 6:1313; constraint form: Farhat, Geradin 1994.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic_condensation import CyclicCondensation
from flexgear.structures.cyclic_lanczos import lowest_modes
from flexgear.structures.cyclic_path import condense_by_sectors
from flexgear.structures.factorisation import Factor, Solver, factorise
from flexgear.structures.fem import FeModel, Interface
from flexgear.structures.lanczos import largest_eigenpairs
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.spd import scaled_inverse
from flexgear.structures.tall import dot, single_threaded_blas, times, times_in_place

Progress = Callable[[str, float], None]

SOLVE_BLOCK = 96  # right-hand sides a solve
LANCZOS_BLOCK = 24  # vectors a step
CYCLIC_LANCZOS_BLOCK = 8  # fewer do where columns of all sectors make the blocks wide
_BASIS_BYTES = 0.8e9  # of the cyclic path's Lanczos basis, where that is enough for the modes


def silent(stage: str, fraction: float) -> None:
    """Progress that nobody watches."""


@dataclass(frozen=True, eq=False)
class Condensation:
    """Static condensation of a body on its interface.

    rows: B (b, d); constraint_modes: Psi (d, b); stiffness: K_bb (b, b); fe_stiffness, fe_mass:
    (d, d) CSR on the dofs left after rigid ties; scalar_mass: (d/3, d/3) where none is rigid.
    """

    interface: Interface
    rows: sp.csr_matrix = field(repr=False)
    fe_stiffness: sp.csr_matrix = field(repr=False)
    fe_mass: sp.csr_matrix = field(repr=False)
    scalar_mass: sp.csr_matrix | None = field(repr=False)
    factor: Factor = field(repr=False)
    constraint_modes: NDArray[np.float64] = field(repr=False)
    stiffness: NDArray[np.float64] = field(repr=False)
    rigid_residual: float
    path: str

    @property
    def name(self) -> str:
        """Of the solver."""
        return self.factor.name

    @property
    def dofs(self) -> int:
        """Length of a field: dofs left after rigid ties."""
        return int(self.fe_stiffness.shape[0])

    def mass_product(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """M x (d, k); the scalar mass matrix takes x, y and z together."""
        x = np.ascontiguousarray(x)
        if self.scalar_mass is None:
            return self.fe_mass @ x
        return (self.scalar_mass @ x.reshape(self.scalar_mass.shape[0], -1)).reshape(x.shape)

    def stiffness_product(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """K x (d, k)."""
        return self.fe_stiffness @ np.ascontiguousarray(x)

    def interface_motion(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """B x (b, k)."""
        return self.rows @ x

    def constraint_motion(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Psi q (d, k)."""
        return times(self.constraint_modes, q)

    def constraint_load(self, forces: NDArray[np.float64]) -> NDArray[np.float64]:
        """Psi^T f (b, k) of forces (3N, k) on the mesh's dofs."""
        if self.interface.expansion is not None:
            forces = self.interface.expansion.T @ forces
        at = np.flatnonzero(forces.any(axis=1))
        return self.constraint_modes[at].T @ forces[at]

    def dofs_of(self, x: NDArray[np.float64], count: int) -> NDArray[np.float64]:
        """The mesh's first dofs (count, k) of fields x (d, k)."""
        if self.interface.expansion is None:
            return x[:count]
        return self.interface.expansion[:count] @ x

    def projected(
        self, modes: NDArray[np.float64], recovery: NDArray[np.float32]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Psi^T M Psi (b, b) and modes^T M Psi (n, b); Psi at the mesh's first dofs (r, b)."""
        psi, b = self.constraint_modes, self.interface.size
        own, coupling = np.zeros((b, b)), np.zeros((modes.shape[1], b))
        for start in range(0, b, SOLVE_BLOCK):
            block = slice(start, min(start + SOLVE_BLOCK, b))
            weighted = self.mass_product(psi[:, block])
            own[:, block] = dot(psi, weighted)
            coupling[:, block] = dot(modes, weighted)
        recovery[:] = self.dofs_of(psi, len(recovery))
        return 0.5 * (own + own.T), coupling

    def fixed_solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """x (d, k) with K x = right + B^T (reactions), B x = 0."""
        y = self.factor.solve(right)
        return y - times(self.constraint_modes, self.rows @ y)

    def supported_solve(
        self, right: NDArray[np.float64], supports: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """x (d, k) with (K + B^T supports B) x = right; supports (b, b) makes the body regular."""
        q = np.linalg.solve(self.stiffness + supports, dot(self.constraint_modes, right))
        y = self.factor.solve(right)
        return y + times(self.constraint_modes, q - self.rows @ y)


AnyCondensation = Condensation | CyclicCondensation


@dataclass(frozen=True, eq=False)
class Reduction:
    """A reduced body and what error estimates need of the way there.

    fixed_modes: Phi (d, n_modes), fields in the condensation's form; frequencies: (n_modes,) Hz of
    the fixed-interface modes.
    """

    body: ReducedBody
    condensation: AnyCondensation
    fixed_modes: NDArray[np.float64] = field(repr=False)
    frequencies: NDArray[np.float64] = field(repr=False)


def reduce_body(
    model: FeModel,
    interface: Interface,
    n_modes: int,
    progress: Progress = silent,
    name: str = "body",
    solver: Solver = "auto",
    sectors: Sequence[int] = (),
) -> ReducedBody:
    """The reduced body alone; see `reduce`."""
    return reduce(model, interface, n_modes, progress, name, solver, sectors).body


def reduce(
    model: FeModel,
    interface: Interface,
    n_modes: int,
    progress: Progress = silent,
    name: str = "body",
    solver: Solver = "auto",
    sectors: Sequence[int] = (),
) -> Reduction:
    """Craig-Bampton reduction to the interface nodes and n_modes fixed-interface modes.

    sectors: numbers of equal sectors that are tried before the general path (`solver`) serves.
    """
    with single_threaded_blas():
        condensation = condense(model, interface, progress, solver, sectors)
        omega, modes, residual = fixed_interface_modes(condensation, n_modes, progress)
        body = _project(model, condensation, omega, modes, name)
    progress("reduced matrices", 1.0)
    body.report.update(
        fe_dofs=model.dofs,
        interface_dofs=interface.size,
        fixed_interface_modes=n_modes,
        fixed_interface_frequency_min_hz=float(omega[0] / 2 / np.pi) if n_modes else None,
        fixed_interface_frequency_max_hz=float(omega[-1] / 2 / np.pi) if n_modes else None,
        fixed_interface_residual=residual,
        rigid_residual=condensation.rigid_residual,
        solver=condensation.name,
        path=condensation.path,
    )
    return Reduction(body, condensation, modes, omega / (2 * np.pi))


def condense(
    model: FeModel,
    interface: Interface,
    progress: Progress = silent,
    solver: Solver = "auto",
    sectors: Sequence[int] = (),
) -> AnyCondensation:
    """Factor once, for constraint modes and everything after: by sectors, or as a whole."""
    progress("factorisation", 0.0)
    try:
        by_sectors, path = condense_by_sectors(model, interface, sectors)
        if by_sectors is None:
            return _condense_whole(model, interface, progress, solver, path)
    except np.linalg.LinAlgError:
        raise FlexgearError(
            "two interface nodes are tied to the same points, or a patch holds too few nodes"
        ) from None
    stiffness, residual = _free(by_sectors.stiffness, interface)
    progress("constraint modes", 1.0)
    return replace(by_sectors, stiffness=stiffness, rigid_residual=residual)


def _condense_whole(
    model: FeModel, interface: Interface, progress: Progress, solver: Solver, path: str
) -> Condensation:
    """One factor of the whole body, then constraint modes in blocks of right-hand sides."""
    stiffness, mass = model.stiffness, model.mass
    if interface.expansion is not None:
        t = interface.expansion
        stiffness = (t.T @ stiffness @ t).tocsr()
        mass = (t.T @ mass @ t).tocsr()
    rows = interface.rows
    springs = _temporary_springs(interface, stiffness)
    held = rows.T @ sp.diags_array(springs) @ rows
    factor = factorise((stiffness + held).tocsr(), interface.coordinates, solver)
    progress("constraint modes", 0.0)
    dofs, b = stiffness.shape[0], interface.size
    modes = np.empty((dofs, b))
    for start in range(0, b, SOLVE_BLOCK):
        block = slice(start, min(start + SOLVE_BLOCK, b))
        modes[:, block] = factor.solve(rows[block].T.toarray())
        progress("constraint modes", 0.9 * block.stop / b)
    flexibility = rows @ modes
    flexibility = 0.5 * (flexibility + flexibility.T)
    inverse = scaled_inverse(flexibility)
    times_in_place(modes, inverse)
    stiffness_b = inverse - np.diag(springs)
    stiffness_b, residual = _free(stiffness_b, interface)
    progress("constraint modes", 1.0)
    scalar_mass = model.scalar_mass if interface.expansion is None else None
    return Condensation(
        interface, rows, stiffness, mass, scalar_mass, factor, modes, stiffness_b, residual, path
    )


def fixed_interface_modes(
    condensation: AnyCondensation, count: int, progress: Progress = silent
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """omega (count,) in rad/s rising, Phi (d, count), largest residual relative to omega^2."""
    dofs = condensation.dofs
    if count == 0:
        return np.zeros(0), np.zeros((dofs, 0)), 0.0
    progress("fixed-interface modes", 0.0)

    def heard(fraction: float) -> None:
        progress("fixed-interface modes", fraction)

    solve, mass = condensation.fixed_solve, condensation.mass_product
    random = np.random.default_rng(20230617)
    block = CYCLIC_LANCZOS_BLOCK
    least, roomy = 3 * count // 2 + 4 * block, 4 * count + 8 * block
    if isinstance(condensation, CyclicCondensation) and roomy + block < dofs:
        most = min(roomy, max(least, int(_BASIS_BYTES / (8 * dofs))))
        start = random.standard_normal((dofs, block))
        pairs = lowest_modes(solve, mass, start, count, most, progress=heard)
    else:
        start = random.standard_normal((dofs, LANCZOS_BLOCK))
        pairs = largest_eigenpairs(lambda v: solve(mass(v)), mass, start, count, progress=heard)
    vectors = pairs.vectors
    for column in vectors.T:
        column *= np.sign(column[np.abs(column).argmax()])
    residual = float(np.max(pairs.residuals / pairs.values))
    return 1 / np.sqrt(pairs.values), vectors, residual


def _temporary_springs(interface: Interface, stiffness: sp.csr_matrix) -> NDArray[np.float64]:
    """Diagonal of S (b,): springs at up to three nodes with small patches, far apart."""
    counts = np.diff(interface.rows.indptr).reshape(-1, 6).sum(axis=1)
    small = np.flatnonzero(counts <= 1.5 * counts.min())
    chosen = [int(small[0])]
    while len(chosen) < min(3, len(small)):
        distance = np.min(
            [
                np.linalg.norm(interface.positions[small] - interface.positions[c], axis=1)
                for c in chosen
            ],
            axis=0,
        )
        if distance.max() == 0.0:
            break
        chosen.append(int(small[np.argmax(distance)]))
    span = np.ptp(interface.coordinates, axis=0).max()
    scale = float(np.median(stiffness.diagonal()))
    springs = np.zeros(interface.size)
    for node in chosen:
        springs[6 * node : 6 * node + 3] = scale
        springs[6 * node + 3 : 6 * node + 6] = scale * (0.1 * span) ** 2
    return springs


def _free(
    stiffness: NDArray[np.float64], interface: Interface
) -> tuple[NDArray[np.float64], float]:
    """K_bb with rounding at rigid motions projected away, and how large that rounding was."""
    length = np.linalg.norm(interface.positions, axis=1).max()
    scale = np.tile([1.0, 1.0, 1.0] + 3 * [1 / length], len(interface.node_names))
    scaled = scale[:, None] * stiffness * scale
    rigid = np.linalg.qr(interface.rigid_modes() / scale[:, None])[0]
    force = scaled @ rigid
    residual = float(np.linalg.norm(force, 2) / np.linalg.norm(scaled, 2))
    if residual > 1e-6:
        raise FlexgearError(
            f"the reduced body does not move freely as a rigid one (residual {residual:.1e}): "
            "its mesh may consist of several pieces"
        )
    scaled = scaled - rigid @ force.T
    scaled = scaled - (scaled @ rigid) @ rigid.T
    scaled = 0.5 * (scaled + scaled.T)
    return scaled / scale[:, None] / scale, residual


def _project(
    model: FeModel,
    condensation: AnyCondensation,
    omega: NDArray[np.float64],
    modes: NDArray[np.float64],
    name: str,
) -> ReducedBody:
    """Reduced matrices and the recovery at mesh vertices."""
    interface = condensation.interface
    b, count = interface.size, len(omega)
    recovery = np.empty((model.vertex_dofs, b + count), dtype=np.float32)
    reduced_mass = np.eye(b + count)
    reduced_mass[:b, :b], coupling = condensation.projected(modes, recovery[:, :b])
    reduced_mass[b:, :b], reduced_mass[:b, b:] = coupling, coupling.T
    recovery[:, b:] = condensation.dofs_of(modes, model.vertex_dofs)
    reduced_stiffness = np.diag(np.concatenate([np.zeros(b), omega**2]))
    reduced_stiffness[:b, :b] = condensation.stiffness
    return ReducedBody(
        name=name,
        node_names=interface.node_names,
        positions=interface.positions,
        mass=reduced_mass,
        stiffness=reduced_stiffness,
        n_modes=count,
        report={},
        points=np.asarray(model.fe_mesh.points, dtype=float),
        cells=np.asarray(model.fe_mesh.cells),
        recovery=recovery,
    )
