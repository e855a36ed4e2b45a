"""REXS files become cases: closed forms of geometry, springs, speeds; nothing is lost unseen."""

import math
import re
import time

import pytest
from rexs_samples import (
    ARM,
    DEG,
    HELIX,
    MM,
    planetary,
    three_stages,
)

import flexgear as fg
from flexgear.files.rexs.reading import VERSIONS, read_rexs
from flexgear.files.rexs.to_case import case_of_document
from flexgear.gears.power_flow import power_flow
from flexgear.gears.radii import stage_radii
from flexgear.gears.tooth import involute, tooth_geometry, transverse_angle

TURNS = 60 / (2 * math.pi)
STRENGTHS = {  # names of σ_Hlim, σ_Flim, R_z of the flank, class of ISO 1328 in two versions
    "1.3": ("endurance_limit_flank", "endurance_limit_root",
            "averaged_peak_to_valley_height_flank", "tolerance_class_according_to_iso_1328_2013"),
    "2.0": ("allowable_stress_number_contact_iso_6336_2016",
            "nominal_stress_number_tooth_root_iso_6336_2016",
            "mean_peak_to_valley_roughness_flank_iso_4287_1997",
            "global_tolerance_class_iso_1328_2013"),
}  # fmt: skip


def test_planetary_stage(imported):
    case, conversion = imported(planetary())
    stage = case.stages[0]
    assert (stage.name, stage.planets, stage.sun.teeth, stage.ring.teeth) == ("low", 3, 20, 70)
    assert stage.planet_hand == "right" and stage.helix_angle == pytest.approx(math.radians(HELIX))
    assert stage.center_distance == pytest.approx(1e-3 * ARM / math.cos(stage.helix_angle))
    assert case.held_members() == ("low.ring",) and stage.planet_positions is None
    flow = power_flow(case)
    assert flow.speed["low.sun"] * TURNS == pytest.approx(12 * (1 + 70 / 20))
    assert flow.torque["low.sun"] == pytest.approx(-3000 / (1 + 70 / 20))
    assert case.material.young_modulus == pytest.approx(206e9)
    assert not any("lost" in line for line in conversion.left_out)


@pytest.mark.parametrize("of_parts", [False, True])
@pytest.mark.parametrize("of_frame", [None, 90.0])
def test_carrier_of_side_plates_and_pins(imported, of_frame, of_parts):
    """Two plates about the carrier's axis, pins at the centre distance from it. A mass in the file
    replaces that of the material; the mass of the frame is that of the whole carrier."""
    m = planetary()
    stated = {"mass_of_component": (7.0, "kg")} if of_parts else {}
    for _ in range(2):
        m.part(m.carrier, "side_plate", outer_diameter=(260.0, MM), inner_diameter=(60.0, MM),
               length=(25.0, MM), **stated)  # fmt: skip
    pins = [roles["shaft"] for kind, roles in m.relations if kind == "planet_pin"]
    for pin in pins:
        m.part(pin, "shaft_section", u_coordinate_on_shaft=(0.0, MM), length=(110.0, MM),
               outer_diameter_begin=(40.0, MM))  # fmt: skip
        m.set(pin, **stated)
    if of_frame:
        m.set(m.carrier, mass_of_component=(of_frame, "kg"))
    plate = 7800 * math.pi / 4 * (0.26**2 - 0.06**2) * 0.025
    pin = 7800 * math.pi / 4 * 0.04**2 * 0.11
    plate, pin = (7.0, 7.0) if of_parts else (plate, pin)
    arm = 1e-3 * ARM / math.cos(math.radians(HELIX))
    mass = 2 * plate + 3 * pin
    inertia = 2 * plate * (0.26**2 + 0.06**2) / 8 + 3 * pin * (arm**2 + 0.04**2 / 8)
    carrier = imported(m)[0].stages[0].carrier
    assert carrier.mass == pytest.approx(of_frame or mass)
    assert carrier.inertia == pytest.approx(inertia * (of_frame or mass) / mass)


def test_a_train_of_three_stages(imported):
    """Speeds by tooth numbers; the shaft between sun and wheel is that of the file, with torsion
    G J / L under the torque of the sun."""
    case, _ = imported(three_stages())
    flow = power_flow(case)
    sun = 12 * (1 + 70 / 20)
    assert flow.speed["stage_3.pinion"] * TURNS == pytest.approx(sun * 78 / 30 * 62 / 26)
    assert case.output.member == "stage_3.pinion"
    turned = fg.Case.of(case).assemble().static()["body_displacement"].squeeze().sel(dof="rz")
    sun, wheel = (float(turned.sel(body=body)) for body in ("stage_1.sun", "stage_2.gear"))
    shear = 206e9 / (2 * 1.29)
    polar = math.pi / 32 * (0.08**4 - 0.02**4)
    twist = 3000 / (1 + 70 / 20) * 0.25 / (shear * polar)
    assert sun - wheel == pytest.approx(twist, rel=0.01)  # and joints of 10 E b r², 0.5 %
    hands = [stage.planet_hand for stage in case.stages[1:]]
    assert hands == ["left", "right"]
    for end in ("begin", "end"):  # a missing diameter is that of the other end
        m = three_stages()
        m.set(m.section, **{f"{name}_diameter_{end}": None for name in ("outer", "inner")})
        assert imported(m)[0].content_hash() == case.content_hash()


