"""Paths of a train's stages: against flanks written down independently and the flexible stage's."""

import math
from dataclasses import fields

import numpy as np
import pytest
from gears.flanks import Teeth
from gears.stages import (
    contact,
    helical,
    lin_parker,
    pair_indices,
    parallel,
    paths_of,
    planetary,
    seen,
)

from flexgear.gears.geometry import stage_geometry
from flexgear.model.errors import InputError

KINDS = ("ring", "sun", "ring_coast", "sun_coast")
DEG = math.pi / 180


@pytest.mark.parametrize("stage", [planetary(), helical(), lin_parker(3), parallel()])
def test_arms_are_moments_of_the_normal_about_both_axes(stage):
    """N at the contact: about the planet's centre, and about the gear's, R_c away."""
    for path in paths_of(stage).values():
        normal = path.cos_base_helix * path.normal_xy
        for s in (path.s_lo, path.s_hi):
            x, y = path.tangent_point - s * path.normal_xy
            assert x * normal[1] - y * normal[0] == pytest.approx(path.planet_arm, rel=1e-12)
            about = (path.center_distance + x) * normal[1] - y * normal[0]
            if stage.kind == "planetary" and stage.sun.base_diameter:  # printed radii don't close
                assert about == pytest.approx(path.gear_arm, rel=0.25)
                continue
            assert about == pytest.approx(path.gear_arm, rel=1e-9)
        assert abs(path.gear_arm) == pytest.approx(path.base_radius_gear * path.cos_base_helix)


def rolls(stage, path):
    """Rotation of gear and planet and the planet's tangential motion for one radian of θ, all
    relative to the frame that path and axes stand in."""
    g = stage_geometry(seen(stage))
    if stage.kind == "parallel":
        return -g.base["planet"] / g.base["sun"], 1.0
    if path.kind.startswith("ring"):
        return -1.0, -g.base["ring"] / g.base["planet"]
    return g.base["ring"] / g.base["sun"], -g.base["ring"] / g.base["planet"]


@pytest.mark.parametrize("stage", [planetary(), helical(), parallel()])
def test_rolling_does_not_compress_and_travels_along_the_path(stage):
    """Rigid rolling: gear arm times its rotation equals the planet's, and the contact point moves
    along the line of action as fast as the base circle unrolls."""
    for path in paths_of(stage).values():
        gear_turn, planet_turn = rolls(stage, path)
        assert path.gear_arm * gear_turn == pytest.approx(path.planet_arm * planet_turn)
        # s is the planet's radius of curvature: it grows as the tooth turns against N's moment
        sense = -math.copysign(1.0, path.planet_arm)
        assert path.rate == pytest.approx(sense * path.base_radius_planet * planet_turn)


def test_forward_drive_loads_the_drive_flanks():
    """Planets and the gear of a parallel stage that drive for θ̇ > 0 are held back by the force."""
    for stage in (planetary(), parallel()):
        paths = paths_of(stage)
        for (kind, _), path in paths.items():
            if kind.startswith("ring"):
                continue
            _, planet_turn = rolls(stage, path)
            drive = not kind.endswith("coast")
            assert (path.planet_arm * planet_turn < 0) == drive
            assert (path.rate > 0) == drive


# ------------------------------------------------------------------------ parallel stage's flanks
class ParallelBench:
    """Pinion and gear as teeth, in axes at the gear's centre with x away from the pinion."""

    def __init__(self, stage):
        self.stage, self.g = stage, stage_geometry(seen(stage))
        self.paths = {kind: p for (kind, _), p in paths_of(stage).items()}
        hand = 1.0 if stage.planet_hand == "right" else -1.0
        twist = hand * math.tan(stage.helix_angle)
        r = self.g.reference
        self.twist = {"sun": -twist / r["sun"], "planet": twist / r["planet"]}

    def teeth(self, slot, first):
        centre = (-self.g.center_distance, 0.0) if slot == "sun" else (0.0, 0.0)
        return Teeth(self.g.gears[slot], self.g.transverse_angle, self.twist[slot], first, centre)


