"""Reductions that miss the promised static error are said, with what to do."""

import pytest
from stage_samples import cheap_stage
from stage_samples import missing_the_promise as wrong
from train_contexts import mixed

from flexgear.model.load import load_case
from flexgear.solve.bodies import rigid_bodies
from flexgear.solve.result_warnings import PROMISED, reduction_warnings


@pytest.fixture(scope="module")
def case():
    return load_case("wind-5mw", {"solver.fidelity": "quick"}).view()


@pytest.fixture(scope="module")
def bodies(case):
    return cheap_stage(case)


def stage_warnings(stage, bodies, rigid=()):
    case = stage.case
    return reduction_warnings(case, bodies, rigid_bodies(case, rigid))


def all_wrong(bodies):
    return {name: wrong(body) for name, body in bodies.items()}


def test_a_promise_kept_is_not_spoken_of(case, bodies):
    assert stage_warnings(case, bodies) == []
    assert stage_warnings(case, {n: wrong(body, PROMISED) for n, body in bodies.items()}) == []
    held_nowhere = {
        name: body.with_(report={**body.report, "static_error": None})
        for name, body in bodies.items()
    }
    assert stage_warnings(case, held_nowhere) == []


def test_the_line_says_body_load_and_remedy(case, bodies):
    said = stage_warnings(case, all_wrong(bodies))
    assert said[0] == (
        "stage.ring: static error 3.4 % (load: tip end -z), above 2 %; "
        'try stage.ring.fe.tie = "flank", or compare with '
        "stage.ring.fe.flexible = false to see how much its bending matters"
    )
    assert said[1].startswith("stage.carrier: ")
    assert "tie" not in said[1]


def test_what_does_not_bend_has_no_error(case, bodies):
    both = all_wrong(bodies)
    assert stage_warnings(case, both, ["ring"]) == stage_warnings(case, both)[1:]
    assert stage_warnings(case.with_(**{"stage.ring.fe.flexible": False}), both)[0].startswith(
        "stage.carrier"
    )


def test_keys_are_those_of_the_train(tmp_path):
    train, bodies = mixed(tmp_path)
    said = reduction_warnings(train, all_wrong(bodies), rigid_bodies(train))
    assert len(said) == 2
    assert said[0].startswith("first.ring: static error 3.4 %")
    assert 'try stages.first.ring.fe.tie = "flank"' in said[0]
    assert "compare with stages.first.ring.fe.flexible = false" in said[0]
