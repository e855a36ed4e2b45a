"""Units and modifications of REXS as they are called, read and written: tables for both ways.

A file states the unit of each attribute; where it does not, the schema's holds. Names and units
are those of the public REXS schemas 1.0 to 2.0 (rexs.info, FVA).

Who looks at the datum face from outside, with a tooth pointing up from its root to its tip, sees
its left flank on the left (ISO 21771, ISO 1328-1). Seen from +z a tooth of an external gear that
points up has +θ on its left; a tooth of a ring points up below the axis, and has +θ on its right:

    side of the left flank = d (external), −d (internal), d = ±1 for a datum face at the ±z end.

In an external pair left flanks touch left ones, in an internal pair too.

REXS leaves the signs of slopes to the standards. Here, as for a case (``gears.modifications``),

    profile_slope   C_Hα > 0: more is missing at the tip than at the root
    helix_slope     C_Hβ > 0: more is missing at the non-datum face than at the datum face
    profile_twist   S_α > 0: the profile slope is larger at the non-datum face

and amounts are those at the ends of the active profile and of the face.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from flexgear.model.modifications import LARGEST as LARGEST_M
from flexgear.model.section import Section
from flexgear.model.units import unit_name

# name without spaces -> (dimension, multiply by, divide by): SI, exact to the last bit
_UNITS: dict[str, tuple[str, float, float]] = {
    "none": ("number", 1, 1),
    "": ("number", 1, 1),
    "%": ("number", 1, 1e2),
    "mm": ("length", 1, 1e3),
    "mum": ("length", 1, 1e6),
    "um": ("length", 1, 1e6),
    "m": ("length", 1, 1),
    "h": ("time", 3600, 1),
    "deg": ("angle", math.pi, 180),
    "rad": ("angle", 1, 1),
    "1/min": ("speed", 2 * math.pi, 60),
    "rad/s": ("speed", 1, 1),
    "N": ("force", 1, 1),
    "kN": ("force", 1e3, 1),
    "Nm": ("torque", 1, 1),
    "kW": ("power", 1e3, 1),
    "W": ("power", 1, 1),
    "N/m": ("stiffness", 1, 1),
    "N/mm": ("stiffness", 1e3, 1),
    "Nmm/rad": ("rotational stiffness", 1, 1e3),
    "Nm/rad": ("rotational stiffness", 1, 1),
    "N/(mmmum)": ("stiffness per face width", 1e9, 1),
    "MPa": ("stress", 1e6, 1),
    "N/mm^2": ("stress", 1e6, 1),
    "Pa": ("stress", 1, 1),
    "kg": ("mass", 1, 1),
    "GPa": ("stress", 1e9, 1),
    "kg/dm^3": ("density", 1e3, 1),
    "kg/m^3": ("density", 1, 1),
    "kgm^2": ("inertia", 1, 1),
    "m/s^2": ("acceleration", 1, 1),
    "MRev": ("revolutions", 1_000_000, 1),
}

# what is read or written here, by attribute; a file of any version may leave its units out
SCHEMA_UNITS: dict[str, str] = {
    **dict.fromkeys(
        (
            "normal_module", "face_width", "common_face_width", "center_distance", "tip_diameter",
            "root_diameter", "base_diameter", "base_circle_diameter",
            "reference_diameter_cylindrical_gear",
            "addendum_modification", "inner_diameter", "outer_diameter", "length", "pitch_diameter",
            "gear_body_rim_thickness", "tip_corner_radius_reference_profile", "tip_radius",
            "addendum_reference_profile", "inner_diameter_begin", "inner_diameter_end",
            "outer_diameter_begin", "outer_diameter_end", "u_coordinate_on_shaft",
            "u_coordinate_on_shaft_inner_side", "u_coordinate_on_shaft_outer_side",
            "support_vector", "u_axis_vector", "w_axis_vector", "tip_relief_depth",
            "tip_relief_datum_length", "tip_relief_datum_diameter", "root_relief_depth",
            "root_relief_datum_length", "root_relief_datum_diameter", "profile_crowning_at_tip",
            "profile_crowning_at_root", "helix_crowning_amount_datum_face",
            "helix_crowning_amount_non_datum_face", "end_relief_depth_datum_face",
            "end_relief_length_datum_face", "end_relief_depth_non_datum_face",
            "end_relief_length_non_datum_face", "profile_slope", "helix_slope", "profile_twist",
            "minimum_normal_backlash", "mean_normal_backlash", "maximum_normal_backlash",
            "protuberance_amount", "machining_allowance", "grinding_allowance",
        ),
        "mm",
    ),
    **dict.fromkeys(
        (
            "helix_angle_reference_diameter", "normal_pressure_angle", "protuberance_angle",
            "rotating_angle_around_neg_u_axis",
            "operating_pressure_angle_in_the_transverse_section",
        ),
        "deg",
    ),
    **dict.fromkeys(("rotational_speed", "rolling_rotational_speed"), "1 / min"),
    **dict.fromkeys(("torque_around_u_axis", "torque_around_v_axis", "torque_around_w_axis",
                     "torque", "torque_acting_on_shaft_u"), "N m"),
    **dict.fromkeys(("force_u_direction", "force_v_direction", "force_w_direction",
                     "nominal_tangential_force_at_base_diameter"), "N"),
    **dict.fromkeys(("radial_dynamic_load_rating", "dynamic_capacity", "radial_static_load_rating",
                     "fatigue_limit_load"), "kN"),
    **dict.fromkeys([f"chordal_tooth_thickness_{end}_deviation" for end in ("upper", "lower")],
                    "mm"),
    **dict.fromkeys([f"{end}_backlash_allowance_referenced_to_span" for end in ("upper", "lower")],
                    "mum"),
    "power": "kW",
    "power_for_rotational_speed": "W",
    **dict.fromkeys(("radial_stiffness", "axial_stiffness"), "N / m"),
    **dict.fromkeys([f"operating_point_stiffness_{d}{a}_d_{a}"
                     for d in ("f_", "dF_") for a in "uvw"], "N / m"),
    **dict.fromkeys(("bending_stiffness", "rotational_stiffness"), "N mm / rad"),
    **dict.fromkeys(("radial_clearance", "radial_bearing_clearance",
                     "operating_radial_bearing_clearance", "radial_backlash"), "mum"),
    **dict.fromkeys(("operating_time_fraction", "load_duration_fraction"), "%"),
    **dict.fromkeys(("operating_time", "load_duration"), "h"),
    "mass_of_component": "kg",
    **dict.fromkeys(("moment_of_inertia_u_axis", "moment_of_inertia_v_axis",
                     "moment_of_inertia_w_axis"), "kg m^2"),
    **dict.fromkeys(("nominal_rating_life_rotations_iso_281_2007",
                     "nominal_reference_rating_life_rotations_iso_16281_2008",
                     "modified_reference_rating_life_rotations_iso_16281_2008"), "MRev"),
    "elastic_modulus": "MPa",
    "density": "kg / dm^3",
    "gravitational_acceleration": "m / s^2",
}  # fmt: skip


_SIGNS = {"°": "deg", "µ": "mu", "μ": "mu", "²": "^2", "³": "^3", "rpm": "1/min"}


def _plain(name: str) -> str:
    """A unit's name without spaces, as it stands in the table."""
    text = "".join(name.split())
    for sign, word in _SIGNS.items():
        text = text.replace(sign, word)
    return text


