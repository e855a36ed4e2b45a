"""The validation in the manual: what each folder of validation/ says of its source, its printed
figures, and the page of computed ones where `make validate` has written it."""

import csv
import re
import shutil
from pathlib import Path

from sphinx.application import Sphinx

HEAD = """# Validation

`make validate` compares the bundled cases with print, figure by figure, and writes one page over
all of them; CI does so on every change. {built}

What follows says of each source where its figures come from, how signs and frames are mapped, what
was chosen or calibrated (which is no validation), and what does not agree.
"""
BUILT = '<a href="validation/index.html">The page of the last run</a> is part of this manual.'
NOT_BUILT = "It was not there when this manual was made."


def _page(root: Path) -> str:
    built = (root / "results" / "validation" / "index.html").exists()
    parts = [HEAD.format(built=BUILT if built else NOT_BUILT)]
    for source in sorted((root / "validation").glob("*/source.md")):
        text = re.sub(r"^(#+) ", r"#\1 ", source.read_text("utf-8"), flags=re.MULTILINE)
        parts.append(text + _printed(source.with_name("reference.csv")))
    return "\n".join(parts)


def _printed(path: Path) -> str:
    """The figures of a paper as a table, or what is accepted of a comparison without print."""
    if not path.exists():
        return ""
    with path.open(encoding="utf-8", newline="") as file:
        rows = [[cell.replace("|", r"\|") for cell in row] for row in csv.reader(file) if row]
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    rule = "|" + "---|" * len(rows[0])
    title = "Figures in print" if "value" in rows[0] else "What is accepted"
    return f"\n\n{title}:\n\n" + "\n".join([lines[0], rule, *lines[1:]]) + "\n"


def _write(app: Sphinx) -> None:
    out = Path(app.srcdir, "_generated", "validation.md")
    out.parent.mkdir(exist_ok=True)
    text = _page(Path(app.srcdir).parent)
    if not out.exists() or out.read_text("utf-8") != text:
        out.write_text(text, "utf-8")


def _copy(app: Sphinx, fault: Exception | None) -> None:
    built = Path(app.srcdir).parent / "results" / "validation"
    if fault is None and (built / "index.html").exists():
        shutil.copytree(built, Path(app.outdir, "_generated", "validation"), dirs_exist_ok=True)


def setup(app: Sphinx) -> dict:
    """Before sources are looked for, and when pages are written."""
    app.connect("config-inited", lambda app, _: _write(app))
    app.connect("build-finished", _copy)
    return {"parallel_read_safe": True}
