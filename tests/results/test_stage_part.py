"""One flexible stage out of a dataset: the same numbers, whichever stages stand beside it."""

import h5py
import numpy as np
import pytest
import xarray as xr
from stage_samples import cheap_stage
from train_contexts import TWO_FLEXIBLE, put_together
from trains import write

from flexgear.model.load import load_case
from flexgear.results.dataset_file import open_lazily, save
from flexgear.results.stage_part import (
    displacement_of,
    of_kind,
    pairs_of,
    ring_force_spread,
    ring_sharing,
    stage_part,
)
from flexgear.solve.static import static

LARGE = {"tooth_displacement", "pair_load", "body_displacement"}


@pytest.fixture(scope="module")
def two_stages(tmp_path_factory):
    """Equilibria of two flexible stages, one behind the other, both with errors."""
    folder = tmp_path_factory.mktemp("two")
    case = load_case(write(folder, TWO_FLEXIBLE, 'kinematics = "spatial"\n'))
    first, second = (cheap_stage(stage) for stage in case.flexible_stages.values())
    return static(put_together(case, bodies=first | second), [0.0, 0.1, 0.2])


def test_every_stage_has_its_own_entries_under_their_own_names(two_stages):
    data = two_stages
    for number, name in enumerate(("first", "second")):
        part = stage_part(data, name)
        assert set(part) == set(data)
        np.testing.assert_array_equal(part["stage_angle"], data["stage_angle"][:, number])
        for dim, coordinate in (
            ("gear_mesh", "stage"),
            ("flank", "flank_stage"),
            ("tooth", "tooth_stage"),
        ):
            expected = data[dim].values[data[coordinate].values == name]
            np.testing.assert_array_equal(part[dim], expected)
        for dim in ("body", "bolt", "carrier_node", "bearing"):
            assert {str(n).partition(".")[0] for n in part[dim].values} == {name}
            assert part.sizes[dim] == data.sizes[dim] / 2
        for kind in ("ring", "sun"):
            labels = [f"{name} {kind} {i}" for i in range(1, 6)]
            force = data["gear_mesh_force"].sel(gear_mesh=labels)
            np.testing.assert_array_equal(of_kind(part, kind)["gear_mesh_force"], force)
            for sense in ("drive", "coast"):
                flanks = [f"{label} {sense}" for label in labels]
                for what, values in pairs_of(part, kind, sense).items():
                    np.testing.assert_array_equal(values, data[f"pair_{what}"].sel(flank=flanks))
        planets = [f"{name}.planet_{i}" for i in range(1, 6)]
        motion = data["body_displacement"]
        np.testing.assert_array_equal(displacement_of(part, "planet"), motion.sel(body=planets))
        np.testing.assert_array_equal(displacement_of(part, "sun"), motion.sel(body=f"{name}.sun"))
        shared = data["load_sharing"].sel(group=f"{name} ring")
        np.testing.assert_array_equal(ring_sharing(part), shared)
    first = stage_part(data, "first")["pair_load"].values
    assert abs(first - part["pair_load"].values).max() > 1.0


def test_the_pairs_of_both_flanks_add_up_to_the_gear_mesh_force(two_stages):
    for name in ("first", "second"):
        part = stage_part(two_stages, name)
        for kind in ("ring", "sun"):
            drive, coast = (pairs_of(part, kind, s)["load"].sum("slot") for s in ("drive", "coast"))
            np.testing.assert_allclose(of_kind(part, kind)["gear_mesh_force"], drive - coast)


def test_springs_of_a_stage_are_its_own_and_those_of_none(two_stages):
    """A joint belongs to no stage; all others are there once."""
    supports = [str(s) for s in two_stages["support"].values]
    for name in ("first", "second"):
        expected = [s for s in supports if s.startswith(f"{name}.") or "." not in s]
        assert stage_part(two_stages, name)["support"].values.tolist() == expected


def test_the_spread_is_that_of_the_forces(make_part):
    part = make_part()
    force = of_kind(part, "ring")["gear_mesh_force"]
    spread = (force.max("gear_mesh") - force.min("gear_mesh")) / 4e5
    np.testing.assert_allclose(ring_force_spread(part), spread)


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
        assert ring_force_spread(part).notnull().all()
