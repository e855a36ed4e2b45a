"""Craig-Bampton reduction with averaging ties.

The interface motion q = B u is a set of averages, not of dofs of the mesh. With temporary springs S
at a few interface nodes K_s = K + B^T S B is regular, and the springs' energy depends on q alone:

    F = B K_s^{-1} B^T,   Psi = K_s^{-1} B^T F^{-1},   K_bb = F^{-1} - S

are the constraint modes (B Psi = I, K Psi = B^T K_bb) and the stiffness of the free body exactly.
Fixed-interface modes solve K phi = omega^2 M phi with B phi = 0; the constrained solve is

    y = K_s^{-1} g,   x = y - Psi (B y).

Reduced matrices on [q, eta]: K = diag(K_bb, omega^2), M = [Psi Phi]^T M [Psi Phi].
By rounding errors K_bb R of rigid motions R is about 1e-9 of |K_bb| |R| and not zero; the reduction
projects it out, K_bb <- P K_bb P with P = I - R (R^T R)^{-1} R^T, and reports its size.

A body of equal sectors is condensed sector by sector, with the same result
(`cyclic/condensation.py`), any other by one factor of its matrix. With K_s = L L^T and
W = L^{-1} B^T, which is sparse,

    F = W^T W,   Psi = L^{-T} W F^{-1},   Psi^T f = F^{-1} W^T L^{-1} f,
    K_s^{-1} g + Psi q = L^{-T} (L^{-1} g + W F^{-1} q),

so that the constraint modes Psi (dofs times interface dofs) are never stored whole.
Source: Craig, Bampton 1968, AIAA J. 6:1313; constraint form: Farhat, Geradin 1994.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic.condensation import CyclicCondensation, condense_by_sectors
from flexgear.structures.cyclic.modes import cyclic_modes
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.fem.ties import Interface, free_stiffness
from flexgear.structures.linalg.dense import blocks, scaled_inverse, single_threaded_blas
from flexgear.structures.linalg.lanczos import (
    Eigenpairs,
    NotConverged,
    all_modes,
    lowest_modes,
    most_vectors,
    vectors_a_step,
)
from flexgear.structures.linalg.sparse import Factor
from flexgear.structures.reduced import Progress, ReducedBody, silent

SOLVE_BLOCK = 96  # right-hand sides that are solved together


class Condensation:
    """Static condensation of a body on its interface nodes, by one factor of its matrix.

    Its fields are displacements (d, k) on the dofs that rigid ties leave. rows: B (b, d); inverse:
    F^{-1} (b, b); ties: W (d, b) in the factor's order and W^T; stiffness: K_bb (b, b);
    fe_stiffness: (d, d) CSR; fe_mass: (d, d) with rigid ties, (d/3, d/3) for x, y and z alike
    without any.
    """

    name = "cholmod"  # the library that factors the matrix

    def __init__(self, model: FeModel, interface: Interface, progress: Progress, path: str) -> None:
        """path: why the body is not condensed by sectors. FlexgearError where K is singular."""
        self.interface, self.rows, self.path = interface, interface.rows, path
        self.fe_stiffness, self.fe_mass = model.stiffness, model.scalar_mass
        if interface.expansion is not None:
            t = interface.expansion
            self.fe_stiffness = (t.T @ model.stiffness @ t).tocsr()
            self.fe_mass = (t.T @ model.mass @ t).tocsr()
        span = float(np.ptp(model.nodes, axis=0).max())
        springs = _temporary_springs(interface, self.fe_stiffness, span)
        held = self.rows.T @ sp.diags_array(springs) @ self.rows
        try:
            self.factor = Factor((self.fe_stiffness + held).tocsr())
        except np.linalg.LinAlgError:
            raise FlexgearError(
                "the stiffness matrix is singular: the mesh falls into pieces or has cells that "
                "hang on an edge"
            ) from None
        progress("constraint modes", 0.0)
        self.ties = _tied(self.factor, self.rows, progress)
        flexibility = (self.ties[1] @ self.ties[0]).toarray()
        self.inverse = scaled_inverse(0.5 * (flexibility + flexibility.T))
        self.stiffness, self.rigid_residual = free_stiffness(
            self.inverse - np.diag(springs), interface
        )
        progress("constraint modes", 1.0)

    @property
    def dofs(self) -> int:
        """Length d of a field."""
        return int(self.fe_stiffness.shape[0])

    def mass_product(self, x: Array) -> Array:
        """M x (d, k)."""
        x = np.ascontiguousarray(x)
        return (self.fe_mass @ x.reshape(self.fe_mass.shape[0], -1)).reshape(x.shape)

    def stiffness_product(self, x: Array) -> Array:
        """K x (d, k)."""
        return self.fe_stiffness @ x

    def interface_motion(self, x: Array) -> Array:
        """B x (b, k)."""
        return self.rows @ x

    def interface_load(self, forces: Array) -> Array:
        """B^T forces (d, k) of forces (b, k)."""
        return np.asarray(self.rows.T @ forces)

    def constraint_motion(self, q: Array) -> Array:
        """Displacement Psi q (d, k) by interface motion q (b, k)."""
        return np.hstack([self._field(None, q[:, b]) for b in blocks(q.shape[1], SOLVE_BLOCK)])

    def constraint_load(self, forces: Array) -> Array:
        """Interface forces Psi^T f (b, k) of forces (3N, k) on the mesh's dofs."""
        return self._load(self.field_of(forces))

    def field_of(self, forces: Array) -> Array:
        """Forces (3N, k) on the mesh's dofs as loads (d, k) on fields."""
        expansion = self.interface.expansion
        return forces if expansion is None else np.asarray(expansion.T @ forces)

    def dofs_of(self, x: Array, count: int) -> Array:
        """Displacements (count, k) of the mesh's first dofs from fields x (d, k)."""
        if self.interface.expansion is None:
            return x[:count]
        return self.interface.expansion[:count] @ x

    def projected(self, modes: Array, recovery: NDArray[np.float32]) -> tuple[Array, Array]:
        """Psi^T M Psi (b, b) and modes^T M Psi (n, b) of modes (d, n); writes Psi at the mesh's
        first dofs to recovery (r, b)."""
        b, coupling = self.interface.size, self._load(self.mass_product(modes)).T
        result = np.zeros((b, b))
        for block in blocks(b, SOLVE_BLOCK):
            psi = self.constraint_motion(np.eye(b)[:, block])
            result[:, block] = self._load(self.mass_product(psi))
            recovery[:, block] = self.dofs_of(psi, len(recovery))
        return 0.5 * (result + result.T), coupling

    def fixed_solve(self, right: Array) -> Array:
        """Displacement x (d, k) with the interface held: K x = right + B^T (reactions), B x = 0."""
        f, at = self._forward(right)
        return self._field(f, -at)

    def supported_solve(self, right: Array, supports: Array) -> Array:
        """Displacement x (d, k) on supports (b, b) that leave no motion free:
        (K + B^T supports B) x = right."""
        f, at = self._forward(right)
        q = np.linalg.solve(self.stiffness + supports, self.inverse @ at)  # F^{-1} B y = Psi^T g
        return self._field(f, q - at)

    def _load(self, forces: Array) -> Array:
        """Interface forces Psi^T f (b, k) of loads (d, k)."""
        return np.asarray(self.inverse @ self._forward(forces)[1])

    def _forward(self, right: Array) -> tuple[Array, Array]:
        """The forward solution f = L^{-1} right (d, k), and B K_s^{-1} right = W^T f (b, k)."""
        f = self.factor.forward(right)
        return f, self.ties[1] @ f

    def _field(self, f: Array | None, q: Array) -> Array:
        """K_s^{-1} right + Psi q (d, k); f: L^{-1} right, which is overwritten, None for zero."""
        f = np.zeros((self.dofs, q.shape[1])) if f is None else f
        f += self.ties[0] @ (self.inverse @ q)
        return self.factor.backward(f)


