"""Stiffness waves and means of a train's stages, against pairs counted from the paths."""

import math
from dataclasses import replace

import numpy as np
import pytest
from gears.stages import UNLOADED, helical, pair_indices, parallel, paths_of, planetary, seen

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.gears.stiffness import law_mean, mean_stiffness, pair_law
from flexgear.model.errors import InputError
from flexgear.model.load import load_case


def pairs_in_contact(path, planet, theta):
    return np.array([len(pair_indices(path, planet, t)) for t in theta])


@pytest.mark.parametrize("stage", [
    planetary(gear_mesh={"model": "rectangular"}),
    planetary(planets=4, gear_mesh={"model": "rectangular"}),
    helical(gear_mesh={"model": "rectangular"}),
    parallel(gear_mesh={"model": "rectangular"}),
])  # fmt: skip
def test_the_rectangular_wave_counts_the_pairs_of_every_planet(stage):
    """wave(x) ε/mean is the number of pairs at mid-face, at any angle and for every planet: phases
    between planets, and between sun and ring, are those of the teeth."""
    g = stage_geometry(seen(stage))
    paths = paths_of(stage)
    theta = np.linspace(-0.3, 0.4, 1777)
    for (kind, _), path in paths.items():
        ratio = g.gear_meshes[kind.removesuffix("_coast")].transverse_contact_ratio
        share = []
        for i in range(stage.planets):
            x = (path.s0[i] + path.rate * theta - path.s_lo) / path.base_pitch % 1
            at = np.arange(len(path.wave) + 1) / len(path.wave)
            pairs = np.interp(x, at, [*path.wave, path.wave[0]]) * ratio / path.wave.mean()
            near = np.minimum(np.abs(x - ratio % 1), np.minimum(x, 1 - x)) < 2e-3
            assert pairs[~near] == pytest.approx(pairs_in_contact(path, i, theta)[~near])
            share.append(np.mean(pairs > math.floor(ratio) + 0.5))
        # the share of angles with one more pair is what the contact ratio says
        assert share == pytest.approx([ratio % 1] * stage.planets, abs=0.03)


def test_a_planet_meets_sun_and_ring_with_opposite_flanks_half_a_tooth_apart():
    """Ring tooth in the middle of the planet's flank: s_ring + s_sun of one tooth of the planet is
    r_b (π + α_r + α_s + 2Δ), Δ the half angle of the planet's tooth at the base circle."""
    for stage in (planetary(), helical(), helical(planet={"teeth": 30, "profile_shift": 0.1},
                  sun={"teeth": 24, "profile_shift": -0.1},
                  ring={"teeth": 84, "profile_shift": -0.1})):  # fmt: skip
        g = stage_geometry(seen(stage))
        paths, p = paths_of(stage), g.gears["planet"]
        at = g.radii.transverse_angle
        half = p.thickness / (2 * p.reference_radius) + math.tan(at) - at
        whole = p.base_radius * (math.pi + g.radii.ring_angle + g.radii.sun_angle + 2 * half)
        total = paths["ring", ""].s0 + paths["sun", ""].s0
        assert (total - whole) / paths["sun", ""].base_pitch == pytest.approx(np.zeros(3), abs=1e-9)


def test_sum_of_helical_pairs_is_the_fourier_wave():
    """All pairs of the uniform law together, at every angle: the wave with many harmonics."""
    stage = helical(gear_mesh={"model": "fourier", "harmonics": 100, "sun_stiffness": 3e9})
    for (kind, _), path in paths_of(stage).items():
        x = np.arange(0, 1, 0.01)
        k = np.arange(-8, 9)[:, None]
        s = path.s_lo + (x + k) * path.base_pitch
        total = np.interp(s, path.s_grid, path.k_grid, left=0, right=0).sum(axis=0)
        at = np.arange(len(path.wave) + 1) / len(path.wave)
        wave = np.interp(x, at, [*path.wave, path.wave[0]])
        assert wave == pytest.approx(total, rel=2e-3)
        assert np.ptp(total) > 0.01 * total.mean()
        if kind.startswith("sun"):
            assert path.wave.mean() == pytest.approx(3e9)


def test_given_means_are_kept_by_every_model():
    for model in ("constant", "rectangular", "fourier", "per_pair", "lumped"):
        stage = helical(gear_mesh={"model": model, "sun_stiffness": 3e9, "ring_stiffness": 4e9})
        for (kind, _), path in paths_of(stage).items():
            mean = 4e9 if kind.startswith("ring") else 3e9
            if path.wave is not None:
                assert path.wave.mean() == pytest.approx(mean)
            area = np.sum(0.5 * (path.k_grid[1:] + path.k_grid[:-1]) * np.diff(path.s_grid))
            assert area / path.base_pitch == pytest.approx(mean, rel=1e-3)


