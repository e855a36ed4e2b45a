"""Expected lines against signals of N planets that are summed up sample by sample."""

import numpy as np
import pytest

from flexgear.gears.expected_lines import expected_lines, line_rows
from flexgear.gears.power_flow import power_flow, speed_ratios
from flexgear.model.load import load_case

N_SAMPLES = 4096


def lines_of_planets(angles, ring_teeth, harmonics=3):
    """Amplitudes by order of the carrier of what a sensor hears: each planet pulses as it passes,
    its gear mesh is periodic in the teeth that go by. Over one turn, order by order."""
    theta = 2 * np.pi * np.arange(N_SAMPLES) / N_SAMPLES
    total = np.zeros(N_SAMPLES)
    for phi in angles:
        place, tooth = theta + phi, ring_teeth * (theta + phi)
        passing = np.exp(3.0 * np.cos(place - 0.3))
        total += passing * sum(np.cos(h * tooth + 0.4 * h) / h for h in range(1, harmonics + 1))
    return 2 * np.abs(np.fft.rfft(total)) / N_SAMPLES


def rated(case):
    flow = power_flow(case)
    (stage,) = case.stages
    return stage, (flow.speed["stage.carrier"] - flow.speed["stage.ring"]) / (2 * np.pi)


@pytest.mark.parametrize(
    ("positions", "teeth"),
    [
        ("", 72), ("", 70), ("", 71),
        ("[0, 88, 180, 268]", 72), ("[0, 85, 181, 274]", 71),
    ],
)  # fmt: skip
def test_sidebands_are_those_of_a_direct_sum(positions, teeth):
    """Orders up to N beside three harmonics: those that are listed stand in the sum of N planets'
    signals in proportion to their shares, all others are not there."""
    settings = {"stage.ring.teeth": str(teeth)}
    if positions:
        settings["stage.planet_positions_deg"] = positions
    case = load_case("lin-parker", settings)
    stage, turns = rated(case)
    amplitude = lines_of_planets(stage.planet_angles, teeth)
    one = lines_of_planets([0.0], teeth)
    listed = {
        round(line.frequency / turns): line.share
        for line in expected_lines(case)
        if line.kind in ("gear mesh", "sideband")
    }
    for harmonic in (1, 2, 3):
        for n in range(-4, 5):
            order = harmonic * teeth + n
            direct = amplitude[order] / (4 * one[order])
            assert listed.get(order, 0.0) == pytest.approx(direct, abs=1e-9)
    if not positions:
        allowed = {k for k in listed if listed[k] > 0.5}
        assert allowed == {
            h * teeth + n for h in (1, 2, 3) for n in range(-4, 5) if (h * teeth + n) % 4 == 0
        }


