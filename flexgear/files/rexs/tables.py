"""Tables of the units, attributes and flank modifications of REXS for import and export.

A file states the unit of each attribute; if it does not, the unit of the schema applies. Names and
units are those of the public REXS schemas 1.0 to 2.0 (rexs.info, FVA).

The left flank of a tooth is on the left if one looks at the datum face from outside with the tooth
pointing up from root to tip (ISO 21771, ISO 1328-1). Seen from +z, a tooth of an external gear that
points up has +θ on its left; a tooth of a ring points up below the axis, and has +θ on its right:

    side of the left flank = d (external), −d (internal), d = ±1 for a datum face at the ±z end.

Left flanks touch left flanks in external and in internal pairs.

REXS leaves the signs of slopes to the standards. Here, as for a case (``gears.modifications``),

    profile_slope   C_Hα > 0: more is missing at the tip than at the root
    helix_slope     C_Hβ > 0: more is missing at the non-datum face than at the datum face
    profile_twist   S_α > 0: the profile slope is larger at the non-datum face

and amounts are those at the ends of the active profile and of the face.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from flexgear.model.modifications import LARGEST as LARGEST_M
from flexgear.model.section import Section
from flexgear.model.units import SUFFIXES, unit_name

_SIGNS = {"°": "deg", "µ": "mu", "μ": "mu", "²": "^2", "³": "^3", "rpm": "1/min"}


def _plain(name: str) -> str:
    """A unit's name without spaces and with the signs of the table."""
    text = "".join(name.split())
    for sign, word in _SIGNS.items():
        text = text.replace(sign, word)
    return text


# name without spaces -> (dimension, factor, divisor) for SI; two numbers make the result exact
_UNITS: dict[str, tuple[str, float, float]] = {
    **{
        _plain(unit_name(suffix)): (dimension, *factors)
        for dimension, units in SUFFIXES.items()
        for suffix, factors in units.items()
    },
    "none": ("number", 1, 1),
    "": ("number", 1, 1),
    "%": ("number", 1, 1e2),
    "um": ("length", 1, 1e6),
    "h": ("time", 3600, 1),
    "min": ("time", 60, 1),
    "deg": ("angle", math.pi, 180),
    "Nmm/rad": ("rotational stiffness", 1, 1e3),
    "N/mm^2": ("stress", 1e6, 1),
    "GPa": ("stress", 1e9, 1),
    "kg/dm^3": ("density", 1e3, 1),
    "kgmm^2": ("inertia", 1, 1e6),
    "MRev": ("revolutions", 1_000_000, 1),
    "HV": ("number", 1, 1),
    "HRC": ("number", 1, 1),
    "C": ("temperature", 1, 1),
}

