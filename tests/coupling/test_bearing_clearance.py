"""Bearings with a law of their own at every seat: gaps, weight, loads of rows, energy."""

import numpy as np
import pytest
from coupled import TORQUE, make_bodies, make_case
from heavy_stage import SMALL, G, mass_of, reactions, solved
from stepped import energy_closes, jump
from trains import lumped_housing, stage_train
from turning_ring import STANDS, SUPPORT, cheap, held_case

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.solve.dataset import equilibrium_data
from flexgear.solve.model import model_of
from flexgear.structures.bodies import turn

WEIGHED = {**SMALL, "gravity_m_per_s2": "[0, -9.81, 0]"}
ANGLES = np.array([0.0, 0.7, 3.0])


def housing(stiffness, mass="2e4"):
    """A lumped housing on a mount of one stiffness in all directions."""
    return lumped_housing(mass, str([float(mass)] * 3), *4 * [stiffness])


HOUSING = housing("3e8")
ROLLERS = {"count": "30", "rows": "2", "length_mm": "80", "spacing_mm": "90", "clearance_um": "20"}


def with_seats(_=None, **settings):
    case = make_case(**WEIGHED, **settings)
    system = build_system(case.case, make_bodies(case))
    return revolution(modal_system(system), ANGLES, case.case.inputs[0].torque)


def star(folder, **settings):
    """On a hub that turns with its FE ring, its carrier held."""
    case = held_case(folder, "carrier", "sun", "ring", **SUPPORT, **STANDS, **settings)
    system = build_system(case.with_(gravity=(0.0, -9.81, 0.0)), cheap(case))
    return revolution(modal_system(system), ANGLES, system.rated_torque)


SEATS = ("stage.carrier.bearing_drive", "stage.carrier.bearing_far", "output.bearing")
FORTY_ROLLERS = ROLLERS | {"count": "40", "length_mm": "60", "spacing_mm": "80"}
MOVING = housing("1e9")
LOAD = {"member": "stage.carrier", "force": (2e5, -4e5, 0.0), "moment": (1e5, 3e5, 0.0)}


def gaps(size_um, places=SEATS):
    return {f"{at}.clearance_um": size_um for at in places}


LIGHT_HOUSING = lumped_housing("50", "[2, 2, 3]", "3e8", "2e8", "4e6", "5e6")
SPATIAL = {
    "kinematics": '"spatial"',
    "stage.sun.support.axial_n_per_m": "1e8",
    "stage.sun.support.tilt_nm_per_rad": "1e5",
    "stage.ring.support.axial_n_per_m": "1e9",
    "stage.ring.support.tilt_nm_per_rad": "1e7",
    "stage.carrier.support.axial_n_per_m": "1e9",
    "stage.carrier.support.tilt_nm_per_rad": "1e7",
    "stage.planet_bearing.axial_n_per_m": "1e8",
    "stage.planet_bearing.tilt_nm_per_rad": "1e5",
}
LUMPED_ANGLES = np.array([0.0, 0.4, 2.0])
PLACES = ("stage.carrier.support", "stage.sun.support", "stage.planet_bearing")


def lumped(folder, **settings):
    weight = {"gravity_m_per_s2": "[0, -9.81, 0]"}
    case = stage_train(
        folder, sun="1e8", helix=10, **SPATIAL, **LIGHT_HOUSING, **weight, **settings
    )
    system = build_system(case)
    return revolution(modal_system(system), LUMPED_ANGLES, system.rated_torque)


STIFF = {f"{at}.radial_n_per_m": "3e9" for at in ("stage.planet_bearing", "stage.sun.support")}


@pytest.mark.parametrize(
    ("make", "places", "number", "more"),
    [
        (with_seats, SEATS, 3, {}),
        (with_seats, SEATS, 3, {**HOUSING, **{f"{seat}.z_mm": "40" for seat in SEATS}}),
        (with_seats, ("stage.planet_bearing",), 5, STIFF),
        (with_seats, ("stage.sun.support",), 1, STIFF),
        (star, ("stage.ring.hub.bearing",), 1, {}),
        (star, ("stage.carrier.bearing_drive",), 1, {}),
        (lumped, PLACES, 6, {f"{place}.z_mm": "15" for place in PLACES}),
    ],
)
def test_a_bearing_without_a_gap_is_linear(tmp_path, make, places, number, more):
    """The limit c → 0, also off the middle of the seat and between frames that turn: to the share
    that the gap has of what the bearing closes by."""
    linear, tight = make(tmp_path, **more), make(tmp_path, **more, **gaps("1e-7", places))
    assert len(tight.modal.system.bearings) == number
    scale = np.abs(linear.pair_load).max()
    assert np.abs(tight.pair_load - linear.pair_load).max() < 1e-8 * scale
    for bearing in tight.modal.system.bearings:
        linear_force, force = (Recovery(e).link_force(bearing.name) for e in (linear, tight))
        assert np.abs(force - linear_force).max() < 1e-7 * np.abs(linear_force).max()


