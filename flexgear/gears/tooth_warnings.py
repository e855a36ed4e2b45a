"""What a user must know of teeth as their tools make them, in lines of text.

**Mate's tip on the root.** The mate's tip reaches the flank at the roll length |T_1 T_2 − ρ_a| (a
planet's on a ring: T_1 T_2 + ρ_a). Below the start of the involute the root stands proud of it, and
the tip touches there before its path of contact begins; where the tool has freed the flank, by
undercut or protuberance, there is nothing to touch, and the path of contact is shorter.

**Cutters.** A ring's flank is an involute up to its tip only where that lies beyond the cutter's
base tangent point, ρ_a ≥ a_0 sin α_0. Corners of the cutter's tip must not pass through the ring's
teeth, neither where it has its full depth nor on its way there (radial infeed): looked for in
positions, as the cutter's tip circle and half angles tell (ISO 21771: tip trimming).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from flexgear.gears.geometry import StageGeometry, stage_geometry
from flexgear.gears.tool import CutterTool
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.stage_view import StageView

NOTHING = 1e-5  # modules: a root that stands less proud, undercut that takes less off
TURNS, FEEDS = 721, 41  # positions of a cutter
WIDEST = math.radians(75.0)  # turn of a cutter's tooth, beyond which it is clear of the ring


def tooth_warnings(view: StageView) -> list[str]:
    """Of the gears of a stage; none where teeth are not those of the gears."""
    g = stage_geometry(view)
    return [] if g.overridden else [*_undercut(view, g), *_tips(view, g), *_cutters(view, g)]


def _undercut(view: StageView, g: StageGeometry) -> Iterator[str]:
    for role, tooth in g.gears.items():
        least = NOTHING * view.stage.normal_module
        if not tooth.tool.protuberance and tooth.root.missing > least:
            begins, by = _mm(2 * tooth.form_radius), _um(tooth.root.missing)
            yield (
                f"{view.part(role)}: its tool undercuts the flank by {by} µm; the involute begins "
                f"at {begins} mm; raise its profile shift"
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
            if tooth.root.freed:
                ratio = (gear_mesh.s_hi - gear_mesh.s_lo) / gear_mesh.base_pitch
                yield (
                    f"{where}: the profile does not cover the path of contact, whose ratio is "
                    f"{ratio:.3f} with what is there"
                )
                continue
            proud = proud_of_tip(tooth, mate, gear_mesh.working_angle)
            if proud > NOTHING * view.stage.normal_module:
                yield (
                    f"{where}: its root stands {_um(proud)} µm proud; lower {other}.addendum, or "
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
        yield f"{cutter} makes no involute up to the ring's tip; use more"
    depth = trimmed(ring)
    if depth > NOTHING * view.stage.normal_module:
        yield (
            f"{cutter} takes up to {_um(depth)} µm off the ring's tips as it is fed in radially; "
            "use fewer"
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


def proud_of_tip(tooth: ToothGeometry, mate: ToothGeometry, working_angle: float) -> float:
    """By how much the root stands beyond the involute where the mate's tip reaches, 0 where that is
    involute or freed, m."""
    radius = lowest_radius(tooth, mate, working_angle)
    if tooth.root.freed or tooth.outward * (tooth.form_radius - radius) <= 0.0:
        return 0.0
    return float(tooth.root.proud(radius))


def trimmed(ring: ToothGeometry) -> float:
    """Largest depth, along the arc, to which the corner of the cutter's tip enters a ring's tooth
    at any turn and radial infeed, m; 0 where it stays clear."""
    tool = ring.tool
    assert isinstance(tool, CutterTool)
    turn = np.linspace(-WIDEST, WIDEST, TURNS)[:, None]
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