_ATTRIBUTES_BY_UNIT = {
    "mm": """
        normal_module face_width common_face_width center_distance tip_diameter root_diameter
        base_diameter base_circle_diameter reference_diameter_cylindrical_gear addendum_modification
        inner_diameter outer_diameter length gear_body_rim_thickness
        tip_corner_radius_reference_profile tip_radius addendum_reference_profile
        inner_diameter_begin inner_diameter_end outer_diameter_begin outer_diameter_end
        u_coordinate_on_shaft u_coordinate_on_shaft_inner_side u_coordinate_on_shaft_outer_side
        support_vector u_axis_vector w_axis_vector tip_relief_depth tip_relief_datum_length
        tip_relief_datum_diameter root_relief_depth root_relief_datum_length
        root_relief_datum_diameter profile_crowning_at_tip profile_crowning_at_root
        helix_crowning_amount_datum_face helix_crowning_amount_non_datum_face
        end_relief_depth_datum_face end_relief_length_datum_face end_relief_depth_non_datum_face
        end_relief_length_non_datum_face profile_slope helix_slope profile_twist
        minimum_normal_backlash mean_normal_backlash maximum_normal_backlash protuberance_amount
        machining_allowance grinding_allowance chordal_tooth_thickness_upper_deviation
        chordal_tooth_thickness_lower_deviation single_pitch_deviation
        single_pitch_deviation_iso_1328_2013 diameter_of_rolling_element length_of_rolling_element
        reference_diameter_rolling_bearing reference_diameter distance_between_bearing_rows""",
    "deg": """
        helix_angle_reference_diameter normal_pressure_angle protuberance_angle
        rotating_angle_around_neg_u_axis pressure_angle
        operating_pressure_angle_in_the_transverse_section""",
    "1 / min": "rotational_speed",
    "N m": "torque_around_u_axis torque_around_v_axis torque_around_w_axis",
    "N": """
        force_u_direction force_v_direction force_w_direction
        nominal_tangential_force_at_base_diameter""",
    "kN": """
        radial_dynamic_load_rating dynamic_capacity radial_static_load_rating fatigue_limit_load""",
    "mum": """
        upper_backlash_allowance_referenced_to_span lower_backlash_allowance_referenced_to_span
        radial_clearance radial_bearing_clearance operating_radial_bearing_clearance
        radial_backlash mean_peak_to_valley_roughness_flank_iso_4287_1997
        averaged_peak_to_valley_height_flank arithmetic_mean_roughness_flank_iso_4287_1997
        arithmetic_average_roughness_flank mean_peak_to_valley_roughness_root_iso_4287_1997
        averaged_peak_to_valley_height_root arithmetic_mean_roughness_root_iso_4287_1997
        arithmetic_average_roughness_root""",
    "kW": "power",
    "N / m": """
        radial_stiffness axial_stiffness operating_point_stiffness_f_u_d_u
        operating_point_stiffness_f_v_d_v operating_point_stiffness_f_w_d_w
        operating_point_stiffness_dF_u_d_u operating_point_stiffness_dF_v_d_v
        operating_point_stiffness_dF_w_d_w""",
    "N mm / rad": "bending_stiffness rotational_stiffness",
    "%": "operating_time_fraction load_duration_fraction",
    "h": "operating_time load_duration",
    "kg": "mass_of_component",
    "kg m^2": "moment_of_inertia_u_axis moment_of_inertia_v_axis moment_of_inertia_w_axis",
    "MRev": """
        nominal_rating_life_rotations_iso_281_2007
        nominal_reference_rating_life_rotations_iso_16281_2008
        modified_reference_rating_life_rotations_iso_16281_2008""",
    "MPa": """
        elastic_modulus endurance_limit_flank endurance_limit_root yield_strength
        allowable_stress_number_contact_iso_6336_2016 allowable_stress_number_contact_iso_6336_2003
        nominal_stress_number_tooth_root_iso_6336_2016
        nominal_stress_number_tooth_root_iso_6336_2003""",
    "HV": "surface_hardness_vickers",
    "HRC": "core_hardness_rockwell",
    "mm^2 / s": "viscosity_at_40_degree_celsius viscosity_at_100_degree_celsius",
    "C": "temperature_lubricant",
    "kg / dm^3": "density",
    "m / s^2": "gravitational_acceleration",
}
# units of the attributes that are read or written; files of any version may omit units
SCHEMA_UNITS = {name: unit for unit, names in _ATTRIBUTES_BY_UNIT.items() for name in names.split()}


def from_si(unit: str) -> float:
    """Factor that converts an SI value to a unit of the table."""
    _, times, over = _UNITS[_plain(unit)]
    return over / times


def factor(unit: str, into: str) -> float | None:
    """Factor that converts a value from ``unit`` to ``into``, exactly 1 for equal units. None for
    unknown units and units of different dimension."""
    a, b = _plain(unit), _plain(into)
    if a == b:
        return 1.0
    if a not in _UNITS or b not in _UNITS or _UNITS[a][0] != _UNITS[b][0]:
        return None
    (_, times, over), (_, times_into, over_into) = _UNITS[a], _UNITS[b]
    return times * over_into / (over * times_into)


def without_rounding(value: float) -> float:
    """A converted value to 15 digits: 120 rpm, not 119.99999999999999."""
    return float(f"{value:.15g}")


Word = Literal["left", "right"]
WORDS: tuple[Word, Word] = ("left", "right")
DATUM = "datum_face_orientation"  # whether the datum face is at the +u or −u end of the gear
ORIENTATIONS = {"positive": 1, "negative": -1}
ENDS = ("tip", "root")
FACES = {"datum_face": 1, "non_datum_face": -1}


def tooth_side(word: Word, internal: bool, datum: int) -> int:
    """Side of the tooth of a flank, +1 towards +θ, −1 towards −θ. datum: +1 for a datum face at the
    +z end, else −1."""
    left = -datum if internal else datum
    return left if word == "left" else -left


def word_of(side: int, internal: bool, datum: int) -> Word:
    """The flank, "left" or "right", on a side of the tooth: ``tooth_side`` inverted."""
    return "left" if tooth_side("left", internal, datum) == side else "right"


