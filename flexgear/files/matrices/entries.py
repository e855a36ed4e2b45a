"""Matrix entries by (node, component), put into the order of a table of nodes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexgear.files.matrices.nodes import NodeTable
from flexgear.files.matrices.sound import require_form
from flexgear.model.errors import InputError

Place = tuple[int, int]


@dataclass
class Entries:
    """Entries of one matrix; component 0: a modal coordinate; symmetric: given as one triangle."""

    symmetric: bool
    values: dict[tuple[Place, Place], float] = field(default_factory=dict)

    def add(self, row: Place, column: Place, value: float) -> None:
        """One entry."""
        self.values[row, column] = value

    def matrix(self, table: NodeTable, where: str) -> NDArray[np.float64]:
        """The matrix (d, d) with rows in the table's order, modal coordinates behind the nodes."""
        rows = {(node, c): 6 * k + c - 1 for k, node in enumerate(table.ids) for c in range(1, 7)}
        named = {place for pair in self.values for place in pair}
        extra = sorted({*named} - {*rows}, key=lambda p: _order(p, table))
        lost = [node for node, component in extra if component != 0]
        if lost:
            raise InputError(
                where, "nodes", f"the matrices name node {lost[0]}, which the table lacks",
                "give a table of all their nodes",
            )  # fmt: skip
        rows |= {place: 6 * len(table.ids) + k for k, place in enumerate(extra)}
        require_form((len(rows), len(rows)), where, "", table)
        dense = np.zeros((len(rows), len(rows)))
        for (row, column), value in self.values.items():
            dense[rows[row], rows[column]] = value
            if self.symmetric:
                dense[rows[column], rows[row]] = value
        return dense


def _order(place: Place, table: NodeTable) -> tuple[int, int]:
    number = table.mode_ids.index(place[0]) if place[0] in table.mode_ids else len(table.mode_ids)
    return number, place[0]
