"""Bodies, springs and contact nodes of a train on the way to its ``System``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.coupling.connections import Connection
from flexgear.coupling.gear_meshes import BearingElement, ExtraRows, GearMeshSet, GivenLoad
from flexgear.coupling.laws.law import CENTERING
from flexgear.coupling.members import Member
from flexgear.coupling.springs import (
    LawBearing,
    add_spring,
    invariant_part,
    joint_parts,
    own_law,
    rotating_rows,
)
from flexgear.coupling.system import Link, RotatingFrameSupport, StageFrame
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName, MemberName, SupportName
from flexgear.model.springs import Bearing, at_height
from flexgear.structures.bodies import Body
from flexgear.structures.kinematics import rigid_rows, turn

Array = NDArray[np.float64]
MISPLACED = 0.05  # of the size of an FE housing, by which a node may be off its support
LOOSE = 1e-12  # of the largest eigenvalue, below which a motion counts as not resisted


class Assembly:
    """Matrices of the bodies, to which springs are added.

    Nodes of supports that turn against their frame, of bearings with clearance and of loads are
    contact nodes: their rows become blocks of the system behind those of the gear meshes.
    """

    def __init__(self, bodies: Sequence[Body], source: str) -> None:
        self.bodies, self.source = list(bodies), source
        sizes = np.cumsum([0, *[b.size for b in bodies]])
        self.starts = dict(zip([b.name for b in bodies], sizes, strict=False))
        self.size = int(sizes[-1])
        self.mass = np.zeros((self.size, self.size))
        self.stiffness = np.zeros((self.size, self.size))
        for b in bodies:
            at = self.slice_of(b.name)
            self.mass[at, at] = b.mass
            self.stiffness[at, at] = b.stiffness
        self.links: list[Link] = []
        self.rotating_frame_supports: list[RotatingFrameSupport] = []
        self.bearings: list[LawBearing] = []
        self.contact_nodes: list[Array] = []
        self.node_angles: list[int] = []
        self.stands: dict[str, Array] = {}  # of a stage in an FE housing, m
        self.support_rows: list[tuple[float, list[tuple[int, Array]]]] = []
        self.support_names: list[str] = []  # of each of these rows

    def body(self, name: str) -> Body:
        """One body by name."""
        return next(b for b in self.bodies if b.name == name)

    def has(self, name: str) -> bool:
        """Whether there is such a body."""
        return name in self.starts

    def slice_of(self, name: str) -> slice:
        """Coordinates of one body."""
        start = int(self.starts[name])
        return slice(start, start + next(b.size for b in self.bodies if b.name == name))

    def rows(self, body: str, node: str) -> Array:
        """Motion (6, d) of a node."""
        out = np.zeros((6, self.size))
        out[:, self.slice_of(body)] = self.body(body).node(node)
        return out

    def housing_rows(self, support: SupportName, position: Array) -> Array:
        """Motion (6, d) of the housing where a support at ``position`` (3,) of its stage stands.

        Zero on rigid ground. An FE housing has a node of the support's name. A stage stands in it
        where its first support does; what a node is off from there is rigid.
        """
        if not self.has("housing"):
            return np.zeros((6, self.size))
        housing, node = self.body("housing"), "housing"
        place = position
        if not housing.rigid:
            node = support.place
            place = self._place_in_housing(housing, node, position)
        return rigid_rows(place, housing.position(node))[:6] @ self.rows("housing", node)

    def _place_in_housing(self, housing: Body, node: str, position: Array) -> Array:
        """Where in an FE housing a support stands, (3,) m. InputError where its node is not."""
        if node not in housing.node_names:
            raise InputError(
                self.source, "housing.fe_mesh_nodes", f"lacks {node}",
                "name the node on which that support stands so",
            )  # fmt: skip
        at = MemberName.parse(node)
        group = node if at.part in ("pinion", "gear") else at.stage  # gears beside each other
        node_position = housing.position(node)
        place = position + self.stands.setdefault(group, node_position - position)
        off, size = np.linalg.norm(place - node_position), np.ptp(housing.positions, axis=0).max()
        if off > MISPLACED * size:
            raise InputError(
                self.source, "housing.fe_mesh_nodes",
                f"{node} is {1e3 * off:.3g} mm from where the first support of its stage puts it",
                "check its place, the axes and the unit",
            )  # fmt: skip
        return np.asarray(place)

    def link(self, name: str, rows: Array, matrix: Array, kind: str = "") -> None:
        """A constant spring: matrix (6, 6) on the relative motion rows (6, d); see ``Link``."""
        matrix = np.asarray(matrix, dtype=float)
        if not matrix.any():
            return
        add_spring(self.stiffness, rows, matrix)
        self.links.append(Link(name, rows, matrix, kind))

    def contact_node(self, rows: Array, angle: int) -> int:
        """Number of a contact node whose frame has turned by the system's ``angle`` (−1: none)."""
        self.contact_nodes.append(rows)
        self.node_angles.append(angle)
        return len(self.contact_nodes) - 1

    def law_bearing(
        self, name: str, inner: Array, outer: Array, bearing: Bearing, angle: int = -1
    ) -> None:
        """What of a bearing has a law of its own: motion (6, d) of the nodes that its inner and
        outer ring stand on, all zero for ground. Nothing where it is linear.

        angle: of the system's by which the inner ring's frame has turned against the outer ring's;
        on ground, which looks the same from all sides, the law may act in the inner ring's.
        """
        bearing_law = own_law(bearing)
        if bearing_law is None:
            return
        to_z, moves = at_height(bearing.z), bool(outer.any())
        rows, other = to_z @ inner, to_z @ outer
        angle = angle if moves else -1
        end, other_end = self.contact_node(rows, angle), -1
        if moves:
            other_end = self.contact_node(other, -1)
        law, parameters = bearing_law
        self.bearings.append(
            LawBearing(name, rows, other, end, other_end, law, parameters, bearing.z, angle)
        )

    def bearing_rows(self) -> list[Array]:
        """Rows (d,) that bearings with a law of their own hold in the end."""
        return [row for b in self.bearings for row in b.relative[b.components]]

    def extra_rows(self, first_block: int, loads: Sequence[GivenLoad] = ()) -> ExtraRows:
        """Rows beside gear meshes, contact nodes being blocks from ``first_block`` on."""
        bearings = [
            BearingElement(
                b.law,
                (first_block + b.inner, first_block + b.outer if b.outer >= 0 else -1),
                (b.angle, -1),
                b.parameters,
            )
            for b in self.bearings
        ]
        return ExtraRows(self.support_rows, self.node_angles, first_block, bearings, loads)

    def rotating_frame_support(
        self, name: SupportName, key: str, ends: tuple[Array, Array], matrix: Array, angle: int
    ) -> None:
        """Support of a node in a turning frame on the housing, whose motions (6, d) are ``ends``;
        matrix in fixed axes; key: of the support in the case."""
        (rows, housing), matrix = ends, np.asarray(matrix, dtype=float)
        if np.abs(matrix[5]).max() > 0 or np.abs(matrix[:, 5]).max() > 0:
            raise InputError(
                self.source,
                key,
                "holds the rotation about the axis, so the train could not turn",
                "set the stiffness about z to zero",
            )
        mean = invariant_part(matrix)
        self.link(name, rows, mean)
        # what the constant spring to ground leaves out, on (turned node, housing)
        moves = bool(housing.any())
        rest = np.zeros((12, 12))
        rest[:6, :6] = matrix - mean
        if moves:
            rest[:6, 6:], rest[6:, :6], rest[6:, 6:] = -matrix, -matrix, matrix
        if np.abs(rest).max() <= 1e-9 * max(np.abs(matrix).max(), 1e-300):
            return
        self.rotating_frame_supports.append(
            RotatingFrameSupport(name, rows, housing, matrix, angle)
        )
        nodes = [self.contact_node(rows, angle)]
        if moves:
            nodes.append(self.contact_node(housing, -1))
        self._turning_rows(name, rest, nodes)

    def turning_link(
        self, name: str, first: Array, second: Array, matrix: Array, angle: int
    ) -> None:
        """A spring on the motion first − R(θ) second (6, d), θ being the system's ``angle``.

        A small share of it stays a constant spring on ``first``, as bearings with a law of their
        own keep one: what the spring holds is not loose without its turning rows.
        """
        add_spring(self.stiffness, first, CENTERING * matrix)
        ends = [self.contact_node(first, -1), self.contact_node(second, angle)]
        for value, vector in zip(*rotating_rows((1.0 - CENTERING) * matrix), strict=True):
            self.support_rows.append((float(value), [(ends[0], vector), (ends[1], -vector)]))
            self.support_names.append(name)
        self.rotating_frame_supports.append(
            RotatingFrameSupport(name, first, second, matrix, -1, angle)
        )

    def joint(
        self, name: str, first: Array, second: Array, matrix: Array, angles: tuple[int, int]
    ) -> None:
        """A spring between two coaxial nodes whose frames may turn against each other.

        first, second (6, d); matrix (12, 12) on both motions in fixed axes; angles: by which of
        the system's angles each frame has turned, −1 for fixed axes. The part that does not
        depend on the angles (axial, torsion, what each end does to itself) is constant.
        """
        both = np.vstack([first, second])
        if angles[0] == angles[1]:
            add_spring(self.stiffness, both, matrix)
            self.links.append(Link(name, both, matrix))
            return
        mean, rest = joint_parts(matrix)
        add_spring(self.stiffness, both, mean)
        self.links.append(Link(name, both, mean))
        if np.abs(rest).max() <= 1e-12 * np.abs(matrix).max():
            return
        ends = [self.contact_node(first, angles[0]), self.contact_node(second, angles[1])]
        self._turning_rows(name, rest, ends)

    def _turning_rows(self, name: str, rest: Array, nodes: Sequence[int]) -> None:
        for value, vector in zip(*rotating_rows(rest), strict=True):
            ends = [(n, vector[6 * k : 6 * k + 6]) for k, n in enumerate(nodes)]
            self.support_rows.append((float(value), ends))
            self.support_names.append(name)

    def rotation(self, body: str) -> Array:
        """Coordinates (d,) of a unit rotation of one body about the axis of its frame."""
        out = np.zeros(self.size)
        out[self.slice_of(body)] = self.body(body).spin
        return out

    def weight_rows(self, body: str) -> Array:
        """Rows (6, d) on which an acceleration a acts as the body's weight: forces Rᵀ M a.

        R (size, 3): unit translations of the whole body; the mass is the body's own, without what
        hangs on its ports. Rows of rotations are zero.
        """
        b, out = self.body(body), np.zeros((6, self.size))
        out[:3, self.slice_of(body)] = (b.mass @ b.rigid_motions[:, :3]).T
        return out

    def add_inertia(self, row: Array, inertia: float) -> None:
        """Polar inertia (kg m²) on the rotation that row (d,) gives.

        A row that is the mean of n bodies' rotations (halves of a ring) puts 1/n on each, so that
        mass never couples bodies.
        """
        dofs = [s for s in map(self.slice_of, (b.name for b in self.bodies)) if row[s].any()]
        for at in dofs:
            self.mass[at, at] += inertia * len(dofs) * np.outer(row[at], row[at])

    def loose_motions(self) -> Array:
        """Motions (d, r) of bodies as rigid ones that no constant spring resists.

        In the space of the rigid motions of all bodies, the eigenvalues of (K, M) that vanish are
        looked for.
        """
        columns = []
        for b in self.bodies:
            motions = b.rigid_motions[:, b.rigid_motions.any(axis=0)]
            part = np.zeros((self.size, motions.shape[1]))
            part[self.slice_of(b.name)] = motions
            columns.append(part)
        candidates = np.hstack(columns)
        mass = candidates.T @ self.mass @ candidates
        stiffness = candidates.T @ self.stiffness @ candidates
        values, vectors = linalg.eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
        loose = values < LOOSE * max(values[-1], 1e-300)
        return np.asarray(candidates @ vectors[:, loose])


