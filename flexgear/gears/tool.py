"""Tools that generate teeth, and the root that they leave, in the transverse plane.

Frame of a tool's tooth as complex numbers: the real axis along the middle of the tooth towards its
tip, from the rolling line of a rack or from the centre of a cutter; the imaginary axis towards the
flank that is looked at. Its profile is, from the end of the tip land on,

    P(t) = C + ρ e^{iψ},   ψ = ψ_0 + t (ψ_1 − ψ_0),  0 ≤ t ≤ 1      tip rounding, normal n = e^{iψ}
    P(t) = P(1) + (t − 1) L i n,   1 ≤ t ≤ 2                           flank of the protuberance

The rounding touches the tip line (circle) and the flank that makes the finished gear, moved outward
by the protuberance less the grinding allowance, s_pr = pr_P0 − q. A rack of helical gears has this
profile in the normal section, and in the transverse one everything along the imaginary axis over
cos β (its rounding is an ellipse there); a cutter has it in its transverse section.

A point of the tool cuts when its normal passes through the pitch point (law of gearing):

    rack      X = Re P · Im n / Re n − Im P,   G = e^{iγ} (r − P − iX) e^{iX/r}
    cutter    sin(φ + arg n) = −Im(n̄ P)/r_w0
              external   G = e^{iγ} (a_0 − P e^{iφ}) e^{iφ r_w0/r_w}
              internal   G = e^{iγ} conj[(a_0 + P e^{iφ}) e^{−iφ r_w0/r_w}]

X: displacement of the rack, φ: turn of the cutter from where its tooth stands in the middle of the
gear's space; r, r_w, r_w0: rolling radii; a_0 = r_w ± r_w0; γ: half a pitch. G is the root on the
+θ side of the gear's tooth that stands on the real axis. Sources: ISO 21771:2007 for a cutter's
data; the rest follows from the law of gearing.

The root of a tooth is the curve that its tool leaves between the involute and the root circle:
points G(t) with their normals, from the root circle outward (t = 0) to what makes the flank
(t = t_end). The involute begins at t_F, the last place where the curve comes
out of the tooth that the involute alone would make,

    gap(t) = arg G − δ(|G|),   gap(t_F) = 0,   gap < 0 just below, gap ≥ 0 above it,

δ being the half angle of the involute, and below the base circle that at the base circle: there the
tool has undercut the flank, or freed it by its protuberance. Without either the curve touches the
involute at t_end. Curvature is dτ/ds with the angle τ between tangent and middle line, sin τ = ±n_x
(lower sign internal).
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flexgear.arrays import Array

if TYPE_CHECKING:
    from flexgear.gears.tooth import ToothGeometry
    from flexgear.model.member import Tool


Points = NDArray[np.complex128]
RAMP = 2.0  # length of the protuberance's flank over what reaches the finished one
LEAST_ROUNDING = 1e-3  # over the pitch, below which a tool's tip is a point


@dataclass(frozen=True)
class PlainTool:
    """Data of a tool, as ``Tool`` of a case has them, for gears without a case; m, rad."""

    teeth: float | None = None
    profile_shift: float = 0.0
    tip_diameter: float | None = None
    protuberance: float = 0.0
    protuberance_angle: float = math.radians(8.0)
    grinding_allowance: float = 0.0


PLAIN_TOOL = PlainTool()


def plain_tool(data: Tool) -> PlainTool:
    """The same data as plain numbers."""
    return PlainTool(**{f.name: getattr(data, f.name) for f in fields(PlainTool)})


@dataclass(frozen=True)
class Profile:
    """Tip rounding and protuberance of a tool; symbols in the module's head. centre: C; radius: ρ;
    first, last: ψ_0 and ψ_1; ramp: L, 0 without protuberance."""

    centre: complex
    radius: float
    first: float
    last: float
    ramp: float

    @property
    def end(self) -> float:
        """Largest t."""
        return 2.0 if self.ramp else 1.0

    def at(self, t: Array) -> tuple[Points, Points]:
        """P and n at t of any shape."""
        normal = np.exp(1j * (self.first + np.minimum(t, 1.0) * (self.last - self.first)))
        along = np.maximum(np.asarray(t) - 1.0, 0.0) * self.ramp
        return self.centre + (self.radius + 1j * along) * normal, normal


@dataclass(frozen=True)
class RackTool:
    """A rack. pitch: along the rolling line, normal section, m; half_tooth: half the thickness of
    its tooth there, on the rolling line, m; depth: of its tip line below that; tip_radius: ρ;
    protuberance: s_pr, m; protuberance_angle, pressure_angle (normal), helix_angle: rad."""

    pitch: float
    half_tooth: float
    depth: float
    tip_radius: float
    pressure_angle: float
    helix_angle: float
    protuberance: float
    protuberance_angle: float

    @cached_property
    def profile(self) -> Profile:
        """In the normal section."""
        alpha, down = self.pressure_angle, self.depth - self.tip_radius
        normal = (self.protuberance - self.tip_radius) / math.cos(alpha)
        return _profile(
            self, complex(down, self.half_tooth - down * math.tan(alpha) + normal), alpha
        )

    @property
    def land(self) -> float:
        """Half of the tip land, m; below zero where the rounding does not fit."""
        return self.profile.centre.imag

    def end(self, rolling_radius: float) -> float:
        """Largest t of the profile that cuts."""
        return self.profile.end

    def cut(self, t: Array, rolling_radius: float) -> tuple[Points, Points]:
        """Points G of the gear's root (its tooth on the real axis) and the gear's outward normals
        there."""
        point, normal = self.profile.at(t)
        cos = math.cos(self.helix_angle)
        point = point.real + 1j * point.imag / cos
        normal = normal.real + 1j * normal.imag * cos
        normal /= abs(normal)
        rolled = point.real * normal.imag / normal.real - point.imag
        turn = np.exp(1j * (self.pitch / cos / 2 + rolled) / rolling_radius)
        return (rolling_radius - point - 1j * rolled) * turn, normal * turn


@dataclass(frozen=True)
class CutterTool:
    """A shaper cutter, transverse section. teeth: z_0; base_radius: r_b0; tip_circle: d_a0/2, m;
    base_half_angle: of its tooth at the base circle, rad; rounding: ρ_a0, m; distance: a_0, m;
    internal: whether it cuts a ring; pitch_angle: of the gear, rad; protuberance: s_pr in the
    transverse section, m; protuberance_angle: rad."""

    teeth: float
    base_radius: float
    tip_circle: float
    base_half_angle: float
    tip_radius: float
    distance: float
    internal: bool
    pitch_angle: float
    protuberance: float
    protuberance_angle: float

    @cached_property
    def profile(self) -> Profile:
        """Parallels of an involute are involutes of the same base circle."""
        base, radius = self.base_radius, self.tip_circle - self.tip_radius
        roll = math.sqrt(max(radius**2 - base**2, 0.0))
        angle = self.base_half_angle - (roll / base - math.atan2(roll, base))
        angle += (self.protuberance - self.tip_radius) / base
        # the flank's normal at the rounding touches the base circle
        alpha = math.pi / 2 - angle - math.atan2(base, roll)
        return _profile(self, cmath.rect(radius, angle), alpha, angle)

    def working_angle(self, gear_base_radius: float) -> float:
        """α_0, cos α_0 = (r_b ± r_b0)/a_0, rad."""
        sign = -1.0 if self.internal else 1.0
        return math.acos((gear_base_radius + sign * self.base_radius) / self.distance)

    @property
    def land(self) -> float:
        """Half of the tip land, m; below zero where the rounding does not fit."""
        centre = self.profile.centre
        return math.atan2(centre.imag, centre.real) * self.tip_circle

    def end(self, rolling_radius: float) -> float:
        """Largest t of the profile that cuts: further on normals pass by the pitch point."""
        profile, reach = self.profile, 0.999999 * self._rolling(rolling_radius)
        centre = complex(profile.centre)
        lever = abs(centre) * math.sin(profile.last - math.atan2(centre.imag, centre.real))
        if lever <= reach:
            return 1.0 + min(1.0, (reach - lever) / profile.ramp) if profile.ramp else 1.0
        return math.asin(reach / abs(centre)) / (profile.last - profile.first)

    def _rolling(self, rolling_radius: float) -> float:
        """r_w0 to r_w of the gear."""
        return (rolling_radius - self.distance) if self.internal else self.distance - rolling_radius

    def cut(self, t: Array, rolling_radius: float) -> tuple[Points, Points]:
        """As of ``RackTool``; rolling_radius: r_w of the gear."""
        point, normal = self.profile.at(t)
        cutter_radius = self._rolling(rolling_radius)
        lever = (np.conj(normal) * point).imag / cutter_radius
        turn = -np.angle(normal) - np.arcsin(np.clip(lever, -1.0, 1.0))
        roll, half = np.exp(1j * turn), np.exp(0.5j * self.pitch_angle)
        along = np.exp(1j * turn * cutter_radius / rolling_radius)
        if self.internal:
            point, normal = (self.distance + point * roll) / along, normal * roll / along
            return half * np.conj(point), -half * np.conj(normal)
        return half * (self.distance - point * roll) * along, half * normal * roll * along


GeneratingTool = RackTool | CutterTool


def _profile(
    tool: GeneratingTool, centre: complex, flank_angle: float, first: float = 0.0
) -> Profile:
    """Rounding about ``centre`` from ψ_0 = ``first`` on; flank_angle: between the finished flank
    and the middle line where the rounding meets it, rad."""
    rho, spr = tool.tip_radius, tool.protuberance
    slope, ramp = (tool.protuberance_angle if spr > 0.0 else flank_angle), 0.0
    if flank_angle > slope:
        # from where the rounding ends the finished flank is ``free`` away along its normal
        free = spr - rho * (1.0 - math.cos(flank_angle - slope))
        ramp = RAMP * max(free, 0.0) / math.sin(flank_angle - slope)
    return Profile(centre, rho, first, math.pi / 2 - slope, ramp)


def rounded(tool: GeneratingTool, tip_radius: float) -> GeneratingTool | None:
    """The tool with this tip radius, or that of its full round where that does not fit;
    None where its tip is a point."""
    tool = replace(tool, tip_radius=tip_radius)
    if tool.land >= 0.0:
        return tool

    def land(radius: float) -> float:
        return replace(tool, tip_radius=radius).land

    least = LEAST_ROUNDING * tip_radius
    if land(least) <= 0.0:
        return None
    return replace(tool, tip_radius=float(brentq(land, least, tip_radius, xtol=1e-15, rtol=1e-14)))


ROOT_SECTION = {False: math.radians(30.0), True: math.radians(60.0)}  # by internal, ISO 6336-3
_PLACES = 600  # of the table by which arc lengths and places are found
_TOUCHES = 1e-9  # of the pitch: gap below which the curve touches the involute, not crosses it
_STEP = 1e-5  # of t, for derivatives
_HALVINGS = 50


@dataclass(frozen=True)
class CriticalSection:
    """Where a tooth breaks: thickness s_Fn, distance from the gear's centre along the middle line,
    radius of curvature ρ_F of the root there; m, in the section that is looked at."""

    thickness: float
    distance: float
    fillet_radius: float


@dataclass(frozen=True)
class ToothRoot:
    """The root on the +θ side of a tooth on the x axis; symbols in the module's head.

    Places t count from the root circle towards the tip. ValueError where the tool leaves no
    involute.
    """

    tooth: ToothGeometry

    def at(self, t: Array | float) -> Points:
        """G at t of any shape, m."""
        tooth = self.tooth
        return tooth.tool.cut(np.asarray(t, dtype=float), tooth.rolling_radius)[0]

    def slope(self, t: Array | float) -> Array:
        """sin τ at t of any shape: 0 where the tangent is parallel to the tooth's middle line."""
        tooth = self.tooth
        normal = tooth.tool.cut(np.asarray(t, dtype=float), tooth.rolling_radius)[1]
        return np.asarray(tooth.outward * normal.real)

    @property
    def end(self) -> float:
        """t_end."""
        return self.tooth.tool.end(self.tooth.rolling_radius)

    @cached_property
    def form(self) -> float:
        """t_F."""
        tooth, end = self.tooth, self.end
        t = np.linspace(0.0, end, _PLACES)
        gap = self._gap(t) * tooth.reference_radius
        touch = _TOUCHES * tooth.pitch_angle * tooth.reference_radius
        missing = np.flatnonzero(gap < -touch)
        if not len(missing):
            return float(end)
        last = int(missing[-1])
        if last == _PLACES - 1:
            raise ValueError("the tool leaves no involute")
        return float(brentq(self._gap, t[last], t[last + 1], xtol=1e-14))

    @property
    def form_radius(self) -> float:
        """d_Ff/2, where the involute begins, m."""
        return float(abs(self.at(self.form)))

    @property
    def end_angle(self) -> float:
        """Half angle at which the root circle begins, rad."""
        return float(np.angle(self.at(0.0)))

    @property
    def freed(self) -> bool:
        """Whether the tool has taken off some of the flank above it: undercut, or protuberance."""
        return self.form < self.end

    @cached_property
    def missing(self) -> float:
        """Largest width, normal to the involute, by which the flank is freed above the base circle,
        m; 0 where it is not."""
        if not self.freed:
            return 0.0
        inner, outer = sorted((self.tooth.root_radius, self.form_radius))
        radius = np.linspace(max(inner, self.tooth.base_radius), outer, _PLACES)
        return max(-float(self.proud(radius).min()), 0.0)

    def proud(self, radius: Array | float) -> Array:
        """By how much the root stands beyond the involute at radii of any shape, normal to it, m;
        below zero where the flank is freed, 0 from the form circle on."""
        half = self.half_angle(radius) - self.tooth.half_angle(radius)
        return np.asarray(half * self.tooth.base_radius)

    def half_angle(self, radius: Array | float) -> Array:
        """Half angle of flank and root at radii of any shape, rad; that of the curve's end on and
        below the root circle."""
        tooth, rho = self.tooth, np.asarray(radius, dtype=float)
        half = np.array(tooth.half_angle(rho))
        below = tooth.outward * (rho - self.form_radius) < 0
        if not below.any():
            return half
        radii = rho[below]
        low, high = np.zeros_like(radii), np.full_like(radii, self.form)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            inside = tooth.outward * (abs(self.at(middle)) - radii) < 0
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        half[below] = np.angle(self.at(0.5 * (low + high)))
        return half

    def points(self, count: int, end: float | None = None) -> Array:
        """(count + 1, 2) m from the form circle down to the root circle, or to the half angle
        ``end``: at equal steps of arc length over its whole plus turn of the tangent over its
        whole, so that short arcs of small radius have their share."""
        stop = 0.0 if end is None or end >= self.end_angle else self._place_of(end)
        t = np.linspace(self.form, stop, _PLACES)
        steps = np.abs(np.diff(self.at(t)))
        turns = np.abs(np.diff(self.slope_angle(t)))
        share = steps / steps.sum() + turns / turns.sum()
        along = np.concatenate([[0.0], np.cumsum(share)])
        point = self.at(np.interp(np.linspace(0.0, along[-1], count + 1), along, t))
        return np.column_stack([point.real, point.imag])

    def slope_angle(self, t: Array | float) -> Array:
        """τ at t of any shape, rad."""
        return np.arcsin(np.clip(self.slope(t), -1.0, 1.0))

    @cached_property
    def section_place(self) -> float:
        """t of the root section: where the tangent makes 30° (external) or 60° (internal) with the
        tooth's middle line, or where the involute ends if it is steeper there."""
        steepest = math.sin(ROOT_SECTION[self.tooth.internal])
        t = np.linspace(0.0, self.form, _PLACES)
        steeper = np.flatnonzero(self.slope(t) > steepest)
        if not len(steeper) or steeper[0] != 0:
            return 0.0
        flatter = np.flatnonzero(self.slope(t) <= steepest)
        if not len(flatter):
            return self.form
        first = int(flatter[0])
        return float(
            brentq(lambda x: float(self.slope(x)) - steepest, t[first - 1], t[first], xtol=1e-15)
        )

    @cached_property
    def section(self) -> CriticalSection:
        """At the root section."""
        t = self.section_place
        point = complex(self.at(t))
        low, high = max(t - _STEP, 0.0), min(t + _STEP, self.form)
        turn = float(self.slope_angle(low) - self.slope_angle(high))
        length = float(abs(self.at(low) - self.at(high)))
        return CriticalSection(2.0 * point.imag, point.real, length / abs(turn))

    def _gap(self, t: Array | float) -> Array:
        point = self.at(t)
        return np.asarray(np.angle(point)) - self.tooth.half_angle(np.abs(point).astype(float))

    def _place_of(self, half_angle: float) -> float:
        """t of a half angle near the root circle."""

        def off(t: float) -> float:
            return float(np.angle(self.at(t))) - half_angle

        return float(brentq(off, 0.0, self.form, xtol=1e-14))
