"""Pictures of trains: what is drawn, with which unit, and what is left out."""

import itertools

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from flexgear.gears.expected_lines import ExpectedLine
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import FlexgearError
from flexgear.model.load import load_case
from flexgear.model.names import GearMeshName
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.results.load_sharing import sharing_histories
from flexgear.views import mode_charts, sharing_charts
from flexgear.views.interactive import panels_of
from flexgear.views.mode_charts import (
    BACKWARD,
    FORWARD,
    STRAIGHT,
    campbell_chart,
    index_colour,
)
from flexgear.views.order_charts import order_chart, static_sensors_chart
from flexgear.views.style import planet_colour

SAMPLES = 40
BODIES = ["one.sun", "one.carrier", "one.planet_1", "two.pinion", "two.gear"]
NAMES = tuple(
    [GearMeshName.of("one", kind, "", i) for kind in ("ring", "sun") for i in (1, 2, 3)]
    + [GearMeshName.of("two", "sun", "", 1)]
)


def history(dim: str = "position", uneven: float = 0.1) -> xr.Dataset:
    """A planetary stage whose planets share unevenly, and a parallel stage."""
    turn = np.linspace(0, 4 * np.pi, SAMPLES)
    share = 1 + uneven * np.sin(turn[:, None] + 2 * np.pi * np.arange(3) / 3)
    force = 1e4 * np.column_stack([share, share, 3 * np.ones(SAMPLES)])
    moved = np.zeros((SAMPLES, len(BODIES), 6))
    moved[:, 0, 0], moved[:, 0, 1] = 30e-6 * np.cos(turn), 30e-6 * np.sin(turn)
    moved[:, 3, 0] = 12e-6
    return labelled_dataset(
        dim,
        np.linspace(0, 2, SAMPLES) if dim == "time" else np.arange(SAMPLES),
        {
            "input_angle": turn[:, None],
            "gear_mesh_force": force,
            "body_displacement": moved,
            **{
                k: v
                for k, v in sharing_histories(force, np.full(7, 1e4), NAMES).items()
                if k == "planet_load_factor"
            },
        },
        {},
        {"input_coordinate": ["one.sun"], "body": BODIES},
        NAMES,
    )


def text_of(figure: Figure) -> str:
    titles = [a.get_title(loc="left") + a.get_xlabel() + a.get_ylabel() for a in figure.axes]
    return " ".join(titles)


def colours(ax) -> list[str]:
    return [line.get_color() for line in ax.get_lines()]


class TestSharing:
    def test_a_panel_for_each_kind_and_a_line_for_each_planet(self):
        figure = sharing_charts.sharing_chart(history())
        assert len(figure.axes) == 2  # the parallel stage has nothing to share
        for ax in figure.axes:
            assert colours(ax)[:3] == [planet_colour(i) for i in (1, 2, 3)]
            assert "largest 1.1" in ax.get_title(loc="left")
            np.testing.assert_allclose(
                ax.get_lines()[0].get_ydata(), 1 + 0.1 * np.sin(np.linspace(0, 4 * np.pi, SAMPLES))
            )
        assert figure.axes[-1].get_xlabel() == "turns of one, sun (–)"
        assert figure.axes[-1].get_xlim() == pytest.approx((0, 2))

    def test_load_sharing_is_drawn_over_time(self):
        figure = sharing_charts.sharing_chart(history("time"))
        assert figure.axes[-1].get_xlabel() == "time (s)"

    def test_planets_that_are_alike_are_one_line(self):
        figure = sharing_charts.sharing_chart(history(uneven=0.0))
        for ax in figure.axes:
            assert colours(ax).count("black") == 1
            assert "all planets alike" in ax.get_title(loc="left")

    def test_gaps_between_cycles_that_are_far_apart(self):
        data = history().isel(position=[*range(10), *range(30, 40)])
        line = sharing_charts.sharing_chart(data).axes[0].get_lines()[0]
        assert np.isnan(line.get_xdata()).sum() == 1

    def test_nothing_to_share(self):
        data = history().isel(gear_mesh=[6])
        with pytest.raises(FlexgearError, match="more than one planet"):
            sharing_charts.sharing_chart(data)


