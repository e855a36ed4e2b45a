"""Writes the page of all variables, coordinates and figures of results from their declarations."""

from pathlib import Path

from sphinx.application import Sphinx

from flexgear.results.quantities import RESULT_COORDINATES
from flexgear.results.result_quantities import RESULT_QUANTITIES
from flexgear.results.summary import KEYS
from flexgear.solve.headlines import HEADLINES

HEAD = """# Variables and figures of results

Made from their declarations; [](../results.md) explains them. A variable that may lack values says
when.
"""


def page() -> str:
    """The whole page in MyST."""
    parts = (
        ("Variables", ("variable", "axes", "unit", "meaning"),
         map(_variable, RESULT_QUANTITIES.items())),
        ("Coordinates", ("coordinate", "unit", "meaning"),
         ((n, *about[:2]) for n, about in RESULT_COORDINATES.items())),
        ("Keys of `summary.json`", ("key", "unit", "meaning"), (key[:3] for key in KEYS)),
        ("Headlines", ("headline", "unit", "meaning", "allowable"),
         ((h.name, h.unit, h.meaning, h.allowable) for h in HEADLINES)),
    )  # fmt: skip
    return HEAD + "".join(_table(*part) for part in parts)


def _variable(item: tuple) -> tuple:
    name, quantity = item
    missing = f"; missing {quantity.missing}" if quantity.missing else ""
    return name, ", ".join(quantity.dims), quantity.units, f"{quantity.meaning}{missing}"


def _table(title: str, heads: tuple, rows: object) -> str:
    lines = [f"\n## {title}\n", f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for name, *cells in rows:
        lines.append(f"| {' | '.join([f'`{name}`', *(cell or '–' for cell in cells)])} |")
    return "\n".join(lines) + "\n"


def _write(app: Sphinx) -> None:
    out = Path(app.srcdir, "_generated", "result_reference.md")
    out.parent.mkdir(exist_ok=True)
    text = page()
    if not out.exists() or out.read_text() != text:
        out.write_text(text)


def setup(app: Sphinx) -> dict:
    """Before sources are looked for."""
    app.connect("config-inited", lambda app, _: _write(app))
    return {"parallel_read_safe": True}
