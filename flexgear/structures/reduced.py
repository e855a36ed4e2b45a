"""Reduced bodies: on interface nodes, in mean axes, and both halves of a ring as one body.

A reduced body has mass and stiffness on named 6-dof nodes and modal coordinates.

u ~ Psi q_b + Phi eta, coordinates q = [q_b, eta]; q_b = six dofs (ux, uy, uz in m; tx, ty, tz in
rad) of each node in node order, eta scaled by Phi^T M Phi = I (kg^(1/2) m).

In coordinates of the rigid motion of its mean axes and of elastic modes (``floating``) a free
reduced body moves as

    u = R r + Φ e,   K Φ = M Φ diag(ω²),   Φᵀ M Φ = 1,   Rᵀ M Φ = 0

R: rigid motion of the body about the origin of its frame, r its six components; Φ: all modes of
the free body but the six rigid ones. Mean axes move by r; relative to them the body has neither
momentum nor angular momentum. It may then turn with its axes by any angle while e stays small.

The ring of a double-helical stage consists of its left half (−z) and the mirror image of that. The
halves have separate supports and are not connected to each other. With the reflection z → −z of a
node's motion, S = diag(1, 1, −1, −1, −1, 1), which leaves fixed-interface modes unchanged, the
right half has M' = S M S, K' = S K S, Ψ' = diag(1, 1, −1) Ψ S. The nodes "tooth_001", "bolt_01" of
the left half are "tooth_left_001", "bolt_left_01" of the whole ring; their images are
"tooth_right_001", "bolt_right_01".

The node of a tooth of an FE gear has the rigid motion q of the tooth's base section. Amplitudes p
of shapes S describe how the base section deforms along the face: sections z = const of the tooth
translate and turn about z by Legendre polynomials over the face width b,

    u(x) = [e_r, e_t, e_z, e_z × (x − x_c)] P_k(2 z/b),   k = 2, 3, 4,

in axes that follow the helix through the tooth's middle x_c(z). The rigid motion that fits each
shape best is subtracted, S' = S − H N with N = (∫HᵀH dA)⁻¹ ∫HᵀS dA, so that the shapes are
orthogonal to the node's motion, and rigid motion has zero amplitudes:

    p = (∫ S'ᵀS' dA)⁻¹ ∫ S'ᵀ u dA = B_s u.

Loads B_sᵀ f act on the base section alone and have no resultant.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import scipy.sparse as sp
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy import linalg
from scipy.linalg import block_diag

from flexgear.arrays import Array, Ints
from flexgear.model.names import SIDES, BodyName, NodeName
from flexgear.structures.bodies import Body, Spring, node_motions, rigid_motion, rotation, turn
from flexgear.structures.strain import strain_of_gradient, vertex_gradient

ORDERS = (2, 3, 4)  # of Legendre polynomials along the face; the node has the lower ones
SHAPES = 4 * len(ORDERS)
MOTIONS = 6 + SHAPES  # of a tooth: those of its node and its shapes
NEXT_TEETH = 2  # number of teeth in +θ that loads on a tooth's shapes move


@dataclass(frozen=True)
class ToothLine:
    """Helix through a tooth's middle: angle rad at z = 0, radius m of its node, helix_rate dθ/dz
    rad/m, face_width m."""

    angle: float
    radius: float
    helix_rate: float
    face_width: float

    @property
    def place(self) -> Array:
        """Position (3,) m of the node."""
        return self.radius * np.array([np.cos(self.angle), np.sin(self.angle), 0.0])

    def shapes(self, points: Array) -> Array:
        """Shapes S (m, 3, SHAPES) at points (m, 3) m: translations 1, rotation m."""
        axes = rotation(self.angle + self.helix_rate * points[:, 2])  # e_r, e_t, e_z in columns
        turned = np.cross(axes[..., 2], points - self.radius * axes[..., 0])
        motion = np.concatenate([axes, turned[..., None]], axis=2)
        orders = legvander(2 * points[:, 2] / self.face_width, max(ORDERS))[:, ORDERS]
        return np.einsum("mci,mk->mcki", motion, orders).reshape(len(points), 3, SHAPES)


@dataclass(frozen=True, eq=False)
class RimFlexibility:
    """Flexibility ΔT (``tooth_influence.rim``) of a gear's tooth and of the next teeth, components
    along the axes of each tooth at its middle.

    tooth (MOTIONS, MOTIONS), beside (NEXT_TEETH, MOTIONS, MOTIONS): zero in the block of the nodes;
    less: N (6, SHAPES); line: of the tooth at the angle 0.
    """

    tooth: Array
    beside: Array
    less: Array
    line: ToothLine


def normal_displacement(line: ToothLine, less: Array, points: Array, normals: Array) -> Array:
    """Displacement G (k, MOTIONS) along normals (k, 3) at points (k, 3) m by unit motions of the
    node and unit amplitudes of the shapes S'; less: N."""
    rigid = rigid_motion(points - line.place)
    motions = np.concatenate([rigid, line.shapes(points) - rigid @ less], axis=2)
    return np.einsum("ki,kij->kj", normals, motions)


