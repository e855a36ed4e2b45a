"""Histories with many oscillations: their envelopes, close-ups and orbits have closed forms."""

import numpy as np
import pytest

from flexgear.views.select import close_up, draw, is_dense, orbit, oscillations
from flexgear.views.style import panels

TIME = np.linspace(0.0, 5.32, 5321)
CYCLES = 93


def drawn(values):
    _, axes = panels(1, 1, height_mm=60)
    return draw(axes[0, 0], TIME, values, "black"), axes[0, 0]


def test_many_cycles_are_a_band_between_least_and_largest():
    """2 + (1 + 0.2 sin t) sin ωt lies between 2 ± (1 + 0.2 sin t); a place of the band has the
    extremes of nine cycles, six from it at most, in which the size changes by 0.2 2π 6/93."""
    size = 1 + 0.2 * np.sin(2 * np.pi * TIME / 5.32)
    dense, axes = drawn(2 + size * np.sin(2 * np.pi * CYCLES * TIME / 5.32))
    low, high = axes.get_lines()
    assert dense and len(axes.collections) == 1
    for line, sign in ((low, -1), (high, 1)):
        exact = 2 + sign * np.interp(line.get_xdata(), TIME, size)
        outside = sign * (line.get_ydata() - exact)
        of_cycle = 0.2 * 2 * np.pi / CYCLES  # most that the size changes in one
        assert outside.min() > -of_cycle and outside.max() < 6 * of_cycle
    assert len(low.get_xdata()) == CYCLES // 3


def test_ripple_on_a_few_waves_is_a_line():
    """As a tooth of the ring has as planets pass: what counts is the wave."""
    values = 40 * np.sin(2 * np.pi * 5 * TIME / 5.32) + 4 * np.sin(2 * np.pi * CYCLES * TIME / 5.32)
    dense, axes = drawn(values)
    assert not dense
    (line,) = axes.get_lines()
    np.testing.assert_array_equal(line.get_ydata(), values)


@pytest.mark.parametrize("values", [np.ones(100), np.full(100, np.nan), np.zeros(2)])
def test_what_is_constant_or_missing_does_not_oscillate(values):
    assert oscillations(values) == 0


def test_a_close_up_holds_some_cycles_about_the_largest_value():
    values = np.sin(2 * np.pi * CYCLES * TIME / 5.32) * (1 + np.exp(-((TIME - 2.0) ** 2)))
    near = close_up(np.column_stack([values, -0.5 * values]))
    shown = TIME[near]
    assert is_dense(values)
    assert shown[0] < TIME[np.argmax(values)] < shown[-1]
    assert shown[-1] - shown[0] == pytest.approx(4 * 5.32 / CYCLES, rel=0.05)


def test_an_orbit_is_round_where_samples_are_few():
    """Eight samples a turn: their polygon comes to 0.924 of the radius, the orbit to 1 % of it."""
    angle = 2 * np.pi * np.arange(60 * 8) / 8
    way = np.column_stack([np.cos(angle), np.sin(angle)])
    found = orbit(way)
    np.testing.assert_allclose(np.hypot(*found.T), 1.0, atol=1e-2)
    assert len(found) == pytest.approx(4 * 60, rel=0.2)  # of the last four turns
