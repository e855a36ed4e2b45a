"""Plausibility of bearings: stiffness, clearance, thrust and rating beside load and size."""

import math
from collections.abc import Iterator

from flexgear.gears.bearings.basic_life import LEAST_E, roller_bearing_stiffness
from flexgear.gears.bearings.nominal import nominal_bearings
from flexgear.gears.geometry import StageGeometry
from flexgear.gears.power_flow import StageFlow
from flexgear.model.bearings import Bearing
from flexgear.model.stage_view import StageView

FACTOR = 100.0  # by which a bearing's stiffness or rating may differ from an estimate for its load
LARGEST_CLEARANCE = 0.03  # modules, of bearings; but no less than the share of their diameter that
LARGEST_PLAY = 0.0012  # the widest rolling bearings (C5 of ISO 5753-1) and plain ones have
RIGID = 10.5  # times E b: what an imported file calls rigid has 10
ROUNDED = 1.01  # by which raceways of rounded sizes may exceed the bore that they are ground in


def implausible_bearings(view: StageView, g: StageGeometry, stage: StageFlow) -> Iterator[str]:
    """Warnings about implausible values of the bearings of a stage."""
    yield from _stiffness(view, g, stage)
    yield from _in_planet(view, g)
    yield from _clearances(view, g)
    yield from _thrust(view, g, stage)
    yield from without_tilt(view, g)
    yield from _rating(view, stage)


def _stiffness(view: StageView, g: StageGeometry, stage: StageFlow) -> Iterator[str]:
    """Warnings about stiffness far from that of a roller bearing for the load, and about planets'
    bearings beside their planet. Supports of suns and carriers may be soft, as these members may
    float; a power of ten is a support that is meant to be rigid. Usual are a quarter of the radial
    stiffness along the axis, and two rows half of the gear width or centre distance apart. Up to
    ``RIGID`` E b, in tilting times the square of the gears' mean radius, nothing is too stiff."""
    parallel = stage.kind == "parallel"
    load = abs(stage.sun_gear_mesh_force) if parallel else stage.planet_bearing_force
    if load == 0.0:
        return
    usual = roller_bearing_stiffness(load, view.stage.gear_width)
    arm = max(view.stage.gear_width, 0.5 * g.center_distance) / 2.0
    rigid = RIGID * view.material.young_modulus * view.stage.gear_width
    radii = [t.reference_radius for t in g.gears.values()]
    radii += [g.planet.reference_radius] * (view.stage.planets - 1)
    radius = sum(radii) / len(radii)
    in_housing = ("ring.support", "ring.hub.bearing")
    for key, bearing in view.stage.bearings.items():
        in_planet = key == "planet_bearing"
        if in_planet and abs(bearing.z) > _span(view, g):
            yield (
                f"{view.key(key)}.z is {1e3 * bearing.z:.4g} mm from the middle of a planet of "
                f"{1e3 * view.stage.gear_width:.4g} mm width; check its unit"
            )
        if key in in_housing:
            continue
        k = bearing.stiffness
        for name, stiffness, expected, most, unit in (
            ("radial", max(k[:2]), usual, rigid, "N/m"),
            ("axial", k[2], usual / 4.0, rigid, "N/m"),
            ("tilt", max(k[3:5]), usual * arm**2, rigid * radius**2, "N m/rad"),
        ):
            carries = (parallel or in_planet) and name == "radial"
            soft = carries and 0.0 < stiffness < expected / FACTOR
            holds = not in_planet and stiffness > 0.0 and math.log10(stiffness).is_integer()
            if soft or (stiffness > max(FACTOR * expected, most) and not holds):
                meant = "" if soft else ", unless it is to be rigid"
                yield (
                    f"{view.key(key)}.{name} is {stiffness:.3g} {unit}, and a roller bearing under "
                    f"the {load:.3g} N of a planet or pinion has about {expected:.2g}; check its "
                    f"unit{meant}"
                )


def _span(view: StageView, g: StageGeometry) -> float:
    """Largest plausible distance between the outer ends of a planet's bearings, m: gear width plus
    tip diameter, as a planet may be cut on a shaft that runs in bearings beside the gear."""
    return view.stage.gear_width + 2.0 * g.planet.tip_radius


def _in_planet(view: StageView, g: StageGeometry) -> Iterator[str]:
    """Warnings about planet bearings whose rows are longer than ``_span``, or whose diameter
    exceeds the planet's bore. Bearings beside the gear, or of a planet without a bore, may be as
    large as the distance between the axes of neighbouring planets."""
    bearing, planet = view.stage.planet_bearing, view.stage.planet
    if view.stage.kind != "planetary" or planet is None:
        return
    elements, journal = bearing.elements, bearing.journal
    row = bearing.rollers or elements
    wide, between = journal.length if journal else 0.0, 0.0
    if row is not None:
        rows = bearing.count * (row.rows or 1) if row is elements else row.rows or 1
        between = (rows - 1) * (row.spacing or 0.0)
        wide = between + (row.length or 0.0)
    large = max(
        journal.diameter if journal else 0.0,
        bearing.mean_diameter or 0.0,
        elements.pitch_diameter + elements.diameter if elements else 0.0,
    )
    room, most = g.planet_clearance + 2.0 * g.planet.tip_radius, _span(view, g)
    place = "the next planet is at"
    if planet.bore_diameter and between < view.stage.gear_width:
        room, place = planet.bore_diameter, "the seat in its planet, bore_diameter, is"
    if large > ROUNDED * room:
        yield (
            f"{view.key('planet_bearing')} is {1e3 * large:.4g} mm across by its elements or film, "
            f"and {place} {1e3 * room:.4g} mm; check these sizes"
        )
    if wide > most:
        yield (
            f"{view.key('planet_bearing')} is {1e3 * wide:.4g} mm long by its elements or film, "
            f"and gear width and tip diameter of its planet are {1e3 * most:.4g} mm together; "
            "check rows, spacing and length"
        )


