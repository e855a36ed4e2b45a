"""Tolerance studies: physics of what they give, the same numbers however they are run."""

import json
import math

import load_sharing_theory as theory
import numpy as np
import pytest
import xarray as xr
from scipy import stats
from small_train import FLEXIBLE
from stage_samples import cheap_stage
from trains import spur_pair, stage_train, write

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.line_loads import line_loads
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.coupling.pair_data import slice_gaps
from flexgear.gears.slices import factor_along
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case
from flexgear.results.load_sharing import load_sharing
from flexgear.solve import bodies as solve_bodies
from flexgear.solve.face_load import along_face, largest_line_load
from flexgear.solve.model import assemble
from flexgear.studies import job_pool
from flexgear.studies import tolerance as study
from flexgear.studies.early_workers import Outcome
from flexgear.studies.tolerance import batch_store, finished, tolerance
from flexgear.studies.tolerance_samples import drawn_errors, sample_values, with_sample

PIN = "tolerance.errors.pin_tangential.standard_deviation_um"
ROOM = {"stage.planet.teeth": "16", "stage.ring.teeth": "58", "stage.ring.addendum": "0.6"}
HELD = {  # sun that only turns, ring fixed, carrier on its axis
    **ROOM,
    "stage.sun.kinematics": "torsional",
    "stage.ring.kinematics": "fixed",
    "stage.ring.support.radial_n_per_m": "0",
    "stage.ring.support.tangential_n_per_m": "0",
    "stage.carrier.support.radial_n_per_m": "1e14",
}


pytestmark = pytest.mark.usefixtures("cache")


@pytest.fixture
def cheap(monkeypatch):
    """Bodies of springs in the place of reductions."""
    monkeypatch.setattr(solve_bodies, "stage_bodies", lambda stage, *_: cheap_stage(stage))


def lumped(tmp_path, **settings):
    """Four planets on a sprung sun, pins drawn."""
    more = {PIN: "10", "tolerance.samples": "60", **settings}
    return stage_train(tmp_path, sun="2e8", **more)


class TestPhysics:
    @pytest.mark.parametrize("planets", [4, 5])
    def test_normal_pins_make_normal_forces(self, tmp_path, planets):
        """Sun held: F_i − F̄ = k (e_i − ē), so its standard deviation is k |t| σ √(1 − 1/N), with
        the tangential resultant t of both gear meshes of a planet."""
        sigma, count = 4e-6, 400
        train = stage_train(tmp_path, planets=planets, **HELD,
                            **{PIN: "4", "tolerance.samples": str(count)})  # fmt: skip
        data = tolerance(train, workers=1)
        paths = theory.stage_paths(planets)
        torque = 3000 * 26 / 84
        force = torque / (planets * paths.sun_base_radius)
        deviation = paths.stiffness[0] * abs(paths.resultant[1]) * sigma
        deviation *= math.sqrt(1 - 1 / planets) / force
        share = data["planet_load_factor_mean"].sel(gear_mesh=data["kind"] == "sun") - 1
        for planet in range(planets):
            values = share[:, planet].to_numpy()
            assert stats.kstest(values, stats.norm(0, deviation).cdf).pvalue > 1e-3
            assert values.std() == pytest.approx(deviation, rel=4 / math.sqrt(2 * count))
        # and sample by sample
        for j in range(20):
            e = theory.path_errors(paths, pin_tangential=data["error_size"][j].to_numpy())
            expected = theory.fixed_sun(paths, e, torque) / force - 1
            assert np.allclose(share[j], expected, atol=1e-4 * deviation, rtol=1e-4)

    def test_a_sample_is_the_revolution_of_its_case(self, cheap):
        case = load_case("wind-5mw", {"tolerance.samples": "4"})
        data = tolerance(case, workers=1)
        values = sample_values(drawn_errors(case), 1, range(4))
        seeds = study.pitch_seeds("stage", 1, range(4))
        count = 93 * 4
        for j in (0, 3):
            model = assemble(with_sample(case, values, j, [seeds[j]]))
            equilibrium = revolution(
                model.modal, 2 * np.pi / count * np.arange(count)[:, None], 4e6
            )
            force = model.gear_meshes.forces(equilibrium.pair_load).reshape(count, 2, 5)
            k = load_sharing(force, 8e5)
            assert np.allclose(data["load_sharing_max"][j], k.max(axis=0), rtol=1e-9)
            assert np.allclose(data["load_sharing_mean"][j], k.mean(axis=0), rtol=1e-9)
        assert json.loads(data.attrs["positions"]) == {"stage ring": count, "stage sun": count}

    def test_as_stated_is_the_case_itself(self, tmp_path):
        errors = {"stage.errors.pin_tangential_um": "[12, -7, 3, 20]"}
        train = lumped(tmp_path, **errors)
        data = tolerance(train, workers=1)
        modal = modal_system(build_system(train))
        force = revolution(modal, np.zeros(1), modal.system.rated_torque).pair_load.sum(axis=-1)[0]
        k = 4 * force.reshape(2, 4).max(axis=1) / force.reshape(2, 4).sum(axis=1)
        assert np.allclose(data["load_sharing_as_stated"], k, rtol=1e-9)

    def test_a_flexible_stage_in_a_train_is_that_stage(self, tmp_path, cheap):
        """Pins that were drawn in the train, stated in the case alone: the same load sharing."""
        path = tmp_path / "train.toml"
        path.write_text(FLEXIBLE.replace("carrier_eccentricity_um = 30", ""))
        train = load_case(path, {PIN: "20", "tolerance.samples": "3"})
        data = tolerance(train, workers=1)
        pins = data["error_size"][2].to_numpy().tolist()
        alone = load_case("wind-5mw", {"stage.ring.fe.flexible": "false", "tolerance.samples": "2",
                                       "stage.errors.pin_tangential_m": str(pins)})  # fmt: skip
        stated = tolerance(alone, workers=1)["load_sharing_as_stated"]
        assert np.allclose(data["load_sharing_max"][2], stated, rtol=1e-7)
        assert float(stated.max()) > 1.01

    def test_pitch_deviations_are_drawn_anew(self, tmp_path):
        settings = {"stage.errors.sun_pitch_um": "4", "tolerance.samples": "5"}
        data = tolerance(stage_train(tmp_path, sun="2e8", **settings), workers=1)
        assert len(np.unique(data["load_sharing_max"].to_numpy().round(12), axis=0)) == 5
        assert "error_size" not in data


