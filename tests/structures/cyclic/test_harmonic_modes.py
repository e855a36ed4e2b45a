"""Modes harmonic by harmonic against dense algebra and against the iteration of whole fields."""

import numpy as np
import pytest
from cyclic_samples import STEEL, TEETH, plain_ring, ring_ties
from plain_meshes import annulus
from scipy.sparse import diags_array
from scipy.sparse.linalg import eigsh

from flexgear.structures.cyclic.condensation import condense_by_sectors
from flexgear.structures.cyclic.harmonic_modes import harmonic_modes
from flexgear.structures.cyclic.modes import cyclic_modes
from flexgear.structures.fem.assembly import FeModel, disc_points, point_sample
from flexgear.structures.fem.ties import averaging_tie, interface_of
from flexgear.structures.frequency_check import compare_frequencies
from flexgear.structures.reduction import reduce

pytestmark = pytest.mark.usefixtures("one_thread")


def bolted(teeth, bolts, axial=2):
    """A ring with a tie at every tooth, one on its axis, and equally spaced bolts."""
    model = FeModel(annulus((2 * teeth, 1, axial), teeth=teeth), *STEEL)
    ties = ring_ties(model, teeth, 0.7, 0.88, 0.15)[:-2]
    for k in range(bolts):
        angle = 2 * np.pi * (k + 0.3) / bolts
        centre = np.array([0.88 * np.cos(angle), 0.88 * np.sin(angle), 0.15])
        discs = point_sample(model, *disc_points(centre, 0.06))
        ties.append(averaging_tie(f"bolt_{k + 1}", centre, discs))
    return model, interface_of(model, ties)


@pytest.mark.parametrize(("count", "axial"), [(1, 4), (7, 4), (30, 4), (60, 6)])
def test_modes_are_those_of_the_whole_body(count, axial):
    """Frequencies; vectors are normalised, held at the ties and satisfy the equations."""
    model, interface = bolted(TEETH, 0, axial)
    whole = reduce(model, interface, count).body.stiffness.diagonal()[interface.size :]
    parts, _ = condense_by_sectors(model, interface, (TEETH,))
    shares = []
    modes = harmonic_modes(parts, len(whole), shares.append)
    assert shares[-1] == 1.0 and shares == sorted(shares)
    assert np.allclose(modes.omega**2, whole, rtol=1e-9)
    x = np.ascontiguousarray(modes.vectors)
    assert np.abs(x.T @ parts.mass_product(x) - np.eye(len(whole))).max() < 1e-10
    assert np.abs(parts.interface_motion(x)).max() < 1e-9 * np.abs(x).max()
    strain = x.T @ parts.stiffness_product(x) / np.outer(modes.omega, modes.omega)
    assert np.abs(strain - np.eye(len(whole))).max() < 1e-7


def test_bolts_that_no_sector_has_need_whole_fields():
    model, interface = plain_ring()
    parts, _ = condense_by_sectors(model, interface, (TEETH,))
    assert not parts.ties.invariant


def test_sectors_are_as_many_as_teeth_and_bolts_have_in_common():
    """But not few: they would be large."""
    for bolts, sectors in ((8, 8), (16, 8), (6, 24), (0, 24), (24, 24)):
        model, interface = bolted(24, bolts)
        parts, path = condense_by_sectors(model, interface, (24, 12, 8, 6, 4, 3))
        assert parts.sectors.count == sectors and path.startswith(f"cyclic: {sectors} sectors")
        assert parts.ties.invariant == (bolts != 6)
        lowest = cyclic_modes(parts, 12, lambda _: None)
        expected = reduce(model, interface, 12).body.stiffness.diagonal()[interface.size :][:12]
        assert np.allclose(lowest.omega**2, expected, rtol=1e-8)


@pytest.mark.parametrize("last_bolt", [1.0, 0.3], ids=["alike", "one soft bolt"])
def test_frequency_check_knows_the_frequencies_of_the_unreduced_body(last_bolt):
    """Harmonic by harmonic with bolts alike, and on whole fields with a soft one. Few modes, so
    that the reduced body is wrong by per cents."""
    model, interface = bolted(24, 8)
    reduction = reduce(model, interface, 8, sectors=(24, 12, 8))
    assert reduction.condensation.ties.invariant
    spring = np.repeat([1e9, 1e6], 3)
    supports = np.zeros(interface.size)
    for bolt in range(1, 9):
        at = 6 * interface.node_names.index(f"bolt_{bolt}")
        supports[at : at + 6] = spring * (last_bolt if bolt == 8 else 1.0)
    comparison = compare_frequencies(reduction, np.diag(supports), 1900.0)
    k = model.stiffness + interface.rows.T @ diags_array(supports) @ interface.rows
    values = eigsh(k.tocsc(), 40, model.mass.tocsc(), sigma=0, return_eigenvectors=False)
    exact = np.sort(np.sqrt(values)) / (2 * np.pi)
    exact = exact[exact < 1900.0]
    assert len(exact) > 16 and comparison.errors.max() > 0.01
    assert comparison.full == pytest.approx(exact, rel=2e-4)


def test_a_sector_of_few_dofs_is_left_to_whole_fields():
    """All modes of some harmonics are among those that are sought."""
    model, interface = bolted(TEETH, 0)
    parts, _ = condense_by_sectors(model, interface, (TEETH,))
    count = parts.dofs // 5 - 1
    assert harmonic_modes(parts, 3 * count, lambda _: None) is None
    lowest = cyclic_modes(parts, count, lambda _: None)
    expected = reduce(model, interface, count).body.stiffness.diagonal()[interface.size :]
    assert np.allclose(lowest.omega[:count] ** 2, expected[:count], rtol=1e-8)
