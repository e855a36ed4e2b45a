"""Cases with all data for the rating of gears, as TOML text, and shortcuts to their ratings."""

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.rating.pair import gear_pair, pair_load
from flexgear.model.load import load_case

HEAD = """
[material]
young_modulus_gpa = 206
poisson_ratio = 0.3
density_kg_per_m3 = 7830

[lubricant]
viscosity_40_mm2_per_s = 150

[rating]
edition = 2006
"""

PAIR = (
    HEAD
    + """
[stage]
name = "pair"
kind = "parallel"
normal_module_mm = 5
pressure_angle_deg = 20
helix_angle_deg = 8
planet_hand = "right"
face_width_mm = 45

[stage.pinion]
teeth = 21
profile_shift = 0.3
support = { radial_n_per_m = 1e9 }
[stage.pinion.rating]
steel = "case_hardened"
grade = "MQ"
flank_rz_um = 4
root_rz_um = 16
accuracy_grade = 6

[stage.gear]
teeth = 67
profile_shift = -0.1
bore_diameter_mm = 80
support = { radial_n_per_m = 1e9 }
[stage.gear.rating]
steel = "through_hardened"
grade = "MQ"
vickers_hardness = 280
yield_strength_mpa = 700
flank_rz_um = 8
root_rz_um = 20
accuracy_grade = 7

[[inputs]]
member = "pair.pinion"
speed_rpm = 1200
torque_nm = 800

[output]
member = "pair.gear"
"""
)

GEAR = """
[stage.{}]
teeth = {}
{}
[stage.{}.rating]
steel = "case_hardened"
grade = "MQ"
flank_rz_um = 4
root_rz_um = 16
accuracy_grade = 5
"""
PLANETARY = (
    HEAD
    + """
[stage]
planets = 3
normal_module_mm = 4
pressure_angle_deg = 20
face_width_mm = 60
"""
    + GEAR.format("sun", 24, "profile_shift = 0.2\nbore_diameter_mm = 30", "sun")
    + GEAR.format("planet", 36, "profile_shift = -0.2\nbore_diameter_mm = 90", "planet")
    + GEAR.format(
        "ring", 96, 'profile_shift = 0.2\nrim_thickness_mm = 12\nkinematics = "fixed"', "ring"
    )
    + """
[stage.carrier]
[stage.planet_bearing]
radial_n_per_m = 1e8

[[inputs]]
member = "stage.carrier"
speed_rpm = 60
torque_nm = 9e3

[output]
member = "stage.sun"
"""
)


def case_of(folder, text, **changes):
    """The case of a text, with values changed (SI)."""
    path = folder / "rated.toml"
    path.write_text(text, encoding="utf-8")
    case = load_case(path)
    return case.with_(**changes) if changes else case


def pair_of(case, role="sun"):
    """Gear mesh of the case's only stage, and its load in the mean power flow."""
    view = case.view()
    pair = gear_pair(view, stage_geometry(view), role)
    return pair, pair_load(pair, power_flow(case).stages[0])
