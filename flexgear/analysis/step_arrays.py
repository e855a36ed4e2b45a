"""Arrays that a compiled step works on: constants of step sizes, state, work space, samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class StepData(NamedTuple):
    """Constant arrays of L step sizes; n modes, n_c channels: 6 a block, P ports, 3 a gear mesh
    along its line of action; the last two are the head."""

    h: Array  # (L,) rising
    omega2: Array  # (n,)
    damping: Array  # (n,) 2ζω
    inverse: Array  # (L, n) D
    angles: Array  # (A, n)
    masters: Array  # (F, n)
    gyroscopic: Array  # (n, n) or (0, 0)
    centripetal: Array  # (n, n) or (0, 0)
    ports: int  # P, the braked one last
    head: int
    output: int  # channel of the braked port
    channel_modes: Array  # (n_c, n)
    residual: Array  # (n_c, n_c)
    displacement: Array  # (L, n_c, n_c) G
    brake_torque: float
    brake_speed: float
    brake_exponent: float


class State(NamedTuple):
    """What a step carries on; arrays are updated in place."""

    eta: Array  # (n,)
    velocity: Array  # (n,)
    acceleration: Array  # (n,)
    load: Array  # (M, PLACES) of rows at the last step, N; see ``contact_law.place_of``
    limited: NDArray[np.uint8]  # (M, PLACES) rows in the limited state
    wanted: NDArray[np.int64]  # (M,) gear meshes to look at
    torques: Array  # (P,) given torques and the brake's of the last step
    energy: Array  # (8,) in the order of ENERGIES
    given: Array  # (1,) energy that the train began with and that given torques moved, J


class Work(NamedTuple):
    """Work space of a step; R rows with room for one more unknown, n modes in whole cache lines."""

    matrix: Array  # (R, R)
    small: Array  # (R, R)
    right: Array  # (R,)
    x: Array  # (R,)
    delta: Array  # (R,)
    rate: Array  # (R,)
    stiffness: Array  # (R,) of the contact law
    damping: Array  # (R,)
    share: Array  # (R,)
    active: NDArray[np.int64]  # (R,)
    theta: Array  # (A,)
    torques: Array  # (P,)
    acceleration: Array  # (n,)
    free: Array  # (n,)
    free_v: Array  # (n,)
    push: Array  # (n,)
    turning: Array  # (n,)
    error: Array  # (n,)
    motion: Array  # (6 n_blocks,)
    back_speed: Array  # (M,) largest approach speed of back flanks of late, m/s


class Samples(NamedTuple):
    """Where a chunk of saved samples goes, (n_saved, …)."""

    eta: Array
    theta: Array  # (…, A) angles used for the pairs' geometry
    masters: Array  # (…, F, 2) independent rotations and their speeds
    torques: Array  # (…, P) given torques, and the brake's
    output_speed: Array
    pair_load: Array  # (…, M, SLOTS)
    pair_tooth: NDArray[np.int16]
    pair_stiffness: Array
    pair_position: Array
    support_load: Array  # (…, extra rows)
    direction: Array  # (…, n_c, 3)
    energy: Array  # (…, 8)
    wanted: NDArray[np.int64]
