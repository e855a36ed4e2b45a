"""Figures of a summary as bars: labels, unit, values."""

import numpy as np

from flexgear.results.figure import Bars, Figure
from flexgear.results.stage_figures import LIVES
from flexgear.views.charts import figure_bars

STRESS = Figure(
    "stress_mpa", "MPa", "stress", bars=Bars("face", "stress", "Stress", "A bar a stage.")
)


def drawn(figure, stages):
    ax = figure_bars(figure, stages).axes[0]
    labels = [text.get_text() for text in ax.get_yticklabels()]
    return labels, [bar.get_width() for bar in ax.patches], ax.get_xlabel()


def test_a_bar_for_every_name_of_every_stage():
    lives = {"first": {"planet_bearing_1": 2e4, "planet_bearing_2": 3e4}, "second": {"far": 1e5}}
    labels, sizes, axis = drawn(LIVES[0], lives)
    assert labels == ["first planet bearing 1", "first planet bearing 2", "second far"]
    assert sizes == [2e4, 3e4, 1e5]
    assert axis == "basic rating life (h)"


def test_a_bar_a_stage_in_the_unit_that_reads_well():
    labels, sizes, axis = drawn(STRESS, {"stage": 1500.0})
    np.testing.assert_allclose(sizes, [1.5])
    assert (labels, axis) == (["stage"], "stress (GPa)")
