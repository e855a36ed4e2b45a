"""Speeds, torques and powers of trains: closed forms, balances, and what has no single answer."""

import math
from dataclasses import replace

import numpy as np
import pytest
from flow_samples import parallel, planetary, train
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgear.gears.power_flow import PowerFlow, power_flow, stage_flow
from flexgear.gears.radii import stage_radii
from flexgear.model.errors import InputError
from flexgear.model.train import MemberLoad

teeth = st.integers(20, 60)
speeds = st.floats(-50.0, 50.0).filter(lambda v: abs(v) > 1e-3)
torques = st.floats(-1e6, 1e6).filter(lambda v: abs(v) > 1.0)


def differential(sun, planet, ring_speed, carrier_speed, torque) -> PowerFlow:
    """Two inputs: speeds of ring and carrier, torque on the ring."""
    return power_flow(
        train(
            planetary(sun=sun, planet=planet, held=(), planets=1),
            inputs={
                "a.ring": {"speed": ring_speed, "torque": torque},
                "a.carrier": {"speed": carrier_speed},
            },
            output=("a.sun", {}),
        )
    )


def three_stages(speed=1.2, torque=3e6, scale=1.0):
    """Planetary, star and parallel stage in series."""
    return train(
        planetary("a", 20, 31),
        planetary("b", 23, 40, held=("carrier",)),
        parallel("p", 30, 71, helix_angle=0.2, planet_hand="right"),
        inputs={"a.carrier": {"speed": speed * scale, "torque": torque * scale}},
        output=("p.pinion", {}),
        joints=[("a.sun", "b.ring"), ("b.sun", "p.gear")],
        held=("a.ring", "b.carrier"),
    )


def require_balance(flow: PowerFlow) -> None:
    size = max(abs(p) for p in flow.power.values()) + 1e-9
    assert sum(flow.power.values()) == pytest.approx(0.0, abs=1e-9 * size)
    assert sum(flow.branch_power.values()) == pytest.approx(0.0, abs=1e-9 * size)
    for s in flow.stages:
        branch = [p for m, p in flow.branch_power.items() if m.startswith(f"{s.name}.")]
        assert sum(branch) == pytest.approx(0.0, abs=1e-9 * size)
        if s.kind == "planetary":
            parts = (s.sun_torque, s.ring_torque, s.carrier_torque)
            largest = max(map(abs, parts))
            assert sum(parts) == pytest.approx(0.0, abs=1e-9 * largest)


@pytest.mark.parametrize(
    ("held", "driven", "out", "ratio"),
    [
        ("ring", "carrier", "sun", 1 + 96 / 24),  # wind turbine
        ("ring", "sun", "carrier", 1 / (1 + 96 / 24)),
        ("carrier", "sun", "ring", -24 / 96),  # star
        ("carrier", "ring", "sun", -96 / 24),
        ("sun", "ring", "carrier", 1 / (1 + 24 / 96)),  # solar
        ("sun", "carrier", "ring", 1 + 24 / 96),
    ],
)
def test_one_stage_with_one_member_held(held, driven, out, ratio):
    """Willis: ratio of speeds, inverse ratio of torques, the held member takes what is left."""
    flow = power_flow(
        train(
            planetary(sun=24, planet=36, held=(held,)),
            inputs={f"a.{driven}": {"speed": -3.0, "torque": 500.0}},
            output=(f"a.{out}", {}),
            held=(f"a.{held}",),
        )
    )
    assert flow.mobility == 1
    assert flow.speed[f"a.{out}"] == pytest.approx(-3.0 * ratio)
    assert flow.torque[f"a.{out}"] == pytest.approx(-500.0 / ratio)
    assert flow.torque[f"a.{held}"] == pytest.approx(500.0 * (1 / ratio - 1))
    assert flow.power[f"a.{held}"] == 0
    require_balance(flow)
    assert flow.circulating_power == 0