@pytest.mark.parametrize("more", [{}, HOUSING], ids=["ground", "housing"])
def test_forces_balance_with_gaps_and_rollers(more):
    laws = {
        "stage.carrier.bearing_drive.clearance_um": "150",
        "stage.carrier.bearing_drive.z_mm": "20",
        **{f"stage.carrier.bearing_far.rollers.{k}": v for k, v in ROLLERS.items()},
        "output.bearing.clearance_um": "50",
    }
    equilibrium = with_seats(**more, **laws)
    assert equilibrium.closure.max() < 1e-8
    system = equilibrium.modal.system
    assert {b.law for b in system.bearings} == {"clearance", "rollers"}
    # all bodies but the ring hang on these bearings and the gear meshes: y forces add to the weight
    recovery = Recovery(equilibrium)
    rows = recovery.bearing_loads("stage.carrier_far")
    force = recovery.link_force("stage.carrier_far")
    psi = 2 * np.pi * np.arange(30) / 30
    inward = np.abs(rows @ np.exp(1j * psi)).sum(axis=1)
    assert (np.hypot(force[:, 0], force[:, 1]) <= inward * (1 + 1e-3) + 1e-6).all()


def rollers(places=SEATS):
    return {f"{at}.rollers.{key}": value for at in places for key, value in FORTY_ROLLERS.items()}


def loaded_system(bodies=None, **settings):
    """The small stage with a force and a moment in space on its carrier."""
    case = make_case(**SMALL, **settings).with_(loads=(LOAD,))
    return build_system(case.case, bodies or make_bodies(case))


@pytest.mark.parametrize("angle", [0.0, 2.0])
def test_a_heavy_stage_drops_by_the_clearance(angle):
    """Weight is held to 1e-8; each seat moves by c + F/k, F being what the law carries there."""
    gap, places = 5e-5, SEATS[:2]
    plain = make_case(**SMALL, **gaps("50", places))
    bodies = make_bodies(plain)
    heavy = plain.with_(gravity=(0.0, -G, 0.0))
    equilibrium, free = (solved(case, bodies, [angle]) for case in (heavy, make_case(**SMALL)))
    system = equilibrium.modal.system
    weight = mass_of(system) * G
    more = reactions(equilibrium) - reactions(free)
    assert more[:3] == pytest.approx([0.0, weight, 0.0], abs=1e-8 * weight)
    recovery = Recovery(equilibrium)
    for side in ("drive", "far"):
        u = recovery.node("stage.carrier", f"bearing_{side}")[0, :2]
        k = plain.stage.seat_bearings[side].stiffness[0]
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
    energy_closes(modal, jump(TORQUE, 0.5 * TORQUE, 0.002), 0.008)


def test_results_hold_the_rows_of_seats_beside_those_of_planets():
    """As many rows as any bearing has; those of supports without rollers are missing."""
    planets = {
        f"stage.planet_bearing.rollers.{k}": v for k, v in (FORTY_ROLLERS | {"rows": "1"}).items()
    }
    case = make_case(**SMALL, **rollers(SEATS[1:2]), **planets).with_(loads=(LOAD,)).case
    bodies = make_bodies(case.view())
    model = model_of(case, build_system(case, bodies))
    equilibrium = revolution(model.modal, np.array([0.0, 0.7]), TORQUE)
    data = equilibrium_data(model, equilibrium)
    seat = data.bearing_row_load.sel(support="stage.carrier_far")
    assert np.isfinite(seat).all() and seat.max() > 1e4
    assert np.isnan(data.bearing_row_load.sel(support="stage.carrier_drive")).all()
    assert np.isfinite(data.planet_bearing_row_load[:, :, 0]).all()
    assert np.isnan(data.planet_bearing_row_load[:, :, 1]).all()
    recovered = Recovery(equilibrium).row_loads(["stage.carrier_far"])[:, 0]
    np.testing.assert_allclose(seat, recovered, rtol=1e-12)


def test_a_gap_that_stays_open_leaves_the_carrier_to_the_teeth(tmp_path):
    """What the limit is told from: within 50 µm the gear meshes alone hold it up."""
    linear = lumped(tmp_path)
    loose = lumped(tmp_path, **{"stage.carrier.support.clearance_um": "50"})
    rows = linear.modal.system.node_rows("stage.carrier", "stage.carrier")[:2]
    low, high = (np.hypot(*(rows @ e.modal.modes @ e.eta.T)).max() for e in (loose, linear))
    assert 1.2 * high < low < 50e-6
