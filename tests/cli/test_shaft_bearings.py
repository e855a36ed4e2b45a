"""Bearings of shafts between gears, by statics and the formulas of ISO 281 and ISO 76 by hand."""

import math

import pytest
from pinion_on_bearings import (
    BALL,
    HELIX,
    HOURS,
    MODULE,
    PLAIN,
    RPM,
    SPEEDS,
    TEETH,
    TORQUE,
    by_hand,
    cot,
    life,
    of,
    rated,
    supports,
    table,
    text,
)
from trains import STAGE, write

from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.results.rating_files import rating_rows
from flexgear.results.report.study_tables import rating_tables, rating_verdicts
from flexgear.studies.rating import rate

FEW = {"rating.gear_mesh_cycles": "1", "rating.positions_per_gear_mesh": "2"}


@pytest.mark.parametrize(
    ("hand", "torque", "position"),
    [("right", TORQUE, 0), ("left", TORQUE, 70), ("left", -TORQUE, 0)],
)
def test_two_bearings_of_every_shaft_carry_what_statics_says(
    flexgear, tmp_path, hand, torque, position
):
    """In check, static and run alike; rollers without a contact angle carry no thrust."""
    path = write(tmp_path, text(hand, position, torque))
    loads, thrust = by_hand(hand, torque)
    checked = flexgear.json("check", path)
    running = checked["running"]
    shares = [f"none of the thrust, {100 * thrust / of[1]:.3g} %" for of in loads.values()]
    assert all(any(share in warning for warning in checked["warnings"]) for share in shares)
    figures = flexgear.json("static", path)
    worst = max(thrust / of[1] for of in loads.values())
    assert f"thrust or moment is {100 * worst:.3g} % of it" in figures["neglected"][-1]
    static = figures["0 deg"]["bearing"]
    assert set(static) == {f"stage_1.{part}_support_{k}" for part in loads for k in (1, 2)}
    for part, radial in loads.items():
        for k, of_bearing in enumerate(radial, 1):
            name, hours = f"{part}_support_{k}", life(of_bearing, SPEEDS[part])
            assert running[f"{name}_radial_force_n"] == pytest.approx(of_bearing, rel=1e-6)
            assert running[f"{name}_axial_force_n"] == pytest.approx(thrust * (k == 2), abs=1e-3)
            assert running[f"nominal_{name}_life_h"] == pytest.approx(hours, rel=1e-5)
            at = static[f"stage_1.{name}"]
            assert at["force_n"] == pytest.approx(of_bearing, rel=1e-4)
            assert abs(at["axial_n"]) == pytest.approx(thrust * (k == 2), rel=1e-4, abs=1.0)
            assert at["life_h"] == pytest.approx(hours, rel=1e-3)


@pytest.mark.slow
def test_a_run_reports_the_bearings_of_shafts_and_levels_of_sensors(flexgear, tmp_path):
    """The pinion moves by its thrust over the axial stiffness, 2e8 N/m."""
    sensor = '[[sensors]]\nname = "along"\non = "stage_1.pinion"\nmeasures = "displacement"\n'
    path, out = write(tmp_path, text(more=sensor + 'direction = "z"')), tmp_path / "out"
    quick = ["--set", "solver.settle_s=0.01", "--set", "solver.duration_s=0.03"]
    summary = flexgear.json("run", path, *quick, "--out", out)
    loads, thrust = by_hand()
    level = summary["sensors"]["along"]
    assert abs(level["mean"]) == pytest.approx(thrust / 2e8, rel=1e-3) and level["unit"] == "m"
    left_out = summary["stages"]["stage_1"]["not_in_bearing_life"]
    shares = {f"{part}_support_2": thrust / radial[1] for part, radial in loads.items()}
    assert left_out == pytest.approx(shares, rel=1e-3)
    for part, radial in loads.items():
        for k, of_bearing in enumerate(radial, 1):
            figures, name = summary["stages"]["stage_1"], f"{part}_support_{k}"
            assert figures["bearing_force_n"][name] == pytest.approx(of_bearing, rel=1e-4)
            hours = life(of_bearing, SPEEDS[part])
            assert figures["bearing_life_h"][name] == pytest.approx(hours, rel=1e-3)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "pinion support 2" in page and "along, root mean square about it" in page


