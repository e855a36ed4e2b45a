"""A free reduced body by the rigid motion of its mean axes and elastic coordinates beside it.

    u = R r + Φ e,   K Φ = M Φ diag(ω²),   Φᵀ M Φ = 1,   Rᵀ M Φ = 0

R: rigid motion of the body about the origin of its frame, r its six components; Φ: all modes of
the free body but the six rigid ones. Mean axes move by r; relative to them the body has neither
momentum nor angular momentum. A body may then turn with its axes by any angle while e stays small.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.model.names import BodyName
from flexgear.structures.bodies import Body
from flexgear.structures.kinematics import rotation, turn
from flexgear.structures.reduced import ReducedBody

Array = NDArray[np.float64]


def elastic_modes(reduced: ReducedBody) -> tuple[Array, Array]:
    """ω² (m,) in rad²/s², rising, and Φ (d, m) of a free body, m = d − 6.

    Φ e are coordinates of the reduced body, which ``recover`` and ``strain`` take.
    """
    values, shapes = linalg.eigh(reduced.stiffness, reduced.mass)
    values, shapes = values[6:], shapes[:, 6:]
    rigid = reduced.rigid_modes()
    momentum = rigid.T @ reduced.mass
    return values, shapes - rigid @ np.linalg.solve(momentum @ rigid, momentum @ shapes)


def floating(reduced: ReducedBody, name: BodyName, turned: float = 0.0) -> Body:
    """The body in coordinates q = [r (6), e (m)]: M = diag(M_6, 1), K = diag(0, ω²).

    name: of the body and of its first node, which moves with the mean axes, by r, at the origin;
    the nodes of the reduced body follow, each with its elastic displacement alone, Φ e. turned:
    angle of the body's axes about z from those of r and of all nodes, rad.
    """
    values, shapes = elastic_modes(reduced)
    rigid = reduced.rigid_modes()
    nodes = shapes[: reduced.interface_dofs].reshape(-1, 6, len(values))
    size = 6 + len(values)
    return Body(
        name=name,
        node_names=(name, *reduced.node_names),
        positions=np.vstack([np.zeros(3), reduced.positions @ rotation(turned).T]),
        mass=linalg.block_diag(
            turn(turned) @ rigid.T @ reduced.mass @ rigid @ turn(turned).T, np.eye(len(values))
        ),
        stiffness=np.diag(np.concatenate([np.zeros(6), values])),
        node_map=linalg.block_diag(np.eye(6), (turn(turned) @ nodes).reshape(-1, len(values))),
        rigid_motions=np.eye(size, 6),
    )
