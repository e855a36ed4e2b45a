"""What declares results: axes and variables of datasets, figures of ``summary.json``.

The first dimension is that of the samples, "time" for a transient and "position" for a series of
equilibria; it is written here as "sample". Frames and signs are those of docs/conventions.md. Only
variables with an attribute ``missing``, which says when, hold values that are not a number (null in
JSON).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Literal, NamedTuple

import numpy as np


class Quantity(NamedTuple):
    """dims: names of the axes in order; units; meaning in words; missing: when a value is missing,
    that is not a number, empty where none ever is."""

    dims: tuple[str, ...]
    units: str
    meaning: str
    missing: str = ""

    @property
    def attrs(self) -> dict[str, str]:
        """Attributes of a variable."""
        attributes = {MISSING: self.missing} if self.missing else {}
        return {"units": self.units, "long_name": self.meaning, **attributes}


def quantity(axes: str, units: str, meaning: str, missing: str = "") -> Quantity:
    """A quantity with its axes as words."""
    return Quantity(tuple(axes.split()), units, meaning, missing)


class Coordinate(NamedTuple):
    """An axis: its unit and its meaning in words.

    stage: where the stage of an entry stands, if entries belong to stages: "name" where labels are
    names of members, else the name of the coordinate beside it.
    """

    units: str
    meaning: str
    stage: str = ""


S = "sample"
MISSING = "missing"  # attribute of variables that may lack values: when they do
UNLOADED = "where the planets together carry less than 3 % of rated, or of the largest of them"
DOFS = ("ux", "uy", "uz", "rx", "ry", "rz")
AXES = ("x", "y", "z")


RESULT_COORDINATES: dict[str, Coordinate] = {
    "time": Coordinate("s", "time"),
    "position": Coordinate("1", "number of the equilibrium position, from 0"),
    "planet": Coordinate("1", "planet number, from 1"),
    "slot": Coordinate("1", "place of a tooth pair among those in contact, from 1"),
    "tooth": Coordinate("1", "ring tooth number, from 1", "tooth_stage"),
    "axis": Coordinate("", "direction"),
    "dof": Coordinate("", "u in m or N, r in rad or N m"),
    "carrier_node": Coordinate("", "interface node of the carrier", "name"),
    "bearing": Coordinate("", "bearing or support", "name"),
    "bearing_row": Coordinate("1", "row of rollers, from 1 at -z"),
    "tooth_angle": Coordinate("rad", "angle of the ring tooth's centre"),
    "lead_angle": Coordinate(
        "rad", "rotation of the reference member, the first port of given speed that turns"
    ),
    "turning_stage": Coordinate("", "stage that turns"),
    "flank": Coordinate(
        "", "one flank of a gear mesh: stage, kind, side, planet, drive or coast", "flank_stage"
    ),
    "flank_stage": Coordinate("", "stage of the flank"),
    "flank_kind": Coordinate("", "ring or sun"),
    "flank_side": Coordinate("", "half of a double-helical stage"),
    "flank_planet": Coordinate("1", "planet number, from 1"),
    "flank_sense": Coordinate("", "drive: carries under rated torque; coast: the other"),
    "state": Coordinate("1", "entry of the state of a transient"),
    "slice": Coordinate("1", "slice of a contact line, from 1 at -z"),
    "face": Coordinate("1", "place along the face over its width, from -1/2 at -z to 1/2"),
    "cause": Coordinate("", "cause of misalignment: a body or bearing, errors, modified flanks"),
    "pair_member": Coordinate(
        "", "of a tooth pair: planet (gear of a parallel stage), or gear: its mate"
    ),
    "fillet": Coordinate("", "fillet of a tooth: on its -theta or +theta side"),
    "gear_mesh_order": Coordinate("1", "order of the gear mesh"),
    "gear_mesh_phase": Coordinate("1", "gear-mesh cycles from the first position on"),
    "bolt": Coordinate("", "bolt of a ring", "name"),
    "fe_coordinate_of": Coordinate("", "FE body that a coordinate belongs to", "name"),
    "support": Coordinate(
        "", "bearing, fit, spline, joint or other spring between two nodes", "name"
    ),
    "tooth_stage": Coordinate("", "stage of the ring tooth"),
    "tooth_side": Coordinate("", "half of a double-helical ring that has the tooth"),
    "sensor_time": Coordinate("s", "time of a sensor's samples, without the delay of its filter"),
    "sensor": Coordinate("", "sensor, by its name"),
    "sensor_quantity": Coordinate("", "measured quantity"),
    "sensor_unit": Coordinate("", "its unit"),
    "static_sensor": Coordinate("", "sensor of a displacement, strain or torque"),
    "static_sensor_unit": Coordinate("", "its unit"),
    "tooth_number": Coordinate("1", "number of the tooth in its ring, from 1"),
    "gear_mesh": Coordinate("", "gear mesh of a train: stage, kind, side, planet", "stage"),
    "stage": Coordinate("", "stage of the gear mesh"),
    "kind": Coordinate("", "ring or sun; of a parallel stage the pinion counts as sun"),
    "side": Coordinate("", "half of a double-helical stage: left (-z) or right"),
    "group": Coordinate("", "gear meshes that share the load of a stage", "group_stage"),
    "group_stage": Coordinate("", "stage of the group"),
    "group_kind": Coordinate("", "ring or sun"),
    "group_side": Coordinate("", "half of a double-helical stage"),
    "body": Coordinate("", "lumped body, or node that represents a flexible one", "name"),
    "inertia": Coordinate("", "body that can move, with its elastic modes, if any", "name"),
    "member": Coordinate("", "member of a stage that turns about its axis", "name"),
    "input_coordinate": Coordinate("", "member whose rotation is independent"),
    "port": Coordinate("", "member where torque acts from outside"),
    "load": Coordinate("", "load on a member, as the case lists them: number, member, frame"),
    "direction": Coordinate("", "radial outward, tangential, axial, in the planet's axes"),
    "definition": Coordinate("", "definition of the load sharing factor"),
    "cycle": Coordinate("1", "evaluated gear-mesh cycle, from 1"),
    "mode": Coordinate("1", "number of the mode, from 1"),
    "spring": Coordinate("", "link, support, gear mesh or body that is strained"),
    "motion": Coordinate("", "part of the kinetic energy: motion of central members, or planets"),
    "speed_factor": Coordinate("1", "speed over rated speed"),
    "excitation": Coordinate(
        "", "order of a gear-mesh frequency, of a shaft's turn or of passing planets"
    ),
    "excitation_stage": Coordinate("", "stage that it belongs to"),
    "excitation_kind": Coordinate("", "gear mesh, shaft or planet pass"),
    "excitation_order": Coordinate("1", "order of the harmonic"),
    "crossing": Coordinate("1", "number of the crossing, from 1"),
    "meeting": Coordinate(
        "1", "number of a mode that an excitation meets at an operating speed, from 1"
    ),
    "kept_mode": Coordinate("1", "number of the natural mode, from 1, rigid rotations among them"),
    "peak": Coordinate("1", "number of the peak, from 1, the highest first"),
    "band": Coordinate("1", "number of the band of speeds, from 1"),
    "acting": Coordinate("1", "the two modes of an instability, 1 the lower one"),
    "harmonic": Coordinate("Hz", "frequency of an error of gears or of a gear mesh"),
    "point": Coordinate("1", "steady state, from 0, in the order of its curve"),
    "measure": Coordinate("", "over a period: maximum, minimum, mean, rms about the mean"),
    "turning_point": Coordinate("1", "number of a turning point of a curve, from 1"),
    "target": Coordinate("1", "number of a stable state to which a sweep may jump, from 1"),
    "stability_change": Coordinate("1", "number of a change of stability, from 1"),
}


ALWAYS: Literal["always"] = "always"
WITH_SECTION: Literal["with its section"] = "with its section"
ABSENT: Any = {}  # value of a figure that is not there


class Bars(NamedTuple):
    """A picture of a figure as bars, by stage and name. section: of the report; label: of its axis,
    without unit; caption; sentence: below it."""

    section: str
    label: str
    caption: str
    sentence: str


class Figure(NamedTuple):
    """path: keys with dots below those of its section, angle brackets for names of the case; unit:
    "" where it is no number; needed: always, where the section that its path begins with is there,
    or not; of: the value of the path's first key, with all that is below it, of what the section is
    of: ABSENT where there is none, None where it has no number; label: of its rows in tables,
    {name} for angle brackets, "" where they leave it out; printed: unit in tables, where the unit
    does not say; bars: its picture, if it has one.
    """

    path: str
    unit: str
    meaning: str
    needed: Literal["", "always", "with its section"] = ""
    of: Callable[[Any], Any] | None = None
    label: str = ""
    printed: str = ""
    bars: Bars | None = None

    @property
    def names(self) -> list[str]:
        """Names on the way to it."""
        return self.path.split(".")


def number(value: Any) -> float | None:
    """A number, None where there is none."""
    return float(value) if np.isfinite(value) else None


def below(section: str, figures: Iterable[Figure]) -> Iterator[Figure]:
    """Figures with their whole paths."""
    return (f._replace(path=f"{section}.{f.path}") for f in figures)


def values(figures: Iterable[Figure], subject: Any) -> dict[str, Any]:
    """A section of a summary: the figures of a subject by their keys."""
    figures_of = ((f.names[0], f.of(subject), f.needed) for f in figures if f.of is not None)
    return {name: value for name, value, needed in figures_of if needed or value != ABSENT}
