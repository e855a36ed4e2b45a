"""Load cases, written in a case or in a table, against ratios and powers of a train by hand."""

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_train import SMALL

from flexgear.files.load_files import table_of_bins
from flexgear.gears.implausible import implausible
from flexgear.gears.load_bins import bins_of_load_cases, case_in_bin, idle_loads
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.model.load_cases import LoadCase

IN, OUT, RATIO = "stage_1.carrier", "stage_2.pinion", -8.0  # 1 + 60/20 and −40/20
TRAIN = SMALL.replace("teeth = 60", "teeth = 60, addendum = 0.8")  # no interference
RATED = 1e3 / (10 * math.pi / 30)  # 1 kW at 10 r/min
TABLE = """name,hours,torque_nm,speed_rpm,moment_x_knm,stage_2.gear.force_y_n,extreme
part,100,300,5,0.2,-40,0
full,50,900,,,,0
storm,,1200,0,,,1
"""


@pytest.fixture
def case_with(tmp_path):
    def make(cases="", table="", total=""):
        path = tmp_path / "mine.toml"
        spectrum = "\n[spectrum]\n" if table or total else ""
        if table:
            (tmp_path / "bins.csv").write_text(table, encoding="utf-8")
            spectrum += 'file = "bins.csv"\n'
        path.write_text(f"{TRAIN}\n{cases}{spectrum}{total}", encoding="utf-8")
        return load_case(path)

    return make


def in_case(**keys):
    lines = (f"{key} = {value}" for key, value in keys.items())
    return "[[load_cases]]\n" + "\n".join(lines) + "\n"


def test_speeds_and_torques_follow_by_ratio_and_power(case_with):
    case = case_with(in_case(hours=10, torque_nm=300, speed_rpm=5))
    (load_bin,) = bins_of_load_cases(case)
    speed = 5 * math.pi / 30
    assert load_bin.speed[OUT] == pytest.approx(RATIO * speed, rel=1e-12)
    assert load_bin.torque[IN] == pytest.approx(300)
    assert load_bin.torque[OUT] == pytest.approx(-300 / RATIO, rel=1e-12)
    assert load_bin.turns(speed) == pytest.approx(10 * 60 * 5, rel=1e-12)
    flow = power_flow(case_in_bin(case, load_bin))
    assert flow.torque[OUT] == pytest.approx(load_bin.torque[OUT], rel=1e-12)
    assert flow.speed == pytest.approx(dict(load_bin.speed), rel=1e-12)


@pytest.mark.parametrize(
    "keys", ["power_kw = 0.5", "members = [{ member = 'stage_2.pinion', torque_nm = TWICE }]"]
)
def test_torque_may_be_stated_at_either_end_or_as_power(case_with, keys):
    text = in_case(hours=1) + keys.replace("TWICE", repr(-0.5 * RATED / RATIO))
    (load_bin,) = bins_of_load_cases(case_with(text))
    assert load_bin.torque[IN] == pytest.approx(0.5 * RATED, rel=1e-9)


def test_a_load_case_without_torque_or_speed_has_the_rated_ones(case_with):
    case = case_with(in_case(cycles=6e5))
    (load_bin,) = bins_of_load_cases(case)
    assert load_bin.hours == pytest.approx(6e5 / 10 / 60, rel=1e-12)
    assert load_bin.torque[IN] == pytest.approx(RATED, rel=1e-12)
    assert load_bin.name == "load case 1"


def test_a_moment_on_a_member_inside_changes_the_output_alone(case_with):
    text = in_case(hours=1, torque_nm=300)
    text += "members = [{ member = 'stage_2.gear', moment_nm = [3, 0, 7] }]\n"
    (load_bin,) = bins_of_load_cases(case_with(text))
    assert load_bin.torque[IN] == pytest.approx(300)
    # power: T_in ω + T_out (−8 ω) + 7 · 4 ω = 0
    assert load_bin.torque[OUT] == pytest.approx((300 + 4 * 7) / 8, rel=1e-12)
    assert [load.member for load in load_bin.loads] == ["stage_2.gear"]
    assert load_bin.loads[0].first == pytest.approx([0, 0, 0, 3, 0, 7])


