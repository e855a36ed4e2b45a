"""Transients over a pitted or missing tooth against involutes and a Runge–Kutta rule of its own."""

import math

import numpy as np
import pytest
from trains import spur_pair, write

from flexgear import load_case

TEETH, MODULE, ANGLE, FACE = (60, 30), 4e-3, math.radians(20), 40e-3  # gear drives pinion
STIFFNESS, RATIO, MASS, TORQUE, SPEED = 1e10 * FACE, 0.05, 50.0, 500.0, 2 * math.pi
BASE = [z * MODULE / 2 * math.cos(ANGLE) for z in TEETH]
TIP = [math.sqrt((z * MODULE / 2 + MODULE) ** 2 - r**2) for z, r in zip(TEETH, BASE, strict=True)]
OFFSET, PITCH = sum(TEETH) * MODULE / 2 * math.sin(ANGLE), math.pi * MODULE * math.cos(ANGLE)
LAST, STEP, FAULTY, PIT = 0.065, 4e-6, 3, 30e-6
TABLE = "position = [0, 1]\nstiffness_n_per_mm_um = [10, 10]\n"
TEXT = spur_pair(
    "teeth = 30, equivalent_mass_kg = 100, kinematics = 'torsional'",
    "teeth = 60, equivalent_mass_kg = 100, kinematics = 'torsional'",
    f'model = "face_load"\nslices = 1\ndamping_ratio = {RATIO}\npair_stiffness = "table"\n'
    f"[stages.gear_mesh.table.sun]\n{TABLE}[stages.gear_mesh.table.ring]\n{TABLE}",
    backlash=400, speed=60, torque=TORQUE, output='machine = { law = "torque" }',
    sections="[damping]\nratio = 0\n[solver]\ntime_step_s = 5e-6\nmodes_to_hz = 5000",
)  # fmt: skip


def tip_gaps(beyond, tip, mate):
    """Gaps (n,), m at the mate's base circle, between the tip edge of one gear and the mate's
    flank, the gears having rolled by ``beyond`` (n,), m, past the end of the path."""
    turn = beyond / BASE[tip]
    x = BASE[tip] * np.sin(turn) + TIP[tip] * np.cos(turn)
    y = BASE[tip] * np.cos(turn) - TIP[tip] * np.sin(turn) - BASE[tip]
    edge, radius = np.arctan2(BASE[mate] - y, OFFSET - x), np.hypot(OFFSET - x, BASE[mate] - y)
    roll = np.sqrt(radius**2 - BASE[mate] ** 2)  # of the mate's flank at that radius
    back = (roll - (OFFSET - TIP[tip] - beyond)) / BASE[mate]  # from its point on the line
    flank = np.arctan2(
        BASE[mate] * np.cos(back) + roll * np.sin(back),
        roll * np.cos(back) - BASE[mate] * np.sin(back),
    )
    return BASE[mate] * np.abs(edge - flank)


def forces_by_hand(first, depth):
    """Times and gear-mesh forces; first: path position of pair 1 at the start, m."""
    pairs, table = np.arange(-2, 9), np.linspace(0.0, 0.4 * PITCH, 400)
    places = first - (pairs - 1) * PITCH
    after, before = tip_gaps(table, 0, 1), tip_gaps(table, 1, 0)
    deep, damping = np.where(pairs == FAULTY, depth, 0.0), 2 * RATIO * math.sqrt(STIFFNESS * MASS)
    load, start = TORQUE / BASE[0], 0.0

    def force(time, motion, speed):
        s = places + BASE[0] * SPEED * time + 0.5 * (motion - start)  # half of it turns the gear
        gap = deep + np.interp(s - TIP[0], table, after, left=0.0, right=1.0)
        gap += np.interp(OFFSET - TIP[1] - s, table, before, left=0.0, right=1.0)
        spring = STIFFNESS * np.maximum(motion - gap, 0.0)
        return np.clip(spring + damping * speed, 0.0, 2 * spring).sum()

    low, high = 0.0, 1e-4
    for _ in range(60):
        start = 0.5 * (low + high)
        low, high = (start, high) if force(0.0, start, 0.0) < load else (low, start)
    motion, speed, out = start, 0.0, []
    times = np.arange(0.0, LAST, STEP)
    for t in times:
        out.append(force(t, motion, speed))
        a = [(load - out[-1]) / MASS]
        for share in (0.5, 0.5, 1.0):
            earlier = a[-2] if len(a) > 1 else 0.0
            at = motion + share * STEP * (speed + 0.5 * STEP * earlier)
            a.append((load - force(t + share * STEP, at, speed + share * STEP * a[-1])) / MASS)
        motion += STEP * speed + STEP**2 / 6 * (a[0] + a[1] + a[2])
        speed += STEP / 6 * (a[0] + 2 * a[1] + 2 * a[2] + a[3])
    return times, np.array(out)


@pytest.mark.parametrize(
    ("fault", "depth"),
    [(f'kind = "spall"\nflank = "drive"\ndepth_um = {1e6 * PIT:g}', PIT),
     ('kind = "missing_tooth"', 1.0)],
)  # fmt: skip
def test_forces_over_a_faulty_tooth_are_those_of_an_integration_by_hand(tmp_path, fault, depth):
    """Tips of neighbours and of the pitted tooth touch off the path, and the pair vibrates."""
    text = f'{TEXT}\n[[faults]]\ngear = "pinion"\ntooth = {FAULTY}\n{fault}\n'
    model = load_case(write(tmp_path, text)).assemble()
    at_start = model.static([0.0])
    first = at_start["pair_position"].to_numpy()[at_start["pair_tooth"].to_numpy() == 1][0]
    data = model.transient(LAST, output_interval=1e-4)
    time, forces = data["time"].to_numpy(), data["gear_mesh_force"].to_numpy()[:, 0]
    expected = np.interp(time, *forces_by_hand(first, depth))
    assert expected.max() > 2 * TORQUE / BASE[0]  # against 1.4 of sound teeth
    assert np.abs(forces - expected).max() < 5e-3 * expected.max()
    assert (forces - expected).std() < 1e-3 * expected.std()
