"""The command line in this process, on cheap bodies instead of reductions."""

import pytest
from stage_samples import cheap_stage

from flexgear.cli import analysis_commands, run_commands
from flexgear.cli.entry import run


@pytest.fixture
def flexgear(capsys, monkeypatch):
    """Function: arguments -> (exit code, stdout, stderr)."""
    for module in (analysis_commands, run_commands):
        monkeypatch.setattr(module, "stage_bodies", lambda case, progress: cheap_stage(case))

    def call(*arguments):
        code = run([str(a) for a in arguments])
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return call
