"""Printed figures of three stages beside those of ``flexgear rate``."""

from functools import cache
from pathlib import Path

from rows import Row, compared, gathered, reference

from flexgear.model.load import load_case
from flexgear.results.rating import Rating
from flexgear.studies.rating import rate

PAPER = "reboucas2020"
HERE = Path(__file__).parent


@cache
def rating() -> Rating:
    """The case rated under its only load case."""
    return rate(load_case(HERE / "case.toml"), workers=1)


def figures() -> dict[str, float]:
    """By the quantities of reference.csv, in its units."""
    sheets = {part.name: part.factors[0] for part in rating().parts}
    sheets |= {str(gear_mesh.name): gear_mesh.factors[0] for gear_mesh in rating().gear_meshes}
    return {
        f"{of}, {symbol}": line.value
        for of, sheet in sheets.items()
        for symbol, line in sheet.items()
    }


def rows() -> list[Row]:
    """All printed figures."""
    return gathered(PAPER, printed)


def printed() -> list[Row]:
    """Every line of reference.csv."""
    values = figures()
    return [compared(PAPER, line, values[name], 6) for name, line in reference(PAPER).items()]
