"""The commented case file of proposed stages, alone or in series."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from flexgear.files.case_text import CaseText, Value, commented
from flexgear.gears import surroundings as around
from flexgear.gears.sizing import FACTOR, FLANK, FORM, ROOT, Proposal

Fields = dict[str, tuple[Value, str]]  # by key: value and why
RPM = 30 / math.pi
RATED, ASKED = "rated", "as asked"
TEETH = ("normal_module_mm", "face_width_mm", "profile_shift")
AXES = {  # side of the carrier's flange, of the ring's bolts, of the sun's shaft
    "planetary": ("-z", "-z", "+z"),
    "star": ("-z", "+z", "-z"),
    "solar": ("-z", "+z", "+z"),
}


@dataclass(frozen=True)
class Rated:
    """Torque (N m) and speed (rad/s) of the driving end of stages in series: the slow member of the
    first, or at_sun the fast member of the last."""

    torque: float
    speed: float
    at_sun: bool = False


def new_case_text(stages: Sequence[Proposal], rated: Rated) -> str:
    """The case of stages in series, the slowest first: the fast member of each is joined to the
    slow one of the next."""
    first, last = stages[0], stages[-1]
    names = ["stage"] if len(stages) == 1 else [f"stage_{k}" for k in range(1, len(stages) + 1)]
    members = list(zip(names, stages, strict=True))
    text = CaseText()
    ratio = math.prod(p.ratio for p in stages)
    torque = f"{rated.torque:.6g} N m"
    top = text.section("")
    top.put("title", f"{_kinds(stages)} of ratio {ratio:.4g} for {torque}", "")
    top.put("held", [f"{name}.{p.request.kind.held}" for name, p in members], "")
    _put(text, "[material]", {
        "young_modulus_gpa": (206.0, "chosen: steel"), "poisson_ratio": (0.3, ""),
        "density_kg_per_m3": (7850.0, ""),
    })  # fmt: skip
    for name, p in members:
        _stage(text, "stage" if len(stages) == 1 else "stages", name, p)
    for (name, p), (following, q) in pairwise(members):
        _joint(text, f"{name}.{p.request.kind.fast}", f"{following}.{q.request.kind.slow}", p)
    slow = (f"{names[0]}.{first.request.kind.slow}", first, 1.0)
    fast = (f"{names[-1]}.{last.request.kind.fast}", last, ratio)
    driven, loaded = (fast, slow) if rated.at_sun else (slow, fast)
    inertia = around.port_inertia(first)
    _port(text, "[[inputs]]", *driven, inertia, rated)
    _port(text, "[output]", *loaded, inertia)
    head = [
        f"Proposal: ratio {ratio:.5g}, {torque} at {rated.speed * RPM:.5g} r/min on {driven[0]}.",
        "Every value is a rule of thumb or chosen, and says which; replace them by those of your "
        "machine.",
        f"Flanks: K* = F/(b d1) (u + 1)/u up to {FLANK:g} N/mm², the K* form of ISO 6336-2 "
        f"(Niemann/Winter);",
        f"roots: F/(b m) Y up to {ROOT:g} N/mm² with Y_Fa Y_Sa = {FORM:g}, ISO 6336-3; both with "
        f"{FACTOR:g} times the load.",
    ]
    return commented(head) + "\n" + text.text()


def _kinds(stages: Sequence[Proposal]) -> str:
    kinds = [p.request.arrangement for p in stages]
    if len(kinds) == 1:
        return f"{kinds[0].capitalize()} stage"
    return f"{' and '.join(kinds).capitalize()} stages"


def _put(text: CaseText, header: str, fields: Fields) -> None:
    """A section with these fields, lengths in m; rated figures to nine digits, lengths to four."""
    section = text.section(header)
    for key, (value, why) in fields.items():
        length = key.endswith("_mm")
        digits = 9 if why in (RATED, ASKED) else 5 if key in TEETH else 4 if length else 3
        if isinstance(value, float):
            value = float(f"{value * (1e3 if length else 1.0):.{digits}g}")
        section.put(key, value, why)


def _stage(text: CaseText, table: str, name: str, p: Proposal) -> None:
    stage = "[stage]" if table == "stage" else "[[stages]]"
    named: Fields = {} if table == "stage" else {"name": (name, "")}
    carrier = around.carrier_size(p)
    _put(text, stage, named | _gears(p))
    _put(text, f"[{table}.errors]", _errors(p))
    planet = _gear(p, 1, "the sum Σ of sun and planet fits the ring's centre distance")
    bore = "bearing seat; rim of 1.2 tooth heights, ISO 6336-3"
    _put(text, f"[{table}.planet]", {**planet, "bore_diameter_mm": (carrier.bore, bore)})
    _put(text, f"[{table}.planet_bearing]", _planet_bearing(p))
    _put(text, f"[{table}.sun]", _gear(p, 0, "ISO/TR 4467: λ (u - 1)/(u + 1) + Σ/(u + 1), λ = 0.5"))
    _sun_shaft(text, f"{table}.sun.shaft", p, carrier)
    ring = _gear(p, 2, "x_p + x_r = 0: at their reference distance")
    ring["addendum"] = (p.teeth.ring_addendum, "its tip clears the root of the planets")
    ring["dedendum"] = (p.teeth.ring_dedendum, "its root clears the tips of the planets")
    ring["root_fillet"] = (p.teeth.ring_fillet, "of the tool's tip, ISO 53")
    _put(text, f"[{table}.ring]", ring)
    _ring(text, f"{table}.ring", p)
    _carrier(text, f"{table}.carrier", p, carrier)


def _gears(p: Proposal) -> Fields:
    double = p.request.double_helical
    fields: Fields = {
        "planets": (p.request.planets, f"({p.teeth.sun} + {p.teeth.ring})/{p.request.planets} is "
                    "whole: equal spacings assemble"),
        "normal_module_mm": (
            p.module, ASKED if p.request.module else "DIN 780; by flank and root",
        ),
        "pressure_angle_deg": (20.0, "ISO 53"),
        "face_width_mm": (
            p.face_width,
            "the least that carries flank and root" + (", of each half" if double else ""),
        ),
    }  # fmt: skip
    if p.request.helix:
        fields["helix_angle_deg"] = (math.degrees(p.request.helix), ASKED)
        where = " in the left half (-z)" if double else "; the sun has the other"
        fields["planet_hand"] = ("right", f"of planets and ring{where}")
    if double:
        fields["double_helical"] = (True, "")
        fields["half_gap_mm"] = (p.half_gap, "chosen: six modules for the tool to run out")
    return fields


def _gear(p: Proposal, which: int, why: str) -> Fields:
    teeth = (p.teeth.sun, p.teeth.planet, p.teeth.ring)[which]
    return {"teeth": (teeth, ""), "profile_shift": (p.teeth.shifts[which], why)}


def _errors(p: Proposal) -> Fields:
    size = min(1.2 * math.sqrt(1e3 * p.module) + 2, 1e3 * p.module)
    why = "about ISO 1328 quality 5, or a thousandth of the module"
    return {f"{gear}_tooth_um": (size, why) for gear in ("ring", "planet", "sun")}


def _arm(p: Proposal) -> float:
    """Of rows of rollers from their middle, m."""
    return 0.25 * p.gear_width


def _planet_bearing(p: Proposal) -> Fields:
    slides, bearing = p.request.double_helical, around.bearing_stiffness(p)
    return {
        "radial_n_per_m": (bearing, "two rows of 16 rollers, half of Palmgren's stiffness"),
        "axial_n_per_m": (
            (0.0025 if slides else 0.25) * bearing,
            "chosen: rollers slide; halves place the planet" if slides else "chosen: a quarter",
        ),
        "tilt_nm_per_rad": (
            bearing * _arm(p) ** 2,
            "rows at a quarter of the face from its middle",
        ),
    }


def _bearing(p: Proposal, axial: float, why: str, times: float = 1.0) -> Fields:
    """So many times as stiff as a planet's; axial: share of the radial stiffness."""
    bearing = times * around.bearing_stiffness(p)
    return {
        "radial_n_per_m": (bearing, why),
        "axial_n_per_m": (axial * bearing, ""),
        "tilt_nm_per_rad": (bearing * _arm(p) ** 2, ""),
    }


