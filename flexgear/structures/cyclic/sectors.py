"""Equal sectors of a body: nodes and cells that are images of one another, matrices, borders.

Sector s is sector 0 turned by s 2 pi / z about the z-axis. The nodes of its cells are its interior,
its border with sector s - 1, and the border of sector s + 1, which belongs to that sector:

    nodes of sector s = [interior, border],   nodes of its cells = [interior, border, next border].

Whether an FE mesh is periodic follows from its coordinates and cells alone, for generated and
users' meshes alike. The body has one isotropic material, so that K and M of a periodic mesh are
block-circulant in axes that turn with the sectors.

A field in sector form is x (3n, z, k): local dof, sector, vector; components along the axes of each
sector. With the next sector's border x_b(s + 1)

    (A x)(s) = A_0 x(s) + A_1 x_b(s + 1),   plus  A_1^T x(s)  on the border of s + 1,

and A_0, A_1 are the same for all sectors. Mass acts on x, y and z alike; x_b(s + 1) has components
along the next sector's axes, so that A_1 has Q, the rotation by one pitch, for every node.

Rigid motion of the borders. Where a large body bends softly, its sectors move nearly as rigid
bodies, and rounding errors of a sector's stiffness would exceed the forces of its small strain. So
the condensed matrices of a sector are corrected to reproduce rigid motion exactly. Of a free sector
condensed to its borders, S x_b, with B^ x_b the motion of its ties and R rigid motion (R_b on the
borders),

    S R_b = 0,   B^ R_b = B R

hold exactly, if the stiffness that two neighbours add at a border is divided correctly between
them; in the body only the sum of the two parts counts. With R_b^T R_b = I the smallest corrections
that restore these equations are

    S <- (I - R_b R_b^T) S (I - R_b R_b^T),   B^ <- B^ + (B R - B^ R_b) R_b^T.

Harmonics of the borders. One sector's condensed matrix on [its border, the next border] is
[S_00 S_01; S_10 S_11]. With x(s) = 1/z sum_h X_h e^{i h s 2 pi/z} the equations of all borders
separate,

    S_h = S_00 + S_11 + S_01 e^{i h 2 pi/z} + S_10 e^{-i h 2 pi/z},   S_h X_h = R_h,

with S_h Hermitian, and definite where the sectors are held; harmonics h and z - h are conjugates,
so h = 0 ... z // 2 suffice. Source: Thomas 1979, Int. J. Numer. Methods Eng. 14:81.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.fft
import scipy.sparse as sp
from scipy.spatial import cKDTree

from flexgear.arrays import Array, Complex, Ints
from flexgear.model.errors import FlexgearError
from flexgear.structures.bodies import rigid_motion, rotation
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.linalg.dense import (
    THREADS,
    hermitian_inverse,
    shared,
    signed_hermitian_inverse,
)

LEAST_SECTORS = 3  # with two sectors the one before is also the one after
_TOLERANCE = 1e-9  # largest distance of an image from its node, over the radius
_SAMPLED = 64  # nodes whose images are checked before all others
_WINDOWS = 8  # angles that are tried as the beginning of the first sector


@dataclass(frozen=True, eq=False)
class Sectors:
    """Nodes and cells of the ``count`` equal sectors of an FE mesh.

    nodes: (n, z) numbers in the mesh of the local nodes of every sector; the last ``border`` of the
    n local nodes are shared with the previous sector; cells: (c,) cells of sector 0.
    """

    count: int
    nodes: Ints = field(repr=False)
    border: int
    cells: Ints = field(repr=False)

    @property
    def interior(self) -> int:
        """Number of local nodes that are not on the border."""
        return len(self.nodes) - self.border

    @property
    def pitch(self) -> float:
        """Angle between sectors, rad."""
        return 2 * np.pi / self.count

    def turns(self) -> Array:
        """Rotations (z, 3, 3) of components along the sectors' axes to the body's."""
        return rotation(self.pitch * np.arange(self.count, dtype=float))

    @cached_property
    def axes(self) -> sp.csr_matrix:
        """Orthogonal matrix T (3N, 3n z) from fields in sector form to vectors on the mesh's dofs;
        columns by local dof, then sector."""
        n, z = self.nodes.shape
        turns = sp.block_diag(self.turns(), format="csc")  # rows and columns by sector, then dof
        of_node = turns[:, np.arange(3 * z).reshape(z, 3).T.ravel()]  # columns by dof, then sector
        rows = (3 * self.nodes[..., None] + np.arange(3)).ravel()
        return sp.kron(sp.identity(n), of_node, format="csr")[np.argsort(rows)]

    def reordered(self, interior: Ints) -> Sectors:
        """The same sectors with the interior nodes in the order ``interior`` (n - border,)."""
        order = np.concatenate([interior, np.arange(self.interior, len(self.nodes))])
        return Sectors(self.count, self.nodes[order], self.border, self.cells)


def find_sectors(model: FeModel, counts: Iterable[int]) -> Sectors | None:
    """Sectors of a body, as many as the first of ``counts`` that its FE mesh allows, with the
    smallest border of several choices; None where it allows none."""
    for count in counts:
        image, dofs = _image(model.nodes, 2 * np.pi / count), model.basis.element_dofs
        cell_image = None if image is None else _cell_image(dofs.T.astype(np.int64), image)
        if image is None or cell_image is None:
            continue
        choices = _choices(model, count, cell_image)
        possible = [_sectors(dofs[:, cells], count, image, cells) for cells in choices]
        sectors = [s for s in possible if s is not None]
        if sectors:
            return min(sectors, key=lambda s: s.border)
    return None


def _image(nodes: Array, angle: float) -> Ints | None:
    """Node (n,) at the place of each node turned by ``angle`` about z; None unless all have one."""
    turned = nodes @ rotation(angle).T
    tolerance = _TOLERANCE * float(np.hypot(nodes[:, 0], nodes[:, 1]).max())
    tree = cKDTree(nodes)
    sampled = turned[:: max(1, len(nodes) // _SAMPLED)]
    if tree.query(sampled)[0].max() > tolerance:
        return None
    distance, image = tree.query(turned)
    if distance.max() > tolerance or len(np.unique(image)) != len(image):
        return None
    return image.astype(np.int64)


def _cell_image(cells: Ints, image: Ints) -> Ints | None:
    """Cell (m,) whose nodes are the images of those of each cell (m, a); None unless all have
    one."""
    hash_of_node = np.random.default_rng(0).integers(1 << 62, size=len(image))
    with np.errstate(over="ignore"):
        key = hash_of_node[cells].sum(axis=1)
        turned = hash_of_node[image[cells]].sum(axis=1)
    order = np.argsort(key)
    target = order[np.minimum(np.searchsorted(key[order], turned), len(order) - 1)]
    same = np.sort(image[cells], axis=1) == np.sort(cells[target], axis=1)
    return target if same.all() else None


def orbits(start: Ints, image: Ints, count: int) -> Ints:
    """Images (k, z) of numbers start (k,) after 0 to z - 1 applications of ``image``."""
    out = np.empty((len(start), count), dtype=np.int64)
    out[:, 0] = start
    for s in range(1, count):
        out[:, s] = image[out[:, s - 1]]
    return out


def _choices(model: FeModel, count: int, cell_image: Ints) -> Iterator[Ints]:
    """Possible sets of cells of the first sector: those with the lowest numbers, by which
    generators number sectors, then those whose centres lie in windows of angle."""
    every = np.arange(len(cell_image))
    lowest = np.flatnonzero(orbits(every, cell_image, count).min(axis=1) == every)
    if len(lowest) * count != len(every):  # a cell is its own image before a full turn
        return
    yield lowest
    images = orbits(lowest, cell_image, count)
    centre = model.nodes[model.basis.element_dofs].mean(axis=0)
    angle = np.arctan2(centre[:, 1], centre[:, 0])[images]
    pitch = 2 * np.pi / count
    for window in range(_WINDOWS):
        # centres lie on lines of symmetry; 0.4567 keeps the borders of windows away from these
        begin = (window + 0.4567) * pitch / _WINDOWS
        yield images[every[: len(images)], np.argmin((angle - begin) % (2 * np.pi), axis=1)]


def _sectors(element_dofs: Ints, count: int, image: Ints, cells: Ints) -> Sectors | None:
    """Sectors from the nodes of the first one's cells; None where cells connect sectors that are
    not neighbours."""
    of_cells = np.zeros(len(image), dtype=bool)
    of_cells[element_dofs] = True
    ahead = np.zeros_like(of_cells)
    ahead[image[of_cells]] = True
    in_sector = of_cells & ~ahead
    border = np.zeros_like(of_cells)
    border[np.argsort(image)[of_cells & ahead]] = True
    if in_sector.sum() * count != len(image) or (border & ~in_sector).any():
        return None
    local = np.concatenate([np.flatnonzero(in_sector & ~border), np.flatnonzero(border)])
    nodes = orbits(local, image, count)
    if len(np.unique(nodes)) < len(image) or border.sum() in (0, in_sector.sum()):
        return None
    return Sectors(count, nodes, int(border.sum()), cells)


@dataclass(frozen=True, eq=False)
class Circulant:
    """A block-circulant matrix: sector, A_0 (n, n) CSR, within a sector; coupling, A_1 (n, b) CSR,
    to the border of the next sector, the last b of its n dofs."""

    sector: sp.csr_matrix = field(repr=False)
    coupling: sp.csr_matrix = field(repr=False)

    def product(self, x: Array) -> Array:
        """A x (n, z, k) of a field x in sector form."""
        n, b = self.coupling.shape
        flat, border = np.ascontiguousarray(x).reshape(n, -1), slice(n - b, None)
        next_border = np.roll(x[border], -1, axis=1)
        out = (self.sector @ flat + self.coupling @ next_border.reshape(b, -1)).reshape(x.shape)
        out[border] += np.roll((self.coupling.T @ flat).reshape(next_border.shape), 1, axis=1)
        return out

    def extended(self) -> sp.csr_matrix:
        """[A_0 A_1; A_1^T 0], the matrix of one sector; the sum over all sectors is A."""
        return sp.bmat([[self.sector, self.coupling], [self.coupling.T, None]], format="csr")

    def less(self, factor: float, other: Circulant) -> Circulant:
        """The matrix A - factor B."""
        return Circulant(
            self.sector - factor * other.sector, self.coupling - factor * other.coupling
        )


def sector_matrices(model: FeModel, sectors: Sectors) -> tuple[Circulant, Circulant]:
    """Stiffness and mass of a body of equal sectors, assembled over one sector."""
    n, b = len(sectors.nodes), sectors.border
    part, numbers = model.part(sectors.cells)
    in_part = np.empty(len(model.nodes), dtype=np.int64)
    in_part[numbers] = np.arange(len(numbers))
    at = in_part[np.concatenate([sectors.nodes[:, 0], sectors.nodes[sectors.interior :, 1]])]
    dofs = (3 * at[:, None] + np.arange(3)).ravel()
    q = rotation(sectors.pitch)
    turned = sp.block_diag([sp.identity(3 * n), sp.kron(sp.identity(b), q)]).tocsr()
    stiffness = (turned.T @ part.stiffness[dofs][:, dofs] @ turned).tocsr()
    scalar = _circulant(part.scalar_mass[at][:, at].tocsr(), n, b)
    sector, coupling = sp.kron(scalar.sector, np.eye(3)), sp.kron(scalar.coupling, q)
    return _circulant(stiffness, 3 * n, 3 * b), Circulant(sector.tocsr(), coupling.tocsr())


def _circulant(matrix: sp.csr_matrix, n: int, b: int) -> Circulant:
    """Block-circulant matrix from that of one sector's cells on its n dofs and the b dofs of the
    next border, whose diagonal block is added to the sector's own border."""
    at = sp.csr_matrix((np.ones(b), (np.arange(n - b, n), np.arange(b))), (n, b))
    sector = matrix[:n, :n] + at @ matrix[n:, n:] @ at.T
    return Circulant(sector.tocsr(), matrix[:n, n:].tocsr())


