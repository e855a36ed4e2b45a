"""Trains whose speeds or torques have no single answer are refused in one line."""

import math

import pytest
from flow_samples import parallel, planetary, train

from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import InputError

RPM = math.pi / 30
FREE = planetary(held=())
RING_HELD = planetary()


@pytest.mark.parametrize(
    ("stages", "keys", "words"),
    [
        pytest.param(
            [RING_HELD],
            {"inputs": {"a.carrier": {"torque": 1.0}}, "output": ("a.sun", {})},
            ["mobility 1, and no speeds are given", "give 1 speed at a.carrier or a.sun"],
            id="no speed",
        ),
        pytest.param(
            [FREE],
            {
                "inputs": {"a.carrier": {"speed": 1.0, "torque": 1.0}, "a.ring": {}},
                "output": ("a.sun", {}),
            },
            ["mobility 2, and 1 speed is given (a.carrier)", "at a.ring or a.sun"],
            id="one speed of a differential",
        ),
        pytest.param(
            [RING_HELD],
            {
                "inputs": {"a.carrier": {"speed": RPM, "torque": 1.0}},
                "output": ("a.sun", {"speed": 4 * RPM}),
            },
            ["output: overdetermined", "make a.sun turn at 5 r/min, given are 4", "remove 1 speed"],
            id="two speeds that differ",
        ),
        pytest.param(
            [RING_HELD],
            {"inputs": {"a.carrier": {"speed": 1.0}}, "output": ("a.sun", {})},
            ["need 1 torque, and no torques are given", "at a.carrier or a.sun"],
            id="no torque",
        ),
        pytest.param(
            [RING_HELD],
            {
                "inputs": {"a.carrier": {"speed": 1.0, "power": 1.0}},
                "output": ("a.sun", {"torque": -1.0}),
            },
            ["output: overdetermined", "(a.carrier, a.sun)", "remove 1 torque or power"],
            id="two torques",
        ),
        pytest.param(
            [RING_HELD, planetary("b")],
            {
                "inputs": {"a.carrier": {"speed": 1.0, "torque": 1.0}},
                "output": ("b.sun", {}),
            },
            ["mobility 2", "give 1 speed at b.sun, or hold, join or drive"],
            id="stages that are not joined",
        ),
        pytest.param(
            [RING_HELD, planetary("b")],
            {
                "inputs": {"a.carrier": {"speed": 1.0, "torque": 1.0}},
                "output": ("b.sun", {}),
                "joints": [("a.sun", "b.carrier"), ("b.carrier", "a.sun")],
            },
            ["joint a.sun – b.carrier, joint b.carrier – a.sun", "remove one joint"],
            id="joint twice",
        ),
        pytest.param(
            [RING_HELD, planetary("b")],
            {
                "inputs": {"a.carrier": {"speed": 1.0, "torque": 1.0}},
                "output": ("b.sun", {}),
                "joints": [("a.sun", "b.carrier"), ("b.sun", "a.carrier")],
            },
            ["mobility 0", "release a member or a joint"],
            id="nothing turns",
        ),
        pytest.param(
            [FREE, parallel()],
            {
                "inputs": {"a.carrier": {"speed": 1.0, "torque": 1.0}, "a.ring": {}},
                "output": ("p.gear", {"speed": 2.0}),
                "joints": [("a.carrier", "p.pinion")],
            },
            ["(a.carrier, p.gear), but they depend on each other", "give 1 speed at a.ring"],
            id="speeds of one shaft",
        ),
        pytest.param(
            [FREE, parallel()],
            {
                "inputs": {"a.carrier": {"speed": 1.0}, "a.ring": {"speed": 2.0}},
                "output": ("p.gear", {}),
                "joints": [("a.carrier", "p.pinion")],
            },
            ["3 ports and mobility 2 need 1 torque", "at a.carrier or a.ring or p.gear"],
            id="no torque of a differential",
        ),
    ],
)
def test_trains_without_a_single_answer_are_refused(stages, keys, words):
    with pytest.raises(InputError) as caught:
        power_flow(train(*stages, **keys))
    for word in words:
        assert word in str(caught.value)
    assert str(caught.value).startswith("test.toml: ")
    assert "\n" not in str(caught.value)


def test_torques_that_leave_a_part_open_are_refused():
    """The ring idles, so no torque is left to choose on the shaft of carrier and gear pair."""
    idling = train(
        FREE,
        parallel(),
        inputs={"a.carrier": {"speed": 1.0}, "a.ring": {"speed": 2.0, "torque": 3.0}},
        output=("a.sun", {}),
        joints=[("a.carrier", "p.pinion")],
    )
    assert power_flow(idling).torque["a.sun"] == pytest.approx(3.0 / 4)
    with pytest.raises(InputError, match=r"leave a\.carrier and p\.gear open"):
        power_flow(
            train(
                FREE,
                parallel(),
                inputs={
                    "a.carrier": {"speed": 1.0},
                    "a.ring": {"speed": 2.0, "torque": 3.0},
                    "a.sun": {"torque": 1.0},
                },
                output=("p.gear", {}),
                joints=[("a.carrier", "p.pinion")],
            )
        )
