"""Weibull laws of parts and the life of all of them together."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgear.gears.reliability import (
    PartLife,
    reliability_factor,
    system_life,
    system_reliability,
)

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
    """N parts alike: life falls by N^(−1/b)."""
    part = PartLife(1000.0, 1.5, 0.0)
    assert system_life([part] * 8) == pytest.approx(1000 * 8 ** (-1 / 1.5), rel=1e-9)
    assert system_life([part]) == pytest.approx(1000) and system_life([]) == math.inf
    assert system_life([part, PartLife(math.inf, 1.5, 0.2)]) == pytest.approx(1000)


@given(gearbox=st.lists(parts, min_size=1, max_size=12), reliability=st.floats(0.6, 0.99))
def test_life_of_a_gearbox(gearbox, reliability):
    """At it all parts together have the reliability; one part more never helps; order is free."""
    life = system_life(gearbox, reliability)
    assert system_reliability(gearbox, life) == pytest.approx(reliability, rel=1e-6)
    assert life <= min(part.at(reliability) for part in gearbox) * (1 + 1e-12)
    assert system_life([*gearbox, gearbox[0]], reliability) <= life * (1 + 1e-9)
    assert system_life(gearbox[::-1], reliability) == pytest.approx(life, rel=1e-9)


def test_factor_of_reliability():
    assert [reliability_factor(r) for r in (0.9, 0.95, 0.99)] == pytest.approx([1, 0.64, 0.25])
    assert 0.25 < reliability_factor(0.985) < 0.37
    with pytest.raises(ValueError, match=r"from 0\.9"):
        reliability_factor(0.5)
