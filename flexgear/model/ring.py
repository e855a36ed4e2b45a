"""The ring as an FE body, and its supports: bolts, fits and splines."""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import Field

from flexgear.model.bodies import FeMeshSource
from flexgear.model.names import NodeName
from flexgear.model.section import Missing, OneOrMany, Refusal, Section
from flexgear.model.units import Angle, Length, RotationalStiffness, Stiffness

End = Literal["+z", "-z"]


class Bolts(Section):
    """A bolt circle of the ring. Stiffness is that of one bolt with its clamped joint to the
    housing. Bolt k is at first_angle + 2πk/number; radial and tangential are its local directions.

    number: bolts of the circle. circle_diameter: of the bolt circle. diameter: of the area on which
    a bolt acts, or of its hole. holes: true meshes the holes. first_angle: of bolt 0 from the x
    axis. stiffness_radial, stiffness_tangential, stiffness_axial: of one bolt in these directions.
    stiffness_tilt: about the radial and the tangential direction. stiffness_twist: about the bolt.
    end: bolted face; ``end`` of the ring if left out.
    """

    number: int = Field(ge=0, le=400)
    circle_diameter: Length = Field(ge=1e-2, le=20.0)
    diameter: Length = Field(ge=1e-3, le=0.3)
    holes: bool = False
    first_angle: Angle = 0.0
    end: End | None = None
    stiffness_radial: Stiffness = Field(ge=0.0, le=1e13)
    stiffness_tangential: Stiffness = Field(ge=0.0, le=1e13)
    stiffness_axial: Stiffness = Field(ge=0.0, le=1e13)
    stiffness_tilt: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e13)
    stiffness_twist: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e13)


class Fit(Section):
    """A housing fit: a cylindrical band of the outer diameter, tied to one node on the axis.

    The node has springs in all six directions, isotropic across the axis.

    z: middle of the band from mid-face. half_width: half of the band's width. stiffness_radial:
    across the axis. stiffness_axial: along the axis. stiffness_tilt: about a diameter.
    stiffness_torsion: about the axis.
    """

    z: Length = Field(ge=-2.0, le=2.0)
    half_width: Length = Field(ge=1e-4, le=1.0)
    stiffness_radial: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    stiffness_axial: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    stiffness_tilt: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e14)
    stiffness_torsion: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e14)

    @property
    def band(self) -> tuple[float, float]:
        """Axial limits of the band, m."""
        return (self.z - self.half_width, self.z + self.half_width)


class Spline(Fit):
    """An outer spline or lugs: a fit that transmits the ring's torque."""

    def _check(self) -> None:
        if self.stiffness_torsion == 0.0:
            problem = "is zero, so the spline transmits no torque"
            raise Refusal("stiffness_torsion", problem, "give it a stiffness, or make it a fit")


class Ring(FeMeshSource):
    """Ring gear as an FE body.

    rim_thickness: outside the root circle of the teeth. tie: whether tooth nodes act on the root or
    the flank of their teeth. tie_kind: averaging (RBE3) or rigid (RBE2) tie of a node to its
    surface. tooth_shapes: whether deformation of the rim along the face within a tooth is included,
    if slices have FE influences and nodes act on roots: auto, if its static effect exceeds 2 %.
    fits: bands of the outer diameter in the housing. splines: bands that transmit torque. bolts:
    one circle, or a list of circles; end: the bolted face of circles without ``end``.
    """

    usual_modes: ClassVar[int] = 120

    rim_thickness: Length = Field(ge=1e-3, le=3.0)
    tie: Literal["root", "flank"] = "root"
    tie_kind: Literal["averaging", "rigid"] = "averaging"
    tooth_shapes: Literal["auto", "always", "none"] = "auto"
    end: End | None = None
    bolts: OneOrMany[Bolts] = ()
    fits: tuple[Fit, ...] = ()
    splines: tuple[Spline, ...] = ()

    @property
    def bolt_circles(self) -> tuple[Bolts, ...]:
        """All bolt circles."""
        return (self.bolts,) if isinstance(self.bolts, Bolts) else self.bolts

    def first_bolt(self, circle: Bolts) -> int:
        """Number of a circle's first bolt; bolts of all circles are numbered consecutively."""
        earlier = self.bolt_circles[: self.bolt_circles.index(circle)]
        return 1 + sum(other.number for other in earlier)

    def bolted_end(self, circle: Bolts) -> End:
        """The face at which a circle's bolts act."""
        return circle.end or self.end or "+z"

    def _check(self) -> None:
        circles = self.bolt_circles
        if self.end is None and any(c.end is None for c in circles):
            raise Missing("end")
        if sum(c.holes for c in circles) > 1:
            raise Refusal("bolts", "more than one circle has holes", "mesh those of one circle")
        if any(circles.index(c) < k for k, c in enumerate(circles)):
            raise Refusal("bolts", "the same circle is listed twice", "list it once")
        torsion = [c.number * c.stiffness_tangential for c in circles]
        torsion += [band.stiffness_torsion for band in (*self.fits, *self.splines)]
        if any(torsion):
            return
        if isinstance(self.bolts, Bolts):
            problem = "is zero, so nothing supports the ring's torque"
            raise Refusal("bolts.stiffness_tangential", problem, "give the bolts a stiffness")
        problem = "nothing supports the ring's torque"
        raise Refusal("bolts", problem, "add [ring.fe.bolts] or [[ring.fe.splines]]")


@dataclass(frozen=True)
class RingSupport:
    """Six springs between one node of the ring and the housing.

    node: name of the node; group: surface of the FE mesh to which it is tied, "" for a disc in an
    end face; place: (x, y, z) of the node at the end face or mid-band, m; angle: of the springs'
    axes about z, rad; stiffness: radial, tangential, axial, N/m, and about these axes, N m/rad;
    end, diameter: of a bolt.
    """

    node: NodeName
    group: str
    place: tuple[float, float, float]
    angle: float
    stiffness: tuple[float, float, float, float, float, float]
    end: End | None = None
    diameter: float = 0.0


def ring_supports(ring: Ring, face_width: float) -> list[RingSupport]:
    """Supports of a ring: fits, splines, and the bolts of all circles; face_width in m."""
    supports = [_band(NodeName.of("fit", k), band) for k, band in enumerate(ring.fits, 1)]
    supports += [_band(NodeName.of("spline", k), band) for k, band in enumerate(ring.splines, 1)]
    for b in ring.bolt_circles:
        end, arm = ring.bolted_end(b), 0.5 * b.circle_diameter
        z = math.copysign(0.5 * face_width, 1.0 if end == "+z" else -1.0)
        along = (b.stiffness_radial, b.stiffness_tangential, b.stiffness_axial)
        for k in range(b.number):
            node = NodeName.of("bolt", ring.first_bolt(b) + k, digits=2)
            angle = b.first_angle + 2 * math.pi * k / b.number
            supports.append(
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
    return supports


def _band(node: NodeName, fit: Fit) -> RingSupport:
    along = (fit.stiffness_radial, fit.stiffness_radial, fit.stiffness_axial)
    about = (fit.stiffness_tilt, fit.stiffness_tilt, fit.stiffness_torsion)
    return RingSupport(node, node, (0.0, 0.0, fit.z), 0.0, (*along, *about))
