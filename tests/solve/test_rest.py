"""No torque and no speed are states of every train, and no number is missing without a word."""

import numpy as np
import pytest
from coupled import CLEAN, make_case
from stage_samples import cheap_stage
from train_contexts import BUNDLED, bundled, put_together
from trains import stage_train

from flexgear.model.load import load_case
from flexgear.results.quantities import MISSING
from flexgear.results.settling import settled
from flexgear.results.time_figures import drop_summary
from flexgear.solve.campbell import campbell
from flexgear.solve.modes import modes
from flexgear.solve.run import run
from flexgear.solve.static import position_figures, static
from flexgear.solve.transient import simulate
from flexgear.studies.compare import compare_sharing


def unexplained(data):
    """Variables that hold something that is no number, and do not say when."""
    return [
        str(name)
        for name, field in data.data_vars.items()
        if field.dtype.kind == "f" and MISSING not in field.attrs and not np.isfinite(field).all()
    ]


def at_rest(name, what, law):
    """A bundled train whose inputs have no torque, or no speed, in place of what they have."""

    def changed(port):
        torque, speed = port.given_torque, port.speed
        torque = 0.0 if what == "torque" and torque is not None else torque
        speed = 0.0 if what == "speed" and speed is not None else speed
        return port.model_copy(update={"power": None, "torque": torque, "speed": speed})

    def one_law(stage):
        contact = stage.gear_mesh.model_copy(update={"contact_law": law})
        return stage.model_copy(update={"gear_mesh": contact})

    train = load_case(name)
    changes = {
        "inputs": tuple(map(changed, train.inputs)),
        "stages": tuple(map(one_law, train.stages)),
    }
    return train.model_copy(update=changes)


@pytest.mark.parametrize("what", ["torque", "speed"])
@pytest.mark.parametrize(
    ("name", "law"), [*((n, "one-sided") for n in BUNDLED), ("double-rotor-5mw", "linear")]
)
def test_every_train_stands_without_torque_and_without_speed(name, what, law):
    context = put_together(at_rest(name, what, law))
    data = static(context, [0.0, 0.2])
    assert unexplained(data) == []
    assert data.attrs["closure_max"] < 1e-8
    assert data["input_angle"].values[1, 0] == pytest.approx(0.2)
    nothing = 1e-9 * bundled(name).rated.max()
    # errors press on some planets and pull at others, and add up to nothing
    mean = data["gear_mesh_force"].groupby("kind").mean("gear_mesh")
    if what == "torque":
        np.testing.assert_allclose(mean, 0.0, atol=nothing)
        np.testing.assert_allclose(data["port_torque"], 0.0, atol=nothing)
        assert data["load_sharing"].isnull().all()
    else:
        rated = static(put_together(at_rest(name, "", law)), [0.0])
        expected = rated["gear_mesh_force"].isel(position=0).groupby("kind").mean()
        np.testing.assert_allclose(mean.isel(position=0), expected, rtol=1e-8)
    for k in range(2):
        position_figures(context, data.isel(position=k))


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    """The spur stage with errors in the two states."""
    folder = tmp_path_factory.mktemp("rest")
    keys = {"stage.errors.carrier_eccentricity_um": "20", "solver.settle_s": "0.02"}
    keys |= {"solver.time_step_s": "1e-4", "solver.output_interval_ms": "0.2"}
    states = {"torque": {"inputs.0.torque_nm": "0"}, "speed": {"inputs.0.speed_rpm": "0"}}
    return {
        name: put_together(stage_train(folder, sun="1e8", **keys, **state))
        for name, state in states.items()
    }


@pytest.mark.parametrize("what", ["torque", "speed"])
def test_every_analysis_takes_a_train_without_torque_or_speed(stage, what):
    """The whole job, and every dataset of it says what is missing in it."""
    train = stage[what].case
    result = run(train.with_(**{"solver.duration": 0.05}), workers=1)
    for name, data in result.datasets.items():
        assert unexplained(data) == [], name
    assert unexplained(campbell(stage[what])) == []
    compare_sharing({"lumped": stage[what]}, cycles=2, transient=False)


def test_a_train_rated_at_rest_stays_there(stage):
    """The brake of a train that stands is what holds it: nothing moves under the rated torque."""
    context = stage["speed"]
    still = static(context, [0.0])
    rest = settled(simulate(context).data)
    torque = np.abs(still["port_torque"]).max()
    np.testing.assert_allclose(
        rest["port_torque"], still["port_torque"].values * np.ones((rest.sizes["time"], 1)),
        atol=1e-9 * float(torque),
    )  # fmt: skip
    force = still["gear_mesh_force"].values
    np.testing.assert_allclose(
        rest["gear_mesh_force"], force * np.ones((rest.sizes["time"], 1)),
        atol=1e-6 * np.abs(force).max(),
    )  # fmt: skip
    assert np.abs(rest["input_speed"]).max() < 1e-9


def test_modes_do_not_depend_on_torque_or_speed(stage):
    a, b = (modes(context)["frequency"].values for context in stage.values())
    np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-6)


def test_a_flexible_stage_without_torque():
    """Errors press on some teeth, nothing is passed on, and nothing moves."""
    stage = make_case(**{"drive.torque_nm": "0"}, **dict.fromkeys(CLEAN, "4.0"))
    bodies = cheap_stage(stage)
    model = put_together(stage.case, rigid=["all"], bodies=bodies)
    data = static(model, [0.0, 0.3], 0.0)
    assert unexplained(data) == []
    assert data["load_sharing"].isnull().all()
    np.testing.assert_allclose(data["port_torque"], 0.0, atol=1e-6)
    run = simulate(model, duration=0.01)
    assert unexplained(run.data) == []
    assert set(drop_summary(run.data)["load_sharing"].values()) == {None}
    assert abs(run.data["stage_speed"]).max() < 1e-6
