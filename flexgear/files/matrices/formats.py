"""Formats of matrices: Nastran OP4 and DMIG, Abaqus and CalculiX.

Nastran OP4: real matrices, written as text with 17 digits, read as text or binary. Record of a
matrix: NCOL, NROW (< 0: rows in two words), form, type (1 single, 2 double), name of eight letters,
in text the format of numbers; then columns ICOL, IROW, NW and NW words. IROW = 0 is a sparse column
of strings, each headed by its length and first row: (L, IROW), or L 65536 + IROW in one word, where
L − 1 is the number of words of its values. A column beyond the last ends the matrix. Source: MSC
Nastran DMAP guide, OUTPUT4.

Nastran DMIG bulk data: real matrices by grid point and component. DMIG NAME 0 IFO TIN …, then
columns DMIG NAME GJ CJ _ G1 C1 A1 _ G2 C2 A2 …; IFO 6 is symmetric, given as one triangle. Fields
have 8 letters, or 16 (DMIG*), or are separated by commas; component 0 is a scalar point, which is a
modal coordinate. Source: MSC Nastran quick reference guide.

Abaqus and CalculiX: lines "node, component, node, component, value" of *MATRIX GENERATE, or *USER
ELEMENT with the dofs of its nodes and *MATRIX, TYPE=STIFFNESS or MASS with one triangle row by row,
as *SUBSTRUCTURE MATRIX OUTPUT writes.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.files.matrices.body import NodeTable, require_form
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
        problem = f"cannot be read: {_reason(error)}"
        remedy = "write real matrices with OUTPUT4, and give the complete file"
        raise InputError(where, "OP4", problem, remedy) from None
    return matrices


def _reason(error: Exception) -> str:
    """Why a file cannot be read, in words."""
    ended = isinstance(error, IndexError) or not str(error)
    return "it ends too early" if ended else str(error)


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


NodeDof = tuple[int, int]  # node id and component 1 to 6, or 0 for a modal coordinate


@dataclass
class Entries:
    """Entries of one matrix by dofs of row and column; symmetric: only one triangle is stored."""

    symmetric: bool
    values: dict[tuple[NodeDof, NodeDof], float] = field(default_factory=dict)

    def matrix(self, table: NodeTable, where: str) -> NDArray[np.float64]:
        """The matrix (d, d), its nodes in the order of the table, followed by modal coordinates."""
        rows = {(node, c): 6 * k + c - 1 for k, node in enumerate(table.ids) for c in range(1, 7)}
        dofs = {dof for pair in self.values for dof in pair}
        extra = sorted(dofs - {*rows}, key=lambda dof: _order(dof, table))
        unknown = [dof for dof in extra if dof[1] != 0]
        if unknown:
            node, component = unknown[0]
            if node in table.ids:
                problem = f"node {node} has a dof {component} in the matrices"
                raise InputError(where, "nodes", problem, "export six dofs of each, 1 to 6")
            problem = f"the matrices name node {node}, which the table lacks"
            raise InputError(where, "nodes", problem, "give a table of all their nodes")
        rows |= {dof: 6 * len(table.ids) + k for k, dof in enumerate(extra)}
        require_form((len(rows), len(rows)), where, "", table)
        dense = np.zeros((len(rows), len(rows)))
        for (row, column), value in self.values.items():
            dense[rows[row], rows[column]] = value
            if self.symmetric:
                dense[rows[column], rows[row]] = value
        return dense


def _order(dof: NodeDof, table: NodeTable) -> tuple[int, int]:
    """Sort key of modal coordinates: their order in the table, then their ids."""
    number = table.mode_ids.index(dof[0]) if dof[0] in table.mode_ids else len(table.mode_ids)
    return number, dof[0]


def read_dmig(text: str, where: str) -> dict[str, Entries]:
    """All real DMIG matrices of bulk data, by name."""
    matrices: dict[str, Entries] = {}
    try:
        for card in _cards(text):
            name, first = card[1].upper(), card[2].strip()
            if first in ("", "0"):
                if int(card[4] or 1) > 2:
                    raise ValueError(f"{name} is complex")
                matrices[name] = Entries(symmetric=int(card[3]) == _SYMMETRIC)
                continue
            column = int(first), int(card[3] or 0)
            for k in range(5, len(card) - 2, 4):
                if card[k].strip():
                    row = int(card[k]), int(card[k + 1] or 0)
                    matrices[name].values[row, column] = _number(card[k + 2])
    except (IndexError, KeyError, ValueError) as error:
        remedy = "write real DMIG cards with their header"
        raise InputError(where, "DMIG", f"cannot be read: {error}", remedy) from None
    return matrices


def _cards(text: str) -> list[list[str]]:
    """DMIG cards with their continuation lines, as fields; field 0 is the card's name."""
    cards: list[list[str]] = []
    inside = False
    for raw in text.splitlines():
        line = raw.split("$")[0].rstrip()
        if not line:
            continue
        if re.match(r"DMIG\b", line, re.IGNORECASE):
            cards.append(_fields(line))
            inside = True
        elif inside and line[0] in "*+ ,":
            cards[-1] += _fields(line)[1:]
        else:
            inside = False
    return cards


