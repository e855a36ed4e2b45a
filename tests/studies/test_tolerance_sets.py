"""Errors of samples in the places of a system against the system of each sample."""

from __future__ import annotations

import numpy as np
import pytest
from coupled import make_bodies
from small_train import FLEXIBLE, SMALL

from flexgear.coupling.build import build_system
from flexgear.model.load import load_case
from flexgear.studies.tolerance_samples import (
    drawn_errors,
    error_sets,
    nominal,
    paths_of,
    pitch_seeds,
    sample_values,
    with_sample,
)

TRAIN_TOLERANCE = """
[tolerance.errors]
pin_radial = { standard_deviation_um = 5 }
planet_pitch = { distribution = "uniform", low_um = 1, high_um = 3 }
planet_thickness = { standard_deviation_um = 5 }
sun_eccentricity = { distribution = "rayleigh", standard_deviation_um = 5 }
sun_eccentricity_phase = {}
planet_eccentricity = { distribution = "rayleigh", standard_deviation_um = 5 }
ring_offset = { distribution = "rayleigh", standard_deviation_um = 5 }
ring_offset_phase = {}
carrier_eccentricity = { distribution = "rayleigh", standard_deviation_um = 5 }
sun_gear_mesh = { standard_deviation_um = 5 }
sun_gear_mesh_phase = {}
sun_helix_slope = { standard_deviation_um = 5 }
planet_sun_helix_slope = { standard_deviation_um = 5 }
"""


def samples(model, count=3):
    drawn = drawn_errors(model)
    values = sample_values(drawn, 3, range(count))
    names = [""] if not hasattr(model, "stages") else [s.name for s in model.stages]
    seeds = list(zip(*(pitch_seeds(n, 3, range(count)) for n in names), strict=True))
    return [with_sample(model, values, j, own) for j, own in enumerate(seeds)]


def assert_same(models, systems):
    base = systems[-1]
    sets = error_sets(models, paths_of(models[0]), base.gear_meshes, base.pairs)
    for j, system in enumerate(systems):
        found = sets.pairs(base.pairs, j)
        for name in found._fields:
            a, b = getattr(found, name), getattr(system.pairs, name)
            assert np.array_equal(a, b) or np.allclose(a, b, rtol=1e-14, atol=0), name


BODIES = {
    f"tolerance.errors.{key}.{name}": value
    for key, given in {
        "planet_thickness": {"standard_deviation_um": "5"},
        "sun_eccentricity": {"distribution": "rayleigh", "standard_deviation_um": "5"},
        "sun_eccentricity_phase": {"distribution": "uniform"},
        "planet_eccentricity": {"distribution": "rayleigh", "standard_deviation_um": "5"},
        "ring_offset": {"distribution": "rayleigh", "standard_deviation_um": "5"},
        "ring_gear_mesh": {"standard_deviation_um": "5"},
        "ring_helix_slope": {"standard_deviation_um": "5"},
        "planet_ring_helix_slope": {"standard_deviation_um": "5"},
    }.items()
    for name, value in given.items()
}


@pytest.mark.parametrize("more", [{}, BODIES], ids=["teeth", "bodies"])
@pytest.mark.parametrize("law", ["linear", "one-sided"])
def test_flexible_stage(law, more):
    case = load_case("wind-5mw", {"stage.gear_mesh.contact_law": law, **more})
    models, bodies = samples(case), make_bodies(case.view())
    assert_same(models, [build_system(m, bodies) for m in models])


def test_errors_that_a_flexible_stage_of_a_train_states_are_its_nominal_ones(tmp_path):
    path = tmp_path / "train.toml"
    path.write_text(FLEXIBLE)
    model = load_case(path, {"stages.0.errors.sun_eccentricity_um": "17", **BODIES})
    values = nominal(model, drawn_errors(model))
    assert values["stage_1", "sun_eccentricity"] == pytest.approx(17e-6)
    assert values["stage_1", "ring_offset"] == pytest.approx(0, abs=1e-15)
    bodies = make_bodies(model.view(model.stages[0].name))
    models = samples(model)
    assert_same(models, [build_system(m, bodies) for m in models])


@pytest.mark.parametrize("name", ["pitch-drive", "herringbone"])
def test_bundled_trains(name):
    settings = {
        "tolerance.errors.pin_radial.standard_deviation_um": "5",
        "tolerance.errors.planet_pitch.distribution": "rayleigh",
        "tolerance.errors.planet_pitch.standard_deviation_um": "2",
    }
    models = samples(load_case(name, settings))
    assert_same(models, [build_system(m) for m in models])


def test_parallel_stage_behind_a_planetary_one(tmp_path):
    path = tmp_path / "train.toml"
    path.write_text(SMALL + TRAIN_TOLERANCE)
    room = {"stages.stage_1.ring.addendum": "0.6", "stages.stage_1.planets": "4"}
    models = samples(load_case(path, room))
    assert_same(models, [build_system(m) for m in models])
