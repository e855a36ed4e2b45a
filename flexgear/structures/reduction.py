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
Source: Craig, Bampton 1968, AIAA J. 6:1313; constraint form: Farhat, Geradin 1994.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError
from flexgear.structures.factorisation import Factor, Solver, factorise
from flexgear.structures.fem import FeModel, Interface
from flexgear.structures.lanczos import largest_eigenpairs
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.tall import dot, single_threaded_blas, times, times_in_place

Progress = Callable[[str, float], None]

SOLVE_BLOCK = 96  # right-hand sides a solve
LANCZOS_BLOCK = 24  # vectors a step


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

    def mass_product(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """M x (d, k); the scalar mass matrix takes x, y and z together."""
        x = np.ascontiguousarray(x)
        if self.scalar_mass is None:
            return self.fe_mass @ x
        return (self.scalar_mass @ x.reshape(self.scalar_mass.shape[0], -1)).reshape(x.shape)

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


@dataclass(frozen=True, eq=False)
class Reduction:
    """A reduced body and what error estimates need of the way there.

    fixed_modes: Phi (d, n_modes); frequencies: (n_modes,) Hz of the fixed-interface modes.
    """

    body: ReducedBody
    condensation: Condensation
    fixed_modes: NDArray[np.float64] = field(repr=False)
    frequencies: NDArray[np.float64] = field(repr=False)


def reduce_body(
    model: FeModel,
    interface: Interface,
    n_modes: int,
    progress: Progress = silent,
    name: str = "body",
    solver: Solver = "auto",
) -> ReducedBody:
    """The reduced body alone; see `reduce`."""
    return reduce(model, interface, n_modes, progress, name, solver).body


def reduce(
    model: FeModel,
    interface: Interface,
    n_modes: int,
    progress: Progress = silent,
    name: str = "body",
    solver: Solver = "auto",
) -> Reduction:
    """Craig-Bampton reduction to the interface nodes and n_modes fixed-interface modes."""
    with single_threaded_blas():
        condensation = condense(model, interface, progress, solver)
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
        solver=condensation.factor.name,
    )
    return Reduction(body, condensation, modes, omega / (2 * np.pi))


def condense(
    model: FeModel, interface: Interface, progress: Progress = silent, solver: Solver = "auto"
) -> Condensation:
    """Factor once, then constraint modes in blocks of right-hand sides."""
    progress("factorisation", 0.0)
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
    try:
        inverse = _scaled_inverse(flexibility)
    except np.linalg.LinAlgError:
        raise FlexgearError(
            "two interface nodes are tied to the same points, or a patch holds too few nodes"
        ) from None
    times_in_place(modes, inverse)
    stiffness_b = inverse - np.diag(springs)
    stiffness_b, residual = _free(stiffness_b, interface)
    progress("constraint modes", 1.0)
    scalar_mass = model.scalar_mass if interface.expansion is None else None
    return Condensation(
        interface, rows, stiffness, mass, scalar_mass, factor, modes, stiffness_b, residual
    )


def fixed_interface_modes(
    condensation: Condensation, count: int, progress: Progress = silent
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """omega (count,) in rad/s rising, Phi (d, count), largest residual relative to omega^2."""
    dofs = condensation.fe_stiffness.shape[0]
    if count == 0:
        return np.zeros(0), np.zeros((dofs, 0)), 0.0
    mass = condensation.mass_product
    start = np.random.default_rng(20230617).standard_normal((dofs, LANCZOS_BLOCK))
    progress("fixed-interface modes", 0.0)
    pairs = largest_eigenpairs(
        lambda v: condensation.fixed_solve(mass(v)),
        mass,
        start,
        count,
        progress=lambda fraction: progress("fixed-interface modes", fraction),
    )
    vectors = pairs.vectors
    vectors = vectors * np.sign(vectors[np.abs(vectors).argmax(axis=0), np.arange(count)])
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


def _scaled_inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric positive definite matrix, scaled to unit diagonal first."""
    scale = 1 / np.sqrt(np.diag(matrix))
    factor = sla.cho_factor(scale[:, None] * matrix * scale, lower=True)
    inverse = sla.cho_solve(factor, np.eye(len(matrix)))
    inverse = 0.5 * (inverse + inverse.T)
    return scale[:, None] * inverse * scale


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
    condensation: Condensation,
    omega: NDArray[np.float64],
    modes: NDArray[np.float64],
    name: str,
) -> ReducedBody:
    """Reduced matrices and the recovery at mesh vertices."""
    interface = condensation.interface
    b, count = interface.size, len(omega)
    psi = condensation.constraint_modes
    reduced_mass = np.zeros((b + count, b + count))
    for start in range(0, b, SOLVE_BLOCK):
        block = slice(start, min(start + SOLVE_BLOCK, b))
        weighted = condensation.mass_product(psi[:, block])
        reduced_mass[:b, block] = dot(psi, weighted)
        reduced_mass[b:, block] = dot(modes, weighted)
    reduced_mass[:b, :b] = 0.5 * (reduced_mass[:b, :b] + reduced_mass[:b, :b].T)
    reduced_mass[:b, b:] = reduced_mass[b:, :b].T
    reduced_mass[b:, b:] = np.eye(count)
    reduced_stiffness = np.zeros_like(reduced_mass)
    reduced_stiffness[:b, :b] = condensation.stiffness
    reduced_stiffness[range(b, b + count), range(b, b + count)] = omega**2
    recovery = np.empty((model.vertex_dofs, b + count), dtype=np.float32)
    if interface.expansion is None:
        recovery[:, :b] = psi[: model.vertex_dofs]
        recovery[:, b:] = modes[: model.vertex_dofs]
    else:
        expansion = interface.expansion[: model.vertex_dofs]
        recovery[:, :b] = expansion @ psi
        recovery[:, b:] = expansion @ modes
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
