"""Assembly of a train: matrices of its bodies, springs, contact nodes and angles."""

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy import linalg
from scipy.sparse.csgraph import connected_components

from flexgear.arrays import Array
from flexgear.coupling.connections import Connection
from flexgear.coupling.gear_meshes import GearMeshSet, StageFrame, SupportRow
from flexgear.coupling.laws.dampers import DAMPERS
from flexgear.coupling.laws.law import CENTERING
from flexgear.coupling.laws.rollers import ROLLERS, RaceRates, with_defects
from flexgear.coupling.members import Member
from flexgear.coupling.springs import (
    LawBearing,
    add_spring,
    invariant_part,
    joint_parts,
    laws_of,
    rotating_rows,
)
from flexgear.coupling.system import BodyCoordinates, Link, RotatingFrameSupport
from flexgear.gears.bearings.reference_life import dynamic_viscosity
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.bearings import at_height
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName, MemberName, SupportName
from flexgear.model.section import Refusal
from flexgear.model.stage import PARALLEL
from flexgear.structures.bodies import Body, rigid_rows, turn

LARGEST_OFFSET = 0.05  # of a housing node from its support, over the size of the FE housing
FREE = 1e-12  # eigenvalue over the largest, below which no spring resists the motion


class Assembly(BodyCoordinates):
    """Mutable data of a train from which a ``System`` is made.

    members: stage by stage; blocks: motions (6, d) of the nodes of gear meshes; block_of: block of
    a body's gear, or of its first tooth, by name of the body. Contact nodes are the nodes of
    supports between rotating frames, of nonlinear bearings and of loads; their rows follow the
    blocks of gear meshes in the system.
    """

    def __init__(
        self, case: Case, flow: PowerFlow, members: list[list[Member]], housing: Body | None
    ) -> None:
        self.case, self.flow, self.members, self.housing = case, flow, members, housing
        self.bodies = [m.body for stage_members in members for m in stage_members]
        self.bodies += [] if housing is None else [housing]
        self.mass = linalg.block_diag(*(b.mass for b in self.bodies))
        self.stiffness = linalg.block_diag(*(b.stiffness for b in self.bodies))
        self.frames: list[StageFrame] = []
        self.angles: list[Array] = []
        self.blocks: list[Array] = []
        self.block_of: dict[str, int] = {}
        self.sets: list[GearMeshSet] = []
        self.links: list[Link] = []
        self.rotating_frame_supports: list[RotatingFrameSupport] = []
        self.bearings: list[LawBearing] = []
        self.contact_nodes: list[Array] = []
        self.node_angles: list[int] = []
        self.stage_offsets: dict[str, Array] = {}  # position of stages in an FE housing, m
        self.support_rows: list[SupportRow] = []

    @cached_property
    def viscosity(self) -> float | None:
        """Dynamic viscosity of the lubricant, Pa·s; None if unknown."""
        return dynamic_viscosity(self.case.lubricant)

    def angle(self, row: Array) -> int:
        """Index of the angle that row (d,) gives; a new row is appended."""
        for k, angle_row in enumerate(self.angles):
            if np.array_equal(angle_row, row):
                return k
        self.angles.append(row)
        return len(self.angles) - 1

    def body_angle(self, stage: int, m: Member) -> int:
        """Index of the rotation angle of a body's frame, −1 for a fixed frame."""
        return int(getattr(self.frames[stage], m.frame))

    @cached_property
    def member_of(self) -> dict[str, Member]:
        """Members by name of the body."""
        return {m.body.name: m for members in self.members for m in members}

    def bodies_of(self, member: str) -> list[Member]:
        """All bodies of the member of a name, in the order of the stage."""
        part = MemberName.parse(member).part
        return [m for m in self.members[self.case.stage_index(member)] if m.part == part]

    def rows(self, body: str, port: str) -> Array:
        """Rows (6, d) of the motion of a port in its axes."""
        p = self.member_of[body].port(port)
        rows = self.node_rows(body, p.node)
        rows = turn(p.axes) @ rows if p.axes else rows
        return rigid_rows(np.array([p.arm, 0.0, p.rise])) @ rows if p.arm or p.rise else rows

    def place(self, body: str, port: str) -> Array:
        """Position (3,) of a port in its body's frame, without its arm, m."""
        p = self.member_of[body].port(port)
        return self.body(body).position(p.node) + np.array([0.0, 0.0, p.rise])

    def ends_of(self, member: str) -> list[BodyName]:
        """Bodies that connect a member to the rest of the train, with equal shares: the hub of a
        rotating FE ring, both halves of a double-helical ring; none of a held FE ring."""
        return [m.body.name for m in self.bodies_of(member) if "end" in m.ports]

    def end_rows(self, member: str) -> Array:
        """Rows (6, d) of the motion of a member at its connection to the rest of the train, in the
        axes of its stage; zero for a held FE ring."""
        ends, rows = self.ends_of(member), np.zeros((6, self.size))
        for end in ends:
            rows += self.rows(end, "end") / len(ends)
        return rows

    def rotation(self, member: str) -> Array:
        """Row (d,) of the rotation of a member; zero if it is held."""
        return np.asarray(self.end_rows(member)[5])

    def speed_row(self, member: str) -> Array:
        """Row (d,) of the rotation that counts as speed of a member; of an FE carrier the mean
        rotation of its pins."""
        frame = self.frames[self.case.stage_index(member)]
        if MemberName.parse(member).part == "carrier" and frame.carrier >= 0:
            return self.angles[frame.carrier]
        return self.rotation(member)

    def connect(self, stage: int, c: Connection) -> None:
        """Add a spring between two bodies, or between a body and the housing."""
        first, frame = self.rows(*c.first), self.frames[stage]
        angle = int(getattr(frame, c.frame)) if c.frame else -1
        if c.second is not None:
            second = self.rows(*c.second)
            if self.member_of[c.second[0]].port(c.second[1]).floats:
                relative = first - self.rows(c.second[0], "gear")
                self._turning_link(c, relative, second, frame.planets)
                self._law_bearing(stage, c, second, relative, frame.planets)
                return
            if c.reaches:
                second = rigid_rows(self.place(*c.first), self.place(*c.second)) @ second
            self.link(c.name, turn(c.axes).T @ (first - second), c.matrix, c.kind)
            self._law_bearing(stage, c, second, first)
            return
        has_law = c.bearing is not None and bool(laws_of(c.bearing))
        if not (np.any(c.matrix) or has_law):
            return
        housing = self._housing_rows(c.name, self.place(*c.first), c.bearing.z if c.bearing else 0)
        if angle >= 0:
            self._rotating_frame_support(c, first, housing, angle)
        else:
            self.link(c.name, turn(c.axes).T @ (first - housing), c.matrix, c.kind)
        self._law_bearing(stage, c, first, housing, angle)

    def _housing_rows(self, support: SupportName, position: Array, z: float) -> Array:
        """Rows (6, d) of the motion of the housing at ``position`` (3,) of a stage, for a support
        at the distance z along the axis from there, m.

        Zero on rigid ground. An FE housing has a node with the name of the support; the first
        support of a stage fixes the position of the stage, and offsets of other nodes are rigid.
        """
        if self.housing is None:
            return np.zeros((6, self.size))
        node, place = "housing", position
        if not self.housing.rigid:
            node = support.place
            offset = np.array([0.0, 0.0, z])
            place = self._place_in_housing(self.housing, node, position + offset) - offset
        rows = self.node_rows("housing", node)
        return rigid_rows(place, self.housing.position(node))[:6] @ rows

    def _place_in_housing(self, housing: Body, node: str, position: Array) -> Array:
        """Position (3,) of a support in an FE housing, m. Raises InputError if the housing has no
        node ``node``, or has it far from there."""
        if node not in housing.node_names:
            remedy = "give this name to the node of that support"
            raise InputError(self.case.source, "housing.fe_mesh_nodes", f"lacks {node}", remedy)
        at = MemberName.parse(node)
        gear = next((gear for gear in PARALLEL if at.part.startswith(gear)), "")
        # pinion and gear have separate axes, members of a planetary stage one axis
        group = f"{at.stage}.{gear}" if gear else at.stage
        node_position = housing.position(node)
        place = position + self.stage_offsets.setdefault(group, node_position - position)
        off, size = np.linalg.norm(place - node_position), np.ptp(housing.positions, axis=0).max()
        if off > LARGEST_OFFSET * size:
            raise InputError(
                self.case.source, "housing.fe_mesh_nodes",
                f"{node} is {1e3 * off:.3g} mm from where the first support of its stage puts it",
                "check its position, the axes and the unit",
            )  # fmt: skip
        return np.asarray(place)

    def link(self, name: str, rows: Array, matrix: Array, kind: str = "") -> None:
        """Add a constant spring, matrix (m, m), on relative motion rows (m, d); see ``Link``."""
        if matrix.any():
            add_spring(self.stiffness, rows, matrix)
            self.links.append(Link(name, rows, matrix, kind))

    def contact_node(self, rows: Array, angle: int) -> int:
        """Add a contact node with motion rows (6, d); returns its index. angle: index of the angle
        by which its frame turns, −1: none."""
        self.contact_nodes.append(rows)
        self.node_angles.append(angle)
        return len(self.contact_nodes) - 1

    def _law_bearing(
        self, stage: int, c: Connection, inner: Array, outer: Array, angle: int = -1
    ) -> None:
        """Add the nonlinear part of a bearing, if it has one.

        inner, outer: motions (6, d) of the nodes of inner and outer ring, zero for ground; angle:
        index of the angle of the inner ring's frame relative to that of the outer ring. On ground,
        where laws without defects are isotropic, these act in the inner ring's frame.
        """
        if c.bearing is None:
            return
        try:
            laws = laws_of(c.bearing, self.viscosity)
        except Refusal as fault:
            key = f"{c.key}.{fault.key}"
            raise InputError(self.case.source, key, fault.problem, fault.remedy) from None
        if not laws:
            return
        to_z, moves = at_height(c.bearing.z), bool(outer.any())
        rows, outer_rows = to_z @ inner, to_z @ outer
        angle = angle if moves or c.defects else -1
        node = self.contact_node(rows, angle)
        outer_node = self.contact_node(outer_rows, -1) if moves else -1
        for name, parameters in laws:
            bearing = LawBearing(
                c.name, rows, outer_rows, node, outer_node, name, parameters, c.bearing.z, angle
            )
            elements = c.bearing.elements
            if name == ROLLERS.name and c.defects and elements is not None:
                turned, rates = self._race_rates(stage, c, inner)
                with_passing = with_defects(parameters, elements, rates, c.defects)
                bearing = replace(bearing, parameters=with_passing, turned=turned)
            self.bearings.append(bearing)

    def _race_rates(self, stage: int, c: Connection, inner: Array) -> tuple[int, RaceRates]:
        """Index of the angle with which a race of a bearing turns, and the rates of both.

        In the axes of the law, those of the carrier, the outer race of a planet bearing turns, and
        in those of the housing the inner race of any other, with motion ``inner`` (6, d). The law's
        motion is that of the planet relative to the pin, so that rollers on the side of the pin
        towards +x are at ψ = π.
        """
        if c.kind == "planet_bearing":
            return self.frames[stage].planets, RaceRates(0.0, 1.0, load_zone=math.pi)
        return self.angle(inner[5]), RaceRates(1.0, 0.0)

    def damper(self, name: str, row: Array, other: Array, damping: float) -> None:
        """Add a damper, N m s/rad, between two rotations (d,); other: zero for ground."""
        if damping == 0.0:
            return
        first, second = (np.vstack([np.zeros((5, self.size)), r]) for r in (row, other))
        node = self.contact_node(first, -1)
        other_node = self.contact_node(second, -1) if second.any() else -1
        parameters = np.r_[np.zeros(5), damping]
        self.bearings.append(
            LawBearing(name, first, second, node, other_node, DAMPERS.name, parameters)
        )

    def _rotating_frame_support(
        self, c: Connection, rows: Array, housing: Array, angle: int
    ) -> None:
        """Add a support of a node in a rotating frame on the housing, with motions (6, d) of both;
        its matrix acts in fixed axes."""
        if np.abs(c.matrix[5]).max() > 0 or np.abs(c.matrix[:, 5]).max() > 0:
            problem = "holds the rotation about the axis, so the train could not turn"
            raise InputError(self.case.source, c.key, problem, "set the stiffness about z to zero")
        mean = invariant_part(c.matrix)
        self.link(c.name, rows, mean)
        # remainder of the stiffness on (rotating node, housing) without the constant spring
        moves = bool(housing.any())
        remainder = np.zeros((12, 12))
        remainder[:6, :6] = c.matrix - mean
        if moves:
            remainder[:6, 6:], remainder[6:, :6] = -c.matrix, -c.matrix
            remainder[6:, 6:] = c.matrix
        if np.abs(remainder).max() <= 1e-9 * max(np.abs(c.matrix).max(), 1e-300):
            return
        self.rotating_frame_supports.append(
            RotatingFrameSupport(c.name, rows, housing, c.matrix, angle)
        )
        ends = self.contact_node(rows, angle), self.contact_node(housing, -1) if moves else -1
        self._support_rows(c.name, *rotating_rows(remainder), ends)

    def _turning_link(self, c: Connection, first: Array, second: Array, angle: int) -> None:
        """Add a spring K on the motion first − R(θ) second (6, d), θ being the angle of that index
        and ``second`` elastic motion.

        A small share c of K is a constant spring on ``first``, as the body has no other constant
        support; rows take (1 − c) K of first − R second/(1 − c). So both together act on ``first``
        with K (first − R second), and stiffen only the elastic body, by c K.
        """
        centering = CENTERING * (c.matrix if c.bearing is None else c.bearing.matrix)
        add_spring(self.stiffness, first, centering)
        ends = self.contact_node(first, -1), self.contact_node(second, angle)
        stiffness, vectors = rotating_rows(c.matrix - centering)
        vectors = np.hstack([vectors, -vectors / (1.0 - CENTERING)])
        self._support_rows(c.name, stiffness, vectors, ends)
        self.rotating_frame_supports.append(
            RotatingFrameSupport(c.name, first, second, c.matrix, -1, angle)
        )

    def joint(
        self, name: str, first: Array, second: Array, matrix: Array, angles: tuple[int, int]
    ) -> None:
        """Add a spring between two coaxial nodes whose frames may rotate relative to each other.

        first, second (6, d); matrix (12, 12) on both motions in fixed axes; angles: indices of the
        angles of both frames, −1 for fixed axes. The part that does not depend on the angles
        (``joint_parts``) is constant.
        """
        if angles[0] == angles[1]:
            self.link(name, np.vstack([first, second]), matrix)
            return
        mean, remainder = joint_parts(matrix)
        self.link(name, np.vstack([first, second]), mean)
        if np.abs(remainder).max() > 1e-12 * np.abs(matrix).max():
            ends = self.contact_node(first, angles[0]), self.contact_node(second, angles[1])
            self._support_rows(name, *rotating_rows(remainder), ends)

    def _support_rows(
        self, name: str, stiffness: Array, vectors: Array, ends: tuple[int, int]
    ) -> None:
        """Add rows of stiffness (m,) with vectors (m, 12) on both ends."""
        for value, vector in zip(stiffness, vectors, strict=True):
            self.support_rows.append(SupportRow(name, float(value), ends, vector.reshape(2, 6)))

    def add_inertia(self, row: Array, inertia: float) -> None:
        """Add a polar inertia, kg m², on the rotation that row (d,) gives. If the row is the mean
        rotation of n bodies (halves of a ring) each has 1/n of the inertia, so that mass does not
        couple bodies."""
        slices = [s for s in map(self.slice_of, (b.name for b in self.bodies)) if row[s].any()]
        for s in slices:
            self.mass[s, s] += inertia * len(slices) * np.outer(row[s], row[s])

    def loose_motions(self) -> Array:
        """Combinations (d, r) of rigid motions of all bodies that no constant spring resists, exact
        zeros where springs and masses do not couple the bodies."""
        motions = [b.rigid_motions[:, b.rigid_motions.any(axis=0)] for b in self.bodies]
        candidates = linalg.block_diag(*motions)
        mass = candidates.T @ self.mass @ candidates
        stiffness = candidates.T @ self.stiffness @ candidates
        _, part = connected_components((mass != 0.0) | (stiffness != 0.0), directed=False)
        values, vectors = np.zeros(len(mass)), np.zeros_like(mass)
        for number in range(part.max() + 1):
            at = np.flatnonzero(part == number)
            k, m = stiffness[np.ix_(at, at)], mass[np.ix_(at, at)]
            values[at], vectors[np.ix_(at, at)] = linalg.eigh(0.5 * (k + k.T), 0.5 * (m + m.T))
        return np.asarray(candidates @ vectors[:, values < FREE * max(values.max(), 1e-300)])
