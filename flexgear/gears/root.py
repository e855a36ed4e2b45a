"""Root of a tooth: the curve that the tool cuts between the involute and the root circle.

The curve G(t), with normals (``tool``), runs from the root circle (t = 0) to the flank (t = t_end).
The involute begins at t_F, where the curve crosses it for the last time,

    gap(t) = arg G − δ(|G|),   gap(t_F) = 0,   gap < 0 just below, gap ≥ 0 above,

δ being the half angle of the involute, below the base circle that at the base circle. Then the tool
has undercut the flank, possibly by its protuberance; otherwise the curve touches the involute at
t_F = t_end. Curvature is dτ/ds with the angle τ between tangent and middle line, sin τ = ±n_x
(lower sign internal).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from flexgear.arrays import Array
from flexgear.gears.tool import Points

if TYPE_CHECKING:
    from flexgear.gears.tooth import ToothGeometry


ROOT_SECTION = {False: math.radians(30.0), True: math.radians(60.0)}  # by internal, ISO 6336-3
_POINTS = 600  # of tables over t
_TOUCHING = 1e-9  # of the pitch: gap below which the curve touches the involute, not crosses it
_STEP = 1e-5  # of t, for derivatives
_HALVINGS = 50


@dataclass(frozen=True)
class CriticalSection:
    """Critical section of a tooth root, in the plane (transverse or normal) of the tooth.
    thickness: s_Fn; distance: from the gear's centre along the middle line; fillet_radius: radius
    of curvature ρ_F; all m."""

    thickness: float
    distance: float
    fillet_radius: float


@dataclass(frozen=True)
class ToothRoot:
    """Root on the +θ side of a tooth on the x axis; symbols as in the module docstring. The
    parameter t rises from the root circle towards the tip. Raises ValueError where the tool leaves
    no involute."""

    tooth: ToothGeometry

    def at(self, t: Array | float) -> Points:
        """Points G at t of any shape, m, as x + i y."""
        tooth = self.tooth
        return tooth.tool.cut(np.asarray(t, dtype=float), tooth.rolling_radius)[0]

    def slope(self, t: Array | float) -> Array:
        """sin τ at t of any shape: 0 where the tangent is parallel to the tooth's middle line."""
        tooth = self.tooth
        normal = tooth.tool.cut(np.asarray(t, dtype=float), tooth.rolling_radius)[1]
        return np.asarray(tooth.outward * normal.real)

    @property
    def end(self) -> float:
        """Parameter t_end at which the curve meets the flank."""
        return self.tooth.tool.end(self.tooth.rolling_radius)

    @cached_property
    def form(self) -> float:
        """Parameter t_F at which the involute begins. Raises ValueError without involute."""
        tooth, end = self.tooth, self.end
        t = np.linspace(0.0, end, _POINTS)
        gap = self._gap(t) * tooth.reference_radius
        touch = _TOUCHING * tooth.pitch_angle * tooth.reference_radius
        undercut = np.flatnonzero(gap < -touch)
        if not len(undercut):
            return float(end)
        last = int(undercut[-1])
        if last == _POINTS - 1:
            raise ValueError("the tool leaves no involute")
        return float(brentq(self._gap, t[last], t[last + 1], xtol=1e-14))

    @property
    def form_radius(self) -> float:
        """Radius d_Ff/2 at which the involute begins, m."""
        return float(abs(self.at(self.form)))

    @property
    def end_angle(self) -> float:
        """Half angle at which the root circle begins, rad."""
        return float(np.angle(self.at(0.0)))

    @property
    def is_undercut(self) -> bool:
        """Whether the tool has removed part of the flank, by undercut or its protuberance."""
        return self.form < self.end

    @cached_property
    def undercut(self) -> float:
        """Largest depth of undercut above the base circle, normal to the involute, m."""
        if not self.is_undercut:
            return 0.0
        inner, outer = sorted((self.tooth.root_radius, self.form_radius))
        radius = np.linspace(max(inner, self.tooth.base_radius), outer, _POINTS)
        return max(-float(self.protrusion(radius).min()), 0.0)

    def protrusion(self, radius: Array | float) -> Array:
        """Height of the root over the involute, normal to it, at radii of any shape, m; negative
        where the flank is undercut, 0 beyond the form circle."""
        half = self.half_angle(radius) - self.tooth.half_angle(radius)
        return np.asarray(half * self.tooth.base_radius)

    def half_angle(self, radius: Array | float) -> Array:
        """Half angle of flank and root at radii of any shape, rad; below the root circle that at
        the root circle."""
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
        """Points (count + 1, 2), m, from the form circle to the root circle, or to the half angle
        ``end``. In equal steps of relative arc length plus relative rotation of the tangent, so
        that short arcs of small radius are resolved."""
        stop = 0.0
        if end is not None and end < self.end_angle:
            stop = brentq(lambda t: float(np.angle(self.at(t))) - end, 0.0, self.form, xtol=1e-14)
        t = np.linspace(self.form, stop, _POINTS)
        steps = np.abs(np.diff(self.at(t)))
        turns = np.abs(np.diff(self.slope_angle(t)))
        share = steps / steps.sum() + turns / turns.sum()
        along = np.concatenate([[0.0], np.cumsum(share)])
        point = self.at(np.interp(np.linspace(0.0, along[-1], count + 1), along, t))
        return np.column_stack([point.real, point.imag])

    def slope_angle(self, t: Array | float) -> Array:
        """Angle τ between tangent and middle line at t of any shape, rad."""
        return np.arcsin(np.clip(self.slope(t), -1.0, 1.0))

    @cached_property
    def section_place(self) -> float:
        """Parameter t of the critical section, whose tangent makes 30° (external) or 60° (internal)
        with the tooth's middle line; t_F if the tangent is steeper everywhere."""
        steepest = math.sin(ROOT_SECTION[self.tooth.internal])
        t = np.linspace(0.0, self.form, _POINTS)
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
        """Critical section at ``section_place``."""
        t = self.section_place
        point = complex(self.at(t))
        low, high = max(t - _STEP, 0.0), min(t + _STEP, self.form)
        turn = float(self.slope_angle(low) - self.slope_angle(high))
        length = float(abs(self.at(low) - self.at(high)))
        return CriticalSection(2.0 * point.imag, point.real, length / abs(turn))

    def _gap(self, t: Array | float) -> Array:
        point = self.at(t)
        return np.asarray(np.angle(point)) - self.tooth.half_angle(np.abs(point).astype(float))
