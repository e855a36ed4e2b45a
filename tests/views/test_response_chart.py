"""The picture of responses with all branches: what its lines, marks and legend are of."""

import json

import numpy as np
import pytest
import xarray as xr

from flexgear.model.load import load_case
from flexgear.views.interactive import panels_of
from flexgear.views.vibration_charts import FORCE, response_chart


@pytest.fixture
def curve():
    """A resonance that leans over: stable up to a turning point at 1.2, unstable back to one at 0.9
    and stable beyond, with teeth that part on the upper two branches."""
    share = np.concatenate(
        [np.linspace(0.5, 1.2, 8), np.linspace(1.1, 0.9, 5), np.linspace(1, 2, 9)]
    )
    force = 1e3 * np.linspace(3.0, 8.0, len(share))
    stable = np.repeat([1, 0, 1], [8, 5, 9])
    measures = np.stack([force, 0.2 * force, 0.6 * force, 0.1 * force], axis=-1)[:, None]
    points = {"response_speed_share": share, "stable": stable, "response_branch": 0 * stable + 1}
    data = {name: ("point", values) for name, values in points.items()}
    of_mesh = ("point", "gear_mesh", "measure")
    data |= {"response_gear_mesh_force": (of_mesh, measures)}
    data |= {"response_transmission_error": (of_mesh, 1e-9 * measures)}
    parted = (np.arange(len(share)) >= 8)[:, None] * 0.3
    data |= {
        "lost_contact_share": (of_mesh[:2], parted),
        "back_contact_share": (of_mesh[:2], 0 * parted),
    }
    turning = {"parameter": [1.2, 0.9], "force": [5e3, 6e3], "sense": [1, -1],
               "target_force": [[4e3, 7e3], [np.nan, np.nan]]}  # fmt: skip
    dims = "turning_point", "target"
    data |= {f"turning_point_{k}": (dims[: np.ndim(v)], v) for k, v in turning.items()}
    data |= {"stability_change_parameter": ("stability_change", [1.2, 0.9]),
             "stability_change_kind": ("stability_change", [0, 0])}  # fmt: skip
    coords = {"gear_mesh": ["pair sun 1"], "measure": ["maximum", "minimum", "mean", "rms"]}
    attrs = {"over": "speed", "harmonics": 20, "without_contact": "teeth lose contact"}
    case = json.dumps(load_case("lin-parker").to_dict())
    return xr.Dataset(data, coords, {**attrs, "parameters": case})


def test_unstable_states_are_dashed_and_jumps_are_marked(curve):
    figure = response_chart(curve)
    force, error = figure.axes
    dashed = [line for line in force.lines if line.get_linestyle() == "--"]
    x = np.concatenate([line.get_xdata() for line in dashed])
    assert x.min() == 0.9 and x.max() <= 1.1
    marks = {
        line.get_marker(): line.get_xdata()[0] for line in force.lines if len(line.get_xdata()) == 1
    }
    assert marks == {">": 1.2, "<": 0.9}
    assert len(force.texts) == 2  # an arrow to each stable state, none where there is none
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["pair sun 1", "stable", "unstable", "teeth lose contact",
                      "jump as speed rises", "jump as speed falls"]  # fmt: skip
    assert force.get_ylim()[1] > 8.0 > 0.9 * force.get_ylim()[1]
    assert [len(panel["data"]) > 3 for panel in panels_of(figure)] == [True, True]
    assert np.ptp(error.get_ylim()) > 0.0
    assert force.get_ylabel().startswith("gear-mesh force (kN)")
    names = FORCE, "turning_point_force", "turning_point_target_force"
    small = response_chart(curve.assign({n: 0.1 * curve[n] for n in names})).axes[0]
    assert small.get_ylabel().startswith("gear-mesh force (N)")  # 800 N, jumps at 500 and 600 N
    assert small.get_ylim()[1] > 800.0 > 0.9 * small.get_ylim()[1]
    jumps = [line.get_ydata()[0] for line in small.lines if len(line.get_xdata()) == 1]
    assert jumps == pytest.approx([500.0, 600.0])


@pytest.mark.parametrize(("stable", "label"), [(1, "stable"), (0, "unstable")])
def test_the_legend_has_what_is_drawn(curve, stable, label):
    curve["stable"][:] = stable
    labels = [text.get_text() for text in response_chart(curve).legends[0].get_texts()]
    assert [x for x in labels if "stable" in x] == [label]


