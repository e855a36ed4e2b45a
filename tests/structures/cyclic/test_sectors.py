"""Sectors found from coordinates and cells; matrices and ties written on one of them."""

from dataclasses import replace

import numpy as np
import pytest
from cyclic_samples import STEEL, TEETH, bent, plain_ring, renumbered, toothed_ring_mesh
from plain_meshes import annulus, box, tetrahedra

from flexgear.structures.bodies import rotation
from flexgear.structures.cyclic.condensation import (
    condense_by_sectors,
    cyclic_condensation,
    sector_counts,
)
from flexgear.structures.cyclic.sectors import (
    find_sectors,
)
from flexgear.structures.cyclic.ties import sector_ties
from flexgear.structures.fem.assembly import FeModel, facet_sample
from flexgear.structures.fem.ties import averaging_tie, interface_of


def model_of(fe_mesh):
    return FeModel(fe_mesh, *STEEL)


MESHES = {
    "hexahedra": lambda: annulus((12, 2, 2)),
    "tetrahedra": lambda: tetrahedra(annulus((12, 1, 2))),
    "renumbered": lambda: renumbered(annulus((12, 2, 2))),
    "teeth": toothed_ring_mesh,
}


@pytest.mark.parametrize("name", MESHES)
def test_every_node_is_one_sectors_own_and_images_turn_into_one_another(name):
    model = model_of(MESHES[name]())
    sectors = find_sectors(model, sector_counts(24 if name == "teeth" else 12))
    assert sectors.count == (24 if name == "teeth" else 12)
    assert np.array_equal(np.sort(sectors.nodes, axis=None), np.arange(len(model.nodes)))
    first = model.nodes[sectors.nodes[:, 0]]
    for s in range(sectors.count):
        expected = first @ rotation(sectors.pitch * s).T
        assert np.abs(model.nodes[sectors.nodes[:, s]] - expected).max() < 1e-11
    assert len(sectors.cells) * sectors.count == model.basis.nelems
    touched = np.unique(model.basis.element_dofs[:, sectors.cells])
    nodes, ahead = sectors.nodes[:, 0], sectors.nodes[sectors.interior :, 1]
    assert np.array_equal(touched, np.sort(np.concatenate([nodes, ahead])))


def test_border_of_a_toothed_ring_runs_through_the_rim_only():
    fe_mesh = toothed_ring_mesh()
    model = model_of(fe_mesh)
    sectors = find_sectors(model, (24,))
    border = model.nodes[sectors.nodes[sectors.interior :, 0]]
    root = np.hypot(*fe_mesh.points[fe_mesh.facets["tooth_root_001"]][..., :2].T).min()
    assert np.hypot(border[:, 0], border[:, 1]).min() > root - 1e-4  # chords


def test_most_sectors_are_found_that_the_mesh_allows():
    def bumps(angle):
        return 1 + 0.01 * np.cos(4 * angle)

    plain = annulus((12, 1, 1))
    points = plain.points.copy()
    points[:, :2] *= bumps(np.arctan2(points[:, 1], points[:, 0]))[:, None]
    assert find_sectors(model_of(replace(plain, points=points)), sector_counts(12)).count == 4


@pytest.mark.parametrize(
    "fe_mesh",
    [bent(annulus((12, 1, 1)), 1e-7), box((4, 2, 2)), annulus((13, 1, 1))],
    ids=["one node off", "a box", "another number"],
)
def test_meshes_that_do_not_repeat_have_no_sectors(fe_mesh):
    assert find_sectors(model_of(fe_mesh), sector_counts(12)) is None


def test_a_mesh_that_repeats_in_nodes_but_not_in_cells_has_no_sectors():
    fe_mesh = annulus((12, 1, 1))
    tets = tetrahedra(fe_mesh)
    first = np.flatnonzero(np.isin(tets.cells, fe_mesh.cells[0]).all(axis=1))
    mirrored = fe_mesh.cells[0][[1, 0, 3, 2, 5, 4, 7, 6]]
    other = tetrahedra(replace(fe_mesh, cells=mirrored[None])).cells[:, [1, 0, 2, 3]]
    cells = np.concatenate([np.delete(tets.cells, first, axis=0), other])
    assert find_sectors(model_of(replace(tets, cells=cells)), (12,)) is None


