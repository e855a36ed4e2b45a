"""Springs that hold bodies, for the coupled system and the error estimates alike.

A spring acts on the motion of one interface node against its surroundings, in axes turned about z:
those of a bolt point outward along the radius, tangentially and along z.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexgear.model.names import NodeName
from flexgear.structures.kinematics import turn

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Spring:
    """matrix: (6, 6) SI in axes that are turned by angle (rad) against those of the body."""

    node: NodeName
    matrix: Array = field(repr=False)
    angle: float = 0.0

    @property
    def axes(self) -> Array:
        """(6, 6) that takes a motion in the body's axes to the spring's."""
        return turn(self.angle).T

    @property
    def in_body(self) -> Array:
        """Stiffness (6, 6) in the body's axes."""
        return self.axes.T @ self.matrix @ self.axes


def stiffness_at(springs: list[Spring], node_names: tuple[str, ...]) -> Array:
    """Stiffness (6 n, 6 n) of springs to ground at the nodes of a body."""
    out = np.zeros((6 * len(node_names),) * 2)
    for spring in springs:
        at = slice(6 * node_names.index(spring.node), 6 * node_names.index(spring.node) + 6)
        out[at, at] += spring.in_body
    return out
