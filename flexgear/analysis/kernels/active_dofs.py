"""Active dofs: the channels on which the contact rows of a step act, in contiguous arrays.

Channels are all motions on which forces may act: six of a contact block, one of a port, two of a
gear mesh along its line of action (``action_lines``, for planets and lumped gears), one of its
approach along the line of centres. Of hundreds of ring teeth only a few are in contact at a time.
The active dofs of a step are the ports, the lines of action and the blocks on which its rows act;
their modes and receptances are copied into contiguous arrays. A block that becomes necessary
replaces one that no row acts on any more, such as that of a tooth that has left contact; if there
is none, or if there are many, all dofs are gathered anew.
"""

from typing import Any, NamedTuple

import numpy as np

from flexgear.analysis.kernels.vectors import SIMD, add_six, fill, padded, two_dots
from flexgear.arrays import Array, Ints
from flexgear.compiled import FAST, INNER, PART, njit

# unsigned indices make short loops faster: no check for negative indices
ONE, TWO, SIX = np.uint64(1), np.uint64(2), np.uint64(6)
SPARE = 0.25  # share of active blocks without rows, above which dofs are gathered without them
STAYS = -2  # mark, in the place of its first dof, of a block that remains active
AT_ONCE = 6  # largest number of dofs read together; arrays have so many entries beyond the last dof
COUNTS = np.dtype([(name, np.int64) for name in ("dofs", "ports", "blocks", "fresh", "head")])


class Channels(NamedTuple):
    """All channels: blocks, ports, lines of action, approaches; L step sizes, n modes."""

    modes: Array  # (n_c, n)
    span: Ints  # (n_c, 2) first mode of a channel, and one past the last
    displacement: Array  # (L, n_c, n_c) G = Φ βh² D Φᵀ + R, m/N
    residual: Array  # (n_c, n_c) R, m/N
    first: Ints  # (B + M,) first channel of a block, then of a line of action
    part: Ints  # (B,) number of the uncoupled part of the train with a block; ports and lines of
    # action are on part 0


class ActiveDofs(NamedTuple):
    """Work space for C dofs: ports, then groups of two (lines of action) or six (blocks)."""

    counts: Any  # (1,) COUNTS; fresh: 1 after the dofs have changed, until the energy balance has
    # used them; head: number of dofs of ports and lines of action, which come first
    channel: Ints  # (C,) of each dof
    place: Ints  # (B + M,) first dof of a block or a line of action, −1 where it has none
    modes: Array  # (C, n)
    span: Ints  # (C, 2)
    beside: Ints  # (C, 2) first dof on the same part of the train, and one past the last
    receptance: Array  # (L, C, ≥ 2 C) G and R alternating, at [c, 2 d] and [c, 2 d + 1]
    reach: Ints  # (C, 2) first nonzero entry in a row of ``receptance``, and one past the last
    gathered: Ints  # (L,) 1 where ``receptance`` of a step size is that of these dofs
    filled: Ints  # (L, C, 2) range ``beside`` for which a row of ``receptance`` was gathered; it is
    # zero outside


class DofVectors(NamedTuple):
    """Values at the active dofs (C,)."""

    free: Array  # motion without contact forces
    free_rate: Array
    torque_motion: Array  # G f of given torques
    force: Array
    motion: Array
    before: Array  # motion at the last step, for the energy balance
    image: Array  # (≥ 2 C,) G V and R V of one row, alternating
    line_image: Array  # (≥ 2 (P + 2 M + 1),) G V and R V of its line of action, on ports and lines


@njit(**INNER)
def _all_placed(active, rows, n):
    """Whether all blocks and lines of action of n rows are active."""
    blocks = active.counts[0].blocks
    for i in range(n):
        row = rows.row[i]
        if row.line >= 0 and active.place[blocks + row.line] < 0:
            return False
        for a in range(row.beyond, row.width):
            if active.place[rows.blocks[i, a]] < 0:
                return False
    return True


