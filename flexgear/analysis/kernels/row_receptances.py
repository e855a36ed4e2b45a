"""Contact rows at the active dofs: motions and forces of rows, receptances between rows."""

import numpy as np

from flexgear.analysis.kernels.active_dofs import ONE, SIX, TWO, reach_of
from flexgear.analysis.kernels.eliminated_springs import BlockImage, spring_receptances
from flexgear.analysis.kernels.vectors import SIMD, add_six, fill, padded, put_six, put_two
from flexgear.compiled import FAST, INNER, PART, ZERO, njit

NONE = np.uint64(0)
BLOCK_ENTRIES = 12  # G and R of the six dofs of a block
MAX_PARTS = 62  # parts of the train with a bit of their own; further ones share one


@njit(**INNER)
def place_rows(active, channels, rows, n, springs):
    """Set in n rows the active dofs and parts on which they act (see ``Rows``); springs: number of
    eliminated springs, which are the last rows."""
    counts, all_parts, spring_since = active.counts[0], 0, active.counts[0].dofs
    since = spring_since
    for i in range(n - 1, -1, -1):
        row = rows.row[i]
        row.dof, row.parts = active.place[counts.blocks + row.line] if row.line >= 0 else -1, 0
        for a in range(row.beyond, row.width):
            block = rows.blocks[i, a]
            rows.place[i, a] = active.place[block]
            row.parts |= 1 << min(channels.part[block], MAX_PARTS)
            if i < n - springs:
                since = min(since, active.place[block])
        if i < n - springs:
            all_parts |= row.parts
        row.since = since
    # all rows also need their receptances with the springs on their parts
    for i in range(n - springs, n):
        for a in range(rows.row[i].beyond, rows.row[i].width):
            block = rows.blocks[i, a]
            if all_parts & (1 << min(channels.part[block], MAX_PARTS)) != 0:
                spring_since = min(spring_since, active.place[block])
    for i in range(n if springs > 0 else 0):
        rows.row[i].since = min(rows.row[i].since, spring_since)


@njit(**INNER)
def row_value(rows, i, vector):
    """V_iᵀ u of row i for values u at the active dofs."""
    row, total = rows.row[i], 0.0
    if row.dof >= 0:
        total = vector[row.dof] + row.along * vector[row.dof + 1]
    for a in range(row.beyond, row.width):
        coef, d = rows.coef[i, a], rows.place[i, a]
        for p in range(SIX):
            total += coef[p] * vector[d + p]
    return total


@njit(**PART)
def add_row(rows, i, factor, vector):
    """vector += factor · V_i at the active dofs."""
    row = rows.row[i]
    if row.dof >= 0:
        vector[row.dof] += factor
        vector[row.dof + 1] += factor * row.along
    for a in range(row.beyond, row.width):
        coef, d = rows.coef[i, a], rows.place[i, a]
        for p in range(SIX):
            vector[d + p] += factor * coef[p]


@njit(**PART)
def _image_of_blocks(active, level, row, coef, place, image):
    """Compute in ``image`` G V and R V of the blocks of one row (without its line of action), at
    the dofs of this row and later ones. Returns whether the blocks are coupled to lines of action,
    and the ranges of ``image`` filled by the first block and by the others."""
    table, head = active.receptance[level], active.counts[0].head
    linked, first, stop, others, end = False, ZERO, ZERO, ZERO, ZERO
    for a in range(row.beyond, row.width):
        d = np.int64(place[a])
        for p in range(d, d + 6):
            linked = linked or active.reach[p, 0] < 2 * head
        low, high = reach_of(active.reach, d, 6, head, row.since)
        # extended to the whole head and to whole blocks, of which rows read all dofs
        low = low - (low - 2 * head) % BLOCK_ENTRIES if low >= 2 * head else ZERO
        low -= low % SIMD
        after = padded(high + max(2 * head - high, ZERO))
        after = padded(after + -(after - 2 * head) % BLOCK_ENTRIES)
        if a == row.beyond:
            first, stop = low, after
            put_six(image[low:after], coef[a], table[d : d + 6], low)
        elif end == ZERO and (low >= stop or after <= first):
            others, end = low, after
            put_six(image[low:after], coef[a], table[d : d + 6], low)
        else:
            begin, beyond = (low, after) if end == ZERO else (min(low, others), max(after, end))
            for k in range(begin, beyond):  # entries that no block before has filled
                if not (first <= k < stop or others <= k < end):
                    image[k] = 0.0
            others, end = begin, beyond
            add_six(image[low:after], coef[a], table[d : d + 6], low)
    ranges = (np.uint64(first), np.uint64(stop), np.uint64(others), np.uint64(end))
    return linked, BlockImage(image, *ranges)