def test_curves_of_two_gear_meshes_have_beads(curve):
    curve["response_branch"][{"point": slice(13, None)}] = 2
    curve["response_period"] = curve["response_branch"]
    figure = response_chart(curve)
    beads = [x for x in figure.axes[0].lines if x.get_marker() == "o"]
    x = np.concatenate([line.get_xdata() for line in beads])
    assert {*x} == {*curve["response_speed_share"].to_numpy()[13:]}
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "period of two gear meshes" in labels


def test_sensors_have_a_panel_each(curve):
    """Without the rounding that a sensor sees where planets alike do not move its body."""
    signals = np.stack([curve["response_gear_mesh_force"].to_numpy()[:, 0]] * 2, axis=1)
    signals[:, 0] *= 1e-14
    curve = curve.assign_coords(sensor=["top", "foot"], sensor_unit=("sensor", ["m/s2", "1"]))
    curve["response_sensor"] = (("point", "sensor", "measure"), signals)
    curve["gear_mesh_frequency"] = "point", 400.0 * curve["response_speed_share"].to_numpy()
    curve = curve.assign_coords(gear_mesh_order=[1, 2, 20])
    axes = response_chart(curve).axes
    labels = [ax.get_ylabel() for ax in axes]
    assert {y for line in axes[2].lines for y in line.get_ydata()} == {0.0}
    assert labels[2:] == ["top, rms (m/s²)", "foot, rms (µm/m)"]


def test_forces_of_backs_are_in_the_picture(curve):
    curve["response_gear_mesh_force"].loc[{"measure": "minimum"}] *= -1.0
    assert response_chart(curve).axes[0].get_ylim()[0] < -1.6
    curve["response_gear_mesh_force"][{"point": [9], "measure": [0, 1]}] *= 1e3
    figure = response_chart(curve)
    low, high = figure.axes[0].get_ylim()
    assert -low == high == pytest.approx(20 * 5.5, rel=0.2)
    (note,) = [
        text
        for text in panels_of(figure)[0]["layout"]["annotations"]
        if text["text"].startswith("states continue up to")
    ]
    assert (note["xref"], note["yref"], note["x"], note["y"]) == (
        "x domain", "y domain", 0.99, 0.97,
    )  # fmt: skip


def test_labels_of_panels_do_not_overlap(curve):
    """Beside a legend of eight gear meshes, which leaves the panels little room."""
    names = [f"stage {part} {k}" for part in ("ring", "sun") for k in range(1, 5)]
    figure = response_chart(curve.isel(gear_mesh=[0] * 8).assign_coords(gear_mesh=names))
    figure.canvas.draw()
    above, below = (ax.yaxis.label.get_window_extent() for ax in figure.axes)
    assert below.y1 < above.y0


def test_marks_of_jumps_and_changes_are_on_the_page(curve):
    curve["stability_change_kind"][:] = 1
    force, _ = panels_of(response_chart(curve))
    marks = {
        t["marker"]["symbol"]: (t["mode"], t["x"])
        for t in force["data"]
        if "marker" in t and t["x"] != [None]
    }
    assert marks == {
        "triangle-right": ("markers", [1.2]),
        "triangle-left": ("markers", [0.9]),
        "diamond-tall": ("markers", [1.2, 0.9]),
    }
    arrows = [a for a in force["layout"]["annotations"] if a["showarrow"]]
    assert [(a["x"], a["ay"], a["y"]) for a in arrows] == [(1.2, 5.0, 4.0), (1.2, 5.0, 7.0)]


def test_planets_with_the_same_forces_have_one_line(curve):
    names = ["stage ring 1", "stage ring 2", "stage sun 1", "stage sun 2"]
    four = curve.isel(gear_mesh=[0] * 4).assign_coords(gear_mesh=names)
    force = four["response_gear_mesh_force"]
    other = four.assign(response_gear_mesh_force=force * np.array([1, 1, 1, 1.1])[:, None])
    for data, lines in (
        (four, ["ring 1, 2", "sun 1, 2"]),
        (other, ["ring 1, 2", "sun 1", "sun 2"]),
    ):
        labels = [text.get_text() for text in response_chart(data).legends[0].get_texts()]
        assert [label for label in labels if label.startswith(("ring", "sun"))] == lines
