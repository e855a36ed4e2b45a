"""Data of the steps of a run: constants of its step sizes, work space, accelerations.

Steps of average acceleration need the acceleration they start from. A step with h = 0 moves
nothing, D = 1 and G = R: it finds the contact forces of the motion as it is, hence accelerations.

Springs in turning frames between bodies whose receptances are the same at every angle.

They are worked out at some angles; where all agree, a step eliminates the springs from its contact
problem (``kernels.eliminated_springs``), else they stay rows of it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from flexgear.analysis.kernels.active_dofs import AT_ONCE, COUNTS, ActiveDofs, Channels, DofVectors
from flexgear.analysis.kernels.contact_newton import contact_problem, law_space
from flexgear.analysis.kernels.eliminated_springs import EliminatedSprings, no_springs
from flexgear.analysis.kernels.energy import BOOKED, ENERGIES, Ledger
from flexgear.analysis.kernels.outer_forces import (
    BRAKE,
    CONTROLLER,
    MACHINE,
    SPEED,
    FrameData,
    port_space,
)
from flexgear.analysis.kernels.refinement import control
from flexgear.analysis.kernels.samples import empty_pair_loads
from flexgear.analysis.kernels.step import BETA, GAMMA, advance
from flexgear.analysis.kernels.step_arrays import (
    ModalData,
    ModalSpace,
    Samples,
    Space,
    State,
    StepData,
    Work,
)
from flexgear.analysis.kernels.vectors import SIMD, aligned, rounded_up
from flexgear.arrays import Array, Ints
from flexgear.coupling.kernels.elements import (
    law_functions,
    packed,
    pair_rows,
    row_motions,
    widest,
)
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.machines import Brake, Controller, GivenSpeed
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import PairData, action_lines, covered
from flexgear.coupling.system import System

ANGLES = (0.0, 0.7, 2.3, 4.4)  # rad, of the first angle of a system; each further one turns on
SAME = 1e-11  # of the receptances of two rows by themselves


def eliminated_springs(pairs: PairData, channels: Channels, ports: int) -> EliminatedSprings:
    """The rotating-frame supports for steps with the receptances of ``channels``; none of them
    where a receptance between them, or to a port or line of action, changes with the angle."""
    levels, stiffness = len(channels.displacement), pairs.support_stiffness
    first = 6 * len(channels.part)
    head = slice(first, first + ports + 2 * len(pairs.s0) + 1)
    nothing = no_springs(levels, head.stop - head.start)
    if not len(stiffness) or not stiffness.all():
        return nothing
    count, size = len(stiffness), rounded_up(len(stiffness))
    at = np.unique(pairs.support_block[pairs.support_block >= 0])
    at = (6 * at[:, None] + np.arange(6)).ravel()
    unit = np.eye(first)[:, at]
    rows = np.array([_rows(pairs, angle, unit) for angle in ANGLES])
    shape = (levels, head.stop - head.start, size)
    condensed, *tables = aligned(levels, count, size), *(aligned(*shape) for _ in range(3))
    displacement, modal, force = tables
    for level, g in enumerate(channels.displacement):
        between = rows @ g[np.ix_(at, at)] @ rows.transpose(0, 2, 1)
        each = np.sqrt(np.abs(np.diagonal(between[0])))
        scale = np.outer(each, np.sqrt(np.abs(np.diag(g)[head])))
        for table, matrix in ((displacement, g), (modal, g - channels.residual)):
            across = rows @ matrix[at, head]
            if not _all_same(across, scale):
                return nothing
            table[level, :, :count] = across[0].T
        if not _all_same(between, np.outer(each, each)):
            return nothing
        flexibility = np.diag(1.0 / stiffness) + 0.5 * (between[0] + between[0].T)
        condensed[level, :, :count] = np.linalg.inv(flexibility)
        force[level] = displacement[level, :, :count] @ condensed[level]
    return EliminatedSprings(np.array(stiffness), condensed, displacement, modal, force)


def _all_same(values: Array, scale: Array) -> bool:
    """Whether values (angles, …) differ by nothing but rounding."""
    return bool((np.abs(values - values[0]) <= SAME * scale + np.finfo(float).tiny).all())


def _rows(pairs: PairData, angle: float, motion: Array) -> Array:
    """Motion (B, c) of the supports' rows, from that of the blocks (6 n_b, c), where every angle of
    the system is a multiple of one."""
    rows, none = pair_rows(pairs), np.zeros(len(pairs.s0), dtype=np.int64)
    angles = pairs.support_angle, pairs.bearing_angle, pairs.load_angle, pairs.bearing_turned
    count = 1 + max(numbers.max(initial=0) for numbers in angles)
    n, _ = build_rows(pairs, rows, angle * np.arange(1, count + 1), none)
    return row_motions(rows, n, motion)[n - len(pairs.support_block) :]


def step_data(modal: ModalSystem, sizes: float | Array) -> StepData:
    """Constant arrays of one step size or several (s): modal factors, receptances, elements."""
    h = np.atleast_1d(np.asarray(sizes, dtype=float))
    omega2 = modal.omega**2
    inverse = 1.0 / (1.0 + GAMMA * h[:, None] * modal.damping + BETA * h[:, None] ** 2 * omega2)
    channel_data = channels(modal, h, inverse)
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
        channels=channel_data,
        elements=packed(modal.system.pairs),
        machines=packed_machines(modal.system),
        springs=eliminated_springs(modal.system.pairs, channel_data, len(modal.system.ports)),
    )


def work_space(modal: ModalSystem, track_energy: bool = False, sizes: int = 1) -> Space:
    """Empty work space for ``sizes`` step sizes, with or without the energy balance."""
    pairs, active = modal.system.pairs, active_dofs(modal, sizes)
    ports = len(modal.system.ports)
    rows, last = pair_rows(pairs, ports), pair_rows(pairs, ports)
    count, n = len(rows.row), rounded_up(modal.modes.shape[1])
    theta, speeds = np.zeros((2, len(modal.angles)))
    free, free_rate, acceleration, push, rotating, spare = aligned(6, n)
    space = ModalSpace(
        free, free_rate, acceleration, push, rotating, spare, theta, speeds, port_space(ports)
    )
    work = Work(
        modes=space,
        rows=rows,
        active=active,
        dofs=dof_vectors(active),
        problem=contact_problem(count, len(pairs.support_stiffness)),
        space=law_space(len(rows.element), widest(pairs)),
        closing_speed=np.zeros(len(pairs.s0)),
        error_rates=np.zeros(len(pairs.s0)),
    )
    booked = np.zeros(1, dtype=BOOKED)
    booked["tracked"], booked["rows"] = int(track_energy), -1
    ledger = Ledger(
        booked=booked,
        rows=last,
        lost=np.zeros((4, count)),
        now=np.zeros((2, count)),
        before=np.zeros((2, count)),
        delta=np.zeros(count),
        force=np.zeros(len(modal.channels) + 3 * len(pairs.s0)),
        error_rates=np.zeros(len(pairs.s0)),
    )
    return Space(work, ledger)


def begin(space: Space, data: StepData) -> None:
    """Make the ports of other constants the only active dofs; a step gathers what else it needs."""
    active = space.work.active
    counts = active.counts[0]
    ports = 6 * counts["blocks"] + np.arange(counts["ports"])
    active.place[:], active.gathered[:], counts["dofs"], counts["fresh"] = -1, 0, len(ports), 1
    counts["head"] = len(ports)
    active.channel[: len(ports)] = ports
    active.modes[: len(ports)] = data.channels.modes[ports]
    active.span[: len(ports)] = data.channels.span[ports]
    active.beside[: len(ports)] = 0, len(ports)
    space.work.space.remembered[-1] = -1


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


def channels(modal: ModalSystem, h: Array, inverse: Array) -> Channels:
    """Channels of a system for steps of the sizes h (L,) s with D = ``inverse`` (L, n)."""
    ports, count = len(modal.system.ports), len(modal.system.pairs.s0)
    block_channels = len(modal.channels) - ports
    lines = action_lines(modal.system.pairs, block_channels // 6)
    p = np.vstack([modal.channel_modes, lines @ modal.channel_modes[:block_channels]])
    across = lines @ modal.residual[:block_channels]
    residual = np.block(
        [[modal.residual, across.T], [across, across[:, :block_channels] @ lines.T]]
    )
    part = _parts(p, residual, block_channels)
    displacement = np.zeros((len(h), *residual.shape))
    for k in range(part.max(initial=-1) + 1):
        on_part = np.flatnonzero(part == k)
        moving = np.flatnonzero(p[on_part].any(axis=0))
        part_modes, among = p[np.ix_(on_part, moving)], np.ix_(on_part, on_part)
        for level, size in enumerate(h):
            dynamic = part_modes * (BETA * size**2 * inverse[level, moving]) @ part_modes.T
            displacement[level][among] = dynamic + residual[among]
    modes = np.zeros((len(p), rounded_up(p.shape[1])))
    modes[:, : p.shape[1]] = p
    first = np.concatenate(
        [np.arange(0, block_channels, 6), block_channels + ports + 2 * np.arange(count)]
    )
    of_block = part[:block_channels:6]
    return Channels(modes, _spans(p), displacement, np.ascontiguousarray(residual), first, of_block)


def _parts(p: Array, residual: Array, block_channels: int) -> Ints:
    """Part of the train (n_c,) that each channel is on: parts share neither modes p (n_c, n) nor
    residual flexibility (n_c, n_c). Ports and lines of action, the last channels, are on part 0.
    """
    starts = np.r_[0:block_channels:6, block_channels : len(p)]
    moves = np.logical_or.reduceat(p != 0.0, starts, axis=0)
    yields = np.logical_or.reduceat(residual != 0.0, starts, axis=0)
    yields = np.logical_or.reduceat(yields, starts, axis=1)
    links = csr_array(np.block([[yields, moves], [moves.T, np.zeros((p.shape[1],) * 2, bool)]]))
    component = connected_components(links, directed=False)[1]
    of_head = np.isin(component, component[block_channels // 6 : len(starts)])
    of_group = np.where(of_head, -1, component)[: len(starts)]
    by_channel = np.repeat(of_group, np.diff(np.r_[starts, len(p)]))
    return np.unique(by_channel, return_inverse=True)[1]


def _spans(p: Array) -> Ints:
    """Ranges of modes that hold all that are not zero, in multiples of SIMD."""
    moves = p != 0.0
    first = np.where(moves.any(axis=1), moves.argmax(axis=1), 0)
    stop = np.where(moves.any(axis=1), p.shape[1] - moves[:, ::-1].argmax(axis=1), 0)
    return np.column_stack([first - first % SIMD, stop + -stop % SIMD]).astype(np.int64)


def active_dofs(modal: ModalSystem, sizes: int) -> ActiveDofs:
    """Empty work space for so many step sizes."""
    pairs, ports, modes = modal.system.pairs, len(modal.system.ports), modal.modes.shape[1]
    blocks = (len(modal.channels) - ports) // 6
    room = ports + 2 * len(pairs.s0) + 6 * _most_blocks(pairs, blocks) + AT_ONCE
    counts = np.zeros(1, dtype=COUNTS)
    counts["ports"], counts["blocks"] = ports, blocks
    return ActiveDofs(
        counts=counts,
        channel=np.zeros(room, dtype=np.int64),
        place=np.full(blocks + len(pairs.s0), -1, dtype=np.int64),
        modes=aligned(room, rounded_up(modes)),
        span=np.zeros((room, 2), dtype=np.int64),
        beside=np.zeros((room, 2), dtype=np.int64),
        receptance=aligned(sizes, room, rounded_up(2 * room)),
        reach=np.zeros((room, 2), dtype=np.int64),
        gathered=np.zeros(sizes, dtype=np.int64),
        filled=np.zeros((sizes, room, 2), dtype=np.int64),
    )


def _most_blocks(pairs: PairData, blocks: int) -> int:
    """Blocks that rows of one step and of the one before may act on beyond lines of action."""
    on_teeth = (pairs.per_tooth == 1).sum() + (pairs.planet_turns >= 0).sum()
    teeth = 2 * pairs.slots * int(on_teeth)
    beyond = int((covered(pairs) == 1).sum())
    several = (pairs.support_block, pairs.bearing_block, pairs.load_block)
    return min(blocks, teeth + beyond + sum(np.asarray(s).size for s in several))


def dof_vectors(active: ActiveDofs) -> DofVectors:
    """Work space beside ``active``."""
    room, counts = len(active.channel), active.counts[0]
    head = counts["ports"] + 2 * (len(active.place) - counts["blocks"]) + 1
    image, of_line = aligned(rounded_up(2 * room)), aligned(rounded_up(2 * head))
    free, free_rate, of_torques, force, motion, before = np.zeros((6, room))
    return DofVectors(free, free_rate, of_torques, force, motion, before, image, of_line)


def frame_data(modal: ModalSystem) -> FrameData:
    """Gyroscopic and centripetal matrices of a system at rated speed, and its velocity row."""
    if not modal.gyroscopic.size:
        return FrameData(modal.gyroscopic, modal.centripetal, np.zeros(0))
    return FrameData(modal.gyroscopic, modal.centripetal, rated_row(modal))


def rated_row(modal: ModalSystem) -> Array:
    """Row v/vᵀv (n,), which times velocities (n,) is their share of rated speed; v (n,): velocities
    at rated speed. Zero for a train that is rated at rest."""
    rolling = modal.rolling @ modal.system.rated_input_speeds
    size = float(rolling @ rolling)
    return np.asarray(rolling / size if size else rolling)


def packed_machines(system: System) -> Any:
    """Records (P,) MACHINE of the ports."""
    out = np.zeros(len(system.ports), dtype=MACHINE)
    for record, machine in zip(out, system.machines, strict=True):
        record["least"], record["most"] = -math.inf, math.inf
        if isinstance(machine, Brake):
            record["kind"], record["torque"] = BRAKE, machine.rated_torque
            record["speed"], record["exponent"] = machine.rated_speed, machine.exponent
        elif isinstance(machine, Controller):
            record["kind"], record["proportional"] = CONTROLLER, machine.proportional
            record["integral"] = machine.integral
            record["least"], record["most"] = machine.least, machine.most
        elif isinstance(machine, GivenSpeed):
            record["kind"] = SPEED
    return out


NEVER = 2  # ticks between samples, of which one is taken


def at_rest(data: StepData, modal_system: ModalSystem) -> StepData:
    """The system with a step of zero duration as its only one."""
    system, inverse = modal_system.system, np.ones((1, data.modal.omega2.size))
    modal = data.modal._replace(h=np.zeros(1), inverse=inverse)
    channels = data.channels._replace(displacement=data.channels.residual[None])
    springs = eliminated_springs(system.pairs, channels, len(system.ports))
    return data._replace(modal=modal, channels=channels, springs=springs)


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
    """``accelerate`` so that the equation of motion holds now, with a ``space`` that is for
    ``data`` before and after. A jump of a torque moves the quasi-static part at once; the ledger
    books it."""
    resting = at_rest(data, modal)
    begin(space, resting)
    status = accelerate(modal, resting, state, prescribed, space)
    begin(space, data)
    return status
