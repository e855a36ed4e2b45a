"""Bearings of shafts with several gears, of carriers and of bodies behind shafts, by statics."""

import math

import pytest
from pinion_on_bearings import (
    HELIX,
    MODULE,
    TEETH,
    TORQUE,
    A,
    B,
    life,
    table,
    text,
)
from trains import STAGE, write

from flexgear.model.errors import InputError
from flexgear.model.load import load_case


def test_bearings_of_a_shaft_with_two_gears_carry_both(flexgear, tmp_path):
    """A spur pinion above the gear on the same shaft, as the joint's second member and without
    bearings of its own, by statics; check computes every gear alone, so it has no loads there."""
    case = text().replace('member = "stage_1.gear"', 'member = "stage_2.gear"')
    case += """
[[stages]]
kind = "parallel"
normal_module_mm = 5
pressure_angle_deg = 20
face_width_mm = 60
pinion = { teeth = 20 }
gear = { teeth = 60, support = { radial_n_per_m = 1e9 } }
[stages.gear_mesh]
model = "constant"
[[joints]]
first = "stage_1.gear"
second = "stage_2.pinion"
length_mm = 70
outer_diameter_mm = 60
"""
    path, torque = write(tmp_path, case), TORQUE * TEETH["gear"] / TEETH["pinion"]
    helix, tangent = math.radians(HELIX), math.tan(math.radians(20))
    radii = {part: 5e-4 * MODULE * z / math.cos(helix) for part, z in TEETH.items()}
    first, second = TORQUE / radii["pinion"], torque / 0.05
    along, span = first * math.tan(helix) * radii["gear"], A["gear"] + B["gear"]
    x, y = first * tangent / math.cos(helix), -second * tangent
    far_y = (A["gear"] * first + (A["gear"] + 0.07) * second) / span
    far_x = (A["gear"] * x + (A["gear"] + 0.07) * y + along) / span
    loads = math.hypot(x + y - far_x, first + second - far_y), math.hypot(far_x, far_y)
    static = flexgear.json("static", path)["0 deg"]["bearing"]
    running = flexgear.json("check", path)["stage_1 running"]
    for k, load in enumerate(loads, 1):
        name = f"gear_support_{k}"
        assert static[f"stage_1.{name}"]["force_n"] == pytest.approx(load, rel=1e-4)
        assert f"{name}_radial_force_n" not in running
    assert "flexgear static" in running["bearings_of_the_gear"]
    assert "pinion_support_1_radial_force_n" in running


@pytest.mark.parametrize("tilt", ["2e5", "0"])
def test_both_bearings_of_a_carrier_carry_its_whole_moment(flexgear, tmp_path, tilt):
    """M over their distance; none passes through planets and their bearings to the housing."""
    at = "z_mm = {}, radial_n_per_m = 5e8, axial_n_per_m = 1e8"
    supports_text = ", ".join(f"{{ {at.format(z)} }}" for z in (-60, 60))
    text = STAGE.format(planets=3, helix=0, sun="1e8")
    text = text.replace("support = { radial_n_per_m = 1e9 }", f"support = [{supports_text}]")
    bearing = f"radial_n_per_m = 5e8\naxial_n_per_m = 1e8\ntilt_nm_per_rad = {tilt}"
    text = text.replace("radial_n_per_m = 5e8\n[stage.gear_mesh]", f"{bearing}\n[stage.gear_mesh]")
    text += "[[loads]]\nmember = 'stage.carrier'\nmoment_nm = [1000, 0, 0]\n"
    bearings = flexgear.json("static", write(tmp_path, text))["0 deg"]["bearing"]
    for k in (1, 2):
        load = bearings[f"stage.carrier_support_{k}"]["force_n"]
        assert load == pytest.approx(1000 / 0.12, rel=1e-6)


def test_a_joint_takes_no_thrust_to_the_housing(flexgear):
    """The gear's bearing has the whole thrust, T tan β/r, beside a spline to a sun that floats."""
    plain = ["nrel-5mw", "--set", "kinematics="]
    torque = flexgear.json("check", *plain)["torques_on_the_stages_nm"]["stage_3.gear"]
    stage = load_case("nrel-5mw").stage("stage_3")
    radius = 0.5 * stage.gear.teeth * stage.normal_module / math.cos(stage.helix_angle)
    thrust = abs(torque) * math.tan(stage.helix_angle) / radius
    bearing = flexgear.json("static", *plain)["0 deg"]["bearing"]["stage_3.gear_support_2"]
    assert bearing["axial_n"] == pytest.approx(thrust, rel=1e-3)


def test_a_shaft_on_several_bearings_can_tilt(tmp_path):
    path = write(tmp_path, text())
    assert load_case(path).kinematics_of("stage_1.pinion") == "spatial"
    with pytest.raises(InputError, match=r"pinion.kinematics: 'axial' does not tilt"):
        load_case(path, {"stages.stage_1.pinion.kinematics": "axial"})


def planetary_text(support):
    """A stage of ``trains`` whose carrier stands on these supports."""
    plain = STAGE.format(planets=3, helix=0, sun="1e6")
    before, after = plain.split("[stage.planet_bearing]")
    before = before.removesuffix("support = { radial_n_per_m = 1e9 }\n")
    return f"{before}support = {support}\n[stage.planet_bearing]{after}"


