"""Weight and loads reach every body of a flexible stage, also those that bend."""

import math

import numpy as np
import pytest
from coupled import make_bodies, make_case
from heavy_stage import SMALL, G, mass_of, reactions, solved


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.0])
def test_the_housing_carries_the_weight_of_all_bodies(angle):
    """Reactions with weight less those without are m g, whatever the carrier's angle."""
    plain = make_case(**SMALL)
    heavy = plain.with_(gravity=(0.0, -G, 0.0))
    bodies = make_bodies(plain)
    with_weight, without = (solved(case, bodies, [angle]) for case in (heavy, plain))
    weight = mass_of(with_weight.modal.system) * G
    more = reactions(with_weight) - reactions(without)
    assert more[:3] == pytest.approx([0.0, weight, 0.0], abs=1e-8 * weight)


def test_axial_gravity_loads_the_axial_bearings():
    plain = make_case(**SMALL)
    bodies = make_bodies(plain)
    heavy = plain.with_(gravity=(0.0, 0.0, G))
    more = reactions(solved(heavy, bodies)) - reactions(solved(plain, bodies))
    weight = mass_of(solved(heavy, bodies).modal.system) * G
    assert more[:3] == pytest.approx([0.0, 0.0, -weight], abs=1e-8 * weight)


def test_load_sharing_under_weight_turns_once_a_revolution():
    """Weight pulls planet after planet; what one feels, the next feels a fifth of a turn later."""
    case = make_case(**SMALL)
    bodies = make_bodies(case)
    heavy = case.with_(gravity=(0.0, -G, 0.0))
    turnings = 2 * math.pi * np.arange(5) / 5
    found = solved(heavy, bodies, turnings)
    force = found.pair_load.sum(axis=-1)[:, :5]  # ring, planets in order
    assert np.ptp(force[0]) > 1e-4 * force.mean()
    for k in range(5):
        assert force[k] == pytest.approx(np.roll(force[0], -k), rel=1e-6)


def test_a_rotor_moment_is_held_by_the_bearings():
    """Six components at the carrier's drive end, in fixed axes."""
    moment, force = np.array([3e5, -2e5, 0.0]), np.array([1e4, 2e4, -3e4])
    plain = make_case(**SMALL)
    load = {"member": "carrier", "force": tuple(force), "moment": tuple(moment)}
    loaded = plain.with_(loads=(load,))
    bodies = make_bodies(plain)
    for angle in (0.0, 1.0):
        more = reactions(solved(loaded, bodies, [angle])) - reactions(
            solved(plain, bodies, [angle])
        )
        at = np.array([0.0, 0.0, bodies[1].positions[0][2]])
        wanted = -np.r_[force, moment + np.cross(at, force)]
        assert more == pytest.approx(wanted, abs=1e-8 * np.abs(wanted).max())
