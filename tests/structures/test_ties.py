"""Interface ties: rigid motion exactly, and independent of where mesh nodes fall."""

import numpy as np
import pytest
from plain_meshes import annulus, box, rigid_modes, tetrahedra

from flexgear.model.errors import FlexgearError
from flexgear.structures.bodies import rigid_rows
from flexgear.structures.fem.assembly import FeModel, disc_points, facet_sample, point_sample
from flexgear.structures.fem.ties import averaging_tie, interface_of, rigid_tie, seat_tie

STEEL = (210e9, 0.3, 7850.0)
CENTRE = np.array([0.5, 0.11, 0.3])


def smooth(points):
    """A quadratic displacement field, which quadratic elements hold exactly."""
    x, y, z = points.T
    return np.column_stack([x * y, x**2 - 0.5 * y * z, z * x + 0.3 * y**2])


def disc_tie(mesh):
    model = FeModel(mesh, *STEEL)
    disc = disc_points(CENTRE, 0.12)
    return model, averaging_tie("bolt", CENTRE, point_sample(model, *disc))


def test_averaging_tie_reproduces_rigid_motion_wherever_its_node_lies():
    model = FeModel(annulus((12, 1, 2)), *STEEL)
    sample = facet_sample(model, model.fe_mesh.facets["outer"])
    far = np.array([3.0, -1.0, 2.0])
    interface = interface_of(model, [averaging_tie("fit", far, sample)])
    assert np.allclose(
        interface.rows @ rigid_modes(model), rigid_rows(interface.positions), atol=1e-12
    )


@pytest.mark.parametrize(
    "mesh", [box((7, 3, 3)), box((10, 4, 2)), tetrahedra(box((6, 2, 3)))], ids=["7", "10", "tet"]
)
def test_disc_tie_does_not_depend_on_the_mesh(mesh):
    model, tie = disc_tie(mesh)
    coarse_model, coarse = disc_tie(box((4, 2, 2)))
    q = tie.rows @ smooth(model.nodes).ravel()
    reference = coarse.rows @ smooth(coarse_model.nodes).ravel()
    assert np.allclose(q, reference, atol=1e-12)


def test_disc_quadrature_integrates_polynomials():
    points, weights = disc_points(np.zeros(3), 2.0)
    assert weights.sum() == pytest.approx(np.pi)
    assert weights @ points[:, 0] ** 2 == pytest.approx(np.pi / 4)
    assert weights @ (points[:, 0] ** 2 * points[:, 1] ** 2) == pytest.approx(np.pi / 24)


def test_rigid_tie_moves_its_patch_as_one_piece():
    model = FeModel(box((4, 2, 2)), *STEEL)
    sample = facet_sample(model, model.fe_mesh.facets["x1"])
    position = np.array([1.0, 0.1, 0.15])
    disc = averaging_tie("bolt", CENTRE, point_sample(model, *disc_points(CENTRE, 0.1)))
    interface = interface_of(model, [rigid_tie("end", position, sample), disc])
    q = np.array([0.1, 0.2, 0.3, 0.01, -0.02, 0.03])
    reduced = np.zeros(interface.expansion.shape[1])
    reduced[-6:] = q
    assert np.allclose(interface.rows[:6] @ reduced, q)
    u = (interface.expansion @ reduced).reshape(-1, 3)
    on = np.isclose(model.nodes[:, 0], 1.0)
    expected = q[:3] + np.cross(q[3:], model.nodes[on] - position)
    assert np.allclose(u[on], expected)
    assert np.all(u[~on] == 0.0)


@pytest.mark.parametrize("place", [[0.0, 0.0, 0.0], [0.0, 0.0, 0.7]], ids=["middle", "outside"])
@pytest.mark.parametrize("covers", [1.0, 0.4], ids=["round", "a part"])
def test_a_seat_tie_reproduces_rigid_motion(place, covers):
    model = FeModel(annulus((12, 1, 2)), *STEEL)
    facets = model.fe_mesh.facets["outer"]
    sample = facet_sample(model, facets[: int(covers * len(facets))])
    tie = seat_tie("seat", np.array(place), sample)
    assert np.allclose(
        tie.rows @ rigid_modes(model), rigid_rows(interface_of(model, [tie]).positions), atol=1e-12
    )


def test_a_seat_tie_loads_the_seat_by_pressure_alone():
    """Force across and tilting moment give tractions along the normals, p ~ cos of the angle and
    linear along the seat; axial force and torque have the whole surface."""
    model = FeModel(annulus((24, 1, 3)), *STEEL)
    sample = facet_sample(model, model.fe_mesh.facets["outer"])
    points = sample.points
    normal = points * [1.0, 1.0, 0.0] / np.hypot(*points.T[:2])[:, None]
    middle = np.array([0.0, 0.0, sample.weights @ points[:, 2] / sample.weights.sum()])
    tie = seat_tie("seat", middle, sample)
    area = sample.weights.sum()
    z, square = points[:, 2] - middle[2], sample.weights @ (points[:, 2] - middle[2]) ** 2 / area
    for wrench, pressure in [
        ([1.0, 0, 0, 0, 0, 0], 2 * normal[:, 0]),
        ([0, 1.0, 0, 0, 0, 0], 2 * normal[:, 1]),
        ([0, 0, 0, 1.0, 0, 0], -2 * normal[:, 1] * z / square),
        ([0, 0, 0, 0, 1.0, 0], 2 * normal[:, 0] * z / square),
    ]:
        forces = (sample.weights / area * pressure)[:, None] * normal
        expected = sample.load(forces)
        assert np.allclose(tie.rows.T @ wrench, expected, atol=0.02 * np.abs(expected).max())
    torque = tie.rows.T @ np.array([0, 0, 0, 0, 0, 1.0])
    assert np.allclose(rigid_modes(model).T @ torque, [0, 0, 0, 0, 0, 1.0], atol=1e-12)


def test_a_patch_without_extent_is_refused():
    model = FeModel(box((2, 1, 1)), *STEEL)
    line = np.array([[0.5, 0.1, 0.05], [0.5, 0.1, 0.25]])
    with pytest.raises(FlexgearError, match="rotation"):
        averaging_tie("line", line[0], point_sample(model, line, np.ones(2)))


def test_a_point_outside_the_mesh_is_refused():
    model = FeModel(box((2, 1, 1)), *STEEL)
    with pytest.raises(FlexgearError, match="outside"):
        point_sample(model, np.array([[2.0, 0.0, 0.0]]), np.ones(1))
