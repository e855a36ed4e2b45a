"""Parameter studies: physics of what they give, gaps where points fail, the same in any order."""

import contextlib
import pickle

import numpy as np
import pytest
import xarray as xr
from small_train import ALONE, FLEXIBLE
from stage_samples import cheap_stage
from trains import stage_train, write
from two_gears import gears_text

from flexgear.analysis.modes import modes, springs_at
from flexgear.coupling.build import build_system
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import FlexgearError
from flexgear.model.load import load_case
from flexgear.solve import bodies as solve_bodies
from flexgear.solve.model import assemble
from flexgear.solve.static import stages_sharing
from flexgear.structures.cache import sealed
from flexgear.studies import sweep
from flexgear.studies.measures import measures_of
from flexgear.studies.sweep import failures, finished, planned, run_sweep
from flexgear.studies.sweep_keys import parse_setting


@pytest.fixture(autouse=True, scope="module")
def elsewhere(tmp_path_factory):
    """Finished points are kept away from the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FLEXGEAR_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def swept(case, *settings, **options):
    options.setdefault("workers", 1)
    return sweep.sweep(case, dict(map(parse_setting, settings)), **options)


ROOM = {"stage.ring.addendum": "0.6"}  # no interference of the small ring
BEARING = "stage.planet_bearing.radial_n_per_m"


@pytest.fixture(scope="module")
def bearings():
    return swept(
        "lin-parker", f"{BEARING}=1e6:1e10:9:log", "stage.planets=3,4,5",
        measures=["frequencies", "frequencies_by_type"], modes=12,
    )  # fmt: skip


def with_another_frequency(stored):
    """A finished point whose first frequency differs in its last bit: not what was computed."""
    seal, _, part = stored.partition(b"\n")
    number = pickle.loads(part)["frequency"].to_numpy()[0].tobytes()
    assert number in part
    return seal + b"\n" + part.replace(number, bytes([number[0] ^ 1]) + number[1:])


def test_the_force_of_a_pair_is_that_of_its_power_flow(tmp_path):
    file = write(tmp_path, gears_text(model="per_pair"))
    data = swept(file, "stages.0.face_width_mm=20,30", measures=["gear_mesh_forces"])
    nominal = abs(power_flow(load_case(file)).stages[0].sun_gear_mesh_force)
    assert data["gear_mesh_force_max"].shape == (2, 1)
    np.testing.assert_allclose(data["gear_mesh_force_max"], nominal, rtol=1e-9)


class TestGrid:
    def test_dimensions_are_the_keys_with_their_units(self, bearings):
        assert bearings["frequency"].dims == (BEARING, "stage.planets", "mode")
        assert bearings[BEARING].attrs["units"] == "N/m"
        assert bearings["stage.planets"].attrs["units"] == ""
        np.testing.assert_allclose(np.diff(np.log10(bearings[BEARING])), 0.5)
        assert bearings["frequency"].attrs["units"] == "Hz"
        assert bearings["message"].dims == (BEARING, "stage.planets")
        assert bearings.attrs["failed"] == 0

    def test_a_point_is_the_run_of_its_case(self, bearings):
        case = load_case("lin-parker", {BEARING: "100000000", "stage.planets": "5"})
        system = build_system(case)
        alone = modes(system, springs_at(system).stiffness).frequencies
        point = bearings["frequency"].sel({"stage.planets": 5}).sel({BEARING: 1e8})
        np.testing.assert_allclose(point, alone[alone > 0][:12], rtol=1e-12)

    def test_fewer_modes_leave_gaps(self, bearings):
        """Three planets have no planet modes; their type is there for the others."""
        three = bearings["frequency_by_type"].sel({"stage.planets": 3, "type": "planet"})
        assert np.isnan(three).all()


@pytest.mark.slow
def test_the_same_with_one_and_two_processes():
    settings = ("lin-parker", f"{BEARING}=1e7,1e8,1e9", "stage.planets=3,4")
    one = swept(*settings, workers=1)
    two = swept(*settings, workers=2)
    xr.testing.assert_identical(one, two)


@pytest.mark.usefixtures("cache")
class TestInterrupted:
    GRID = ("stage.planets=3,4,5,6", f"{BEARING}=1e7,1e9")
    MEASURES = ("frequencies", "frequencies_by_type", "load_sharing", "mean_forces")

    def plan(self, *settings, **options):
        options.setdefault("measures", self.MEASURES)
        return planned("lin-parker", dict(map(parse_setting, settings or self.GRID)), **options)

    def run(self, monkeypatch, plan, after, error=KeyboardInterrupt):
        """Run until some points are measured; what came of it, and how many were measured."""
        measure, count = sweep.measured, []

        def counted(*arguments):
            if len(count) == after:
                raise error
            count.append(1)
            return measure(*arguments)

        data = None
        with monkeypatch.context() as patch, contextlib.suppress(KeyboardInterrupt):
            patch.setattr(sweep, "measured", counted)
            data = run_sweep(plan, workers=1)
        return data, len(count)

    def test_a_stopped_study_goes_on_where_it_stopped(self, monkeypatch, cache):
        plan = self.plan()
        whole = run_sweep(plan, workers=1)
        assert not (cache / "sweep").exists()
        assert self.run(monkeypatch, plan, 3) == (None, 3)
        assert finished(plan) == 3
        data, rest = self.run(monkeypatch, plan, 99)
        assert rest == 5
        xr.testing.assert_identical(data, whole)
        assert finished(plan) == 0
        assert not (cache / "sweep").exists()

    def test_more_values_go_on_from_fewer(self, monkeypatch):
        self.run(monkeypatch, self.plan("stage.planets=3,4,5"), 2)
        assert finished(self.plan("stage.planets=4:6:3")) == 1
        assert finished(self.plan("stage.planets=3:8:6")) == 2

    @pytest.mark.parametrize(
        "other", [{"measures": ("frequencies",)}, {"modes": 9}, {"settings": {BEARING: "2e8"}}]
    )
    def test_another_sweep_takes_no_points_of_this_one(self, monkeypatch, other):
        self.run(monkeypatch, self.plan("stage.planets=3,4,5"), 2)
        assert finished(self.plan("stage.planets=3,4,5", **other)) == 0

    def test_failed_points_are_tried_again(self, monkeypatch):
        plan = self.plan("stage.planets=3,4,5")
        measure = sweep.measured

        def unlucky(shared, case):
            if case.stages[0].planets == 4:
                raise FlexgearError("out of luck")
            return measure(shared, case)

        with monkeypatch.context() as patch:
            patch.setattr(sweep, "measured", unlucky)
            data = run_sweep(plan, workers=1, keep_points=True)
        assert data.attrs["failed"] == 1
        data, measured = self.run(monkeypatch, plan, 99)
        assert (measured, data.attrs["failed"]) == (1, 0)

    def test_damaged_points_are_made_again(self, monkeypatch):
        plan = self.plan("stage.planets=3,4,5,6,7")
        whole = run_sweep(plan, workers=1, keep_points=True)
        damaged = (b"", b"{", sealed(b"no pickle"), with_another_frequency)
        for file, content in zip(sorted(plan.store.folder.iterdir()), damaged, strict=False):
            stored = file.read_bytes()
            file.write_bytes(content if isinstance(content, bytes) else content(stored))
        assert finished(plan) == 1
        data, measured = self.run(monkeypatch, plan, 99)
        assert measured == 4
        xr.testing.assert_identical(data, whole)

    def test_every_measure_survives_the_disk(self, monkeypatch):
        for module in (solve_bodies, sweep):
            monkeypatch.setattr(module, "stage_bodies", lambda stage, *_: cheap_stage(stage))
        measures = measures_of(load_case("wind-5mw"))
        names = [name for name in measures if not name.startswith("transient")]  # too slow
        plan = planned("wind-5mw", dict([parse_setting("inputs.0.torque_nm=2e6")]), measures=names)
        whole = run_sweep(plan, workers=1, keep_points=True)
        data, measured = self.run(monkeypatch, plan, 99)
        assert measured == 0
        xr.testing.assert_identical(data, whole)


def test_power_grows_with_torque_and_life_falls_with_its_power():
    measures = ["powers", "torques", "speeds", "mean_forces", "bearing_life"]
    data = swept("pitch-drive", "inputs.0.power_kw=3.2,6.4,12.8", measures=measures)
    power = data["power"].sel(member="stage_1.sun")
    np.testing.assert_allclose(power, [3200, 6400, 12800])
    flow = power_flow(load_case("pitch-drive"))
    at = {"inputs.0.power_kw": 6.4}
    for member, torque in flow.branch_torque.items():
        assert float(data["torque"].sel(at).sel(member=member)) == torque
    force = data["mean_sun_gear_mesh_force"]
    np.testing.assert_allclose(force / force.sel(at), np.outer([0.5, 1, 2], np.ones(3)))
    for kind, exponent in (("ball", 3), ("roller", 10 / 3)):
        ratio = data["life_ratio"].sel(bearing=kind)
        np.testing.assert_allclose(ratio, np.outer([2**exponent, 1, 2**-exponent], np.ones(3)))


def test_a_failed_point_is_a_gap_with_its_message(tmp_path):
    path = write(tmp_path, ALONE)
    data = swept(path, "stage.planets=4,7,5", measures=["speeds"], settings=ROOM)
    assert data.attrs["failed"] == 1
    ((where, message),) = failures(data)
    assert where == "stage.planets = 7"
    assert "planets" in message
    assert np.isnan(data["speed"].sel({"stage.planets": 7})).all()
    assert not np.isnan(data["speed"].sel({"stage.planets": [4, 5]})).any()


class TestFlexibleStage:
    @pytest.fixture(autouse=True)
    def cheap(self, monkeypatch):
        """Bodies of springs; how often they are asked for."""
        self.made = []

        def bodies(stage, *_):
            self.made.append(stage)
            return cheap_stage(stage)

        monkeypatch.setattr(solve_bodies, "stage_bodies", lambda stage, *_: cheap_stage(stage))
        monkeypatch.setattr(sweep, "stage_bodies", bodies)

    def test_a_flexible_stage_in_a_train(self, tmp_path):
        path = write(tmp_path, FLEXIBLE)
        data = swept(path, "stages.stage_1.planet_bearing.radial_n_per_m=1e9,4e9",
                     measures=["frequencies", "gear_mesh_forces"], modes=4)  # fmt: skip
        assert failures(data) == []
        assert data.attrs["reductions"] == 1
        assert float(data["frequency"].diff(data["frequency"].dims[0]).max()) > 1e-3
        assert list(data["group"].to_numpy()) == ["stage_1 ring", "stage_1 sun"]

    def test_bodies_that_cannot_be_made_are_gaps(self, monkeypatch):
        def bodies(case, *_):
            if case.material.young_modulus > 2.05e11:
                raise FlexgearError("the mesh is broken")
            return cheap_stage(case)

        monkeypatch.setattr(sweep, "stage_bodies", bodies)
        data = swept("wind-5mw", "material.young_modulus_gpa=200,210", modes=3,
                     measures=["frequencies"])  # fmt: skip
        assert failures(data) == [("material.young_modulus_gpa = 210", "the mesh is broken")]


class TestLoadSharing:
    """Measures of load sharing against theorems and single runs."""

    PIN = "stage.errors.pin_tangential_um.0=0:40:3"

    def test_a_point_is_the_run_of_its_case(self, tmp_path):
        data = self.pins(tmp_path, 4, "0")
        train = stage_train(
            tmp_path, planets=4, **{"stage.errors.pin_tangential_um": "[40, 0, 0, 0]"}
        )
        alone = stages_sharing(assemble(train), "stage")
        point = data["load_sharing"].isel({data["load_sharing"].dims[0]: 2})
        np.testing.assert_array_equal(point, alone["load_sharing_coefficient"])
        forces = data["gear_mesh_force_max"].isel({data["load_sharing"].dims[0]: 2})
        assert float(forces.max()) == float(alone["cycle_maximum"].max())

    def pins(self, folder, planets, sun):
        stage_train(folder, planets=planets, sun=sun)
        measures = ["load_sharing", "gear_mesh_forces"]
        return swept(folder / "train.toml", self.PIN, measures=measures)

    def test_a_runout_moves_a_free_sun_by_itself(self, tmp_path):
        """A sun that floats on three planets turns its eccentricity away."""
        stage_train(tmp_path, planets=3)
        data = swept(tmp_path / "train.toml", "stage.errors.sun_eccentricity_um=0,10,20",
                     measures=["displacements"])  # fmt: skip
        sun = data["displacement"].sel(body="stage.sun", statistic="largest")
        np.testing.assert_allclose(sun[1:] - sun[0], [10e-6, 20e-6], rtol=1e-3)

    def test_transient_of_a_perfect_train_is_its_equilibrium(self, tmp_path):
        data = swept(
            "lin-parker", "inputs.0.torque_nm=100,200",
            settings={"solver.duration_s": "0.05", "solver.settle_s": "0.01"},
            measures=["transient_sharing", "transient_forces", "transient_displacements",
                      "mean_forces", "gear_mesh_forces"],
        )  # fmt: skip
        assert data.attrs["failed"] == 0
        np.testing.assert_allclose(data["transient_sharing"], 1.0, atol=1e-4)
        np.testing.assert_allclose(
            data["transient_force_max"], data["gear_mesh_force_max"], rtol=1e-4
        )
        mean = data["mean_sun_gear_mesh_force"].to_numpy()
        np.testing.assert_allclose(data["gear_mesh_force_max"].to_numpy(), mean + [[0, 0]])
        assert float(data["transient_displacement"].max()) < 1e-9

    def test_measures_in_time_leave_the_start_up_out(self, tmp_path):
        """A wave of stiffness that jumps sets a train going that was in equilibrium; what the sweep
        calls largest is that of the whole samples from the settled window on."""
        settings = {
            "stage.gear_mesh.model": '"fourier"', "stage.gear_mesh.sun_harmonic_shares": "[0.3]",
            "solver.duration_s": "0.2", "solver.settle_s": "0.1",
        }  # fmt: skip
        case = stage_train(tmp_path, planets=3, **settings)
        run = case.assemble().transient()
        data = swept(
            tmp_path / "train.toml", "inputs.0.torque_nm=3000", settings=settings,
            measures=["transient_forces"],
        )  # fmt: skip
        force = run["gear_mesh_force"].max("gear_mesh")
        largest = float(force.where(run["time"] >= 0.1).max())
        assert float(force.max()) > 1.001 * largest
        assert float(data["transient_force_max"].max()) == pytest.approx(largest, rel=1e-6)

    def test_nothing_to_share(self, tmp_path):
        with pytest.raises(FlexgearError, match="no stage that turns"):
            swept("lin-parker", "stage.planets=1", measures=["load_sharing"])