def _tied(
    factor: Factor, rows: sp.csr_matrix, progress: Progress
) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """W = L^{-1} B^T (d, b) and W^T of rows B (b, d)."""
    parts = []
    for block in blocks(rows.shape[0], SOLVE_BLOCK):
        parts.append(factor.forward_sparse(rows[block].T))
        progress("constraint modes", 0.9 * block.stop / rows.shape[0])
    ties = sp.hstack(parts, format="csr")
    return ties, ties.T.tocsr()


def _temporary_springs(interface: Interface, stiffness: sp.csr_matrix, span: float) -> Array:
    """Diagonal of S (b,): springs at up to three nodes with small patches, far apart; span: largest
    dimension of the body, m."""
    patch_sizes = np.diff(interface.rows.indptr).reshape(-1, 6).sum(axis=1)
    small = np.flatnonzero(patch_sizes <= 1.5 * patch_sizes.min())
    chosen = [int(small[0])]
    while len(chosen) < min(3, len(small)):
        distance = cdist(interface.positions[small], interface.positions[chosen]).min(axis=1)
        if distance.max() == 0.0:
            break
        chosen.append(int(small[np.argmax(distance)]))
    scale = float(np.median(stiffness.diagonal()))
    springs = np.zeros((len(interface.node_names), 6))
    springs[chosen] = scale * np.repeat([1.0, (0.1 * span) ** 2], 3)
    return springs.ravel()


_EQUAL = 1e-9  # largest relative difference of the omega^2 of a pair

AnyCondensation = Condensation | CyclicCondensation


