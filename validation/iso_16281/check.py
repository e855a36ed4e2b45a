"""The worked example by the plain equations: equilibrium and life written down without flexgear."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from iso_16281.example import LOADS, figure, rated
from iso_16281.statements import published

D, DP, INSIDE, OUTSIDE, MODULUS = 11.5, 43.5, 5.98, 6.095, 210e3 / 0.91  # N, mm


def raceway(ring: float, groove: float) -> float:
    """δ/Q^(2/3) of a ball on a raceway of curvatures 1/ring and −1/groove: Hertz by quadrature."""
    rolling, across = 2 / D + ring, 2 / D - 1 / groove

    def moments(ratio: float) -> tuple[float, float]:
        """∫ dφ and ∫ cos² over √(1 − e² sin²): K-like integrals of the ellipse a = ratio, b = 1."""
        weight = lambda p: np.hypot(np.sin(p) * ratio, np.cos(p))  # noqa: E731
        short = quad(lambda p: np.cos(p) ** 2 / weight(p) ** 3, 0, np.pi / 2)[0]
        long = quad(lambda p: np.sin(p) ** 2 / weight(p) ** 3, 0, np.pi / 2)[0]
        return short, long

    ratio = brentq(lambda r: moments(r)[0] / moments(r)[1] - rolling / across, 1.0, 100.0)
    # potential of an ellipsoidal pressure, semi-axes r c and c: all integrals over 0 … π/2
    first = quad(lambda p: 1 / np.hypot(np.sin(p) * ratio, np.cos(p)), 0, np.pi / 2)[0]
    share = moments(ratio)[0]
    size = (3 / (np.pi * MODULUS) * share * 2 / rolling) ** (1 / 3)
    return float(3 / (np.pi * MODULUS) * first / size)


@pytest.fixture(scope="module")
def stiffness() -> float:
    inner = raceway(2 / (DP - D), INSIDE)
    outer = raceway(-2 / (DP + D), OUTSIDE)
    return float((inner + outer) ** -1.5)


def life(loads: np.ndarray) -> float:
    """L_10r in 10⁶ revolutions, inner ring turning."""
    g = D / DP
    grooves = (INSIDE / OUTSIDE * (2 * OUTSIDE - D) / (2 * INSIDE - D)) ** 0.41
    t = (1.044 * ((1 - g) / (1 + g)) ** 1.72 * grooves) ** (10 / 3)
    rated_inner = 23400 / 0.407 / 7 * (1 + t) ** 0.3
    rated_outer = 23400 / 0.389 / 7 * (1 + 1 / t) ** 0.3
    inner = np.mean(loads**3) ** (1 / 3)
    outer = np.mean(loads ** (10 / 3)) ** 0.3
    return float(((inner / rated_inner) ** (10 / 3) + (outer / rated_outer) ** (10 / 3)) ** -0.9)


@pytest.mark.parametrize("name", [name for name in LOADS if "tilted" not in name])
def test_plain_equations(name: str, stiffness: float) -> None:
    """Radial load: balls at ψ close by δ cos ψ − g; thrust: all alike."""
    gap, (radial, _) = LOADS[name]
    gap *= 1e3
    psi = 2 * np.pi * np.arange(7) / 7
    distance = INSIDE + OUTSIDE - D
    if radial:
        loads = lambda u: stiffness * np.maximum(u * np.cos(psi) - gap, 0) ** 1.5  # noqa: E731
        u = brentq(lambda u: loads(u) @ np.cos(psi) - 1000, gap, 1.0)
    else:

        def loads(u: float) -> np.ndarray:
            closing = max(np.hypot(distance - gap, u) - distance, 0)
            return np.full(7, stiffness * closing**1.5)

        u = brentq(lambda u: loads(u).sum() * u / np.hypot(distance - gap, u) - 1000, 1e-3, 1.0)
    which = "radial deflection" if radial else "axial deflection"
    rating = rated(name)
    assert figure(rating, which) == pytest.approx(1e3 * u, rel=1e-5)
    assert figure(rating, "L_10r") == pytest.approx(life(loads(u)), rel=1e-4)


def test_every_line_is_compared() -> None:
    assert len(published("load zone")) == 18 and len(published("ball bearing")) == 11
