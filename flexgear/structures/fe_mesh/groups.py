"""Named groups of a body's FE mesh, and where the case has them: one table for reading a user's
file, for checking its place, and for `flexgear mesh --groups`.

Frame of the case: origin on the axis at mid-face, z the axis (docs/conventions.md). What a group
is, in detail: gears.py and carrier.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil, log10
from typing import Literal

import numpy as np

from flexgear.arrays import Array
from flexgear.model.bodies import RingSupport
from flexgear.structures.fe_mesh.carrier import CarrierMeshParameters
from flexgear.structures.fe_mesh.gears import (
    PlanetMeshParameters,
    RingMeshParameters,
    ToothedMeshParameters,
)

_ANYWHERE = float("nan")


@dataclass(frozen=True, eq=False)
class Family:
    """Groups of one kind.

    names: of all that the case has; stem: what they are called without a number; places: (n, 3) m,
    the centre of each, not a number where the case leaves a coordinate open; radial: how far the
    centre may be off along the radius, m; side: the side of mid-face it is on, 0 for either;
    needed: whether a file must have them; twist: dθ/dz along the group, rad/m, None if any;
    says: the key that says how many there are; meaning: in words.
    """

    stem: str
    meaning: str
    names: tuple[str, ...]
    places: Array = field(repr=False)
    needed: bool
    says: str
    radial: float = float("inf")
    side: Literal[-1, 0, 1] = 0
    twist: float | None = None

    @property
    def numbered(self) -> bool:
        """Whether the names are the stem and a number."""
        return self.names != (self.stem,)


@dataclass(frozen=True, eq=False)
class Groups:
    """All named groups of a body and the lengths that tolerances of their place follow from.

    body: "ring", "planet" or "carrier"; radius: where teeth or pins stand, m; pitch: of its teeth,
    of a carrier the ring's, round the reference circle, m; face_width: m.
    """

    body: str
    families: tuple[Family, ...]
    radius: float
    pitch: float
    face_width: float

    @property
    def needed(self) -> list[str]:
        """Names that a file must have."""
        return [name for f in self.families if f.needed for name in f.names]

    def point(self, place: Array) -> str:
        """Coordinates that are stated, in mm, to about a thousandth of a pitch."""
        decimals = max(0, ceil(-log10(1e3 * 1e-3 * min(self.pitch, self.face_width))))
        shown = [
            f"{axis} {round(1e3 * float(value), decimals) + 0.0:.12g}"
            for axis, value in zip("xyz", place, strict=True)
            if np.isfinite(value)
        ]
        return f"{', '.join(shown)} mm" if shown else ""

    def content(self) -> object:
        """What of the case the place of a file is judged by: part of the cache's key."""
        families = [
            [f.stem, list(f.names), f.places, f.needed, f.radial, f.side, f.twist]
            for f in self.families
        ]
        return [self.body, families, self.radius, self.pitch, self.face_width]


def ring_groups(p: RingMeshParameters, tie: str, supports: Sequence[RingSupport]) -> Groups:
    """Teeth for either tie, "root" or "flank", fits, and what holds the bolts: walls of holes, or
    the bolted face."""
    holes = [s for s in supports if s.end and s.group]

    def of_bands(kind: str, meaning: str) -> Family:
        of_kind = [s for s in supports if s.group and s.node.kind == kind]
        places = np.array([s.place for s in of_kind]).reshape(-1, 3)
        return Family(
            kind, meaning, tuple(s.group for s in of_kind), places, True, f"stage.ring.fe.{kind}s"
        )

    families = [
        *_teeth(p, tie),
        of_bands("fit", "band of housing fit k, as ring.fe.fits lists them"),
        of_bands("spline", "outer spline or lugs k, as ring.fe.splines lists them"),
        Family(
            *("bolt", "wall of bolt hole k, with ring.fe.bolts.holes = true"),
            tuple(s.group for s in holes),
            np.array([[*s.place[:2], _ANYWHERE] for s in holes]).reshape(-1, 3),
            *(True, "stage.ring.fe.bolts.number" if holes else "stage.ring.fe.bolts.holes"),
            radial=max((s.diameter / 2.0 for s in holes), default=0.0),
        ),
    ]
    bolted = {s.end for s in supports if not s.group}
    for name, end, side in (("end_minus", "-z", -1), ("end_plus", "+z", 1)):
        meaning = f"end face on the {end} side; bolts without holes act there if it is ring.fe.end"
        place = np.full((1, 3), _ANYWHERE)
        families.append(
            Family(name, meaning, (name,), place, end in bolted, "stage.ring.fe.end", side=side)  # type: ignore[arg-type]
        )
    return _toothed(p, families)


