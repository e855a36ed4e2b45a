"""What holds an FE ring: bolt circles on either end, fits and splines; closed forms and balance."""

import numpy as np
import pytest
from coupled import stage_system
from small_train import SMALL_STAGE

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.modal import modal_system
from flexgear.model.errors import InputError
from flexgear.model.load import load_case

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
TORQUE, RING_TORQUE = 300.0, 300.0 * 72 / 100
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
    return Recovery(revolution(modal, 0.1, TORQUE))


def test_a_spline_alone_twists_by_the_torque_over_its_stiffness(tmp_path):
    found = rigid_state(stage(tmp_path, SPLINE))
    assert found.node("stage.ring", "spline_1")[0, 5] == pytest.approx(RING_TORQUE / 5e6, rel=1e-9)
    force = found.link_force("stage.spline_1")[0]
    assert force[5] == pytest.approx(RING_TORQUE, rel=1e-9)
    assert np.abs(force[:5]).max() < 1e-7 * RING_TORQUE


def test_fits_and_splines_share_the_torque_by_their_stiffness(tmp_path):
    fit = SPLINE.replace("splines", "fits").replace("5e6", "1e6").replace("z_mm = 0", "z_mm = 4")
    found = rigid_state(stage(tmp_path, SPLINE + fit))
    assert found.link_force("stage.spline_1")[0, 5] == pytest.approx(RING_TORQUE * 5 / 6, rel=1e-9)
    assert found.link_force("stage.fit_1")[0, 5] == pytest.approx(RING_TORQUE / 6, rel=1e-9)


@pytest.mark.parametrize(
    "supports", [circle("-z"), circle("+z"), circle("-z", 0.5) + circle("+z", 0.5)]
)
def test_bolts_twist_a_rigid_ring_alike_wherever_they_are(tmp_path, supports):
    """θ = T / (n (k_t r² + k_twist)), n and k of all circles together."""
    found = rigid_state(stage(tmp_path, supports))
    expected = RING_TORQUE / (8 * (2e8 * 0.061**2 + 2e2))
    assert found.node("stage.ring", "bolt_01")[0, 5] == pytest.approx(expected, rel=1e-9)


def test_bolts_on_both_ends_carry_alike_and_do_not_tilt_a_spur_ring(tmp_path):
    found = rigid_state(stage(tmp_path, circle("-z", 0.5) + circle("+z", 0.5)))
    names = [f"bolt_{k:02d}" for k in range(1, 17)]
    force = np.array([found.link_force(f"stage.{name}")[0, :3] for name in names]).reshape(2, 8, 3)
    assert np.abs(force[0] - force[1] * [1, 1, -1]).max() < 1e-6 * np.abs(force).max()
    assert np.abs(found.node("stage.ring", "bolt_01")[0, 3:5]).max() < 1e-6 * RING_TORQUE / 1e6
    one = rigid_state(stage(tmp_path, circle("-z")))
    assert np.abs(one.node("stage.ring", "bolt_01")[0, 3:5]).max() < 1e-6 * RING_TORQUE / 1e6
    torque = (8 * 0.5 * 2e2 * found.node("stage.ring", "bolt_01")[0, 5] * 2) + 0.061 * force[
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
        ("", {}, "stage.ring.fe.bolts: nothing takes the ring's torque"),
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
            "[stage.ring.fe.bolts]\n" + BOLTS,
            {"stage.ring.fe.bolts.number": "x"},
            "stage.ring.fe.bolts.number: 'x' is not",
        ),
        (
            circle("+z"),
            {"stage.ring.fe.bolts.number": "4"},
            "stage.ring.fe.bolts.number: bolts is a list",
        ),
        (
            circle("+z") * 2,
            {"stage.ring.fe.bolts.1.end": "'-x'"},
            "stage.ring.fe.bolts.1.end: '-x' is unknown",
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