class TestSameNumbers:
    def test_batches_of_any_size(self, tmp_path, monkeypatch):
        whole = tolerance(lumped(tmp_path), workers=1)
        monkeypatch.setattr(study, "BATCH", 7)
        xr.testing.assert_identical(tolerance(lumped(tmp_path), workers=1), whole)

    def test_more_samples_begin_with_the_same(self, tmp_path, cheap):
        few, more = (
            tolerance(load_case("wind-5mw", {"tolerance.samples": n}), workers=1)
            for n in ("3", "11")
        )
        for name in ("error_size", "load_sharing_max", "planet_load_factor_mean"):
            assert np.array_equal(few[name], more[name][:3])

    def test_another_seed_is_another_study(self, tmp_path):
        a, b = lumped(tmp_path), lumped(tmp_path, **{"tolerance.seed": "2"})
        assert batch_store(a) != batch_store(b)
        studies = [tolerance(x, workers=1)["load_sharing_max"].to_numpy() for x in (a, b)]
        assert not np.isin(studies[0], studies[1]).any()


class TestInterrupted:
    @pytest.fixture(autouse=True)
    def small_batches(self, monkeypatch):
        monkeypatch.setattr(study, "BATCH", 10)

    def stopped(self, monkeypatch, model, after, error=KeyboardInterrupt):
        """Run until some batches are done; samples solved."""
        solve, solved = study.sampled, []

        def counted(setup, numbers):
            if len(solved) == after:
                raise error
            solved.append(numbers)
            return solve(setup, numbers)

        with monkeypatch.context() as patch:
            patch.setattr(study, "sampled", counted)
            try:
                data = tolerance(model, workers=1)
            except KeyboardInterrupt:
                data = None
        return data, solved

    def test_a_stopped_study_goes_on_where_it_stopped(self, tmp_path, monkeypatch, cache):
        train = lumped(tmp_path)
        whole = tolerance(train, workers=1)
        data, first = self.stopped(monkeypatch, train, 2)
        assert data is None
        assert finished(train) == 20
        data, rest = self.stopped(monkeypatch, train, 99)
        xr.testing.assert_identical(data, whole)
        assert [*first, *rest] == study.batches_of(60)
        assert not (cache / "tolerance").exists()

    def test_more_samples_go_on_from_fewer(self, tmp_path, monkeypatch):
        self.stopped(monkeypatch, lumped(tmp_path), 2)
        longer = lumped(tmp_path, **{"tolerance.samples": "80"})
        assert finished(longer) == 20

    def test_failed_batches_are_an_error_and_the_others_stay(self, tmp_path, monkeypatch):
        train = lumped(tmp_path)

        def lost(function, shared, jobs, **options):
            for k, job in enumerate(jobs):
                bad = job.start == 20
                value = None if bad else function(shared, job)
                yield k, Outcome(value, "the worker was lost" if bad else "")

        with monkeypatch.context() as patch:
            patch.setattr(job_pool, "run_jobs", lost)
            with pytest.raises(
                FlexgearError, match=r"1 of 6 .* samples 20 to 29: the worker was lost"
            ):
                tolerance(train, workers=2)
        assert finished(train) == 50
        data, again = self.stopped(monkeypatch, train, 99)
        assert again == [range(20, 30)]
        assert data.sizes["sample"] == 60


