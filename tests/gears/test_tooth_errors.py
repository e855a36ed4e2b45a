"""Manufacturing errors as pair compression."""

import math

import numpy as np
import pytest
from gears.stages import flexible_errors, flexible_paths

from flexgear.model.load import load_case


def test_single_tooth_deviations_add_half_each():
    e = flexible_errors(load_case("wind-5mw").view())
    assert np.allclose(e["ring"].harmonic_amplitude, 0.5 * (21e-6 + 18e-6))
    assert np.allclose(e["sun"].harmonic_amplitude, 0.5 * (18e-6 + 18e-6))
    # coast flanks are cut as well as drive flanks
    for kind in ("ring", "sun"):
        assert np.all(e[f"{kind}_coast"].harmonic_amplitude == e[kind].harmonic_amplitude)


def test_a_pin_forward_presses_the_drive_flanks_and_relieves_the_coast_flanks():
    """Planet moved by t tangentially: δ = -N·t; n_y = -cos α at both loaded flanks."""
    case = load_case("wind-5mw", {"stage.errors.pin_tangential_um": "[50, 0, 0, 0, 0]"}).view()
    paths, e = flexible_paths(case), flexible_errors(case)
    for kind, sign in (("ring", 1), ("sun", 1), ("ring_coast", -1), ("sun_coast", -1)):
        p = paths[kind]
        size = 50e-6 * math.cos(p.alpha) * math.cos(p.beta_b)
        assert e[kind].offset == pytest.approx([sign * size, 0, 0, 0, 0])
    case = load_case("wind-5mw", {"stage.errors.pin_radial_um": "[0, 50, 0, 0, 0]"}).view()
    e = flexible_errors(case)
    assert e["ring"].offset[1] > 0 > e["sun"].offset[1]


def test_pitch_deviations_belong_to_flanks_and_to_the_seed():
    over = {"stage.errors.ring_pitch_um": "5", "stage.errors.planet_pitch_um": "4"}
    e, again = (flexible_errors(load_case("wind-5mw", over).view()) for _ in range(2))
    other = flexible_errors(load_case("wind-5mw", {**over, "stage.errors.seed": "2"}).view())
    assert np.array_equal(e["ring"].gear_tooth, again["ring"].gear_tooth)
    assert not np.array_equal(e["ring"].gear_tooth, other["ring"].gear_tooth)
    assert e["ring"].gear_tooth.shape == (93,)
    assert e["ring"].planet_tooth.shape == (5, 33)
    assert 3e-6 < e["ring"].gear_tooth.std() < 7e-6
    assert np.allclose(e["ring"].gear_tooth.mean(), 0)
    assert np.all(e["sun"].gear_tooth == 0)
    # the flank that meets the ring when driving meets the sun when driven
    assert np.array_equal(e["ring"].planet_tooth, e["sun_coast"].planet_tooth)
    assert np.array_equal(e["sun"].planet_tooth, e["ring_coast"].planet_tooth)
    assert not np.array_equal(e["ring"].planet_tooth, e["sun"].planet_tooth)
