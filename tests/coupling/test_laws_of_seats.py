"""Laws at all bearings of a flexible stage: weight, loads of rows, energy in transients."""

import numpy as np
import pytest
from coupled import TORQUE, make_bodies, make_case
from heavy_stage import SMALL, G, mass_of, reactions, solved
from stepped import Jumping, energy_error, stepped

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.solve.dataset import equilibrium_data
from flexgear.solve.model import model_of
from flexgear.structures.kinematics import turn

SEATS = ("stage.carrier.bearing_drive", "stage.carrier.bearing_far", "output.bearing")
ROLLERS = {"count": "40", "rows": "2", "length_mm": "60", "spacing_mm": "80", "clearance_um": "20"}
MOVING = {
    "housing.kind": '"lumped"',
    "housing.mass_kg": "2e4",
    "housing.inertia_kg_m2": "[2e4, 2e4, 2e4]",
    "housing.mount.radial_n_per_m": "1e9",
    "housing.mount.axial_n_per_m": "1e9",
    "housing.mount.tilt_nm_per_rad": "1e9",
    "housing.mount.torsion_nm_per_rad": "1e9",
}


def gaps(size_um, places=SEATS):
    return {f"{at}.clearance_um": size_um for at in places}


def rollers(places=SEATS):
    return {f"{at}.rollers.{key}": value for at in places for key, value in ROLLERS.items()}


def loaded_system(bodies=None, **given):
    """The small stage with a force and a moment in space on its carrier."""
    load = {"member": "stage.carrier", "force": (2e5, -4e5, 0.0), "moment": (1e5, 3e5, 0.0)}
    case = make_case(**SMALL, **given).with_(loads=(load,))
    return build_system(case.case, bodies or make_bodies(case))


@pytest.mark.parametrize("angle", [0.0, 2.0])
def test_a_heavy_stage_drops_by_the_clearance(angle):
    """Weight is held to 1e-8; each seat moves by c + F/k, F being what the law carries there."""
    gap, places = 5e-5, SEATS[:2]
    plain = make_case(**SMALL, **gaps("50", places))
    bodies = make_bodies(plain)
    heavy = plain.with_(gravity=(0.0, -G, 0.0))
    found, free = (solved(case, bodies, [angle]) for case in (heavy, make_case(**SMALL)))
    system = found.modal.system
    weight = mass_of(system) * G
    more = reactions(found) - reactions(free)
    assert more[:3] == pytest.approx([0.0, weight, 0.0], abs=1e-8 * weight)
    recovery = Recovery(found)
    for side in ("drive", "far"):
        u = recovery.node("stage.carrier", f"bearing_{side}")[0, :2]
        k = plain.seat_bearings[side].stiffness[0]
        force = recovery.link_force(f"stage.carrier_{side}")[0, :2]
        loaded = max(np.hypot(*u) - gap, 0.0)
        expected = (1 - 1e-4) * k * loaded + 1e-4 * k * np.hypot(*u)
        assert np.hypot(*force) == pytest.approx(expected, rel=1e-8)
        assert np.hypot(*u) > gap


def test_rows_of_carrier_bearings_add_up_on_a_housing_that_moves():
    """Loads of all rollers are the force of their bearing, seen from the housing."""
    system = loaded_system(**MOVING, **rollers())
    recovery = Recovery(revolution(modal_system(system), np.array([0.7]), TORQUE))
    turning = {support.name: support for support in system.rotating_frame_supports}
    for side in ("drive", "far"):
        name = f"stage.carrier_{side}"
        loads = recovery.bearing_loads(name)
        psi = 2 * np.pi * np.arange(40) / 40
        total = np.array([(loads * f(psi)).sum() for f in (np.cos, np.sin)])
        force = recovery.link_force(name) - recovery._turning_force(turning[name])
        assert np.abs(total).max() > 1e4
        turned = turn(0.7)[:2, :2] @ force[0, :2]
        assert total == pytest.approx(turned, rel=1e-8)


@pytest.mark.parametrize("housing", [{}, MOVING])
@pytest.mark.parametrize("law", [gaps("20"), rollers()])
def test_energy_closes_with_laws_at_all_bearings(law, housing):
    system = loaded_system(**law, **housing)
    modal = modal_system(system, 2000.0)
    drive = Jumping(lambda t: np.where(t > 0.002, 0.5 * TORQUE, TORQUE), jumps=(0.002,))
    lost = []
    for step in (4e-5, 2e-5):
        run = stepped(modal, drive, 0.008, step, 2e-4, track_energy=True)
        lost.append(energy_error(run))
    assert lost[1] < 1e-3
    assert lost[1] < 0.5 * lost[0]


def test_results_hold_the_rows_of_seats_beside_those_of_planets():
    """As many rows as any bearing has; those of supports without rollers are missing."""
    planets = {f"stage.planet_bearing.rollers.{k}": v for k, v in (ROLLERS | {"rows": "1"}).items()}
    load = {"member": "stage.carrier", "force": (2e5, -4e5, 0.0), "moment": (1e5, 3e5, 0.0)}
    case = make_case(**SMALL, **rollers(SEATS[1:2]), **planets).with_(loads=(load,)).case
    bodies = make_bodies(case.view())
    model = model_of(case, build_system(case, bodies))
    found = revolution(model.modal, np.array([0.0, 0.7]), TORQUE)
    data = equilibrium_data(model, found)
    seat = data.bearing_row_load.sel(support="stage.carrier_far")
    assert np.isfinite(seat).all() and seat.max() > 1e4
    assert np.isnan(data.bearing_row_load.sel(support="stage.carrier_drive")).all()
    assert np.isfinite(data.planet_bearing_row_load[:, :, 0]).all()
    assert np.isnan(data.planet_bearing_row_load[:, :, 1]).all()
    recovered = Recovery(found).row_loads(["stage.carrier_far"])[:, 0]
    np.testing.assert_allclose(seat, recovered, rtol=1e-12)
