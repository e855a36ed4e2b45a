"""Supports, bolts and fits of members in closed form, and the springs that reductions know."""

import numpy as np
import pytest
from coupled import TORQUE, make_bodies, make_case, make_system, named, shaped, stage_system
from small_train import SMALL_STAGE
from trains import lumped_housing

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.modes import springs_at
from flexgear.analysis.recovery import Recovery, channel_forces
from flexgear.coupling.modal import modal_system
from flexgear.coupling.springs import invariant_part, rotating_rows
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.structures.bodies import turn
from flexgear.structures.sources.carrier import source as carrier_source
from flexgear.structures.sources.ring import source as ring_source

ODD = {  # a carrier bearing softer in one fixed direction
    "stage.carrier.bearing_far.radial_x_n_per_m": "1e9",
    "stage.carrier.bearing_far.radial_y_n_per_m": "6e9",
}


def test_invariant_part_does_not_feel_rotation_and_the_rest_has_no_mean():
    rng = np.random.default_rng(3)
    a = rng.normal(size=(6, 6))
    k = a @ a.T
    mean = invariant_part(k)
    for angle in (0.3, 1.7):
        assert np.allclose(turn(angle).T @ mean @ turn(angle), mean)
    assert np.allclose(invariant_part(k - mean), 0.0, atol=1e-12)
    values, vectors = rotating_rows(k - mean)
    assert np.allclose((vectors.T * values) @ vectors, k - mean)


@pytest.fixture(scope="module")
def odd():
    return make_system(**ODD)


def test_anisotropic_bearing_enters_as_a_rotated_spring(odd):
    """Equilibrium against dense algebra with the bearing's matrix turned into the carrier frame."""
    case = make_case(**ODD)
    modal = modal_system(odd)
    matrix = case.stage.seat_bearings["far"].matrix
    for theta in (0.0, 0.6, 2.0):
        e = revolution(modal, theta, TORQUE)
        q = modal.modes @ e.eta[0] + modal.residual_motion @ channel_forces(e)[0]
        rows = odd.node_rows("stage.carrier", "bearing_far")
        extra = rows.T @ (turn(theta).T @ matrix @ turn(theta) - invariant_part(matrix)) @ rows
        load = odd.ports[0].row * TORQUE - odd.ports[-1].row * -e.torques[0, -1]
        gear_meshes = sum(one.stiffness for one in springs_at(odd, theta).gear_meshes)
        loaded = shaped(e, "pair_load")[0][shaped(e, "pair_stiffness")[0] > 0]
        assert loaded.min() > 0  # every pair in mesh is loaded, so the spring form holds
        residual = (odd.stiffness + extra + gear_meshes) @ q - load
        assert np.abs(residual).max() < 1e-8 * TORQUE


def test_a_run_on_an_anisotropic_bearing_stays_balanced(odd):
    theta = np.arange(24) / 24 * 2 * np.pi
    e = revolution(modal_system(odd), theta, TORQUE)
    assert e.closure.max() < 1e-8
    assert np.allclose(-e.torques[:, -1], TORQUE * 27 / 120)
    carried = Recovery(e).link_force("stage.carrier_far")  # carrier axes, from the matrix as given
    u = Recovery(e).node("stage.carrier", "bearing_far")
    matrix = make_case(**ODD).stage.seat_bearings["far"].matrix
    for t, angle in enumerate(theta):
        r = turn(angle)
        assert np.allclose(carried[t], r.T @ matrix @ r @ u[t], atol=1e-6 * TORQUE)


def test_soft_mount_turns_by_the_ring_torque():
    soft = lumped_housing("2e4", "[2e4, 2e4, 2e4]", "1e9", "1e9", "1e9", "2e8")
    e = revolution(modal_system(make_system(**soft)), 0.8, TORQUE)
    turned = Recovery(e).node("housing", "housing")[0, 5]
    assert turned == pytest.approx(TORQUE * 93 / 120 / 2e8, rel=1e-6)
    assert -e.torques[0, -1] == pytest.approx(TORQUE * 27 / 120, rel=1e-9)


def test_single_point_gear_mesh_shares_load_by_stiffness():
    theta = np.linspace(0, 0.06, 5)
    lumped = revolution(
        modal_system(make_system(**{"stage.gear_mesh.model": '"lumped"'})), theta, TORQUE
    )
    pairs = revolution(modal_system(make_system()), theta, TORQUE)
    total, k = shaped(lumped, "pair_load").sum(-1, keepdims=True), shaped(lumped, "pair_stiffness")
    share = k / np.maximum(k.sum(-1, keepdims=True), 1.0)
    assert np.allclose(shaped(lumped, "pair_load"), total * share, atol=1e-6 * total.max())
    assert np.allclose(
        shaped(lumped, "pair_load").sum(-1)[:, :2].mean(-1),
        shaped(pairs, "pair_load").sum(-1)[:, :2].mean(-1),
        rtol=1e-6,
    )


