"""Rating of gears against hand calculations, limits and scaling laws."""

import math

import pytest
from gears.rated_gears import PAIR, PLANETARY, case_of, pair_of
from small_train import refused

from flexgear.gears.nominal_stress import largest_root_stress
from flexgear.gears.power_flow import power_flow
from flexgear.gears.rating.capacity import rate
from flexgear.gears.rating.load_factors import (
    dynamic_factor,
    method_b_inputs,
    transverse_factors,
)
from flexgear.gears.rating.pair import PairLoad
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.results.report.parts import rows_of


def value(state, symbol):
    return state.factors[symbol].value


def flank_of(case, part="sun", role="sun"):
    """State of a flank without load factors."""
    return rate(*pair_of(case, role), {})[part, "flank"]


@pytest.fixture(scope="module")
def rated(tmp_path_factory):
    return pair_of(case_of(tmp_path_factory.mktemp("pair"), PAIR))


def test_helical_gears_of_2019_without_profile_modification_are_pressed_more(tmp_path):
    """Z_B² by f_ZCa from ε_β = 1 on, by its share ε_β below; not in 2006, not of spur gears."""
    key = "rating.profile_modification_factor"
    for width, edition, angle in ((0.2, 2019, 8), (0.045, 2019, 8), (0.2, 2006, 8), (0.2, 2019, 0)):
        changes = {"stage.face_width": width, "rating.edition": edition}
        changes["stage.helix_angle"] = math.radians(angle)
        cases = [case_of(tmp_path, PAIR, **changes, **{key: f}) for f in (1.2, 1.0)]
        bare, proven = (value(flank_of(case), "Z_B") for case in cases)
        share = min(pair_of(cases[0])[0].geometry.overlap_ratio, 1.0) if edition == 2019 else 0.0
        assert bare - proven == pytest.approx(share * (math.sqrt(1.2) - 1.0), abs=1e-12)


def test_check_names_the_edition_of_its_root_stress(tmp_path):
    """2006, whatever the case is rated by: 2019 has f_ε in Y_F and 1/cos³ β in Y_β."""
    (row,) = rows_of({"nominal_root_stress_iso_6336_3_pinion_mpa": 1.0})
    for edition in (2006, 2019):
        case = case_of(tmp_path, PAIR, **{"rating.edition": edition})
        forces = power_flow(case).stages[0].gear_mesh_forces
        nominal = largest_root_stress(case.view(), forces)["sun"] / 1e6
        same = value(rate(*pair_of(case), {})["sun", "root"], "σ_F0") == pytest.approx(nominal)
        assert same is (f"ISO 6336-3:{edition}" in row.label)


def test_a_contact_ratio_above_two_is_remarked_as_two_pairs_may_be_pressed_more(tmp_path):
    """Hertz with half the load at the end of triple contact, where two pairs begin to carry."""
    keys = "teeth = {}\naddendum = {}\ndedendum = 1.6\nroot_fillet = 0.2"
    spur = PAIR.replace('helix_angle_deg = 8\nplanet_hand = "right"\n', "")
    remarks = []
    for addendum in (1.0, 1.3):
        text = spur.replace("teeth = 21\nprofile_shift = 0.3", keys.format(40, addendum))
        text = text.replace("teeth = 67\nprofile_shift = -0.1", keys.format(60, addendum))
        factors = flank_of(case_of(tmp_path, text)).factors
        remarks.append("may be too low" in factors["Z_B"].source)
    base, pitch = 100e-3 * math.cos(math.radians(20)), 5e-3 * math.pi * math.cos(math.radians(20))
    line, small = 250e-3 * math.sin(math.radians(20)), 100e-3 * math.sin(math.radians(20))
    inner = math.sqrt(106.5e-3**2 - base**2) - 2 * pitch
    pressed = 0.5 * small * (line - small) / (inner * (line - inner))
    assert remarks == [False, True]
    assert math.sqrt(pressed) > 1.04 * factors["Z_B"].value * factors["Z_ε"].value


