"""Abaqus and CalculiX input decks: nodes, solid elements, sets and surfaces.

meshio is not used here: it reads neither ``*SURFACE`` nor element numbers, and writes element names
that CalculiX refuses. Solid elements are right-handed; a named patch is a surface of (element,
face) pairs, which may be inside the body.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.model.errors import InputError, echo
from flexgear.structures.fe_mesh.fe_mesh import FACETS_VTK, FeMesh, facet_keys

_TYPES = {  # element name -> meshio's cell type, number of nodes
    "C3D8": ("hexahedron", 8),
    "C3D20": ("hexahedron20", 20),
    "C3D4": ("tetra", 4),
    "C3D10": ("tetra10", 10),
    "C3D6": ("wedge", 6),
    "C3D15": ("wedge15", 15),
    "S3": ("triangle", 3),
    "S4": ("quad", 4),
    "S6": ("triangle6", 6),
    "STRI65": ("triangle6", 6),
    "S8": ("quad8", 8),
    "SFM3D3": ("triangle", 3),
    "SFM3D4": ("quad", 4),
    "SFM3D6": ("triangle6", 6),
    "SFM3D8": ("quad8", 8),
}
_SUFFIXES = ("RH", "IH", "MH", "R5", "R", "I", "H", "M", "RS", "T")
MOST_NUMBERS = 10**8  # largest number of members of a set


@dataclass
class InpDeck:
    """Content of a deck. points (n, 3) in the deck's unit; blocks: cell types and rows (k, v) of
    points; groups: facets of 3 or 4 points by name, from surfaces and from sets of shell or
    membrane elements; node_sets: points by name. Points are numbered from 0."""

    points: Array
    blocks: list[tuple[str, Ints]]
    groups: dict[str, list[Ints]] = field(default_factory=dict)
    node_sets: dict[str, Ints] = field(default_factory=dict)


def write_inp(fe_mesh: FeMesh, stream: TextIO) -> None:
    """Write C3D8 or C3D4 elements in the set EALL, and every patch as ``*SURFACE`` and node set."""
    stream.write("*HEADING\nflexgear FE mesh, units m\n*NODE, NSET=NALL\n")
    for i, (x, y, z) in enumerate(fe_mesh.points.tolist(), 1):
        stream.write(f"{i}, {_number(x)}, {_number(y)}, {_number(z)}\n")
    name = "C3D8" if fe_mesh.kind == "hex" else "C3D4"
    stream.write(f"*ELEMENT, TYPE={name}, ELSET=EALL\n")
    for i, row in enumerate((fe_mesh.vtk_cells + 1).tolist(), 1):
        stream.write(f"{i}, {', '.join(map(str, row))}\n")
    faces = len(FACETS_VTK[fe_mesh.kind])
    keys, first = np.unique(facet_keys(fe_mesh.every_facet, len(fe_mesh.points)), return_index=True)
    for patch, ids in fe_mesh.facets.items():
        numbers = first[np.searchsorted(keys, facet_keys(ids, len(fe_mesh.points)))]
        stream.write(f"*SURFACE, NAME={patch}, TYPE=ELEMENT\n")
        for k in numbers.tolist():
            stream.write(f"{k // faces + 1}, S{k % faces + 1}\n")
        nodes = (np.unique(ids) + 1).tolist()
        stream.write(f"*NSET, NSET=N_{patch}\n")
        for start in range(0, len(nodes), 8):
            stream.write(", ".join(map(str, nodes[start : start + 8])) + ",\n")


def _number(x: float) -> str:
    """A number with all digits where CalculiX's limit of 20 characters allows, else with 14."""
    text = repr(x)
    return text if len(text) <= 20 else f"{x:.13e}"


def read_inp(path: Path) -> InpDeck:
    """Nodes, elements, sets and element surfaces of a deck; other cards are ignored. InputError for
    cards that cannot be read."""
    return _Reader(path).read()


