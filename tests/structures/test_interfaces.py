"""Interface nodes act on the groups that are named after them."""

from dataclasses import replace

import numpy as np
import pytest

from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh import FeMesh
from flexgear.structures.fem import FeModel, Interface
from flexgear.structures.sources.of_case import ring_source
from flexgear.structures.sources.reducing import tied


@pytest.fixture(scope="module")
def case() -> StageView:
    return load_case("wind-5mw", {"solver.fidelity": "quick"}).view()


def interface(case: StageView, fe_mesh: FeMesh) -> tuple[Interface, FeModel]:
    m = case.material
    model = FeModel(fe_mesh, m.young_modulus, m.poisson_ratio, m.density)
    return tied(model, ring_source(case).nodes(model.fe_mesh)), model


@pytest.mark.parametrize("order", [1, -1])
def test_a_fit_is_tied_to_its_own_band_whichever_is_listed_first(
    case: StageView, order: int
) -> None:
    """Under u = z e_x a node moves by the mean height of what it is tied to."""
    listed = case.with_(**{"stage.ring.fe.fits": case.ring.fits[::order]})
    found, model = interface(listed, ring_source(listed).fe_mesh())
    field = np.zeros((len(model.nodes), 3))
    field[:, 0] = model.nodes[:, 2]
    motion = (found.rows @ field.ravel()).reshape(-1, 6)
    for k, fit in enumerate(listed.ring.fits, 1):
        node = found.node_names.index(f"fit_{k}")
        assert found.positions[node, 2] == fit.z
        assert motion[node, 0] == pytest.approx(fit.z)


def test_bolts_act_in_the_end_face_that_is_named(case: StageView) -> None:
    """A ring that reaches beyond its bolted face, say by a pilot."""
    fe_mesh = ring_source(case).fe_mesh()
    levels = np.unique(fe_mesh.points[:, 2].round(9))
    assert case.ring.end == "-z"
    for level in levels[:2]:
        flat = np.isclose(fe_mesh.points[:, 2], level)
        face = fe_mesh.every_facet[flat[fe_mesh.every_facet].all(axis=1)]
        _, first = np.unique(np.sort(face, axis=1), axis=0, return_index=True)
        named = replace(fe_mesh, facets={**fe_mesh.facets, "end_minus": face[first]})
        found, _ = interface(case, named)
        assert found.positions[found.node_names.index("bolt_01"), 2] == pytest.approx(level)
