"""Life curves, Miner's sum of bins and at places of a tooth, reliability: slopes and limits."""

import math
from typing import get_args

import numpy as np
import pytest
from gears.rated_gears import PLANETARY, case_of, pair_of
from hypothesis import given
from hypothesis import strategies as st

from flexgear.gears.rating.capacity import rate
from flexgear.gears.rating.damage import (
    LifeCurve,
    PartLife,
    Places,
    Spectrum,
    around_axis,
    pulsating_stress,
    system_reliability,
)
from flexgear.gears.rating.steels import allowable_stress, flank_knees, root_knees
from flexgear.model.rating import GearRating, SteelKind
from flexgear.model.section import Refusal

STEELS = get_args(SteelKind)

CURVE = LifeCurve((1e5, 5e7, 1e10), (1600.0, 1000.0, 850.0))
stresses = st.floats(min_value=300.0, max_value=1500.0)
counts = st.floats(min_value=1.0, max_value=1e9)
spectra = st.lists(st.tuples(stresses, counts), min_size=1, max_size=20)


def spectrum(bins, curve=CURVE):
    sigma, cycles = np.array(bins).T
    return Spectrum.of([curve] * len(bins), sigma, cycles)


def damage(bins):
    return spectrum(bins).damages().sum()


def test_a_curve_at_its_knees_and_its_ends():
    for cycles, stress in zip(CURVE.cycles, CURVE.stress, strict=True):
        assert CURVE.stress_at(cycles) == pytest.approx(stress, rel=1e-12)
    assert CURVE.stress_at(1.0) == 1600.0
    assert CURVE.cycles_at(1600.0) == pytest.approx(1e5)
    assert CURVE.cycles_at(1600.1) == 0.0
    level = LifeCurve((1e3, 3e6, 1e10), (2.5, 1.0, 1.0))
    assert level.cycles_at(1.0) == math.inf and level.cycles_at(1.0001) < 3e6


@given(st.floats(min_value=1e5, max_value=1e12))
def test_a_curve_and_its_inverse(cycles):
    assert CURVE.cycles_at(CURVE.stress_at(cycles)) == pytest.approx(cycles, rel=1e-9)


@given(stresses, counts)
def test_one_bin_is_the_rating_of_a_constant_load(stress, cycles):
    one = spectrum([(stress, cycles)])
    assert one.safety == pytest.approx(CURVE.stress_at(cycles) / stress, rel=1e-12)
    assert one.damages() == pytest.approx([cycles / CURVE.cycles_at(stress)], rel=1e-12)


@given(spectra, st.randoms(use_true_random=False), st.floats(min_value=0.05, max_value=0.95))
def test_splitting_and_reordering_bins_changes_no_damage(bins, random, share):
    pieces = [(s, x) for s, n in bins for x in (share * n, (1 - share) * n)]
    random.shuffle(pieces)
    assert damage(pieces) == pytest.approx(damage(bins), rel=1e-12, abs=0)
    assert spectrum(pieces).safety == pytest.approx(spectrum(bins).safety, rel=1e-12)


@given(spectra)
def test_at_the_safety_the_damage_is_one(bins):
    safety = spectrum(bins).safety
    # one of the bins may stand at the static stress, above which nothing lives
    assert damage([(safety * s, n) for s, n in bins]) <= 1 + 1e-9
    assert damage([(safety * (1 + 1e-9) * s, n) for s, n in bins]) > 1 - 1e-6


@given(spectra, spectra)
def test_places_side_by_side_are_rated_as_alone(first, second):
    """Many stresses under the same cycles at once."""
    count = min(len(first), len(second))
    cycles = [n for _, n in first[:count]]
    sides = [[s for s, _ in side[:count]] for side in (first, second)]
    both = Spectrum.of([CURVE] * count, np.array(sides).T, cycles)
    alone = [spectrum(list(zip(side, cycles, strict=True))) for side in sides]
    assert both.safety == pytest.approx([float(one.safety) for one in alone], rel=1e-12)
    assert both.damages() == pytest.approx(np.array([one.damages() for one in alone]).T)


def test_no_load_no_damage():
    idle = spectrum([(0.0, 1e9), (900.0, 0.0)])
    assert not idle.damages().any() and idle.safety == math.inf
    level = LifeCurve((1e3, 3e6, 1e10), (2.5, 1.0, 1.0))
    endless = Spectrum.of([level], [0.8], [1e12])
    assert not endless.damages().any() and endless.safety == pytest.approx(1.25, rel=1e-12)


