"""A case: stages of lumped members, FE bodies and shafts, their joints, ports and loads, in SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

from flexgear.model.bearings import Lubricant
from flexgear.model.bodies import FeMeshSource, Housing, Material, Shaft
from flexgear.model.content import content_hash, digest_files
from flexgear.model.errors import InputError, echo
from flexgear.model.faults import Fault, check_faults, require_rollers
from flexgear.model.gear_mesh import Damping
from flexgear.model.load_cases import LoadCase, LoadSeries, Spectrum, check_load_cases
from flexgear.model.machine import TorqueHistory, check_machines
from flexgear.model.member import CarrierMember, GearMember, Kinematics
from flexgear.model.names import BodyName, Member, MemberName
from flexgear.model.rating import Rating, check_rating
from flexgear.model.read import Written, changed, is_place, nearest, numbered, of_only_stage
from flexgear.model.section import Missing, Refusal, Section, raw_value
from flexgear.model.sensor import Recorder, Sensor, check_sensors
from flexgear.model.solver import Solver
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView
from flexgear.model.tolerance import Tolerance, check_tolerance
from flexgear.model.train import Input, Joint, MemberLoad, Output
from flexgear.model.units import Acceleration
from flexgear.model.upgrade import refuse_earlier_key
from flexgear.model.validation_errors import input_error

_LONGEST = 100  # characters; a file name holds 255 bytes


def check_case_name(name: str) -> None:
    """Refusal of a name that can be no part of a file name, or would lead elsewhere."""
    bad = not name.isprintable() or any(sign in name for sign in '/\\:*?"<>|')
    if bad or name != name.strip(" .") or not 0 < len(name) <= _LONGEST:
        raise Refusal(
            "name",
            f"{echo(name)} cannot name a file of results",
            f'give name = "…" of letters, digits, hyphens, at most {_LONGEST} of them',
        )


def check_case(case: Case) -> None:
    """Names, ports and supports fit one another; Refusal otherwise."""
    _check_stage_names(case)
    _check_members(case)
    _check_ports(case)
    _check_held(case)
    check_machines(case)
    check_load_cases(case)
    check_rating(case)
    check_faults(case)
    _check_behind_shafts(case)
    _check_hubs(case)
    check_sensors(case)


def _check_stage_names(case: Case) -> None:
    seen: dict[str, int] = {}
    for k, stage in enumerate(case.stages):
        if stage.name in seen:
            raise Refusal(
                f"stages.{k}.name",
                f"{echo(stage.name)} is also the name of stage {seen[stage.name] + 1}",
                "give each stage its own name",
            )
        seen[stage.name] = k


def _ports(case: Case) -> list[tuple[str, str]]:
    """Keys and members of inputs and output."""
    ports = [(f"inputs.{k}.member", port.member) for k, port in enumerate(case.inputs)]
    return ports if case.output is None else [*ports, ("output.member", case.output.member)]


def _joint_ends(case: Case) -> list[tuple[str, str]]:
    """Keys and members of joints."""
    ends = ("first", "second")
    return [(f"joints.{k}.{e}", getattr(j, e)) for k, j in enumerate(case.joints) for e in ends]


def _check_members(case: Case) -> None:
    """Every member that is named exists."""
    named = [(f"held.{k}", name) for k, name in enumerate(case.held)] + _ports(case)
    named += [(f"loads.{k}.member", load.member) for k, load in enumerate(case.loads)]
    members: list[str] = list(case.member_names())
    for key, name in named + _joint_ends(case):
        if name not in members:
            raise Refusal(key, f"{echo(name)} is not a member", nearest(name, members))


def _check_ports(case: Case) -> None:
    """A member has one role."""
    seen: dict[str, str] = {}
    for key, name in _ports(case):
        if name in seen:
            raise Refusal(key, f"{name} is a port already ({seen[name]})", "name another member")
        seen[name] = key
    for k, name in enumerate(case.held):
        if name in seen:
            raise Refusal(
                f"held.{k}", f"{name} is also {seen[name]}", "a held member is no port; drop one"
            )
    for key, name in _ports(case) + _joint_ends(case):
        if case.kinematics_of(name) == "fixed":
            raise Refusal(key, f"{name} is fixed", 'choose another kinematics than "fixed"')


def _check_held(case: Case) -> None:
    """Held members have a support against rotation; others have one in free vibration only."""
    held = case.held_members()
    for name in case.member_names():
        k, part = case.stage_index(name), name.part
        form, member = case.stages[k].form(part), case.member(name)
        if form == "fe":
            continue  # its own supports, or the hub
        needs_none = (
            member.holds_rotation
            or form == "beam"  # the shaft's end stands in the housing
            or case.kinematics_of(name) == "fixed"
            or (case.output is None and name in case.held)  # there is no torque to take
        )
        if name in held and not needs_none:
            raise Refusal(
                f"stages.{k}.{part}.support.tangential",
                f"is zero, so nothing takes the torque of the held {name}",
                f'give it (or torsion), or {part}.kinematics = "fixed"',
            )
        if name not in held and member.holds_rotation and case.output is not None:
            at, support = next(x for x in member.supports.items() if x[1].holds_rotation)
            key = "tangential" if support.tangential > 0 else "torsion"
            raise Refusal(
                f"stages.{k}.{part}.{at}.{key}",
                f"holds the rotation of {name}, which turns",
                f'set it to zero, or name "{name}" in held (a case of free vibration, without '
                "[output], may have it)",
            )


def _check_behind_shafts(case: Case) -> None:
    """The body behind the spline of a sun's shaft can move in all directions."""
    for (key_of_member, _), port in zip(_ports(case), case.ports, strict=True):
        at, member = key_of_member.removesuffix(".member"), MemberName.parse(port.member)
        beam = case.stage(member.stage).form(member.part) == "beam"
        for key in ("inertia", "mass", "tilt_inertia"):
            if beam and getattr(port, key) is None:
                problem = f"is missing, and {port.member} has a shaft whose end carries a body"
                raise Missing(f"{at}.{key}", problem, "give inertia, mass and tilt_inertia")
        for key in ("mass", "tilt_inertia", "bearing"):
            if not beam and getattr(port, key) is not None:
                problem = f"is of a body behind a sun's shaft, but {port.member} has none"
                raise Refusal(f"{at}.{key}", problem, "give it to the member")


