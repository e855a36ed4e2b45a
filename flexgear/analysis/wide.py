"""Sums of matrix rows, eight numbers at a time, as vector instructions.

The compiler vectorises plain loops over such sums too, but for long lines: it first rules out that
lines overlap, takes sixteen numbers or more at a time and the rest one by one. Lines of a time step
are 8 to 100 numbers long. Nothing is checked here: callers keep whole groups of eight at hand.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

WIDE = 8  # numbers taken at once: a cache line
_EIGHT = ir.VectorType(ir.DoubleType(), WIDE)
_FUSED = ("contract", "reassoc", "nsz")


def aligned(*shape: int) -> NDArray[np.float64]:
    """Zeros that begin at a cache line, so that whole lines of numbers are whole cache lines."""
    size = int(np.prod(shape))
    room = np.zeros(size + WIDE)
    start = -(room.ctypes.data // room.itemsize) % WIDE
    return room[start : start + size].reshape(shape)


def _is_line(array: Any, dimensions: int) -> bool:
    """Whether numbers of a row stand side by side."""
    return (
        isinstance(array, types.Array)
        and array.dtype == types.float64
        and array.ndim == dimensions
        and array.layout == "C"
    )


def _from(builder: Any, pointer: Any, offset: Any) -> Any:
    """Where the eight numbers from ``offset`` on are."""
    return builder.bitcast(builder.gep(pointer, [offset]), _EIGHT.as_pointer())


def _repeated(builder: Any, number: Any) -> Any:
    """Eight times the same number."""
    index = ir.IntType(32)
    empty = ir.Constant(_EIGHT, ir.Undefined)
    first = builder.insert_element(empty, number, ir.Constant(index, 0))
    lanes = ir.Constant(ir.VectorType(index, WIDE), [0] * WIDE)
    return builder.shuffle_vector(first, empty, lanes)


def _sum_of_rows(builder: Any, data: Any, offset: Any, width: Any, factors: list[Any]) -> Any:
    """Σ factors[i] · (eight numbers from offset + i width on), and where the next row begins."""
    total = None
    for factor in factors:
        line = builder.load(_from(builder, data, offset), align=8)
        part = builder.fmul(factor, line, flags=_FUSED)
        total = part if total is None else builder.fadd(total, part, flags=_FUSED)
        offset = builder.add(offset, width)
    return total, offset


@intrinsic
def add_rows(typing: Any, out: Any, at: Any, matrix: Any, first: Any, factors: Any) -> Any:
    """out[at : at + 8] += Σ_i factors[i] · matrix[first + i, at : at + 8]; factors: a tuple."""
    if not (_is_line(out, 1) and _is_line(matrix, 2) and isinstance(factors, types.UniTuple)):
        return None  # reported as wrong types
    shares = types.UniTuple(types.float64, len(factors))

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        to, at, source, first, factors = arguments
        target = context.make_array(out)(context, builder, to)
        table = context.make_array(matrix)(context, builder, source)
        width = cgutils.unpack_tuple(builder, table.shape, 2)[1]
        here = _from(builder, target.data, at)
        spread = [_repeated(builder, f) for f in cgutils.unpack_tuple(builder, factors)]
        begin = builder.add(builder.mul(first, width), at)
        total, _ = _sum_of_rows(builder, table.data, begin, width, spread)
        before = builder.load(here, align=8)
        builder.store(builder.fadd(before, total, flags=_FUSED), here, align=8)
        return context.get_dummy_value()

    return types.void(out, types.intp, matrix, types.intp, shares), code


@intrinsic
def put_paired(
    typing: Any, out: Any, at: Any, matrix: Any, first: Any, factors: Any, along: Any
) -> Any:
    """out[at : at + 8] = Σ_i factors[i] · (matrix[first + i] + along · matrix[first + k + i]).

    factors: a tuple of k; the second k rows are multiplied number by number with ``along``.
    """
    if not (_is_line(out, 1) and _is_line(along, 1) and _is_line(matrix, 2)):
        return None
    if not isinstance(factors, types.UniTuple):
        return None
    shares = types.UniTuple(types.float64, len(factors))

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        to, at, source, first, factors, other = arguments
        target = context.make_array(out)(context, builder, to)
        table = context.make_array(matrix)(context, builder, source)
        beside = context.make_array(along)(context, builder, other)
        width = cgutils.unpack_tuple(builder, table.shape, 2)[1]
        spread = [_repeated(builder, f) for f in cgutils.unpack_tuple(builder, factors)]
        begin = builder.add(builder.mul(first, width), at)
        plain, begin = _sum_of_rows(builder, table.data, begin, width, spread)
        turned, _ = _sum_of_rows(builder, table.data, begin, width, spread)
        by = builder.load(_from(builder, beside.data, at), align=8)
        total = builder.fadd(plain, builder.fmul(turned, by, flags=_FUSED), flags=_FUSED)
        builder.store(total, _from(builder, target.data, at), align=8)
        return context.get_dummy_value()

    return types.void(out, types.intp, matrix, types.intp, shares, along), code


@intrinsic
def clear(typing: Any, out: Any, at: Any) -> Any:
    """out[at : at + 8] = 0."""
    if not _is_line(out, 1):
        return None

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        to, at = arguments
        target = context.make_array(out)(context, builder, to)
        builder.store(ir.Constant(_EIGHT, [0.0] * WIDE), _from(builder, target.data, at), align=8)
        return context.get_dummy_value()

    return types.void(out, types.intp), code
