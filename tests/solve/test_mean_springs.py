"""Modes with the mean stiffness of gear meshes over their cycles, against motion in time."""

from dataclasses import replace

import numpy as np
import pytest
from train_contexts import bundled, put_together
from trains import STAGE, write
from turning_ring import cheap, held_case
from two_gears import gears_text

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.modal import modal_system, static_system
from flexgear.model.load import load_case
from flexgear.solve.model import assemble
from flexgear.solve.modes import modes
from flexgear.solve.static import static
from flexgear.solve.transient import simulate

CONSTANT = """model = "constant"
sun_stiffness_n_per_m = 6e8
ring_stiffness_n_per_m = 8e8
"""
PAIRS = 'model = "per_pair"\n'
TEETH = 60  # of the gear: as many gear-mesh cycles a second as it makes turns a minute


def pair(folder, speed=1000.0, *, damping=0.05, law="one-sided", **more):
    """A spur pair on stiff supports, its gear meshes of single pairs; it has one mode below them
    all, of its inertias on the teeth."""
    text = gears_text("per_pair", law, damping, speed, backlash=100).replace("1e9", "1e11")
    return load_case(write(folder, text), more)


def on_the_teeth(folder, **options):
    return float(modes(assemble(pair(folder, **options)))["frequency"][1])


def test_fast_gears_swing_at_the_mean_stiffness(tmp_path):
    """Teeth that pass five times as fast as the gears swing: averaging theory has the mean
    stiffness of the cycle. The swing after the start in time, by its spectrum, to 0.3 %; with the
    stiffness of an angle it is up to a fifth off."""
    mode = on_the_teeth(tmp_path)
    speed = 5.0 * mode
    run = simulate(assemble(pair(tmp_path, speed, damping=0.01)), duration=36.0 / mode).data
    force, time = run["gear_mesh_force"].to_numpy()[:, 0], run["time"].to_numpy()
    padded = 2**18
    spectrum = np.abs(np.fft.rfft((force - force.mean()) * np.hanning(len(force)), padded))
    frequency = np.fft.rfftfreq(padded, time[1] - time[0])
    below = frequency < 0.5 * speed
    assert frequency[below][np.argmax(spectrum[below])] == pytest.approx(mode, rel=3e-3)
    model = assemble(pair(tmp_path))
    at_angles = [float(modes(model, angle=a)["frequency"][1]) for a in np.radians([0.0, 2.0, 4.0])]
    assert min(at_angles) < 0.85 * mode and max(at_angles) > 1.05 * mode


def test_resonance_of_a_stepped_speed(tmp_path):
    """The third order passes the mode: dynamic tooth forces peak there, within 3 %."""
    mode = on_the_teeth(tmp_path)
    shares = np.linspace(0.88, 1.12, 9)
    swing = []
    for share in shares:
        model = assemble(pair(tmp_path, share * mode / 3.0, damping=0.06))
        run = simulate(model, duration=0.05).data
        settled = run["gear_mesh_force"].to_numpy()[run["time"].to_numpy() > 0.025, 0]
        swing.append(settled.std() / settled.mean())
    at = int(np.argmax(swing))
    assert 0 < at < len(shares) - 1
    peak = np.polyfit(shares[at - 1 : at + 2], swing[at - 1 : at + 2], 2)
    assert -0.5 * peak[1] / peak[0] == pytest.approx(1.0, abs=0.03)


def test_pairs_that_do_not_touch_under_the_load_do_not_count(tmp_path):
    """Tip relief far beyond the deflection takes away double contact: the mean is that over the
    loads of equilibria, with pairs of the table's stiffness."""
    relief = {
        f"stages.0.{gear}.modifications.tip_relief.{key}": value
        for gear in ("pinion", "gear")
        for key, value in (("amount_um", "200"), ("length_mm", "4"))
    }
    plain, eased = assemble(pair(tmp_path)), assemble(pair(tmp_path, **relief))
    turn = 2 * np.pi / TEETH
    solved = static(eased, np.linspace(0.0, turn, 240, endpoint=False))
    touching = solved["pair_stiffness"].where(solved["pair_load"] > 0.0, 0.0)
    expected = float(touching.sum("slot").mean("position").max())
    cycle = eased.mean_springs.cycles[0]
    assert cycle.stiffness.mean() == pytest.approx(expected, rel=0.01)
    assert cycle.stiffness.mean() < 0.95 * plain.mean_springs.cycles[0].stiffness.mean()