def _check_hubs(case: Case) -> None:
    """An FE ring that turns stands on a hub, and only such a ring."""
    held = case.held_members()
    for k, stage in enumerate(case.stages):
        if stage.form("ring") != "fe" or stage.ring is None:
            continue
        turns = f"{stage.name}.ring" not in held
        if turns and stage.ring.hub is None:
            problem = "is missing, and the FE ring turns: its bolts, fits and splines stand on it"
            raise Missing(
                f"stages.{k}.ring.hub", problem, f'add it, or name "{stage.name}.ring" in held'
            )
        if not turns and stage.ring.hub is not None:
            problem = "is that of a ring that turns, but the ring is held"
            raise Refusal(f"stages.{k}.ring.hub", problem, "take it out, or hold another member")


_NOT_PHYSICAL = {"name", "title", "source", "tolerance"}


class Case(Section):
    """A whole gearbox. Members are named "<stage>.sun", ".ring", ".carrier" in a planetary stage,
    "<stage>.pinion", ".gear" in a parallel one.

    name: of results; that of the file if left out. title: one line of text. source: file that it
    was read from. kinematics: of members that do not state their own. gyroscopic: Coriolis and
    centripetal terms of the carriers' frames, over speed in Campbell diagrams and at the
    instantaneous speed in transients. gravity: acceleration in fixed axes, x, y, z. material: of
    all gears and bodies that do not state their own. stages: in order; a single one is written
    [stage]. joints: splines, couplings and shafts between members. held: members that do not turn;
    a planetary stage without a held member holds its ring unless that is a port or in a joint.
    inputs: driven members. output: the loaded member. loads: constant forces and moments on
    members. load_cases: steady states for the rating; spectrum: load cases from a table;
    load_series: load cases from series. drive: machine of the first input. housing: of the
    bearings. lubricant: of gears and bearings. rating: rules by which gears are rated. faults: of
    single teeth. damping: of the structure. tolerance: distributions of a tolerance study. sensors:
    what transients record; recorder: their clock. solver: numerical options. Without ``output`` the
    case is one of free vibration, which has modes only: at zero speed without inputs, else about
    their steady speeds. Only there may members that turn have a support against rotation: a spring
    to a frame at their steady speed.
    """

    name: str = "train"
    title: str = ""
    source: str = "train"
    kinematics: Literal["planar", "axial", "spatial"] = "planar"
    gyroscopic: bool = False
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, 0.0, 0.0)
    material: Material
    stages: tuple[Stage, ...] = Field(min_length=1)
    joints: tuple[Joint, ...] = ()
    held: tuple[Member, ...] = ()
    inputs: tuple[Input, ...] = ()
    output: Output | None = None
    loads: tuple[MemberLoad, ...] = ()
    load_cases: tuple[LoadCase, ...] = ()
    spectrum: Spectrum = Spectrum()
    load_series: LoadSeries | None = None
    drive: TorqueHistory = TorqueHistory()
    housing: Housing = Housing()
    lubricant: Lubricant | None = None
    rating: Rating = Rating()
    faults: tuple[Fault, ...] = ()
    damping: Damping = Damping()
    tolerance: Tolerance = Tolerance()
    sensors: tuple[Sensor, ...] = ()
    recorder: Recorder = Recorder()
    solver: Solver = Solver()

    def stage(self, name: str) -> Stage:
        """The stage of that name."""
        return self.stages[self.stage_index(name)]

    def __repr__(self) -> str:
        stages = (f"{stage.name} ({stage.kind})" for stage in self.stages)
        return f"<flexgear case {self.name!r}: {', '.join(stages)}>"

    __str__ = __repr__

    @property
    def flexible_stages(self) -> dict[str, StageView]:
        """Stages with FE bodies or a shaft, by name."""
        return {s.name: self.view(s.name) for s in self.stages if s.is_flexible}

    @property
    def fe_ring_stages(self) -> dict[str, StageView]:
        """Stages whose ring is an FE body, with a node at every tooth."""
        return {s.name: self.view(s.name) for s in self.stages if s.form("ring") == "fe"}

    @property
    def flexible_bodies(self) -> dict[BodyName, FeMeshSource | Shaft]:
        """Sections of all bodies that may bend, stage by stage."""
        views = self.flexible_stages.values()
        return {body: section for view in views for body, section in view.flexible_bodies.items()}

    def stage_index(self, name: str) -> int:
        """Place of the stage of that name, or of a member's stage, in the train; InputError for
        another name."""
        stages, stage = [s.name for s in self.stages], MemberName.parse(name).stage
        if stage not in stages:
            raise InputError(
                self.source, echo(name), "is of no stage of the case", nearest(stage, stages)
            )
        return stages.index(stage)

    def member_names(self) -> tuple[MemberName, ...]:
        """All members, stage by stage: "stage_1.sun", "stage_1.ring", …"""
        return tuple(MemberName.of(s.name, part) for s in self.stages for part in s.members)

    def member(self, name: str) -> GearMember | CarrierMember:
        """The member of that name, also "<stage>.planet"."""
        at = MemberName.parse(name)
        return self.stage(at.stage).member(at.part)

    @property
    def ports(self) -> tuple[Input | Output, ...]:
        """Inputs in their order, then the output."""
        return self.inputs if self.output is None else (*self.inputs, self.output)

    def require_load(self) -> None:
        """InputError for a case of free vibration, where anything but modes is asked for."""
        if self.output is None:
            raise InputError(
                self.source, "output", "is missing, so that this is a case of free vibration",
                "ask for its modes, or add [output], and inputs with speed and torque",
            )  # fmt: skip

    def port_at(self, member: str) -> Input | Output | None:
        """The port at a member, if there is one."""
        return next((port for port in self.ports if port.member == member), None)

    def port_inertia(self, member: str) -> float:
        """Polar inertia that the port at a member adds, kg m²."""
        port = self.port_at(member)
        return 0.0 if port is None or port.inertia is None else port.inertia

    def kinematics_of(self, name: str) -> Kinematics:
        """Coordinates of a member or of "<stage>.planet"; "spatial" unless said on several supports
        and in a stage with FE bodies or a shaft."""
        member = self.member(name)
        tilts = self.stage(name).is_flexible or len(member.supports) > 1
        return member.kinematics or ("spatial" if tilts else self.kinematics)

    def held_members(self) -> tuple[MemberName, ...]:
        """Members that do not turn: ``held``, those with kinematics "fixed", default rings."""
        held = {*self.held}
        for name in self.member_names():
            if self.kinematics_of(name) == "fixed":
                held.add(name)
        used = {port.member for port in self.ports}
        used |= {name for joint in self.joints for name in (joint.first, joint.second)}
        for stage in self.stages:
            names = {f"{stage.name}.{member}" for member in stage.members}
            ring = f"{stage.name}.ring"
            free = not stage.is_flexible and not self.ports  # supports alone say what is held
            if stage.kind == "planetary" and not names & held and ring not in used and not free:
                held.add(ring)
        return tuple(name for name in self.member_names() if name in held)

    def view(self, name: str = "") -> StageView:
        """The stage of that name with the keys of the case that concern it; the only one if not
        named."""
        if not name and len(self.stages) > 1:
            names = ", ".join(s.name for s in self.stages)
            raise InputError(self.source, "stages", f"are {names}", "name one of them")
        return StageView(self, self.stage(name) if name else self.stages[0])

    def content_hash(self, *sections: str) -> str:
        """SHA-256 of the physical content of the case (or of the named sections), 64 hex digits.
        Name, title and spelling do not count; files count by their content."""
        data = self.model_dump(mode="python", exclude=_NOT_PHYSICAL)
        for dumped in data["stages"]:
            dumped.pop("case")
        for dumped in data["load_cases"]:
            del dumped["source"], dumped["line"]
        digest_files(data)
        if sections:
            data = {name: data[name] for name in sections}
        return content_hash(data)

    def with_(self, **changes: Any) -> Case:
        """A copy with SI values changed, validated again.

        Keys are field paths without units, joined by "." or "__"; stages by number or name, or
        "stage" if there is one: ``with_(**{"stage.planets": 4, "stages.two.face_width": 0.1})``.
        """
        data = self.model_dump(mode="python")
        for key, value in changes.items():
            dotted = key.replace("__", ".")
            refuse_earlier_key(dotted, "with_")
            parts = numbered(dotted, data, "with_")
            path: list[str | int] = [int(p) if is_place(p) else p for p in parts]
            if isinstance(value, Section):
                value = value.model_dump(mode="python")
            data = changed(data, path, value, "with_", key)
        try:
            return validated_case(data, "with_", Written())
        except InputError as fault:
            if self.stages[0].name != "stage":
                raise
            raise of_only_stage(fault) from None

    def to_dict(self) -> dict[str, Any]:
        """Plain data in SI, as stored with results; lists for tuples."""
        return self.model_dump(mode="json")

    @classmethod
    def required(cls, data: Mapping[str, Any]) -> list[Missing]:
        """Where power goes in, a member takes it, and the other way round."""
        require_rollers(data)
        inputs, loaded = data.get("inputs") or (), data.get("output") is not None
        if not isinstance(inputs, list | tuple):
            return []  # which is what is wrong
        if loaded and not inputs:
            return [Missing("inputs", "is missing beside output", "add [[inputs]]")]
        powers = [k for i in inputs for k in ("torque", "power") if raw_value(i, k) is not None]
        if powers and not loaded:
            remedy = f"add [output], or take {powers[0]} out for free vibration"
            return [Missing("output", f"is missing, and inputs give {powers[0]}", remedy)]
        return []

    @model_validator(mode="before")
    @classmethod
    def _named_stages(cls, data: Any) -> Any:
        """Stages without a name are stage_1, stage_2, …"""
        if not isinstance(data, dict) or not isinstance(data.get("stages"), (tuple, list)):
            return data
        stages = [
            {**stage, "name": stage.get("name") or f"stage_{k}"} if isinstance(stage, dict)
            else stage
            for k, stage in enumerate(data["stages"], 1)
        ]  # fmt: skip
        return {**data, "stages": tuple(stages)}

    def _check(self) -> None:
        check_case_name(self.name)
        check_case(self)
        check_tolerance(self)


def validated_case(data: dict[str, Any], where: str, written: Written) -> Case:
    """The train of plain SI data; InputError names each key as it was written."""
    try:
        return Case.model_validate(data)
    except ValidationError as fault:
        raise input_error(Case, fault, where, written) from None