def _sun_shaft(text: CaseText, at: str, p: Proposal, carrier: around.CarrierSize) -> None:
    slides, bearing = p.request.double_helical, around.bearing_stiffness(p)
    _put(text, f"[{at}]", {"direction": (AXES[p.request.arrangement][2], "")})
    _put(text, f"[[{at}.sections]]", {
        "length_mm": (p.gear_width + 4 * carrier.plate, "through a plate and beyond"),
        "outer_diameter_mm": (carrier.shaft, "solid; 100 N/mm² of shear at rated torque"),
    })  # fmt: skip
    where = "; its end is held" if p.request.kind.held == "sun" else ""
    _put(text, f"[{at}.spline]", {
        "radial_n_per_m": (bearing, f"chosen: stiff in torsion{where}"),
        "axial_n_per_m": (
            (0.01 if slides else 1.0) * bearing,
            "chosen: slides; halves place the sun" if slides else "",
        ),
        "tilt_nm_per_rad": (bearing * _arm(p) ** 2, ""),
        "torsion_nm_per_rad": (p.sun_torque / around.TWIST, _twist()),
    })  # fmt: skip


def _twist() -> str:
    return f"chosen: {1e3 * around.TWIST:g} mrad at rated torque"


def _ring(text: CaseText, ring: str, p: Proposal) -> None:
    at, double, support = f"{ring}.fe", p.request.double_helical, around.ring_support(p)
    bolted = isinstance(support, around.Bolting)
    width = "3 to 3.5 modules (full by ISO 6336-3), with room for the bolts"
    rim: Fields = {"rim_thickness_mm": (support.rim, width if bolted else "chosen: three modules")}
    if isinstance(support, around.Bolting):
        why = "chosen" + ("; the right half is mirrored" if double else "")
        end = "-z" if double else AXES[p.request.arrangement][1]
        _put(text, f"[{at}]", {**rim, "end": (end, why)})
        _put(text, f"[{at}.bolts]", _bolts(support))
    else:
        _put(text, f"[{at}]", rim)
        _put(text, f"[[{at}.splines]]", {
            "z_mm": (0.0, "chosen: outer spline over most of the face"),
            "half_width_mm": (support.half_width, ""),
            "stiffness_radial_n_per_m": (support.across, "chosen: its flanks centre it"),
            "stiffness_axial_n_per_m": (support.across, "chosen: a snap ring"),
            "stiffness_tilt_nm_per_rad": (support.tilt, ""),
            "stiffness_torsion_nm_per_rad": (support.torsion, "chosen: 0.5 mrad at rated torque"),
        })  # fmt: skip
    if p.request.kind.held == "ring":
        return
    hub = around.ring_hub(p, support.rim)
    side = 1.0 if AXES[p.request.arrangement][1] == "+z" else -1.0
    _put(text, f"[{ring}.hub]", {
        "mass_kg": (hub.mass, "chosen: a flange a third as wide as the gears"),
        "inertia_kg_m2": (hub.inertia, ""), "tilt_inertia_kg_m2": (hub.tilt_inertia, ""),
        "z_mm": (side * hub.z, ""),
    })  # fmt: skip
    _put(text, f"[{ring}.hub.bearing]", _bearing(p, 0.5, "chosen: as a planet's"))


