"""Warnings about implausible values of a case that can still be computed: one sentence each.

Teeth as cut by their tools:

**Mate's tip on the root.** The mate's tip reaches the flank at the roll length |T_1 T_2 − ρ_a|
(tip of a planet on a ring: T_1 T_2 + ρ_a). Below the start of the involute the root protrudes
beyond it, and the tip touches there before its path of contact begins. Where undercut or
protuberance has removed the flank there is no contact, and the path of contact is shorter.

**Cutters.** A ring's flank is an involute up to its tip only where the tip is beyond the cutter's
base tangent point, ρ_a ≥ a_0 sin α_0. Corners of the cutter's tip must not cut the tips of the
ring's teeth (tip trimming, ISO 21771), neither at full depth nor during radial infeed; this is
checked at a number of positions.

Limits are those of gears that have been built. Tips of 0.2 modules: Niemann/Winter,
Maschinenelemente II. Endurance limits of the strongest case-hardened steel without any factor:
σ_Hlim = 1650 N/mm², σ_FE = 1050 N/mm² (ISO 6336-5:2016, ME).
"""

import math
from collections.abc import Iterator

import numpy as np

from flexgear.gears.contact import ASSEMBLY_TOLERANCE, GearMeshKind, assembly_mismatch
from flexgear.gears.errors import errors_closing, stage_errors
from flexgear.gears.geometry import (
    StageGeometry,
    bottom_clearance,
    inherent_backlash,
    stage_geometry,
)
from flexgear.gears.implausible_bearings import implausible_bearings
from flexgear.gears.load_bins import idle_loads
from flexgear.gears.nominal_stress import largest_root_stress, pitch_point_pressure
from flexgear.gears.paths import modified_flanks, stage_paths
from flexgear.gears.power_flow import PowerFlow, StageFlow
from flexgear.gears.radii import base_arm, gears_by_role
from flexgear.gears.tool import CutterTool
from flexgear.gears.tooth import ToothGeometry
from flexgear.gears.tooth_faults import lost_contact
from flexgear.model.case import Case
from flexgear.model.stage_view import StageView

NEGLIGIBLE = 1e-5  # modules of protrusion, undercut or trimming
DISTANCE_TOLERANCE = 5e-3  # relative, for rounded angles and diameters
TURNS, FEEDS = 721, 41  # positions of a cutter
LARGEST_TURN = math.radians(75.0)  # of a cutter's tooth, which is then clear of the ring


def tooth_warnings(view: StageView) -> list[str]:
    """Warnings about the teeth of a stage, or only about its radii where the case gives base
    diameters or angles."""
    g = stage_geometry(view)
    if g.overridden:
        return [*_base_circles(view, g)]
    return [*_fillets(view, g), *_undercut(view, g), *_tips(view, g), *_cutters(view, g)]


def _base_circles(view: StageView, g: StageGeometry) -> Iterator[str]:
    for role in g.gear_meshes:
        distance = base_arm(g.base, role) / math.cos(g.working_angles[role])
        if abs(distance / g.center_distance - 1.0) > DISTANCE_TOLERANCE:
            yield (
                f"{view.key('center_distance_mm')}: at {_mm(g.center_distance)} mm the base "
                f"circles and working angle of {view.part(role)} and planet do not fit, which need "
                f"{_mm(distance)} mm: speed ratios then differ from those of the tooth numbers. "
                "Modes do not depend on that, but transients and equilibria need radii that fit"
            )


def _fillets(view: StageView, g: StageGeometry) -> Iterator[str]:
    """Stated tip radii of tools that are too narrow for them; a default is only an upper bound."""
    for role, gear in gears_by_role(view.stage).items():
        radius = g.gears[role].tool.tip_radius / view.stage.normal_module
        if "root_fillet" in gear.model_fields_set and radius < gear.root_fillet - NEGLIGIBLE:
            yield (
                f"{view.part(role)}.root_fillet: the tip of its tool is too narrow for "
                f"{gear.root_fillet:g} modules; its root is cut with a full round tip of "
                f"{radius:.3g} modules instead; give at most that, or less dedendum"
            )


