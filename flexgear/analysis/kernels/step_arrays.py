"""Arrays of a compiled step: constants of step sizes, state, work space, samples."""

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
    """Constants of n modes for L step sizes."""

    h: Array  # (L,) rising, s
    omega2: Array  # (n,) rad²/s²
    damping: Array  # (n,) 2ζω, rad/s
    inverse: Array  # (L, n) D = 1/(1 + γ h d + β h² ω²)
    angles: Array  # (A, n) angles of the train by modal coordinates
    inputs: Array  # (F, n) independent rotations by modal coordinates
    frames: FrameData


class StepData(NamedTuple):
    """Constants of a run. The output is the last port."""

    modal: ModalData
    channels: Channels
    elements: Elements
    machines: Any  # (P,) MACHINE
    springs: EliminatedSprings


class State(NamedTuple):
    """State from step to step; arrays are updated in place."""

    eta: Array  # (n,)
    velocity: Array  # (n,)
    acceleration: Array  # (n,)
    memory: Array  # (places, 2, r) δ and δ̇ of elements at the last step; see ``contact_newton``
    active_flanks: NDArray[np.int64]  # (M,) 1 for flanks in the contact problem
    ports: Any  # (P,) PORT: torques, and states of controllers
    energy: Array  # (9,) in the order of ENERGIES, J
    energy_in: Array  # (1,) energy at the start plus absolute works of machines and loads, J


class ModalSpace(NamedTuple):
    """Work space in modes (n,), and for ports and angles."""

    free: Array  # motion under given torques, without contact forces and other machines
    free_rate: Array
    acceleration: Array  # of this motion
    push: Array  # acceleration by contact forces and machines
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
    closing_speed: Array  # (M,) largest recent approach speed of unloaded flanks, m/s
    error_rates: Array  # (M,) of the errors of gear meshes at the new time, m/s


class Samples(NamedTuple):
    """Arrays for a chunk of saved samples; the first axis is that of samples."""

    eta: Array  # (…, n)
    theta: Array  # (…, A) angles used for the pairs' geometry, rad
    input_motion: Array  # (…, F, 2) independent rotations, rad, and their speeds, rad/s
    torques: Array  # (…, P) external torques on the ports, N·m
    speeds: Array  # (…, P) of the ports, rad/s
    energy: Array  # (…, 9) J
    active_flanks: NDArray[np.int64]
    pairs: PairLoads


class Space(NamedTuple):
    """Work space of the steps of one run, and its energy balance."""

    work: Work
    ledger: Ledger
