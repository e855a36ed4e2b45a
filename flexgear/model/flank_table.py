"""A flank as a table over profile and face, written in the case or read from a CSV file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Self

import numpy as np
from pydantic import Field, model_validator

from flexgear.model.csv_table import read_table
from flexgear.model.errors import InputError
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Angle, Length

LARGEST = 2e-3  # m
GEARS = ("sun", "planet", "ring", "pinion", "gear")
FLANKS = ("drive", "coast", "sun", "ring")


class FlankTable(Section):
    """What a flank lacks at points of a grid over profile and face, as a gear measuring machine
    finds it; straight between them, and beyond them as at the nearest one.

    file: CSV with the columns roll_angle_deg or diameter_mm, z_mm and gap_um, one row a point, in
    any order; it gives the other keys. roll_angles: of the points on the profile, rising from the
    base circle (tan of the profile angle there); diameters: in their place, circles of the points,
    rising. z: of the points along the face, rising, 0 at its middle. gaps: a list over z for each
    place on the profile, positive where material is missing (measured deviations, where excess is
    positive, have the other sign).
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

    @model_validator(mode="after")
    def _whole(self) -> Self:
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
        return self


def flank_tables(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Tables of flanks in the SI data of a case."""
    for stage in data.get("stages", ()):
        for gear in GEARS:
            member = stage.get(gear)
            of_member = member.get("modifications") if isinstance(member, dict) else None
            if not isinstance(of_member, dict):
                continue
            sections = (of_member, *(of_member.get(flank) for flank in FLANKS))
            tables = (section.get("table") for section in sections if isinstance(section, dict))
            yield from (section for section in tables if isinstance(section, dict))


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
