"""FE meshes of ring and planet with their teeth and rims.

Frame: origin at the gear's centre and mid-face, z the axis of rotation; the middle of tooth j
(0-based) is at the angle 2πj/z at z = 0; patches are numbered from 1 (tooth_root_001 is j = 0).

Helix: a point (r, θ, z) of the section moves to θ + κ z f(r), κ = h tan β/r_ref, h = +1 for a
right-hand gear, f = 1 where the rim is a body of revolution.

Patches
  tooth_flank_NNN      involute flank on the -θ side
  tooth_backflank_NNN  involute flank on the +θ side
  tooth_root_NNN       the tooth's base section: the *interior* facets between the ends of its two
                       roots on the root circle, bowed a tip radius of the tool into the rim,
                       symmetric about the tooth's middle
  end_minus, end_plus  plane faces at -b/2 and +b/2

A planet has f = 1, and ``bore``, the wall of the bore. Of a ring the flank on the -θ side is the
one that planets press when the carrier turns by +z and drives. f = 1, for the rim is a body of
revolution; with bolt holes only from the tooth's tip to the root circle, falling as 1 - 3t² + 2t³
to 0 at the inside of the straight holes.

More patches of a ring
  fit_1, spline_1 ..   bands of the outer cylinder, in the order given
  bolt_NN              walls of the bolt holes, when there are holes
  outer                outer cylinder
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, pi, tan
from typing import ClassVar, Literal, NoReturn

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.tool import PLAIN_TOOL, PlainTool
from flexgear.gears.tooth import ToothGeometry, tooth_geometry
from flexgear.model.bodies import Fidelity
from flexgear.model.errors import InputError
from flexgear.model.names import NodeName
from flexgear.model.section import Refusal
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.section import (
    SectionDivisions,
    ToothedSection,
    Wall,
    extruded,
    toothed_section,
    with_bolt_holes,
)

Band = tuple[float, float]

DIVISIONS: dict[str, tuple[SectionDivisions, int]] = {  # section, least number of layers
    "quick": (SectionDivisions(tooth=1, flank=1, fillet=1, rim=2), 3),
    "standard": (SectionDivisions(tooth=2, flank=2, fillet=2, rim=4), 4),
    "fine": (SectionDivisions(tooth=3, flank=3, fillet=2, rim=5), 6),
}
THIN_RIM = 3.0  # modules; thinner rims of rings bend between the teeth: two columns across a tooth
_PITCH_LAYERS = {"quick": 3, "standard": 4, "fine": 4}  # n in which the helix turns by a pitch:
# fewer make coarse rims within a tooth too soft (their chords leave it by r (2π/z)²/(8 n²))
GROWTH = {"quick": 1.4, "standard": 1.3, "fine": 1.15}


@dataclass(frozen=True, kw_only=True)
class ToothedFeMeshParameters:
    """Parameters of the FE mesh of a gear; m and rad. Defaults are a spur gear of ISO 53's rack.

    addendum, dedendum, root_fillet and profile_shift are multiples of the normal module; the sign
    of profile_shift is stated in gears/tooth.py. tool: of the teeth; where: source of the case;
    part: member of the stage in keys of messages, "ring" or "planet".
    """

    part: ClassVar[str]

    teeth: int
    normal_module: float
    pressure_angle: float = 20.0 * pi / 180.0
    helix_angle: float = 0.0
    hand: Literal["right", "left"] = "right"
    profile_shift: float = 0.0
    addendum: float = 1.0
    dedendum: float = 1.25
    root_fillet: float = 0.38
    tool: PlainTool = PLAIN_TOOL
    face_width: float
    fidelity: Fidelity = "standard"
    where: str = "case"

    @cached_property
    def tooth(self) -> ToothGeometry:
        """Tooth of the gear. InputError with key and remedy if it has no profile."""
        try:
            tooth = tooth_geometry(self, self, internal=self.part == "ring")
        except Refusal as fault:
            self.reject(fault.key, fault.problem, fault.remedy)
        if tooth.tip_radius <= tooth.base_radius:
            tip, base = (f"{r * 1e3:.1f} mm" for r in (tooth.tip_radius, tooth.base_radius))
            problem = f"the tip circle ({tip}) lies inside the base circle ({base}), where no "
            remedy = "lower the addendum or the profile shift, or use more teeth"
            self.reject("addendum", f"{problem}involute exists", remedy)
        if tooth.outward * (tooth.tip_radius - tooth.root_radius) <= 0.0:
            self.reject("dedendum", "leaves no tooth between root and tip circle", "raise it")
        if tooth.half_angle(tooth.tip_radius) <= 0.0:
            self.reject("addendum", "the tooth is pointed before its tip circle", "lower it")
        return tooth

    @property
    def helix_rate(self) -> float:
        """Helix rate κ = h tan β/r_ref, rad/m."""
        sign = 1.0 if self.hand == "right" else -1.0
        return sign * tan(self.helix_angle) / self.tooth.reference_radius

    @property
    def least_layers(self) -> int:
        """Least number of layers along the face for teeth and helix."""
        pitches = abs(self.helix_rate) * self.face_width / self.tooth.pitch_angle
        least = DIVISIONS[self.fidelity][1]
        return max(least, ceil(_PITCH_LAYERS[self.fidelity] * pitches))

    def reject(self, key: str, problem: str, remedy: str) -> NoReturn:
        """Raise InputError for a key of this gear's section, as "stage.ring.fe.rim_thickness"."""
        raise InputError(self.where, f"stage.{self.part}.{key}", problem, remedy)

    def check(self) -> None:
        """InputError with key and remedy where no gear can be made."""
        _ = self.tooth


