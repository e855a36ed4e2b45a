"""Springs that hold ring and carrier, for the coupled system and the error estimates alike.

A spring acts on the motion of one interface node against its surroundings, in axes turned about z:
those of a bolt point outward along the radius, tangentially and along z.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexgear.model.names import NodeName
from flexgear.model.ring_supports import ring_supports
from flexgear.model.stage_view import StageView
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


def ring_springs(view: StageView) -> list[Spring]:
    """All that holds the ring, see `model/ring_supports.py`."""
    supports = ring_supports(view.ring, view.stage.face_width)
    return [Spring(s.node, np.diag(s.stiffness), s.angle) for s in supports]


def carrier_springs(view: StageView) -> list[Spring]:
    """Bearings of the carrier, in fixed axes."""
    return [
        Spring(NodeName.parse(f"bearing_{side}"), np.asarray(bearing.matrix))
        for side, bearing in view.seat_bearings.items()
    ]


def stiffness_at(springs: list[Spring], node_names: tuple[str, ...]) -> Array:
    """Stiffness (6 n, 6 n) of springs to ground at the nodes of a body."""
    out = np.zeros((6 * len(node_names),) * 2)
    for spring in springs:
        at = slice(6 * node_names.index(spring.node), 6 * node_names.index(spring.node) + 6)
        out[at, at] += spring.in_body
    return out
