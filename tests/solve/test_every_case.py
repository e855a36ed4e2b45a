"""Python's way from a case to labelled results, the same for every bundled case."""

import numpy as np
import pytest
from stage_samples import bodies_of

import flexgear as fg
from flexgear.model.bundled import bundled_cases
from flexgear.results.quantities import MISSING
from flexgear.results.result_quantities import RESULT_COORDINATES, RESULT_QUANTITIES

ANGLES = [0.0, 0.02]
SHORT = {"solver.duration": 0.004, "solver.settle": 0.001, "solver.gear_mesh_orders": 1}
SOLVED = {
    "static": lambda model: fg.static(model, carrier_angle=ANGLES),
    "modes": fg.modes,
    "transient": lambda model: fg.transient(model, duration=0.004),
}
STATISTICS = {
    "static": ["closure_max", "modes_estimate"],
    "modes": [],
    "transient": ["steps", "steps_refused", "step_sizes", "solver", "modes_estimate"],
}


@pytest.fixture(scope="module", params=bundled_cases())
def model(request):
    case = fg.load_case(request.param).with_(**SHORT)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flexgear.solve.bodies.stage_bodies", lambda stage, *_: bodies_of(stage))
        return fg.assemble(case)


@pytest.fixture(scope="module", params=SOLVED)
def result(model, request):
    return request.param, SOLVED[request.param](model)


def test_every_variable_is_in_the_schema_with_axes_unit_and_meaning(result):
    _, data = result
    sample = next(d for d in ("time", "position", "mode") if d in data.dims)
    for name, values in data.data_vars.items():
        known = RESULT_QUANTITIES[name]
        assert values.dims == tuple(sample if d == "sample" else d for d in known.dims)
        assert values.attrs == known.attrs
        if MISSING not in known.attrs and values.dtype.kind == "f":
            assert np.all(np.isfinite(values)), name
    for name, values in data.coords.items():
        assert (values.attrs["units"], values.attrs["long_name"]) == RESULT_COORDINATES[name][:2]
    assert set(data.dims) <= set(data.coords)


def test_every_result_says_whose_it_is_and_how_good(model, result):
    name, data = result
    assert data.attrs["content_hash"] == model.case.content_hash()
    assert {"case", "variant", "version", "parameters", *STATISTICS[name]} <= set(data.attrs)
    for name in model.bodies:
        assert data.attrs[f"{name}_static_error"] == 0.001
        assert data.attrs[f"{name}_frequency_error"] == 0.002


def test_equilibria_are_found_by_the_angle_that_was_asked_for(model):
    data = fg.static(model, carrier_angle=ANGLES)
    force = data["gear_mesh_force"].swap_dims(position="lead_angle")
    assert force["lead_angle"].values.tolist() == ANGLES
    assert data["input_angle"][:, 0].values.tolist() == ANGLES
    assert np.array_equal(force.sel(lead_angle=ANGLES[1]), data["gear_mesh_force"][1])


def test_gears_that_cannot_mesh_are_refused():
    case = fg.load_case("wind-5mw", {"stage.planets": "6"})
    with pytest.raises(fg.InputError, match="planets"):
        fg.assemble(case)
