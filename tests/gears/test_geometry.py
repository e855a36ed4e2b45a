"""Closed forms of stage geometry, and what is refused."""

import math

import numpy as np
import pytest
from gears.stages import flexible_paths
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgear.gears.contact import assembly_mismatch
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.tooth import inverse_involute, involute
from flexgear.model.errors import InputError
from flexgear.model.load import load_case


@pytest.fixture(scope="module")
def case():
    return load_case("wind-5mw").view()


def test_centre_distance_and_diameters_of_the_bundled_stage(case):
    g = stage_geometry(case)
    assert g.center_distance == pytest.approx(0.54466, abs=5e-6)
    assert g.center_distance == pytest.approx(30 * 0.018 / math.cos(math.radians(7.5)))
    assert g.assembly == 24
    assert g.ring.reference_radius == pytest.approx(0.84422, abs=5e-6)
    assert g.planet.tip_radius - g.planet.reference_radius == pytest.approx(0.018)
    assert g.ring.reference_radius - g.ring.tip_radius == pytest.approx(0.018)
    assert g.ring.root_radius - g.ring.reference_radius == pytest.approx(1.25 * 0.018)
    assert g.planet_clearance > 0


def test_contact_ratios(case):
    """ε_α from tip circles, ε_β = b sinβ/(π m_n); the ring has between two and three pairs."""
    g = stage_geometry(case)
    at, pb = g.transverse_angle, g.ring_mesh.base_pitch
    alpha_p = math.acos(g.planet.base_radius / g.planet.tip_radius)
    alpha_s = math.acos(g.sun.base_radius / g.sun.tip_radius)
    classic = (
        27 * (math.tan(alpha_s) - math.tan(at)) + 33 * (math.tan(alpha_p) - math.tan(at))
    ) / (2 * math.pi)
    assert g.sun_mesh.transverse_contact_ratio == pytest.approx(classic)
    assert pb == pytest.approx(math.pi * 0.018 / math.cos(math.radians(7.5)) * math.cos(at))
    overlap = 0.43 * math.sin(math.radians(7.5)) / (math.pi * 0.018)
    assert g.ring_mesh.overlap_ratio == pytest.approx(overlap)
    assert 2 < g.ring_mesh.total_contact_ratio < 3
    assert 2 < g.sun_mesh.total_contact_ratio < 3


def test_speeds_torques_and_forces(case):
    k, g = power_flow(case.case).stages[0], stage_geometry(case)
    assert k.carrier_speed * 30 / math.pi == pytest.approx(11.27)
    assert k.sun_speed / k.carrier_speed == pytest.approx(120 / 27)
    assert k.gear_mesh_frequency == pytest.approx(93 * 11.27 / 60)
    assert -k.sun_torque == pytest.approx(4e6 * 27 / 120)
    assert k.ring_torque + k.sun_torque == pytest.approx(-4e6)
    force = 4e6 * 93 / 120 / (5 * g.ring.base_radius * math.cos(g.base_helix_angle))
    assert k.ring_gear_mesh_force == pytest.approx(force)
    assert k.ring_gear_mesh_force == pytest.approx(788.28e3, rel=1e-4)
    assert k.sun_gear_mesh_force == pytest.approx(
        k.ring_gear_mesh_force
    )  # a planet carries no torque


@given(st.floats(0.0, 1.0))
def test_inverse_involute(angle):
    assert inverse_involute(involute(angle)) == pytest.approx(angle, abs=2e-6)


