"""What the README shows works: the Python lines, and the commands it names."""

import re
from pathlib import Path

import numpy as np
import pytest
from stage_samples import cheap_stage

from flexgear.cli.entry import run

README = Path(__file__).parents[2] / "README.md"
TEXT = README.read_text(encoding="utf-8")


def test_python_lines(monkeypatch, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 15
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda stage, *_: cheap_stage(stage))
    names: dict = {}
    exec(compile(code.replace("duration=0.5", "duration=0.05"), str(README), "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    orders = np.array([float(x) for x in " ".join(printed[:-1]).strip("[]").split()])
    assert orders[5] > 10 * np.delete(orders, [0, 5, 10]).max()
    assert float(printed[-1].split()[0]) > 1e5


@pytest.mark.parametrize("command", sorted(set(re.findall(r"^\| `(\w+)` \|", TEXT, re.MULTILINE))))
def test_commands_exist(command, capsys):
    assert run([command, "--help"]) == 0
    assert command in capsys.readouterr().out


def test_pictures_exist():
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", TEXT):
        assert (README.parent / picture).is_file()