def test_spur_gears_and_an_overlap_of_one_are_the_limits_of_helical_ones(tmp_path):
    def at(degrees, width=0.045):
        changes = {"stage.helix_angle": math.radians(degrees), "stage.face_width": width}
        case = case_of(tmp_path, PAIR, **changes)
        return pair_of(case)[0].geometry, rate(*pair_of(case), {})

    (spur, first), (_, nearly) = at(0.0), at(1e-4)
    ratio = spur.transverse_contact_ratio
    z_epsilon = value(first["sun", "flank"], "Z_ε")
    assert z_epsilon == pytest.approx(math.sqrt((4 - ratio) / 3), rel=1e-12)
    for part, symbol in (("sun", "Z_B"), ("planet", "Z_D")):
        both = [value(x[part, "flank"], symbol) for x in (nearly, first)]
        assert both[0] == pytest.approx(both[1], rel=1e-4)
    wide, states = at(8.0, 0.2)
    assert wide.overlap_ratio > 1
    expected = math.sqrt(1 / wide.transverse_contact_ratio)
    assert value(states["sun", "flank"], "Z_ε") == pytest.approx(expected, rel=1e-12)
    assert value(states["sun", "flank"], "Z_B") == 1.0


def test_rims_count_where_no_fe_body_has_them(tmp_path):
    case = case_of(tmp_path, PLANETARY)
    pair = pair_of(case, "ring")[0]
    assert pair.gears["ring"].rim_factor == pytest.approx(1.15 * math.log(8.324 * 4 / 12))
    wind = load_case("wind-5mw")
    fe, stage = "stage.ring.fe", wind.stages[0]
    assert pair_of(wind, "ring")[0].gears["ring"].rim_factor == 1.0
    assert "FE body" in rate(*pair_of(wind, "ring"), {})["ring", "root"].factors["Y_B"].source
    stated = wind.with_(**{"stage.ring.rating.rim_factor": 1.3})
    assert pair_of(stated, "ring")[0].gears["ring"].rim_factor == 1.3
    for rim, left_out in ((3.51, False), (3.4, True), (1.5, True)):
        keys = {f"{fe}.rim_thickness": rim * stage.normal_module}
        ring = pair_of(wind.with_(**keys), "ring")[0].gears["ring"]
        assert (ring.rim_factor, ring.rim_left_out) == (1.0, left_out)
    stiff = wind.with_(**{f"{fe}.flexible": False, f"{fe}.rim_thickness": 2 * stage.normal_module})
    assert pair_of(stiff, "ring")[0].gears["ring"].rim_factor == pytest.approx(
        1.15 * math.log(8.324 / 2)
    )
    thin = pair_of(case.with_(**{"stage.planet.bore_diameter": 0.116}))[0].gears["planet"]
    rim, height = (4 * (36 - 2 * 1.45) - 116) / 2, 2.25 * 4
    assert thin.rim_factor == pytest.approx(1.6 * math.log(2.242 * height / rim))
    assert pair.gears["planet"].rim_factor == 1.0  # of 2.4 tooth heights


def test_fillets_yield_under_static_loads_alone(rated):
    """σ_0.2 over σ_F of the gear that states it, up to the knee of its life curve."""
    states = rate(*rated, {"K_A": 2.0})
    root = states["planet", "root"]
    assert root.sheet(1e4)["S_0.2"].value == pytest.approx(700 / value(root, "σ_F"))
    assert "S_0.2" not in root.sheet(1.1e4)
    assert "S_0.2" not in states["sun", "root"].sheet(1.0)
    assert "S_0.2" not in states["planet", "flank"].sheet(1.0)


