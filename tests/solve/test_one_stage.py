"""A stage alone and the train of that one stage: every figure of every result is the same."""

import numpy as np
import pytest
from stage_samples import cheap_stage
from trains import STEEL, write

import flexgear as fg

TRAIN = (
    STEEL
    + """
[[stages]]
name = "stage"
case = "wind-5mw"
[[inputs]]
member = "stage.carrier"
speed_rpm = 11.27
torque_knm = 4000
[output]
member = "stage.sun"
brake_exponent = 1
"""
)
PINNED = {  # what a train does not take over from the case of its stage
    "solver.modes_band_hz": "500", "solver.modes_accuracy": "0.01", "solver.settle_s": "0",
    "solver.time_step_s": "1e-4", "solver.step_time_step_s": "2e-5",
    "solver.output_interval_s": "1e-3",
}  # fmt: skip
RESULTS = {
    "static": lambda model: model.static([0.0, 20.0, 40.0]),
    "modes": lambda model: model.modes(limit_hz=500.0),
    "transient": lambda model: model.transient(duration=0.03),
}


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    train = fg.load_case(write(tmp_path_factory.mktemp("train"), TRAIN), PINNED)
    alone = fg.load_case("wind-5mw", PINNED)
    return [case.assemble(bodies=cheap_stage(case.view())) for case in (alone, train)]


@pytest.mark.parametrize("result", RESULTS)
def test_figures_are_those_of_the_stage_alone(models, result):
    alone, train = (RESULTS[result](model) for model in models)
    assert set(alone.variables) == set(train.variables)
    for name, values in alone.variables.items():
        if name == "closure":  # itself what rounding leaves over
            continue
        a, b = values.to_numpy(), train[name].to_numpy()
        if values.dtype.kind != "f":
            assert np.array_equal(a, b), name
            continue
        assert np.array_equal(np.isnan(a), np.isnan(b)), name
        largest = np.nanmax(np.abs(a), initial=0.0)
        assert np.nanmax(np.abs(a - b), initial=0.0) <= 1e-10 * largest, name
