"""Report of the stages of a case for ``flexgear check``: assembly, gears, gear meshes.

Keys end in their unit, as in case files. Speeds and forces are those of the power flow. The report
includes estimates of effects that gear-mesh models neglect:

**Friction** μ N acts across the line of action and reverses at the pitch point C. With a load that
is uniform over the path of contact its share of the power of a gear mesh is

    μ (1/r_b,planet ± 1/r_b,gear) x̄ / cos β_b,   x̄ = mean of |s − s_C| over the path

(upper sign external), as the sliding speed at the distance x from C is x |ω₁ ± ω₂|.

**The rim of a planet** is an inextensible ring of mean radius R and bending stiffness EI with
u = Σ aₙ cos nθ + bₙ sin nθ outward, v = −∫u dθ along the rim, and rotation ψ = (v − u')/R:

    U = (π E I / 2R³) Σ (n² − 1)² (aₙ² + bₙ²),   n ≥ 2      (Timoshenko, Strength of Materials II)

Tooth forces act at the working circles r_w (v + (r_w − R) ψ along them), the pin presses on half of
the bore with a cosine. The rim is otherwise free. Rollers in the bore would support it, so the
result is an upper bound of the deflection along the lines of action. Planets that are flexible FE
bodies deform in the model itself and have no estimate.

**The pin** of a planet is a beam clamped in both plates, with a uniform force over the seat;
deflection of its middle relative to the ends of the seat

    δ = M c²/(8EI) − F c³/(384EI) + F c/(8 κ G A),   M = F (L/8 − c/8) + F c²/(24 L)

(span L between the plates, seat width c, κ = 0.9).
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.contact import ASSEMBLY_TOLERANCE, GearMeshKind, GearMeshPath
from flexgear.gears.errors import PairErrors, errors_closing, stage_errors
from flexgear.gears.geometry import PER_PAIR_MODELS, StageGeometry, backlash_source, stage_geometry
from flexgear.gears.nominal_stress import RootStress, pitch_point_pressure, stage_root_stress
from flexgear.gears.paths import assembly_misfit, modified_flanks, stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.gears.stiffness import iso_peak
from flexgear.gears.tool import CutterTool
from flexgear.gears.tooth import ToothGeometry
from flexgear.gears.tooth_faults import fault_report
from flexgear.model.case import Case
from flexgear.model.stage_view import StageView

FRICTION = 0.05  # between ground, oiled flanks; 0.03 to 0.08 are usual
RIM_KEYS = {r: f"free_planet_rim_gives_way_{r}_gear_mesh_um" for r in ("ring", "sun")}
SHEAR_FACTOR = 0.9  # κ of a round section
ORDERS = np.arange(2, 2001)  # n


def neglected_effects(view: StageView, forces: Mapping[str, float]) -> dict[str, float]:
    """Estimates of neglected effects; units in the keys. forces: normal force of one gear mesh of
    "sun" and "ring", N. Rims are those of planets with a bore that are no flexible FE bodies, pins
    those of an FE carrier."""
    g, stage = stage_geometry(view), view.stage
    effects = {"coefficient_of_friction": FRICTION}
    for role in g.gear_meshes:
        name = "gear_mesh" if stage.kind == "parallel" else f"{role}_gear_mesh"
        effects[f"friction_loss_share_{name}"] = friction_share(g, role, FRICTION)
        effects[f"friction_force_{name}_n"] = FRICTION * abs(forces[role])
    if stage.planet is None:
        return effects
    halves = 2 if stage.double_helical else 1
    normal = {
        role: halves * abs(forces[role]) * math.cos(g.base_helix_angle) for role in g.gear_meshes
    }
    if stage.planet.bore_diameter > 0.0 and view.fe_tie("planet") is None:
        for role, size in _planet_rim(view, g, normal, 0.5 * stage.planet.bore_diameter).items():
            effects[RIM_KEYS[role]] = 1e6 * size
    if view.stage.form("carrier") == "fe":
        on_pin = sum(normal[s] * math.cos(m.working_angle) for s, m in g.gear_meshes.items())
        effects["pin_bends_in_planet_um"] = 1e6 * _pin(view, on_pin)
    return effects


def friction_share(g: StageGeometry, role: str, coefficient: float) -> float:
    """Friction loss over the power of a gear mesh, for a uniform load over the path."""
    gear, gear_mesh = g.gears[role], g.gear_meshes[role]
    pitch_point = g.planet.base_radius * math.tan(gear_mesh.working_angle)
    low, high = gear_mesh.s_lo - pitch_point, gear_mesh.s_hi - pitch_point
    mean = (high * abs(high) - low * abs(low)) / (2.0 * (high - low))
    slip = 1.0 / g.planet.base_radius + gear.outward / gear.base_radius
    return coefficient * slip * mean / math.cos(g.base_helix_angle)


def rim_rows(angle: float, radial: float, tangential: float, arm: float) -> Array:
    """Displacement per aₙ and bₙ, (2, orders), of a point of a ring in a direction. angle: θ of the
    point, rad; radial, tangential: components of the direction; arm: r/R − 1 for the radius r of
    the point."""
    n = ORDERS
    c, s = np.cos(n * angle), np.sin(n * angle)
    u, v = np.array([c, s]), np.array([-s, c]) / n
    rotation = v + n * np.array([s, -c])  # R ψ = v − u'
    return np.asarray(radial * u + tangential * (v + arm * rotation))


def rim_compliance(bending: float, radius: float) -> Array:
    """Amplitudes aₙ and bₙ per unit of their loads, (orders,), m/N; bending: EI, N m²."""
    n = ORDERS.astype(float)
    return np.asarray(radius**3 / (math.pi * bending * (n**2 - 1.0) ** 2))


def _planet_rim(
    view: StageView, g: StageGeometry, normal: Mapping[str, float], bore: float
) -> dict[str, float]:
    """Displacement of the rim along the line of action at "ring" (θ = 0) and "sun" (θ = π), m;
    bore: radius, m."""
    width = view.stage.face_width * (2.0 if view.stage.double_helical else 1.0)
    height, radius = g.planet.root_radius - bore, 0.5 * (g.planet.root_radius + bore)
    bending = view.material.young_modulus * width * height**3 / 12.0
    rows, load, on_pin = {}, np.zeros((2, len(ORDERS))), 0.0
    for role, angle, sense in (("ring", 0.0, 1.0), ("sun", math.pi, -1.0)):
        alpha = g.gear_meshes[role].working_angle
        arm = g.planet.base_radius / math.cos(alpha) / radius - 1.0
        rows[role] = rim_rows(angle, -math.sin(alpha), sense * math.cos(alpha), arm)
        load += normal[role] * rows[role]
        on_pin += normal[role] * math.cos(alpha)
    load += on_pin * _half_bore()
    deflection = load * rim_compliance(bending, radius)
    return {role: float(np.sum(row * deflection)) for role, row in rows.items()}


def _half_bore() -> Array:
    """Load (2, orders) of a unit pin force towards θ = −π/2: p = (2/π) cos(θ + π/2) per angle over
    half of the bore."""
    n, middle = ORDERS.astype(float), -0.5 * math.pi
    share = 2.0 / math.pi * 2.0 * np.cos(0.5 * math.pi * n) / (1.0 - n**2)
    return np.array([share * np.cos(n * middle), share * np.sin(n * middle)])


def _pin(view: StageView, force: float) -> float:
    """Deflection of a pin, as in ``pin_sag``, under the force of its planet, N."""
    body, m = view.carrier, view.material
    seat = body.pin_seat_width or body.plate_gap
    area = 0.25 * math.pi * (body.pin_diameter**2 - body.pin_bore**2)
    second = math.pi * (body.pin_diameter**4 - body.pin_bore**4) / 64.0
    shear = m.young_modulus / (2.0 * (1.0 + m.poisson_ratio))
    return pin_sag(
        force, body.plate_gap, seat, m.young_modulus * second, SHEAR_FACTOR * shear * area
    )


def pin_sag(force: float, span: float, seat: float, bending: float, shear: float) -> float:
    """Deflection δ of the middle of a pin relative to the ends of its seat, m. force: F, N; span:
    L, seat: c, m; bending: EI, N m²; shear: κ G A, N."""
    moment = force * (span - seat) / 8.0 + force * seat**2 / (24.0 * span)
    return (
        moment * seat**2 / (8.0 * bending)
        - force * seat**3 / (384.0 * bending)
        + force * seat / (8.0 * shear)
    )


POINTS = 101  # of a flank, along profile and face
Report = dict[str, dict[str, Any]]


def case_reports(case: Case) -> dict[str, Report]:
    """``stage_report`` by name of the stage, "" for a single stage. Raises InputError for gears
    that do not mesh, collide or do not assemble."""
    return {
        flow.name if len(case.stages) > 1 else "": stage_report(
            case.view(flow.name), flow.gear_mesh_forces
        )
        for flow in power_flow(case).stages
    }


def stage_report(view: StageView, forces: Mapping[str, float]) -> Report:
    """Report of a stage; forces as in ``stage_paths``.

    Sections "assembly", one for each gear, "sun_gear_mesh" and "ring_gear_mesh" (parallel stage:
    "gear_mesh"), "missing_on_flanks" if flanks are modified, "faults" if teeth have faults, and
    "not_modelled" (``neglected_effects``). Stiffness (along the 3D normal), place and phases are
    those of the flanks that carry rated torque; stiffness, face width and contact ratios of a
    double-helical stage those of one half. Backlash is reduced by errors at the planet where they
    reduce it most. Stresses are nominal, without load factors.
    """
    g, paths, stage = stage_geometry(view), stage_paths(view, forces), view.stage
    report: Report = {"assembly": _assembly(view, g)}
    for role, gear in g.gears.items():
        rows: dict[str, Any] = {
            "teeth": gear.teeth,
            "reference_diameter_mm": 2e3 * gear.reference_radius,
            "base_diameter_mm": 2e3 * g.base[role],
            "tip_diameter_mm": 2e3 * gear.tip_radius,
            "root_diameter_mm": 2e3 * gear.root_radius,
        }
        report[view.part(role)] = {**rows, **_tool(gear)} if gear.is_cut else rows
    side = "left" if stage.double_helical else ""
    stresses = stage_root_stress(view, g, forces)
    errors = stage_errors(view, paths) if view.gear_mesh.contact_law == "one-sided" else {}
    for role in g.gear_meshes:
        name = "gear_mesh" if stage.kind == "parallel" else f"{role}_gear_mesh"
        kinds = GearMeshKind.both(role)
        flanks = [errors[kind, side] for kind in kinds if errors]
        carrying = next(path for kind in kinds if (path := paths[kind, side]).carries)
        report[name] = _gear_mesh(view, g, role, carrying, flanks)
        if forces[role]:
            pressure = pitch_point_pressure(view, g, role, forces[role])
            report[name]["nominal_contact_pressure_mpa"] = pressure / 1e6
        for (stress_role, part), stress in stresses.items():
            if stress_role == role:
                report[name] |= _root(view.part(part), stress)
    missing = {}  # least and largest
    for flank in modified_flanks(view, paths):
        gap = 1e6 * flank.surface(POINTS)[2]
        missing[f"{flank.part}_{flank.name}_um"] = [float(gap.min()), float(gap.max())]
    report |= {"missing_on_flanks": missing} if missing else {}
    faults = fault_report(view, list(paths.values()))
    report |= {"faults": faults} if faults else {}
    return report | {"not_modelled": neglected_effects(view, forces)}


def _assembly(view: StageView, g: StageGeometry) -> dict[str, Any]:
    """Rows of centre distance, assembly of planets, angles and face width."""
    stage = view.stage
    rows: dict[str, Any] = {"center_distance_mm": 1e3 * g.center_distance}
    if stage.kind == "planetary":
        misfit = assembly_misfit(view, g)
        rows = {
            "planets": stage.planets,
            "(z_sun + z_ring)/N": g.assembly,
            "assembles": misfit <= ASSEMBLY_TOLERANCE,
            "largest_misfit_of_a_sun_tooth_in_pitches": misfit,
            **rows,
        }
        if math.isfinite(g.planet_clearance):
            rows["planet_clearance_mm"] = 1e3 * g.planet_clearance
    rows["transverse_pressure_angle_deg"] = math.degrees(g.transverse_angle)
    rows["base_helix_angle_deg"] = math.degrees(g.base_helix_angle)
    if stage.double_helical:
        rows["halves"] = 2
        rows["face_width_of_a_half_mm"] = 1e3 * stage.face_width
    if g.overridden:
        rows["radii"] = "as given, not those of the teeth"
    return rows


def _tool(gear: ToothGeometry) -> dict[str, Any]:
    """Rows of the tool, and of the root that it cuts."""
    tool = gear.tool
    rows: dict[str, Any] = {"tool": "rack"}
    if isinstance(tool, CutterTool):
        rows = {
            "tool": "shaper cutter",
            "cutter_teeth": tool.teeth,
            "cutter_tip_diameter_mm": 2e3 * tool.tip_circle,
        }
    rows["tool_tip_radius_mm"] = 1e3 * tool.tip_radius
    rows["start_of_involute_diameter_mm"] = 2e3 * gear.form_radius
    return rows


def _gear_mesh(
    view: StageView, g: StageGeometry, role: str, path: GearMeshPath, errors: Sequence[PairErrors]
) -> dict[str, Any]:
    """Rows of a gear mesh; errors: of drive and coast flanks, none with linear contact."""
    gear_mesh, closed = g.gear_meshes[role], {}
    if errors:
        drive, coast = errors
        largest = errors_closing(drive, coast, path.half_face).max()
        closed["errors_close_up_to_um"] = 1e6 * float(largest)
    start = (path.s0 - path.s_lo) / path.base_pitch
    rows: dict[str, Any] = {
        "working_pressure_angle_deg": math.degrees(gear_mesh.working_angle),
        "transverse_contact_ratio": gear_mesh.transverse_contact_ratio,
        "overlap_ratio": gear_mesh.overlap_ratio,
        "contact_ratio": gear_mesh.total_contact_ratio,
        "base_pitch_mm": 1e3 * path.base_pitch,
        "path_of_contact_mm": [1e3 * path.s_lo, 1e3 * path.s_hi],
        "backlash_um": 1e6 * path.backlash,
        "backlash_by": backlash_source(view, role),
        **closed,
        "place_of_first_pair_in_pitches": _fraction(start[0]),
    }
    if view.stage.kind == "planetary":
        rows["phase_of_planets_in_pitches"] = [_fraction(x - start[0]) for x in start]
    rows["stiffness"] = view.gear_mesh.model
    rows["mean_stiffness_n_per_m"] = path.mean_stiffness
    low, high = _stiffness_range(path)
    rows["least_stiffness_n_per_m"], rows["largest_stiffness_n_per_m"] = low, high
    if view.gear_mesh.model in PER_PAIR_MODELS:
        rows["pair_stiffness_peak_n_per_m"] = float(path.k_grid.max())
    if not g.overridden:
        rows["iso_single_stiffness_n_per_mm_um"] = iso_peak(view, role) / 1e9
    return rows


def _root(gear: str, stress: RootStress) -> dict[str, Any]:
    """Rows of the nominal root stress of a gear at rated torque, and its factors."""
    return {
        f"nominal_root_stress_iso_6336_3_{gear}_mpa": stress.stress / 1e6,
        f"form_and_notch_factor_{gear}": [stress.form_factor, stress.notch_factor],
    }


def _fraction(x: float) -> float:
    """x modulo 1, rounded so that it is 0 for an integer with rounding errors."""
    return round(float(x) % 1.0, 9) % 1.0


def _stiffness_range(path: GearMeshPath) -> tuple[float, float]:
    """Least and largest stiffness of the gear mesh over a base pitch, N/m."""
    if path.wave is not None:
        return float(path.wave.min()), float(path.wave.max())
    x = path.s_lo + path.base_pitch * np.arange(256) / 256
    count = math.ceil((path.s_grid[-1] - path.s_grid[0]) / path.base_pitch) + 1
    s = x + path.base_pitch * np.arange(-count, count + 1)[:, None]
    total = np.interp(s, path.s_grid, path.k_grid, left=0.0, right=0.0).sum(axis=0)
    return float(total.min()), float(total.max())
