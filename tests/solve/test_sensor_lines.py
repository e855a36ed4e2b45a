"""Orders of the carrier that a sensor on a held ring hears: those that planets let through."""

import numpy as np
import pytest

from flexgear import load_case

TURN = 0.04  # s
RING = """
kinematics = "planar"
gravity_m_per_s2 = [0, -9.81, 0]
damping = { ratio = 0.1 }

[material]
young_modulus_gpa = 206
poisson_ratio = 0.3
density_kg_per_m3 = 7850

[stage]
planets = 4
normal_module_mm = 1.5
pressure_angle_deg = 20
face_width_mm = 20
backlash_ring_mm = 0.05
backlash_sun_mm = 0.05
sun = { teeth = 28, support = { radial_n_per_m = 1e7, axial_n_per_m = 1e7, tilt_nm_per_rad = 1e3 } }
planet = { teeth = 22 }
carrier = { support = { radial_n_per_m = 3e8, axial_n_per_m = 1e8, tilt_nm_per_rad = 2e4 } }
planet_bearing = { radial_n_per_m = 2e8, axial_n_per_m = 5e7, tilt_nm_per_rad = 1e4 }
gear_mesh = { damping_ratio = 0.2 }

[stage.ring]
teeth = 72

[stage.ring.fe]
rim_thickness_mm = 9
end = "-z"

[stage.ring.fe.bolts]
number = 9
circle_diameter_mm = 122
diameter_mm = 4
stiffness_radial_n_per_m = 2e8
stiffness_tangential_n_per_m = 2e8
stiffness_axial_n_per_m = 3e8
stiffness_tilt_nm_per_rad = 2e3
stiffness_twist_nm_per_rad = 2e2

[[inputs]]
member = "stage.carrier"
torque_nm = 300
speed_rpm = 1500
machine = { law = "speed" }

[output]
member = "stage.sun"
inertia_kg_m2 = 0.002

[solver]
fidelity = "quick"
gear_mesh_orders = 2
time_step_s = 5e-6

[recorder]
band_hz = 3000
sampling_rate_hz = 8000

[[sensors]]
name = "acceleration"
on = "stage.ring"
measures = "acceleration"
angle_deg = 70
direction = "radial"

[[sensors]]
name = "displacement"
on = "stage.ring"
measures = "displacement"
angle_deg = 70
direction = "radial"

[[sensors]]
name = "strain"
on = "stage.ring"
measures = "strain"
angle_deg = 70
"""


def model_of(folder, errors="", **settings):
    path = folder / "ring.toml"
    path.write_text(RING + errors, encoding="utf-8")
    return load_case(path, settings).assemble()


def orders(values):
    """Amplitudes (n,) of the orders of a turn."""
    return np.abs(np.fft.rfft(values, axis=0)) / len(values)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("lines")


@pytest.mark.parametrize("kind", ["acceleration", "displacement", "strain"])
def test_planets_alike_let_only_orders_through_that_are_multiples_of_their_number(run, kind):
    """72 teeth and four planets: (H z_r + n) mod 4 = 0 for all that a turn of the carrier holds;
    nine bolts and weight change nothing in that, as they repeat with every planet's pass."""
    last = run["sensor_signal"].sel(sensor=kind).to_numpy()[-320:]
    line = orders(last)[1:]
    allowed = np.arange(1, len(line) + 1) % 4 == 0
    assert line[~allowed].max() < 1e-6 * line.max()
    assert np.sort(line[allowed])[-8] > 1e-3 * line.max()  # there are many


@pytest.fixture(scope="module")
def run(place):
    """Five turns of the carrier, of which the last one is settled."""
    return model_of(place).transient(duration=5 * TURN)


TURNED = np.arange(0.0, 360.0)  # as few lines of the gear mesh fold down from there


def static_lines(place, errors, **settings):
    """Orders (n, sensors) of a slow turn."""
    return orders(model_of(place, errors, **settings).static(TURNED)["sensor_static"].to_numpy())


def test_pin_errors_bring_the_other_orders_as_the_phasors_of_the_planets_say(place):
    """Order m of what planets at φ_i with small errors ε_i add goes with |Σ ε_i exp(j m φ_i)|."""
    pins = "\n[stage.errors]\npin_tangential_um = "
    one, two, opposite = (
        static_lines(place, pins + str(errors))
        for errors in ([0.2, 0, 0, 0], [0.2, 0.2, 0, 0], [0.2, 0, 0.2, 0])
    )
    m = np.array([1, 2, 3, 5, 6, 7])
    assert (one[m] > 1e-5 * one[4]).all()
    for lines, angle in ((two, np.pi / 2), (opposite, np.pi)):
        phasors = np.abs(1 + np.exp(1j * m * angle))
        np.testing.assert_allclose(
            lines[m], one[m] * phasors[:, None], atol=0.02 * one[m].max(), rtol=0.02
        )


def test_unequal_spacing_brings_the_orders_that_planets_then_share(place):
    """Planets at 0, 90° − δ, 180°, 270° − δ repeat twice a turn: odd orders stay away, and of
    others is left what |1 + exp(j m φ)| says."""
    spaced = [
        static_lines(place, "", **{"stage.planet_positions_deg": f"[0, {a}, 180, {a + 180}]"})
        for a in (86.4, 82.8)
    ]
    for lines in spaced:
        assert lines[1::2].max() < 1e-6 * lines[1:].max()
    for m in (2, 6):
        near, far = (abs(1 + np.exp(1j * m * np.radians(a))) for a in (86.4, 82.8))
        np.testing.assert_allclose(spaced[1][m] / spaced[0][m], far / near, rtol=0.02)
