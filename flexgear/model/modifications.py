"""Flank modifications: micro-geometry of gears by keys or as a table over profile and face."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from flexgear.model.errors import InputError
from flexgear.model.input_file import read_table
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Angle, Length

LARGEST = 2e-3  # m, limit of amounts
FLANKS = ("drive", "coast", "sun", "ring")


class FlankTable(Section):
    """Material missing at points of a grid over profile and face, as from a gear measuring machine;
    bilinear between the points, beyond them as at the nearest point.

    file: CSV with the columns roll_angle_deg or diameter_mm, z_mm and gap_um, one row for each
    point, in any order; it replaces the other keys. roll_angles: positions on the profile,
    increasing from the base circle (tan of the profile angle); diameters: circles of the points, in
    place of roll_angles, increasing. z: positions along the face, increasing, 0 at its middle.
    gaps: a list over z for each position on the profile, positive if material is missing (measured
    deviations, of which excess is positive, have the opposite sign).
    """

    file: str | None = None
    roll_angles: tuple[Angle, ...] = ()
    diameters: tuple[Length, ...] = ()
    z: tuple[Length, ...] = ()
    gaps: tuple[tuple[Length, ...], ...] = Field(default=())

    @property
    def profile(self) -> tuple[str, tuple[float, ...]]:
        """Key and values of the positions on the profile: roll angles (rad) or diameters (m)."""
        if self.roll_angles:
            return "roll_angles", self.roll_angles
        return "diameters", self.diameters

    def _check(self) -> None:
        name, places = self.profile
        if not places:
            raise Missing("file", "is missing", "name a CSV file, or give roll_angles, z and gaps")
        if self.roll_angles and self.diameters:
            raise Refusal("diameters", "are given beside roll angles", "keep one of them")
        for key, values in ((name, places), ("z", self.z)):
            if not values or np.any(np.diff(values) <= 0):
                problem = "do not increase" if values else "are missing"
                raise Refusal(key, problem, "put them in order, each once")
        if len(self.gaps) != len(places) or any(len(row) != len(self.z) for row in self.gaps):
            remedy = f"give a list over z for each of the {name.replace('_', ' ')}"
            raise Refusal("gaps", f"are not {len(places)} lists of {len(self.z)} values", remedy)
        largest = np.abs(self.gaps).max()
        if largest > LARGEST:
            raise Refusal("gaps", f"reach {1e3 * largest:g} mm, beyond 2 mm", "check the unit")


def read_flank_table(path: Path) -> dict[str, Any]:
    """Fields of a ``FlankTable`` from a CSV file, in SI; InputError for an incomplete grid."""
    where, what = str(path), "flank table"
    profile = {"roll_angle": "angle", "diameter": "length"}
    titles, rows = read_table(path, what, [profile, {"z": "length"}, {"gap": "length"}])
    name = next(title for title in profile if title in titles)
    gap_at: dict[tuple[float, float], float] = {}
    for number, values in rows:
        point = values[name], values["z"]
        if point in gap_at:
            raise InputError(where, f"line {number}", "repeats a point", "keep one of them")
        gap_at[point] = values["gap"]
    if not gap_at:
        raise InputError(where, what, "has no rows", "give one row a point")
    places, z = (tuple(sorted({point[k] for point in gap_at})) for k in (0, 1))
    if len(gap_at) != len(places) * len(z):
        raise InputError(
            where, what,
            f"has {len(gap_at)} points, but {len(places)} different {titles[name]} and {len(z)} "
            f"different {titles['z']}",
            "give a value for each position on the profile at each position along the face",
        )  # fmt: skip
    gaps = tuple(tuple(gap_at[p, at] for at in z) for p in places)
    return {f"{name}s": places, "z": z, "gaps": gaps}


Form = Literal["linear", "parabolic"]


class Relief(Section):
    """Material taken off towards the tip, or towards the root.

    amount: at the end of the active profile (C_αa, C_αf); length: of the relief on the path of
    contact, from that end (L_Cαa, L_Cαf); start_diameter: circle at which the relief begins, in
    place of length (d_Ca, d_Cf); form: how the amount increases from there.
    """

    amount: Length = Field(ge=0.0, le=LARGEST)
    length: Length | None = Field(default=None, gt=0.0, le=1.0)
    start_diameter: Length | None = Field(default=None, gt=0.0, le=20.0)
    form: Form = "linear"

    def _check(self) -> None:
        if self.length is None and self.start_diameter is None:
            raise Missing("length", "is missing", "add length_mm, or start_diameter_mm")
        self._keep_one("start_diameter", "length")


class EndRelief(Section):
    """Material taken off towards the ends of the face.

    amount: at the end (C_βI, C_βII); length: along the face, from the end (L_CI, L_CII); form: how
    the amount increases; end: "+z", "-z", or "both".
    """

    amount: Length = Field(ge=0.0, le=LARGEST)
    length: Length = Field(gt=0.0, le=2.0)
    form: Form = "linear"
    end: Literal["both", "+z", "-z"] = "both"


class FlankModifications(Section):
    """Material missing on one flank, or on both. Negative amounts are excess material. An amount of
    zero is a value, which replaces that of both flanks.

    profile_crowning: amount at both ends of the active profile, parabolic from its middle (C_α).
    profile_slope: amount at the tip less that at the root end of the active profile, linear (C_Hα);
    positive if the pressure angle is too large. lead_crowning: amount at both ends of the face,
    parabolic from its middle (C_β). helix_slope: amount at the +z end of the face less that at its
    -z end, linear (C_Hβ), for any hand and flank. twist: profile_slope at the +z end less that at
    the -z end (S_α). tip_relief: towards the tip. root_relief: towards the root. end_relief:
    towards the ends of the face. table: gaps over profile and face, measured or computed.
    """

    profile_crowning: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    profile_slope: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    lead_crowning: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    helix_slope: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    twist: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    tip_relief: Relief | None = None
    root_relief: Relief | None = None
    end_relief: EndRelief | None = None
    table: FlankTable | None = None

    def of(self, flank: str) -> FlankModifications:
        """Modifications of one flank: its own keys, and keys for both flanks that it lacks."""
        of_both = self._stated(FlankModifications.model_fields)
        of_one = getattr(self, flank) or FlankModifications()
        return FlankModifications(**{**of_both, **of_one._stated()})

    def key(self, flank: str, name: str) -> str:
        """Path of the key ``name`` of a flank: in the flank's section, or that for both flanks."""
        modifications, field = getattr(self, flank), name.partition(".")[0]
        of_flank = modifications and getattr(modifications, field) is not None
        return f"{flank}.{name}" if of_flank else name


class GearModifications(FlankModifications):
    """Modified flanks of a gear with one gear mesh (sun, ring, pinion, gear). Keys of this section
    hold for both flanks unless ``drive`` or ``coast`` has the same key.

    drive: the flank that transmits the rated torque. coast: the opposite flank.
    """

    drive: FlankModifications | None = None
    coast: FlankModifications | None = None


class PlanetModifications(FlankModifications):
    """Modified flanks of the planets. Keys of this section hold for both flanks unless ``sun`` or
    ``ring`` has the same key.

    sun: the flank that transmits the rated torque at the sun, and a reversed torque at the ring.
    ring: the flank that transmits the rated torque at the ring, and a reversed torque at the sun.
    """

    sun: FlankModifications | None = None
    ring: FlankModifications | None = None