Progress = Callable[[str, float], None]  # name of a stage, and the fraction of it that is done


def silent(stage: str, fraction: float) -> None:
    """Progress callback that does nothing."""


@dataclass(frozen=True, eq=False)
class HalvesRecovery:
    """Recovery (2r, 2h) of both halves of a ring, by rows and by products, from that of the left
    one: as an array it would be four times as large, three quarters of it zero or the same values.

    half (r, h): of the left half; columns (2, h): coordinates of each half in those of both; sign
    (h,): of the left half's coordinates in its mirror image, whose points follow those of the left.
    """

    half: NDArray[np.float32]
    columns: Ints
    sign: NDArray[np.float32]

    def __matmul__(self, coordinates: NDArray[np.float32]) -> NDArray[np.float32]:
        """Displacements (2r, k) for coordinates (2h, k)."""
        left, right = (coordinates[columns] for columns in self.columns)
        image = (self.half @ (self.sign[:, None] * right)).reshape(-1, 3, right.shape[1])
        image *= PLACE[:, None].astype(np.float32)
        return np.concatenate([self.half @ left, image.reshape(len(self.half), -1)])

    def __getitem__(self, rows: Ints | slice) -> NDArray[np.float32]:
        """The chosen rows (n, 2h) of the matrix of both halves, each of which has h columns."""
        chosen = np.arange(2 * len(self.half))[rows]
        is_image, at = np.divmod(chosen, len(self.half))
        sides = np.where(is_image[:, None], PLACE[at % 3, None] * self.sign, 1.0)
        out = np.zeros((len(chosen), self.columns.size), dtype=np.float32)
        out[np.arange(len(chosen))[:, None], self.columns[is_image]] = self.half[at] * sides
        return out


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """A reduced body, with the matrix that recovers the displacements of its FE mesh.

    positions (n, 3) m; mass, stiffness (d, d) with d = 6 n + n_modes; report: sizes, options and
    error estimates; points (p, 3) m and cells: vertices and cells of the FE mesh; recovery (3p, d)
    float32: [Psi, Phi] at the vertices; probe_cases: (node, load case) of every load of the static
    check, probe_loads (2, b, n) N, N m: its exact interface forces Ψᵀf, and the wrench at the node
    that replaces it (`estimate`); rim: additional flexibility of a gear's teeth along the face
    (`tooth_influence.rim`), None where it is negligible.
    """

    name: str
    node_names: tuple[str, ...] = field(repr=False)
    positions: Array = field(repr=False)
    mass: Array = field(repr=False)
    stiffness: Array = field(repr=False)
    n_modes: int
    report: dict[str, Any] = field(repr=False)
    points: Array = field(repr=False)
    cells: Ints = field(repr=False)
    recovery: NDArray[np.float32] | HalvesRecovery = field(repr=False)
    probe_cases: tuple[tuple[str, str], ...] = field(default=(), repr=False)
    probe_loads: Array = field(default_factory=lambda: np.zeros((2, 0, 0)), repr=False)
    rim: RimFlexibility | None = field(default=None, repr=False)

    @cached_property
    def nodes(self) -> tuple[NodeName, ...]:
        """Names of the nodes with their kinds, halves and numbers."""
        return tuple(map(NodeName.parse, self.node_names))

    @property
    def interface_dofs(self) -> int:
        """Number of interface dofs, six for each node."""
        return 6 * len(self.node_names)

    def node_slice(self, name: str) -> slice:
        """Slice of a node's six coordinates; KeyError where there is no such node."""
        try:
            start = 6 * self.node_names.index(name)
        except ValueError:
            raise KeyError(f"{self.name} has no interface node '{name}'") from None
        return slice(start, start + 6)

    def with_(self, **changes: Any) -> Self:
        """A copy with some attributes replaced."""
        return replace(self, **changes)

    def as_body(self) -> Body:
        """The body for the coupled system: its node dofs come first."""
        return Body(
            name=BodyName.of("", self.name),
            node_names=tuple(self.node_names),
            positions=np.asarray(self.positions),
            mass=self.mass,
            stiffness=self.stiffness,
            node_map=np.eye(self.interface_dofs, self.mass.shape[0]),
            rigid_motions=self.rigid_modes(),
        )

    def rigid_modes(self) -> Array:
        """Coordinates (d, 6) of unit rigid motions about the origin: ux, uy, uz, tx, ty, tz."""
        return node_motions(self.positions, len(self.mass))

    def with_rigid(self, rows: NDArray[np.floating[Any]], exact: Array | float = 0.0) -> Array:
        """Rows (..., d) that multiply coordinates, corrected to give ``exact`` (..., 6) under unit
        rigid motions: the single-precision recovery has rounding errors there."""
        rigid = self.rigid_modes()
        return np.asarray(rows + (exact - rows @ rigid) @ np.linalg.pinv(rigid))

    def recover(self, q: Array) -> Array:
        """Displacements (p, 3[, k]) in m at the vertices of the FE mesh for coordinates q (d[, k]).

        The rigid motion nearest to q is recovered in double precision and only the rest from the
        single-precision array, so that large rigid rotations cost no accuracy.
        """
        q = np.asarray(q, dtype=float)
        columns = q.reshape(len(q), -1)
        rigid = self.rigid_modes()
        motion = np.linalg.lstsq(rigid, columns, rcond=None)[0]
        rest = columns - rigid @ motion
        elastic = np.asarray(self.recovery @ rest.astype(np.float32), dtype=np.float64)
        exact = rigid_motion(self.points).reshape(-1, 6) @ motion
        return (elastic + exact).reshape((len(self.points), 3) + q.shape[1:])

    @cached_property
    def vertex_gradient(self) -> sp.csr_matrix:
        """Gradient matrix (3p, p) on values at the vertices of the FE mesh; see ``strain``."""
        return vertex_gradient(self.points, self.cells)

    def strain(self, q: Array) -> Array:
        """Strain (p, 6) at the vertices of the FE mesh for coordinates q (d,), in the order of
        ``strain.COMPONENTS``."""
        rows = (self.vertex_gradient @ self.recover(q)).reshape(len(self.points), 3, 3)
        return strain_of_gradient(rows.swapaxes(1, 2))


