"""Segments of a few teeth: true profile, patches on the surface, the ring's own base section."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from flexgear.gears.tooth import ToothGeometry, tooth_geometry
from flexgear.model.errors import FlexgearError
from flexgear.structures.fe_mesh.gears import RingFeMeshParameters, ring_fe_mesh
from flexgear.structures.fe_mesh.tooth_segment import (
    SegmentDivisions,
    SegmentParameters,
    tooth_segment,
)

RACK = RingFeMeshParameters(
    teeth=60, normal_module=6e-3, helix_angle=0.2, face_width=0.05, rim_thickness=0.02
)
DIVISIONS = SegmentDivisions(flank=4, fillet=3, layers=2)
GEARS = {  # teeth, internal, profile shift; 17 teeth have a radial flank below the base circle
    "sun": (17, False, 0.3),
    "planet": (40, False, 0.0),
    "ring": (97, True, 0.1),
    "few": (14, False, 0.5),
}


def tooth_of(name: str) -> ToothGeometry:
    teeth, internal, shift = GEARS[name]
    return tooth_geometry(replace(RACK, teeth=teeth, profile_shift=shift), RACK, internal=internal)


def parameters(name: str, **options) -> SegmentParameters:
    tooth, m = tooth_of(name), RACK.normal_module
    held = tooth.root_radius - tooth.outward * 2.5 * m
    return SegmentParameters(
        tooth, 8 * m, 2.0, held, 0.15 * m, **{"divisions": DIVISIONS, **options}
    )


def facet_normals(points, facets):
    at = points[facets]
    return np.cross(at[:, 2] - at[:, 0], at[:, 3] - at[:, 1])


@pytest.mark.parametrize("name", GEARS)
def test_patches_cover_the_surface_with_outward_normals(name):
    segment = tooth_segment(parameters(name, margin=0.8))
    fe_mesh = segment.fe_mesh
    assert fe_mesh.quality() > 0.3
    surface = {tuple(sorted(ids)): ids for ids in fe_mesh.boundary}
    for patch, facets in fe_mesh.facets.items():
        if "root" in patch:
            continue
        outward = np.array([surface[tuple(sorted(ids))] for ids in facets])
        same = facet_normals(fe_mesh.points, facets) * facet_normals(fe_mesh.points, outward)
        assert (same.sum(axis=1) > 0).all(), patch


@pytest.mark.parametrize("name", GEARS)
def test_flank_is_the_involute_and_the_layer_has_its_depth(name):
    p = parameters(name, divisions=replace(DIVISIONS, flank=10))
    segment = tooth_segment(p)
    tooth, points = p.tooth, segment.fe_mesh.points
    for j in range(p.teeth):
        at = points[segment.flank_nodes[j]]  # (rows, layers, 3)
        radius = np.hypot(at[..., 0], at[..., 1])
        middle = (j - p.middle) * tooth.pitch_angle + p.helix_rate * segment.z
        angle = np.arctan2(at[..., 1], at[..., 0]) - middle
        assert angle == pytest.approx(-tooth.half_angle(radius), abs=1e-12)
        assert np.hypot(tooth.base_radius, segment.roll) == pytest.approx(radius[:, 0], rel=1e-12)
    flank = points[segment.flank_nodes[p.middle][:, 0], :2]
    inner = points[segment.inner_nodes[p.middle][:, 0], :2]
    thick = 2 * tooth.half_angle(np.hypot(tooth.base_radius, segment.roll)) * tooth.base_radius
    full = thick > 3 * p.flank_layer  # not at a pointed tip
    assert segment.depth[full] == pytest.approx(p.flank_layer, rel=0.15)
    for start, end in itertools.pairwise(inner[: len(segment.roll)]):
        middle, along = (start + end) / 2, (end - start) / np.linalg.norm(end - start)
        off = flank - middle
        nearest = np.argmin(np.linalg.norm(off, axis=1))
        normal = abs(off[nearest, 0] * along[1] - off[nearest, 1] * along[0])
        if full[nearest]:
            assert normal == pytest.approx(segment.depth[nearest], rel=0.05)


def test_half_a_turn_about_the_radial_axis_changes_nothing():
    """(x, y, z) -> (x, −y, −z): coast flanks follow from drive flanks."""
    fe_mesh = tooth_segment(parameters("planet")).fe_mesh
    turned = fe_mesh.points * np.array([1.0, -1.0, -1.0])
    order = [np.lexsort(np.round(q / 1e-9).astype(np.int64).T) for q in (fe_mesh.points, turned)]
    assert fe_mesh.points[order[0]] == pytest.approx(turned[order[1]], abs=1e-12)


def _at_mid_face(ring, points):
    """Rising angles from the tooth's middle, and radii, of the points at z = 0."""
    x, y, _ = points[np.abs(points[:, 2]) < 1e-9].T
    order = np.argsort(np.arctan2(y, x))
    return np.arctan2(y, x)[order], np.hypot(x, y)[order]


def test_a_tooth_cut_at_its_base_section_ends_where_the_ring_is_tied():
    ring = replace(RACK, teeth=97, rim_thickness=0.03, face_width=0.05, fidelity="fine")
    cut = SegmentParameters(
        ring.tooth, 0.05, ring.helix_rate, None, 1e-3, 1, replace(DIVISIONS, tooth=20, layers=6)
    )
    fe_mesh = tooth_segment(cut).fe_mesh
    whole = ring_fe_mesh(ring)
    base = fe_mesh.points[np.unique(fe_mesh.facets["held"])]
    tied = whole.points[np.unique(whole.facets["tooth_root_001"])]
    (own_angle, own_radius), (angle, radius) = (_at_mid_face(ring, p) for p in (base, tied))
    assert own_angle[[0, -1]] == pytest.approx(angle[[0, -1]], rel=1e-9)
    bow = ring.tooth.tool.tip_radius
    assert radius == pytest.approx(np.interp(angle, own_angle, own_radius), abs=1e-3 * bow)
    with_rim = tooth_segment(replace(cut, held_radius=ring.outer_radius, teeth=3)).fe_mesh
    roots = with_rim.points[np.unique(with_rim.facets["tooth_root_002"])]
    assert np.sort(roots, axis=0) == pytest.approx(np.sort(base, axis=0), abs=1e-12)


def test_impossible_tooth_segments_are_refused():
    p = parameters("planet")
    with pytest.raises(FlexgearError, match="not below"):
        tooth_segment(replace(p, held_radius=p.tooth.root_radius))
    with pytest.raises(FlexgearError, match="one tooth"):
        tooth_segment(replace(p, held_radius=None))
