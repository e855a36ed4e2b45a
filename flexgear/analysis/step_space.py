"""Data of the steps of a run: constants of its step sizes, work space, accelerations.

**Accelerations.** A step of average acceleration needs the acceleration at its start. A step with
h = 0, D = 1 and G = R changes no displacement: it gives the contact forces of the present motion,
and hence its acceleration.

**Springs in turning frames** whose receptances do not depend on the angle are eliminated from the
contact problem of a step (``kernels.eliminated_springs``). The receptances are computed at four
angles; where they differ the springs remain rows of the contact problem.
"""

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
from flexgear.coupling.kernels.elements import law_functions, packed, pair_rows, row_motions, widest
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.machines import Brake, Controller, GivenSpeed
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import PairData, action_lines, covered
from flexgear.coupling.system import System

ANGLES = (0.0, 0.7, 2.3, 4.4)  # rad; angle k of the system is k + 1 times these
SAME = 1e-11  # difference of receptances over the geometric mean of the direct ones


def eliminated_springs(pairs: PairData, channels: Channels, ports: int) -> EliminatedSprings:
    """The rotating-frame supports eliminated with the receptances of ``channels``; none where a
    receptance between them, or to a port or line of action, depends on the angle."""
    levels, stiffness = len(channels.displacement), pairs.support_stiffness
    first = 6 * len(channels.part)
    head = slice(first, first + ports + 2 * len(pairs.s0) + 1)
    none = no_springs(levels, head.stop - head.start)
    if not len(stiffness) or not stiffness.all():
        return none
    count, size = len(stiffness), rounded_up(len(stiffness))
    at = np.unique(pairs.support_block[pairs.support_block >= 0])
    at = (6 * at[:, None] + np.arange(6)).ravel()
    unit = np.eye(first)[:, at]
    rows = np.array([_rows(pairs, angle, unit) for angle in ANGLES])
    shape = (levels, head.stop - head.start, size)
    condensed, *tables = aligned(levels, count, size), *(aligned(*shape) for _ in range(3))
    displacement, modal, force = tables
    for level, g in enumerate(channels.displacement):
        springs = rows @ g[np.ix_(at, at)] @ rows.transpose(0, 2, 1)
        root = np.sqrt(np.abs(np.diagonal(springs[0])))
        scale = np.outer(root, np.sqrt(np.abs(np.diag(g)[head])))
        for table, matrix in ((displacement, g), (modal, g - channels.residual)):
            to_head = rows @ matrix[at, head]
            if not _all_same(to_head, scale):
                return none
            table[level, :, :count] = to_head[0].T
        if not _all_same(springs, np.outer(root, root)):
            return none
        flexibility = np.diag(1.0 / stiffness) + 0.5 * (springs[0] + springs[0].T)
        condensed[level, :, :count] = np.linalg.inv(flexibility)
        force[level] = displacement[level, :, :count] @ condensed[level]
    return EliminatedSprings(np.array(stiffness), condensed, displacement, modal, force)


def _all_same(values: Array, scale: Array) -> bool:
    """Whether values (angles, …) differ only by rounding."""
    return bool((np.abs(values - values[0]) <= SAME * scale + np.finfo(float).tiny).all())


def _rows(pairs: PairData, angle: float, motion: Array) -> Array:
    """Motions (B, c) of the supports' rows for motions (6 n_b, c) of the blocks, with angle k of
    the system k + 1 times ``angle``, rad."""
    rows, none = pair_rows(pairs), np.zeros(len(pairs.s0), dtype=np.int64)
    angles = pairs.support_angle, pairs.bearing_angle, pairs.load_angle, pairs.bearing_turned
    count = 1 + max(numbers.max(initial=0) for numbers in angles)
    n, _ = build_rows(pairs, rows, angle * np.arange(1, count + 1), none)
    return row_motions(rows, n, motion)[n - len(pairs.support_block) :]


