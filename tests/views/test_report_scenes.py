"""Bodies that turn and swing on the page of a report."""

import numpy as np
import pytest
import pyvista as pv

from flexgear.structures.fe_mesh.fe_mesh import HEX_TO_VTK
from flexgear.views.render import deformation_exaggeration
from flexgear.views.report import (
    MAX_PLOTS,
    within,
)
from flexgear.views.scenes import (
    MODE_SIZE,
    PAGE_TRIANGLES,
    body_scene,
    mode_scene,
    triangles_of_each,
)


def test_a_deformed_body_turns_on_the_page():
    """A cube of one cell: 12 triangles, moved as stated, coloured by its displacement."""
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0],
                       [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float)  # fmt: skip
    cell = np.empty((1, 8), dtype=int)
    cell[0, HEX_TO_VTK] = np.arange(8)
    u = np.zeros((8, 3))
    u[4:, 2] = 2e-5
    (panel,) = body_scene(corner, cell, u, np.linspace(0, 70e6, 8))
    (body,) = panel["data"]
    assert len(body["i"]) == 12
    assert max(body["intensity"]) == 20.0
    factor = deformation_exaggeration(corner, u)
    assert max(body["z"]) == pytest.approx(1e3 * (1 + factor * 2e-5), rel=2e-4)
    assert min(body["z"]) == 0.0
    plain, stressed = panel["layout"]["updatemenus"][0]["buttons"]
    assert plain["args"][0]["intensity"] == [body["intensity"]]
    values, layout = stressed["args"]
    assert max(values["intensity"][0]) == 70.0 and values["colorbar.title.text"] == ["MPa"]
    assert "largest 70 MPa" in layout["title.text"]


def test_a_body_swings_between_its_modes():
    """A bar that stretches in one mode and twists in another keeps its surface in both."""
    grid = pv.ImageData(dimensions=(3, 3, 9)).cast_to_structured_grid().cast_to_unstructured_grid()
    cells = np.empty_like(grid.cells_dict[pv.CellType.HEXAHEDRON])
    cells[:, HEX_TO_VTK] = grid.cells_dict[pv.CellType.HEXAHEDRON]
    x, y, z = np.asarray(grid.points, dtype=float).T - np.array([[1.0], [1.0], [0.0]])
    shapes = np.stack([np.stack([0 * z, 0 * z, z / 8], 1), np.stack([-y * z, x * z, 0 * z], 1)])
    shapes[1] /= np.linalg.norm(shapes[1], axis=1).max()
    (panel,) = mode_scene(grid.points, cells, shapes, ["stretch", "twist"])
    (trace,), swing = panel["data"], panel["swing"]
    rest = np.array(swing["rest"])
    assert max(max(trace[k]) for k in "ijk") < rest.shape[1] == len(trace["intensity"])
    assert [mode["label"] for mode in swing["modes"]] == ["stretch", "twist"]
    for mode in swing["modes"]:
        assert np.linalg.norm(mode["by"], axis=0).max() == pytest.approx(
            1e3 * MODE_SIZE * 8, rel=2e-3
        )
        assert max(mode["size"]) == 100
        for k, name in enumerate("xyz"):
            low, high = panel["layout"]["scene"][f"{name}axis"]["range"]
            assert low <= (rest - np.abs(mode["by"]))[k].min()
            assert high >= (rest + np.abs(mode["by"]))[k].max()
    stretched = np.array(swing["modes"][0]["by"])
    assert np.allclose(stretched[2], MODE_SIZE * rest[2], atol=1.0)


def test_small_bodies_are_as_smooth_as_large_ones():
    """A bar of 5 mm that moves by 0.7 µm: rounded to 0.1 mm and 0.1 µm it had seven colours."""
    grid = pv.ImageData(dimensions=(3, 3, 40), spacing=(1e-4,) * 3).cast_to_unstructured_grid()
    cells = np.empty_like(grid.cells_dict[pv.CellType.VOXEL])
    cells[:, HEX_TO_VTK] = grid.cells_dict[pv.CellType.VOXEL][:, [0, 1, 3, 2, 4, 5, 7, 6]]
    points = np.asarray(grid.points, dtype=float)
    u = 1.8e-4 * points * [0, 0, 1]
    (panel,), (moving,) = (
        body_scene(points, cells, u, u[:, 2]),
        mode_scene(points, cells, u[None] / u.max(), ["stretch"]),
    )
    body = panel["data"][0]
    assert (
        len({*body["z"]}) == len({*body["intensity"]}) == len({*moving["swing"]["rest"][2]}) == 40
    )
    assert panel["layout"]["scene"]["zaxis"]["title"]["text"] == "z (mm)"
    assert "largest 0.702 µm" in panel["layout"]["title"]["text"]


@pytest.mark.parametrize("distance", [1.0, 3.0])
def test_a_body_keeps_to_its_triangles(distance):
    """A bar of 60 cubes, and 60 cubes apart, of which none can go while every piece is kept."""
    cubes = [pv.ImageData(dimensions=(4, 4, 4), spacing=(1 / 3,) * 3, origin=(distance * k, 0, 0))
             for k in range(60)]  # fmt: skip
    grid = pv.merge([cube.cast_to_structured_grid() for cube in cubes])
    cells = np.empty_like(grid.cells_dict[pv.CellType.HEXAHEDRON])
    cells[:, HEX_TO_VTK] = grid.cells_dict[pv.CellType.HEXAHEDRON]
    u = 1e-5 * grid.points
    (full,) = body_scene(grid.points, cells, u, u[:, 0])
    (few,) = body_scene(grid.points, cells, u, u[:, 0], 300)
    assert len(full["data"][0]["i"]) > 2000
    body = few["data"][0]
    assert 100 < len(body["i"]) <= 300
    assert max(max(body[k]) for k in "ijk") < len(body["x"]) == len(body["intensity"])


@pytest.mark.parametrize("bodies", [1, 2, 7])
def test_scenes_of_any_number_of_bodies_fit_into_the_page(bodies):
    """Random numbers, which deflate worst, of as many triangles as bodies may have together."""
    rng, (each, swinging) = np.random.default_rng(1), triangles_of_each(bodies)
    points, few = each // 2 + 2, swinging // 2 + 2  # of closed surfaces without holes
    plots = {
        str(k): {"data": [{"type": "mesh3d"}
                 | {name: rng.uniform(-1, 1, points).round(4).tolist() for name in "xyz"}
                 | {name: rng.integers(0, points, each).tolist() for name in "ijk"}
                 | {n: rng.uniform(0, 500, points).round(1).tolist() for n in ("um", "mpa")}]}
        for k in range(bodies)
    }  # fmt: skip
    plots |= {
        f"modes {k}": {"swing": rng.uniform(-1, 1, (5, 3, few)).round(4).tolist(),
                       "size": rng.integers(0, 100, (4, few)).tolist(),
                       "ijk": rng.integers(0, few, (3, swinging)).tolist()}
        for k in range(bodies)
    }  # fmt: skip
    assert (each + swinging) * bodies <= PAGE_TRIANGLES
    text, left_out, thinned = within(plots, MAX_PLOTS)
    assert len(text) < MAX_PLOTS and not left_out and not thinned
