"""The recorder: filter, decimation, derivatives and chunks, on signals in closed form."""

import numpy as np
import pytest

from flexgear.analysis.recording import Clock, Quantity, Recorder

STEP = 4.1e-5
CLOCK = Clock(band=1000.0, rate=2560.0, step=STEP)


def recorded(signal, order=0, times=None, parts=1, clock=CLOCK):
    """Times and values of one signal given at the samples of a run."""
    times = np.arange(1, 30_001) * STEP if times is None else times
    recorder = Recorder(clock, [Quantity(lambda samples: samples, order)])
    pieces = [
        recorder.append(piece, signal(piece)[:, None]) for piece in np.array_split(times, parts)
    ]
    return np.concatenate([t for t, _ in pieces]), np.concatenate([v[:, 0] for _, v in pieces])


@pytest.mark.parametrize("hz", [3.0, 400.0, 999.0])
def test_waves_in_the_band_keep_their_times_and_derivatives(hz):
    """Amplitude and phase within 1e-4 at the times that are said: no delay is left."""
    w = 2 * np.pi * hz
    waves = (lambda t: np.sin(w * t), lambda t: w * np.cos(w * t), lambda t: -w * w * np.sin(w * t))
    for order, exact in enumerate(waves):
        t, values = recorded(waves[0], order)
        assert np.diff(t) == pytest.approx(1 / CLOCK.rate)
        np.testing.assert_allclose(values, exact(t), atol=1e-4 * w**order)


@pytest.mark.parametrize("hz", [1281.0, 1600.0, 2560.0, 5119.0, 7000.0])
def test_waves_that_would_fold_into_the_spectrum_are_rejected_by_80_db(hz):
    _, values = recorded(lambda t: np.sin(2 * np.pi * hz * t))
    assert np.abs(values).max() < 1e-4


def test_a_line_above_half_the_rate_of_plain_samples_would_have_folded():
    """What an unlucky interval does without the filter: 2500 Hz sampled at 2560 is 60 Hz."""
    t, values = recorded(
        lambda t: np.sin(2 * np.pi * 2500.0 * t) + 1e-3 * np.sin(2 * np.pi * 60 * t)
    )
    plain = np.sin(2 * np.pi * 2500.0 * t)
    assert np.abs(plain).max() > 0.9
    assert np.abs(values).max() == pytest.approx(1e-3, rel=0.2)


@pytest.mark.parametrize("parts", [7, 1000])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_chunks_give_what_the_whole_gives(order, parts):
    def signal(t):
        return np.sin(2 * np.pi * 300 * t) + t**2 + 0.1 * np.sin(2 * np.pi * 8000 * t)

    t, whole = recorded(signal, order)
    t_parts, values = recorded(signal, order, parts=parts)
    np.testing.assert_array_equal(t_parts, t)
    np.testing.assert_allclose(values, whole, rtol=0, atol=1e-12 * np.abs(whole).max())
    assert len(t) == CLOCK.count(np.r_[STEP, np.arange(29_993, 30_001) * STEP])


def test_steps_that_change_do_not_move_the_clock():
    """Finer steps after a jump of the torque: the grid stays, and so does the signal."""
    times = np.cumsum(np.r_[np.full(9000, 4.1e-5), np.full(9000, 1.3e-5), np.full(9000, 3.7e-5)])
    clock = Clock(1000.0, 2560.0, step=1.3e-5)
    t, values = recorded(lambda t: np.cos(2 * np.pi * 700 * t), 0, times, clock=clock)
    np.testing.assert_allclose(values, np.cos(2 * np.pi * 700 * t), atol=1e-4)


def test_large_slow_motion_leaves_nothing_in_its_derivatives():
    """Turns beside micrometres, the worst case for differences: a shaft's angle, and a place on it
    that moves by metres, with 20 rad/s."""
    _, speed = recorded(lambda t: 1e3 + 200.0 * t, 1)
    np.testing.assert_allclose(speed, 200.0, rtol=1e-9)
    t, values = recorded(lambda t: np.cos(20.0 * t), 2)
    np.testing.assert_allclose(values, -400.0 * np.cos(20.0 * t), atol=1e-5)


def test_a_run_too_short_for_its_filter_has_no_value():
    times = np.arange(1, 60) * STEP
    t, values = recorded(np.sin, 0, times)
    assert len(t) == len(values) == CLOCK.count(times) == 0
