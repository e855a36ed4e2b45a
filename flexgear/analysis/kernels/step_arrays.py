"""Arrays that a compiled step works on: constants of step sizes, state, work space, samples."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.active_dofs import ActiveDofs, Channels, DofVectors
from flexgear.analysis.kernels.contact_newton import ContactProblem, LawSpace
from flexgear.analysis.kernels.eliminated_springs import EliminatedSprings
from flexgear.analysis.kernels.energy import Ledger
from flexgear.analysis.kernels.outer_forces import FrameData, PortSpace
from flexgear.analysis.kernels.samples import PairLoads
from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import Elements, Rows


class ModalData(NamedTuple):
    """Modal constants of L step sizes; n modes."""

    h: Array  # (L,) rising, s
    omega2: Array  # (n,) rad²/s²
    damping: Array  # (n,) 2ζω, rad/s
    inverse: Array  # (L, n) D
    angles: Array  # (A, n)
    inputs: Array  # (F, n) independent rotations
    frames: FrameData


class StepData(NamedTuple):
    """What does not change in a run. The output is the last port."""

    modal: ModalData
    channels: Channels
    elements: Elements
    machines: Any  # (P,) MACHINE
    springs: EliminatedSprings


class State(NamedTuple):
    """What a step carries on; arrays are updated in place."""

    eta: Array  # (n,)
    velocity: Array  # (n,)
    acceleration: Array  # (n,)
    memory: Array  # (places, 2, r) δ and δ̇ of elements at the last step; see ``contact_newton``
    active_flanks: NDArray[np.int64]  # (M,) gear meshes to look at
    ports: Any  # (P,) PORT: torque, and what a controller carries on
    energy: Array  # (9,) in the order of ENERGIES
    energy_in: Array  # (1,) energy that the train began with and that machines and loads moved, J


class ModalSpace(NamedTuple):
    """Work space in modes (n,) and at ports and angles."""

    free: Array  # motion without contact forces and machines but given torques
    free_rate: Array
    acceleration: Array  # and its acceleration
    push: Array  # what contact forces and machines add to it
    rotating: Array  # G v − C q of a rotating frame
    spare: Array
    theta: Array  # (A,) angles of the new time
    speeds: Array  # (A,) of these angles, rad/s
    ports: PortSpace


class Work(NamedTuple):
    """Work space of a step."""

    modes: ModalSpace
    rows: Rows
    active: ActiveDofs
    dofs: DofVectors
    problem: ContactProblem
    space: LawSpace
    closing_speed: Array  # (M,) largest approach speed of unloaded flanks of late, m/s
    error_rates: Array  # (M,) of the errors of gear meshes at the new time, m/s


class Samples(NamedTuple):
    """Where a chunk of saved samples goes, (n_saved, …)."""

    eta: Array
    theta: Array  # (…, A) angles used for the pairs' geometry
    input_motion: Array  # (…, F, 2) independent rotations and their speeds
    torques: Array  # (…, P) from outside on the ports
    speeds: Array  # (…, P) of the ports
    energy: Array  # (…, 9)
    active_flanks: NDArray[np.int64]
    pairs: PairLoads


class Space(NamedTuple):
    """Work space of the steps of one run, and its account of energy."""

    work: Work
    ledger: Ledger
