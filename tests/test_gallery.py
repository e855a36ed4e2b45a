"""Every example of the manual runs as it is printed, without a display, and draws something."""

import runpy
from pathlib import Path

import matplotlib
import pytest

EXAMPLES = sorted(Path(__file__).parents[1].glob("docs/examples/plot_*.py"))


def test_there_are_examples():
    assert len(EXAMPLES) >= 10


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(example, monkeypatch):
    from matplotlib import pyplot

    matplotlib.use("Agg")
    monkeypatch.chdir(example.parent)
    figure = runpy.run_path(str(example))["figure"]
    figure.canvas.draw()
    drawn = [ax for ax in figure.axes if ax.has_data()]
    assert drawn
    pyplot.close("all")
