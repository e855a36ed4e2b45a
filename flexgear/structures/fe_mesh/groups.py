"""Named groups of a body's FE mesh and their positions in the case: for reading a user's file, for
checking its placement, and for `flexgear mesh --groups`.

Frame of the case: origin on the axis at mid-face, z the axis (docs/conventions.md). Definitions of
the groups: gears.py and carrier.py.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil, log10
from typing import Any, Literal

import numpy as np

from flexgear.arrays import Array
from flexgear.model.ring import End, RingSupport
from flexgear.structures.fe_mesh.carrier import CarrierFeMeshParameters
from flexgear.structures.fe_mesh.gears import (
    PlanetFeMeshParameters,
    RingFeMeshParameters,
    ToothedFeMeshParameters,
)

_ANYWHERE = float("nan")
_ON_AXIS = (0.0, 0.0, _ANYWHERE)
Side = Literal[-1, 0, 1]
_END = "end face on the {}z side; bolts without holes act there if it is ring.fe.end"
_MEANINGS = {
    "tooth_root": "base section of tooth j",
    "tooth_flank": "flank of tooth j on its -θ side",
    "tooth_backflank": "flank of tooth j on its +θ side",
    "fit": "band of housing fit k, as ring.fe.fits lists them",
    "spline": "outer spline or lugs k, as ring.fe.splines lists them",
    "bolt": "wall of bolt hole k, with ring.fe.bolts.holes = true",
    "end_minus": _END.format("-"),
    "end_plus": _END.format("+"),
    "bore": "wall of the bore",
    "drive": "face that the drive is bolted to",
    "bearing_drive": "bearing seat on the drive's side",
    "bearing_far": "the other bearing seat, on either side",
    "pin": "seat of planet i on its pin",
}


@dataclass(frozen=True, eq=False)
class Family:
    """Groups of one kind.

    stem: name without a number; names: of all groups in the case; places: centres (n, 3) m, NaN for
    coordinates that the case does not state; says: key of the case that determines their number;
    needed: whether a file must have them; radial: tolerance of the centre along the radius, m;
    side: sign of z, 0 for either; twist: dθ/dz along the group, rad/m, None if not checked.
    """

    stem: str
    names: tuple[str, ...]
    places: Array = field(repr=False)
    says: str
    needed: bool = True
    radial: float = float("inf")
    side: Side = 0
    twist: float | None = None

    @property
    def meaning(self) -> str:
        """Description for `flexgear mesh --groups`."""
        return _MEANINGS[self.stem]

    @property
    def numbered(self) -> bool:
        """Whether the names have numbers."""
        return self.names != (self.stem,)


@dataclass(frozen=True, eq=False)
class Groups:
    """All named groups of a body and the lengths that determine tolerances of their positions.

    body: "ring", "planet" or "carrier"; radius: of the circle of teeth or pins, m; pitch: of the
    teeth, for a carrier those of the ring, round the reference circle, m; face_width: m.
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
        """Coordinates of a position that are not NaN as text, in mm to about a thousandth of a
        pitch."""
        decimals = max(0, ceil(-log10(1e3 * 1e-3 * min(self.pitch, self.face_width))))
        stated = [
            f"{axis} {round(1e3 * float(value), decimals) + 0.0:.12g}"
            for axis, value in zip("xyz", place, strict=True)
            if np.isfinite(value)
        ]
        return f"{', '.join(stated)} mm" if stated else ""

    def content(self) -> object:
        """Data of the case with which a file's groups are compared: part of the cache's key."""
        families = [
            [f.stem, list(f.names), f.places, f.needed, f.radial, f.side, f.twist]
            for f in self.families
        ]
        return [self.body, families, self.radius, self.pitch, self.face_width]


def _at(stem: str, place: tuple[float, ...], says: str, **limits: Any) -> Family:
    """Family of one group without a number."""
    return Family(stem, (stem,), np.array([place]), says, **limits)


