"""Declarations of axes and variables of datasets and of figures of ``summary.json``.

The first dimension, written "sample", is "time" for a transient and "position" for a series of
equilibria. Axes and signs are those of docs/conventions.md. Only variables with an attribute
``missing``, which states the reason, have values that are NaN (null in JSON).
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Literal, NamedTuple

import numpy as np


class Quantity(NamedTuple):
    """A variable of a dataset.

    dims: names of the axes in order. missing: description of the values that are NaN, "" if there
    are none.
    """

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
    """A quantity; axes: names of its axes, separated by blanks."""
    return Quantity(tuple(axes.split()), units, meaning, missing)


class Coordinate(NamedTuple):
    """An axis: its unit and its meaning.

    stage: source of an entry's stage: "name" for the label itself, a name of a member, else the
    name of the coordinate with the stage, "" if entries belong to no stage.
    """

    units: str
    meaning: str
    stage: str = ""


S = "sample"
MISSING = "missing"  # attribute of variables that may have missing values
UNLOADED = "where the planets together carry less than 3 % of rated, or of the largest of them"
DOFS = ("ux", "uy", "uz", "rx", "ry", "rz")
AXES = ("x", "y", "z")


RESULT_COORDINATES: dict[str, Coordinate] = {
    "time": Coordinate("s", "time"),
    "position": Coordinate("1", "number of the equilibrium position, from 0"),
    "planet": Coordinate("1", "planet number, from 1"),
    "slot": Coordinate("1", "number of a tooth pair among those in contact, from 1"),
    "tooth": Coordinate("1", "ring tooth number, from 1", "tooth_stage"),
    "axis": Coordinate("", "direction"),
    "dof": Coordinate("", "u in m or N, r in rad or N m"),
    "carrier_node": Coordinate("", "interface node of the carrier", "name"),
    "bearing": Coordinate("", "bearing or support", "name"),
    "bearing_row": Coordinate("1", "row of rollers, from 1 at -z"),
    "tooth_angle": Coordinate("rad", "angle of the ring tooth's centre"),
    "lead_angle": Coordinate(
        "rad", "rotation of the reference member, the first rotating port with given speed"
    ),
    "turning_stage": Coordinate("", "stage that rotates"),
    "flank": Coordinate(
        "", "one flank of a gear mesh: stage, kind, side, planet, drive or coast", "flank_stage"
    ),
    "flank_stage": Coordinate("", "stage of the flank"),
    "flank_kind": Coordinate("", "ring or sun"),
    "flank_side": Coordinate("", "half of a double-helical stage"),
    "flank_planet": Coordinate("1", "planet number, from 1"),
    "flank_sense": Coordinate("", "drive: loaded by rated torque; coast: the opposite flank"),
    "state": Coordinate("1", "entry of the state of a transient"),
    "slice": Coordinate("1", "slice of a contact line, from 1 at -z"),
    "face": Coordinate("1", "position along the face over its width, from -1/2 at -z to 1/2"),
    "cause": Coordinate("", "cause of misalignment: a body or bearing, errors, modified flanks"),
    "pair_member": Coordinate(
        "", "gear of a tooth pair: planet (gear of a parallel stage), or gear for its mate"
    ),
    "fillet": Coordinate("", "fillet of a tooth: on its -theta or +theta side"),
    "gear_mesh_order": Coordinate("1", "order of the gear mesh"),
    "gear_mesh_phase": Coordinate("1", "gear-mesh cycles since the first position"),
    "bolt": Coordinate("", "bolt of a ring", "name"),
    "fe_coordinate_of": Coordinate("", "FE body of a coordinate", "name"),
    "support": Coordinate(
        "", "bearing, fit, spline, joint or other spring between two nodes", "name"
    ),
    "tooth_stage": Coordinate("", "stage of the ring tooth"),
    "tooth_side": Coordinate("", "half of a double-helical ring that has the tooth"),
    "sensor_time": Coordinate("s", "time of a sensor's samples, without the delay of its filter"),
    "sensor": Coordinate("", "name of the sensor"),
    "sensor_quantity": Coordinate("", "measured quantity"),
    "sensor_unit": Coordinate("", "unit of the sensor's signal"),
    "static_sensor": Coordinate("", "sensor of a displacement, strain or torque"),
    "static_sensor_unit": Coordinate("", "unit of the sensor's value"),
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
    "member": Coordinate("", "member of a stage that rotates about its axis", "name"),
    "input_coordinate": Coordinate("", "member whose rotation is independent"),
    "port": Coordinate("", "member on which a torque acts from outside"),
    "load": Coordinate("", "load on a member in the case: number, member, frame"),
    "direction": Coordinate("", "radial outward, tangential, axial, in the planet's axes"),
    "definition": Coordinate("", "definition of the load sharing factor"),
    "cycle": Coordinate("1", "evaluated gear-mesh cycle, from 1"),
    "mode": Coordinate("1", "number of the mode, from 1"),
    "spring": Coordinate("", "link, support, gear mesh or body with strain energy"),
    "motion": Coordinate("", "part of the kinetic energy: motion of central members, or planets"),
    "speed_factor": Coordinate("1", "speed over rated speed"),
    "excitation": Coordinate(
        "", "order of a gear-mesh frequency, of a shaft's rotation or of passing planets"
    ),
    "excitation_stage": Coordinate("", "stage of the excitation"),
    "excitation_kind": Coordinate("", "gear mesh, shaft, planet pass or bolt pass"),
    "excitation_order": Coordinate("1", "order of the harmonic"),
    "crossing": Coordinate("1", "number of the crossing, from 1"),
    "meeting": Coordinate(
        "1", "number of a coincidence of a mode and an excitation at an operating speed, from 1"
    ),
    "kept_mode": Coordinate("1", "number of the natural mode, from 1, rigid rotations included"),
    "peak": Coordinate("1", "number of the peak, from 1, the highest first"),
    "band": Coordinate("1", "number of the band of speeds, from 1"),
    "acting": Coordinate("1", "number of a mode of an instability, 1 for the lower one"),
    "point": Coordinate("1", "number of the steady state, from 0, in the order of its curve"),
    "measure": Coordinate("", "maximum, minimum, mean, or rms about the mean, over a period"),
    "turning_point": Coordinate("1", "number of a turning point of a curve, from 1"),
    "target": Coordinate("1", "number of a stable state to which a sweep may jump, from 1"),
    "stability_change": Coordinate("1", "number of a change of stability, from 1"),
}


ALWAYS: Literal["always"] = "always"
WITH_SECTION: Literal["with its section"] = "with its section"
ABSENT: Any = {}  # value of a figure that a subject does not have


class Figure(NamedTuple):
    """A figure of a summary.

    path: dotted key below its section, with angle brackets for names of the case. unit: "" for a
    value that is no number. needed: whether the figure is required always, with its section, or
    not. of: function of the section's subject that returns the value of the path's first key with
    all nested keys, ABSENT if the subject does not have it, None without a number. label: label of
    its rows in tables with {name} for angle brackets, "" if tables omit it. printed: unit in tables
    if it differs.
    """

    path: str
    unit: str
    meaning: str
    needed: Literal["", "always", "with its section"] = ""
    of: Callable[[Any], Any] | None = None
    label: str = ""
    printed: str = ""

    @property
    def names(self) -> list[str]:
        """Keys of the path."""
        return self.path.split(".")


def number(value: Any) -> float | None:
    """The value as float, None if it is not finite."""
    return float(value) if np.isfinite(value) else None


def below(section: str, figures: Iterable[Figure]) -> Iterator[Figure]:
    """Figures with the path of their section in front of their paths."""
    return (f._replace(path=f"{section}.{f.path}") for f in figures)


def values(figures: Iterable[Figure], subject: Any) -> dict[str, Any]:
    """A section of a summary: the figures of a subject by key, without absent ones."""
    figures_of = ((f.names[0], f.of(subject), f.needed) for f in figures if f.of is not None)
    return {name: value for name, value, needed in figures_of if needed or value != ABSENT}
