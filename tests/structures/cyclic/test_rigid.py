"""Rigid motion of a sector, in its fields and in what its condensed matrices keep of it."""

import numpy as np
import pytest
from cyclic_samples import TEETH, plain_ring

from flexgear.structures.cyclic.borders import rigid_fields, with_rigid, without_rigid
from flexgear.structures.cyclic.condensation import condense_by_sectors


@pytest.fixture(scope="module")
def ring():
    model, interface = plain_ring()
    return model, condense_by_sectors(model, interface, (TEETH,))[0]


def test_rigid_fields_strain_no_sector_and_are_orthonormal_at_its_ends(ring):
    model, parts = ring
    fields = rigid_fields(model.nodes, parts.sectors)
    inside = 3 * parts.sectors.interior
    matrix = parts.fe_stiffness.extended()
    scale = abs(matrix).max() * np.abs(fields).max()
    assert np.abs((matrix @ fields)[:inside]).max() < 1e-13 * scale
    assert np.allclose(fields[inside:].T @ fields[inside:], np.eye(6), atol=1e-12)


def sector(b=12, seed=0):
    """Stiffness (2b, 2b) of a free sector and its rigid motion, alike at both borders."""
    random = np.random.default_rng(seed)
    shape = random.standard_normal((b, 6))
    rigid = np.linalg.qr(np.vstack([shape, shape @ random.standard_normal((6, 6))]))[0]
    stiffness = random.standard_normal((2 * b, 2 * b))
    stiffness = stiffness @ stiffness.T
    free = np.eye(2 * b) - rigid @ rigid.T
    return free @ stiffness @ free, rigid


def test_stiffness_that_has_rigid_motion_is_kept_and_rounding_leaves_it():
    exact, rigid = sector()
    noise = np.random.default_rng(1).standard_normal(exact.shape)
    found = without_rigid(exact + 1e-9 * (noise + noise.T), rigid)
    assert np.abs(found @ rigid).max() < 1e-13 * np.abs(exact).max()
    assert np.abs(found - exact).max() < 1e-7 * np.abs(exact).max()


def test_only_the_sum_of_what_neighbours_add_at_a_border_counts():
    exact, rigid = sector()
    b = len(exact) // 2
    moved = np.random.default_rng(1).standard_normal((b, b))
    moved = moved + moved.T
    shifted = exact.copy()
    shifted[:b, :b] += moved
    shifted[b:, b:] -= moved
    found = without_rigid(shifted, rigid)
    scale = np.abs(exact).max()
    assert np.abs(found[:b, b:] - exact[:b, b:]).max() < 1e-11 * scale
    both = exact[:b, :b] + exact[b:, b:]
    assert np.abs(found[:b, :b] + found[b:, b:] - both).max() < 1e-11 * scale


def test_ties_take_their_own_rigid_motion():
    _, rigid = sector()
    random = np.random.default_rng(2)
    ties, motion = random.standard_normal((3, 24)), random.standard_normal((3, 6))
    found = with_rigid(ties, rigid, motion)
    assert np.allclose(found @ rigid, motion, atol=1e-12)
    across = np.eye(24) - rigid @ rigid.T
    assert np.allclose(found @ across, ties @ across, atol=1e-12)