@dataclass
class TrainAssembly:
    """What grows while a train is put together.

    members: stage by stage; bending: see ``stage_sets``; blocks: nodes (6, d) of gear meshes;
    block_of: by body the block of its gear, or of its first tooth.
    """

    case: Case
    flow: PowerFlow
    a: Assembly
    members: list[list[Member]]
    bending: bool = True
    frames: list[StageFrame] = field(default_factory=list)
    angles: list[Array] = field(default_factory=list)
    blocks: list[Array] = field(default_factory=list)
    block_of: dict[str, int] = field(default_factory=dict)
    sets: list[GearMeshSet] = field(default_factory=list)

    def angle(self, row: Array) -> int:
        """Number of an angle, entered if it is new."""
        for k, angle_row in enumerate(self.angles):
            if np.array_equal(angle_row, row):
                return k
        self.angles.append(row)
        return len(self.angles) - 1

    def body_angle(self, stage: int, m: Member) -> int:
        """By which angle a body's frame has turned, −1 where it stands."""
        return int(getattr(self.frames[stage], m.frame))

    @cached_property
    def member_of(self) -> dict[str, Member]:
        """Members of the train by the names of their bodies."""
        return {m.body.name: m for members in self.members for m in members}

    def bodies_of(self, member: str) -> list[Member]:
        """All bodies of a member, in the order of the stage."""
        at = MemberName.parse(member)
        members = self.members[self.case.stage_index(member)]
        return [m for m in members if m.part == at.part]

    def rows(self, body: str, port: str) -> Array:
        """Motion (6, d) of a port in its axes."""
        p = self.member_of[body].port(port)
        rows = self.a.rows(body, p.node)
        rows = turn(p.axes) @ rows if p.axes else rows
        return rigid_rows(np.array([p.arm, 0.0, 0.0])) @ rows if p.arm else rows

    def place(self, body: str, port: str) -> Array:
        """Position (3,) of a port's node in its body's frame, m."""
        return self.a.body(body).position(self.member_of[body].port(port).node)


