"""What FE meshes of gears with their teeth and rims have in common: parameters, layers, extrusion.

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
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, pi, tan
from typing import ClassVar, Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.tool import PLAIN_TOOL, PlainTool
from flexgear.gears.tooth import ToothGeometry, tooth_geometry
from flexgear.model.errors import InputError
from flexgear.model.section import Refusal
from flexgear.structures.fe_mesh.fe_mesh import HEX_FROM_VTK, FeMesh
from flexgear.structures.fe_mesh.toothed_section import SectionDivisions, ToothedSection

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Fidelity = Literal["quick", "standard", "fine"]
Band = tuple[float, float]

DIVISIONS: dict[str, tuple[SectionDivisions, int]] = {  # section, least number of layers
    "quick": (SectionDivisions(tooth=1, flank=1, fillet=1, rim=2), 3),
    "standard": (SectionDivisions(tooth=2, flank=2, fillet=2, rim=4), 4),
    "fine": (SectionDivisions(tooth=3, flank=3, fillet=2, rim=5), 6),
}
_PITCH_LAYERS = {"quick": 3, "standard": 4, "fine": 4}  # n in which the helix turns by a pitch:
# fewer make coarse rims within a tooth too soft (their chords leave it by r (2π/z)²/(8 n²))
GROWTH = {"quick": 1.4, "standard": 1.3, "fine": 1.15}


@dataclass(frozen=True)
class ToothedMeshParameters:
    """What the FE mesh of every gear depends on; m and rad. Defaults are those of a ring.

    Coefficients addendum, dedendum, root_fillet and profile_shift are multiples of the normal
    module; the sign of profile_shift is stated in gears/tooth.py. tool: what cuts it. where: what
    the values are from. part: of the stage, "ring" or "planet", as keys in messages name it.
    """

    part: ClassVar[str]

    teeth: int = 93
    normal_module: float = 18e-3
    pressure_angle: float = 20.0 * pi / 180.0
    helix_angle: float = 7.5 * pi / 180.0
    hand: Literal["right", "left"] = "right"
    profile_shift: float = 0.0
    addendum: float = 1.0
    dedendum: float = 1.25
    root_fillet: float = 0.38
    tool: PlainTool = PLAIN_TOOL
    face_width: float = 0.43
    fidelity: Fidelity = "standard"
    where: str = "case"

    @cached_property
    def tooth(self) -> ToothGeometry:
        """The tooth; InputError, with key and remedy, where its profile cannot be drawn."""
        try:
            tooth = tooth_geometry(self, self, internal=self.part == "ring")
        except Refusal as fault:
            self.reject(fault.key, fault.problem, fault.remedy)
        if tooth.tip_radius <= tooth.base_radius:
            self.reject(
                "addendum",
                f"the tip circle ({tooth.tip_radius * 1e3:.1f} mm) lies inside the base circle "
                f"({tooth.base_radius * 1e3:.1f} mm), where no involute exists",
                "lower the addendum or the profile shift, or use more teeth",
            )
        if tooth.outward * (tooth.tip_radius - tooth.root_radius) <= 0.0:
            self.reject("dedendum", "leaves no tooth between root and tip circle", "raise it")
        if tooth.half_angle(tooth.tip_radius) <= 0.0:
            self.reject("addendum", "the tooth is pointed before its tip circle", "lower it")
        return tooth

    @property
    def helix_rate(self) -> float:
        """κ = h tan β/r_ref, rad/m."""
        sign = 1.0 if self.hand == "right" else -1.0
        return sign * tan(self.helix_angle) / self.tooth.reference_radius

    @property
    def least_layers(self) -> int:
        """Layers along the face that teeth and helix need at least."""
        pitches = abs(self.helix_rate) * self.face_width / self.tooth.pitch_angle
        least = DIVISIONS[self.fidelity][1]
        return max(least, ceil(_PITCH_LAYERS[self.fidelity] * pitches))

    def reject(self, key: str, problem: str, remedy: str) -> NoReturn:
        """Raise InputError for a key of this gear's section, as "stage.ring.fe.rim_thickness"."""
        raise InputError(self.where, f"stage.{self.part}.{key}", problem, remedy)

    def check(self) -> None:
        """Raise InputError, naming the key and the remedy, if no gear can be made."""
        if self.fidelity not in DIVISIONS:
            problem = f"{self.fidelity!r} is unknown"
            raise InputError(self.where, "solver.fidelity", problem, "quick, standard or fine")
        if self.face_width <= 0.0:
            remedy = "give the gear's face width"
            raise InputError(self.where, "stage.face_width", "must be above 0", remedy)
        _ = self.tooth


def layer_positions(face_width: float, bands: tuple[Band, ...], least: int) -> Array:
    """Layer borders from -b/2 to b/2: at every band's edge, and no layer thicker than b/least
    where at least one more fits; bands at the ends count as layers, the middle shares the rest."""
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


def extruded(
    section: ToothedSection,
    twist: Array | float,
    z: Array,
    walls: Iterable[tuple[str, Ints, Ints | None]],
) -> FeMesh:
    """Hexahedra over a section with the patches of its teeth, walls and ends.

    twist: κ f(r) of the section's points (n,) or of all, rad/m; z: layer borders, m; walls: more
    patches, each by name, edges of the section (k, 2) and layers, None for all.
    """
    n, layers = len(section.radius), len(z) - 1
    angle = section.angle[None, :] + np.broadcast_to(twist, n)[None, :] * z[:, None]
    points = np.stack(
        [
            section.radius * np.cos(angle),
            section.radius * np.sin(angle),
            np.broadcast_to(z[:, None], angle.shape),
        ],
        axis=2,
    ).reshape(-1, 3)
    level = n * np.arange(layers)[:, None, None]
    vtk = np.concatenate([section.quads + level, section.quads + level + n], axis=2).reshape(-1, 8)

    def wall(lines: Ints, chosen: Ints | None) -> Ints:
        """(k, 2) section edges -> (k layers, 4) facets."""
        step = level if chosen is None else level[chosen]
        a, b = lines[None, :, 0] + step[:, :, 0], lines[None, :, 1] + step[:, :, 0]
        return np.stack([a, b, b + n, a + n], axis=2).reshape(-1, 4)

    facets: dict[str, Ints] = {}
    for name in ("flank", "backflank", "root"):
        for j, lines in enumerate(section.tooth_lines[name], 1):
            facets[f"tooth_{name}_{j:03d}"] = wall(lines, None)
    facets |= {name: wall(lines, chosen) for name, lines, chosen in walls}
    facets["end_minus"] = section.quads[:, ::-1]
    facets["end_plus"] = section.quads + n * layers
    return FeMesh(points, vtk[:, HEX_FROM_VTK], "hex", facets)