def test_forces_are_in_kilonewtons_or_newtons():
    figure = sharing_charts.gear_mesh_forces(history())
    assert len(figure.axes) == 3
    assert "mean 10 kN, largest 11" in text_of(figure)
    assert all(ax.get_ylabel() == "force (kN)" for ax in figure.axes)
    small = history()
    small["gear_mesh_force"] = 1e-2 * small["gear_mesh_force"]
    figure = sharing_charts.gear_mesh_forces(small)
    assert "mean 100 N, largest 110" in text_of(figure)
    assert all(ax.get_ylabel() == "force (N)" for ax in figure.axes)


def test_planets_of_one_picture_are_all_bands_or_all_lines():
    """Planet 1 oscillates 300 times, the others three times. In a close-up of so short a time the
    numbers of its axis stand apart."""
    turn = np.linspace(0.0, 1.0, 6000)
    waves = 1e4 * (2 + np.sin(2 * np.pi * turn[:, None] * [300, 3, 3] + np.arange(3)))
    arrays = {"gear_mesh_force": waves, "input_angle": turn[:, None]}
    labels = {"input_coordinate": ["one.sun"]}
    data = labelled_dataset("time", 0.067 + 0.08 * turn, arrays, {}, labels, NAMES[:3])
    figure = sharing_charts.gear_mesh_forces(data)
    panel, near = figure.axes
    figure.canvas.draw()
    extents = [text.get_window_extent() for text in near.get_xticklabels() if text.get_text()]
    inside = [e for e in extents if near.bbox.x0 <= (e.x0 + e.x1) / 2 <= near.bbox.x1]
    assert len(inside) > 1
    assert all(b.x0 - a.x1 > 4 for a, b in itertools.pairwise(inside))
    colours = [line.get_color() for line in panel.get_lines()]
    assert [colours.count(planet_colour(p)) for p in (1, 2, 3)] == [2, 2, 2]


class TestDisplacements:
    def test_orbit_and_distance_in_micrometres(self):
        figure = sharing_charts.displacements_chart(history())
        orbit, distance, *other = figure.axes
        np.testing.assert_allclose(orbit.get_lines()[0].get_data()[0][0], 30.0)
        assert orbit.get_xlabel() == "x of the sun (µm)"
        assert distance.get_ylabel() == "distance from the axis (µm)"
        assert distance.get_xlabel() == "turns of one, sun (–)"
        np.testing.assert_allclose(distance.get_lines()[0].get_ydata(), 30.0)
        assert other[0].get_xlabel() == "x of the pinion (µm)"

    def test_members_that_stay_are_left_out(self):
        figure = sharing_charts.displacements_chart(history())
        labels = [t.get_text() for t in figure.legends[0].get_texts()]
        assert labels == ["sun", "pinion"]

    def test_members_that_do_not_move_are_said_to_stay(self):
        data = history()
        data["body_displacement"] = 0 * data["body_displacement"]
        figure = sharing_charts.displacements_chart(data)
        assert "stay on their axes" in figure.axes[0].texts[0].get_text()


class TestPowerFlow:
    def test_bars_are_speeds_torques_and_powers(self):
        flow = power_flow(load_case("pitch-drive"))
        speed, torque, power = sharing_charts.power_flow_chart(flow).axes
        widths = [bar.get_width() for bar in speed.patches]
        np.testing.assert_allclose(
            widths, [v * 30 / np.pi for v in flow.speed.values()], rtol=1e-12
        )
        assert torque.get_xlabel() == "torque on the stage (kN m)"
        np.testing.assert_allclose(
            [b.get_width() for b in torque.patches], np.array([*flow.branch_torque.values()]) / 1e3
        )
        assert sum(bar.get_width() for bar in power.patches) == pytest.approx(0, abs=1e-9)

    def test_ports_and_held_members_are_marked(self):
        flow = power_flow(load_case("double-rotor-5mw"))
        figure = sharing_charts.power_flow_chart(flow)
        names = [t.get_text() for t in figure.axes[0].get_yticklabels()]
        assert sum("(in)" in n for n in names) == 2
        assert sum("(out)" in n for n in names) == 1
        assert any("(held)" in n for n in names)
        assert "2 independent speeds" in figure.get_suptitle()


