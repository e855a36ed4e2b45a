"""Published figures redrawn and published statements checked.

`pytest validation` takes the FE meshes of the case's own fidelity (standard). For a reduced set
give ``--fidelity quick`` or set FLEXGEAR_FIDELITY=quick. However the tests end, the page over all
papers is written to results/validation/index.html.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
FIDELITIES = ("quick", "standard", "fine")
sys.path.insert(0, str(HERE))  # `from tan2023.runs import Runs`, whatever the import mode

from ledger import Ledger  # noqa: E402  (found through the line above)
from page import write_page  # noqa: E402

LEDGER = pytest.StashKey[Ledger]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--fidelity",
        choices=FIDELITIES,
        default=os.environ.get("FLEXGEAR_FIDELITY", "standard"),
        help="FE meshes of the validation runs (default: $FLEXGEAR_FIDELITY, else standard)",
    )


def pytest_configure(config: pytest.Config) -> None:
    folder = Path(config.rootpath) / "results" / "validation"
    config.stash[LEDGER] = Ledger(folder, str(config.getoption("--fidelity")))


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the common page, whatever failed."""
    ledger = session.config.stash[LEDGER]
    if ledger.found:
        print(f"\n{write_page(ledger)}")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    """`check.py` of every paper holds tests."""
    if file_path.name != "check.py":
        return None
    return pytest.Module.from_parent(parent, path=file_path)


@pytest.fixture(scope="session")
def fidelity(request: pytest.FixtureRequest) -> str:
    """Fidelity of the FE meshes."""
    return str(request.config.getoption("--fidelity"))


@pytest.fixture(scope="session")
def results(ledger: Ledger) -> Path:
    """Where pictures and pages go (not under version control)."""
    return ledger.folder


@pytest.fixture(scope="session")
def ledger(request: pytest.FixtureRequest) -> Ledger:
    """Rows and pictures of all papers, each computed once a session."""
    return request.config.stash[LEDGER]
