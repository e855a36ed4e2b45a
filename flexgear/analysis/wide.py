"""Sums of matrix rows, eight numbers at a time, as vector instructions.

The compiler vectorises plain loops over such sums too, but for long lines: it first rules out that
lines overlap, takes sixteen numbers or more at a time and the rest one by one. Lines of a time step
are 8 to 100 numbers long. Nothing is checked here: callers keep whole groups of eight at hand.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

WIDE = 8  # numbers taken at once: a cache line
_EIGHT = ir.VectorType(ir.DoubleType(), WIDE)
_FUSED = ("contract", "reassoc", "nsz")


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


def _sum_of_rows(out: Any, matrix: Any, factors: Any, *, onto: bool) -> Any:
    """Signature and code of ``out[at : at + 8] (+)= Σ factors[i] matrix[first + i, at : at + 8]``.

    None, which numba reports as wrong types, where numbers of a row are not side by side.
    """
    if not (_is_line(out, 1) and _is_line(matrix, 2) and isinstance(factors, types.UniTuple)):
        return None
    shares = types.UniTuple(types.float64, len(factors))

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        to, at, source, first, factors = arguments
        target = context.make_array(out)(context, builder, to)
        table = context.make_array(matrix)(context, builder, source)
        width = cgutils.unpack_tuple(builder, table.shape, 2)[1]
        offset = builder.add(builder.mul(first, width), at)
        here = _from(builder, target.data, at)
        total = builder.load(here, align=8) if onto else None
        for factor in cgutils.unpack_tuple(builder, factors, len(shares)):
            line = builder.load(_from(builder, table.data, offset), align=8)
            part = builder.fmul(_repeated(builder, factor), line, flags=_FUSED)
            total = part if total is None else builder.fadd(total, part, flags=_FUSED)
            offset = builder.add(offset, width)
        builder.store(total, here, align=8)
        return context.get_dummy_value()

    return types.void(out, types.intp, matrix, types.intp, shares), code


@intrinsic
def add_rows(typing: Any, out: Any, at: Any, matrix: Any, first: Any, factors: Any) -> Any:
    """out[at : at + 8] += Σ_i factors[i] · matrix[first + i, at : at + 8]; factors: a tuple."""
    return _sum_of_rows(out, matrix, factors, onto=True)


@intrinsic
def put_rows(typing: Any, out: Any, at: Any, matrix: Any, first: Any, factors: Any) -> Any:
    """out[at : at + 8] = Σ_i factors[i] · matrix[first + i, at : at + 8]; factors: a tuple."""
    return _sum_of_rows(out, matrix, factors, onto=False)


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
