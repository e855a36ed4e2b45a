"""What the steps of a run work with: constants of its step sizes, and work space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.active_dofs import active_dofs, channels, dof_vectors
from flexgear.analysis.kernels.contact_newton import contact_problem, law_space
from flexgear.analysis.kernels.energy import BOOKED, ENERGIES, Ledger
from flexgear.analysis.kernels.frame_forces import frame_data
from flexgear.analysis.kernels.machines import packed_machines, port_space
from flexgear.analysis.kernels.pair_loads import empty_pair_loads
from flexgear.analysis.kernels.step import BETA, GAMMA
from flexgear.analysis.kernels.step_arrays import (
    ModalData,
    ModalSpace,
    Samples,
    Space,
    StepData,
    Work,
)
from flexgear.analysis.kernels.vectors import aligned, rounded_up
from flexgear.coupling.kernels.elements import packed, pair_rows, widest
from flexgear.coupling.modal import ModalSystem

Array = NDArray[np.float64]


def step_data(modal: ModalSystem, sizes: float | Array) -> StepData:
    """Constant arrays of one step size or several (s): modal factors, receptances, elements."""
    h = np.atleast_1d(np.asarray(sizes, dtype=float))
    omega2 = modal.omega**2
    inverse = 1.0 / (1.0 + GAMMA * h[:, None] * modal.damping + BETA * h[:, None] ** 2 * omega2)
    return StepData(
        modal=ModalData(
            h=h,
            omega2=omega2,
            damping=modal.damping,
            inverse=inverse,
            angles=modal.angles,
            inputs=modal.input_rows,
            frames=frame_data(modal),
        ),
        channels=channels(modal, h, inverse, BETA),
        elements=packed(modal.system.pairs),
        machines=packed_machines(modal.system),
    )


def work_space(modal: ModalSystem, track_energy: bool = False, sizes: int = 1) -> Space:
    """Empty work space for so many step sizes, with the account of energy or without."""
    pairs, active = modal.system.pairs, active_dofs(modal, sizes)
    ports = len(modal.system.ports)
    rows, last = pair_rows(pairs, ports), pair_rows(pairs, ports)
    count, n = len(rows.row), rounded_up(modal.modes.shape[1])
    angles = np.zeros(len(modal.angles))
    free, free_rate, acceleration, push, rotating, spare = aligned(6, n)
    space = ModalSpace(
        free, free_rate, acceleration, push, rotating, spare, angles, port_space(ports)
    )
    work = Work(
        modes=space,
        rows=rows,
        active=active,
        dofs=dof_vectors(active),
        problem=contact_problem(count),
        space=law_space(len(rows.element), widest(pairs)),
        closing_speed=np.zeros(len(pairs.s0)),
    )
    booked = np.zeros(1, dtype=BOOKED)
    booked["tracked"], booked["rows"] = int(track_energy), -1
    ledger = Ledger(
        booked=booked,
        rows=last,
        lost=np.zeros((3, count)),
        now=np.zeros((2, count)),
        before=np.zeros((2, count)),
        delta=np.zeros(count),
        force=np.zeros(len(modal.channels) + 3 * len(pairs.s0)),
    )
    return Space(work, ledger)


def begin(space: Space, data: StepData) -> None:
    """Make the ports of other constants the only active dofs; a step gathers what else it needs."""
    active = space.work.active
    counts = active.counts[0]
    ports = 6 * counts["blocks"] + np.arange(counts["ports"])
    active.place[:], active.gathered[:], counts["dofs"], counts["fresh"] = -1, 0, len(ports), 1
    active.channel[: len(ports)] = ports
    active.modes[: len(ports)] = data.channels.modes[ports]
    active.span[: len(ports)] = data.channels.span[ports]


def empty_samples(modal: ModalSystem, count: int) -> Samples:
    """Where so many saved samples go; no pair is in contact."""
    system = modal.system
    return Samples(
        eta=np.zeros((count, modal.modes.shape[1])),
        theta=np.zeros((count, len(system.angles))),
        input_motion=np.zeros((count, len(system.input_rows), 2)),
        torques=np.zeros((count, len(system.ports))),
        speeds=np.zeros((count, len(system.ports))),
        energy=np.zeros((count, len(ENERGIES))),
        active_flanks=np.zeros((count, len(system.pairs.s0)), dtype=np.int64),
        pairs=empty_pair_loads(system.pairs, count),
    )
