"""Roller bearings: Harris's load integral, loaded planets in equilibrium, energy in transients."""

import numpy as np
import pytest
from coupled import make_system
from law_response import respond
from scipy.integrate import quad
from stepped import stepped
from trains import stage_train

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.gear_mesh_cycle import mean_springs
from flexgear.analysis.modes import modes
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Drive
from flexgear.coupling.build import build_system
from flexgear.coupling.kernels.elements import packed
from flexgear.coupling.laws import LAW_NUMBERS
from flexgear.coupling.laws.rollers import roller_loads, roller_parameters
from flexgear.coupling.modal import modal_system
from flexgear.gears.bearings.rows import roller_stiffness
from flexgear.model.bearings import Rollers
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case

N = 10 / 9


def force_of(rollers, motion):
    parameters, motion = np.array(roller_parameters(rollers, 1e9, 1e6)), [motion, np.zeros(4)]
    return respond(LAW_NUMBERS["rollers"], parameters, np.array(motion))[1][0]


def load_integral(share):
    """J_r(ε) of Harris and Kotzalas, eq. 7.16, for line contact."""
    half = np.arccos(np.clip(1 - 2 * share, -1, 1))

    def load(psi):
        return max(1 - (1 - np.cos(psi)) / (2 * share), 0.0) ** N * np.cos(psi)

    return quad(load, -half, half, epsabs=1e-12)[0] / (2 * np.pi)


@pytest.mark.parametrize("gap", [0.0, 1e-5, 4e-5])
def test_force_is_harris_load_integral(gap):
    """F_r = Z K δ_max^n J_r(ε) with ε = ½ (1 − gap/δ_r); Z/(1/J_r) is Stribeck's number 4.08."""
    rollers, x = Rollers(count=180, rows=1, length=0.03, clearance=gap), 6e-5
    force = force_of(rollers, (x, 0.0, 0.0, 0.0))
    share = 0.5 * (1 - gap / x)
    expected = 180 * roller_stiffness(0.03) * (x - gap) ** N * load_integral(share)
    assert force[0] == pytest.approx(expected, rel=2e-4)
    assert np.abs(force[1:]).max() < 1e-9 * force[0]
    if gap == 0.0:
        largest = roller_stiffness(0.03) * x**N
        assert 180 * largest / force[0] == pytest.approx(4.08, abs=0.01)


def test_tilted_bearing_loads_its_rows_apart():
    """Two rows as two bearings: sums of their forces, moments by their distance."""
    two = Rollers(count=24, rows=2, length=0.04, spacing=0.06, clearance=1e-5)
    one = Rollers(count=24, rows=1, length=0.04, clearance=1e-5)
    x, tilt = 4e-5, 6e-4  # r_y
    force = force_of(two, (x, 0.0, 0.0, tilt))
    low, high = (force_of(one, (x + z * tilt, 0.0, 0.0, 0.0))[0] for z in (-0.03, 0.03))
    assert force[0] == pytest.approx(low + high, rel=1e-12)
    assert force[3] == pytest.approx(0.03 * (high - low), rel=1e-12)
    motion = np.array([x, 0.0, 0.0, tilt])
    loads = roller_loads(np.array(roller_parameters(two, 1e9, 1e6)), motion[None], np.zeros(1))[0]
    assert loads.shape == (2, 24)
    along = (loads * np.cos(2 * np.pi * np.arange(24) / 24)).sum(axis=1)
    assert along == pytest.approx([low, high], rel=1e-12)


ROLLERS = {"count": "20", "rows": "2", "length_mm": "18", "spacing_mm": "20", "clearance_um": "15"}


def lumped(folder):
    keys = {f"stage.planet_bearing.rollers.{k}": v for k, v in ROLLERS.items()}
    return build_system(stage_train(folder, planets=3, **keys))


def flexible(_, **more):
    rollers = ROLLERS | {"length_mm": "120", "spacing_mm": "150"}
    keys = {f"stage.planet_bearing.rollers.{k}": v for k, v in rollers.items()}
    return make_system(**{"stage.gear_mesh.contact_law": "one-sided", **keys, **more})