@njit(**INNER)
def _place(active, channels, group, size):
    """Append the ``size`` channels of a block or line of action unless they are active."""
    if active.place[group] >= 0:
        return
    counts = active.counts[0]
    active.place[group] = counts.dofs
    for i in range(size):
        active.channel[counts.dofs] = channels.first[group] + i
        counts.dofs += 1


@njit(**INNER)
def _place_lines(active, channels, rows, n):
    """Append the lines of action of rows."""
    for i in range(n):
        if rows.row[i].line >= 0:
            _place(active, channels, active.counts[0].blocks + rows.row[i].line, 2)


@njit(**INNER)
def _place_blocks(active, channels, rows, n, part):
    """Append the blocks of the first n rows that are on a part of the train, as active dofs;
    those that a row moves through its line of action are not among them."""
    for i in range(n):
        for a in range(rows.row[i].beyond, rows.row[i].width):
            if channels.part[rows.blocks[i, a]] == part:
                _place(active, channels, rows.blocks[i, a], 6)


@njit(**INNER)
def _acted_on(block, rows, n):
    """Whether any of n rows acts on a block."""
    for i in range(n):
        for a in range(rows.row[i].beyond, rows.row[i].width):
            if rows.blocks[i, a] == block:
                return True
    return False


@njit(**INNER)
def _copy_modes(active, channels, first, stop):
    """Copy the modes of the dofs first … stop − 1."""
    for d in range(first, stop):
        c = active.channel[d]
        active.span[d, 0], active.span[d, 1] = channels.span[c, 0], channels.span[c, 1]
        for j in range(active.modes.shape[1]):
            active.modes[d, j] = channels.modes[c, j]


