"""Samples of manufacturing errors, and the errors of gear meshes that follow."""

import math

import numpy as np
import pytest
from coupled import make_bodies
from scipy import stats
from small_train import FLEXIBLE, SMALL
from trains import write

from flexgear.coupling.build import build_system
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.model.tolerance import PhaseDistribution, SizeDistribution
from flexgear.studies.tolerance_samples import (
    cut_normal,
    drawn_errors,
    error_sets,
    inverse,
    nominal,
    paths_of,
    pitch_seeds,
    sample_values,
    with_sample,
)

ERRORS = "tolerance.errors"
PIN = {f"{ERRORS}.pin_tangential.standard_deviation_um": "10"}


@pytest.fixture(scope="module")
def drawn():
    return drawn_errors(load_case("pitch-drive"))


class TestStreams:
    def test_a_sample_is_its_numbers_alone(self, drawn):
        whole = sample_values(drawn, 5, range(20))
        for numbers in ([7], [19, 3, 0], range(4, 9)):
            some = sample_values(drawn, 5, numbers)
            for key, values in some.items():
                assert np.array_equal(values, whole[key][list(numbers)])

    def test_an_error_does_not_depend_on_others(self, drawn):
        alone = sample_values(drawn[3:4], 5, range(20))
        every = sample_values(drawn, 5, range(20))
        for key, values in alone.items():
            assert np.array_equal(values, every[key])

    def test_stages_keys_planets_samples_and_seeds_differ(self, drawn):
        a, b = (sample_values(drawn, seed, range(50)) for seed in (1, 2))
        numbers = np.concatenate([v.ravel() for draws in (a, b) for v in draws.values()])
        assert len(np.unique(numbers)) == len(numbers)
        seeds = [s for stage in ("a", "b") for s in pitch_seeds(stage, 1, range(50))]
        assert len(set(seeds)) == 100

    def test_planets_are_independent(self, drawn):
        pins = sample_values(drawn, 1, range(1500))["stage_1", "pin_tangential"]
        assert pins.shape == (1500, 3)
        correlation = np.corrcoef(pins.T) - np.eye(3)
        assert np.abs(correlation).max() < 4 / math.sqrt(1500)


class TestDistributions:
    UNIFORM = np.random.default_rng(1).random(20_000)

    def fits(self, distribution, expected):
        size = inverse(distribution, self.UNIFORM)
        return stats.kstest(size, expected.cdf).pvalue > 1e-3

    def test_a_normal_distribution_is_drawn(self):
        d = SizeDistribution(mean=3e-6, standard_deviation=2e-6)
        assert self.fits(d, stats.norm(3e-6, 2e-6))

    @pytest.mark.parametrize(("low", "high"), [(-1.0, 2.0), (1.5, 4.0), (-6.0, -1.0)])
    def test_cut_normal(self, low, high):
        s = 1e-5
        d = SizeDistribution(standard_deviation=s, low=low * s, high=high * s)
        assert self.fits(d, stats.truncnorm(low, high, scale=s))
        assert low * s <= inverse(d, self.UNIFORM).min()
        assert inverse(d, self.UNIFORM).max() <= high * s

    def test_far_tails_keep_their_digits(self):
        u = np.array([0.1, 0.5, 0.9])
        for a, b in ((5.0, 7.5), (-7.5, -5.0)):
            assert np.allclose(cut_normal(u, a, b), stats.truncnorm(a, b).ppf(u), rtol=1e-9)
            assert np.allclose(cut_normal(u, a, b), -cut_normal(1 - u, -b, -a), rtol=1e-12)

    def test_rayleigh_is_the_distance_of_two_normal_coordinates(self):
        d = SizeDistribution(distribution="rayleigh", standard_deviation=4e-6)
        assert self.fits(d, stats.rayleigh(scale=4e-6))
        cut = SizeDistribution(distribution="rayleigh", standard_deviation=4e-6, high=5e-6)
        size = inverse(cut, self.UNIFORM)
        assert size.max() <= 5e-6
        share = np.mean(size < 2e-6)
        expected = stats.rayleigh(scale=4e-6).cdf(2e-6) / stats.rayleigh(scale=4e-6).cdf(5e-6)
        assert share == pytest.approx(expected, abs=0.015)

    def test_uniform_sizes_and_phases_are_drawn(self):
        d = SizeDistribution(distribution="uniform", low=-2e-6, high=6e-6)
        assert self.fits(d, stats.uniform(-2e-6, 8e-6))
        assert self.fits(PhaseDistribution(), stats.uniform(0, 2 * math.pi))

    def test_ends_are_finite_and_no_size_is_just_zero(self):
        ends = np.array([0.0, 1 - 2.0**-53])
        for d in (
            SizeDistribution(standard_deviation=1e-5),
            SizeDistribution(distribution="rayleigh", standard_deviation=1e-5),
            SizeDistribution(distribution="uniform", low=0.0, high=1e-5),
        ):
            size = inverse(d, ends)
            assert np.isfinite(size).all()
            assert (size != 0).all()


