"""Shape, symmetry and patches of the planet's FE mesh."""

from dataclasses import replace
from math import cos, pi, sin, tan

import numpy as np
import pytest
from scipy.spatial import cKDTree

from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh import FeMesh, PlanetMeshParameters, planet_fe_mesh
from flexgear.structures.fe_mesh.solids import mesh_solid, planet_solid


@pytest.fixture(scope="module")
def planet() -> FeMesh:
    return planet_fe_mesh(PlanetMeshParameters())


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("side", ["flank", "backflank"])
def test_flank_nodes_lie_on_the_involute_turned_by_the_helix(hand: str, side: str) -> None:
    p = PlanetMeshParameters(hand=hand, profile_shift=0.2)
    m, j = planet_fe_mesh(p), 7
    at = m.points[np.unique(m.facets[f"tooth_{side}_{j + 1:03d}"])]
    r, theta = np.hypot(at[:, 0], at[:, 1]), np.arctan2(at[:, 1], at[:, 0])
    # φ(z) = 2πj/z + κ z ∓ δ(r): inv α written out from the definition, not from gears.tooth
    alpha_t = np.arctan(tan(p.pressure_angle) / cos(p.helix_angle))
    r_ref = p.teeth * p.normal_module / cos(p.helix_angle) / 2.0
    alpha = np.arccos(r_ref * cos(alpha_t) / r)
    thickness = pi / 2 + 2 * p.profile_shift * tan(p.pressure_angle)
    half = thickness / p.teeth - (np.tan(alpha) - alpha) + (tan(alpha_t) - alpha_t)
    sign = 1.0 if hand == "right" else -1.0
    expected = 2 * pi * j / p.teeth + sign * tan(p.helix_angle) / r_ref * at[:, 2]
    expected += -half if side == "flank" else half
    assert np.abs(r * (theta - expected)).max() < 1e-12
    assert r.max() == pytest.approx(r_ref + (p.addendum + p.profile_shift) * p.normal_module)


def test_mesh_has_the_volume_and_moments_of_the_closed_form() -> None:
    """Chords of flanks, tips and bore lose O(h²)."""
    p = PlanetMeshParameters()
    solid, errors = planet_solid(p), []
    for fidelity in ("quick", "standard", "fine"):
        meshed = mesh_solid(planet_fe_mesh(replace(p, fidelity=fidelity)))
        assert np.abs(meshed.first).max() < 1e-14
        errors.append(abs(meshed.volume / solid.volume - 1.0))
        assert meshed.second == pytest.approx(solid.second, rel=2e-2, abs=1e-12)
    assert errors[0] < 1e-2
    assert errors[1] < 5e-3
    assert errors[2] < 3e-3


def test_tiny_teeth_leave_a_plain_annulus() -> None:
    p = PlanetMeshParameters(
        teeth=180, normal_module=0.002, helix_angle=0.0, addendum=1e-3, dedendum=5e-3,
        root_fillet=1e-3, bore_diameter=0.25,
    )  # fmt: skip
    annulus = pi * (p.tooth.root_radius**2 - p.bore_radius**2) * p.face_width
    polygon = sin(2 * pi / 360) / (2 * pi / 360)
    assert planet_fe_mesh(p).volume() == pytest.approx(annulus * polygon, rel=1e-3)
    assert planet_solid(p).volume == pytest.approx(annulus, rel=1e-3)


def test_every_patch_is_there_and_points_outwards(planet: FeMesh) -> None:
    names = {f"tooth_{k}_{j:03d}" for k in ("flank", "backflank", "root") for j in range(1, 34)}
    assert set(planet.facets) == names | {"bore", "end_minus", "end_plus"}
    outside = {_from_least(facet) for facet in planet.boundary}
    for name, facets in planet.facets.items():
        inside = [_from_least(facet) not in outside for facet in facets]
        assert all(inside) if "root" in name else not any(inside), name
    area = planet.facet_areas("bore").sum()
    assert area == pytest.approx(pi * 0.42 * 0.43, rel=1e-2)
    assert planet.quality() > 0.5


def test_teeth_repeat_under_exact_rotation(planet: FeMesh) -> None:
    c, s = cos(2 * pi / 33), sin(2 * pi / 33)
    turned = planet.points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    distance, image = cKDTree(planet.points).query(turned)
    assert distance.max() < 1e-14
    for kind in ("flank", "backflank", "root"):
        this, following = (planet.facets[f"tooth_{kind}_{j:03d}"] for j in (5, 6))
        np.testing.assert_array_equal(image[this], following)


@pytest.mark.parametrize("bore", [0.02, 0.2, 0.5])
@pytest.mark.parametrize("fidelity", ["quick", "standard", "fine"])
def test_cells_are_well_shaped_for_thick_and_thin_rims(bore: float, fidelity: str) -> None:
    p = PlanetMeshParameters(bore_diameter=bore, fidelity=fidelity)  # type: ignore[arg-type]
    assert planet_fe_mesh(p).quality() > 0.3


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"bore_diameter": 0.0}, "stage.planet.bore_diameter_mm: is missing"),
        ({"bore_diameter": 0.53}, "stage.planet.bore_diameter_mm: leaves a rim of 9"),
        ({"profile_shift": 1.5, "addendum": 1.5}, "stage.planet.addendum"),
    ],
)
def test_impossible_planets_are_refused_by_key(changes: dict, key: str) -> None:
    with pytest.raises(InputError) as error:
        planet_fe_mesh(PlanetMeshParameters(**changes))
    assert key in str(error.value)


def _from_least(facet: np.ndarray) -> tuple[int, ...]:
    """The facet begun at its smallest vertex, in the same sense."""
    return tuple(np.roll(facet, -int(np.argmin(facet))).tolist())