def modes(count: int = 6) -> xr.Dataset:
    return xr.Dataset(
        {
            "frequency": ("mode", np.array([0.0, 100, 100, 200, 300, 300])[:count]),
            "type": (
                "mode",
                ["rigid", "translational", "translational", "rotational", "planet", "planet"][
                    :count
                ],
            ),
            "motion_energy": (
                ("mode", "motion"),
                np.array([[0, 1], [0.6, 0.4], [0.6, 0.4], [0, 1], [0, 1], [0, 1]])[:count],
            ),
            "strain_energy": (
                ("mode", "spring"),
                np.tile([0.1, 0.2, 0.3, 0.4], (6, 1))[:count],
            ),
        },
        coords={
            "motion": ["translational", "planet"],
            "spring": [
                "a.planet_bearing_1", "a.planet_bearing_2", "a.sun-b.gear", "b sun gear mesh 1"
            ],
            "body": ["a.sun", "b.gear"],
        },
    )  # fmt: skip


def test_a_sensor_of_a_constant_says_so_in_a_unit_of_its_size():
    torque = 2.273642e6 * (1.0 + 1e-12 * np.arange(5.0))[:, None]
    of_sensor = {"static_sensor": ["input"], "static_sensor_unit": ("static_sensor", ["N m"])}
    data = xr.Dataset(
        {
            "sensor_static": (("position", "static_sensor"), torque),
            "input_angle": (("position", "input_coordinate"), np.linspace(0, 1, 5)[:, None]),
        },
        coords=of_sensor,
    )
    (axis,) = static_sensors_chart(data).axes
    assert axis.get_title(loc="left") + axis.get_title() == "input: constant, 2.274 MN m"
    assert axis.get_ylabel() == "torque (MN m)"
    data["sensor_static"][0] = 1.1e6
    (axis,) = static_sensors_chart(data).axes
    assert axis.get_title(loc="left") + axis.get_title() == "input: 1.1 … 2.274 MN m"


def test_a_sensor_that_sees_rounding_alone_is_constant():
    of_sensor = {"static_sensor": ["sun_x"], "static_sensor_unit": ("static_sensor", ["m"])}
    data = xr.Dataset(
        {
            "sensor_static": (("position", "static_sensor"), 1e-20 * np.eye(5)[:, :1]),
            "input_angle": (("position", "input_coordinate"), np.linspace(0, 1, 5)[:, None]),
        },
        coords=of_sensor,
    )
    (axis,) = static_sensors_chart(data).axes
    assert axis.get_title(loc="left") + axis.get_title() == "sun_x: constant, 0 µm"


def test_own_harmonics_need_no_name_beside_those_of_other_stages():
    lines = [
        (ExpectedLine(stage, "gear mesh", "", 100.0 * k, 1.0, harmonic=k), order)
        for stage, k, order in (("planetary", 1, 1.0), ("planetary", 2, 2.0), ("helical", 1, 3.3))
    ]
    spectrum = xr.DataArray(
        np.ones(50), {"order": np.linspace(0, 4, 50)}, "order", "gear_mesh_force",
        {"units": "N", "turns": 10, "window": "hann", "of": "the gear mesh"},
    )  # fmt: skip
    axes = order_chart(spectrum, lines).axes[0]
    label = "order of the gear mesh (–); hann window over 10 cycles of the gear mesh"
    assert axes.get_xlabel() == label
    texts = [t.get_text() for t in axes.texts]
    assert texts == ["1×", "2×", "helical 1×"]


