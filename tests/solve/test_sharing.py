"""Quasi-static load sharing: theorems, error cycles, and the linear way against the solved one."""

import numpy as np
import pytest
from train_contexts import bundled, one_stage

from flexgear.analysis.equilibrium import revolution
from flexgear.model.errors import FlexgearError
from flexgear.solve.linear import linear_train, why_not_linear
from flexgear.solve.model import rated_rotations
from flexgear.solve.static import shared_stages, stages_sharing

ERRORS = {
    "stage.errors.sun_eccentricity_um": "20",
    "stage.errors.planet_eccentricity_um": "[15, 30, 5]",
    "stage.errors.planet_eccentricity_phase_deg": "[10, 200, 75]",
    "stage.errors.ring_eccentricity_um": "25",
    "stage.errors.carrier_eccentricity_um": "12",
    "stage.errors.pin_tangential_um": "[30, -10, 4]",
    "stage.errors.ring_gear_mesh_um": "6",
    "stage.errors.sun_gear_mesh_um": "-4",
    "stage.errors.sun_pitch_um": "5",
    "stage.errors.planet_pitch_um": "4",
}


def test_a_held_sun_does_not_even_out():
    """Stage 1 of the pitch drive holds its sun: its K is large, the others' 1."""
    model = bundled("pitch-drive")
    held = stages_sharing(model, "stage_1", cycles=50)["load_sharing_coefficient"]
    free = stages_sharing(model, "stage_3", cycles=50)["load_sharing_coefficient"]
    assert held.values.min() > 5
    np.testing.assert_allclose(free, 1.0, atol=1e-9)


@pytest.mark.parametrize("weight", [False, True])
def test_linear_way_is_the_solved_way(tmp_path, weight):
    """One influence matrix gives what solving position by position gives, with every error."""
    head = "gravity_m_per_s2 = [1, -9.81, 0.5]\n" if weight else ""
    model = one_stage(tmp_path, planets=3, sun="3e8", head=head, **ERRORS)
    assert why_not_linear(model.system) is None
    angles = rated_rotations(model.system, np.linspace(0, 60, 37))
    solved = revolution(model.modal, angles, model.system.rated_torque)
    linear = linear_train(model.system).forces(angles)
    np.testing.assert_allclose(linear, solved.pair_load.sum(axis=-1), rtol=1e-8)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"stage.gear_mesh.model": "rectangular"}, "stiffness"),
        ({"stage.gear_mesh.contact_law": "one-sided"}, "one-sided"),
        ({"stage.planet_bearing.clearance_um": "20"}, "clearance"),
        ({"stage.carrier.support.radial_x_n_per_m": "1e8"}, "direction"),
    ],
)
def test_other_trains_are_solved_position_by_position(tmp_path, change, reason):
    model = one_stage(tmp_path, planets=3, **change)
    assert reason in why_not_linear(model.system)
    data = stages_sharing(model, "stage", cycles=2)
    assert data.attrs["cycles_looked_at"] <= 2
    assert data["load_sharing_coefficient"].values == pytest.approx(1.0, abs=0.2)


def test_the_whole_error_cycle_is_looked_at():
    """lcm(23, 17, 57) gear-mesh cycles of the herringbone stage, none left out."""
    model = bundled("herringbone")
    data = stages_sharing(model, "stage")
    assert data.attrs["cycles"] == data.attrs["cycles_looked_at"] == 23 * 17 * 57
    assert data.attrs["complete"] == 1
    assert data.sizes["cycle"] == 23 * 17 * 57
    part = stages_sharing(model, "stage", cycles=300)
    whole = float(data["load_sharing_coefficient"].max())
    assert 0.99 * (whole - 1) < float(part["load_sharing_coefficient"].max()) - 1 <= whole - 1


def test_errors_come_back_after_their_cycle():
    """Forces one error cycle later are the same, a third of it later they are not."""
    model = bundled("herringbone")
    linear = linear_train(model.system)
    theta_per_lead = 3.0106929597 / 10.4719755120
    lead = np.array([0.2, 1.4])
    cycle = 391 * 2 * np.pi / theta_per_lead
    first, again, third = (
        linear.forces(rated_rotations(model.system, lead + shift))
        for shift in (0.0, cycle, cycle / 3)
    )
    np.testing.assert_allclose(again, first, rtol=1e-6)
    assert np.abs(third - first).max() > 1e-3 * first.max()


def test_positions_shown_are_one_turn_of_the_stage():
    model = bundled("lin-parker")
    data = stages_sharing(model, "stage")
    sun = data["input_angle"].values[:, 0]
    carrier = abs(sun[-1] + sun[1] - 2 * sun[0]) * 26 / (26 + 94)
    assert carrier == pytest.approx(2 * np.pi, rel=1e-6)
    assert sun[-1] * model.flow.speed["stage.sun"] > 0  # forward in time


def test_stages_that_share_nothing():
    model = bundled("nrel-5mw")
    assert shared_stages(model) == ["stage_1", "stage_2"]
    with pytest.raises(FlexgearError, match="no planets that share"):
        stages_sharing(model, "stage_3")