def elastic_modes(reduced: ReducedBody) -> tuple[Array, Array]:
    """Elastic modes of a free body, m = d − 6: ω² (m,) in rad²/s², rising, and shapes Φ (d, m) in
    the coordinates of the reduced body."""
    values, shapes = linalg.eigh(reduced.stiffness, reduced.mass)
    values, shapes = values[6:], shapes[:, 6:]
    rigid = reduced.rigid_modes()
    momentum = rigid.T @ reduced.mass
    return values, shapes - rigid @ np.linalg.solve(momentum @ rigid, momentum @ shapes)


def floating(reduced: ReducedBody, name: BodyName, turned: float = 0.0) -> Body:
    """The body in mean axes, coordinates q = [r (6), e (m)]: M = diag(M_6, 1), K = diag(0, ω²).

    name: of the body and of its first node, at the origin, which moves with the mean axes by r. The
    other nodes are those of the reduced body with their elastic displacement Φ e alone. turned:
    angle of the body's axes about z from those of r and of all nodes, rad.
    """
    values, shapes = elastic_modes(reduced)
    rigid = reduced.rigid_modes()
    nodes = shapes[: reduced.interface_dofs].reshape(-1, 6, len(values))
    size = 6 + len(values)
    return Body(
        name=name,
        node_names=(name, *reduced.node_names),
        positions=np.vstack([np.zeros(3), reduced.positions @ rotation(turned).T]),
        mass=linalg.block_diag(
            turn(turned) @ rigid.T @ reduced.mass @ rigid @ turn(turned).T, np.eye(len(values))
        ),
        stiffness=np.diag(np.concatenate([np.zeros(6), values])),
        node_map=linalg.block_diag(np.eye(6), (turn(turned) @ nodes).reshape(-1, len(values))),
        rigid_motions=np.eye(size, 6),
    )


