"""The command line in this process, on cheap bodies instead of reductions."""

import json
import math

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image
from stage_samples import cheap_stage

from flexgear.cli.entry import run


class CommandLine:
    """Called with arguments it gives exit code, stdout and stderr."""

    def __init__(self, capsys):
        self._capsys = capsys

    def __call__(self, *arguments):
        code = run([str(a) for a in arguments])
        shown = self._capsys.readouterr()
        return code, shown.out, shown.err

    def out(self, *arguments):
        """What a command that works prints."""
        code, out, err = self(*arguments)
        assert code == 0, err
        return out

    def quiet(self, *arguments):
        """The same of a command that has nothing to remark."""
        code, out, err = self(*arguments)
        assert (code, err) == (0, "")
        return out

    def json(self, *arguments):
        """What a command that works says to programs."""
        more = [] if arguments[0] in ("check", "cache") else ["--quiet"]
        return json.loads(self.out(*arguments, "--json", *more))

    def refused(self, *arguments, says=()):
        """The one line in which a command refuses its arguments, with these words."""
        code, out, err = self(*arguments)
        assert (code, out, err.count("\n")) == (2, "", 1), err
        assert err.startswith("flexgear: ")
        assert all(words in err for words in says), err
        return err


@pytest.fixture
def flexgear_with_fe(capsys, monkeypatch):
    """The command line, which meshes and reduces bodies; cores run other tests."""
    monkeypatch.setattr("flexgear.studies.job_pool.STARTING", math.inf)
    monkeypatch.setattr("flexgear.studies.early_workers.processors", lambda: 1)
    return CommandLine(capsys)


@pytest.fixture
def flexgear(flexgear_with_fe, monkeypatch):
    """The command line on cheap bodies."""
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda stage, *_: cheap_stage(stage))
    return flexgear_with_fe


@pytest.fixture
def no_pixels(monkeypatch):
    """Every figure is made, and saved as a dot, renders and animations too: matplotlib draws the
    same kinds of texts and lines in the README's run and in that of double-rotor-5mw."""
    dot = Image.new("RGB", (4, 4))
    monkeypatch.setattr(FigureCanvasAgg, "print_png", lambda _, at, **__: dot.save(at, "png"))
    monkeypatch.setattr("flexgear.views.render.render_deformed", lambda *_, **__: Figure())
    monkeypatch.setattr(
        "flexgear.views.star.animate_star", lambda *to, **_: dot.save(to[-1], "gif")
    )
