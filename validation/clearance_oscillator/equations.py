"""An oscillator m ẍ + k x₊ − k (−x − b)₊ = F₀ with clearance b, without flexgear: its free motion
in closed form, and its forced motion by the first-order harmonic balance.

Lengths over x_s = F₀/k, forces over F₀, frequencies over ω₀ = √(k/m).
"""

import math

import numpy as np
from scipy.optimize import brentq


def backbone(peak: float, clearance: float = math.inf) -> float:
    """Frequency of the free motion with the largest force ``peak``: in contact x = 1 + a cos t,
    a = peak − 1; where a > 1 it leaves at cos θ = −1/a with speed a sin θ, falls back under F₀,
    and, where that reaches the other side, is thrown back there by a spring under F₀."""
    a = peak - 1.0
    if a <= 1.0:
        return 1.0
    theta = math.acos(-1.0 / a)
    leaves = a * math.sin(theta)
    square = leaves**2 - 2.0 * clearance
    if square <= 0.0:
        return math.pi / (theta + leaves)
    arrives = math.sqrt(square)
    return math.pi / (theta + leaves - arrives + math.atan(arrives))


def mean_shift(amplitude: float) -> float:
    """Mean of δ = mean + amplitude cos φ that gives δ₊ the mean 1; 1 where δ stays positive."""
    if amplitude <= 1.0:
        return 1.0

    def over(mean: float) -> float:
        share = mean / amplitude
        return mean * (0.5 + math.asin(share) / math.pi) + amplitude / math.pi * math.sqrt(
            1 - share**2
        )

    return float(brentq(lambda mean: over(mean) - 1.0, -amplitude, amplitude, xtol=1e-15))


def describing(amplitude: float) -> float:
    """First harmonic of δ₊ over that of δ, 1 where δ stays positive."""
    if amplitude <= 1.0:
        return 1.0
    share = mean_shift(amplitude) / amplitude
    return 0.5 + (math.asin(share) + share * math.sqrt(1 - share**2)) / math.pi


def forced(amplitude: float, error: float, damping: float) -> list[tuple[float, float]]:
    """Frequencies w, rising, at which δ = x + error sin has the amplitude, damped by 2ζ δ̇ always,
    and the amplitude of x there: with N the describing function,
    amplitude² [(N − w²)² + (2ζw)²] = error² w⁴, |x|² w⁴ = [N² + (2ζw)²] amplitude²."""
    n, c = describing(amplitude), 4.0 * damping**2
    a, e = amplitude**2, error**2
    squares = np.roots([a - e, a * (c - 2.0 * n), a * n**2])
    real = sorted(float(s.real) for s in squares if abs(s.imag) < 1e-12 and s.real > 0.0)
    return [(math.sqrt(s), amplitude * math.sqrt(n**2 + c * s) / s) for s in real]


def first_order_jumps(error: float, damping: float) -> tuple[float, float]:
    """Frequencies at which sweeps down and up jump: the least on the upper side of the resonance,
    and the largest on its lower side where it leans over."""
    amplitudes = np.linspace(1.0, error / (2.0 * damping) + 2.0, 40001)
    pairs = [w for w in (forced(float(a), error, damping) for a in amplitudes) if len(w) == 2]
    low, high = (np.array([pair[side][0] for pair in pairs]) for side in (0, 1))
    return float(high.min()), float(low.max())
