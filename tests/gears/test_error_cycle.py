"""Error cycles against brute force over teeth, and how evenly samples meet phases."""

import math
from collections import Counter
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgear.gears.error_cycle import (
    MAX_CYCLES,
    ErrorCycle,
    TrainTurn,
    error_cycle,
    error_sources,
    exact_rate,
    sample_train_angles,
    spread,
    train_cycle,
)
from flexgear.model.errors import FlexgearError
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.load import load_case

TEETH = st.integers(5, 14)


def planetary(sun, planet, ring):
    gears = {
        n: SimpleNamespace(teeth=z)
        for n, z in zip(("sun", "planet", "ring"), (sun, planet, ring), strict=True)
    }
    return SimpleNamespace(kind="planetary", **gears)


def parallel(pinion, gear):
    return SimpleNamespace(
        kind="parallel", pinion=SimpleNamespace(teeth=pinion), gear=SimpleNamespace(teeth=gear)
    )


@given(sun=TEETH, planet=TEETH, ring=st.integers(15, 30), turns=st.fractions(-3, 3))
def test_runouts_come_back_exactly_and_not_before(sun, planet, ring, turns):
    """Angles of sun, planet and ring relative to the carrier and of the carrier in space."""
    stage = planetary(sun, planet, ring)
    cycle = error_cycle(stage, carrier_turns=turns)
    rates = [Fraction(ring, sun), -Fraction(ring, planet), Fraction(-1), turns, Fraction(ring)]
    assert all((cycle.turns * r).denominator == 1 for r in rates)
    divisors = [d for d in range(2, 50) if cycle.gear_meshes % d == 0]
    for d in divisors:
        assert any((cycle.turns / d * r).denominator != 1 for r in rates)


def test_only_the_sources_that_are_there_count():
    stage = planetary(12, 30, 75)
    assert error_cycle(stage).gear_meshes == 300
    assert error_cycle(stage, ["sun"]).turns == Fraction(12, 75)
    assert error_cycle(stage, ["sun", "planet"]).gear_meshes == 60
    assert error_cycle(stage, ["ring"]).turns == 1
    assert error_cycle(stage, ["housing"]).turns == 1  # ring held
    assert error_cycle(stage, ["housing"], Fraction(0)).gear_meshes == 1  # carrier held
    assert error_cycle(stage, ["housing"], Fraction(-2, 5)).turns == 5  # 2.5 is 187.5 gear meshes
    assert error_cycle(stage, []).turns == Fraction(1, 75)
    with pytest.raises(FlexgearError, match="no source"):
        error_cycle(stage, ["planets"])


def test_parallel_stage():
    cycle = error_cycle(parallel(24, 93))
    assert (cycle.gear_meshes, cycle.turns) == (744, 8)
    assert error_cycle(parallel(24, 93), ["planet"]).turns == 1


def test_sources_of_errors():
    assert error_sources(GearErrors()) == ()
    given_errors = GearErrors(sun_eccentricity=1e-5, planet_eccentricity=(0.0, 1e-5, 0.0))
    assert error_sources(given_errors) == ("sun", "planet")
    assert error_sources(GearErrors(ring_pitch=1e-6, ring_offset=1e-6)) == ("ring", "housing")
    assert error_sources(GearErrors(ring_gear_mesh=1e-5), housing=True) == ("housing",)


def sample_angles(stage, per_gear_mesh, most=MAX_CYCLES):
    """Angles of a stage that is a train by itself."""
    return sample_train_angles([TrainTurn(error_cycle(stage), Fraction(1))], 0, per_gear_mesh, most)


def test_bundled_stage_is_sampled_in_whole_gear_mesh_cycles():
    stage = load_case("wind-5mw").view().stage
    whole = error_cycle(stage)
    assert (whole.gear_meshes, whole.turns) == (9207, 99)  # lcm(27, 33, 93)
    s = sample_angles(stage, 8, most=186)
    assert s.angles.shape == (186 * 8,)
    assert np.all(np.diff(s.angles) > 0) and s.angles[-1] < 2 * math.pi * 99
    # each cycle is one ring tooth wide and begins where a ring tooth begins
    starts = s.angles.reshape(-1, 8)[:, 0] * 93 / (2 * math.pi)
    np.testing.assert_allclose(starts, s.gear_mesh, atol=1e-9)
    np.testing.assert_allclose(np.diff(s.angles.reshape(-1, 8)), 2 * math.pi / 93 / 8)


