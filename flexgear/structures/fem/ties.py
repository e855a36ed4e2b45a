r"""Interface nodes: six dofs each, tied to a patch of the finite-element mesh.

Averaging tie (RBE3). The motion q = [t, theta] of a node at x0 is the rigid motion that fits the
displacement u over its patch best,

    min_q \int |u(x) - H(x) q|^2 dA,  H = [I, -(x - x0) x]   =>
    q = (\int H^T H dA)^{-1} \int H^T N dA u = B u.

The weights come from integration over the patch, so they do not depend on where mesh nodes fall;
a load on the node spreads over the patch as B^T f and stiffens nothing. Rigid motion is
reproduced exactly wherever x0 lies.

Seat tie. As the averaging tie, but translations across the axis and tilts fit the displacement
along the seat's normals only, so that a load on the node spreads as the pressure p ~ cos(angle)
round the seat, see `seat_tie`.

Rigid tie (RBE2). All dofs on a patch follow its node, u = H q, and are eliminated:
u = T [u_free, q]. Nodes shared by two rigid patches belong to neither.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
import scipy.sparse as sp

from flexgear.arrays import Array, Ints
from flexgear.model.errors import FlexgearError
from flexgear.structures.bodies import rigid_motion, rigid_rows
from flexgear.structures.fem.assembly import FeModel, Sample


@dataclass(frozen=True, eq=False)
class Tie:
    """Tie of one interface node at position (3,) m: rows (6, 3n) of B of an averaging or seat tie,
    or the nodes of a rigid patch."""

    name: str
    position: Array
    rows: sp.csr_matrix | None = None
    nodes: Ints | None = None


@dataclass(frozen=True, eq=False)
class Interface:
    """All interface nodes of a body and their ties, q = B u on the dofs that rigid ties leave.

    node_names (n,), positions (n, 3) m; rows: B (6n, d) CSR, six rows a node in node order;
    expansion (3n_fe, d) CSR with u = expansion u_d, None where no tie is rigid.
    """

    node_names: tuple[str, ...]
    positions: Array
    rows: sp.csr_matrix = field(repr=False)
    expansion: sp.csr_matrix | None = field(repr=False, default=None)

    @property
    def size(self) -> int:
        """Number of interface dofs."""
        return 6 * len(self.node_names)


def averaging_tie(name: str, position: Array, sample: Sample) -> Tie:
    """Tie of a node whose motion is the least-squares rigid motion of a sample's points.
    FlexgearError where the points do not determine it."""
    patch = _Patch.of(sample)
    weight = np.einsum("m,mci->cmi", sample.weights, patch.motion)
    weight = weight @ _inverse(name, np.einsum("cmi,mcj->ij", weight, patch.motion))
    return _tie(name, position, sample, patch, weight)


def seat_tie(name: str, position: Array, sample: Sample) -> Tie:
    """Tie of a bearing seat to a node on its axis, which is along z.

    A bearing transmits pressure only, so translations across the axis and tilts q fit the
    displacement along the seat's normals n,

        min ∫ (n·(u − H q))² dA;

    translation along the axis and rotation about it fit the remaining displacement u − H q.
    """
    w, away = sample.weights, sample.points - position
    patch = _Patch.of(sample, position + np.array([0.0, 0.0, w @ away[:, 2] / w.sum()]))
    normal = away * [1.0, 1.0, 0.0]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    across, along = patch.motion[..., [0, 1, 3, 4]], patch.motion[..., [2, 5]]
    pressed = np.einsum("mc,mci->mi", normal, across)
    of_across = np.einsum("m,mi,mc->cmi", w, pressed, normal)
    of_across = of_across @ _inverse(name, np.einsum("m,mi,mj->ij", w, pressed, pressed))
    of_along = np.einsum("m,mci->cmi", w, along)
    of_along = of_along @ _inverse(name, np.einsum("cmi,mcj->ij", of_along, along))
    of_along -= of_across @ np.einsum("cmj,mci->ij", of_along, across)
    weight = np.empty_like(patch.motion.swapaxes(0, 1))
    weight[..., [0, 1, 3, 4]], weight[..., [2, 5]] = of_across, of_along
    return _tie(name, position, sample, patch, weight)


@dataclass(frozen=True, eq=False)
class _Patch:
    """A tied surface: its centre (3,) m; length, root mean square distance of its points from
    there, m; and motion (m, 3, 6) of the points by unit translations and by rotations of 1/length,
    a scaling for good condition."""

    centre: Array
    length: float
    motion: Array

    @classmethod
    def of(cls, sample: Sample, centre: Array | None = None) -> Self:
        """Patch of a sample about a centre (3,) m, by default its centroid."""
        share = sample.weights / sample.weights.sum()
        centre = share @ sample.points if centre is None else centre
        away = sample.points - centre
        length = float(np.sqrt(share @ np.sum(away**2, axis=1)))
        motion = rigid_motion(away)
        motion[..., 3:] /= length
        return cls(centre, length, motion)


def _inverse(name: str, gram: Array) -> Array:
    if np.linalg.cond(gram) > 1e8:
        raise FlexgearError(
            f"patch '{name}' has no extent across one axis: rotation about it is undetermined"
        )
    return np.asarray(np.linalg.inv(gram))


def _tie(name: str, position: Array, sample: Sample, patch: _Patch, weight: Array) -> Tie:
    """Tie of a node at a position (3,) m, from weights (3, m, 6) of the displacements of a sample's
    points in the six scaled motions of its patch."""
    position = np.asarray(position, dtype=float)
    weight = weight / np.repeat([1.0, patch.length], 3)
    # from the patch's centre to the node: t(x0) = t(c) + theta x (x0 - c)
    shift = np.eye(6)
    shift[:3] = rigid_motion((position - patch.centre)[None])[0]
    rows = [
        sp.kron(sp.csr_matrix(shift @ weight[c].T) @ sample.interpolation, np.eye(1, 3, c))
        for c in range(3)
    ]
    return Tie(name, position, rows=(rows[0] + rows[1] + rows[2]).tocsr())


def rigid_tie(name: str, position: Array, sample: Sample) -> Tie:
    """Tie by which all nodes of the elements at a sample's points move rigidly with the interface
    node."""
    nodes = np.unique(sample.interpolation.indices)
    return Tie(name, np.asarray(position, dtype=float), nodes=nodes.astype(np.int64))


def interface_of(model: FeModel, ties: Sequence[Tie]) -> Interface:
    """The interface of ties, its nodes in their order."""
    names = tuple(tie.name for tie in ties)
    positions = np.array([tie.position for tie in ties])
    rigid = [i for i, tie in enumerate(ties) if tie.nodes is not None]
    if not rigid:
        rows = sp.vstack([t.rows for t in ties]).tocsr()
        return Interface(names, positions, rows)
    expansion, first = _expansion(model, ties, rigid)
    unit = sp.eye(6 * len(rigid), expansion.shape[1], k=first, format="csr")
    parts = []
    for i, tie in enumerate(ties):
        start = 6 * rigid.index(i) if tie.rows is None else 0
        parts.append(unit[start : start + 6] if tie.rows is None else tie.rows @ expansion)
    return Interface(names, positions, sp.vstack(parts).tocsr(), expansion)


def _expansion(
    model: FeModel, ties: Sequence[Tie], rigid: Sequence[int]
) -> tuple[sp.csr_matrix, int]:
    """Expansion T (3n, d) of u = T [u_free, q_rigid], and the column where q_rigid begins; rigid:
    indices of the rigid ties."""
    owner = np.full(len(model.nodes), -1)
    shared = np.zeros(len(model.nodes), dtype=bool)
    for i in rigid:
        nodes = ties[i].nodes
        shared[nodes[owner[nodes] >= 0]] = True  # type: ignore[index]
        owner[nodes] = i
    owner[shared] = -1
    identity = sp.identity(model.dofs, format="csc")
    blocks = [identity[:, np.repeat(owner < 0, 3)]]
    for i in rigid:
        nodes = np.flatnonzero(owner == i)
        motion = rigid_motion(model.nodes[nodes] - ties[i].position).reshape(-1, 6)
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        blocks.append(identity[:, dofs] @ sp.csr_matrix(motion))
    return sp.hstack(blocks).tocsr(), blocks[0].shape[1]


def free_stiffness(stiffness: Array, interface: Interface) -> tuple[Array, float]:
    """K_bb with exactly no forces under rigid motions, and the relative size of those before.
    FlexgearError where they exceed rounding errors."""
    length = np.linalg.norm(interface.positions, axis=1).max()
    scale = np.tile([1.0, 1.0, 1.0] + 3 * [1 / length], len(interface.node_names))
    scaled = scale[:, None] * stiffness * scale
    rigid = np.linalg.qr(rigid_rows(interface.positions) / scale[:, None])[0]
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
