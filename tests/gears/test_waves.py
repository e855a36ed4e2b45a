"""Stiffness waves against closed forms: mean, Fourier coefficients, Parseval, limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgear.gears.stiffness import (
    iso_mean_stiffness,
    pairs_on_path,
    stiffness_wave,
    wave_coefficients,
)

RATIOS = st.floats(1.0, 4.0)
MODELS = ("constant", "rectangular", "fourier")


@settings(max_examples=60, deadline=None)
@given(
    model=st.sampled_from(MODELS), ratio=RATIOS, overlap=st.floats(0, 3), terms=st.integers(1, 60)
)
def test_every_wave_keeps_its_mean(model, ratio, overlap, terms):
    wave = stiffness_wave(model, 2.5e9, ratio, overlap, terms)
    assert wave.mean() == pytest.approx(2.5e9, rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(ratio=RATIOS)
def test_the_rectangular_wave_is_single_pair_stiffness_times_pairs_on_the_path(ratio):
    """k_single = mean/ε; floor(ε) + 1 pairs for the share ε − floor(ε) of the pitch, from x = 0."""
    wave = stiffness_wave("rectangular", 1.0, ratio, samples=4000)
    low, share = int(np.floor(ratio)), ratio - np.floor(ratio)
    x = np.arange(4000) / 4000
    clear = (np.minimum(x, 1 - x) > 1e-3) & (np.abs(x - share) > 1e-3)  # away from the jumps
    pairs = np.where(x < share, low + 1, low)
    assert wave[clear] * ratio == pytest.approx(pairs[clear].astype(float))
    assert np.mean(wave * ratio > low + 0.5) == pytest.approx(share, abs=1e-3)


def test_coefficients_are_those_of_the_sampled_wave():
    for ratio, overlap in ((1.6, 0.0), (1.45, 1.04), (2.3, 0.37)):
        x = (np.arange(20000) + 0.5) / 20000
        z = (np.arange(101) - 50) / 101  # face from -1/2 to 1/2, s moves by overlap z
        count = np.zeros_like(x)
        for k in range(-4, 6):
            s = x[:, None] + k + overlap * z
            count += ((s > 0) & (s < ratio)).mean(axis=1)
        assert count.mean() == pytest.approx(ratio, rel=1e-3)
        for h in (1, 2, 3, 5):
            direct = 2 * np.mean(count * np.exp(2j * np.pi * h * (x - ratio / 2))) / ratio
            closed = wave_coefficients(ratio, overlap, np.array([h]))[0]
            assert abs(direct.imag) < 2e-3
            assert direct.real == pytest.approx(closed, abs=2e-3)


def test_fourier_obeys_parseval_and_tends_to_the_rectangular_wave():
    """The error of the truncated series is the power of the missing terms: falls as 1/H."""
    ratio, n = 1.62, 4096
    exact = stiffness_wave("rectangular", 1.0, ratio, samples=n)
    orders = np.arange(1, 200001)
    power = np.mean(exact**2) - 1  # Σ c_h²/2 over all orders
    squares = wave_coefficients(ratio, 0.0, orders) ** 2 / 2
    assert power == pytest.approx(squares.sum(), rel=3e-3)
    jumps = 2 / ratio**2 / 4 / n  # most that averaging over cells takes from the power
    previous = np.inf
    for terms in (1, 3, 5, 20, 100):
        wave = stiffness_wave("fourier", 1.0, ratio, harmonics=terms, samples=n)
        left = np.mean((wave - exact) ** 2)
        assert left == pytest.approx(squares[terms:].sum(), rel=0.02, abs=jumps)
        assert left < previous
        previous = left


def test_terms_of_the_published_series():
    """Hu et al. 2023, eq. 4 with the sign (−1)^h: ½ k_single Σ 4/(πh) (−1)^h sin hπ(ε − 2)."""
    ratio, mean = 1.45, 8.16e8
    single = mean / ratio
    phase = np.arange(1024) / 1024  # ωt/2π, from the middle of the two-pair stretch
    published = np.full(1024, mean)
    for h in range(1, 6):
        published += (
            single / 2 * 4 / (np.pi * h) * (-1) ** h * np.sin(h * np.pi * (ratio - 2))
            * np.cos(2 * np.pi * h * phase)
        )  # fmt: skip
    wave = stiffness_wave("fourier", mean, ratio, harmonics=5)
    x = (phase + ratio / 2 + 0.5) % 1
    assert np.interp(x, np.arange(1025) / 1024, [*wave, wave[0]]) == pytest.approx(
        published, rel=2e-4
    )
    assert published[0] > mean > published[512]


def test_whole_ratios_have_no_wave():
    for ratio, overlap in ((2.0, 0.0), (1.5, 1.0)):
        wave = stiffness_wave("fourier", 1.0, ratio, overlap, harmonics=30)
        assert np.ptp(wave) < 1e-12
    assert np.ptp(stiffness_wave("rectangular", 1.0, 2.0)) < 1e-12


def test_pairs_averaged_over_a_whole_pitch_are_the_contact_ratio():
    at = np.linspace(-1, 1, 7)
    assert pairs_on_path(at, at + 1, 1.37) == pytest.approx(np.full(7, 1.37))
    assert pairs_on_path(np.array([0.1]), np.array([0.2]), 1.37) == pytest.approx([2.0])


def test_iso_mean_of_two_pairs():
    """ε_α = 2: c_γ = 1.75 c'."""
    assert iso_mean_stiffness(14e9, 2.0, 0.1) == pytest.approx(1.75 * 1.4e9)


def test_unknown_models_are_no_waves():
    with pytest.raises(ValueError, match="no stiffness wave"):
        stiffness_wave("per_pair", 1.0, 1.5)