STAGE = SMALL_STAGE.read_text()
BEFORE, REST = STAGE.split("[stage.ring.fe.bolts]\n")
BOLTS, AFTER = REST.split("[stage.carrier.fe]\n")
AFTER = f"[stage.carrier.fe]\n{AFTER}"
SPLINE = """[[stage.ring.fe.splines]]
z_mm = 0
half_width_mm = 6
stiffness_radial_n_per_m = 1e9
stiffness_axial_n_per_m = 1e8
stiffness_tilt_nm_per_rad = 1e5
stiffness_torsion_nm_per_rad = 5e6
"""
CLEAN = {f"stage.errors.{gear}_tooth_um": "0" for gear in ("ring", "planet", "sun")}
SUN_TORQUE, RING_TORQUE = 300.0, 300.0 * 72 / 100
RIGID = ("ring", "carrier", "shaft")


def stage(folder, supports, **settings):
    file = folder / "stage.toml"
    file.write_text(BEFORE.replace('end = "-z"\n', "") + supports + AFTER)
    return load_case(file, {**CLEAN, "solver.fidelity": "quick", **settings}).view()


def circle(end, factor=1.0):
    """A list element of bolts with all stiffnesses times a factor."""
    lines = []
    for line in BOLTS.strip().splitlines():
        key, _, value = line.partition(" = ")
        scaled = f"{factor * float(value)}" if key.startswith("stiffness") else value
        lines.append(f"{key} = {scaled}")
    return "\n".join(["[[stage.ring.fe.bolts]]", f'end = "{end}"', *lines, ""])


def rigid_state(case):
    """Recovered equilibrium at rated torque of all rigid bodies on the case's springs."""
    modal = modal_system(stage_system(case, {}, RIGID))
    return Recovery(revolution(modal, 0.1, SUN_TORQUE))


FIT = SPLINE.replace("splines", "fits").replace("5e6", "1e6").replace("z_mm = 0", "z_mm = 4")


@pytest.mark.parametrize(("supports", "total"), [(SPLINE, 5e6), (SPLINE + FIT, 6e6)])
def test_splines_and_fits_twist_by_the_torque_and_share_it_by_their_stiffness(
    tmp_path, supports, total
):
    state = rigid_state(stage(tmp_path, supports))
    twist = RING_TORQUE / total
    assert state.node("stage.ring", "spline_1")[0, 5] == pytest.approx(twist, rel=1e-9)
    force = state.link_force("stage.spline_1")[0]
    assert force[5] == pytest.approx(5e6 * twist, rel=1e-9)
    if total == 5e6:
        assert np.abs(force[:5]).max() < 1e-7 * RING_TORQUE
    else:
        assert state.link_force("stage.fit_1")[0, 5] == pytest.approx(1e6 * twist, rel=1e-9)


@pytest.mark.parametrize(
    "supports", [circle("-z"), circle("+z"), circle("-z", 0.5) + circle("+z", 0.5)]
)
def test_bolts_twist_a_rigid_ring_alike_wherever_they_are(tmp_path, supports):
    """θ = T / (n (k_t r² + k_twist)), n and k of all circles together."""
    state = rigid_state(stage(tmp_path, supports))
    expected = RING_TORQUE / (8 * (2e8 * 0.061**2 + 2e2))
    assert state.node("stage.ring", "bolt_01")[0, 5] == pytest.approx(expected, rel=1e-9)


def test_bolts_on_both_ends_carry_alike_and_do_not_tilt_a_spur_ring(tmp_path):
    state = rigid_state(stage(tmp_path, circle("-z", 0.5) + circle("+z", 0.5)))
    names = [f"bolt_{k:02d}" for k in range(1, 17)]
    force = np.array([state.link_force(f"stage.{name}")[0, :3] for name in names]).reshape(2, 8, 3)
    assert np.abs(force[0] - force[1] * [1, 1, -1]).max() < 1e-6 * np.abs(force).max()
    assert np.abs(state.node("stage.ring", "bolt_01")[0, 3:5]).max() < 1e-6 * RING_TORQUE / 1e6
    one = rigid_state(stage(tmp_path, circle("-z")))
    assert np.abs(one.node("stage.ring", "bolt_01")[0, 3:5]).max() < 1e-6 * RING_TORQUE / 1e6
    torque = (8 * 0.5 * 2e2 * state.node("stage.ring", "bolt_01")[0, 5] * 2) + 0.061 * force[
        ..., 1
    ].sum()
    assert torque == pytest.approx(RING_TORQUE, rel=1e-9)


