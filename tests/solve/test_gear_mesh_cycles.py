"""Transmission error by order, loaded and unloaded, and gear-mesh stiffness over cycles."""

from dataclasses import replace

import numpy as np
import pytest
from train_contexts import rigid_stage

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.line_loads import gear_mesh_stiffness, line_loads
from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.results.face_load import cycle_figures
from flexgear.results.harmonics import order_amplitudes, with_orders
from flexgear.solve.static import gear_mesh_cycles, static
from flexgear.views.face_load_charts import stiffness_chart, transmission_error_chart

BASE = load_case("wind-5mw").with_(
    **{"stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": 5}
)
CROWNED = {
    "stage.planet.modifications.ring.profile_crowning": 12e-6,
    "stage.planet.modifications.sun.helix_slope": 15e-6,
}
CYCLE = 2 * np.pi / 93 * np.arange(3) / 3


@pytest.fixture(scope="module")
def crowned():
    return rigid_stage(BASE.with_(**CROWNED))


@pytest.fixture(scope="module")
def cycles(crowned):
    return gear_mesh_cycles(crowned, "stage")


def test_orders_are_found_beside_what_passes_slowly():
    phase = np.add.outer([0.0, 31.0, 62.0], np.arange(12) / 12).ravel()
    wave = 3e-6 * np.sin(2 * np.pi * phase + 0.7) + 0.5e-6 * np.cos(6 * np.pi * phase)
    drift = np.repeat([1e-5, -2e-5, 4e-6], 12) + np.repeat([5e-6, 0.0, -3e-6], 12) * (phase % 1.0)
    found = order_amplitudes(phase, wave + drift, 4)
    assert found == pytest.approx([3e-6, 0.0, 0.5e-6, 0.0], abs=1e-15)


def test_the_unloaded_error_is_where_equilibria_go_as_the_torque_goes(crowned):
    """Under hardly any torque bodies close until flanks touch, and no more; where one still tilts
    freely, they touch off mid-face."""
    ideal, left = crowned.without_errors(), []
    for share in (1e-2, 1e-4):
        data = static(ideal, CYCLE, share * ideal.system.rated_torque)
        more = np.abs(data["transmission_error"] - data["unloaded_transmission_error"])
        tilted = 0.5 * np.abs(data["gear_mesh_misalignment"])
        left.append(float((more - tilted).max()))
    assert left[0] > 1e-6
    assert left[1] < 0.15 * left[0]


def test_an_error_at_gear_mesh_frequency_is_order_one_of_the_unloaded_error():
    """Involutes without tilt touch where e = ½ (f'₁ + f'₂) sin says, whichever pair does."""
    case = BASE.with_(**{"stage.errors.sun_tooth": 8e-6, "stage.errors.planet_tooth": 4e-6})
    phase = np.arange(8) / 8
    data = with_orders(static(rigid_stage(case), 2 * np.pi / 93 * phase), phase, 2)
    found = data["unloaded_transmission_error_order"].sel(flank="stage sun 2 drive")
    assert found.to_numpy() == pytest.approx([6e-6, 0.0], abs=1e-12)


def test_a_ground_helix_lets_bodies_closer_before_it_touches(cycles):
    """Half of it is left at one end, where lines over the whole face have the middle of their last
    slice (1 − 1/K)/2 of the face from mid-face, and shorter ones further out."""
    left = 0.5 * 15e-6 * np.cos(stage_geometry(BASE.view()).base_helix_angle)
    found = cycles["unloaded_transmission_error"].sel(flank="stage sun 1 drive")
    assert -left < float(found.min()) < -(1 - 1 / 5) * left
    assert (found < 0).all()


def test_stiffness_is_the_slope_of_the_force(crowned):
    """Of slices beside each other: all rows closed by a little more, in a central difference."""
    turned = revolution(crowned.modal, CYCLE, crowned.system.rated_torque)
    found, step = gear_mesh_stiffness(turned, line_loads(turned)), 1e-12

    def force(closer):
        approach = turned.pair_approach + np.array([closer, closer, 0.0, 0.0])
        lines = line_loads(replace(turned, pair_approach=approach))
        return np.nansum(lines.force, axis=(2, 3))

    slope = (force(step) - force(-step)) / (2 * step)
    np.testing.assert_allclose(found[:, :10], slope[:, :10], rtol=1e-3)


def test_figures_and_pictures(cycles):
    figures = cycle_figures(cycles)
    assert len(figures) == 10
    one = figures["stage ring 1 drive"]
    assert len(one["transmission_error_orders_um"]) == BASE.solver.gear_mesh_orders
    largest = one["transmission_error_orders_um"][0]
    assert 0.2 < one["transmission_error_cycle_peak_to_peak_um"] / (2 * largest) < 3.0
    stiffness = one["gear_mesh_stiffness_n_per_um"]
    assert 0.0 < stiffness["min"] <= stiffness["mean"] <= stiffness["max"]
    assert len(transmission_error_chart(cycles).axes) == 4
    assert len(stiffness_chart(cycles).axes) == 2
