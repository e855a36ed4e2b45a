"""A case as a REXS model: gears, shafts, carriers, bearings, joints, loads; steady results.

Frame: u is the case's z, v its x, w its y. Speeds, torques and powers of the steady flow stand in a
load case.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from flexgear.arrays import Array
from flexgear.files.rexs import tables as table
from flexgear.files.rexs.outgoing import (
    GearsOut,
    Outgoing,
    Written,
    axes,
    halves,
    middle,
    places,
)
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.load_bins import HOUR, LoadBin, bins_of_load_cases
from flexgear.gears.power_flow import power_flow
from flexgear.gears.radii import StageRadii, stage_radii
from flexgear.model.bearings import Springs
from flexgear.model.case import Case
from flexgear.model.member import LumpedInertia, MatedGear, PlanetBearing, PlanetGear, Support
from flexgear.model.modifications import FLANKS, FlankModifications
from flexgear.model.names import MemberName
from flexgear.model.section import Section
from flexgear.model.stage import Stage
from flexgear.model.train import Input, Joint, MemberLoad, Output

_WRITTEN = {
    "name", "title", "source", "gravity", "material", "stages", "joints", "held", "inputs",
    "output", "loads", "load_cases", "spectrum",
}  # fmt: skip
_UNWRITTEN = sorted(FlankModifications.model_fields.keys() - table.KEYS)  # modifications
_OF_SPRINGS = ("damping", "journal", "rollers")  # that REXS has not
_OF_PORTS = {"member", "speed", "torque", "power", "inertia"}


def not_written(case: Case) -> list[str]:
    """Parts of the case that the REXS model does not hold, in words."""
    lost = _set(case, "", _WRITTEN)
    for k, port in enumerate(case.ports):
        where = "output" if port is case.output else f"inputs[{k}]"
        lost += _set(port, f"{where}.", _OF_PORTS)
    lost += [f"loads on {load.member}" for load in case.loads if not _is_written(load)]
    states = [state for c in case.load_cases for _, _, state in c.states("")]
    if any(s.frame != "fixed" and (s.force or s.moment) for s in states):
        lost.append("loads of load_cases in turning frames")
    for k, joint in enumerate(case.joints):
        lost += _lost(joint, f"joints[{k}].", "damping")
    for stage in case.stages:
        before = f"stages.{stage.name}."
        lost += _lost(stage, before, "errors", "gear_mesh")
        lost += _lost(stage.planet_bearing, f"{before}planet_bearing.", *_OF_SPRINGS)
        for name in (*stage.members, "planet"):
            member, where = getattr(stage, name, None), f"{before}{name}"
            if getattr(member, "inertia", None) or getattr(member, "equivalent_mass", None):
                lost.append(f"{where}: its moment of inertia")
            if isinstance(member, LumpedInertia):
                lost += _lost(member.support, f"{where}.support.", *_OF_SPRINGS)
            if isinstance(member, MatedGear | PlanetGear):
                ground = member.modifications
                lost += _lost(member, f"{where}.", "rating")
                lost += _lost(ground, f"{where}.modifications.", *_UNWRITTEN)
                for flank in FLANKS:
                    of_flank = getattr(ground, flank, None)
                    lost += _lost(of_flank, f"{where}.modifications.{flank}.", *_UNWRITTEN)
        if stage.is_flexible:
            lost.append(f"{before[:-1]}: FE bodies of ring and carrier, their bearings, shaft")
    return lost


def _set(section: Section, before: str, written: Iterable[str]) -> list[str]:
    """Keys of a section that are set, but for those that are written."""
    return _lost(section, before, *(k for k in type(section).model_fields if k not in written))


def _lost(section: Section | None, before: str, *keys: str) -> list[str]:
    """Those of the keys that a section has and that are set."""
    fields = {} if section is None else type(section).model_fields
    return [
        f"{before}{key}"
        for key in keys
        if key in fields
        and getattr(section, key) != fields[key].get_default(call_default_factory=True)
    ]


def model_of_case(case: Case) -> Outgoing:
    """The REXS model of a case. InputError for a train without one answer for its speeds."""
    return _Export(case).model


class _Export:
    def __init__(self, case: Case) -> None:
        self.case, self.model = case, Outgoing()
        self.flow = power_flow(case)
        self.places = places(case)
        self.shafts: dict[str, int] = {}
        self.unit = self._gear_unit()
        self.casing = self.model.part(self.unit, "gear_casing", "casing")
        self.material = self.model.add(
            "material",
            "material",
            elastic_modulus=case.material.young_modulus,
            poisson_ratio=case.material.poisson_ratio,
            density=case.material.density,
        )
        for stage in case.stages:
            _StageOut(self, stage).add()
        for joint in case.joints:
            self._joint(joint)
        self._speeds()
        ports = {port.member: self._port(port) for port in case.ports}
        self.forces: dict[str, list[int]] = {}
        bins = bins_of_load_cases(case)
        for load in filter(_is_written, case.loads):
            self._load(load)
        for load in (load for load_bin in bins for load in filter(_is_written, load_bin.loads)):
            if load.member not in self.forces:
                self._load(MemberLoad(member=load.member))
        for load_bin in bins:
            self._load_case(load_bin, ports)

    def _gear_unit(self) -> int:
        size = math.sqrt(sum(g * g for g in self.case.gravity))
        x, y, z = (g / size if size else 0.0 for g in self.case.gravity)
        gravity: dict[str, Written | None] = {"account_for_gravity": size > 0}
        if size:
            gravity |= {
                "direction_vector_gravity_u": z,
                "direction_vector_gravity_v": x,
                "direction_vector_gravity_w": y,
                "gravitational_acceleration": size,
            }
        name = self.case.title or self.case.name
        return self.model.add(
            "gear_unit", name, support_vector=(0.0, 0.0, 0.0), **axes(), **gravity
        )

    def shaft(
        self, member: str, place: tuple[float, float, float], whole: int | None = None
    ) -> int:
        """The shaft of a member (or a planet), which begins at ``place``."""
        port = self.case.port_at(member)
        defines = None if port is None else port.speed is not None
        number = self.model.part(
            self.unit if whole is None else whole,
            "shaft",
            member,
            support_vector=place,
            **axes(),
            defines_speed=defines,
        )
        self.shafts[member] = number
        return number

    def _joint(self, joint: Joint) -> None:
        stage = self.case.stage(joint.first)
        radii = stage_radii(self.case.view(stage.name))
        torsion = _torsion(joint, radii, MemberName.parse(joint.first).part)
        radial = axial = tilt = 0.0
        if joint.is_shaft:
            assert joint.length is not None and joint.outer_diameter is not None
            polar = math.pi / 32 * (joint.outer_diameter**4 - joint.inner_diameter**4)
            material = self.case.material
            shear = material.young_modulus / (2 * (1 + material.poisson_ratio))
            torsion = shear * polar / joint.length
        else:
            radial, _, axial, tilt, _, _ = joint.stiffness
        self.model.side(
            "coupling",
            self.shafts[joint.first],
            self.shafts[joint.second],
            f"{joint.first} – {joint.second}",
            rotational_stiffness=torsion,
            radial_stiffness=radial,
            axial_stiffness=axial,
            bending_stiffness=tilt,
        )

    def _speeds(self) -> None:
        if self.case.ports:
            for member, speed in self.flow.speed.items():
                self.model.result(self.shafts[member], rotational_speed=speed)

    def _load(self, load: MemberLoad) -> None:
        """Force and transverse moments; a load in the carrier's frame, or a moment about u, is not
        written."""
        number = self.model.part(
            self.shafts[load.member],
            "external_load",
            f"force on {load.member}",
            u_coordinate_on_shaft=0.0,
            transmits_torque=False,
            **_force_attributes(load.first),
        )
        self.forces.setdefault(load.member, []).append(number)

    def _load_case(self, load_bin: LoadBin, ports: dict[str, int]) -> None:
        """Results of a load bin; loads that the case has already are not written again."""
        model = self.model
        model.begin_load_case()
        model.result(self.unit, operating_time=HOUR * load_bin.hours)
        for member, speed in load_bin.speed.items():
            model.result(self.shafts[member], rotational_speed=speed)
        for member, number in ports.items():
            torque = load_bin.torque[member]
            power = torque * load_bin.speed[member]
            model.result(number, torque_around_u_axis=torque, power=power)
        for member, numbers in self.forces.items():
            loads = [load for load in load_bin.loads if load.member == member]
            if loads != [load for load in self.case.loads if load.member == member]:
                total = sum((load.first for load in filter(_is_written, loads)), np.zeros(6))
                for k, number in enumerate(numbers):
                    model.result(number, **_force_attributes(np.zeros(6) if k else total))

    def _port(self, port: Input | Output) -> int:
        """The external load at a port; its id."""
        shaft = self.shafts[port.member]
        number = self.model.part(
            shaft,
            "external_load",
            port.member,
            u_coordinate_on_shaft=0.0,
            transmits_torque=True,
            defines_torque=port.given_torque is not None,
        )
        if self.case.output is not None:
            self.model.result(
                number,
                torque_around_u_axis=self.flow.torque[port.member],
                power=self.flow.power[port.member],
            )
        inertia = self.case.port_inertia(port.member)
        if inertia > 0:
            self.model.part(
                shaft,
                "additional_mass",
                u_coordinate_on_shaft=0.0,
                moment_of_inertia_u_axis=inertia,
            )
        return number


class _StageOut:
    """Adds one stage to a model."""

    def __init__(self, whole: _Export, stage: Stage) -> None:
        self.whole, self.stage, self.model = whole, stage, whole.model
        view = whole.case.view(stage.name)
        self.geometry = stage_geometry(view)
        forward = whole.flow.stage(stage.name).sun_gear_mesh_force >= 0
        self.gears = GearsOut(self.model, view, self.geometry, forward)
        self.loaded = whole.case.output is not None
        self.reach = stage.face_width / 2 - middle(
            stage, halves(stage)[0]
        )  # of the stage from its middle
        self.at = whole.places

    def add(self) -> None:
        """Stage, shafts, gears, gear meshes, supports and results."""
        if self.stage.kind == "planetary":
            self._planetary()
        else:
            self._parallel()
        for part in self.stage.members:
            self._support(part)
        if self.whole.case.ports:
            self._results()

    def _results(self) -> None:
        """Speeds of the gears; forces in the gear meshes, of one planet and half each."""
        flow = self.whole.flow.stage(self.stage.name)
        speed = {"sun": flow.sun_speed, "ring": flow.ring_speed, "planet": flow.planet_speed}
        for role, number in self.gears.gears:
            self.model.result(number, rotational_speed=speed[role])
        if self.whole.case.output is not None:
            for role, number in self.gears.meshes:
                force = abs(flow.gear_mesh_forces[role]) * math.cos(self.geometry.base_helix_angle)
                self.model.result(number, nominal_tangential_force_at_base_diameter=force)

    def _gears(
        self, role: str, shaft: int, name: str, place: tuple[float, float, float]
    ) -> list[int]:
        """Adds a gear for each half of the stage and returns their ids; place: of the middle of the
        stage on the gear's axis."""
        u, v, w = place
        return [
            self.gears.add(
                role, shaft, self.reach, name, (u + middle(self.stage, half), v, w), half,
                self.whole.material,
            )
            for half in halves(self.stage)
        ]  # fmt: skip

    def _shaft(
        self, member: str, place: tuple[float, float, float], whole: int | None = None
    ) -> int:
        u, v, w = place
        return self.whole.shaft(member, (u - self.reach, v, w), whole)

    def _planetary(self) -> None:
        name, model = self.stage.name, self.model
        place = self.at[f"{name}.sun"]
        number = model.part(self.whole.unit, "planetary_stage", name)
        assert self.stage.carrier is not None
        frame = model.part(
            number, "planet_carrier", f"{name}.carrier", mass_of_component=self.stage.carrier.mass
        )
        drive = self._shaft(f"{name}.carrier", place, frame)
        model.relate("planet_carrier_shaft", planetary_stage=number, shaft=drive)
        central = {}
        for role in ("sun", "ring"):
            shaft = self._shaft(f"{name}.{role}", place)
            model.relate("central_shaft", planetary_stage=number, shaft=shaft)
            central[role] = self._gears(role, shaft, f"{name}.{role}", place)
        (u, v, w), arm, bearing = place, self.geometry.center_distance, self.stage.planet_bearing
        for k, angle in enumerate(self.stage.planet_angles):
            planet = f"{name}.planet_{k + 1}"
            centre = (u, v + arm * math.cos(angle), w + arm * math.sin(angle))
            shaft = self._shaft(planet, centre)
            pin = model.part(
                frame,
                "shaft",
                f"{planet} pin",
                support_vector=(u - self.reach, *centre[1:]),
                **axes(),
            )
            model.relate("planet_shaft", planetary_stage=number, shaft=shaft)
            model.relate("planet_pin", planetary_stage=number, shaft=pin)
            halves_of_planet = self._gears("planet", shaft, planet, centre)
            for _ in range(bearing.count):
                self._bearing(pin, shaft, f"{planet} bearing", bearing, centre, 1.0 / bearing.count)
            for role, mates in central.items():
                for pair in zip(mates, halves_of_planet, strict=True):
                    label = f"{name}.{role} – {planet}"
                    self.gears.mesh(number, role, pair, label, loaded=self.loaded)

    def _parallel(self) -> None:
        name, gears = self.stage.name, []
        for role, part in (("sun", "pinion"), ("planet", "gear")):
            place = self.at[f"{name}.{part}"]
            shaft = self._shaft(f"{name}.{part}", place)
            gears.append(self._gears(role, shaft, f"{name}.{part}", place))
        for pinion, gear in zip(*gears, strict=True):
            self.gears.mesh(self.whole.unit, "sun", (pinion, gear), name, loaded=self.loaded)

    def _support(self, part: str) -> None:
        """Springs to the casing; of a held member a coupling, which takes its torque."""
        member = f"{self.stage.name}.{part}"
        support = self.stage.member(part).support
        shaft, place = self.whole.shafts[member], self.at[member]
        copies = 2 if part == "ring" and self.stage.double_helical else 1  # halves with one each
        if member not in self.whole.case.held_members():
            if support.matrix.any():
                casing = self.whole.casing
                self._bearing(shaft, casing, f"{member} bearing", support, place, copies)
            return
        torsion = _torsion(support, self.geometry.radii, part)
        springs = _springs(support, copies)
        if torsion > 0:  # else it is held rigidly, which is a coupling without stiffness
            springs["rotational_stiffness"] = torsion * copies
        place = (place[0] + support.z, *place[1:])
        self.model.side(
            "coupling", shaft, self.whole.casing, f"{member} held", support_vector=place, **axes(),
            **springs,
        )  # fmt: skip

    def _bearing(
        self,
        inner: int,
        outer: int,
        name: str,
        springs: Support,
        place: tuple[float, float, float],
        share: float,
    ) -> None:
        kind, clearance = "concept_bearing", "radial_clearance"
        rating: dict[str, Written | None] = {}
        if isinstance(springs, PlanetBearing) and springs.dynamic_rating is not None:
            kind, clearance = "rolling_bearing_with_catalog_geometry", "radial_bearing_clearance"
            ball = springs.rolling == "ball"
            rating = {
                "radial_dynamic_load_rating": springs.dynamic_rating,
                "radial_static_load_rating": springs.static_rating,
                "fatigue_limit_load": springs.fatigue_load_limit,
                "bearing_type": "radial_grooved_ball_bearing" if ball else "radial_roller_bearing",
            }
        of_diameter = {clearance: 2 * springs.clearance or None}
        centre = (place[0] + springs.z, *place[1:])
        self.model.side(
            kind, inner, outer, name, support_vector=centre, **axes(), **_springs(springs, share),
            **rating, **of_diameter,
        )  # fmt: skip