def _undercut(view: StageView, g: StageGeometry) -> Iterator[str]:
    for role, tooth in g.gears.items():
        least = NEGLIGIBLE * view.stage.normal_module
        if not tooth.tool.protuberance and tooth.root.undercut > least:
            start, depth = _mm(2 * tooth.form_radius), _um(tooth.root.undercut)
            yield (
                f"{view.part(role)}: its tool undercuts the flank by {depth} µm; the involute "
                f"begins at {start} mm; raise its profile shift"
            )


def _tips(view: StageView, g: StageGeometry) -> Iterator[str]:
    for role, gear_mesh in g.gear_meshes.items():
        pair = (g.planet, g.gears[role]), (g.gears[role], g.planet)
        for (tooth, mate), (part, other) in zip(
            pair, (("planet", role), (role, "planet")), strict=True
        ):
            form = tooth.form_radius
            radius = lowest_radius(tooth, mate, gear_mesh.working_angle)
            if tooth.outward * (form - radius) <= 0.0:
                continue
            part, other = view.part(part), view.part(other)
            where = (
                f"the tip of {other} reaches {part} at {_mm(2 * radius)} mm, where the involute "
                f"begins at {_mm(2 * form)} mm"
            )
            if tooth.root.is_undercut:
                ratio = (gear_mesh.s_hi - gear_mesh.s_lo) / gear_mesh.base_pitch
                yield (
                    f"{where}: the profile does not cover the path of contact, which leaves a "
                    f"contact ratio of {ratio:.3f}"
                )
                continue
            height = root_protrusion(tooth, mate, gear_mesh.working_angle)
            if height > NEGLIGIBLE * view.stage.normal_module:
                yield (
                    f"{where}: its root protrudes {_um(height)} µm; lower {other}.addendum, or "
                    f"raise {part}.dedendum (1.4 with a tip radius of 0.39, ISO 53 profile D)"
                )


def _cutters(view: StageView, g: StageGeometry) -> Iterator[str]:
    ring = g.gears.get("ring")
    if ring is None or not isinstance(ring.tool, CutterTool):
        return
    tool = ring.tool
    cutter = f"{view.part('ring')}.tool: a cutter of {tool.teeth} teeth"
    tangent = tool.distance * math.sin(tool.working_angle(ring.base_radius))
    if ring.roll_length(ring.tip_radius) < tangent:
        yield f"{cutter} makes no involute up to the ring's tip; use more teeth"
    depth = tip_trimming(ring)
    if depth > NEGLIGIBLE * view.stage.normal_module:
        yield (
            f"{cutter} cuts up to {_um(depth)} µm off the ring's tips during radial infeed; "
            "use fewer teeth"
        )


def lowest_contact(tooth: ToothGeometry, mate: ToothGeometry, working_angle: float) -> float:
    """Roll length at which the mate's tip touches a flank, 0 below the base circle, m."""
    between, tip = tooth.tangent_distance(mate, working_angle), mate.roll_length(mate.tip_radius)
    if tooth.internal:
        return mate.tangent_distance(tooth, working_angle) + tip
    return max(tip - between if mate.internal else between - tip, 0.0)


def lowest_radius(tooth: ToothGeometry, mate: ToothGeometry, working_angle: float) -> float:
    """Radius at which the mate's tip touches a flank, m."""
    return math.hypot(tooth.base_radius, lowest_contact(tooth, mate, working_angle))


def root_protrusion(tooth: ToothGeometry, mate: ToothGeometry, working_angle: float) -> float:
    """Height of the root over the involute where the mate's tip touches it, m; 0 where the tip
    touches the involute, or no flank because of undercut."""
    radius = lowest_radius(tooth, mate, working_angle)
    if tooth.root.is_undercut or tooth.outward * (tooth.form_radius - radius) <= 0.0:
        return 0.0
    return float(tooth.root.protrusion(radius))


def tip_trimming(ring: ToothGeometry) -> float:
    """Largest depth, along the arc, to which the corner of the cutter's tip enters a ring tooth
    at any rotation and radial infeed, m; 0 without contact."""
    tool = ring.tool
    assert isinstance(tool, CutterTool)
    turn = np.linspace(-LARGEST_TURN, LARGEST_TURN, TURNS)[:, None]
    depth = np.linspace(0.0, ring.root_radius - ring.tip_radius, FEEDS)
    corner = tool.profile.at(np.linspace(0.0, 1.0, 9))[0][:, None, None]
    rolled = np.exp(-1j * turn * tool.teeth / ring.teeth)
    deepest = 0.0
    for side in (corner, np.conj(corner)):
        point = (tool.distance - depth + side * np.exp(1j * turn)) * rolled
        radius = np.abs(point)
        space = ring.pitch_angle / 2 - ring.root.half_angle(radius)
        enters = radius * (np.abs(np.angle(point)) - space)
        deepest = max(deepest, float(np.where(radius > ring.tip_radius, enters, 0.0).max()))
    return deepest


