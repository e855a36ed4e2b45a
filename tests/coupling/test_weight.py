"""Weight and loads reach every body of a flexible stage, also those that bend."""

import math
from dataclasses import replace

import numpy as np
import pytest
from coupled import make_bodies, make_case
from heavy_stage import SMALL, G, body_mass, reactions, solved

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.loads import weight_rows
from flexgear.coupling.modal import modal_system
from flexgear.face.case import load_case
from flexgear.model.names import BodyName
from flexgear.solve.model import assemble
from flexgear.structures.bodies import rigid_variant, rotation


@pytest.mark.parametrize("part", ["ring", "carrier"])
def test_weight_of_a_rigid_fe_body_acts_at_its_centre_of_mass(part):
    """As unit translations of all of it: force m, moment s × m, the same for flexible and rigid."""
    case = make_case(**SMALL)
    flexible = make_bodies(case)[BodyName.of(case.name, part)].as_body()
    rows = []
    for body in (flexible, rigid_variant(flexible)):
        rows.append(weight_rows(body) @ body.rigid_motions)
    assert rows[1] == pytest.approx(rows[0], abs=1e-9 * np.abs(rows[0]).max())
    assert np.abs(rows[1][:, 5]).max() < 1e-9 * np.abs(rows[1]).max()


HEAVIER = 250.0  # kg, each body with it


def heavier(part):
    """The same stage with more mass on one part, what that adds in all (kg), and its height (m)."""
    keys = {"stage.sun.mass_kg": "400", "stage.planet.mass_kg": "300"}
    plain = make_case(**SMALL, **keys)
    bodies, name = make_bodies(plain), f"stage.{part}"
    if name in bodies:
        body = bodies[name]
        share = HEAVIER / len(body.positions)
        more = np.kron(np.eye(len(body.positions)), np.diag([share] * 3 + [0.0] * 3))
        bodies[name] = replace(body, mass=body.mass + more)
        return plain, plain, bodies, HEAVIER, float(body.positions[:, 2].mean())
    key = f"stage.{part}.mass_kg"
    case = make_case(**SMALL, **{**keys, key: str(float(keys[key]) + HEAVIER)})
    return plain, case, bodies, HEAVIER * (5 if part == "planet" else 1), 0.0


@pytest.mark.parametrize("part", ["sun", "planet", "ring", "carrier"])
def test_a_body_weighs_what_it_weighs(part):
    """What mass on one body adds to the reactions is its weight, in force and moment."""
    plain, case, bodies, mass, height = heavier(part)
    light, heavy = (
        reactions(solved(c.with_(gravity=(0.0, -G, 0.0)), pair, [2.0]))
        for c, pair in ((plain, make_bodies(plain)), (case, bodies))
    )
    weight = np.array([0.0, -G * mass, 0.0])
    expected = -np.r_[weight, np.cross([0.0, 0.0, height], weight)]
    assert heavy - light == pytest.approx(expected, abs=1e-8 * G * mass)


def normals(system):
    """Directions (M, 3) of the force on each gear mesh's planet, in its planet's axes."""
    pairs = system.pairs
    return np.column_stack([pairs.normal * pairs.cos_b[:, None], pairs.sin_b])


def unbalanced(equilibrium, angle):
    """Force (3,) that gear meshes and springs leave on each body at the first position, N."""
    system, recovery = equilibrium.modal.system, Recovery(equilibrium)
    force = {link.name.removeprefix("stage."): recovery.link_force(link.name)[0, :3]
             for link in system.links}  # fmt: skip
    rest = {part: np.zeros(3) for part in ("ring", "shaft", "carrier")}  # in fixed axes
    load = equilibrium.pair_load[0].sum(axis=-1)
    for label, normal, size in zip(system.gear_meshes, normals(system), load, strict=True):
        turned = rotation(angle + 2 * math.pi * label.planet / 5)
        planet = rest.setdefault(f"planet_{label.planet + 1}", np.zeros(3))
        planet += turned @ normal * size
        rest["ring" if label.kind.startswith("ring") else "shaft"] -= turned @ normal * size
    for i in range(5):
        pin = rotation(angle + 2 * math.pi * i / 5) @ force[f"planet_bearing_{i + 1}"]
        rest[f"planet_{i + 1}"] += pin
        rest["carrier"] -= pin
    for name, spring in force.items():
        if name.startswith(("bolt", "fit")):
            x = system.body("stage.ring").position(name)
            bolt = math.atan2(x[1], x[0]) if name.startswith("bolt") else 0.0
            rest["ring"] -= rotation(bolt) @ spring
        elif name.startswith("carrier"):
            rest["carrier"] -= rotation(angle) @ spring
    rest["shaft"] -= rotation(angle) @ force["spline"]
    return rest