@given(sun=teeth, planet=teeth, ring=speeds, carrier=speeds, torque=torques)
@settings(max_examples=40, deadline=None)
def test_two_inputs_superpose(sun, planet, ring, carrier, torque):
    """ω_s = (1 + k) ω_c − k ω_r, torques 1 : k : −(1 + k), k = z_r/z_s, whatever the speeds."""
    k = (sun + 2 * planet) / sun
    flow = differential(sun, planet, ring, carrier, torque)
    expected = (1 + k) * carrier - k * ring
    assert flow.mobility == 2
    assert flow.speed["a.sun"] == pytest.approx(expected, abs=1e-9)
    assert flow.torque["a.sun"] == pytest.approx(torque / k)
    assert flow.torque["a.carrier"] == pytest.approx(-torque * (1 + k) / k)
    require_balance(flow)


@given(sun=teeth, planet=teeth, ring=speeds, carrier=speeds, torque=torques, turn=speeds)
@settings(max_examples=40, deadline=None)
def test_a_rotation_of_everything_changes_neither_rolling_nor_torques(
    sun, planet, ring, carrier, torque, turn
):
    one = differential(sun, planet, ring, carrier, torque)
    other = differential(sun, planet, ring + turn, carrier + turn, torque)
    for member, speed in one.speed.items():
        assert other.speed[member] == pytest.approx(speed + turn, abs=1e-9)
    a, b = one.stages[0], other.stages[0]
    assert b.planet_speed == pytest.approx(a.planet_speed + turn, abs=1e-9)
    assert b.planet_relative_speed == pytest.approx(a.planet_relative_speed, abs=1e-9)
    assert b.gear_mesh_frequency == pytest.approx(a.gear_mesh_frequency, abs=1e-7)
    assert b.stage_power == pytest.approx(a.stage_power, rel=1e-9, abs=1e-6)
    assert one.torque == pytest.approx(other.torque)
    assert b.planet_bearing_force == pytest.approx(a.planet_bearing_force)


@given(speed=speeds, torque=torques, scale=st.floats(-3.0, 3.0).filter(lambda v: abs(v) > 0.1))
@settings(max_examples=25, deadline=None)
def test_a_train_in_series_is_linear_and_reversible(speed, torque, scale):
    """Speeds and torques scale, powers go with the square; so do signs."""
    one, other = (power_flow(three_stages(speed, torque, s)) for s in (1.0, scale))
    require_balance(one)
    for member in one.speed:
        assert other.speed[member] == pytest.approx(scale * one.speed[member])
        assert other.branch_torque[member] == pytest.approx(scale * one.branch_torque[member])
        assert other.branch_power[member] == pytest.approx(scale**2 * one.branch_power[member])
    for a, b in zip(one.stages, other.stages, strict=True):
        assert b.sun_gear_mesh_force == pytest.approx(scale * a.sun_gear_mesh_force)
        assert b.gear_mesh_frequency == pytest.approx(abs(scale) * a.gear_mesh_frequency)
    ratio = (1 + 82 / 20) * (-103 / 23) * (-71 / 30)
    assert one.speed["p.pinion"] == pytest.approx(speed * ratio)
    assert one.torque["p.pinion"] == pytest.approx(-torque / ratio)


def test_joints_pass_on_what_their_stages_say():
    flow = power_flow(three_stages())
    for first, second in (("a.sun", "b.ring"), ("b.sun", "p.gear")):
        assert flow.branch_torque[first] != 0.0
        assert flow.branch_torque[first] == pytest.approx(-flow.branch_torque[second])
    assert flow.input_power == pytest.approx(1.2 * 3e6)


def test_planet_turns_with_the_difference_of_ring_and_carrier():
    """Pitch points of planet with sun and ring move as sun and ring do there."""
    flow = differential(24, 36, -2.0, 5.0, 1.0)
    s, v = flow.stages[0], flow.speed
    r = stage_radii(train_of_differential().view("a"))
    centre = v["a.carrier"] * (r.base["sun"] + r.base["planet"])
    assert centre - s.planet_speed * r.base["planet"] == pytest.approx(v["a.sun"] * r.base["sun"])
    assert centre + s.planet_speed * r.base["planet"] == pytest.approx(v["a.ring"] * r.base["ring"])
    assert s.planet_relative_speed == pytest.approx(s.planet_speed - 5.0)
    assert s.gear_mesh_frequency == pytest.approx(96 * 7.0 / (2 * math.pi))
    assert s.gear_mesh_frequency == pytest.approx(
        24 * abs(v["a.sun"] - v["a.carrier"]) / (2 * math.pi)
    )