def _bolts(b: around.Bolting) -> Fields:
    held = "friction 0.12 holds 1.5 times the torque (VDI 2230)"
    if b.friction < 1.0:
        held = f"friction holds {100 * b.friction:.0f} % of the torque, fitted pins the rest"
    return {
        "number": (b.number, f"grade 10.9; {held}"),
        "circle_diameter_mm": (b.circle, "middle of the rim"),
        "diameter_mm": (b.diameter, ""),
        "stiffness_radial_n_per_m": (b.across, "chosen: friction joint, half of the axial one"),
        "stiffness_tangential_n_per_m": (b.across, ""),
        "stiffness_axial_n_per_m": (b.axial, "E A/l of the clamped sleeve"),
        "stiffness_tilt_nm_per_rad": (b.tilt, "chosen: axial stiffness times d²"),
        "stiffness_twist_nm_per_rad": (0.1 * b.tilt, ""),
    }


def _carrier(text: CaseText, at: str, p: Proposal, c: around.CarrierSize) -> None:
    held = p.request.kind.held == "carrier"
    flange = _bearing(p, 1.0, "chosen: a flange bolted to the housing", times=2.0)
    flange["torsion_nm_per_rad"] = (p.carrier_torque / around.TWIST, _twist())
    located = _bearing(p, 0.25, "chosen: as a planet's; locates axially")
    _put(text, f"[{at}.bearing_drive]", flange if held else located)
    _put(text, f"[{at}.bearing_far]", _bearing(p, 0.25, "chosen"))
    _put(text, f"[{at}.fe]", {
        "drive_side": (AXES[p.request.arrangement][0], "chosen: two plates round the planets"),
        "plate_diameter_mm": (c.plate_diameter, "encloses the pins, passes through the ring"),
        "plate_thickness_drive_mm": (c.plate, "half of a pin's diameter"),
        "plate_thickness_far_mm": (c.plate, ""),
        "plate_gap_mm": (c.gap, "width of the gears and two modules"),
        "web_width_mm": (c.web_width, ""),
        "web_clearance_mm": (c.web_clearance, ""),
        "pin_diameter_mm": (c.pin, "three quarters of the planets' bore"),
        "hub_outer_diameter_mm": (c.hub, ""),
        "hub_bore_mm": (c.hub_bore, "the sun's shaft has room"),
        "hub_length_mm": (c.hub_length, ""),
    })  # fmt: skip
    seats = {
        "drive": min(1.1 * c.hub, 0.95 * c.plate_diameter),
        "far": max(0.9 * c.hub, 1.12 * c.hub_bore),
    }
    for side, diameter in seats.items():
        _put(text, f"[{at}.fe.seat_{side}]", {
            "diameter_mm": (diameter, ""), "width_mm": (0.5 * c.hub_length, ""),
        })  # fmt: skip


