"""Shape, symmetry and patches of the FE meshes of ring and planet."""

from dataclasses import replace
from math import cos, pi, sin, tan

import numpy as np
import pytest
from scipy.spatial import cKDTree

from flexgear.gears.tool import PlainTool
from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh.fe_mesh import FeMesh, facet_areas
from flexgear.structures.fe_mesh.gears import (
    PlanetFeMeshParameters,
    RingFeMeshParameters,
    layer_positions,
    planet_fe_mesh,
    ring_fe_mesh,
)
from flexgear.structures.fe_mesh.solids import planet_solid, solid_of_fe_mesh

from .small_bodies import small_ring, wind_planet, wind_ring

MESHED = {RingFeMeshParameters: ring_fe_mesh, PlanetFeMeshParameters: planet_fe_mesh}
SMALL_PLANET = PlanetFeMeshParameters(
    teeth=33, normal_module=0.01, helix_angle=0.14, face_width=0.1, bore_diameter=0.2
)


def meshed(p: RingFeMeshParameters | PlanetFeMeshParameters) -> FeMesh:
    return MESHED[type(p)](p)


@pytest.fixture(scope="module")
def plain() -> FeMesh:
    return ring_fe_mesh(small_ring())


@pytest.fixture(scope="module")
def planet() -> FeMesh:
    return planet_fe_mesh(SMALL_PLANET)


@pytest.fixture(scope="module")
def holed() -> FeMesh:
    return ring_fe_mesh(small_ring(bolt_holes=True, first_bolt_angle=0.1))


