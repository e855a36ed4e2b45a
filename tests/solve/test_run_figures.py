"""Figures of a run from its model and its equilibria."""

import numpy as np
import pytest
from coupled import make_bodies, make_case
from heavy_stage import SMALL, G

from flexgear.coupling.build import build_system
from flexgear.gears.bearings import ROLLER, rating_life_hours
from flexgear.solve.model import model_of
from flexgear.solve.run_transients import stages_summary
from flexgear.solve.static import static


def test_lives_of_the_bearings_on_the_seats_of_a_heavy_carrier():
    """Under weight and a force of the rotor; only the seat with a rating has a life."""
    rating = {"dynamic_rating_kn": "3000", "rolling": "roller"}
    given = {f"stage.carrier.bearing_far.{key}": value for key, value in rating.items()}
    load = {"member": "stage.carrier", "force": (0.0, -2e5, 0.0)}
    case = make_case(**SMALL, **given).with_(gravity=(0.0, -G, 0.0), loads=(load,)).case
    model = model_of(case, build_system(case, make_bodies(case.view())))
    data = static(model, np.linspace(0.0, 2 * np.pi, 5, endpoint=False))
    found = stages_summary(model, data)["stage"]
    seat = data["bearing_force"].sel(support="stage.carrier_far")
    radial = np.hypot(seat.sel(dof="ux"), seat.sel(dof="uy")).to_numpy()
    assert found["carrier_bearing_force_n"].keys() == {"drive", "far"}
    assert found["carrier_bearing_force_n"]["far"] == pytest.approx(radial.max(), rel=1e-12)
    assert radial.min() > 1e3
    mean = np.mean(radial**ROLLER) ** (1 / ROLLER)
    expected = rating_life_hours(3e6, mean, case.inputs[0].speed)
    assert found["bearing_life_h"] == {"carrier_bearing_far": pytest.approx(expected, rel=1e-9)}
