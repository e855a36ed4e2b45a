"""Series sorted into bins: what is kept, what splitting changes, and files of every form."""

import math

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from openfast_files import write_out, write_outb
from small_train import SMALL

from flexgear.files.load_files import table_of_bins
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.solve.load_series import HOUR, bins_of_series, load_bins
from flexgear.views.study_charts import load_duration_chart

TRAIN = SMALL.replace("teeth = 60", "teeth = 60, addendum = 0.8")  # no interference
IN = "stage_1.carrier"
RPM = math.pi / 30
RATED = 1e3 / (10 * RPM)  # 1 kW at 10 r/min


def series(samples=2001, seed=1):
    """A rotor in wind: torque in kN m about the rated 0.955, speed about the rated 10 r/min."""
    random = np.random.default_rng(seed)
    time = 60.0 + 0.05 * np.arange(samples)
    slow = np.cumsum(random.normal(size=samples)) / math.sqrt(samples)
    return {
        "Time": time,
        "RotTorq": 0.7 + 0.3 * np.sin(0.1 * time) + 0.05 * slow,
        "RotSpeed": 9.0 + 0.8 * np.cos(0.07 * time) + 0.1 * slow,
        "LSSGagMys": 0.3 + 0.1 * random.normal(size=samples),
        "LSSGagMzs": -0.1 + 0.1 * random.normal(size=samples),
    }


@pytest.fixture
def case_with(tmp_path):
    def make(files=(("*.outb", 3000),), keys='moment = ["LSSGagMys", "LSSGagMzs"]'):
        text = (
            f'{TRAIN}\n[load_series]\nyears = 20\ntorque = "RotTorq"\nspeed = "RotSpeed"\n{keys}\n'
        )
        for name, hours in files:
            text += f'[[load_series.design_load_cases]]\nname = "{name}"\nfiles = "{name}"\n'
            text += f"hours_per_year = {hours}\n" if hours else "extreme = true\n"
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return load_case(path)

    return make


def turns_of(bins):
    return sum(b.turns(b.speed[IN]) for b in bins)


def mean_speed(columns, name="RotSpeed"):
    time = columns["Time"]
    return float(np.trapezoid(columns[name], time) / (time[-1] - time[0]))


@pytest.mark.parametrize("value", ["damage", "edge"])
def test_hours_and_turns_are_those_of_the_samples(case_with, tmp_path, value):
    columns = series()
    write_outb(tmp_path / "a.outb", columns, form=3)
    bins = load_bins(case_with(keys=f'value = "{value}"'))
    lasting = [b for b in bins if not b.extreme]
    assert len(lasting) > 10
    assert sum(b.hours for b in bins) == pytest.approx(60_000, rel=1e-12)
    turns = 60_000 * 60 * mean_speed(columns)
    assert turns_of(lasting) == pytest.approx(turns, rel=1e-12)


@pytest.mark.parametrize("exponent", [1.0, 10 / 3, 6.6, 8.7])
def test_damage_by_the_stated_exponent_is_that_of_the_samples(case_with, tmp_path, exponent):
    columns = series()
    write_outb(tmp_path / "a.outb", columns, form=3)
    case = case_with(keys=f"exponent = {exponent}")
    bins = [b for b in load_bins(case) if not b.extreme]
    damage = sum(b.turns(b.speed[IN]) * abs(b.torque[IN]) ** exponent for b in bins)
    turns = columns["RotSpeed"] / 60 * (1e3 * columns["RotTorq"]) ** exponent
    time = columns["Time"]
    mean = np.trapezoid(turns, time) / (time[-1] - time[0])
    assert damage == pytest.approx(60_000 * 3600 * mean, rel=1e-12)
    assert bins_of_series(case).damage_of_bins(6.6) == pytest.approx(1, rel=5e-3)


def test_the_upper_edge_damages_more_than_the_samples(case_with, tmp_path):
    write_outb(tmp_path / "a.outb", series(), form=3)
    assert 1.0 < bins_of_series(case_with(keys='value = "edge"')).damage_of_bins(6.6) < 1.5


