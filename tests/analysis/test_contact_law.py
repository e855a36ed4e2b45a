"""One law of tooth pairs: damping in contact only, loads that converge; no run goes astray."""

from dataclasses import replace

import numpy as np
import pytest
from stepped import stepped
from two_gears import TORQUE, evenly_stiff, exact_after, reversal, two_gears

from flexgear.analysis.start import start_state
from flexgear.analysis.transient import Drive
from flexgear.model.errors import FlexgearError

STEADY = Drive(lambda t: np.full(len(t), TORQUE))
SPAN = 4e-3  # s: teeth part, cross the backlash and hammer on the other flank
EVERY = 2e-5


@pytest.mark.slow
@pytest.mark.parametrize("model", ["constant", "per_pair"])
def test_loads_converge_to_an_integration_that_stops_at_every_event(tmp_path, model):
    """Torque reverses: teeth part, cross the backlash, meet behind, bounce. Second order."""
    modal = evenly_stiff(two_gears(tmp_path, model=model, speed=0.01))
    times = np.arange(1, round(SPAN / EVERY) + 1) * EVERY
    exact, events = exact_after(modal, -0.6 * TORQUE, np.concatenate([[0.0], times]))
    assert events > 6
    total = np.abs(exact[1:]).sum(axis=1)
    errors = []
    for parts in (8, 16, 32):
        run = stepped(
            modal, Drive(lambda t: np.full(len(t), -0.6 * TORQUE)), SPAN, EVERY / parts,
            interval=EVERY, start=start_state(modal, TORQUE),
        )  # fmt: skip
        assert run.time == pytest.approx(times)
        errors.append(np.abs(run.pair_load.sum(axis=(1, 2)) - total).max() / total.max())
    assert errors[-1] < 1e-3
    assert np.log2(errors[0] / errors[-1]) / 2 > 1.6, errors


@pytest.mark.parametrize("model", ["constant", "per_pair"])
def test_no_load_across_an_open_gap_and_damping_takes_energy_only(tmp_path, model):
    modal = two_gears(tmp_path, model=model, speed=10)
    run = stepped(modal, reversal(-0.6 * TORQUE, 5e-4), 4e-3, 2e-6, track_energy=True)
    e = run.energy
    load = run.pair_load.sum(axis=(1, 2))
    assert (load == 0).any() and (run.pair_load >= 0).all()
    # what carries is compressed
    assert (e["pair_elastic"][load > 0] > 0).all()
    # the law's bound F ≤ 2 k δ: F² / 4 ≤ Σ k · Σ ½ k δ² · 2 over the loaded rows
    stiffness = np.where(run.pair_load > 0, run.pair_stiffness, 0.0).sum(axis=(1, 2))
    assert (load**2 <= 8.0 * stiffness * e["pair_elastic"] * (1 + 1e-6)).all()
    taken = np.diff(e["pair_damping_work"])
    assert taken.min() > -1e-6 * e["pair_damping_work"].max()
    held = e["kinetic"] + e["elastic"] + e["pair_elastic"]
    work = e["input_work"] - e["brake_work"] - e["damping_work"] - e["pair_damping_work"]
    left = held - work - e["parametric_work"]
    assert np.abs(left - left[0]).max() < 1e-3 * (e["elastic"] + e["pair_elastic"]).max()


def test_undamped_gears_do_not_gain_energy_from_back_flanks_found_late(tmp_path):
    """0.05 ms at a gear-mesh period of 0.67 ms: grew to 1e17 N and more."""
    modal = two_gears(tmp_path, model="per_pair", damping=0.0, speed=1500, backlash=0)
    run = stepped(modal, STEADY, 0.02, 5e-5)
    assert run.pair_load.sum(axis=(1, 2)).max() < 10 * run.pair_load[0].sum()


def test_growth_is_noticed_by_the_integration_itself(tmp_path):
    """Teeth that feed vibration instead of damping it, whatever they stand for."""
    modal = two_gears(tmp_path, law="linear", speed=60)
    pairs = modal.system.pairs
    feeding = modal.system.with_(pairs=pairs._replace(damping=-pairs.damping))
    unstable = replace(modal, system=feeding)
    start = start_state(unstable, TORQUE)
    start.velocity[-1] += 1e-3
    with pytest.raises(FlexgearError, match=r"ran away at t = 0\.\d+ s .*: lower the time step"):
        stepped(unstable, STEADY, 0.5, 2e-5, interval=0.1, start=start)


@pytest.mark.parametrize("model", ["per_pair", "lumped"])
def test_undamped_impacts_that_gain_energy_are_refused_and_those_that_do_not_are_not(
    tmp_path, model
):
    """0.05 ms give 10 000 kN of impacts after 0.5 s, ten times less twice the load."""
    modal = two_gears(tmp_path, model=model, damping=0.0, speed=1500)
    with pytest.raises(FlexgearError, match=r"ran away at t = 0\.0.*gains energy"):
        stepped(modal, STEADY, 0.5, 5e-5)
    with pytest.raises(FlexgearError, match=r"ran away at t = 0\..*gains energy"):
        stepped(modal, STEADY, 0.5, 2.5e-5, interval=5e-5)
    run = stepped(modal, STEADY, 0.5, 5e-6, interval=5e-5)
    assert run.pair_load.sum(axis=(1, 2)).max() < 2.5 * run.pair_load[0].sum()
    assert not any(account.any() for account in run.energy.values())  # nobody asked for it


def test_motion_that_is_not_finite_is_refused(tmp_path):
    modal = two_gears(tmp_path)
    lost = Drive(lambda t: np.where(t > 5e-3, np.nan, TORQUE))
    with pytest.raises(FlexgearError, match=r"ran away at t = 0\.0050\d+ s"):
        stepped(modal, lost, 0.01, 1e-5, interval=1e-3)
    start = start_state(modal, TORQUE)
    start.velocity[0] = np.inf
    with pytest.raises(FlexgearError, match="start from is not finite"):
        stepped(modal, STEADY, 0.01, 1e-5, start=start)


def test_steps_longer_than_a_quarter_of_the_gear_mesh_period_are_refused(tmp_path):
    modal = two_gears(tmp_path, speed=500)  # 500 Hz
    with pytest.raises(FlexgearError, match=r"0\.1 s is too long .* 0\.002 s: take 0\.0005 s"):
        stepped(modal, STEADY, 1.0, 0.1)
    assert stepped(modal, STEADY, 1e-3, 5e-4).steps.taken == 2