class _Reader:
    """Reader of one deck, card by card."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.node_position: dict[int, int] = {}
        self.coordinates: list[list[float]] = []
        self.elements: dict[int, tuple[str, list[int]]] = {}
        self.element_sets: dict[str, list[int]] = {}
        self.node_sets: dict[str, list[int]] = {}
        self.surfaces: dict[str, list[tuple[str, str]]] = {}
        self.names: dict[str, str] = {}  # upper case -> as written

    def read(self) -> InpDeck:
        for keyword, options, rows in _cards(self.path):
            try:
                self._card(keyword, options, rows)
            except (ValueError, KeyError, IndexError, OverflowError) as error:
                raise InputError(
                    str(self.path), f"*{keyword}", f"cannot be read ({error})", "check the card"
                ) from error
        return self._deck()

    def _card(self, keyword: str, options: dict[str, str], rows: list[list[str]]) -> None:
        if keyword == "NODE":
            for row in rows:
                self.node_position[int(row[0])] = len(self.coordinates)
                place = [float(x.replace("D", "E")) for x in (*row[1:4], "0", "0", "0")]
                self.coordinates.append(place[:3])
        elif keyword == "ELEMENT":
            self._element(options, rows)
        elif keyword in ("ELSET", "NSET"):
            sets = self.element_sets if keyword == "ELSET" else self.node_sets
            into = sets.setdefault(self._name(options[keyword]), [])
            for row in rows:
                if "GENERATE" in options:
                    a, b, step = ([int(x) for x in row] + [1])[:3]
                    if len(range(a, b + 1, step)) > MOST_NUMBERS:
                        raise ValueError(f"{a} to {b} are more numbers than a mesh has")
                    into.extend(range(a, b + 1, step))
                else:
                    for x in row:
                        members = [int(x)] if x.isdecimal() else sets[x.upper()]
                        if len(into) + len(members) > MOST_NUMBERS:
                            raise ValueError(f"{x} makes more numbers than a mesh has")
                        into.extend(members)
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
            into_surface = self.surfaces.setdefault(self._name(options["NAME"]), [])
            into_surface.extend((row[0], (row + [""])[1].upper()) for row in rows)

    def _name(self, name: str) -> str:
        return self.names.setdefault(name.upper(), name.strip('"')).upper()

    def _element(self, options: dict[str, str], rows: list[list[str]]) -> None:
        name = options["TYPE"].upper()
        base = next((name[: -len(s)] for s in _SUFFIXES if name[: -len(s)] in _TYPES), name)
        base = name if name in _TYPES else base
        if base not in _TYPES:
            problem = f"type {name} is not known"
            raise InputError(str(self.path), "*ELEMENT", problem, "use C3D8/20 or C3D4/10")
        kind, size = _TYPES[base]
        numbers = [int(x) for row in rows for x in row]
        if len(numbers) % (size + 1):
            raise ValueError(f"{name} elements need {size} nodes each")
        ids = np.array(numbers, dtype=np.int64).reshape(-1, size + 1)
        for number, *nodes in ids.tolist():
            self.elements[number] = (kind, [self.node_position[n] for n in nodes])
        if "ELSET" in options:
            members = self.element_sets.setdefault(self._name(options["ELSET"]), [])
            members.extend(ids[:, 0].tolist())

    def _deck(self) -> InpDeck:
        by_kind: dict[str, list[list[int]]] = {}
        for kind, nodes in self.elements.values():
            by_kind.setdefault(kind, []).append(nodes)
        blocks = [(kind, np.array(rows, dtype=np.int64)) for kind, rows in by_kind.items()]
        deck = InpDeck(np.array(self.coordinates, dtype=float).reshape(-1, 3), blocks)
        for name, members in self.element_sets.items():
            corners = [self._shell(e) for e in members if e in self.elements]
            facets = [c for c in corners if c is not None]
            if facets and len(facets) == len(corners):
                deck.groups[self.names[name]] = facets
        for name, pairs in self.surfaces.items():
            deck.groups[self.names[name]] = [
                self._face(element, face) for which, face in pairs for element in self._of(which)
            ]
        for name, nodes in self.node_sets.items():
            at = [self.node_position[n] for n in nodes if n in self.node_position]
            deck.node_sets[self.names[name]] = np.array(at, dtype=np.int64)
        return deck

    def _of(self, which: str) -> list[int]:
        """Numbers of an element, given by its number, or of the elements of a named set."""
        return [int(which)] if which.isdecimal() else self.element_sets.get(which.upper(), [])

    def _shell(self, element: int) -> Ints | None:
        kind, nodes = self.elements[element]
        corners = next((n for k, n in (("triangle", 3), ("quad", 4)) if kind.startswith(k)), None)
        return None if corners is None else np.array(nodes[:corners], dtype=np.int64)

    def _face(self, element: int, face: str) -> Ints:
        if element not in self.elements:
            problem = f"element {element} is not there"
            raise InputError(str(self.path), "*SURFACE", problem, "check the surface")
        shell = self._shell(element)
        if shell is not None:
            return shell
        kind, nodes = self.elements[element]
        table = FACETS_VTK.get(kind[:3], ())  # hexahedron, tetra
        faces = {f"S{i}": facet for i, facet in enumerate(table, 1)}
        if face not in faces:
            problem = f"{echo(face)} is no face of a {kind}"
            raise InputError(str(self.path), "*SURFACE", problem, "use S1 to S6")
        return np.array([nodes[i] for i in faces[face]], dtype=np.int64)


def _cards(path: Path) -> Iterator[tuple[str, dict[str, str], list[list[str]]]]:
    """Keyword, options and data rows of each card; a keyword line that ends with a comma continues
    on the next line."""
    keyword, options, rows = "", {}, []  # type: str, dict[str, str], list[list[str]]
    pending = ""
    with path.open(encoding="utf-8", errors="replace") as stream:
        for raw in stream:
            line = raw.strip()
            if not line or line.startswith("**"):
                continue
            if line.startswith("*") or pending:
                if pending:
                    line, pending = pending + line, ""
                elif keyword:
                    yield keyword, options, rows
                if line.endswith(","):
                    pending = line
                    continue
                head, *rest = [part.strip() for part in line[1:].split(",")]
                keyword, rows = head.upper(), []
                options = {}
                for part in rest:
                    key, _, value = part.partition("=")
                    options[key.strip().upper()] = value.strip()
            else:
                rows.append([part.strip() for part in line.split(",") if part.strip()])
    if keyword:
        yield keyword, options, rows