def test_split_and_reordered_files_give_the_same_bins(case_with, tmp_path):
    columns = series()
    write_outb(tmp_path / "whole.outb", columns, form=3)
    for name, part in (("b", slice(0, 701)), ("a", slice(700, None))):
        write_outb(tmp_path / f"{name}.part.outb", {k: v[part] for k, v in columns.items()}, form=3)
    whole = [b for b in load_bins(case_with([("whole.outb", 3000)])) if not b.extreme]
    parts = [b for b in load_bins(case_with([("*.part.outb", 3000)])) if not b.extreme]
    assert len(whole) == len(parts)
    for one, other in zip(whole, parts, strict=True):
        assert one.hours == pytest.approx(other.hours, rel=1e-12)
        assert one.torque[IN] == pytest.approx(other.torque[IN], rel=1e-12)
        assert one.loads[0].moment == pytest.approx(other.loads[0].moment, rel=1e-9, abs=1e-9)


def test_finer_bins_change_damage_by_other_exponents_less_and_less(case_with, tmp_path):
    write_outb(tmp_path / "a.outb", series(), form=3)
    wrong = [
        abs(bins_of_series(case_with(keys=f"torque_step_nm = {s}")).damage_of_bins(8.7) - 1)
        for s in (200, 100, 50, 25)
    ]
    orders = np.log2(np.array(wrong[:-1]) / wrong[1:])
    assert 1.6 < orders.mean() < 2.4


def test_constant_series_are_one_bin_of_their_load(case_with, tmp_path):
    time = np.arange(101.0)
    columns = {"Time": time, "RotTorq": 0.63 + 0 * time, "RotSpeed": 7.0 + 0 * time,
               "LSSGagMys": 0.2 + 0 * time, "LSSGagMzs": -0.4 + 0 * time}  # fmt: skip
    write_out(tmp_path / "a.out", columns)
    lasting, *extreme = load_bins(case_with([("a.out", 100)]))
    assert lasting.torque[IN] == pytest.approx(630, rel=1e-9)
    assert lasting.speed[IN] == pytest.approx(7 * RPM, rel=1e-9)
    assert lasting.loads[0].moment == pytest.approx((200, -400, 0), rel=1e-9)
    assert [b.name for b in extreme] == ["largest torque", "largest bending moment"]


def test_extremes_keep_what_acts_at_the_same_time(case_with, tmp_path):
    columns = series()
    columns["LSSGagMzs"][1234] = -5.0
    columns["RotTorq"][77] = 1.9
    columns["RotTorq"][99] = -0.4
    write_outb(tmp_path / "a.outb", columns, form=3)
    bins = {b.name: b for b in load_bins(case_with([("a.outb", None)]))}
    assert len(bins) == 3 and all(b.extreme and b.hours == 0 for b in bins.values())
    bending = bins["largest bending moment"]
    assert bending.torque[IN] == pytest.approx(1e3 * columns["RotTorq"][1234])
    assert bending.loads[0].moment[1] == pytest.approx(-5000)
    assert bins["largest torque"].torque[IN] == pytest.approx(1900)
    assert bins["largest torque against the rated"].torque[IN] == pytest.approx(-400)
    assert "a.outb at 121.7 s" in bending.source


def test_moments_along_axes_of_the_rotor_are_turned_back(case_with, tmp_path):
    time = np.arange(0.0, 60.0, 0.01)
    azimuth = 42.0 * time  # deg, 7 r/min
    turn = np.radians(azimuth)
    columns = {"Time": time, "RotTorq": 0.6 + 0 * time, "RotSpeed": 7 + 0 * time,
               "Azimuth": azimuth % 360.0,
               "LSSGagMys": 0.3 * np.cos(turn) + 0.1 * np.sin(turn),
               "LSSGagMzs": -0.3 * np.sin(turn) + 0.1 * np.cos(turn)}  # fmt: skip
    write_outb(tmp_path / "a.outb", columns, form=3)
    keys = 'moment = ["LSSGagMys", "LSSGagMzs"]\nmoment_step_nm = 70\nazimuth = "Azimuth"'
    lasting = [b for b in load_bins(case_with(keys=keys)) if not b.extreme]
    assert len(lasting) == 1
    assert lasting[0].loads[0].moment == pytest.approx((300, 100, 0), rel=1e-9)


