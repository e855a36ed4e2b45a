"""Python's way from a case to labelled results, the same for every bundled case."""

import numpy as np
import pytest
from stage_samples import bodies_of

import flexgear as fg
from flexgear.model.load import bundled_cases
from flexgear.results.quantities import MISSING, RESULT_COORDINATES
from flexgear.results.result_quantities import RESULT_QUANTITIES

SAMPLED = ("time", "position", "mode", "speed_factor")
DEGREES = [0.0, 1.5]
SHORT = {"solver.duration": 0.004, "solver.settle": 0.001, "solver.gear_mesh_orders": 1}
SOLVED = {
    "static": lambda model: model.static(DEGREES),
    "modes": lambda model: model.modes(),
    "transient": lambda model: model.transient(duration=0.004),
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
        return case.assemble()


@pytest.fixture(scope="module", params=SOLVED)
def result(model, request):
    return request.param, SOLVED[request.param](model)


def test_every_variable_is_in_the_schema_with_axes_unit_and_meaning(result):
    _, data = result
    for name, values in data.data_vars.items():
        quantity = RESULT_QUANTITIES[name]
        declared = zip(quantity.dims, values.dims, strict=True)
        assert all(of in SAMPLED if d == "sample" else of == d for d, of in declared), name
        assert values.attrs == quantity.attrs
        if MISSING not in quantity.attrs and values.dtype.kind == "f":
            assert np.all(np.isfinite(values)), name
    for name, values in data.coords.items():
        assert (values.attrs["units"], values.attrs["long_name"]) == RESULT_COORDINATES[name][:2]
    assert set(data.dims) <= set(data.coords)


@pytest.mark.parametrize("model", ["herringbone", "nrel-5mw", "wind-5mw"], indirect=True)
def test_every_picture_of_a_result_is_drawn(result):
    kind, data = result
    plots = data.fg.plot
    assert {"static": "power_flow", "modes": "campbell"}.get(
        kind, "transient_displacements"
    ) in dir(plots)
    for name in dir(plots):
        assert getattr(plots, name)().axes, name


@pytest.mark.parametrize("model", ["wind-5mw"], indirect=True)
def test_a_carrier_that_turns_backwards_has_its_stars_at_two_angles(model):
    axes = model.static([0, -20, -36]).fg.plot.ring_star().axes
    assert [ax.get_title(loc="left")[-9:] for ax in axes] == ["0.000 rad", "0.628 rad"]
    assert "−π/5" in axes[1].get_title(loc="left")
    assert len(model.static(0).fg.plot.ring_star().axes) == 1  # one position is not shown twice


def test_every_result_says_whose_it_is_and_how_good(model, result):
    name, data = result
    assert data.attrs["content_hash"] == model.case.content_hash()
    assert {"case", "variant", "version", "parameters", *STATISTICS[name]} <= set(data.attrs)
    for name in model.bodies:
        assert data.attrs[f"{name}_static_error"] == 0.001
        assert data.attrs[f"{name}_frequency_error"] == 0.002


def test_equilibria_are_found_by_the_angle_that_was_asked_for(model):
    data, angles = model.static(DEGREES), np.radians(DEGREES).tolist()
    force = data["gear_mesh_force"].swap_dims(position="lead_angle")
    assert force["lead_angle"].values.tolist() == angles
    assert data["input_angle"][:, 0].values.tolist() == angles
    assert np.array_equal(force.sel(lead_angle=angles[1]), data["gear_mesh_force"][1])


def test_gears_that_cannot_mesh_are_refused():
    case = fg.load_case("wind-5mw", planets=6)
    with pytest.raises(fg.InputError, match="planets"):
        case.assemble()
