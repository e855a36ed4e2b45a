"""Orders of the carrier that a sensor on a held ring hears: those that planets let through."""

import numpy as np
import pytest
from small_train import LUMPED_PARTS, SMALL_STAGE
from trains import write

from flexgear import load_case

TURN = 0.04  # s
KINDS = ("acceleration", "displacement", "strain")
SENSORS = "".join(
    f'[[sensors]]\nname = "{kind}"\non = "stage.ring"\nmeasures = "{kind}"\nangle_deg = 70\n'
    + ("" if kind == "strain" else 'direction = "radial"\n')
    for kind in KINDS
)
RING = {  # the small stage with lumped members but for its ring, planar, without errors
    **LUMPED_PARTS["carrier"], **LUMPED_PARTS["sun"],
    "stage.sun.support.radial_n_per_m": "1e7", "stage.sun.support.axial_n_per_m": "1e7",
    "stage.sun.bore_diameter_mm": "", "stage.planet.bore_diameter_mm": "",
    "stage.ring.fe.bolts.number": "9", "stage.gear_mesh.damping_ratio": "0.2",
    "stage.ring.fe.fixed_interface_modes": "20",
    "kinematics": '"planar"', "gravity_m_per_s2": "[0, -9.81, 0]", "damping.ratio": "0.1",
    "inputs.0.inertia_kg_m2": "", "inputs.0.machine.law": '"speed"',
    "output.inertia_kg_m2": "0.002", "solver.fidelity": "quick", "solver.gear_mesh_orders": "2",
    "solver.time_step_s": "5e-6", "recorder.band_hz": "3000", "recorder.sampling_rate_hz": "8000",
}  # fmt: skip


def model_of(folder, **settings):
    text = SMALL_STAGE.read_text(encoding="utf-8").partition("[stage.errors]")[0] + SENSORS
    path = write(folder, text, name="ring.toml")
    return load_case(path, {**RING, **settings}).assemble()


def orders(values):
    """Amplitudes (n,) of the orders of a turn."""
    return np.abs(np.fft.rfft(values, axis=0)) / len(values)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("lines")


@pytest.mark.parametrize("kind", KINDS)
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


def static_lines(place, **settings):
    """Orders (n, sensors) of a slow turn."""
    return orders(model_of(place, **settings).static(TURNED)["sensor_static"].to_numpy())


def test_pin_errors_bring_the_other_orders_as_the_phasors_of_the_planets_say(place):
    """Order m of what planets at φ_i with small errors ε_i add goes with |Σ ε_i exp(j m φ_i)|."""
    one, two, opposite = (
        static_lines(place, **{"stage.errors.pin_tangential_um": str(errors)})
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
        static_lines(place, **{"stage.planet_positions_deg": f"[0, {a}, 180, {a + 180}]"})
        for a in (86.4, 82.8)
    ]
    for lines in spaced:
        assert lines[1::2].max() < 1e-6 * lines[1:].max()
    for m in (2, 6):
        near, far = (abs(1 + np.exp(1j * m * np.radians(a))) for a in (86.4, 82.8))
        np.testing.assert_allclose(spaced[1][m] / spaced[0][m], far / near, rtol=0.02)