@pytest.mark.parametrize("form", [1, 2, 3, 4])
def test_all_binary_forms_and_text_say_the_same(case_with, tmp_path, form):
    columns = series(500)
    write_out(tmp_path / "a.out", columns)
    write_outb(tmp_path / "a.outb", columns, form)
    step = "torque_step_nm = 1e4\nspeed_step_rpm = 100"
    (text, *_), (packed, *_) = (load_bins(case_with([(f, 1)], step)) for f in ("a.out", "a.outb"))
    assert packed.torque[IN] == pytest.approx(text.torque[IN], rel=3e-5)
    assert packed.speed[IN] == pytest.approx(text.speed[IN], rel=3e-5)


def test_csv_and_netcdf_say_the_same(case_with, tmp_path):
    columns = series(300)
    write_out(tmp_path / "a.out", columns)
    rows = [
        ";".join(f"{x:.8e}".replace(".", ",") for x in row)
        for row in zip(*columns.values(), strict=True)
    ]
    titles = ["Time [s]", "RotTorq (kN m)", "RotSpeed", "LSSGagMys", "LSSGagMzs"]
    (tmp_path / "a.csv").write_text("\n".join(["sep=;", ";".join(titles), *rows]))
    units = dict(zip(columns, ["s", "kN m", "1/min", "kNm", "kNm"], strict=True))
    data = {k: ("t", v, {"units": units[k]}) for k, v in columns.items() if k != "Time"}
    xr.Dataset(data, {"Time": ("t", columns["Time"], {"units": "s"})}).to_netcdf(tmp_path / "a.nc")
    keys = 'moment = ["LSSGagMys [kN m]", ""]'.replace("[kN m]", "[kN m]")
    text, netcdf = (load_bins(case_with([(f, 1)], keys)) for f in ("a.out", "a.nc"))
    csv = load_bins(case_with([("a.csv", 1)], keys).with_(load_series__speed="RotSpeed [rpm]"))
    for other in (netcdf, csv):
        assert [b.hours for b in other] == pytest.approx([b.hours for b in text])
        assert [b.torque[IN] for b in other] == pytest.approx([b.torque[IN] for b in text])
    titles[3] = "RotTorq [N m]"
    for content, words in (
        ("", "load series: is empty"),
        (";".join(titles), "RotTorq: occurs twi"),
    ):
        (tmp_path / "a.csv").write_text(content)
        with pytest.raises(InputError, match=words):
            load_bins(case_with([("a.csv", 1)], ""))


def test_the_start_up_at_the_beginning_of_a_file_is_left_out(case_with, tmp_path):
    columns = series()
    late = {k: v[1000:] for k, v in columns.items()}
    columns["RotTorq"][:1000] = 40.0
    write_outb(tmp_path / "a.outb", columns, form=3)
    write_outb(tmp_path / "late.outb", late, form=3)
    one = load_bins(case_with([("a.outb", 10)], "start_s = 50"))
    other = load_bins(case_with([("late.outb", 10)], ""))
    assert [b.hours for b in one] == pytest.approx([b.hours for b in other], rel=1e-9)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ({"cut": 9000}, r"a.outb: load series: ends after 9000 bytes, and needs .* cut short"),
        ({"cut": 61}, "a.outb: load series: ends after 61 bytes"),
        ({"cut": 0}, "a.outb: load series: ends after 0 bytes"),
        ({"units": {"RotTorq": "deg"}}, "a.outb: RotTorq: is in 'deg', which is no unit of torque"),
        ({"units": {"RotTorq": "-"}}, r'RotTorq: has no unit of torque -- .* torque = "Rot'),
        ({"form": 9}, "begins with 9, which is no form of .outb"),
    ],
)  # fmt: skip
def test_a_bad_binary_file_is_one_line(case_with, tmp_path, damage, words):
    write_outb(tmp_path / "a.outb", series(), **{"form": 4, **damage})
    with pytest.raises(InputError, match=words):
        load_bins(case_with())


