"""The whole job on cheap bodies: figures that theory gives, whatever the bodies."""

import threading

import numpy as np
import pytest
from stage_samples import cheap_stage, missing_the_promise

from flexgear.gears.kinematics import rated_flow
from flexgear.model.errors import FlexgearError
from flexgear.model.load import load_case
from flexgear.results.contact_share import expected_contact_share
from flexgear.studies.single_runs import equilibria, simulate
from flexgear.studies.stage_bodies import StageBodies, stage_modal, variant_of
from flexgear.studies.stage_run import depth_name, run_stage

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
    bodies = cheap_stage(case)
    bodies = StageBodies(missing_the_promise(bodies.ring), bodies.carrier)
    return run_stage(case, bodies, lambda stage, share: seen.update({stage: share}))


def test_datasets_of_both_variants(run):
    assert set(run.datasets) == {
        "equilibrium_flexible",
        "equilibrium_flexible_without_errors",
        "steady_flexible",
        "steady_rigid",
        "torque_step_0.4e6_flexible",
        "torque_step_0.4e6_rigid",
    }
    assert run.datasets["steady_rigid"].attrs["variant"] == "rigid"
    assert set(run.fields) == {"ring", "carrier"}


def test_steady_figures_are_those_of_statics(run, case):
    steady, motion = run.summary["steady"], rated_flow(case)
    assert steady["carrier_speed_rpm_mean"] == pytest.approx(11.27, rel=1e-3)
    assert steady["ring_mesh_force_n_mean"] == pytest.approx(motion.ring_gear_mesh_force, rel=1e-3)
    expected = expected_contact_share(run.summary["kinematics"]["contact_ratio_ring"])
    shares = steady["ring_pairs_in_contact"]
    assert {int(n) for n in shares} == set(expected)
    for n, share in expected.items():
        assert shares[str(n)] == pytest.approx(share, abs=0.01)


def test_only_orders_that_the_planets_allow(run):
    orders = np.array(run.summary["steady"]["radial_harmonics_um"])
    others = [n for n in range(21) if n % 5]
    assert orders[others].max() < 0.1 * orders[5]


def test_speed_dips_in_the_drop(run):
    step = run.summary["torque_steps"]["0.4e6"]
    for variant in ("flexible", "rigid"):
        assert 0 < step[variant]["carrier_speed_rpm_min"] < 11.2
        assert step[variant]["tooth_load_n_min"] >= 0  # one-sided contact never pulls


def test_a_reduction_that_misses_its_promise_stands_in_the_summary(run):
    (said,) = run.summary["warnings"]
    assert said.startswith("ring: static error 3.4 % (load: tip end -z), above 2 %; set ")


def test_energy_closes(run):
    assert 0 < run.summary["energy_residual"] < 0.01


def test_every_stage_says_when_it_is_done(run, seen):
    assert seen["steady flexible"] == 1.0
    assert seen["torque step 0.4e6 rigid"] == 1.0
    assert set(run.summary["timing_s"]) >= {"coupled_systems", "equilibria", "transients"}


def test_interrupt_stops_every_thread(case):
    def stop(stage, share):
        if stage.startswith("torque step") and share > 0.2:
            raise KeyboardInterrupt

    before = set(threading.enumerate())  # other tests' Dask clients leave theirs behind
    with pytest.raises((KeyboardInterrupt, FlexgearError)):
        run_stage(case, cheap_stage(case), stop)
    assert set(threading.enumerate()) <= before


def test_gear_mesh_force_is_working_less_back_flank(case):
    bodies = cheap_stage(case)
    modal = stage_modal(case, bodies, variant_of(case))
    _, data = equilibria(case, modal, [0.0, 0.1], -4e6)
    force = data["ring_gear_mesh_force"]
    assert (force < 0).all()
    assert (data["ring_pair_load"] == 0).all()
    np.testing.assert_allclose(force, -data["ring_back_pair_load"].sum("slot"))
    np.testing.assert_allclose(data["output_torque"], -9e5, rtol=1e-6)


def test_rigid_parts_and_the_case_choose_the_variant():
    assert variant_of(load_case("wind-5mw"), ("ring",)).label == "carrier+shaft"
    stiff = load_case("wind-5mw", {"carrier.flexible": "false"})
    assert variant_of(stiff, ("ring", "shaft")).label == "rigid"


def test_ramp_ends_where_the_brake_law_says(case):
    """Half the torque, brake T ~ speed: half the speed."""
    ramp = load_case(
        "wind-5mw",
        {
            **FAST,
            "solver.step_time_step_s": "2e-4",
            "inertia.drive_kg_m2": "2e5",  # settles twelve times over before the last half second
            "drive.kind": "ramp",
            "drive.times_s": "[0.1, 0.5]",
            "drive.torques_nm": "[4e6, 2e6]",
        },
    )
    modal = stage_modal(ramp, cheap_stage(ramp), variant_of(ramp))
    run = simulate(ramp, modal, duration=4.0)
    late = run.data.sel(time=slice(3.5, None))
    assert float(late["carrier_speed"].mean()) == pytest.approx(
        case.drive.rated_speed / 2, rel=1e-3
    )
    assert run.core > 0


@pytest.mark.parametrize(("torque", "name"), [(2e6, "2e6"), (4e5, "0.4e6"), (1200.0, "1200")])
def test_depth_names(torque, name):
    assert depth_name(torque) == name


def test_a_run_shorter_than_the_output_interval_has_its_end(case):
    modal = stage_modal(case, cheap_stage(case), variant_of(case))
    data = simulate(case, modal, duration=6e-4, output_interval=1.0).data
    np.testing.assert_allclose(data["time"], [6e-4])
