"""One set of runs for all tests of a session."""

from __future__ import annotations

import pytest

from tan2023 import on_page
from tan2023.statements import Findings


@pytest.fixture(scope="session")
def findings(fidelity: str) -> Findings:
    return on_page.findings(fidelity)