def train_of_differential():
    return train(
        planetary(held=()),
        inputs={"a.ring": {"speed": 1.0, "torque": 1.0}, "a.carrier": {"speed": 1.0}},
        output=("a.sun", {}),
    )


def test_rolling_power_is_what_passes_the_teeth_as_seen_from_the_carrier():
    """T_s (ω_s − ω_c) = −T_r (ω_r − ω_c); it vanishes where all members turn together."""
    flow = differential(24, 36, -2.0, 5.0, 700.0)
    v, s = flow.speed, flow.stages[0]
    assert s.stage_power == pytest.approx(-s.ring_torque * (v["a.ring"] - v["a.carrier"]))
    assert differential(24, 36, 5.0, 5.0, 700.0).stages[0].stage_power == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize(
    ("planet", "shifts", "distance"), [(36, (0.0, 0.0, 0.0), None), (35, (0.2, 0.25, 0.2), 0.31)]
)
def test_planets_are_in_equilibrium(double, planet, shifts, distance):
    """Equal normal forces, bearing force T_c/(N R_c) tangentially, N times the arms the torques.

    35 teeth: working angles of sun and ring mesh differ, so a radial force is left.
    """
    gears = {
        name: {"teeth": z, "addendum": 0.8, "profile_shift": x}
        for name, z, x in zip(("sun", "planet", "ring"), (24, planet, 96), shifts, strict=True)
    }
    gears["ring"]["support"] = {"tangential": 1e9}
    one = train(
        planetary(
            double_helical=double, helix_angle=0.25, planet_hand="left", center_distance=distance
        )
        | gears,
        inputs={"a.carrier": {"speed": 2.0, "torque": 9e5}},
        output=("a.sun", {}),
    )
    s, r = power_flow(one).stages[0], stage_radii(one.view(one.stages[0].name))
    sides = 2 if double else 1
    assert s.sun_gear_mesh_force > 0
    assert s.ring_gear_mesh_force == pytest.approx(s.sun_gear_mesh_force)
    torque = (
        3
        * sides
        * s.sun_gear_mesh_force
        * math.cos(r.base_helix_angle)
        * (r.base["sun"] + r.base["ring"])
    )
    assert torque == pytest.approx(9e5)
    assert s.planet_bearing_tangential == pytest.approx(9e5 / (3 * r.center_distance))
    both = sides * (s.sun_working_force + s.ring_working_force)
    assert s.planet_bearing_tangential == pytest.approx(both)
    lifted = math.tan(r.working_angles["sun"]) * s.sun_working_force
    lifted -= math.tan(r.working_angles["ring"]) * s.ring_working_force
    assert s.planet_bearing_radial == pytest.approx(sides * lifted, abs=1e-6)
    assert s.planet_bearing_force == pytest.approx(math.hypot(both, sides * lifted))
    assert s.tangential_force == pytest.approx(-s.sun_torque / (3 * sides * r.reference["sun"]))
    if planet == 36:
        assert s.sun_working_force == pytest.approx(s.tangential_force)
        assert abs(s.planet_bearing_radial) < 1e-9 * s.planet_bearing_tangential
    else:
        assert s.planet_bearing_radial > 0.02 * s.planet_bearing_tangential


def test_a_gear_pair_pushes_both_gears_apart():
    flow = power_flow(
        train(
            parallel(pinion=20, gear=60),
            inputs={"p.gear": {"speed": 2.0, "power": 1e4}},
            output=("p.pinion", {}),
        )
    )
    s = flow.stages[0]
    r_b = 0.01 * 20 / 2 * math.cos(0.35)
    assert flow.torque["p.gear"] == pytest.approx(5000.0)
    assert flow.speed["p.pinion"] == pytest.approx(-6.0)
    assert s.sun_gear_mesh_force == pytest.approx(5000.0 / 3 / r_b)  # the gear drives
    assert s.planet_bearing_force == pytest.approx(5000.0 / 3 / r_b)
    assert s.gear_mesh_frequency == pytest.approx(20 * 6.0 / (2 * math.pi))
    assert s.planet_speed == 2.0


