"""Tooth loads: eq. 23, curves that break between engagements, the engagement map."""

import numpy as np
import pytest
import xarray as xr

from flexgear.model.errors import FlexgearError
from flexgear.views import histories
from flexgear.views.select import within_window
from flexgear.views.style import SPLIT_COLOUR, VARIANT_COLOURS


def test_pair_curve_follows_a_tooth_through_its_slots_and_breaks_between_engagements():
    x = np.arange(6.0)
    tooth = np.array([[1, 0], [0, 1], [2, 0], [2, 0], [1, 2], [0, 1]])
    value = np.array([[10, 99], [99, 11], [20, 99], [21, 99], [12, 22], [99, 13]], dtype=float)
    curves = histories.pair_curves(x, tooth, value)
    np.testing.assert_array_equal(curves[1][1], [10, 11, np.nan, 12, 13])
    np.testing.assert_array_equal(curves[2][0], [2, 3, 4])
    np.testing.assert_array_equal(curves[2][1], [20, 21, 22])


def test_engagement_spans():
    tooth = np.array([[1, 0], [1, 2], [0, 2], [1, 0]])
    spans = histories.engagements(np.array([0.0, 1.0, 2.0, 3.0]), tooth)
    np.testing.assert_array_equal(spans, [[1, 0, 1], [1, 3, 3], [2, 1, 2]])


@pytest.mark.parametrize(("x", "label"), [("stage_angle", "(rad)"), ("time", "(s)")])
def test_pair_loads_overlays_variants_and_split(steady, x, label):
    figure = histories.pair_loads(within_window(steady, x, (1.0, 1.5)), "ring", x=x)
    ax = figure.axes[0]
    drawn = {line.get_color() for line in ax.get_lines()}
    assert {SPLIT_COLOUR, *VARIANT_COLOURS.values()} <= drawn
    assert ax.get_ylabel().endswith("(kN)")
    assert ax.get_xlabel().endswith(label)
    highest = max(np.nanmax(line.get_ydata()) for line in ax.get_lines())
    assert 300 < highest < 800  # kN, not N


def test_engagement_map_shows_all_planets_and_stiffness_in_n_per_um(steady):
    figure = histories.engagement_map(steady["flexible"])
    assert len(figure.axes[0].collections) == 5
    mesh = figure.axes[2].collections[0]
    assert np.nanmax(mesh.get_array()) == pytest.approx(4000, rel=1e-3)
    assert any("N/µm" in ax.get_ylabel() for ax in figure.axes)


def test_wrong_choices_are_one_clear_line(steady):
    with pytest.raises(FlexgearError, match="no tooth pairs of the sun"):
        histories.pair_loads(steady, "sun")
    with pytest.raises(FlexgearError, match="nothing to draw between"):
        within_window(steady, "stage_angle", (80.0, 90.0))


def test_reversed_torque_draws_the_coast_flanks(steady):
    """The same loads and teeth on the other flank make the same curves, and the title says so."""
    ahead = steady["flexible"]
    unloaded = ahead.assign({n: 0 * ahead[n] for n in ahead if str(n).startswith("pair_")})
    labels = [str(n).replace("drive", "coast") for n in ahead["flank"].values]
    coast = ahead.assign_coords(flank=labels, flank_sense=("flank", ["coast"] * len(labels)))
    back = xr.concat([unloaded, coast], "flank", data_vars="minimal")
    one, other = (
        histories.pair_loads(within_window({"flexible": d}, "stage_angle", (1.0, 1.5))).axes[0]
        for d in (ahead, back)
    )
    for a, b in zip(one.get_lines(), other.get_lines(), strict=True):
        np.testing.assert_array_equal(a.get_ydata(), b.get_ydata())
    assert "coast flank" in other.get_title(loc="left")
    assert "flank" not in one.get_title(loc="left")
    assert len(histories.engagement_map(back).axes[0].collections) == 5
