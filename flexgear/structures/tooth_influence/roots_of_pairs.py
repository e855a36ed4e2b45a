"""Root stress of the teeth of a gear mesh per force of the slices of its contact lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.gears.contact import GearMeshPath
from flexgear.gears.slices import Slices
from flexgear.model.stage_view import StageView
from flexgear.structures.tooth_influence.of_case import root_of_case
from flexgear.structures.tooth_influence.pairs import mating_flanks, some_places, widths

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
