"""The web of a carrier between two neighbouring planets."""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, asin, cos, hypot, sin, sqrt


@dataclass(frozen=True)
class Web:
    """A web on the middle line between two planets; m and rad.

    phi: half the angle between the planets whose room it leaves free. It is `width` wide at the
    plates' edge, bounded by arcs about the two pins and by a flat at the radius `start`.
    clear: radius about a pin that the planet needs; inner_radius: where the web
    begins, None: where it is a third of its width thick.
    """

    phi: float
    center_distance: float
    edge: float
    width: float
    clear: float
    inner_radius: float | None = None

    @property
    def arc_radius(self) -> float:
        """Radius about each pin outside which the web lies, m.

        The larger of what the planet needs and the distance from the pin to the web's corner on
        the plates' edge at τ = width/2 from the middle line.
        """
        off = self.phi - asin(min(self.width / 2.0 / self.edge, 1.0))
        corner = hypot(self.edge * cos(off) - self.center_distance, self.edge * sin(off))
        return max(self.clear, corner if off > 0.0 else 0.0)

    def half_thickness(self, radius: float) -> float:
        """h(ρ) on the middle line at θ = φ: (ρ - R cos φ)² + (R sin φ - h)² = r_arc², m."""
        free = self.arc_radius**2 - (radius - self.center_distance * cos(self.phi)) ** 2
        return self.center_distance * sin(self.phi) - sqrt(max(free, 0.0))

    @property
    def start(self) -> float:
        """Inner radius of the web: as given, or where it is a third of its width thick, m."""
        if self.inner_radius is not None:
            return self.inner_radius
        side = self.center_distance * sin(self.phi) - self.width / 6.0
        beyond = sqrt(max(self.arc_radius**2 - side**2, 0.0))
        return self.center_distance * cos(self.phi) + beyond

    @property
    def edge_angle(self) -> float:
        """Half angle of the web at the plates' edge, seen from the axis, rad (law of cosines)."""
        edge, r = self.edge, self.center_distance
        cosine = (edge**2 + r**2 - self.arc_radius**2) / (2.0 * edge * r)
        return self.phi - acos(max(-1.0, min(1.0, cosine)))