MIRROR = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])  # signs of a node's motion reflected at z = 0
PLACE = MIRROR[:3]  # signs of a reflected position


def mirrored(springs: Sequence[Spring]) -> list[Spring]:
    """Springs of both halves of a ring, from those of the left half: the left ones, then their
    mirror images on the right half."""
    left = [Spring(s.node.of_half("left"), s.matrix, s.angle) for s in springs]
    across = np.outer(MIRROR, MIRROR)
    return left + [Spring(s.node.of_half("right"), across * s.matrix, s.angle) for s in springs]


def both_halves(half: ReducedBody, offset: float) -> ReducedBody:
    """Both halves of a ring as one body; half: the left one; offset: distance of the mid-planes of
    the halves from z = 0, m.

    Coordinates: six of every node of the left half, then of the right, then modal ones of the left
    half and of the right. ``report`` is that of one half; the loads of its static check are left
    out.
    """
    nodes, inner = half.interface_dofs, half.n_modes
    sign = np.concatenate([np.tile(MIRROR, len(half.node_names)), np.ones(inner)])
    # from one half after the other to nodes of both, then modes of both
    half_after_half = np.arange(2 * (nodes + inner)).reshape(2, -1)
    order = np.concatenate([half_after_half[:, :nodes].ravel(), half_after_half[:, nodes:].ravel()])
    columns = np.argsort(order).reshape(2, -1)
    across = np.outer(sign, sign)
    lift = np.array([0.0, 0.0, offset])
    return half.with_(
        node_names=tuple(n.of_half(side) for side in SIDES for n in half.nodes),
        positions=np.vstack([half.positions - lift, half.positions * PLACE + lift]),
        mass=_in_order(block_diag(half.mass, across * half.mass), order),
        stiffness=_in_order(block_diag(half.stiffness, across * half.stiffness), order),
        n_modes=2 * inner,
        points=np.vstack([half.points - lift, half.points * PLACE + lift]),
        cells=np.vstack([half.cells, half.cells + len(half.points)]),
        recovery=HalvesRecovery(np.asarray(half.recovery), columns, sign.astype(np.float32)),
        probe_cases=(),
        probe_loads=np.zeros((2, 0, 0)),
    )


def _in_order(matrix: Array, order: Ints) -> Array:
    return np.ascontiguousarray(matrix[np.ix_(order, order)])