def test_bins_must_fit_one_another():
    with pytest.raises(ValueError, match="2 curves"):
        Spectrum.of([CURVE, CURVE], [1.0], [1.0])
    other = LifeCurve((1e3, 3e6), (2.0, 1.0))
    with pytest.raises(ValueError, match="different knees"):
        Spectrum.of([CURVE, other], [1.0, 1.0], [1.0, 1.0])


def test_static_factors_only_change_the_static_end(tmp_path):
    kinds = ("constant", "interpolated")
    both = [
        rate(*pair_of(case_of(tmp_path, PLANETARY, **{"rating.static_factors": kind})),
             {})
        for kind in kinds
    ]  # fmt: skip
    for place, static in (("flank", 1.6), ("root", 2.5)):
        constant, interpolated = (states["sun", place].curve for states in both)
        assert interpolated.stress[1:] == constant.stress[1:]
        assert constant.stress[0] == pytest.approx(static * constant.stress[1], rel=1e-12)
    assert both[1]["sun", "flank"].curve.stress[0] == pytest.approx(1.6 * 1500e6, rel=1e-12)


def test_life_factors_of_steels_fall_and_end_at_the_long_life_factor():
    for steel in STEELS:
        for knees in (
            flank_knees(steel, 0.9, limited_pitting=False),
            flank_knees(steel, 0.9, limited_pitting=True),
            root_knees(steel, 0.9),
        ):
            cycles, factors = zip(*knees, strict=True)
            assert list(cycles) == sorted(cycles) and list(factors) == sorted(factors)[::-1]
            assert knees[-1] == (1e10, 0.9) and 1.0 in factors


@given(st.sampled_from(STEELS), st.floats(min_value=100.0, max_value=1000.0))
def test_strength_does_not_fall_with_grade_or_hardness(steel, hardness):
    for place in ("flank", "root"):
        values = []
        for grade in ("ML", "MQ", "ME"):
            try:
                values.append([
                    allowable_stress(
                        GearRating(steel=steel, grade=grade, vickers_hardness=x), place
                    )
                    for x in (hardness, min(hardness + 20.0, 1000.0))
                ])  # fmt: skip
            except Refusal:
                continue
        assert all(soft <= hard for soft, hard in values)
        for number in (0, 1):
            assert [v[number] for v in values] == sorted(v[number] for v in values)


SLOPE, KNEE = 8.0, 1e9  # of a curve that is one power law: N = KNEE (1/σ)^SLOPE
POWER_LAW = LifeCurve((1.0, KNEE), (KNEE ** (1 / SLOPE), 1.0))


@given(st.integers(0, 2**32 - 1))
def test_the_worst_place_of_a_power_law(seed):
    """D = Σ n/P Σ σ_p^k/KNEE, and the factor on all stresses with D = 1 is D^(−1/k)."""
    random = np.random.default_rng(seed)
    stresses = [random.uniform(0.3, 1.2, (passes, 7)) for passes in (3, 3, 5)]
    cycles = random.uniform(1e5, 1e9, 3)
    places = Places(lambda b: stresses[b], (POWER_LAW,) * 3, cycles)
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
    places, safeties = Places(lambda b: stresses[b], (POWER_LAW,) * 2, cycles).weakest(3)
    assert (places[:2] == damage.reshape(3, 4).argmax(axis=1)[:2] + [0, 4]).all()
    by_hand = damage.reshape(3, 4).max(axis=1)[:2] ** (-1 / SLOPE)
    assert safeties == pytest.approx([*by_hand, math.inf], rel=1e-9)


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


parts = st.builds(PartLife, st.floats(1.0, 1e6), st.floats(1.05, 3.0), st.floats(0.0, 0.95))


@given(part=parts, reliability=st.floats(0.5, 0.999))
def test_life_and_reliability_are_inverse(part, reliability):
    assert part.reliability(part.at(reliability)) == pytest.approx(reliability, rel=1e-6)
    assert part.at(0.9) == pytest.approx(part.life) and part.reliability(0.0) == 1


def test_lives_at_one_and_ten_per_cent_by_hand():
    """B_1/B_10 of flanks and bearings by hand."""
    spread = math.log(0.99) / math.log(0.9)
    flank, roller = PartLife.typical("flank", 100.0), PartLife.typical("roller", 100.0)
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


