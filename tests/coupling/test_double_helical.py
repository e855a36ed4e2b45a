"""A double-helical stage whose ring, carrier and sun shaft bend."""

import numpy as np
import pytest
from cheap_bodies import cheap_carrier, cheap_ring
from coupled import TORQUE, make_case, named, stage_system

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.structures.sources.ring import source as ring_source

DOUBLE = {
    "stage.double_helical": "true", "stage.face_width_mm": "190", "stage.half_gap_mm": "60",
    "stage.helix_angle_deg": "25", "stage.planet_bearing.z_mm": "0", "stage.ring.fe.fits": "[]",
    "stage.gear_mesh.contact_law": "one-sided",
}  # fmt: skip
ANGLES = np.array([0.0, 0.02, 0.3])


def system(drive_z=-0.6, rigid=(), **changes):
    """Ring of two halves, each bolted at its outer end, and a carrier driven at drive_z."""
    direction = "+z" if drive_z < 0 else "-z"
    case = make_case(**{**DOUBLE, "stage.sun.shaft.direction": direction, **changes})
    g = stage_geometry(case)
    ring = cheap_ring(case.ring_gear.teeth, g.ring.reference_radius, bolt_z=-0.095)
    carrier = cheap_carrier(case.stage.planets, g.center_distance, drive_z=drive_z)
    return case, stage_system(
        case, named(case, ring=ring_source(case).whole(ring), carrier=carrier), rigid
    )


def forces(equilibrium, side, kind):
    """Gear-mesh forces (p, N) of one half, N."""
    labels = equilibrium.modal.system.gear_meshes
    columns = [m for m, x in enumerate(labels) if (x.side, x.kind) == (side, kind)]
    return equilibrium.pair_load[:, columns].sum(axis=-1)


@pytest.mark.parametrize("rigid", [(), ("ring", "carrier", "shaft")])
def test_both_halves_carry_what_the_power_flow_says(rigid):
    case, built = system(rigid=rigid)
    equilibrium = revolution(modal_system(built), ANGLES, TORQUE)
    flow = power_flow(case.case).stages[0]
    for kind in ("ring", "sun"):
        both = forces(equilibrium, "left", kind) + forces(equilibrium, "right", kind)
        expected = 2 * flow.gear_mesh_forces[kind]
        np.testing.assert_allclose(both.mean(axis=1), expected, rtol=5e-3)


def test_the_mirror_image_of_the_machine_swaps_the_halves():
    """Driven from the other end, the other half carries what this one did."""
    equilibrium, image = (
        revolution(modal_system(system(z)[1]), ANGLES, TORQUE) for z in (-0.6, 0.6)
    )
    size = forces(equilibrium, "left", "ring").max()
    for kind in ("ring", "sun"):
        left, right = (forces(equilibrium, side, kind) for side in ("left", "right"))
        assert np.abs(left - right).max() > 1e-3 * size  # twist of carrier and shaft
        np.testing.assert_allclose(forces(image, "right", kind), left, atol=1e-8 * size)
        np.testing.assert_allclose(forces(image, "left", kind), right, atol=1e-8 * size)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stage.carrier.fe.plate_gap_mm": "430"}, "both halves and their gap"),
        ({"stage.gear_mesh.model": "face_load", "stage.gear_mesh.root_stress": "fe"}, "two halves"),
    ],
)
def test_halves_that_do_not_fit_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        make_case(**{**DOUBLE, **changes})


def test_a_load_on_a_ring_of_two_halves_is_shared_by_them():
    """Forces and moments in fixed axes; the supports of sun, carrier and ring take them."""
    turns = {
        "output.member": "stage.ring", "held": '["stage.carrier"]', "kinematics": '"spatial"',
        "stage.carrier.support.tangential_n_per_m": "1e9", "stage.planet_bearing.tilt_nm_per_rad":
        "1e8", "stage.ring.support.tangential_n_per_m": "0",
        **{f"stage.{m}.support.tilt_nm_per_rad": "1e9" for m in ("sun", "ring", "carrier")},
    }  # fmt: skip
    case = load_case("herringbone", turns)
    force, moment = (3e4, -2e4, 1e4), (2e3, 5e3, 0.0)
    load = {"member": "stage.ring", "force": force, "moment": moment}
    held, angle = [], np.array([0.4])
    for one in (case, case.with_(loads=(load,))):
        system = build_system(one)
        recovery = Recovery(revolution(modal_system(system), angle, system.rated_torque))
        total, halves = np.zeros(6), []
        for name in ("sun", "carrier", "ring_left", "ring_right"):
            carried = recovery.link_force(f"stage.{name}_support")[0]
            total += carried
            if name.startswith("ring"):
                halves.append(carried)
        held.append((total, *halves))
    more = [loaded - plain for plain, loaded in zip(*held, strict=True)]
    six_components = np.array([*force, *moment])
    assert more[0] == pytest.approx(six_components, abs=1e-8 * np.abs(six_components).max())
    assert np.abs(more[1] - more[2]).max() < 0.2 * np.abs(more[1]).max()


def test_supports_with_clearance_are_the_same_on_both_halves_of_a_ring():
    case = load_case("herringbone", overrides={"stage.ring.support.clearance_um": 20.0})
    links = {link.name: link.matrix for link in build_system(case).links}
    left, right = (links[f"stage.ring_{side}_support"] for side in ("left", "right"))
    np.testing.assert_array_equal(left, right)
    assert left[2, 2] == 1e10
    assert 0.0 < left[0, 0] < 1e-3 * 1e10  # centred in its clearance