@pytest.mark.parametrize(
    ("repeats", "counts"), [(93, (93, 31, 3)), (5, (5,)), (4, (4,)), (2, ()), (8, (8, 4))]
)
def test_numbers_of_sectors_that_are_tried(repeats, counts):
    assert sector_counts(repeats) == counts


@pytest.fixture(scope="module")
def ring():
    model, interface = plain_ring()
    sectors = find_sectors(model, (TEETH,))
    return model, interface, cyclic_condensation(model, interface, sectors)


def test_products_by_sectors_equal_the_assembled_matrices(ring):
    model, interface, parts = ring
    x = np.random.default_rng(0).standard_normal((model.dofs, 5))
    for product, matrix in (
        (parts.mass_product, model.mass),
        (parts.stiffness_product, model.stiffness),
    ):
        expected = matrix @ x
        result = parts.dofs_of(product(parts.field_of(x)), model.dofs)
        assert np.abs(result - expected).max() < 1e-12 * np.abs(expected).max()
    expected = interface.rows @ x
    result = parts.interface_motion(parts.field_of(x))
    assert np.abs(result - expected).max() < 1e-12 * np.abs(expected).max()


def test_ties_that_share_the_period_and_the_others(ring):
    _, interface, parts = ring
    names = np.array(interface.node_names)
    assert parts.ties.periodic.shape == (TEETH, 1)
    assert set(names[parts.ties.other]) == {"fit", "bolt_1", "bolt_2"}
    angle = np.unwrap(np.arctan2(*interface.positions[parts.ties.periodic[:, 0], 1::-1].T))
    assert np.allclose(np.diff(angle), 2 * np.pi / TEETH)
    q = np.random.default_rng(1).standard_normal((interface.size, 2))
    assert np.abs(parts.ties.joined(*parts.ties.split(q)) - q).max() < 1e-15


def test_bodies_without_a_tie_in_every_sector_take_the_general_path():
    model = FeModel(annulus((12, 1, 1), teeth=12), *STEEL)
    ties = [
        averaging_tie(name, np.zeros(3), facet_sample(model, model.fe_mesh.facets[name]))
        for name in ("outer", "end_plus")
    ]
    parts, path = condense_by_sectors(model, interface_of(model, ties), (12,))
    assert parts is None
    assert path.startswith("general: no tie")


def test_a_patch_over_two_sectors_takes_the_general_path():
    fe_mesh = annulus((12, 1, 2), teeth=12)
    wide = {
        f"patch_{j + 1:03d}": np.concatenate(
            [fe_mesh.facets[f"patch_{k % 12 + 1:03d}"] for k in (j, j + 1)]
        )
        for j in range(12)
    }
    model = FeModel(replace(fe_mesh, facets=wide), *STEEL)
    ties = [
        averaging_tie(name, rotation(np.pi * j / 6) @ [0.7, 0.2, 0.0], facet_sample(model, patch))
        for j, (name, patch) in enumerate(wide.items())
    ]
    sectors = find_sectors(model, (12,))
    assert sector_ties(interface_of(model, ties), sectors) is None


def test_ties_alike_in_place_but_not_in_shape_are_no_ones_images():
    fe_mesh = annulus((12, 1, 2), teeth=6)
    facets = dict(fe_mesh.facets)
    facets["patch_002"] = facets["patch_002"][:2]
    model = FeModel(replace(fe_mesh, facets=facets), *STEEL)
    ties = [
        averaging_tie(
            f"{j}",
            rotation(np.pi * j / 3) @ [0.7, 0.2, 0.0],
            facet_sample(model, facets[f"patch_{j + 1:03d}"]),
        )
        for j in range(6)
    ]
    assert sector_ties(interface_of(model, ties), find_sectors(model, (6,))) is None
