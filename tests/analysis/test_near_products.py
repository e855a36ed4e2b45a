"""The contact matrix and its elimination against plain dense algebra."""

import numpy as np
import pytest
from numba import njit

from flexgear.analysis.contact import eliminate
from flexgear.analysis.contact_matrix import contact_matrix, contact_work
from flexgear.analysis.near import whole_ranges
from flexgear.analysis.near_products import LINE, answered, moved, pushed, whole_lines
from flexgear.analysis.wide import aligned

PORTS, MESHES, HEAD = 2, 5, 16 + 8
GROUPS = ((0, 3), (4, 7))  # slots of each; a group begins with a cache line


@pytest.fixture
def rng():
    return np.random.default_rng(11)


@njit
def solved(a, n, x):
    return eliminate(a, n, x)


@njit
def made(g, r, rows, slots, groups, lines, n, wide, k, f, which, work, out):
    line, along, at, part, coef, width, beyond = rows
    order, since, reach = slots
    low, high, linked = groups
    contact_matrix(
        g, r, line, along, at, part, coef, width, beyond, order, since, reach, PORTS, lines, low,
        high, linked, n, wide, k, f, which, work, out,
    )  # fmt: skip


def system_of(n, rng, excess=0.0):
    a = aligned(8 * (n // 8 + 1), 8 * (n // 8 + 1))
    flexible = rng.standard_normal((n, n))
    a[:n, :n] = np.eye(n) + rng.uniform(0.1, 3.0, n)[:, None] * (flexible @ flexible.T / n)
    a[:n, :n] += excess * rng.standard_normal((n, n))
    a[:n, n] = rng.standard_normal(n)
    return a


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 7, 8, 9, 12, 15, 16, 27, 28, 31, 44])
def test_elimination_solves(n, rng):
    a, x = system_of(n, rng, 0.01), np.zeros(n + 1)
    expected = np.linalg.solve(a[:n, :n], a[:n, n])
    assert solved(a, n, x)
    np.testing.assert_allclose(x[:n], expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("bad", [0, 3, 5, 9])
def test_elimination_refuses_a_small_pivot(bad, rng):
    a = system_of(10, rng)
    a[bad, :10] = a[:10, bad] = 0.0
    a[bad, bad] = 0.1
    assert not solved(a, 10, np.zeros(11))


def channel_matrix(linked, rng):
    """Symmetric, with zeros between groups, and between the head and groups not linked to it."""
    size = HEAD + 6 * GROUPS[-1][1]
    size += -size % LINE
    member = np.full(size, -1)  # the head
    for g, (a, b) in enumerate(GROUPS):
        member[HEAD + 6 * a : HEAD + 6 * b] = g
    joined = member[:, None] == member
    for g, with_head in enumerate(linked):
        if with_head:
            joined |= ((member == g)[:, None] & (member == -1)) | (
                (member == -1)[:, None] & (member == g)
            )
    joined[HEAD + 6 * GROUPS[-1][1] :] = False
    half = rng.standard_normal((size, size))
    full = aligned(size, size)
    full[:] = np.where(joined, half @ half.T / size, 0.0)
    return full


def random_rows(n, size, rng, most=3):
    """Rows on lines and blocks (arrays of ``made``, dense (n, size)), and their order."""
    line = rng.integers(-1, MESHES - 1, n)  # the last gear mesh has no pair
    along = np.where(line >= 0, rng.standard_normal(n), 0.0)
    beyond = rng.integers(0, 2, n)
    width = beyond + rng.integers(0, most, n)
    width[line < 0] += width[line < 0] == beyond[line < 0]  # such a row touches something
    width[-3:], line[-3:] = beyond[-3:], 1  # the last ones only have lines
    at, part = np.zeros((2, n, most + 1), dtype=np.int64)
    coef = rng.standard_normal((n, most + 1, 6))
    rows = np.zeros((n, size))
    for i in range(n):
        if line[i] >= 0:
            rows[i, PORTS + 2 * line[i] : PORTS + 2 * line[i] + 2] = 1.0, along[i]
        for a in range(beyond[i], width[i]):
            slot = rng.choice(np.r_[0:3, 4:7])
            at[i, a], part[i, a] = HEAD + 6 * slot, int(slot >= GROUPS[1][0])
            rows[i, at[i, a] : at[i, a] + 6] += coef[i, a]
    first = [at[i, beyond[i] : width[i]].min(initial=size) for i in range(n)]
    order = np.argsort(first, kind="stable")[: np.count_nonzero(width > beyond)]
    since, reach = np.zeros((2, n), dtype=np.int64)
    for p, i in enumerate(order):
        since[p] = first[i] - first[i] % LINE
        last = max(at[j, a] + 6 for j in order[p:] for a in range(beyond[j], width[j]))
        reach[p] = whole_lines(last)
    return (line, along, at, part, coef, width, beyond), rows, (order, since, reach)


def check_contact_matrix(g, r, linked, n, which, work, rng):
    parts, rows, (order, since, reach) = random_rows(n, len(g), rng)
    low, high = (HEAD + 6 * np.array([s[e] for s in GROUPS]) for e in range(2))
    k, f = rng.uniform(1.0, 2.0, n), rng.uniform(0.0, 0.5, n)
    out = aligned(n + 7, whole_lines(n + 1))
    out[:] = np.nan
    made(
        g, r, parts, (order.astype(np.uint64), since, reach), (low, high, np.array(linked)),
        PORTS + 2 * (parts[0].max() + 1), n, len(order), k, f, which, work, out,
    )  # fmt: skip
    of_g, of_r = rows @ g @ rows.T, rows @ r @ rows.T
    expected = np.eye(n) + (k + f)[:, None] * of_g - f[:, None] * of_r
    scale = np.abs(expected).max()
    np.testing.assert_allclose(out[:n, :n], expected, rtol=0, atol=1e-13 * scale)
    at_port = (k + f) * (rows @ g)[:, PORTS - 1] - f * (rows @ r)[:, PORTS - 1]
    np.testing.assert_allclose(out[:n, n], at_port, rtol=0, atol=1e-13 * scale)


@pytest.mark.parametrize("linked", [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_contact_matrix_is_the_dense_one(linked, rng):
    g, r = channel_matrix(linked, rng), channel_matrix(linked, rng)
    work = contact_work(MESHES, 17, 4, len(g))
    work.image[:], work.image_r[:] = np.nan, np.nan
    check_contact_matrix(g, r, linked, 17, 0, work, rng)


def test_contact_matrix_follows_pairs_and_receptance(rng):
    """What lines answer is held from call to call: same pairs, other pairs, fewer, another G."""
    linked = (1, 0)
    g, other, r = (channel_matrix(linked, rng) for _ in range(3))
    work = contact_work(MESHES, 17, 4, len(g))
    for matrix, n, which in ((g, 17, 0), (g, 17, 0), (g, 16, 0), (other, 16, 1), (g, 16, 0)):
        check_contact_matrix(matrix, r, linked, n, which, work, np.random.default_rng(n))
    check_contact_matrix(g, r, linked, 16, 0, work, np.random.default_rng(2))  # other lines
    work.known[:] = -1
    check_contact_matrix(other, r, linked, 16, 0, work, np.random.default_rng(2))


@njit
def products(shapes, modes, matrix, head, lines, top, ranges, groups, a, b, forces, out):
    span, rigid, elastic = ranges
    low, high, linked = groups
    moved(shapes, head, span, low, high, rigid, elastic, a, out[0])
    moved(shapes, head, span, low, high, rigid, elastic, b, out[1])
    pushed(modes, lines, span, low, high, rigid, elastic, forces, out[2])
    answered(matrix, lines, head, low, high, linked, top, forces, out[3])


@pytest.mark.parametrize("linked", [(0, 0), (1, 1)])
def test_products_with_modes_are_the_dense_ones(linked, rng):
    """Groups move in their own modes, whose ranges neither begin nor end with a cache line."""
    rigid, ends, n = 5, ((7, 21), (21, 30)), 30
    matrix = channel_matrix(linked, rng)
    size, count = len(matrix), whole_lines(n)
    lines, (start, stop) = HEAD - 3, (HEAD, HEAD + 6 * GROUPS[-1][1])
    modes, shapes = aligned(size, count), aligned(count, size)
    modes[:lines, :rigid] = rng.standard_normal((lines, rigid))
    modes[:lines, 7:30] = rng.standard_normal((lines, 23))
    for (first, last), (j, k) in zip(GROUPS, ends, strict=True):
        at = slice(HEAD + 6 * first, HEAD + 6 * last)
        modes[at, j:k] = rng.standard_normal((6 * (last - first), k - j))
    modes[HEAD : HEAD + 6 * GROUPS[0][1], :rigid] = 1.0
    shapes[:] = modes.T
    span = np.array(whole_ranges(rigid, 7, 30))
    ranges = [whole_ranges(r, *e) for r, e in zip((rigid, 0), ends, strict=True)]
    low, high = (HEAD + 6 * np.array([s[e] for s in GROUPS]) for e in range(2))
    a, b, forces = aligned(count), aligned(count), aligned(size)
    a[:n], b[:n] = rng.standard_normal((2, n))
    forces[:lines] = rng.standard_normal(lines)
    forces[start:stop] = rng.standard_normal(stop - start) * (np.abs(modes[start:stop]).sum(1) > 0)
    out = np.full((4, max(size, count)), np.nan)
    products(
        shapes, modes, matrix, HEAD, lines, stop,
        (span, np.array([r for r, _, _ in ranges]), np.array([e for _, *e in ranges])),
        (low, high, np.array(linked)), a, b, forces, out,
    )  # fmt: skip
    used = np.concatenate([np.arange(lines), *(np.arange(*e) for e in zip(low, high, strict=True))])
    for found, expected in (
        (out[0, used], (modes @ a)[used]),
        (out[1, used], (modes @ b)[used]),
        (out[2, :n], (modes.T @ forces)[:n]),
        (out[3, used], (matrix @ forces)[used]),
    ):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ((7, 28, 94), (8, 24, 96)),
        ((0, 7, 28), (0, 0, 32)),
        ((7, 7, 28), (8, 8, 32)),  # mode 7 stands with the rigid ones
        ((7, 7, 7), (8, 8, 8)),
        ((0, 0, 0), (0, 0, 0)),
    ],
)
def test_ranges_of_modes_hold_whole_lines_once(given, expected):
    assert whole_ranges(*given) == expected