def test_rows_of_a_table_are_load_cases(case_with):
    case = case_with(in_case(name='"before"', hours=7), TABLE)
    before, part, full, storm = bins_of_load_cases(case)
    assert (before.name, before.hours) == ("before", 7)
    assert (part.hours, part.torque[IN]) == (100, pytest.approx(300))
    assert part.speed[IN] == pytest.approx(5 * math.pi / 30)
    loads = {load.member: list(load.first) for load in part.loads}
    assert loads == {IN: [0, 0, 0, 200, 0, 0], "stage_2.gear": [0, -40, 0, 0, 0, 0]}
    assert full.speed[IN] == pytest.approx(10 * math.pi / 30)
    assert full.loads == case.loads
    assert storm.extreme and not storm.hours and storm.speed[OUT] == 0.0
    assert storm.torque[OUT] == pytest.approx(1200 / 8)
    assert storm.source.endswith("bins.csv line 4")


def test_load_factors_of_a_load_case_replace_those_of_the_rating(case_with):
    """Of all gear meshes, of a stage, of one kind; a table written of the bins has them again."""
    more = "[rating]\nk_h_beta = 1.2\nleast_flank_safety = 1.25\nleast_static_flank_safety = 1.0\n"
    some = in_case(hours=7, k_v=1.1) + '[[load_cases.gear_meshes]]\nkind = "ring"\nk_v = 1.15\n'
    titles = "name,hours,extreme,k_h_beta,stage_1.k_h_beta,stage_1.ring.k_gamma\n"
    case = case_with(some, titles + "part,100,,1.3,1.4,1.5\nfull,50,,,,\nstorm,,1,,,\n", more)
    text = table_of_bins(bins_of_load_cases(case), [IN, OUT])
    again = case_with(table=text, total=more)
    for each in (case, again):
        rules = [case_in_bin(each, b).rating for b in bins_of_load_cases(each)]
        first, part, full, storm = (
            [r.forced(*at) for at in (("stage_1", "sun"), ("stage_1", "ring"), ("stage_2", "sun"))]
            for r in rules
        )
        assert [f.k_v for f in first] == [1.1, 1.15, 1.1]
        assert [f.k_h_beta for f in part] == [1.4, 1.4, 1.3]
        assert [f.k_gamma for f in part] == [None, 1.5, None]
        assert [f.k_h_beta for f in (*full, *storm)] == [1.2] * 6
        assert [r.least("flank_safety") for r in rules] == [1.25, 1.25, 1.25, 1.0]
        assert {r.least("root_safety") for r in rules} == {1.0}


def test_every_bin_has_its_own_name(case_with):
    """A default name gives way to a stated one: two alike would be one in rating.json."""
    table = "name,hours\n,1\n,2\nload case 2,3\n,4\n"
    bins = bins_of_load_cases(case_with(table=table))
    names = ["load case 1", "load case 2 (number 2)", "load case 2", "load case 4"]
    assert [load_bin.name for load_bin in bins] == names
    series = [LoadCase(name="bin 1", hours=1.0), LoadCase(name="bin 2", hours=1.0)]
    bins = bins_of_load_cases(case_with(in_case(name='"bin 1"', hours=7)), series)
    assert [load_bin.name for load_bin in bins] == ["bin 1", "bin 1 (number 2)", "bin 2"]


@pytest.mark.parametrize(
    ("kinematics", "named"),
    [("planar", ("forces along z", "moments about x")), ("axial", ("moments about x",)),
     ("spatial", ())],
)  # fmt: skip
def test_loads_without_effect_are_named(case_with, kinematics, named):
    """The hub moment of a carrier that cannot tilt would be left out of the rating in silence."""
    text = in_case(hours=1, force_kn="[1, 0, 2]", moment_knm="[0.3, 0, 0]")
    case = case_with(text).with_(**{"kinematics": kinematics, "stages.stage_1.planets": 4})
    warnings = [w for w in implausible(case, power_flow(case)) if "no effect" in w]
    stated = f"loads on {IN}: {', '.join(named)} have no effect, as it does not move there; "
    assert [w.startswith(stated) for w in warnings] == [True] * bool(named)
    (load_bin,) = bins_of_load_cases(case)
    assert len(idle_loads(case, [(x.member, x.first) for x in load_bin.loads])) == bool(named)