@pytest.mark.parametrize("limit", [0.85, 1.15, 1.5])
def test_dynamic_factor_goes_over_between_its_ranges_without_a_step(rated, limit):
    """At main resonance, the intermediate range and the supercritical one; 1 of perfect gears at
    rest. N grows with the speed. Below 0.85 the standard's K_v has a step of its own (C_v3 to
    C_v4, N to 1), which is there."""
    pair, load = rated

    def at(velocity):
        return dynamic_factor(pair, PairLoad(load.tangential_force, velocity), 1.0)

    assert at(0.0) == (1.0, 0.0)
    velocity = limit / at(1.0)[1]
    below, above = (at(velocity * (1 + sign * 1e-9)) for sign in (-1, 1))
    assert below[1] < limit < above[1]
    if limit == 0.85:
        assert above[0] > below[0]
    else:
        assert above[0] == pytest.approx(below[0], rel=1e-6)


def test_static_strength_of_a_through_hardened_gear_by_hand(tmp_path):
    """ISO 6336-2, 13: Z_W = 1.05 − (HB − 130)/6800 = 1.03 of 280 HV, that is HB 266, beside a case-
    hardened pinion; ISO 6336-3, 13.3: Y_δrelT with (300/700)^¼ = 0.80910 and 0.82 · 0.80910 =
    0.66346; σ_Hlim = 1.313 · 280 + 373 = 740.64, σ_Flim = 0.425 · 280 + 187 = 306 N/mm²."""
    rated = rate(*pair_of(case_of(tmp_path, PAIR, **{"rating.static_factors": "interpolated"})), {})
    flank, root = (rated["planet", limit] for limit in ("flank", "root"))
    assert flank.curve.stress_at(1e5) == pytest.approx(1.6 * 740.64e6 * 1.03, rel=1e-6)
    notch = (1 + 0.66346 * (value(root, "Y_S") - 1)) / 1.66346
    assert root.curve.stress_at(1e4) == pytest.approx(2.5 * 306e6 * 2 * notch, rel=1e-4)


@pytest.mark.parametrize(
    ("steel", "hardness", "endures", "bears"),
    [
        ("induction_hardened", 550, 0.66038, 0.76923),
        ("nitrided", 700, 0.60748, 0.60748),
        ("through_hardened", 300, 0.60748, 0.71429),
        ("case_hardened", 700, None, 0.82524),
    ],
)
def test_alternating_roots_of_planets_by_hand(tmp_path, steel, hardness, endures, bears):
    """ISO 6336-3, annex B, R = −1.2: Y_M = 1/(1 + 1.2 (1 − M)/(1 + M)) with M = 0.4, 0.3, 0.3 of
    endurance and 0.6, 0.3, 0.5 of static stress; 0.8 − 0.15 Y_S and 0.7 case-hardened."""
    changes = {"steel": steel, "vickers_hardness": hardness, "yield_strength": 6e8}
    keys = {f"stage.planet.rating.{key}": x for key, x in changes.items()}
    keys["rating.static_factors"] = "interpolated"
    state = rate(*pair_of(case_of(tmp_path, PLANETARY, **keys)), {})["planet", "root"]
    mean = 0.8 - 0.15 * value(state, "Y_S")
    expected = endures or 1 / (1 + 1.2 * (1 - mean) / (1 + mean))
    assert value(state, "Y_M") == pytest.approx(expected, rel=1e-5)
    stated = {**keys, "stage.planet.rating.mean_stress_ratio": 0.999999}
    pulsating = rate(*pair_of(case_of(tmp_path, PLANETARY, **stated)), {})["planet", "root"]
    ratio = state.curve.stress_at(1e3) / pulsating.curve.stress_at(1e3)
    assert ratio == pytest.approx(bears, rel=1e-5)


def test_a_gear_narrower_than_its_gear_mesh_is_one_line(tmp_path):
    case = case_of(tmp_path, PAIR, **{"stage.gear.rating.face_width": 0.04})
    with pytest.raises(
        InputError, match=r"gear\.rating\.face_width_mm: is 40 mm, .* is 45 mm wide"
    ):
        pair_of(case)