def layer_positions(face_width: float, bands: tuple[Band, ...], least: int) -> Array:
    """Layer borders from -b/2 to b/2, m, with one at every edge of a band: ``least`` layers or
    more, thin where the bands leave long spans, and none thicker than 2.5 b/least."""
    half = face_width / 2.0
    marks = [-half, half]
    for edge in sorted({e for band in bands for e in band}):
        if min(abs(edge - m) for m in marks) > 0.01 * face_width:
            marks.append(edge)
    marks.sort()
    spans = np.diff(marks)
    counts = np.ones(len(spans), dtype=int)
    while counts.sum() < least:
        counts[int(np.argmax(spans / counts))] += 1
    thickest = 2.5 * face_width / least
    counts = np.maximum(counts, [ceil(s / thickest - 1e-9) for s in spans])
    parts = [
        np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(marks[:-1], marks[1:], counts, strict=True)
    ]
    return np.concatenate([*parts, [half]])


def _toothed(
    section: ToothedSection, twist: Array | float, z: Array, walls: Mapping[str, Wall]
) -> FeMesh:
    """FE mesh of a section extruded over layers z, with patches of teeth, other walls and ends."""
    teeth: dict[str, Wall] = {
        f"tooth_{name}_{j:03d}": (edges, None)
        for name in ("flank", "backflank", "root")
        for j, edges in enumerate(section.tooth_lines[name], 1)
    }
    return extruded(section.radius, section.angle, section.quads, twist, z, {**teeth, **walls})


@dataclass(frozen=True, kw_only=True)
class PlanetFeMeshParameters(ToothedFeMeshParameters):
    """All parameters of the planet's FE mesh; m and rad."""

    part = "planet"

    bore_diameter: float

    @property
    def size(self) -> float:
        """Largest dimension, m."""
        return 2.0 * self.tooth.tip_radius

    @property
    def bore_radius(self) -> float:
        """Radius of the bore, m."""
        return self.bore_diameter / 2.0

    def check(self) -> None:
        """InputError with key and remedy where no planet can be made."""
        super().check()
        rim = self.tooth.root_radius - self.bore_radius
        if self.bore_diameter <= 0.0:
            problem = "is missing: an FE planet is carried at its bore"
            self.reject("bore_diameter_mm", problem, "give the diameter of the bearing's seat")
        if rim < self.normal_module:
            problem = f"leaves a rim of {rim * 1e3:.2f} mm below the teeth, less than one module"
            self.reject("bore_diameter_mm", problem, "lower it")


def planet_fe_mesh(p: PlanetFeMeshParameters) -> FeMesh:
    """FE mesh of the planet with the patches of the module's docstring."""
    p.check()
    section = toothed_section(p.tooth, p.bore_radius, DIVISIONS[p.fidelity][0], GROWTH[p.fidelity])
    z = layer_positions(p.face_width, (), p.least_layers)
    return _toothed(section, p.helix_rate, z, {"bore": (section.rim, None)})


_HOLE_ROWS = {"quick": (2, 1, 1), "standard": (3, 1, 1), "fine": (4, 1, 2)}  # as in section.py
BLOCK = 1.7  # inner border of a bolt's block, in bolt radii from the bolt's axis


