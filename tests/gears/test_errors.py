"""Errors of a train's stage: against displaced flanks, rigid displacements and corrected papers."""

import math
from dataclasses import replace

import numpy as np
import pytest
from gears.flanks import Teeth
from gears.stages import (
    helical,
    parallel,
    paths_of,
    planetary,
    seen,
)

from flexgear.gears.errors import stage_errors, stage_turns
from flexgear.gears.geometry import stage_geometry

UM = 1e-6
KINDS = ("ring", "sun", "ring_coast", "sun_coast")
THETAS = (0.0, 0.37, -1.9, 11.0)


def errors_and_paths(stage):
    paths = paths_of(stage)
    return stage_errors(seen(stage), paths), paths


def body_error(errors, i, theta, carrier=None):
    """Offset and runouts of planet i, m; carrier: its absolute angle, θ while the ring is held."""
    angle = np.array([theta, theta if carrier is None else carrier])[errors.runout_angle]
    waves = errors.runout_amplitude[i] * np.sin(errors.runout_rate * angle + errors.runout_phase[i])
    return float(errors.offset[i] + waves.sum())


def turned(size, angle):
    return size * np.array([math.cos(angle), math.sin(angle)])


# ------------------------------------------------------------------------- against real flanks
SIDES = {"ring": (-1, +1), "sun": (-1, -1), "ring_coast": (+1, -1), "sun_coast": (+1, +1)}
PARALLEL_SIDES = {"sun": (+1, +1), "sun_coast": (-1, -1)}


class DisplacedFlanks:
    """Teeth of one planet's gear meshes; how far a displaced or thicker gear closes on its mate.

    Tooth n of a gear passes through the contact point; once displaced, another (real) number L
    does, so turning it by (L − n) pitches would bring the flank back: it stands off by that angle
    times the base radius along the normal.
    """

    def __init__(self, stage, kind):
        self.stage, self.kind = stage, kind
        self.g, self.path = stage_geometry(seen(stage)), paths_of(stage)[kind, ""]
        sides = PARALLEL_SIDES if stage.kind == "parallel" else SIDES
        self.gear_side, self.planet_side = sides[kind]
        self.slot = kind.removesuffix("_coast")

    def excess(self, i, theta, *, gear_shift=(0, 0), planet_shift=(0, 0), thicker=0.0):
        path, shift = self.path, np.asarray(gear_shift, dtype=float)
        s = path.s0[i] + path.rate * theta
        s += path.base_pitch * round((0.5 * (path.s_lo + path.s_hi) - s) / path.base_pitch)
        c = np.array([*(path.tangent_point - s * path.normal_xy), 0.0])
        centre = np.array([-self.g.center_distance, 0.0])
        at, body, planet = (
            self.g.transverse_angle,
            self.g.gears[self.slot],
            self.g.gears["planet"],
        )
        gear = Teeth(body, at, 0.0, 0.0, centre).locate(c, self.gear_side)
        moved = Teeth(body, at, 0.0, 0.0, centre + shift).locate(c, self.gear_side)
        mine = Teeth(planet, at, 0.0, 0.0).locate(c, self.planet_side)
        thick = replace(planet, thickness=planet.thickness + thicker)
        other = Teeth(thick, at, 0.0, 0.0, planet_shift).locate(c, self.planet_side)
        pitch = 2 * math.pi / np.array([body.teeth, planet.teeth])
        return (
            -(moved - gear) * pitch[0] * path.gear_arm + (other - mine) * pitch[1] * path.planet_arm
        )


def into_planet_axes(stage, i, size, angle):
    """A vector of the stage's frame in the axes of planet i."""
    return turned(size, angle - stage.planet_angles[i])


CASES = [(planetary, kind) for kind in KINDS] + [(helical, kind) for kind in KINDS]
CASES += [(parallel, kind) for kind in ("sun", "sun_coast")]


@pytest.mark.parametrize(("make", "kind"), CASES)
def test_eccentric_sun_or_ring_displaces_its_flanks(make, kind):
    slot = kind.removesuffix("_coast")
    stage = make(errors={f"{slot}_eccentricity": 30 * UM, f"{slot}_eccentricity_phase": 0.7})
    errors, _ = errors_and_paths(stage)
    flanks, turn = DisplacedFlanks(stage, kind), stage_turns(stage)[slot]
    for i in range(stage.planets):
        for theta in THETAS:
            shift = into_planet_axes(stage, i, 30 * UM, turn * theta + 0.7)
            expected = flanks.excess(i, theta, gear_shift=shift)
            assert body_error(errors[kind, ""], i, theta) == pytest.approx(expected, abs=0.02 * UM)