def polar(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.hypot(points[..., 0], points[..., 1]), np.arctan2(points[..., 1], points[..., 0])


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = cos(angle), sin(angle)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("body", [small_ring(), replace(SMALL_PLANET, profile_shift=0.2)])
@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("side", ["flank", "backflank"])
def test_flank_nodes_lie_on_the_involute_turned_by_the_helix(hand, side, body) -> None:
    p, j = replace(body, hand=hand), 7
    m, outward = meshed(p), -1.0 if p.part == "ring" else 1.0
    at = m.points[np.unique(m.facets[f"tooth_{side}_{j + 1:03d}"])]
    r, theta = polar(at)
    # φ(z) = 2πj/z + κ z ∓ δ(r): inv α written out from the definition, not from gears.tooth
    alpha_t = np.arctan(tan(p.pressure_angle) / cos(p.helix_angle))
    r_ref = p.teeth * p.normal_module / cos(p.helix_angle) / 2.0
    alpha = np.arccos(r_ref * cos(alpha_t) / r)
    thickness = pi / 2 + 2 * p.profile_shift * tan(p.pressure_angle)
    half = thickness / p.teeth - outward * ((np.tan(alpha) - alpha) - (tan(alpha_t) - alpha_t))
    sign = 1.0 if hand == "right" else -1.0
    expected = 2 * pi * j / p.teeth + sign * tan(p.helix_angle) / r_ref * at[:, 2]
    expected += -half if side == "flank" else half
    assert np.abs(r * (theta - expected)).max() < 1e-12
    tip = r_ref + outward * (p.addendum + p.profile_shift) * p.normal_module
    ends = (tip, p.tooth.form_radius)
    assert (r.min(), r.max()) == pytest.approx((min(ends), max(ends)))


def test_nodes_of_a_tooth_lie_on_flank_and_root() -> None:
    """Every node of the surface between tip and root circle, at mid-face."""
    p = small_ring(fidelity="fine", helix_angle=0.0)
    m, t = ring_fe_mesh(p), p.tooth
    outside = {tuple(sorted(q)) for q in m.boundary}
    ends = {tuple(sorted(q)) for name in ("end_minus", "end_plus") for q in m.facets[name]}
    nodes = m.points[np.unique([node for facet in outside - ends for node in facet])]
    radius, angle = np.hypot(nodes[:, 0], nodes[:, 1]), np.arctan2(nodes[:, 1], nodes[:, 0])
    angle = np.abs((angle + t.pitch_angle / 2) % t.pitch_angle - t.pitch_angle / 2)
    between = (radius > t.tip_radius * (1 + 1e-9)) & (radius < t.root_radius * (1 - 1e-6))
    assert (radius[between] > t.form_radius).any() and (radius[between] < t.form_radius).any()
    assert angle[between] == pytest.approx(t.root.half_angle(radius[between]), abs=1e-9)


def test_planet_has_the_volume_and_moments_of_the_closed_form() -> None:
    """Chords of flanks, tips and bore lose O(h²)."""
    p = wind_planet()
    solid, errors = planet_solid(p), []
    for fidelity in ("quick", "standard", "fine"):
        of_mesh = solid_of_fe_mesh(planet_fe_mesh(replace(p, fidelity=fidelity)))
        assert np.abs(of_mesh.first).max() < 1e-14
        errors.append(abs(of_mesh.volume / solid.volume - 1.0))
        assert of_mesh.second == pytest.approx(solid.second, rel=2e-2, abs=1e-12)
    assert errors[0] < 1e-2
    assert errors[1] < 5e-3
    assert errors[2] < 3e-3


FITS = {"fit_1", "fit_2", "outer"}


@pytest.mark.parametrize(
    ("name", "teeth", "others"),
    [
        ("plain", 36, FITS),
        ("holed", 36, FITS | {f"bolt_{k:02d}" for k in range(1, 6)}),
        ("planet", 33, {"bore"}),
    ],
)
def test_every_patch_is_there_and_cells_are_well_shaped(request, name, teeth, others) -> None:
    m, kinds = request.getfixturevalue(name), ("flank", "backflank", "root")
    names = {f"tooth_{k}_{j:03d}" for k in kinds for j in range(1, teeth + 1)}
    assert set(m.facets) == names | others | {"end_minus", "end_plus"}
    assert m.quality() > 0.3


@pytest.mark.parametrize(("name", "teeth"), [("plain", 36), ("planet", 33)])
def test_teeth_and_patches_repeat_under_exact_rotation(request, name: str, teeth: int) -> None:
    m = request.getfixturevalue(name)
    distance, image = cKDTree(m.points).query(turned(m.points, 2 * pi / teeth))
    assert distance.max() < 1e-14
    for kind in ("flank", "backflank", "root"):
        this, following = (m.facets[f"tooth_{kind}_{j:03d}"] for j in (5, 6))
        np.testing.assert_array_equal(image[this], following)
        areas = [
            facet_areas(m.points, m.facets[f"tooth_{kind}_{j:03d}"]).sum()
            for j in range(1, teeth + 1)
        ]
        np.testing.assert_allclose(areas, areas[0], rtol=1e-12)


def test_other_hand_is_the_mirror_image() -> None:
    a, b = (ring_fe_mesh(small_ring(hand=hand)) for hand in ("right", "left"))
    distance, _ = cKDTree(a.points).query(b.points * [1.0, 1.0, -1.0])
    assert distance.max() < 1e-14


def test_root_patch_is_symmetric_about_the_tooth_and_lies_inside() -> None:
    m = ring_fe_mesh(small_ring(helix_angle=0.0, fidelity="standard"))
    ids = m.facets["tooth_root_001"]
    at = m.points[np.unique(ids)]
    distance, _ = cKDTree(at).query(at * [1.0, -1.0, 1.0])
    assert distance.max() < 1e-15
    surface = set(map(tuple, np.sort(m.boundary, axis=1)))
    assert surface.isdisjoint(map(tuple, np.sort(ids, axis=1)))


@pytest.mark.parametrize("name", ["holed", "planet"])
def test_surface_patches_look_outward(request, name: str) -> None:
    def from_smallest(facets: np.ndarray) -> set[tuple[int, ...]]:
        return {tuple(np.roll(f, -int(np.argmin(f))).tolist()) for f in facets}

    m = request.getfixturevalue(name)
    surface = from_smallest(m.boundary)
    for patch, facets in m.facets.items():
        inside = patch.startswith("tooth_root")
        assert (
            surface.isdisjoint(from_smallest(facets))
            if inside
            else (from_smallest(facets) <= surface)
        ), patch


def test_bolt_holes_are_straight_round_and_on_their_axes(holed: FeMesh) -> None:
    p = small_ring(bolt_holes=True, first_bolt_angle=0.1)
    for k in range(5):
        at = holed.points[np.unique(holed.facets[f"bolt_{k + 1:02d}"])]
        angle = 0.1 + 2 * pi * k / 5
        axis = p.bolt_circle_diameter / 2 * np.array([cos(angle), sin(angle)])
        off = np.linalg.norm(at[:, :2] - axis, axis=1)
        assert np.abs(off - p.bolt_diameter / 2).max() < 1e-14
        bottom, top = (at[np.isclose(at[:, 2], z)] for z in (-0.05, 0.05))
        distance, _ = cKDTree(bottom[:, :2]).query(top[:, :2])
        assert distance.max() < 1e-15


def holes_of(teeth: int, bolts: int) -> RingFeMeshParameters:
    return small_ring(
        teeth=teeth, normal_module=0.36 / teeth, rim_thickness=0.07, bolts=bolts, bolt_holes=True,
        bolt_circle_diameter=0.45,
    )  # fmt: skip


def half_a_column_off(first_angle: float) -> RingFeMeshParameters:
    """Thick holes that lie beside the middle of their block of columns."""
    options = {"first_bolt_angle": first_angle, "fidelity": "standard"}
    return small_ring(bolt_holes=True, bolt_diameter=0.02, **options)


@pytest.mark.parametrize(
    ("least", "body"),
    [
        *((0.25, holes_of(*numbers)) for numbers in ((40, 7), (50, 12), (93, 25))),
        *((0.25, half_a_column_off(angle)) for angle in np.linspace(0.0, 2 * pi / 72, 3)),
        *((0.3, wind_ring(fidelity="quick", rim_thickness=t)) for t in (0.15, 0.16, 0.3)),
        *(
            (0.3, wind_planet(bore_diameter=bore, fidelity=fidelity))
            for bore, fidelity in ((0.02, "fine"), (0.2, "standard"), (0.5, "quick"))
        ),
    ],
)
def test_cells_are_well_shaped(least, body) -> None:
    assert meshed(body).quality() > least


def test_standard_ring_has_the_promised_size() -> None:
    m = ring_fe_mesh(wind_ring())
    assert 100_000 < m.quadratic_dofs < 140_000
    assert m.quality() > 0.3


def test_layers_follow_the_bands_and_the_number_that_is_asked_for() -> None:
    z = layer_positions(0.43, ((-0.215, -0.155), (0.155, 0.215)), 4)
    np.testing.assert_allclose(z, [-0.215, -0.155, 0.0, 0.155, 0.215], atol=1e-15)
    np.testing.assert_allclose(layer_positions(0.4, (), 4), [-0.2, -0.1, 0.0, 0.1, 0.2], atol=1e-15)


RING, PLANET = small_ring(), wind_planet()


@pytest.mark.parametrize(
    ("body", "changes", "key"),
    [
        (RING, {"teeth": 20}, "addendum"),
        (RING, {"root_fillet": 0.4, "dedendum": 2.4}, "dedendum"),
        (RING, {"tool": PlainTool(teeth=36)}, "tool.teeth"),
        (RING, {"rim_thickness": 0.001}, "rim_thickness"),
        (RING, {"bolt_circle_diameter": 0.3}, "bolts.circle_diameter"),
        (RING, {"bolt_circle_diameter": 0.51}, "bolts.circle_diameter"),
        (RING, {"bolts": 120}, "bolts.number"),
        (RING, {"bolts": 50, "bolt_holes": True}, "bolts.number"),
        (RING, {"fits": ((0.0, 0.2),)}, "fits"),
        (
            small_ring(),
            {"helix_angle": 0.3, "face_width": 0.3, "bolt_holes": True, "fits": ()},
            "bolts.holes",
        ),
        (
            wind_planet(),
            {"bore_diameter": 0.0},
            "bore_diameter_mm: is missing",
        ),
        (
            wind_planet(),
            {"bore_diameter": 0.53},
            "bore_diameter_mm: leaves a rim of 9",
        ),
        (PLANET, {"profile_shift": 1.5, "addendum": 1.5}, "planet.addendum"),
    ],
)
def test_impossible_gears_are_refused_by_key(body, changes: dict, key: str) -> None:
    with pytest.raises(InputError) as error:
        meshed(replace(body, **changes))
    assert key in str(error.value)
    assert "\n" not in str(error.value)