def _mm(length: float) -> str:
    return f"{1e3 * length:.2f}"


def _um(length: float) -> str:
    return f"{1e6 * length:.1f}"


THINNEST_TIP = 0.2  # modules
FLANK_LIMIT, ROOT_LIMIT = 1650e6, 1050e6  # Pa, endurance of the strongest case-hardened steel
SHEAR_LIMIT = 650e6  # Pa, yield of quenched and tempered steel in torsion, 1100 N/mm² / √3
LARGEST_MODIFICATION = 0.05  # modules; teeth deflect by about a hundredth
LEAST_GRAVITY, MOST_GRAVITY = 1.0, 100.0  # m/s²: the Moon's is 1.6, gearboxes are flown at 10 g
FASTEST = 250.0  # m/s on pitch circles; turbo gears reach 200
LARGEST_TWIST = 1.2  # rad of a joint at rated torque; dual-mass flywheels of cars reach 1
LEAST_MASS, MOST_MASS = 0.01, 300.0  # of a steel disc; small suns carry rotors; units make 1000


def implausible(case: Case, flow: PowerFlow) -> list[str]:
    """Warnings about implausible values of a case, in the order of its stages."""
    warnings = [*_gravity(case), *_idle(case), *_joints(case, flow)]
    for stage in flow.stages:
        prefix = f"{stage.name}: " if len(case.stages) > 1 else ""
        warnings += [prefix + text for text in _of_stage(case.view(stage.name), stage)]
    return warnings


def _gravity(case: Case) -> Iterator[str]:
    size = math.hypot(*case.gravity)
    if size and not LEAST_GRAVITY <= size <= MOST_GRAVITY:
        yield f"gravity is {size:g} m/s², and that of the Earth 9.81: check its unit"


def _idle(case: Case) -> list[str]:
    """Warnings about loads, of load cases and series, too, that have no effect on their member."""
    loads = [(str(load.member), np.abs(load.points).max(axis=0)) for load in case.loads]
    series, zeros = case.load_series, (0.0, 0.0, 0.0)
    for load_case in case.load_cases:
        for _, member, state in load_case.states(case.inputs[0].member):
            loads.append((member, np.array([*(state.force or zeros), *(state.moment or zeros)])))
    if series is not None:
        channels = np.array([*map(bool, (*series.force, *series.moment)), False])
        loads.append((case.inputs[0].member, channels))
    return [f"{name}: {reason}" for name, reason in idle_loads(case, loads).items()]


def _joints(case: Case, flow: PowerFlow) -> Iterator[str]:
    """Warnings about springs between members that rated torque twists too far. The torque is the
    smaller one of both members' branches; machines at a member carry the rest."""
    for k, joint in enumerate(case.joints):
        torque = min(abs(flow.branch_torque[member]) for member in (joint.first, joint.second))
        stiffness = joint.stiffness[5]
        if not joint.tangential and torque > LARGEST_TWIST * stiffness > 0.0:
            yield (
                f"joints.{k}.torsion: {stiffness:.3g} N m/rad twist by {torque / stiffness:.3g} "
                f"rad under the {torque:.3g} N m between {joint.first} and {joint.second}; check "
                "its unit"
            )


def _of_stage(view: StageView, stage: StageFlow) -> Iterator[str]:
    g = stage_geometry(view)
    yield from _places(view, g)
    yield from _teeth(view, g)
    yield from _sizes(view, g, stage)
    yield from lost_contact(view, stage.gear_mesh_forces)
    yield from _backlash(view, g, stage)
    yield from _modifications(view, stage)
    yield from _stress(view, g, stage)
    yield from _shaft(view, g, stage)
    yield from implausible_bearings(view, g, stage)


