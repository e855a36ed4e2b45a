"""Transients of trains: steady where nothing disturbs, the end of start-up, durations."""

import math
import tomllib

import numpy as np
import pytest
import xarray as xr
from stepped import jump, stepped
from train_contexts import bundled, mixed, one_stage, put_together

from flexgear.coupling.pace import ACCURACY
from flexgear.files.case_text import Rated
from flexgear.gears.sizing import StageRequest
from flexgear.model.errors import InputError
from flexgear.model.load import case_of_toml, load_case
from flexgear.model.names import BodyName
from flexgear.results.report.wording import window_words
from flexgear.results.settling import SHARE, settled, window_of
from flexgear.results.sinks import ranges_of
from flexgear.results.time_figures import energy_balance, largest_residual
from flexgear.solve.model import assemble
from flexgear.solve.start_vibration import steady_start
from flexgear.solve.static import static
from flexgear.solve.transient import simulate, usual_duration
from flexgear.studies.proposal import proposed_case


def with_(train, **solver):
    """The same train with other numbers of its solver."""
    return train.with_(**{f"solver.{k}": v for k, v in solver.items()})


@pytest.mark.parametrize("name", ["double-rotor-5mw", "nrel-5mw", "lin-parker"])
def test_perfect_trains_roll_in_equilibrium(name):
    """Rated speed, rated torques, forces of the power flow, from the first sample to the last."""
    train = bundled(name).case
    model = put_together(with_(train, settle=0.0, duration=200 * train.solver.time_step))
    data = simulate(model).data
    still = static(model, [0.0])
    np.testing.assert_allclose(
        data["gear_mesh_force"], still["gear_mesh_force"].values * np.ones((data.sizes["time"], 1)),
        rtol=1e-5,
    )  # fmt: skip
    rated = model.system.rated_input_speeds
    np.testing.assert_allclose(data["input_speed"].values / rated, 1.0, rtol=1e-7)
    for port in data.port.values:
        np.testing.assert_allclose(
            data["port_torque"].sel(port=port), model.flow.torque[port], rtol=1e-6
        )


def test_chosen_modes_of_a_train_that_bends_carry_the_loads_of_all(tmp_path):
    """The case says no accuracy: few modes are kept, and a torque drop loads teeth as with all."""
    train, bodies = mixed(tmp_path)
    train = train.with_(**{"solver.modes_band": 500.0})
    chosen = put_together(train, bodies=bodies).modal
    every = put_together(train.with_(**{"solver.modes_to": 1e9}), bodies=bodies).modal
    assert every.dropped == 0
    assert len(chosen.omega) < 0.2 * len(every.omega)
    assert chosen.choice.estimate <= ACCURACY
    rated = chosen.system.rated_torque
    drop = jump(rated, 0.3 * rated, 0.01)

    def loads(modal):
        return stepped(modal, drop, 0.03, 1e-4).pair_load

    full, few = loads(every), loads(chosen)
    assert full.max(axis=0).max() > 0
    assert np.abs(few.max(axis=0) - full.max(axis=0)).max() < ACCURACY * full.max()
    assert np.abs(few - full).max() < ACCURACY * full.max()


def test_all_modes_of_rigid_bodies_are_kept():
    assert bundled("nrel-5mw").modal.dropped == 0


@pytest.fixture(scope="module")
def herringbone():
    """Herringbone stage with its errors after start-up."""
    train = with_(bundled("herringbone").case, time_step=1e-4, duration=2.0)
    model = put_together(train)
    return model, simulate(model, energy=True)


def test_transient_load_sharing_is_taken_after_start_up(herringbone):
    _, run = herringbone
    rest = settled(run.data)
    assert float(rest["time"][0]) >= run.data.attrs["settle_s"] > 0
    k = run.data["load_sharing_coefficient"].sel(definition="instantaneous").values
    np.testing.assert_allclose(k, rest["load_sharing"].max("time"), rtol=1e-9)


def test_start_up_ends_where_forces_become_those_of_the_end(herringbone):
    """Harmonics of the run-outs of ring, planets and sun and of the gear mesh, fitted to the last
    second and continued to the start: before the end of start-up forces are others."""
    model, run = herringbone
    time, force = run.data["time"].to_numpy(), run.data["gear_mesh_force"].to_numpy()
    flow, speed = model.flow.stages[0], model.flow.speed
    carrier, sun = speed["stage.carrier"], speed["stage.sun"]
    gear_mesh = math.tau * flow.gear_mesh_frequency
    rates = [carrier, flow.planet_relative_speed, sun - carrier, gear_mesh]
    angles = np.multiply.outer(time, rates)
    columns = np.column_stack([np.ones(len(time)), np.cos(angles), np.sin(angles)])
    late = time > 1.0
    fitted = columns @ np.linalg.lstsq(columns[late], force[late], rcond=None)[0]
    share = np.abs(force - fitted).max(axis=1) / np.ptp(force[late], axis=0).max()
    start = run.data.attrs["settle_s"]
    assert run.data.attrs["settled"] == "yes"
    assert share[late].max() < 0.1 * SHARE  # errors cause no other harmonics
    assert share[time >= start].max() < SHARE < share[time < start].max()


