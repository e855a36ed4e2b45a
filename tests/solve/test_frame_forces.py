"""Forces of frames that turn follow the speed that a train has, not the one it is rated at."""

import numpy as np
import pytest
from trains import stage_train

STEPS = {
    "solver.time_step_s": "1e-5", "solver.step_time_step_s": "1e-5",
    "solver.output_interval_s": "1e-4", "solver.duration_s": "0.02", "solver.settle_s": "0",
    "solver.modes_band_hz": "5000", "output.machine.law": "torque", "inputs.0.machine.law": "speed",
}  # fmt: skip
MASS, RADIUS = 4.0, 0.12  # of a planet, and of the pins' circle: (26 + 34) modules of 4 mm / 2


def run(folder, rated, turning="true", **keys):
    settings = {"inputs.0.speed_rpm": str(rated), "gyroscopic": turning}
    return stage_train(folder, **{**STEPS, **settings, **keys}).assemble().transient()


def test_a_train_at_half_speed_is_one_rated_at_half_speed(tmp_path):
    half = {"inputs.0.machine.speed_rpm": "1500"}
    slow, native = run(tmp_path, 3000, **half), run(tmp_path, 1500, **half)
    for name in ("gear_mesh_force", "planet_bearing_force", "port_torque"):
        expected = native[name].to_numpy()
        assert np.abs(slow[name].to_numpy() - expected).max() < 1e-8 * np.abs(expected).max()
    plain = run(tmp_path, 3000, "false", **half)
    force = native["planet_bearing_force"].to_numpy()
    assert (
        np.abs(plain["planet_bearing_force"].to_numpy() - force).max() > 0.1 * np.abs(force).max()
    )


def test_pins_carry_planets_round_at_the_speed_of_the_moment(tmp_path):
    ramp = {"kind": "ramp", "times_s": "[0.005, 0.055]", "speeds_rpm": "[1500, 3000]"}
    damped = {
        "damping.ratio": "0.3",
        "stage.gear_mesh.damping_ratio": "0.5",
        "solver.duration_s": "0.1",
        "inputs.0.inertia_kg_m2": "0",
        "output.inertia_kg_m2": "0",
    }
    keys = {f"inputs.0.machine.{k}": v for k, v in ramp.items()} | damped

    def radial(data):
        return data["planet_bearing_force"].isel(direction=0).mean("bearing").to_numpy()

    ramped = radial(run(tmp_path, 3000, **keys))
    slow, fast = (
        radial(run(tmp_path, speed, **damped, **{"inputs.0.machine.speed_rpm": str(speed)}))
        for speed in (1500, 3000)
    )
    assert ramped[:40] == pytest.approx(slow[:40], rel=1e-3)
    assert ramped[-100:].mean() == pytest.approx(fast[-100:].mean(), rel=1e-4)
    # beside the radial parts of the gear meshes' forces, which change little as planets give way
    grown = MASS * RADIUS * ((100 * np.pi) ** 2 - (50 * np.pi) ** 2)
    assert fast[-1] - slow[-1] == pytest.approx(grown, rel=0.05)


def test_whirl_does_not_depend_on_the_port_whose_speed_is_given(tmp_path):
    """The frame follows the rotation of the whole train, not the swing of one member."""
    keys = {"gyroscopic": "true", "stage.planet_bearing.radial_n_per_m": "5e7"}
    carrier = {**keys, "inputs.0.speed_rpm": "3000"}
    sun = {**keys, "inputs.0.speed_rpm": "", "output.speed_rpm": str(3000 * 120 / 26)}
    first, second = (
        np.sort(stage_train(tmp_path, **port).assemble().campbell([0.0, 1.0]).campbell_frequency[1])
        for port in (carrier, sun)
    )
    assert first == pytest.approx(second, rel=1e-9)
