"""One tooth in the transverse plane: circles, thickness, involute flanks, and the root.

With normal module m_n, normal pressure angle α_n, helix angle β, and for a ring ISO's negative
tooth number, so that x > 0 thickens every tooth:

    tan α_t = tan α_n / cos β,   r = z m_n / (2 cos β),   r_b = r cos α_t
    s = m_n (π/2 + 2 x tan α_n) / cos β      transverse thickness at the reference circle
    r_a = r ± m_n (h_a + x),   r_f = r ∓ m_n (h_f − x)      upper sign external, lower internal
    δ(ρ) = s/(2 r) ∓ (inv α_ρ − inv α_t),   cos α_ρ = r_b/ρ,   inv α = tan α − α

δ is the half angle of the tooth at the radius ρ: it falls outward on an external tooth and grows
outward on a tooth of a ring, which has the shape of a space of an external gear.

The root is cut by the tool (``tool``): a rack of tip height h_f and tip radius ρ_f m_n, or a cutter
of z_0 teeth at the distance a_0,

    inv α_0 = inv α_t + 2 tan α_n (x + x_0)/(z + z_0),   a_0 = (r_b ± r_b0)/cos α_0
    d_f = 2 a_0 ∓ d_a0      (a ring has z < 0 and the lower sign)

Frame of a tooth: origin at the gear's centre, x along the middle line of the tooth, y across.
Source: ISO 21771:2007.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
from scipy.optimize import newton

from flexgear.arrays import Array
from flexgear.gears.root import ToothRoot
from flexgear.gears.tool import CutterTool, GeneratingTool, PlainTool, RackTool, rounded
from flexgear.model.member import Tool
from flexgear.model.section import Refusal


class Rack(Protocol):
    """Basic rack of the gears of a stage in normal section; m and rad."""

    @property
    def normal_module(self) -> float: ...
    @property
    def pressure_angle(self) -> float: ...
    @property
    def helix_angle(self) -> float: ...


@dataclass(frozen=True)
class PlainRack:
    """Basic rack by plain numbers; m, or any unit of length, and rad."""

    normal_module: float
    pressure_angle: float
    helix_angle: float = 0.0


class Blank(Protocol):
    """Data of the teeth of one gear, lengths in normal modules; a virtual gear may have a number of
    teeth that is no integer."""

    @property
    def teeth(self) -> float: ...
    @property
    def profile_shift(self) -> float: ...
    @property
    def addendum(self) -> float: ...
    @property
    def dedendum(self) -> float: ...
    @property
    def root_fillet(self) -> float: ...
    @property
    def tool(self) -> Tool | PlainTool: ...


def involute(angle: float) -> float:
    """inv α = tan α − α of one angle, rad."""
    return math.tan(angle) - angle


def involutes(angles: Array) -> Array:
    """inv α = tan α − α of angles of any shape."""
    return np.asarray(np.tan(angles) - angles)


def inverse_involute(value: float) -> float:
    """Angle α, rad, with inv α = value. Raises ValueError for a negative value."""
    if value < 0:
        raise ValueError("an involute function below zero has no angle")
    start, slope = min((3 * value) ** (1 / 3), 1.4), lambda angle: math.tan(angle) ** 2
    angle = newton(lambda x: involute(x) - value, start, slope, tol=1e-15, disp=False)
    return float(angle)


def transverse_angle(rack: Rack) -> float:
    """Transverse pressure angle α_t at the reference circle, tan α_t = tan α_n / cos β, rad."""
    return math.atan(math.tan(rack.pressure_angle) / math.cos(rack.helix_angle))


def base_helix_angle(rack: Rack) -> float:
    """Base helix angle β_b, sin β_b = sin β cos α_n, rad."""
    return math.asin(math.sin(rack.helix_angle) * math.cos(rack.pressure_angle))


@dataclass(frozen=True)
class ToothOutline:
    """Outline of half a tooth from the tip to the root section. x along the middle line, y across:
    (n,) m; the first ``flank_points`` points are on the flank."""

    tooth: ToothGeometry
    x: Array
    y: Array
    flank_points: int

    @property
    def root_thickness(self) -> float:
        """Chord at the root section, m."""
        return 2.0 * float(self.y[-1])


@dataclass(frozen=True)
class ToothGeometry:
    """Tooth of one gear; formulas in the module docstring. Radii, and transverse ``thickness`` at
    the reference circle, m; transverse_angle: α_t at the reference circle, rad."""

    teeth: int
    internal: bool
    reference_radius: float
    base_radius: float
    tip_radius: float
    root_radius: float
    thickness: float
    transverse_angle: float
    tool: GeneratingTool

    @property
    def rolling_radius(self) -> float:
        """Radius of the gear's rolling circle in generation by the tool, m."""
        if isinstance(self.tool, RackTool):
            return self.reference_radius
        return self.base_radius / math.cos(self.tool.working_angle(self.base_radius))

    @property
    def pitch_angle(self) -> float:
        """Pitch angle 2π/z, rad."""
        return 2.0 * math.pi / self.teeth

    @property
    def base_pitch(self) -> float:
        """Transverse base pitch p_b = 2π r_b / z, m."""
        return self.pitch_angle * self.base_radius

    @property
    def outward(self) -> float:
        """Radial direction from root to tip: +1 outward, −1 inward (ring)."""
        return -1.0 if self.internal else 1.0

    def pressure_angle(self, radius: Array | float) -> Array:
        """Pressure angle α_ρ, cos α_ρ = r_b/ρ, rad; 0 below the base circle."""
        return np.arccos(np.minimum(1.0, self.base_radius / np.asarray(radius, dtype=float)))

    def half_angle(self, radius: Array | float) -> Array:
        """Half angle δ(ρ) of the involute, rad; constant below the base circle (radial flank)."""
        alpha = self.pressure_angle(radius)
        half = self.thickness / (2 * self.reference_radius)
        return half - self.outward * (involutes(alpha) - involute(self.transverse_angle))

    @cached_property
    def base_half_angle(self) -> float:
        """Half angle at the base circle, s/(2 r) ± inv α_t, rad."""
        half = self.thickness / (2 * self.reference_radius)
        return half + self.outward * involute(self.transverse_angle)

    def thickness_at(self, radius: float) -> float:
        """Transverse tooth thickness along the circle of that radius, 2 ρ δ(ρ), m."""
        return 2.0 * radius * float(self.half_angle(radius))

    def load_angle(self, radius: Array) -> Array:
        """Angle α_ρ ∓ δ(ρ) between a normal load on the flank at ρ and the normal of the middle
        line (upper sign external), rad."""
        return self.pressure_angle(radius) - self.outward * self.half_angle(radius)

    def roll_length(self, radius: float) -> float:
        """√(ρ² − r_b²): radius of curvature of the flank at ρ, the length along the line of action
        from the base tangent point, m."""
        return math.sqrt(max(radius**2 - self.base_radius**2, 0.0))

    def tangent_distance(self, mate: ToothGeometry, working_angle: float) -> float:
        """Distance between both base tangent points on the line of action, (r_b2 ± r_b1) tan α_w
        (− with a ring), m."""
        arm = mate.base_radius + (-1.0 if mate.internal else 1.0) * self.base_radius
        return arm * math.tan(working_angle)

    def path_of_contact(self, mate: ToothGeometry, working_angle: float) -> tuple[float, float]:
        """Ends s_lo and s_hi of the path of contact with ``mate``, m.

        s is the distance on the line of action from this gear's base tangent point, equal to the
        radius of curvature of its flank. The path runs from the mate's tip to this gear's tip, but
        not beyond ``usable_roll`` of either flank.
        """
        between = self.tangent_distance(mate, working_angle)
        tip, mate_tip = self.roll_length(self.tip_radius), mate.roll_length(mate.tip_radius)
        first = mate_tip - between if mate.internal else between - mate_tip
        last = mate.usable_roll - between if mate.internal else between - mate.usable_roll
        return max(first, self.usable_roll), min(tip, last)

    def interferes_with(self, mate: ToothGeometry, working_angle: float) -> bool:
        """Whether a ring's tip reaches this gear's flank below its base circle."""
        between = self.tangent_distance(mate, working_angle)
        return mate.internal and mate.roll_length(mate.tip_radius) < between

    @property
    def is_cut(self) -> bool:
        """Whether base and reference circle fit each other: a case may give any base diameter."""
        base = self.reference_radius * math.cos(self.transverse_angle)
        return abs(self.base_radius - base) < 1e-9 * base

    @cached_property
    def root(self) -> ToothRoot:
        """Root curve that the tool cuts below the involute."""
        base = self.reference_radius * math.cos(self.transverse_angle)
        return _root(self if self.is_cut else replace(self, base_radius=base))

    @property
    def form_radius(self) -> float:
        """Radius d_Ff/2 at which the involute begins, m. Raises ValueError without involute."""
        return self.root.form_radius

    @property
    def usable_roll(self) -> float:
        """Roll length of the root end of the flank, m: at the form circle of an undercut flank,
        else at the base circle, or at the root circle of a ring."""
        if self.is_cut and self.root.is_undercut:
            return self.roll_length(self.form_radius)
        return self.roll_length(self.root_radius) if self.internal else 0.0

    def profile(self, flank: int, root: int) -> Array:
        """Points (flank + root + 1, 2), m, of one side from the tip to the root circle."""
        radius = np.linspace(self.tip_radius, self.form_radius, flank + 1)[:-1]
        half = self.half_angle(radius)
        upper = radius[:, None] * np.column_stack([np.cos(half), np.sin(half)])
        return np.concatenate([upper, self.root.points(root)])

    def outline(self, points: int = 160) -> ToothOutline:
        """Outline from the tip to the root section with ``points`` points on the flank."""
        root = self.root
        below = root.at(np.linspace(root.form, root.section_place, points // 3))[1:]
        radius = np.linspace(self.tip_radius, self.form_radius, points)
        half = self.half_angle(radius)
        x = np.concatenate([radius * np.cos(half), below.real])
        y = np.concatenate([radius * np.sin(half), below.imag])
        return ToothOutline(self, x, y, points)


@lru_cache(maxsize=256)
def _root(tooth: ToothGeometry) -> ToothRoot:
    return ToothRoot(tooth)


def reference_radius(teeth: float, rack: Rack) -> float:
    """Reference radius r = z m_n / (2 cos β), m."""
    return rack.normal_module * teeth / (2 * math.cos(rack.helix_angle))


def tooth_geometry(blank: Blank, rack: Rack, *, internal: bool = False) -> ToothGeometry:
    """Tooth of a gear. Raises Refusal, with a key of the gear, for a tool that cannot cut it."""
    module, x = rack.normal_module, blank.profile_shift
    at, r = transverse_angle(rack), reference_radius(blank.teeth, rack)
    out = -1.0 if internal else 1.0
    root = r - out * module * (blank.dedendum - x)
    tip = r + out * module * (blank.addendum + x)
    if blank.tool.protuberance > 0.0 and blank.tool.protuberance_angle >= rack.pressure_angle:
        raise Refusal(
            "tool.protuberance_angle", "is not below the pressure angle", "5 to 10° are usual"
        )
    tool: GeneratingTool
    if internal or blank.tool.teeth is not None:
        tool = _cutter(blank, rack, internal, root)
        if blank.tool.tip_diameter is not None:
            root = tool.distance - out * tool.tip_circle
    else:
        tool = _rack_tool(blank, rack)
    fitting = rounded(tool, blank.root_fillet * module)
    if fitting is None:
        raise Refusal("dedendum", "is so large that the tool's tip is a point", "lower it")
    return ToothGeometry(
        teeth=round(blank.teeth),
        internal=internal,
        reference_radius=r,
        base_radius=r * math.cos(at),
        tip_radius=tip,
        root_radius=root,
        thickness=_thickness(x, rack),
        transverse_angle=at,
        tool=fitting,
    )


def _thickness(shift: float, rack: Rack) -> float:
    """Transverse thickness s at the reference circle of a gear or a cutter, m."""
    half = math.pi / 2 + 2 * shift * math.tan(rack.pressure_angle)
    return rack.normal_module * half / math.cos(rack.helix_angle)


def _rack_tool(blank: Blank, rack: Rack) -> RackTool:
    """Rack whose rolling line touches the gear's reference circle."""
    if blank.tool.tip_diameter is not None or blank.tool.profile_shift:
        raise Refusal(
            "tool.teeth", "is missing beside data of a cutter", "add it, or take these out"
        )
    module, x = rack.normal_module, blank.profile_shift
    return RackTool(
        pitch=math.pi * module,
        half_tooth=module * (math.pi / 4 - x * math.tan(rack.pressure_angle)),
        depth=module * (blank.dedendum - x),
        tip_radius=blank.root_fillet * module,
        pressure_angle=rack.pressure_angle,
        helix_angle=rack.helix_angle,
        protuberance=blank.tool.protuberance - blank.tool.grinding_allowance,
        protuberance_angle=blank.tool.protuberance_angle,
    )


def _cutter(blank: Blank, rack: Rack, internal: bool, root: float) -> CutterTool:
    """Cutter of a gear. root: radius of the root circle, m, used without a tip diameter. The
    default number of teeth is half the ring's: more than that of any planet, so that the cutter
    makes the ring's flank wherever planets touch it, and too few to trim the ring's tips."""
    teeth = math.floor(blank.teeth / 2) if blank.tool.teeth is None else blank.tool.teeth
    out, at = -1.0 if internal else 1.0, transverse_angle(rack)
    r, r0 = (reference_radius(z, rack) for z in (blank.teeth, teeth))
    if internal and teeth >= blank.teeth:
        raise Refusal("tool.teeth", f"{teeth} do not go into the ring's {blank.teeth}", "lower it")
    shifts = blank.profile_shift + blank.tool.profile_shift
    angle = involute(at) + 2 * math.tan(rack.pressure_angle) * shifts / (teeth + out * blank.teeth)
    if angle <= 0.0:
        problem = f"a cutter of {teeth} teeth does not roll in this ring: inv α_0 = {angle:.4f}"
        remedy = "lower the profile shifts of ring and cutter, or use fewer teeth of the cutter"
        raise Refusal("tool.teeth", problem, remedy)
    base = r0 * math.cos(at)
    distance = (base + out * r * math.cos(at)) * out / math.cos(inverse_involute(angle))
    stated = blank.tool.tip_diameter
    tip = out * (distance - root) if stated is None else stated / 2
    if tip <= base:
        key = "dedendum" if stated is None else "tool.tip_diameter_mm"
        raise Refusal(key, "leaves the cutter's tip inside its base circle", "raise it")
    half = _thickness(blank.tool.profile_shift, rack) / (2 * r0)
    return CutterTool(
        teeth=teeth,
        base_radius=base,
        tip_circle=tip,
        base_half_angle=half + involute(at),
        tip_radius=blank.root_fillet * rack.normal_module,
        distance=distance,
        internal=internal,
        pitch_angle=2 * math.pi / blank.teeth,
        protuberance=(blank.tool.protuberance - blank.tool.grinding_allowance)
        / math.cos(rack.helix_angle),
        protuberance_angle=blank.tool.protuberance_angle,
    )
