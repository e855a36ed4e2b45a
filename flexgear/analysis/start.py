"""Initial state of a transient, and its state as a vector from which another transient continues.

**Initial state**: static equilibrium plus rigid rotation of the train, with all machines in
equilibrium. Speeds of the F independent rotations: ports of given or controlled speed have that
speed; the rest of the motion has rated proportions and the size at which a brake has its torque of
equilibrium. Torques: ports of given torque have that torque, brakes the one of their law at this
speed, and F ports have the torque that balances the train; the integral of a controller is set
accordingly.

**State vector**: displacement, velocity and acceleration (d,) in physical coordinates, as signs and
bases of modes differ between computations; then the memory of the laws of elements, active flanks,
states of the machines, and the energy balance.
"""

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

SPEED_TOLERANCE = 1e-9  # relative change of speeds in the last iteration
TOLERANCE = 1e-12  # relative change of brake torques and of the share of rated speed

_BRAKE_TORQUE = getattr(brake_torque, "py_func", brake_torque)  # uncompiled, for a single call


def start_state(modal: ModalSystem, prescribed: float | Array) -> State:
    """Equilibrium at zero angle plus rigid rotation at the speeds that the machines require.

    prescribed: torque of the first port, N·m, the others in rated proportion; or the prescribed
    values (P,) of all machines (``transient.Drive``).

    Speeds s at which equilibria ask for the speeds g(s) = s: Aitken's relaxation s + ω r with r =
    g(s) − s, ω ← −ω r·Δr/Δr² (Irons and Tuck 1969), as g falls steeply where drag is large beside
    the brake.
    """
    system = modal.system
    values = np.asarray(prescribed, dtype=float)
    values = system.proportional_torques(values[None])[0] if values.ndim == 0 else values
    balanced = replace(modal, system=_balanced(system))
    speeds, converged = _given_speeds(system, values, 1.0), False
    relaxation, residual = 1.0, np.zeros(len(speeds))
    while not converged:
        torques, share = _known_torques(balanced.system, values, speeds), _share(modal, speeds)
        turning = replace(balanced, system=_at_speed(balanced.system, share, speeds))
        equilibrium = revolution(turning, 0.0, torques[None])
        aim, last = _speeds(balanced.system, values, equilibrium.torques[0]), residual
        residual = aim - speeds
        if last.any() and (change := residual - last).any():
            relaxation *= -float(last @ change) / float(change @ change)
        before, speeds = speeds, aim + (relaxation - 1.0) * residual
        new_torques = _known_torques(balanced.system, values, speeds)
        converged = bool(
            np.abs(new_torques - torques).max() <= TOLERANCE * np.abs(new_torques).max()
            and abs(_share(modal, speeds) - share) <= TOLERANCE * abs(share)
            # torques of bearings may depend on speed
            and np.abs(speeds - before).max() <= SPEED_TOLERANCE * np.abs(speeds).max()
        )
    velocity = modal.rolling @ speeds
    return State(
        eta=equilibrium.eta[0].copy(),
        velocity=velocity,
        acceleration=np.zeros(modal.modes.shape[1]),
        memory=first_memory(system.pairs, turning.system.rolling_rates),
        active_flanks=equilibrium.active_flanks[0].copy(),
        ports=_ports(system, values, equilibrium.torques[0], _port_rolling(system) @ speeds),
        energy=np.zeros(len(ENERGIES)),
        energy_in=np.array([_first_energy(modal, equilibrium, velocity)]),
    )


def _port_rolling(system: System) -> Array:
    """Rotations (P, F) of the ports per radian of each independent rotation."""
    return np.asarray(system.port_rows @ system.rolling)


def _speed_ports(system: System) -> list[int]:
    """Numbers of the ports with a given or controlled speed."""
    kinds = (GivenSpeed, Controller)
    return [p for p, machine in enumerate(system.machines) if isinstance(machine, kinds)]


def _balanced(system: System) -> System:
    """The system with F reactions for the start: first ports of given or controlled speed, then
    brakes, then reactions at rated load."""
    rotations = _port_rolling(system)
    brakes = [p for p, machine in enumerate(system.machines) if isinstance(machine, Brake)]
    reactions: list[int] = []
    for p in dict.fromkeys([*_speed_ports(system), *reversed(brakes), *system.reactions]):
        if np.linalg.matrix_rank(rotations[[*reactions, p]]) > len(reactions):
            reactions.append(p)
    ports = tuple(replace(x, reaction=p in reactions) for p, x in enumerate(system.ports))
    return system.with_(ports=ports)


