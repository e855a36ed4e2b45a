"""Closed forms of stage geometry and radii, and what is refused."""

import math

import numpy as np
import pytest
from gears.stages import flexible_paths, lin_parker, parallel, planetary, seen
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgear.gears.contact import assembly_mismatch
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import stage_radii
from flexgear.gears.tooth import involute
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
    at, pb = g.transverse_angle, g.ring_gear_mesh.base_pitch
    alpha_p = math.acos(g.planet.base_radius / g.planet.tip_radius)
    alpha_s = math.acos(g.sun.base_radius / g.sun.tip_radius)
    classic = (
        27 * (math.tan(alpha_s) - math.tan(at)) + 33 * (math.tan(alpha_p) - math.tan(at))
    ) / (2 * math.pi)
    assert g.sun_gear_mesh.transverse_contact_ratio == pytest.approx(classic)
    assert pb == pytest.approx(math.pi * 0.018 / math.cos(math.radians(7.5)) * math.cos(at))
    overlap = 0.43 * math.sin(math.radians(7.5)) / (math.pi * 0.018)
    assert g.ring_gear_mesh.overlap_ratio == pytest.approx(overlap)
    assert 2 < g.ring_gear_mesh.total_contact_ratio < 3
    assert 2 < g.sun_gear_mesh.total_contact_ratio < 3


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
    for gear_mesh, play in ((g.ring_gear_mesh, 0.01), (g.sun_gear_mesh, 0.02)):
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
    assert g.ring_gear_mesh.backlash == pytest.approx(0.5e-3, rel=1e-6)


def test_a_printed_centre_distance_without_backlash_is_accepted():
    """DTU 10 MW, stage 2: shifts of four decimals and a to a µm leave play or overlap below a µm;
    one more µm of centre distance is one more of play, 2 sin(α_w) times it."""
    shifts = {"sun": 0.2787, "planet": 0.1213, "ring": -0.0024}
    over: dict[str, object] = {f"stage.{g}.profile_shift": x for g, x in shifts.items()}
    over |= {"stage.sun.teeth": 26, "stage.planet.teeth": 41, "stage.ring.teeth": 109}
    over |= {"stage.normal_module_mm": 20, "stage.helix_angle_deg": 8, "stage.planet_hand": "left"}
    over |= {
        "stage.face_width_mm": 520,
        "stage.planets": 3,
        "stage.gear_mesh.contact_law": "linear",
    }
    over |= {"stage.backlash_sun_mm": 0, "stage.backlash_ring_mm": 0}
    for distance in (684.272, 684.273, 684.274):
        case = load_case("lin-parker", {**over, "stage.center_distance_mm": distance})
        g = stage_geometry(case.view())
        assert 0.0 <= g.sun_gear_mesh.backlash < 1e-6


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


def test_gears_too_far_apart_for_a_contact_ratio_are_told_the_missing_profile_shift():
    """inv α_w = inv α_t + 2 tan α_n Σx/Σz at the stated distance, against 0.48 + 0.669."""
    teeth, turn = 24 + 95, math.cos(math.radians(10))
    angle = math.atan(math.tan(math.radians(20)) / turn)
    distance = 0.014 * (teeth / 2 / turn + 2.0)
    working = math.acos(0.014 * teeth / 2 / turn * math.cos(angle) / distance)
    needed = (involute(working) - involute(angle)) * teeth / 2 / math.tan(math.radians(20))
    words = f"below 1, and .* backlash of .* -- add {needed - 0.48 - 0.669:.3g} to their sum"
    with pytest.raises(InputError, match=words):
        stage_geometry(seen(parallel(center_distance=distance)))


def test_positions_may_be_given_in_any_order_and_turn():
    places = "[360, 648, 216, -216, 72]"
    case = load_case("wind-5mw", {"stage.planet_positions_deg": places}).view()
    plain = stage_geometry(load_case("wind-5mw").view())
    assert stage_geometry(case).planet_clearance == pytest.approx(plain.planet_clearance)
    twice = load_case("wind-5mw", {"stage.planet_positions_deg": "[0, 72, 144, 216, 576]"}).view()
    with pytest.raises(InputError, match="collide"):
        stage_geometry(twice)


DEG = math.pi / 180


def distances(radii):
    """Centre distances at which the base circles of sun and ring have their working angles."""
    base, angles = radii.base, radii.working_angles
    sun = (base["sun"] + base["planet"]) / math.cos(angles["sun"])
    return sun, (base["ring"] - base["planet"]) / math.cos(angles["ring"])


