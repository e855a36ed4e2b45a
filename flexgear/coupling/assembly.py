"""A train while it is put together: its bodies, springs, contact nodes and angles."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy import linalg

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

MISPLACED = 0.05  # of the size of an FE housing, by which a node may be off its support
LOOSE = 1e-12  # of the largest eigenvalue, below which a motion counts as not resisted


class Assembly(BodyCoordinates):
    """Matrices of the bodies, to which springs are added, and what else makes a ``System``.

    members: stage by stage; blocks: nodes (6, d) of gear meshes; block_of: by body the block of its
    gear, or of its first tooth. Nodes of supports that turn against their frame, of bearings with
    clearance and of loads are contact nodes: their rows become blocks of the system behind those of
    the gear meshes.
    """

    def __init__(
        self, case: Case, flow: PowerFlow, members: list[list[Member]], housing: Body | None
    ) -> None:
        self.case, self.flow, self.members, self.housing = case, flow, members, housing
        self.bodies = [m.body for of_stage in members for m in of_stage]
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
        self.stands: dict[str, Array] = {}  # of a stage in an FE housing, m
        self.support_rows: list[SupportRow] = []

    @cached_property
    def viscosity(self) -> float | None:
        """Dynamic viscosity of the lubricant in contacts, Pa·s; None where it is not stated."""
        return dynamic_viscosity(self.case.lubricant)

    def angle(self, row: Array) -> int:
        """Number of an angle, entered if it is new."""
        for k, angle_row in enumerate(self.angles):
            if np.array_equal(angle_row, row):
                return k
        self.angles.append(row)
        return len(self.angles) - 1

    def body_angle(self, stage: int, m: Member) -> int:
        """Index of the angle by which a body's frame has turned, −1 for a fixed frame."""
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
        rows = self.node_rows(body, p.node)
        rows = turn(p.axes) @ rows if p.axes else rows
        return rigid_rows(np.array([p.arm, 0.0, p.rise])) @ rows if p.arm or p.rise else rows

    def place(self, body: str, port: str) -> Array:
        """Position (3,) of a port in its body's frame, without its arm, m."""
        p = self.member_of[body].port(port)
        return self.body(body).position(p.node) + np.array([0.0, 0.0, p.rise])

    def ends_of(self, member: str) -> list[BodyName]:
        """Bodies with which a member meets the rest of the train, with equal shares: the hub of an
        FE ring that turns, both halves of a double-helical ring; none of an FE ring that is held.
        """
        return [m.body.name for m in self.bodies_of(member) if "end" in m.ports]

    def end_rows(self, member: str) -> Array:
        """Motion (6, d) of a member where it meets the rest of the train, in its stage's axes; zero
        of a held FE ring."""
        ends, rows = self.ends_of(member), np.zeros((6, self.size))
        for end in ends:
            rows += self.rows(end, "end") / len(ends)
        return rows

    def rotation(self, member: str) -> Array:
        """Row (d,) of the rotation of a member; zero where it is held fast."""
        return np.asarray(self.end_rows(member)[5])

    def speed_row(self, member: str) -> Array:
        """Row (d,) of the rotation that represents a member's speed: that of the pins for an FE
        carrier."""
        frame = self.frames[self.case.stage_index(member)]
        if MemberName.parse(member).part == "carrier" and frame.carrier >= 0:
            return self.angles[frame.carrier]
        return self.rotation(member)

    def connect(self, stage: int, c: Connection) -> None:
        """Enter a spring between two bodies, or of one on the housing."""
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
        """Motion (6, d) of the housing at ``position`` (3,) of a stage, for a support that stands
        at z from there, m.

        Zero on rigid ground. An FE housing has a node of the support's name. A stage stands in it
        where its first support does; what a node is off from there is rigid.
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
        """Where in an FE housing a support stands, (3,) m. InputError where its node is not."""
        if node not in housing.node_names:
            raise InputError(
                self.case.source, "housing.fe_mesh_nodes", f"lacks {node}",
                "name the node on which that support stands so",
            )  # fmt: skip
        at = MemberName.parse(node)
        gear = next((gear for gear in PARALLEL if at.part.startswith(gear)), "")
        group = f"{at.stage}.{gear}" if gear else at.stage  # whose gears are side by side
        node_position = housing.position(node)
        place = position + self.stands.setdefault(group, node_position - position)
        off, size = np.linalg.norm(place - node_position), np.ptp(housing.positions, axis=0).max()
        if off > MISPLACED * size:
            raise InputError(
                self.case.source, "housing.fe_mesh_nodes",
                f"{node} is {1e3 * off:.3g} mm from where the first support of its stage puts it",
                "check its place, the axes and the unit",
            )  # fmt: skip
        return np.asarray(place)

    def link(self, name: str, rows: Array, matrix: Array, kind: str = "") -> None:
        """A constant spring: matrix (m, m) on the relative motion rows (m, d); see ``Link``."""
        if matrix.any():
            add_spring(self.stiffness, rows, matrix)
            self.links.append(Link(name, rows, matrix, kind))

    def contact_node(self, rows: Array, angle: int) -> int:
        """Number of a contact node whose frame has turned by the system's ``angle`` (−1: none)."""
        self.contact_nodes.append(rows)
        self.node_angles.append(angle)
        return len(self.contact_nodes) - 1

    def _law_bearing(
        self, stage: int, c: Connection, inner: Array, outer: Array, angle: int = -1
    ) -> None:
        """Add the nonlinear part of a bearing; nothing for a linear one. inner, outer: motion (6,
        d) of the nodes of its inner and outer ring, zero for ground. angle: index of the system's
        angle by which the inner ring's frame has turned against the outer ring's; on ground, which
        is isotropic, the law may act in the inner ring's frame."""
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
        rows, other = to_z @ inner, to_z @ outer
        angle = angle if moves else -1
        end = self.contact_node(rows, angle)
        other_end = self.contact_node(other, -1) if moves else -1
        ends = (rows, other, end, other_end)
        for name, parameters in laws:
            bearing = LawBearing(c.name, *ends, name, parameters, c.bearing.z, angle)
            elements = c.bearing.elements
            if name == ROLLERS.name and c.defects and elements is not None:
                turned, rates = self._race_rates(stage, c, moves)
                passing = with_defects(parameters, elements, rates, c.defects)
                bearing = replace(bearing, parameters=passing, turned=turned)
            self.bearings.append(bearing)

    def _race_rates(self, stage: int, c: Connection, housing_moves: bool) -> tuple[int, RaceRates]:
        """Index of the system's angle by which the races of a bearing turn against the axes of its
        law, and their rates: of a planet's bearing the outer race turns in the carrier's axes; of a
        carrier's, whose inner race turns, the outer one in the carrier's axes, the inner one in
        those of a moving housing.

        The law's motion is that of the planet less the pin, towards which the pin's rollers lie.
        """
        frame = self.frames[stage]
        if c.kind == "planet_bearing":
            return frame.planets, RaceRates(0.0, 1.0, load_zone=math.pi)
        return frame.carrier, RaceRates(1.0, 0.0) if housing_moves else RaceRates(0.0, -1.0)

    def damper(self, name: str, row: Array, other: Array, damping: float) -> None:
        """A damper, N m s/rad, between two rotations (d,); other: zero for ground."""
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
        """Support of a node in a turning frame on the housing, whose motions (6, d) are given; its
        matrix acts in fixed axes."""
        if np.abs(c.matrix[5]).max() > 0 or np.abs(c.matrix[:, 5]).max() > 0:
            raise InputError(
                self.case.source, c.key,
                "holds the rotation about the axis, so the train could not turn",
                "set the stiffness about z to zero",
            )  # fmt: skip
        mean = invariant_part(c.matrix)
        self.link(c.name, rows, mean)
        # what the constant spring to ground leaves out, on (turned node, housing)
        moves = bool(housing.any())
        rest = np.zeros((12, 12))
        rest[:6, :6] = c.matrix - mean
        if moves:
            rest[:6, 6:], rest[6:, :6], rest[6:, 6:] = -c.matrix, -c.matrix, c.matrix
        if np.abs(rest).max() <= 1e-9 * max(np.abs(c.matrix).max(), 1e-300):
            return
        self.rotating_frame_supports.append(
            RotatingFrameSupport(c.name, rows, housing, c.matrix, angle)
        )
        ends = self.contact_node(rows, angle), self.contact_node(housing, -1) if moves else -1
        self._support_rows(c.name, *rotating_rows(rest), ends)

    def _turning_link(self, c: Connection, first: Array, second: Array, angle: int) -> None:
        """A spring on the motion first − R(θ) second (6, d), θ being the system's ``angle``.

        A small share of the bearing's stiffness stays a constant spring on ``first``: without its
        turning rows, and the rows of a law of its own, the body would be loose.
        """
        centering = CENTERING * (c.matrix if c.bearing is None else c.bearing.matrix)
        add_spring(self.stiffness, first, centering)
        ends = self.contact_node(first, -1), self.contact_node(second, angle)
        stiffness, vectors = rotating_rows(c.matrix - centering)
        self._support_rows(c.name, stiffness, np.hstack([vectors, -vectors]), ends)
        self.rotating_frame_supports.append(
            RotatingFrameSupport(c.name, first, second, c.matrix, -1, angle)
        )

    def joint(
        self, name: str, first: Array, second: Array, matrix: Array, angles: tuple[int, int]
    ) -> None:
        """A spring between two coaxial nodes whose frames may turn against each other.

        first, second (6, d); matrix (12, 12) on both motions in fixed axes; angles: by which of
        the system's angles each frame has turned, −1 for fixed axes. The part that does not
        depend on the angles (axial, torsion, what each end does to itself) is constant.
        """
        mean, rest = joint_parts(matrix) if angles[0] != angles[1] else (matrix, np.zeros(1))
        self.link(name, np.vstack([first, second]), mean)
        if np.abs(rest).max() > 1e-12 * np.abs(matrix).max():
            ends = self.contact_node(first, angles[0]), self.contact_node(second, angles[1])
            self._support_rows(name, *rotating_rows(rest), ends)

    def _support_rows(
        self, name: str, stiffness: Array, vectors: Array, ends: tuple[int, int]
    ) -> None:
        """Rows of stiffness (m,) and vectors (m, 12) on both ends."""
        for value, vector in zip(stiffness, vectors, strict=True):
            self.support_rows.append(SupportRow(name, float(value), ends, vector.reshape(2, 6)))

    def add_inertia(self, row: Array, inertia: float) -> None:
        """Polar inertia (kg m²) on the rotation that row (d,) gives.

        A row that is the mean of n bodies' rotations (halves of a ring) puts 1/n on each, so that
        mass never couples bodies.
        """
        dofs = [s for s in map(self.slice_of, (b.name for b in self.bodies)) if row[s].any()]
        for at in dofs:
            self.mass[at, at] += inertia * len(dofs) * np.outer(row[at], row[at])

    def loose_motions(self) -> Array:
        """Rigid motions (d, r) of bodies that no constant spring resists: the null space of (K, M)
        in the space of the rigid motions of all bodies."""
        motions = [b.rigid_motions[:, b.rigid_motions.any(axis=0)] for b in self.bodies]
        candidates = linalg.block_diag(*motions)
        mass = candidates.T @ self.mass @ candidates
        stiffness = candidates.T @ self.stiffness @ candidates
        values, vectors = linalg.eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
        loose = values < LOOSE * max(values[-1], 1e-300)
        return np.asarray(candidates @ vectors[:, loose])
