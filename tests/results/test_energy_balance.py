"""Energy residual of an oscillator whose account is known, and of gears."""

import numpy as np
import pytest
from stage_samples import cheap_stage
from train_contexts import put_together

from flexgear.model.errors import FlexgearError
from flexgear.model.load import load_case
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.results.sinks import ranges_of
from flexgear.results.time_figures import energy_balance, largest_residual
from flexgear.solve.transient import simulate


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


def residual(data):
    return largest_residual(ranges_of(data, energy_balance))


def test_closed_account_leaves_nothing():
    assert residual(account()) < 1e-12


def test_lost_energy_is_seen_relative_to_the_elastic_peak():
    lost = account(lost=0.4)
    np.testing.assert_allclose(residual(lost), 0.4 * 2 * np.pi / 8)
    left = energy_balance(lost)["left"]
    np.testing.assert_allclose(left[-1] - left[0], -0.4 * 2 * np.pi)


def test_missing_terms_are_named():
    with pytest.raises(FlexgearError, match="energy_parametric_work"):
        residual(account().drop_vars("energy_parametric_work"))


def test_energy_closes_where_spur_pairs_come_and_go_under_load():
    """Their forces, and with them the static part of the ring's motion, jump within a step."""
    keys = {
        "stage.helix_angle_deg": "0",
        "stage.planet_hand": "",
        "solver.time_step_s": "5e-5",
        "solver.modes_accuracy": "0.3",
        "drive.steps.torques_nm": "[]",
    }
    case = load_case("wind-5mw", keys)
    model = put_together(case, bodies=cheap_stage(case.view()))
    run = simulate(model, duration=0.1, energy=True).data
    assert (
        np.ptp(run["energy_parametric_work"].to_numpy()) > 1e-3 * run["energy_pair_elastic"].max()
    )
    assert residual(run) < 1e-6
