"""Ring gear with its teeth as hexahedra: transverse section, layers along the axis, helix.

Frame, helix and patches of teeth and ends: ``toothed``. The flank on the -θ side is the one that
planets press when the carrier turns by +z and drives. f = 1, for the rim is a body of revolution;
with bolt holes only from the tooth's tip to the root circle, falling as 1 - 3t² + 2t³ to 0 at the
inside of the straight holes.

More patches
  fit_1, spline_1 ..   bands of the outer cylinder, in the order given
  bolt_NN              walls of the bolt holes, when there are holes
  outer                outer cylinder
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from flexgear.model.names import NodeName
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.ring_holes import with_bolt_holes
from flexgear.structures.fe_mesh.toothed import (
    DIVISIONS,
    GROWTH,
    Band,
    ToothedMeshParameters,
    extruded,
    layer_positions,
)
from flexgear.structures.fe_mesh.toothed_section import ToothedSection, toothed_section

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_HOLE_ROWS = {"quick": (2, 1, 1), "standard": (3, 1, 1), "fine": (4, 1, 2)}  # see ring_holes.py
BLOCK = 1.7  # inner border of a bolt's block, in bolt radii from the bolt's axis


@dataclass(frozen=True)
class RingMeshParameters(ToothedMeshParameters):
    """Everything the ring's FE mesh depends on; m and rad.

    fits: (z_low, z_high) of each housing fit's band, splines likewise. Bolt k is at
    first_bolt_angle + 2πk/bolts on the bolt circle, and named from first_bolt on. other_bolts:
    (number, circle diameter, diameter) of more circles, without holes.
    """

    part = "ring"

    rim_thickness: float = 0.205
    bolts: int = 25
    bolt_circle_diameter: float = 1.97
    bolt_diameter: float = 0.056
    bolt_holes: bool = False
    first_bolt_angle: float = 0.0
    first_bolt: int = 1
    fits: tuple[Band, ...] = ((-0.215, -0.155), (0.155, 0.215))
    splines: tuple[Band, ...] = ()
    other_bolts: tuple[tuple[int, float, float], ...] = ()

    @property
    def size(self) -> float:
        """Largest dimension, m."""
        return 2.0 * self.outer_radius

    @property
    def outer_radius(self) -> float:
        """Outer radius of the rim, m."""
        return self.tooth.root_radius + self.rim_thickness

    @property
    def bands(self) -> list[tuple[NodeName, Band]]:
        """Bands of the outer cylinder by the names of their groups."""
        fits = [(NodeName.of("fit", k), band) for k, band in enumerate(self.fits, 1)]
        return fits + [(NodeName.of("spline", k), band) for k, band in enumerate(self.splines, 1)]

    @property
    def straight_radius(self) -> float:
        """Radius beyond which the section is not twisted, m: inside bolt holes, whose axes are
        straight; without any, the rim is a body of revolution and all of it may be twisted."""
        if not self.has_holes:
            return np.inf
        return self.bolt_circle_diameter / 2.0 - BLOCK * self.bolt_diameter / 2.0

    @property
    def has_holes(self) -> bool:
        """Whether there are bolts whose holes are meshed."""
        return self.bolt_holes and self.bolts > 0

    def check(self) -> None:
        """Raise InputError, naming the key and the remedy, if no ring can be made."""
        super().check()
        tooth, width = self.tooth, self.face_width
        if self.rim_thickness < self.normal_module:
            self.reject(
                "fe.rim_thickness",
                f"{self.rim_thickness * 1e3:.1f} mm is thinner than one module",
                "the rim is counted outside the root circle; give at least one module",
            )
        if self.bolts:
            radius, hole = self.bolt_circle_diameter / 2.0, self.bolt_diameter / 2.0
            room = self.straight_radius - tooth.root_radius
            if room < 0.1 * self.rim_thickness or radius - hole < tooth.root_radius:
                self.reject(
                    "fe.bolts.circle_diameter",
                    f"bolts on {radius * 2e3:.0f} mm leave no rim below the teeth's root at "
                    f"{tooth.root_radius * 2e3:.0f} mm",
                    "raise it or lower the bolts' diameter",
                )
            if self.has_holes and abs(self.helix_rate) * width / 2.0 * radius > room:
                self.reject(
                    "fe.bolts.holes",
                    f"the helix cannot fade over the {room * 1e3:.0f} mm between the teeth's "
                    "root and the holes, whose axes are straight",
                    "leave the holes out, or raise circle_diameter",
                )
            if not radius + (1.2 if self.bolt_holes else 1.0) * hole < self.outer_radius:
                self.reject(
                    "fe.bolts.circle_diameter",
                    f"bolts on {radius * 2e3:.0f} mm break through the outer diameter of "
                    f"{self.outer_radius * 2e3:.0f} mm",
                    "lower it or raise rim_thickness",
                )
            if 2.0 * radius * np.sin(pi / self.bolts) < 1.2 * self.bolt_diameter:
                self.reject(
                    "fe.bolts.number",
                    "neighbouring bolts overlap",
                    "use fewer or thinner bolts",
                )
        for number, circle, diameter in self.other_bolts:
            parted = replace(self, bolts=number, bolt_circle_diameter=circle, other_bolts=())
            replace(parted, bolt_diameter=diameter, bolt_holes=False).check()
        for name, (low, high) in self.bands:
            tolerance = 1e-9 * width
            if not -width / 2 - tolerance <= low < high <= width / 2 + tolerance:
                self.reject(
                    f"fe.{name.kind}s",
                    f"a band from {low * 1e3:.1f} to {high * 1e3:.1f} mm is not on the face of "
                    f"±{width * 5e2:.1f} mm",
                    "move it or make it narrower",
                )
        if self.has_holes:  # whether there is room for them shows in the section
            _section(self)


def ring_fe_mesh(p: RingMeshParameters) -> FeMesh:
    """Hexahedra of the ring gear with its teeth and the patches listed in the module's head."""
    p.check()
    section = _section(p)
    z = layer_positions(p.face_width, p.fits + p.splines, p.least_layers)
    middle = (z[:-1] + z[1:]) / 2.0
    walls: list[tuple[str, Ints, Ints | None]] = []
    for name, (low, high) in p.bands:
        inside = np.flatnonzero((middle > low) & (middle < high))
        if len(inside) == 0:
            key = f"fe.{name.kind}s.{name.number - 1}"
            p.reject(key, "the band is too narrow", "make it wider")
        walls.append((name, section.rim, inside))
    walls += [(f"bolt_{k:02d}", lines, None) for k, lines in enumerate(section.holes, p.first_bolt)]
    return extruded(section, _twist(p, section.radius), z, [*walls, ("outer", section.rim, None)])


def _section(p: RingMeshParameters) -> ToothedSection:
    divisions, growth = DIVISIONS[p.fidelity][0], GROWTH[p.fidelity]
    if not p.has_holes:
        return toothed_section(p.tooth, p.outer_radius, divisions, growth)
    below = replace(divisions, rim=max(divisions.rim // 2, 1))
    return with_bolt_holes(
        toothed_section(p.tooth, p.straight_radius, below, growth),
        p.outer_radius,
        p.first_bolt_angle + 2.0 * pi * np.arange(p.bolts) / p.bolts,
        p.bolt_circle_diameter / 2.0,
        p.bolt_diameter / 2.0,
        _HOLE_ROWS[p.fidelity],
        p.where,
    )


def _twist(p: RingMeshParameters, radius: Array) -> Array:
    """κ f(r), rad/m: f = 1 to the root circle, 0 from the straight radius on, C¹ between."""
    if not p.has_holes:
        return np.full_like(radius, p.helix_rate)
    root = p.tooth.root_radius
    t = np.clip((radius - root) / (p.straight_radius - root), 0.0, 1.0)
    return p.helix_rate * (1.0 - 3.0 * t**2 + 2.0 * t**3)
