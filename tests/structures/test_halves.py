"""Both halves of a double-helical ring as one body: rigid motion, mass, mirrored answers."""

import numpy as np
import pytest
from cheap_bodies import cheap_ring

from flexgear.model.names import NodeName
from flexgear.structures.bodies import rigid_motion, rigid_rows
from flexgear.structures.reduced import MIRROR, PLACE, ReducedBody, both_halves

OFFSET, MODES = 0.2, 3


@pytest.fixture(scope="module")
def half():
    """A ring of springs with three modes of its own and a field that knows rigid motion."""
    cheap = cheap_ring(9, 0.5, bolts=4, bolt_radius=0.6, bolt_z=-0.1)
    random, nodes = np.random.default_rng(3), 6 * len(cheap.node_names)
    coupling = random.normal(size=(nodes, MODES))
    mass = np.block([[cheap.mass, coupling], [coupling.T, 1e3 * np.eye(MODES)]])
    stiffness = np.zeros((nodes + MODES,) * 2)
    stiffness[:nodes, :nodes] = cheap.stiffness
    stiffness[nodes:, nodes:] = np.diag([1e9, 2e9, 3e9])
    points = random.uniform(-0.5, 0.5, size=(30, 3))
    rigid = rigid_rows(cheap.positions)
    field = random.normal(size=(90, nodes + MODES))
    field[:, :nodes] += (rigid_motion(points).reshape(-1, 6) - field[:, :nodes] @ rigid) @ (
        np.linalg.pinv(rigid)
    )
    return ReducedBody(
        name="ring", node_names=cheap.node_names, positions=cheap.positions, mass=mass,
        stiffness=stiffness, n_modes=MODES, report={}, points=points,
        cells=np.arange(24).reshape(3, 8), recovery=field.astype(np.float32),
    )  # fmt: skip


@pytest.fixture(scope="module")
def whole(half):
    return both_halves(half, OFFSET)


def mirrored(motion):
    """Of nodes one after the other, six components each."""
    return (motion.reshape(-1, 6) * MIRROR).ravel()


def coordinates(half, whole, left, right):
    """Coordinates of the whole from those of both halves, (d,)."""
    nodes = half.interface_dofs
    out = np.concatenate([left[:nodes], right[:nodes], left[nodes:], right[nodes:]])
    assert len(out) == len(whole.mass)
    return out


def test_names_say_the_half(half, whole):
    tooth = NodeName.of("tooth", 1, digits=3)
    assert tooth.of_half("left") == "tooth_left_001"
    nodes = [NodeName.parse(n) for n in ("tooth_right_012", "tooth_012", "bearing_drive")]
    assert [n.kind for n in nodes] == ["tooth", "tooth", "bearing_drive"]
    assert [(n.side, n.number) for n in nodes] == [("right", 12), ("", 12), ("", 0)]
    assert len(set(whole.node_names)) == 2 * len(half.node_names)
    for side, sign in (("left", -1.0), ("right", 1.0)):
        at = whole.positions[whole.node_names.index(f"bolt_{side}_01")]
        np.testing.assert_allclose(at, [0.6, 0.0, sign * (OFFSET + 0.1)])


def test_rigid_motion_makes_no_force_and_moves_twice_the_mass(half, whole):
    rigid = whole.rigid_modes()
    size = np.abs(whole.stiffness).max()
    assert np.abs(whole.stiffness @ rigid).max() < 1e-12 * size
    moved, half_mass = (
        rigid.T @ whole.mass @ rigid,
        half.rigid_modes().T @ half.mass @ half.rigid_modes(),
    )
    assert moved[0, 0] == pytest.approx(2 * half_mass[0, 0]) and moved[5, 5] == pytest.approx(
        2 * half_mass[5, 5]
    )
    assert moved[2, 3] == pytest.approx(0.0, abs=1e-9 * moved[3, 3])  # symmetric about z = 0
    q = rigid @ np.array([1e-3, 2e-3, -1e-3, 1e-4, 3e-4, -2e-4])
    expected = rigid_motion(whole.points) @ np.array([1e-3, 2e-3, -1e-3, 1e-4, 3e-4, -2e-4])
    np.testing.assert_allclose(whole.recover(q), expected, atol=1e-9)


def test_the_right_half_answers_as_the_image_of_the_left(half, whole):
    random = np.random.default_rng(5)
    left = random.normal(size=len(half.mass))
    nodes = half.interface_dofs
    right = np.concatenate([mirrored(left[:nodes]), left[nodes:]])
    q = coordinates(half, whole, left, right)
    for one, both in ((half.mass, whole.mass), (half.stiffness, whole.stiffness)):
        response, force = both @ q, one @ left
        image = np.concatenate([mirrored(force[:nodes]), force[nodes:]])
        expected = coordinates(half, whole, force, image)
        np.testing.assert_allclose(response, expected, atol=1e-12 * np.abs(expected).max())
    field, count = whole.recover(q), len(half.points)
    assert np.abs(field[:count]).max() > 0.1
    np.testing.assert_allclose(field[count:], field[:count] * PLACE, atol=1e-5)
    np.testing.assert_allclose(whole.points[count:], whole.points[:count] * PLACE)


def test_rows_and_products_of_the_recovery_are_those_of_the_whole_matrix(half, whole):
    """Each half has the left one's rows in its own coordinates, the right one's reflected."""
    size, count = len(half.mass), len(half.recovery)
    expected = np.zeros((2 * count, 2 * size))
    for k in range(size):
        unit, none = np.eye(size)[k], np.zeros(size)
        image = unit.copy()
        image[: half.interface_dofs] = mirrored(unit[: half.interface_dofs])
        left, right = coordinates(half, whole, unit, none), coordinates(half, whole, none, image)
        expected[:count] += np.outer(half.recovery @ unit, left)
        reflected = (half.recovery @ unit).reshape(-1, 3) * PLACE
        expected[count:] += np.outer(reflected.ravel(), right)
    np.testing.assert_allclose(whole.recovery[:], expected, rtol=1e-6)
    rows = np.array([0, 4, count - 1, count, count + 5, 2 * count - 1])
    np.testing.assert_allclose(whole.recovery[rows], expected[rows], rtol=1e-6)
    q = np.random.default_rng(1).normal(size=(2 * size, 3)).astype(np.float32)
    np.testing.assert_allclose(whole.recovery @ q, expected @ q, atol=1e-4)
