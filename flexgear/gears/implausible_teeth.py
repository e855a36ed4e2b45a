"""Warnings about teeth as cut by their tools: one sentence each.

**Mate's tip on the root.** The mate's tip reaches the flank at the roll length |T_1 T_2 − ρ_a|
(tip of a planet on a ring: T_1 T_2 + ρ_a). Below the start of the involute the root protrudes
beyond it, and the tip touches there before its path of contact begins. Where undercut or
protuberance has removed the flank there is no contact, and the path of contact is shorter.

**Cutters.** A ring's flank is an involute up to its tip only where the tip is beyond the cutter's
base tangent point, ρ_a ≥ a_0 sin α_0. Corners of the cutter's tip must not cut the tips of the
ring's teeth (tip trimming, ISO 21771), neither at full depth nor during radial infeed; this is
checked at a number of positions.
"""

import math
from collections.abc import Iterator

import numpy as np

from flexgear.gears.geometry import StageGeometry, stage_geometry
from flexgear.gears.radii import base_arm, gears_by_role
from flexgear.gears.tool import CutterTool
from flexgear.gears.tooth import ToothGeometry
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
    """Height by which the root protrudes beyond the involute where the mate's tip reaches it, m; 0
    where the tip touches the involute, or where undercut has removed the flank."""
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