def test_radii_of_a_plain_stage_are_those_of_its_geometry():
    stage = planetary(helix_angle=12 * DEG, planet_hand="left")
    r, g = stage_radii(seen(stage)), stage_geometry(seen(stage))
    assert r.base == pytest.approx({s: t.base_radius for s, t in g.gears.items()}, rel=1e-15)
    assert r.center_distance == pytest.approx(0.27 / math.cos(12 * DEG))
    assert r.reference["ring"] - r.reference["planet"] == pytest.approx(r.center_distance)


def test_printed_working_angles_give_the_printed_centre_distance():
    """Hu et al. 2023, stages 1 to 3: tooth numbers, modules and both working angles."""
    for teeth, module, angles, distance in (
        ((12, 30, 75), 2.5e-3, (26.24, 16.04), 55.0e-3),
        ((18, 28, 75), 2.5e-3, (22.54, 19.32), 58.5e-3),
        ((16, 23, 65), 4.0e-3, (26.07, 14.69), 81.6e-3),
    ):
        sun, planet, ring = teeth
        stage = planetary(
            normal_module=module, face_width=0.03, allow_unassemblable=True,
            sun={"teeth": sun}, planet={"teeth": planet}, ring={"teeth": ring},
            sun_pressure_angle=angles[0] * DEG, ring_pressure_angle=angles[1] * DEG,
        )  # fmt: skip
        r = stage_radii(seen(stage))
        assert r.center_distance == pytest.approx(distance, rel=1e-3)
        first, other = distances(r)
        assert first == pytest.approx(r.center_distance)
        # the angles are printed with two decimals: both gear meshes agree to a hundredth of a mm
        assert other == pytest.approx(r.center_distance, abs=1.5e-5)


def test_printed_radii_that_contradict_one_another_are_taken_as_they_are():
    r = stage_radii(seen(lin_parker()))
    assert r.base == {"sun": 0.03871, "planet": 0.050175, "ring": 0.137515}
    assert r.center_distance == 0.0884
    assert r.working_angles == {"sun": 24.6 * DEG, "ring": 24.6 * DEG}
    assert abs(distances(r)[0] - r.center_distance) > 5e-3


def test_one_given_angle_leaves_the_other_to_the_centre_distance():
    stage = planetary(sun_pressure_angle=22 * DEG)
    r = stage_radii(seen(stage))
    assert r.working_angles["sun"] == 22 * DEG
    assert distances(r) == pytest.approx((r.center_distance, r.center_distance))
    both = stage_radii(seen(planetary(ring_pressure_angle=18 * DEG)))
    assert both.working_angles["ring"] == 18 * DEG
    assert distances(both) == pytest.approx((both.center_distance, both.center_distance))


def test_a_parallel_stage_has_its_pinion_in_the_suns_place():
    """Working angle from the profile shifts: inv α_w = inv α_t + 2 tan α_n Σx/Σz."""
    stage = parallel()
    r = stage_radii(seen(stage))
    at = math.atan(math.tan(20 * DEG) / math.cos(10 * DEG))
    assert r.reference["sun"] == pytest.approx(0.014 * 24 / 2 / math.cos(10 * DEG))
    assert r.base["planet"] == pytest.approx(0.014 * 95 / 2 / math.cos(10 * DEG) * math.cos(at))
    shift = 2 * math.tan(20 * DEG) * (0.48 + 0.669) / (24 + 95)
    assert involute(r.working_angles["sun"]) == pytest.approx(involute(at) + shift)
    assert r.center_distance == pytest.approx(0.861, abs=2e-4)  # printed for this gear pair
    radii = stage_radii(seen(parallel(center_distance=0.861)))
    cosine = math.cos(radii.working_angles["sun"])
    assert cosine == pytest.approx((r.base["sun"] + r.base["planet"]) / 0.861)


@pytest.mark.parametrize(
    ("stage", "words"),
    [
        (parallel(center_distance=0.5), r"center_distance_mm.*base circles.*\(pinion\)"),
        (planetary(name="low", sun_pressure_angle=30 * DEG, center_distance=0.1),
         r"^my.toml: stages.low.center_distance_mm.*\(ring\).*ring_pressure_angle_deg"),
        (planetary(name="low", ring={"teeth": 84, "profile_shift": 0.5}),
         r"^my.toml: stages.low.center_distance_mm.*profile shifts"),
        (parallel(name="fast", pinion={"teeth": 12, "profile_shift": -1.9}, gear={"teeth": 20}),
         r"^my.toml: stages.fast: the profile shifts leave no working pressure angle"),
    ],
)  # fmt: skip
def test_gears_that_cannot_mesh_are_refused_with_the_stage_named(stage, words):
    with pytest.raises(InputError, match=words) as caught:
        stage_radii(seen(stage))
    assert "\n" not in str(caught.value)
