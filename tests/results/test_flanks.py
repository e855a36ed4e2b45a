"""Which flank carries, its tooth pairs, and their loads by stiffness."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flexgear.model.errors import FlexgearError
from flexgear.results.quantities import values
from flexgear.results.stage_part import (
    carrying_pairs,
    flank_histories,
    flank_names,
    of_kind,
    pairs_of,
    stage_part,
    stiffness_split,
    tooth_loads,
)
from flexgear.results.time_figures import STAGE_DROP, StageDrop


@pytest.fixture
def both_runs(make_run):
    """A run whose drive flanks carry, and the same with coast flanks in their place."""
    drive = pairs_of(stage_part(make_run(), "stage"), "ring", "drive")
    load, tooth = (drive[n].to_numpy() for n in ("load", "tooth"))
    shifted = np.where(tooth > 0, (tooth + 3) % 93 + 1, 0).astype(np.int16)
    spare = {"ring_coast_pair_load": 0 * load, "ring_coast_pair_tooth": shifted}
    spare |= {"sun_coast_pair_load": 0 * load, "sun_coast_pair_tooth": shifted}
    run = make_run(**spare)
    ahead, turned = stage_part(run, "stage"), {}
    for gear in ("ring", "sun"):
        for part in ("load", "tooth"):
            one, other = f"{gear}_pair_{part}", f"{gear}_coast_pair_{part}"
            turned[one] = pairs_of(ahead, gear, "coast")[part].to_numpy()
            turned[other] = pairs_of(ahead, gear, "drive")[part].to_numpy()
    turned["ring_gear_mesh_force"] = -of_kind(ahead, "ring")["gear_mesh_force"].to_numpy()
    return run, make_run(**turned)


@pytest.fixture
def both_flanks(both_runs):
    """The same of the stage alone."""
    return tuple(stage_part(run, "stage") for run in both_runs)


def test_exchanged_flanks_have_the_same_figures(both_flanks, both_runs):
    ahead, back = both_flanks
    for gear in ("ring", "sun"):
        a, b = (carrying_pairs(d, gear) for d in both_flanks)
        assert set(a) == {"load", "tooth"}
        xr.testing.assert_equal(a.drop_attrs(), b.drop_attrs())
        assert a["tooth"].dtype == np.int16
        assert flank_names(flank_histories(ahead, gear)) == "drive"
        assert flank_names(flank_histories(back, gear)) == "coast"
    assert tooth_loads(back, "ring").min() > 0
    one, other = (values(STAGE_DROP, StageDrop(run, "stage")) for run in both_runs)
    assert other == one


def test_flanks_may_take_turns(both_flanks):
    ahead, back = both_flanks
    turning = xr.concat(
        [ahead.isel(time=slice(5)), back.isel(time=slice(5, None))], "time", data_vars="minimal"
    )
    assert flank_names(flank_histories(turning, "ring")) == "drive and coast"
    expected = np.broadcast_to(np.arange(20)[:, None] >= 5, (20, 5))
    np.testing.assert_array_equal(flank_histories(turning, "ring")["coast"], expected)
    xr.testing.assert_equal(
        carrying_pairs(turning, "ring").drop_attrs(), carrying_pairs(ahead, "ring").drop_attrs()
    )


def test_without_load_the_drive_flank_is_shown(both_flanks):
    ahead = both_flanks[0]
    empty = ahead.assign(pair_load=0 * ahead["pair_load"])
    assert flank_names(flank_histories(empty, "ring")) == "none"
    drive = pairs_of(ahead, "ring", "drive")["tooth"]
    np.testing.assert_array_equal(carrying_pairs(empty, "ring")["tooth"], drive)


def test_linear_contact_pulls_on_its_only_flank(make_part):
    data = make_part()
    pulled = data.assign(pair_load=-data["pair_load"])
    assert flank_names(flank_histories(pulled, "ring")) == "drive"
    assert tooth_loads(pulled, "ring").max() < 0


def test_a_dataset_without_pairs_is_named(make_part):
    with pytest.raises(FlexgearError, match="no tooth pairs of the sun"):
        carrying_pairs(of_kind(make_part(), "ring"), "sun")


POSITIVE = st.floats(1.0, 1e9)


def test_split_of_a_load_by_stiffness_by_hand():
    np.testing.assert_allclose(
        stiffness_split([[30.0, 60.0, 0.0]], [[1.0, 2.0, 6.0]]), [[10, 20, 60]]
    )


def test_no_pair_no_load():
    assert (stiffness_split(np.zeros((2, 4)), np.zeros((2, 4))) == 0).all()


@given(arrays(float, (3, 4), elements=POSITIVE), arrays(float, (3, 4), elements=POSITIVE))
def test_sum_is_kept_and_split_again_changes_nothing(load, stiffness):
    parts = stiffness_split(load, stiffness)
    np.testing.assert_allclose(parts.sum(-1), load.sum(-1), rtol=1e-12)
    np.testing.assert_allclose(stiffness_split(parts, stiffness), parts, rtol=1e-12)
