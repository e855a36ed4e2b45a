"""Machines and torque histories."""

import numpy as np
import pytest
from trains import stage_train

from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.model.machine import Machine, TimeHistory, machines_of

AT = "inputs.0.machine."
OUT = "output.machine."


def machine(folder, **keys):
    """The first input's."""
    case = stage_train(folder, **{AT + key: value for key, value in keys.items()})
    return machines_of(case)[0]


def test_without_a_word_the_inputs_drive_and_the_output_brakes(tmp_path):
    case = stage_train(tmp_path, **{"output.brake_exponent": "2", "output.brake_torque_nm": "700"})
    first, last = machines_of(case)
    assert first == Machine()
    assert last == Machine(law="brake", brake_torque=700.0, brake_exponent=2.0)


def test_drive_is_another_name_of_the_first_machine(tmp_path):
    keys = {"kind": "ramp", "times_s": "[0, 1]", "torques_knm": "[1, 3]"}
    by_drive = stage_train(tmp_path, **{f"drive.{k}": v for k, v in keys.items()})
    assert machines_of(by_drive)[0] == machine(tmp_path, **keys)


@pytest.mark.parametrize("law", ["torque", "speed"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_series_comes_back_from_its_file(tmp_path, law, separator):
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.uniform(0.01, 0.1, 50))
    values = rng.uniform(50, 150, 50)
    rows = [separator.join(map(repr, map(float, row))) for row in zip(times, values, strict=True)]
    title = separator.join(["time_s", f"{law}_{'nm' if law == 'torque' else 'rad_per_s'}"])
    (tmp_path / "series.csv").write_text("\n".join([title, *rows]), encoding="utf-8")
    history = machine(tmp_path, law=law, kind="csv", file="series.csv")
    assert np.array_equal(history.times, times)
    assert np.array_equal(history.values, values)
    assert history.at(times, 0.0) == pytest.approx(values, rel=1e-14)
    assert history.file == str(tmp_path / "series.csv")


def test_a_speed_from_a_file_has_no_kink_inside_and_does_not_overshoot(tmp_path):
    (tmp_path / "s.csv").write_text("time_s,speed_rpm\n0,10\n1,20\n2,20\n3,5\n", encoding="utf-8")
    history = machine(tmp_path, law="speed", kind="csv", file="s.csv")
    t = np.linspace(0, 3, 3001)
    speed = history.at(t, 0.0) * 30 / np.pi
    assert speed.min() >= 5 - 1e-12
    assert speed.max() <= 20 + 1e-12
    rate = history.rate_at(t[1:-1])
    assert np.abs(np.diff(rate)).max() < 0.01 * np.abs(rate).max()
    assert rate == pytest.approx(np.gradient(history.at(t, 0.0), t)[1:-1], abs=2e-3)
    assert history.kinks() == (0.0, 3.0)


def test_rates_are_slopes():
    ramp = TimeHistory(kind="ramp", times=(0.0, 1.0, 3.0), torques=(1.0, 3.0, 0.0))
    assert ramp.rate_at([-1.0, 0.5, 1.5, 2.9, 3.1]) == pytest.approx([0, 2, -1.5, -1.5, 0])
    assert ramp.kinks() == (0.0, 1.0, 3.0)
    steps = TimeHistory(kind="steps", times=(0.0, 1.0), torques=(1.0, 3.0))
    assert np.array_equal(steps.rate_at([0.5, 1.5]), [0, 0])
    assert steps.change_times() == (1.0,)


@pytest.mark.parametrize(
    ("over", "words"),
    [
        ({AT + "law": "speed", AT + "kind": "steps", AT + "times_s": "[0, 1]",
          AT + "speeds_rpm": "[1, 2]"},
         r"inputs.0.machine.kind: a speed cannot jump.* -- use kind = \"soft\""),
        ({AT + "law": "speed", AT + "torque_nm": "5"},
         r"machine.torque_nm: is given where a speed is followed -- give speed instead"),
        ({AT + "speeds_rpm": "[1, 2]"}, "machine.speeds_rpm: is given where a torque is followed"),
        ({AT + "law": "controller"}, "machine.kp_nm_s_per_rad: is missing for a controller"),
        ({AT + "law": "controller", AT + "kp": "5"}, "has no unit.*kp_nm_s_per_rad"),
        ({AT + "kp_nm_s_per_rad": "5"}, "kp.*is given, but law is 'torque' -- set law"),
        ({AT + "law": "controller", AT + "kp_nm_s_per_rad": "5", AT + "least_torque_nm": "5",
          AT + "most_torque_nm": "5"}, "least_torque_nm: is not below most_torque"),
        ({AT + "law": "brake", AT + "brake_exponent": "0.5"}, "brake_exponent: between 0 and 1"),
        ({AT + "law": "motor"}, "'motor' is unknown.*torque, speed, controller, brake"),
        ({AT + "law": "speed", AT + "kind": "ramp", AT + "times_s": "[0, 1]",
          AT + "speeds_rpm": "[1]"}, "2 times and 1 speeds"),
        ({AT + "law": "speed", AT + "kind": "csv"}, "file: is missing.*time_s and speed_rpm"),
        ({AT + "kind": "ramp", AT + "times_s": "[0]", AT + "torques_nm": "[1]",
          "drive.torque_nm": "5"}, "drive.torque_nm: is given beside inputs.0.machine"),
        ({AT + "law": "speed", "drive.steps.torques_nm": "[5]"},
         "drive.steps.torques_nm: are drops of a torque, but the first input follows.*'speed'"),
        ({OUT + "law": "brake", "output.brake_torque_nm": "5"},
         "output.brake_torque_nm: is given beside output.machine"),
        ({AT + "law": "speed", OUT + "law": "controller", OUT + "kp_nm_s_per_rad": "5"},
         "output.machine.law: all ports follow a speed.* -- let one of them follow"),
    ],
)  # fmt: skip
def test_machines_that_cannot_be_are_refused(tmp_path, over, words):
    with pytest.raises(InputError, match=words) as caught:
        stage_train(tmp_path, **over)
    assert "\n" not in str(caught.value)


def test_a_speed_beyond_all_machines_is_refused(tmp_path):
    (tmp_path / "s.csv").write_text("time_s,speed_rpm\n0,1\n1,2000000\n", encoding="utf-8")
    with pytest.raises(InputError, match="are beyond 1e4 rad/s"):
        machine(tmp_path, law="speed", kind="csv", file="s.csv")


RATED = 4e6  # N m, of the bundled case


def drive_of(**over):
    return load_case("wind-5mw", {f"drive.{k}": v for k, v in over.items()}).drive


def test_a_constant_torque_has_no_change_times():
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


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "torque series: is empty -- give columns time_s, torque_nm"),
        ("t,torque_nm\n0,1\n1,2\n", "column time: is not among"),
        ("time_s,torque_mm\n0,1\n1,2\n", "column torque: is not among.*torque_nm"),
        (
            "time_s,torque_nm,torque_nm\n0,1,2\n1,1,2\n",
            "column torque_nm: occurs twice -- keep one",
        ),
        ("time_s,torque_nm,time_ms\n0,1,0\n1,1,9\n", "column time_ms: is beside time_s -- keep"),
        ("time_s,torque_nm\n0,1\n1,two\n", "line 3, torque_nm: 'two' is not a number"),
        ("time_s,torque_nm\n0,1\n1\n", "line 3, torque_nm: is empty"),
        ("time_s,torque_nm\n0,1\n1,nan\n", "line 3, torque_nm"),
        ("time_s,torque_nm\n0,1\n2,2\n1,3\n", "line 4, time_s: does not increase"),
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
        ({"kind": "csv", "file": "nowhere.csv"}, r"nowhere.csv.*no such file"),
        ({"kind": "ramp"}, r"0 times and 0 torques"),
        ({"kind": "ramp", "times_s": "[1, 0]", "torques_nm": "[1, 2]"}, "times_s: do not increase"),
        ({"kind": "gusts"}, "'gusts' is unknown.*one of constant, steps, ramp, soft, csv"),
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