@njit(**INNER)
def _replace(active, channels, d, block):
    """Replace the block at dof d by another one on the same part of the train."""
    active.place[active.channel[d] // 6], active.place[block] = -1, d
    for p in range(6):
        active.channel[d + p] = channels.first[block] + p
    _copy_modes(active, channels, d, d + 6)
    for level in range(active.gathered.shape[0]):
        if active.gathered[level] == 0:
            continue
        table = active.receptance[level]
        for p in range(d, d + 6):
            _copy_receptance(active, channels, level, p)
        for c in range(active.beside[d, 0], active.beside[d, 1]):
            nonzero = False
            for p in range(d, d + 6):
                table[c, 2 * p], table[c, 2 * p + 1] = table[p, 2 * c], table[p, 2 * c + 1]
                nonzero = nonzero or table[c, 2 * p] != 0.0 or table[c, 2 * p + 1] != 0.0
            if nonzero:
                active.reach[c, 0] = min(active.reach[c, 0], 2 * d)
                active.reach[c, 1] = max(active.reach[c, 1], 2 * d + 12)


@njit(**INNER)
def _replaced(active, channels, rows, n, last_rows, last):
    """Let new blocks of n rows replace blocks on the same part of the train on which neither these
    rows nor the ``last`` rows of the last step act; returns whether all blocks are active then."""
    counts = active.counts[0]
    for i in range(n):
        row = rows.row[i]
        if row.line >= 0 and active.place[counts.blocks + row.line] < 0:
            return False
        for a in range(row.beyond, row.width):
            block, d = rows.blocks[i, a], counts.head
            if active.place[block] >= 0:
                continue
            for d in range(counts.head, counts.dofs, 6):
                other = active.channel[d] // 6
                if channels.part[other] == channels.part[block] and not (
                    _acted_on(other, rows, n) or _acted_on(other, last_rows, last)
                ):
                    _replace(active, channels, d, block)
                    break
            if active.place[block] < 0:
                return False
    counts.fresh = 1
    return True


@njit(**INNER)
def _few_are_spare(active, rows, n, last_rows, last):
    """Whether rows act on most of the active blocks, and the arrays have room for all others."""
    counts, spare = active.counts[0], 0
    room = active.channel.shape[0] - counts.dofs - AT_ONCE
    for d in range(counts.head, counts.dofs, 6):
        block = active.channel[d] // 6
        if not (_acted_on(block, rows, n) or _acted_on(block, last_rows, last)):
            spare += 6
    for i in range(n):
        row = rows.row[i]
        if row.line >= 0 and active.place[counts.blocks + row.line] < 0:
            room -= 2
        for a in range(row.beyond, row.width):
            if active.place[rows.blocks[i, a]] < 0:
                room -= 6
    return room >= 0 and spare <= SPARE * (counts.dofs - counts.head)


@njit(**INNER)
def gather(active, channels, rows, n, last_rows, last):
    """Activate the dofs of n rows and of the ``last`` rows of the last step; returns whether the
    active dofs have changed.

    Blocks stay active until new ones replace them. Where not enough blocks can be replaced, new
    ones are appended, and if there are many blocks without rows these are dropped. Blocks on one
    part of the train are contiguous.
    """
    if _all_placed(active, rows, n):
        return False
    keep = _all_placed(active, last_rows, last) and _few_are_spare(active, rows, n, last_rows, last)
    if keep and _replaced(active, channels, rows, n, last_rows, last):
        return True
    counts = active.counts[0]
    for group in range(active.place.shape[0]):
        stays = keep and group < counts.blocks and active.place[group] >= 0
        active.place[group] = STAYS if stays else -1
    for p in range(counts.ports):
        active.channel[p] = 6 * counts.blocks + p
    counts.dofs = counts.ports
    _place_lines(active, channels, rows, n)
    _place_lines(active, channels, last_rows, last)
    counts.head, parts = counts.dofs, 0
    for block in range(channels.part.shape[0]):
        parts = max(parts, channels.part[block] + 1)
    first = np.int64(0)  # dofs of ports and lines of action are on part 0
    for part in range(parts):
        _place_blocks(active, channels, rows, n, part)
        _place_blocks(active, channels, last_rows, last, part)
        for block in range(counts.blocks):
            if active.place[block] == STAYS and channels.part[block] == part:
                _place(active, channels, block, 6)
        for d in range(first, counts.dofs):
            active.beside[d, 0], active.beside[d, 1] = first, counts.dofs
        first = counts.dofs
    _copy_modes(active, channels, 0, counts.dofs)
    fill(active.gathered, 0)
    counts.fresh = 1
    return True


@njit(**INNER)
def _copy_receptance(active, channels, level, c):
    """Copy G and R of the active dof c for a step size; the rest of its row is zero."""
    g = channels.displacement[level, active.channel[c]]
    r, entries = channels.residual[active.channel[c]], active.receptance[level, c]
    begin, end = active.beside[c, 0], active.beside[c, 1]
    first, stop = 2 * end, 0
    for d in range(begin, end):
        entries[2 * d], entries[2 * d + 1] = g[active.channel[d]], r[active.channel[d]]
        if entries[2 * d] != 0.0 or entries[2 * d + 1] != 0.0:
            first, stop = min(first, 2 * d), 2 * d + 2
    active.reach[c, 0], active.reach[c, 1] = min(first, stop), stop


@njit(**INNER)
def gather_receptance(active, channels, level):
    """Copy the receptances among the active dofs from ``channels`` to ``active``, unless they are
    there already: G for the step size ``level``, and its residual part R."""
    if active.gathered[level] == 1:
        return
    active.gathered[level] = 1
    filled = active.filled[level]
    for c in range(active.counts[0].dofs):
        fill(active.receptance[level, c, 2 * filled[c, 0] : 2 * filled[c, 1]], 0.0)
        filled[c, 0], filled[c, 1] = active.beside[c, 0], active.beside[c, 1]
        _copy_receptance(active, channels, level, c)


@njit(**INNER, fastmath=FAST)
def motions(active, a, b, out_a, out_b):
    """Φ a and Φ b at the active dofs for modal vectors a, b (n,); four dofs at once, as memory
    access takes most of the time."""
    dofs, span, modes = active.counts[0].dofs, active.span, active.modes
    for d in range(0, dofs, 4):
        first, stop = span[d, 0], span[d, 1]
        for e in range(d + 1, d + 4):
            first, stop = min(first, span[e, 0]), max(stop, span[e, 1])
        p, q = modes[d, first:stop], modes[d + 1, first:stop]
        r, s = modes[d + 2, first:stop], modes[d + 3, first:stop]
        u, v = a[first:stop], b[first:stop]
        pa = pb = qa = qb = ra = rb = sa = sb = 0.0
        for j in range(p.shape[0]):
            pa += p[j] * u[j]
            pb += p[j] * v[j]
            qa += q[j] * u[j]
            qb += q[j] * v[j]
            ra += r[j] * u[j]
            rb += r[j] * v[j]
            sa += s[j] * u[j]
            sb += s[j] * v[j]
        out_a[d], out_b[d] = pa, pb
        out_a[d + 1], out_b[d + 1] = qa, qb
        out_a[d + 2], out_b[d + 2] = ra, rb
        out_a[d + 3], out_b[d + 3] = sa, sb


@njit(**INNER)
def modal_forces(active, force, out):
    """Φᵀ f (n,) of forces on the active dofs, six at once; sets entries after the last to zero."""
    fill(out, 0.0)
    dofs, span = active.counts[0].dofs, active.span
    fill(force[dofs : dofs + AT_ONCE], 0.0)
    for d in range(0, dofs, AT_ONCE):
        first, stop = span[d, 0], span[d, 1]
        for e in range(d + 1, d + 6):
            first, stop = min(first, span[e, 0]), max(stop, span[e, 1])
        add_six(out[first:stop], force[d : d + 6], active.modes[d : d + 6], first)


@njit(**PART)
def reach_of(reach, d, count, head, since):
    """Range of the nonzero entries in the rows of the receptance table of ``count`` dofs from d on;
    its start is rounded down to a multiple of SIMD.

    A range that begins after the head (ports and lines of action) begins at the dof ``since`` or
    later: remaining rows do not read the dofs before.
    """
    low, high = reach[d, 0], reach[d, 1]
    for e in range(d + 1, d + count):
        low, high = min(low, reach[e, 0]), max(high, reach[e, 1])
    if low >= 2 * head:
        low = max(low, 2 * since)
    return low - low % SIMD, high


@njit(**INNER)
def apply_receptance(active, level, force, image):
    """G f and R f (≥ 2 C,), alternating, of forces on the active dofs, six dofs at once; entries of
    ``force`` beyond the last dof are set to zero."""
    dofs, head, table = active.counts[0].dofs, active.counts[0].head, active.receptance[level]
    fill(image[: padded(2 * dofs)], 0.0)
    fill(force[dofs : dofs + AT_ONCE], 0.0)
    for d in range(0, dofs, AT_ONCE):
        six, total = force[d : d + 6], 0.0
        for p in range(6):
            total += abs(six[p])
        if total != 0.0:
            low, high = reach_of(active.reach, d, 6, head, 0)
            add_six(image[low : padded(high)], six, table[d : d + 6], low)


@njit(**INNER)
def add_residual(active, level, force, image, out):
    """out += R f at the active dofs; image: see ``apply_receptance``."""
    apply_receptance(active, level, force, image)
    for d in range(active.counts[0].dofs):
        out[d] += image[2 * d + 1]


@njit(**INNER, fastmath=FAST)
def channel_motion(channels, active, c, eta, rate, force):
    """Displacement Φη + R f and speed Φη̇ of channel c, which belongs to part 0 of the train; R is
    zero between this part and the others. rate: η̇; force: f on the active dofs."""
    modes = channels.modes[c]
    motion, speed = two_dots(modes[: eta.shape[0]], eta, rate)
    for d in range(active.beside[0, 1]):
        motion += channels.residual[c, active.channel[d]] * force[d]
    return motion, speed


@njit(**INNER, fastmath=FAST)
def dof_motion(active, level, d, eta, rate, force):
    """Displacement Φη + R f and speed Φη̇ of the active dof d; see ``channel_motion``."""
    first, stop = active.span[d, 0], active.span[d, 1]
    modes, entries = active.modes[d, first:stop], active.receptance[level, d]
    motion, speed = two_dots(modes, eta[first:stop], rate[first:stop])
    for e in range(active.reach[d, 0] // 2, active.reach[d, 1] // 2):
        motion += entries[2 * e + 1] * force[e]
    return motion, speed
