"""A case: stages of lumped members, FE bodies and shafts, their joints, ports and loads, in SI."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

from flexgear.model.bearings import Lubricant
from flexgear.model.bodies import FeMeshSource, Housing, Material, Shaft
from flexgear.model.case_checks import check_case, check_case_name
from flexgear.model.content import content_hash, digest_files, resolve_files, tables_in
from flexgear.model.errors import InputError, echo
from flexgear.model.faults import Fault, require_rollers
from flexgear.model.gear_mesh import Damping
from flexgear.model.load_cases import LoadCase, LoadSeries, Spectrum
from flexgear.model.machine import TorqueHistory
from flexgear.model.member import CarrierMember, GearMember, Kinematics
from flexgear.model.names import BodyName, Member, MemberName
from flexgear.model.rating import Rating
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
from flexgear.model.section import Missing, Section, raw_value
from flexgear.model.sensor import Recorder, Sensor
from flexgear.model.solver import Solver
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView
from flexgear.model.tolerance import Tolerance, check_tolerance
from flexgear.model.train import Input, Joint, MemberLoad, Output, shafts
from flexgear.model.units import Acceleration
from flexgear.model.upgrade import refuse_earlier_key
from flexgear.model.validation_errors import input_error

_NOT_PHYSICAL = {"name", "title", "source", "tolerance"}


class Case(Section):
    """A whole gearbox. Members are named "<stage>.sun", ".ring", ".carrier" in a planetary stage,
    "<stage>.pinion", ".gear" in a parallel one.

    name: name of results; that of the file if left out. title: one line of text. source: file from
    which the case was read. kinematics: of members without this key, unless an FE body, a shaft, a
    joint or several supports need more coordinates.
    gyroscopic: whether Coriolis and centripetal terms of the carriers' frames are included, over
    speed in Campbell diagrams and at the instantaneous speed in transients. gravity: acceleration
    in fixed axes, x, y, z.
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
        """Coordinates of a member or of "<stage>.planet": those of its key, or by default

        - "spatial" on several supports, in a stage with FE bodies or a shaft, and joined by thrust
          and bending to such a member, which a planar one would hold on the housing;
        - of planets on a spatial carrier what their bearings transmit: "axial" or "spatial";
        - "axial" in place of "planar" where a joint passes on the thrust of helical teeth;
        - else the case's.
        """
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
        """Members on the shaft of a member, itself included: connected by joints that transmit
        thrust; bending: joints that also transmit moments across the axis."""
        ties = [
            (joint.first, joint.second)
            for joint in self.joints
            if (joint.passes_bending if bending else joint.passes_thrust)
        ]
        shaft = shafts(self.member_names(), ties)
        return [m for m, first in shaft.items() if first == shaft.get(name)] or [name]

    def _tilts(self, name: str) -> bool:
        """Whether a member has all six coordinates by its own keys and its stage alone."""
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
        """A copy with SI values changed, validated again; see ``face.case.Case.with_``."""
        data = self.model_dump(mode="python")
        earlier = tables_in(data)
        for key, value in changes.items():
            dotted = key.replace("__", ".")
            refuse_earlier_key(dotted, "with_")
            first, of_case = dotted.partition(".")[0], type(self).model_fields
            of_stage = get_close_matches(first, Stage.model_fields, n=1, cutoff=0.75)
            if len(self.stages) == 1 and of_stage and first not in (*of_case, "stage"):
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