CASES = {  # data of the bearing with thrust; P and P_0 over the radial load, by F_a/F_r
    "one row of rollers": (
        {**PLAIN, **of(contact_angle_deg=10)},
        lambda t: 0.4 + 0.4 * cot(10) * t if t > 1.5 / cot(10) else 1.0,
        lambda t: max(0.5 + 0.22 * cot(10) * t, 1.0),
    ),
    "two rows of rollers": (
        {**PLAIN, **of(contact_angle_deg=25, rows=2)},
        lambda t: 0.67 + 0.67 * cot(25) * t if t > 1.5 / cot(25) else 1 + 0.45 * cot(25) * t,
        lambda t: 1 + 0.44 * cot(25) * t,
    ),
    "angular contact balls": (
        {**BALL, **of(contact_angle_deg=40)},
        lambda t: 0.35 + 0.57 * t if t > 1.14 else 1.0,
        lambda t: max(0.5 + 0.26 * t, 1.0),
    ),
    "their pair between two angles of the table": (
        {**BALL, **of(contact_angle_deg=22.5, rows=2)},
        lambda t: 0.685 + 1.52 * t if t > 0.625 else 1 + 1.005 * t,
        lambda t: 1 + 0.80 * t,
    ),
    "factors of a catalogue": (
        {**PLAIN, **of(e=0.1, x=0.5, y=1.5, y_1=0.4, x_0=0.6, y_0=1.2)},
        lambda t: 0.5 + 1.5 * t if t > 0.1 else 1 + 0.4 * t,
        lambda t: max(0.6 + 1.2 * t, 1.0),
    ),
}


@pytest.mark.parametrize("data", CASES.values(), ids=CASES)
def test_thrust_counts_as_in_the_standards(tmp_path, data):
    bearing, equivalent, static = data
    _, row = rated(tmp_path, bearing)
    loads, thrust = by_hand()
    exponent = 3 if "ball" in bearing["rolling"] else 10 / 3
    for part, (near, far) in loads.items():
        name, speed = f"{part}_support_2", SPEEDS[part]
        load = far * equivalent(thrust / far)
        assert row(name, "P") == pytest.approx(load, rel=1e-4)
        damage = HOURS / life(load, speed, exponent)
        assert row(name, "damage") == pytest.approx(damage, rel=1e-3)
        gust = 150e3 / (2 * far * static(thrust / far))
        assert row(name, "bin_safety", "gust") == pytest.approx(gust, rel=1e-3)
        free = HOURS / life(near, speed)  # of cylindrical rollers beside it
        assert row(f"{part}_support_1", "damage_sum", "all") == pytest.approx(free, rel=1e-3)


