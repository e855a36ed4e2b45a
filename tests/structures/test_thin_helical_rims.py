"""Rings with thin rims whose helix turns by many teeth over the face, as of marine gears: their FE
meshes, and flexibility and frequencies of their reduced bodies."""

from dataclasses import replace
from math import pi, radians, sin

import numpy as np
import pytest
import scipy.linalg as sla

from flexgear.structures.fe_mesh.gears import RingFeMeshParameters, ring_fe_mesh
from flexgear.structures.fe_mesh.solids import ring_solid, solid_of_fe_mesh
from flexgear.structures.fem.assembly import FeModel, facet_sample
from flexgear.structures.fem.ties import averaging_tie, interface_of
from flexgear.structures.reduction import reduce

STEEL = (210e9, 0.3, 7850.0)
TEETH, MODULE, HELIX = 30, 8e-3, radians(25.0)
FIDELITIES = ("quick", "standard", "fine")


def ring(rim_modules, overlap, **changes):
    """A rim of so many modules; overlap: b sin β/(π m_n)."""
    width = overlap * pi * MODULE / sin(HELIX)
    values = {
        "teeth": TEETH, "normal_module": MODULE, "helix_angle": HELIX, "addendum": 0.8,
        "root_fillet": 0.3, "face_width": width, "rim_thickness": rim_modules * MODULE, "bolts": 0,
        "fits": ((-width / 2, -width / 4), (width / 4, width / 2)), "fidelity": "standard",
    }  # fmt: skip
    return RingFeMeshParameters(**(values | changes))


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize(("rim", "overlap"), [(1.2, 4.5), (2.0, 7.0), (3.0, 4.0)])
def test_cells_are_sound_and_fill_the_body(rim, overlap, hand):
    """The solid of the closed form, whose section the helix only turns."""
    p = ring(rim, overlap, hand=hand)
    expected = ring_solid(p)
    errors = []
    for fidelity in FIDELITIES:
        fe_mesh = ring_fe_mesh(replace(p, fidelity=fidelity))
        assert fe_mesh.quality() > 0.2
        solid = solid_of_fe_mesh(fe_mesh)
        second = np.abs(solid.second - expected.second).max() / np.abs(expected.second).max()
        errors.append(max(abs(solid.volume / expected.volume - 1.0), second))
    assert max(errors) < 0.02
    assert errors[2] < min(2e-3, 0.5 * errors[0])


def test_bolts_without_holes_let_the_rim_be_thin():
    """Bolts in a rim of 2.5 modules: the helix need not fade before their circle."""
    p = ring(2.5, 4.5)
    circle = 2 * (p.outer_radius - 1.25 * MODULE)
    bolted = replace(p, bolts=24, bolt_circle_diameter=circle, bolt_diameter=6e-3)
    assert np.array_equal(ring_fe_mesh(bolted).points, ring_fe_mesh(p).points)


def test_the_mesh_becomes_that_of_a_spur_gear():
    spur, slight = (
        ring_fe_mesh(ring(1.5, 4.5, helix_angle=beta, face_width=0.2, fits=()))
        for beta in (0.0, 1e-6)
    )
    assert np.array_equal(spur.cells, slight.cells)
    assert np.abs(spur.points - slight.points).max() < 1e-6 * 0.2


def static_and_frequencies(p):
    """Flexibility of a tooth (6, 6) and the lowest frequencies of a ring on springs at its fits."""
    model = FeModel(ring_fe_mesh(p), *STEEL)
    patches, radius = model.fe_mesh.facets, p.tooth.reference_radius
    ties = []
    for j in range(p.teeth):
        angle = j * p.tooth.pitch_angle
        place = radius * np.array([np.cos(angle), np.sin(angle), 0.0])
        sample = facet_sample(model, patches[f"tooth_root_{j + 1:03d}"])
        ties.append(averaging_tie(f"tooth_{j + 1:03d}", place, sample))
    for name, (low, high) in p.bands:
        place = np.array([0.0, 0.0, (low + high) / 2])
        ties.append(averaging_tie(name, place, facet_sample(model, patches[name])))
    body = reduce(model, interface_of(model, ties), 8, sectors=(p.teeth,)).body
    held = np.zeros(len(body.mass))
    held[6 * p.teeth : body.interface_dofs] = np.tile([1e9, 1e9, 1e9, 1e7, 1e7, 1e7], 2)
    stiffness = body.stiffness + np.diag(held)
    b = body.interface_dofs
    values = sla.eigh(stiffness, body.mass, eigvals_only=True, subset_by_index=(0, 9))
    return np.linalg.inv(stiffness[:b, :b])[:6, :6], np.sqrt(values) / (2 * pi)


@pytest.mark.slow
def test_flexibility_and_frequencies_converge():
    results = [static_and_frequencies(ring(2.0, 1.5, fidelity=f)) for f in FIDELITIES]
    finest, last = results[-1]
    scale = np.sqrt(np.diag(finest))
    errors = [np.abs((a - finest) / scale / scale[:, None]).max() for a, _ in results[:-1]]
    lower = [np.abs(f / last - 1).max() for _, f in results[:-1]]
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 0.02
    assert lower[1] < lower[0] < 0.015  # one column across a tooth is 4 % too high
    assert lower[1] < 0.01
