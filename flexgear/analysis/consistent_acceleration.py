"""Accelerations that agree with the forces of an instant: a time step of no duration.

Steps of average acceleration need the acceleration they start from. A step with h = 0 moves
nothing, D = 1 and G = R: it finds the contact forces of the motion as it is, hence accelerations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.refinement import control
from flexgear.analysis.kernels.step import advance
from flexgear.analysis.kernels.step_arrays import Space, State, StepData
from flexgear.analysis.step_space import begin, empty_samples
from flexgear.coupling.kernels.elements import law_functions
from flexgear.coupling.modal import ModalSystem

Array = NDArray[np.float64]
NEVER = 2  # ticks between samples, of which one is taken


def at_rest(data: StepData) -> StepData:
    """The same system with a step of no duration as its only one."""
    modal = data.modal._replace(h=np.zeros(1), inverse=np.ones((1, data.modal.omega2.size)))
    channels = data.channels._replace(displacement=data.channels.residual[None])
    return data._replace(modal=modal, channels=channels)


def accelerate(
    modal: ModalSystem, resting: StepData, state: State, prescribed: Array, space: Space
) -> int:
    """Set accelerations and stored forces by a step of no duration; ``space`` is ready for such.

    prescribed (P + L,): of the machines, rates rad/s² of given speeds, and of loads. Returns 0,
    or 1 without a solution.
    """
    status, _ = advance(
        resting, law_functions(modal.system.pairs), prescribed[None], 0, state, space,
        empty_samples(modal, 0), control(1, every=NEVER),
    )  # fmt: skip
    return int(status)


def consistent_acceleration(
    modal: ModalSystem, data: StepData, state: State, prescribed: Array, space: Space
) -> int:
    """Set accelerations (and stored forces) so that the equation of motion holds now.

    prescribed (P + L,): as of ``accelerate``. A jump of a torque moves the quasi-static part at
    once; the ledger books it. Returns 0, or 1 without a solution. ``space`` is then ready for
    ``data``.
    """
    resting = at_rest(data)
    begin(space, resting)
    status = accelerate(modal, resting, state, prescribed, space)
    begin(space, data)
    return status
