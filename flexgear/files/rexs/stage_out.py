"""A stage as REXS components: shafts, gears with flanks and tools, gear meshes, supports, results.

The datum face of every gear is at its −z end, the negative end of its u axis. In a parallel stage
the pinion has the role of the sun and the gear that of the planet.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from flexgear.files.rexs import tables as table
from flexgear.files.rexs.outgoing import Place, TrainOut, Written, located
from flexgear.gears.bearings.basic_life import thrust_factors
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import tooth_sides
from flexgear.gears.radii import StageRadii, gears_by_role
from flexgear.gears.tool import CutterTool
from flexgear.model.bearings import Bearing, Rolling, Springs
from flexgear.model.bodies import Shaft
from flexgear.model.member import Support
from flexgear.model.modifications import FlankModifications
from flexgear.model.names import GroupName, MemberName, SupportName
from flexgear.model.stage import Stage
from flexgear.model.train import Joint

_DATUM, _ORIENTATION = -1, "negative"


class StageOut:
    """Adds one stage to a model.

    words: REXS flank ("left", "right") by member and name of the flank. reach: distance from the
    start of a shaft to the middle of the stage, m. speed: of the gears, by role.
    """

    def __init__(self, train: TrainOut, stage: Stage) -> None:
        self.train, self.stage = train, stage
        self.view = train.case.view(stage.name)
        self.geometry = stage_geometry(self.view)
        self.flow = train.flow.stage(stage.name)
        self.members = gears_by_role(stage)
        sides = tooth_sides(stage.kind, self.flow.sun_gear_mesh_force >= 0)
        self.words = {
            key: table.word_of(side, key[0] == "ring", _DATUM) for key, side in sides.items()
        }
        self.loaded = train.case.output is not None
        self.halves = (-1, 1) if stage.double_helical else (0,)
        self.reach = stage.face_width / 2 - self._middle(self.halves[0])
        beam = stage.sun.shaft if stage.sun else None
        below = () if beam is None or beam.direction == "+z" else beam.sections
        self.sun_reach = max(self.reach, sum(section.length for section in below))
        flow = self.flow
        self.speed = {"sun": flow.sun_speed, "ring": flow.ring_speed, "planet": flow.planet_speed}

    def add(self) -> None:
        """Add stage, shafts, gears, gear meshes, supports and results."""
        if self.stage.kind == "planetary":
            self._planetary()
        else:
            self._parallel()
        for part in self.stage.members:
            self._support(part)
        if self.stage.sun is not None and self.stage.sun.shaft is not None:
            self._sun_shaft(self.stage.sun.shaft)

    def _planetary(self) -> None:
        name, stage, train = self.stage.name, self.stage, self.train
        u, v, w = place = train.places[f"{name}.sun"]
        number = train.part(train.unit, "planetary_stage", name)
        assert stage.carrier is not None
        frame = train.part(
            number, "planet_carrier", f"{name}.carrier", mass_of_component=stage.carrier.mass
        )
        drive = self._shaft(f"{name}.carrier", place, frame)
        train.relate("planet_carrier_shaft", planetary_stage=number, shaft=drive)
        central = {}
        for role in ("sun", "ring"):
            shaft = self._shaft(f"{name}.{role}", place)
            train.relate("central_shaft", planetary_stage=number, shaft=shaft)
            central[role] = self._gears(role, shaft, f"{name}.{role}", place)
        arm, bearing = self.geometry.center_distance, stage.planet_bearing
        for k, angle in enumerate(stage.planet_angles):
            planet = f"{name}.planet_{k + 1}"
            centre = (u, v + arm * math.cos(angle), w + arm * math.sin(angle))
            shaft = self._shaft(planet, centre)
            begin = (u - self.reach, *centre[1:])
            pin = train.part(frame, "shaft", f"{planet} pin", **located(begin))
            train.relate("planet_shaft", planetary_stage=number, shaft=shaft)
            train.relate("planet_pin", planetary_stage=number, shaft=pin)
            gears = self._gears("planet", shaft, planet, centre)
            train.bearings[MemberName.of(name, f"planet_bearing_{k + 1}")] = [
                self._bearing(pin, shaft, f"{planet} bearing", bearing, centre, 1.0 / bearing.count)
                for _ in range(bearing.count)
            ]
            for role, mates in central.items():
                for pair in zip(mates, gears, stage.sides, strict=True):
                    self._gear_mesh(number, role, pair, f"{name}.{role} – {planet}")

    def _parallel(self) -> None:
        gears = []
        for role, part in (("sun", "pinion"), ("planet", "gear")):
            member = f"{self.stage.name}.{part}"
            place = self.train.places[member]
            gears.append(self._gears(role, self._shaft(member, place), member, place))
        for pair in zip(*gears, self.stage.sides, strict=True):
            self._gear_mesh(self.train.unit, "sun", pair, self.stage.name)

    def _middle(self, half: int) -> float:
        """Axial distance from the middle of the stage to that of a half, m.

        half: −1 left, 1 right, 0 for a stage with one helix.
        """
        return half * (self.stage.face_width + self.stage.half_gap) / 2

    def _shaft(self, member: str, place: Place, whole: int | None = None) -> int:
        reach = self.sun_reach if member == f"{self.stage.name}.sun" else self.reach
        begin = (place[0] - reach, *place[1:])
        return self.train.shaft(member, begin, self.train.unit if whole is None else whole)

    def _sun_shaft(self, beam: Shaft) -> None:
        """Add the sections of the sun's shaft and its spline.

        The spline connects to the casing if the sun is held, else to a shaft with the port's
        bearing.
        """
        train, member = self.train, f"{self.stage.name}.sun"
        shaft, at, held = train.shafts[member], self.sun_reach, member in train.case.held_members()
        for section in beam.sections:
            end = max(at + (section.length if beam.direction == "+z" else -section.length), 0.0)
            sizes = table.written(section, table.SHAFT_SECTION)
            train.part(shaft, "shaft_section", u_coordinate_on_shaft=min(at, end), **sizes)
            at = end
        u, v, w = train.places[member]
        end_place = (u + at - self.sun_reach, v, w)
        if held:
            behind = train.casing
        else:
            behind = train.part(train.unit, "shaft", f"{member} end", **located(end_place))
            train.ends[member] = behind
        springs = springs_out(beam.spline, 1.0) | {"rotational_stiffness": beam.spline.stiffness[5]}
        train.side(
            "coupling", shaft, behind, f"{member} spline", **located(end_place), **springs,
            u_coordinate_on_shaft_inner_side=at,
            u_coordinate_on_shaft_outer_side=None if held else 0.0,
        )  # fmt: skip
        port = train.case.port_at(member)
        if port is not None and port.bearing is not None:
            name = f"{member} end bearing"
            number = self._bearing(behind, train.casing, name, port.bearing, end_place, 1.0)
            train.bearings[SupportName.of(f"{self.stage.name}.output")] = [number]

    def _gears(self, role: str, shaft: int, name: str, place: Place) -> list[int]:
        """Add a gear for each half of the stage, with its speed; returns their ids.

        place: position of the middle of the stage on the gear's axis.
        """
        stage, gear, tooth = self.stage, self.members[role], self.geometry.gears[role]
        ring, (u, v, w) = role == "ring", place
        reach = self.sun_reach if name == f"{stage.name}.sun" else self.reach
        base = tooth.base_radius if gear.base_diameter is None else gear.base_diameter / 2
        right = (stage.planet_hand == "right") != (role == "sun")  # hand of a single or left half
        numbers, grade = [], gear.rating.accuracy_grade
        for half in self.halves:
            helix = stage.helix_angle * (1 if right != (half > 0) else -1)
            middle = self._middle(half)
            number = self.train.part(
                shaft,
                "ring_gear" if ring else "cylindrical_gear",
                name,
                number_of_teeth=gear.teeth,
                normal_module=stage.normal_module,
                face_width=stage.face_width,
                helix_angle_reference_diameter=helix + 0.0,  # makes −0 positive
                tip_diameter=2 * tooth.tip_radius,
                root_diameter=2 * tooth.root_radius,
                base_diameter=2 * base,
                reference_diameter_cylindrical_gear=2 * tooth.reference_radius,
                u_coordinate_on_shaft=reach + middle,
                **located((u + middle, v, w)),
                datum_face_orientation=_ORIENTATION,
                mass_of_component=(
                    None if gear.mass is None else gear.mass / (1 if ring else len(self.halves))
                ),
                inner_diameter=None if ring else gear.bore_diameter or None,
                **table.written(gear.rating, table.GEAR_SURFACE),
                **{table.ACCURACY[0]: None if grade is None or grade > 11 else str(grade)},
            )
            material = self.train.material(gear.rating)
            self.train.relate("reference", origin=number, referenced=material)
            if ring and gear.rim_thickness is not None:
                self.train.part(number, "gear_body", gear_body_rim_thickness=gear.rim_thickness)
            self._flanks(number, role, half)
            if self.train.case.ports:
                self.train.result(number, rotational_speed=self.speed[role])
            numbers.append(number)
        return numbers

    def _gear_mesh(self, whole: int, role: str, pair: tuple[int, int, str], name: str) -> None:
        """Add a cylindrical_stage with its force. pair: ids of the gear of this role and of the
        planet, and side."""
        *gears, side = pair
        group = GroupName.of(self.stage.name, self.view.part(role), side)
        geometry, rules = self.geometry.gear_meshes[role], self.train.case.rating
        forced = rules.forced(group.stage, role)
        number = self.train.part(
            whole,
            "cylindrical_stage",
            name,
            center_distance=self.geometry.center_distance,
            common_face_width=self.stage.face_width,
            minimum_normal_backlash=geometry.backlash,
            maximum_normal_backlash=geometry.backlash,
            radial_contact_ratio=geometry.transverse_contact_ratio,
            overlap_contact_ratio=geometry.overlap_ratio or None,
            total_contact_ratio=geometry.total_contact_ratio,
            **table.written(forced, [table.APPLICATION_FACTOR], at=rules.edition == 2006),
        )
        self.train.gear_data.setdefault((group, ""), []).append(number)
        if self.loaded:
            force = abs(self.flow.gear_mesh_forces[role]) * math.cos(self.geometry.base_helix_angle)
            self.train.result(number, nominal_tangential_force_at_base_diameter=force)
        self.train.relate("stage", stage=number, gear_1=gears[0], gear_2=gears[1])
        for gear, of in zip(gears, (role, "planet"), strict=True):
            data = self.train.add(
                "cylindrical_stage_gear_data",
                operating_pressure_angle_in_the_transverse_section=geometry.working_angle,
            )
            self.train.relate("stage_gear_data", stage=number, gear=gear, stage_gear_data=data)
            self.train.gear_data.setdefault((group, of), []).append(data)
            if self.loaded:
                part = self.view.part(of)
                flank = self.words[part, role if part == "planet" else "drive"]
                self.train.result(data, **{table.LOADED: flank})

    def _flanks(self, number: int, role: str, half: int) -> None:
        """Add both flanks of a gear, and its tool."""
        gear, tool = self.members[role], self.geometry.gears[role].tool
        flanks = {
            word: self.train.add(
                "cylindrical_gear_flank",
                normal_pressure_angle=self.stage.pressure_angle,
                addendum_modification_coefficient=gear.profile_shift,
            )
            for word in table.WORDS
        }
        self.train.relate("flank", gear=number, left=flanks["left"], right=flanks["right"])
        cutter = tool if isinstance(tool, CutterTool) else None
        made_by = self.train.add(
            "cutter_wheel_tool" if cutter else "rack_shaped_tool",
            number_of_teeth=round(cutter.teeth) if cutter else None,
            addendum_modification_coefficient=gear.tool.profile_shift if cutter else None,
            tip_diameter=2 * cutter.tip_circle if cutter else None,
            tip_corner_radius_factor_reference_profile=tool.tip_radius / self.stage.normal_module,
            addendum_coefficient_reference_profile=None if cutter else gear.dedendum,
            **(table.written(gear.tool, table.PROTUBERANCE) if gear.tool.protuberance else {}),
        )
        settings = self.train.add(
            "cylindrical_gear_manufacturing_settings",
            machining_allowance=gear.tool.grinding_allowance or None,
        )
        names = {
            word: name for (of, name), word in self.words.items() if of == self.view.part(role)
        }
        for word, flank in flanks.items():
            self.train.relate(
                "manufacturing_step",
                1,
                workpiece=flank,
                tool=made_by,
                manufacturing_settings=settings,
            )
            modifications = gear.modifications.of(names[word])
            for component in self._modifications(modifications, table.outward(_DATUM, half)):
                self.train.relate("reference", origin=flank, referenced=component)

    def _modifications(self, modifications: FlankModifications, datum: int) -> Iterator[int]:
        """Add the modifications of one flank; yields their ids.

        datum: +1 if the positive z of a modification is towards the datum face, else −1. Slopes are
        positive if more is missing at the tip or at the non-datum face, as in ``tables``.
        """
        for kind, m in table.MODIFICATIONS.items():
            part: Any = getattr(modifications, m.section) if m.section else modifications
            end = "+z" if m.face * datum > 0 else "-z"
            if part is None or (m.face and part.end not in ("both", end)):
                continue
            sizes = table.written(part, m.sizes, -datum if m.by_face else 1)
            if sizes:
                words = {"shape_of_relief": part.form} if m.section else m.words
                yield self.train.add(kind, **words, **sizes)

    def _support(self, part: str) -> None:
        """Springs to the casing; of a held member couplings, which take its torque."""
        member, casing = f"{self.stage.name}.{part}", self.train.casing
        shaft, (u, v, w) = self.train.shafts[member], self.train.places[member]
        copies = 2 if part == "ring" and self.stage.double_helical else 1  # halves with one each
        spline = self.stage.form(part) == "beam"  # which takes the torque of a held sun
        held = not spline and member in self.train.case.held_members()
        supports = self.stage.member(part).supports
        for number, (key, support) in enumerate(supports.items(), 1):
            which = f" {number}" if len(supports) > 1 else ""
            if held:
                springs = springs_out(support, copies)
                torsion = torsion_out(support, self.geometry, part)
                if torsion > 0:  # a coupling without this attribute is rigid
                    springs["rotational_stiffness"] = torsion * copies
                place = located((u + support.z, v, w))
                self.train.side(
                    "coupling", shaft, casing, f"{member} held{which}", **place, **springs
                )
            elif support.matrix.any():
                name = f"{member} bearing{which}"
                component = self._bearing(shaft, casing, name, support, (u, v, w), copies)
                names = self.view.support_names(part, key)
                self.train.bearings |= {each: [component] for each in names if copies == 1}

    def _bearing(
        self, inner: int, outer: int, name: str, springs: Bearing, place: Place, share: float
    ) -> int:
        kind, clearance = "concept_bearing", "radial_clearance"
        rating: dict[str, Written | None] = {}
        if springs.dynamic_rating is not None:
            kind, clearance = "rolling_bearing_with_catalog_geometry", "radial_bearing_clearance"
            ball = springs.rolling == "ball"
            rating = {**table.written(springs, table.RATING), **thrust_out(springs)}
            rating["bearing_type"] = f"radial_{'grooved_ball' if ball else 'roller'}_bearing"
        return self.train.side(
            kind, inner, outer, name, **located((place[0] + springs.z, *place[1:])),
            **springs_out(springs, share), **rating, **{clearance: 2 * springs.clearance or None},
        )  # fmt: skip


def springs_out(springs: Springs, share: float) -> dict[str, Written | None]:
    """REXS attributes of radial, axial and bending stiffness, each times ``share``. Rotational
    stiffness is left out, since a coupling with a value of zero transmits no torque."""
    x, y, axial, tilt_x, tilt_y, _ = springs.stiffness
    values = ((x + y) / 2, axial, (tilt_x + tilt_y) / 2)
    return {row.names[0]: share * k for row, k in zip(table.SPRINGS, values, strict=False)}


def thrust_out(bearing: Rolling) -> dict[str, Written | None]:
    """REXS attributes of the factors of P under thrust; none if they depend on the load or on the
    other bearing of a pair."""
    thrust = bearing.thrust
    if thrust is None or thrust.contact_angle == 0.0 or thrust.direction is not None:
        return {}
    factors = thrust_factors(bearing, np.zeros(1))
    below: dict[str, Written | None] = {table.RADIAL_BELOW_E: 1.0}
    return below | {row.names[0]: float(getattr(factors, row.field)) for row in table.THRUST}


def torsion_out(springs: Joint | Support, radii: StageRadii, part: str) -> float:
    """Torsional stiffness, N m/rad, including the tangential stiffness at a member's radius."""
    return springs.stiffness[5] + springs.tangential * radii.rotation_radius(part) ** 2