def outward(datum: int, half: int) -> int:
    """End of the datum face, ±1, on the z axis of modifications.

    In the left half (half = −1) of a double-helical stage, the mirror image of the right half, that
    axis points towards −z, outwards from the middle.
    """
    return -datum if half < 0 else datum


LARGEST = 1e6 * LARGEST_M  # µm, limit of an amount
FORMS = ("linear", "parabolic")
ADDITIVE = ("is_additive_modification", "true")  # modifications of a case are always additive
LOADED = "loaded_tooth_flank"


@dataclass(frozen=True)
class Row:
    """A field of a section of a case and the REXS attribute that holds it.

    suffix: unit of the case's key, "" for a number. names: names of the attribute; the first is
    written, the first that a file has is read. positive: whether only values above 0 are read.
    both: whether all names are written, those of both ends or transverse axes. usual: assumed in a
    file without the attribute.
    """

    field: str
    suffix: str
    names: tuple[str, ...]
    positive: bool = False
    both: bool = False
    usual: float = 0.0

    @property
    def key(self) -> str:
        """The key in case files, field with unit."""
        return f"{self.field}_{self.suffix}" if self.suffix else self.field

    @property
    def unit(self) -> str:
        """Unit of the key as REXS names it."""
        return unit_name(self.suffix) if self.suffix else "none"


def written(section: Section, rows: Iterable[Row], sign: int = 1, at: int = 0) -> dict[str, Any]:
    """REXS attributes (SI), times ``sign``, of the fields of ``rows`` that a section has. at: which
    of the names is written."""
    values = [(row, getattr(section, row.field, None)) for row in rows]
    return {
        name: sign * value
        for row, value in values
        for name in row.names[at : None if row.both else at + 1]
        if value is not None
    }


