"""One set of runs for all tests of a session."""

from __future__ import annotations

import pytest

from tan2023.runs import Runs
from tan2023.statements import Findings


@pytest.fixture(scope="session")
def runs(fidelity: str) -> Runs:
    return Runs(fidelity)


@pytest.fixture(scope="session")
def findings(runs: Runs) -> Findings:
    return Findings(runs)
