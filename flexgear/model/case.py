"""A case: stages of lumped members, FE bodies and shafts, their joints, ports and loads, in SI."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

from flexgear.model.bearings import Lubricant
from flexgear.model.bodies import FeMeshSource, Housing, Material, Shaft
from flexgear.model.content import content_hash, digest_files, resolve_files, tables_in
from flexgear.model.errors import InputError, echo
from flexgear.model.faults import Fault, check_faults, require_rollers
from flexgear.model.gear_mesh import Damping
from flexgear.model.load_cases import LoadCase, LoadSeries, Spectrum, check_load_cases
from flexgear.model.machine import TorqueHistory, check_machines
from flexgear.model.member import CarrierMember, GearMember, Kinematics
from flexgear.model.names import BodyName, Member, MemberName
from flexgear.model.rating import Rating, check_rating, check_thrust
from flexgear.model.read import (
    Written,
    changed,
    is_index,
    lists_of,
    nearest,
    numbered,
    of_only_stage,
    tuples_of,
)
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

_MAX_NAME_LENGTH = 100  # characters, since a file name is limited to 255 bytes


def check_case_name(name: str) -> None:
    """Raise Refusal for a name that cannot be part of a file name, or contains a path."""
    bad = not name.isprintable() or any(sign in name for sign in '/\\:*?"<>|')
    if bad or name != name.strip(" .") or not 0 < len(name) <= _MAX_NAME_LENGTH:
        remedy = f'give name = "…" of letters, digits, hyphens, at most {_MAX_NAME_LENGTH} of them'
        raise Refusal("name", f"{echo(name)} cannot name a file of results", remedy)


def check_case(case: Case) -> None:
    """Check names, ports and supports of a case against one another; raises Refusal."""
    _check_stage_names(case)
    _check_members(case)
    _check_ports(case)
    _check_held(case)
    check_machines(case)
    check_load_cases(case)
    check_rating(case)
    check_thrust(case)
    check_faults(case)
    _check_behind_shafts(case)
    _check_hubs(case)
    check_sensors(case)


def _check_stage_names(case: Case) -> None:
    seen: dict[str, int] = {}
    for k, stage in enumerate(case.stages):
        if stage.name in seen:
            problem = f"{echo(stage.name)} is also the name of stage {seen[stage.name] + 1}"
            raise Refusal(f"stages.{k}.name", problem, "give each stage a unique name")
        seen[stage.name] = k


def _ports(case: Case) -> list[tuple[str, str]]:
    """Key and member of each input and the output."""
    ports = [(f"inputs.{k}.member", port.member) for k, port in enumerate(case.inputs)]
    return ports if case.output is None else [*ports, ("output.member", case.output.member)]


def _joint_ends(case: Case) -> list[tuple[str, str]]:
    """Key and member of each end of the joints."""
    ends = ("first", "second")
    return [(f"joints.{k}.{e}", getattr(j, e)) for k, j in enumerate(case.joints) for e in ends]


def _check_members(case: Case) -> None:
    """Raise Refusal for the name of a member that does not exist."""
    named = [(f"held.{k}", name) for k, name in enumerate(case.held)] + _ports(case)
    named += [(f"loads.{k}.member", load.member) for k, load in enumerate(case.loads)]
    members: list[str] = list(case.member_names())
    for key, name in named + _joint_ends(case):
        if name not in members:
            raise Refusal(key, f"{echo(name)} is not a member", nearest(name, members))


def _check_ports(case: Case) -> None:
    """Raise Refusal for a port that is another port, held or fixed, and for a fixed joint end."""
    seen: dict[str, str] = {}
    for key, name in _ports(case):
        if name in seen:
            raise Refusal(key, f"{name} is a port already ({seen[name]})", "name another member")
        seen[name] = key
    for k, name in enumerate(case.held):
        if name in seen:
            problem = f"{name} is also {seen[name]}"
            raise Refusal(f"held.{k}", problem, "a held member is no port; delete one")
    for key, name in _ports(case) + _joint_ends(case):
        if case.kinematics_of(name) == "fixed":
            raise Refusal(key, f"{name} is fixed", 'choose another kinematics than "fixed"')


def _check_held(case: Case) -> None:
    """Raise Refusal for a held member without support against rotation, and a loaded member with
    one."""
    held = case.held_members()
    for name in case.member_names():
        k, part = case.stage_index(name), name.part
        form, member = case.stages[k].form(part), case.member(name)
        if form == "fe":
            continue  # the supports of the FE body or its hub hold it
        is_supported = (
            member.holds_rotation
            or form == "beam"  # the spline of the shaft is connected to the housing
            or case.kinematics_of(name) == "fixed"
            or (case.output is None and name in case.held)  # there is no torque
        )
        if name in held and not is_supported:
            problem = f"is zero, so nothing supports the torque of the held {name}"
            remedy = f'give it (or torsion), or {part}.kinematics = "fixed"'
            raise Refusal(f"stages.{k}.{part}.support.tangential", problem, remedy)
        if name not in held and member.holds_rotation and case.output is not None:
            at, support = next(x for x in member.supports.items() if x[1].holds_rotation)
            key = "tangential" if support.tangential > 0 else "torsion"
            raise Refusal(
                f"stages.{k}.{part}.{at}.{key}",
                f"prevents the rotation of {name}, which rotates",
                f'set it to zero, or name "{name}" in held (only a case of free vibration, without '
                "[output], may have it)",
            )


def _check_behind_shafts(case: Case) -> None:
    """Check the keys of the bodies behind the splines of sun shafts; raises Missing or Refusal."""
    for (key_of_member, _), port in zip(_ports(case), case.ports, strict=True):
        at, member = key_of_member.removesuffix(".member"), MemberName.parse(port.member)
        beam = case.stage(member.stage).form(member.part) == "beam"
        for key in ("inertia", "mass", "tilt_inertia"):
            if beam and getattr(port, key) is None:
                problem = f"is missing, and {port.member} has a shaft with a body at its end"
                raise Missing(f"{at}.{key}", problem, "give inertia, mass and tilt_inertia")
        for key in ("mass", "tilt_inertia", "bearing"):
            if not beam and getattr(port, key) is not None:
                problem = f"is for the body at the end of a sun's shaft, but {port.member} has none"
                raise Refusal(f"{at}.{key}", problem, "give it to the member")


def _check_hubs(case: Case) -> None:
    """Check that FE rings have a hub if and only if they rotate; raises Missing or Refusal."""
    held = case.held_members()
    for k, stage in enumerate(case.stages):
        if stage.form("ring") != "fe" or stage.ring is None:
            continue
        turns = f"{stage.name}.ring" not in held
        if turns and stage.ring.hub is None:
            problem = "is missing, and the FE ring rotates: bolts, fits and splines connect to it"
            remedy = f'add it, or name "{stage.name}.ring" in held'
            raise Missing(f"stages.{k}.ring.hub", problem, remedy)
        if not turns and stage.ring.hub is not None:
            problem = "is for a rotating ring, but the ring is held"
            raise Refusal(f"stages.{k}.ring.hub", problem, "delete it, or hold another member")


_NOT_PHYSICAL = {"name", "title", "source", "tolerance"}


class Case(Section):
    """A whole gearbox. Members are named "<stage>.sun", ".ring", ".carrier" in a planetary stage,
    "<stage>.pinion", ".gear" in a parallel one.

    name: name of results; that of the file if left out. title: one line of text. source: file from
    which the case was read. kinematics: of members without this key, in stages
    without FE bodies and shafts. gyroscopic: whether Coriolis and centripetal terms of the
    carriers' frames are included, over speed in Campbell diagrams and at the instantaneous speed in
    transients. gravity: acceleration in fixed axes, x, y, z.
    material: of gears and bodies without this key. stages: in order; a single stage is written
    [stage]. joints: splines, couplings and shafts between members. held: members that do not
    rotate; in a planetary stage without a held member the ring is held unless it is a port or in a
    joint. inputs: driven members. output: the loaded member. loads: forces and moments on members.
    load_cases: steady states for the rating; spectrum: load cases from a table; load_series: load
    cases from time series. drive: machine of the first input. housing: of the bearings. lubricant:
    of gears and bearings. rating: rules for the rating of gears. faults: of single teeth and
    bearings. damping: of the structure. tolerance: distributions for a tolerance study. sensors:
    signals that transients record; recorder: sampling of all sensors. solver: numerical options.

    A case without ``output`` is one of free vibration, for modes only: at zero speed without
    inputs, else at their steady speeds. Only in such a case may rotating members have a support
    against rotation, which is a spring to a frame that rotates at their steady speed.
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
        """Sections of all FE bodies and sun shafts, stage by stage."""
        views = self.flexible_stages.values()
        return {body: section for view in views for body, section in view.flexible_bodies.items()}

    def stage_index(self, name: str) -> int:
        """Index of a stage by its name or that of a member; InputError if there is none."""
        stages, stage = [s.name for s in self.stages], MemberName.parse(f"{name}").stage
        if stage not in stages:
            problem = "is of no stage of the case"
            raise InputError(self.source, echo(name), problem, nearest(stage, stages))
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
        """Raise InputError for a case of free vibration, which has modes only."""
        if self.output is None:
            problem = "is missing, so that this is a case of free vibration"
            remedy = "compute its modes, or add [output], and inputs with speed and torque"
            raise InputError(self.source, "output", problem, remedy)

    def port_at(self, member: str) -> Input | Output | None:
        """The port at a member, None if there is none."""
        return next((port for port in self.ports if port.member == member), None)

    def port_inertia(self, member: str) -> float:
        """Polar inertia that the port at a member adds, kg m²."""
        port = self.port_at(member)
        return 0.0 if port is None or port.inertia is None else port.inertia

    def kinematics_of(self, name: str) -> Kinematics:
        """Coordinates of a member or of "<stage>.planet". Where its key is left out: "spatial" on
        several supports, in a stage with FE bodies or a shaft, and where a joint that passes thrust
        and bending joins it to such a member, which it would hold on the housing else; "axial"
        rather than "planar" where a joint passes thrust of helical teeth to or from one. Planets
        follow a spatial carrier as far as their bearings make them."""
        stated, stage = self.member(name).kinematics, self.stage(name)
        if stated is not None:
            return stated
        lumped = self.kinematics == "planar" and not stage.is_flexible
        if lumped and name == f"{stage.name}.planet":
            stiffness = stage.planet_bearing.stiffness
            if stiffness[2] > 0 and self.kinematics_of(f"{stage.name}.carrier") == "spatial":
                return "spatial" if max(stiffness[3:5]) > 0 else "axial"
        if any(map(self._tilts, self._joined(name, bending=True))):
            return "spatial"
        along = self._joined(name, bending=False)
        pushed = any(self.stage(n).helix_angle and not self.stage(n).double_helical for n in along)
        moves = any(self._tilts(n) or self.member(n).kinematics == "axial" for n in along)
        return "axial" if self.kinematics == "planar" and pushed and moves else self.kinematics

    def _joined(self, name: str, bending: bool) -> list[str]:
        """A member and those that joints which pass thrust, and with it bending, join to it."""
        joined = [str(name)]
        for one in joined:
            for joint in self.joints:
                passes = joint.passes_bending if bending else joint.passes_thrust
                if passes and one in (joint.first, joint.second):
                    joined += {str(joint.first), str(joint.second)} - {*joined}
        return joined

    def _tilts(self, name: str) -> bool:
        """Whether a member has all motions by its own keys and those of its stage."""
        member = self.member(name)
        alone = self.stage(name).is_flexible or len(member.supports) > 1
        return member.kinematics == "spatial" or (member.kinematics is None and alone)

    def held_members(self) -> tuple[MemberName, ...]:
        """Members that do not rotate: those in ``held``, fixed ones, and rings held by default."""
        held = {*self.held}
        for name in self.member_names():
            if self.kinematics_of(name) == "fixed":
                held.add(name)
        used = {port.member for port in self.ports}
        used |= {name for joint in self.joints for name in (joint.first, joint.second)}
        for stage in self.stages:
            names = {f"{stage.name}.{member}" for member in stage.members}
            ring = f"{stage.name}.ring"
            free = not stage.is_flexible and not self.ports  # only supports hold members
            if stage.kind == "planetary" and not names & held and ring not in used and not free:
                held.add(ring)
        return tuple(name for name in self.member_names() if name in held)

    def view(self, name: str = "") -> StageView:
        """A stage with the keys of the case that concern it; "" for the only stage."""
        if not name and len(self.stages) > 1:
            names = ", ".join(s.name for s in self.stages)
            raise InputError(self.source, "stages", f"are {names}", "name one of them")
        return StageView(self, self.stage(name) if name else self.stages[0])

    def content_hash(self, *sections: str) -> str:
        """SHA-256 of the physical content of the case or of some sections, 64 hex digits.

        It does not depend on name, title and units of the keys; files enter by their content.
        """
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
        "stage" if there is one, whose keys need no "stage.":
        ``with_(planets=4)``, ``with_(**{"stages.two.face_width": 0.1})``.
        """
        data = self.model_dump(mode="python")
        earlier = tables_in(data)
        for key, value in changes.items():
            dotted = key.replace("__", ".")
            refuse_earlier_key(dotted, "with_")
            first, of_case = dotted.partition(".")[0], type(self).model_fields
            if len(self.stages) == 1 and first in Stage.model_fields and first not in of_case:
                dotted = f"stage.{dotted}"
            parts = numbered(dotted, data, "with_")
            path: list[str | int] = [int(p) if is_index(p) else p for p in parts]
            data = changed(data, path, tuples_of(lists_of(value), "with_", key), "with_", key)
        resolve_files(data, Path(), earlier)
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
        """``inputs`` beside an output; ``output`` beside inputs with torque or power."""
        require_rollers(data)
        inputs, loaded = data.get("inputs") or (), data.get("output") is not None
        if not isinstance(inputs, list | tuple):
            return []  # pydantic refuses the type
        if loaded and not inputs:
            return [Missing("inputs", "is missing beside output", "add [[inputs]]")]
        powers = [k for i in inputs for k in ("torque", "power") if raw_value(i, k) is not None]
        if powers and not loaded:
            remedy = f"add [output], or delete {powers[0]} for free vibration"
            return [Missing("output", f"is missing, and inputs give {powers[0]}", remedy)]
        return []

    @model_validator(mode="before")
    @classmethod
    def _named_stages(cls, data: Any) -> Any:
        """Name stages without a name stage_1, stage_2, …"""
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
    """The case of plain SI data; an InputError names keys as the user wrote them."""
    try:
        return Case.model_validate(data)
    except ValidationError as fault:
        raise input_error(Case, fault, where, written) from None