def from_si(unit: str) -> float:
    """Factor from an SI number to a known unit."""
    _, times, over = _UNITS[_plain(unit)]
    return over / times


def factor(unit: str, into: str) -> float | None:
    """Factor from the unit ``unit`` to ``into``. None for an unknown unit or one of another
    dimension; 1 exactly for the same unit."""
    a, b = _plain(unit), _plain(into)
    if a == b:
        return 1.0
    if a not in _UNITS or b not in _UNITS or _UNITS[a][0] != _UNITS[b][0]:
        return None
    (_, times, over), (_, times_into, over_into) = _UNITS[a], _UNITS[b]
    return times * over_into / (over * times_into)


Word = Literal["left", "right"]
WORDS: tuple[Word, Word] = ("left", "right")
DATUM = "datum_face_orientation"  # of a gear: on the side of its u axis, or against it
ORIENTATIONS = {"positive": 1, "negative": -1}
ENDS = ("tip", "root")
FACES = {"datum_face": 1, "non_datum_face": -1}


def tooth_side(word: Word, internal: bool, datum: int) -> int:
    """Side of the tooth of a flank, +1 towards +θ; datum: +1 for a datum face at the +z end."""
    left = -datum if internal else datum
    return left if word == "left" else -left


def word_of(side: int, internal: bool, datum: int) -> Word:
    """The flank on a side of the tooth."""
    return "left" if tooth_side("left", internal, datum) == side else "right"


def outward(datum: int, half: int) -> int:
    """End of the datum face in the axis of modifications: +z, but out from the middle in the left
    half (−1) of a double-helical stage, which is the mirror image of the right one (1)."""
    return -datum if half < 0 else datum


LARGEST = 1e6 * LARGEST_M  # µm, of an amount
FORMS = ("linear", "parabolic")
ADDITIVE = ("is_additive_modification", "true")  # what a case means anyway
LOADED = "loaded_tooth_flank"


@dataclass(frozen=True)
class Row:
    """A field of a section of a case and the REXS attribute that holds it.

    suffix: unit of the case's key, "" for a number. names: of the attribute, the first one is
    written, and the first that a file has is read. positive: whether it is read above 0 alone.
    """

    field: str
    suffix: str
    names: tuple[str, ...]
    positive: bool = False

    @property
    def key(self) -> str:
        """The key as case files write it."""
        return f"{self.field}_{self.suffix}" if self.suffix else self.field

    @property
    def unit(self) -> str:
        """Unit of the key."""
        return unit_name(self.suffix) if self.suffix else "none"