def test_one_circle_may_be_a_table_or_a_list(tmp_path):
    table = stage(tmp_path, '[stage.ring.fe.bolts]\nend = "+z"\n' + BOLTS)
    listed = stage(tmp_path, circle("+z"))
    assert table.ring.bolt_circles == listed.ring.bolt_circles
    a, b = (rigid_state(case).node("stage.ring", "bolt_03")[0] for case in (table, listed))
    assert np.array_equal(a, b)


@pytest.mark.parametrize(
    ("supports", "settings", "says"),
    [
        ("", {}, "stage.ring.fe.bolts: nothing supports the ring's torque"),
        (
            SPLINE.replace("5e6", "0"),
            {},
            "stage.ring.fe.splines[0].stiffness_torsion_nm_per_rad: is zero",
        ),
        (
            SPLINE.replace("_torsion", "_twist"),
            {},
            "stage.ring.fe.splines[0].stiffness_twist_nm_per_rad",
        ),
        (SPLINE.replace("z_mm = 0", "z_mm = 9"), {}, "stage.ring.fe.splines[0].z_mm: the band"),
        ("[stage.ring.fe.bolts]\n" + BOLTS, {}, "stage.ring.fe.end: is missing"),
        (
            circle("+z").replace("number = 8", "number = 8.5"),
            {},
            "stage.ring.fe.bolts[0].number: 8.5 is not",
        ),
        (
            circle("+z"),
            {"stage.ring.fe.bolts.number": "4"},
            "stage.ring.fe.bolts.number: bolts is a list",
        ),
        (circle("+z") * 2, {}, "stage.ring.fe.bolts: the same circle is listed twice"),
    ],
)
def test_supports_that_cannot_be_meant_are_refused(tmp_path, supports, settings, says):
    with pytest.raises(InputError) as refused:
        stage(tmp_path, supports, **settings)
    assert says in str(refused.value)


def test_a_ring_that_nothing_holds_along_the_axis_is_loose(tmp_path):
    lines = [line for line in SPLINE.splitlines() if "axial" not in line]
    case = stage(tmp_path, "\n".join([*lines, ""]))
    with pytest.raises(InputError, match=r"stage.ring.fe.splines.0.stiffness_axial_n_per_m"):
        rigid_state(case)


STIFFNESS = {  # no two alike
    "stage.ring.fe.bolts.stiffness_radial_n_per_m": "1.1e9",
    "stage.ring.fe.bolts.stiffness_tangential_n_per_m": "1.2e9",
    "stage.ring.fe.bolts.stiffness_axial_n_per_m": "1.3e9",
    "stage.ring.fe.bolts.stiffness_tilt_nm_per_rad": "1.4e7",
    "stage.ring.fe.bolts.stiffness_twist_nm_per_rad": "1.5e6",
    "stage.ring.fe.bolts.first_angle_deg": "5",
    "stage.ring.fe.fits.0.stiffness_radial_n_per_m": "1.6e9",
    "stage.ring.fe.fits.0.stiffness_axial_n_per_m": "1.7e8",
    "stage.ring.fe.fits.1.stiffness_tilt_nm_per_rad": "1.8e7",
    "stage.carrier.bearing_far.radial_x_n_per_m": "1.9e9",
    "stage.carrier.bearing_far.radial_y_n_per_m": "2.1e9",
    "stage.carrier.bearing_drive.axial_n_per_m": "2.2e9",
}


@pytest.fixture(scope="module")
def springy_stage():
    case = make_case(**STIFFNESS)
    ring, carrier = make_bodies(case).values()
    return case, ring, carrier, stage_system(case, named(case, ring=ring, carrier=carrier))


def test_supports_of_a_ring_in_the_system_are_those_of_its_source(springy_stage):
    case, ring, _, system = springy_stage
    block = system.slice_of("stage.ring")
    coupled = system.stiffness[block, block] - ring.stiffness
    estimated = ring_source(case).supports(ring.node_names, ring.stiffness)
    assert np.abs(coupled - estimated).max() < 1e-9 * np.abs(estimated).max()
    nodes = np.abs(estimated).max(axis=1).reshape(-1, 6).max(axis=1) > 0
    assert nodes.sum() == case.ring.bolts.number + len(case.ring.fits)


def test_supports_of_a_carrier_in_the_system_are_the_mean_over_a_turn(springy_stage):
    """The system holds the mean of bearings over a turn, and turns the rest."""
    case, _, carrier, system = springy_stage
    block = system.slice_of("stage.carrier")
    coupled = system.stiffness[block, block] - carrier.stiffness
    still = np.zeros_like(carrier.stiffness)
    estimated = carrier_source(case).supports(carrier.node_names, still)
    for name in ("bearing_drive", "bearing_far"):
        at = 6 * carrier.node_names.index(name) + np.arange(6)
        at = np.ix_(at, at)
        mean = invariant_part(estimated[at])
        assert np.abs(mean).max() > 0
        assert np.abs(coupled[at] - mean).max() < 1e-9 * np.abs(mean).max()
