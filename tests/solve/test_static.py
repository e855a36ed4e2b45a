"""Equilibria against the power flow; transmission error and stiffness over cycles."""

import math
from dataclasses import replace

import numpy as np
import pytest
from coupled import make_bodies, make_case
from train_contexts import bundled, mixed, one_stage, put_together, rigid_stage

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.line_loads import gear_mesh_stiffness, line_loads
from flexgear.cli.analysis_views import equilibrium_figures
from flexgear.coupling.build import build_system
from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.results.face_load import cycle_figures, order_amplitudes, with_orders
from flexgear.solve.model import model_of
from flexgear.solve.static import gear_mesh_cycles, position_figures, static
from flexgear.views.face_load_charts import stiffness_chart, transmission_error_chart


@pytest.mark.parametrize("name", ["nrel-5mw", "lin-parker"])
def test_planet_bearings_carry_what_statics_say(name):
    """Size and direction of the force on every pin, in the axes of its planet."""
    model = bundled(name)
    figures = position_figures(model, static(model, [0.3]).isel(position=0))
    for label, load in figures["planet_bearing"].items():
        flow = model.flow.stage(label.partition(".")[0])
        assert load["force_n"] == pytest.approx(flow.planet_bearing_force, rel=1e-6)
        direction = math.atan2(-flow.planet_bearing_tangential, flow.planet_bearing_radial)
        assert load["direction_deg"] == pytest.approx(math.degrees(direction), abs=1e-4)


def test_life_of_a_bearing_under_its_own_load():
    """ISO 281, roller, two bearings a planet: 1e6 (2C/F)^(10/3) turns."""
    model = bundled("nrel-5mw")
    figures = position_figures(model, static(model, [0.0]).isel(position=0))
    load = figures["planet_bearing"]["stage_1.planet_bearing_2"]
    speed = abs(model.flow.stage("stage_1").planet_relative_speed) / (2 * math.pi) * 3600
    turns = 1e6 * (2 * 5.5e6 / load["force_n"]) ** (10 / 3)
    assert load["life_h"] == pytest.approx(turns / speed, rel=1e-9)


def test_a_bearing_without_load_has_no_life_to_tell():
    model = bundled("nrel-5mw")
    figures = position_figures(model, static(model, [0.0], 0.0).isel(position=0))
    load = figures["planet_bearing"]["stage_1.planet_bearing_1"]
    assert load == {"force_n": 0.0, "direction_deg": 0.0, "axial_n": 0.0}
    assert figures["planet_load_factor"] == {}


def test_rounding_of_a_planets_body_is_no_axial_force():
    """An FE planet on helical teeth leaves 2e-8 of the radial force along the axis."""
    model = bundled("nrel-5mw")
    data = static(model, [0.0]).isel(position=0)
    force = data["bearing_force"]
    for share, rounding in ((2e-8, True), (1e-5, False)):
        force[:, 2] = share * np.hypot(force[:, 0], force[:, 1])
        for load in position_figures(model, data)["planet_bearing"].values():
            assert (load["axial_n"] == 0.0) is rounding


def test_clearance_does_not_change_what_a_bearing_carries(tmp_path):
    free = one_stage(tmp_path, planets=3)
    gap = one_stage(tmp_path, planets=3, **{"stage.planet_bearing.clearance_um": "50"})
    a, b = (static(c, [0.0])["planet_bearing_force"].values for c in (free, gap))
    np.testing.assert_allclose(b, a, atol=2e-3 * np.abs(a).max())


def test_two_independent_rotations_turn_in_rated_proportion():
    model = bundled("double-rotor-5mw")
    angle = static(model, [0.5])["input_angle"].values[0]
    assert angle[0] == pytest.approx(0.5)
    assert angle[1] / angle[0] == pytest.approx(-16.21 / 12.1)


def test_a_flexible_stage_shows_its_own_nodes(tmp_path):
    """The joint passes torque only, so the flexible stage is loaded as its power flow says."""
    train, bodies = mixed(tmp_path)
    model = put_together(train, bodies=bodies)
    data = static(model, [0.0, 0.03])
    assert data.attrs["variant"] == "flexible"
    assert {"first.sun", "first.carrier", "first.planet_1"} <= set(data.body.values)
    assert "first.ring" not in data.body.values
    assert data.sizes["bearing"] == 5
    ring = data["gear_mesh_force"].values[:, data.kind.values == "ring"].mean()
    assert ring == pytest.approx(model.flow.stage("first").ring_gear_mesh_force, rel=2e-3)