# the pinion's drive flank faces +y at the gear, the gear's faces −y towards the pinion (found by
# hand: the gear turning by +θ moves the teeth at its −x side towards −y)
FRONT_PINION, FRONT_GEAR = +1, +1


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("play", [0.0, 0.3e-3])
def test_flanks_of_pinion_and_gear_pass_through_the_contact(hand, play):
    stage = parallel(planet_hand=hand, backlash_sun=play)
    bench = ParallelBench(stage)
    drive, coast = bench.paths["sun"], bench.paths["sun_coast"]
    # where tooth 0 of both is, from the pair 0 at θ = 0
    c = contact(drive, 0, 0, 0.0)
    first = {
        slot: 2 * math.pi / bench.g.gears[slot].teeth
        * bench.teeth(slot, 0.0).locate(c, FRONT_PINION if slot == "sun" else FRONT_GEAR)
        for slot in ("sun", "planet")
    }  # fmt: skip
    cos_bb = math.cos(bench.g.base_helix_angle)
    ratio = bench.g.base["planet"] / bench.g.base["sun"]
    for theta in (0.0, 0.013, 0.9, -2.2):
        for path, sign in ((drive, 1), (coast, -1)):
            # on the coast flank the pinion has crossed the backlash, which thins its teeth there
            free = 0.0 if sign == 1 else path.backlash / cos_bb
            turn = -free / bench.g.base["sun"]
            gear = bench.teeth("planet", first["planet"] + theta)
            pinion = bench.teeth("sun", first["sun"] - ratio * theta + turn)
            if sign == -1:
                pinion.thin(play / cos_bb, -FRONT_PINION)
            for z in (-0.9 * path.half_face, 0.0, 0.7 * path.half_face):
                indices = pair_indices(path, 0, theta, z)
                assert len(indices) > 0
                for k in indices:
                    c = contact(path, 0, k, theta, z)
                    for teeth, number, side in (
                        (pinion, path.gear_tooth0[0] + path.gear_step * k, sign * FRONT_PINION),
                        (gear, path.planet_tooth0[0] + path.planet_step * k, sign * FRONT_GEAR),
                    ):
                        count = teeth.gear.teeth
                        off = (teeth.locate(c, side) - number + count / 2) % count - count / 2
                        assert abs(off) < 1e-8
                        radius = float(np.hypot(*(c[:2] - teeth.centre)))
                        n = teeth.normal(number, side, radius, z)
                        unit = np.array([*path.normal_xy, path.slope]) / math.hypot(1, path.slope)
                        assert abs(abs(n @ unit) - 1) < 1e-8
                    into = gear.tooth_direction(path.planet_tooth0[0] + path.planet_step * k, z)
                    out = pinion.tooth_direction(path.gear_tooth0[0] + path.gear_step * k, z)
                    assert (into - c[:2]) @ path.normal_xy > 0 > (out - c[:2]) @ path.normal_xy


def test_a_parallel_stage_is_right_for_the_pinions_own_rotation():
    """Over a turn of the gear z_gear pairs pass; tooth 0 meets tooth 0 at the pitch point at 0."""
    path = paths_of(parallel())["sun", ""]
    assert set(paths_of(parallel())) == {("sun", ""), ("sun_coast", "")}
    assert 2 * math.pi * path.rate / path.base_pitch == pytest.approx(95)
    x, y = contact(path, 0, 0, 0.0)[:2]
    assert y == pytest.approx(0, abs=1e-12)
    assert -x / (path.center_distance + x) == pytest.approx(95 / 24)


# -------------------------------------------------------------------------- double-helical halves
def test_halves_have_opposite_hands_and_are_in_phase():
    stage = helical(double_helical=True, half_gap=0.03, planet_hand="left")
    paths = paths_of(stage)
    assert set(paths) == {(kind, side) for kind in KINDS for side in ("left", "right")}
    single = paths_of(helical(planet_hand="left"))
    for kind in KINDS:
        left, right, plain = paths[kind, "left"], paths[kind, "right"], single[kind, ""]
        assert left.slope == -right.slope == plain.slope
        assert left.z_offset == -right.z_offset == -0.5 * (0.03 + 0.1)
        assert np.array_equal(left.s0, right.s0) and np.array_equal(left.s0, plain.s0)
        assert np.array_equal(left.wave, right.wave)
        assert left.half_face == right.half_face == 0.05
        assert np.array_equal(left.normal_xy, right.normal_xy)
        assert (left.side, right.side) == ("left", "right")


