"""Time steps by an error estimate, and equilibria after a step of iterative refinement."""

import numpy as np
import pytest
from coupled import TORQUE
from error_samples import random_sets
from stepped import energy_error, jump, stepped

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.kernels.refinement import PATIENCE, after_step, choose_level, control
from flexgear.analysis.kernels.static_position import CLOSURE
from flexgear.analysis.step_plan import Adaptive
from flexgear.coupling.modal import modal_system


def run(modal, low, step, adaptive=None, **options):
    """A torque drop to ``low`` for 0.1 s."""
    return stepped(
        modal, jump(TORQUE, low, 0.05, 0.15), 0.3, step, 1e-3, adaptive=adaptive, **options
    )


def apart(a, b):
    """Largest difference of pair loads at any time over the largest load."""
    assert np.allclose(a.time, b.time, rtol=0, atol=1e-12)
    return np.abs(a.pair_load - b.pair_load).max() / b.pair_load.max()


def test_same_answer_as_fine_fixed_steps_in_fewer_the_closer_the_tolerance(one_sided_modal):
    """A step may err by the tolerance; errors of a decay's length add up, hence ten times it."""
    fine = run(one_sided_modal, 0.1 * TORQUE, 5e-6)
    usual = run(one_sided_modal, 0.1 * TORQUE, 2e-5)  # what torque steps take with fixed steps
    tolerances = (1e-2, 1e-3, 1e-4)
    runs = [run(one_sided_modal, 0.1 * TORQUE, 1e-4, Adaptive(t, 2.5e-6, 4e-4)) for t in tolerances]
    errors = np.array([apart(f, fine) for f in runs])
    taken = np.array([f.steps.taken for f in runs])
    assert (np.diff(errors) < 0).all() and (np.diff(taken) > 0).all()
    assert (errors < 10 * np.array(tolerances)).all()
    assert (taken < 0.4 * usual.steps.taken).all()
    for f in runs:
        assert sum(f.steps.by_size.values()) == f.steps.taken
        assert sum(h * n for h, n in f.steps.by_size.items()) == pytest.approx(0.3)


def test_finer_after_a_torque_step_and_at_impacts_coarser_in_steady_running(one_sided_modal):
    """The drive reverses: teeth part and meet again on their coast flanks."""
    levels = Adaptive(1e-3, 2.5e-6, 4e-4)
    steady = run(one_sided_modal, TORQUE, 1e-4, levels)
    hammering = run(one_sided_modal, -0.5 * TORQUE, 1e-4, levels)
    short = [sum(n for h, n in r.steps.by_size.items() if h < 5e-5) for r in (steady, hammering)]
    assert short[1] > 5 * short[0]  # the start of every piece is finer in both
    mean = 0.3 / steady.steps.taken
    assert mean > 1.5e-4
    assert hammering.steps.refused > steady.steps.refused
    fixed = run(one_sided_modal, -0.5 * TORQUE, 5e-6)
    peaks = [r.pair_load.max() for r in (hammering, fixed)]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-3)
    assert hammering.steps.taken < 0.1 * fixed.steps.taken


def test_a_single_level_is_the_fixed_step(one_sided_modal):
    """Nothing is refused where nothing finer is allowed."""
    same = run(one_sided_modal, 0.1 * TORQUE, 1e-4, Adaptive(1e-9, 1e-4, 1e-4))
    fixed = run(one_sided_modal, 0.1 * TORQUE, 1e-4)
    assert np.array_equal(same.pair_load, fixed.pair_load)
    assert same.steps.refused == 0


def test_energy_closes_with_changing_steps(one_sided_modal):
    r = run(one_sided_modal, 0.1 * TORQUE, 1e-4, Adaptive(1e-4, 2.5e-6, 4e-4), track_energy=True)
    assert energy_error(r) < 1e-3


def test_sizes_halve_and_meet_samples():
    sizes, every = Adaptive(1e-3, 2.5e-6, 4e-4).sizes(0.0501, 1e-3)
    assert sizes == pytest.approx(sizes[-1] / 2.0 ** np.arange(len(sizes) - 1, -1, -1))
    assert sizes[-1] <= 4e-4 and 1.25e-6 <= sizes[0] <= 2.5e-6
    assert sizes[0] * every == pytest.approx(0.0501 / 50)


def test_a_step_never_passes_a_sample_or_the_end():
    rng = np.random.default_rng(2)
    for _ in range(200):
        every, total, at, seen = int(rng.integers(1, 40)), int(rng.integers(1, 200)), 0, []
        levels = control(5, 1e-3, every=every)
        levels.counts["level"] = rng.integers(5)
        while at < total:
            size = 1 << choose_level(levels, at, total - at)
            assert at % size == 0
            at += size
            seen.append(at)
        assert at == total
        assert set(range(every, total + 1, every)) <= set(seen)


def test_refused_and_calm_steps_change_the_level():
    levels = control(3, 1.0)
    for _ in range(PATIENCE):
        assert after_step(levels, 0, 1e-3)
    assert levels.counts[0]["level"] == 1
    assert not after_step(levels, 1, 1.5)
    assert levels.counts[0]["level"] == 0
    assert levels.counts[0]["refused"] == 1
    assert after_step(levels, 0, 1.5)  # nothing shorter is left
    assert not after_step(control(3, 1.0), 1, np.nan)


@pytest.mark.parametrize(("size", "share"), [(2e-5, 1.0), (3e-4, 0.5), (2e-5, -1.0)])
def test_equilibria_close_far_below_what_is_asked(one_sided, size, share):
    """Loaded, jammed between both flanks, reversed: they closed to 8e-9 without refinement."""
    modal = modal_system(one_sided, 3000.0)
    sets = random_sets(modal.system.pairs, 3, size)
    for j in range(3):
        system = modal.system.with_(pairs=sets.pairs(modal.system.pairs, j))
        equilibrium = revolution(
            modal_system(system, 3000.0), np.linspace(0.0, 2.0, 5), share * TORQUE
        )
        assert equilibrium.closure.max() < 0.1 * CLOSURE
        assert (equilibrium.pair_load >= 0.0).all()
