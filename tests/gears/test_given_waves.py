"""Gear-mesh stiffness that a case prescribes: two levels, or the terms of a Fourier series."""

import numpy as np
import pytest
from trains import spur_pair, write

import flexgear as fg
from flexgear.coupling.kernels.elements import pair_rows
from flexgear.coupling.kernels.pairs import build_rows

MEAN = 4e8


def stiffness(folder, wave, angles):
    """Stiffness (angles, flanks), N/m, drive flank first, over rotations of the gear, rad."""
    gear_mesh = f'contact_law = "one-sided"\nsun_stiffness_n_per_m = {MEAN}\n{wave}'
    path = write(folder, spur_pair(gear_mesh=gear_mesh))
    system = fg.load_case(path).assemble().system
    rows, out = pair_rows(system.pairs), np.zeros((len(angles), 2))
    for values, angle in zip(out, angles, strict=True):
        theta = system.theta(np.array([angle]))
        n, _ = build_rows(system.pairs, rows, theta, np.ones(2, np.int64))
        of_flank = np.flatnonzero(rows.row["kind"][:n] >= 0)
        values[rows.row["owner"][of_flank]] = rows.row["stiffness"][of_flank]
    return out


def test_terms_that_are_given_are_those_of_the_stiffness(tmp_path):
    """At rotation 0 teeth touch at the pitch point, s = r_b tan α; s rises by r_b a radian."""
    wave = """model = "fourier"
sun_harmonic_shares = [0.3, 0.05, 0.1]
sun_harmonic_phases_deg = [20, 0, -75]"""
    angles = np.linspace(0.0, 0.3, 57)
    drive, coast = stiffness(tmp_path, wave, angles).T
    base_radius = 0.12 * np.cos(np.radians(20))
    pitch = 2 * np.pi * base_radius / 60
    turns = base_radius * (np.tan(np.radians(20)) + angles) / pitch
    exact = 1 + sum(
        a * np.cos(2 * np.pi * h * turns + np.radians(phase))
        for h, a, phase in ((1, 0.3, 20), (2, 0.05, 0), (3, 0.1, -75))
    )
    assert drive / MEAN == pytest.approx(exact, abs=2e-5)  # linear between 1024 samples
    assert coast / MEAN == pytest.approx(exact, abs=2e-5)


def test_a_step_of_a_rectangular_wave_gives_two_levels(tmp_path):
    """Two pairs for the share ε − 1 of the cycle, one for the rest, and the mean that is given."""
    wave = """model = "rectangular"
sun_contact_ratio = 1.6
sun_stiffness_step_n_per_m = 1e8"""
    cycle = 2 * np.pi / 60 * (np.arange(500) + 0.5) / 500
    over = np.round(stiffness(tmp_path, wave, cycle)[:, 0] / MEAN, 9)
    levels, counts = np.unique(over, return_counts=True)
    assert levels[counts > 5] == pytest.approx([0.85, 1.1])
    assert counts[counts > 5] / 500 == pytest.approx([0.4, 0.6], abs=0.01)


@pytest.mark.parametrize(
    ("wave", "words"),
    [
        ('model = "fourier"\nsun_harmonic_shares = [0.9, -0.3]', "fall to -20 %"),
        ('model = "per_pair"\nsun_harmonic_shares = [0.1]', "cannot be used with model"),
        ('model = "fourier"\nsun_harmonic_phases_deg = [3]', "1 phases for 0 terms"),
        ('model = "constant"\nsun_stiffness_step_n_per_m = 1e8', "no effect with model"),
        ('model = "rectangular"\nsun_stiffness_step_n_per_m = 1e9', "sun_stiffness_step"),
        ('model = "rectangular"\nring_stiffness_step_n_per_m = 1e8', "ring_stiffness.* is missing"),
    ],
)
def test_a_wave_that_cannot_be_is_one_line(tmp_path, wave, words):
    with pytest.raises(fg.InputError, match=words) as refused:
        stiffness(tmp_path, wave, [0.0])
    assert "\n" not in str(refused.value)
