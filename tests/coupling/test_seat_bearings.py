"""Bearings with a law of their own at every seat of a flexible stage."""

import numpy as np
import pytest
from coupled import make_bodies, make_case
from turning_ring import STANDS, SUPPORT, cheap, held_case

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.structures.kinematics import turn

SMALL = {  # few tooth nodes; planets repeat by fives
    "stage.gear_mesh.contact_law": "linear",
    "stage.sun.teeth": "20",
    "stage.planet.teeth": "20",
    "stage.ring.teeth": "60",
    "stage.planet.bore_diameter_mm": "200",
    "stage.carrier.fe.pin_diameter_mm": "180",
    "gravity_m_per_s2": "[0, -9.81, 0]",
}
KEYS = {  # by the ends of the bearings' names
    "carrier_drive": "stage.carrier.bearing_drive",
    "carrier_far": "stage.carrier.bearing_far",
    "output": "output.bearing",
}
ANGLES = np.array([0.0, 0.7, 3.0])
HOUSING = {
    "housing.kind": "lumped",
    "housing.mass_kg": "2e4",
    "housing.inertia_kg_m2": "[2e4, 2e4, 2e4]",
    "housing.mount.radial_n_per_m": "3e8",
    "housing.mount.axial_n_per_m": "3e8",
    "housing.mount.tilt_nm_per_rad": "3e8",
    "housing.mount.torsion_nm_per_rad": "3e8",
}
ROLLERS = {"count": "30", "rows": "2", "length_mm": "80", "spacing_mm": "90", "clearance_um": "20"}


def solved(bodies=None, **settings):
    case = make_case(**SMALL, **settings)
    system = build_system(case.case, bodies or make_bodies(case))
    return revolution(modal_system(system), ANGLES, case.case.inputs[0].torque)


def reaction(found, name, node, sample):
    """What a bearing carries, in fixed axes (6,)."""
    return turn(float(found.theta[sample, 0])) @ Recovery(found).link_force(name)[sample]


@pytest.mark.parametrize("more", [{}, HOUSING], ids=["ground", "housing"])
@pytest.mark.parametrize("z", ["0", "40"])
def test_without_a_gap_it_is_the_linear_bearing(more, z):
    """The limit c → 0, also off the middle of the seat and between frames that turn: to the share
    that the gap has of what the bearing closes by."""
    places = {f"{KEYS[seat]}.z_mm": z for seat in KEYS}
    gaps = {f"{KEYS[seat]}.clearance_um": "1e-7" for seat in KEYS}
    linear, tight = solved(**more, **places), solved(**more, **places, **gaps)
    scale = np.abs(linear.pair_load).max()
    assert np.abs(tight.pair_load - linear.pair_load).max() < 1e-8 * scale
    for seat in KEYS:
        forces = [Recovery(e).link_force(f"stage.{seat}") for e in (linear, tight)]
        weight = np.abs(forces[0]).max(axis=0)
        assert np.abs(forces[1] - forces[0]).max() < 1e-7 * weight.max()


@pytest.mark.parametrize(("at", "number"), [("stage.planet_bearing", 5), ("stage.sun.support", 1)])
def test_without_a_gap_planets_and_sun_stand_on_linear_bearings(at, number):
    stiff = {f"{at}.radial_n_per_m": "3e9"}
    linear, tight = solved(**stiff), solved(**stiff, **{f"{at}.clearance_um": "1e-7"})
    assert len(tight.modal.system.bearings) == number
    scale = np.abs(linear.pair_load).max()
    assert np.abs(tight.pair_load - linear.pair_load).max() < 1e-8 * scale


@pytest.mark.parametrize("at", ["ring.hub.bearing", "carrier.bearing_drive"])
def test_without_a_gap_a_star_stands_on_linear_bearings(tmp_path, at):
    """Of the hub that turns with its FE ring, and of the carrier that is held."""
    found = []
    for gap in ({}, {f"stage.{at}.clearance_um": "1e-7"}):
        case = held_case(tmp_path, "carrier", "sun", "ring", **SUPPORT, **STANDS, **gap)
        case = case.with_(gravity=(0.0, -9.81, 0.0))
        system = build_system(case, cheap(case))
        found.append(revolution(modal_system(system), ANGLES, system.rated_torque))
    linear, tight = found
    assert len(tight.modal.system.bearings) == 1
    scale = np.abs(linear.pair_load).max()
    assert np.abs(tight.pair_load - linear.pair_load).max() < 1e-8 * scale


@pytest.mark.parametrize("more", [{}, HOUSING], ids=["ground", "housing"])
def test_forces_balance_with_gaps_and_rollers(more):
    laws = {
        "stage.carrier.bearing_drive.clearance_um": "150",
        "stage.carrier.bearing_drive.z_mm": "20",
        **{f"stage.carrier.bearing_far.rollers.{k}": v for k, v in ROLLERS.items()},
        "output.bearing.clearance_um": "50",
    }
    found = solved(**more, **laws)
    assert found.closure.max() < 1e-8
    system = found.modal.system
    assert {b.law for b in system.bearings} == {"clearance", "rollers"}
    # all bodies but the ring hang on these bearings and the gear meshes: y forces add to the weight
    recovery = Recovery(found)
    rows = recovery.bearing_loads("stage.carrier_far")
    force = recovery.link_force("stage.carrier_far")
    psi = 2 * np.pi * np.arange(30) / 30
    inward = np.abs(rows @ np.exp(1j * psi)).sum(axis=1)
    assert (np.hypot(force[:, 0], force[:, 1]) <= inward * (1 + 1e-3) + 1e-6).all()


def test_a_carrier_rests_on_the_bottom_of_its_gap():
    """Without torque it hangs by its weight: each seat is lower by its gap plus F/k."""
    gap, k = 2e-4, 5e9
    keys = {f"{KEYS[seat]}.clearance_um": "200" for seat in ("carrier_drive", "carrier_far")}
    case = make_case(**SMALL, **keys)
    system = build_system(case.case, make_bodies(case))
    found = revolution(modal_system(system), ANGLES, 1.0)
    recovery = Recovery(found)
    for side in ("drive", "far"):
        force = recovery.link_force(f"stage.carrier_{side}")
        moved = recovery.node("stage.carrier", f"bearing_{side}")
        for t in range(len(ANGLES)):
            r = turn(float(found.theta[t, 0]))[:2, :2]
            f, u = r @ force[t, :2], r @ moved[t, :2]
            assert u[1] < -0.9 * gap
            assert np.hypot(*u) == pytest.approx(gap + np.hypot(*f) / k, rel=1e-3)
            assert u @ f == pytest.approx(np.hypot(*u) * np.hypot(*f), rel=1e-6)
