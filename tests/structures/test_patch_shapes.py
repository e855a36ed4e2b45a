"""Motion of loaded nodes that only the wrench of a load moves: a thin ring bolted at one end,
against direct solutions of its FE model."""

import numpy as np
import pytest
import scipy.sparse as sp

from flexgear.structures import probe_loads
from flexgear.structures.estimate import probed, static_errors
from flexgear.structures.fe_mesh.ring import RingMeshParameters, ring_fe_mesh
from flexgear.structures.fem import (
    assemble,
    averaging_tie,
    disc_points,
    facet_sample,
    interface_of,
    point_sample,
)
from flexgear.structures.linalg.cholesky import Factor
from flexgear.structures.patch_responses import loaded_patches, nodes_beside, shapes_of
from flexgear.structures.patch_shapes import OF_TEETH
from flexgear.structures.reduction import reduce
from flexgear.structures.tooth_shapes import ToothLine

TEETH, MODULE, WIDTH = 30, 10e-3, 75e-3
STEEL = (210e9, 0.3, 7850.0)
RING = RingMeshParameters(
    teeth=TEETH, normal_module=MODULE, helix_angle=0.15, addendum=0.8, root_fillet=0.3,
    face_width=WIDTH, rim_thickness=33e-3, bolts=6, bolt_circle_diameter=0.375,
    bolt_diameter=12e-3, fits=(), fidelity="quick",
)  # fmt: skip
RADIUS = RING.tooth.reference_radius
BOLTS = {"k": 2e8, "tilt": 1e4}


class Ring:
    """FE model, ties and what is wanted of them; bodies with plain nodes and with loaded ones."""

    def __init__(self):
        self.model = assemble(ring_fe_mesh(RING), *STEEL)
        facets = self.model.fe_mesh.facets
        ties, self.lines = [], {}
        for j in range(TEETH):
            name, angle = f"tooth_{j + 1:03d}", 2 * np.pi * j / TEETH
            place = RADIUS * np.array([np.cos(angle), np.sin(angle), 0.0])
            ties.append(
                averaging_tie(
                    name, place, facet_sample(self.model, facets[f"tooth_root_{name[6:]}"])
                )
            )
            self.lines[name] = ToothLine(angle, RADIUS, RING.helix_rate, WIDTH)
        for k in range(6):
            angle = 2 * np.pi * k / 6
            place = np.array([0.1875 * np.cos(angle), 0.1875 * np.sin(angle), -WIDTH / 2])
            disc = disc_points(place, np.array([0.0, 0.0, 1.0]), 12e-3)
            ties.append(averaging_tie(f"bolt_{k + 1:02d}", place, point_sample(self.model, *disc)))
        self.interface = interface_of(self.model, ties)
        skin = ["tooth_root", "tooth_flank", "tooth_backflank"]
        self.patches = loaded_patches(self.model, self.lines, skin, OF_TEETH)
        self.reduction = reduce(
            self.model, self.interface, 6, sectors=(TEETH,),
            beside=nodes_beside(self.model, self.patches),
        )  # fmt: skip
        shapes = shapes_of(self.reduction, self.patches)
        self.body = self.reduction.body.with_(patches=shapes)
        self.supports = self.springs(1.0)
        self.loaded = self.body.on_loaded_patches(self.supports)

    def springs(self, factor):
        out = np.zeros(self.interface.size)
        out[6 * TEETH :] = factor * np.tile([*3 * [BOLTS["k"]], *3 * [BOLTS["tilt"]]], 6)
        return np.diag(out)

    def solver(self, supports):
        """Of the whole FE model on springs at the bolts."""
        rows = self.interface.rows
        held = rows.T @ sp.csr_matrix(supports) @ rows
        return Factor((self.model.stiffness + held).tocsr()).solve

    def weights(self, j):
        """A of tooth j and its ties: B, B_s (3n columns)."""
        b = self.interface.size
        held = np.linalg.inv(self.body.stiffness[:b, :b] + self.supports)
        patch = self.patches[j]
        shapes = np.zeros((len(patch.rows), self.model.dofs))
        shapes[:, patch.dofs] = patch.rows
        node = self.interface.rows[6 * j : 6 * j + 6].toarray()
        return self.body.patches.weights(held)[j], node, shapes


@pytest.fixture(scope="module")
def ring():
    return Ring()


def flexibility(body, supports):
    b = body.interface_dofs
    return np.linalg.inv(body.stiffness[:b, :b] + supports)


def relative(found, expected):
    scale = np.sqrt(np.abs(np.diag(expected)))
    return np.abs((found - expected) / scale / scale[:, None]).max()