def test_nothing_to_share_is_refused(tmp_path):
    pair = load_case(write(tmp_path, spur_pair()), {PIN: "10"})
    for case in (pair, stage_train(tmp_path, planets=1, **{PIN: "10"})):
        with pytest.raises(InputError, match="no stage whose planets share a load"):
            tolerance(case)
    with pytest.raises(InputError, match=r"no error of a part.*sun_gear_mesh"):
        drawn_errors(pair)


@pytest.mark.slow
def test_load_along_the_face_of_a_sample_is_that_of_its_case(cheap):
    """Largest K_Hβ and line load of the gear meshes of ring and sun over the same turn."""
    case = load_case(
        "wind-5mw",
        {
            "stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": "3",
            "tolerance.samples": "2",
            "tolerance.errors.sun_helix_slope.standard_deviation_um": "20",
        },
    )  # fmt: skip
    data = tolerance(case, workers=1)
    values = sample_values(drawn_errors(case), 1, range(2))
    sample_case = with_sample(case, values, 1, study.pitch_seeds("stage", 1, range(2))[1:])
    model, count = assemble(sample_case), 93 * 4
    equilibrium = revolution(model.modal, 2 * np.pi / count * np.arange(count)[:, None], 4e6)
    lines, pairs = line_loads(equilibrium), model.system.pairs
    load, largest = along_face(pairs, lines).mean(axis=0), largest_line_load(pairs, lines)
    for kind, group in enumerate(("ring", "sun")):
        row, flanks = data.isel(sample=1).sel(group=f"stage {group}"), pairs.kind == kind
        factor = max(map(factor_along, load[flanks]))
        assert float(row["k_h_beta"]) == pytest.approx(factor, rel=1e-9)
        assert float(row["largest_line_load"]) == pytest.approx(largest[:, flanks].max(), rel=1e-9)


def test_ground_amounts_of_a_sample_are_those_of_a_case_that_states_them(cheap):
    """Gaps of slices of every gear mesh: what all planets have alike, and what planet 3 has. Relief
    turns flanks, by more than in proportion to its amount."""
    at, names = "tolerance.modifications", {}
    keys = {
        "stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": "3",
        "stage.sun.modifications.tip_relief.amount_um": "20",
        "stage.sun.modifications.tip_relief.length_mm": "18",
        "stage.planet.modifications.lead_crowning_um": "10",
        f"{at}.sun.tip_relief.low_um": "0",
    }  # fmt: skip
    for name in ("sun.tip_relief", "planet_ring.lead_crowning", "ring.profile_crowning"):
        names[name] = name.replace(".", "_")
        keys[f"{at}.{name}.mean_um"] = "40"
        keys[f"{at}.{name}.standard_deviation_um"] = "9"
    setup = study.tolerance_setup(load_case("wind-5mw", keys))
    values = sample_values(setup.drawn, 1, range(2))
    sets = study.sets_of(setup, values, [[0], [0]])
    drawn = {name: values["stage", key][1] for name, key in names.items()}
    assert [len(x) for x in drawn.values()] == [1, 5, 1]
    stated = load_case("wind-5mw", keys).with_(
        **{
            "stage.sun.modifications.drive": {
                "tip_relief": {"amount": drawn["sun.tip_relief"][0], "length": 18e-3}
            },
            "stage.planet.modifications.ring": {
                "lead_crowning": drawn["planet_ring.lead_crowning"][2]
            },
            "stage.ring.modifications.drive": {
                "profile_crowning": drawn["ring.profile_crowning"][0]
            },
        }
    )
    system = setup.modal.system
    pairs, expected = sets.pairs(system.pairs, 1), assemble(stated).system.pairs
    third = [m for m, label in enumerate(system.gear_meshes) if label.planet == 2]
    assert len(third) == 4
    for m, label in enumerate(system.gear_meshes):
        one, other = (slice_gaps(p)[p.table[m]] for p in (pairs, expected))
        same = np.allclose(one, other, rtol=0.0, atol=0.2e-6)
        assert same == (m in third or label.kind not in ("ring", "sun_coast"))