@pytest.mark.parametrize("make", [lumped, flexible])
def test_loaded_planet_bearing_is_in_equilibrium(tmp_path, make):
    """Loads of all rollers add up to the force on the pin; each follows from its own approach; in
    the lumped stage of spur gears the force is that of statics."""
    system = make(tmp_path)
    equilibrium = revolution(modal_system(system), np.array([0.0, 0.2]), system.rated_torque)
    recovery = Recovery(equilibrium)
    names = [b.name for b in system.bearings]
    assert len(names) == len({g.planet for g in system.gear_meshes})
    assert "planet_bearing_1" in names[0]
    for bearing in system.bearings:
        loads = recovery.bearing_loads(bearing.name)
        assert loads.shape == (2, 2, 20) and (loads >= 0).all() and (loads == 0).any()
        psi = 2 * np.pi * np.arange(20) / 20
        resultant = np.stack([(loads * f(psi)).sum(axis=(1, 2)) for f in (np.cos, np.sin)], axis=1)
        link = next(li for li in system.links if li.name == bearing.name)
        spring = recovery.motion(link.rows) @ link.matrix.T
        force = -recovery.link_force(bearing.name)
        scale = 1e-8 * np.abs(resultant).max()
        np.testing.assert_allclose(resultant, (force + spring)[:, :2], rtol=0, atol=scale)
        if make is lumped:
            gears = equilibrium.pair_load.sum(axis=-1)[0, 0]
            assert np.hypot(*force[0, :2]) == pytest.approx(
                2 * gears * np.cos(np.radians(20)), rel=1e-8
            )
            assert loads[:, 0] == pytest.approx(loads[:, 1], rel=1e-9)  # planar: rows alike
        else:  # helical gears tilt a planet: one row carries more
            rows = np.linalg.norm([(loads * f(psi)).sum(axis=-1) for f in (np.cos, np.sin)], axis=0)
            assert np.abs(rows[:, 0] - rows[:, 1]).min() > 0.05 * rows.max()
            assert recovery.row_loads([bearing.name])[:, 0] == pytest.approx(rows, rel=1e-12)


def test_modes_have_the_tilt_of_rows_that_share_the_radial_stiffness():
    """k_r/2 at ±75 mm resist tilting with k_r (75 mm)², stated by hand; one row does not, and
    planets that nothing else holds have no equilibrium."""
    frequencies, left_out = [], {"stage.planet_bearing.tilt_nm_per_rad": None}
    for tilt in (left_out, dict.fromkeys(left_out, 4e9 * 0.075**2)):
        modal = modal_system(flexible(None, **tilt))
        springs = mean_springs(modal.system, modal).stiffness
        frequencies.append(modes(modal.system, springs, 500.0).frequencies)
    np.testing.assert_allclose(*frequencies, rtol=1e-4)
    modal = modal_system(flexible(None, **{**left_out, "stage.planet_bearing.rollers.rows": "1"}))
    with pytest.raises(FlexgearError, match="one row of rollers needs tilt_nm_per_rad"):
        mean_springs(modal.system, modal)


def test_a_run_starts_where_the_equilibrium_is(tmp_path):
    """Nothing but rolling happens under steady torque: bearings carry what they did at rest."""
    system = lumped(tmp_path)
    modal = modal_system(system)
    at_rest = revolution(modal, np.array([0.0]), system.rated_torque)
    drive = Drive(lambda t: np.full_like(t, system.rated_torque))
    run = stepped(modal, drive, 2e-3, 2e-5)
    scale = np.abs(at_rest.support_load).max()
    np.testing.assert_allclose(run.support_load[0], at_rest.support_load[0], atol=2e-3 * scale)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("stage.planet_bearing.rollers.count", "2", "rollers.count"),
        ("stage.planet_bearing.clearance_um", "5", "give it as rollers.clearance"),
        ("stage.planet_bearing.rollers.length_um", "-3", "rollers.length_um"),
    ],
)
def test_impossible_rollers_are_refused(tmp_path, key, value, message):
    keys = {f"stage.planet_bearing.rollers.{k}": v for k, v in ROLLERS.items()}
    keys = {k: v for k, v in keys.items() if not (k.endswith("length_mm") and "length" in key)}
    with pytest.raises(InputError, match=message):
        stage_train(tmp_path, planets=3, **{**keys, key: value})


def test_rollers_and_dampers_of_one_bearing_have_rows_of_their_own():
    """Laws with more and with fewer parameters stand side by side."""
    planet = "stage.planet_bearing"
    settings = {
        f"{planet}.rollers.count": 14,
        f"{planet}.rollers.length_mm": 12,
        f"{planet}.damping.radial_n_s_per_m": 1e3,
    }
    rows = packed(build_system(load_case("lin-parker", settings)).pairs).fixed.row
    planets, of_rollers, of_dampers = 4, 4, 6
    assert len(rows) == planets * (of_rollers + of_dampers)
    assert np.sum(rows["stiffness"] == 1e8) == 2 * planets  # radial, of modes
