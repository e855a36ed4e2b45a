"""Energy residual of an oscillator whose account is known."""

import numpy as np
import pytest

from flexgear.model.errors import FlexgearError
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.results.time_figures import energy_residual


def account(lost: float = 0.0):
    t = np.linspace(0, 2 * np.pi, 101)
    zero = np.zeros_like(t)
    energies = {
        "energy_kinetic": 8 * np.sin(t) ** 2 - t + 3 * t,
        "energy_elastic": 6 * np.cos(t) ** 2,
        "energy_pair_elastic": 2 * np.cos(t) ** 2,
        "energy_input_work": 5 * t,
        "energy_brake_work": 2 * t,
        "energy_damping_work": 0.5 * t,
        "energy_pair_damping_work": 0.75 * t,
        "energy_parametric_work": zero + 0.25 * t + lost * t - 0.1 * t,
        "energy_load_work": 0.1 * t,
    }
    return labelled_dataset("time", t, energies, {}, {})


def test_closed_account_leaves_nothing():
    assert np.abs(energy_residual(account())).max() < 1e-12


def test_lost_energy_is_seen_relative_to_the_elastic_peak():
    np.testing.assert_allclose(energy_residual(account(lost=0.4))[-1], -0.4 * 2 * np.pi / 8)


def test_missing_terms_are_named():
    with pytest.raises(FlexgearError, match="energy_parametric_work"):
        energy_residual(account().drop_vars("energy_parametric_work"))
