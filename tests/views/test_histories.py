"""Histories and tooth loads: units, gaps, envelopes, curves that break between engagements."""

import numpy as np
import pytest
import xarray as xr

from flexgear.model.errors import FlexgearError
from flexgear.views import histories, star
from flexgear.views.select import (
    MAX_OSCILLATIONS,
    close_up,
    draw,
    orbit,
    oscillations,
    within_window,
)
from flexgear.views.style import DEFORMED_COLOUR, SPLIT_COLOUR, VARIANT_COLOURS, panels
from flexgear.views.vibration_charts import energy_balance


def line_of(ax, colour):
    return next(line for line in ax.get_lines() if line.get_color() == colour)


def test_load_sharing_leaves_gaps_where_it_is_undefined(dropped):
    figure = histories.load_sharing(dropped, x="time", spread=True)
    line = line_of(figure.axes[0], VARIANT_COLOURS["flexible"])
    time, values = line.get_data()
    np.testing.assert_array_equal(np.isnan(values), (time > 1) & (time <= 1.2))
    spread = line_of(figure.axes[1], VARIANT_COLOURS["flexible"]).get_ydata()
    assert not np.isnan(spread).any()


def test_speed_is_in_revolutions_per_minute(dropped):
    figure = histories.carrier_speed(dropped, rated_rpm=11.27)
    values = line_of(figure.axes[1], VARIANT_COLOURS["flexible"]).get_ydata()
    assert values[0] == pytest.approx(11.27, rel=1e-3)
    assert figure.axes[1].get_ylabel() == "carrier speed to\nring (r/min)"


def test_constant_speed_is_not_blown_up_to_noise(steady):
    low, high = histories.carrier_speed(steady).axes[1].get_ylim()
    assert high - low >= 0.2


def test_rounding_is_not_blown_up_to_curves(steady):
    data = steady["flexible"].copy(deep=True)
    data["load_sharing"][:] = 1.0 + 1e-10 * np.random.default_rng(1).random(data.load_sharing.shape)
    data["body_displacement"].loc[{"body": "stage.sun"}] = 1e-16
    low, high = histories.load_sharing({"flexible": data}).axes[0].get_ylim()
    assert high - low >= 0.01
    sun = histories.displacement({"flexible": data}, "sun").axes
    assert all("zero, to rounding" in ax.get_title(loc="left") for ax in sun)
    assert sun[0].get_ylim()[1] > 1e-3  # µm


def test_torque_drop_has_five_panels_with_units(dropped):
    figure = histories.torque_drop(within_window(dropped, "time", (0.8, 1.6)))
    assert len(figure.axes) == 5
    assert all("(" in ax.get_ylabel() for ax in figure.axes)
    assert figure.axes[-1].get_xlim() == pytest.approx((0.8, 1.6), abs=5e-3)
    weak = {n: d.assign(gear_mesh_force=1e-5 * d["gear_mesh_force"]) for n, d in dropped.items()}
    axes = figure.axes[2], histories.torque_drop(weak).axes[2]
    assert [ax.get_ylabel().split()[-1] for ax in axes] == ["(kN)", "(N)"]
    sizes = [max(np.nanmax(line.get_ydata()) for line in ax.get_lines()) for ax in axes]
    assert sizes[1] == pytest.approx(1e-2 * sizes[0])


def test_tooth_node_has_three_directions_in_micrometres(steady):
    figure = histories.displacement(steady, "tooth node")
    assert [ax.get_ylabel() for ax in figure.axes] == ["X (µm)", "Y (µm)", "Z (µm)"]
    x = line_of(figure.axes[0], VARIANT_COLOURS["flexible"]).get_ydata()
    assert np.max(x) == pytest.approx(30.0, rel=1e-3)


def test_planet_motion(steady):
    figure = histories.displacement(steady, "planet")
    tangential = line_of(figure.axes[1], VARIANT_COLOURS["flexible"]).get_ydata()
    planet = steady["flexible"]["body_displacement"].sel(body="stage.planet_1")[:, 1]
    np.testing.assert_allclose(tangential, 1e6 * planet, rtol=1e-6)


def test_tooth_map_holds_every_tooth(steady):
    figure = star.tooth_displacement_map(steady["flexible"])
    mesh = figure.axes[0].collections[0]
    assert mesh.get_array().shape == (93, star.MAP_SAMPLES)
    assert mesh.norm.vmin == -mesh.norm.vmax
    assert figure.axes[1].get_ylabel().endswith("(µm)")


def test_harmonics_mark_multiples_of_the_planet_number():
    amplitudes = np.zeros(21)
    amplitudes[[0, 5, 7]] = 3e-6, 12e-6, 1e-6
    ax = star.radial_harmonics(amplitudes, 5).axes[0]
    red = [k for k, bar in enumerate(ax.patches) if hex_of(bar) == DEFORMED_COLOUR]
    assert red == [0, 5, 10, 15, 20]
    assert ax.patches[5].get_height() == pytest.approx(12.0)