def _joint(text: CaseText, first: str, second: str, p: Proposal) -> None:
    """Between two stages; a sun's shaft has its spline in series."""
    torque = p.request.torque / p.ratio
    _put(text, "[[joints]]", {
        "first": (first, ""), "second": (second, ""),
        **_bearing(p, 0.25, "chosen: a flange"),
        "torsion_nm_per_rad": (torque / around.TWIST, _twist()),
    })  # fmt: skip


def _port(
    text: CaseText,
    header: str,
    member: str,
    stage: Proposal,
    ratio: float,
    slow_inertia: float,
    rated: Rated | None = None,
) -> None:
    """A port of the train; ratio: its speed over that of the slow end, without sign; rated: of the
    driving one."""
    inertia = slow_inertia / ratio**2
    fields: Fields = {"member": (member, "")}
    if rated is not None:
        fields["torque_nm"] = (rated.torque, RATED)
        fields["speed_rpm"] = (rated.speed * RPM, RATED)
    fields["inertia_kg_m2"] = (inertia, "chosen: 0.05 s of rated power, or less")
    if member.endswith(".sun"):
        size = stage.center_distance
        fields["mass_kg"] = (
            max(2 * inertia / size**2, 0.01),
            "a disc as large as the planets' circle",
        )
        fields["tilt_inertia_kg_m2"] = (max(0.5 * inertia, 1e-6), "")
        _put(text, header, fields)
        bearing = _bearing(stage, 1.0, "chosen: shaft bearing")
        _put(text, f"{header.replace('[[', '[').replace(']]', ']')[:-1]}.bearing]", bearing)
        return
    _put(text, header, fields)