@pytest.mark.parametrize(("make", "kind"), CASES)
def test_eccentric_planets_displace_their_flanks_on_both_gear_meshes(make, kind):
    stage = make(errors={"planet_eccentricity": (25 * UM,), "planet_eccentricity_phase": (-1.1,)})
    errors, _ = errors_and_paths(stage)
    flanks, turn = DisplacedFlanks(stage, kind), stage_turns(stage)["planet"]
    for i in range(stage.planets):
        for theta in THETAS:
            shift = turned(25 * UM, turn * theta - 1.1)
            expected = flanks.excess(i, theta, planet_shift=shift)
            assert body_error(errors[kind, ""], i, theta) == pytest.approx(expected, abs=0.02 * UM)


@pytest.mark.parametrize(("make", "kind"), CASES)
def test_thicker_planet_teeth_close_on_both_gear_meshes(make, kind):
    n = 1 if make is parallel else 3
    stage = make(errors={"planet_thickness": (40 * UM, 0.0, -10 * UM)[:n]})
    errors, _ = errors_and_paths(stage)
    flanks = DisplacedFlanks(stage, kind)
    for i in range(n):
        excess = stage.errors.planet_thickness[i]
        expected = flanks.excess(i, 0.4, thicker=excess)
        assert body_error(errors[kind, ""], i, 0.4) == pytest.approx(expected, abs=1e-6 * UM)
        # ½ Δs_n cos α_n, the normal thickness at the normal pressure angle
        by_hand = 0.5 * excess * math.cos(stage.helix_angle) * math.cos(stage.pressure_angle)
        assert expected == pytest.approx(by_hand, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_displaced_pins_and_carrier_displace_the_planets_flanks(kind):
    stage = helical(errors={"pin_radial": (20 * UM, 0, -5 * UM), "pin_tangential": (0, 30 * UM, 0),
                            "carrier_eccentricity": 15 * UM,
                            "carrier_eccentricity_phase": 2.2})  # fmt: skip
    errors, _ = errors_and_paths(stage)
    flanks = DisplacedFlanks(stage, kind)
    for i in range(3):
        pin = np.array([stage.errors.pin_radial[i], stage.errors.pin_tangential[i]])
        shift = pin + into_planet_axes(stage, i, 15 * UM, 2.2)
        for theta in THETAS:  # constant in the carrier
            expected = flanks.excess(i, theta, planet_shift=shift)
            assert body_error(errors[kind, ""], i, theta) == pytest.approx(expected, abs=0.02 * UM)


# ------------------------------------------------------------------------------- published formulas
def driven_by_the_sun(**errors):
    """Coast flanks carry: n = (sin α, cos α) at the sun, (−sin α, cos α) at the ring."""
    stage = planetary(errors=errors)
    gaps, paths = errors_and_paths(stage)
    return stage, gaps["sun_coast", ""], gaps["ring_coast", ""], paths["sun_coast", ""].alpha


@pytest.mark.parametrize("theta", [0.0, 0.9, -4.0])
@pytest.mark.parametrize("i", [0, 1, 2])
def test_ren_and_hu_with_the_signs_of_their_own_deflections(theta, i):
    """Ren eq. 16 and Hu eq. 1 (as excess), term by term, E = 1 µm, spur; − marks a sign that is
    not that of the deflection in the same paper (Ren eq. 3, Hu eq. 3 with η relieving both)."""
    zs, zp, zr, beta = 24, 30, 84, 0.55
    phi = 2 * math.pi * i / 3

    def pair(**errors):
        _, sun, ring, a = driven_by_the_sun(**errors)
        return body_error(sun, i, theta) / UM, body_error(ring, i, theta) / UM, a

    sun, ring, a = pair(sun_eccentricity=UM, sun_eccentricity_phase=beta)
    printed = math.sin(zr / zs * theta + beta + a - phi)
    ren, hu = -printed, +printed
    assert (sun, ring) == (pytest.approx(hu), 0)
    assert sun == pytest.approx(-ren)

    sun, ring, _ = pair(ring_eccentricity=UM, ring_eccentricity_phase=beta)
    printed = math.sin(-theta + beta - a - phi)
    ren, hu = +printed, -printed
    assert (sun, ring) == (0, pytest.approx(ren))
    assert ring == pytest.approx(-hu)
    assert pair(ring_offset=UM, ring_offset_phase=beta)[1] == pytest.approx(-hu)

    sun, ring, _ = pair(planet_eccentricity=(UM,), planet_eccentricity_phase=(beta,))
    at_sun, at_ring = (math.sin(-zr / zp * theta + beta + x) for x in (a, -a))
    ren, hu = (-at_sun, +at_ring), (+at_sun, -at_ring)
    assert (sun, ring) == (pytest.approx(ren[0]), pytest.approx(-ren[1]))
    assert (sun, ring) == (pytest.approx(-hu[0]), pytest.approx(hu[1]))

    sun, ring, _ = pair(carrier_eccentricity=UM, carrier_eccentricity_phase=beta)
    tangential = math.sin(beta - phi) * math.cos(a)
    ren, hu = (+tangential, -tangential), (-tangential, +tangential)
    radial = math.cos(beta - phi) * math.sin(a)  # which both leave out
    assert sun == pytest.approx(-ren[0] - radial) == pytest.approx(hu[0] - radial)
    assert ring == pytest.approx(ren[1] + radial) == pytest.approx(-hu[1] + radial)


def test_gear_mesh_error_adds_to_the_tooth_errors_as_a_phasor():
    stage = planetary(errors={
        "sun_tooth": 8 * UM, "planet_tooth": 4 * UM, "sun_phase": 0.2, "sun_gear_mesh": 5 * UM,
        "sun_gear_mesh_phase": 1.9, "ring_gear_mesh": (-3 * UM, 7 * UM),
    })  # fmt: skip
    errors, paths = errors_and_paths(stage)
    x = 2 * np.pi * np.linspace(0, 1, 9)
    for kind in ("sun", "sun_coast"):
        e = errors[kind, ""]
        wave = e.harmonic_amplitude[1] * np.sin(x + e.harmonic_phase[1])
        assert wave == pytest.approx(6 * UM * np.sin(x + 0.2) + 5 * UM * np.sin(x + 1.9), abs=1e-18)
    e = errors["ring", ""]
    wave = e.harmonic_amplitude[0] @ np.sin(np.outer([1, 2], x) + e.harmonic_phase[0][:, None])
    assert wave == pytest.approx((2 - 3) * UM * np.sin(x) + 7 * UM * np.sin(2 * x), abs=1e-18)
    assert paths["sun", ""].wave is not None
    with pytest.raises(ValueError, match="1 phases for 2 harmonics"):
        planetary(errors={"ring_gear_mesh": (UM, UM), "ring_gear_mesh_phase": 1.0})


def test_halves_share_errors_of_bodies_and_have_pitch_deviations_of_their_own():
    stage = helical(double_helical=True, half_gap=0.02, errors={
        "ring_pitch": 5 * UM, "planet_pitch": 5 * UM, "sun_eccentricity": 7 * UM,
        "pin_radial": (3 * UM, 0, 0), "planet_thickness": (4 * UM,),
    })  # fmt: skip
    errors, _ = errors_and_paths(stage)
    again, _ = errors_and_paths(stage)
    assert len(errors) == 8
    for kind in KINDS:
        left, right = errors[kind, "left"], errors[kind, "right"]
        assert np.array_equal(left.offset, right.offset)
        assert np.array_equal(left.runout_amplitude, right.runout_amplitude)
        assert np.array_equal(left.runout_phase, right.runout_phase)
        assert not np.array_equal(left.planet_tooth, right.planet_tooth)
        assert np.array_equal(left.planet_tooth, again[kind, "left"].planet_tooth)


def test_pinion_and_gear_have_the_errors_of_sun_and_planet():
    stage = parallel(errors={
        "sun_pitch": 5 * UM, "planet_pitch": 6 * UM, "sun_tooth": 2 * UM, "planet_tooth": 4 * UM,
        "sun_eccentricity": 3 * UM, "planet_eccentricity": (5 * UM,),
    })  # fmt: skip
    errors, _ = errors_and_paths(stage)
    assert set(errors) == {("sun", ""), ("sun_coast", "")}
    e = errors["sun", ""]
    assert e.gear_tooth.shape == (24,) and e.planet_tooth.shape == (1, 95)
    assert e.harmonic_amplitude == pytest.approx([3 * UM])
    assert e.runout_rate == pytest.approx([-95 / 24, 1])
    assert not np.array_equal(e.gear_tooth, errors["sun_coast", ""].gear_tooth)
    assert np.ptp(e.planet_tooth) > 0


def test_no_errors_are_no_errors():
    for stage in (planetary(), helical(double_helical=True), parallel()):
        for e in errors_and_paths(stage)[0].values():
            assert e.runout_amplitude.size == e.runout_rate.size == e.runout_angle.size == 0
            for values in (e.offset, e.harmonic_amplitude, e.gear_tooth, e.planet_tooth):
                assert not values.any()
