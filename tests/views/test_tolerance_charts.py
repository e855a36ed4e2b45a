"""The picture of a tolerance study: what is drawn, and what it says."""

import numpy as np
import pytest
from tolerance_results import study_data

from flexgear.model.errors import FlexgearError
from flexgear.views.study_charts import tolerance_chart
from flexgear.views.style import save_figure


def words(figure):
    legends = [t.get_text() for legend in figure.legends for t in legend.get_texts()]
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    inside = [t.get_text() for ax in figure.axes for t in ax.texts]
    return "\n".join([figure.get_suptitle(), *titles, *legends, *inside])


def test_equal_groups_are_drawn_once_and_constant_ones_said(tmp_path):
    data = study_data(count=400)
    figure = tolerance_chart(data)
    assert len(figure.axes) == 2
    said = words(figure)
    assert "stage 1 ring and sun" in said
    assert "stage 2 ring: 1.000000 in all of them" in said
    median = float(data["load_sharing_quantile"].sel(group="stage_1 ring", quantile=0.5))
    assert f"50 %: {median:.4f}" in said
    assert "95 % band" in said and "IEC 61400-4" in said and "as stated" in said
    assert save_figure(figure, tmp_path / "a.png").stat().st_size > 10_000


def test_histogram_holds_every_sample():
    figure = tolerance_chart(study_data(count=400, gaps=[1, 2]))
    assert sum(patch.get_height() for patch in figure.axes[0].containers[0]) == 398


def test_the_band_rises_and_holds_the_samples():
    figure = tolerance_chart(study_data(count=60))
    steps = next(line for line in figure.axes[1].lines if len(line.get_xdata()) == 60)
    assert np.all(np.diff(steps.get_ydata()) > 0)
    band = figure.axes[1].collections[0].get_paths()[0].vertices
    assert band[:, 1].min() < 1 / 60 and band[:, 1].max() <= 1.0


def test_all_samples_equal(tmp_path):
    data = study_data().sel(group=["stage_2 ring"])
    figure = tolerance_chart(data)
    assert "1.000000 in all 50 samples" in words(figure)
    save_figure(figure, tmp_path / "a.png")


def test_nothing_to_draw():
    with pytest.raises(FlexgearError, match="no sample has an equilibrium"):
        tolerance_chart(study_data(gaps=list(range(50))))
