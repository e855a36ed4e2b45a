"""Equilibria of trains against the power flow, which knows nothing of stiffness."""

import math

import numpy as np
import pytest
from train_contexts import BUNDLED, bundled, mixed, one_stage, put_together

from flexgear.solve.static import position_figures, static


@pytest.mark.parametrize("name", BUNDLED)
def test_forces_and_torques_are_those_of_the_power_flow(name):
    """Each gear mesh carries N S F r_b cos β_b: the mean over planets is the power flow's."""
    model = bundled(name)
    data = static(model, [0.0, 0.7])
    groups = dict.fromkeys(n.group for n in model.gear_meshes.names)
    for group in groups:
        own = [n.group == group for n in model.gear_meshes.names]
        mean = data["gear_mesh_force"].values[:, own].mean(axis=1)
        flow = getattr(model.flow.stage(group.stage), f"{group.kind}_gear_mesh_force")
        np.testing.assert_allclose(mean, abs(flow), rtol=1e-8, err_msg=group)
    for port in data.port.values:
        given = model.flow.torque[port]
        np.testing.assert_allclose(data["port_torque"].sel(port=port), given, rtol=1e-8)


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


def test_clearance_does_not_change_what_a_bearing_carries(tmp_path):
    free = one_stage(tmp_path, planets=3)
    gap = one_stage(tmp_path, planets=3, **{"stage.planet_bearing.clearance_um": "50"})
    a, b = (static(c, [0.0])["planet_bearing_force"].values for c in (free, gap))
    np.testing.assert_allclose(b, a, atol=2e-3 * np.abs(a).max())


def test_torque_scales_all_ports():
    model = bundled("double-rotor-5mw")
    rated = static(model, [0.0])
    half = static(model, [0.0], 0.5 * model.system.rated_torque)
    np.testing.assert_allclose(half["port_torque"], 0.5 * rated["port_torque"], rtol=1e-9)
    assert half["load_sharing"].values == pytest.approx(1.0, abs=1e-9)


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


def test_datasets_carry_their_case(tmp_path):
    data = static(put_together(bundled("lin-parker").case), [0.0])
    assert data.attrs["case"] == "lin-parker"
    assert data.attrs["closure_max"] < 1e-10