@pytest.mark.parametrize(
    ("version", "suffix"), [(v, ".rexs") for v in VERSIONS] + [("2.0", ".rexsj"), ("2.0", ".rexsz")]
)
def test_versions_and_forms_say_the_same(imported, version, suffix):
    expected, text = imported(three_stages())
    case, other = imported(three_stages(version), suffix)
    assert case.content_hash() == expected.content_hash()
    assert (other.left_out, other.assumed) == (text.left_out, text.assumed) or version != "2.0"


def test_units_of_the_file_count(imported):
    """Another unit with the number that belongs to it is the same; so is none at all."""
    expected, _ = imported(planetary())
    m = planetary()
    for number in m.of("cylindrical_gear") + m.of("ring_gear"):
        m.set(number, face_width=(0.06, "m"), normal_module=(4.0, ""))
    m.set(m.drive, rotational_speed=(12 * 2 * math.pi / 60, "rad / s"))
    m.set(m.fixed, rotational_stiffness=(5e5, "kN m / rad"), radial_stiffness=(4e3, "N / µm"))
    m.set(m.steel, density=(7.8, "g / cm^3"))
    m.set(m.load, torque_around_u_axis=None, power=(3000 * 12 / TURNS * 1e-3, "kW"))
    case, _ = imported(m)
    assert case.stages[0].face_width == pytest.approx(expected.stages[0].face_width, rel=1e-12)
    assert case.stages[0].ring.support == expected.stages[0].ring.support
    assert case.material == expected.material
    a, b = power_flow(case), power_flow(expected)
    assert a.speed == pytest.approx(b.speed, rel=1e-12)
    assert a.torque == pytest.approx(b.torque, rel=1e-12)


def test_axis_that_points_the_other_way_turns_signs(imported):
    m = planetary()
    m.set(m.drive, u_axis_vector=((-1.0, 0.0, 0.0), MM))
    flow = power_flow(imported(m)[0])
    assert flow.speed["low.carrier"] * TURNS == pytest.approx(-12)
    assert flow.torque["low.carrier"] == pytest.approx(-3000)