@given(sun=TEETH, planet=TEETH, ring=st.integers(15, 40), times=st.integers(1, 3))
def test_sampled_cycles_meet_every_phase_of_every_gear_equally_often(sun, planet, ring, times):
    stage = planetary(sun, planet, ring)
    for name, z in (("sun", sun), ("planet", planet), ("ring", ring)):
        s = sample_angles(stage, 1, most=times * z)
        if len(s.gear_mesh) < error_cycle(stage).gear_meshes:
            met = Counter((s.gear_mesh % z).tolist())
            assert met == dict.fromkeys(range(z), times), name


@given(count=st.integers(3, 10**6), data=st.data())
def test_spread_is_distinct_rising_and_leaves_no_wide_gap(count, data):
    most = data.draw(st.integers(1, min(count, 300)))
    s = spread(count, most)
    assert len(s) == most and np.all(np.diff(s) > 0) and s[0] >= 0 and s[-1] < count
    if most > 20 and count > 10**4:  # three-distance theorem near the golden ratio
        gaps = np.diff(np.append(s, s[0] + count))
        assert gaps.max() < 4 * count / most


def test_train_comes_back_when_all_stages_do():
    """Two stages in series, ring held: the second carrier turns with the first sun."""
    first, second = planetary(18, 36, 90), planetary(15, 30, 75)
    turns = [
        TrainTurn(error_cycle(first), Fraction(1)),
        TrainTurn(error_cycle(second), Fraction(6)),  # 1 + 90/18
    ]
    period = train_cycle(turns)
    assert period == 2  # lcm(180/90, 150/75/6) = lcm(2, 1/3)
    for t in turns:
        assert (period * t.rate / t.cycle.turns).denominator == 1
    s = sample_train_angles(turns, 1, 4, most=10**6)
    assert len(s.gear_mesh) == 2 * 6 * 75
    np.testing.assert_allclose(s.angles[4], 2 * math.pi / 6 / 75)
    still = TrainTurn(error_cycle(first), Fraction(0))
    assert train_cycle([*turns, still]) == period
    for call in (lambda: train_cycle([still]), lambda: sample_train_angles([still], 0, 1, 1)):
        with pytest.raises(FlexgearError, match="turn"):
            call()


def test_long_train_is_sampled_evenly_in_every_stage():
    """Three stages of the pitch drive: phases of every gear of every stage fill the circle."""
    z = [(12, 30, 75), (18, 28, 75), (16, 23, 65)]
    cycles = [error_cycle(planetary(*t)) for t in z]
    ratios = [1 + Fraction(r, s) for s, _, r in z]
    rates = [ratios[1] * ratios[2], ratios[2], Fraction(1)]  # input coordinate: last carrier
    turns = [TrainTurn(c, r) for c, r in zip(cycles, rates, strict=True)]
    s = sample_train_angles(turns, 2, 1, most=2000)
    assert len(s.gear_mesh) == 2000
    for t, (sun, planet, ring) in zip(turns, z, strict=True):
        for teeth in (sun, planet, ring):
            turned = s.angles * float(t.rate) * ring / teeth
            assert abs(np.exp(1j * turned).mean()) < 0.02
    # and the phases of two stages are not tied to each other
    a, b = (s.angles * float(t.rate) * 75 / n for t, n in ((turns[0], 12), (turns[1], 18)))
    assert abs(np.exp(1j * (a - b)).mean()) < 0.05 and abs(np.exp(1j * (a + b)).mean()) < 0.05


def test_endless_train_keeps_its_phases():
    cycle = ErrorCycle(9207, 93)
    turns = [TrainTurn(cycle, Fraction(1)), TrainTurn(cycle, Fraction(999_983, 999_979))]
    s = sample_train_angles(turns, 0, 2, most=100)
    assert len(s.gear_mesh) == 100 and s.gear_mesh.max() < MAX_CYCLES


def test_rates_from_speeds():
    assert exact_rate(2.0 * (1 + 93 / 27), 2.0) == Fraction(40, 9)
    assert exact_rate(-1.5, 3.0) == Fraction(-1, 2)
    with pytest.raises(FlexgearError, match="at least one"):
        sample_angles(planetary(12, 30, 75), 0)
