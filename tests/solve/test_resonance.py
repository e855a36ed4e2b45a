"""What meets natural frequencies: orders, nodal indices, and who excites what, against motion in
time and against the rule of Parker."""

import json

import numpy as np
import pytest
from train_contexts import bundled, one_stage, put_together
from trains import STAGE, write
from two_gears import gears_text

import flexgear as fg
from flexgear.analysis.excitation import ABSENT, UNEVEN, excited_index, folded
from flexgear.model.load import load_case
from flexgear.solve.campbell import ERRORS, IDEAL, campbell, excitations, operating_factors
from flexgear.solve.model import assemble
from flexgear.solve.modes import modes, nodal_index
from flexgear.solve.resonance import resonance_figures, resonance_verdict
from flexgear.solve.transient import simulate

CONSTANT = """model = "constant"
sun_stiffness_n_per_m = 6e8
ring_stiffness_n_per_m = 8e8
"""
PAIRS = """model = "per_pair"
contact_law = "linear"
damping_ratio = 0.02
"""
TEETH_SUN, PLANETS = 26, 4  # k = 2, 0, 2, 0 … of its orders: never the 1 of translational modes


def spur(folder, speed=100.0, errors="", planets=PLANETS):
    text = STAGE.format(planets=planets, sun="1e8", helix=0).replace(CONSTANT, PAIRS)
    text = text.replace("speed_rpm = 100", f"speed_rpm = {speed}")
    text = text.replace("[[inputs]]", f"{errors}[damping]\nratio = 0.01\n[[inputs]]", 1)
    return load_case(write(folder, text))


@pytest.mark.parametrize("planets", [3, 4, 5, 6, 7])
def test_types_of_lin_and_parker_have_their_index(planets):
    """Rotational modes 0, translational 1, planet modes of one frequency each of the others, twice
    but for half the number of planets."""
    model = put_together(load_case("lin-parker", {"stage.planets": str(planets)}))
    data = modes(model)
    index, kinds = data["nodal_index"].to_numpy()[:, 0], data["type"].to_numpy()
    assert set(index[(kinds == "rotational") | (kinds == "rigid")]) == {0}
    assert set(index[kinds == "translational"]) == {1}
    planet = index[kinds == "planet"]
    each = sorted(min(k, planets - k) for k in range(2, planets - 1))
    groups = planet.reshape(3, planets - 3) if each else []
    assert [sorted(group) for group in groups] == [each] * len(groups)
    assert len(groups) == (3 if each else 0)


def test_indices_belong_to_their_stage():
    """Modes of one stage are at rest in the others; a parallel stage has none but 0."""
    model = bundled("nrel-5mw")
    index = nodal_index(model, model.natural_modes().shapes)
    assert {ABSENT, 0, 1} == set(index[:, 0]) == set(index[:, 1])
    assert {ABSENT, 0} == set(index[:, 2])
    sideways = index[:, 0] == 1
    assert np.all(index[sideways, 1] == ABSENT)


def test_uneven_planets_have_no_index(tmp_path):
    """Every order excites every mode then, and it is said why."""
    model = one_stage(tmp_path, planets=4, **{
        "stage.planet_positions_deg": "[0, 87, 180, 267]", "inputs.0.speed_rpm": "1500",
    })  # fmt: skip
    assert set(nodal_index(model, model.natural_modes().shapes)[:, 0]) == {UNEVEN}
    data = campbell(model, margin=0.5)
    teeth = data["meeting_excitation"].str.startswith("stage x").to_numpy()
    assert teeth.any() and set(data["meeting_cause"].to_numpy()[teeth]) == {IDEAL}
    rows = resonance_figures(model.case, data, modes(model))["met"]
    assert rows[0]["nodal_index"] == "uneven planets"


def test_work_of_orders_on_modes_follows_the_rule(tmp_path):
    """The generalised force of order l, from the phases of the teeth alone, vanishes on all modes
    but those of k = l z_s mod N."""
    model = assemble(spur(tmp_path))
    natural, cycles = model.natural_modes(), model.mean_springs.cycles
    index = nodal_index(model, natural.shapes)[:, 0]
    for order in range(1, 7):
        work = natural.shapes.T @ sum(c.harmonic_force(order) for c in cycles.values())
        single = np.max(
            [np.abs(natural.shapes.T @ c.harmonic_force(order)) for c in cycles.values()]
        )
        k = folded(excited_index(order, TEETH_SUN, PLANETS), PLANETS)
        assert np.abs(work[index != k]).max() < 1e-9 * single
        assert np.abs(work[index == k]).max() > 1e-2 * single


def sway(folder, speed, frequency, errors=""):
    """Amplitude, µm, of the sun's path at gear-mesh frequency, settled."""
    model = assemble(spur(folder, speed, errors))
    run = simulate(model, duration=60.0 / frequency).data
    time = run["time"].to_numpy()
    late = time > 30.0 / frequency
    path = run["body_displacement"].sel(body="stage.sun").to_numpy()[late]
    turn = np.exp(2j * np.pi * model.flow.stages[0].gear_mesh_frequency * time[late])
    path, window = path[:, 0] + 1j * path[:, 1], np.hanning(late.sum())
    both = [np.abs(np.sum((path - path.mean()) * turn**s * window)) for s in (1, -1)]
    return 1e6 * sum(both) / window.sum()


