"""Published load zones and the worked example of a ball bearing beside flexgear."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import scipy
from rows import Row, compared, gathered, published

from flexgear.gears.bearings.rows import LINE, POINT
from iso_16281.example import D_PW, figure, rated

PAPER = "iso_16281"
ELSEWHERE = 2.5e-4  # with the arm of the example


def rows() -> list[Row]:
    """All rows."""
    return gathered(PAPER, load_zones, ball_bearing, with_the_arm_of_the_example)


def load_zone_integral(extent: float, exponent: float) -> float:
    """J_r(ε) = 1/(2π) ∫ [1 − (1 − cos ψ)/(2ε)]ⁿ cos ψ dψ over the zone of a radial bearing with
    rigid rings and many elements, Q_max = F_r/(Z J_r); ε = 1/2 without clearance.
    Source: Sjoevall 1933; Harris, Kotzalas 2006, ch. 7."""
    half = math.acos(1 - 2 * extent) if extent < 1 else math.pi

    def share(psi: float) -> float:
        return float(max(1 - (1 - np.cos(psi)) / (2 * extent), 0.0) ** exponent * np.cos(psi))

    return float(scipy.integrate.quad(share, 0.0, half, epsabs=1e-12)[0] / math.pi)


def load_zones() -> Iterable[Row]:
    """J_r(ε), and 1/J_r(1/2)."""
    for line in published(PAPER, "load zone"):
        exponent = POINT if "ball" in line.quantity else LINE
        if line.quantity.startswith("J_r"):
            extent = float(line.quantity.partition("= ")[2])
            yield compared(PAPER, line, load_zone_integral(extent, exponent))
        else:
            yield compared(PAPER, line, 1 / load_zone_integral(0.5, exponent))


def ball_bearing() -> Iterable[Row]:
    """All figures, with the arm of the inner groove's centres."""
    for line in published(PAPER, "ball bearing"):
        load, _, name = line.quantity.partition(": ")
        yield compared(PAPER, line, figure(rated(load), name))


def with_the_arm_of_the_example() -> Iterable[Row]:
    """All figures, with the arm D_pw/2."""
    for line in published(PAPER, "ball bearing"):
        load, _, name = line.quantity.partition(": ")
        tight = replace(
            line, quantity=f"{line.quantity}, arm D_pw/2", tolerance=ELSEWHERE, reason=""
        )
        yield compared(PAPER, tight, figure(rated(load, D_PW / 2), name))