def test_gear_meshes_of_a_planet_may_differ_in_width(tmp_path):
    """The ring's is rated as in a stage of its width, the sun's as before."""
    ring = PLANETARY + '[[rating.gear_meshes]]\nkind = "ring"\nface_width_mm = 50\n'
    for role, width in (("ring", 0.05), ("sun", 0.06)):
        of_stage = case_of(tmp_path, PLANETARY, **{"stage.face_width": width})
        pairs = [pair_of(case, role) for case in (case_of(tmp_path, ring), of_stage)]
        first, second = (rate(*each, {}) for each in pairs)
        assert first == second
        factors = [method_b_inputs(*each, 1.0) for each in pairs]
        assert factors[0] == factors[1]


def test_floors_of_a_named_set_and_what_a_case_puts_in_their_place(tmp_path):
    changes = {"rating.limits": "wind", "rating.least_root_safety": 1.4}
    pair, load = pair_of(case_of(tmp_path, PLANETARY, **changes))
    least = [pair.rules.least(name) for name in ("dynamic_factor", "face_load_factor")]
    assert least == [1.05, 1.15]
    states = rate(pair, load, {})
    assert states["sun", "flank"].least_safety == 1.25
    assert states["sun", "root"].least_safety == 1.4


@pytest.mark.parametrize(
    ("part", "key", "place", "missing"),
    [
        ("sun", "steel", "flank", ["steel", "grade"]),
        ("sun", "flank_rz", "flank", ["flank_rz_um"]),
        ("planet", "root_rz", "root", ["root_rz_um"]),
        ("planet", "grade", "root", ["grade"]),
    ],
)
def test_a_missing_rating_key_is_named_and_the_part_not_assessed(
    tmp_path, part, key, place, missing
):
    changes = {f"stage.{part}.rating.{key}": None}
    if key == "steel":
        changes[f"stage.{part}.rating.grade"] = None
    pair, load = pair_of(case_of(tmp_path, PLANETARY, **changes))
    state = rate(pair, load, {})[part, place]
    assert list(state.missing) == missing
    assert state.curve is None and math.isnan(state.safety(1e6)) and "S_H" not in state.sheet(1e6)
    assert state.stress > 0
    if place == "flank":  # Z_R, and σ_Hlim in Z_L, are of both gears
        of_mate = rate(pair, load, {})["planet", "flank"].missing
        assert list(of_mate) == [f"sun.{key}" for key in missing]


def test_without_accuracy_there_is_no_factor_of_method_b(tmp_path):
    changes = {"stage.sun.rating.accuracy_grade": None}
    pair, load = pair_of(case_of(tmp_path, PLANETARY, **changes))
    factors = (dynamic_factor(pair, load, 1.0)[0], *transverse_factors(pair, load, 1.0, 1.0))
    assert all(map(math.isnan, factors))


def test_a_hardness_that_the_standard_has_no_strength_for_is_one_line(tmp_path):
    case = case_of(tmp_path, PAIR, **{"stage.gear.rating.vickers_hardness": 420.0})
    with pytest.raises(InputError, match=r"gear\.rating\.vickers_hardness: is 420") as caught:
        pair_of(case)
    assert "flank_strength_mpa" in str(caught.value)
    stated = {"stage.gear.rating.flank_strength": 8e8, "stage.gear.rating.root_strength": 3e8}
    rated = pair_of(case.with_(**stated))
    assert rated[0].gears["planet"].flank_strength == 8e8
    states = rate(*rated, {})
    assert states["planet", "flank"].factors["σ_Hlim"].source == "key flank_strength"
    assert states["sun", "flank"].factors["σ_Hlim"].source == "ISO 6336-5:2003, table 1"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("flank_rz_um = 4", "flank_rz_um = 4\nflank_ra_um = 1", "flank_ra.*beside flank_rz"),
        ('steel = "case_hardened"\n', "", r"steel.*is missing beside grade"),
        ('"case_hardened"', '"carburised"', "steel.*unknown"),
        ("edition = 2006", "edition = 2020", "edition.*2006, 2019"),
    ],
)
def test_wrong_keys_are_one_line_each(tmp_path, old, new, words):
    refused(tmp_path / "wrong.toml", PAIR, old, new, words)


