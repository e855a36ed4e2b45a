"""Pictures of parameter and tolerance studies."""

import numpy as np
import pytest
import xarray as xr
from tolerance_results import study_data

from flexgear.model.errors import FlexgearError
from flexgear.views.mode_charts import TYPE_COLOURS
from flexgear.views.study_charts import tolerance_chart
from flexgear.views.style import save_figure
from flexgear.views.sweep_charts import drawn_variables, scale_of, sweep_chart


def key(name, values, units="", logarithmic=0):
    about = {"units": units, "long_name": name, "logarithmic": logarithmic}
    return xr.Variable((name,), values, about)


def field(values, units="N", **labels):
    """A variable over key a (and b), with further labels."""
    dims = ("a", "b")[: np.ndim(values) - len(labels)] + tuple(labels)
    return xr.Variable(dims, values, {"units": units, "long_name": "what it is"})


def study(variables, keys, **labels):
    shape = [v.size for v in keys]
    data = xr.Dataset(variables, {v.dims[0]: v for v in keys} | labels)
    return data.assign(message=([v.dims[0] for v in keys], np.full(shape, "")))


A = key("a", [3.0, 1.0, 2.0], "mm")


def lines_of(figure, panel=0):
    return figure.axes[panel].get_lines()


def test_one_key_is_sorted_and_in_the_units_of_the_picture():
    data = study({"force": field([3e4, 1e4, 2e4])}, [A])
    figure = sweep_chart(data, "force")
    (line,) = lines_of(figure)
    np.testing.assert_allclose(line.get_xydata(), [[1, 10], [2, 20], [3, 30]])
    assert figure.axes[0].get_xlabel() == "a (mm)"
    assert figure.axes[0].get_ylabel() == "force (kN)"


@pytest.mark.parametrize(
    ("units", "values", "expected"),
    [
        ("m", [1e-6], (1e6, "µm")),
        ("N", [30.0], (1.0, "N")),
        ("N m", [5e6], (1e-6, "MN m")),
        ("W", [-4e3], (1e-3, "kW")),
        ("1", [1.0], (1.0, "–")),
        ("Hz", [1e5], (1.0, "Hz")),
        ("rad/s", [1.0], (30 / np.pi, "r/min")),
    ],
)
def test_axes_have_the_unit_that_suits_their_values(units, values, expected):
    factor, unit = scale_of(xr.DataArray(values, attrs={"units": units}))
    assert unit == expected[1]
    assert factor == pytest.approx(expected[0])


def test_lines_by_label_panels_by_the_labels_before():
    values = np.arange(12.0).reshape(3, 2, 2) + 1
    data = study(
        {"k": field(values, "1", definition=0, group=0)}, [A],
        definition=["x", "y"], group=["stage_1 ring", "stage_1 sun"],
    )  # fmt: skip
    figure = sweep_chart(data, "k")
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["x", "y"]
    assert [len(lines_of(figure, p)) for p in (0, 1)] == [2, 2]
    labels = [t.get_text() for t in figure.legends[0].get_texts()]
    assert labels == ["stage 1 ring", "stage 1 sun"]


def test_lines_that_cover_each_other_take_turns():
    values = np.ones((3, 2))
    data = study({"k": field(values, "1", group=0)}, [A], group=["p", "q"])
    figure = sweep_chart(data, "k")
    first, second = lines_of(figure)
    assert first.get_linestyle() == "-"
    assert second.get_linestyle() == "--"
    assert [line.get_linestyle() for line in figure.legends[0].get_lines()] == ["-", "-"]


def test_lines_that_are_nothing_are_left_out():
    values = np.array([[1.0, 0.0], [2.0, 1e-15], [3.0, 0.0]])
    data = study({"k": field(values, "1", body=0)}, [A], body=["p", "q"])
    assert len(lines_of(sweep_chart(data, "k"))) == 1