def test_a_whole_contact_ratio_is_a_constant_stiffness(tmp_path):
    """Two pairs at every angle, each as stiff all along its path: mean and every angle agree."""
    model = assemble(pair(tmp_path))
    pairs = model.system.pairs
    start = pairs.s_lo[pairs.table]
    length, samples = 2.0 * pairs.pitch[pairs.table], pairs.k_table.shape[1]
    even = pairs._replace(
        s_hi=pairs.s_lo + 2.0 * pairs.pitch,
        table_start=start,
        table_step=length / (samples - 1),
        k_table=np.full_like(pairs.k_table, 4e8),
    )
    model = replace(model, system=model.system.with_(pairs=even))
    mean = modes(model)["frequency"].to_numpy()
    for degrees in (0.3, 1.7, 4.1):
        at_angle = modes(model, angle=np.radians(degrees))["frequency"].to_numpy()
        np.testing.assert_allclose(at_angle, mean, rtol=1e-9)
    assert np.ptp(model.mean_springs.cycles[0].stiffness) == 0.0


def test_constant_stiffness_has_one_mean():
    """The benchmark of Lin and Parker: at any angle what it is on average."""
    model = bundled("lin-parker")
    np.testing.assert_allclose(
        modes(model)["frequency"], modes(model, angle=0.0)["frequency"], rtol=1e-12, atol=1e-6
    )


def splits(frequency):
    """Relative distances of neighbouring elastic frequencies."""
    elastic = np.asarray(frequency)[np.asarray(frequency) > 0]
    return np.diff(elastic) / elastic[1:]


@pytest.mark.parametrize("planets", [3, 4])
def test_pairs_of_an_ideal_stage_do_not_split(tmp_path, planets):
    """Equal planets out of phase: pairs are pairs to rounding; at an angle they are not."""
    path = write(
        tmp_path, STAGE.format(planets=planets, sun="1e8", helix=0).replace(CONSTANT, PAIRS)
    )
    model = assemble(load_case(path))
    mean = splits(modes(model)["frequency"])
    close = mean < 1e-4
    assert np.sum(close) >= 4 and mean[close].max() < 1e-9
    at_angle = splits(modes(model, angle=0.0)["frequency"])
    assert np.sum(at_angle < 1e-6) < np.sum(close)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sun", "planet", "ring", "bolts"), [("30", "30", "90", 25), ("27", "33", "93", 93)]
)
def test_teeth_of_a_ring_pass_through_the_gear_mesh(tmp_path, sun, planet, ring, bolts):
    """FE ring that is the same from tooth to tooth, 93 of them for five planets, which stand before
    them differently: pairs are pairs to rounding, as those of a ring that repeats with the
    planets. At an angle such a ring's are not."""
    keys = {
        "stage.sun.teeth": sun, "stage.planet.teeth": planet, "stage.ring.teeth": ring,
        "stage.planet.bore_diameter_mm": "380", "stage.carrier.fe.pin_diameter_mm": "360",
        "stage.ring.fe.bolts.number": str(bolts), "stage.ring.fe.bolts.diameter_mm": "20",
    }  # fmt: skip
    case = held_case(tmp_path, "ring", "sun", "carrier", **keys)
    model = put_together(case, bodies=cheap(case, bolts))
    mean = splits(modes(model, limit_hz=1000.0)["frequency"])
    pairs = mean[mean < 1e-4]
    assert len(pairs) > 8 and pairs.max() < 1e-9
    if int(ring) % 5:
        at_angle = splits(modes(model, angle=0.0, limit_hz=1000.0)["frequency"])
        assert np.sum(at_angle < 1e-6) < len(pairs) / 2


def test_equilibria_need_no_modes(tmp_path):
    """One factorisation gives the answers that all modes together give."""
    case = held_case(tmp_path, "ring", "sun", "carrier")
    system = put_together(case, bodies=cheap(case)).system
    angles = np.radians([0.0, 1.3, 40.0])
    by_modes = revolution(modal_system(system), angles, system.rated_torque)
    without = revolution(static_system(system), angles, system.rated_torque)
    largest = by_modes.pair_load.max()
    np.testing.assert_allclose(without.pair_load, by_modes.pair_load, atol=1e-7 * largest)
    np.testing.assert_allclose(without.torques, by_modes.torques, rtol=1e-7)