def _clearances(view: StageView, g: StageGeometry) -> Iterator[str]:
    """Warnings about gaps of bearings, or an interference, that are large beside the teeth."""
    for key, bearing in view.stage.bearings.items():
        for part in ("", ".rollers", ".elements", ".journal"):
            source = getattr(bearing, part[1:], None) if part else bearing
            gap = getattr(source, "clearance", None) or 0.0
            share = abs(gap) / view.stage.normal_module
            usual = LARGEST_PLAY * (_diameter(view, key, bearing) or g.center_distance)
            if share > LARGEST_CLEARANCE and abs(gap) > usual:
                yield (
                    f"{view.key(f'{key}{part}.clearance')}: {1e3 * gap:.4g} mm on every side is "
                    f"{share:.2g} modules, by which gears leave their place, and bearings of this "
                    f"size have up to {1e3 * usual:.2g} mm: "
                    "check value and unit"
                )


def _diameter(view: StageView, key: str, bearing: Bearing) -> float:
    """Diameter of a bearing's circle of rolling elements, of its journal or of the planet's bore,
    m; 0 where none of them is given."""
    diameters = (
        bearing.elements and bearing.elements.pitch_diameter,
        getattr(getattr(bearing, "journal", None), "diameter", None),
        view.stage.planet and key == "planet_bearing" and view.stage.planet.bore_diameter,
    )
    return next(filter(None, diameters), 0.0)


def _thrust(view: StageView, g: StageGeometry, stage: StageFlow) -> Iterator[str]:
    """Warnings about bearings with an axial stiffness or a rating whose gear cannot move along its
    axis: they carry nothing of the thrust N F sin β_b of its helical teeth."""
    if view.stage.double_helical:
        return
    for role in g.gear_meshes:
        thrust = (
            view.stage.planets * abs(stage.gear_mesh_forces[role]) * math.sin(g.base_helix_angle)
        )
        parts = ("pinion", "gear") if stage.kind == "parallel" else (role,)
        for part in parts if thrust else ():
            kinematics = view.case.kinematics_of(f"{view.name}.{part}")
            if kinematics not in ("planar", "torsional") or view.stage.form(part) == "fe":
                continue
            for key, bearing in view.stage.member(part).supports.items():
                if bearing.stiffness[2] > 0.0 or bearing.dynamic_rating is not None:
                    yield (
                        f"{view.key(part)}.{key} carries no thrust, as the {part} cannot move "
                        f"along its axis ({kinematics}), and helical teeth push it by "
                        f'{thrust:.3g} N; set {view.key(part)}.kinematics = "spatial"'
                    )


def untilted(view: StageView, role: str) -> list[str]:
    """Keys of the gears of a gear mesh whose tilting K_Hβ leaves out, as their ``kinematics`` has
    none: both where neither can tilt, else those with bearings that resist tilting."""
    parts = ("pinion", "gear") if view.stage.kind == "parallel" else (role, "planet")
    kinematics = {part: view.case.kinematics_of(f"{view.name}.{part}") for part in parts}
    moving = [part for part in parts if kinematics[part] != "fixed"]
    straight = [part for part in moving if kinematics[part] != "spatial"]
    stage = view.stage
    springs = {
        part: [stage.planet_bearing] if part == "planet" else stage.member(part).supports.values()
        for part in straight
    }
    resists = [p for p in straight if any(b.z or any(b.stiffness[3:5]) for b in springs[p])]
    return [view.key(part) for part in (straight if straight == moving else resists)]


def without_tilt(view: StageView, g: StageGeometry) -> Iterator[str]:
    """Warnings about load along the face of gears that cannot tilt."""
    if view.gear_mesh.model == "face_load":
        keys = dict.fromkeys(key for role in g.gear_meshes for key in untilted(view, role))
        for key in keys:
            yield (
                f'{key}.kinematics is not "spatial", so K_Hβ counts no tilt of it; set it, and '
                "supports that resist tilting"
            )


def _rating(view: StageView, stage: StageFlow) -> Iterator[str]:
    """Warnings about dynamic ratings of bearings that do not fit their nominal load, and lives that
    leave out thrust."""
    for nominal in nominal_bearings(view, stage).values():
        bearing, hours = nominal.place.bearing, nominal.life_hours
        if bearing.dynamic_rating is None or hours is None or not math.isfinite(hours):
            continue
        if (
            bearing.thrust is None
            and bearing.elements is None
            and nominal.axial > LEAST_E * nominal.radial
        ):
            yield (
                f"{nominal.place.key}: its life counts none of the thrust, "
                f"{100 * nominal.axial / nominal.radial:.3g} % of the radial load; give its thrust "
                "(contact_angle_deg, or factors of the catalogue) or elements"
            )
        ratio = bearing.dynamic_rating * bearing.count / nominal.equivalent
        if not 1.0 <= ratio <= FACTOR:
            yield (
                f"{nominal.place.key}.dynamic_rating is {ratio:.2g} times the load on it, with a "
                f"life of {hours:.2g} h; check its unit"
            )