def _places(view: StageView, g: StageGeometry) -> Iterator[str]:
    """Warnings about planets that collide or do not assemble, and gears that do not fit."""
    module = view.stage.normal_module
    if g.planet_clearance < 0:
        yield (
            f"neighbouring planets collide: their tips overlap by {-1e3 * g.planet_clearance:.3g} "
            "mm; such a stage cannot be built"
        )
    if view.stage.kind == "planetary":
        misfit = np.abs(assembly_mismatch(g, np.asarray(view.stage.planet_angles)))
        if misfit.max() > ASSEMBLY_TOLERANCE:
            planet = int(np.argmax(misfit)) + 1
            yield (
                f"the planets do not assemble: a tooth of planet {planet} is {misfit.max():.3g} "
                "pitches off the gap of the sun; they are computed as if its teeth were cut to fit"
            )
    for role, gear_mesh in g.gear_meshes.items() if g.overridden else ():
        name = _gear_mesh(view, role)
        low, high = g.planet.path_of_contact(g.gears[role], gear_mesh.working_angle)
        room = bottom_clearance(g.gears[role], g.planet, g.center_distance)
        depth = 2.0 * max(abs(t.tip_radius - t.root_radius) for t in (g.planet, g.gears[role]))
        if min(room) < 0:
            problem = f"tips reach {-1e3 * min(room):.3g} mm into the roots of their mates"
        elif max(room) > depth:
            problem = f"tips end {1e3 * max(room):.3g} mm above the roots of their mates"
        elif high - low < gear_mesh.base_pitch:
            ratio = max(high - low, 0.0) / gear_mesh.base_pitch
            problem = f"tips leave a contact ratio of {ratio:.3f}, so that at times no teeth touch"
        elif (play := inherent_backlash(g.gears, role, g)) < -0.01 * module:
            problem = f"teeth overlap by {-1e3 * play:.3g} mm at this distance"
        else:
            continue
        yield f"{problem} in the {name}; check module, centre distance and base diameters"


def _backlash(view: StageView, g: StageGeometry, stage: StageFlow) -> Iterator[str]:
    """Warnings about errors that exceed the backlash, where contact is one-sided."""
    if view.gear_mesh.contact_law == "linear":
        return
    paths = stage_paths(view, stage.gear_mesh_forces)
    errors, side = stage_errors(view, paths), view.stage.sides[0]
    for role, gear_mesh in g.gear_meshes.items():
        drive, coast = (errors[kind, side] for kind in GearMeshKind.both(role))
        closed = float(errors_closing(drive, coast, 0.5 * view.stage.face_width).max())
        if closed > gear_mesh.backlash:
            yield (
                f"manufacturing errors close up to {1e6 * closed:.4g} µm of a backlash of "
                f"{1e6 * gear_mesh.backlash:.4g} µm in the {_gear_mesh(view, role)}: both flanks "
                "carry there; raise the backlash, or lower the errors"
            )


def _modifications(view: StageView, stage: StageFlow) -> Iterator[str]:
    flanks = modified_flanks(view, stage_paths(view, stage.gear_mesh_forces))
    if flanks and view.gear_mesh.contact_law == "linear":
        yield (
            f"{view.key('gear_mesh.contact_law')}: with linear contact teeth pull where modified "
            'flanks part, which changes loads and transmission error: set it to "one-sided"'
        )
    for flank in flanks:
        gap = flank.surface(21)[2]
        largest = float(gap.flat[np.abs(gap).argmax()])
        share = abs(largest) / view.stage.normal_module
        if share > LARGEST_MODIFICATION:
            yield (
                f"{view.key(f'{flank.part}.modifications')}: up to {1e6 * abs(largest):.4g} µm "
                f"{'missing' if largest > 0 else 'in excess'} on the {flank.name} flank, "
                f"{share:.2g} modules, and teeth deflect by about 0.01: check value and unit"
            )


def _gear_mesh(view: StageView, role: str) -> str:
    return "gear mesh" if view.stage.kind == "parallel" else f"{role} gear mesh"


def _teeth(view: StageView, g: StageGeometry) -> Iterator[str]:
    """Warnings about thin tips, and about the teeth that tools cut."""
    stage = view.stage
    for role, tooth in {} if g.overridden else g.gears.items():
        name = view.part(role)
        thickness = tooth.thickness_at(tooth.tip_radius) * math.cos(stage.helix_angle)
        thickness /= stage.normal_module
        if thickness < THINNEST_TIP:
            yield (
                f"tips of the {name} are {thickness:.2g} modules thick, and they break below "
                f"{THINNEST_TIP:g}; lower {name}.addendum or {name}.profile_shift"
            )
    yield from tooth_warnings(view)


