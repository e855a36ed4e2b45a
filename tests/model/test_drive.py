"""Torque histories."""

import numpy as np
import pytest

from flexgear.model.errors import InputError
from flexgear.model.load import load_case

RATED = 4e6  # N m, of the bundled case


def drive_of(**over):
    return load_case("wind-5mw", {f"drive.{k}": v for k, v in over.items()}).drive


def test_constant():
    d = drive_of(torque_nm="1e6")
    assert np.array_equal(d.at([0, 1, 9], RATED), [1e6, 1e6, 1e6])
    assert d.at(0.3, RATED).shape == ()
    assert d.change_times() == ()


def test_a_drop_is_that_of_the_paper():
    """T = 4e6 for t <= 1 s, 4e5 for 1 < t <= 1.2 s, 4e6 after."""
    d = drive_of().drop(4e5, 1.0, 0.2, RATED)
    t = [0, 0.5, 1.0, 1.0001, 1.1, 1.2, 1.2001, 5]
    assert d.at(t, RATED) == pytest.approx([4e6, 4e6, 4e6, 4e5, 4e5, 4e5, 4e6, 4e6])
    assert d.change_times() == pytest.approx((1.0, 1.2))
    grid = np.arange(0, 15000) * 1e-4
    assert np.sum(d.at(grid, RATED) < 1e6) == 2000


def test_ramp_goes_straight_and_stays_outside():
    d = drive_of(kind="ramp", times_s="[0, 2]", torques_knm="[0, 4000]")
    assert d.at([-1, 0.5, 2, 9], RATED) == pytest.approx([0, 1e6, 4e6, 4e6])


def test_csv(tmp_path):
    f = tmp_path / "wind.csv"
    f.write_text("# measured\ntime_s,speed,torque_knm\n0, 1, 1000\n\n1.5, 1, 4000\n")
    d = drive_of(kind="csv", file=str(f))
    assert d.at([0, 0.75, 1.5], RATED) == pytest.approx([1e6, 2.5e6, 4e6])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("t,torque_nm\n0,1\n1,2\n", "column time: is not among"),
        ("time_s,torque_mm\n0,1\n1,2\n", "column torque: is not among.*torque_nm"),
        ("time_s,torque_nm\n0,1\n1,two\n", "line 3, torque_nm: 'two' is not a number"),
        ("time_s,torque_nm\n0,1\n1\n", "line 3, torque_nm: is empty"),
        ("time_s,torque_nm\n0,1\n1,nan\n", "line 3, torque_nm"),
        ("time_s,torque_nm\n0,1\n2,2\n1,3\n", "line 4, time_s: does not rise"),
        ("time_s,torque_nm\n0,1\n", "has 1 rows"),
        ("time_s,torque_nm\n0,0,1,5\n", "line 2: has 4 cells under 2 titles.*semicolons"),
        ("time_s;torque_nm\n0;1.000,5\n", "line 2, torque_nm: '1.000,5' is not a number"),
        ("time_s;torque_nm\n0;" + "9x" * 1000 + "\n", "'9x.*… is not a number"),
        ("time_s,torque_nm\n0,1\n1," + "9" * 200_000 + "\n", "line 3: is no CSV"),
    ],
)
def test_broken_csv_is_one_clear_line(tmp_path, text, words):
    f = tmp_path / "wind.csv"
    f.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        drive_of(kind="csv", file=str(f))
    assert str(caught.value).startswith(str(f))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < len(str(f)) + 250


@pytest.mark.parametrize(
    ("over", "words"),
    [
        ({"kind": "csv"}, r"drive.file: is missing"),
        ({"kind": "csv", "file": "nowhere.csv"}, r"nowhere.csv.*no such file"),
        ({"kind": "ramp"}, r"0 times and 0 torques"),
        ({"kind": "steps", "times_s": "[0, 1]", "torques_nm": "[1]"}, "2 times and 1 torques"),
        ({"kind": "ramp", "times_s": "[1, 0]", "torques_nm": "[1, 2]"}, "times_s: do not rise"),
        ({"kind": "gusts"}, "'gusts' is unknown.*one of constant, steps, ramp, csv"),
    ],
)
def test_incomplete_drives_are_refused(over, words):
    with pytest.raises(InputError, match=words):
        drive_of(**over)


@pytest.mark.parametrize(
    "text",
    [
        "time_s;torque_knm\n0;1000\n1,5;4000,25\n",
        "﻿time_s;torque_knm;\r\n0;1000;\r\n1,5;4000.25;\r\n",
        "# from a spreadsheet\ntime_s\ttorque_knm\n0\t1000\n1,5\t4000,25\n",
        'time_s,torque_knm,\n0,"1000",\n1.5,4000.25,\n',
    ],
)
def test_csv_as_spreadsheets_write_it(tmp_path, text):
    f = tmp_path / "wind.csv"
    f.write_text(text, encoding="utf-8")
    assert drive_of(kind="csv", file=str(f)).at([0, 1.5], RATED) == pytest.approx([1e6, 4000.25e3])
