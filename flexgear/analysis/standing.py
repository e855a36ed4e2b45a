"""Accelerations that agree with the forces of an instant: a time step of no duration.

Steps of average acceleration need the acceleration they start from. A step with h = 0 moves
nothing, D = 1 and G = R: it finds the contact forces of the motion as it is, hence accelerations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.energy import Ledger
from flexgear.analysis.kernel import advance
from flexgear.analysis.ladder import control
from flexgear.analysis.near import Near, begin
from flexgear.analysis.step_arrays import Samples, State, StepData, Work
from flexgear.coupling.pair_data import PairData, PairRows

Array = NDArray[np.float64]
NEVER = 2  # ticks between samples, of which one is taken


def at_rest(data: StepData) -> StepData:
    """The same system with a step of no duration as its only one."""
    return data._replace(
        h=np.zeros(1),
        inverse=np.ones((1, data.omega2.size)),
        displacement=data.residual[None],
    )


def no_samples(pairs: PairData) -> Samples:
    """Room for no sample."""
    several = np.zeros((0, len(pairs.s0), 1))
    return Samples(
        eta=np.zeros((0, 0)),
        theta=np.zeros((0, 0)),
        masters=several,
        torques=np.zeros((0, 0)),
        output_speed=np.zeros(0),
        pair_load=several,
        pair_tooth=several.astype(np.int16),
        pair_stiffness=several,
        pair_position=several,
        support_load=np.zeros((0, 0)),
        direction=several,
        energy=np.zeros((0, 0)),
        wanted=np.zeros((0, 0), dtype=np.int64),
    )


def accelerate(
    still: StepData,
    pairs: PairData,
    rows: PairRows,
    state: State,
    drive: Array,
    near: Near,
    work: Work,
    ledger: Ledger,
) -> int:
    """Set accelerations and stored forces by a step of no duration; ``near`` is ready for such.

    drive (P − 1,): given torques. Returns 0, or 1 without a solution.
    """
    status, _ = advance(
        still, pairs, rows, state, drive[None], NEVER, 0, no_samples(pairs), near, work, ledger,
        control(1),
    )  # fmt: skip
    return int(status)


def consistent_acceleration(
    data: StepData,
    pairs: PairData,
    rows: PairRows,
    state: State,
    drive: Array,
    near: Near,
    work: Work,
    ledger: Ledger,
) -> int:
    """Set accelerations (and stored forces) so that the equation of motion holds now.

    drive (P − 1,): given torques. A jump of the torque moves the quasi-static part at once; the
    ledger books it. Returns 0, or 1 without a solution. ``near`` is then ready for ``data``.
    """
    still = at_rest(data)
    begin(near, still)
    status = accelerate(still, pairs, rows, state, drive, near, work, ledger)
    begin(near, data)
    return status
