"""Slices of a pair that bend each other: both teeth on the right flank, hand and place."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.gears.slices import NominalLoad, with_flexibility
from flexgear.gears.stiffness import compliance
from flexgear.model.load import load_case
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions
from flexgear.structures.tooth_influence import of_case
from flexgear.structures.tooth_influence.influence import influence_of
from flexgear.structures.tooth_influence.of_case import pair_bending

COARSE = SegmentDivisions(flank=4, fillet=2, tooth=2, rim=2, layers=4)
SMALL = {
    "stage.face_width_mm": "144",
    "stage.gear_mesh.model": "face_load",
    "stage.gear_mesh.slices": "5",
}
TURNED = {**SMALL, "stage.planet_hand": "left"}
SPUR = {**SMALL, "stage.helix_angle_deg": "0"}


@pytest.fixture(autouse=True)
def _coarse(monkeypatch):
    """Influences of coarse segments, not kept."""
    monkeypatch.setattr(of_case, "tooth_influence", _coarse_influence)


def _coarse_influence(case, slot):
    parameters = of_case.influence_parameters(case, slot)
    return _made(replace(parameters, divisions=COARSE), of_case.is_tied(case, slot))


@lru_cache
def _made(parameters, tied):
    return influence_of(parameters, 2.1e11, 0.3, tied=tied)


def bending(changes, kind):
    """Case, force of the gear mesh, its slices, flexibility, and scale and limit of the contact."""
    case = load_case("wind-5mw", {**changes, "stage.ring.fe.fits": "[]"}).view()
    forces = power_flow(case.case).stages[0].gear_mesh_forces
    path, force = stage_paths(case, forces)[kind, ""], forces[kind.removesuffix("_coast")]
    return case, abs(force), path, pair_bending(case, path, path.slices, force)


@pytest.mark.slow
@pytest.mark.parametrize("slot", ["sun", "ring"])
def test_symmetric_definite_and_reflected(slot):
    """Coast flanks and the other hand of helix are reflections in the middle of the face."""
    _, _, path, pair = bending(SMALL, slot)
    c, scale, limit = pair.flexibility, pair.scale, pair.limit
    long = path.slices.width[:, 0] > 0.5 * path.slices.width.max()
    assert np.array_equal(c, c.swapaxes(1, 2))
    smallest, largest = np.linalg.eigvalsh(c)[:, [0, -1]].T
    assert (smallest > -1e-12 * largest).all()  # short lines are definite by their contact alone
    assert (smallest[long] > 1e-3 * largest[long]).all()
    assert (scale > 0).all() and (limit > 0).all()
    for changes, kind in ((SMALL, f"{slot}_coast"), (TURNED, slot)):
        _, _, _, other = bending(changes, kind)
        # slices are put about their centre of stiffness, which is a sum over a table
        for one, two in ((other.flexibility, c), (other.beside, pair.beside)):
            assert one == pytest.approx(two[..., ::-1, ::-1], abs=1e-4 * c.max())
        assert other.scale == pytest.approx(scale[:, ::-1], rel=1e-9)
    middle = c[len(c) // 2]
    assert np.abs(middle - middle[::-1, ::-1]).max() > 1e-3 * middle.max()  # a helix leans


@pytest.mark.slow
@pytest.mark.parametrize("slot", ["sun", "ring"])
def test_right_halves_have_the_other_hand(slot):
    """Paths of the other hand on a case's right half are those of a case of that hand."""
    case, force, *_ = bending(SMALL, slot)
    _, _, path, expected = bending(TURNED, slot)
    pair = pair_bending(case, replace(path, side="right"), path.slices, force)
    for one, two in ((pair.flexibility, expected.flexibility), (pair.beside, expected.beside)):
        assert one == pytest.approx(two, abs=1e-4 * expected.flexibility.max())


@pytest.mark.slow
def test_even_load_at_the_pitch_point_against_weber_and_banaschek():
    """A spur pair, whole face: both teeth and the contact, in 3D against plane strain."""
    case, force, path, bends = bending(SPUR, "sun")
    c, scale, limit = bends.flexibility, bends.scale, bends.limit
    g = stage_geometry(case)
    theory = compliance(case, g, "sun", force)
    s_pitch = path.base_radius_planet * np.tan(path.alpha)
    xi = (s_pitch - path.s_lo) / (path.s_hi - path.s_lo)
    width = case.stage.face_width
    # the theory's contact part is the secant at the mean line load of the whole path
    even = force / g.sun_gear_mesh.transverse_contact_ratio / 5
    at = int(np.argmin(np.abs(path.slices.s - s_pitch)))
    approach = c[at].sum(axis=1) * even + scale[at] * even * np.log(limit[at] / even)
    deflection = approach.mean() * width / (5 * even)
    assert deflection == pytest.approx(np.interp(xi, theory.xi, theory.total), rel=0.08)
    # what the contact element takes as its nominal stiffness is the tangent there
    nominal = NominalLoad(5 * even / width, path.base_pitch)
    lines = with_flexibility(path.slices, c, bends.beside, (scale, limit), nominal)
    assert lines.stiffness[at].sum() == pytest.approx(1.05 * width / deflection, rel=0.06)
    assert lines.centre[at] == pytest.approx(0.0, abs=1e-6 * width)