MATERIAL = (  # usual: steel
    Row("young_modulus", "gpa", ("elastic_modulus",), positive=True, usual=210.0),
    Row("poisson_ratio", "", ("poisson_ratio",), positive=True, usual=0.3),
    Row("density", "kg_per_m3", ("density",), positive=True, usual=7850.0),
)
GEAR_STRENGTH = (  # of the material of a gear
    Row("flank_strength", "mpa", ("allowable_stress_number_contact_iso_6336_2016",
        "allowable_stress_number_contact_iso_6336_2003", "endurance_limit_flank"), positive=True),
    Row("root_strength", "mpa", ("nominal_stress_number_tooth_root_iso_6336_2016",
        "nominal_stress_number_tooth_root_iso_6336_2003", "endurance_limit_root"), positive=True),
    Row("vickers_hardness", "", ("surface_hardness_vickers",), positive=True),
    Row("core_rockwell_hardness", "", ("core_hardness_rockwell",), positive=True),
    Row("yield_strength", "mpa", ("yield_strength",), positive=True),
)  # fmt: skip
STEEL = ("heat_treated_material_type_iso_6336_2019", "heat_treated_material_type_iso_6336_2006")
STEELS = {  # of ISO 6336-5; REXS does not tell through-hardened carbon steel from alloy steel
    "case_hardened": "case_hardened_wrought_steel",
    "induction_hardened": "flame_or_induction_hardened_steel",
    "nitrided": "nitrided_steel",
    "nitrided_through_hardening": "nitrided_through_hardened_steel",
    "nitrocarburised": "nitrocaburized_wrought_steel",
    "through_hardened": "through_hardened_wrought_steel",
}
ROUGHNESS = {  # of a flank or root; R_z takes precedence
    place: (
        Row(f"{place}_rz", "um", (f"mean_peak_to_valley_roughness_{place}_iso_4287_1997",
            f"averaged_peak_to_valley_height_{place}"), positive=True),
        Row(f"{place}_ra", "um", (f"arithmetic_mean_roughness_{place}_iso_4287_1997",
            f"arithmetic_average_roughness_{place}"), positive=True),
    )
    for place in ("flank", "root")
}  # fmt: skip
PITCH_DEVIATION = Row(
    "pitch_deviation", "um", ("single_pitch_deviation", "single_pitch_deviation_iso_1328_2013")
)
ACCURACY = ("global_tolerance_class_iso_1328_2013", "tolerance_class_according_to_iso_1328_2013")
GEAR_SURFACE = (*ROUGHNESS["flank"], *ROUGHNESS["root"], PITCH_DEVIATION)
VISCOSITIES = (
    Row("viscosity_40", "mm2_per_s", ("viscosity_at_40_degree_celsius",), positive=True),
    Row("viscosity_100", "mm2_per_s", ("viscosity_at_100_degree_celsius",), positive=True),
)
OIL = Row("temperature", "c", ("temperature_lubricant",))
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
RADIAL_BEARINGS = (  # types whose rolling elements have no contact angle
    "radial_roller_bearing", "radial_needle_roller_bearing", "radial_grooved_ball_bearing",
)  # fmt: skip
BEARING_ROW = (
    Row("count", "", ("number_of_rolling_elements",), positive=True),
    Row("pitch_diameter", "mm", ("reference_diameter_rolling_bearing", "reference_diameter"),
        positive=True),
)  # fmt: skip
ROLLING_ELEMENT = (
    Row("diameter", "mm", ("diameter_of_rolling_element",), positive=True),
    Row("length", "mm", ("length_of_rolling_element",), positive=True),  # of rollers
)
THRUST = (  # factors of a catalogue; X_1 has to be 1
    Row("e", "", ("catalogue_value_e",), positive=True),
    Row("x", "", ("radial_factor_x_2",)),
    Row("y", "", ("axial_factor_y_2",)),
    Row("y_1", "", ("axial_factor_y_1",)),
)
RADIAL_BELOW_E = "radial_factor_x_1"
_STANDARDS = ("iso_6336_2019", "iso_6336_2006", "din_3990_1987")
APPLICATION_FACTOR, *LOAD_FACTORS = (  # of gear meshes; old files have names without a standard
    Row(field, "", (*(f"{n}_{s}" for n in names for s in _STANDARDS), *names), positive=True)
    for field, *names in (
        ("application_factor", "application_factor"),
        ("k_gamma", "mesh_load_factor"),
        ("k_v", "dynamic_factor"),
        ("k_h_beta", "face_load_factor_contact_stress", "face_load_factor_flank"),
        ("k_f_beta", "face_load_factor_root_stress", "face_load_factor_root"),
        ("k_h_alpha", "transverse_load_factor_contact_stress", "transverse_load_factor_flank",
         "transverse_load_factor"),
        ("k_f_alpha", "transverse_load_factor_root_stress"),
    )
)  # fmt: skip
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
PORT_BODY = (  # behind the spline of a sun's shaft
    INERTIA,
    Row("mass", "kg", ("mass_of_component",)),
    Row("tilt_inertia", "kg_m2", ("moment_of_inertia_v_axis", "moment_of_inertia_w_axis"),
        both=True),
)  # fmt: skip
SHAFT_SECTION = (  # a cylinder
    Row("length", "mm", ("length",)),
    Row("outer_diameter", "mm", ("outer_diameter_begin", "outer_diameter_end"), both=True),
    Row("inner_diameter", "mm", ("inner_diameter_begin", "inner_diameter_end"), both=True),
)
AXES = ("v", "w", "u")  # x, y, z of a case
FORCES = tuple(f"force_{axis}_direction" for axis in AXES)
MOMENTS = tuple(f"torque_around_{axis}_axis" for axis in AXES[:2])
GRAVITY = tuple(f"direction_vector_gravity_{axis}" for axis in AXES)


@dataclass(frozen=True)
class Modification:
    """A REXS component that modifies a flank.

    sizes: rows of its lengths; of two rows for the same field the mean is read. section: section of
    a case's modifications with these fields, "" for the flank's section. words: attributes with the
    only meaning that a case knows. by_face: whether the sign depends on the datum face. face: 1 for
    a modification at the datum face, −1 at the non-datum face, 0 for others. positive: meaning of
    positive values.
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
            tuple(
                Row(key, unit, (f"{kind}_{name}",), positive=True)
                for key, (unit, name) in _RELIEF.items()
            ),
            section=kind,
        )
        for kind in ("tip_relief", "root_relief")
    },
    **{
        f"end_relief_{face}": Modification(
            (
                Row("amount", "um", (f"end_relief_depth_{face}",), positive=True),
                Row("length", "mm", (f"end_relief_length_{face}",), positive=True),
            ),
            section="end_relief",
            face=side,
        )
        for face, side in FACES.items()
    },
}
KEYS = {m.section or row.field for m in MODIFICATIONS.values() for row in m.sizes}