def closed_loop(pinion: int, gear: int, idler: bool = False) -> PowerFlow:
    """Carrier drives 1 kW; sun (output) and ring tied by a gear pair, or by two in a row."""
    joints = [("a.sun", "p.pinion"), ("a.ring", "p.gear")]
    stages = [planetary(sun=24, planet=36, held=()), parallel("p", pinion, gear)]
    if idler:
        stages.append(parallel("q", 40, 40))
        joints = [("a.sun", "p.pinion"), ("p.gear", "q.pinion"), ("q.gear", "a.ring")]
    return power_flow(
        train(
            *stages,
            inputs={"a.carrier": {"speed": 2.0, "power": 1e3}},
            output=("a.sun", {}),
            joints=joints,
        )
    )


@pytest.mark.parametrize(("pinion", "gear"), [(20, 100), (20, 90), (20, 50), (30, 30), (60, 20)])
def test_power_circulates_in_a_closed_differential(pinion, gear):
    """k = z_r/z_s, j = z_1/z_2: ω_r = −j ω_s gives P_s = −P/(1 − k j), P_r = k j P/(1 − k j).

    One of both runs round: k j/(1 − k j) for k j < 1, 1/(k j − 1) for k j > 1.
    """
    k, j = 96 / 24, pinion / gear
    flow = closed_loop(pinion, gear)
    require_balance(flow)
    assert flow.branch_power["a.sun"] == pytest.approx(-1e3 / (1 - k * j))
    assert flow.branch_power["a.ring"] == pytest.approx(1e3 * k * j / (1 - k * j))
    expected = 1e3 * (k * j / (1 - k * j) if k * j < 1 else 1 / (k * j - 1))
    assert flow.circulating_power == pytest.approx(expected)
    assert flow.stage("a").circulating_power == pytest.approx(expected)
    assert flow.stage("p").circulating_power == pytest.approx(expected)
    largest = max(abs(p) for p in flow.branch_power.values())
    assert largest == pytest.approx(flow.input_power + expected)


def test_power_that_splits_and_joins_does_not_circulate():
    flow = closed_loop(20, 50, idler=True)
    share = 4 * 20 / 50
    assert flow.branch_power["a.ring"] == pytest.approx(-1e3 * share / (1 + share))
    assert flow.branch_power["a.sun"] == pytest.approx(-1e3 / (1 + share))
    assert flow.circulating_power == 0


def test_a_moment_on_a_member_takes_part():
    """A given moment about z is an external torque like a port's."""
    one = three_stages()
    load = MemberLoad(member="b.ring", moment=(5.0, 6.0, 700.0))
    flow = power_flow(one.model_copy(update={"loads": (load,)}))
    bare = power_flow(one)
    require_balance(flow)
    assert flow.torque["b.ring"] == 700.0
    ratio = flow.speed["b.ring"] / flow.speed["p.pinion"]
    change = flow.torque["p.pinion"] - bare.torque["p.pinion"]
    assert change == pytest.approx(-700.0 * ratio)


def test_forces_are_odd_in_the_torques():
    stage = train_of_differential().view("a")
    speed = {"sun": 5.0, "ring": 0.0, "carrier": 1.0}
    torque = {"sun": -200.0, "ring": -800.0, "carrier": 1000.0}
    one = stage_flow(stage, speed, torque)
    other = stage_flow(stage, speed, {m: -t for m, t in torque.items()})
    mirrored = {
        name: -getattr(one, name)
        for name in one.__dataclass_fields__
        if name.endswith(("torque", "force", "stage_power")) or name == "planet_bearing_tangential"
    }
    assert replace(one, **mirrored) == other  # teeth push apart whichever flanks carry
    assert np.isclose(one.planet_bearing_force, other.planet_bearing_force)


