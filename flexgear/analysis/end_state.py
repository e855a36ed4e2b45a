"""What a transient hands on to one that starts from its end, as one vector.

Motion is kept in physical coordinates, as modes of equal frequency and their signs are those of one
computation alone: displacement, velocity and acceleration (d,) each; then what laws of elements
remember, flanks that are looked at, what machines carry on, and the account of energy.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from flexgear.analysis.kernels.contact_newton import first_memory
from flexgear.analysis.kernels.energy import ENERGIES
from flexgear.analysis.kernels.outer_forces import PORT
from flexgear.analysis.kernels.step_arrays import State
from flexgear.arrays import Array
from flexgear.coupling.modal import ModalSystem


@dataclass(frozen=True)
class CarriedState:
    """The state that a run starts from at a time, s."""

    state: State
    time: float


def packed_state(modal: ModalSystem, state: State) -> Array:
    """The vector (n,) of a state."""
    motion = [modal.modes @ part for part in (state.eta, state.velocity, state.acceleration)]
    ports = [state.ports[name] for name in PORT.names or ()]
    parts = [*motion, state.memory.ravel(), state.active_flanks, *ports]
    return np.concatenate([*parts, state.energy, state.energy_in])


def state_size(modal: ModalSystem) -> int:
    """Length of that vector."""
    return int(sum(_sizes(modal)))


def unpacked_state(modal: ModalSystem, values: Array) -> State:
    """The state of such a vector (n,), in the modes of this computation."""
    ends = np.cumsum([0, *_sizes(modal)])
    parts = [values[first:stop].copy() for first, stop in pairwise(ends)]
    project = modal.modes.T @ modal.system.mass
    eta, velocity, acceleration = (project @ part for part in parts[:3])
    memory = first_memory(modal.system.pairs, modal.system.rolling_rates)
    ports = np.zeros(len(modal.system.ports), dtype=PORT)
    for name, column in zip(PORT.names or (), parts[5:-2], strict=True):
        ports[name] = column
    return State(
        eta, velocity, acceleration,
        memory=parts[3].reshape(memory.shape),
        active_flanks=parts[4].astype(np.int64),
        ports=ports,
        energy=parts[-2],
        energy_in=parts[-1],
    )  # fmt: skip


def _sizes(modal: ModalSystem) -> list[int]:
    """Of the parts of the vector."""
    pairs, ports = modal.system.pairs, len(modal.system.ports)
    memory = first_memory(pairs, modal.system.rolling_rates).size
    columns = [ports] * len(PORT.names or ())
    return [*[modal.modes.shape[0]] * 3, memory, len(pairs.s0), *columns, len(ENERGIES), 1]
