"""Bodies of the coupled system (mass, stiffness and named 6-dof nodes), their springs, and small
rigid motion.

A body has coordinates ``q`` (d,). The motion of its nodes is ``node_map @ q`` with six rows a
node in the order ux, uy, uz, rx, ry, rz (m, rad). ``Body`` represents a reduced finite-element
body, a beam, a lumped gear and a rigid component alike, so that a component is made rigid or
stiffer by a transformation that returns a new body.

Coordinates are the node dofs followed by modal ones (Craig–Bampton, beams); the rigid motion of
the frame's origin (rigid and lumped bodies); or that motion followed by elastic coordinates
(``floating``). The columns of ``rigid_motions`` are the coordinates of unit rigid motions.

A spring connects one interface node to the body's surroundings, in axes turned about z: the axes of
a bolt point outward along the radius, tangentially and along z.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName, NodeName


def rotation(angle: Array | float) -> Array:
    """Rotation matrix (..., 3, 3) about z by ``angle`` (...), rad.

    It transforms components along the turned axes to components along the fixed axes; row vectors
    are multiplied by its transpose.
    """
    angle = np.asarray(angle, dtype=float)
    out = np.zeros((*angle.shape, 3, 3))
    out[..., 0, 0] = out[..., 1, 1] = np.cos(angle)
    out[..., 1, 0] = np.sin(angle)
    out[..., 0, 1] = -out[..., 1, 0]
    out[..., 2, 2] = 1.0
    return out


def turn(angle: Array | float) -> Array:
    """Rotations (..., 6, 6) about z by angles (...), rad, of the six components of a node's motion
    or of a wrench."""
    block = rotation(angle)
    out = np.zeros((*block.shape[:-2], 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = block
    return out


def rigid_motion(arms: Array) -> Array:
    """Displacements H (m, 3, 6) of points at arms (m, 3) m from a reference point by its unit
    translations t and rotations θ: u = t + θ x arm = H [t, θ]."""
    h = np.zeros((len(arms), 3, 6))
    h[:, [0, 1, 2], [0, 1, 2]] = 1.0
    x, y, z = arms.T
    h[:, 0, 4], h[:, 0, 5] = z, -y
    h[:, 1, 3], h[:, 1, 5] = -z, x
    h[:, 2, 3], h[:, 2, 4] = y, -x
    return h


def rigid_rows(positions: Array, centre: Array | None = None) -> Array:
    """Motion (6 n, 6) of nodes under unit rigid motions of ``centre`` x0 (the origin if left out):
    translations t + θ x (x − x0) and rotations θ of each node in turn."""
    arms = np.atleast_2d(positions) - (0.0 if centre is None else centre)
    rows = np.zeros((len(arms), 6, 6))
    rows[:, :3] = rigid_motion(arms)
    rows[:, 3:, 3:] = np.eye(3)
    return rows.reshape(-1, 6)


@dataclass(frozen=True)
class Body:
    """One component of the coupled system.

    name: of the body; node_names: (n,) names; positions: (n, 3) m in the body's frame;
    mass: (d, d); stiffness: (d, d), SI; node_map: (6 n, d), node motion = node_map @ q;
    rigid_motions: (d, 6) coordinates of unit rigid translations, and rotations about a point of the
    frame's axis, zero columns where a body cannot move so; rigid: whether it has no other motions.
    """

    name: BodyName
    node_names: tuple[str, ...]
    positions: Array
    mass: Array
    stiffness: Array
    node_map: Array
    rigid_motions: Array
    rigid: bool = False

    @cached_property
    def nodes(self) -> tuple[NodeName, ...]:
        """Names of the nodes with their kinds, halves and numbers."""
        return tuple(map(NodeName.parse, self.node_names))

    @property
    def size(self) -> int:
        """Number of coordinates d."""
        return int(self.mass.shape[0])

    def node(self, name: str) -> Array:
        """Rows (6, d) of the node map that belong to one named node."""
        try:
            i = self.node_names.index(name)
        except ValueError:
            raise FlexgearError(f"{self.name}: there is no node {name!r}") from None
        return self.node_map[6 * i : 6 * i + 6]

    @property
    def spin(self) -> Array:
        """Coordinates (d,) of a unit rotation about the axis of its frame."""
        return self.rigid_motions[:, 5]

    def position(self, name: str) -> Array:
        """Position (3,) of a named node in the body's frame, m."""
        return self.positions[self.node_names.index(name)]


KINEMATICS: dict[str, tuple[int, ...]] = {  # node dofs that a lumped body has, of six
    "fixed": (),
    "torsional": (5,),
    "planar": (0, 1, 5),
    "axial": (0, 1, 2, 5),
    "spatial": (0, 1, 2, 3, 4, 5),
}


def lumped_body(
    name: BodyName,
    mass: float,
    inertia: tuple[float, float, float],
    kinematics: str = "spatial",
    *,
    held: bool = False,
) -> Body:
    """A rigid body of one node at its centre of mass, M = diag(m, m, m, Jx, Jy, Jz).

    kinematics: a key of ``KINEMATICS``; held: whether it cannot rotate about its axis.
    """
    dofs = [i for i in KINEMATICS[kinematics] if not (held and i == 5)]
    return Body(
        name=name,
        node_names=(name,),
        positions=np.zeros((1, 3)),
        mass=np.diag(np.array([mass, mass, mass, *inertia])[dofs]),
        stiffness=np.zeros((len(dofs), len(dofs))),
        node_map=np.eye(6)[:, dofs],
        rigid_motions=np.eye(6)[dofs],
        rigid=True,
    )


def rigid_variant(body: Body) -> Body:
    """The body with rigid motion only: q = T q6, M6 = Tᵀ M T, K6 = 0, T its ``rigid_motions``."""
    if body.rigid:
        return body
    motions = body.rigid_motions
    return replace(
        body,
        mass=motions.T @ body.mass @ motions,
        stiffness=np.zeros((6, 6)),
        node_map=body.node_map @ motions,
        rigid_motions=np.eye(6),
        rigid=True,
    )


def node_motions(positions: Array, size: int) -> Array:
    """``rigid_motions`` (size, 6) of a body whose node dofs come first. Modal coordinates are zero
    in them, because constraint modes reproduce rigid motion exactly."""
    nodes = rigid_rows(positions)
    return np.pad(nodes, ((0, size - len(nodes)), (0, 0)))


@dataclass(frozen=True, eq=False)
class Spring:
    """Spring between an interface node and the body's surroundings.

    matrix: stiffness (6, 6) SI in axes that are turned by angle (rad) about z from the body's.
    """

    node: NodeName
    matrix: Array = field(repr=False)
    angle: float = 0.0

    @property
    def in_body(self) -> Array:
        """Stiffness (6, 6) in the body's axes."""
        to_body = turn(self.angle)
        return to_body @ self.matrix @ to_body.T


def stiffness_at(springs: list[Spring], node_names: tuple[str, ...]) -> Array:
    """Stiffness (6 n, 6 n) of springs to ground at the nodes of a body."""
    out = np.zeros((6 * len(node_names),) * 2)
    for spring in springs:
        at = slice(6 * node_names.index(spring.node), 6 * node_names.index(spring.node) + 6)
        out[at, at] += spring.in_body
    return out
