"""Tools that generate teeth, and the root curve that they cut, in the transverse plane.

Frame of a tool's tooth as complex numbers: the real axis along the middle of the tooth towards its
tip, from the rolling line of a rack or from the centre of a cutter; the imaginary axis towards the
cutting flank. The profile that begins at the end of the tip land is

    P(t) = C + ρ e^{iψ},   ψ = ψ_0 + t (ψ_1 − ψ_0),  0 ≤ t ≤ 1      tip rounding, normal n = e^{iψ}
    P(t) = P(1) + (t − 1) L i n,   1 ≤ t ≤ 2                           flank of the protuberance

The rounding touches the tip line (circle) and the flank that makes the finished gear, offset
outward by the protuberance less the grinding allowance, s_pr = pr_P0 − q. A rack of helical gears
has this profile in the normal section; in the transverse section lengths along the imaginary axis
are divided by cos β (its rounding is an ellipse there). A cutter has it in its transverse section.

A point of the tool cuts when its normal passes through the pitch point (law of gearing):

    rack      X = Re P · Im n / Re n − Im P,   G = e^{iγ} (r − P − iX) e^{iX/r}
    cutter    sin(φ + arg n) = −Im(n̄ P)/r_w0
              external   G = e^{iγ} (a_0 − P e^{iφ}) e^{iφ r_w0/r_w}
              internal   G = e^{iγ} conj[(a_0 + P e^{iφ}) e^{−iφ r_w0/r_w}]

X: displacement of the rack, φ: rotation of the cutter, 0 with its tooth in the middle of a space of
the gear; r, r_w, r_w0: rolling radii; a_0 = r_w ± r_w0; γ: half a pitch. G is the root on the +θ
side of the gear's tooth on the real axis. Sources: ISO 21771:2007 for the data of cutters; the rest
follows from the law of gearing.
"""

import cmath
import math
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flexgear.arrays import Array
from flexgear.model.member import Tool

Points = NDArray[np.complex128]
RAMP = 2.0  # length of the protuberance's flank over its length up to the finished flank
LEAST_ROUNDING = 1e-3  # of the stated tip radius; with less a tool's tip is a point


@dataclass(frozen=True)
class PlainTool:
    """Plain numbers of a tool with the meaning of ``Tool``, for gears without a case; m, rad."""

    teeth: float | None = None
    profile_shift: float = 0.0
    tip_diameter: float | None = None
    protuberance: float = 0.0
    protuberance_angle: float = math.radians(8.0)
    grinding_allowance: float = 0.0


PLAIN_TOOL = PlainTool()


def plain_tool(data: Tool) -> PlainTool:
    """Plain numbers of a tool of a case."""
    return PlainTool(**{f.name: getattr(data, f.name) for f in fields(PlainTool)})


@dataclass(frozen=True)
class Profile:
    """Tip rounding and protuberance of a tool. centre: C; radius: ρ; first, last: ψ_0 and ψ_1;
    ramp: L, 0 without protuberance."""

    centre: complex
    radius: float
    first: float
    last: float
    ramp: float

    @property
    def end(self) -> float:
        """Largest parameter t of the profile."""
        return 2.0 if self.ramp else 1.0

    def at(self, t: Array) -> tuple[Points, Points]:
        """Points P and normals n at t of any shape."""
        normal = np.exp(1j * (self.first + np.minimum(t, 1.0) * (self.last - self.first)))
        along = np.maximum(np.asarray(t) - 1.0, 0.0) * self.ramp
        return self.centre + (self.radius + 1j * along) * normal, normal


