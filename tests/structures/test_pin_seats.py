"""Pins of a reduced carrier beside the unreduced one under the pressure of two bearing rows."""

import numpy as np
import pytest

from flexgear.model.load import load_case
from flexgear.structures.fem import FeModel, facet_sample
from flexgear.structures.reduction import condense
from flexgear.structures.sources.of_case import carrier_source
from flexgear.structures.sources.reducing import tied


def test_a_pin_yields_to_two_rows_as_the_unreduced_carrier_does():
    """Pressure p ~ cos of the angle on either half of the seat: equal pressures push the pin,
    opposite ones tilt it. The displacement of the unreduced carrier is a solution of K + BᵀSB
    itself. An average over all of the displacement was 19 % too stiff against tilting."""
    view = load_case("wind-5mw", {"solver.fidelity": "quick"}).view()
    m = view.material
    model = FeModel(carrier_source(view).fe_mesh(), m.young_modulus, m.poisson_ratio, m.density)
    interface = tied(model, carrier_source(view).nodes(model.fe_mesh))
    condensation = condense(model, interface)
    supports = carrier_source(view).supports(interface.node_names, condensation.stiffness)
    node = interface.node_names.index("pin_1")
    seat = facet_sample(model, model.fe_mesh.facets["pin_1"])
    arm = seat.points - interface.positions[node]
    normal = arm * [1.0, 1.0, 0.0] / np.hypot(*arm.T[:2])[:, None]
    for across in (0, 1):
        loads, wrenches = [], []
        for half in (arm[:, 2] < 0, arm[:, 2] > 0):
            forces = (seat.weights * half * normal[:, across])[:, None] * normal
            forces /= forces[:, across].sum()
            loads.append(seat.load(forces))
            wrench = np.zeros(interface.size)
            moment = np.cross(arm, forces).sum(axis=0)
            wrench[6 * node : 6 * node + 6] = [*forces.sum(axis=0), *moment]
            wrenches.append(wrench)
        loads, wrenches = np.array(loads).T, np.array(wrenches).T
        motion = condensation.supported_solve(loads, supports)
        full = loads.T @ motion
        reduced = wrenches.T @ np.linalg.solve(condensation.stiffness + supports, wrenches)
        for rows, accepted in (([0.5, 0.5], 0.01), ([0.5, -0.5], 0.12)):
            exact = np.array(rows) @ full @ rows
            assert np.array(rows) @ reduced @ rows == pytest.approx(exact, rel=accepted)
