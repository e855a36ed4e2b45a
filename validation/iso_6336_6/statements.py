"""Printed numbers of cycles and the sum of damage beside those of ``flexgear.gears.rating``."""

import csv
from pathlib import Path

import numpy as np
from rows import Row, compared, gathered, reference

from flexgear.gears.rating.damage import LifeCurve, Spectrum

PAPER = "iso_6336_6"
STRENGTH = 1500.0 * 1.02 * 0.943 * 1.01  # N/mm², σ_Hlim Z_L Z_v Z_R
CURVE = LifeCurve((1e5, 5e7, 1e10), (1.6 * STRENGTH, STRENGTH, 0.85 * STRENGTH), 2400.0)


def spectrum() -> tuple[list[str], Spectrum]:
    """Numbers of the loaded bins, and their stresses and cycles."""
    with Path(__file__).with_name("spectrum.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    stress, cycles = (np.array([float(x[key]) for x in lines]) for key in ("stress", "cycles"))
    return [line["bin"] for line in lines], Spectrum.of([CURVE] * len(lines), stress, cycles)


def figures() -> dict[str, float]:
    """By the quantities of reference.csv."""
    bins, loads = spectrum()
    lives = CURVE.cycles_at(loads.stress)
    out = {f"N of bin {number}": float(life) for number, life in zip(bins, lives, strict=True)}
    return out | {"ΣU": float(loads.damages().sum()), "S": float(loads.safety)}


def rows() -> list[Row]:
    """All printed figures."""
    return gathered(PAPER, printed)


def printed() -> list[Row]:
    """Every line of reference.csv."""
    values = figures()
    return [compared(PAPER, line, values[name], 5) for name, line in reference(PAPER).items()]
