"""What the public REXS schema 2.0 says of the components that are exported: attributes with units,
roles of relations. Facts of the schema (rexs.info, FVA), for checking what is written."""

ATTRIBUTES = {
    "additional_mass": {
        "moment_of_inertia_u_axis": "kg m^2",
        "u_coordinate_on_shaft": "mm",
    },
    "concept_bearing": {
        "axial_stiffness": "N / m",
        "bending_stiffness": "N mm / rad",
        "radial_clearance": "mum",
        "radial_stiffness": "N / m",
        "support_vector": "mm",
        "u_axis_vector": "mm",
        "w_axis_vector": "mm",
    },
    "coupling": {
        "axial_stiffness": "N / m",
        "bending_stiffness": "N mm / rad",
        "radial_stiffness": "N / m",
        "rotational_stiffness": "N mm / rad",
        "support_vector": "mm",
        "u_axis_vector": "mm",
        "w_axis_vector": "mm",
    },
    "cylindrical_gear": {
        "base_diameter": "mm",
        "datum_face_orientation": "none",
        "face_width": "mm",
        "helix_angle_reference_diameter": "deg",
        "inner_diameter": "mm",
        "mass_of_component": "kg",
        "normal_module": "mm",
        "number_of_teeth": "none",
        "reference_diameter_cylindrical_gear": "mm",
        "root_diameter": "mm",
        "rotational_speed": "1 / min",
        "support_vector": "mm",
        "tip_diameter": "mm",
        "u_axis_vector": "mm",
        "u_coordinate_on_shaft": "mm",
        "w_axis_vector": "mm",
    },
    "cylindrical_gear_flank": {
        "addendum_modification_coefficient": "none",
        "normal_pressure_angle": "deg",
    },
    "cylindrical_gear_manufacturing_settings": {},
    "cylindrical_stage": {
        "center_distance": "mm",
        "common_face_width": "mm",
        "maximum_normal_backlash": "mm",
        "minimum_normal_backlash": "mm",
        "nominal_tangential_force_at_base_diameter": "N",
        "overlap_contact_ratio": "none",
        "radial_contact_ratio": "none",
        "total_contact_ratio": "none",
    },
    "cylindrical_stage_gear_data": {
        "loaded_tooth_flank": "none",
        "operating_pressure_angle_in_the_transverse_section": "deg",
    },
    "external_load": {
        "defines_torque": "none",
        "power": "kW",
        "torque_around_u_axis": "N m",
        "transmits_torque": "none",
        "u_coordinate_on_shaft": "mm",
    },
    "gear_body": {
        "gear_body_rim_thickness": "mm",
    },
    "gear_casing": {},
    "gear_unit": {
        "account_for_gravity": "none",
        "direction_vector_gravity_u": "none",
        "direction_vector_gravity_v": "none",
        "direction_vector_gravity_w": "none",
        "gravitational_acceleration": "m / s^2",
        "support_vector": "mm",
        "u_axis_vector": "mm",
        "w_axis_vector": "mm",
    },
    "material": {
        "density": "kg / dm^3",
        "elastic_modulus": "MPa",
        "poisson_ratio": "none",
    },
    "planet_carrier": {
        "mass_of_component": "kg",
    },
    "planetary_stage": {},
    "rack_shaped_tool": {
        "addendum_coefficient_reference_profile": "none",
        "tip_corner_radius_factor_reference_profile": "none",
    },
    "ring_gear": {
        "base_diameter": "mm",
        "datum_face_orientation": "none",
        "face_width": "mm",
        "helix_angle_reference_diameter": "deg",
        "mass_of_component": "kg",
        "normal_module": "mm",
        "number_of_teeth": "none",
        "reference_diameter_cylindrical_gear": "mm",
        "root_diameter": "mm",
        "rotational_speed": "1 / min",
        "support_vector": "mm",
        "tip_diameter": "mm",
        "u_axis_vector": "mm",
        "u_coordinate_on_shaft": "mm",
        "w_axis_vector": "mm",
    },
    "rolling_bearing_with_catalog_geometry": {
        "axial_stiffness": "N / m",
        "bearing_type": "none",
        "bending_stiffness": "N mm / rad",
        "radial_bearing_clearance": "mum",
        "radial_dynamic_load_rating": "kN",
        "radial_stiffness": "N / m",
        "support_vector": "mm",
        "u_axis_vector": "mm",
        "w_axis_vector": "mm",
    },
    "shaft": {
        "defines_speed": "none",
        "rotational_speed": "1 / min",
        "support_vector": "mm",
        "u_axis_vector": "mm",
        "w_axis_vector": "mm",
    },
    "end_relief_datum_face": {
        "end_relief_depth_datum_face": "mm",
        "end_relief_length_datum_face": "mm",
        "shape_of_relief": "none",
    },
    "end_relief_non_datum_face": {
        "end_relief_depth_non_datum_face": "mm",
        "end_relief_length_non_datum_face": "mm",
        "shape_of_relief": "none",
    },
    "helix_crowning": {
        "helix_crowning_amount_datum_face": "mm",
        "helix_crowning_amount_non_datum_face": "mm",
        "shape_of_helix_crowning": "none",
    },
    "helix_slope": {
        "helix_evaluation_reference": "none",
        "helix_slope": "mm",
    },
    "profile_slope": {
        "profile_slope": "mm",
    },
    "profile_twist": {
        "profile_twist": "mm",
    },
    "profile_crowning": {
        "profile_crowning_at_root": "mm",
        "profile_crowning_at_tip": "mm",
        "shape_of_profile_crowning": "none",
    },
    "root_relief": {
        "root_relief_datum_diameter": "mm",
        "root_relief_datum_length": "mm",
        "root_relief_depth": "mm",
        "shape_of_relief": "none",
    },
    "tip_relief": {
        "shape_of_relief": "none",
        "tip_relief_datum_length": "mm",
        "tip_relief_depth": "mm",
    },
}
RELATIONS = {
    ("assembly", frozenset([("assembly", "gear_unit"), ("part", "cylindrical_stage")])),
    ("assembly", frozenset([("assembly", "gear_unit"), ("part", "gear_casing")])),
    ("assembly", frozenset([("assembly", "gear_unit"), ("part", "planetary_stage")])),
    ("assembly", frozenset([("assembly", "gear_unit"), ("part", "shaft")])),
    ("assembly", frozenset([("assembly", "planet_carrier"), ("part", "shaft")])),
    ("assembly", frozenset([("assembly", "planetary_stage"), ("part", "cylindrical_stage")])),
    ("assembly", frozenset([("assembly", "planetary_stage"), ("part", "planet_carrier")])),
    ("assembly", frozenset([("assembly", "ring_gear"), ("part", "gear_body")])),
    ("assembly", frozenset([("assembly", "shaft"), ("part", "additional_mass")])),
    ("assembly", frozenset([("assembly", "shaft"), ("part", "cylindrical_gear")])),
    ("assembly", frozenset([("assembly", "shaft"), ("part", "external_load")])),
    ("assembly", frozenset([("assembly", "shaft"), ("part", "ring_gear")])),
    ("central_shaft", frozenset([("planetary_stage", "planetary_stage"), ("shaft", "shaft")])),
    (
        "flank",
        frozenset(
            [
                ("gear", "cylindrical_gear"),
                ("left", "cylindrical_gear_flank"),
                ("right", "cylindrical_gear_flank"),
            ]
        ),
    ),
    (
        "flank",
        frozenset(
            [
                ("gear", "ring_gear"),
                ("left", "cylindrical_gear_flank"),
                ("right", "cylindrical_gear_flank"),
            ]
        ),
    ),
    (
        "manufacturing_step",
        frozenset(
            [
                ("manufacturing_settings", "cylindrical_gear_manufacturing_settings"),
                ("tool", "rack_shaped_tool"),
                ("workpiece", "cylindrical_gear_flank"),
            ]
        ),
    ),
    (
        "planet_carrier_shaft",
        frozenset([("planetary_stage", "planetary_stage"), ("shaft", "shaft")]),
    ),
    ("planet_pin", frozenset([("planetary_stage", "planetary_stage"), ("shaft", "shaft")])),
    ("planet_shaft", frozenset([("planetary_stage", "planetary_stage"), ("shaft", "shaft")])),
    ("reference", frozenset([("origin", "cylindrical_gear"), ("referenced", "material")])),
    *(
        ("reference", frozenset([("origin", "cylindrical_gear_flank"), ("referenced", kind)]))
        for kind in (
            "end_relief_datum_face",
            "end_relief_non_datum_face",
            "helix_crowning",
            "helix_slope",
            "profile_crowning",
            "profile_slope",
            "profile_twist",
            "root_relief",
            "tip_relief",
        )
    ),
    ("reference", frozenset([("origin", "ring_gear"), ("referenced", "material")])),
    (
        "side",
        frozenset(
            [
                ("assembly", "concept_bearing"),
                ("inner_part", "shaft"),
                ("outer_part", "gear_casing"),
            ]
        ),
    ),
    (
        "side",
        frozenset(
            [("assembly", "concept_bearing"), ("inner_part", "shaft"), ("outer_part", "shaft")]
        ),
    ),
    (
        "side",
        frozenset(
            [("assembly", "coupling"), ("inner_part", "shaft"), ("outer_part", "gear_casing")]
        ),
    ),
    (
        "side",
        frozenset([("assembly", "coupling"), ("inner_part", "shaft"), ("outer_part", "shaft")]),
    ),
    (
        "side",
        frozenset(
            [
                ("assembly", "rolling_bearing_with_catalog_geometry"),
                ("inner_part", "shaft"),
                ("outer_part", "shaft"),
            ]
        ),
    ),
    (
        "stage",
        frozenset(
            [
                ("gear_1", "cylindrical_gear"),
                ("gear_2", "cylindrical_gear"),
                ("stage", "cylindrical_stage"),
            ]
        ),
    ),
    (
        "stage",
        frozenset(
            [
                ("gear_1", "ring_gear"),
                ("gear_2", "cylindrical_gear"),
                ("stage", "cylindrical_stage"),
            ]
        ),
    ),
    (
        "stage_gear_data",
        frozenset(
            [
                ("gear", "cylindrical_gear"),
                ("stage", "cylindrical_stage"),
                ("stage_gear_data", "cylindrical_stage_gear_data"),
            ]
        ),
    ),
    (
        "stage_gear_data",
        frozenset(
            [
                ("gear", "ring_gear"),
                ("stage", "cylindrical_stage"),
                ("stage_gear_data", "cylindrical_stage_gear_data"),
            ]
        ),
    ),
}
