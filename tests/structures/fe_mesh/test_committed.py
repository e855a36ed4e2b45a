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
    made = make_module()
    now = ring_fe_mesh(made.RING_36) if "ring" in body else carrier_fe_mesh(made.CARRIER_5)
    kept = read_fe_mesh(FOLDER / f"{body}.vtu")
    assert set(kept.facets) == set(now.facets)
    if "ring" in body:  # structured: vertex by vertex
        np.testing.assert_allclose(kept.points, now.points, atol=1e-12)
        np.testing.assert_array_equal(kept.cells, now.cells)
    # free tetrahedra may differ between versions of gmsh, the body may not
    assert now.volume() == pytest.approx(kept.volume(), rel=2e-2)
    for name in kept.facets:
        area = facet_areas(kept.points, kept.facets[name]).sum()
        assert facet_areas(now.points, now.facets[name]).sum() == pytest.approx(area, rel=0.1), name
