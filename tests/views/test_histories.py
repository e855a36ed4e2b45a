"""Histories, displacements and charts: units, gaps, what is taken out."""

import numpy as np
import pytest

from flexgear.views import charts, histories
from flexgear.views.select import within_window
from flexgear.views.style import DEFORMED_COLOUR, VARIANT_COLOURS


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
    assert figure.axes[1].get_ylabel() == "carrier speed\n(r/min)"


def test_constant_speed_is_not_blown_up_to_noise(steady):
    low, high = histories.carrier_speed(steady).axes[1].get_ylim()
    assert high - low >= 0.2


def test_torque_drop_has_five_panels_with_units(dropped):
    figure = histories.torque_drop(within_window(dropped, "time", (0.8, 1.6)))
    assert len(figure.axes) == 5
    assert all("(" in ax.get_ylabel() for ax in figure.axes)
    assert figure.axes[-1].get_xlim() == pytest.approx((0.8, 1.6), abs=5e-3)


def test_tooth_node_has_three_directions_in_micrometres(steady):
    figure = histories.tooth_node_displacement(steady)
    assert [ax.get_ylabel() for ax in figure.axes] == ["X (µm)", "Y (µm)", "Z (µm)"]
    x = line_of(figure.axes[0], VARIANT_COLOURS["flexible"]).get_ydata()
    assert np.max(x) == pytest.approx(30.0, rel=1e-3)


def test_planet_motion(steady):
    figure = histories.planet_displacement(steady)
    tangential = line_of(figure.axes[1], VARIANT_COLOURS["flexible"]).get_ydata()
    planet = steady["flexible"]["body_displacement"].sel(body="stage.planet_1")[:, 1]
    np.testing.assert_allclose(tangential, 1e6 * planet, rtol=1e-6)


def test_sun_motion(steady):
    figure = histories.sun_displacement(steady)
    assert [ax.get_ylabel() for ax in figure.axes] == ["x (µm)", "y (µm)", "z (µm)"]


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_tooth_map_holds_every_tooth(steady, axis):
    figure = histories.tooth_displacement_map(steady["flexible"], axis)
    mesh = figure.axes[0].collections[0]
    assert mesh.get_array().shape == (93, histories.MAP_SAMPLES)
    assert mesh.norm.vmin == -mesh.norm.vmax
    assert figure.axes[1].get_ylabel().endswith("(µm)")


def test_harmonics_mark_multiples_of_the_planet_number():
    amplitudes = np.zeros(21)
    amplitudes[[0, 5, 7]] = 3e-6, 12e-6, 1e-6
    ax = charts.radial_harmonics(amplitudes, 5).axes[0]
    red = [k for k, bar in enumerate(ax.patches) if hex_of(bar) == DEFORMED_COLOUR]
    assert red == [0, 5, 10, 15, 20]
    assert ax.patches[5].get_height() == pytest.approx(12.0)


def hex_of(bar) -> str:
    from matplotlib.colors import to_hex

    return to_hex(bar.get_facecolor()).upper()


def test_energy_balance_residual_is_what_was_put_in(dropped):
    dataset = dropped["flexible"]
    figure = charts.energy_balance(dataset)
    residual = figure.axes[-1].get_lines()[0].get_ydata()
    time = np.asarray(dataset["time"])
    expected = -0.8 * np.sin(40 * time) / 1400 * 100
    np.testing.assert_allclose(residual, expected, atol=1e-3)
