r"""Shapes that the patch of a loaded node takes beside its rigid motion, and a motion of the node
that loads of these shapes leave alone.

The node of an averaging tie has the mean rigid motion q = B u of its patch. Loads on it, B^T w,
also shear, bend, turn and stretch the patch along the face, p = B_s u, with Legendre polynomials

    e_r P_k,   e_t P_k,   [e_z x (x - x_c)] P_k,   y e_t P_k

of 2 z/b in axes that follow the patch's middle x_c(z), y across it; the best rigid motion within
each is taken off. Of pins only shear is taken, for how they bend within their seats and how that
distributes the load is the bearing's; and the shape (cos 2 phi, sin 2 phi) along and across a load,
by which pressure, cos phi e_n, differs from an even load.

So a load at one end of a tooth, B^T w + B_s^T s, moves q by T_qp s more than its wrench w on the
node does: 2 to 4 % on thin rims that are held at one end. The motion

    q' = q + A p,   A = -T_qp T_pp^{-1},   T_q'p = 0,

feels only the wrench, as far as these shapes go. With P = B_s Psi of constraint modes and
C = B_s K^{-1} B_s^T, the interface held, on supports S

    T_qq = (K_bb + S)^{-1},   T_qp = T_qq P^T,   T_pp = P T_qq P^T + C,

so that other supports need no other reduction. A load w' on q' is B^T w' + B_s^T A^T w', so that
with q' = W q + A C A^T w'

    T_q'q' = W T_qq W^T + D,   D = A C A^T in the blocks of loaded nodes:

the stiffness on W q with springs D in series at the loaded nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from flexgear.structures.kinematics import rigid_motion
from flexgear.structures.tooth_shapes import ToothLine

Array = NDArray[np.float64]

Orders = Mapping[str, tuple[int, ...]]  # of polynomials by kind of shape
OF_TEETH: Orders = {"radial": (1, 2, 3), "across": (1, 2, 3), "turn": (1, 2), "stretch": (0, 1)}
OF_PINS: Orders = {"radial": (1,), "across": (1,), "round": (0,), "askew": (0,)}
_RESOLVED = 1e-8  # of the largest eigenvalue, below which a patch does not have a shape


@dataclass(frozen=True, eq=False)
class PatchShapes:
    """Of the loaded nodes (n,) of a body, which come one after the other from `first` on.

    motion: P (n, s, b) of s shapes, components along the axes of each patch; flexibility: C (s, s),
    alike for all.
    """

    first: int
    motion: Array = field(repr=False)
    flexibility: Array = field(repr=False)

    def weights(self, flexibility: Array) -> Array:
        """A (n, 6, s); flexibility: T_qq (b, b)."""
        answer = self.motion @ flexibility  # T_pq of all nodes (n, s, b)
        own = answer @ self.motion.swapaxes(1, 2) + self.flexibility
        inverse = np.linalg.pinv(own, rcond=_RESOLVED, hermitian=True)
        at_node = np.take_along_axis(answer, self.dofs[:, None], axis=2)
        return np.asarray(-at_node.swapaxes(1, 2) @ inverse)

    @property
    def dofs(self) -> NDArray[np.int64]:
        """(n, 6) of the loaded nodes."""
        nodes = self.first + np.arange(len(self.motion))
        return 6 * nodes[:, None] + np.arange(6)

    def moved(self, weights: Array) -> Array:
        """W (b, b) with A (n, 6, s)."""
        out = np.eye(self.motion.shape[2])
        out[self.dofs.ravel()] += (weights @ self.motion).reshape(-1, len(out))
        return out

    def in_series(self, weights: Array) -> Array:
        """D of every loaded node (n, 6, 6)."""
        return np.asarray(weights @ self.flexibility @ weights.swapaxes(1, 2))

    def inner(self, stiffness: Array, weights: Array) -> tuple[Array, Array]:
        """q = G q' (b, b) while nothing acts but on nodes, and the stiffness (b, b) on q'.

        stiffness: K_bb; with K = W^{-T} K_bb W^{-1} and D at the loaded nodes l,
        (W q)_l = q'_l - D (K W q)_l.
        """
        at, series = self.dofs.ravel(), self.in_series(weights)
        back = np.linalg.inv(self.moved(weights))
        rigid = back.T @ stiffness @ back
        soft = np.zeros_like(rigid)  # D K
        soft[at] = (series @ rigid[at].reshape(len(series), 6, -1)).reshape(len(at), -1)
        give = np.linalg.solve(np.eye(len(at)) + soft[np.ix_(at, at)], soft[at])
        out = rigid - rigid[:, at] @ give
        before = np.eye(len(rigid))
        before[at] -= give
        return back @ before, 0.5 * (out + out.T)


def patch_rows(line: ToothLine, points: Array, weights: Array, orders: Orders) -> Array:
    """B_s as (s, m, 3) on displacements of points (m, 3) with areas weights (m,).

    Their face width is what the points span; that of the line does not count.
    """
    shapes = _shapes(line, points, orders)
    rigid = rigid_motion(points - line.place)
    less = np.linalg.solve(_inner(weights, rigid, rigid), _inner(weights, rigid, shapes))
    beside = shapes - rigid @ less
    size = np.sqrt(np.diag(_inner(weights, shapes, shapes)))
    gram = _inner(weights, beside / size, beside / size)
    inverse = np.linalg.pinv(gram, rcond=_RESOLVED, hermitian=True)
    rows = np.einsum("m,mck,kl->lmc", weights, beside / size, inverse)
    return np.asarray(rows / size[:, None, None])


def without_rigid(motion: Array, positions: Array) -> Array:
    """P (n, s, b) less what rounding makes of rigid motion; positions (b/6, 3) m."""
    length = np.linalg.norm(positions, axis=1).max()
    scale = np.tile([1.0, 1.0, 1.0, length, length, length], len(positions))
    turning = np.broadcast_to(np.eye(6)[3:], (len(positions), 3, 6))
    rigid = np.concatenate([rigid_motion(positions), turning], axis=1).reshape(-1, 6)
    basis = np.linalg.qr(scale[:, None] * rigid)[0]
    scaled = motion / scale
    return np.asarray((scaled - (scaled @ basis) @ basis.T) * scale)


def _shapes(line: ToothLine, points: Array, orders: Orders) -> Array:
    """S (m, 3, s) without units: turn and stretch over the distance from the middle."""
    radial, across, turned = line.sections(points)
    away = points - line.radius * radial
    x, y = (np.einsum("mi,mi->m", away, axis)[:, None] for axis in (radial, across))
    motions = {
        "radial": radial,
        "across": across,
        "turn": turned,
        "stretch": y * across,
        "round": (x**2 - y**2) * radial + 2 * x * y * across,
        "askew": 2 * x * y * radial + (y**2 - x**2) * across,
    }
    low, high = points[:, 2].min(), points[:, 2].max()
    height = legvander((2 * points[:, 2] - low - high) / (high - low), 3)
    return np.concatenate(
        [motions[name][:, :, None] * height[:, None, list(k)] for name, k in orders.items()],
        axis=2,
    )


def _inner(weights: Array, one: Array, two: Array) -> Array:
    return np.asarray(np.einsum("m,mci,mcj->ij", weights, one, two))
