"""Root stress of the teeth of an FE ring by the motion of its body, as rows on its coordinates.

With the motion u(x) = Φ_r(x) q of the body at the cut of the submodel, which stands at tooth j
turned by φ_j about the axis,

    σ = Σ_c S_u,c · R(φ_j)ᵀ u(R(φ_j) x_c),

less what rounding leaves of rigid motion. The cut lies so deep that what the body's own FE mesh
lacks there, the true shape of the teeth, no longer counts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from flexgear.structures.field_at import FieldAt
from flexgear.structures.kinematics import rotation
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.tooth_influence.root_stress import HALF_TURN, RootInfluence

Array = NDArray[np.float64]


def both_cuts(root: RootInfluence) -> Array:
    """S_u (2, rows, q, c, 3) Pa/m in the −θ and the +θ fillet, which half a turn about the tooth's
    radial axis makes of each other."""
    away, partner = cKDTree(root.cut_points).query(root.cut_points * HALF_TURN)
    assert np.all(away < 1e-6 * np.ptp(root.cut_points[:, 2]))
    return np.stack([root.cut, root.cut[:, ::-1, partner] * HALF_TURN])


def ring_root_rows(root: RootInfluence, body: ReducedBody, teeth: int) -> NDArray[np.float32]:
    """Stress (teeth, 2, rows, q, d) Pa in the −θ and +θ fillets of all teeth of a ring per reduced
    coordinate; tooth 0 stands on the x axis."""
    cuts, field = both_cuts(root), FieldAt(body)
    shape, rigid = cuts.shape[:3], body.rigid_modes()
    back = np.linalg.pinv(rigid)
    out = np.empty((teeth, int(np.prod(shape)), len(body.mass)), dtype=np.float32)
    flat = cuts.reshape(-1, *cuts.shape[3:])
    for j in range(teeth):
        turn = rotation(2 * np.pi * j / teeth)
        weights = field.weights(root.cut_points @ turn.T).tocsc()
        used = np.flatnonzero(np.diff(weights.indptr))
        of_vertices = np.stack(
            [weights[:, used].T @ part.T for part in _turned(flat, turn)], axis=1
        )
        recovery = np.asarray(body.recovery).reshape(-1, 3, len(body.mass))[used]
        rows = of_vertices.reshape(3 * len(used), -1).T.astype(np.float32) @ recovery.reshape(
            3 * len(used), -1
        )
        out[j] = rows - (rows @ rigid) @ back
    return out.reshape(teeth, *shape, -1)


def _turned(cuts: Array, turn: Array) -> Array:
    """S_u (p, c, 3) on displacements in the ring's axes, by component: (3, p, c)."""
    return np.moveaxis(cuts @ turn.T, 2, 0)
