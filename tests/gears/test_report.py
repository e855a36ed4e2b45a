"""What ``check`` tells of stages, their backlash, and the sizes of what models leave out."""

import json
import math

import numpy as np
import pytest
from gears.stages import (
    UNLOADED,
    helical,
    lin_parker,
    parallel,
    paths_of,
    planetary,
    seen,
)
from trains import BEARING, spur_pair, write

from flexgear.cli.case_commands import derived
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.implausible import implausible
from flexgear.gears.power_flow import power_flow
from flexgear.gears.report import (
    friction_share,
    neglected_effects,
    pin_sag,
    rim_compliance,
    rim_rows,
    stage_report,
)
from flexgear.model.load import case_of_toml, load_case
from flexgear.solve.model import assemble
from flexgear.solve.static import static


def test_a_planetary_stage_tells_what_its_geometry_says():
    stage = helical(gear_mesh={"model": "rectangular", "sun_stiffness": 3e9}, backlash_sun=2e-4)
    g, report = stage_geometry(seen(stage)), stage_report(seen(stage), UNLOADED)
    names = ["assembly", "sun", "planet", "ring", "sun_gear_mesh", "ring_gear_mesh", "not_modelled"]
    assert list(report) == names
    assembly, sun, contact = report["assembly"], report["sun"], report["sun_gear_mesh"]
    assert assembly["assembles"] is True
    assert assembly["(z_sun + z_ring)/N"] == 36
    assert assembly["planet_clearance_mm"] == pytest.approx(1e3 * g.planet_clearance)
    assert assembly["center_distance_mm"] == pytest.approx(270 / math.cos(stage.helix_angle))
    assert sun["tip_diameter_mm"] - sun["reference_diameter_mm"] == pytest.approx(20)
    assert contact["contact_ratio"] == pytest.approx(g.sun_gear_mesh.total_contact_ratio)
    assert contact["backlash_um"] == pytest.approx(200)
    assert contact["mean_stiffness_n_per_m"] == pytest.approx(3e9)
    ratio = contact["transverse_contact_ratio"]
    assert contact["largest_stiffness_n_per_m"] == pytest.approx(2 / ratio * 3e9)
    assert contact["least_stiffness_n_per_m"] == pytest.approx(1 / ratio * 3e9)
    assert contact["phase_of_planets_in_pitches"] == [0, 0, 0]  # 84 / 3 is whole
    # c_γ b = c' (0.75 ε_α + 0.25) b
    ring = report["ring_gear_mesh"]
    peak = ring["iso_single_stiffness_n_per_mm_um"] * 1e9
    mean = peak * (0.75 * ring["transverse_contact_ratio"] + 0.25) * 0.1
    assert ring["mean_stiffness_n_per_m"] == pytest.approx(mean)


def test_phases_of_planets_that_are_not_in_phase():
    stage = planetary(sun={"teeth": 26}, planet={"teeth": 29})
    report = stage_report(seen(stage.model_copy(update={"allow_unassemblable": True})), UNLOADED)
    assert report["assembly"]["assembles"] is False
    assert report["assembly"]["largest_misfit_of_a_sun_tooth_in_pitches"] == pytest.approx(1 / 3)
    stage = planetary(planets=4, sun={"teeth": 30}, planet={"teeth": 28}, ring={"teeth": 86})
    report = stage_report(seen(stage), UNLOADED)
    assert report["ring_gear_mesh"]["phase_of_planets_in_pitches"] == [0, 0.5, 0, 0.5]
    assert report["sun_gear_mesh"]["phase_of_planets_in_pitches"] == [0, 0.5, 0, 0.5]


def test_printed_radii_are_said_to_be_given():
    report = stage_report(seen(lin_parker(4)), UNLOADED)
    assert report["assembly"]["radii"].startswith("as given")
    assert report["sun"]["base_diameter_mm"] == pytest.approx(77.42)
    assert report["ring"]["base_diameter_mm"] == pytest.approx(275.03)
    assert report["sun_gear_mesh"]["mean_stiffness_n_per_m"] == 5e8


