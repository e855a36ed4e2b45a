"""Every variable a result may hold: dimensions, unit, meaning.

The first dimension is that of the samples, "time" for a transient and "position" for a series of
equilibria; it is written here as "sample". Frames and signs are those of docs/conventions.md. Only
variables with an attribute ``missing``, which says when, hold values that are not a number (null in
JSON).
"""

from __future__ import annotations

from typing import NamedTuple


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
        said = {MISSING: self.missing} if self.missing else {}
        return {"units": self.units, "long_name": self.meaning, **said}


S = "sample"
MISSING = "missing"  # attribute of variables that may lack values: when they do
UNLOADED = "where the planets together carry less than 3 % of rated, or of the largest of them"
DOFS = ("ux", "uy", "uz", "rx", "ry", "rz")
AXES = ("x", "y", "z")

COORDINATES: dict[str, tuple[str, str]] = {
    "time": ("s", "time"),
    "position": ("1", "number of the equilibrium position, from 0"),
    "planet": ("1", "planet number, from 1"),
    "slot": ("1", "place of a tooth pair among those in contact, from 1"),
    "tooth": ("1", "ring tooth number, from 1"),
    "axis": ("", "direction"),
    "dof": ("", "u in m or N, r in rad or N m"),
    "carrier_node": ("", "interface node of the carrier"),
    "bolt": ("1", "bolt number, from 1"),
    "bearing": ("", "bearing or support"),
    "bearing_row": ("1", "row of rollers, from 1 at -z"),
    "tooth_angle": ("rad", "angle of the ring tooth's centre"),
    "planet_angle": ("rad", "angle of the planet in the carrier frame"),
}


def _gear_mesh(kind: str, other: str) -> dict[str, Quantity]:
    pair = (S, "planet", "slot")
    found = {
        f"{kind}_gear_mesh_force": Quantity(
            (S, "planet"),
            "N",
            f"normal force along the 3D line of action, {other} on planet, drive less coast flank",
        )
    }
    for flank, words in (("", "drive flank"), ("_coast", "coast flank")):
        start, said = f"{kind}{flank}_pair", f"{other}-planet tooth pair, {words}"
        found |= {
            f"{start}_load": Quantity(pair, "N", f"load of a {said}; compressive is positive"),
            f"{start}_tooth": Quantity(pair, "1", f"{other} tooth of a {said}, from 1; 0: none"),
            f"{start}_stiffness": Quantity(pair, "N/m", f"stiffness of a {said}"),
            f"{start}_position": Quantity(
                pair, "m", f"path coordinate of a {said}, from the planet's base tangent point"
            ),
        }
    return found


QUANTITIES: dict[str, Quantity] = {
    "carrier_angle": Quantity((S,), "rad", "mean rotation of the pins against the ring"),
    "carrier_speed": Quantity((S,), "rad/s", "mean speed of the pins against the ring"),
    "input_torque": Quantity((S,), "N m", "drive torque on the carrier"),
    "output_torque": Quantity((S,), "N m", "torque the brake takes at the sun shaft"),
    "output_speed": Quantity((S,), "rad/s", "speed of the sun shaft's output end"),
    **_gear_mesh("ring", "ring"),
    **_gear_mesh("sun", "sun"),
    "tooth_displacement": Quantity((S, "tooth", "axis"), "m", "ring tooth node, axes of the ring"),
    "sun_displacement": Quantity((S, "dof"), "m, rad", "sun, carrier axes, rolling taken off"),
    "planet_displacement": Quantity(
        (S, "planet", "dof"), "m, rad", "planet, axes radial, tangential, axial, rolling taken off"
    ),
    "pin_displacement": Quantity(
        (S, "planet", "dof"), "m, rad", "pin, carrier axes, rolling taken off"
    ),
    "carrier_displacement": Quantity(
        (S, "carrier_node", "dof"), "m, rad", "carrier node, carrier axes, rolling taken off"
    ),
    "load_sharing": Quantity(
        (S,), "1", "N max F / sum F of the ring gear meshes", missing=UNLOADED
    ),
    "planet_force_spread": Quantity(
        (S,), "1", "(max F - min F) / rated mean F of the ring gear meshes"
    ),
    "bolt_force": Quantity(
        (S, "bolt", "axis"), "N", "force of the ring on a bolt: radial, tangential, axial"
    ),
    "bearing_force": Quantity(
        (S, "bearing", "dof"),
        "N, N m",
        "force and moment that a bearing, fit or spline carries, of what it holds on its support",
    ),
    "planet_bearing_row_load": Quantity(
        (S, "planet", "bearing_row"), "N", "radial force of a row of rollers of the planet's bearing"
    ),
    "closure": Quantity(
        (S,),
        "1",
        "largest imbalance of an equilibrium over its load, or what errors and gaps are worth",
    ),
    "energy_kinetic": Quantity((S,), "J", "kinetic energy"),
    "energy_elastic": Quantity((S,), "J", "strain energy of bodies, bearings, bolts, splines"),
    "energy_pair_elastic": Quantity((S,), "J", "strain energy of the tooth pairs"),
    "energy_input_work": Quantity((S,), "J", "work done by the machines at the inputs"),
    "energy_brake_work": Quantity((S,), "J", "work taken by the machine at the output"),
    "energy_damping_work": Quantity((S,), "J", "work taken by damping of the structure"),
    "energy_pair_damping_work": Quantity((S,), "J", "work taken by damping of the tooth pairs"),
    "energy_parametric_work": Quantity(
        (S,), "J", "work of changing pair stiffness and contact vectors"
    ),
    "energy_load_work": Quantity((S,), "J", "work done by weight and loads given from outside"),
}