def _given_speeds(system: System, prescribed: Array, share: float) -> Array:
    """Speeds (F,), rad/s: those prescribed at ports, the rest ``share`` of rated speed."""
    ports, rated = _speed_ports(system), share * system.rated_input_speeds
    rotations = _port_rolling(system)[ports]
    return np.asarray(rated + np.linalg.pinv(rotations) @ (prescribed[ports] - rotations @ rated))


def _speeds(system: System, prescribed: Array, torques: Array) -> Array:
    """Speeds (F,) of ``_given_speeds`` with the share at which the last brake among the reactions
    has its torque of equilibrium; torques (P,): of the equilibrium, N·m."""
    rotations = _port_rolling(system)
    for p in reversed(system.reactions):
        machine = system.machines[p]
        braked_speed = machine.speed(-torques[p]) if isinstance(machine, Brake) else None
        if braked_speed is None:
            continue
        low, high = (rotations[p] @ _given_speeds(system, prescribed, x) for x in (0.0, 1.0))
        if abs(high - low) > TOLERANCE * abs(rotations[p] @ system.rated_input_speeds):
            return _given_speeds(system, prescribed, (braked_speed - low) / (high - low))
    return _given_speeds(system, prescribed, 1.0)


def _share(modal: ModalSystem, speeds: Array) -> float:
    """Share of rated speed in speeds (F,), if loads depend on speed; else 1."""
    if not modal.system.pairs.load_grows.any():
        return 1.0
    return float(rated_row(modal) @ modal.rolling @ speeds)


def _at_speed(system: System, share: float, speeds: Array) -> System:
    """The system at speeds (F,), rad/s, with loads that grow with speed² at a share of rated."""
    pairs = system.pairs
    scale = np.where(pairs.load_grows == 1, share**2, 1.0)
    scaled = pairs._replace(load_vector=pairs.load_vector * scale[:, None])
    return system.with_(pairs=scaled, input_speeds=tuple(speeds.tolist()))


def _known_torques(system: System, prescribed: Array, speeds: Array) -> Array:
    """Torques (P,), N·m: given ones, and of brakes that are no reactions those at speeds (F,)."""
    out, port_speeds = prescribed.copy(), _port_rolling(system) @ speeds
    records = packed_machines(system).view(np.recarray)
    for p, machine in enumerate(system.machines):
        if isinstance(machine, Brake) and p not in system.reactions:
            out[p] = -_BRAKE_TORQUE(records[p], port_speeds[p])[0]
    return out


def _ports(system: System, prescribed: Array, torques: Array, speeds: Array) -> Any:
    """States (P,) PORT of the ports, with the integrals of controllers for a stationary start;
    torques N·m, speeds rad/s (P,)."""
    out = np.zeros(len(system.ports), dtype=PORT)
    for p, machine in enumerate(system.machines):
        if isinstance(machine, Controller):
            out[p]["error"] = prescribed[p] - speeds[p]
            out[p]["integral"] = torques[p] - machine.proportional * out[p]["error"]
    return out


def _first_energy(modal: ModalSystem, equilibrium: Equilibrium, velocity: Array) -> float:
    """Elastic energy of an equilibrium and kinetic energy, at least that of rated speed, J."""
    rated = modal.rolling @ modal.system.rated_input_speeds
    kinetic = 0.5 * max(float(velocity @ velocity), float(rated @ rated))
    elastic = 0.5 * float(np.sum((modal.omega * equilibrium.eta[0]) ** 2))
    stiffness = np.where(equilibrium.pair_stiffness[0] > 0, equilibrium.pair_stiffness[0], np.inf)
    return kinetic + elastic + 0.5 * float(np.sum(equilibrium.pair_load[0] ** 2 / stiffness))


@dataclass(frozen=True)
class CarriedState:
    """The state from which a run starts, and its time, s."""

    state: State
    time: float


def packed_state(modal: ModalSystem, state: State) -> Array:
    """The state as one vector (n,)."""
    motion = [modal.modes @ part for part in (state.eta, state.velocity, state.acceleration)]
    ports = [state.ports[name] for name in PORT.names or ()]
    parts = [*motion, state.memory.ravel(), state.active_flanks, *ports]
    return np.concatenate([*parts, state.energy, state.energy_in])


def state_size(modal: ModalSystem) -> int:
    """Length n of the vector of ``packed_state``."""
    return int(sum(_sizes(modal)))


def unpacked_state(modal: ModalSystem, values: Array) -> State:
    """The state from a vector (n,) of ``packed_state``, in the modes of ``modal``."""
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
    """Lengths of the parts of the vector of ``packed_state``."""
    pairs, ports = modal.system.pairs, len(modal.system.ports)
    memory = first_memory(pairs, modal.system.rolling_rates).size
    columns = [ports] * len(PORT.names or ())
    return [*[modal.modes.shape[0]] * 3, memory, len(pairs.s0), *columns, len(ENERGIES), 1]
