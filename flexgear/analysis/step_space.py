"""What the steps of a run work with: constants of its step sizes, and work space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.energy import ENERGIES, Ledger
from flexgear.analysis.kernel import BETA, GAMMA
from flexgear.analysis.near import Near, head_size, near_channels
from flexgear.analysis.near_products import whole_lines
from flexgear.analysis.step_arrays import Samples, StepData, Work
from flexgear.analysis.wide import aligned
from flexgear.coupling.action_lines import action_lines
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import SLOTS, PairRows, extra_rows, pair_rows

Array = NDArray[np.float64]


def step_data(modal: ModalSystem, sizes: float | Array) -> StepData:
    """Constant arrays of one step size or a ladder of them (s): modal factors, receptances."""
    h = np.atleast_1d(np.asarray(sizes, dtype=float))
    omega2, brake, ports = modal.omega**2, modal.system.brake, len(modal.system.ports)
    blocks = len(modal.channels) - ports
    lines = action_lines(modal.system.pairs, blocks // 6)
    head = head_size(modal)
    lines = np.pad(lines, ((0, head - ports - len(lines)), (0, 0)))  # nothing moves the rest
    p = np.vstack([modal.channel_modes, lines @ modal.channel_modes[:blocks]])
    across = lines @ modal.residual[:blocks]
    residual = np.block([[modal.residual, across.T], [across, across[:, :blocks] @ lines.T]])
    inverse = 1.0 / (1.0 + GAMMA * h[:, None] * modal.damping + BETA * h[:, None] ** 2 * omega2)
    displacement = np.empty((len(h), *residual.shape))
    for r, size in enumerate(h):
        np.matmul(p * (BETA * size**2 * inverse[r]), p.T, out=displacement[r])
        displacement[r] += residual
    return StepData(
        h=h,
        omega2=omega2,
        damping=modal.damping,
        inverse=inverse,
        angles=modal.angles,
        masters=modal.masters,
        gyroscopic=modal.gyroscopic,
        centripetal=modal.centripetal,
        ports=ports,
        head=head,
        output=blocks + ports - 1,
        channel_modes=np.ascontiguousarray(p),
        residual=residual,
        displacement=displacement,
        brake_torque=brake.rated_torque,
        brake_speed=brake.rated_speed,
        brake_exponent=brake.exponent,
    )


@dataclass(frozen=True)
class Space:
    """Work space of the steps of one run; arrays are overwritten."""

    rows: PairRows
    near: Near
    work: Work
    ledger: Ledger


def work_space(modal: ModalSystem, track_energy: bool = False, sizes: int = 1) -> Space:
    """Empty work space for so many step sizes, with the account of energy or without."""
    rows = pair_rows(modal.system.pairs)
    count, n = len(rows.kind), whole_lines(modal.modes.shape[1])
    blocks = len(modal.system.blocks) // 6
    size, ports = whole_lines(count + 2), len(modal.system.ports)
    near = near_channels(modal, rows.blocks.shape[0], rows.blocks.shape[1], sizes)
    work = Work(
        **{name: aligned(size, size) for name in ("matrix", "small")},
        **{
            name: np.zeros(size)
            for name in (
                "right",
                "x",
                "delta",
                "rate",
                "stiffness",
                "damping",
                "share",
            )
        },
        active=np.zeros(size, dtype=np.int64),
        theta=np.zeros(len(modal.angles)),
        torques=np.zeros(ports),
        **{
            name: aligned(n)
            for name in ("acceleration", "free", "free_v", "push", "turning", "error")
        },
        motion=np.zeros(6 * blocks),
        back_speed=np.zeros(len(modal.system.pairs.s0)),
    )
    ledger = Ledger(
        rows=pair_rows(modal.system.pairs),
        booked=np.full(1 if track_energy else 0, -1, dtype=np.int64),
        at=np.zeros(rows.blocks.shape, dtype=np.int64),
        damping_load=np.zeros(count),
        fresh=np.zeros(count),
        row_now=np.zeros(count),
        row_old=np.zeros(count),
    )
    return Space(rows, near, work, ledger)


def empty_samples(modal: ModalSystem, count: int) -> Samples:
    """Where so many saved samples go; no pair is in contact."""
    pairs = modal.system.pairs
    meshes, system = len(pairs.s0), modal.system
    shape = (count, meshes, SLOTS)
    return Samples(
        eta=np.zeros((count, modal.modes.shape[1])),
        theta=np.zeros((count, len(system.angles))),
        masters=np.zeros((count, len(system.masters), 2)),
        torques=np.zeros((count, len(system.ports))),
        output_speed=np.zeros(count),
        pair_load=np.zeros(shape),
        pair_tooth=np.full(shape, -1, dtype=np.int16),
        pair_stiffness=np.zeros(shape),
        pair_position=np.zeros(shape),
        support_load=np.zeros((count, extra_rows(pairs))),
        direction=np.zeros((count, len(pairs.clearance_stiffness), 3)),
        energy=np.zeros((count, len(ENERGIES))),
        wanted=np.zeros((count, meshes), dtype=np.int64),
    )
