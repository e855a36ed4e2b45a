"""Keys, values and grids of parameter studies: what is written, what it means, what is refused."""

import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_train import SMALL
from trains import write

from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.studies.sweep_keys import parse_setting, points, swept_key


def keys_of(base, *settings):
    return [swept_key(base, *parse_setting(s)) for s in settings]


@pytest.fixture(scope="module")
def pitch_drive():
    return load_case("pitch-drive")


@pytest.fixture(scope="module")
def stage():
    return load_case("wind-5mw")


@pytest.mark.parametrize(
    ("text", "texts"),
    [
        ("k=1,2.5,1e8", ("1", "2.5", "100000000")),
        ("k=0:1:5", ("0", "0.25", "0.5", "0.75", "1")),
        ("k=3:6:4", ("3", "4", "5", "6")),
        ("k=1e-3:1e3:3:log", ("0.001", "1", "1000")),
        ("k=linear, one-sided", ("linear", "one-sided")),
        ("k=[1,2],[3,4]", ("[1,2]", "[3,4]")),
        ("k=-5", ("-5",)),
    ],
)
def test_a_setting_of_a_sweep_is_split_into_its_values(text, texts):
    assert parse_setting(text)[1].texts == texts


@given(
    ends=st.tuples(st.floats(1e-9, 1e12), st.floats(1e-9, 1e12)).filter(
        lambda e: abs(e[0] - e[1]) > 1e-6 * e[0]
    ),
    count=st.integers(2, 30),
)
def test_ranges_keep_their_ends_and_equal_steps(ends, count):
    start, stop = ends
    steps = parse_setting(f"k={start!r}:{stop!r}:{count}")[1].numbers
    ratios = parse_setting(f"k={start!r}:{stop!r}:{count}:log")[1].numbers
    for numbers in (steps, ratios):
        assert len(numbers) == count
        np.testing.assert_allclose((numbers[0], numbers[-1]), (start, stop), rtol=1e-12)
    largest = max(start, stop)
    assert np.ptp(np.diff(steps)) < 1e-9 * largest
    np.testing.assert_allclose(np.diff(np.log(ratios)), np.log(stop / start) / (count - 1), 1e-6)


@given(st.floats(-1e300, 1e300))
def test_numbers_reach_the_case_to_the_last_bit(value):
    text = parse_setting(f"k={value!r}")[1].texts[0]
    assert float(tomllib.loads(f"x = {text}")["x"]) == value


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("stage.planets", ["KEY=VALUES"]),
        ("=3", ["KEY=VALUES"]),
        ("stage.planets=", ["empty value"]),
        ("stage.planets=3,,4", ["empty value"]),
        ("stage.planets=3:5", ["range", "start:stop:count"]),
        ("stage.planets=3:5:2:lin", ["range"]),
        ("stage.planets=3:5:0", ["the count of", "is 0"]),
        ("stage.planets=3:5:-2", ["the count of"]),
        ("stage.planets=3:5:1.5", ["the count of"]),
        ("stage.planets=3:3:4", ["starts where it stops"]),
        ("stage.planets=a:5:3", ["'a'", "not a number"]),
        ("stage.planets=3,4,3", ["3 is given twice"]),
        ("stage.planets=3,four", ["'four'", "not a number"]),
        ("stage.planets=three", ["'three'", "not a number"]),
        ("stage.planets=3:4:3", ["whole numbers", "3.5"]),
        ("stage.planets=nan,3", ["'nan'"]),
        ("stage.plantes=3,4", ["stage.plantes", "planets"]),
        ("stagee.planets=3,4", ["stagee"]),
        ("stage=3,4", ["section"]),
        ("stage.face_width=1,2", ["unit", "face_width_mm"]),
        ("stage.face_width_nm=1,2", ["length", "face_width_mm"]),
        ("stage.face_width_mm=0:1:3:log", ["positive"]),
        ("stage.face_width_mm.0=1,2", ["not a list"]),
        ("stage.gear_mesh.contact_law=1,2", ["words"]),
        ("stage.errors.pin_tangential_um.5=1,2", ["5 elements"]),
        ("stage.errors.pin_tangential_um.0.x=1,2", ["keys below"]),
    ],
)
def test_a_bad_setting_of_a_sweep_is_one_line_with_its_reason(stage, setting, words):
    with pytest.raises(InputError) as fault:
        keys_of(stage, setting)
    text = str(fault.value)
    assert "\n" not in text
    assert " -- " in text
    for word in words:
        assert word in text


def test_stages_of_a_train_by_name_number_and_alias(pitch_drive):
    for name in ("stages.stage_2", "stages.1", "stage_2"):
        (key,) = keys_of(pitch_drive, f"{name}.face_width_mm=10,20")
        assert (key.path, key.units) == (("stages", 1, "face_width"), "mm")
    for before in ("stage.", ""):
        setting = f"{before}planet_bearing.radial_n_per_m=1e7,1e8"
        (alias,) = keys_of(load_case("lin-parker"), setting)
        assert alias.path == ("stages", 0, "planet_bearing", "radial")
        assert alias.units == "N/m"
    with pytest.raises(InputError, match="3 stages -- write stage_1"):
        keys_of(pitch_drive, "stage.face_width_mm=10,20")
    with pytest.raises(InputError, match="stage_9"):
        keys_of(pitch_drive, "stages.stage_9.face_width_mm=10,20")


