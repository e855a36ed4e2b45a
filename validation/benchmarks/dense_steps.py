r"""Steps in all coordinates with dense matrices: the usual ways for a stiffness that changes.

    (M + gamma h C + beta h^2 K + V^T W V + gamma h s o o^T) a = right,   W = beta h^2 k + gamma h c

"refactor": the matrix is summed and factorised by Cholesky at every step and every set of loaded
pairs; "woodbury": the inverse of the constant part is kept dense and updated by the few rows V.
Same rule, rows and sets as flexgear's step (`tests/reference_transient.py`).
"""

from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as sla
from numba import njit
from reference_transient import damping_matrix, law

from flexgear.analysis.kernels.step import BETA, GAMMA
from flexgear.analysis.transient import State
from flexgear.coupling.kernels.elements import pair_rows
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import carrying_flanks

Array = np.ndarray


@dataclass
class DenseSteps:
    """Matrices of a system for one step size, made once."""

    modal: ModalSystem
    torque: float
    time_step: float
    way: str
    base: Array = field(init=False)
    inverse: Array | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        system, h = self.modal.system, self.time_step
        self.damping = damping_matrix(system)
        self.base = system.mass + GAMMA * h * self.damping + BETA * h * h * system.stiffness
        if self.way == "woodbury":
            self.inverse = np.linalg.inv(self.base)

    def run(self, start: State, steps: int) -> Array:
        """Motion (d,) after some steps from the state of a flexgear run with all modes."""
        system, h, pairs = self.modal.system, self.time_step, self.modal.system.pairs
        q, v = self.modal.modes @ start.eta, self.modal.modes @ start.velocity
        brake = system.machines[-1]
        rows, flanks = pair_rows(pairs), carrying_flanks(pairs)
        weights = GAMMA * h * brake.rated_torque / brake.rated_speed
        slope = brake.rated_torque / brake.rated_speed
        o, drive = system.ports[-1].row, system.ports[0].row * self.torque
        vectors, k, c, offset = self._rows(rows, flanks, system.angles @ q)
        force, _, _ = law(k, c, vectors @ q + offset, vectors @ v)
        load = drive - o * slope * (o @ v)
        a = np.linalg.solve(
            system.mass, load - vectors.T @ force - self.damping @ v - system.stiffness @ q
        )
        left_rigid = system.rigid.T @ system.mass
        for _ in range(steps):
            rigid = system.rigid @ (left_rigid @ a)
            theta = system.angles @ (q + h * v + 0.5 * h * h * rigid)
            vectors, k, c, offset = self._rows(rows, flanks, theta)
            star = q + h * v + (0.5 - BETA) * h * h * a
            star_v = v + (1 - GAMMA) * h * a
            free = drive - o * slope * (o @ star_v)
            free = free - self.damping @ star_v - system.stiffness @ star
            ka, ca = k, c
            damped = self._solver(vectors, BETA * h * h * k + GAMMA * h * c, weights)
            for _ in range(50):
                active = ka > 0
                solve = damped
                if not np.array_equal(ka[active], k[active]):
                    solve = self._solver(vectors, BETA * h * h * ka + GAMMA * h * ca, weights)
                explicit = ka * (vectors @ star + offset) + ca * (vectors @ star_v)
                a = solve(free - vectors[active].T @ explicit[active], active)
                delta = vectors @ (star + BETA * h * h * a) + offset
                _, kb, cb = law(k, c, delta, vectors @ (star_v + GAMMA * h * a))
                if np.array_equal(ka, kb) and np.array_equal(ca, cb):
                    break
                ka, ca = kb, cb
            q, v = star + BETA * h * h * a, star_v + GAMMA * h * a
        return q

    def _rows(self, rows, flanks, theta):
        system = self.modal.system
        n, _ = build_rows(system.pairs, rows, theta, flanks)
        vectors = np.zeros((n, system.size))
        expand(rows.coef, rows.blocks, rows.row["width"], system.blocks, vectors)
        return (
            vectors,
            rows.row["stiffness"][:n].copy(),
            rows.row["damping"][:n].copy(),
            rows.row["offset"][:n].copy(),
        )

    def _solver(self, vectors: Array, weight: Array, brake: float):
        """right, active -> accelerations; what does not depend on the set is done once."""
        o = self.modal.system.ports[-1].row
        if self.way == "refactor":

            def refactor(right: Array, active: Array) -> Array:
                va = vectors[active]
                left = self.base + (va.T * weight[active]) @ va + brake * np.outer(o, o)
                factor = sla.cho_factor(left, lower=True, overwrite_a=True, check_finite=False)
                return sla.cho_solve(factor, right, check_finite=False)

            return refactor
        wide = np.vstack([vectors, o])
        image = self.inverse @ wide.T
        inner = wide @ image
        scale = np.append(weight, brake)

        def woodbury(right: Array, active: Array) -> Array:
            on = np.flatnonzero(np.append(active, True))
            y = self.inverse @ right
            small = inner[np.ix_(on, on)] + np.diag(1 / scale[on])
            return y - image[:, on] @ np.linalg.solve(small, wide[on] @ y)

        return woodbury


@njit(cache=True)
def expand(coef, blocks, width, block_rows, out):
    """Rows V (n, d) in all coordinates from their coefficients on contact blocks."""
    for i in range(out.shape[0]):
        for a in range(width[i]):
            for p in range(6):
                f = coef[i, a, p]
                if f != 0.0:
                    line = block_rows[6 * blocks[i, a] + p]
                    for j in range(out.shape[1]):
                        out[i, j] += f * line[j]
