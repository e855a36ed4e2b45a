"""Every example of the manual runs as it is printed, without a display, and draws something."""

import runpy
import shutil
from pathlib import Path

import matplotlib
import pytest

EXAMPLES = sorted(Path(__file__).parents[1].glob("docs/examples/plot_*.py"))


def test_there_are_examples():
    assert len(EXAMPLES) >= 10


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(example, monkeypatch, tmp_path, capsys):
    """As a plain script it prints figures and leaves its pictures where it is run."""
    from matplotlib import pyplot

    matplotlib.use("Agg")
    shutil.copy(example.parent / "stage.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    figure = runpy.run_path(str(example))["figure"]
    assert [ax for ax in figure.axes if ax.has_data()]
    printed = capsys.readouterr().out
    wrote = [line.removeprefix("wrote ") for line in printed.splitlines() if "wrote" in line]
    assert wrote and set(wrote) == {path.name for path in tmp_path.glob("*.png")}
    assert any(sign.isdigit() for sign in printed.replace("\n".join(wrote), ""))
    pyplot.close("all")