def test_pinion_and_gear_and_one_gear_mesh():
    report = stage_report(seen(parallel(gear_mesh={"model": "per_pair"})), UNLOADED)
    assert list(report) == ["assembly", "pinion", "gear", "gear_mesh", "not_modelled"]
    assert "planets" not in report["assembly"]
    rows = report["gear_mesh"]
    assert rows["least_stiffness_n_per_m"] < rows["mean_stiffness_n_per_m"]
    assert rows["mean_stiffness_n_per_m"] < rows["largest_stiffness_n_per_m"]
    assert rows["pair_stiffness_peak_n_per_m"] < rows["largest_stiffness_n_per_m"]
    json.dumps(report, default=float, allow_nan=False)


def test_stiffness_is_that_of_the_flank_that_carries(tmp_path):
    """A pair of spur gears with relief on its drive flank, run forwards and backwards."""
    relief = ", modifications = { drive = { tip_relief = { amount_um = 40, length_mm = 8 } } }"
    rows = []
    for sign in (1, -1):
        text = spur_pair(
            pinion=f"teeth = 30, {BEARING}{relief}", backlash=100, speed=sign * 10,
            gear_mesh='model = "per_pair"\ncontact_law = "one-sided"', torque=sign * 500,
        )  # fmt: skip
        rows.append(derived(load_case(write(tmp_path, text)))["gear_mesh"])
    for name in ("mean", "least", "largest"):
        key = f"{name}_stiffness_n_per_m"
        assert rows[1][key] == pytest.approx(rows[0][key], rel=1e-9)
    assert rows[1]["backlash_um"] == pytest.approx(rows[0]["backlash_um"], rel=1e-9)


def test_a_double_helical_stage_reports_its_halves():
    rows = stage_report(seen(helical(double_helical=True, planets=1)), UNLOADED)["assembly"]
    assert rows["halves"] == 2
    assert rows["face_width_of_a_half_mm"] == pytest.approx(100)
    assert "planet_clearance_mm" not in rows


def test_a_ring_pressed_on_its_diameter_gives_way_as_timoshenko_says():
    rows = [rim_rows(angle, -1.0, 0.0, 0.0) for angle in (0.0, math.pi)]
    way = sum(rows) * rim_compliance(3.0, 0.2)
    shorter = sum(float(np.sum(row * way)) for row in rows)
    assert shorter == pytest.approx((math.pi / 4 - 2 / math.pi) * 0.2**3 / 3.0, rel=1e-6)


def test_turning_the_whole_ring_s_load_about_a_place_beside_it_is_force_and_couple():
    """A couple bends a ring as two tangential forces apart by its arm do."""
    arm = 1e-4
    difference = (rim_rows(0.3, 0.0, 1.0, arm) - rim_rows(0.3, 0.0, 1.0, -arm)) / (2 * arm)
    # v' of the radial displacement: a couple is two radial forces close together
    step = 1e-6
    near = (rim_rows(0.3 + step, 1.0, 0.0, 0.0) - rim_rows(0.3 - step, 1.0, 0.0, 0.0)) / (2 * step)
    first = slice(0, 20)
    turned = rim_rows(0.3, 0.0, 1.0, 0.0) - near
    np.testing.assert_allclose(difference[:, first], turned[:, first], atol=1e-7)


def test_a_pin_whose_seat_is_its_span_sags_as_a_beam_with_both_ends_built_in():
    assert pin_sag(5.0, 0.3, 0.3, 7.0, math.inf) == pytest.approx(5.0 * 0.3**3 / (384 * 7.0))


def test_a_pin_loaded_on_a_short_seat_bends_by_the_moment_in_its_middle():
    seat = 1e-4  # curvature M/EI = F L/(8 EI) over the seat
    expected = 5.0 * 0.3 / 8 * seat**2 / (8 * 7.0)
    assert pin_sag(5.0, 0.3, seat, 7.0, math.inf) == pytest.approx(expected, rel=1e-3)


