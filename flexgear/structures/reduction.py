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

How constraint modes are held, or not: `condensation.py`. A body that repeats by sectors is
condensed sector by sector where the numbers of sectors to try are given, with the same result:
`cyclic/condensation.py`.
Source: Craig, Bampton 1968, AIAA J. 6:1313; constraint form: Farhat, Geradin 1994.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError
from flexgear.structures.condensation import Condensation
from flexgear.structures.cyclic.condensation import CyclicCondensation, condense_by_sectors
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.fem.ties import Interface
from flexgear.structures.linalg.lanczos import (
    Eigenpairs,
    NotConverged,
    all_modes,
    lowest_modes,
    most_vectors,
)
from flexgear.structures.linalg.threads import single_threaded_blas
from flexgear.structures.reduced import Progress, ReducedBody, silent

LANCZOS_BLOCK = 4  # vectors a step: CHOLMOD solves one at a time, and small blocks need fewer
_EQUAL = 1e-9  # apart, relative, are the omega^2 of a pair at most


AnyCondensation = Condensation | CyclicCondensation


@dataclass(frozen=True, eq=False)
class Reduction:
    """A reduced body and what error estimates need of the way there.

    fixed_modes: Phi (d, n_modes), fields in the condensation's form; frequencies: (n_modes,) Hz of
    the fixed-interface modes.
    """

    body: ReducedBody
    condensation: AnyCondensation
    fixed_modes: Array = field(repr=False)
    frequencies: Array = field(repr=False)


def reduce(
    model: FeModel,
    interface: Interface,
    n_modes: int,
    progress: Progress = silent,
    name: str = "body",
    sectors: Sequence[int] = (),
) -> Reduction:
    """Craig-Bampton reduction to the interface nodes and n_modes fixed-interface modes.

    One more where the last is one of a pair of equal frequencies.

    sectors: numbers of equal sectors that are tried before the general path serves.
    """
    with single_threaded_blas():
        condensation = condense(model, interface, progress, sectors)
        fixed = fixed_interface_modes(condensation, n_modes, progress)
        body = _project(model, condensation, fixed, name)
    omega = fixed.omega
    progress("reduced matrices", 1.0)
    body.report.update(
        fe_dofs=model.dofs,
        interface_dofs=interface.size,
        fixed_interface_modes=len(omega),
        fixed_interface_frequency_min_hz=float(omega[0] / 2 / np.pi) if n_modes else None,
        fixed_interface_frequency_max_hz=float(omega[-1] / 2 / np.pi) if n_modes else None,
        fixed_interface_residual=float(np.max(fixed.residuals / fixed.values, initial=0.0)),
        rigid_residual=condensation.rigid_residual,
        solver=condensation.name,
        path=condensation.path,
    )
    return Reduction(body, condensation, fixed.vectors, omega / (2 * np.pi))


def condense(
    model: FeModel,
    interface: Interface,
    progress: Progress = silent,
    sectors: Sequence[int] = (),
) -> AnyCondensation:
    """Factor once, for constraint modes and everything after: by sectors, or as a whole."""
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
    """The `count` lowest modes with the interface held; sign: the largest entry is positive.

    Where the last is one of a pair of equal frequencies, as bodies of equal sectors have, the other
    comes along: which direction of the plane they span is found first is a matter of rounding.
    """
    dofs = condensation.dofs
    if count == 0:
        return Eigenpairs(np.zeros(0), np.zeros((dofs, 0)), np.zeros(0))
    progress("fixed-interface modes", 0.0)

    def heard(fraction: float) -> None:
        progress("fixed-interface modes", fraction)

    try:
        pairs = _eigenpairs(condensation, min(count + 1, dofs - condensation.interface.size), heard)
    except NotConverged as error:
        raise FlexgearError(str(error)) from None
    nu = pairs.values
    if len(nu) > count and nu[count - 1] - nu[count] > _EQUAL * nu[count]:
        pairs = pairs.lowest(count)
    vectors = pairs.vectors
    vectors *= np.array([np.sign(column[np.abs(column).argmax()]) for column in vectors.T])
    return pairs


def _eigenpairs(
    condensation: AnyCondensation, count: int, heard: Callable[[float], None]
) -> Eigenpairs:
    """The `count` lowest modes with the interface held: all at once of a small body."""
    mass, dofs, block = condensation.mass_product, condensation.dofs, LANCZOS_BLOCK
    if most_vectors(count, block) + block >= dofs:
        return all_modes(condensation.fixed_solve, mass, dofs, count)
    start = np.random.default_rng(20230617).standard_normal((dofs, block))
    most = most_vectors(count, block, dofs)
    return lowest_modes(condensation.fixed_solve, mass, start, count, most, heard)


def _project(
    model: FeModel,
    condensation: AnyCondensation,
    fixed: Eigenpairs,
    name: str,
) -> ReducedBody:
    """Reduced matrices and the recovery at mesh vertices."""
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
