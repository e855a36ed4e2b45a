"""Root stress of the teeth of a gear mesh per force of the slices of its contact lines, and of an
FE ring by the motion of its body, as rows on its coordinates.

With the motion u(x) = Φ_r(x) q of the body at the cut of the submodel, which stands at tooth j
turned by φ_j about the axis,

    σ = Σ_c S_u,c · R(φ_j)ᵀ u(R(φ_j) x_c),

less what rounding leaves of rigid motion. The cut lies so deep that what the body's own FE mesh
lacks there, the true shape of the teeth, no longer counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from flexgear.gears.contact import GearMeshPath
from flexgear.gears.slices import Slices
from flexgear.model.stage_view import StageView
from flexgear.structures.kinematics import rotation
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.surface_strain import FieldAt
from flexgear.structures.tooth_influence.of_case import root_of_case
from flexgear.structures.tooth_influence.pairs import mating_flanks, some_places, widths
from flexgear.structures.tooth_influence.root_stress import HALF_TURN, RootInfluence

Array = NDArray[np.float64]

_PLACES = 126  # contact lines of the table; linear between


@dataclass(frozen=True, eq=False)
class PairRoots:
    """Of one gear of a gear mesh.

    name: "planet", "sun" or "ring"; sense: 1 where −θ flanks are loaded, else −1; step: teeth in +θ
    from one pair to the next. s: (S,) path coordinates, m, rising; stress: (S, K, 3, 2, rows, q)
    Pa/N of a tooth per force of a slice on the tooth before, on itself and on the next in +θ; in
    the fillet under the loaded flank, then in the other; q layer borders along the face at
    z (q,) m.
    """

    name: str
    sense: int
    step: int
    s: Array
    stress: Array
    z: Array

    def of(self, s: Array, force: Array) -> Array:
        """σ (n, 3, 2, rows, q) Pa by pairs at s (n,) with forces (n, K) N: in the tooth after their
        own, in their own and in the one before; fillets as in ``stress``."""
        (n, count), flat = force.shape, self.stress.reshape(len(self.s) * force.shape[1], -1)
        at = np.clip(np.searchsorted(self.s, s) - 1, 0, len(self.s) - 2)
        far = np.clip((s - self.s[at]) / np.diff(self.s)[at], 0.0, 1.0)[:, None]
        columns = count * at[:, None] + np.arange(count)
        entries = np.concatenate([(1.0 - far) * force, far * force], axis=1)
        places = np.concatenate([columns, columns + count], axis=1)
        starts = 2 * count * np.arange(n + 1)
        shares = sp.csr_matrix((entries.ravel(), places.ravel(), starts), (n, len(flat)))
        return np.asarray(shares @ flat).reshape(n, *self.stress.shape[2:])


def pair_roots(view: StageView, path: GearMeshPath, slices: Slices) -> list[PairRoots]:
    """Of the planet, then of its mate; the cut stands still."""
    width, some = widths(path, slices), some_places(slices, _PLACES)
    roots = []
    for flank in mating_flanks(path, slices):
        root = flank.of(root_of_case(view, flank.name))
        stress = root.per_force(flank.roll[some], slices.z[some], width[some])
        pair_root = PairRoots(
            flank.name, flank.sense, flank.step, slices.s[some], stress, root.flank.z
        )
        roots.append(pair_root)
    return roots


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