@njit(**INNER, fastmath=FAST)
def row_receptances(active, level, share, rows, n, total, springs, vectors, problem):
    """Receptances V_iᵀ G V_j and share · V_iᵀ (G − R) V_j of ``total`` rows, both symmetric.

    For the springs, the last of the first n rows, only receptances with other rows are computed. A
    row's line of action (or port) is coupled to other lines, its blocks to other blocks and, where
    a body has both, to lines. vectors: work space.
    """
    table, width = active.receptance[level], padded(2 * active.counts[0].head)
    row, coef, place, displacement = rows.row, rows.coef, rows.place, problem.displacement
    line_image, rate = vectors.line_image[:width], problem.rate
    skipped = np.uint64(springs.stiffness.shape[0])
    count, first_spring = np.uint64(total) - skipped, np.uint64(n) - skipped
    for at_j in range(count):
        j = at_j + skipped if at_j >= first_spring else at_j
        d, linked, blocks = row[j].dof, False, row[j].beyond < row[j].width
        block_image = BlockImage(vectors.image, NONE, NONE, NONE, NONE)
        if d >= 0:
            put_two(line_image, 1.0, table[d], row[j].along, table[d + 1])
        else:
            fill(line_image, 0.0)
        if blocks:
            linked, block_image = _image_of_blocks(
                active, level, row[j], coef[j], place[j], vectors.image
            )
        image, parts = block_image.image, row[j].parts if blocks else ZERO
        for at_i in range(at_j, count):
            i = at_i + skipped if at_i >= first_spring else at_i
            g = r = 0.0
            if row[i].dof >= 0:
                at, along = TWO * np.uint64(row[i].dof), row[i].along
                g = line_image[at] + along * line_image[at + TWO]
                r = line_image[at + ONE] + along * line_image[at + TWO + ONE]
            for a in range(row[i].beyond, row[i].width if row[i].parts & parts != 0 else ZERO):
                v, at = coef[i, a], TWO * place[i, a]
                is_first = block_image.first <= at < block_image.stop
                if not (is_first or block_image.others <= at < block_image.end):
                    continue  # on another part of the train
                for p in range(SIX):
                    g += v[p] * image[at + TWO * p]
                    r += v[p] * image[at + TWO * p + ONE]
            w = share * (g - r)
            displacement[at_i, at_j] = displacement[at_j, at_i] = g
            rate[at_i, at_j] = rate[at_j, at_i] = w
        if linked:
            _add_lines_to_blocks(row, j, at_j, n, total, skipped, share, image, problem)
        if skipped > 0:
            spring_receptances(
                active, level, share, rows, j, at_j, np.int64(first_spring), springs, block_image,
                problem.springs,
            )  # fmt: skip


@njit(**INNER)
def _add_lines_to_blocks(row, j, at_j, n, total, skipped, share, image, problem):
    """Add the receptances between the blocks of row j, whose ``image`` is G V and R V, and the
    lines of action of all rows; at_j: place of row j in the problem."""
    displacement, rate = problem.displacement, problem.rate
    for i in range(total):
        if row[i].dof >= 0:
            at, along = TWO * np.uint64(row[i].dof), row[i].along
            g = image[at] + along * image[at + TWO]
            w = share * (g - image[at + ONE] - along * image[at + TWO + ONE])
            at_i = i - np.int64(skipped) if i >= n else i
            displacement[at_i, at_j] += g
            displacement[at_j, at_i] += g
            rate[at_i, at_j] += w
            rate[at_j, at_i] += w