def written(section: Section, rows: Iterable[Row], turn: int = 1) -> dict[str, Any]:
    """Attributes (SI) of the fields that a section has; turn: sign of numbers."""
    values = {row.names[0]: getattr(section, row.field, None) for row in rows}
    return {name: turn * value for name, value in values.items() if value is not None}


MATERIAL = (
    Row("young_modulus", "gpa", ("elastic_modulus",), positive=True),
    Row("poisson_ratio", "", ("poisson_ratio",), positive=True),
    Row("density", "kg_per_m3", ("density",), positive=True),
)
SPRINGS = (
    Row("radial", "n_per_m", ("radial_stiffness",)),
    Row("axial", "n_per_m", ("axial_stiffness",)),
    Row("tilt", "nm_per_rad", ("bending_stiffness",)),
    Row("torsion", "nm_per_rad", ("rotational_stiffness",)),
)
RATING = (  # of a bearing
    Row("dynamic_rating", "kn", ("radial_dynamic_load_rating", "dynamic_capacity"), positive=True),
    Row("static_rating", "kn", ("radial_static_load_rating",)),
    Row("fatigue_load_limit", "kn", ("fatigue_limit_load",)),
)
CUTTER = (
    Row("teeth", "", ("number_of_teeth",)),
    Row("profile_shift", "", ("addendum_modification_coefficient",)),
)
PROTUBERANCE = (
    Row("protuberance", "mm", ("protuberance_amount",), positive=True),
    Row("protuberance_angle", "deg", ("protuberance_angle",)),
)
PORT = (
    Row("speed", "rpm", ("rotational_speed",)),
    Row("torque", "nm", ("torque_around_u_axis",)),
    Row("power", "kw", ("power",)),
)
INERTIA = Row("inertia", "kg_m2", ("moment_of_inertia_u_axis",))
BEHIND = (  # the spline of a sun's shaft: a port's body
    INERTIA,
    Row("mass", "kg", ("mass_of_component",)),
    Row("tilt_inertia", "kg_m2", ("moment_of_inertia_v_axis", "moment_of_inertia_w_axis")),
)
AXES = ("v", "w", "u")  # x, y, z of a case
FORCES = tuple(f"force_{axis}_direction" for axis in AXES)
MOMENTS = tuple(f"torque_around_{axis}_axis" for axis in AXES[:2])
GRAVITY = tuple(f"direction_vector_gravity_{axis}" for axis in AXES)


@dataclass(frozen=True)
class Modification:
    """A REXS component that modifies a flank.

    sizes: lengths; of one field at both ends of a flank the mean is read. section: of a case's
    modifications that they are in, "" for the flank's own. words: what a case means anyway.
    by_face: whether its sign hangs on the datum face; face: where it is, 1 at the datum, −1 at the
    non-datum face, 0 at neither; positive: what a positive one is.
    """

    sizes: tuple[Row, ...]
    section: str = ""
    words: Mapping[str, str] = field(default_factory=dict)
    by_face: bool = False
    face: int = 0
    positive: str = ""


_RELIEF = {"amount": ("um", "depth"), "length": ("mm", "datum_length"),
           "start_diameter": ("mm", "datum_diameter")}  # fmt: skip
MODIFICATIONS = {
    "profile_crowning": Modification(
        tuple(Row("profile_crowning", "um", (f"profile_crowning_at_{end}",)) for end in ENDS),
        words={"shape_of_profile_crowning": "parabolic"},
    ),
    "helix_crowning": Modification(
        tuple(Row("lead_crowning", "um", (f"helix_crowning_amount_{face}",)) for face in FACES),
        words={"shape_of_helix_crowning": "parabolic"},
    ),
    "profile_slope": Modification(
        (Row("profile_slope", "um", ("profile_slope",)),),
        positive="where more is missing at the tip",
    ),
    "helix_slope": Modification(
        (Row("helix_slope", "um", ("helix_slope",)),),
        words={"helix_evaluation_reference": "facewidth"},
        by_face=True,
        positive="where more is missing at the non-datum face",
    ),
    "profile_twist": Modification(
        (Row("twist", "um", ("profile_twist",)),),
        by_face=True,
        positive="where the profile slope is larger at the non-datum face",
    ),
    **{
        kind: Modification(
            tuple(Row(key, unit, (f"{kind}_{name}",)) for key, (unit, name) in _RELIEF.items()),
            section=kind,
        )
        for kind in ("tip_relief", "root_relief")
    },
    **{
        f"end_relief_{face}": Modification(
            (
                Row("amount", "um", (f"end_relief_depth_{face}",)),
                Row("length", "mm", (f"end_relief_length_{face}",)),
            ),
            section="end_relief",
            face=side,
        )
        for face, side in FACES.items()
    },
}
KEYS = {m.section or row.field for m in MODIFICATIONS.values() for row in m.sizes}