def test_iso_mean_of_a_herringbone_gear_mesh():
    """Ren et al. 2021 leave stiffness out; module 22 mm fits their masses. c_γ b of a side is about
    2.5e9 (sun) and 3.3e9 (ring) N/m in the transverse plane, over cos²β_b along the normal."""
    train = load_case("herringbone")
    options = {"sun_stiffness": None, "ring_stiffness": None}
    stage = train.stages[0]
    stage = stage.model_copy(update={"gear_mesh": stage.gear_mesh.model_copy(update=options)})
    view = replace(train.view("stage"), stage=stage)
    g = stage_geometry(view)
    cos2 = math.cos(g.radii.base_helix_angle) ** 2
    sun, ring = (mean_stiffness(view, g, slot, 0.0) for slot in ("sun", "ring"))
    assert sun * cos2 == pytest.approx(2.5e9, rel=0.03)
    assert ring * cos2 == pytest.approx(3.3e9, rel=0.03)
    assert (sun, ring) == (pytest.approx(2.92e9, rel=0.01), pytest.approx(3.86e9, rel=0.01))


def test_per_pair_mean_without_a_given_one_is_that_of_its_law():
    stage = helical(gear_mesh={"model": "per_pair"})
    g = stage_geometry(seen(stage))
    law = pair_law(seen(stage), g, "sun", 0.0)
    mean = mean_stiffness(seen(stage), g, "sun", 0.0)
    assert law_mean(law, seen(stage), g, "sun") == mean
    peak = float(law(np.array([0.5]))[0])
    ratio = g.gear_meshes["sun"].transverse_contact_ratio
    # mean of the parabola between 0.67 and 1: 1 − 0.33/3
    assert mean == pytest.approx(peak * 0.1 * ratio * (1 - 0.33 / 3), rel=1e-6)


def test_contact_ratios_given_for_waves():
    stage = planetary(gear_mesh={"model": "rectangular", "sun_contact_ratio": 1.25})
    plain = paths_of(planetary())["sun", ""]
    path = paths_of(stage)["sun", ""]
    assert (path.s_hi - path.s_lo) / path.base_pitch == pytest.approx(1.25)
    assert path.s_lo + path.s_hi == pytest.approx(plain.s_lo + plain.s_hi)
    assert path.wave.max() / path.wave.min() == pytest.approx(2)
    assert np.mean(path.wave > path.wave.mean()) == pytest.approx(0.25, abs=2e-3)


TABLE = {"position": (0.0, 1.0), "stiffness": (10e9, 14e9)}


def test_laws_of_tables_and_of_tooth_deflection():
    """A lumped stage has nothing of its teeth in an FE mesh: whole compliance, at the load that
    passes; the mean after Weber and Banaschek is the theoretical one of ISO 6336-1, whose c' is
    smaller by C_M = 0.8 and C_B."""
    stage = planetary(gear_mesh={
        "model": "per_pair", "pair_stiffness": "table", "table": {"ring": TABLE, "sun": TABLE},
    })  # fmt: skip
    g = stage_geometry(seen(stage))
    ratio = g.gear_meshes["sun"].transverse_contact_ratio
    assert mean_stiffness(seen(stage), g, "sun", 0.0) == pytest.approx(ratio * 0.1 * 12e9)
    for name in ("stage_2", "stage_3"):
        means = []
        for law in ("iso6336", "weber-banaschek"):
            train = load_case("nrel-5mw", {
                f"stages.{name}.gear_mesh.model": "per_pair",
                f"stages.{name}.gear_mesh.pair_stiffness": law,
            })  # fmt: skip
            view, force = train.view(name), power_flow(train).stage(name).sun_gear_mesh_force
            means.append(mean_stiffness(view, stage_geometry(view), "sun", force))
        assert means[1] * 0.8 * 0.975 == pytest.approx(means[0], rel=0.03)


def test_tooth_deflection_needs_a_load():
    stage = planetary(gear_mesh={"model": "per_pair", "pair_stiffness": "weber-banaschek"})
    with pytest.raises(InputError, match=r"stage.gear_mesh.pair_stiffness: weber-ban.* needs a"):
        stage_paths(seen(stage), UNLOADED)