def test_friction_takes_what_summing_over_the_path_gives():
    g = stage_geometry(seen(planetary()))
    for slot, sense in (("sun", 1.0), ("ring", -1.0)):
        gear_mesh, gear = g.gear_meshes[slot], g.gears[slot]
        s = np.linspace(gear_mesh.s_lo, gear_mesh.s_hi, 20001)
        pitch_point = g.planet.base_radius * math.tan(gear_mesh.working_angle)
        # flanks slide by the difference of the speeds of both gears' radii of curvature
        turned = g.planet.base_radius / gear.base_radius
        slide = np.abs((s - pitch_point) * (1.0 + sense * turned)) / g.planet.base_radius
        assert friction_share(g, slot, 0.05) == pytest.approx(0.05 * slide.mean(), rel=1e-3)


@pytest.mark.parametrize("name", ["grc-750kw", "wind-5mw", "lin-parker"])
def test_sizes_follow_what_the_case_has(name):
    case = load_case(name)
    flow = power_flow(case).stages[0]
    effects = neglected_effects(case.view(flow.name), flow.gear_mesh_forces)
    rim = case.stages[0].planet.bore_diameter > 0
    assert any(key.startswith("free_planet_rim") for key in effects) == rim
    assert ("pin_bends_in_planet_um" in effects) == (case.stages[0].form("carrier") == "fe")
    assert all(math.isfinite(size) and size > 0 for size in effects.values())
    twice = neglected_effects(
        case.view(flow.name), {k: 2 * f for k, f in flow.gear_mesh_forces.items()}
    )
    for key, size in effects.items():
        linear = key.endswith(("_um", "_n"))
        assert twice[key] == pytest.approx((2 if linear else 1) * size)


def test_planets_that_ovalise_in_the_model_are_not_estimated():
    case = load_case("wind-5mw")
    lumped = neglected_effects(case.view(), forces := power_flow(case).stages[0].gear_mesh_forces)
    case = case.with_(**{"stage.planet.fe.tie": "root"})
    flexible = neglected_effects(case.view(), forces)
    assert not any(key.startswith("free_planet_rim") for key in flexible)
    assert neglected_effects(case.view().with_rigid(["planet"]), forces) == lumped


ONE_SIDED = {"contact_law": "one-sided"}


def plain_stage(**sections):
    """Four planets on soft pins, lumped, one-sided pairs; the backlash is left to the rule."""
    spring = {"radial_n_per_m": 3e8}
    stage = {
        "planets": 4, "normal_module_mm": 1.5, "pressure_angle_deg": 20, "face_width_mm": 20,
        "sun": {"teeth": 28}, "planet": {"teeth": 22}, "planet_bearing": spring,
        "ring": {"teeth": 72, "rim_thickness_mm": 9, "kinematics": "fixed"},
        "carrier": {"support": spring},
        "gear_mesh": {"model": "per_pair", "contact_law": "one-sided"}, **sections,
    }  # fmt: skip
    return case_of_toml({
        "title": "plain", "stage": stage, "output": {"member": "stage.sun"},
        "material": {
            "young_modulus_gpa": 206, "poisson_ratio": 0.3, "density_kg_per_m3": 7850},
        "inputs": [{"member": "stage.carrier", "speed_rpm": 1500, "torque_nm": 300}],
    }, "plain.toml", "plain")  # fmt: skip


@pytest.mark.parametrize(
    ("backlash", "expected_um"),
    # 2/3 (60 + 0.5 a + 30 m) µm by hand, a and m in mm: 270 and 10; 37.5 and 1.5 in the next test
    [({}, 330.0), ({"backlash_ring": 0.0}, 0.0), ({"backlash_ring": 4e-4}, 400.0)],
)  # fmt: skip
def test_backlash_is_that_of_the_case_or_of_the_rule(backlash, expected_um):
    for law, expected in (("one-sided", expected_um), ("linear", expected_um if backlash else 0.0)):
        path = paths_of(planetary(gear_mesh={"contact_law": law}, **backlash))["ring_coast", ""]
        assert 1e6 * path.backlash == pytest.approx(expected, abs=1e-9)


