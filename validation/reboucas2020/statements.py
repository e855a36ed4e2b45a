"""Figures of three protocols and two saved calculations beside those of ``flexgear rate``."""

from functools import cache
from pathlib import Path

from rows import Row, compared, gathered, reference

from flexgear.model.load import load_case
from flexgear.results.rating import Rating
from flexgear.studies.rating import rate

PAPER = "reboucas2020"
HERE = Path(__file__).parent


@cache
def ratings() -> list[Rating]:
    """The protocols' case, that of the DTU gearbox, and bins of a load spectrum."""
    names = ("case", "dtu", "spectrum")
    return [rate(load_case(HERE / f"{name}.toml"), workers=1) for name in names]


def figures() -> dict[str, float]:
    """By the quantities of reference.csv, in its units; of a spectrum with the name of the bin."""
    values: dict[str, float] = {}
    for rating in ratings():
        sheets = {part.name: part.factors for part in rating.parts}
        sheets |= {str(gear_mesh.name): gear_mesh.factors for gear_mesh in rating.gear_meshes}
        for b, load_bin in enumerate(rating.bins):
            of_bin = f" of {load_bin.name}" if len(rating.bins) > 1 else ""
            values |= {
                f"{of}, {symbol}{of_bin}": line.value
                for of, each in sheets.items()
                for symbol, line in each[b].items()
            }
    return values


def rows() -> list[Row]:
    """All printed figures."""
    return gathered(PAPER, printed)


def printed() -> list[Row]:
    """Every line of reference.csv."""
    values = figures()
    return [compared(PAPER, line, values[name], 6) for name, line in reference(PAPER).items()]