class TestModes:
    def test_repeated_frequencies_are_one_row(self):
        figure = mode_charts.modes_chart(modes())
        texts = [t.get_text() for t in figure.axes[0].texts]
        assert texts == ["0", "100 ×2", "200", "300 ×2"]
        ticks = [t.get_text() for t in figure.axes[0].get_yticklabels()]
        assert ticks == ["1", "2", "4", "5"]
        assert figure.axes[0].get_xlabel() == "natural frequency (Hz)"

    def test_labels_of_frequencies_have_room(self):
        axis = mode_charts.modes_chart(modes()).axes[0]
        axis.figure.canvas.draw()
        boxes = sorted(
            (box.x0, box.x1)
            for minor in (False, True)
            for label in axis.get_xticklabels(minor=minor)
            if label.get_text()
            for box in [label.get_window_extent()]
        )
        assert boxes
        assert all(one[1] < other[0] for one, other in itertools.pairwise(boxes))

    def test_springs_of_a_kind_are_summed(self):
        strain = mode_charts.modes_chart(modes()).axes[2]
        bars = {c.get_label(): [b.get_width() for b in c] for c in strain.containers}
        assert set(bars) == {"planet bearing", "joint", "sun gear mesh"}
        np.testing.assert_allclose(bars["planet bearing"], 30.0)
        np.testing.assert_allclose(sum(np.array(v) for v in bars.values()), 100.0)

    def test_too_many_modes_are_cut_and_it_is_said(self, monkeypatch):
        monkeypatch.setattr(mode_charts, "MAX_MODES", 2)
        figure = mode_charts.modes_chart(modes())
        assert "lowest 2 of 4" in figure.get_suptitle()

    def test_a_chart_without_modes_is_refused(self):
        with pytest.raises(FlexgearError, match="no modes"):
            mode_charts.modes_chart(modes(0))


def campbell() -> xr.Dataset:
    """Two whirl modes and one that does not whirl, and two orders, which meet none."""
    factor = np.linspace(0, 1.2, 5)
    frequency = np.column_stack([100 + 20 * factor, 100 - 20 * factor, 0 * factor + 150])
    return xr.Dataset(
        {
            "campbell_frequency": (("speed_factor", "mode"), frequency),
            "campbell_nodal_index": (("mode", "turning_stage"), np.zeros((3, 2), dtype=int)),
            "whirl": (("speed_factor", "mode"), np.tile([1.0, -1.0, np.nan], (5, 1))),
            "excitation_slope": ("excitation", [80.0, 160.0]),
            "excitation_index": ("excitation", [1, 2]),
            "meeting_mode": ("meeting", np.zeros(0)),
        },
        coords={
            "speed_factor": factor,
            "turning_stage": ["stage_1", "stage_2"],
            "excitation": ["stage_1 x 1", "stage_1 x 2"],
            "excitation_stage": ("excitation", ["stage_1", "stage_1"]),
            "excitation_kind": ("excitation", ["gear mesh", "gear mesh"]),
            "excitation_order": ("excitation", [1.0, 2.0]),
        },
        attrs={"margin": 0.2, "operating_factors": [1.0], "planets": [3, 3]},
    )


def with_meetings() -> xr.Dataset:
    """Modes of index 0 and 1 of a stage of three planets; order 1 drives k = 1, order 2 k = 2."""
    data = campbell().drop_dims("meeting").isel(turning_stage=[0])
    return data.assign(
        campbell_nodal_index=(("mode", "turning_stage"), [[0], [1], [-2]]),
        whirl=np.nan * data["whirl"],
        meeting_factor=("meeting", [1.0, 1.0]),
        meeting_excitation=("meeting", ["stage_1 x 1", "stage_1 x 1"]),
        meeting_mode=("meeting", [1, 2]),
        meeting_frequency=("meeting", [80.0, 80.0]),
        meeting_away=("meeting", [-0.2, 0.0]),
        meeting_cause=("meeting", ["errors", "ideal"]),
    )