def _is_written(load: MemberLoad) -> bool:
    """Whether REXS has an attribute for a load: constant, in fixed axes, no torque."""
    return not load.is_history and load.frame == "fixed" and load.moment[2] == 0


def _force_attributes(load: Array) -> dict[str, float]:
    """Attributes of a load, force N and moment N m (6,) along x, y, z = v, w, u."""
    x, y, z, mx, my, _ = (float(part) for part in load)
    return {
        "force_u_direction": z, "force_v_direction": x, "force_w_direction": y,
        "torque_around_v_axis": mx, "torque_around_w_axis": my,
    }  # fmt: skip


def _torsion(springs: Joint | Support, radii: StageRadii, part: str) -> float:
    """Stiffness about the axis, N m/rad, with what acts along the base circle of a member."""
    role = {"pinion": "sun", "gear": "planet", "carrier": "center_distance"}.get(part, part)
    radius: float = getattr(radii, role)
    return springs.stiffness[5] + springs.tangential * radius**2


def _springs(springs: Springs, share: float) -> dict[str, Written | None]:
    """Radial, axial and bending stiffness; without the rotational one, since a coupling of zero
    rotational stiffness would hold nothing."""
    x, y, axial, tilt_x, tilt_y, _ = springs.stiffness
    return {
        "radial_stiffness": share * (x + y) / 2,
        "axial_stiffness": share * axial,
        "bending_stiffness": share * (tilt_x + tilt_y) / 2,
    }