def ring_groups(p: RingFeMeshParameters, tie: str, supports: Sequence[RingSupport]) -> Groups:
    """Groups of a ring: teeth for either tie, "root" or "flank", fits, splines, walls of bolt holes
    and end faces."""
    walls, bolted = [s for s in supports if s.group], {s.end for s in supports if not s.group}

    def of_kind(stem: str, key: str, **limits: Any) -> Family:
        alike = [s for s in walls if s.node.kind == stem]
        places = np.array([s.place for s in alike]).reshape(-1, 3)
        names = tuple(s.group for s in alike)
        return Family(stem, names, places, f"stage.ring.fe.{key}", **limits)

    def end(stem: str, name: End, side: Side) -> Family:
        place = (_ANYWHERE,) * 3
        return _at(stem, place, "stage.ring.fe.end", needed=name in bolted, side=side)

    radii = [s.diameter / 2.0 for s in walls if s.end]
    key = f"bolts.{'number' if radii else 'holes'}"
    bolts = of_kind("bolt", key, radial=max(radii, default=0.0))
    bolts.places[:, 2] = _ANYWHERE
    families = [of_kind("fit", "fits"), of_kind("spline", "splines"), bolts]
    families += [end("end_minus", "-z", -1), end("end_plus", "+z", 1)]
    return _toothed(p, tie, families)


def planet_groups(p: PlanetFeMeshParameters, tie: str) -> Groups:
    """Groups of a planet: teeth for either tie, "root" or "flank", and the bore."""
    return _toothed(p, tie, [_at("bore", _ON_AXIS, "stage.planet.bore_diameter_mm")])


def _toothed(p: ToothedFeMeshParameters, tie: str, more: Sequence[Family]) -> Groups:
    """Groups of a gear: base sections and flanks of its teeth, and ``more``."""
    tooth, middle = p.tooth, (p.tooth.tip_radius + p.tooth.form_radius) / 2.0
    angles = tooth.pitch_angle * np.arange(p.teeth, dtype=float)
    half = float(tooth.half_angle(middle))
    parts = {"flank": (middle, -half), "backflank": (middle, half)}
    teeth = [
        Family(
            *(f"tooth_{part}", _numbered(f"tooth_{part}", p.teeth, 3)),
            *(_polar(radius, angles + offset), f"stage.{p.part}.teeth"),
            needed=part == tie,
            radial=abs(tooth.root_radius - tooth.tip_radius),
            twist=p.helix_rate,
        )
        for part, (radius, offset) in {"root": (tooth.root_radius, 0.0), **parts}.items()
    ]
    radius = tooth.reference_radius
    return Groups(p.part, (*teeth, *more), radius, tooth.pitch_angle * radius, p.face_width)


def carrier_groups(p: CarrierFeMeshParameters, angles: Array, pitch: float) -> Groups:
    """Groups of a carrier: drive flange, bearing seats and pins at angles (N,), rad; pitch: of the
    ring's teeth, m."""
    drive: Side = 1 if p.drive_side == "+z" else -1
    ends: tuple[tuple[str, Side], ...] = (
        ("drive", drive), ("bearing_drive", drive), ("bearing_far", 0),  # both of an overhung one
    )  # fmt: skip
    key = "stage.carrier.fe.drive_side"
    pins = _numbered("pin", p.planets, 1), _polar(p.center_distance, angles)
    families = [_at(stem, _ON_AXIS, key, side=side) for stem, side in ends]
    families.append(Family("pin", *pins, "stage.planets", radial=0.2 * pitch))
    return Groups("carrier", tuple(families), p.center_distance, pitch, p.gear_face_width)


def _numbered(stem: str, count: int, digits: int) -> tuple[str, ...]:
    return tuple(f"{stem}_{k:0{digits}d}" for k in range(1, count + 1))


def _polar(radius: float, angles: Array) -> Array:
    """Points (n, 3) at one radius, at mid-face."""
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), 0.0 * angles])