def rigid_fields(nodes: Array, sectors: Sectors) -> Array:
    """Rigid motion R (3n + 3b, 6) of a sector's nodes and of the next border, along the axes of
    either sector, orthonormal on the borders; nodes (N, 3), m."""
    sector_nodes, ahead = sectors.nodes[:, 0], sectors.nodes[sectors.interior :, 1]
    points = nodes[np.concatenate([sector_nodes, ahead])]
    fields = rigid_motion(points - points[sectors.interior :].mean(axis=0))
    fields[len(sector_nodes) :] = rotation(sectors.pitch).T @ fields[len(sector_nodes) :]
    flat = fields.reshape(-1, 6)
    _, triangle = np.linalg.qr(flat[3 * sectors.interior :])
    return np.linalg.solve(triangle.T, flat.T).T


def without_rigid(stiffness: Array, rigid: Array) -> Array:
    """The condensed stiffness S (2b, 2b), corrected to S R_b = 0; rigid: R_b (2b, 6)."""
    stiffness = _balanced(stiffness, rigid)
    half = stiffness - rigid @ (rigid.T @ stiffness)
    return half - (half @ rigid) @ rigid.T


def _balanced(stiffness: Array, rigid: Array) -> Array:
    """S with a part X moved from S_00 to S_11, which leaves their sum, so that
    S_00 R_0 + S_01 R_1 = 0."""
    b = len(stiffness) // 2
    q, triangle = np.linalg.qr(rigid[:b])
    y = np.linalg.solve(triangle.T, (stiffness[:b] @ rigid).T).T
    across = q.T @ y
    share = y @ q.T + q @ y.T - q @ (0.5 * (across + across.T)) @ q.T
    out = stiffness.copy()
    out[:b, :b] -= share
    out[b:, b:] += share
    return out