PAIRS = {  # kind, X, Y, e of one row, and thrust over radial load that this induces
    "rollers": (PLAIN, 14, 0.4, 0.4 * cot(14), 1.5 / cot(14), 0.5 / (0.4 * cot(14))),
    "balls": (BALL, 40, 0.35, 0.57, 1.14, 1.14),
}


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("torque", [TORQUE, 0.02 * TORQUE, -TORQUE])
@pytest.mark.parametrize("at_b", ["+z", "-z"])
def test_single_rows_that_face_each_other_induce_thrust(flexgear, tmp_path, kind, torque, at_b):
    """The shaft rests on the bearing towards which the sum of outer and induced thrust points;
    both are in equilibrium with the outer thrust, and neither has less than it induces."""
    data, angle, x, y, e, share = PAIRS[kind]
    at_a = "-z" if at_b == "+z" else "+z"
    keys = [{**data, **of(contact_angle_deg=angle, direction=f'"{d}"')} for d in (at_a, at_b)]
    path = write(tmp_path, text(torque=torque, free=keys[0], locating=keys[1]))
    running = flexgear.json("check", path)["running"]
    static = flexgear.json("static", path)["0 deg"]["bearing"]
    rows = {tuple(r[:3]): r[3] for r in rating_rows(rate(load_case(path), workers=1))}
    loads, outer = by_hand("right", torque)
    exponent = 3 if kind == "balls" else 10 / 3
    for part, radial in loads.items():
        # a right-handed gear under this torque is pushed against its pinion; towards b if "+z"
        towards_b = outer * (1 if (torque < 0) == (part == "pinion") else -1)
        towards_b *= 1 if at_b == "+z" else -1
        induced = [share * f for f in radial]
        if induced[0] + towards_b > induced[1]:
            thrusts = induced[0], induced[0] + towards_b
        else:
            thrusts = induced[1] - towards_b, induced[1]
        for k, (of_bearing, thrust) in enumerate(zip(radial, thrusts, strict=True), 1):
            name = f"{part}_support_{k}"
            big = thrust > e * of_bearing * (1 + 1e-9)
            load = x * of_bearing + y * thrust if big else of_bearing
            assert running[f"{name}_axial_force_n"] == pytest.approx(thrust, rel=1e-6)
            assert abs(static[f"stage_1.{name}"]["axial_n"]) == pytest.approx(thrust, rel=1e-3)
            hours = life(load, SPEEDS[part], exponent)
            assert running[f"nominal_{name}_life_h"] == pytest.approx(hours, rel=1e-5)
            assert static[f"stage_1.{name}"]["life_h"] == pytest.approx(hours, rel=5e-3)
            if torque > 0:
                assert rows[f"stage_1.{name}", "rated", "F_a"] == pytest.approx(
                    thrust * (1 if (k == 2) == (at_b == "+z") else -1), rel=1e-3
                )
                assert rows[f"stage_1.{name}", "rated", "P"] == pytest.approx(load, rel=1e-3)


def test_a_reversed_load_case_separates_gears_as_the_rated_one_does(flexgear, tmp_path):
    """The thrust turns round with the torque, the radial force does not: the share of both bearings
    is another one, also with linear contact, the default of lumped members."""
    back = '[[load_cases]]\nname = "back"\nhours = 9\ntorque_nm = -500\nback_driven = true'
    _, row = rated(tmp_path, PLAIN, more=back)
    for torque, name in ((TORQUE, "rated"), (-500.0, "back")):
        loads, _ = by_hand(torque=torque)
        for part, both in loads.items():
            for k, load in enumerate(both, 1):
                assert row(f"{part}_support_{k}", "F_r", name) == pytest.approx(load, rel=1e-4)
    path = write(tmp_path, text())
    assert "pull" not in flexgear.out("static", path, "--quiet")
    assert "Torque of stage 1 is against the rated sense: teeth pull" in " ".join(
        flexgear.out("static", path, "--torque-nm", "-500", "--quiet").split()
    )


def test_deep_groove_balls_by_their_relative_axial_load(tmp_path):
    """f_0 F_a/C_0 half way between 0.689 and 1.03: e = 0.27, Y = 1.63."""
    loads, thrust = by_hand()
    f_0 = 0.5 * (0.689 + 1.03) * 150e3 / thrust
    _, row = rated(tmp_path, {**BALL, **of(contact_angle_deg=0, calculation_factor=f_0)})
    far = loads["pinion"][1]
    assert thrust > 0.27 * far
    load = 0.56 * far + 1.63 * thrust
    assert row("pinion_support_2", "P") == pytest.approx(load, rel=1e-4)
    hours = life(load, RPM, 3)
    assert row("pinion_support_2", "damage") == pytest.approx(HOURS / hours, rel=1e-3)