@pytest.mark.parametrize("factor", [1.0, 0.05, 30.0])
def test_flexibility_of_a_loaded_node_is_that_of_the_fe_model_on_any_supports(ring, factor):
    """A is chosen on some supports; what follows for q' = q + A p on others is exact."""
    supports, (a, node, shapes) = ring.springs(factor), ring.weights(0)
    rows = node + a @ shapes
    exact = rows @ ring.solver(supports)(np.ascontiguousarray(rows.T))
    found = flexibility(ring.loaded, supports)[:6, :6]
    assert relative(found, exact) < 1e-5


def test_shape_loads_do_not_move_a_loaded_node(ring):
    a, node, shapes = ring.weights(7)
    moved = ring.solver(ring.supports)(np.ascontiguousarray(shapes.T))
    plain, loaded = node @ moved, (node + a @ shapes) @ moved
    assert np.abs(loaded).max() < 0.02 * np.abs(plain).max()


def test_loads_at_the_ends_of_a_tooth_move_its_node_as_their_wrench_does(ring):
    """Line loads that no shape was made from; a tooth between two bolts and one over a bolt."""
    worst = {"plain": 0.0, "loaded": 0.0}
    solve = ring.solver(ring.supports)
    held = {
        k: flexibility(b, ring.supports) for k, b in (("plain", ring.body), ("loaded", ring.loaded))
    }
    for j in (0, 2):
        a, node, shapes = ring.weights(j)
        rows = {"plain": node, "loaded": node + a @ shapes}
        for load in probe_loads.tooth_lines(ring.model, [j], WIDTH):
            wrench = load.wrench(ring.interface.positions[j])
            moved = solve(load.sample.load(load.forces)[:, None])[:, 0]
            at = slice(6 * j, 6 * j + 6)
            for kind in held:
                exact = (rows[kind] @ moved)[:3]
                found = (held[kind][at, at] @ wrench)[:3]
                error = np.linalg.norm(found - exact) / np.linalg.norm(exact)
                worst[kind] = max(worst[kind], error)
    assert worst["plain"] > 0.02
    assert worst["loaded"] < 0.7 * worst["plain"]


def test_the_estimate_is_that_error(ring):
    loads = probe_loads.tooth_lines(ring.model, [0, 2], WIDTH)
    body = probed(ring.reduction, loads, ring.patches).with_(patches=ring.body.patches)
    errors = static_errors(body, ring.supports)
    a, node, shapes = ring.weights(2)
    load = next(x for x in loads if x.node == "tooth_003" and x.case == "tip end +z")
    moved = ring.solver(ring.supports)(load.sample.load(load.forces)[:, None])[:, 0]
    exact = ((node + a @ shapes) @ moved)[:3]
    wrench = load.wrench(ring.interface.positions[2])
    found = (flexibility(ring.loaded, ring.supports)[12:18, 12:18] @ wrench)[:3]
    error = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    one = body.with_(
        probe_cases=(("tooth_003", "tip end +z"),),
        probe_loads=body.probe_loads[:, :, [loads.index(load)]],
        probe_shapes=body.probe_shapes[:, [loads.index(load)]],
    )
    assert static_errors(one, ring.supports)["tip end +z"] == pytest.approx(error, rel=0.05)
    assert errors["tip end +z"] >= error * 0.95


def test_rigid_motion_and_means_of_patches(ring):
    """Rigid motion makes no force and has the mass of the plain body; what the nodes are tied to
    moves as in the plain body under the same loads, as far as it is rigid."""
    rigid, body = ring.body.rigid_modes(), ring.loaded
    force = body.stiffness @ rigid
    assert np.abs(force).max() < 1e-7 * np.abs(body.stiffness).max()
    expected = rigid.T @ ring.body.mass @ rigid
    assert rigid.T @ body.mass @ rigid == pytest.approx(
        expected, rel=1e-6, abs=1e-6 * expected.max()
    )
    assert body.inner @ rigid == pytest.approx(rigid, abs=1e-6)
    field = body.recover(rigid[:, 5])
    x, y = body.points[:, 0], body.points[:, 1]
    assert field == pytest.approx(np.stack([-y, x, 0 * x], axis=1), abs=1e-9)


def test_fields_are_those_of_the_plain_body(ring):
    """What a force on a bolt does is the same in both coordinates; it loads no tooth."""
    b = ring.interface.size
    force = np.zeros(b)
    force[6 * TEETH] = 1.0
    plain, loaded = (
        body.recover(np.append(flexibility(body, ring.supports) @ force, np.zeros(body.n_modes)))
        for body in (ring.body, ring.loaded)
    )
    assert loaded == pytest.approx(plain, rel=1e-4, abs=1e-5 * np.abs(plain).max())


def test_a_free_body_keeps_its_plain_nodes(ring):
    assert ring.body.on_loaded_patches(0.0 * ring.supports) is ring.body
