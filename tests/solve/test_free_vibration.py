"""Cases without output: natural modes about rest or steady speed, with torsional supports k r².

Supports of members that turn are springs to what turns on at the steady speed, as in Cooley and
Parker 2012 (Vibration properties of high-speed planetary gears with gyroscopic effects).
"""

import numpy as np
import pytest
from lumped_stage import lin_parker
from trains import STEEL, free_stage, write

from flexgear import InputError, load_case

SUN, CARRIER = 2e8, 7e8  # N/m, of u = r θ
TURNING = {
    "stage.sun.support.tangential_n_per_m": str(SUN),
    "stage.carrier.support.tangential_n_per_m": str(CARRIER),
}

PAIR = (
    STEEL
    + """
[stage]
kind = "parallel"
normal_module_mm = 2
pressure_angle_deg = 20
face_width_mm = 20
gear_mesh = { model = "constant", sun_stiffness_n_per_m = 2e8 }
[stage.pinion]
teeth = 20
kinematics = "torsional"
inertia_kg_m2 = 2e-4
support = { torsion_nm_per_rad = 4e4 }
[stage.gear]
teeth = 50
kinematics = "torsional"
inertia_kg_m2 = 9e-3
support = { tangential_n_per_m = 3e7 }
"""
)


def test_two_gears_on_torsional_springs(tmp_path):
    """det(K − ω² J) = 0 with K = k_m (r1, r2)(r1, r2)ᵀ + diag(k1, k2), r the base radii."""
    r = np.array([0.02, 0.05]) * np.cos(np.radians(20))
    inertia, springs = np.array([2e-4, 9e-3]), np.array([4e4, 3e7 * r[1] ** 2])
    for held in (True, False):
        text = (
            PAIR
            if held
            else PAIR.replace("torsion_nm_per_rad = 4e4", "").replace(
                "tangential_n_per_m = 3e7", ""
            )
        )
        k = 2e8 * np.outer(r, r) + np.diag(springs * held)
        a = np.prod(inertia)
        b = -(k[0, 0] * inertia[1] + k[1, 1] * inertia[0])
        expected = np.sort(np.roots([a, b, np.linalg.det(k) if held else 0.0]))
        frequencies = load_case(write(tmp_path, text)).assemble().modes()["frequency"].to_numpy()
        assert (2 * np.pi * frequencies) ** 2 == pytest.approx(expected, rel=1e-9, abs=1e-3)


@pytest.mark.parametrize("planets", [3, 4])
def test_a_planetary_stage_with_all_members_on_springs(tmp_path, planets):
    """Frequencies of an independent assembly; none is zero."""
    train = free_stage(tmp_path, **TURNING, **{"stage.planets": str(planets)})
    assert train.held_members() == ()
    frequencies = train.assemble().modes()["frequency"].to_numpy()
    expected = lin_parker(planets, sun_torsion=SUN, carrier_torsion=CARRIER).modes()[0]
    assert frequencies == pytest.approx(expected, rel=1e-9)
    assert frequencies[0] > 100.0


def test_without_ports_the_modes_are_those_of_the_bundled_case(tmp_path):
    loaded = load_case("lin-parker").assemble().modes()
    free = free_stage(tmp_path).assemble().modes()
    assert free["frequency"].to_numpy() == pytest.approx(loaded["frequency"].to_numpy(), rel=1e-9)
    assert free["frequency"][0] == 0.0
    assert list(free["type"].to_numpy()) == list(loaded["type"].to_numpy())


def test_a_member_held_by_name_has_no_rotation(tmp_path):
    """The limit of a stiff spring."""
    stiff = {"stage.sun.support.tangential_n_per_m": "1e14"}
    held = free_stage(tmp_path, held='["stage.sun"]').assemble().modes()["frequency"].to_numpy()
    limit = free_stage(tmp_path, **stiff).assemble().modes()["frequency"].to_numpy()
    assert limit[: len(held)] == pytest.approx(held, rel=1e-4)
    assert len(limit) == len(held) + 1


def test_whirl_about_steady_speed(tmp_path):
    """All bodies in the carrier's frame, M q̈ + 2Ω m E q̇ + (K − Ω² m) q, by the companion matrix."""
    port = '[[inputs]]\nmember = "stage.carrier"\nspeed_rpm = 6000\n'
    train = free_stage(tmp_path, port, gyroscopic="true", **TURNING)
    data = train.assemble().campbell(factors=[0.0, 1.0])
    model = lin_parker(4, sun_torsion=SUN, carrier_torsion=CARRIER)
    size, speed = len(model.mass), 6000 * np.pi / 30
    turning, pushing = np.zeros((size, size)), np.zeros((size, size))
    for k in range(size // 3):
        m = model.mass[3 * k, 3 * k]
        turning[3 * k, 3 * k + 1], turning[3 * k + 1, 3 * k] = -2 * m * speed, 2 * m * speed
        pushing[3 * k, 3 * k] = pushing[3 * k + 1, 3 * k + 1] = m * speed**2
    inverse = np.linalg.inv(model.mass)
    companion = np.block([
        [np.zeros((size, size)), np.eye(size)],
        [-inverse @ (model.stiffness - pushing), -inverse @ turning],
    ])  # fmt: skip
    values = np.linalg.eigvals(companion)
    expected = np.sort(values.imag[values.imag > 0]) / (2 * np.pi)
    frequencies = np.sort(data["campbell_frequency"].to_numpy()[1])
    assert frequencies == pytest.approx(expected, rel=1e-9)
    still = np.sort(data["campbell_frequency"].to_numpy()[0])
    assert np.abs(frequencies - still).max() > 50.0  # Hz: the terms matter here


def test_analyses_from_python_refuse_a_case_of_free_vibration(tmp_path):
    model = free_stage(tmp_path).assemble()
    with pytest.raises(InputError, match="free vibration"):
        model.static()


@pytest.mark.parametrize(
    ("ports", "message"),
    [
        ('[output]\nmember = "stage.sun"\n', "inputs: is missing beside output"),
        ('[[inputs]]\nmember = "stage.sun"\nspeed_rpm = 1\ntorque_nm = 2\n',
         "output: is missing, and inputs give torque"),
        ('[[inputs]]\nmember = "stage.sun"\nspeed_rpm = 1\npower_kw = 2\n',
         "output: is missing, and inputs give power"),
    ],
)  # fmt: skip
def test_half_a_load_is_refused(tmp_path, ports, message):
    with pytest.raises(InputError, match=message):
        free_stage(tmp_path, ports)


def test_a_loaded_member_on_a_spring_is_told_of_free_vibration(tmp_path):
    with pytest.raises(InputError, match=r"which rotates -- .*free vibration, without \[output\]"):
        load_case("lin-parker", TURNING)
