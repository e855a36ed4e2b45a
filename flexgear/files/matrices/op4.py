"""Nastran OP4: real matrices, written as text with 17 digits, read as text or binary.

Record of a matrix: NCOL, NROW (< 0: rows in two words), form, type (1 single, 2 double), name of
eight letters, in text the format of numbers; then columns ICOL, IROW, NW and NW words. IROW = 0 is
a sparse column of strings, each headed by its length and first row: (L, IROW), or L 65536 + IROW in
one word, with L the words of its numbers + 1. A column behind the last ends it. Source: MSC Nastran
DMAP guide, OUTPUT4.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping

import numpy as np

from flexgear.arrays import Array
from flexgear.model.errors import InputError

_PER_LINE, _WIDTH = 3, 23
_SQUARE, _SYMMETRIC, _RECTANGULAR = 1, 6, 2
_SINGLE, _DOUBLE = 1, 2
_KEY = 65536
_LEAST = 1e-99


def op4_text(matrices: Mapping[str, Array]) -> str:
    """Dense matrices as OP4 text; names are cut to eight letters.

    Numbers below 1e-99 are 0: their exponents do not fit the columns.
    """
    lines = []
    for name, matrix in matrices.items():
        rows, columns = matrix.shape
        form = _RECTANGULAR
        if rows == columns:
            form = _SYMMETRIC if np.array_equal(matrix, matrix.T) else _SQUARE
        head = f"{columns:8d}{rows:8d}{form:8d}{_DOUBLE:8d}{name.upper()[:8]:8s}"
        lines.append(f"{head}1P,{_PER_LINE}E{_WIDTH}.16")
        for k in range(columns):
            filled = np.flatnonzero(matrix[:, k])
            if len(filled):
                first, last = int(filled[0]), int(filled[-1])
                lines.append(f"{k + 1:8d}{first + 1:8d}{last - first + 1:8d}")
                lines += _lines(matrix[first : last + 1, k])
        lines.append(f"{columns + 1:8d}{1:8d}{1:8d}")
        lines += _lines(np.array([np.sqrt(2.0)]))
    return "\n".join(lines) + "\n"


def _lines(values: Array) -> list[str]:
    text = [f"{v:{_WIDTH}.16E}" for v in np.where(abs(values) < _LEAST, 0.0, values).tolist()]
    return ["".join(text[k : k + _PER_LINE]) for k in range(0, len(text), _PER_LINE)]


def read_op4(
    data: bytes, where: str, require: Callable[[tuple[int, int], str], None] = lambda *_: None
) -> dict[str, Array]:
    """All real matrices of a file by name. InputError for a file that is no whole OP4.

    require: refuses shapes (by name) before such a matrix is made.
    """
    binary = len(data) >= 8 and struct.unpack("<i", data[:4])[0] in (24, 24 << 24)
    matrices: dict[str, Array] = {}
    try:
        source: _Text | _Binary = _Binary(data) if binary else _Text(data)
        while not source.ended:
            name, matrix = _matrix(source, require)
            matrices[name] = matrix
    except (IndexError, ValueError, struct.error, UnicodeDecodeError) as error:
        raise InputError(
            where, "OP4", f"cannot be read: {error or 'it ends too early'}",
            "write real matrices with OUTPUT4, and the whole file",
        ) from None  # fmt: skip
    return matrices


def _matrix(
    source: _Text | _Binary, require: Callable[[tuple[int, int], str], None]
) -> tuple[str, Array]:
    columns, rows, kind, name = source.header()
    require((abs(rows), columns), name)
    if kind not in (_SINGLE, _DOUBLE):
        raise ValueError(f"{name} is complex")
    matrix = np.zeros((abs(rows), columns))
    words = kind  # of a number
    while True:
        column, row, count = source.column()
        if column > columns:
            source.numbers(count, kind)
            source.leave()
            return name, matrix
        if row > 0:
            values = source.numbers(source.dense(count, words), kind)
            matrix[row - 1 : row - 1 + len(values), column - 1] = values
            continue
        left = count
        while left > 0:
            length, first, used = source.string(wide=rows < 0)
            values = source.numbers((length - 1) // words, kind)
            matrix[first - 1 : first - 1 + len(values), column - 1] = values
            left -= used + len(values) * words


class _Text:
    """OP4 as text."""

    def __init__(self, data: bytes) -> None:
        self.lines = data.decode("ascii").splitlines()
        self.at, self.width = 0, _WIDTH
        self.per = _PER_LINE

    @property
    def ended(self) -> bool:
        """Whether nothing but blanks is left."""
        return not any(line.strip() for line in self.lines[self.at : self.at + 4])

    def _next(self) -> str:
        self.at += 1
        return self.lines[self.at - 1]

    def header(self) -> tuple[int, int, int, str]:
        """NCOL, NROW, type, name."""
        line = self._next()
        columns, rows, _, kind = (int(line[8 * k : 8 * k + 8]) for k in range(4))
        match = re.search(r"(\d+)[ED](\d+)\.", line[40:])
        if match is not None:
            self.per, self.width = int(match[1]), int(match[2])
        return columns, rows, kind, line[32:40].strip()

    def column(self) -> tuple[int, int, int]:
        """ICOL, IROW, NW."""
        line = self._next()
        return int(line[:8]), int(line[8:16]), int(line[16:24])

    @staticmethod
    def dense(count: int, words: int) -> int:
        """Numbers in a dense column: text counts numbers."""
        return count

    def string(self, wide: bool) -> tuple[int, int, int]:
        """L, IROW of a string and the words of its head."""
        line = self._next()
        if wide:
            return int(line[:8]), int(line[8:16]), 2
        key = int(line)
        return key // _KEY, key % _KEY, 1

    def numbers(self, count: int, kind: int) -> Array:
        """The next numbers; a line is theirs alone."""
        values: list[float] = []
        while len(values) < count:
            line = self._next().rstrip().replace("D", "E")
            values += [float(line[k : k + self.width]) for k in range(0, len(line), self.width)]
        return np.array(values[:count])

    def leave(self) -> None:
        """Nothing ends a matrix in text."""


class _Binary:
    """OP4 in Fortran records of either byte order, words of four bytes."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at, self.inside = data, 0, 0
        self.order = "<" if struct.unpack("<i", data[:4])[0] == 24 else ">"

    @property
    def ended(self) -> bool:
        """Whether the file is at its end."""
        return self.at >= len(self.data)

    def _ints(self, count: int) -> tuple[int, ...]:
        self.at += 4 * count
        return struct.unpack_from(f"{self.order}{count}i", self.data, self.at - 4 * count)

    def header(self) -> tuple[int, int, int, str]:
        """NCOL, NROW, type, name."""
        _, columns, rows, _, kind = self._ints(5)
        name = self.data[self.at : self.at + 8].decode("ascii").strip()
        self.at += 12
        return columns, rows, kind, name

    def column(self) -> tuple[int, int, int]:
        """ICOL, IROW, NW; the record before is left behind."""
        if self.inside:
            self.at = self.inside + 4
        (length,) = self._ints(1)
        self.inside = self.at + length
        if length < 12 or self.inside + 4 > len(self.data):
            raise ValueError("a record is not whole")
        column, row, count = self._ints(3)
        return column, row, count

    @staticmethod
    def dense(count: int, words: int) -> int:
        """Numbers in a dense column: binary counts words."""
        return count // words

    def string(self, wide: bool) -> tuple[int, int, int]:
        """L, IROW of a string and the words of its head."""
        if wide:
            length, row = self._ints(2)
            return length, row, 2
        (key,) = self._ints(1)
        return key // _KEY, key % _KEY, 1

    def numbers(self, count: int, kind: int) -> Array:
        """The next numbers; those of the last column end the matrix's records."""
        size = 8 if kind == _DOUBLE else 4
        if self.at + size * count > self.inside:
            count = (self.inside - self.at) // size
        values = np.frombuffer(self.data, f"{self.order}f{size}", count, self.at)
        self.at += size * count
        return values.astype(np.float64)

    def leave(self) -> None:
        """Behind the last record of a matrix."""
        self.at, self.inside = self.inside + 4, 0
