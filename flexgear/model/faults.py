"""Faults of teeth (cracked roots, missing teeth, pits, wear) and of rolling bearings (defects of
races and rollers), the sections ``faults`` of a case.

Manufacturing deviations of all gears are in ``gear_mesh.GearErrors``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from flexgear.model.errors import InputError, echo
from flexgear.model.read import nearest
from flexgear.model.section import Missing, Refusal, Section, below, raw_value
from flexgear.model.units import Angle, Length

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.stage import Stage

FOLLOWS_PAIRS = ("per_pair", "face_load", "lumped")
BEARING_FAULTS = ("outer_race", "inner_race", "roller")
_COMMON_KEYS = ("kind", "stage", "planet")
_PATCH = ("start_diameter", "end_diameter", "face_start", "face_end")
_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {  # by kind: required, optional
    "root_crack": (("gear", "tooth", "flank", "depth"), ("side", "angle", "face", "depths")),
    "missing_tooth": (("gear", "tooth"), ("side",)),
    "spall": (("gear", "tooth", "flank", "depth"), ("side", *_PATCH)),
    "wear": (("gear", "flank", "depth"), ("side", "tooth", *_PATCH)),
    **dict.fromkeys(BEARING_FAULTS, (("bearing", "width", "depth"), ("row", "position"))),
}


class Fault(Section):
    """A fault of one tooth, or of a bearing with ``rollers``. Teeth count from 1 as in results:
    tooth 1 of the ring is on the x axis at carrier angle zero, numbers increase towards +θ.

    kind: root_crack, from the root into the tooth, which adds compliance under load on the flank
    that opens the crack, and none under load on the other flank; missing_tooth, a tooth without any
    load; spall, a pit of uniform depth; wear, whose depth decreases as a parabola from the middle
    of the profile to zero at both ends; outer_race, inner_race, roller, a defect of a bearing over
    the whole length of its rollers, which then move along the races. stage: name of the stage; may
    be left out in a case of one stage. gear: gear of the tooth. planet: number of the planet, from
    1. side: half of a double-helical stage. tooth: number of the tooth; all teeth if left out, only
    for wear. flank: flank of the gear as in ``modifications``; for a root crack the flank whose
    load opens it, on the side where it starts.

    depth: length of a crack from the surface where the tangent at 30° to the tooth's middle line
    (60° in a ring) touches the root; depth of a spall or wear normal to the flank. Zero means a
    sound tooth. angle: between the crack and the tooth's middle line. face, depths: depths of a
    crack at positions along the face, linear between them and zero beyond, in place of depth.
    start_diameter, end_diameter: circles that limit a spall or wear; the whole flank if left out.
    face_start, face_end: positions along the face that limit a spall or wear; the ends of the face
    if left out. Positions along the face count from its middle towards +z; in the halves of a
    double-helical stage outwards, in the left half towards -z.

    bearing: key of the bearing with the defect below its stage: planet_bearing, which needs the
    number of its planet, carrier.bearing_drive, pinion.support, of several supports
    pinion.support.0, pinion.support.1 and so on. row: row of the rollers, from 1 towards +z. width:
    of the defect along the race or around the roller; depth: largest distance by which a roller can
    sink in; 0 means a sound bearing with moving rollers. position: angle at carrier angle zero of
    the defect on its race from the x axis of the bearing, which at a planet points outwards from
    the carrier's axis; of a roller its angle on the outer race.
    """

    kind: Literal[
        "root_crack", "missing_tooth", "spall", "wear", "outer_race", "inner_race", "roller"
    ]
    stage: str = ""
    gear: Literal["", "sun", "planet", "ring", "pinion", "gear"] = ""
    planet: int | None = Field(default=None, ge=1, le=20)
    side: Literal["left", "right"] | None = None
    tooth: int | None = Field(default=None, ge=1, le=2000)
    flank: Literal["drive", "coast", "sun", "ring"] | None = None
    depth: Length | None = Field(default=None, ge=0.0, le=0.2)
    angle: Angle = Field(default=math.radians(60), ge=math.radians(30), le=math.radians(90))
    face: tuple[Length, ...] = ()
    depths: tuple[Length, ...] = ()
    start_diameter: Length | None = Field(default=None, gt=0.0, le=20.0)
    end_diameter: Length | None = Field(default=None, gt=0.0, le=20.0)
    face_start: Length | None = Field(default=None, ge=-2.0, le=2.0)
    face_end: Length | None = Field(default=None, ge=-2.0, le=2.0)
    bearing: str = Field(default="", max_length=60)
    row: int = Field(default=1, ge=1, le=4)
    width: Length | None = Field(default=None, gt=0.0, le=0.5)
    position: Angle = Field(default=0.0, ge=-2 * math.pi, le=2 * math.pi)

    @property
    def of_bearing(self) -> bool:
        """Whether the fault is one of a bearing, not of a tooth."""
        return self.kind in BEARING_FAULTS

    @property
    def deepest(self) -> float:
        """Largest depth, m; 0 for a missing tooth."""
        return max(self.depths, default=self.depth or 0.0)

    @property
    def is_sound(self) -> bool:
        """Whether the depth is zero, so that the fault has no effect."""
        return self.kind != "missing_tooth" and self.deepest == 0.0

    @property
    def words(self) -> str:
        """Description, such as "root crack of planet 2, tooth 5, flank sun, 1.5 mm deep"."""
        if self.of_bearing:
            which = (
                f"{self.bearing.replace('_', ' ').replace('.', ' ')} {self.planet or ''}".strip()
            )
            depth, width = 1e6 * (self.depth or 0.0), 1e3 * (self.width or 0.0)
            parts = [f"defect of {self.kind.replace('_', ' ')}", which, f"row {self.row}"]
            return ", ".join([*parts, f"{width:g} mm wide", f"{depth:g} µm deep"])
        tooth = "all teeth" if self.tooth is None else f"tooth {self.tooth}"
        owner = " ".join(filter(None, [self.side, self.gear, str(self.planet or "")]))
        parts = [f"{self.kind.replace('_', ' ')} of {owner}", tooth]
        parts += [f"flank {self.flank}"] if self.flank else []
        if self.kind == "root_crack":
            parts.append(f"{1e3 * self.deepest:g} mm deep")
        elif self.kind != "missing_tooth":
            parts.append(f"{1e6 * self.deepest:g} µm deep")
        return ", ".join(parts)

    def depth_at(self, z: Any) -> np.ndarray[Any, Any]:
        """Depth of a root crack at positions z along the face (any shape), m."""
        z = np.asarray(z, dtype=float)
        if not self.depths:
            return np.full_like(z, self.depth or 0.0)
        return np.interp(z, self.face, self.depths, left=0.0, right=0.0)

    @classmethod
    def required(cls, data: Mapping[str, Any]) -> list[Missing]:
        """Keys that the kind of the fault requires."""
        required, _ = _KEYS.get(str(data.get("kind")), ((), ()))
        names = [name for name in required if name != "depth" or not data.get("depths")]
        if required and "planet" in (data.get("gear"), str(data.get("bearing")).partition("_")[0]):
            names.append("planet")
        return [Missing(name) for name in names if data.get(name) in (None, "")]

    def _check(self) -> None:
        allowed = {*_COMMON_KEYS, *itertools.chain(*_KEYS[self.kind])}
        unused = [name for name in type(self).model_fields if name not in allowed]
        self._refuse_set(unused, f"is not a key of the kind {self.kind}")
        if self.kind == "root_crack":
            self._check_crack_front()
        if self.planet is not None and "planet" not in (self.gear, self.bearing.partition("_")[0]):
            raise Refusal("planet", f"is given for the {self.gear or self.bearing}", "take it out")
        if self.of_bearing:
            return
        flanks = ("sun", "ring") if self.gear == "planet" else ("drive", "coast")
        if self.flank is not None and self.flank not in flanks:
            problem = f"the {self.gear} has no flank {self.flank!r}"
            raise Refusal("flank", problem, f"use {' or '.join(flanks)}")
        for low, high in (("start_diameter", "end_diameter"), ("face_start", "face_end")):
            first, last = getattr(self, low), getattr(self, high)
            if first is not None and last is not None and not first < last:
                raise Refusal(high, f"is not above {low}", "put them in order")

    def _check_crack_front(self) -> None:
        if self.depths and self.depth is not None:
            raise Refusal("depths", "are given beside depth", "keep one of them")
        if len(self.face) != len(self.depths) or len(self.depths) == 1:
            problem = f"{len(self.depths)} depths at {len(self.face)} positions along the face"
            raise Refusal("depths", problem, "give as many of both, at least two")
        if any(b <= a for a, b in itertools.pairwise(self.face)):
            raise Refusal("face", "does not increase", "put the positions in order, each once")
        if min(self.depths, default=0.0) < 0.0:
            raise Refusal("depths", "has negative values", "zero means a sound root")


def stage_of_fault(case: Case, fault: Fault) -> Stage:
    """The stage of a fault; Refusal if no stage has that name."""
    names = [stage.name for stage in case.stages]
    if not fault.stage and len(names) == 1:
        return case.stages[0]
    if not fault.stage:
        raise Missing("stage", "is missing", f"name one of {', '.join(names)}")
    if fault.stage not in names:
        raise Refusal("stage", f"{echo(fault.stage)} is no stage", nearest(fault.stage, names))
    return case.stage(fault.stage)


def bearing_defects(case: Case, stage: str, bearing: str) -> tuple[Fault, ...]:
    """Defects of a bearing of a stage by its key; of planet bearings those of all planets."""
    return tuple(
        fault
        for fault in case.faults
        if fault.bearing == bearing and stage_of_fault(case, fault).name == stage
    )


def require_rollers(data: Any) -> None:
    """Raise Refusal for a defect of a bearing without rollers, in raw data of a case. It is raised
    before the check of ``elements``, which would only ask for their number."""
    stages, faults = raw_value(data, "stages"), raw_value(data, "faults")
    if not isinstance(stages, (list, tuple)) or not isinstance(faults, (list, tuple)):
        return
    for k, fault in enumerate(faults):
        name, key = raw_value(fault, "stage"), str(raw_value(fault, "bearing") or "")
        for number, stage in enumerate(stages, 1):
            bearing = raw_value(stage, *key.split(".")) if key else None
            stage_name = raw_value(stage, "name")
            of_stage = name == stage_name if name else len(stages) == 1
            if of_stage and bearing is not None and raw_value(bearing, "rollers") is None:
                with below(f"faults.{k}"):
                    raise _missing_section(key, str(stage_name or f"stage_{number}"), "rollers")


def _missing_section(bearing: str, stage: str, section: str) -> Refusal:
    remedy = f"add {bearing}.{section}: defects need count, clearance, diameters of rollers"
    return Refusal("bearing", f"{bearing} of {stage} has no {section}", remedy)


def require_sound(case: Case, study: str) -> None:
    """Raise InputError for a case with faults in a study that needs equal teeth."""
    if case.faults:
        problem = f"cannot be used in {study}, which needs equal teeth"
        raise InputError(case.source, "faults", problem, "take them out")


def check_faults(case: Case) -> None:
    """Raise Refusal for faults of teeth and bearings that the case does not have, or that its model
    of the gear mesh cannot represent."""
    faulty, cracked = dict[tuple[Any, ...], int](), dict[tuple[Any, ...], int]()
    for k, fault in enumerate(case.faults):
        with below(f"faults.{k}"):
            stage = stage_of_fault(case, fault)
            if fault.planet is not None and fault.planet > stage.planets:
                problem = f"{fault.planet} is beyond the {stage.planets} planets"
                raise Refusal("planet", problem, "planets count from 1")
            if fault.of_bearing:
                _check_bearing(case, stage, fault)
                continue
            _check_tooth(stage, fault)
            _check_gear_mesh(stage)
            tooth = stage.name, fault.gear, fault.planet, fault.side, fault.tooth
            first = faulty.setdefault(tooth, k)
            if first != k and "missing_tooth" in (fault.kind, case.faults[first].kind):
                problem = f"has faults.{first}, too, and a missing tooth has no other fault"
                raise Refusal("tooth", problem, "keep one of both")
            if fault.kind == "root_crack":
                first = cracked.setdefault((*tooth, fault.flank), k)
                if first != k:
                    problem = f"is cracked by faults.{first} already"
                    raise Refusal("tooth", problem, "keep one crack a flank")


def _check_bearing(case: Case, stage: Stage, fault: Fault) -> None:
    bearing, part = stage.bearings.get(fault.bearing), fault.bearing.partition(".")[0]
    if bearing is None:
        problem, names = f"there is no {echo(fault.bearing)} of {stage.name}", [*stage.bearings]
        raise Refusal("bearing", problem, nearest(fault.bearing, names))
    member = f"{stage.name}.{part}"
    if part in stage.members and member in case.held_members():
        problem = f"{fault.bearing}: the {part} is held, so no roller passes its defect"
        raise Refusal("bearing", problem, "name the bearing of a member that turns")
    if part in stage.members and case.kinematics_of(member) in ("fixed", "torsional"):
        problem = f"{fault.bearing}: the {part} has no radial motion, which rollers transmit"
        raise Refusal("bearing", problem, f'take {part}.kinematics = "planar" or "spatial"')
    if bearing.rollers is None or bearing.elements is None:
        section = "rollers" if bearing.rollers is None else "elements"
        raise _missing_section(fault.bearing, stage.name, section)
    if fault.row > bearing.rollers.rows:
        raise Refusal("row", f"{fault.row} is beyond its {bearing.rollers.rows} rows", "from 1")
    if fault.deepest > (radius := bearing.elements.diameter / 2):
        problem = f"{1e3 * fault.deepest:g} mm is more than the radius of the rollers"
        raise Refusal("depth", problem, f"at most {1e3 * radius:.4g} mm; check the unit")
    pitch = math.pi * bearing.elements.pitch_diameter / bearing.rollers.count
    if fault.width is not None and fault.width >= pitch:
        problem = f"{1e3 * fault.width:g} mm reach the next roller, {1e3 * pitch:.4g} mm apart"
        raise Refusal("width", problem, "take a smaller one")


def _check_tooth(stage: Stage, fault: Fault) -> None:
    gears = ("pinion", "gear") if stage.kind == "parallel" else ("sun", "planet", "ring")
    if fault.gear not in gears:
        raise Refusal("gear", f"a {stage.kind} stage has no {fault.gear}", nearest("", gears))
    teeth = getattr(stage, fault.gear).teeth
    if fault.tooth is not None and fault.tooth > teeth:
        problem = f"{fault.tooth} is beyond the {teeth} teeth of the {fault.gear}"
        raise Refusal("tooth", problem, f"teeth count from 1 to {teeth}")
    if stage.double_helical and fault.side is None:
        raise Missing("side", "is missing in a double-helical stage", 'add "left" or "right"')
    if fault.side is not None and not stage.double_helical:
        raise Refusal("side", "is for a double-helical stage", "take it out")
    half = 0.5 * stage.face_width * (1.0 + 1e-9)
    for key in ("face_start", "face_end", "face"):
        largest = np.abs(np.atleast_1d(getattr(fault, key) or 0.0)).max(initial=0.0)
        if largest > half:
            remedy = f"from {-1e3 * half:.6g} to {1e3 * half:.6g} mm, 0 is its middle"
            raise Refusal(key, f"reaches {1e3 * largest:g} mm, beyond the face", remedy)


def _check_gear_mesh(stage: Stage) -> None:
    options = stage.gear_mesh
    if options.model not in FOLLOWS_PAIRS:
        problem = f"gear_mesh.model = {options.model!r} of {stage.name} does not model single teeth"
        raise Refusal("gear", problem, 'use "per_pair" or "face_load"')
    if options.contact_law == "linear":
        problem = f"gear_mesh.contact_law = 'linear' of {stage.name} lets flanks pull"
        raise Refusal("gear", problem, 'use "one-sided" with faults')
