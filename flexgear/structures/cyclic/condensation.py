"""Static condensation of a body of equal sectors, with the methods of `reduction.Condensation`.

With Psi_t the motion of the body under its periodic ties, the others free, Y = the solution under
C^T and H, G as in `cyclic/solver.py`,

    Psi = Psi_t [I 0] + Y N,   N = G^{-1} [-H I],
    K_bb = [K_t 0; 0 0] + [-H I]^T G^{-1} [-H I],

where columns of Psi_t for one sector give all others by rotation. Constraint modes are stored whole
only where few large sectors meet. Fields are in sector form, (3n z, k), dofs of one local node
after another, see `cyclic/sectors.py`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic.projection import (
    SectorMotion,
    condensed_stiffness,
    project_constraint_modes,
    sector_motion,
)
from flexgear.structures.cyclic.sectors import (
    LEAST_SECTORS,
    Circulant,
    Sectors,
    find_sectors,
    rigid_fields,
    sector_matrices,
)
from flexgear.structures.cyclic.solver import CyclicSolver
from flexgear.structures.cyclic.ties import SectorTies, sector_ties
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.fem.ties import Interface, free_stiffness
from flexgear.structures.linalg.dense import blocks, dot, shared
from flexgear.structures.linalg.sparse import Elimination, nested_dissection_order

# calibrated: 20 sectors in place of 180 make a ring's modes 8 times faster for the same
# condensation; 3 in place of 93 take 12 s for it in place of 3 s
_LEAST = 8  # sectors below which modes harmonic by harmonic gain less than large sectors cost
_BLOCK_BYTES = 32e6  # of vectors that are processed together


@dataclass(frozen=True, eq=False)
class CyclicCondensation:
    """Static condensation of a body of equal sectors.

    fe_stiffness, fe_mass: block-circulant matrices of the body; stiffness: K_bb (b, b); recovered:
    number of first dofs of the mesh that are recovered; path: kind of solution, for the report;
    rigid_residual: see ``free_stiffness``.
    """

    name: ClassVar[str] = "cyclic"  # of the solver, for the report
    interface: Interface
    ties: SectorTies = field(repr=False)
    fe_stiffness: Circulant = field(repr=False)
    fe_mass: Circulant = field(repr=False)
    solver: CyclicSolver = field(repr=False)
    stiffness: Array = field(repr=False)
    recovered: int
    path: str
    rigid_residual: float

    @property
    def sectors(self) -> Sectors:
        """Sectors of the FE mesh."""
        return self.ties.sectors

    @property
    def dofs(self) -> int:
        """Length d of a field."""
        return 3 * self.sectors.nodes.size

    @cached_property
    def motion(self) -> SectorMotion:
        """Inertia of a sector and its motion by its ends."""
        return sector_motion(self.solver, self.ties, self.fe_mass, self.recovered)

    @property
    def has_short_borders(self) -> bool:
        """Whether a sector has fewer motions of its ends than all sectors have constraint modes.

        True of gears. For a few large sectors, as of carriers, fields of all constraint modes take
        less time than ``motion``.
        """
        return self.solver.ends < self.interface.size * self.sectors.count

    def shifted(self, sigma: float) -> CyclicSolver:
        """Solver with K - sigma M in place of K; sigma: rad²/s²."""
        matrix = self.fe_stiffness.less(sigma, self.fe_mass)
        bordered = matrix.sector.shape[0] + matrix.coupling.shape[1]
        interior = _interior(matrix, self.ties)
        return CyclicSolver(interior, self.ties, np.zeros((bordered, 0)), definite=False)

    def mass_product(self, x: Array) -> Array:
        """M x (d, k)."""
        return self._each(x, self.fe_mass.product)

    def stiffness_product(self, x: Array) -> Array:
        """K x (d, k)."""
        return self._each(x, self.fe_stiffness.product)

    def interface_motion(self, x: Array) -> Array:
        """B x (b, k)."""
        return self.interface.rows @ (self.sectors.axes @ x)

    def interface_load(self, forces: Array) -> Array:
        """B^T forces (d, k) of forces (b, k)."""
        return self.field_of(self.interface.rows.T @ forces)

    def fixed_solve(self, right: Array) -> Array:
        """Displacement x (d, k) with the interface held: K x = right + B^T (reactions), B x = 0."""
        return self._each(right, self.solver.solve)

    def supported_solve(self, right: Array, supports: Array) -> Array:
        """Displacement x (d, k) on supports (b, b) that leave no motion free:
        (K + B^T supports B) x = right."""
        flexibility = np.linalg.inv(self.stiffness + supports)
        reactions = self.solver.reactions
        return self._each(right, lambda g: self.solver.solve(g, -flexibility @ reactions(g)))

    def constraint_motion(self, q: Array) -> Array:
        """Displacement Psi q (d, k) by interface motion q (b, k)."""
        fields = [self.solver.solve(None, q[:, block]) for block in self._blocks(q.shape[1])]
        return np.hstack([x.reshape(self.dofs, -1) for x in fields])

    def constraint_load(self, forces: Array) -> Array:
        """Interface forces Psi^T f (b, k) of forces (3N, k) on the mesh's dofs."""
        fields = (self.field_of(forces[:, b]) for b in self._blocks(forces.shape[1]))
        return -np.hstack([self.solver.reactions(self._form(field)) for field in fields])

    def projected(self, modes: Array, recovery: NDArray[np.float32]) -> tuple[Array, Array]:
        """Psi^T M Psi (b, b) and modes^T M Psi (n, b) of modes (d, n); writes Psi at the mesh's
        first dofs to recovery (r, b)."""
        blocks_of_modes = self._blocks(modes.shape[1])
        loads = (self.fe_mass.product(self._form(modes[:, b])) for b in blocks_of_modes)
        no_modes = np.zeros((self.interface.size, 0))
        coupling = -np.hstack([no_modes, *map(self.solver.reactions, loads)]).T
        if self.has_short_borders:
            result = project_constraint_modes(self.solver, self.ties, self.motion, recovery)
            return result, coupling
        psi = self.constraint_motion(np.eye(self.interface.size))
        recovery[:] = self.dofs_of(psi, len(recovery))
        result = dot(psi, self.mass_product(psi))
        return 0.5 * (result + result.T), coupling

    def field_of(self, dofs: Array) -> Array:
        """Field, or loads on fields, (d, k) from vectors (3N, k) on the mesh's dofs."""
        return np.asarray(self.sectors.axes.T @ dofs)

    def dofs_of(self, x: Array, count: int) -> Array:
        """Displacements (count, k) of the mesh's first dofs from fields x (d, k)."""
        out, rows = np.empty((count, x.shape[1])), self.sectors.axes[:count]

        def part(block: slice) -> None:
            out[:, block] = rows @ x[:, block]

        shared(x.shape[1], part, self._block)
        return out

    def _form(self, x: Array) -> Array:
        """Fields (d, k) as (3n, z, k)."""
        count = self.sectors.count
        return np.ascontiguousarray(x).reshape(len(x) // count, count, x.shape[1])

    @property
    def _block(self) -> int:
        """Number of vectors that are processed together, at least a step of the Lanczos
        iteration."""
        return max(8, int(_BLOCK_BYTES / (8 * self.dofs)))

    def _blocks(self, columns: int) -> Iterator[slice]:
        """Slices of vectors that are processed together."""
        return blocks(columns, self._block)

    def _each(self, x: Array, transform: Callable[[Array], Array]) -> Array:
        """transform(x) (d, k), block by block in sector form."""
        parts = [transform(self._form(x[:, block])) for block in self._blocks(x.shape[1])]
        return np.hstack([part.reshape(self.dofs, -1) for part in parts])


def cyclic_condensation(
    model: FeModel, interface: Interface, sectors: Sectors
) -> CyclicCondensation:
    """Condensation of a body by its sectors, which have ties."""
    sectors = sectors.reordered(nested_dissection_order(_graph(model, sectors)))
    ties = sector_ties(interface, sectors)
    assert ties is not None
    stiffness, mass = sector_matrices(model, sectors)
    rigid = rigid_fields(model.nodes, sectors)
    solver = CyclicSolver(_interior(stiffness, ties), ties, rigid)
    path = f"cyclic: {sectors.count} sectors, {len(solver.border_harmonics)} harmonics"
    condensed, residual = free_stiffness(condensed_stiffness(solver, ties), interface)
    recovered = model.vertex_dofs
    return CyclicCondensation(
        interface, ties, stiffness, mass, solver, condensed, recovered, path, residual
    )


def _interior(stiffness: Circulant, ties: SectorTies) -> Elimination:
    """Elimination of one sector's interior from [K B^T; B 0].

    The shift makes the matrix definite: in `Circulant.extended` the next border has no stiffness,
    so it gets that of the sector's own border; the diagonal keeps the sector from moving freely.
    """
    size = stiffness.sector.shape[0] - stiffness.coupling.shape[1]
    border = stiffness.sector[size:, size:].toarray()
    diagonal = np.diag(np.diag(border))
    shift = sla.block_diag(diagonal, border + diagonal)
    try:
        return Elimination(stiffness.extended(), ties.rows, size, shift)
    except np.linalg.LinAlgError:
        raise FlexgearError(
            "the stiffness matrix of a sector is singular: its mesh falls into pieces or has cells "
            "that hang on an edge"
        ) from None


def _graph(model: FeModel, sectors: Sectors) -> sp.csr_matrix:
    """Graph of a sector's interior nodes: entries for nodes of the same cell."""
    local = np.full(len(model.nodes), -1)
    local[sectors.nodes[:, 0]] = np.arange(len(sectors.nodes))
    cells = local[model.basis.element_dofs[:, sectors.cells].T]
    cell, at = np.nonzero((cells >= 0) & (cells < sectors.interior))
    member = sp.csr_matrix(
        (np.ones(len(cell)), (cell, cells[cell, at])), (len(cells), sectors.interior)
    )
    return (member.T @ member).tocsr()


def sector_counts(repeats: int) -> tuple[int, ...]:
    """Possible numbers of sectors of a body with ``repeats`` teeth or pins, falling."""
    return tuple(z for z in range(repeats, LEAST_SECTORS - 1, -1) if repeats % z == 0)


def condense_by_sectors(
    model: FeModel, interface: Interface, counts: Sequence[int]
) -> tuple[CyclicCondensation | None, str]:
    """The condensation by one of several numbers of sectors, None where there is none; and the kind
    of solution with the reason, for the report."""
    if not counts:
        return None, "general: sectors not asked for"
    if interface.expansion is not None:
        return None, "general: rigid ties"
    sectors = find_sectors(model, counts)
    if sectors is None:
        return None, "general: the FE mesh does not repeat by sectors"
    ties = sector_ties(interface, sectors)
    if ties is None:
        return None, "general: no tie that every sector has lies within its sector"
    if not ties.invariant:
        ties = _invariant_ties(model, interface, [z for z in counts if z < sectors.count]) or ties
    condensation = cyclic_condensation(model, interface, ties.sectors)
    return condensation, condensation.path


def _invariant_ties(
    model: FeModel, interface: Interface, counts: Sequence[int]
) -> SectorTies | None:
    """The body's ties by sector, for the largest of ``counts`` at which a turn by one sector maps
    every tie to a tie; None where that is less than ``_LEAST``."""
    for count in counts:
        if count < _LEAST:
            break
        sectors = find_sectors(model, [count])
        ties = None if sectors is None else sector_ties(interface, sectors)
        if ties is not None and ties.invariant:
            return ties
    return None