def planet_groups(p: PlanetMeshParameters, tie: str) -> Groups:
    """Teeth for either tie, "root" or "flank", and the bore."""
    centre = np.array([[0.0, 0.0, _ANYWHERE]])
    says = "stage.planet.bore_diameter_mm"
    return _toothed(
        p, [*_teeth(p, tie), Family("bore", "wall of the bore", ("bore",), centre, True, says)]
    )


def _toothed(p: ToothedMeshParameters, families: Sequence[Family]) -> Groups:
    radius = p.tooth.reference_radius
    return Groups(p.part, tuple(families), radius, p.tooth.pitch_angle * radius, p.face_width)


def _teeth(p: ToothedMeshParameters, tie: str) -> list[Family]:
    """Base sections and flanks of a gear's teeth."""
    tooth, teeth = p.tooth, p.teeth
    angles = tooth.pitch_angle * np.arange(teeth, dtype=float)
    middle = (tooth.tip_radius + tooth.form_radius) / 2.0
    half = float(tooth.half_angle(middle))

    def of_teeth(part: str, meaning: str, radius: float, offset: float, needed: bool) -> Family:
        stem = f"tooth_{part}"
        return Family(
            *(stem, meaning, _numbered(stem, teeth, 3)),
            *(_polar(radius, angles + offset), needed, f"stage.{p.part}.teeth"),
            radial=abs(tooth.root_radius - tooth.tip_radius),
            twist=p.helix_rate,
        )

    return [
        of_teeth("root", "base section of tooth j", tooth.root_radius, 0.0, tie == "root"),
        of_teeth("flank", "flank of tooth j on its -θ side", middle, -half, tie == "flank"),
        of_teeth("backflank", "flank of tooth j on its +θ side", middle, half, False),
    ]


def carrier_groups(p: CarrierMeshParameters, angles: Array, pitch: float) -> Groups:
    """Drive flange, bearing seats and pins; angles: of the pins (N,), rad; pitch: of the ring's
    teeth, m."""
    drive: Literal[-1, 1] = 1 if p.drive_side == "+z" else -1
    on_axis = np.array([[0.0, 0.0, _ANYWHERE]])

    def at_end(name: str, meaning: str, side: Literal[-1, 1]) -> Family:
        return Family(
            name, meaning, (name,), on_axis, True, "stage.carrier.fe.drive_side", side=side
        )

    far: Literal[-1, 1] = 1 if drive == -1 else -1
    families = (
        at_end("drive", "face that the drive is bolted to", drive),
        at_end("bearing_drive", "bearing seat on the drive's side", drive),
        at_end("bearing_far", "bearing seat on the other side", far),
        Family(
            *("pin", "seat of planet i on its pin"),
            _numbered("pin", p.planets, 1),
            _polar(p.center_distance, angles),
            *(True, "stage.planets"),
            radial=0.2 * pitch,
        ),
    )
    return Groups("carrier", families, p.center_distance, pitch, p.gear_face_width)


def _numbered(stem: str, count: int, digits: int) -> tuple[str, ...]:
    return tuple(f"{stem}_{k:0{digits}d}" for k in range(1, count + 1))


def _polar(radius: float, angles: Array) -> Array:
    """Points (n, 3) at one radius, at mid-face."""
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), 0.0 * angles])
