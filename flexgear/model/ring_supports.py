"""All that holds an FE ring, node by node: bolts, fits and splines, each with its own patch."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flexgear.model.names import NodeName
from flexgear.model.ring import End, Fit, Ring


@dataclass(frozen=True)
class RingSupport:
    """Six springs between one node of the ring and the housing.

    node: its name; group: of the FE mesh's surface that it is tied to, "" for a disc in an end
    face; place: (x, y, z) m, z being that of the end face, or mid-band; angle: of the springs' axes
    about z, rad; stiffness: radial, tangential, axial N/m, about these three axes N m/rad; end,
    diameter: of a bolt.
    """

    node: NodeName
    group: str
    place: tuple[float, float, float]
    angle: float
    stiffness: tuple[float, float, float, float, float, float]
    end: End | None = None
    diameter: float = 0.0


def ring_supports(ring: Ring, face_width: float) -> list[RingSupport]:
    """Fits, splines, then bolts circle by circle, numbered through."""
    out = [_band(NodeName.of("fit", k), band) for k, band in enumerate(ring.fits, 1)]
    out += [_band(NodeName.of("spline", k), band) for k, band in enumerate(ring.splines, 1)]
    for b in ring.bolt_circles:
        end, arm = ring.bolted_end(b), 0.5 * b.circle_diameter
        z = math.copysign(0.5 * face_width, 1.0 if end == "+z" else -1.0)
        along = (b.stiffness_radial, b.stiffness_tangential, b.stiffness_axial)
        for k in range(b.number):
            node = NodeName.of("bolt", ring.first_bolt(b) + k, digits=2)
            angle = b.first_angle + 2 * math.pi * k / b.number
            out.append(
                RingSupport(
                    node=node,
                    group=node if b.holes else "",
                    place=(arm * math.cos(angle), arm * math.sin(angle), z),
                    angle=angle,
                    stiffness=(*along, b.stiffness_tilt, b.stiffness_tilt, b.stiffness_twist),
                    end=end,
                    diameter=b.diameter,
                )
            )
    return out


def _band(node: NodeName, fit: Fit) -> RingSupport:
    along = (fit.stiffness_radial, fit.stiffness_radial, fit.stiffness_axial)
    about = (fit.stiffness_tilt, fit.stiffness_tilt, fit.stiffness_torsion)
    return RingSupport(node, node, (0.0, 0.0, fit.z), 0.0, (*along, *about))