@pytest.mark.parametrize("place", [4, 8])  # in a file of form 4: number of channels, of samples
def test_room_is_made_only_for_what_a_file_holds(case_with, tmp_path, place):
    write_outb(tmp_path / "a.outb", series(), form=4)
    content = bytearray((tmp_path / "a.outb").read_bytes())
    content[place : place + 4] = b"\xff\xff\xff\x7f"
    (tmp_path / "a.outb").write_bytes(content)
    with pytest.raises(InputError, match="ends after"):
        load_bins(case_with())


def test_a_text_file_that_ends_within_a_number_is_one_line(case_with, tmp_path):
    """1.2E+0 of 1.2E+02 is a number, too."""
    write_out(tmp_path / "a.out", series(), cut=-2)
    with pytest.raises(
        InputError, match=r"a.out: line \d+: ends within a number -- the file is cut"
    ):
        load_bins(case_with([("a.out", 10)]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: c.pop("RotSpeed"), "a.outb: RotSpeed: is not in the file -- use one of Time"),
        (lambda c: c["RotTorq"].__setitem__(5, math.nan), "RotTorq: sample 6 is nan -- "),
        (lambda c: c["RotTorq"].__imul__(-1), 'with the other sign: torque = "-RotTorq"'),
        (lambda c: c["RotTorq"].__imul__(1000), "times the rated 954.93 -- check the unit"),
        (lambda c: c["RotSpeed"].__imul__(97), r"times the rated 10 r/min -- check the unit"),
    ],
)  # fmt: skip
def test_a_bad_channel_is_one_line(case_with, tmp_path, change, words):
    columns = series()
    change(columns)
    write_outb(tmp_path / "a.outb", columns, form=3)
    with pytest.raises(InputError, match=words):
        load_bins(case_with())


def test_a_sign_in_the_case_turns_a_channel(case_with, tmp_path):
    columns = series()
    write_outb(tmp_path / "a.outb", columns, form=3)
    first = load_bins(case_with())
    columns["RotTorq"] *= -1
    write_outb(tmp_path / "a.outb", columns, form=3)
    turned = load_bins(case_with().with_(load_series__torque="-RotTorq"))
    assert [b.torque[IN] for b in turned] == pytest.approx([b.torque[IN] for b in first])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("years = 20", "", "load_series.years: is missing"),
        ('"a.outb"', '"b.outb"', "load_series.design_load_cases: .*b.outb' names no file"),
        ("hours_per_year = 5", "", r"design_load_cases\[0\].hours_per_year: is missing"),
        (
            "hours_per_year = 5",
            "hours_per_year = 5000\n[[load_series.design_load_cases]]\n"
            'name = "more"\nfiles = "a.outb"\nhours_per_year = 4000',
            "last 9000 h a year together",
        ),
        ('"RotTorq"', '"RotTorq [nm"', "load_series.torque: 'RotTorq .nm' names no channel"),
        ("years = 20", 'years = 20\nforce = ["Fx","",""]', "load_series.force_step_n: is missing"),
        ("years = 20", "years = 20\nstart_s = 1000", "load_series.start: leaves out all of"),
        ('"RotTorq"', '"RotTorq [N m]"', "is in kN-m in the file, and in N m in the case"),
        ("years = 20", "years = 20\ntorque_step_nm = 1e-9", "load_series.torque_step: .*wider one"),
    ],
)
def test_a_wrong_section_is_one_line(case_with, tmp_path, old, new, words):
    write_outb(tmp_path / "a.outb", series(), form=4)
    case_with([("a.outb", 5)])
    path = tmp_path / "mine.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=words):
        load_bins(load_case(path))


def test_the_content_of_a_case_is_that_of_its_series(case_with, tmp_path):
    write_outb(tmp_path / "a.outb", series())
    first = case_with().content_hash()
    write_outb(tmp_path / "a.outb", series(seed=2))
    assert case_with().content_hash() != first


