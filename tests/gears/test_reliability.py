"""Weibull laws of parts and the reliability of all of them together."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgear.gears.rating.damage import PartLife, system_reliability

parts = st.builds(PartLife, st.floats(1.0, 1e6), st.floats(1.05, 3.0), st.floats(0.0, 0.95))


@given(part=parts, reliability=st.floats(0.5, 0.999))
def test_life_and_reliability_are_inverse(part, reliability):
    assert part.reliability(part.at(reliability)) == pytest.approx(reliability, rel=1e-6)
    assert part.at(0.9) == pytest.approx(part.life) and part.reliability(0.0) == 1


def test_first_and_tenth_per_cent():
    """B_1/B_10 of flanks and bearings by hand."""
    spread = math.log(0.99) / math.log(0.9)
    flank, roller = PartLife.typical("pitting", 100.0), PartLife.typical("roller", 100.0)
    assert flank.life * (0.6 + 0.4 * spread ** (1 / 1.3)) == pytest.approx(100)
    assert roller.life == pytest.approx(100)
    assert roller.at(0.99) == pytest.approx(100 * (0.2 + 0.8 * spread ** (1 / 1.35)))


def test_equal_parts_without_failure_free_time():
    """N parts alike: all live to N^(−1/b) of B_10 with a probability of 0.9; order is free."""
    part, other = PartLife(1000.0, 1.5, 0.0), PartLife(700.0, 1.2, 0.3)
    assert system_reliability([part] * 8, 1000 * 8 ** (-1 / 1.5)) == pytest.approx(0.9, rel=1e-12)
    both = system_reliability([part, other], 600.0)
    assert both == system_reliability([other, part], 600.0)
    assert both < min(part.reliability(600.0), other.reliability(600.0))
    assert system_reliability([], 1.0) == 1.0