def step_data(modal: ModalSystem, sizes: float | Array) -> StepData:
    """Constant arrays of a run: modal factors, receptances, elements; sizes: of steps, s."""
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
    """Empty work space for ``sizes`` step sizes; track_energy: with the energy balance."""
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
    """Prepare the work space for steps with ``data``: only the ports are active dofs."""
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
    """Arrays for ``count`` saved samples, without pairs in contact."""
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
    """Receptances of the channels for steps of the sizes h (L,), s; inverse (L, n): D."""
    ports, count = len(modal.system.ports), len(modal.system.pairs.s0)
    block_channels = len(modal.channels) - ports
    lines = action_lines(modal.system.pairs, block_channels // 6)
    p = np.vstack([modal.channel_modes, lines @ modal.channel_modes[:block_channels]])
    to_lines = lines @ modal.residual[:block_channels]
    residual = np.block(
        [[modal.residual, to_lines.T], [to_lines, to_lines[:, :block_channels] @ lines.T]]
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
    parts = part[:block_channels:6]
    return Channels(modes, _spans(p), displacement, np.ascontiguousarray(residual), first, parts)


def _parts(p: Array, residual: Array, block_channels: int) -> Ints:
    """Number (n_c,) of the uncoupled part of the train to which each channel belongs: parts share
    neither modes p (n_c, n) nor residual flexibility (n_c, n_c). Ports and lines of action, the
    last channels, belong to part 0."""
    starts = np.r_[0:block_channels:6, block_channels : len(p)]
    by_modes = np.logical_or.reduceat(p != 0.0, starts, axis=0)
    by_residual = np.logical_or.reduceat(residual != 0.0, starts, axis=0)
    by_residual = np.logical_or.reduceat(by_residual, starts, axis=1)
    no_links = np.zeros((p.shape[1],) * 2, bool)
    links = csr_array(np.block([[by_residual, by_modes], [by_modes.T, no_links]]))
    component = connected_components(links, directed=False)[1]
    first_part = np.isin(component, component[block_channels // 6 : len(starts)])
    by_group = np.where(first_part, -1, component)[: len(starts)]
    by_channel = np.repeat(by_group, np.diff(np.r_[starts, len(p)]))
    return np.unique(by_channel, return_inverse=True)[1]


def _spans(p: Array) -> Ints:
    """Ranges (n_c, 2) of modes outside which p (n_c, n) is zero, rounded to multiples of SIMD."""
    nonzero = p != 0.0
    first = np.where(nonzero.any(axis=1), nonzero.argmax(axis=1), 0)
    stop = np.where(nonzero.any(axis=1), p.shape[1] - nonzero[:, ::-1].argmax(axis=1), 0)
    return np.column_stack([first - first % SIMD, stop + -stop % SIMD]).astype(np.int64)


def active_dofs(modal: ModalSystem, sizes: int) -> ActiveDofs:
    """Empty work space of active dofs for ``sizes`` step sizes."""
    pairs, ports, modes = modal.system.pairs, len(modal.system.ports), modal.modes.shape[1]
    blocks = (len(modal.channels) - ports) // 6
    room = ports + 2 * len(pairs.s0) + 6 * _max_blocks(pairs, blocks) + AT_ONCE
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


def _max_blocks(pairs: PairData, blocks: int) -> int:
    """Largest number of blocks on which the rows of two successive steps act, beside lines of
    action; blocks: number of all blocks."""
    gears_with_teeth = (pairs.per_tooth == 1).sum() + (pairs.planet_turns >= 0).sum()
    teeth = 2 * pairs.slots * int(gears_with_teeth)
    gears = int((covered(pairs) == 1).sum())
    others = (pairs.support_block, pairs.bearing_block, pairs.load_block)
    return min(blocks, teeth + gears + sum(np.asarray(b).size for b in others))


def dof_vectors(active: ActiveDofs) -> DofVectors:
    """Empty vectors over the active dofs."""
    room, counts = len(active.channel), active.counts[0]
    head = counts["ports"] + 2 * (len(active.place) - counts["blocks"]) + 1
    image, line_image = aligned(rounded_up(2 * room)), aligned(rounded_up(2 * head))
    free, free_rate, torque_motion, force, motion, before = np.zeros((6, room))
    return DofVectors(free, free_rate, torque_motion, force, motion, before, image, line_image)


def frame_data(modal: ModalSystem) -> FrameData:
    """Gyroscopic and centripetal matrices of a system at rated speed, and its velocity row."""
    if not modal.gyroscopic.size:
        return FrameData(modal.gyroscopic, modal.centripetal, np.zeros(0))
    return FrameData(modal.gyroscopic, modal.centripetal, rated_row(modal))


def rated_row(modal: ModalSystem) -> Array:
    """Row v/vᵀv (n,), whose product with velocities (n,) is the share of rated speed; v (n,):
    velocities at rated speed. Zero for a train with zero rated speed."""
    rolling = modal.rolling @ modal.system.rated_input_speeds
    size = float(rolling @ rolling)
    return np.asarray(rolling / size if size else rolling)


def packed_machines(system: System) -> Any:
    """The machines of the ports as records (P,) MACHINE."""
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


def zero_step(data: StepData, modal_system: ModalSystem) -> StepData:
    """Constants with a step of zero duration as the only one."""
    system, inverse = modal_system.system, np.ones((1, data.modal.omega2.size))
    modal = data.modal._replace(h=np.zeros(1), inverse=inverse)
    channels = data.channels._replace(displacement=data.channels.residual[None])
    springs = eliminated_springs(system.pairs, channels, len(system.ports))
    return data._replace(modal=modal, channels=channels, springs=springs)


def accelerate(
    modal: ModalSystem, zero: StepData, state: State, prescribed: Array, space: Space
) -> int:
    """Set accelerations and stored forces by a step of zero duration, for which ``space`` is
    prepared; zero: see ``zero_step``.

    prescribed (P + L,): torques of machines, N·m, or rates of given speeds, rad/s², then factors of
    loads. Returns 0, or 1 without a solution.
    """
    no_samples = control(1, every=2)  # samples at every second tick, of which only one is run
    status, _ = advance(
        zero, law_functions(modal.system.pairs), prescribed[None], 0, state, space,
        empty_samples(modal, 0), no_samples,
    )  # fmt: skip
    return int(status)


def consistent_acceleration(
    modal: ModalSystem, data: StepData, state: State, prescribed: Array, space: Space
) -> int:
    """Set accelerations that satisfy the equation of motion (``accelerate``), with a ``space`` that
    is prepared for ``data`` before and after. The quasi-static part of the motion follows a jump of
    torque at once; the energy balance includes this."""
    zero = zero_step(data, modal)
    begin(space, zero)
    status = accelerate(modal, zero, state, prescribed, space)
    begin(space, data)
    return status
