"""Springs between nodes: constant links, supports that turn against a frame, bearings with a law.

A support of a turning node on the fixed frame has energy ½ qᵀ R(θ)ᵀ K R(θ) q. Its mean over θ is
invariant to rotation and belongs to the constant stiffness; the rest becomes rows λ w wᵀ that are
rotated at every evaluation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.laws import LAW_NUMBERS, LAWS
from flexgear.coupling.laws.law import CENTERING
from flexgear.model.bearings import Bearing, at_height
from flexgear.structures.bodies import turn

ANY = 1.0  # Pa·s, where only the laws' names are asked for


def invariant_part(matrix: Array) -> Array:
    """Mean of R(θ)ᵀ K R(θ) over a turn; harmonics up to 2θ, so eight angles are exact."""
    angles = np.arange(8) * np.pi / 4
    turned = np.array([turn(a).T @ matrix @ turn(a) for a in angles])
    return np.asarray(turned.mean(axis=0))


def joint_parts(matrix: Array) -> tuple[Array, Array]:
    """Mean over independent turns of both ends of a (12, 12) joint stiffness, and the rest.

    The mean keeps each end's own invariant part and the coupling of axial motion and of torsion;
    the rest (lateral coupling between the ends) depends on the difference of the angles.
    """
    mean = np.zeros((12, 12))
    mean[:6, :6] = invariant_part(matrix[:6, :6])
    mean[6:, 6:] = invariant_part(matrix[6:, 6:])
    for i in (2, 5):
        for j in (2, 5):
            mean[i, 6 + j], mean[6 + j, i] = matrix[i, 6 + j], matrix[6 + j, i]
    return mean, matrix - mean


def behind_spline(joint: Array, spline: Array, end: int) -> Array:
    """(12, 12) stiffness of a joint with a spline (6, 6) in series at end 0 or 1.

    The node between them has no mass: it is where the sum of its forces vanishes,
    K' = K_aa − K_ab K_bb⁺ K_ba. Where neither resists a motion of that node, no force passes.
    """
    full = np.zeros((18, 18))  # both ends of the whole, then the node between
    inner = [12, 13, 14, 15, 16, 17]
    dofs = list(range(6 * end, 6 * end + 6))
    ends = [*inner, *range(6, 12)] if end == 0 else [*range(6), *inner]
    full[np.ix_(ends, ends)] += joint
    all_dofs = [*dofs, *inner]
    full[np.ix_(all_dofs, all_dofs)] += np.kron([[1.0, -1.0], [-1.0, 1.0]], spline)
    middle, across = full[12:, 12:], full[:12, 12:]
    resisted = np.diag(middle)  # N/m and N·m/rad: one scale for both
    scale = 1.0 / np.sqrt(np.where(resisted > 0.0, resisted, 1.0))
    inverse = np.linalg.pinv(middle * np.outer(scale, scale), rcond=1e-12, hermitian=True)
    return np.asarray(full[:12, :12] - across @ (inverse * np.outer(scale, scale)) @ across.T)


def rotating_rows(matrix: Array) -> tuple[Array, Array]:
    """Eigen-rows of a symmetric (n, n): stiffness λ (m,) of either sign and vectors w (m, n)."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    keep = np.abs(values) > 1e-9 * max(np.abs(values).max(), 1e-300)
    return values[keep], vectors[:, keep].T


def add_spring(stiffness: Array, rows: Array, matrix: Array) -> None:
    """stiffness += rowsᵀ K rows, in place, on the coordinates that rows touch."""
    at = np.flatnonzero(np.any(rows != 0.0, axis=0))
    local = rows[:, at]
    stiffness[np.ix_(at, at)] += local.T @ matrix @ local


@dataclass(frozen=True)
class LawBearing:
    """A bearing with a law of its own, named like its spring.

    rows, outer_rows: (6, d) motion of inner and outer ring at the bearing's middle z (m, along the
    axis from its node), each in its own frame. The law acts in the outer ring's; angle: of the
    system's by which the inner ring's has turned against it, −1 where they are the same. inner,
    outer: contact nodes, −1 for the housing; law: name; parameters: of the law; turned: of the
    system's angles that is one of these, −1 none.
    """

    name: str
    rows: Array
    outer_rows: Array
    inner: int
    outer: int
    law: str
    parameters: Array
    z: float = 0.0
    angle: int = -1
    turned: int = -1

    @property
    def relative(self) -> Array:
        """(6, d) motion of the inner ring less that of the outer one before anything has turned."""
        return np.asarray(self.rows - self.outer_rows)

    @property
    def components(self) -> list[int]:
        """Components of ``rows`` that the law acts on."""
        return list(LAWS[LAW_NUMBERS[self.law]].components)

    @property
    def held(self) -> Array:
        """Rows (k, d) of the relative motion that the law holds, those of a nominal stiffness."""
        stiff = LAWS[LAW_NUMBERS[self.law]].nominal(self.parameters) > 0.0
        return np.asarray(self.relative[self.components][stiff])

    @property
    def has_parts(self) -> bool:
        """Whether the law gives loads of parts of the bearing."""
        return LAWS[LAW_NUMBERS[self.law]].part_loads is not None

    @property
    def part_rows(self) -> int:
        """Rows of its parts."""
        return int(self.part_loads(np.zeros((1, 6)), np.zeros((1, self.turned + 1))).shape[1])

    def part_loads(self, motion: Array, theta: Array) -> Array:
        """Loads of the bearing's parts at motions (t, 6) and the system's angles (t, θ), N."""
        of_parts = LAWS[LAW_NUMBERS[self.law]].part_loads
        if of_parts is None:
            raise KeyError(f"the law {self.law!r} of {self.name} has no parts")
        turned = theta[:, self.turned] if self.turned >= 0 else np.zeros(len(motion))
        return of_parts(self.parameters, motion[:, self.components], turned)


def laws_of(bearing: Bearing, viscosity: float | None = ANY) -> list[tuple[str, Array]]:
    """Names and parameters of the laws that a bearing states, none for a linear one; viscosity:
    dynamic, of the lubricant, Pa·s, None where it is not known. Refusal where a law needs it."""
    stated = [(law.name, law.stated_by(bearing, viscosity)) for law in LAWS]
    return [(name, np.asarray(p, dtype=float)) for name, p in stated if p is not None]


def linear_part(bearing: Bearing, matrix: Array) -> Array:
    """Stiffness (6, 6) that stays a spring: all of a linear bearing, else without what laws act on
    in its place but for its centering."""
    laws = [LAWS[LAW_NUMBERS[name]] for name, _ in laws_of(bearing)]
    replaced = [component for law in laws if law.replaces for component in law.components]
    if not replaced:
        return matrix
    share, to_node = np.ones(6), at_height(-bearing.z)
    share[replaced] = np.sqrt(CENTERING)
    middle = (to_node.T @ matrix @ to_node) * np.outer(share, share)
    to_z = at_height(bearing.z)
    return np.asarray(to_z.T @ middle @ to_z)
