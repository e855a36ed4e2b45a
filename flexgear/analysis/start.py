"""Initial state of a transient: static equilibrium plus rigid-body rotation, machines in balance.

Speeds of the F independent rotations: ports with a given or a controlled speed turn at theirs; what
is left of the motion keeps its rated proportion, at the size at which a brake takes the torque that
equilibrium asks of it. Torques: ports of given torque have theirs, brakes what their law says at
that speed, and F ports hold the balance; a controller's integral starts at its share.

What a transient hands on to one that starts from its end, as one vector.

Motion is kept in physical coordinates, as modes of equal frequency and their signs are those of one
computation alone: displacement, velocity and acceleration (d,) each; then what laws of elements
remember, flanks that are looked at, what machines carry on, and the account of energy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from flexgear.analysis.equilibrium import Equilibrium, revolution
from flexgear.analysis.kernels.contact_newton import first_memory
from flexgear.analysis.kernels.energy import ENERGIES
from flexgear.analysis.kernels.outer_forces import PORT, brake_torque
from flexgear.analysis.kernels.step_arrays import State
from flexgear.analysis.step_space import packed_machines, rated_row
from flexgear.arrays import Array
from flexgear.coupling.machines import Brake, Controller, GivenSpeed
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.system import System

STEADY = 1e-9  # of the speeds, by which they may still change
AGREES = 1e-12  # of the torques of brakes that hold no balance, found in turns with the speeds

_BRAKE_TORQUE = getattr(brake_torque, "py_func", brake_torque)  # not compiled for one call


def start_state(modal: ModalSystem, prescribed: float | Array) -> State:
    """Equilibrium at zero angle plus rigid-body rotation at the speeds that the machines require.

    prescribed: torque of the first port, the others then as rated, or (P,) the prescribed value of
    every machine (``transient.Drive``).
    """
    system = modal.system
    ends = np.asarray(prescribed, dtype=float)
    ends = system.proportional_torques(ends[None])[0] if ends.ndim == 0 else ends
    held = replace(modal, system=_balanced(system))
    speeds, settled = _given_speeds(system, ends, 1.0), False
    while not settled:
        torques, share = _known_torques(held.system, ends, speeds), _share(modal, speeds)
        turning = replace(held, system=_at_speed(held.system, share, speeds))
        at_rest = revolution(turning, 0.0, torques[None])
        before, speeds = speeds, _speeds(held.system, ends, at_rest.torques[0])
        known_torques = _known_torques(held.system, ends, speeds)
        settled = bool(
            np.abs(known_torques - torques).max() <= AGREES * np.abs(known_torques).max()
        )
        settled = settled and abs(_share(modal, speeds) - share) <= AGREES * abs(share)
        # laws of bearings may take torque that depends on speed
        settled = settled and np.abs(speeds - before).max() <= STEADY * np.abs(speeds).max()
    velocity = modal.rolling @ speeds
    return State(
        eta=at_rest.eta[0].copy(),
        velocity=velocity,
        acceleration=np.zeros(modal.modes.shape[1]),
        memory=first_memory(system.pairs, turning.system.rolling_rates),
        active_flanks=at_rest.active_flanks[0].copy(),
        ports=_ports(system, ends, at_rest.torques[0], _port_rolling(system) @ speeds),
        energy=np.zeros(len(ENERGIES)),
        energy_in=np.array([_first_energy(modal, at_rest, velocity)]),
    )


def _port_rolling(system: System) -> Array:
    """Rotation (P, F) of the ports per radian of each independent rotation."""
    return np.asarray(system.port_rows @ system.rolling)


def _follow_speed(system: System) -> list[int]:
    """Ports with a given or controlled speed."""
    kinds = (GivenSpeed, Controller)
    return [p for p, machine in enumerate(system.machines) if isinstance(machine, kinds)]


def _balanced(system: System) -> System:
    """The system with those ports as reactions whose torque is free at the start: first those with
    a speed, then brakes, then those that are reactions at rated load."""
    follows_speed, turns = _follow_speed(system), _port_rolling(system)
    brakes = [p for p, machine in enumerate(system.machines) if isinstance(machine, Brake)]
    chosen: list[int] = []
    for p in dict.fromkeys([*follows_speed, *reversed(brakes), *system.reactions]):
        if np.linalg.matrix_rank(turns[[*chosen, p]]) > len(chosen):
            chosen.append(p)
    ports = tuple(replace(x, reaction=p in chosen) for p, x in enumerate(system.ports))
    return system.with_(ports=ports)


def _given_speeds(system: System, prescribed: Array, share: float) -> Array:
    """Speeds (F,), prescribed where ports follow a speed, else ``share`` of the rated ones."""
    follows_speed, rated = _follow_speed(system), share * system.rated_input_speeds
    if not follows_speed:
        return np.asarray(rated)
    turns = _port_rolling(system)[follows_speed]
    return np.asarray(rated + np.linalg.pinv(turns) @ (prescribed[follows_speed] - turns @ rated))


def _speeds(system: System, prescribed: Array, torques: Array) -> Array:
    """Speeds (F,) as of ``_given_speeds``, with the share at which the last brake among the
    reactions has its equilibrium torque."""
    turns = _port_rolling(system)
    for p in reversed(system.reactions):
        machine = system.machines[p]
        braked_speed = machine.speed(-torques[p]) if isinstance(machine, Brake) else None
        if braked_speed is None:
            continue
        none, all_of_it = (turns[p] @ _given_speeds(system, prescribed, x) for x in (0.0, 1.0))
        if abs(all_of_it - none) > AGREES * abs(turns[p] @ system.rated_input_speeds):
            return _given_speeds(system, prescribed, (braked_speed - none) / (all_of_it - none))
    return _given_speeds(system, prescribed, 1.0)


def _share(modal: ModalSystem, speeds: Array) -> float:
    """Share of rated speed, where loads depend on it; else 1."""
    if not modal.system.pairs.load_grows.any():
        return 1.0
    return float(rated_row(modal) @ modal.rolling @ speeds)


def _at_speed(system: System, share: float, speeds: Array) -> System:
    """The system at speeds (F,), with loads proportional to the square of speed at a share of the
    rated one."""
    pairs = system.pairs
    scale = np.where(pairs.load_grows == 1, share**2, 1.0)
    scaled = pairs._replace(load_vector=pairs.load_vector * scale[:, None])
    return system.with_(pairs=scaled, input_speeds=tuple(speeds.tolist()))


def _known_torques(system: System, prescribed: Array, speeds: Array) -> Array:
    """Torques (P,) of ports that follow one, and at these speeds of brakes that are no reactions,
    N·m."""
    out, turned = prescribed.copy(), _port_rolling(system) @ speeds
    records = packed_machines(system).view(np.recarray)
    for p, machine in enumerate(system.machines):
        if isinstance(machine, Brake) and p not in system.reactions:
            out[p] = -_BRAKE_TORQUE(records[p], turned[p])[0]
    return out


def _ports(system: System, prescribed: Array, torques: Array, speeds: Array) -> Any:
    """State (P,) PORT of controllers for which the start is stationary."""
    out = np.zeros(len(system.ports), dtype=PORT)
    for p, machine in enumerate(system.machines):
        if isinstance(machine, Controller):
            out[p]["error"] = prescribed[p] - speeds[p]
            out[p]["integral"] = torques[p] - machine.proportional * out[p]["error"]
    return out


def _first_energy(modal: ModalSystem, equilibrium: Equilibrium, velocity: Array) -> float:
    """Energy of an equilibrium and of its speed, at least the rated one, J."""
    rated = modal.rolling @ modal.system.rated_input_speeds
    kinetic = 0.5 * max(float(velocity @ velocity), float(rated @ rated))
    elastic = 0.5 * float(np.sum((modal.omega * equilibrium.eta[0]) ** 2))
    stiffness = np.where(equilibrium.pair_stiffness[0] > 0, equilibrium.pair_stiffness[0], np.inf)
    return kinetic + elastic + 0.5 * float(np.sum(equilibrium.pair_load[0] ** 2 / stiffness))


@dataclass(frozen=True)
class CarriedState:
    """State at a time, s, from which a run starts."""

    state: State
    time: float


def packed_state(modal: ModalSystem, state: State) -> Array:
    """The state as one vector (n,)."""
    motion = [modal.modes @ part for part in (state.eta, state.velocity, state.acceleration)]
    ports = [state.ports[name] for name in PORT.names or ()]
    parts = [*motion, state.memory.ravel(), state.active_flanks, *ports]
    return np.concatenate([*parts, state.energy, state.energy_in])


def state_size(modal: ModalSystem) -> int:
    """Length n of that vector."""
    return int(sum(_sizes(modal)))


def unpacked_state(modal: ModalSystem, values: Array) -> State:
    """The state from such a vector (n,), in the modes of this computation."""
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
    """Lengths of the parts of the vector."""
    pairs, ports = modal.system.pairs, len(modal.system.ports)
    memory = first_memory(pairs, modal.system.rolling_rates).size
    columns = [ports] * len(PORT.names or ())
    return [*[modal.modes.shape[0]] * 3, memory, len(pairs.s0), *columns, len(ENERGIES), 1]
