"""The small FE meshes in meshes/ are what the generators make today."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from flexgear.structures.fe_mesh.carrier_mesh import carrier_fe_mesh
from flexgear.structures.fe_mesh.fe_mesh import facet_areas
from flexgear.structures.fe_mesh.files import read_fe_mesh
from flexgear.structures.fe_mesh.gears import ring_fe_mesh

FOLDER = Path(__file__).parents[3] / "meshes"


def make_module():
    spec = importlib.util.spec_from_file_location("make", FOLDER / "make.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("body", ["ring36_quick", "carrier5_quick"])
def test_generator_still_makes_the_committed_body(body: str) -> None:
    generator = make_module()
    now = (
        ring_fe_mesh(generator.RING_36) if "ring" in body else carrier_fe_mesh(generator.CARRIER_5)
    )
    committed = read_fe_mesh(FOLDER / f"{body}.vtu")
    assert set(committed.facets) == set(now.facets)
    if "ring" in body:  # structured: vertex by vertex
        np.testing.assert_allclose(committed.points, now.points, atol=1e-12)
        np.testing.assert_array_equal(committed.cells, now.cells)
    # free tetrahedra may differ between versions of gmsh, the body may not
    assert now.volume() == pytest.approx(committed.volume(), rel=2e-2)
    for name in committed.facets:
        area = facet_areas(committed.points, committed.facets[name]).sum()
        assert facet_areas(now.points, now.facets[name]).sum() == pytest.approx(area, rel=0.1), name