def test_a_resonance_that_needs_errors_appears_in_time_with_errors(tmp_path):
    """Order 1 on the lowest translational modes: nothing sways in an ideal stage; with one pin out
    of place by 20 µm it resonates."""
    model = assemble(spur(tmp_path))
    lowest = modes(model)
    at = int(np.flatnonzero(lowest["type"].to_numpy() == "translational")[0])
    frequency = float(lowest["frequency"][at])
    speed = 100.0 * frequency / model.flow.stages[0].gear_mesh_frequency
    data = campbell(assemble(spur(tmp_path, speed)))
    rows = (data["meeting_excitation"] == "stage x 1") & (data["meeting_mode"] == at + 1)
    assert data["meeting_cause"][rows].to_numpy().tolist() == [ERRORS]
    assert abs(float(data["meeting_away"][rows][0])) < 1e-6
    pin = "[stage.errors]\npin_tangential_um = [20, 0, 0, 0]\n"
    met, beside = (sway(tmp_path, share * speed, frequency, pin) for share in (1.0, 0.85))
    assert met > 0.3 and met > 5.0 * beside
    assert sway(tmp_path, speed, frequency) < 1e-6 * met


def test_force_of_a_met_order_is_that_in_time(tmp_path):
    """Order 2 of a pair whose stiffness varies by 4 %: the swing of the tooth force in time, as
    large as all speeds make it, within 5 %."""
    keys = {"stages.0.gear_mesh.harmonics": "2", "stages.0.gear_mesh.sun_contact_ratio": "1.96"}

    def model(speed):
        text = gears_text("fourier", "linear", damping=0.03, speed=speed, backlash=100)
        return assemble(load_case(write(tmp_path, text.replace("1e9", "1e11")), keys))

    natural = float(modes(model(1000.0))["frequency"][1])  # teeth a second: turns a minute
    data = campbell(model(natural / 2.0))
    met = data["meeting_excitation"] == "stage_1 x 2"
    estimate = float(data["meeting_force"][met][0])
    swings = []
    for share in (0.99, 1.0, 1.01):
        run = simulate(model(share * natural / 2.0), duration=0.05).data
        time, force = run["time"].to_numpy(), run["gear_mesh_force"].to_numpy()[:, 0]
        late = time > 0.025
        window = np.hanning(late.sum())
        turn = np.exp(-2j * np.pi * share * natural * time[late])
        swings.append(2 * abs(np.sum(force[late] * window * turn)) / window.sum() / force.mean())
    assert max(swings) == pytest.approx(estimate, rel=0.05)


def test_force_of_a_met_order_where_only_the_structure_damps(tmp_path):
    """Two gears that turn together are damped by their bearings alone: the estimate beside the
    peak of the forced response, which solves the same train without its modes one by one."""
    text = gears_text("fourier", "linear", damping=0.0, speed=1000, backlash=100)
    keys = {"stages.0.gear_mesh.sun_harmonic_shares": "[0.001]", "damping.ratio": "0.01"}
    natural = float(modes(assemble(load_case(write(tmp_path, text), keys)))["frequency"][1])
    keys |= {"inputs.0.speed_rpm": f"{natural:.9g}", "output.machine.law": "torque"}
    model = fg.load_case(write(tmp_path, text), keys).assemble()
    data = model.campbell()
    met = (data["meeting_excitation"] == "stage_1 x 1") & (data["meeting_mode"] == 2)
    peak = model.linear_response((0.98, 1.02), count=401).linear_force_amplitude
    mean = float(np.abs(model.static(0.0).gear_mesh_force.to_numpy()).max())
    assert float(data["meeting_force"][met][0]) * mean == pytest.approx(float(peak.max()), rel=0.02)


@pytest.mark.slow
def test_force_of_a_met_bolt_pass_is_that_in_time():
    """Planets of a star pass the bolts of its ring at the frequency of the lowest mode, which a
    brake damps most: the swing of gear-mesh forces in time, which has statics of other modes, too.
    """

    def model(speed):
        keys = {"solver.fidelity": "quick", "output.brake_exponent": "3"}
        case = load_case("star-ring", keys | {"inputs.0.speed_rpm": f"{speed:.9g}"})
        return assemble(case, ["carrier"])

    natural = float(modes(model(3000.0), limit_hz=400.0)["frequency"][1])
    at_resonance = model(3000.0 * natural / (12 * 840 / 60))  # 12 bolts at 840 turns a minute
    data = campbell(at_resonance, limit_hz=400.0)
    assert data["meeting_excitation"].values.tolist() == ["stage bolt pass x 12"]
    assert data["meeting_cause"].values.tolist() == [IDEAL]
    run = simulate(at_resonance, duration=0.2).data
    late = run["time"].to_numpy() > 0.2 - 4 / natural
    time, force = run["time"].to_numpy()[late], run["gear_mesh_force"].to_numpy()[late]
    turn = 2 * np.pi * natural * time
    waves = np.column_stack([np.cos(turn), np.sin(turn), np.ones(len(time))])
    cosine, sine, mean = np.linalg.lstsq(waves, force, rcond=None)[0]
    swing = np.hypot(cosine, sine) / mean
    assert float(data["meeting_force"][0]) == pytest.approx(swing.max(), rel=0.2)


