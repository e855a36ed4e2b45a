"""The tooth of a ring that is to be meshed: what of ``gears.tooth`` cannot be, is refused."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexgear.gears.tooth import ToothGeometry, tooth_geometry
from flexgear.model.errors import InputError
from flexgear.model.section import Refusal

if TYPE_CHECKING:
    from flexgear.structures.fe_mesh.ring import RingMeshParameters


def ring_tooth(p: RingMeshParameters) -> ToothGeometry:
    """The tooth of the ring. InputError, with key and remedy, where its profile cannot be drawn."""
    try:
        tooth = tooth_geometry(p, p, internal=True)
    except Refusal as fault:
        raise InputError(p.where, f"stage.ring.{fault.key}", fault.problem, fault.remedy) from None
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
    if tooth.half_angle(tooth.tip_radius) <= 0.0:
        raise InputError(
            p.where, "stage.ring.addendum", "the tooth is pointed before its tip circle", "lower it"
        )
    return tooth
