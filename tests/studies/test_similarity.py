"""No number of one machine: a case λ times as large has λ times the results, of every unit."""

from pathlib import Path

import numpy as np
import pytest
from similarity import POWERS, differences, figures_apart, similar
from train_contexts import bundled, put_together

from flexgear.cli.case_commands import derived
from flexgear.cli.train_check import derived_of_train
from flexgear.coupling.pace import stage_pace
from flexgear.gears.kinematics import stage_kinematics
from flexgear.model.load import load_case
from flexgear.model.units import DIMENSIONS
from flexgear.studies.single_runs import equilibria, simulate, torque_step
from flexgear.studies.stage_bodies import stage_bodies, stage_modal, variant_of
from flexgear.studies.stage_run import kinematics, run_stage
from flexgear.studies.train_harmonic import harmonic_data, train_harmonic
from flexgear.studies.train_linear import why_not_linear
from flexgear.studies.train_modes import train_campbell, train_modes
from flexgear.studies.train_sharing import train_sharing
from flexgear.studies.train_static import position_figures, train_equilibria
from flexgear.studies.train_transient import simulate_train

SMALL = Path(__file__).parents[1] / "small_spur_stage.toml"
FACTOR = 1 / 16  # a power of two: rounding is no excuse
ALIKE = 1e-6


def test_every_dimension_has_its_power():
    assert set(POWERS) | {"6 x 6 matrix"} == set(DIMENSIONS)


@pytest.fixture(scope="module")
def stages():
    """The small stage, as it is and sixteen times as large: case, bodies, coupled system."""
    cheap = {
        "solver.fidelity": "quick",
        "ring.fixed_interface_modes": "8",
        "carrier.fixed_interface_modes": "8",
        "drive.steps.torques_nm": "[150]",
        "brake.exponent": "2",
        "errors.pin_tangential_um": "[5, 0, 0, 0]",  # else what moves the sun is rounding alone
    }
    small = load_case(SMALL, cheap)
    found = []
    for case in (similar(small, 1 / FACTOR), small):
        bodies = stage_bodies(case)
        found.append((case, bodies, stage_modal(case, bodies, variant_of(case))))
    return found


def apart(pair):
    """Differences of two results, those that are too large; closure is nothing but rounding."""
    found = differences(*pair, FACTOR)
    return {k: v for k, v in found.items() if v > ALIKE and k != "closure"}


def test_what_is_said_of_a_stage_scales(stages):
    large, small = ({**derived(case), "run": kinematics(case)} for case, _, _ in stages)
    found = figures_apart(large, small, FACTOR)
    assert len(found) > 60
    assert {k: v for k, v in found.items() if v > ALIKE} == {}


@pytest.mark.parametrize("name", ["ring", "carrier"])
def test_fe_meshes_and_reduced_bodies_scale(stages, name):
    large, small = (getattr(bodies, name) for _, bodies, _ in stages)
    np.testing.assert_allclose(FACTOR * large.points, small.points, rtol=0, atol=1e-9 * FACTOR)
    assert np.array_equal(large.cells, small.cells)
    for figure in ("frequency_error", "static_error", "frequencies_below_limit"):
        assert small.report[figure] == pytest.approx(large.report[figure], rel=1e-6, abs=1e-8)
    ours, theirs = (np.array(b.report["compared_frequencies_hz"]) for b in (small, large))
    np.testing.assert_allclose(ours, theirs / FACTOR, rtol=ALIKE)


def test_modes_equilibria_and_transients_of_a_stage_scale(stages):
    modals = [modal for _, _, modal in stages]
    assert modals[0].figures["kept_modes"] == modals[1].figures["kept_modes"]
    np.testing.assert_allclose(modals[0].omega / FACTOR, modals[1].omega, rtol=ALIKE, atol=1e-3)
    still = [equilibria(case, modal, [0.0, 0.3])[1] for case, _, modal in stages]
    assert apart(still) == {}
    few = [3 / stage_pace(case).gear_mesh for case, _, _ in stages]
    runs = [
        simulate(case, modal, duration=span, energy=True).data
        for (case, _, modal), span in zip(stages, few, strict=True)
    ]
    assert runs[0].sizes["time"] > 200
    assert apart(runs) == {}


def test_a_torque_drop_scales(stages):
    runs = [torque_step(case, modal, case.drive.steps.torques[0]).data for case, _, modal in stages]
    assert float(runs[1]["ring_pair_load"].max()) > 0
    assert apart(runs) == {}


@pytest.mark.parametrize(
    ("name", "up"),
    [
        ("pitch-drive", 16),
        ("lin-parker", 16),
        ("herringbone", 1),
        ("nrel-5mw", 1),
        ("double-rotor-5mw", 1),
    ],
)
def test_every_analysis_of_a_train_scales(name, up):
    whole = bundled(name).train
    data = whole.model_dump(exclude_unset=True)
    data["solver"] = {"positions_per_gear_mesh": 4}  # else nothing is said of steps and times
    for unasked in ("gravity", "tolerance"):
        data.pop(unasked, None)
    large = similar(type(whole).model_validate(data), up)
    trains = (large, similar(large, FACTOR))
    found = figures_apart(*(derived_of_train(t) for t in trains), FACTOR)
    assert {k: v for k, v in found.items() if v > ALIKE} == {}
    contexts = [put_together(train) for train in trains]
    for analysis in (train_modes, train_campbell, lambda c: train_equilibria(c, [0.0, 1.0])):
        assert apart([analysis(c) for c in contexts]) == {}
    figures = [position_figures(c, train_equilibria(c, [0.0]).isel(position=0)) for c in contexts]
    assert {k: v for k, v in figures_apart(*figures, FACTOR).items() if v > ALIKE} == {}
    stage = large.stages[0].name
    assert apart([train_sharing(c, stage, cycles=1) for c in contexts]) == {}
    runs = [simulate_train(c, duration=2 / c.pace.gear_mesh).data for c in contexts]
    assert runs[0].sizes["time"] > 100
    assert apart(runs) == {}
    if why_not_linear(contexts[0].system) is None:
        assert apart([harmonic_data(c, train_harmonic(c)) for c in contexts]) == {}


def test_a_small_stage_runs_with_the_defaults(stages):
    """No supported mode of its ring lies below the 2 000 Hz that once were everybody's limit."""
    case, bodies, _ = stages[1]
    assert bodies.ring.report["supported_frequency_min_hz"] > 2000
    rated = case.with_(**{"drive.steps.torques": ()})
    run = run_stage(rated, bodies)
    assert run.summary["solver"]["modes_band_hz"] == pytest.approx(18_000)
    forces = run.summary["steady"]["ring_mesh_force_n_mean"]
    assert forces == pytest.approx(stage_kinematics(case).ring_mesh_force, rel=0.01)


def test_the_largest_tooth_load_is_that_of_a_fine_run(stages):
    """At times one pair of teeth carries all the load of a planet; samples must not miss it."""
    case, _, modal = stages[1]
    span = 4 / stage_pace(case).gear_mesh
    step = 1 / (40 * 8 * 18_000)
    fine = case.with_(**{"solver.time_step": step, "solver.output_interval": step})
    usual, exact = (
        float(simulate(c, modal, duration=span).data["ring_pair_load"].max()) for c in (case, fine)
    )
    assert usual > stage_kinematics(case).ring_mesh_force
    assert usual == pytest.approx(exact, rel=0.02)