def test_without_torque_the_pass_of_bolts_has_no_force():
    case = load_case("star-ring", {"solver.fidelity": "quick", "inputs.0.torque_nm": "0"})
    data = campbell(assemble(case), limit_hz=400.0)
    assert "stage bolt pass x 12" in data["meeting_excitation"].values
    assert np.isnan(data["meeting_force"]).all()


def test_orders_are_those_of_the_stiffness(tmp_path):
    """At least a tenth of the largest harmonic and a thousandth of the mean, by the spectrum; of
    constant stiffness the first three."""
    model = assemble(spur(tmp_path))
    data = campbell(model)
    cycles = model.mean_springs.cycles.values()
    shares = np.max(
        [np.abs(np.fft.rfft(c.stiffness))[1:31] * 2 / c.stiffness.sum() for c in cycles], axis=0
    )
    expected = 1 + np.flatnonzero(shares >= max(0.1 * shares.max(), 1e-3))
    gear_mesh = data["excitation_kind"] == "gear mesh"
    below = expected[expected * 1.0 * model.flow.stages[0].gear_mesh_frequency < 6600.0]
    assert data["excitation_order"][gear_mesh].to_numpy().tolist() == below.tolist()
    constant = excitations(bundled("lin-parker"), 1e5)
    assert [x.order for x in constant if x.label.kind == "gear mesh"] == [1, 2, 3]


def test_shafts_and_passing_planets_excite():
    model = bundled("nrel-5mw")
    lines = {one.label: one.slope for one in excitations(model, 1e4)}
    speed = {m: abs(w) / (2 * np.pi) for m, w in model.flow.speed.items()}
    assert lines["stage_3.pinion x 2"] == pytest.approx(2 * speed["stage_3.pinion"])
    assert lines["stage_1 planet pass x 1"] == pytest.approx(3 * speed["stage_1.carrier"])
    assert "stage_2.carrier x 1" not in lines  # turns with the sun before it


def test_speeds_that_a_case_holds_are_looked_at(tmp_path):
    text = STAGE.format(planets=4, sun="1e8", helix=0).replace(
        "[output]",
        '[inputs.machine]\nlaw = "speed"\nkind = "ramp"\ntimes_s = [0, 1]\nspeeds_rpm = [20, 150]\n'
        "[output]",
    )
    model = put_together(load_case(write(tmp_path, text)))
    assert operating_factors(model) == (1.0, 1.5)
    data = campbell(model)
    assert float(data["speed_factor"][-1]) == pytest.approx(1.8)
    assert json.dumps(resonance_figures(model.case, data, modes(model)))


def test_verdict_says_what_is_met_and_by_what():
    """Order 2 of the benchmark, 679 Hz, lies 7 % below translational modes: its k = 2·z_s mod N."""
    model = bundled("lin-parker")
    figures = resonance_figures(model.case, campbell(model), modes(model))
    sun = model.case.stages[0].sun.teeth
    rows = {(row["excitation"], tuple(row["modes"])): row for row in figures["met"]}
    row = rows["stage x 2", (2, 3)]
    assert row["excited_index"] == 2 * sun % 4
    assert row["nodal_index"] == "1 or 3" and row["cause"] == ERRORS
    level, _, sentence = resonance_verdict(figures)
    assert level == "note" and "unequal planets" in sentence and "constant" in sentence
    of_shaft = {**figures, "met": [{**row, "excitation": "stage.sun x 1"}]}
    assert "such as run-out or unbalance." in resonance_verdict(of_shaft)[2]
    near = resonance_figures(model.case, campbell(model, margin=0.001), modes(model))
    level, figure, sentence = resonance_verdict(near)
    assert figure == "clear" and "0.1 %" in sentence
    assert level == "note"  # constant stiffness tells no orders: no all-clear
    ideal = {**row, "cause": IDEAL, "force_share": 0.2}
    level, _, sentence = resonance_verdict({**figures, "met": [ideal], "ideal": 1, "errors": 0})
    assert level == "watch" and "20 %" in sentence
    ideal |= {"away": -2e-5, "force_share": 1.12}
    _, _, sentence = resonance_verdict({**figures, "met": [ideal], "ideal": 1, "errors": 0})
    assert " Hz, lies on modes 2 and 3 (" in sentence and "vary by 112 % of" in sentence
    clear = {**figures, "met": [], "orders": {"stage": [1]}, "unknown_spectrum": []}
    assert resonance_verdict(clear)[2].startswith("Order 1 and turns of shafts keep ")