@pytest.mark.parametrize(
    "second",
    ["stages.1.face_width_mm=1,2", "stages.stage_2.face_width_m=0.1,0.2"],
)
def test_one_field_is_swept_once(pitch_drive, second):
    first = "stages.stage_2.face_width_mm=10,20"
    with pytest.raises(InputError, match="the same"):
        points(keys_of(pitch_drive, first, second))


def test_the_last_key_runs_fastest(pitch_drive):
    keys = keys_of(pitch_drive, "stages.0.sun.teeth=12,13", "inputs.0.power_kw=1:3:3")
    values = [("12", "1"), ("12", "2"), ("12", "3"), ("13", "1"), ("13", "2"), ("13", "3")]
    assert [tuple(point.values()) for point in points(keys)] == values
    assert points(keys)[-1] == {"stages.0.sun.teeth": "13", "inputs.0.power_kw": "3"}


def test_a_sweep_of_too_many_points_is_refused(pitch_drive):
    keys = keys_of(pitch_drive, "inputs.0.power_kw=1:3:1000", "stages.0.face_width_mm=1:3:1000")
    with pytest.raises(InputError, match="1000000 points"):
        points(keys)


class TestListElements:
    def test_one_pin_moves_and_the_others_stay(self, tmp_path):
        path = write(tmp_path, SMALL)
        settings = {"stages.0.errors.pin_tangential_um": "[1, 2, 3]"}
        (key,) = keys_of(load_case(path, settings), "stages.0.errors.pin_tangential_um.1=0:50:3")
        assert key.units == "µm"
        case = load_case(path, {**settings, **points([key])[2]})
        np.testing.assert_allclose(case.stages[0].errors.pin_tangential, [1e-6, 5e-5, 3e-6])

    def test_lists_that_are_left_out_are_zeros(self, tmp_path):
        path = write(tmp_path, SMALL)
        keys = keys_of(load_case(path), "stages.0.errors.pin_radial_um.0=5",
                       "stages.0.errors.pin_radial_um.2=7")  # fmt: skip
        case = load_case(path, points(keys)[0])
        np.testing.assert_allclose(case.stages[0].errors.pin_radial, [5e-6, 0, 7e-6])

    def test_one_for_all_becomes_one_each(self, pitch_drive):
        (key,) = keys_of(pitch_drive, "stages.0.errors.planet_eccentricity_um.2=0,9")
        case = load_case("pitch-drive", points([key])[1])
        np.testing.assert_allclose(case.stages[0].errors.planet_eccentricity, [21e-6, 21e-6, 9e-6])

    def test_a_number_for_a_list_is_a_list_of_one(self, pitch_drive):
        (key,) = keys_of(pitch_drive, "stages.0.errors.planet_eccentricity_um=0:20:3")
        assert key.ticks == (0.0, 10.0, 20.0)
        case = load_case("pitch-drive", points([key])[1])
        assert case.stages[0].errors.planet_eccentricity == (10e-6,)

    def test_elements_of_one_list_in_different_units(self, pitch_drive):
        keys = keys_of(pitch_drive, "stages.0.errors.pin_radial_um.0=5,6",
                       "stages.0.errors.pin_radial_mm.2=0.07,0.08")  # fmt: skip
        case = load_case("pitch-drive", points(keys)[2])
        np.testing.assert_allclose(case.stages[0].errors.pin_radial, [6e-6, 0, 7e-5])

    def test_positions_that_are_left_out_are_those_of_equal_spacing(self, pitch_drive):
        (key,) = keys_of(pitch_drive, "stages.0.planet_positions_deg.1=119,121")
        sets = {"stages.0.allow_unassemblable": "true", **points([key])[1]}
        case = load_case("pitch-drive", sets)
        np.testing.assert_allclose(np.degrees(case.stages[0].planet_angles), [0, 121, 240])

    def test_a_list_and_its_element(self, pitch_drive):
        keys = keys_of(pitch_drive, "stages.0.errors.pin_radial_um.0=5,6",
                       "stages.0.errors.pin_radial_um=[1,2,3],[4,5,6]")  # fmt: skip
        with pytest.raises(InputError, match="the same"):
            points(keys)


def test_words_and_lists_are_labels(stage):
    law, pins = keys_of(stage, "stage.gear_mesh.contact_law=linear,one-sided",
                        "stage.errors.pin_radial_um=[0,0,0,0,0],[9,0,0,0,0]")  # fmt: skip
    assert law.ticks == ("linear", "one-sided")
    assert pins.ticks == ("[0,0,0,0,0]", "[9,0,0,0,0]")
    assert law.values.numbers is None


def test_a_switch_is_swept_over_true_and_false():
    (key,) = keys_of(load_case("lin-parker"), "gyroscopic=false,true")
    assert load_case("lin-parker", points([key])[1]).gyroscopic is True