@dataclass(frozen=True)
class RackTool:
    """Rack that generates a gear, in normal section.

    pitch: along the rolling line, m; half_tooth: half the thickness of a tooth on the rolling line,
    m; depth: distance from the rolling line to the tip line, m; tip_radius: ρ, m; pressure_angle
    (normal), helix_angle, protuberance_angle: rad; protuberance: s_pr, m.
    """

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
        """Profile in the normal section."""
        alpha, down = self.pressure_angle, self.depth - self.tip_radius
        normal = (self.protuberance - self.tip_radius) / math.cos(alpha)
        return _profile(
            self, complex(down, self.half_tooth - down * math.tan(alpha) + normal), alpha
        )

    @property
    def land(self) -> float:
        """Half of the tip land, m; negative if the rounding does not fit."""
        return self.profile.centre.imag

    def end(self, rolling_radius: float) -> float:
        """Largest parameter t of the profile that cuts."""
        return self.profile.end

    def cut(self, t: Array, rolling_radius: float) -> tuple[Points, Points]:
        """Points G of the gear's root, m, for a tooth on the real axis, and outward normals. t: of
        any shape; rolling_radius: of the gear, m."""
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
    """Shaper cutter in transverse section.

    teeth: z_0; base_radius: r_b0, m; tip_circle: d_a0/2, m; base_half_angle: half angle of a tooth
    at the base circle, rad; tip_radius: ρ_a0, m; distance: a_0, m; internal: whether the gear is a
    ring; pitch_angle: of the gear, rad; protuberance: s_pr, m; protuberance_angle: rad.
    """

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
        """Profile in transverse section: the centre of the rounding is on an involute, which is
        parallel to the flank and has the same base circle."""
        base, radius = self.base_radius, self.tip_circle - self.tip_radius
        roll = math.sqrt(max(radius**2 - base**2, 0.0))
        angle = self.base_half_angle - (roll / base - math.atan2(roll, base))
        angle += (self.protuberance - self.tip_radius) / base
        # the flank's normal at the rounding touches the base circle
        alpha = math.pi / 2 - angle - math.atan2(base, roll)
        return _profile(self, cmath.rect(radius, angle), alpha, angle)

    def working_angle(self, gear_base_radius: float) -> float:
        """Working angle α_0 of cutter and gear, cos α_0 = (r_b ± r_b0)/a_0, rad."""
        sign = -1.0 if self.internal else 1.0
        return math.acos((gear_base_radius + sign * self.base_radius) / self.distance)

    @property
    def land(self) -> float:
        """Half of the tip land, m; negative if the rounding does not fit."""
        centre = self.profile.centre
        return math.atan2(centre.imag, centre.real) * self.tip_circle

    def end(self, rolling_radius: float) -> float:
        """Largest parameter t of the profile that cuts; normals beyond miss the pitch point."""
        profile, reach = self.profile, 0.999999 * self._rolling(rolling_radius)
        centre = complex(profile.centre)
        lever = abs(centre) * math.sin(profile.last - math.atan2(centre.imag, centre.real))
        if lever <= reach:
            return 1.0 + min(1.0, (reach - lever) / profile.ramp) if profile.ramp else 1.0
        return math.asin(reach / abs(centre)) / (profile.last - profile.first)

    def _rolling(self, rolling_radius: float) -> float:
        """Rolling radius r_w0 of the cutter for that of the gear, r_w, m."""
        return (rolling_radius - self.distance) if self.internal else self.distance - rolling_radius

    def cut(self, t: Array, rolling_radius: float) -> tuple[Points, Points]:
        """Points G of the gear's root, m, and outward normals; arguments as in ``RackTool.cut``."""
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
    """Profile with a rounding about ``centre`` that begins at ψ_0 = ``first``; flank_angle: between
    the finished flank and the middle line where the rounding meets it, rad."""
    rho, spr = tool.tip_radius, tool.protuberance
    slope, ramp = (tool.protuberance_angle if spr > 0.0 else flank_angle), 0.0
    if flank_angle > slope:
        # distance of the finished flank from the end of the rounding, along the flank's normal
        distance = spr - rho * (1.0 - math.cos(flank_angle - slope))
        ramp = RAMP * max(distance, 0.0) / math.sin(flank_angle - slope)
    return Profile(centre, rho, first, math.pi / 2 - slope, ramp)


def rounded(tool: GeneratingTool, tip_radius: float) -> GeneratingTool | None:
    """Tool with the tip radius, m, or with a full round tip if that is smaller; None if the tip is
    a point."""
    tool = replace(tool, tip_radius=tip_radius)
    if tool.land >= 0.0:
        return tool

    def land(radius: float) -> float:
        return replace(tool, tip_radius=radius).land

    least = LEAST_ROUNDING * tip_radius
    if land(least) <= 0.0:
        return None
    return replace(tool, tip_radius=float(brentq(land, least, tip_radius, xtol=1e-15, rtol=1e-14)))
