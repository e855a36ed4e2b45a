"""The dynamic transmission error against what pairs carry: without errors load is k δ."""

import numpy as np
import pytest
from beam_planet import beam_planet
from coupled import make_bodies, make_case, stage_system
from train_contexts import bundled

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transmission_error import dynamic_transmission_error
from flexgear.coupling.modal import static_system
from flexgear.gears.geometry import stage_geometry
from flexgear.model.names import BodyName

SPUR = {"stage.helix_angle_deg": "0"}
TORQUE = 4e6


def flexible_stage(**keys):
    """A ring and a carrier that bend, and with ``planet`` planets of beams."""
    view = make_case(**SPUR, **keys)
    bodies = make_bodies(view)
    if "stage.planet.fe.tie" in keys:
        g = stage_geometry(view)
        beam = beam_planet(g.planet.teeth, 0.9 * g.planet.root_radius, young=2.06e12)
        bodies[BodyName.of(view.name, "planet")] = beam
    return stage_system(view, bodies, rigid=())


@pytest.mark.parametrize("keys", [{}, {"stage.planet.fe.tie": "root"}], ids=["ring", "planets"])
def test_teeth_of_fe_bodies(keys):
    """Spur teeth close by F/k each: the mean by their loads, at several angles of all planets."""
    system = flexible_stage(**keys)
    equilibrium = revolution(static_system(system), np.linspace(0.0, 0.3, 6), TORQUE)
    carries = np.flatnonzero(np.asarray(system.pairs.carries) == 1)
    error = dynamic_transmission_error(Recovery(equilibrium), carries)
    load, stiffness = (
        equilibrium.pair_load,
        np.where(equilibrium.pair_load > 0, equilibrium.pair_stiffness, 1.0),
    )
    total = load.sum(axis=-1)
    assert (total[:, carries] > 0).all()
    closed = (load**2 / stiffness).sum(axis=-1)[:, carries] / total[:, carries]
    np.testing.assert_allclose(error, closed, rtol=1e-6)
    assert np.ptp(error) > 0.01 * error.mean()


def test_lumped_train():
    """One spring a gear mesh: planetary and helical parallel stages without errors."""
    model = bundled("nrel-5mw")
    equilibrium = revolution(model.modal, [0.1], model.system.rated_torque)
    flanks = np.arange(equilibrium.pair_load.shape[1])
    error = dynamic_transmission_error(Recovery(equilibrium), flanks)
    total, stiffness = equilibrium.pair_load.sum(axis=-1), equilibrium.pair_stiffness.sum(axis=-1)
    assert (np.abs(total) > 0).all()
    np.testing.assert_allclose(error, total / stiffness, rtol=1e-6)
