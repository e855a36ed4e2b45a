"""Tip relief: where it is on the path, its mean over a helical contact line, and its refusals."""

import numpy as np
import pytest
from trains import stage_train

from flexgear.gears.modifications import mean_gap, pair_gap
from flexgear.gears.paths import stage_paths
from flexgear.model.errors import InputError

RELIEF = {"amount_um": "40", "length_mm": "6"}


def relieved(folder, gear, form="linear", **changes):
    relief = {f"stage.{gear}.tip_relief.{k}": v for k, v in RELIEF.items()}
    relief[f"stage.{gear}.tip_relief.form"] = f'"{form}"'
    relief["stage.gear_mesh.model"] = '"per_pair"'
    return stage_train(folder, **{**relief, **changes})


def paths(train):
    view = train.view(train.stages[0].name)
    return stage_paths(view, {"sun": 1e4, "ring": 1e4})


@pytest.mark.parametrize(("form", "power"), [("linear", 1), ("parabolic", 2)])
@pytest.mark.parametrize("gear", ["planet", "sun", "ring"])
def test_relief_of_a_spur_gear_rises_from_its_start_to_its_tip(tmp_path, gear, form, power):
    """The planet's tip is at the end of the path with the largest s, those of sun and ring at the
    other; both flanks have it, other gear meshes do not."""
    found = paths(relieved(tmp_path, gear, form))
    for (kind, _), path in found.items():
        if gear not in ("planet", kind.removesuffix("_back")):
            assert not path.gap_grid.any()
            continue
        tip = path.s_hi if gear == "planet" else path.s_lo
        left = np.clip(1 - np.abs(path.s_grid - tip) / 6e-3, 0, 1)
        np.testing.assert_allclose(path.gap_grid, 40e-6 * left**power, rtol=0, atol=1e-12)
        assert path.gap_grid.max() == pytest.approx(40e-6, rel=1e-9)


def test_mean_gap_over_a_helical_contact_line():
    """Even stiffness, gap x on a path 0 … 1: the mean of x over what is inside, times cosβ."""
    s, slope, half = np.array([-0.05, 0.3, 0.5, 1.02]), 0.4, 0.25
    of_pair = pair_gap([(lambda rho, z: rho, lambda s: s)], slope)
    gap = mean_gap(s, np.ones_like, (0.0, 1.0), slope, half, of_pair)
    low, high = np.clip(s - 0.1, 0, 1), np.clip(s + 0.1, 0, 1)
    expected = 0.5 * (low + high) / np.hypot(1.0, slope)
    np.testing.assert_allclose(gap, expected, rtol=0, atol=1.5e-3)
    inside = slice(1, 3)
    np.testing.assert_allclose(gap[inside], expected[inside], rtol=1e-12)


def test_what_tip_relief_does_not_fit(tmp_path):
    with pytest.raises(InputError, match=r"planet\.tip_relief\.length: .* longer than the path"):
        paths(relieved(tmp_path, "planet", **{"stage.planet.tip_relief.length_mm": "100"}))
    with pytest.raises(InputError, match="'constant' follows no pair along its path"):
        paths(relieved(tmp_path, "sun", **{"stage.gear_mesh.model": '"constant"'}))
