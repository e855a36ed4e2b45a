"""Balls and rollers by the plain equations: equilibrium and life written down without flexgear."""

import numpy as np
import pytest
from rows import published
from scipy.integrate import quad
from scipy.optimize import brentq, root

from flexgear.gears.bearings.bearing import RollingBearing, rate_load
from flexgear.gears.bearings.reference_life import Ratings
from flexgear.gears.bearings.rows import RollerRow, standard_drops
from iso_16281.example import LOADS, figure, rated
from iso_16281.statements import PAPER

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


@pytest.mark.parametrize("name", list(LOADS)[:4])
def test_plain_equations(name: str, stiffness: float) -> None:
    """Radial load: balls at ψ close by δ cos ψ − g; thrust: all alike."""
    gap, (radial, *_) = LOADS[name]
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
    assert len(published(PAPER, "load zone")) == 18 and len(published(PAPER, "ball bearing")) == 17


ROLLERS = {"count": 12, "diameter": 15.0, "pitch": 75.0, "length": 16.0, "rating": 6e4}  # mm, N


def plain_rollers(
    load: float, moment: float, gap: float, laminae: int, turning: str, edges: bool, profile: bool
) -> tuple[float, float, float]:
    """δ_r (mm), tilt (rad) and L_10r (10⁶) of a row of rollers, element by element, in N and mm."""
    z, d, dp, length, c = ROLLERS.values()
    places = [((k + 0.5) / laminae - 0.5) * length for k in range(laminae)]
    drops = [
        0.00035 * d * np.log(1 / (1 - (2 * x / length) ** 2)) if profile else 0 for x in places
    ]
    angles = [2 * np.pi * (j + 0.5) / z for j in range(z)]  # two rollers beside the load

    def loads(delta: float, tilt: float) -> np.ndarray:
        out = np.zeros((z, laminae))
        for j, phi in enumerate(angles):
            for k, x in enumerate(places):
                inward = delta * np.cos(phi) - gap + x * np.tan(tilt) * np.cos(phi) - 2 * drops[k]
                if inward > 0:
                    out[j, k] = 35948 * length ** (8 / 9) / laminae * inward ** (10 / 9)
        return out

    def balance(u: np.ndarray) -> list[float]:
        q = loads(u[0] * 1e-3, u[1] * 1e-3) * np.cos(angles)[:, None]
        return [q.sum() / load - 1, ((q @ places).sum() - moment) / load]

    solution = root(balance, [1e3 * gap + 30, 0.1], tol=1e-12)
    assert solution.success
    delta, tilt = solution.x * 1e-3
    q, total = loads(delta, tilt), 0.0
    g = d / dp
    t = 1.038 * ((1 - g) / (1 + g)) ** (143 / 108)
    inner = c / (0.83 * 0.378 * z) * (1 + t**4.5) ** (2 / 9) / laminae ** (7 / 9)
    outer = c / (0.83 * 0.364 * z) * (1 + t**-4.5) ** (2 / 9) / laminae ** (7 / 9)
    powers = (4.0, 4.5) if turning == "inner" else (4.5, 4.0)
    for k in range(laminae):
        away = 1.985 * abs(2 * (k + 1) - laminae - 1) / (2 * laminae - 2)
        factor = 1 - 0.01 / np.log(away) if edges else 1.0
        for rated_load, w in zip((inner, outer), powers, strict=True):
            equivalent = (sum((factor * load) ** w for load in q[:, k]) / z) ** (1 / w)
            total += (equivalent / rated_load) ** 4.5
    return delta, tilt, total ** (-8 / 9)


@pytest.mark.parametrize("moment", [0.0, 1.5e4])
@pytest.mark.parametrize("gap", [0.0, 0.02])
@pytest.mark.parametrize(
    ("turning", "edges", "profile"),
    [("inner", True, True), ("outer", False, True), ("inner", False, False)],
)
def test_plain_rollers(moment: float, gap: float, turning: str, edges: bool, profile: bool) -> None:
    """Tilt, clearance and profile; 8 kN, no moment or 15 N m."""
    plain = plain_rollers(8e3, moment, gap, 30, turning, edges, profile)
    z, d, dp, length, c = ROLLERS.values()
    drops = standard_drops(d * 1e-3, length * 1e-3) if profile else (0.0,) * 30
    row = RollerRow(
        int(z), d * 1e-3, dp * 1e-3, 0.0, gap * 1e-3, 0.0, length * 1e-3, drops, edges,
        phase=np.pi / z,
    )  # fmt: skip
    stationary = "outer" if turning == "inner" else "inner"
    bearing = RollingBearing((row,), Ratings(c))
    rating = rate_load(bearing, np.array([8e3, 0, 0, 0, moment * 1e-3]), stationary)
    assert 1e3 * rating.motion[0] == pytest.approx(plain[0], rel=1e-7)
    assert rating.motion[4] == pytest.approx(plain[1], rel=1e-6, abs=1e-10)
    assert rating.basic_life / 1e6 == pytest.approx(plain[2], rel=1e-6)
