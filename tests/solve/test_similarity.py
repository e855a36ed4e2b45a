"""No number of one machine: a case λ times as large has λ times the results, of every unit."""

from dataclasses import replace

import numpy as np
import pytest
from similarity import POWERS, differences, figures_apart, of_one_frequency, similar
from small_train import SMALL_STAGE
from train_contexts import bundled, put_together
from trains import STEEL, stage_train, write

from flexgear.cli.case_commands import derived
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.model.names import BodyName
from flexgear.model.units import SUFFIXES
from flexgear.results.stage_part import pairs_of
from flexgear.solve.bodies import reduced_bodies
from flexgear.solve.campbell import campbell
from flexgear.solve.modes import modes
from flexgear.solve.run import run
from flexgear.solve.run_summary import stages_summary
from flexgear.solve.static import position_figures, stages_sharing, static
from flexgear.solve.transient import simulate, torque_drop
from flexgear.studies.measures import measures_of
from flexgear.studies.sweep import failures, planned, run_sweep
from flexgear.studies.sweep_keys import parse_values
from flexgear.studies.tolerance import tolerance

FACTOR = 1 / 16  # a power of two: rounding is no excuse
ALIKE = 1e-6
CHEAP = {
    "solver.fidelity": "quick",
    "stage.ring.fe.fixed_interface_modes": "8",
    "stage.carrier.fe.fixed_interface_modes": "8",
    "drive.steps.torques_nm": "[150]",
    "output.brake_exponent": "2",
    "stage.errors.pin_tangential_um": "[5, 0, 0, 0]",  # else what moves the sun is rounding alone
}


def test_every_dimension_has_its_power():
    assert set(POWERS) | {"6 x 6 matrix"} == set(SUFFIXES)


@pytest.fixture(scope="module")
def stages():
    """The small stage sixteen times as large, and as it is."""
    small = load_case(SMALL_STAGE, CHEAP)
    return [
        put_together(case, bodies=reduced_bodies(case))
        for case in (similar(small, 1 / FACTOR), small)
    ]


def apart(pair):
    """Differences of two results, those that are too large; closure is nothing but rounding."""
    by_name = differences(*pair, FACTOR)
    return {k: v for k, v in by_name.items() if v > ALIKE and k != "closure"}


def unsaid(train, **more):
    """The train with nothing said of steps and times."""
    data = train.model_dump(exclude_unset=True)
    data["solver"] = {"positions_per_gear_mesh": 4}
    for unasked in ("gravity", "tolerance"):
        data.pop(unasked, None)
    return type(train).model_validate(data | more)


def every_analysis(contexts, modes=modes):
    """What of the analyses of two similar trains is too far apart."""
    for analysis in (modes, campbell, lambda c: static(c, [0.0, 1.0])):
        assert apart([analysis(c) for c in contexts]) == {}
    figures = [position_figures(c, static(c, [0.0]).isel(position=0)) for c in contexts]
    assert {k: v for k, v in figures_apart(*figures, FACTOR).items() if v > ALIKE} == {}
    stage = contexts[0].case.stages[0].name
    assert apart([stages_sharing(c, stage, cycles=1) for c in contexts]) == {}
    runs = [simulate(c, duration=2 / c.pace.gear_mesh).data for c in contexts]
    assert runs[0].sizes["time"] > 100
    assert apart(runs) == {}


def test_figures_of_a_stage_scale(stages):
    large, small = ({**derived(m.case), "run": stages_summary(m, static(m, [0.0]))} for m in stages)
    by_name = figures_apart(large, small, FACTOR)
    assert len(by_name) > 60
    assert {k: v for k, v in by_name.items() if v > ALIKE} == {}


@pytest.mark.parametrize("name", ["ring", "carrier"])
def test_fe_meshes_and_reduced_bodies_scale(stages, name):
    large, small = (model.bodies[f"stage.{name}"] for model in stages)
    np.testing.assert_allclose(FACTOR * large.points, small.points, rtol=0, atol=1e-9 * FACTOR)
    assert np.array_equal(large.cells, small.cells)
    for figure in ("frequency_error", "static_error", "frequencies_below_limit"):
        assert small.report[figure] == pytest.approx(large.report[figure], rel=1e-6, abs=1e-8)
    ours, theirs = (np.array(b.report["compared_frequencies_hz"]) for b in (small, large))
    np.testing.assert_allclose(ours, theirs / FACTOR, rtol=ALIKE)


def test_modes_equilibria_and_transients_of_a_stage_scale(stages):
    modals = [model.modal for model in stages]
    assert modals[0].figures["kept_modes"] == modals[1].figures["kept_modes"]
    np.testing.assert_allclose(modals[0].omega / FACTOR, modals[1].omega, rtol=ALIKE, atol=1e-3)
    still = [static(model, [0.0, 0.3]) for model in stages]
    assert apart(still) == {}
    runs = [simulate(m, duration=3 / m.pace.gear_mesh, energy=True).data for m in stages]
    assert runs[0].sizes["time"] > 200
    assert apart(runs) == {}


def test_a_torque_drop_scales(stages):
    runs = [torque_drop(model, model.case.drive.steps.torques[0]).data for model in stages]
    assert float(runs[1]["pair_load"].max()) > 0
    assert apart(runs) == {}


