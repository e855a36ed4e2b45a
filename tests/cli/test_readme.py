"""What the README shows works: the Python lines, and the commands it names."""

import re
from pathlib import Path

import numpy as np
import pytest
from stage_samples import cheap_stage

import flexgear as fg
from flexgear.cli.entry import run

README = Path(__file__).parents[2] / "README.md"
TEXT = README.read_text(encoding="utf-8")


SHORT = "solver__duration_s=0.05, solver__settle_s=0.01, drive__steps__torques_nm=[]"


@pytest.mark.slow
def test_python_lines(monkeypatch, tmp_path):
    """As they are printed, but for short runs; every result has its picture or page."""
    (code,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 15
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda stage, *_: cheap_stage(stage))
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    short = code.replace("duration=0.5", "duration=0.02").replace(
        "planets=5", f"planets=5, {SHORT}"
    )
    exec(compile(short, str(README), "exec"), names)
    assert {"ring_star", "ring_profile"} <= set(dir(names["eq"].fg.plot))
    star = fg.stage_part(names["eq"], "stage").tooth_displacement.values[0]
    orders = abs(fg.radial_harmonics(star))[:11]
    assert orders[5] > 10 * np.delete(orders, [0, 5, 10]).max()
    assert names["run"].pair_load.max() > 1e5
    assert (tmp_path / "results" / "own" / "report.html").stat().st_size > 1e5


@pytest.mark.parametrize("command", sorted(set(re.findall(r"^\| `(\w+)` \|", TEXT, re.MULTILINE))))
def test_commands_exist(command, capsys):
    assert run([command, "--help"]) == 0
    assert command in capsys.readouterr().out


def test_pictures_exist():
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", TEXT):
        assert (README.parent / picture).is_file()