def on_a_bolted_ring(angles, teeth, bolts):
    """Amplitudes by order of the carrier of the force of planet 1, and of the radial motion of a
    place of the ring: planets close alike on teeth in series with a thin ring that bends between
    its bolts, w = Σ a_n cos nβ + b_n sin nβ, n from 1, by Ritz with (n² − 1)² of bending."""
    n = np.arange(1, 40)

    def shapes(at):
        return np.concatenate([np.cos(n * at[..., None]), np.sin(n * at[..., None])], axis=-1)

    places = shapes(2 * np.pi * np.arange(bolts) / bolts)
    flexible = np.linalg.inv(np.diag(np.tile((n**2 - 1.0) ** 2, 2)) + 3e3 * places.T @ places)
    psi = 2 * np.pi * np.arange(N_SAMPLES // 4)[:, None] / (N_SAMPLES // 4) + np.array(angles)
    loaded = shapes(psi)
    between = loaded @ flexible @ loaded.swapaxes(1, 2)
    between += np.eye(len(angles)) * 1e-3 / (1 + 0.1 * np.cos(teeth * psi))[:, None]
    force = np.linalg.solve(between, np.ones((*psi.shape, 1)))
    force /= force.sum(axis=1, keepdims=True)
    motion = (shapes(np.array(0.1)) @ flexible) @ (loaded.swapaxes(1, 2) @ force)
    return (
        2 * np.abs(np.fft.rfft(x[:, 0], axis=0)[:, 0]) / len(psi) for x in (force, motion[:, None])
    )


def test_planets_pass_the_bolts_of_a_ring_that_bends():
    """Multiples of 24, and 24 orders below and above those of the gear mesh, in one planet's force;
    of 5 planets a sensor on the ring has those orders beside the bolts that are multiples of 5."""
    case = load_case("wind-5mw", {"stage.ring.fe.bolts.number": "24"})
    stage, turns = rated(case)
    force, motion = on_a_bolted_ring(stage.planet_angles, stage.ring.teeth, 24)
    lines = {x.label: (x.frequency / turns, x.kind) for x in expected_lines(case)}
    passes = [round(order) for order, kind in lines.values() if kind == "bolt pass"]
    assert passes == [24, 48, 72, *(h * 93 + k for k in (-24, 24) for h in (1, 2, 3))]
    heard = np.flatnonzero(force > 1e-9 * force[0])[1:]
    assert not [k for k in heard if k % 3]  # gcd of 93 and 24
    assert max(heard[heard < 93], key=lambda k: force[k]) == 24
    both = [k for k in heard if k < 140 and k % 24 and k % 93]
    assert {*sorted(both, key=lambda k: -force[k])[:2]} == {93 - 24, 93 + 24}
    beside = [
        round(x) for label, (x, kind) in lines.items() if "bolts" in label and kind == "sideband"
    ]
    assert sorted(beside) == [20, 25, 45, 50, 70, 75]
    around = [k for order in passes[:3] for k in range(order - 5, order + 6)]
    assert {k for k in around if motion[k] > 1e-9 * motion[0]} == set(beside)
    assert not [
        x
        for x in expected_lines(load_case("wind-5mw", {"stage.ring.fe.flexible": "false"}))
        if x.kind == "bolt pass"
    ]


def test_ring_that_turns_and_carrier_that_stands():
    """A star: planets stay where they are, so no sidebands; a sensor that turns with the ring sees
    the planets pass at the ring's speed, and the same gear mesh."""
    case = load_case("star-ring")
    flow = power_flow(case)
    fixed = expected_lines(case)
    assert not [line for line in fixed if line.kind in ("sideband", "planet pass")]
    ring = flow.speed["stage.ring"]
    turning = expected_lines(case, sensor_speed=ring)
    passes = [line.frequency for line in turning if line.kind == "planet pass"]
    assert passes == pytest.approx([case.stages[0].planets * abs(ring) / (2 * np.pi)])
    beside = {line.label: line.frequency for line in turning if line.harmonic == 1}
    assert case.stages[0].ring.teeth % 4 == 3  # so that 4 planets leave one pass more
    step = beside["gear mesh 1 +1 carrier turn"] - beside["gear mesh 1"]
    assert step == pytest.approx(passes[0] / 4)


def test_a_sensor_on_a_planet_has_lines_one_turn_beside_the_gear_mesh():
    """Its axis turns past the motion of the planet's centre; the planet's rotation does not."""
    case = load_case("lin-parker")
    (flow,) = power_flow(case).stages
    teeth, theta = case.stages[0].planet.teeth, 2 * np.pi * np.arange(1024) / 1024
    signal = sum(np.cos(h * teeth * theta) * (1 + np.cos(theta - 0.2)) for h in (1, 2))
    heard = np.flatnonzero(np.abs(np.fft.rfft(signal)) > 1e-6 * len(theta))
    turn = abs(flow.planet_relative_speed) / (2 * np.pi)
    lines = expected_lines(case, harmonics=2, sensor_speed=flow.planet_speed)
    listed = [x.frequency / turn for x in lines if x.kind in ("gear mesh", "sideband")]
    assert sorted(listed) == pytest.approx(heard)
    assert not [x for x in lines if x.kind == "planet pass"]


@pytest.mark.parametrize("positions", ["", "[0, 85, 181, 274]"])
def test_tooth_faults_by_counting_meetings(positions):
    """A tooth of the sun meets planets so often in a second, and each of them; positions counted
    one by one."""
    case = load_case("lin-parker", {"stage.planet_positions_deg": positions} if positions else {})
    (stage,), flow = case.stages, power_flow(case)
    sun, carrier = (flow.speed[f"stage.{part}"] for part in ("sun", "carrier"))
    seconds = 200.0
    time = np.linspace(0.0, seconds, 400_001)
    meetings = 0
    for phi in stage.planet_angles:
        turns = ((sun - carrier) * time - phi - 0.1) / (2 * np.pi)
        meetings += np.count_nonzero(np.diff(np.floor(turns)))
    faults = {x.label: x.frequency for x in expected_lines(case) if x.kind == "tooth fault"}
    assert faults["tooth of sun"] == pytest.approx(meetings / seconds, rel=2e-3)
    each = faults["tooth of sun at one gear mesh"]
    assert each == pytest.approx(meetings / seconds / stage.planets, rel=2e-3)
    turns = abs(flow.speed["stage.ring"] - carrier) / (2 * np.pi)
    assert faults["tooth of ring at one gear mesh"] == pytest.approx(turns)
    planet = abs(speed_ratios(case)["stage.planet"] - speed_ratios(case)["stage.carrier"])
    input_speed = flow.speed[case.inputs[0].member]
    assert faults["flank of a planet"] == pytest.approx(planet[0] * input_speed / (2 * np.pi))


def test_the_same_teeth_meet_where_a_count_of_gear_meshes_says():
    """Sun 26 against planet 34, gear mesh by gear mesh: a tooth meets so many of the other gear,
    and the first pair meets again after so many."""
    case = load_case("lin-parker")
    (flow,) = power_flow(case).stages
    pairs = [(k % 26, k % 34) for k in range(1, 2000)]
    again = 1 + pairs.index((0, 0))
    met = {planet for sun, planet in pairs if sun == 0}
    lines = {x.label: flow.gear_mesh_frequency / x.frequency for x in expected_lines(case)
             if x.kind == "same teeth"}  # fmt: skip
    assert lines["hunting tooth of sun and planet"] == pytest.approx(again)
    assert lines["assembly phase of sun and planet"] == pytest.approx(34 / len(met))
    assert lines["hunting tooth of ring and planet"] == pytest.approx(94 * 34 / 2)


BALLS = {  # 6205-2RS of the bearing data centre of Case Western Reserve University, inches in mm
    "stage.planet_bearing.rolling": "ball",
    "stage.planet_bearing.elements.count": "9",
    "stage.planet_bearing.elements.diameter_mm": str(0.3126 * 25.4),
    "stage.planet_bearing.elements.pitch_diameter_mm": str(1.537 * 25.4),
    "stage.planet_bearing.elements.clearance_mm": "0",
}


def test_bearing_orders_in_print():
    """Defect frequencies over the speed of one ring against the other, as published with that
    bearing: outer 3.5848, inner 5.4152, element (both races) 4.7135, cage 0.39828 against the outer
    ring, which stands still there; here the inner one does, and the cage has the rest."""
    case = load_case("lin-parker", BALLS)
    flow = power_flow(case)
    turns = abs(flow.stages[0].planet_relative_speed) / (2 * np.pi)
    orders = {x.label.split(", ")[1]: x.frequency / turns for x in expected_lines(case)
             if x.kind == "bearing"}  # fmt: skip
    assert orders["outer race"] == pytest.approx(3.5848, rel=1e-4)
    assert orders["inner race"] == pytest.approx(5.4152, rel=1e-4)
    assert 2 * orders["spin of elements"] == pytest.approx(4.7135, rel=1e-4)
    assert orders["cage"] == pytest.approx(1 - 0.39828, rel=1e-4)


def test_table_stays_short():
    """A row a kind and stage, of a train of three stages as of one with unequal planets."""
    train = load_case("grc-750kw")
    lines = expected_lines(train)
    assert all(len(line_rows(lines, stage.name)) <= 8 for stage in train.stages)
    uneven = load_case("lin-parker", {"stage.planet_positions_deg": "[0, 85, 181, 274]"})
    rows = line_rows(expected_lines(uneven), "stage")
    assert any("%" in label for label in rows["beside_order_1"])
    assert len(rows) <= 7


def test_stage_that_turns_as_one_piece_has_its_shafts_alone():
    """Ring and carrier at one speed: no gear mesh, no tooth fault; they differ: one beside two."""
    case = load_case("double-rotor-5mw", {"inputs.1.speed_rpm": "12.1"})
    kinds = {x.kind for x in expected_lines(case) if x.stage == "stage_1"}
    assert kinds == {"shaft", "planet pass"}
    passes = {x.frequency for x in expected_lines(case) if x.kind == "planet pass"}
    planets = case.stages[0].planets
    assert min(passes) == pytest.approx(planets * 12.1 / 60)
