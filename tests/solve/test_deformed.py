"""Displacement fields of FE bodies at samples of a transient."""

import math

import numpy as np
import pytest
from stage_samples import stage_with_vertices

from flexgear.model.errors import InputError
from flexgear.model.names import BodyName
from flexgear.solve.deformed import LEAST_SHARE, deformed, mode_field, mode_shapes
from flexgear.solve.transient import simulate
from flexgear.views.render import field_grid

BODIES = ("stage.ring", "stage.carrier")


@pytest.fixture(scope="module")
def model():
    return stage_with_vertices()


@pytest.fixture(scope="module")
def run(model):
    return simulate(model, duration=0.004, fields=BODIES).data


@pytest.mark.parametrize(
    ("body", "variable"),
    list(zip(BODIES, ("tooth_displacement", "carrier_displacement"), strict=True)),
)
def test_fields_of_samples_move_the_nodes_as_the_results_say(model, run, body, variable):
    for time in run["time"].to_numpy():
        field = deformed(model, body, run=run, time=time + 1e-5)
        assert field.attrs["time"] == time
        nodes = run[variable].sel(time=time).to_numpy()[:8, :3]
        assert np.abs(nodes).max() > 0
        assert np.allclose(field["displacement"], nodes, atol=1e-6 * np.abs(nodes).max())


def test_a_ring_in_steady_running_is_near_statics(model, run):
    """What swings about the equilibrium of an angle is a few per cent of it."""
    angle = float(run["input_angle"][-1, 0])
    later = deformed(model, "stage.ring", run=run, time=run["time"][-1])
    static = deformed(model, "stage.ring", carrier_angle=angle)["displacement"]
    assert np.abs(static - later["displacement"]).max() < 0.05 * np.abs(static).max()


def test_a_field_is_a_grid_for_pyvista(model):
    field = deformed(model, "stage.ring")
    grid = field_grid(field)
    assert grid.n_points == field.sizes["vertex"]
    assert np.array_equal(grid.point_data["displacement"], field["displacement"])
    assert np.array_equal(grid.point_data["stress_Pa"], field["stress"])
    assert field["stress"].attrs["units"] == field["von_mises_stress"].attrs["units"] == "Pa"
    warped = grid.warp_by_vector("displacement", factor=10)
    assert np.allclose(warped.points, field["point"] + 10 * field["displacement"], atol=1e-6)


def test_a_field_that_a_run_does_not_keep_is_refused(model, run):
    short = simulate(model, duration=0.002).data
    with pytest.raises(InputError, match=r"is not kept in the run, which keeps none -- .*fields="):
        deformed(model, "stage.ring", run=short)
    with pytest.raises(InputError, match=r"'stage\.rings': is not a flexible FE body"):
        simulate(model, duration=0.002, fields=["stage.rings"])
    with pytest.raises(InputError, match="inf: is no torque -- give a number"):
        deformed(model, "stage.ring", torque=math.inf)
    with pytest.raises(InputError, match="1: is not within the run -- take one from"):
        deformed(model, "stage.ring", run=run, time=1.0)
    with pytest.raises(InputError, match="time: is that of no run -- give the transient as run"):
        deformed(model, "stage.ring", time=1.0)
    assert len(repr(model.bodies[BodyName.of("stage", "ring")])) < 80  # no list of all teeth


@pytest.mark.parametrize("body", BODIES)
def test_shapes_of_a_run_are_the_modes_that_move_the_body(model, body):
    """Each is the field of its mode over its largest, rising, and far enough apart."""
    natural = model.natural_modes(model.pace.band)
    shapes = mode_shapes(model, body, natural)
    assert shapes.sizes["mode"] > 1
    assert (np.diff(shapes["frequency"]) > 0).all()
    for number in shapes["mode"].to_numpy():
        assert natural.energy[body][number - 1] >= LEAST_SHARE
        whole = mode_field(model, body, int(number), largest=1.0)
        shape = shapes.sel(mode=number)
        assert float(shape["frequency"]) == pytest.approx(whole.attrs["frequency"], rel=1e-9)
        one, other = shape["mode_displacement"].to_numpy(), whole["displacement"].to_numpy()
        sign = np.sign(np.sum(one * other))
        np.testing.assert_allclose(sign * one, other, atol=1e-7)
