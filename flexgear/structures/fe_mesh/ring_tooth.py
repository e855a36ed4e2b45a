"""The tooth of a ring that is to be meshed: what of ``gears.tooth`` cannot be, is refused."""

from __future__ import annotations

from math import floor, pi
from typing import TYPE_CHECKING

from flexgear.gears.tooth import ToothGeometry, tooth_geometry
from flexgear.model.errors import InputError

if TYPE_CHECKING:
    from flexgear.structures.fe_mesh.ring import RingMeshParameters

_SMALLEST_FILLET = 0.01  # modules; where not even this fits, the fillet is not to blame


def ring_tooth(p: RingMeshParameters) -> ToothGeometry:
    """The tooth of the ring. InputError, with key and remedy, where its profile cannot be drawn."""
    tooth = tooth_geometry(p, p, internal=True)
    if tooth.tip_radius <= tooth.base_radius:
        raise InputError(
            p.where,
            "stage.ring.addendum",
            f"the tip circle ({tooth.tip_radius * 1e3:.1f} mm) lies inside the base circle "
            f"({tooth.base_radius * 1e3:.1f} mm), where no involute exists",
            "lower the addendum or the profile shift, or use more teeth",
        )
    if tooth.root_radius <= tooth.tip_radius:
        raise InputError(
            p.where, "stage.ring.dedendum", "the root circle is inside the tip circle", "raise it"
        )
    if p.root_fillet <= 0.0:
        raise InputError(p.where, "stage.ring.root_fillet", "must be above 0", "0.38 is usual")
    if tooth.half_angle(tooth.tip_radius) <= 0.0:
        raise InputError(
            p.where, "stage.ring.addendum", "the tooth is pointed before its tip circle", "lower it"
        )
    if not _fits(tooth, tooth.fillet_radius):
        low, high = 0.0, p.root_fillet
        for _ in range(30):
            half = (low + high) / 2.0
            low, high = (half, high) if _fits(tooth, half * p.normal_module) else (low, half)
        raise InputError(
            p.where,
            "stage.ring.root_fillet",
            f"a fillet of {tooth.fillet_radius * 1e3:.2f} mm does not fit into the root of the "
            "tooth space",
            f"at most {floor(low * 1000) / 1000:g}"
            if low > _SMALLEST_FILLET
            else "lower the dedendum: the tooth space ends before the root circle",
        )
    return tooth


def _fits(tooth: ToothGeometry, fillet_radius: float) -> bool:
    """Whether the fillet leaves a land of the root circle between neighbouring teeth, or none."""
    fillet = tooth.fillet_of(fillet_radius)
    return fillet is not None and fillet.end <= pi / tooth.teeth