# ------------------------------------------------------------------------------- printed geometry
def test_printed_values_equal_to_the_derived_ones_change_nothing():
    plain = helical(gear_mesh={"model": "fourier"})
    g = stage_geometry(seen(plain))
    printed = helical(
        gear_mesh={"model": "fourier"},
        sun_pressure_angle=g.working_angles["sun"], ring_pressure_angle=g.working_angles["ring"],
        sun={"teeth": 24, "base_diameter": 2 * g.base["sun"]},
        planet={"teeth": 30, "base_diameter": 2 * g.base["planet"]},
        ring={"teeth": 84, "base_diameter": 2 * g.base["ring"]},
    )  # fmt: skip
    a, b = paths_of(plain), paths_of(printed)
    for key in a:
        for field in fields(a[key]):
            x, y = getattr(a[key], field.name), getattr(b[key], field.name)
            if isinstance(x, str) or x is None:
                assert x == y
            elif field.name == "off_path":
                ends = [(p.offset, p.s_lo, p.s_hi, p.cos_base_helix) for p in (x, y)]
                assert np.allclose(*ends, rtol=1e-9)
            elif field.name in ("s_grid", "k_grid", "zc_grid", "wave"):
                assert np.allclose(x, y, rtol=1e-9, atol=1e-9 * np.abs(x).max())
            else:
                assert np.allclose(x, y, rtol=1e-9, atol=1e-12), (key, field.name)


@pytest.mark.parametrize("planets", [1, 3, 4, 5, 6, 8])
def test_radii_that_do_not_fit_keep_gear_mesh_order_and_phases_of_the_teeth(planets):
    """Lin and Parker 1999: z_r gear-mesh periods a turn; planet i is ∓z_r φ_i / 2π of them from
    planet 1 at ring and sun, for any number of planets."""
    stage = lin_parker(planets)
    paths = paths_of(stage)
    phi = np.array(stage.planet_angles)
    for kind, sign, arm in (("ring", -1, 0.137515), ("sun", 1, 0.03871)):
        p = paths[kind, ""]
        assert abs(p.rate) * 2 * math.pi / p.base_pitch == pytest.approx(99)
        phase = (p.s0 - p.s0[0]) / p.base_pitch
        assert phase == pytest.approx(sign * 99 * phi / (2 * math.pi), abs=1e-9)
        assert (p.base_radius_gear, p.base_radius_planet) == (arm, 0.050175)
        assert np.all(p.wave == 5e8)
        assert p.alpha == 24.6 * DEG


def test_phases_of_a_stage_that_assembles():
    """±z_r φ_i / 2π; where the planets assemble, the sun's teeth ask for −z_s φ_i / 2π as well."""
    for stage in (planetary(), planetary(planets=4), planetary(planet_positions=(0, 2.0944, 4.0))):
        stage = stage.model_copy(update={"allow_unassemblable": True})
        paths = paths_of(stage)
        phi = np.array(stage.planet_angles)
        ring, sun = paths["ring", ""], paths["sun", ""]
        at_ring = (ring.s0 - ring.s0[0]) / ring.base_pitch
        at_sun = (sun.s0 - sun.s0[0]) / sun.base_pitch
        assert at_ring == pytest.approx(-84 * phi / (2 * np.pi))
        assert at_sun == pytest.approx(84 * phi / (2 * np.pi))
        if (24 + 84) % stage.planets == 0 and stage.planet_positions is None:
            seen = (at_sun + 24 * phi / (2 * np.pi) + 0.5) % 1 - 0.5
            assert seen == pytest.approx(np.zeros(stage.planets), abs=1e-9)


# ----------------------------------------------------------------------------------------- refused
@pytest.mark.parametrize(
    ("stage", "words"),
    [
        (planetary(name="low", planets=4, sun={"teeth": 26}, planet={"teeth": 29}),
         r"^my.toml: stages.low.planets: the planets do not assemble: \(z_s \+ z_r\)/N = 27.5 --"),
        (lin_parker(4).model_copy(update={"allow_unassemblable": False}), "do not assemble"),
        (planetary(name="low", planets=4, sun={"teeth": 24}, planet={"teeth": 30},
                   planet_positions=tuple(np.radians([1.0, 91.0, 183.0, 271.0]))),
         r"stages.low.planet_positions_deg\[2\]: .* at 183° .* 0.4 pitches off .* 184.33333°"),
        (lin_parker(gear_mesh={"model": "per_pair"}), r"gear_mesh.model: per_pair needs true"),
        (parallel(name="fast", gear={"teeth": 95, "profile_shift": 0.669, "addendum": 1.6}),
         r"stages.fast.pinion.dedendum: a tip reaches .* into the root of its mate \(pinion\)"),
        (lin_parker(gear_mesh={"model": "rectangular"}),
         r"stage.gear_mesh.sun_contact_ratio: the tips leave"),
    ],
)  # fmt: skip
def test_stages_that_cannot_be_are_refused_with_the_stage_named(stage, words):
    with pytest.raises(InputError, match=words) as caught:
        paths_of(stage)
    assert "\n" not in str(caught.value)