ROTOR = """
[[loads]]
member = "stage.carrier"
force_n = [0, -9000, 4000]
moment_nm = [1200, 0, 0]
"""


def test_a_carrier_on_two_bearings_carries_what_hangs_on_it(flexgear, tmp_path):
    """Weight of a rotor and its moment about x: with springs at a = −0.1 m and b = 0.4 m, and z of
    the load 0, moments about x at a give b's force along y. Planets between ring and a soft sun
    take less than a hundredth of it."""
    table_a = "{ z_mm = -100, radial_n_per_m = 1e9 }"
    rated = 'dynamic_rating_kn = 200, static_rating_kn = 300, rolling = "roller"'
    table_b = f"{{ z_mm = 400, radial_n_per_m = 4e8, axial_n_per_m = 5e8, {rated} }}"
    text = planetary_text(f"[{table_a}, {table_b}]")
    bearings = flexgear.json("static", write(tmp_path, text + ROTOR))["0 deg"]["bearing"]
    # about x at a: 0.1 * 9000 + 1200 = 0.5 f_b, f_b what the shaft gives the bearing along −y
    far = (0.1 * 9000 + 1200) / 0.5
    near = 9000 - far
    first, second = (bearings[f"stage.carrier_support_{k}"] for k in (1, 2))
    assert first["force_n"] == pytest.approx(abs(near), rel=0.01)
    assert second["force_n"] == pytest.approx(abs(far), rel=0.01)
    assert abs(second["axial_n"]) == pytest.approx(4000, rel=1e-6)
    assert "life_h" not in first
    assert second["life_h"] == pytest.approx(life(far, 100, rating=200e3), rel=0.03)


def test_a_shaft_bends_between_its_bearings(flexgear, tmp_path):
    """A sun of 100 N hangs over by a = 0.1 m, bearings are L = 0.2 m apart on its shaft: they carry
    F (L + a)/L and F a/L, and the sun moves by δ = F a² (L + a)/(3 E I); its teeth are soft."""
    shaft = """[stage.sun.shaft]
direction = "+z"
elements_per_section = 3
sections = [{ length_mm = 300, outer_diameter_mm = 20 }]
spline = { torsion_nm_per_rad = 1e6 }
[stage.planet]"""
    near, far = ({"z_mm": z, "radial_n_per_m": 1e11} for z in (100, 300))
    text = STAGE.format(planets=3, helix=0, sun="1e6").replace(
        "support = { radial_n_per_m = 1e6 }", f"support = [{table(near)}, {table(far)}]"
    )
    text = text.replace("[stage.planet]", shaft)
    text += """mass_kg = 1
tilt_inertia_kg_m2 = 1
bearing = { radial_n_per_m = 1e9, axial_n_per_m = 1e9, tilt_nm_per_rad = 1e6 }
"""
    weight = {"gravity_m_per_s2": "[1, 0, 0]", "stage.sun.mass_kg": "100"}  # beside 0.05 kg of it
    keys = weight | {"material.density_kg_per_m3": "500"}
    keys |= {"stage.sun.support.0.axial_n_per_m": "1e8", "inputs.0.torque_nm": "1e-6"}
    keys |= {f"stage.gear_mesh.{gear}_stiffness_n_per_m": "1e4" for gear in ("sun", "ring")}
    keys |= {
        "stage.planet_bearing.axial_n_per_m": "1e8",
        "stage.planet_bearing.tilt_nm_per_rad": "1e6",
    }
    keys |= {
        f"stage.{part}.support.{key}": value
        for part in ("ring", "carrier")
        for key, value in (("axial_n_per_m", "1e9"), ("tilt_nm_per_rad", "1e8"))
    }
    options = [word for key, value in keys.items() for word in ("--set", f"{key}={value}")]
    figures = flexgear.json("static", write(tmp_path, text), *options)["0 deg"]
    bearings = figures["bearing"]
    assert bearings["stage.sun_support_1"]["force_n"] == pytest.approx(150, rel=1e-2)
    assert bearings["stage.sun_support_2"]["force_n"] == pytest.approx(50, rel=1e-2)
    bending = 210e9 * math.pi * 0.02**4 / 64
    deflection = 1e6 * 100 * 0.1**2 * 0.3 / (3 * bending)
    assert figures["distance_from_axis_um"]["stage.sun"] == pytest.approx(deflection, rel=0.03)


def test_hub_and_body_behind_a_shaft_have_lives(flexgear):
    keys = []
    for bearing, rolling in (("stage.ring.hub.bearing", "roller"), ("inputs.0.bearing", "ball")):
        rated = {"dynamic_rating_kn": 5, "rolling": rolling, "count": 2}
        keys += [word for k, x in rated.items() for word in ("--set", f"{bearing}.{k}={x}")]
    speeds = flexgear.json("check", "star-ring", *keys)["speeds_rpm"]
    bearings = flexgear.json("static", "star-ring", "--rigid", "ring", *keys)["0 deg"]["bearing"]
    for name, member, exponent in (("hub", "ring", 10 / 3), ("output", "sun", 3)):
        load, speed = bearings[f"stage.{name}"]["force_n"], abs(speeds[f"stage.{member}"])
        hours = life(load / 2, speed, exponent, 5e3)
        assert load > 0.0
        assert bearings[f"stage.{name}"]["life_h"] == pytest.approx(hours, rel=1e-9)