def test_weight_stands_in_space(tmp_path):
    """Three planets answer alike in all directions: what weight adds on the pins stays in space."""
    head = "gravity_m_per_s2 = [0, -9.81, 0]\n"
    heavy = one_stage(tmp_path, planets=3, head=head)
    angles = np.array([0.0, 1.1, 2.9])
    force = static(heavy, angles)["planet_bearing_force"].values
    turned = angles[:, None] + np.asarray(heavy.case.stages[0].planet_angles)
    radial, tangential = force[..., 0], force[..., 1]
    total = np.stack(
        [
            (np.cos(turned) * radial - np.sin(turned) * tangential).sum(axis=1),
            (np.sin(turned) * radial + np.cos(turned) * tangential).sum(axis=1),
        ]
    )
    np.testing.assert_allclose(total, total[:, :1] * np.ones(3), rtol=1e-6)
    assert total[1, 0] < -3 * 4 * 9.81  # their own weight and some of the sun's


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
    amplitudes = order_amplitudes(phase, wave + drift, 4)
    assert amplitudes == pytest.approx([3e-6, 0.0, 0.5e-6, 0.0], abs=1e-15)


def test_the_unloaded_error_is_where_equilibria_go_as_the_torque_goes(crowned):
    """Under hardly any torque bodies close until flanks touch, and no more; where one still tilts
    freely, they touch off mid-face, and where a slope is ground, in the middle of the last slice
    and not at the end of the face."""
    ideal, left, half_slice = crowned.without_errors(), [], 0.5 * 15e-6 / 5
    for share in (1e-2, 1e-4):
        data = static(ideal, CYCLE, share * ideal.system.rated_torque)
        more = np.abs(data["transmission_error"] - data["unloaded_transmission_error"])
        tilted = 0.5 * np.abs(data["gear_mesh_misalignment"]) + half_slice
        left.append(float((more - tilted).max()))
    assert left[0] > 1e-6
    assert left[1] < 0.15 * left[0]


def test_an_error_at_gear_mesh_frequency_is_order_one_of_the_unloaded_error():
    """Involutes without tilt touch where e = ½ (f'₁ + f'₂) sin says, whichever pair does."""
    case = BASE.with_(**{"stage.errors.sun_tooth": 8e-6, "stage.errors.planet_tooth": 4e-6})
    phase = np.arange(8) / 8
    data = with_orders(static(rigid_stage(case), 2 * np.pi / 93 * phase), phase, 2)
    amplitudes = data["unloaded_transmission_error_order"].sel(flank="stage sun 2 drive")
    assert amplitudes.to_numpy() == pytest.approx([6e-6, 0.0], abs=1e-12)


def test_a_ground_helix_lets_bodies_closer_before_it_touches(cycles):
    """Half of it is left at one end of the face, where some pair always touches."""
    left = 0.5 * 15e-6 * np.cos(stage_geometry(BASE.view()).base_helix_angle)
    error = cycles["unloaded_transmission_error"].sel(flank="stage sun 1 drive")
    np.testing.assert_allclose(error, -left, atol=0.01 * left)


def test_stiffness_is_the_slope_of_the_force(crowned):
    """Of slices beside each other: all rows closed by a little more, in a central difference."""
    turned = revolution(crowned.modal, CYCLE, crowned.system.rated_torque)
    stiffness, step = gear_mesh_stiffness(turned, line_loads(turned)), 1e-12

    def force(closer):
        approach = turned.pair_approach + np.array([closer, closer, 0.0, 0.0])
        lines = line_loads(replace(turned, pair_approach=approach))
        return np.nansum(lines.force, axis=(2, 3))

    slope = (force(step) - force(-step)) / (2 * step)
    np.testing.assert_allclose(stiffness[:, :10], slope[:, :10], rtol=1e-3)


def test_figures_and_pictures(cycles):
    figures = cycle_figures(cycles)
    assert len(figures) == 10
    one = figures["stage ring 1 drive"]
    assert len(one["transmission_error_orders_um"]) == BASE.solver.static_orders
    largest = one["transmission_error_orders_um"][0]
    assert 0.2 < one["transmission_error_cycle_peak_to_peak_um"] / (2 * largest) < 3.0
    stiffness = one["gear_mesh_stiffness_n_per_um"]
    assert 0.0 < stiffness["min"] <= stiffness["mean"] <= stiffness["max"]
    chart = transmission_error_chart(cycles)
    assert len(chart.axes) == 4
    plain = {
        f"{error}_error": 0.0 * cycles[f"{error}_error"] - 1.5e-6 + noise
        for error, noise in (("transmission", 2e-22), ("unloaded_transmission", 0.0))
    }
    title = transmission_error_chart(cycles.assign(plain)).axes[0].get_title(loc="left")
    assert title.count("−1.5 ± 0 µm") == 2
    assert len(stiffness_chart(cycles).axes) == 2


def test_the_largest_axial_displacement_of_a_plane_ring_is_zero_and_not_rounding():
    """Not by 1e-11 um: bolts in the plane of spur teeth leave rounding there."""
    stage = make_case(**{"stage.gear_mesh.contact_law": "linear", "stage.helix_angle_deg": "0"})
    model = model_of(stage.case, build_system(stage.case, make_bodies(stage, bolt_z=0.0)))
    data = static(model)
    assert 0.0 < np.abs(data["tooth_displacement"].to_numpy()[..., 2]).max() < 1e-15
    figures = equilibrium_figures(model, data)["stage"]
    radial, tangential, axial = figures["tooth_displacement_largest_um"]
    assert min(radial, tangential) > 10.0
    assert axial == 0.0
