"""Modified flanks: micro-geometry of gears, in keys or as a table over profile and face."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from flexgear.model.errors import InputError
from flexgear.model.input_file import read_table
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Angle, Length

LARGEST = 2e-3  # m
FLANKS = ("drive", "coast", "sun", "ring")


class FlankTable(Section):
    """Material missing at points of a grid over profile and face, as from a gear measuring machine;
    bilinear between them, beyond them as at the nearest one.

    file: CSV with the columns roll_angle_deg or diameter_mm, z_mm and gap_um, one row for each
    point, in any order; it replaces the other keys. roll_angles: of the points on the profile,
    rising from the base circle (tan of the profile angle there); diameters: in their place, circles
    of the points, rising. z: of the points along the face, rising, 0 at its middle. gaps: a list
    over z for each place on the profile, positive where material is missing (measured deviations,
    where excess is positive, have the other sign).
    """

    file: str | None = None
    roll_angles: tuple[Angle, ...] = ()
    diameters: tuple[Length, ...] = ()
    z: tuple[Length, ...] = ()
    gaps: tuple[tuple[Length, ...], ...] = Field(default=())

    @property
    def profile(self) -> tuple[str, tuple[float, ...]]:
        """Key and values of the places on the profile: roll angles (rad) or diameters (m)."""
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
                problem = "do not rise" if values else "are missing"
                raise Refusal(key, problem, "put them in order, each once")
        if len(self.gaps) != len(places) or any(len(row) != len(self.z) for row in self.gaps):
            raise Refusal(
                "gaps",
                f"are not {len(places)} lists of {len(self.z)} values",
                f"give a list over z for each of the {name.replace('_', ' ')}",
            )
        largest = np.abs(self.gaps).max()
        if largest > LARGEST:
            raise Refusal("gaps", f"reach {1e3 * largest:g} mm, beyond 2 mm", "check the unit")


def read_flank_table(path: Path) -> dict[str, Any]:
    """Fields of a ``FlankTable`` from a CSV file, in SI. InputError for what is no whole grid."""
    where, what = str(path), "flank table"
    profile = {"roll_angle": "angle", "diameter": "length"}
    titles, rows = read_table(path, what, [profile, {"z": "length"}, {"gap": "length"}])
    name = next(title for title in profile if title in titles)
    gap_at: dict[tuple[float, float], float] = {}
    for number, values in rows:
        point = values[name], values["z"]
        if point in gap_at:
            raise InputError(
                where, f"line {number}", "gives a point for the second time", "keep one of them"
            )
        gap_at[point] = values["gap"]
    if not gap_at:
        raise InputError(where, what, "has no rows", "give one row a point")
    places, z = (tuple(sorted({point[k] for point in gap_at})) for k in (0, 1))
    if len(gap_at) != len(places) * len(z):
        raise InputError(
            where, what,
            f"has {len(gap_at)} points, but {len(places)} different {titles[name]} and {len(z)} "
            f"different {titles['z']}",
            "give every place on the profile at every place along the face",
        )  # fmt: skip
    gaps = tuple(tuple(gap_at[p, at] for at in z) for p in places)
    return {f"{name}s": places, "z": z, "gaps": gaps}


Form = Literal["linear", "parabolic"]


class Relief(Section):
    """Material taken off towards the tip, or towards the root.

    amount: at the end of the active profile (C_αa, C_αf); length: of the part of the path of
    contact that has relief, from that end on (L_Cαa, L_Cαf); start_diameter: the circle where it
    begins, in place of length (d_Ca, d_Cf); form: how the amount rises from there.
    """

    amount: Length = Field(gt=0.0, le=LARGEST)
    length: Length | None = Field(default=None, gt=0.0, le=1.0)
    start_diameter: Length | None = Field(default=None, gt=0.0, le=20.0)
    form: Form = "linear"

    def _check(self) -> None:
        if self.length is None and self.start_diameter is None:
            raise Missing("length", "is missing", "add length_mm, or start_diameter_mm")
        self._keep_one("start_diameter", "length")


class EndRelief(Section):
    """Material taken off towards the ends of the face.

    amount: at the end (C_βI, C_βII); length: along the face, from the end on (L_CI, L_CII); form:
    how the amount rises; end: which of the ends, "+z", "-z", or "both".
    """

    amount: Length = Field(gt=0.0, le=LARGEST)
    length: Length = Field(gt=0.0, le=2.0)
    form: Form = "linear"
    end: Literal["both", "+z", "-z"] = "both"


class FlankModifications(Section):
    """Material missing on one flank, or on both; zero is an amount, too. Negative amounts are
    excess material.

    profile_crowning: at both ends of the active profile, as a parabola from its middle (C_α).
    profile_slope: more at the tip than at the root end of the active profile, in a straight line
    (C_Hα); the tooth's pressure angle is too large where it is positive. lead_crowning: at both
    ends of the face, as a parabola from its middle (C_β). helix_slope: more at the +z end of the
    face than at its -z end, in a straight line (C_Hβ), whatever the hand and the flank. twist:
    profile_slope at the +z end less that at the -z end (S_α). tip_relief: towards the tip.
    root_relief: towards the root. end_relief: towards the ends of the face. table: gaps over
    profile and face, measured or computed.
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
        """Modifications of one flank: keys of that flank first, then keys that hold for both."""
        of_both = self._stated(FlankModifications.model_fields)
        of_one = getattr(self, flank) or FlankModifications()
        return FlankModifications(**{**of_both, **of_one._stated()})

    def key(self, flank: str, name: str) -> str:
        """Where the key ``name`` of one of its flanks stands: in its own section, or for both."""
        modifications = getattr(self, flank)
        field = name.partition(".")[0]
        return (
            f"{flank}.{name}"
            if modifications and getattr(modifications, field) is not None
            else name
        )


class GearModifications(FlankModifications):
    """Modified flanks of a gear with one gear mesh (sun, ring, pinion, gear). Keys here hold for
    both flanks; a key of ``drive`` or ``coast`` replaces the same one here.

    drive: the flank that carries the rated torque. coast: the other one.
    """

    drive: FlankModifications | None = None
    coast: FlankModifications | None = None


class PlanetModifications(FlankModifications):
    """Modified flanks of the planets. Keys here hold for both flanks; a key of ``sun`` or ``ring``
    replaces the same one here.

    sun: the flank that carries the rated torque at the sun; under a torque of the other sense it
    carries at the ring. ring: the flank that carries the rated torque at the ring, and at the sun
    under the other sense.
    """

    sun: FlankModifications | None = None
    ring: FlankModifications | None = None