def test_where_a_table_lies_and_how_it_is_written_is_no_part_of_the_content(case_with):
    first = case_with(table=TABLE).content_hash("load_cases")
    assert first == case_with(table="# made by hand\n" + TABLE).content_hash("load_cases")
    assert first != case_with(table=TABLE.replace("300", "301")).content_hash("load_cases")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (in_case(torque_nm=300), r"load_cases\[0\].hours: is missing -- add hours or cycles"),
        (in_case(hours=1, cycles=3), r"load_cases\[0\].cycles: is given beside hours"),
        (in_case(hours=1, extreme="true"), r"load_cases\[0\].hours: is given for an extreme"),
        (in_case(hours=1, torque_knm=955), "1000 times the rated 954.9.*N m for kN m"),
        (in_case(hours=1, torque_nm=0.9549), "load_cases: have at most 0.9549 N m.*kN m for N m"),
        (in_case(hours=1, torque_nm=-300), "against the rated sense.*back_driven = true"),
        (in_case(hours=1, torque_nm=300, speed_rpm=-10),
         "torque: has its rated sense, but stage_1.carrier turns the other way, by its speed"),
        (in_case(hours=1, moment_knm=[300, 0, 0]), "moment: is 3e.05 N m .* N m for kN m"),
        (in_case(hours=1, force_kn=[0, -5000, 0]), "force: is 5e.06 N .* of a gear mesh.* for kN"),
        (in_case(hours=1, speed_rad_per_s=10), "95.493 r/min is 9.55 times the rated 10 r/min"),
        (in_case(hours=1, speed_rpm=5, members=[{}]).replace(
            "[{}]", "[{ member = 'stage_2.pinion', speed_rpm = -50 }]"),
         r"load_cases\[0\].members\[0\].speed: is -50 r/min, but the train makes .* at -40"),
        (in_case(hours=1, torque_nm=400, members=[{}]).replace(
            "[{}]", "[{ member = 'stage_2.pinion', torque_nm = 40 }]"),
         "makes 40 N m on stage_2.pinion, but the other torques make it 50"),
        (in_case(hours=1, members=[{}]).replace(
            "[{}]", "[{ member = 'stage_2.gear', torque_nm = 40 }]"),
         "is given for stage_2.gear, which is neither input nor output"),
        (in_case(hours=1, moment_nm=[0, 0, 5]), "about the axis of stage_1.carrier"),
        (in_case(hours=1, torque_nm=1, power_kw=1), "power_kw: is given beside torque"),
        (in_case(hours=1, torque=1), r"load_cases\[0\].torque: has no unit"),
        (in_case(name='"a"', hours=1) * 2, "name: 'a' is also the name of number 1"),
    ],
)  # fmt: skip
def test_load_cases_that_do_not_fit_the_train_are_one_line(case_with, text, words):
    with pytest.raises(InputError, match=words) as caught:
        bins_of_load_cases(case_with(text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "300",
            "300000",
            r"bins.csv: line 2, torque_nm: makes 300000 N m .* 314.2 times",
        ),
        (",300", ",-300", "bins.csv: line 2, torque_nm: .* against the rated sense"),
        ("100,300", "1e9,300", r"bins.csv: line 2, hours: 1e\+09 is outside"),
        ("100,300", "x,300", r"bins.csv: line 2, hours: 'x' is not a number"),
        ("100,300", ",300", r"bins.csv: line 2, hours: is missing"),
        ("full", "part", r"bins.csv: line 3, name: 'part' is also the name"),
        ("torque_nm", "torque", r"bins.csv: column 'torque': is not known -- did you mean torque_"),
        ("stage_2.gear", "stage_2.gears", "bins.csv: line 2.*'stage_2.gears' is not a member"),
        (",0\n", ",0,0,5\n", "bins.csv: line 2: has 9 cells under 7 titles"),
        ("part,100,300,5,0.2,-40,0", "part,100", "line 2: has 2 cells .* -- is the file complete"),
        ("speed_rpm", "torque_nm", "bins.csv: column torque_nm: occurs twice -- keep one of them"),
        ("speed_rpm", "torque_knm", "bins.csv: column torque_knm: is beside torque_nm -- keep one"),
        (TABLE[TABLE.index("part") :], "", "bins.csv: load spectrum: has titles, but no load case"),
        ("0\nfull", "perhaps\nfull", "line 2, extreme: 'perhaps' is neither 1 nor 0"),
    ],
)
def test_a_wrong_table_is_one_line_with_its_place(case_with, old, new, words):
    with pytest.raises(InputError, match=words):
        bins_of_load_cases(case_with(table=TABLE.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("title", "cell", "words"),
    [
        ("stage_2.pinion.speed_rpm", "-50", "is -50 r/min, but the train makes"),
        ("stage_2.pinion.power_kw", "5", "against the rated sense"),
        ("stage_2.gear.force_y_n", "1e9", "is 1e.09 N on stage_2.gear"),
        ("stage_3.k_v", "1.2", "'stage_3' is no stage -- did you mean"),
        ("stage_1.rim.k_v", "1.2", "'rim' is unknown -- use one of sun, ring"),
        ("stage_1.k_h_beta", "0.9", "0.9 is outside 1"),
    ],
)
def test_a_wrong_value_of_another_member_is_named_by_the_title_of_its_column(
    case_with, title, cell, words
):
    table = f"name,hours,speed_rpm,{title}\npart,100,5,{cell}\n"
    with pytest.raises(InputError, match=rf"bins.csv: line 2, {title}: .*{words}"):
        bins_of_load_cases(case_with(table=table))


def test_a_first_line_may_state_the_separator(case_with):
    """As of tables that Excel is to open."""
    plain = bins_of_load_cases(case_with(table=TABLE))
    named = bins_of_load_cases(case_with(table="sep=;\n" + TABLE.replace(",", ";")))
    assert [(b.name, b.torque, b.loads) for b in named] == [
        (b.name, b.torque, b.loads) for b in plain
    ]


def test_hours_are_held_to_their_total(case_with):
    assert case_with(table=TABLE, total="total_hours = 150").spectrum.total_hours == 150
    with pytest.raises(InputError, match=r"total_hours: is 200, but the hours of all .* up to 150"):
        case_with(table=TABLE, total="total_hours = 200")


def test_turns_are_held_to_the_total_hours_too(case_with):
    """6000 turns at 10 r/min are 10 h."""
    table = "name,cycles,speed_rpm\na,6000,10\n"
    (load_bin,) = bins_of_load_cases(case_with(table=table, total="total_hours = 10\n"))
    assert load_bin.hours == pytest.approx(10.0)
    with pytest.raises(InputError, match="add up to 10"):
        bins_of_load_cases(case_with(table=table, total="total_hours = 5\n"))


def test_a_bin_of_zero_hours_is_no_load(case_with):
    """An empty class of a histogram would be rated for endurance, and decide the safety."""
    table = "name,hours,torque_nm\npart,100,300\nempty,0,1900\n"
    assert [b.name for b in bins_of_load_cases(case_with(table=table))] == ["part"]


def test_hours_may_be_shares_of_the_total(case_with):
    shares = TABLE.replace("hours", "share", 1)
    shares = shares.replace("part,100,", "part,0.4,").replace("full,50,", "full,0.6,")
    case = case_with(table=shares, total="total_hours = 150")
    assert [b.hours for b in bins_of_load_cases(case)] == pytest.approx([60, 90, 0])
    with pytest.raises(InputError, match=r"bins.csv: line 2, share: needs a total"):
        case_with(table=shares)
    percent = shares.replace("0.4,", "40,").replace("0.6,", "60,")
    with pytest.raises(InputError, match=r"bins.csv: line 2, share: 40 is above 1 -- .* per cent"):
        case_with(table=percent, total="total_hours = 150")


def test_coasting_by_intent_is_taken(case_with):
    (load_bin,) = bins_of_load_cases(
        case_with(in_case(hours=1, torque_nm=-300, back_driven="true"))
    )
    assert load_bin.torque[OUT] == pytest.approx(-300 / 8)


@pytest.mark.slow
@settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.integers(0, len(TABLE)), st.integers(0, 12), st.text(max_size=6))
def test_any_damage_to_a_table_is_one_line_or_none(case_with, place, cut, put):
    damaged, lines = TABLE[:place] + put + TABLE[place + cut :], []
    try:
        bins_of_load_cases(case_with(table=damaged))
    except InputError as fault:
        lines = str(fault).splitlines()
    assert len(lines) <= 1
