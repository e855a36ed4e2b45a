"""The command that prints load bins, writes their table and draws their duration."""

import json

import numpy as np
import pytest
from openfast_files import write_outb
from small_train import SMALL

TRAIN = SMALL.replace("teeth = 60", "teeth = 60, addendum = 0.8")  # no interference
SERIES = """
[load_series]
years = 20
torque = "RotTorq"
speed = "RotSpeed"
moment = ["LSSGagMys", "LSSGagMzs"]

[[load_series.design_load_cases]]
name = "1.2"
files = "dlc12/*.outb"
hours_per_year = 3000
"""


@pytest.fixture
def case(tmp_path):
    time = np.arange(0.0, 600.0, 0.1)
    wave = np.sin(0.05 * time)
    columns = {
        "Time": time,
        "RotTorq": 0.8 + 0.2 * wave,
        "RotSpeed": 9.5 + 0.6 * wave,
        "LSSGagMys": 0.2 * np.sin(0.6 * time),
        "LSSGagMzs": 0.1 * np.cos(0.6 * time),
    }
    (tmp_path / "dlc12").mkdir()
    write_outb(tmp_path / "dlc12" / "a.outb", columns)
    path = tmp_path / "mine.toml"
    path.write_text(TRAIN + SERIES)
    return path


def test_bins_are_printed_written_and_drawn(flexgear, case, tmp_path):
    out = tmp_path / "bins.csv"
    code, shown, err = flexgear("spectrum", case, "--out", out, "-q")
    assert (code, err) == (0, "")
    assert "60000" in shown and "1.0000 (exponent 6.6)" in shown
    assert "largest bending moment" in shown
    assert len(out.read_text().splitlines()) > 10
    assert out.with_suffix(".png").stat().st_size > 1000
    code, _, err = flexgear("spectrum", case, "--out", out, "-q")
    assert code == 2 and "is there already" in err and err.count("\n") == 1
    code, shown, _ = flexgear("spectrum", case, "-q", "--json")
    assert code == 0
    assert sum(b["hours"] for b in json.loads(shown)["bins"]) == pytest.approx(60_000)


def test_a_case_without_loads_says_how_to_give_them(flexgear, case):
    case.write_text(TRAIN)
    code, out, err = flexgear("spectrum", case)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "load_cases: is missing -- add [[load_cases]]" in err
