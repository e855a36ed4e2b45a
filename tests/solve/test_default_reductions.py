"""Reductions of bundled cases keep what they promise."""

import pytest

from flexgear.model.load import bundled_cases, load_case
from flexgear.solve.bodies import reduced_bodies, rigid_bodies
from flexgear.solve.result_warnings import reduction_warnings

FLEXIBLE = ["wind-5mw", "ev-reducer", "star-ring", "grc-750kw"]


def test_these_are_all_with_fe_bodies():
    assert sorted(FLEXIBLE) == sorted(n for n in bundled_cases() if load_case(n).flexible_stages)


@pytest.mark.slow
@pytest.mark.parametrize("name", FLEXIBLE)
@pytest.mark.parametrize("fidelity", ["quick", "standard"])
def test_a_bundled_case_does_not_warn_of_its_own_reductions(name, fidelity):
    case = load_case(name, {"solver.fidelity": fidelity})
    bodies = reduced_bodies(case, rigid=())
    assert reduction_warnings(case, bodies, rigid_bodies(case)) == []