def test_relief_counts_at_both_ends_of_the_path_on_whichever_gear(tmp_path):
    """B_k of tip relief on both gears, or of tip and root relief on one of them."""

    def relief(gear, end):
        key = f"stage.{gear}.modifications.{end}_relief"
        return {f"{key}.amount": 4e-5, f"{key}.length": 3e-3}

    base = {"stage.gear_mesh.model": "per_pair", "stage.gear.rating.accuracy_grade": 5}
    base["stage.pinion.rating.accuracy_grade"] = 5
    both, alone, none = (
        dynamic_factor(*pair_of(case_of(tmp_path, PAIR, **base, **first, **second)), 1.0)[0]
        for first, second in (
            (relief("pinion", "tip"), relief("gear", "tip")),
            (relief("pinion", "tip"), relief("pinion", "root")),
            ({}, {}),
        )
    )
    assert both == pytest.approx(alone, rel=1e-12)
    assert both != pytest.approx(none, rel=1e-3)


@pytest.mark.parametrize("edition", [2006, 2019])
@pytest.mark.parametrize("role", ["sun", "ring"])
def test_a_thinner_tooth_has_the_root_of_one_that_is_cut_deeper(tmp_path, edition, role):
    """A_sn moves the tool as a smaller profile shift does, while tip and path of contact stay."""
    tool = {"stage.ring.tool.teeth": 30, "stage.ring.root_fillet": 0.25}
    common = {"stage.center_distance": 0.12, "rating.edition": edition, **tool}
    case = case_of(tmp_path, PLANETARY, **common)
    shift = -0.16e-3 / (2 * 4e-3 * math.tan(math.radians(20)))
    member = getattr(case.stages[0], role)
    thin = case.with_(**{f"stage.{role}.rating.thickness_deviation": -0.16e-3})
    deep = case.with_(
        **{
            f"stage.{role}.profile_shift": member.profile_shift + shift,
            f"stage.{role}.addendum": member.addendum - shift,
        }
    )
    sheets = [rate(*pair_of(x, role), {})[role, "root"].factors for x in (case, thin, deep)]
    for symbol in ("Y_F", "Y_S", "s_Fn/m_n", "ρ_F/m_n"):
        nominal, thinner, deeper = (sheet[symbol].value for sheet in sheets)
        assert thinner == pytest.approx(deeper, rel=1e-9)
        assert abs(thinner / nominal - 1) > 1e-3
    assert sheets[1]["ε_α"].value == pytest.approx(sheets[0]["ε_α"].value, rel=1e-12)


def test_half_of_the_pitch_deviation_where_modifications_compensate(tmp_path):
    """K_Fα = ε_γ/2 (0.9 + 0.4 c_γα (f_pb − y_α)/w), spur gears of equal case-hardened steel."""
    settings = {f"stage.{part}.rating.pitch_deviation": 32e-6 for part in ("sun", "planet")}
    settings |= {f"stage.{part}.rating.profile_deviation": 1e-6 for part in ("sun", "planet")}
    values = []
    for share in (1.0, 0.5):
        case = case_of(tmp_path, PLANETARY, **settings, **{"rating.pitch_deviation_share": share})
        pair, load = pair_of(case)
        inputs = method_b_inputs(pair, load, 1.0)
        base_pitch = share * 32.0 * math.cos(math.radians(20))
        effective = base_pitch - min(0.075 * base_pitch, 3.0)
        width = load.tangential_force / 60.0
        overlap = pair.geometry.transverse_contact_ratio
        by_hand = overlap / 2 * (0.9 + 0.4 * inputs["c_γα"] * effective / (1.3 * width))
        values.append(transverse_factors(pair, load, 1.0, 1.3)[1])
        assert values[-1] == pytest.approx(by_hand, rel=1e-9)
        assert inputs["f_pb,eff"] == pytest.approx(32 * math.cos(math.radians(20)) * 0.925)
    assert values[0] > values[1] > 1.0
