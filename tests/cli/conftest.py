"""The command line in this process, on cheap bodies instead of reductions."""

import math

import pytest
from stage_samples import cheap_stage

from flexgear.cli.entry import run


@pytest.fixture
def flexgear(capsys, monkeypatch):
    """Function: arguments -> (exit code, stdout, stderr)."""
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda stage, *_: cheap_stage(stage))
    # cores run other tests
    monkeypatch.setattr("flexgear.studies.job_pool.STARTING", math.inf)
    monkeypatch.setattr("flexgear.studies.early_workers.processors", lambda: 1)

    def call(*arguments):
        code = run([str(a) for a in arguments])
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return call