@pytest.mark.parametrize("sign", [1, -1])
def test_diameters_become_coefficients(imported, sign):
    """Tip and root circles of the case are those of the file, with profile shift, on every gear;
    those of the ring may have a minus sign."""
    m = planetary()
    shifts = {m.sun: 0.3, m.ring: 0.3, **dict.fromkeys(m.planets, -0.3)}
    tips = {m.sun: 91.9, m.ring: 276.1, **dict.fromkeys(m.planets, 106.9)}
    roots = {m.sun: 74.0, m.ring: 294.0, **dict.fromkeys(m.planets, 89.0)}
    for number, x in shifts.items():
        side = sign if number == m.ring else 1
        m.set(number, tip_diameter=(side * tips[number], MM),
              root_diameter=(side * roots[number], MM))  # fmt: skip
        m.shift(number, x)
    stage = imported(m)[0].stages[0]
    for name, number in (("sun", m.sun), ("planet", m.planets[0]), ("ring", m.ring)):
        tooth = tooth_geometry(stage.member(name), stage, internal=name == "ring")
        assert 2e3 * tooth.tip_radius == pytest.approx(tips[number], rel=1e-12)
        assert 2e3 * tooth.root_radius == pytest.approx(roots[number], rel=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_ring_shift_of_either_sign_convention(imported, sign):
    """Programs differ in the sign of a ring's profile shift; the centre distance decides."""
    m = planetary()
    beta, alpha = math.radians(HELIX), math.radians(20)
    at_ = math.atan(math.tan(alpha) / math.cos(beta))
    distance = ARM / math.cos(beta) + 0.8
    working = math.acos(ARM * math.cos(at_) / math.cos(beta) / distance)
    total = 45 * (involute(working) - involute(at_)) / (2 * math.tan(alpha))
    m.shift(m.sun, total - 0.1)
    m.shift(m.ring, -sign * (total + 0.1))
    for planet in m.planets:
        m.shift(planet, 0.1)
    for number in m.of("cylindrical_stage"):
        m.set(number, center_distance=(distance, MM))
    case, conversion = imported(m)
    assert case.stages[0].ring.profile_shift == pytest.approx(-(total + 0.1), rel=1e-12)
    assert ("sign changed" in conversion.text) == (sign == -1)
    radii = stage_radii(case.view("low"))
    assert radii.center_distance == pytest.approx(1e-3 * distance, rel=1e-12)


def test_missing_shift_follows_from_the_centre_distance(imported):
    m = planetary()
    for number in m.of("cylindrical_stage"):
        m.set(number, center_distance=(ARM / math.cos(math.radians(HELIX)) + 0.5, MM))
    for number in m.of("cylindrical_gear_flank"):
        m.set(number, addendum_modification_coefficient=None)
    case, conversion = imported(m)
    stage = case.stages[0]
    working = stage_radii(case.view("low")).working_angles["sun"]
    total = 45 * (involute(working) - involute(transverse_angle(stage)))
    total /= 2 * math.tan(stage.pressure_angle)
    assert stage.sun.profile_shift + stage.planet.profile_shift == pytest.approx(total)
    assert stage.planet.profile_shift + stage.ring.profile_shift == pytest.approx(-total)
    assert sum("profile_shift" in line for line in conversion.assumed) == 3


def test_tip_relief_by_diameter(imported):
    """Relief from a diameter takes the difference of the roll lengths; other shapes are said."""
    m = planetary()
    m.set(m.sun, tip_diameter=(89.0, MM))
    for flank in m.flanks(m.sun):
        relief = m.add("tip_relief", tip_relief_depth=(30.0, "mum"),
                       tip_relief_datum_diameter=(86.0, MM),
                       shape_of_relief=("linear", ""))  # fmt: skip
        m.relate("reference", origin=flank, referenced=relief)
    stage = imported(m)[0].stages[0]
    base = 2 * tooth_geometry(stage.sun, stage).base_radius
    length = (math.sqrt(0.089**2 - base**2) - math.sqrt(0.086**2 - base**2)) / 2
    assert stage.sun.modifications.tip_relief.amount == pytest.approx(30e-6)
    assert stage.sun.modifications.tip_relief.length == pytest.approx(length)
    assert stage.sun.modifications.tip_relief.form == "linear"


def test_double_helical(imported):
    m = planetary()
    gears = [(m.sun, -1), (m.ring, 1), *((p, 1) for p in m.planets)]
    shaft_of = {r["part"]: r["assembly"] for k, r in m.relations if k == "assembly"}
    mates = [(r["gear_1"], r["gear_2"]) for k, r in m.relations if k == "stage"]
    twins = {}
    for number, _ in gears:
        kind, name, attributes = m.components[number]
        helix = -attributes["helix_angle_reference_diameter"][0]
        twins[number] = m.part(shaft_of[number], kind, name)
        m.set(twins[number], **{**attributes, "u_coordinate_on_shaft": (140.0, MM),
                                "helix_angle_reference_diameter": (helix, DEG)})  # fmt: skip
    for first, second in mates:
        pair = m.part(
            m.stage, "cylindrical_stage", center_distance=(ARM / math.cos(math.radians(10)), MM)
        )
        m.relate("stage", stage=pair, gear_1=twins[first], gear_2=twins[second])
    stage = imported(m)[0].stages[0]
    assert stage.double_helical and stage.half_gap == pytest.approx(0.03)
    assert stage.planet_hand == "right" and stage.ring.support.radial == 2e9  # of each half


def test_thickness_allowances_are_backlash(imported):
    """j_bn = −Σ A_sn cos α_n of mean deviations, or −Σ A_W; beside a stated backlash they yield."""
    m = planetary()
    for gear, deviations in [(m.sun, (-0.05, -0.09)), *((p, (-0.1, -0.14)) for p in m.planets)]:
        m.set(gear, chordal_tooth_thickness_upper_deviation=(deviations[0], MM),
              chordal_tooth_thickness_lower_deviation=(deviations[1], MM))  # fmt: skip
    case, conversion = imported(m)
    stage = case.stages[0]
    assert stage.backlash_sun == pytest.approx(0.19e-3 * math.cos(stage.pressure_angle))
    assert stage.backlash_ring == pytest.approx(0.12e-3 * math.cos(stage.pressure_angle))
    assert not any("chordal" in line for line in conversion.left_out)
    m.set(m.sun, chordal_tooth_thickness_upper_deviation=None,
          chordal_tooth_thickness_lower_deviation=None,
          upper_backlash_allowance_referenced_to_span=(-60.0, "mum"),
          lower_backlash_allowance_referenced_to_span=(-80.0, "mum"))  # fmt: skip
    spans = imported(m)[0].stages[0]
    expected = 0.07e-3 + 0.12e-3 * math.cos(stage.pressure_angle)
    assert spans.backlash_sun == pytest.approx(expected)


def with_steel(m):
    """The sun's steel, surface and accuracy, oil in the casing, and sizes of planet bearings."""
    flank, root, rz, accuracy = STRENGTHS[m.version]
    m.set(m.steel, **{flank: (1500.0, "N / mm^2"), root: (480.0, "N / mm^2")},
          heat_treated_material_type_iso_6336_2006=("case_hardened_wrought_steel", "none"),
          surface_hardness_vickers=(700.0, "HV"), core_hardness_rockwell=(33.0, "HRC"),
          yield_strength=(850.0, "MPa"))  # fmt: skip
    m.set(m.sun, **{rz: (4.8, "mum"), accuracy: ("5", "none")}, single_pitch_deviation=(0.007, MM))
    oil = m.add("lubricant", "VG 320", viscosity_at_40_degree_celsius=(320.0, "mm^2 / s"),
                viscosity_at_100_degree_celsius=(35.0, "mm^2 / s"))  # fmt: skip
    m.relate("reference", origin=m.casing, referenced=oil)
    m.set(m.casing, temperature_lubricant=(65.0, "C"))
    for number in m.planet_bearings:
        m.set(number, radial_dynamic_load_rating=(900.0, "kN"), fatigue_limit_load=(160.0, "kN"),
              inner_diameter=(120.0, MM), outer_diameter=(180.0, MM))  # fmt: skip
    return m


@pytest.mark.parametrize("version", STRENGTHS)
def test_steel_surface_and_oil_for_a_rating(imported, version):
    case, conversion = imported(with_steel(planetary(version)))
    sun = case.stages[0].sun.rating
    assert "heat_treated_material_type_iso_6336_2006" in conversion.text
    assert (sun.steel, sun.flank_strength, sun.root_strength) == ("case_hardened", 1.5e9, 4.8e8)
    assert (sun.vickers_hardness, sun.core_rockwell_hardness, sun.accuracy_grade) == (700, 33, 5)
    assert (sun.flank_rz, sun.pitch_deviation) == pytest.approx((4.8e-6, 7e-6))
    assert sun.yield_strength == 8.5e8
    assert case.stages[0].ring.rating.steel is None  # without a material in the file
    oil = case.lubricant
    values = (oil.viscosity_40, oil.viscosity_100, oil.temperature)
    assert values == pytest.approx((320e-6, 35e-6, 338.15))
    assert case.stages[0].planet_bearing.mean_diameter == pytest.approx(0.15)
    listed = " ".join(conversion.left_out)
    assert not any(word in listed for word in ("yield", "lubricant", "hardness", "er_diameter"))


def test_a_material_without_life_curves_says_so(imported):
    m = with_steel(planetary())
    m.set(m.steel, heat_treated_material_type_iso_6336_2006=("grey_cast_iron", "none"))
    case, conversion = imported(m)
    assert case.stages[0].sun.rating.steel is None
    assert any("grey_cast_iron' is no steel" in line for line in conversion.assumed)


def test_every_attribute_is_used_or_listed(tmp_path):
    """What stands in a file, known or not, is in the case's comments or in the list below it."""
    m = three_stages()
    odd = {}
    for k, number in enumerate(list(m.components)):
        odd[number] = f"custom_thing_{k}"
        m.set(number, **{odd[number]: (float(k), "furlong")})
    strange = m.add("flux_capacitor", "strange", charge=(1.21, "GW"))
    m.relate("entanglement", one=strange, two=m.sun)
    path = m.write(tmp_path / "odd.rexs")
    document = read_rexs(path)
    conversion = case_of_document(document, str(path))
    listed = "\n".join(conversion.left_out)
    assert listed in conversion.text.replace("#   ", "")
    for name in odd.values():
        assert re.search(rf"\b{name}\b", listed)
    assert "flux_capacitor" in listed and "charge" in listed
    assert "1 relations of type entanglement" in listed
    for component in document.components.values():
        for attribute in component.attributes.values():
            assert attribute.used or re.search(
                rf"^{component.kind} .*\b{attribute.id}\b", listed, re.M
            )


def test_every_key_says_where_it_is_from(imported):
    _, conversion = imported(three_stages())
    keys = [line for line in conversion.text.splitlines() if re.match(r"[a-z_]+ = ", line)]
    assert len(keys) > 60
    assert all("# " in line for line in keys)


def test_time_grows_with_the_number_of_components_alone(tmp_path):
    """Eight times as many bearings on the gear unit take about eight times as long; a search for
    each, 64 times as long."""
    took = {}
    for number in (1000, 8000):
        m = planetary()
        for _ in range(number):
            m.part(m.unit, "rolling_bearing_with_catalog_geometry", "b")
        path = m.write(tmp_path / "large.rexs")
        begin = time.process_time()
        case_of_document(read_rexs(path), str(path), None)
        took[number] = time.process_time() - begin
    assert took[8000] < 25 * took[1000]