def _fields(line: str) -> list[str]:
    """The fields of a line without the last one, which names the continuation line."""
    if "," in line:
        return [f.strip() for f in (line.split(",") + [""] * 9)[:9]]
    wide = "*" in line[:8]
    step, count = (16, 4) if wide else (8, 8)
    body = line[8:].ljust(step * count)
    return [line[:8].strip(), *(body[k * step : (k + 1) * step].strip() for k in range(count))]


def _number(text: str) -> float:
    """A number of Nastran, which writes 1.2-5 and 1.2D-5 for 1.2e-5."""
    text = text.strip().upper().replace("D", "E")
    return float(re.sub(r"(?<=[0-9.])([+-])", r"E\1", text) if "E" not in text else text)


def read_abaqus(text: str, where: str) -> dict[str, Entries]:
    """Matrices of a file by name: "STIFFNESS", "MASS", or "MATRIX" if the file states no name."""
    try:
        if re.search(r"^\s*\*\s*USER ELEMENT", text, re.IGNORECASE | re.MULTILINE):
            return _user_element(text)
        return {"MATRIX": _entry_list(text)}
    except (ValueError, IndexError) as error:
        problem = f"cannot be read: {_reason(error)}"
        remedy = "write it with *MATRIX OUTPUT, FORMAT=MATRIX INPUT or *SUBSTRUCTURE MATRIX OUTPUT"
        raise InputError(where, "matrix", problem, remedy) from None


def _entry_list(text: str) -> Entries:
    """A matrix from lines "node, component, node, component, value"."""
    rows = [
        re.split(r"[,\s]+", line.strip().rstrip(","))
        for line in text.splitlines()
        if line.strip() and line.strip()[0] not in "*#%"
    ]
    if {len(row) for row in rows} != {5}:
        raise ValueError("some lines do not have five numbers")
    entries = Entries(symmetric=False)
    for a, i, b, j, value in rows:
        pair = (int(a), int(i)), (int(b), int(j))
        entries.values[pair] = float(value.replace("D", "E"))
    entries.symmetric = not any(
        row != column and (column, row) in entries.values for row, column in entries.values
    )
    return entries


def _user_element(text: str) -> dict[str, Entries]:
    """Matrices by type from *USER ELEMENT with the dofs of its nodes, and *MATRIX."""
    nodes: list[int] = []
    dofs: list[NodeDof] = []
    state = ""
    numbers: list[float] = []
    blocks: list[tuple[str, list[float]]] = []
    for raw in text.splitlines():
        line = raw.strip()
        if line.upper().startswith("** ELEMENT NODES"):
            state = "nodes"
        elif state == "nodes" and line.startswith("**") and re.search(r"\d", line):
            nodes += [int(n) for n in re.findall(r"\d+", line)]
        elif line.startswith("**") or not line:
            continue
        elif line.startswith("*"):
            kind = re.match(r"\*\s*MATRIX\s*,\s*TYPE\s*=\s*(\w+)", line, re.IGNORECASE)
            numbers = []
            state = "dofs" if line.upper().replace(" ", "").startswith("*USERELEMENT") else ""
            if kind is not None:
                state = "matrix"
                blocks.append((kind[1].upper(), numbers))
        elif state == "dofs":
            _dofs(line, nodes, dofs)
        elif state == "matrix":
            numbers += [float(v.replace("D", "E")) for v in re.split(r"[,\s]+", line) if v]
    if not blocks:
        raise ValueError("there is no *MATRIX")
    return {name: _triangle(values, dofs) for name, values in blocks}


def _dofs(line: str, nodes: list[int], dofs: list[NodeDof]) -> None:
    """Append the dofs of a line of *USER ELEMENT: components of the first node, or the number of a
    node and its components."""
    values = [int(v) for v in re.split(r"[,\s]+", line.strip(", ")) if v]
    if not dofs:
        first = nodes[0] if nodes else 1
        dofs += [(first, component) for component in values]
        return
    number, components = values[0], values[1:]
    node = nodes[number - 1] if nodes else number
    dofs += [(node, component) for component in components]


def _triangle(values: list[float], dofs: list[NodeDof]) -> Entries:
    """A symmetric matrix from the rows of its lower triangle."""
    size = len(dofs)
    if len(values) != size * (size + 1) // 2:
        raise ValueError(f"{len(values)} numbers are not the triangle of {size} rows")
    pairs = ((dofs[row], dofs[column]) for row, column in zip(*np.tril_indices(size), strict=True))
    return Entries(symmetric=True, values=dict(zip(pairs, values, strict=True)))