def test_check_names_the_rule():
    rows = derived(plain_stage())["ring_gear_mesh"]
    assert rows["backlash_um"] == pytest.approx(82.5)
    assert "ISO/TR 10064-2" in rows["backlash_by"]
    assert "case" in derived(plain_stage(backlash_ring_mm=0.1))["ring_gear_mesh"]["backlash_by"]
    linear = {"model": "per_pair", "contact_law": "linear"}
    assert "linear" in derived(plain_stage(gear_mesh=linear))["sun_gear_mesh"]["backlash_by"]
    stated = plain_stage(gear_mesh=linear, backlash_sun_mm=0.1)
    assert "case; linear" in derived(stated)["sun_gear_mesh"]["backlash_by"]


def test_check_says_that_backlash_is_of_the_profile_shifts():
    """x_1 + x_2 is 0.1 below that of the centre distance: 2 Δx m_n sin α_n is left."""
    distance = stage_geometry(seen(parallel())).center_distance
    loose = parallel(gear={"teeth": 95, "profile_shift": 0.569}, center_distance=distance)
    rows = stage_report(seen(loose), UNLOADED)["gear_mesh"]
    expected = 2 * 0.1 * 14e3 * math.sin(math.radians(20))
    assert rows["backlash_um"] == pytest.approx(expected, rel=1e-6)
    assert rows["backlash_by"].startswith("profile shifts at the centre distance")


def test_coast_flanks_carry_nothing_by_default():
    """Load sharing with an error is that of gears far from touching behind; without backlash,
    flanks behind hold what the error moves, and it is another."""

    def loads(**keys):
        errors = {"pin_tangential_um": [20, 0, 0, 0], "carrier_eccentricity_um": 10}
        data = static(assemble(plain_stage(errors=errors, **keys)), np.linspace(0, 0.1, 7))
        coast = data.pair_load.sel(flank=data.flank_sense == "coast")
        return data.planet_load_factor.to_numpy(), float(np.abs(coast).max())

    by_rule, behind = loads()
    free, _ = loads(backlash_ring_mm=1.0, backlash_sun_mm=1.0)
    tight, held = loads(backlash_ring_mm=0.0, backlash_sun_mm=0.0)
    assert behind == 0.0 and by_rule == pytest.approx(free, rel=1e-9)
    assert held > 100.0 and tight.max() > free.max() * 1.05


def test_coast_tooth_numbers_follow_the_rule():
    """As if the same backlash had been given."""
    by_rule = paths_of(planetary(gear_mesh=ONE_SIDED))
    with_backlash = paths_of(
        planetary(gear_mesh=ONE_SIDED, backlash_ring=3.3e-4, backlash_sun=3.3e-4)
    )
    for kind, path in by_rule.items():
        assert path.s0 == pytest.approx(with_backlash[kind].s0, abs=1e-15)


def closing(**errors):
    stage = planetary(gear_mesh=ONE_SIDED, errors=errors)
    report = stage_report(seen(stage), UNLOADED)
    return {name: report[f"{name}_gear_mesh"]["errors_close_up_to_um"] for name in ("sun", "ring")}


def test_gaps_that_errors_close_in_closed_form():
    """Thicker teeth by Δs cos α, an eccentric sun by 2 E sin α; what turns a planet by nothing."""
    a = math.radians(20)
    assert closing(planet_thickness=(40e-6,))["ring"] == pytest.approx(40 * math.cos(a))
    amounts = closing(sun_eccentricity=50e-6)
    assert amounts["sun"] == pytest.approx(100 * math.sin(a)) and amounts["ring"] == 0.0
    assert closing(pin_tangential=(50e-6, 0.0, 0.0))["sun"] == pytest.approx(0.0, abs=1e-12)
    assert closing(pin_radial=(50e-6, 0.0, 0.0))["ring"] == pytest.approx(100 * math.sin(a))


def test_check_warns_where_errors_close_the_backlash():

    def lines(eccentricity):
        case = plain_stage(errors={"sun_eccentricity_um": eccentricity})
        return [x for x in implausible(case, power_flow(case)) if "backlash" in x]

    (line,) = lines(130)
    assert "close up to 88.93 µm of a backlash of 82.5 µm in the sun gear mesh" in line
    assert not lines(110)
