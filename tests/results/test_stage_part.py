"""One flexible stage out of a dataset: the same numbers, whichever stages stand beside it."""

import h5py
import numpy as np
import pytest
import xarray as xr
from stage_samples import cheap_stage
from train_contexts import put_together
from trains import STEEL, write

from flexgear.model.load import load_case
from flexgear.results.dataset import save
from flexgear.results.dataset_file import open_lazily
from flexgear.results.result_quantities import RESULT_QUANTITIES
from flexgear.results.stage_part import stage_part, with_spread
from flexgear.solve.static import static

LARGE = {"tooth_displacement", "pair_load", "body_displacement"}
TWO = (
    STEEL
    + """
[[stages]]
name = "first"
case = "wind-5mw"
[[stages]]
name = "second"
case = "wind-5mw"
[[joints]]
first = "first.sun"
second = "second.carrier"
torsion_nm_per_rad = 1e9
axial_n_per_m = 1e8
[[inputs]]
member = "first.carrier"
speed_rpm = 2
torque_knm = 4000
[output]
member = "second.sun"
"""
)


@pytest.fixture(scope="module")
def two_stages(tmp_path_factory):
    """Equilibria of two flexible stages, one behind the other, both with errors."""
    folder = tmp_path_factory.mktemp("two")
    case = load_case(write(folder, TWO, 'kinematics = "spatial"\n'))
    first, second = (cheap_stage(stage) for stage in case.flexible_stages.values())
    return static(put_together(case, bodies=first | second), [0.0, 0.1, 0.2])


def flanks(data, stage, kind, sense):
    own = (data["flank_stage"] == stage) & (data["flank_kind"] == kind)
    return data.isel(flank=np.flatnonzero(own & (data["flank_sense"] == sense)))


def test_every_stage_has_its_own_numbers(two_stages):
    data = two_stages
    for number, name in enumerate(("first", "second")):
        part = stage_part(data, name)
        np.testing.assert_array_equal(part["carrier_angle"], data["stage_angle"][:, number])
        for kind in ("ring", "sun"):
            labels = [f"{name} {kind} {i}" for i in range(1, 6)]
            force = data["gear_mesh_force"].sel(gear_mesh=labels)
            np.testing.assert_array_equal(part[f"{kind}_gear_mesh_force"], force)
            for sense, word in (("drive", "pair"), ("coast", "coast_pair")):
                pairs = flanks(data, name, kind, sense)
                assert pairs["flank_planet"].values.tolist() == [1, 2, 3, 4, 5]
                for what in ("load", "tooth", "stiffness", "position"):
                    np.testing.assert_array_equal(
                        part[f"{kind}_{word}_{what}"], pairs[f"pair_{what}"]
                    )
        own = [f"{name}.planet_{i}" for i in range(1, 6)]
        motion = data["body_displacement"]
        np.testing.assert_array_equal(part["planet_displacement"], motion.sel(body=own))
        np.testing.assert_array_equal(part["sun_displacement"], motion.sel(body=f"{name}.sun"))
        teeth = data["tooth_displacement"].values[:, data["tooth_stage"].values == name]
        np.testing.assert_array_equal(part["tooth_displacement"], teeth)
        assert part["tooth"].values.tolist() == list(range(1, 94))
        node = data["carrier_displacement"].sel(carrier_node=f"{name}.pin_4")
        for found in (
            part["pin_displacement"].sel(planet=4),
            part["carrier_displacement"].sel(carrier_node="pin_4"),
        ):
            np.testing.assert_array_equal(found, node)
        bolts = data["bolt_force"].values[:, [str(b).startswith(name) for b in data["bolt"].values]]
        np.testing.assert_array_equal(part["bolt_force"], bolts)
        shared = data["load_sharing"].sel(group=f"{name} ring")
        np.testing.assert_array_equal(part["load_sharing"], shared)
    assert abs(stage_part(data, "first")["ring_pair_load"] - part["ring_pair_load"]).max() > 1.0


def test_the_pairs_of_both_flanks_add_up_to_the_gear_mesh_force(two_stages):
    for name in ("first", "second"):
        part = stage_part(two_stages, name)
        for kind in ("ring", "sun"):
            drive = part[f"{kind}_pair_load"].sum("slot")
            coast = part[f"{kind}_coast_pair_load"].sum("slot")
            np.testing.assert_allclose(part[f"{kind}_gear_mesh_force"], drive - coast)


def test_springs_of_a_stage_are_its_own_and_those_of_none(two_stages):
    """A joint belongs to no stage; all others are there once."""
    supports = [str(s) for s in two_stages["support"].values]
    parts = {n: stage_part(two_stages, n)["bearing"].values.tolist() for n in ("first", "second")}
    for name, found in parts.items():
        expected = [s for s in supports if s.startswith(f"{name}.") or "." not in s]
        assert found == [s.removeprefix(f"{name}.") for s in expected]
        force = stage_part(two_stages, name)["bearing_force"].values
        np.testing.assert_array_equal(force, two_stages["bearing_force"].sel(support=expected))


def test_every_variable_says_what_it_is(make_part):
    """In the words of the variable that it is of."""
    part = make_part()
    declared = [quantity.attrs for quantity in RESULT_QUANTITIES.values()]
    for name, variable in part.data_vars.items():
        assert variable.attrs in declared, name
    assert part["ring_pair_load"].attrs == RESULT_QUANTITIES["pair_load"].attrs
    assert part.attrs["rated_mean_force_n"] == 4e5
    assert part.attrs["content_hash"] == "abc"


def test_the_spread_is_that_of_the_forces(make_part):
    part = make_part()
    force = part["ring_gear_mesh_force"]
    spread = (force.max("planet") - force.min("planet")) / 4e5
    np.testing.assert_allclose(part["planet_force_spread"], spread)


def test_a_file_gives_the_same_and_is_not_read_before(two_stages, tmp_path, monkeypatch):
    save(two_stages, tmp_path / "two.nc")
    read, seen = h5py.Dataset.__getitem__, []

    def watched(variable, key):
        seen.append(variable.name.strip("/"))
        return read(variable, key)

    file = open_lazily(tmp_path / "two.nc")
    whole = file.load()
    for name in ("first", "second"):
        file = open_lazily(tmp_path / "two.nc")
        with monkeypatch.context() as patch:
            patch.setattr(h5py.Dataset, "__getitem__", watched)
            seen.clear()
            part = stage_part(file, name)
            assert not LARGE & set(seen)
            part.load()
            assert set(seen) >= LARGE
        xr.testing.assert_identical(part, stage_part(whole, name))
        assert with_spread(part)["planet_force_spread"].notnull().all()


def test_what_a_dataset_does_not_hold_is_left_out(make_run):
    bare = make_run()[["gear_mesh_force", "rated_gear_mesh_force"]]
    assert set(stage_part(bare, "stage")) == {"ring_gear_mesh_force", "sun_gear_mesh_force"}