def test_thrust_that_is_left_out_leaves_no_verdict(tmp_path):
    rating, row = rated(tmp_path, PLAIN)
    parts = {part.name: part for part in rating.parts}
    assert parts["stage_1.pinion_support_1"].holds is True
    assert parts["stage_1.pinion_support_2"].holds is None
    assert "radial load alone" in parts["stage_1.pinion_support_2"].factors[0]["L_10"].source
    assert row("pinion_support_2", "P") is None
    verdicts = {verdict.subject: verdict for verdict in rating_verdicts(rating)}
    lives, reliability = verdicts["Bearing life, stage 1"], verdicts["Reliability"]
    names = "stage 1 pinion support 2, stage 1 gear support 2"
    assert (lives.level, names in lives.sentence) == ("note", True)
    assert reliability.sentence.endswith("h; 2 without a verdict count by their estimates.")


def test_a_bearing_whose_gear_cannot_move_along_its_axis_is_rated_with_its_thrust(tmp_path):
    """F_t tan β, and its moment, on the only bearing of a pinion, whose kinematics is planar."""
    single = {"radial_n_per_m": 1e9, "axial_n_per_m": 1e8, "tilt_nm_per_rad": 1e7, **PLAIN}
    case = text().replace(supports("pinion", PLAIN), table(single))
    rating = rate(load_case(write(tmp_path, case), FEW))
    part = next(p for p in rating.parts if p.name == "stage_1.pinion_support")
    thrust, arm = by_hand()[1], 5e-4 * MODULE * TEETH["pinion"] / math.cos(math.radians(HELIX))
    assert part.factors[0]["F_a"].value == pytest.approx(thrust, rel=1e-6)
    assert part.factors[0]["M"].value == pytest.approx(thrust * arm, rel=1e-6)
    assert part.estimates and part.holds is None


@pytest.mark.parametrize("kinematics", ["spatial", "planar"])
@pytest.mark.parametrize("distance", [0.2, 2.0])
def test_basic_life_says_that_the_moment_of_a_helical_planet_is_left_out(
    tmp_path, distance, kinematics
):
    """Two gear meshes press a planet with 2 F_t sideways and tilt it with 2 F_t tan β r; on two
    bearings at a ``distance`` the couple is that moment over the distance, whether the model lets
    planets tilt or not."""
    text = STAGE.format(planets=3, helix=20, sun="1e8").replace(
        "radial_n_per_m = 5e8", f"radial_n_per_m = 5e8\ntilt_nm_per_rad = {5e8 * distance**2 / 4}\n"
        "axial_n_per_m = 1e8\ncount = 2\ndynamic_rating_kn = 120\nrolling = 'roller'",
    )  # fmt: skip
    stiff = {"axial_n_per_m": "1e9", "tilt_nm_per_rad": "1e8"}
    keys = {f"stage.{part}.support.{key}": value for part in ("sun", "ring", "carrier")
            for key, value in stiff.items()}  # fmt: skip
    text += "[[load_cases]]\nname = 'rated'\nhours = 1000\n"
    path = write(tmp_path, text, f'kinematics = "{kinematics}"\n')
    rating = rate(load_case(path, keys | FEW))
    part = next(p for p in rating.parts if p.name == "stage.planet_bearing_1")
    sheet = part.factors[0]
    couple = sheet["F_r"].value * math.tan(math.radians(20)) * 0.5 * 34 * 4e-3
    couple /= math.cos(math.radians(20)) * distance
    rows = str(rating_tables(rating))
    if distance > 1.0:  # a twentieth of the load on each half
        assert "F_M" not in sheet and "moment does not count" not in rows
        assert not part.estimates
    else:
        assert part.estimates == {
            "equivalent_load": "by the radial load alone, as the moment is left out"
        }
        assert sheet["F_M"].value == pytest.approx(couple, rel=1e-3)
        assert "moment does not count, which is 26.3 % of the radial load on each half" in rows


