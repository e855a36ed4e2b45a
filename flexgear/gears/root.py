"""The root of a tooth: the curve that its tool leaves between the involute and the root circle.

Points G(t) with their normals (``tool``), from the root circle outward (t = 0) to what makes the
flank (t = t_end). The involute begins at t_F, the last place where the curve comes out of the tooth
that the involute alone would make,

    gap(t) = arg G − δ(|G|),   gap(t_F) = 0,   gap < 0 just below, gap ≥ 0 above it,

δ being the half angle of the involute, and below the base circle that at the base circle: there the
tool has undercut the flank, or freed it by its protuberance. Without either the curve touches the
involute at t_end. Curvature is dτ/ds with the angle τ between tangent and middle line, sin τ = ±n_x
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
_PLACES = 600  # of the table by which arc lengths and places are found
_TOUCHES = 1e-9  # of the pitch: gap below which the curve touches the involute, not crosses it
_STEP = 1e-5  # of t, for derivatives
_HALVINGS = 50


@dataclass(frozen=True)
class CriticalSection:
    """The critical section of a tooth: thickness s_Fn, distance from the gear's centre along the
    middle line, radius of curvature ρ_F of the root there; m, in the section (transverse or normal)
    of the tooth's curve."""

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
        """t_end, where the curve ends in the flank."""
        return self.tooth.tool.end(self.tooth.rolling_radius)

    @cached_property
    def form(self) -> float:
        """t_F, where the involute begins. ValueError where the tool leaves no involute."""
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
        """Whether the tool has removed part of the flank above the root: undercut, or
        protuberance."""
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
        """Distance by which the root lies outside the involute at radii of any shape, normal to it,
        m; negative where the flank is undercut, 0 from the form circle on."""
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
        """The critical section at ``section_place``."""
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
