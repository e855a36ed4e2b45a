"""The command line in this process, on cheap bodies instead of reductions."""

import pytest
from stage_samples import cheap_stage

from flexgear.cli.entry import run


@pytest.fixture
def flexgear(capsys, monkeypatch):
    """Function: arguments -> (exit code, stdout, stderr)."""
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda stage, *_: cheap_stage(stage))

    def call(*arguments):
        code = run([str(a) for a in arguments])
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return call
