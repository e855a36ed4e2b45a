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
from typing import Literal

from flexgear.model.modifications import LARGEST as LARGEST_M

_TURN = 2.0 * math.pi
# name without spaces -> (dimension, factor to SI)
_UNITS: dict[str, tuple[str, float]] = {
    "none": ("number", 1.0),
    "": ("number", 1.0),
    "%": ("number", 1e-2),
    "mm": ("length", 1e-3),
    "mum": ("length", 1e-6),
    "um": ("length", 1e-6),
    "m": ("length", 1.0),
    "h": ("time", 3600.0),
    "deg": ("angle", math.pi / 180.0),
    "rad": ("angle", 1.0),
    "1/min": ("speed", _TURN / 60.0),
    "rad/s": ("speed", 1.0),
    "N": ("force", 1.0),
    "kN": ("force", 1e3),
    "Nm": ("torque", 1.0),
    "kW": ("power", 1e3),
    "W": ("power", 1.0),
    "N/m": ("stiffness", 1.0),
    "N/mm": ("stiffness", 1e3),
    "Nmm/rad": ("rotational stiffness", 1e-3),
    "Nm/rad": ("rotational stiffness", 1.0),
    "N/(mmmum)": ("stiffness per face width", 1e9),
    "MPa": ("stress", 1e6),
    "N/mm^2": ("stress", 1e6),
    "Pa": ("stress", 1.0),
    "kg": ("mass", 1.0),
    "GPa": ("stress", 1e9),
    "kg/dm^3": ("density", 1e3),
    "kg/m^3": ("density", 1.0),
    "kgm^2": ("inertia", 1.0),
    "m/s^2": ("acceleration", 1.0),
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
    "elastic_modulus": "MPa",
    "density": "kg / dm^3",
    "gravitational_acceleration": "m / s^2",
}  # fmt: skip


def _plain(name: str) -> str:
    """A unit's name without spaces, with its degree and micro signs spelled out."""
    text = "".join(name.split())
    return text.replace("°", "deg").replace("µ", "mu").replace("μ", "mu")


def si_factor(name: str) -> float:
    """What a number in a unit that is known is multiplied with to be in SI."""
    return _UNITS[_plain(name)][1]


def factor(unit: str, into: str) -> float | None:
    """What a number in the unit ``unit`` is multiplied with to be in ``into``.

    None for an unknown unit or one of another dimension; 1 exactly for the same unit.
    """
    a, b = _plain(unit), _plain(into)
    if a == b:
        return 1.0
    if a not in _UNITS or b not in _UNITS or _UNITS[a][0] != _UNITS[b][0]:
        return None
    return _UNITS[a][1] / _UNITS[b][1]


Word = Literal["left", "right"]
WORDS: tuple[Word, Word] = ("left", "right")
DATUM = "datum_face_orientation"  # of a gear: on the side of its u axis, or against it
ORIENTATIONS = {"positive": 1, "negative": -1}
FACES = ("datum_face", "non_datum_face")


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


LARGEST = 1e3 * LARGEST_M  # mm, of an amount
RELIEFS = ("tip_relief", "root_relief")
CROWNINGS = {  # REXS component: key of a case, amounts at both ends
    "profile_crowning": (
        "profile_crowning_um",
        ("profile_crowning_at_tip", "profile_crowning_at_root"),
    ),
    "helix_crowning": (
        "lead_crowning_um",
        ("helix_crowning_amount_datum_face", "helix_crowning_amount_non_datum_face"),
    ),
}
SLOPES = {  # REXS component and its attribute: key of a case, whether its sign hangs on the face
    "profile_slope": ("profile_slope_um", False),
    "helix_slope": ("helix_slope_um", True),
    "profile_twist": ("twist_um", True),
}
FORMS = ("linear", "parabolic")
END_RELIEF = "end_relief"
KEYS = {  # fields of a case's ``FlankModifications`` that REXS has
    *(key.removesuffix("_um") for key, _ in (*CROWNINGS.values(), *SLOPES.values())),
    *RELIEFS,
    END_RELIEF,
}
AS_HERE = {  # what a case means anyway; other values are listed
    "shape_of_profile_crowning": ("parabolic",),
    "shape_of_helix_crowning": ("parabolic",),
    "helix_evaluation_reference": ("facewidth",),
    "is_additive_modification": ("true",),
}
LOADED = "loaded_tooth_flank"
SIGNS = {
    "profile_slope": "positive where more is missing at the tip",
    "helix_slope": "positive where more is missing at the non-datum face",
    "profile_twist": "positive where the profile slope is larger at the non-datum face",
}