def hex_of(bar) -> str:
    from matplotlib.colors import to_hex

    return to_hex(bar.get_facecolor()).upper()


def test_energy_balance_residual_is_what_was_put_in(dropped):
    dataset = dropped["flexible"]
    figure = energy_balance(dataset)
    residual = figure.axes[-1].get_lines()[0].get_ydata()
    time = np.asarray(dataset["time"])
    expected = -0.8 * np.sin(40 * time) / 1400 * 100
    np.testing.assert_allclose(residual, expected, atol=1e-3)


def test_pair_curve_follows_a_tooth_through_its_slots_and_breaks_between_engagements():
    x = np.arange(6.0)
    tooth = np.array([[1, 0], [0, 1], [2, 0], [2, 0], [1, 2], [0, 1]])
    value = np.array([[10, 99], [99, 11], [20, 99], [21, 99], [12, 22], [99, 13]], dtype=float)
    at, curve = histories.pair_curve(x, tooth, value)
    gap = np.nan
    np.testing.assert_array_equal(at, [0, 1, gap, 4, 5, gap, 2, 3, 4, gap])
    np.testing.assert_array_equal(curve, [10, 11, gap, 12, 13, gap, 20, 21, 22, gap])


def test_engagement_spans():
    tooth = np.array([[1, 0], [1, 2], [0, 2], [1, 0]])
    spans = histories.engagement_spans(np.array([0.0, 1.0, 2.0, 3.0]), tooth)
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


def test_closer_view_spans_five_pitches_whichever_way_the_carrier_turns():
    """Two teeth of 80 touch at a time, over 1.4 turns."""
    angle, pitch = np.linspace(3.0, 11.7, 2000), 2 * np.pi / 80
    tooth = np.stack([angle // pitch % 80 + 1, (angle // pitch + 1) % 80 + 1], axis=1)
    for x, teeth in ((angle, tooth), (-angle, tooth), (-angle, 81 - tooth)):
        low, high = histories.zoom_window(x, teeth)
        assert high - low == pytest.approx(5 * pitch, rel=0.05)


TIME = np.linspace(0.0, 5.32, 5321)
CYCLES = 93


def drawn(values):
    _, axes = panels(1, 1, height_mm=60)
    draw(axes[0, 0], TIME, values, "black")
    return axes[0, 0]


def test_many_cycles_are_a_band_between_least_and_largest():
    """2 + (1 + 0.2 sin t) sin ωt lies between 2 ± (1 + 0.2 sin t); a place of the band has the
    extremes of nine cycles, six from it at most, in which the size changes by 0.2 2π 6/93."""
    size = 1 + 0.2 * np.sin(2 * np.pi * TIME / 5.32)
    axes = drawn(2 + size * np.sin(2 * np.pi * CYCLES * TIME / 5.32))
    low, high = axes.get_lines()
    assert "bands" in axes.get_title(loc="right") and len(axes.collections) == 1
    for line, sign in ((low, -1), (high, 1)):
        exact = 2 + sign * np.interp(line.get_xdata(), TIME, size)
        outside = sign * (line.get_ydata() - exact)
        of_cycle = 0.2 * 2 * np.pi / CYCLES  # most that the size changes in one
        assert outside.min() > -of_cycle and outside.max() < 6 * of_cycle
    assert len(low.get_xdata()) == CYCLES // 3


def test_ripple_on_a_few_waves_is_a_line():
    """As a tooth of the ring has as planets pass: what counts is the wave."""
    values = 40 * np.sin(2 * np.pi * 5 * TIME / 5.32) + 4 * np.sin(2 * np.pi * CYCLES * TIME / 5.32)
    axes = drawn(values)
    assert not axes.get_title(loc="right")
    (line,) = axes.get_lines()
    np.testing.assert_array_equal(line.get_ydata(), values)


@pytest.mark.parametrize("values", [np.ones(100), np.full(100, np.nan), np.zeros(2)])
def test_constant_or_missing_values_do_not_oscillate(values):
    assert oscillations(values) == 0


def test_a_close_up_holds_some_cycles_about_the_largest_value():
    values = np.sin(2 * np.pi * CYCLES * TIME / 5.32) * (1 + np.exp(-((TIME - 2.0) ** 2)))
    near = close_up(np.column_stack([values, -0.5 * values]))
    shown = TIME[near]
    assert oscillations(values) > MAX_OSCILLATIONS
    assert shown[0] < TIME[np.argmax(values)] < shown[-1]
    assert shown[-1] - shown[0] == pytest.approx(4 * 5.32 / CYCLES, rel=0.05)


def test_an_orbit_is_round_where_samples_are_few():
    """Eight samples a turn: their polygon comes to 0.924 of the radius, the orbit to 1 % of it."""
    angle = 2 * np.pi * np.arange(60 * 8) / 8
    way = np.column_stack([np.cos(angle), np.sin(angle)])
    curve = orbit(way)
    np.testing.assert_allclose(np.hypot(*curve.T), 1.0, atol=1e-2)
    assert len(curve) == pytest.approx(4 * 60, rel=0.2)  # of the last four turns
