"""Invariants and numbering of the FE mesh itself."""

import numpy as np
import pytest
import skfem

from flexgear.model.errors import FlexgearError
from flexgear.structures.fe_mesh.fe_mesh import HEX_FROM_VTK, HEX_TO_VTK, FeMesh, facet_areas

BOX = np.array([[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 0.5]])
VTK_CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float
)


def box(facets: dict[str, np.ndarray] | None = None) -> FeMesh:
    """One hexahedron 2 x 3 x 0.5."""
    return FeMesh(VTK_CORNERS @ BOX, np.array([HEX_FROM_VTK]), "hex", facets or {})


def test_a_box_has_its_volume_quality_edges_and_outward_facets() -> None:
    b = box({"top": np.array([[4, 5, 6, 7]])})
    assert b.volume() == pytest.approx(3.0)
    assert b.quality() == pytest.approx(1.0)
    assert b.quadratic_dofs == 3 * 20
    assert facet_areas(b.points, b.facets["top"]) == pytest.approx([6.0])
    p = b.points[b.boundary]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    assert len(p) == 6
    assert (np.einsum("ij,ij->i", normal, p.mean(axis=1) - b.points.mean(axis=0)) > 0).all()


def test_hex_numbering_converts_there_and_back_and_skfem_finds_it_positive() -> None:
    assert [HEX_TO_VTK[i] for i in HEX_FROM_VTK] == list(range(8))
    b = box()
    np.testing.assert_array_equal(b.vtk_cells, [np.arange(8)])
    mapping = skfem.MappingIsoparametric(skfem.MeshHex1(b.points.T, b.cells.T), skfem.ElementHex1())
    assert (mapping.detDF(np.full((3, 1), 0.3)) > 0.0).all()


def test_volume_of_a_distorted_hexahedron_equals_the_one_skfem_integrates() -> None:
    rng = np.random.default_rng(1)
    points = VTK_CORNERS + 0.15 * rng.random((8, 3))
    b = FeMesh(points, np.array([HEX_FROM_VTK]), "hex", {})
    basis = skfem.Basis(skfem.MeshHex1(b.points.T, b.cells.T), skfem.ElementHex1(), intorder=4)
    assert b.volume() == pytest.approx(basis.dx.sum(), rel=1e-12)


def test_tetrahedra_have_volume_and_regular_quality_one() -> None:
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], float)
    t = FeMesh(corners, np.array([[0, 2, 1, 3]]), "tet", {})
    assert t.volume() == pytest.approx(8.0 / 3.0)
    assert t.quality() == pytest.approx(1.0)
    assert t.quadratic_dofs == 30


def test_arrays_of_an_fe_mesh_are_read_only() -> None:
    b = box({"top": np.array([[4, 5, 6, 7]])})
    with pytest.raises(ValueError, match="read-only"):
        b.points[0, 0] = 1.0


@pytest.mark.parametrize(
    ("points", "cells"),
    [
        (VTK_CORNERS, HEX_TO_VTK),
        (VTK_CORNERS * [1, 1, 0], HEX_FROM_VTK),
        (VTK_CORNERS * np.nan, HEX_FROM_VTK),
    ],
)
def test_cells_that_are_no_body_are_refused(points, cells) -> None:
    with pytest.raises(FlexgearError, match="inverted or collapsed"):
        FeMesh(points, np.array([cells]), "hex", {})
