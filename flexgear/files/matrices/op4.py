"""Nastran OP4: real matrices, written as text with 17 digits, read as text or binary.

Record of a matrix: NCOL, NROW (< 0: rows in two words), form, type (1 single, 2 double), name of
eight letters, in text the format of numbers; then columns ICOL, IROW, NW and NW words. IROW = 0 is
a sparse column of strings, each headed by its length and first row: (L, IROW), or L 65536 + IROW in
one word, where L − 1 is the number of words of its values. A column beyond the last ends the
matrix. Source: MSC Nastran DMAP guide, OUTPUT4.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping

import numpy as np

from flexgear.arrays import Array
from flexgear.model.errors import InputError

_PER_LINE, _WIDTH = 3, 23  # numbers on a line, characters of a number
_SQUARE, _SYMMETRIC, _RECTANGULAR = 1, 6, 2
_SINGLE, _DOUBLE = 1, 2
_STRING_FACTOR = 65536  # of the length in the one-word header of a string
_MIN_VALUE = 1e-99  # smallest with a two-digit exponent


def op4_text(matrices: Mapping[str, Array]) -> str:
    """Dense matrices as OP4 text; names are cut to eight letters. Numbers below 1e-99 are written
    as 0, since three-digit exponents do not fit the columns."""
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
    text = [f"{v:{_WIDTH}.16E}" for v in np.where(abs(values) < _MIN_VALUE, 0.0, values).tolist()]
    return ["".join(text[k : k + _PER_LINE]) for k in range(0, len(text), _PER_LINE)]


def read_op4(
    data: bytes, where: str, require: Callable[[tuple[int, int], str], None] = lambda *_: None
) -> dict[str, Array]:
    """All real matrices of an OP4 file by name; InputError for a damaged or complex file. require:
    called with shape and name before a matrix is allocated; raises if they are wrong."""
    binary = len(data) >= 8 and struct.unpack("<i", data[:4])[0] in (24, 24 << 24)
    matrices: dict[str, Array] = {}
    try:
        source: _Text | _Binary = _Binary(data) if binary else _Text(data)
        while not source.ended:
            name, matrix = _matrix(source, require)
            matrices[name] = matrix
    except (IndexError, ValueError, struct.error, UnicodeDecodeError) as error:
        ended = isinstance(error, IndexError) or not str(error)
        problem = f"cannot be read: {'it ends too early' if ended else error}"
        remedy = "write real matrices with OUTPUT4, and give the complete file"
        raise InputError(where, "OP4", problem, remedy) from None
    return matrices


def _matrix(
    source: _Text | _Binary, require: Callable[[tuple[int, int], str], None]
) -> tuple[str, Array]:
    columns, rows, kind, name = source.header()
    require((abs(rows), columns), name)
    if kind not in (_SINGLE, _DOUBLE):
        raise ValueError(f"{name} is complex")
    matrix = np.zeros((abs(rows), columns))
    while True:
        column, row, count = source.column()
        if column > columns:
            source.numbers(count, kind)
            return name, matrix
        if row > 0:
            values = source.numbers(count // source.words(kind), kind)
            matrix[row - 1 : row - 1 + len(values), column - 1] = values
            continue
        while count > 0:  # strings of numbers, each headed by L and IROW, or both in one word
            if rows < 0:
                (length, first), used = source.integers(2), 2
            else:
                (key,) = source.integers(1)
                length, first, used = key // _STRING_FACTOR, key % _STRING_FACTOR, 1
            values = source.numbers((length - 1) // kind, kind)
            matrix[first - 1 : first - 1 + len(values), column - 1] = values
            count -= used + len(values) * kind


class _Text:
    """Reader of OP4 text."""

    def __init__(self, data: bytes) -> None:
        self.lines = data.decode("ascii").splitlines()
        self.position, self.width = 0, _WIDTH

    @property
    def ended(self) -> bool:
        """Whether only blank lines follow."""
        return not any(line.strip() for line in self.lines[self.position : self.position + 4])

    def _next_line(self) -> str:
        self.position += 1
        return self.lines[self.position - 1]

    def header(self) -> tuple[int, int, int, str]:
        """NCOL, NROW, type, name."""
        line = self._next_line()
        columns, rows, _, kind = (int(line[8 * k : 8 * k + 8]) for k in range(4))
        match = re.search(r"\d+[ED](\d+)\.", line[40:])
        if match is not None:
            self.width = int(match[1])
        return columns, rows, kind, line[32:40].strip()

    def column(self) -> tuple[int, ...]:
        """ICOL, IROW, NW of the next column."""
        return self.integers(3)

    def integers(self, count: int) -> tuple[int, ...]:
        """Integers in the next line, which begins a column or a string of its entries."""
        line = self._next_line()
        return tuple(int(line[8 * k : 8 * k + 8] if count > 1 else line) for k in range(count))

    def words(self, kind: int) -> int:
        """Words per number in the count NW of a dense column."""
        return 1

    def numbers(self, count: int, kind: int) -> Array:
        """The next ``count`` numbers, which begin on a new line and end with a line."""
        values: list[float] = []
        while len(values) < count:
            line = self._next_line().rstrip().replace("D", "E")
            values += [float(line[k : k + self.width]) for k in range(0, len(line), self.width)]
        return np.array(values[:count])


class _Binary:
    """Reader of binary OP4: Fortran records of either byte order, words of four bytes."""

    def __init__(self, data: bytes) -> None:
        self.data, self.position, self.record_end = data, 0, -4
        self.order = "<" if struct.unpack("<i", data[:4])[0] == 24 else ">"

    @property
    def ended(self) -> bool:
        """Whether all records have been read."""
        return self.record_end + 4 >= len(self.data)

    def integers(self, count: int) -> tuple[int, ...]:
        """The next ``count`` words as integers."""
        self.position += 4 * count
        return struct.unpack_from(f"{self.order}{count}i", self.data, self.position - 4 * count)

    def _next_record(self) -> None:
        """Skip the rest of the record and read the length of the next one."""
        self.position = self.record_end + 4
        (length,) = self.integers(1)
        self.record_end = self.position + length
        if length < 12 or self.record_end + 4 > len(self.data):
            raise ValueError("a record is incomplete")

    def header(self) -> tuple[int, int, int, str]:
        """NCOL, NROW, type, name."""
        self._next_record()
        columns, rows, _, kind = self.integers(4)
        return columns, rows, kind, self.data[self.position :][:8].decode("ascii").strip()

    def column(self) -> tuple[int, ...]:
        """ICOL, IROW, NW of the next record."""
        self._next_record()
        return self.integers(3)

    def words(self, kind: int) -> int:
        """Words per number in the count NW of a dense column."""
        return kind

    def numbers(self, count: int, kind: int) -> Array:
        """The next ``count`` numbers, or fewer at the end of the record."""
        size = 8 if kind == _DOUBLE else 4
        if self.position + size * count > self.record_end:
            count = (self.record_end - self.position) // size
        values = np.frombuffer(self.data, f"{self.order}f{size}", count, self.position)
        self.position += size * count
        return values.astype(np.float64)