@dataclass(frozen=True, eq=False)
class Reduction:
    """A reduced body, its condensation and fixed-interface modes, for error estimates; fixed_modes:
    Phi (d, n_modes), fields of the condensation."""

    body: ReducedBody
    condensation: AnyCondensation
    fixed_modes: Array = field(repr=False)


def reduce(
    model: FeModel,
    interface: Interface,
    n_modes: int,
    progress: Progress = silent,
    name: str = "body",
    sectors: Sequence[int] = (),
) -> Reduction:
    """Craig-Bampton reduction to the interface nodes and n_modes fixed-interface modes, one more
    where the last is the first of a pair of equal frequencies.

    sectors: numbers of equal sectors to try before the body is condensed by one factor.
    """
    with single_threaded_blas():
        condensation = condense(model, interface, progress, sectors)
    return with_modes(model, condensation, n_modes, progress, name)


def with_modes(
    model: FeModel,
    condensation: AnyCondensation,
    n_modes: int,
    progress: Progress = silent,
    name: str = "body",
) -> Reduction:
    """Reduction of a condensed model with fixed-interface modes, as ``reduce``."""
    with single_threaded_blas():
        fixed = fixed_interface_modes(condensation, n_modes, progress)
        body = _project(model, condensation, fixed, name)
    omega = fixed.omega
    progress("reduced matrices", 1.0)
    body.report.update(
        fe_dofs=model.dofs,
        interface_dofs=condensation.interface.size,
        fixed_interface_modes=len(omega),
        fixed_interface_frequency_min_hz=float(omega[0] / 2 / np.pi) if n_modes else None,
        fixed_interface_frequency_max_hz=float(omega[-1] / 2 / np.pi) if n_modes else None,
        fixed_interface_residual=float(np.max(fixed.residuals / fixed.values, initial=0.0)),
        rigid_residual=condensation.rigid_residual,
        solver=condensation.name,
        path=condensation.path,
    )
    return Reduction(body, condensation, fixed.vectors)


def condense(
    model: FeModel, interface: Interface, progress: Progress = silent, sectors: Sequence[int] = ()
) -> AnyCondensation:
    """Condensation of a body on its interface: by one of the numbers of ``sectors`` where its FE
    mesh and ties allow it, else by one factor. FlexgearError for ties without a solution."""
    progress("factorisation", 0.0)
    try:
        by_sectors, path = condense_by_sectors(model, interface, sectors)
        if by_sectors is None:
            return Condensation(model, interface, progress, path)
    except np.linalg.LinAlgError:
        raise FlexgearError(
            "two interface nodes are tied to the same points, or a patch holds too few nodes"
        ) from None
    progress("constraint modes", 1.0)
    return by_sectors


def fixed_interface_modes(
    condensation: AnyCondensation, count: int, progress: Progress = silent
) -> Eigenpairs:
    """The `count` lowest modes with the interface held; the largest entry of each is positive.

    Where the last is the first of a pair of equal frequencies, as bodies of equal sectors have, the
    second is included: a single one would be an arbitrary direction of the plane that both span.
    """
    dofs = condensation.dofs
    if count == 0:
        return Eigenpairs(np.zeros(0), np.zeros((dofs, 0)), np.zeros(0))
    progress("fixed-interface modes", 0.0)

    def report(fraction: float) -> None:
        progress("fixed-interface modes", fraction)

    most = dofs - condensation.interface.size
    try:
        pairs = _eigenpairs(condensation, min(count + 1, most), report)
    except NotConverged as error:
        raise FlexgearError(str(error)) from None
    nu = pairs.values
    if len(nu) > count and nu[count - 1] - nu[count] > _EQUAL * nu[count]:
        pairs = pairs.lowest(count)
    vectors = pairs.vectors
    vectors *= np.array([np.sign(column[np.abs(column).argmax()]) for column in vectors.T])
    return pairs


def _eigenpairs(
    condensation: AnyCondensation, count: int, progress: Callable[[float], None]
) -> Eigenpairs:
    """The `count` lowest modes with the interface held: by Lanczos, or all where they are few."""
    mass, dofs, block = condensation.mass_product, condensation.dofs, vectors_a_step(count)
    if isinstance(condensation, CyclicCondensation) and 5 * count < dofs:
        return cyclic_modes(condensation, count, progress)
    if most_vectors(count, block) + block >= dofs:
        return all_modes(condensation.fixed_solve, mass, dofs, count)
    start = np.random.default_rng(20230617).standard_normal((dofs, block))
    most = most_vectors(count, block, dofs)
    return lowest_modes(condensation.fixed_solve, mass, start, count, most, progress=progress)


def _project(
    model: FeModel, condensation: AnyCondensation, fixed: Eigenpairs, name: str
) -> ReducedBody:
    """The reduced body of fixed-interface modes: its matrices, and recovery at mesh vertices."""
    interface = condensation.interface
    omega, modes = fixed.omega, fixed.vectors
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