@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.sampled_from(["out", "outb"]), st.integers(0, 3000), st.integers(0, 9), st.binary(max_size=9)
)
def test_any_damage_to_a_file_is_one_line_or_none(case_with, tmp_path, ending, place, cut, put):
    path, lines = tmp_path / f"a.{ending}", []
    (write_out if ending == "out" else write_outb)(path, series(20))
    content = path.read_bytes()
    path.write_bytes(content[:place] + put + content[place + cut :])
    try:
        bins = load_bins(case_with([(path.name, 10)]))
        assert sum(b.hours for b in bins) == pytest.approx(200)
    except InputError as fault:
        lines = str(fault).splitlines()
    assert len(lines) <= 1


def test_bins_written_as_a_table_are_read_as_they_were(case_with, tmp_path):
    columns = series()
    columns["RotTorq"][500:600] -= 1.5  # against the rated sense
    write_outb(tmp_path / "a.outb", columns, form=3)
    case = case_with()
    bins = load_bins(case)
    (tmp_path / "bins.csv").write_text(table_of_bins(bins, [p.member for p in case.ports]))
    text = (tmp_path / "mine.toml").read_text().partition("[load_series]")[0]
    path = tmp_path / "table.toml"
    path.write_text(f'{text}[spectrum]\nfile = "bins.csv"\ntotal_hours = 60000')
    again = load_bins(load_case(path))
    assert any(b.back_driven for b in bins) and any(b.extreme for b in bins)
    for first, second in zip(bins, again, strict=True):
        assert (first.name, first.extreme) == (second.name, second.extreme)
        assert second.hours == pytest.approx(first.hours, rel=1e-13)
        assert dict(second.torque) == pytest.approx(dict(first.torque), rel=1e-13)
        assert dict(second.speed) == pytest.approx(dict(first.speed), rel=1e-13)
        assert second.loads[0].first == pytest.approx(first.loads[0].first, rel=1e-13)


def test_the_duration_curve_ends_at_all_turns(case_with, tmp_path):
    write_outb(tmp_path / "a.outb", series(), form=3)
    case = case_with()
    bins, sums = load_bins(case), bins_of_series(case)
    ax = load_duration_chart(bins, IN, sums).axes[0]
    exceeded, torque = ax.lines[0].get_data()
    assert exceeded[-1] == pytest.approx(sums.turns, rel=1e-12)
    assert np.all(np.diff(torque) < 0)
    values, edges, _ = ax.patches[0].get_data()
    assert edges[-1] == pytest.approx(sums.turns, rel=1e-12)
    assert np.all(np.diff(values) <= 0)
    # at the turns of each bin's middle the samples' torque lies within a bin's width
    middles = (edges[1:] + edges[:-1]) / 2
    assert np.interp(middles, exceeded, torque) == pytest.approx(values, abs=RATED / 20)


def test_a_bin_lasts_as_long_as_its_turns_take(case_with, tmp_path):
    write_outb(tmp_path / "a.outb", series(), form=3)
    sums = bins_of_series(case_with())
    hours = sum(c.hours for c in sums.load_cases if c.hours)
    turns = sum(c.hours * HOUR * c.speed / 2 / math.pi for c in sums.load_cases if c.hours)
    assert hours == pytest.approx(sums.hours, rel=1e-12)
    assert turns == pytest.approx(sums.turns, rel=1e-12)
    assert sum(sums.duration.values()) == pytest.approx(sums.turns, rel=1e-12)
    assert sums.changes == 0.0


def test_changes_of_the_sense_of_torque_are_those_of_all_repetitions_of_a_series(
    case_with, tmp_path
):
    """A file of 100 s is repeated 60 000 h · 36 / h times; a zero between two senses changes it
    once, one within a sense does not."""
    columns = series()
    columns["RotTorq"] = np.where(np.arange(2001) // 300 % 2, -0.4, 0.7)  # changes 6 times
    columns["RotTorq"][[100, 299, 1000]] = 0.0
    write_outb(tmp_path / "a.outb", columns, form=3)
    sums = bins_of_series(case_with())
    assert sums.changes == pytest.approx(6 * 60_000 * 36, rel=1e-9)