def test_springs_without_data_are_named(tmp_path):
    rating, _ = rated(tmp_path, {})
    missing = rating.not_assessed["stage_1.pinion_support_2"]
    assert missing == "stages.stage_1.pinion.support.1.dynamic_rating_kn is missing"
    assert "stage_1.pinion_support_1" not in rating.not_assessed


ELEMENTS = table({"count": 20, "diameter_mm": 20, "pitch_diameter_mm": 150, "length_mm": 20})


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({**PLAIN, "elements": ELEMENTS, **of(contact_angle_deg=12)}, "thrust.*beside elements"),
        ({**PLAIN, **of(contact_angle_deg=0)}, "contact_angle.*rollers without one take no thrust"),
        ({**BALL, **of(contact_angle_deg=15)}, "contact_angle.*give e, x and y"),
        ({**BALL, **of(contact_angle_deg=0)}, "calculation_factor.*missing"),
        (
            {**PLAIN, **of(e=0.3, x=0.4)},
            "thrust.y.*missing -- give contact_angle_deg, or e",
        ),
        ({**PLAIN, **of(contact_angle_deg=12, y=0.3)}, "thrust.y.*follows from contact_angle"),
        (
            {**PLAIN, **of(contact_angle_deg=12, rows=2, direction='"+z"')},
            "direction.*single rows",
        ),
        (of(contact_angle_deg=12), "dynamic_rating.*missing -- add dynamic_rating_kn"),
    ],
)
def test_data_that_do_not_fit_are_one_line(tmp_path, keys, line):
    with pytest.raises(InputError, match=rf"support\[1\].*{line}") as caught:
        load_case(write(tmp_path, text(locating=keys)))
    assert "\n" not in str(caught.value)


def test_one_direction_of_a_pair_alone_is_one_line(tmp_path):
    alone = {**PLAIN, **of(contact_angle_deg=12, direction='"+z"')}
    with pytest.raises(
        InputError, match=r"support.1..thrust.direction: is given by 1 of"
    ) as caught:
        load_case(write(tmp_path, text(locating=alone)))
    assert "\n" not in str(caught.value)


def test_modified_life_of_a_catalogue_bearing(tmp_path):
    """a_ISO of ISO 281 for κ = ν/ν_1 between 0.4 and 1, with ν_1 = 4500/√(n D_pw) and e_C given."""
    data = {**PLAIN, "fatigue_load_limit_kn": 18, "mean_diameter_mm": 90}
    oil = "[lubricant]\nviscosity_40_mm2_per_s = 32\noperating_viscosity_mm2_per_s = 9\n"
    rating, row = rated(tmp_path, PLAIN, free=data, more=f"{oil}contamination = 0.6\n")
    near = by_hand()[0]["pinion"][0]
    kappa = 9 * math.sqrt(RPM * 90) / 4500
    assert 0.4 < kappa < 1
    less = (1.5859 - 1.2348 / kappa**0.19087) * (0.6 * 18e3 / near) ** 0.4
    factor = 0.1 * (1 - less) ** -9.185
    assert row("pinion_support_1", "κ") == pytest.approx(kappa, rel=1e-6)
    assert row("pinion_support_1", "a_ISO") == pytest.approx(factor, rel=1e-3)
    modified = HOURS / (factor * life(near, RPM))
    assert row("pinion_support_1", "damage") == pytest.approx(modified, rel=2e-3)
    text_of_parts = {r.label: str(r.value) for r in rating_tables(rating)[0].rows}
    assert "a_ISO" not in text_of_parts["stage 1 pinion support 1"]
    assert "without the lubricant" in text_of_parts["stage 1 pinion support 2"]


def test_mean_diameter_needs_a_fatigue_load_limit(tmp_path):
    with pytest.raises(InputError, match=r"fatigue_load_limit_n.*missing -- add it"):
        load_case(write(tmp_path, text(locating={**PLAIN, "mean_diameter_mm": 90})))