class TestCampbell:
    def test_modes_rays_and_crossings(self):
        ax = campbell_chart(campbell()).axes[0]
        lines = [line for line in ax.get_lines() if line.get_linestyle() == "-"][1:]
        assert [line.get_color() for line in lines] == [FORWARD, BACKWARD, STRAIGHT]
        rays = [line for line in ax.get_lines() if line.get_linestyle() == "--"]
        assert [r.get_ydata()[-1] for r in rays] == pytest.approx([192.0, 96.0])
        assert {t.get_text() for t in ax.texts} >= {"1×", "2×"}
        assert ax.get_xlabel() == "speed over rated speed (–)"
        assert ax.get_ylabel() == "frequency (Hz)"

    def test_the_margin_about_an_operating_speed_is_on_the_page(self):
        (panel,) = panels_of(campbell_chart(campbell()))
        bands = [s for s in panel["layout"]["shapes"] if s["type"] == "rect"]
        ends = [(band["x0"], band["x1"], band["fillcolor"]) for band in bands]
        assert ends == [(pytest.approx(0.8), pytest.approx(1.2), "#f3f4f6")]

    def test_the_highest_order_is_seen_at_the_highest_speed(self):
        ax = campbell_chart(campbell()).axes[0]
        assert ax.get_ylim()[1] >= 160.0 * 1.2

    def test_orders_have_the_colour_of_what_they_drive(self):
        """k = 2 of three planets is k = 1 the other way round."""
        ax = campbell_chart(with_meetings()).axes[0]
        rays = [line for line in ax.get_lines() if line.get_linestyle() == "--"]
        assert {line.get_color() for line in rays} == {index_colour(1)}
        modes_ = [line for line in ax.get_lines() if line.get_linestyle() == "-"][1:4]
        assert [line.get_color() for line in modes_] == [index_colour(k) for k in (0, 1, -2)]
        labels = [text.get_text() for text in ax.figure.legends[0].get_texts()]
        assert "without motion of the stage" in labels

    def test_meetings_stand_where_orders_cross_modes(self):
        ax = campbell_chart(with_meetings()).axes[0]
        dots = [line for line in ax.get_lines() if line.get_marker() == "o"]
        places = {(round(d.get_xdata()[0], 6), d.get_ydata()[0]) for d in dots}
        assert places == {(1.25, 100.0), (1.0, 80.0)}
        filled = [d.get_markerfacecolor() for d in dots if d.get_xdata()[0] == 1.0]
        assert filled == ["black"]
        hollow = next(d for d in dots if d.get_markerfacecolor() == "white")
        black = next(d for d in dots if d.get_markerfacecolor() == "black")
        assert black.get_zorder() > hollow.get_zorder()  # where both are near
        assert "1× at 2" in {t.get_text() for t in ax.texts}

    def test_a_panel_for_each_stage(self):
        data = campbell().assign_coords(excitation_stage=("excitation", ["stage_1", "stage_2"]))
        figure = campbell_chart(data)
        assert [ax.get_title(loc="left") for ax in figure.axes] == ["stage 1", "stage 2"]
        tops = [ax.get_ylim()[1] for ax in figure.axes]
        assert tops[0] < tops[1]

    def test_a_campbell_diagram_without_excitation_has_its_modes(self):
        """As of a train in which nothing turns."""
        data = campbell().isel(excitation=[])
        (ax,) = campbell_chart(data).axes
        assert len(ax.get_lines()) > data.sizes["mode"]  # one a mode, and the rated speed


def test_missing_variable_is_named():
    with pytest.raises(FlexgearError, match="no variable 'gear_mesh_force'"):
        sharing_charts.gear_mesh_forces(xr.Dataset())
