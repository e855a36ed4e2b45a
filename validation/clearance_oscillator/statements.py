"""Closed forms of an oscillator with clearance beside steady states of a gear pair."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import xarray as xr
from rows import CLOSED_FORM, Published, Row, compared, gathered, published

import flexgear as fg
from flexgear.arrays import Array

PAPER = "clearance_oscillator"
CASE = Path(__file__).with_name("case.toml")
DEFLECTION = 4.434e-6  # x_s = F₀/k of the case, m
LIGHT = {
    "stage.gear_mesh.damping_law": "in-contact",
    "stage.gear_mesh.damping_ratio": "0.003",
    "stage.errors.sun_gear_mesh_um": "0.2217",
}
BACKLASH = {"one flank": "400", "both flanks": "8.868"}  # µm; the latter 2 x_s


def rows() -> list[Row]:
    """All rows."""
    return gathered(PAPER, free_motion, first_order)


@cache
def free(flanks: str) -> xr.Dataset:
    """Steady states of a pair so lightly damped and excited that its resonance is a narrow tongue
    about the free motion."""
    sets = {**LIGHT, "stage.backlash_sun_um": BACKLASH[flanks]}
    return fg.load_case(CASE, sets).assemble().response((0.55, 1.2), progress=_silent)


@cache
def by_one_harmonic() -> xr.Dataset:
    """Steady states of one harmonic, damped always."""
    return fg.load_case(CASE).assemble().response((0.5, 1.4), harmonics=1, progress=_silent)


def _silent(stage: str, share: float) -> None:
    pass


def crossings(data: xr.Dataset, values: Array, level: float) -> list[float]:
    """Frequencies, over that of the linear pair, at which values along the curves pass a level."""
    x = data["response_speed_share"].to_numpy()
    same = np.diff(data["response_branch"].to_numpy()) == 0
    at = np.flatnonzero(((values[:-1] - level) * (values[1:] - level) < 0.0) & same)
    w = (level - values[at]) / (values[at + 1] - values[at])
    return sorted(((1 - w) * x[at] + w * x[at + 1]).tolist())


def largest_force(data: xr.Dataset) -> Array:
    """Over the mean force."""
    force = data["response_gear_mesh_force"]
    mean = float(force.sel(measure="mean").to_numpy()[0, 0])
    return np.asarray(force.sel(measure="maximum").to_numpy()[:, 0] / mean)


def amplitude(data: xr.Dataset) -> Array:
    """Of δ = x + e in the first harmonic, over x_s: half of its range."""
    error = data["response_transmission_error"]
    return np.asarray(error.sel(measure="rms").to_numpy()[:, 0] * np.sqrt(2.0) / DEFLECTION)


def free_motion() -> Iterable[Row]:
    """The middle between both sides of the tongue at a force, and the frequency of free motion."""
    for line in published(PAPER, "free motion"):
        flanks, _, force = line.quantity.partition(", largest force ")
        data = free(flanks)
        sides = crossings(data, largest_force(data), float(force.split()[0]))
        yield of_closed_form(line, sum(sides[:2]) / 2.0 if len(sides) == 2 else float("nan"))


def first_order() -> Iterable[Row]:
    """Frequencies at amplitudes, and jumps, of one harmonic."""
    data = by_one_harmonic()
    x = data["response_speed_share"].to_numpy()
    turns = np.flatnonzero(np.diff(np.sign(np.diff(x)))) + 1
    rising, falling = x[turns].max(), x[turns].min()
    for line in published(PAPER, "first order"):
        if line.quantity.startswith("jump"):
            yield of_closed_form(line, falling if "falling" in line.quantity else rising)
        else:
            level = float(line.quantity.split()[-2])
            sides = crossings(data, amplitude(data), level)
            yield of_closed_form(line, sides[0 if line.quantity.startswith("lower") else -1])


def of_closed_form(line: Published, computed: float) -> Row:
    """Row of a figure that no print has."""
    return replace(compared(PAPER, line, computed), against=CLOSED_FORM)
