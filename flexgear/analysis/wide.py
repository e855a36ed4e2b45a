"""Sums of matrix rows, eight numbers at a time, as vector instructions.

The compiler vectorises plain loops over such sums too, but for long lines: it rules out overlap of
every pair of lines first, takes sixteen numbers at a time and the rest one by one. Lines of a time
step are 8 to 100 numbers long, and all that took several times what the sums do.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

WIDE = 8  # numbers taken at once: a cache line
_FUSED = ("contract", "reassoc", "nsz")


def _is_line(array: Any, dimensions: int) -> bool:
    """Whether numbers of a row stand side by side."""
    return (
        isinstance(array, types.Array)
        and array.dtype == types.float64
        and array.ndim == dimensions
        and array.layout == "C"
    )


def _sum_of_rows(out: Any, at: Any, matrix: Any, first: Any, factors: Any, *, onto: bool) -> Any:
    """Signature and code of ``out[at : at + 8] (+)= Σ factors[i] matrix[first + i, at : at + 8]``.

    None, which numba reports as wrong types, where lines are not contiguous.
    """
    if not (_is_line(out, 1) and _is_line(matrix, 2) and isinstance(factors, types.UniTuple)):
        return None
    of = types.UniTuple(types.float64, len(factors))

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        to, place, source, row, shares = arguments
        vector = ir.VectorType(ir.DoubleType(), WIDE)
        lanes = ir.Constant(ir.VectorType(ir.IntType(32), WIDE), [0] * WIDE)

        def line(pointer: Any, offset: Any) -> Any:
            start = builder.gep(pointer, [offset])
            return builder.bitcast(start, vector.as_pointer())

        target = context.make_array(out)(context, builder, to)
        table = context.make_array(matrix)(context, builder, source)
        width = cgutils.unpack_tuple(builder, table.shape, 2)[1]
        offset = builder.add(builder.mul(row, width), place)
        here = line(target.data, place)
        total = builder.load(here, align=8) if onto else None
        for share in cgutils.unpack_tuple(builder, shares, len(of)):
            single = builder.insert_element(
                ir.Constant(vector, ir.Undefined), share, ir.Constant(ir.IntType(32), 0)
            )
            spread = builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined), lanes)
            part = builder.fmul(
                spread, builder.load(line(table.data, offset), align=8), flags=_FUSED
            )
            total = part if total is None else builder.fadd(total, part, flags=_FUSED)
            offset = builder.add(offset, width)
        builder.store(total, here, align=8)
        return context.get_dummy_value()

    return types.void(out, types.intp, matrix, types.intp, of), code


@intrinsic
def add_rows(typing: Any, out: Any, at: Any, matrix: Any, first: Any, factors: Any) -> Any:
    """out[at : at + 8] += Σ_i factors[i] · matrix[first + i, at : at + 8], unchecked."""
    return _sum_of_rows(out, at, matrix, first, factors, onto=True)


@intrinsic
def put_rows(typing: Any, out: Any, at: Any, matrix: Any, first: Any, factors: Any) -> Any:
    """out[at : at + 8] = Σ_i factors[i] · matrix[first + i, at : at + 8], unchecked."""
    return _sum_of_rows(out, at, matrix, first, factors, onto=False)


@intrinsic
def clear(typing: Any, out: Any, at: Any) -> Any:
    """out[at : at + 8] = 0, unchecked."""
    if not _is_line(out, 1):
        return None

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        to, place = arguments
        target = context.make_array(out)(context, builder, to)
        vector = ir.VectorType(ir.DoubleType(), WIDE)
        start = builder.gep(target.data, [place])
        builder.store(ir.Constant(vector, [0.0] * WIDE), builder.bitcast(start, vector.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(out, types.intp), code
