"""Strain gauges and rim stress of a small stage with an FE ring."""

import re

import numpy as np
import pytest
from small_train import SMALL_STAGE

from flexgear import InputError, load_case
from flexgear.results.time_figures import rim_stress
from flexgear.structures.surface_strain import Ray, Surface

STAGE = SMALL_STAGE.read_text(encoding="utf-8")
GAUGES = """
[[stage.ring.gauges]]
name = "here"
angle_deg = 5

[[stage.ring.gauges]]
name = "a_planet_on"
angle_deg = 95

[[stage.ring.gauges]]
name = "axial"
angle_deg = -40
z_mm = -4
direction_deg = 90

[[stage.ring.gauges]]
name = "root"
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


def test_a_gauge_sees_the_star_pass_once_a_planet(turn):
    """Four alike planets, teeth and bolts that are a multiple of four: the strain at one place
    repeats a quarter turn of the carrier later, and a quarter on round the ring it is the same."""
    strain = turn["gauge_strain"]
    assert strain.attrs["units"] == "1"
    here = strain.sel(gauge="stage.here").to_numpy()
    size = np.ptp(here)
    assert size > 1e-7
    np.testing.assert_allclose(np.roll(here, 12), here, atol=1e-4 * size)
    there = strain.sel(gauge="stage.a_planet_on").to_numpy()
    np.testing.assert_allclose(there, here, atol=1e-4 * size)
    spectrum = np.abs(np.fft.rfft(here - here.mean()))
    assert np.argmax(spectrum) % PLANETS == 0


def test_strain_grows_with_torque_like_the_deflection_of_teeth(model, turn):
    """Backlash is closed on one side: the ring alone is linear in its loads; nothing moves without
    torque."""
    torque = model.system.rated_torque
    free = model.static(6.0, torque=1e-6 * torque)["gauge_strain"]
    loaded = model.static(6.0)["gauge_strain"]
    assert np.abs(free).max() < 1e-4 * np.abs(loaded).max()


def test_rim_stress_is_that_of_the_gauges_and_in_the_summary(model, turn):
    """σ = E/(1 − ν²)(ε_θ + ν ε_z) at the tooth on the x axis, as the field has its surface."""
    found = turn["rim_stress"].isel(tooth=0, position=0).item()
    ring, material = model.bodies["stage.ring"], model.case.view().material
    surface = Surface(ring)
    vertices, weights, _ = surface.meeting(Ray(0.0, 0.0))
    field = model.deformed("stage.ring")["stress"].to_numpy()
    # of the field, with the normal stress that a mesh so coarse leaves there, taken off
    nu = material.poisson_ratio
    normal, hoop = (weights @ field[vertices])[:2]
    largest = float(np.abs(turn["rim_stress"]).max())
    assert found == pytest.approx(hoop - nu / (1 - nu) * normal, abs=0.02 * largest)
    figures = rim_stress(turn, "stage")
    assert max(figures["max"], -figures["min"]) == pytest.approx(largest / 1e6)
    assert 0 < figures["range_mean"] <= figures["range_max"] <= figures["max"] - figures["min"]


def test_samples_of_a_transient_are_the_strain_of_its_fields(model):
    run = model.transient(duration=2e-3, fields=["stage.ring"])
    strain, ring = run["gauge_strain"], model.bodies["stage.ring"]
    own = run["fe_coordinate"].to_numpy()
    vertices, weights, base = Surface(ring).meeting(Ray(np.radians(5), 0.0))
    for sample in (0, -1):
        xx, yy, _, xy, _, _ = weights @ ring.strain(own[sample])[vertices]
        c, s = base[0, :2]
        around = c * c * xx + s * s * yy + 2 * c * s * xy
        here = strain.isel(time=sample).sel(gauge="stage.here").item()
        assert here == pytest.approx(around, abs=1e-4 * float(np.abs(strain).max()))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("angle_deg = 3\ntooth = 4", "[0].tooth: stands beside angle"),
        ("", "[0].angle_deg: is missing, and so is tooth"),
        ("tooth = 73", "[0].tooth: is 73 -- the ring has 72 teeth"),
        ("angle_deg = 3\nz_mm = 11", "[0].z_mm: is beside the ring -- at most 10 mm"),
        ('angle_deg = 3\nside = "+theta"', "[0].side: is that of a tooth"),
        ('tooth = 2\n[[stage.ring.gauges]]\nname = "a"\ntooth = 1', "[1].name: a is there already"),
    ],
)
def test_a_bad_place_is_one_clear_line(tmp_path, text, said):
    with pytest.raises(InputError, match=re.escape(f"stage.ring.gauges{said}")) as fault:
        case_of(tmp_path, f'\n[[stage.ring.gauges]]\nname = "a"\n{text}\n')
    assert "\n" not in str(fault.value)