@dataclass(frozen=True, kw_only=True)
class RingFeMeshParameters(ToothedFeMeshParameters):
    """All parameters of the ring's FE mesh; m and rad.

    fits: (z_low, z_high) of each housing fit's band, splines likewise. Bolt k is at
    first_bolt_angle + 2πk/bolts on the bolt circle; its number is first_bolt + k. other_bolts:
    (number, circle diameter, diameter) of more circles, without holes.
    """

    part = "ring"

    rim_thickness: float
    bolts: int = 0
    bolt_circle_diameter: float = 0.0
    bolt_diameter: float = 0.0
    bolt_holes: bool = False
    first_bolt_angle: float = 0.0
    first_bolt: int = 1
    fits: tuple[Band, ...] = ()
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
        """Names and bands of the groups on the outer cylinder."""
        fits = [(NodeName.of("fit", k), band) for k, band in enumerate(self.fits, 1)]
        return fits + [(NodeName.of("spline", k), band) for k, band in enumerate(self.splines, 1)]

    @property
    def straight_radius(self) -> float:
        """Radius beyond which the section is not twisted, m: inside the bolt holes, whose axes are
        straight; infinite without holes, as the rim is then a body of revolution."""
        if not self.has_holes:
            return np.inf
        return self.bolt_circle_diameter / 2.0 - BLOCK * self.bolt_diameter / 2.0

    @property
    def divisions(self) -> SectionDivisions:
        """Numbers of elements of the section. With one column across a tooth a rim of one module is
        8 % too high in frequency, of two 4 %; two columns are within 1.5 % of "standard"."""
        usual = DIVISIONS[self.fidelity][0]
        if self.rim_thickness >= THIN_RIM * self.normal_module:
            return usual
        return replace(usual, tooth=max(usual.tooth, 2), fillet=max(usual.fillet, 2))

    @property
    def has_holes(self) -> bool:
        """Whether there are bolts whose holes are meshed."""
        return self.bolt_holes and self.bolts > 0

    def check(self) -> None:
        """InputError with key and remedy where no ring can be made."""
        super().check()
        tooth, width = self.tooth, self.face_width
        if self.rim_thickness < self.normal_module:
            problem = f"{self.rim_thickness * 1e3:.1f} mm is thinner than one module"
            remedy = "the rim is counted outside the root circle; give at least one module"
            self.reject("fe.rim_thickness", problem, remedy)
        if self.bolts:
            radius, hole = self.bolt_circle_diameter / 2.0, self.bolt_diameter / 2.0
            room = self.straight_radius - tooth.root_radius
            circle, key = f"bolts on {radius * 2e3:.0f} mm", "fe.bolts.circle_diameter"
            if room < 0.1 * self.rim_thickness or radius - hole < tooth.root_radius:
                root = f"the teeth's root at {tooth.root_radius * 2e3:.0f} mm"
                remedy = "raise it or lower the bolts' diameter"
                self.reject(key, f"{circle} leave no rim below {root}", remedy)
            if self.has_holes and abs(self.helix_rate) * width / 2.0 * radius > room:
                self.reject(
                    "fe.bolts.holes",
                    f"the helix cannot fade over the {room * 1e3:.0f} mm between the teeth's "
                    "root and the holes, whose axes are straight",
                    "leave the holes out, or raise circle_diameter",
                )
            if not radius + (1.2 if self.bolt_holes else 1.0) * hole < self.outer_radius:
                outer = f"the outer diameter of {self.outer_radius * 2e3:.0f} mm"
                self.reject(
                    key, f"{circle} break through {outer}", "lower it or raise rim_thickness"
                )
            if 2.0 * radius * np.sin(pi / max(self.bolts, 2)) < 1.2 * self.bolt_diameter:
                problem = "neighbouring bolts overlap"
                self.reject("fe.bolts.number", problem, "use fewer or thinner bolts")
        for number, circle_diameter, diameter in self.other_bolts:
            replace(
                self,
                bolts=number,
                bolt_circle_diameter=circle_diameter,
                bolt_diameter=diameter,
                bolt_holes=False,
                other_bolts=(),
            ).check()
        for name, (low, high) in self.bands:
            tolerance = 1e-9 * width
            if not -width / 2 - tolerance <= low < high <= width / 2 + tolerance:
                band = f"a band from {low * 1e3:.1f} to {high * 1e3:.1f} mm"
                problem = f"{band} is not on the face of ±{width * 5e2:.1f} mm"
                self.reject(f"fe.{name.kind}s", problem, "move it or make it narrower")
        if self.has_holes:
            _section(self)  # raises where there is no room for them


def ring_fe_mesh(p: RingFeMeshParameters) -> FeMesh:
    """FE mesh of the ring with the patches of the module's docstring."""
    p.check()
    section = _section(p)
    z = layer_positions(p.face_width, p.fits + p.splines, p.least_layers)
    middle = (z[:-1] + z[1:]) / 2.0
    walls: dict[str, Wall] = {"outer": (section.rim, None)}
    for name, (low, high) in p.bands:
        inside = np.flatnonzero((middle > low) & (middle < high))
        if len(inside) == 0:
            key = f"fe.{name.kind}s.{name.number - 1}"
            p.reject(key, "the band is too narrow", "make it wider")
        walls[name] = section.rim, inside
    walls |= {f"bolt_{k:02d}": (edges, None) for k, edges in enumerate(section.holes, p.first_bolt)}
    return _toothed(section, _twist(p, section.radius), z, walls)


def _section(p: RingFeMeshParameters) -> ToothedSection:
    """Section of the ring, with its bolt holes."""
    divisions, growth = p.divisions, GROWTH[p.fidelity]
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


def _twist(p: RingFeMeshParameters, radius: Array) -> Array:
    """Twist κ f(r), rad/m: f = 1 to the root circle, 0 beyond the straight radius, C¹ between."""
    root = p.tooth.root_radius
    t = np.clip((radius - root) / (p.straight_radius - root), 0.0, 1.0)
    return p.helix_rate * (1.0 - 3.0 * t**2 + 2.0 * t**3)
