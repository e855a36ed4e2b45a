"""The closed form of the free motion against its equation in time."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from clearance_oscillator.equations import backbone, describing, mean_shift


def period(peak: float, clearance: float) -> float:
    """From the largest x to the next one, by Runge-Kutta from event to event."""

    def slope(t: float, y: list[float]) -> list[float]:
        force = max(y[0], 0.0) - max(-y[0] - clearance, 0.0)
        return [y[1], 1.0 - force]

    def turn(t: float, y: list[float]) -> float:
        return y[1]

    turn.terminal, turn.direction = 2, -1  # type: ignore[attr-defined]
    solved = solve_ivp(
        slope, (0.0, 100.0), [peak, 1e-9], "DOP853", events=turn, max_step=0.01, rtol=1e-10
    )
    times = solved.t_events[0]
    return float(times[-1] - times[0])


@pytest.mark.parametrize("clearance", [math.inf, 2.0])
@pytest.mark.parametrize("peak", [2.5, 4.0, 6.0])
def test_free_vibration_has_the_frequency_of_the_backbone(peak: float, clearance: float) -> None:
    assert 2 * math.pi / period(peak, clearance) == pytest.approx(
        backbone(peak, clearance), rel=1e-5
    )


def test_describing_function_is_that_of_the_wave() -> None:
    """First harmonic and mean of δ₊ by sums over a period."""
    angle = 2 * np.pi * np.arange(100000) / 100000
    wave = np.maximum(mean_shift(2.0) + 2.0 * np.cos(angle), 0.0)
    assert wave.mean() == pytest.approx(1.0, rel=1e-6)
    assert 2 * (wave * np.cos(angle)).mean() / 2.0 == pytest.approx(describing(2.0), rel=1e-6)
