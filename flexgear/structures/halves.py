"""The ring of a double-helical stage: its left half (−z) and the mirror image as one body.

Halves are two rings with supports of their own; nothing of the body lies between them. With the
reflection z → −z of a node's motion, S = diag(1, 1, −1, −1, −1, 1), which leaves fixed-interface
modes as they are, the right half has M' = S M S, K' = S K S, Ψ' = diag(1, 1, −1) Ψ S. What the left
half calls "tooth_001", "bolt_01" is "tooth_left_001", "bolt_left_01" in the whole, and
"tooth_right_001", … its image.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from flexgear.model.names import SIDES
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.springs import Spring

Array = NDArray[np.float64]
MIRROR = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])  # of a node's motion, in the plane z = 0
PLACE = MIRROR[:3]


def mirrored(springs: Sequence[Spring]) -> list[Spring]:
    """Springs of the left half on nodes of both: those of the right are their mirror image."""
    left = [Spring(s.node.of_half("left"), s.matrix, s.angle) for s in springs]
    across = np.outer(MIRROR, MIRROR)
    return left + [Spring(s.node.of_half("right"), across * s.matrix, s.angle) for s in springs]


def both_halves(half: ReducedBody, offset: float) -> ReducedBody:
    """Both halves as one body; offset: of their mid-planes from z = 0, m.

    Coordinates: six of every node of the left half, of the right, then their modes. ``report`` is
    that of one half; the loads of its static check are left out.
    """
    nodes, inner = half.interface_dofs, half.n_modes
    sign = np.concatenate([np.tile(MIRROR, len(half.node_names)), np.ones(inner)])
    # both halves one after the other -> nodes of both, then modes of both
    coordinates = np.arange(nodes + inner)
    order = np.concatenate(
        [
            coordinates[:nodes],
            nodes + inner + coordinates[:nodes],
            coordinates[nodes:],
            nodes + inner + coordinates[nodes:],
        ]
    )
    across = np.outer(sign, sign)
    lift = np.array([0.0, 0.0, offset])
    return half.with_(
        node_names=tuple(n.of_half(side) for side in SIDES for n in half.nodes),
        positions=np.vstack([half.positions - lift, half.positions * PLACE + lift]),
        mass=_in_order(block_diag(half.mass, across * half.mass), order),
        stiffness=_in_order(block_diag(half.stiffness, across * half.stiffness), order),
        n_modes=2 * inner,
        points=np.vstack([half.points - lift, half.points * PLACE + lift]),
        cells=np.vstack([half.cells, half.cells + len(half.points)]),
        recovery=_recovery(half, sign.astype(np.float32), order),
        probe_cases=(),
        probe_loads=np.zeros((2, 0, 0)),
    )


def _in_order(matrix: Array, order: NDArray[np.int64]) -> Array:
    return np.ascontiguousarray(matrix[np.ix_(order, order)])


def _recovery(
    half: ReducedBody, sign: NDArray[np.float32], order: NDArray[np.int64]
) -> NDArray[np.float32]:
    rows = np.tile(PLACE.astype(np.float32), len(half.points))
    image = rows[:, None] * half.recovery * sign
    whole = np.zeros((2 * len(half.recovery), 2 * half.recovery.shape[1]), dtype=np.float32)
    whole[: len(half.recovery), : half.recovery.shape[1]] = half.recovery
    whole[len(half.recovery) :, half.recovery.shape[1] :] = image
    return whole[:, order]
