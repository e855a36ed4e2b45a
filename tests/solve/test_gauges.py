"""Strain gauges and rim stress of a small stage with an FE ring."""

import re

import numpy as np
import pytest
from small_train import SMALL_STAGE

from flexgear import InputError, load_case
from flexgear.model.errors import FlexgearWarning
from flexgear.results.time_figures import rim_stress
from flexgear.structures.surface_strain import Ray, Surface

STAGE = SMALL_STAGE.read_text(encoding="utf-8")
GAUGES = """
[[sensors]]
name = "here"
on = "stage.ring"
measures = "strain"
angle_deg = 5

[[sensors]]
name = "a_planet_on"
on = "stage.ring"
measures = "strain"
angle_deg = 95

[[sensors]]
name = "axial"
on = "stage.ring"
measures = "strain"
angle_deg = -40
z_mm = -4
grid_angle_deg = 90

[[sensors]]
name = "root"
on = "stage.ring"
measures = "strain"
tooth = 12
"""
PLANETS, QUICK = 4, {"solver.fidelity": "quick"}


def case_of(folder, gauges=GAUGES):
    path = folder / "small.toml"
    path.write_text(STAGE + gauges, encoding="utf-8")
    return load_case(path, QUICK)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return case_of(tmp_path_factory.mktemp("gauges")).assemble()


@pytest.fixture(scope="module")
def turn(model):
    return model.static(np.arange(0, 360, 7.5))


@pytest.mark.slow
def test_a_gauge_sees_the_star_pass_once_a_planet(turn):
    """Four alike planets, teeth and bolts that are a multiple of four: the strain at one place
    repeats a quarter turn of the carrier later, and a quarter on round the ring it is the same."""
    strain = turn["sensor_static"]
    assert set(strain["static_sensor_unit"].to_numpy()) == {"1"}
    signal = strain.sel(static_sensor="here").to_numpy()
    size = np.ptp(signal)
    assert size > 1e-7
    np.testing.assert_allclose(np.roll(signal, 12), signal, atol=1e-4 * size)
    next_signal = strain.sel(static_sensor="a_planet_on").to_numpy()
    np.testing.assert_allclose(next_signal, signal, atol=1e-4 * size)
    spectrum = np.abs(np.fft.rfft(signal - signal.mean()))
    assert np.argmax(spectrum) % PLANETS == 0


def test_strain_grows_with_torque_like_the_deflection_of_teeth(model, turn):
    """Backlash is closed on one side: the ring alone is linear in its loads; nothing moves without
    torque."""
    torque = model.system.rated_torque
    free = model.static(6.0, torque=1e-6 * torque)["sensor_static"]
    loaded = model.static(6.0)["sensor_static"]
    assert np.abs(free).max() < 1e-4 * np.abs(loaded).max()


def test_rim_stress_is_that_of_the_gauges_and_in_the_summary(model, turn):
    """σ = E/(1 − ν²)(ε_θ + ν ε_z) at the tooth on the x axis, as the field has its surface."""
    stress = turn["rim_stress"].isel(tooth=0, position=0).item()
    ring, material = model.bodies["stage.ring"], model.case.view().material
    surface = Surface(ring)
    vertices, weights, _ = surface.meeting(Ray(0.0, 0.0))
    field = model.deformed("stage.ring")["stress"].to_numpy()
    # of the field, with the normal stress that a mesh so coarse leaves there, taken off
    nu = material.poisson_ratio
    normal, hoop = (weights @ field[vertices])[:2]
    largest = float(np.abs(turn["rim_stress"]).max())
    assert stress == pytest.approx(hoop - nu / (1 - nu) * normal, abs=0.02 * largest)
    figures = rim_stress(turn, "stage")
    assert max(figures["max"], -figures["min"]) == pytest.approx(largest / 1e6)
    assert 0 < figures["range_mean"] <= figures["range_max"] <= figures["max"] - figures["min"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("angle_deg = 3\ntooth = 4", "[0].tooth: is given beside angle"),
        ("", "[0].angle_deg: is missing, and so is tooth"),
        ("tooth = 73", "[0].tooth: is 73 -- the ring has 72 teeth"),
        ("angle_deg = 3\nz_mm = 11", "[0].z_mm: is beside the ring -- at most 10 mm"),
        ('angle_deg = 3\nside = "+theta"', "[0].side: needs a tooth"),
    ],
)
def test_a_bad_place_is_one_clear_line(tmp_path, text, message):
    gauge = f'\n[[sensors]]\nname = "a"\non = "stage.ring"\nmeasures = "strain"\n{text}\n'
    with pytest.raises(InputError, match=re.escape(f"sensors{message}")) as fault:
        case_of(tmp_path, gauge)
    assert "\n" not in str(fault.value)


def test_gauges_of_earlier_files_are_told_what_they_are_now(tmp_path):
    gauges = '\n[[stage.ring.gauges]]\nname = "a"\nangle_deg = 5\n'
    with pytest.raises(InputError, match=re.escape("[[sensors]]")) as fault:
        case_of(tmp_path, gauges)
    assert "\n" not in str(fault.value)


def test_a_root_gauge_on_coarse_elements_warns(tmp_path):
    """Three times less than on finer ones in a thin rim; gauges outside change by some per cent."""
    with pytest.warns(FlexgearWarning, match="sensor root: .* too small") as caught:
        assert case_of(tmp_path).assemble().sensors
    assert len(caught) == 1