def _sizes(view: StageView, g: StageGeometry, stage: StageFlow) -> Iterator[str]:
    """Warnings about masses far from those of steel discs of the member's radius and the gears'
    width, and about the speed of teeth on their pitch circles."""
    radii = {name: gear.reference_radius for name, gear in g.gears.items()}
    for name in (*view.stage.members, "planet"):
        mass = getattr(getattr(view.stage, name), "mass", None)
        radius = radii.get({"pinion": "sun", "gear": "planet"}.get(name, name), g.center_distance)
        disc = math.pi * radius**2 * view.stage.gear_width * view.case.material.density
        if mass is not None and not LEAST_MASS < mass / disc < MOST_MASS:
            yield (
                f"{view.key(name)}.mass is {mass:.3g} kg, and a steel disc of its size and the "
                f"gears' width has {disc:.2g}; check its unit"
            )
    speed = stage.gear_mesh_frequency * 2.0 * math.pi * g.planet.reference_radius / g.planet.teeth
    if speed > FASTEST:
        yield (
            f"teeth mesh at {speed:.4g} m/s, and the fastest gears at about 200; check the unit "
            "of speeds"
        )


def _stress(view: StageView, g: StageGeometry, stage: StageFlow) -> Iterator[str]:
    """Warnings about nominal stresses above the endurance of any steel."""
    forces, torque = stage.gear_mesh_forces, "check torque, face width and module"
    for role in g.gear_meshes:
        pressure = pitch_point_pressure(view, g, role, forces[role])
        if pressure > FLANK_LIMIT:
            yield (
                f"the contact pressure of the {_gear_mesh(view, role)} is {pressure / 1e6:.4g} MPa "
                "at rated torque, and the strongest case-hardened steel endures "
                f"{FLANK_LIMIT / 1e6:.0f}; {torque}"
            )
    for role, stress in largest_root_stress(view, forces).items():
        if stress > ROOT_LIMIT:
            yield (
                f"the nominal root stress of the {view.part(role)} is {stress / 1e6:.4g} MPa at "
                "rated torque, and the strongest case-hardened steel endures "
                f"{ROOT_LIMIT / 1e6:.0f}; {torque}"
            )


def _shaft(view: StageView, g: StageGeometry, stage: StageFlow) -> Iterator[str]:
    """Warnings about torsion of a sun's shaft, τ = 16 T d/(π (d⁴ − d_i⁴)), and about sections that
    neither planets nor the bore of an FE carrier leave room for."""
    if view.stage.form("sun") != "beam":
        return
    rooms = [("the sun's tip circle", 2.0 * g.gears["sun"].tip_radius, 0.0, view.stage.gear_width)]
    if view.stage.form("carrier") == "fe":
        c, side = (
            view.carrier,
            "drive" if view.shaft.direction == view.carrier.drive_side else "far",
        )
        plate = 2.0 * getattr(c, f"plate_thickness_{side}")
        name = "the carrier's hub_bore, in both plates,"
        rooms.append((name, c.hub_bore, c.plate_gap, c.plate_gap + plate))
    start = 0.0
    for k, part in enumerate(view.shaft.sections):
        d, inner, end = part.outer_diameter, part.inner_diameter, start + part.length
        shear = 16.0 * abs(stage.sun_torque) * d / (math.pi * (d**4 - inner**4))
        if shear > SHEAR_LIMIT:
            yield (
                f"the shear stress of the sun's shaft is {shear / 1e6:.4g} MPa in section {k} at "
                f"rated torque, and steel yields at {SHEAR_LIMIT / 1e6:.0f}; check its diameters"
            )
        for name, room, first, last in rooms:
            beside = 2.0 * start > last * (1 - 1e-9) or first > 2.0 * end * (1 - 1e-9)
            if d > room and not beside:
                yield (
                    f"section {k} of the sun's shaft is {_mm(d)} mm thick, and {name} has "
                    f"{_mm(room)} mm; check its diameter, or lengths"
                )
        start = end