@pytest.mark.parametrize(
    ("name", "up"),
    [
        ("pitch-drive", 16),
        ("herringbone", 1),
        ("nrel-5mw", 1),
    ],
)
def test_every_analysis_of_a_train_scales(name, up):
    large = similar(unsaid(bundled(name).case), up)
    trains = (large, similar(large, FACTOR))
    by_name = figures_apart(*(derived(t) for t in trains), FACTOR)
    assert {k: v for k, v in by_name.items() if v > ALIKE} == {}
    every_analysis([put_together(train) for train in trains])


GEARED_DOWN = """
[[stages]]
name = "first"
case = "{case}"
[[stages]]
name = "second"
kind = "parallel"
normal_module_mm = 1.5
pressure_angle_deg = 20
face_width_mm = 20
pinion = {{ teeth = 24, support = {{ {held} }} }}
gear = {{ teeth = 36, support = {{ {held} }} }}
[[joints]]
first = "first.sun"
second = "second.gear"
torsion_nm_per_rad = 1e5
axial_n_per_m = 1e7
tilt_nm_per_rad = 1e4
[[inputs]]
member = "first.carrier"
speed_rpm = 1500
torque_nm = 300
inertia_kg_m2 = 0.02
[output]
member = "second.pinion"
inertia_kg_m2 = 0.002
"""


@pytest.mark.slow
def test_a_train_with_a_flexible_stage_scales(stages, tmp_path):
    head = 'kinematics = "spatial"\n'
    held = "radial_n_per_m = 2e8, axial_n_per_m = 1e8, tilt_nm_per_rad = 1e4"
    path = write(tmp_path, STEEL + GEARED_DOWN.format(case=SMALL_STAGE, held=held), head)
    small = load_case(path, {k.replace("stage.", "stages.0."): v for k, v in CHEAP.items()})
    trains = (similar(small, 1 / FACTOR), small)
    taken = {"name": "stage", "case": None, "material": None}  # what a stage of a train says itself
    for train, model in zip(trains, stages, strict=True):
        assert train.stages[0].model_copy(update=taken) == model.case.stages[0]
    contexts = [
        put_together(
            train, bodies={BodyName.of("first", n.part): body for n, body in model.bodies.items()}
        )
        for train, model in zip(trains, stages, strict=True)
    ]
    every_analysis(contexts, lambda c: of_one_frequency(modes(c)))


@pytest.mark.slow
def test_sweeps_of_a_stage_scale(stages):
    key = "stage.ring.fe.flexible"
    values = parse_values(key, "true,false")
    plan = planned(
        SMALL_STAGE,
        {key: values},
        settings=CHEAP,
        measures=list(measures_of(load_case(SMALL_STAGE))),
    )
    assert_sweeps_scale(plan)


def assert_sweeps_scale(plan):
    """Every measure at every point of a sweep over a key without unit."""
    up = 1 / FACTOR
    large = replace(
        plan, base=similar(plan.base, up), cases=tuple(similar(c, up) for c in plan.cases)
    )
    sweeps = [run_sweep(p, workers=1) for p in (large, plan)]
    assert [failures(data) for data in sweeps] == [[], []]
    assert apart(sweeps) == {}


def test_tolerance_studies_scale(stages, tmp_path):
    drawn = {
        "tolerance.samples": "20",
        "tolerance.errors.pin_tangential.standard_deviation_um": "10",
    }
    train = stage_train(tmp_path, sun="2e8", **drawn)
    for small in (
        unsaid(train, tolerance=train.tolerance.model_dump(exclude_unset=True)),
        load_case(SMALL_STAGE, CHEAP | drawn),
    ):
        assert apart([tolerance(c, workers=1) for c in (similar(small, 1 / FACTOR), small)]) == {}


@pytest.mark.slow
def test_a_small_stage_runs_with_the_defaults(stages):
    """No supported mode of its ring lies below the 2 000 Hz that once were everybody's limit."""
    model = stages[1]
    assert model.bodies["stage.ring"].report["supported_frequency_min_hz"] > 2000
    rated = model.case.with_(**{"drive.steps.torques": ()})
    summary = run(rated, bodies=model.bodies).summary
    assert summary["solver"]["modes_band_hz"] == pytest.approx(18_000)
    force = summary["transient"]["gear_mesh_force"]["stage ring"]["mean_n"]
    assert force == pytest.approx(power_flow(rated).stages[0].ring_gear_mesh_force, rel=0.01)


def test_the_largest_tooth_load_is_that_of_a_fine_run(stages):
    """At times one pair of teeth carries all the load of a planet; samples must not miss it."""
    model = stages[1]
    span = 4 / model.pace.gear_mesh
    step = 1 / (40 * 8 * 18_000)
    case = model.case.with_(**{"solver.time_step": step, "solver.output_interval": step})
    fine = put_together(case, bodies=model.bodies)
    usual, exact = (
        float(pairs_of(simulate(m, duration=span).data, "ring", "drive")["load"].max())
        for m in (model, fine)
    )
    assert usual > power_flow(case).stages[0].ring_gear_mesh_force
    assert usual == pytest.approx(exact, rel=0.02)