def with_rigid(ties: Array, rigid: Array, motion: Array) -> Array:
    """The motion of ties B^ (r, 2b), corrected to B^ R_b = motion; motion: B R (r, 6)."""
    return ties + (motion - ties @ rigid) @ rigid.T


_PANEL = 256  # rows of a panel
_LARGE = 2e8  # bytes of inverses that ``forget`` frees


class Harmonics:
    """Inverses of the borders' stiffness S_h (b, b) in all harmonics h, which take most of the
    memory where borders are wide.

    They are Hermitian: of each only panels of rows are stored, up to their last diagonal entry.
    """

    def __init__(self, condensed: Array, count: int, definite: bool = True) -> None:
        """condensed: S (2b, 2b) of one sector; count: z; definite: whether all S_h are."""
        b = len(condensed) // 2
        self.size, self.count = b, count
        self._panels = [slice(begin, min(begin + _PANEL, b)) for begin in range(0, b, _PANEL)]
        self._condensed, self._definite = condensed, definite
        self._inverse: Complex | None = None
        self._negative = np.zeros(len(self), dtype=int)
        self.inverses()

    def forget(self) -> None:
        """Free the memory of large inverses; their next use computes them again."""
        if self._inverse is not None and self._inverse.nbytes > _LARGE:
            self._inverse = None

    def inverses(self) -> Complex:
        """Inverses (harmonics, entries of all panels), one array so that it is freed as a whole."""
        if self._inverse is not None:
            return self._inverse
        b = self.size
        entries = sum((rows.stop - rows.start) * rows.stop for rows in self._panels)
        inverse = np.empty((len(self), entries), dtype=complex)
        diagonal = self._condensed[:b, :b] + self._condensed[b:, b:]
        diagonal = 0.5 * (diagonal + diagonal.T)
        across = self._condensed[:b, b:]
        for h in range(len(self)):
            phase = np.exp(2j * np.pi * h / self.count)
            matrix = diagonal + phase * across + np.conj(phase) * across.T
            self._negative[h] = self._keep_lower(matrix, inverse[h])
        self._inverse = inverse
        return inverse

    def __len__(self) -> int:
        return self.count // 2 + 1

    @property
    def times(self) -> Ints:
        """Multiplicity (harmonics,): 2 for harmonics with a conjugate, else 1."""
        return np.where(2 * np.arange(len(self)) % self.count == 0, 1, 2)

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues of all S_h, conjugates included."""
        return int(self.times @ self._negative)

    def solve(self, right: Array) -> Array:
        """Borders x (b, z, k) under loads (b, z, k)."""
        if not right.shape[2]:
            return right
        r = scipy.fft.rfft(right, axis=1, workers=THREADS).transpose(1, 0, 2)
        x = np.empty(r.shape, dtype=complex)
        self.inverses()

        def part(harmonics: slice) -> None:
            for h in range(harmonics.start, harmonics.stop):
                x[h] = self.of(h, np.ascontiguousarray(r[h]))

        shared(len(self), part, chunk=1)
        return scipy.fft.irfft(x.transpose(1, 0, 2), self.count, axis=1, workers=THREADS)

    def of(self, h: int, right: Complex) -> Complex:
        """S_h^{-1} right (b, k)."""
        x = np.empty(right.shape, dtype=complex)
        adjoint = np.ascontiguousarray(right.conj().T)
        for rows, panel in self._of_panels(self.inverses()[h]):
            x[rows] = panel @ right[: rows.stop]
            if rows.start:  # its conjugate transpose above the diagonal
                x[: rows.start] += (adjoint[:, rows] @ panel[:, : rows.start]).conj().T
        return x

    def _of_panels(self, entries: Complex) -> Iterator[tuple[slice, Complex]]:
        """Rows and entries of each panel, with its diagonal block, of one harmonic's entries."""
        begin = 0
        for rows in self._panels:
            shape = rows.stop - rows.start, rows.stop
            end = begin + shape[0] * shape[1]
            yield rows, entries[begin:end].reshape(shape)
            begin = end

    def _keep_lower(self, matrix: Complex, entries: Complex) -> int:
        """Store the inverse of a Hermitian matrix in panels; returns the number of its negative
        eigenvalues. FlexgearError where it is not regular."""
        negative = 0
        try:
            if self._definite:
                inverse = hermitian_inverse(matrix)
            else:
                inverse, negative = signed_hermitian_inverse(matrix)
        except np.linalg.LinAlgError:
            raise FlexgearError("a sector is not held by the ties of its teeth") from None
        for rows, panel in self._of_panels(entries):
            panel[:] = inverse[rows, : rows.stop]
            block = panel[:, rows.start :]
            block[:] = np.tril(block) + np.tril(block, -1).conj().T
        return negative