def test_planets_are_displaced_in_their_own_axes(herringbone):
    """Torque pushes every pin back against the sense in which the carrier drives or is driven."""
    _, run = herringbone
    planets = [b for b in run.data.body.values if BodyName.parse(b).part == "planet"]
    assert len(planets) == 3
    tangential = run.data["planet_bearing_force"].sel(direction="tangential").mean("time")
    assert (tangential.values > 0).all()  # driven by the sun: pins are pushed ahead


def test_weight_in_time_is_that_of_equilibria(tmp_path):
    """Weight turns against the carrier, slowly beside the lowest mode."""
    model = one_stage(
        tmp_path, planets=4, sun="2e8", head="gravity_m_per_s2 = [0, -50, 0]\n",
        **{"solver.time_step_s": "1e-4", "solver.settle_s": "0.3", "solver.duration_s": "0.9",
           "damping.ratio": "0.05"},
    )  # fmt: skip
    rest = settled(simulate(model).data).isel(time=slice(None, None, 40))
    force = rest["gear_mesh_force"].to_numpy()
    still = static(model, rest["input_angle"].to_numpy()[:, 0])["gear_mesh_force"].to_numpy()
    assert np.abs(force - still).max() < 2e-3 * force.max()
    assert np.ptp(still, axis=0).max() > 0.01 * force.max()


def test_usual_duration_is_one_turn_of_the_slowest_stage_after_settling():
    model = bundled("pitch-drive")
    slowest = 2 * np.pi / abs(model.flow.speed["stage_3.carrier"])
    assert usual_duration(model.case, model.flow) == pytest.approx(model.pace.start_up + slowest)
    fine = put_together(with_(model.case, time_step=1e-6))
    assert usual_duration(fine.case, fine.flow) == pytest.approx(
        0.4
    )  # bounded by the number of steps


@pytest.mark.parametrize(
    ("ratio", "planets", "arrangement", "torque", "speed", "rigid", "time_step"),
    [
        # its first rotational mode decays over several turns of its ring
        (3.2, 4, "star", 500.0, 300.0, ["all"], 3e-5),
        # gear-mesh forces settle within a turn, displacements on its FE ring do not
        (6.3, 3, "planetary", 900.0, 400.0, ["carrier", "planet", "shaft"], 1e-5),
    ],
)
def test_a_run_starts_in_steady_motion_where_vibration_from_equilibrium_would_not_settle(
    ratio, planets, arrangement, torque, speed, rigid, time_step
):
    """The window is detected in the samples, which the choice of the start does not see."""
    helix = math.radians(15)
    request = StageRequest(ratio, planets, math.nan, math.nan, helix, arrangement=arrangement)
    text, _ = proposed_case([request], Rated(torque, speed * math.pi / 30))
    case = case_of_toml(tomllib.loads(text), "proposal.toml", "proposal")
    model = assemble(with_(case, time_step=time_step, fidelity="quick"), rigid)
    usual = usual_duration(model.case, model.flow)
    from_equilibrium = simulate(model, duration=usual)
    steady, half = simulate(model, energy=True), simulate(model, torque_share=0.5)
    assert from_equilibrium.data.attrs["settled"] == "no"
    assert steady.data.attrs["settled"] == half.data.attrs["settled"] == "yes"
    assert steady.simulated == half.simulated == usual
    assert "steady motion" in window_words(window_of(steady.data).figures)
    assert from_equilibrium.data.attrs["begins"] == "in equilibrium"
    assert steady.data.attrs["settle_s"] < 0.25 * usual
    assert largest_residual(ranges_of(steady.data, energy_balance)) < 1e-3


@pytest.mark.parametrize("name", ["herringbone", "pitch-drive", "nrel-5mw"])
def test_a_run_starts_from_equilibrium_where_vibration_from_it_settles(name):
    model = bundled(name)
    assert steady_start(model, usual_duration(model.case, model.flow)) is None


def test_an_output_that_drives_is_refused():
    """A generator named as input and a rotor as output."""
    train = load_case(
        "lin-parker", {"output.member": "stage.sun", "inputs.0.member": "stage.carrier",
                       "inputs.0.torque_nm": "-100"}
    )  # fmt: skip
    with pytest.raises(InputError, match=r"output\.member: stage\.sun gives .* W to the train"):
        simulate(put_together(train))


def test_settling_longer_than_the_run_is_refused():
    train = with_(bundled("lin-parker").case, settle=1.0, duration=0.5)
    with pytest.raises(InputError, match=r"leave nothing of a run of 0\.5 s"):
        simulate(put_together(train))


def test_settled_samples_begin_at_a_time_or_are_the_end_of_a_long_run():
    data = xr.Dataset({"time": np.arange(11) / 10}, attrs={"settle_s": 0.5})
    assert settled(data)["time"].to_numpy() == pytest.approx(0.1 * np.arange(5, 11))
    assert settled(data, 100).sizes["time"] == 6
    assert settled(data, 2)["time"].to_numpy() == pytest.approx([0.9, 1.0])
