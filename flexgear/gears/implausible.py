"""Warnings about implausible values of a case that can still be computed: one sentence each.

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
from flexgear.gears.implausible_teeth import tooth_warnings
from flexgear.gears.load_bins import idle_loads
from flexgear.gears.nominal_stress import largest_root_stress, pitch_point_pressure
from flexgear.gears.paths import modified_flanks, stage_paths
from flexgear.gears.power_flow import NOISE, PowerFlow, StageFlow
from flexgear.gears.tooth_faults import lost_contact
from flexgear.model.case import Case
from flexgear.model.stage_view import StageView

THINNEST_TIP = 0.2  # modules
FLANK_LIMIT, ROOT_LIMIT = 1650e6, 1050e6  # Pa, endurance of the strongest case-hardened steel
SOFTEST_STEEL = 180e9  # Pa, Young's modulus
SHEAR_LIMIT = 650e6  # Pa, yield of quenched and tempered steel in torsion, 1100 N/mm² / √3
LARGEST_MODIFICATION = 0.05  # modules; teeth deflect by about a hundredth
LEAST_GRAVITY, MOST_GRAVITY = 1.0, 100.0  # m/s²: the Moon's is 1.6, gearboxes are flown at 10 g
FASTEST = 250.0  # m/s on pitch circles; turbo gears reach 200
LARGEST_TWIST = 1.2  # rad of a joint at rated torque; dual-mass flywheels of cars reach 1
LEAST_MASS, MOST_MASS = 0.01, 300.0  # of a solid disc; small suns carry rotors; units make 1000


def implausible(case: Case, flow: PowerFlow) -> list[str]:
    """Warnings about implausible values of a case, in the order of its stages."""
    warnings = [*_gravity(case), *_idle(case), *_braking(case, flow), *_joints(case, flow)]
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


def _braking(case: Case, flow: PowerFlow) -> Iterator[str]:
    """Warning about inputs that together take power out of the train, as the output drives."""
    taken = -sum(flow.power[port.member] for port in case.inputs)
    if taken > NOISE * flow.input_power:
        yield (
            f"the inputs take {taken / 1e3:.4g} kW out of the train, as torque and speed have "
            "opposite signs, and the output drives; to run the train in reverse, change both signs"
        )


def _joints(case: Case, flow: PowerFlow) -> Iterator[str]:
    """Warnings about joints that twist by more than ``LARGEST_TWIST`` under rated torque, the
    smaller of the torques in the branches of both members."""
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
    """Warnings about stated masses, compared with a solid disc as wide as the gears (with the
    reference radius of a gear, the centre distance of a carrier), and about pitch-line speed."""
    radii = {name: gear.reference_radius for name, gear in g.gears.items()}
    for name in (*view.stage.members, "planet"):
        mass = getattr(getattr(view.stage, name), "mass", None)
        radius = radii.get({"pinion": "sun", "gear": "planet"}.get(name, name), g.center_distance)
        disc = math.pi * radius**2 * view.stage.gear_width * view.material.density
        if mass is not None and not LEAST_MASS < mass / disc < MOST_MASS:
            yield (
                f"{view.key(name)}.mass is {mass:.3g} kg, and a solid disc of its size and the "
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
    young = view.material.young_modulus
    for part in map(view.part, g.gears) if young < SOFTEST_STEEL else ():
        if getattr(view.stage, part).rating.steel is not None:
            yield (
                f"{view.key(part)}.rating.steel has the strength and life of a steel, and the "
                f"material's Young's modulus is {young / 1e9:.4g} GPa; leave it out"
            )
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
    """Warnings about the shear stress of a sun's shaft, τ = 16 T d/(π (d⁴ − d_i⁴)), and about
    sections thicker than the sun's tip circle or than the bore of the carrier around them."""
    if view.stage.form("sun") != "beam":
        return
    rooms = [("the sun's tip circle", 2.0 * g.gears["sun"].tip_radius, 0.0, view.stage.gear_width)]
    if view.stage.form("carrier") == "fe":
        c = view.carrier
        side = "drive" if view.shaft.direction == c.drive_side else "far"
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
                    f"section {k} of the sun's shaft is {1e3 * d:.2f} mm thick, and {name} has "
                    f"{1e3 * room:.2f} mm; check its diameter, or lengths"
                )
        start = end