def test_the_most_stressed_place_need_not_be_the_weakest():
    stress = np.array([[1.0, 0.95], [0.1, 0.95]])  # once high, or always nearly so
    places = Places(lambda _: stress, (POWER_LAW,), np.array([KNEE]))
    assert places.weakest()[0] == 1
    idle = Places(lambda _: 0 * stress, (POWER_LAW,), np.array([KNEE]))
    assert idle.weakest()[1] == math.inf and not idle.damage().any()


def test_an_extended_curve_goes_on_to_the_static_strength(tmp_path):
    """σ_HG ~ N^(-ln 1.6/ln 500) up to 1.6 σ_Hlim Z_X, above which a flank fails at once; a root of
    module 4 likewise up to 2.5 σ_Flim Y_ST (0.44 Y_S + 0.12)."""
    changes = {"rating.static_factors": "extended"}
    states = rate(*pair_of(case_of(tmp_path, PLANETARY, **changes)), {})
    flank, root = states["sun", "flank"], states["sun", "root"]
    assert flank.curve is not None and root.curve is not None
    static, line = 1.6 * 1500e6, 1.6 * flank.reference
    assert static > line
    assert flank.curve.stress_at(1.0) == pytest.approx(static)
    assert flank.curve.stress_at(1e5) == pytest.approx(line)
    between = math.sqrt(static * line)
    steep = math.log(500) / math.log(1.6)
    lasts = 1e5 * (line / between) ** steep
    assert float(flank.curve.cycles_at(between)) == pytest.approx(lasts)
    assert flank.curve.stress_at(lasts) == pytest.approx(between)
    assert float(flank.curve.cycles_at(1.0001 * static)) == 0.0
    notch = 0.44 * root.factors["Y_S"].value + 0.12
    assert root.curve.stress_at(1.0) == pytest.approx(2.5 * 425e6 * 2.0 * notch)
    # the sheet of a static load has the factors of which its strength is the product
    idler = states["planet", "root"]
    for state, y_m in ((root, 1.0), (idler, 1 / (1 + 1.2 * 0.3 / 1.7))):
        sheet, lasting = ({s: f.value for s, f in state.sheet(n).items()} for n in (1.0, 1e6))
        notch = 0.44 * sheet["Y_S"] + 0.12
        factors = [sheet[s] for s in ("Y_NT", "Y_δrelT", "Y_RrelT", "Y_X", "Y_M")]
        assert factors == pytest.approx([2.5, notch, 1.0, 1.0, y_m])
        permissible = math.prod(factors) * 425 * 2.0
        assert sheet["σ_FP"] * sheet["S_Fmin"] == pytest.approx(permissible)
        assert lasting["Y_δrelT"] != pytest.approx(notch, rel=0.01)
    factors = [flank.sheet(1.0)[s].value for s in ("Z_NT", "Z_L", "Z_v", "Z_R", "Z_W")]
    assert factors == pytest.approx([1.6, 1.0, 1.0, 1.0, 1.0])
    spectrum = Spectrum.of([flank.curve] * 2, [between, 1e8], [lasts, 1e3])
    assert float(spectrum.damages()[0]) == pytest.approx(1.0)
    assert float(spectrum.safety) == pytest.approx(1.0, rel=1e-3)


def test_bounded_life_factors_do_not_fall_beyond_their_last_value(tmp_path):
    falling, bounded = (
        rate(*pair_of(case_of(tmp_path, PLANETARY, **{"rating.bounded_life_factors": bound})), {})[
            "sun", "flank"
        ]
        for bound in (False, True)
    )
    assert falling.curve is not None and bounded.curve is not None
    least = 0.85 * bounded.reference
    assert bounded.curve.stress_at(1e13) == pytest.approx(least, rel=1e-12)
    assert falling.curve.stress_at(1e13) < 0.9 * least
    assert bounded.curve.stress_at(1e8) == falling.curve.stress_at(1e8)
    assert math.isinf(bounded.curve.cycles_at(0.999 * least))
    assert float(bounded.curve.cycles_at(1.001 * least)) == pytest.approx(
        float(falling.curve.cycles_at(1.001 * least))
    )
    assert bounded.safety(3e11) == pytest.approx(least / bounded.stress)
