"""Miner's sum at places of a tooth: a power law by hand, worst places, angles around an axis."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgear.gears.rating.damage import LifeCurve, Places, around_axis, pulsating_stress

SLOPE, KNEE = 8.0, 1e9  # of a curve that is one power law: N = KNEE (1/σ)^SLOPE
CURVE = LifeCurve((1.0, KNEE), (KNEE ** (1 / SLOPE), 1.0))


@given(st.integers(0, 2**32 - 1))
def test_the_worst_place_of_a_power_law(seed):
    """D = Σ n/P Σ σ_p^k/KNEE, and the factor on all stresses with D = 1 is D^(−1/k)."""
    random = np.random.default_rng(seed)
    stresses = [random.uniform(0.3, 1.2, (passes, 7)) for passes in (3, 3, 5)]
    cycles = random.uniform(1e5, 1e9, 3)
    places = Places(lambda b: stresses[b], (CURVE,) * 3, cycles)
    by_hand = sum(
        n * (stress**SLOPE).mean(axis=0) / KNEE for n, stress in zip(cycles, stresses, strict=True)
    )
    assert places.damage() == pytest.approx(by_hand, rel=1e-9)
    place, safety = places.weakest()
    assert place == np.argmax(by_hand)
    assert safety == pytest.approx(by_hand.max() ** (-1 / SLOPE), rel=1e-9)


def test_every_tooth_has_its_weakest_place():
    """Of three teeth of four places by hand, the last without load."""
    random = np.random.default_rng(3)
    stresses = [random.uniform(0.3, 1.2, (4, 12)) * (np.arange(12) < 8) for _ in range(2)]
    cycles = np.array([3e7, 5e8])
    damage = sum(n * (s**SLOPE).mean(axis=0) / KNEE for n, s in zip(cycles, stresses, strict=True))
    places, safeties = Places(lambda b: stresses[b], (CURVE,) * 2, cycles).weakest(3)
    assert (places[:2] == damage.reshape(3, 4).argmax(axis=1)[:2] + [0, 4]).all()
    by_hand = damage.reshape(3, 4).max(axis=1)[:2] ** (-1 / SLOPE)
    assert safeties == pytest.approx([*by_hand, math.inf], rel=1e-9)


def test_the_most_stressed_place_need_not_be_the_weakest():
    stress = np.array([[1.0, 0.95], [0.1, 0.95]])  # once high, or always nearly so
    places = Places(lambda _: stress, (CURVE,), np.array([KNEE]))
    assert places.weakest()[0] == 1
    idle = Places(lambda _: 0 * stress, (CURVE,), np.array([KNEE]))
    assert idle.weakest()[1] == math.inf and not idle.damage().any()


@given(st.permutations(range(6)), st.floats(0, 2 * math.pi))
def test_around_an_axis_any_start_and_order_give_the_same(order, turned):
    angles = np.array([0.1, 0.9, 2.0, 3.5, 4.4, 6.1])
    values = np.array([1.0, 4.0, 2.0, 5.0, 3.0, 0.5])
    at = np.linspace(0, 2 * math.pi, 50, endpoint=False)
    straight = np.interp(at, angles, values, period=2 * math.pi)
    moved = np.mod(angles + turned, 2 * math.pi)[list(order)]
    assert around_axis(moved, values[list(order)], at + turned) == pytest.approx(straight, abs=1e-9)
    assert around_axis(angles[:1], values[:1], at) == pytest.approx(1.0)


def test_full_alternation_counts_as_the_mean_stress_factor_says():
    """σ_max = −σ_min, M = 0.4: Y_M = 1/(1 + 0.6/1.4) on the strength is its inverse on stress."""
    counted = pulsating_stress(np.array([100.0, 100.0]), np.array([-100.0, 30.0]), 0.6 / 1.4)
    assert counted == pytest.approx([100 * (1 + 0.6 / 1.4), 100.0])
