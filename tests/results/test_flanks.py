"""Which flank carries: the same run with its flanks exchanged has the same figures."""

import numpy as np
import pytest
import xarray as xr

from flexgear.model.errors import FlexgearError
from flexgear.results.flanks import carrying_flank, carrying_pairs, coast_carries, tooth_loads
from flexgear.results.stage_part import stage_part
from flexgear.results.summary import torque_step_summary


@pytest.fixture
def both_runs(make_run):
    """A run whose drive flanks carry, and the same with coast flanks in their place."""
    drive = stage_part(make_run(), "stage")
    load, tooth = (drive[f"ring_pair_{n}"].to_numpy() for n in ("load", "tooth"))
    shifted = np.where(tooth > 0, (tooth + 3) % 93 + 1, 0).astype(np.int16)
    spare = {"ring_coast_pair_load": 0 * load, "ring_coast_pair_tooth": shifted}
    spare |= {"sun_coast_pair_load": 0 * load, "sun_coast_pair_tooth": shifted}
    run = make_run(**spare)
    ahead, turned = stage_part(run, "stage"), {}
    for gear in ("ring", "sun"):
        for part in ("load", "tooth"):
            one, other = f"{gear}_pair_{part}", f"{gear}_coast_pair_{part}"
            turned |= {one: ahead[other].to_numpy(), other: ahead[one].to_numpy()}
    turned["ring_gear_mesh_force"] = -ahead["ring_gear_mesh_force"].to_numpy()
    return run, make_run(**turned)


@pytest.fixture
def both_flanks(both_runs):
    """The same in the words of a stage."""
    return tuple(stage_part(run, "stage") for run in both_runs)


def test_exchanged_flanks_have_the_same_figures(both_flanks, both_runs):
    ahead, back = both_flanks
    for gear in ("ring", "sun"):
        a, b = (carrying_pairs(d, gear) for d in both_flanks)
        assert set(a) == {"load", "tooth"}
        xr.testing.assert_equal(a.drop_attrs(), b.drop_attrs())
        assert a["tooth"].dtype == np.int16
        assert carrying_flank(ahead, gear) == "drive"
        assert carrying_flank(back, gear) == "coast"
    assert tooth_loads(back, "ring").min() > 0
    one, other = (torque_step_summary(run, "stage") for run in both_runs)
    assert other == one


def test_flanks_may_take_turns(both_flanks):
    ahead, back = both_flanks
    turning = xr.concat([ahead.isel(time=slice(5)), back.isel(time=slice(5, None))], "time")
    assert carrying_flank(turning, "ring") == "drive and coast"
    expected = np.broadcast_to(np.arange(20)[:, None] >= 5, (20, 5))
    np.testing.assert_array_equal(coast_carries(turning, "ring"), expected)
    xr.testing.assert_equal(
        carrying_pairs(turning, "ring").drop_attrs(), carrying_pairs(ahead, "ring").drop_attrs()
    )


def test_without_load_the_drive_flank_is_shown(both_flanks):
    ahead = both_flanks[0]
    empty = ahead.assign(ring_pair_load=0 * ahead["ring_pair_load"])
    assert carrying_flank(empty, "ring") == "none"
    np.testing.assert_array_equal(carrying_pairs(empty, "ring")["tooth"], ahead["ring_pair_tooth"])


def test_linear_contact_pulls_on_its_only_flank(make_part):
    data = make_part()
    pulled = data.assign(ring_pair_load=-data["ring_pair_load"])
    assert carrying_flank(pulled, "ring") == "drive"
    assert tooth_loads(pulled, "ring").max() < 0


def test_a_dataset_without_pairs_is_named(make_part):
    with pytest.raises(FlexgearError, match="no tooth pairs of the sun"):
        carrying_pairs(make_part().drop_vars("sun_pair_load"), "sun")