def test_springs_and_gear_meshes_hold_every_body_against_its_weight():
    """The free body of sun, planets, ring and carrier: no force is left over beside m g."""
    case = make_case(**SMALL, **{"inputs.0.torque_nm": "1e5"})
    equilibrium = solved(case.with_(gravity=(0.0, -G, 0.0)), make_bodies(case), [0.7])
    rest = unbalanced(equilibrium, 0.7)
    assert len(rest) == 8
    for name, left in rest.items():
        weight = body_mass(equilibrium.modal.system.body(f"stage.{name}")) * G
        assert left == pytest.approx([0.0, weight, 0.0], abs=1e-8 * weight)


def test_a_floating_sun_without_torque_rests_on_the_teeth():
    """The shaft holds the sun so softly that springs of 1 N/m in open flanks moved it."""
    case = load_case("wind-5mw", **{"inputs.0.torque_nm": 0, "gravity_m_per_s2": [0, -G, 0]})
    model = assemble(case, ["all"])
    rest = unbalanced(revolution(model.modal, np.array([0.4]), 0.0), 0.4)
    for name in ("shaft", "planet_1", "planet_2", "planet_3", "planet_4", "planet_5"):
        weight = body_mass(model.system.body(f"stage.{name}")) * G
        assert rest[name] == pytest.approx([0.0, weight, 0.0], abs=1e-8 * weight)


def test_dropped_modes_carry_weight_by_their_residual_flexibility():
    """Statics do not know how many modes are kept: columns of weight have residual attachments."""
    case = make_case(**SMALL).with_(gravity=(0.0, -G, 0.0))
    system = build_system(case.case, make_bodies(case))
    torque, angles = case.case.inputs[0].torque, np.array([0.3, 2.0])
    few, every = (
        revolution(modal_system(system, limit), angles, torque) for limit in (150.0, None)
    )
    assert few.modal.dropped > 200
    for body, node in (("stage.ring", "tooth_017"), ("stage.planet_2", "stage.planet_2"),
                       ("stage.shaft", "sun"), ("stage.carrier", "bearing_far")):  # fmt: skip
        a, b = (Recovery(equilibrium).node(body, node) for equilibrium in (few, every))
        assert np.abs(a - b).max() < 1e-8 * np.abs(b).max()


def test_weight_swings_the_load_of_a_planet_once_a_revolution():
    """At equal places in the gear mesh, a tooth of the ring apart, its change is one sine."""
    case = make_case(**SMALL)
    bodies, teeth = make_bodies(case), case.stage.ring.teeth
    turnings = 2 * math.pi * np.arange(teeth) / teeth
    heavy, plain = (
        solved(c, bodies, turnings).pair_load.sum(axis=-1)[:, :5]
        for c in (case.with_(gravity=(0.0, -G, 0.0)), case)
    )
    size = np.abs(np.fft.rfft(heavy - plain, axis=0))  # (n, planet) by waves a revolution
    once, others = size[1], np.delete(size[1:], 0, axis=0)
    assert others.max() < 1e-3 * once.min()


def test_a_rotor_moment_is_held_by_the_bearings():
    """Six components at the carrier's drive end, in fixed axes."""
    moment, force = np.array([3e5, -2e5, 0.0]), np.array([1e4, 2e4, -3e4])
    plain = make_case(**SMALL)
    load = {"member": "stage.carrier", "force": tuple(force), "moment": tuple(moment)}
    loaded = plain.with_(loads=(load,))
    bodies = make_bodies(plain)
    for angle in (0.0, 1.0):
        more = reactions(solved(loaded, bodies, [angle])) - reactions(
            solved(plain, bodies, [angle])
        )
        at = np.array([0.0, 0.0, bodies["stage.carrier"].positions[0][2]])
        expected = -np.r_[force, moment + np.cross(at, force)]
        assert more == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())
