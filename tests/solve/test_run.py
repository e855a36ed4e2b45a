"""The whole job: of trains, and of a flexible stage on cheap bodies with figures of theory."""

import threading

import numpy as np
import pytest
from coupled import make_bodies, make_case
from heavy_stage import SMALL, G
from stage_samples import cheap_stage, doubtful_stage
from train_contexts import put_together

from flexgear.coupling.build import build_system
from flexgear.coupling.system import variant_label
from flexgear.gears.bearings.basic_life import ROLLER, rating_life_hours
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import FlexgearError
from flexgear.model.load import load_case
from flexgear.results.stage_part import of_kind, pairs_of
from flexgear.results.summary import missing_keys
from flexgear.solve import run as solve
from flexgear.solve.bodies import rigid_bodies
from flexgear.solve.model import model_of
from flexgear.solve.run_summary import stages_summary
from flexgear.solve.run_transients import depth_name
from flexgear.solve.static import static
from flexgear.solve.transient import simulate

FAST = {
    "solver.time_step_s": "2e-4",
    "solver.step_time_step_s": "5e-5",
    "drive.steps.torques_nm": "[4e5]",
    "drive.steps.start_s": "0.1",
    "drive.steps.duration_s": "0.05",
}


@pytest.fixture(scope="module")
def case():
    return load_case("wind-5mw", FAST)


@pytest.fixture(scope="module")
def seen():
    return {}


@pytest.fixture(scope="module")
def run(case, seen):
    bodies = doubtful_stage(case.view())
    return solve.run(case, lambda stage, share: seen.update({stage: share}), bodies=bodies)


def on_cheap_bodies(case, **options):
    return put_together(case, bodies=cheap_stage(case.view()), **options)


def test_datasets_of_both_variants(run):
    assert set(run.datasets) == {
        "modes", "campbell", "equilibrium", "equilibrium_without_errors",
        "sharing_stage", "sharing_stage_rigid", "sharing_stage_without_errors",
        "transient", "transient_rigid", "transient_without_errors",
        "torque_step_0.4e6", "torque_step_0.4e6_rigid",
    }  # fmt: skip
    assert run.datasets["transient_rigid"].attrs["variant"] == "rigid"
    assert set(run.fields) == {"stage.ring", "stage.carrier"}
    assert missing_keys(run.summary) == []


def test_steady_figures_are_those_of_statics(run, case):
    steady, motion = run.summary["steady"]["stage"], power_flow(case).stages[0]
    assert steady["carrier_speed_rpm_mean"] == pytest.approx(11.27, rel=1e-3)
    force = run.summary["transient"]["gear_mesh_force"]["stage ring"]["mean_n"]
    assert force == pytest.approx(motion.ring_gear_mesh_force, rel=1e-3)
    ratio = run.summary["stages"]["stage"]["contact_ratio"]["ring"]
    expected = {int(ratio): 1 - ratio % 1, int(ratio) + 1: ratio % 1}
    shares = steady["ring_pairs_in_contact"]
    assert {int(n) for n in shares} == set(expected)
    for n, share in expected.items():
        assert shares[str(n)] == pytest.approx(share, abs=0.01)


def test_only_orders_that_the_planets_allow(run):
    orders = np.array(run.summary["steady"]["stage"]["radial_harmonics_um"])
    others = [n for n in range(21) if n % 5]
    assert orders[others].max() < 0.1 * orders[5]


def test_speed_dips_in_the_drop(run):
    step = run.summary["torque_steps"]["0.4e6"]
    for variant in ("flexible", "rigid"):
        assert 0 < step[variant]["stage"]["carrier_speed_rpm_min"] < 11.2
        assert step[variant]["stage"]["tooth_load_n_min"] >= 0  # one-sided contact never pulls


def test_energy_closes(run):
    assert 0 < run.summary["energy_residual"] < 0.01


def test_every_stage_says_when_it_is_done(run, seen):
    assert seen["transient, flexible"] == 1.0
    assert seen["torque drop to 0.4e6, rigid"] == 1.0
    assert set(run.summary["timing_s"]) >= {"coupled_systems", "equilibria", "transients"}


@pytest.mark.slow
def test_interrupt_stops_every_thread(case):
    def stop(stage, share):
        if stage.startswith("torque drop") and share > 0.2:
            raise KeyboardInterrupt

    before = set(threading.enumerate())  # other tests' Dask clients leave theirs behind
    with pytest.raises((KeyboardInterrupt, FlexgearError)):
        solve.run(case, stop, bodies=cheap_stage(case.view()))
    assert set(threading.enumerate()) <= before


def test_gear_mesh_force_is_working_less_back_flank(case):
    whole = static(on_cheap_bodies(case), [0.0, 0.1], -4e6)
    force = of_kind(whole, "ring")["gear_mesh_force"]
    assert (force < 0).all()
    assert (pairs_of(whole, "ring", "drive")["load"] == 0).all()
    np.testing.assert_allclose(force, -pairs_of(whole, "ring", "coast")["load"].sum("slot"))
    np.testing.assert_allclose(-whole["port_torque"].isel(port=-1), -9e5, rtol=1e-6)


def test_rigid_parts_and_the_case_choose_the_variant():
    case = load_case("wind-5mw")
    stiff = load_case("wind-5mw", {"stage.carrier.fe.flexible": "false"})
    assert variant_label(case.flexible_bodies, rigid_bodies(case, ("ring",))) == "carrier+shaft"
    rigid = rigid_bodies(stiff, ("ring", "shaft"))
    assert variant_label(stiff.flexible_bodies, rigid) == "rigid"


@pytest.mark.parametrize(("torque", "name"), [(2e6, "2e6"), (4e5, "0.4e6"), (1200.0, "1200")])
def test_depth_names(torque, name):
    assert depth_name(torque) == name


