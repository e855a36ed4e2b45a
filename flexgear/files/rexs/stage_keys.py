"""Keys of one stage: module, angles, face width, centre distance, profile shifts, backlash."""

import cmath
import math

from flexgear.files.case_text import CaseText, Datum
from flexgear.files.rexs.document import Component, mark, mean, number
from flexgear.files.rexs.gears import GearReader, base_diameter
from flexgear.files.rexs.stages import RexsGearMesh, RexsStage
from flexgear.gears.geometry import RULE, least_backlash
from flexgear.gears.tooth import PlainRack, involute, reference_radius, transverse_angle
from flexgear.model.errors import InputError

_ROUNDING = 1e-3  # modules, or rad, by which redundant values of a file may differ
_ENDS = ("minimum_normal_backlash", "maximum_normal_backlash")
_MIN_SHIFT = 1e-6  # smaller profile shifts are written as 0


class StageWriter:
    """Writes one stage into a case.

    teeth: numbers of teeth by role. distance: centre distance, mm. shift_sums: sums of profile
    shifts for zero backlash, by gear mesh, None if they cannot be computed.
    """

    def __init__(
        self, gears: GearReader, case: CaseText, where: str, stage: RexsStage, name: str
    ) -> None:
        self.document, self.gears, self.case, self.where = gears.document, gears, case, where
        self.stage = stage
        case.stage = name
        self.section = section = case.section("[[stages]]")
        section.put("name", name, stage.component.label)
        section.put("kind", stage.kind, f"{stage.component.kind} with {', '.join(stage.roles)}")
        if stage.kind == "planetary":
            count = len(stage.halves["planet"][0])
            section.put("planets", count, f"planet gears of {stage.component.label}")
        self.rack = self._rack()
        self._widths()
        self.teeth = {role: self._teeth(role) for role in stage.roles}
        self.distance = self._distance()
        self.shift_sums = {role: self._shift_sum(role) for role in stage.gear_meshes}

    @property
    def center_distance(self) -> float:
        """Centre distance in the file, else the reference centre distance of the first pair, mm."""
        if self.distance is not None:
            return self.distance.value
        return reference_radius(sum(self.teeth[r].value for r in self.stage.roles[:2]), self.rack)

    def write(self) -> PlainRack:
        """Write [[stages]] and the sections of its gears; InputError if data are missing."""
        self._angles()
        if self.stage.kind == "planetary":
            self._positions()
        else:
            self._position()
        shifts = self._shifts()
        self._backlash(shifts)
        for role in self.stage.roles:
            self._gear(role, shifts[role])
        return self.rack

    def _missing(self, what: Component, attribute: str) -> InputError:
        return InputError(
            self.where, f"{what.label}, {attribute}", "is missing or no number in a known unit",
            "write it in the program that the file comes from",
        )  # fmt: skip

    def _wrong(self, datum: Datum, problem: str, remedy: str = "") -> InputError:
        what = f"{datum.value:g} {problem}"
        return InputError(self.where, datum.source, what, f"correct it{remedy}")

    def _teeth(self, role: str) -> Datum:
        """Number of teeth, positive; InputError if it is missing or no whole number."""
        datum = number(self.stage.gears(role), "number_of_teeth", "none")
        if datum is None:
            raise self._missing(self.stage.gears(role)[0], "number_of_teeth")
        if datum.value != round(datum.value):
            raise self._wrong(datum, "is not a whole number")
        return Datum(abs(datum.value), datum.source)

    def _rack(self) -> PlainRack:
        every = self.stage.all_gears
        module = number(every, "normal_module", "mm")
        if module is None or module.value <= 0:
            raise self._missing(every[0], "normal_module")
        self.section.put("normal_module_mm", module.value, module.source)
        flanks = self.gears.flanks(every)
        tools = self.gears.tools(every)
        pressure = number([*flanks, *tools], "normal_pressure_angle", "deg")
        degrees = self.section.take_or_assume("pressure_angle_deg", pressure, 20.0, "usual")
        if pressure is not None and not 0 < pressure.value < 45:
            raise self._wrong(pressure, "deg is no pressure angle", "; 20 deg is usual")
        helix = self._helix()
        return PlainRack(module.value, math.radians(degrees), helix)

    def _helix(self) -> float:
        """Write helix angle, hand and double_helical; returns the helix angle, rad."""
        role = "planet" if self.stage.kind == "planetary" else "gear"
        key = "helix_angle_reference_diameter"
        datum = number(self.stage.halves[role][0], key, "deg")
        for half in (h for s in self.stage.roles for h in self.stage.halves[s]):
            number(half, key, "deg")  # marks the angle as used; hands are compared below
        if datum is None:
            self.section.assume("helix_angle_deg", 0, "no helix angle in the file: spur")
            return 0.0
        if abs(datum.value) >= 90.0:
            raise self._wrong(datum, "deg is no helix angle", "; most are below 35 deg")
        self.section.put("helix_angle_deg", abs(datum.value), datum.source)
        if datum.value == 0:
            return 0.0
        hand = "right" if datum.value > 0 else "left"
        self.section.put(
            "planet_hand", hand, f"its sign, positive right-handed (ISO 21771); of the {role}"
        )
        mate = number(self.stage.halves["sun" if role == "planet" else "pinion"][0], key, "deg")
        if mate is not None and mate.value * datum.value > 0:
            self.case.warn(
                f"{mate.source}: has the hand of its mate, {datum.source}; external gears must"
                " have opposite hands; the hand of the former was changed"
            )
        if len(self.stage.halves[role]) == 2:
            self.section.put("double_helical", True, "two gears of opposite hand on each shaft")
        return math.radians(abs(datum.value))

    def _widths(self) -> None:
        gears = self.stage.all_gears
        width = number(self.stage.pairs, "common_face_width", "mm")
        widths = [w for gear in gears if (w := number([gear], "face_width", "mm")) is not None]
        if width is None and widths:
            width = min(widths, key=lambda w: w.value)
            if any(w.value != width.value for w in widths):
                width = Datum(width.value, f"{width.source}; the narrowest of the stage's gears")
        if width is None or width.value <= 0:
            raise self._missing(gears[0], "face_width")
        self.section.put("face_width_mm", width.value, width.source)
        role = self.stage.roles[0]
        if len(self.stage.halves[role]) == 2:
            left, right = (
                number(half, "u_coordinate_on_shaft", "mm") for half in self.stage.halves[role]
            )
            if left is not None and right is not None:
                gap = abs(right.value - left.value) - width.value
                why = f"{right.source} and of its left half, less the face width"
                self.section.put("half_gap_mm", max(gap, 0.0), why)
            else:
                self.section.assume("half_gap_mm", self.rack.normal_module, "one module")

    def _distance(self) -> Datum | None:
        """Write the centre distance, or else the distance of two gears; None without both."""
        first, second = (self.stage.gears(role)[0] for role in self.stage.roles[:2])
        datum = number(self.stage.pairs, "center_distance", "mm")
        if datum is not None and datum.value != 0:
            datum = Datum(abs(datum.value), datum.source)  # internal pairs may have a minus sign
        elif offset := self._offset(first, second):
            datum = Datum(abs(offset), f"positions of {first.label} and {second.label}")
        else:
            return None
        self.section.put("center_distance_mm", datum.value, datum.source)
        return datum

    def _angles(self) -> None:
        """Write working pressure angles of the file that do not follow from the geometry."""
        for role, gear_meshes in self.stage.gear_meshes.items():
            data = [
                component
                for gear_mesh in gear_meshes
                for component in self.document.linked(
                    gear_mesh.stage, "stage", "stage_gear_data", "stage_gear_data"
                )
            ]
            mark(data, "a gear mesh")
            datum = number(data, "operating_pressure_angle_in_the_transverse_section", "deg")
            if datum is None:
                continue
            arm = self._arm(role)
            derived = None
            if self.distance is not None and arm < self.distance.value:
                derived = math.acos(arm / self.distance.value)
            if derived is None or abs(derived - math.radians(datum.value)) > _ROUNDING:
                self.section.put(f"{role}_pressure_angle_deg", datum.value, datum.source)

    def _positions(self) -> None:
        """Write the angles of the planets from the first one if they are not equally spaced, else
        whether equally spaced planets do not fit the teeth."""
        planets, ring = self.stage.halves["planet"][0], self.stage.gears("ring")[0]
        angles = [self._direction(ring, planet) for planet in planets]
        if None in angles:
            of_sun = [m for p in planets for m in self.stage.gear_meshes["sun"] if p in m.gears]
            stated = map(self._stated_direction, of_sun)
            angles = [None if datum is None else datum.value for datum in stated]
        present, count = [angle for angle in angles if angle is not None], len(planets)
        relative = sorted(math.remainder(a - present[0], 360.0) % 360.0 for a in present)
        errors = [math.remainder(a - 360.0 * n / count, 360.0) for n, a in enumerate(relative)]
        sun, ring_teeth = self.teeth["sun"].value, self.teeth["ring"].value
        if len(present) >= count and max(map(abs, errors)) >= 1e-6:
            why = "angles of the planets' shafts from the first one, from v to w"
            self.section.put("planet_positions_deg", relative, why)
        elif round(sun + ring_teeth) % count:
            why = f"({sun:g} + {ring_teeth:g})/{count} is not whole"
            self.section.assume("allow_unassemblable", True, why)

    def _offset(self, first: Component, second: Component) -> complex | None:
        """Offset v + i w from one gear's axis to another's, mm; None if a position is unknown.

        The position of a gear is that of its shaft, or else its own. A ring without either is at
        the origin.
        """
        frames = self.gears.assembly.frames
        ends = [
            frames.of(frames.shaft(gear) or gear) or frames.of(gear) for gear in (first, second)
        ]
        if ends[1] is None or (ends[0] is None and first.kind != "ring_gear"):
            return None
        _, v, w = ends[1].origin - (0.0 if ends[0] is None else ends[0].origin)
        return complex(v, w)

    def _direction(self, first: Component, second: Component) -> float | None:
        """Direction from one gear's axis to another's, deg from v to w about u."""
        offset = self._offset(first, second)
        return math.degrees(cmath.phase(offset)) if offset else None

    def _stated_direction(self, gear_mesh: RexsGearMesh) -> Datum | None:
        """Direction from the first to the second gear of a gear mesh in the file, deg."""
        angle = number([gear_mesh.stage], "rotating_angle_around_neg_u_axis", "deg")
        return None if angle is None else Datum(90.0 - angle.value, angle.source)

    def _position(self) -> None:
        """Write the direction from pinion to gear."""
        pinion, gear = (self.stage.gears(role)[0] for role in self.stage.roles)
        direction, gear_mesh = self._direction(pinion, gear), self.stage.gear_meshes["sun"][0]
        if direction is not None:
            why = f"positions of {pinion.label} and {gear.label}, from v to w"
            self.section.put("position_deg", direction, why)
        elif (stated := self._stated_direction(gear_mesh)) is not None:
            degrees = stated.value + (0.0 if gear_mesh.gears[0] is pinion else 180.0)
            self.section.put("position_deg", math.remainder(degrees, 360.0), stated.source)
        else:
            self.section.assume("position_deg", 0, "no positions of the shafts")

    def _backlash(self, shifts: dict[str, Datum]) -> None:
        """Write the normal backlash of each gear mesh that the case adds to that of the shifts.

        Profile shifts and centre distance alone give the normal backlash
        2 m_n sin α_n (Σx_0 − Σx), with Σx_0 the sum of shifts for zero backlash. If the file states
        no backlash, the rule of the case applies (``least_backlash``).
        """
        tolerance = _ROUNDING * self.rack.normal_module
        for role, gear_meshes in self.stage.gear_meshes.items():
            stages = [gear_mesh.stage for gear_mesh in gear_meshes]
            total = number(stages, "mean_normal_backlash", "mm") or mean(stages, _ENDS, "mm")
            sum_of_shifts = sum(shifts[end].value for end in self._pair(role))
            zero_backlash_sum = self.shift_sums[role]
            of_shifts = 0.0 if zero_backlash_sum is None else zero_backlash_sum - sum_of_shifts
            of_shifts *= 2 * self.rack.normal_module * math.sin(self.rack.pressure_angle)
            key = f"backlash_{role}_mm"
            if total and total.value >= 0 and total.value - of_shifts >= -tolerance:
                extra = round(max(total.value - of_shifts, 0.0), 12)  # to the picometre
                self.section.put(key, extra, f"{total.source}, less that of profile shifts")
                continue
            allowance = self._allowances(gear_meshes)
            if allowance is not None and of_shifts + allowance.value >= -tolerance:
                self.section.put(key, allowance.value, allowance.source)
            elif of_shifts < -tolerance and self.distance is not None:
                least = 1e3 * least_backlash(
                    1e-3 * self.distance.value, 1e-3 * self.rack.normal_module
                )
                overlap = f"teeth overlap by {-of_shifts:.4g} mm at the file's centre distance"
                self.section.assume(key, least - of_shifts, f"{overlap}; and {RULE}")

    def _allowances(self, gear_meshes: list[RexsGearMesh]) -> Datum | None:
        """Normal backlash due to the mean tooth-thickness allowances of a gear mesh, mm.

        It is −Σ A_sn cos α_n for deviations A_sn of the chordal thickness, or −Σ A_W for deviations
        A_W of the base tangent length (external gears). Returns None if neither gear has
        allowances, or if they make teeth thicker.
        """
        total, sources = 0.0, []
        for k in range(2):
            gears = [gear_mesh.gears[k] for gear_mesh in gear_meshes]
            ring = any(gear.kind == "ring_gear" for gear in gears)
            for name, ratio in (
                ("chordal_tooth_thickness_{}_deviation", math.cos(self.rack.pressure_angle)),
                *([] if ring else [("{}_backlash_allowance_referenced_to_span", 1.0)]),
            ):
                deviation = mean(gears, [name.format(end) for end in ("upper", "lower")], "mm")
                if deviation is not None:
                    total -= ratio * deviation.value
                    sources.append(deviation.source)
                    break
        if not sources or total < 0.0:
            return None
        return Datum(total, " and ".join(sources))

    def _shifts(self) -> dict[str, Datum]:
        """Profile shifts by gear.

        The sign of the ring's shift is the one that agrees with the centre distance. A missing
        shift follows from the centre distance for zero backlash, or else is 0.
        """
        shifts = {
            role: self.gears.shift(self.stage.gears(role), self.rack) for role in self.stage.roles
        }
        hub = "planet" if self.stage.kind == "planetary" else "gear"
        ring, of_ring = shifts.get("ring"), self.shift_sums.get("ring")
        planet = shifts.get(hub)
        if ring is not None and planet is not None and of_ring is not None:
            errors = [abs(sign * ring.value + planet.value - of_ring) for sign in (1, -1)]
            if errors[1] < errors[0] - _ROUNDING:
                why = f"{ring.source}; sign changed, which agrees with the centre distance"
                shifts["ring"] = Datum(-ring.value, why)
        for pair, shift_sum in ((self._pair(k), total) for k, total in self.shift_sums.items()):
            missing = [role for role in pair if shifts[role] is None]
            if shift_sum is not None and self.distance is not None:
                rest = shift_sum - sum(d.value for role in pair if (d := shifts[role]) is not None)
                why = f"not in the file; without backlash at {self.distance.source}"
                self._assume_shifts(shifts, missing, rest, why)
        missing = [role for role in self.stage.roles if shifts[role] is None]
        self._assume_shifts(shifts, missing, 0.0, "none in the file")
        return {role: datum for role, datum in shifts.items() if datum is not None}

    def _assume_shifts(
        self, shifts: dict[str, Datum | None], missing: list[str], total: float, why: str
    ) -> None:
        """Share a sum of profile shifts equally among the gears whose shift is not in the file."""
        for role in missing:
            value = total / len(missing)
            value = 0.0 if abs(value) < _MIN_SHIFT else value
            shifts[role] = Datum(value, f"assumed: {why}")
            self.case.warn(f"{self.stage.gears(role)[0].label}: profile_shift = {value:g}: {why}")

    def _gear(self, role: str, shift: Datum) -> None:
        gears, teeth = self.stage.gears(role), self.teeth[role]
        section = self.case.section(f"[stages.{role}]")
        section.put("teeth", int(teeth.value), teeth.source)
        section.put("profile_shift", shift.value, shift.source)
        base = number(gears, ("base_diameter", "base_circle_diameter"), "mm")
        error = 0.0 if base is None else abs(base.value) - base_diameter(teeth.value, self.rack)
        if base is not None and abs(error) > _ROUNDING * self.rack.normal_module:
            why = f"{base.source}; differs from that of its teeth"
            section.put("base_diameter_mm", abs(base.value), why)
        self.gears.write(section, self.stage, role, self.rack, int(teeth.value), shift.value)

    def _pair(self, role: str) -> tuple[str, str]:
        """The two gears of a gear mesh, planet or gear first."""
        return ("planet", role) if self.stage.kind == "planetary" else ("gear", "pinion")

    def _arm(self, role: str) -> float:
        """Sum (internal pairs: difference) of the base radii of a gear mesh, mm."""
        hub, mate = (base_diameter(self.teeth[k].value, self.rack) / 2 for k in self._pair(role))
        return mate - hub if role == "ring" else mate + hub

    def _shift_sum(self, role: str) -> float | None:
        """Sum of profile shifts of a gear mesh for zero backlash; None if it cannot be computed.

        Σx = (z_1 + z_2)(inv α_w − inv α_t)/(2 tan α_n), the ring's z negative (ISO 21771).
        """
        arm = self._arm(role)
        if self.distance is None or not 0 < arm < self.distance.value:
            return None
        hub, mate = (self.teeth[key].value for key in self._pair(role))
        gain = involute(math.acos(arm / self.distance.value)) - involute(
            transverse_angle(self.rack)
        )
        total = hub + (-mate if role == "ring" else mate)
        return total * gain / (2 * math.tan(self.rack.pressure_angle))
