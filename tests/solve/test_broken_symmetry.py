"""Motion in which equal planets differ, against the equations of a planet mode."""

import math

import numpy as np
import pytest

import flexgear
from flexgear.solve.response_figures import response_figures

MASS, ROTARY, BEARING, GEAR_MESH, ANGLE = 0.66, 0.61, 1e8, 5e8, math.radians(24.6)
SHARE, RPM, RING = 0.1, 5000.0, 96
STAGE = {
    "stage.gear_mesh.model": "fourier",
    "stage.gear_mesh.contact_law": "one-sided",
    "stage.gear_mesh.damping_ratio": "0.002",
    "stage.gear_mesh.sun_harmonic_shares": f"[0, {SHARE}]",
    "stage.gear_mesh.ring_harmonic_shares": "[0]",
    "damping.ratio": "0.002",
    "stage.sun.teeth": "28",  # a multiple of four, as the ring's: planets in phase
    "stage.ring.teeth": f"{RING}",
    "stage.center_distance_mm": None,
    "stage.sun_pressure_angle_deg": None,
    "stage.ring_pressure_angle_deg": None,
    "inputs.0.speed_rpm": f"{RPM}",
    "solver.time_step_s": None,
    "solver.output_interval_ms": None,
}
GEAR_MESH_HZ = RPM / 60 * RING / (1 + RING / 28)


def growth(speed):
    """Largest modulus of the multipliers over a gear-mesh period of a planet between members that
    do not move, without damping (Lin and Parker 1999, eq. 1): radial, tangential, rotation."""
    rows = np.array([[-math.sin(ANGLE), -math.cos(ANGLE), 1.0],
                     [math.sin(ANGLE), -math.cos(ANGLE), -1.0]])  # fmt: skip
    inverse = np.diag([1 / MASS, 1 / MASS, 1 / ROTARY])
    period, steps = 1 / (GEAR_MESH_HZ * speed), 400
    state, h = np.eye(6), period / steps

    def rate(t, y):
        wave = 1 + SHARE * math.cos(4 * math.pi * t / period)
        k = rows.T @ np.diag([GEAR_MESH * wave, GEAR_MESH]) @ rows + np.diag([BEARING, BEARING, 0])
        return np.vstack([y[3:], -inverse @ k @ y[:3]])

    for n in range(steps):
        a = rate(n * h, state)
        b = rate((n + 0.5) * h, state + 0.5 * h * a)
        c = rate((n + 0.5) * h, state + 0.5 * h * b)
        d = rate((n + 1) * h, state + h * c)
        state = state + h / 6 * (a + 2 * b + 2 * c + d)
    return np.abs(np.linalg.eigvals(state)).max()


def edge(low, high):
    """Speed between two at which the mode begins to grow."""
    first = growth(low) > 1 + 1e-6
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (growth(middle) > 1 + 1e-6) == first else (low, middle)
    return low


@pytest.mark.slow
def test_curves_of_planets_that_differ_leave_where_their_mode_grows(tmp_path):
    """The wave of stiffness has the second harmonic alone, so equal planets have even orders; the
    motion of a planet mode has odd ones, as strong in all planets and their sum without any."""
    data = (
        flexgear.load_case("lin-parker", STAGE)
        .assemble()
        .response((3.22, 3.37), harmonics=4, doublings=0)
    )
    broken = data.isel(stability_change=(data["stability_change_kind"] == 3).to_numpy())
    edges = np.sort(broken["stability_change_parameter"].to_numpy())
    np.testing.assert_allclose(edges, [edge(3.22, 3.29), edge(3.29, 3.37)], rtol=1e-3)
    branch = data["response_branch"].to_numpy()
    amplitude = data["response_gear_mesh_force_amplitude"]
    first, second = (amplitude.sel(gear_mesh_order=n).to_numpy() for n in (1, 2))
    equal, others = branch == 1, np.isin(branch, broken["stability_change_leaving"])
    assert first[equal].max() < 1e-6 * second[equal].max()
    assert others.any() and 0 not in broken["stability_change_leaving"]
    assert first[others].max(axis=0).min() > 0.1 * second[equal].max()
    np.testing.assert_allclose(first[others][:, :4], first[others][:, [1, 2, 3, 0]], rtol=1e-3)
    ((low, high),) = response_figures(data)["no_stable"]
    assert pytest.approx(edges, rel=5e-3) == [low, high]