class TestModels:
    def test_values_land_where_they_belong(self, drawn):
        model = load_case("pitch-drive")
        values = sample_values(drawn, 1, range(3))
        changed = with_sample(model, values, 2, [7, 8, 9])
        for k, stage in enumerate(changed.stages):
            pins = values[stage.name, "pin_tangential"][2]
            assert stage.errors.pin_tangential == tuple(pins)
            assert stage.errors.sun_eccentricity == values[stage.name, "sun_eccentricity"][2, 0]
            assert stage.errors.seed == 7 + k
            assert stage.errors.sun_gear_mesh == model.stages[k].errors.sun_gear_mesh
        assert model.stages[0].errors.pin_tangential == ()

    def test_a_number_drawn_for_a_gear_mesh_replaces_its_first_harmonic_alone(self):
        keys = {"stage.errors.sun_gear_mesh_um": "[9, 4, 2]",
                "stage.errors.sun_gear_mesh_phase_deg": "[10, 80, 200]",
                f"{ERRORS}.sun_gear_mesh.standard_deviation_um": "5",
                f"{ERRORS}.sun_gear_mesh_phase.distribution": "uniform"}  # fmt: skip
        case = load_case("lin-parker", keys)
        values = sample_values(drawn_errors(case), 1, range(2))
        errors = with_sample(case, values, 1, [0]).stages[0].errors
        (size,), (phase,) = (values["stage", f"sun_gear_mesh{x}"][1] for x in ("", "_phase"))
        assert errors.sun_gear_mesh == pytest.approx((size, 4e-6, 2e-6))
        assert errors.sun_gear_mesh_phase == pytest.approx((phase, *np.radians([80, 200])))
        stated = with_sample(case, nominal(case, drawn_errors(case)), 0, [0]).stages[0].errors
        assert stated.sun_gear_mesh == case.stages[0].errors.sun_gear_mesh

    def test_nominal_errors_are_those_of_the_case(self, drawn):
        model = load_case("pitch-drive")
        values = nominal(model, drawn)
        assert values["stage_1", "planet_eccentricity"].tolist() == [[21e-6] * 3]
        phases = values["stage_1", "planet_eccentricity_phase"][0]
        assert np.allclose(phases, np.radians([0, 120, 240]))
        assert np.abs(values["stage_1", "pin_tangential"]).max() < 1e-20

    def test_parallel_stages_have_no_pins(self, tmp_path):
        errors = drawn_errors(load_case(write(tmp_path, SMALL), PIN))
        assert [(e.stage, e.labels) for e in errors] == [
            ("stage_1", tuple(f"stage_1.pin_tangential {i}" for i in (1, 2, 3)))
        ]

    def test_nothing_to_draw(self):
        with pytest.raises(InputError, match=r"lin-parker: tolerance\.errors: has no error"):
            drawn_errors(load_case("lin-parker"))

    def test_pitch_deviations_alone_are_enough(self):
        assert drawn_errors(load_case("lin-parker", {"stage.errors.sun_pitch_um": "3"})) == ()


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
    seeds = list(zip(*(pitch_seeds(s.name, 3, range(count)) for s in model.stages), strict=True))
    return [with_sample(model, values, j, seed) for j, seed in enumerate(seeds)]


def assert_same(models, systems):
    base = systems[-1]
    sets = error_sets(models, paths_of(models[0]), base.gear_meshes, base.pairs)
    for j, system in enumerate(systems):
        pairs = sets.pairs(base.pairs, j)
        for name in pairs._fields:
            a, b = getattr(pairs, name), getattr(system.pairs, name)
            assert np.array_equal(a, b) or np.allclose(a, b, rtol=1e-14, atol=0), name


BODIES = {
    f"tolerance.errors.{key}.{name}": value
    for key, distribution in {
        "planet_thickness": {"standard_deviation_um": "5"},
        "sun_eccentricity": {"distribution": "rayleigh", "standard_deviation_um": "5"},
        "sun_eccentricity_phase": {"distribution": "uniform"},
        "planet_eccentricity": {"distribution": "rayleigh", "standard_deviation_um": "5"},
        "ring_offset": {"distribution": "rayleigh", "standard_deviation_um": "5"},
        "ring_gear_mesh": {"standard_deviation_um": "5"},
        "ring_helix_slope": {"standard_deviation_um": "5"},
        "planet_ring_helix_slope": {"standard_deviation_um": "5"},
    }.items()
    for name, value in distribution.items()
}


@pytest.mark.parametrize("more", [{}, BODIES], ids=["teeth", "bodies"])
@pytest.mark.parametrize("law", ["linear", "one-sided"])
def test_flexible_stage(law, more):
    case = load_case("wind-5mw", {"stage.gear_mesh.contact_law": law, **more})
    models, bodies = samples(case), make_bodies(case.view())
    assert_same(models, [build_system(m, bodies) for m in models])


def test_errors_that_a_flexible_stage_of_a_train_states_are_its_nominal_ones(tmp_path):
    model = load_case(
        write(tmp_path, FLEXIBLE), {"stages.0.errors.sun_eccentricity_um": "17", **BODIES}
    )
    values = nominal(model, drawn_errors(model))
    assert values["stage_1", "sun_eccentricity"] == pytest.approx(17e-6)
    assert values["stage_1", "ring_offset"] == pytest.approx(0, abs=1e-15)
    bodies = make_bodies(model.view(model.stages[0].name))
    models = samples(model)
    assert_same(models, [build_system(m, bodies) for m in models])


@pytest.mark.parametrize("name", ["pitch-drive", "herringbone"])
def test_bundled_trains(name):
    settings = {
        f"{ERRORS}.pin_radial.standard_deviation_um": "5",
        f"{ERRORS}.planet_pitch.distribution": "rayleigh",
        f"{ERRORS}.planet_pitch.standard_deviation_um": "2",
    }
    models = samples(load_case(name, settings))
    assert_same(models, [build_system(m) for m in models])


def test_parallel_stage_behind_a_planetary_one(tmp_path):
    room = {"stages.stage_1.ring.addendum": "0.6", "stages.stage_1.planets": "4"}
    models = samples(load_case(write(tmp_path, SMALL + TRAIN_TOLERANCE), room))
    assert_same(models, [build_system(m) for m in models])
