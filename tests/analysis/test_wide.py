"""Vector instructions against sums of rows by numpy."""

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from flexgear.analysis.wide import WIDE, add_rows, aligned, clear, put_paired

ROWS, LONG = 7, 5 * WIDE


@njit
def added(out, at, matrix, first, factors):
    add_rows(out, at, matrix, first, factors)


@njit
def paired(out, at, matrix, first, factors, along):
    put_paired(out, at, matrix, first, factors, along)


@njit
def cleared(out, at):
    clear(out, at)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.mark.parametrize("count", [1, 2, 3, 6])
@pytest.mark.parametrize("at", [0, 3, LONG - WIDE])  # lines need not begin with a cache line
def test_sums_of_rows(count, at, rng):
    matrix, before = rng.standard_normal((ROWS, LONG)), rng.standard_normal(LONG)
    factors, inside = rng.standard_normal(count), slice(at, at + WIDE)
    out = before.copy()
    added(out, at, matrix, 1, tuple(factors))
    expected = before[inside] + factors @ matrix[1 : 1 + count, inside]
    np.testing.assert_allclose(out[inside], expected, rtol=0, atol=1e-14)
    out[inside] = before[inside]
    np.testing.assert_array_equal(out, before)  # nothing else was touched


@pytest.mark.parametrize("at", [0, 3, LONG - WIDE])
def test_sums_of_rows_of_which_half_are_multiplied(at, rng):
    matrix, along = rng.standard_normal((ROWS, LONG)), rng.standard_normal(LONG)
    factors, out, inside = rng.standard_normal(3), np.full(LONG, 7.0), slice(at, at + WIDE)
    paired(out, at, matrix, 1, tuple(factors), along)
    expected = factors @ (matrix[1:4] + along * matrix[4:7])
    np.testing.assert_allclose(out[inside], expected[inside], rtol=0, atol=1e-14)
    out[inside] = 7.0
    assert (out == 7.0).all()


def test_aligned_begins_with_a_cache_line():
    for shape in ((3,), (5, 9), (2, 3, 8)):
        array = aligned(*shape)
        assert array.shape == shape and array.ctypes.data % 64 == 0 and not array.any()


def test_clear_touches_eight_numbers(rng):
    out = rng.uniform(1.0, 2.0, LONG)
    cleared(out, 11)
    np.testing.assert_array_equal(np.flatnonzero(out == 0.0), np.arange(11, 11 + WIDE))


def test_an_output_may_be_a_row_of_the_matrix(rng):
    matrix = rng.standard_normal((ROWS, LONG))
    expected = matrix[4] - 2.0 * matrix[1] + 0.5 * matrix[2]
    for at in range(0, LONG, WIDE):
        added(matrix[4], at, matrix, 1, (-2.0, 0.5))
    np.testing.assert_allclose(matrix[4], expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("out", "matrix"),
    [
        (np.zeros(2 * LONG)[::2], np.zeros((ROWS, LONG))),
        (np.zeros(LONG), np.zeros((LONG, ROWS)).T),
        (np.zeros(LONG), np.zeros((ROWS, LONG), dtype=np.float32)),
    ],
)
def test_numbers_that_are_not_side_by_side_are_refused(out, matrix):
    with pytest.raises(TypingError):
        added(out, 0, matrix, 0, (1.0,))
