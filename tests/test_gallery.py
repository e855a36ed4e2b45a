"""Examples of the manual run as they are printed, without a display, and draw something.

All of them run where the manual is made (``make docs`` takes no failure); here the quick ones do.
"""

import runpy
import shutil
from pathlib import Path

import matplotlib
import pytest

EXAMPLES = sorted(Path(__file__).parents[1].glob("docs/examples/plot_*.py"))
QUICK = [path for path in EXAMPLES if path.stem[5:7] in ("01", "03", "09")]


def test_every_example_prints_and_keeps_its_picture():
    assert len(EXAMPLES) >= 10 and len(QUICK) == 3
    for example in EXAMPLES:
        text = example.read_text(encoding="utf-8")
        assert "figure" in text and "print(" in text, example.name


@pytest.mark.parametrize("example", QUICK, ids=lambda path: path.stem)
def test_example_runs(example, monkeypatch, tmp_path, capsys):
    """As a plain script it prints figures and leaves its pictures where it is run."""
    from matplotlib import pyplot

    matplotlib.use("Agg")
    for case in example.parent.glob("*.toml"):
        shutil.copy(case, tmp_path)
    monkeypatch.chdir(tmp_path)
    figure = runpy.run_path(str(example))["figure"]
    assert [ax for ax in figure.axes if ax.has_data()]
    printed = capsys.readouterr().out
    wrote = [line.removeprefix("wrote ") for line in printed.splitlines() if "wrote" in line]
    assert wrote and set(wrote) == {path.name for path in tmp_path.glob("*.png")}
    assert any(sign.isdigit() for sign in printed.replace("\n".join(wrote), ""))
    pyplot.close("all")