RPM = math.pi / 30
FREE = planetary(held=())
RING_HELD = planetary()


DRIVEN = {"a.carrier": {"speed": 1.0, "torque": 1.0}}
SUN = ("a.sun", {})
REFUSED = {  # stages, inputs, output, joints, words
    "no speed": (
        [RING_HELD], {"a.carrier": {"torque": 1.0}}, SUN, [],
        ["mobility 1, and no speeds are given", "give 1 speed at a.carrier or a.sun"]),
    "one speed of a differential": (
        [FREE], DRIVEN | {"a.ring": {}}, SUN, [],
        ["mobility 2, and 1 speed is given (a.carrier)", "at a.ring or a.sun"]),
    "two speeds that differ": (
        [RING_HELD], {"a.carrier": {"speed": RPM, "torque": 1.0}}, ("a.sun", {"speed": 4 * RPM}),
        [],
        ["output: overdetermined", "make a.sun turn at 5 r/min, given are 4", "remove 1 speed"]),
    "no torque": (
        [RING_HELD], {"a.carrier": {"speed": 1.0}}, SUN, [],
        ["need 1 torque, and no torques are given", "at a.carrier or a.sun"]),
    "two torques": (
        [RING_HELD], {"a.carrier": {"speed": 1.0, "power": 1.0}}, ("a.sun", {"torque": -1.0}), [],
        ["output: overdetermined", "(a.carrier, a.sun)", "remove 1 torque or power"]),
    "stages that are not joined": (
        [RING_HELD, planetary("b")], DRIVEN, ("b.sun", {}), [],
        ["mobility 2", "give 1 speed at b.sun, or hold, join or drive"]),
    "joint twice": (
        [RING_HELD, planetary("b")], DRIVEN, ("b.sun", {}),
        [("a.sun", "b.carrier"), ("b.carrier", "a.sun")],
        ["joint a.sun – b.carrier, joint b.carrier – a.sun", "remove one joint"]),
    "nothing turns": (
        [RING_HELD, planetary("b")], DRIVEN, ("b.sun", {}),
        [("a.sun", "b.carrier"), ("b.sun", "a.carrier")],
        ["mobility 0", "release a member or a joint"]),
    "speeds of one shaft": (
        [FREE, parallel()], DRIVEN | {"a.ring": {}}, ("p.gear", {"speed": 2.0}),
        [("a.carrier", "p.pinion")],
        ["(a.carrier, p.gear), but they depend on each other", "give 1 speed at a.ring"]),
    "no torque of a differential": (
        [FREE, parallel()], {"a.carrier": {"speed": 1.0}, "a.ring": {"speed": 2.0}}, ("p.gear", {}),
        [("a.carrier", "p.pinion")],
        ["3 ports and mobility 2 need 1 torque", "at a.carrier or a.ring or p.gear"]),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_trains_without_a_single_answer_are_refused(name):
    stages, inputs, output, joints, words = REFUSED[name]
    with pytest.raises(InputError) as caught:
        power_flow(train(*stages, inputs=inputs, output=output, joints=joints))
    assert all(word in str(caught.value) for word in words)
    assert str(caught.value).startswith("test.toml: ")
    assert "\n" not in str(caught.value)


def test_torques_that_leave_a_part_open_are_refused():
    """The ring idles, so no torque is left to choose on the shaft of carrier and gear pair."""

    def flow(output, **inputs):
        inputs |= {"a.carrier": {"speed": 1.0}, "a.ring": {"speed": 2.0, "torque": 3.0}}
        joints = [("a.carrier", "p.pinion")]
        return power_flow(
            train(FREE, parallel(), inputs=inputs, output=(output, {}), joints=joints)
        )

    assert flow("a.sun").torque["a.sun"] == pytest.approx(3.0 / 4)
    with pytest.raises(InputError, match=r"leave a\.carrier and p\.gear open"):
        flow("p.gear", **{"a.sun": {"torque": 1.0}})