@settings(max_examples=60, deadline=None)
@given(
    planets=st.integers(2, 5),
    sun=st.integers(18, 60),
    planet=st.integers(18, 60),
    helix=st.floats(0.0, 20.0),
    module=st.floats(1.0, 25.0),
    width=st.floats(3.0, 30.0),
    hand=st.sampled_from(["right", "left"]),
)
def test_any_unshifted_stage_is_consistent(planets, sun, planet, helix, module, width, hand):
    """Equal centre distances, no play by itself, contact ratio as pitches on the path, assembly."""
    ring = sun + 2 * planet
    over = {
        "stage.planets": planets, "stage.sun.teeth": sun, "stage.planet.teeth": planet,
        "stage.ring.teeth": ring, "stage.helix_angle_deg": helix, "stage.planet_hand": hand,
        "stage.normal_module_mm": module, "stage.face_width_mm": width * module,
        "stage.ring.addendum": 0.8, "stage.sun.bore_diameter_mm": 0,
        "stage.planet.bore_diameter_mm": 0, "stage.backlash_ring_mm": 0.01 * module,
        "stage.backlash_sun_mm": 0.02 * module, "stage.ring.fe.fits": "[]",
        "stage.carrier.fe.plate_gap_m": 1,
    }  # fmt: skip
    case = load_case("wind-5mw", {k: str(v) for k, v in over.items()}).view()
    reach = (planet + 2 * math.cos(math.radians(helix))) / (sun + planet)
    if planets * math.asin(min(1.0, reach)) > math.pi:
        with pytest.raises(InputError, match="collide"):
            stage_geometry(case)
        return
    g = stage_geometry(case)
    for gear_mesh, play in ((g.ring_mesh, 0.01), (g.sun_mesh, 0.02)):
        assert gear_mesh.backlash == pytest.approx(play * module * 1e-3, rel=1e-6)
        assert gear_mesh.working_angle == pytest.approx(g.transverse_angle)
        assert 1 < gear_mesh.transverse_contact_ratio < 2.6
    mismatch = abs(assembly_mismatch(g, np.array(case.stage.planet_angles))).max()
    if (sun + ring) % planets == 0:
        assert mismatch < 1e-6
        assert set(flexible_paths(case)) == {"ring", "sun", "ring_coast", "sun_coast"}
    else:
        assert mismatch > 1e-3
        with pytest.raises(InputError, match="do not assemble"):
            flexible_paths(case)


def test_profile_shift_moves_all_gears_after_iso():
    """x > 0: thicker teeth everywhere; ring tip inward. x_s + x_p = -(x_p + x_r) keeps distance."""
    plain = stage_geometry(load_case("wind-5mw").view())
    shifts = {"sun": 0.3, "planet": -0.3, "ring": 0.3}
    over = {f"stage.{g}.profile_shift": str(x) for g, x in shifts.items()}
    g = stage_geometry(load_case("wind-5mw", over).view())
    assert g.center_distance == pytest.approx(plain.center_distance)
    for name, x in shifts.items():
        a, b = getattr(plain, name), getattr(g, name)
        assert (b.thickness - a.thickness) * x > 0
        out = -1 if name == "ring" else 1
        assert b.tip_radius - a.tip_radius == pytest.approx(out * x * 0.018)
    assert g.ring_mesh.backlash == pytest.approx(0.5e-3, rel=1e-6)


@pytest.mark.parametrize(
    ("over", "words"),
    [
        ({"stage.planets": "6"}, r"stage.planets.*collide.*overlap by .* mm"),
        ({"stage.ring.profile_shift": "0.5"}, "center_distance_mm.*profile shifts"),
        ({"stage.center_distance_mm": "542.0"}, "teeth overlap by .*raise backlash"),
        ({"stage.center_distance_mm": "300"}, "center_distance_mm"),
        ({"stage.ring.addendum": "2.0"}, "interference"),
        ({"stage.planet.addendum": "1.3"}, "dedendum.*into the root"),
        (
            {"stage.planet.addendum": "0.4", "stage.sun.addendum": "0.3"},
            "contact ratio .* below 1",
        ),
    ],
)
def test_gears_that_cannot_mesh_are_refused_with_a_remedy(over, words):
    with pytest.raises(InputError, match=words) as caught:
        stage_geometry(load_case("wind-5mw", over).model_copy(update={"source": "my.toml"}).view())
    assert str(caught.value).startswith("my.toml: stage")
    assert "\n" not in str(caught.value)


def test_positions_may_be_given_in_any_order_and_turn():
    places = "[360, 648, 216, -216, 72]"
    case = load_case("wind-5mw", {"stage.planet_positions_deg": places}).view()
    plain = stage_geometry(load_case("wind-5mw").view())
    assert stage_geometry(case).planet_clearance == pytest.approx(plain.planet_clearance)
    twice = load_case("wind-5mw", {"stage.planet_positions_deg": "[0, 72, 144, 216, 576]"}).view()
    with pytest.raises(InputError, match="collide"):
        stage_geometry(twice)
