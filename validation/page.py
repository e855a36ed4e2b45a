"""The one page over all papers: counts, then every row and picture by paper."""

import subprocess
from collections.abc import Iterable
from dataclasses import astuple, dataclass
from pathlib import Path

import jinja2
import numpy as np
from ledger import Ledger
from rows import AGAINST, Row

from flexgear.files.atomic import atomic_file
from flexgear.results.version import version

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Counts:
    """Rows by verdict."""

    met: int
    not_met: int
    reported: int


def counts(rows: Iterable[Row]) -> Counts:
    """How many rows are met, not met and only reported."""
    verdicts = [row.verdict for row in rows]
    return Counts(*(verdicts.count(v) for v in ("met", "not met", "reported")))


def commit() -> str:
    """Of the working tree this file is in, "+" behind it where that was changed; "" without git."""
    command = ["git", "-C", str(HERE), "describe", "--always", "--exclude", "*", "--dirty=+"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return done.stdout.strip()


def write_page(ledger: Ledger) -> Path:
    """Writes `<folder>/index.html` from what the ledger knows now; returns it."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    entries = [(e, counts(e.rows)) for e in ledger.entries()]
    every = [row for e, _ in entries for row in e.rows]
    kinds = [(k, m, counts(r for r in every if r.against == k)) for k, m in AGAINST.items()]
    text = environment.get_template("page.html.jinja").render(
        style=(HERE / "page.css").read_text("utf-8"),
        entries=entries,
        total=Counts(*np.sum([astuple(c) for _, c in entries], axis=0)),
        kinds=kinds,
        run=ledger.run,
        version=version(),
        commit=commit(),
    )
    target = ledger.folder / "index.html"
    target.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(target) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return target