def connect(b: TrainAssembly, stage: int, c: Connection) -> None:
    """Enter a spring between two bodies, or of one on the housing."""
    first, angle = b.rows(*c.first), int(getattr(b.frames[stage], c.frame)) if c.frame else -1
    if c.second is not None:
        second = b.rows(*c.second)
        if b.member_of[c.second[0]].port(c.second[1]).floats:
            apart, planets = first - b.rows(c.second[0], "gear"), b.frames[stage].planets
            b.a.turning_link(c.name, apart, second, c.matrix, planets)
            if c.bearing is not None:
                b.a.law_bearing(c.name, second, apart, c.bearing, planets)
            return
        if c.reaches:
            second = rigid_rows(b.place(*c.first), b.place(*c.second)) @ second
        b.a.link(c.name, turn(c.axes).T @ (first - second), c.matrix, c.kind)
        if c.bearing is not None:
            b.a.law_bearing(c.name, second, first, c.bearing)
        return
    if np.any(c.matrix):
        housing = b.a.housing_rows(c.name, b.place(*c.first))
        if angle >= 0:
            b.a.rotating_frame_support(c.name, c.key, (first, housing), c.matrix, angle)
        else:
            b.a.link(c.name, turn(c.axes).T @ (first - housing), c.matrix, c.kind)
    if c.bearing is not None and own_law(c.bearing) is not None:
        housing = b.a.housing_rows(c.name, b.place(*c.first))
        b.a.law_bearing(c.name, first, housing, c.bearing, angle)


def ends_of(b: TrainAssembly, member: str) -> list[BodyName]:
    """Bodies with which a member meets the rest of the train, with equal shares: the hub of an FE
    ring that turns, both halves of a double-helical ring; none of an FE ring that is held."""
    return [m.body.name for m in b.bodies_of(member) if "end" in m.ports]


def end_rows(b: TrainAssembly, member: str) -> Array:
    """Motion (6, d) of a member where it meets the rest of the train, in its stage's axes; zero of
    a held FE ring."""
    ends, rows = ends_of(b, member), np.zeros((6, b.a.size))
    for end in ends:
        rows += b.rows(end, "end") / len(ends)
    return rows


def rotation(b: TrainAssembly, member: str) -> Array:
    """Row (d,) of the rotation of a member; zero where it is held fast."""
    return np.asarray(end_rows(b, member)[5])


def speed_row(b: TrainAssembly, member: str) -> Array:
    """Row (d,) of the rotation that stands for a member's speed: pins of an FE carrier."""
    frame = b.frames[b.case.stage_index(member)]
    if MemberName.parse(member).part == "carrier" and frame.carrier >= 0:
        return b.angles[frame.carrier]
    return rotation(b, member)
