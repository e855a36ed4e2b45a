"""Radii of a train's stage: geometry where nothing is given, what is given where it is."""

import math

import pytest
from gears.stages import lin_parker, parallel, planetary, seen

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import stage_radii
from flexgear.gears.tooth import involute
from flexgear.model.errors import InputError

DEG = math.pi / 180


def test_radii_of_a_plain_stage_are_those_of_its_geometry():
    stage = planetary(helix_angle=12 * DEG, planet_hand="left")
    r, g = stage_radii(seen(stage)), stage_geometry(seen(stage))
    assert (r.sun, r.planet, r.ring) == pytest.approx(
        (g.sun.base_radius, g.planet.base_radius, g.ring.base_radius), rel=1e-15
    )
    assert r.center_distance == g.center_distance == pytest.approx(0.27 / math.cos(12 * DEG))
    assert (r.sun_angle, r.ring_angle) == (g.sun_mesh.working_angle, g.ring_mesh.working_angle)
    assert r.base_helix_angle == g.base_helix_angle
    assert r.transverse_angle == g.transverse_angle
    assert r.ring_reference - r.planet_reference == pytest.approx(r.center_distance)


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
        assert r.center_distance * math.cos(r.sun_angle) == pytest.approx(r.sun + r.planet)
        # the angles are printed with two decimals: both gear meshes agree to a hundredth of a mm
        other = (r.ring - r.planet) / math.cos(r.ring_angle)
        assert other == pytest.approx(r.center_distance, abs=1.5e-5)


def test_printed_radii_that_contradict_one_another_are_taken_as_they_are():
    r = stage_radii(seen(lin_parker()))
    assert (r.sun, r.planet, r.ring) == (0.03871, 0.050175, 0.137515)
    assert r.center_distance == 0.0884
    assert r.sun_angle == r.ring_angle == 24.6 * DEG
    assert abs(r.sun + r.planet - r.center_distance * math.cos(r.sun_angle)) > 5e-3


def test_one_given_angle_leaves_the_other_to_the_centre_distance():
    stage = planetary(sun_pressure_angle=22 * DEG)
    r = stage_radii(seen(stage))
    assert r.center_distance == pytest.approx((r.sun + r.planet) / math.cos(22 * DEG))
    assert math.cos(r.ring_angle) == pytest.approx((r.ring - r.planet) / r.center_distance)
    both = stage_radii(seen(planetary(ring_pressure_angle=18 * DEG)))
    assert both.center_distance == pytest.approx((r.ring - r.planet) / math.cos(18 * DEG))


def test_a_parallel_stage_has_its_pinion_in_the_suns_place():
    """Working angle from the profile shifts: inv α_w = inv α_t + 2 tan α_n Σx/Σz."""
    stage = parallel()
    r = stage_radii(seen(stage))
    at = math.atan(math.tan(20 * DEG) / math.cos(10 * DEG))
    assert r.sun_reference == pytest.approx(0.014 * 24 / 2 / math.cos(10 * DEG))
    assert r.planet == pytest.approx(0.014 * 95 / 2 / math.cos(10 * DEG) * math.cos(at))
    shift = 2 * math.tan(20 * DEG) * (0.48 + 0.669) / (24 + 95)
    assert involute(r.sun_angle) == pytest.approx(involute(at) + shift)
    assert r.center_distance == pytest.approx(0.861, abs=2e-4)  # printed for this gear pair
    assert (r.ring, r.ring_angle, r.ring_reference) == (0.0, 0.0, 0.0)
    given = stage_radii(seen(parallel(center_distance=0.861)))
    assert math.cos(given.sun_angle) == pytest.approx((r.sun + r.planet) / 0.861)


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