def test_modes_are_marked_by_type():
    kinds = np.array([["planet", "axial"]] * 3)
    data = study(
        {
            "frequency": field(np.array([[100.0, 200], [110, 210], [120, 220]]), "Hz", mode=0),
            "mode_type": field(kinds, "", mode=0),
        },
        [A], mode=[1, 2],
    )  # fmt: skip
    assert drawn_variables(data) == ["frequency"]
    figure = sweep_chart(data, "frequency")
    labels = {t.get_text() for t in figure.legends[0].get_texts()}
    assert labels == {"planet", "axial"}
    marked = [line for line in lines_of(figure) if line.get_color() == TYPE_COLOURS["axial"]]
    np.testing.assert_allclose(marked[0].get_xydata(), [[1, 210], [2, 220], [3, 200]])


def test_few_values_of_a_second_key_are_lines():
    b = key("b", [4.0, 5.0], "kN")
    data = study({"k": field(np.arange(6.0).reshape(3, 2) + 1, "1")}, [A, b])
    figure = sweep_chart(data, "k")
    assert len(lines_of(figure)) == 2
    legend = figure.legends[0]
    assert legend.get_title().get_text() == "b (kN)"
    assert [t.get_text() for t in legend.get_texts()] == ["4 kN", "5 kN"]


def test_many_values_of_a_second_key_are_a_map_with_white_gaps():
    b = key("b", np.geomspace(1, 1e4, 9), "Hz", 1)
    values = np.outer([3.0, 1, 2], np.arange(1.0, 10))
    values[0, 4] = np.nan
    data = study({"k": field(values, "m")}, [A, b])
    data["message"][0, 4] = "it broke"
    figure = sweep_chart(data, "k")
    image = figure.axes[0].collections[0]
    assert image.get_array().shape == (9, 3)
    assert np.ma.count_masked(image.get_array()) == 1
    np.testing.assert_allclose(image.get_array()[:, 0], 1e6 * np.arange(1.0, 10))  # a sorted
    assert figure.axes[0].get_yscale() == "log"
    assert figure.axes[1].get_ylabel() == "k (µm)"
    assert "1 of 27 points failed" in figure.get_suptitle()


def test_a_logarithmic_range_and_words():
    data = study({"k": field([1.0, 2, 3], "1")}, [key("a", [1.0, 10, 100], "N/m", 1)])
    assert sweep_chart(data, "k").axes[0].get_xscale() == "log"
    data = study({"k": field([1.0, 2, 3], "1")}, [key("a", ["one", "two", "three"])])
    ax = sweep_chart(data, "k").axes[0]
    assert [t.get_text() for t in ax.get_xticklabels()] == ["one", "two", "three"]


def test_a_constant_is_not_blown_up_to_noise():
    data = study({"k": field([1.0, 1 + 1e-12, 1], "1")}, [A])
    low, high = sweep_chart(data, "k").axes[0].get_ylim()
    assert high - low == pytest.approx(0.01)


def test_three_keys_have_no_picture():
    data = study(
        {"k": xr.Variable(("a", "b", "c"), np.zeros((3, 1, 1)), {"units": "1"})},
        [A, key("b", [1.0]), key("c", [1.0])],
    )
    with pytest.raises(FlexgearError, match="3 keys"):
        sweep_chart(data, "k")


def words(figure):
    legends = [t.get_text() for legend in figure.legends for t in legend.get_texts()]
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    inside = [t.get_text() for ax in figure.axes for t in ax.texts]
    return "\n".join([figure.get_suptitle(), *titles, *legends, *inside])


def test_equal_groups_are_drawn_once_and_constant_ones_said(tmp_path):
    data = study_data(count=400)
    figure = tolerance_chart(data)
    assert len(figure.axes) == 2
    text = words(figure)
    assert "stage 1 ring and sun" in text
    assert "stage 2 ring: 1.000000 in all of them" in text
    median = float(data["load_sharing_quantile"].sel(group="stage_1 ring", quantile=0.5))
    assert f"50 %: {median:.4f}" in text
    assert "95 % band" in text and "IEC 61400-4" in text and "as stated" in text
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
