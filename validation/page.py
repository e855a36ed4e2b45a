"""The one page over all papers: counts, then every row and picture by paper."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from pathlib import Path

import jinja2
import numpy as np
from ledger import PAPERS, Entry, Ledger

from flexgear.files.atomic import atomic_file
from flexgear.results.version import version

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Counts:
    """Rows of a paper by verdict."""

    met: int
    not_met: int
    reported: int


def counts(entry: Entry) -> Counts:
    """How many rows are met, not met and only reported."""
    verdicts = [row.verdict for row in entry.rows]
    return Counts(*(verdicts.count(v) for v in ("met", "not met", "reported")))


def write_page(ledger: Ledger) -> Path:
    """Writes `<folder>/index.html` from what the ledger knows now; returns it."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    entries = [(e, counts(e)) for e in ledger.entries()]
    text = environment.get_template("page.html.jinja").render(
        style=(HERE / "page.css").read_text("utf-8"),
        entries=entries,
        total=Counts(*np.sum([astuple(c) for _, c in entries], axis=0)),
        detail={p.name: p.detail for p in PAPERS},
        fresh=set(ledger.found),
        version=version(),
    )
    target = ledger.folder / "index.html"
    target.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(target) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return target