def test_a_run_shorter_than_the_output_interval_has_its_end(case):
    data = simulate(on_cheap_bodies(case), duration=6e-4, output_interval=1.0).data
    np.testing.assert_allclose(data["time"], [6e-4])


def short(name, **changes):
    return load_case(name, {"solver.settle_s": "0.02", "solver.duration_s": "0.06", **changes})


def test_run_of_a_train_with_errors():
    progress = []
    result = solve.run(short("herringbone"), lambda stage, share: progress.append(stage))
    assert missing_keys(result.summary) == []
    assert set(result.datasets) == {
        "modes", "campbell", "equilibrium", "sharing_stage", "sharing_stage_without_errors",
        "transient",
    }  # fmt: skip
    sharing = result.summary["load_sharing"]["quasi_static"]
    assert sharing["lumped"]["stage"]["complete"] is True
    assert sharing["lumped"]["stage"]["stage ring left"]["instantaneous"] > 1.04
    clean = sharing["lumped, without errors"]["stage"]["stage ring left"]
    assert clean["instantaneous"] == pytest.approx(1.0)
    assert result.summary["power_flow"]["members"]["stage.sun"]["speed_rpm"] == pytest.approx(100)
    assert result.summary["transient"]["displacement_um_max"]["stage.sun"] > 1
    assert result.with_timing(pictures=2.0).summary["timing_s"]["pictures"] == 2.0
    assert {"modes", "transient, lumped"} <= set(progress)
    for data in result.datasets.values():
        assert data.attrs["content_hash"] == result.summary["content_hash"]


def test_run_of_a_train_without_errors_and_with_two_inputs():
    result = solve.run(short("double-rotor-5mw", **{"solver.time_step_s": "5e-5"}))
    assert "transient_without_errors" not in result.datasets
    stages = result.summary["stages"]
    assert stages["stage_1"]["nominal_planet_bearing_life_h"] > 1e5
    assert "ring_gear_mesh_force_n" not in stages["stage_3"]


def test_planets_under_weight_have_equal_lives():
    """A turning carrier takes equal planets through the same loads, and a turn of 120 teeth has
    equilibria at many phases of the gear mesh."""
    settings = {
        "gravity_m_per_s2": "[0, -9.81, 0]",
        "stage.planet.mass_kg": "20",
        "stage.planet_bearing.dynamic_rating_kn": "50",
        "stage.planet_bearing.rolling": "roller",
        "stage.normal_module_mm": str(2 * 88.4 / 72),
    }
    teeth = {f"stage.{gear}.teeth": z for gear, z in (("sun", 24), ("planet", 48), ("ring", 120))}
    case = load_case("lin-parker", settings | {key: str(z) for key, z in teeth.items()})
    result = solve.run(case.with_(solver={"duration": 2e-3, "settle": 1e-3}))
    lives = result.summary["stages"]["stage"]["bearing_life_h"]
    assert result.summary["equilibrium_window"] == "one turn of the carrier against the ring"
    assert len(lives) == 4
    assert np.ptp(list(lives.values())) < 1e-9 * lives["planet_bearing_1"]
    angles = result.datasets["equilibrium"]["stage_angle"].to_numpy().ravel()
    assert len(np.unique(np.round(120 * angles / (2 * np.pi) % 1, 6) % 1)) >= 24


def test_bearings_of_a_train_under_weight_state_the_stage_whose_turn_they_are_over():
    case = load_case("nrel-5mw", {"gravity_m_per_s2": "[0, -9.81, 0]"})
    summary = solve.run(case.with_(solver={"duration": 2e-3, "settle": 1e-3})).summary
    window = "one turn of the carrier against the ring of stage_1"
    assert summary["equilibrium_window"] == window
    life = next(row for row in summary["headlines"] if row["name"] == "bearing_life")
    assert f"over {window}" in life["sentence"]


def test_lives_of_the_bearings_on_the_seats_of_a_heavy_carrier():
    """Under weight and a force of the rotor; only the seat with a rating has a life."""
    rating = {"dynamic_rating_kn": "3000", "rolling": "roller"}
    settings = {f"stage.carrier.bearing_far.{key}": value for key, value in rating.items()}
    load = {"member": "stage.carrier", "force": (0.0, -2e5, 5e4)}
    case = make_case(**SMALL, **settings).with_(gravity=(0.0, -G, 0.0), loads=(load,)).case
    model = model_of(case, build_system(case, make_bodies(case.view())))
    data = static(model, np.linspace(0.0, 2 * np.pi, 5, endpoint=False))
    stage = stages_summary(model, data)["stage"]
    seat = data["bearing_force"].sel(support="stage.carrier_far")
    radial = np.hypot(seat.sel(dof="ux"), seat.sel(dof="uy")).to_numpy()
    assert stage["carrier_bearing_force_n"].keys() == {"drive", "far"}
    assert stage["carrier_bearing_force_n"]["far"] == pytest.approx(radial.max(), rel=1e-12)
    axial = abs(data["bearing_force"].sel(dof="uz"))
    for label, largest in stage["axial_bearing_force_n"].items():
        support = f"stage.{label.replace('_bearing', '')}"
        assert largest == pytest.approx(float(axial.sel(support=support).max()), rel=1e-12)
    assert stage["axial_bearing_force_n"]["carrier_bearing_far"] > 1e3
    assert radial.min() > 1e3
    mean = np.mean(radial**ROLLER) ** (1 / ROLLER)
    expected = rating_life_hours(3e6, mean, case.inputs[0].speed)
    assert stage["bearing_life_h"] == {"carrier_bearing_far": pytest.approx(expected, rel=1e-9)}
