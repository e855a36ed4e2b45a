"""Hu et al. 2023: the plain equations by themselves."""

import numpy as np
import pytest

from hu2023.equations import PLANETS, Drive, matrices, stage_rows

DRIVE = Drive()  # printed tables; what is not printed is 1


@pytest.mark.parametrize("j", [1, 2])
def test_forces_of_the_equations_balance(j: int) -> None:
    """Moving sun, planets and carrier together deflects sun gear meshes and bearings not at all."""
    stage = DRIVE.stages[j]
    gear, bearing = stage_rows(stage)
    for turn in (0.0, np.pi / 2):
        q = np.zeros(stage.size)
        q[1:3] = q[-2:] = np.cos(turn), np.sin(turn)
        for i, phi in enumerate(DRIVE.angles):
            q[3 + 3 * i + 1 : 3 + 3 * i + 3] = np.cos(turn - phi), np.sin(turn - phi)
        assert np.abs(gear[:PLANETS] @ q).max() < 1e-12
        assert np.abs(bearing @ q).max() < 1e-12


def test_torque_arrives_at_the_last_carrier() -> None:
    """Reaction of the last spline times r_c is the ratio times the torque, within the rounding of
    the printed working angles."""
    q0 = matrices(DRIVE).statics()[0]
    last = DRIVE.stages[-1]
    reaction = last.spline * q0[DRIVE.carrier(2)] * last.center_distance
    assert reaction == pytest.approx(DRIVE.torque(2) * last.ratio, rel=5e-4)


def test_as_printed_a_planet_would_pass_no_torque_to_the_carrier() -> None:
    """+η at the ring, as in eq. 3: sun and ring forces almost cancel on the carrier."""
    stage = DRIVE.stages[1]
    gear, _ = stage_rows(stage)
    eta = gear[:, 3 + 2]
    aw, an = stage.angles
    right, wrong = -eta[0] - eta[PLANETS], -eta[0] + eta[PLANETS]
    assert right == pytest.approx(np.cos(aw) + np.cos(an))
    assert abs(wrong) < 0.03 * right
