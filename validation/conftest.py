"""Published figures redrawn and published statements checked.

`pytest validation` takes the FE meshes of the case's own fidelity (standard). For a reduced set
give ``--fidelity quick`` or set FLEXGEAR_FIDELITY=quick. However the tests end, the page over all
papers is written to results/validation/index.html, of workers (``-n 2``) by the process that hands
out their tests.
"""

import os
import sys
import uuid
from pathlib import Path
from typing import Any

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
    worker = getattr(config, "workerinput", {})
    run = str(worker.get("run", uuid.uuid4()))
    config.stash[LEDGER] = Ledger(folder, str(config.getoption("--fidelity")), run)


def pytest_configure_node(node: Any) -> None:
    """Workers know which run of the tests they belong to."""
    node.workerinput["run"] = node.config.stash[LEDGER].run


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the common page, whatever failed."""
    ledger = session.config.stash[LEDGER]
    is_worker = hasattr(session.config, "workerinput")
    if not is_worker and any(entry.run == ledger.run for entry in ledger.entries()):
        print(f"\n{write_page(ledger)}")


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
