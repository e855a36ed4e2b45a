"""Springs between nodes: constant links, supports in rotating frames, nonlinear bearings.

A support of a rotating node on the fixed frame has the energy ½ qᵀ R(θ)ᵀ K R(θ) q. Its mean over θ
is invariant to rotation and part of the constant stiffness; the remainder is rows λ w wᵀ that are
rotated at every evaluation.
"""

from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.laws import LAW_NUMBERS, LAWS
from flexgear.coupling.laws.law import CENTERING
from flexgear.model.bearings import Bearing, at_height
from flexgear.structures.bodies import turn

ANY_VISCOSITY = 1.0  # Pa·s, where only names of laws are used


def invariant_part(matrix: Array) -> Array:
    """Mean of R(θ)ᵀ K R(θ) over a turn; harmonics up to 2θ, so eight angles are exact."""
    turns = turn(np.arange(8) * np.pi / 4)
    return np.asarray((turns.swapaxes(1, 2) @ matrix @ turns).mean(axis=0))


def joint_parts(matrix: Array) -> tuple[Array, Array]:
    """Mean of a joint stiffness (12, 12) over independent rotations of both ends, and remainder.
    The mean has the invariant part of each end and the coupling of axial motion and torsion; the
    remainder, lateral coupling between the ends, depends on the difference of their angles."""
    mean = np.zeros((12, 12))
    mean[:6, :6] = invariant_part(matrix[:6, :6])
    mean[6:, 6:] = invariant_part(matrix[6:, 6:])
    for i in (2, 5):
        for j in (2, 5):
            mean[i, 6 + j], mean[6 + j, i] = matrix[i, 6 + j], matrix[6 + j, i]
    return mean, matrix - mean


def behind_spline(joint: Array, spline: Array, end: int) -> Array:
    """Stiffness (12, 12) of a joint with a spline (6, 6) in series at end 0 or 1. The massless node
    between them is eliminated, K' = K_aa − K_ab K_bb⁺ K_ba; components of its motion without
    stiffness transmit no force."""
    full = np.zeros((18, 18))  # both outer ends, then the node between
    inner = [12, 13, 14, 15, 16, 17]
    dofs = list(range(6 * end, 6 * end + 6))
    ends = [*inner, *range(6, 12)] if end == 0 else [*range(6), *inner]
    full[np.ix_(ends, ends)] += joint
    all_dofs = [*dofs, *inner]
    full[np.ix_(all_dofs, all_dofs)] += np.kron([[1.0, -1.0], [-1.0, 1.0]], spline)
    middle, across = full[12:, 12:], full[:12, 12:]
    diagonal = np.diag(middle)  # N/m and N·m/rad, scaled to 1
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    inverse = np.linalg.pinv(middle * np.outer(scale, scale), rcond=1e-12, hermitian=True)
    return np.asarray(full[:12, :12] - across @ (inverse * np.outer(scale, scale)) @ across.T)


def rotating_rows(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues λ (m,), of either sign, and eigenvectors w (m, n) of a symmetric (n, n), without
    those of zero."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    keep = np.abs(values) > 1e-9 * max(np.abs(values).max(), 1e-300)
    return values[keep], vectors[:, keep].T


def add_spring(stiffness: Array, rows: Array, matrix: Array) -> None:
    """Adds rowsᵀ K rows to ``stiffness`` in place, on the coordinates where rows are not zero."""
    at = np.flatnonzero(np.any(rows != 0.0, axis=0))
    local = rows[:, at]
    stiffness[np.ix_(at, at)] += local.T @ matrix @ local


@dataclass(frozen=True)
class LawBearing:
    """Bearing with a nonlinear law, named like its spring.

    rows, outer_rows: (6, d) motions of inner and outer ring, each in its frame, at the middle of
    the bearing; z: position of the middle along the axis from its node, m. The law acts in the
    frame of the outer ring. inner, outer: contact nodes, −1 for the housing; law: name; parameters:
    of the law; angle: index of the angle of the inner ring's frame relative to that of the outer
    ring, −1 for the same frame; turned: index of the angle that is a parameter of the law, −1 none.
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
        """Motion (6, d) of the inner relative to the outer ring at zero angles."""
        return np.asarray(self.rows - self.outer_rows)

    @property
    def components(self) -> list[int]:
        """Components of the motion on which the law acts."""
        return list(LAWS[LAW_NUMBERS[self.law]].components)

    @property
    def held(self) -> Array:
        """Rows (k, d) of the relative motion for which the law has a nominal stiffness."""
        stiff = LAWS[LAW_NUMBERS[self.law]].nominal(self.parameters) > 0.0
        return np.asarray(self.relative[self.components][stiff])

    @property
    def has_parts(self) -> bool:
        """Whether the law gives loads of parts (rolling elements) of the bearing."""
        return LAWS[LAW_NUMBERS[self.law]].part_loads is not None

    @property
    def part_rows(self) -> int:
        """Number of rows of parts."""
        return int(self.part_loads(np.zeros((1, 6)), np.zeros((1, self.turned + 1))).shape[1])

    def part_loads(self, motion: Array, theta: Array) -> Array:
        """Loads (t, rows, parts) of the parts of the bearing, N. motion: relative motions (t, 6);
        theta: angles (t, A). Raises KeyError for a law without parts."""
        part_loads = LAWS[LAW_NUMBERS[self.law]].part_loads
        if part_loads is None:
            raise KeyError(f"the law {self.law!r} of {self.name} has no parts")
        turned = theta[:, self.turned] if self.turned >= 0 else np.zeros(len(motion))
        return part_loads(self.parameters, motion[:, self.components], turned)


def laws_of(bearing: Bearing, viscosity: float | None = ANY_VISCOSITY) -> list[tuple[str, Array]]:
    """Names and parameters of the laws of a bearing, none for a linear one. viscosity: dynamic
    viscosity of the lubricant, Pa·s, None if unknown. Raises Refusal if a law needs an unknown
    viscosity."""
    stated = [(law.name, law.stated_by(bearing, viscosity)) for law in LAWS]
    return [(name, np.asarray(p, dtype=float)) for name, p in stated if p is not None]


def linear_part(bearing: Bearing, matrix: Array) -> Array:
    """Part of the stiffness (6, 6) of a bearing that is a linear spring. All of it for a linear
    bearing; components that a law replaces have the fraction ``CENTERING``."""
    laws = [LAWS[LAW_NUMBERS[name]] for name, _ in laws_of(bearing)]
    replaced = [component for law in laws if law.replaces for component in law.components]
    if not replaced:
        return matrix
    share, to_node = np.ones(6), at_height(-bearing.z)
    share[replaced] = np.sqrt(CENTERING)
    middle = (to_node.T @ matrix @ to_node) * np.outer(share, share)
    to_z = at_height(bearing.z)
    return np.asarray(to_z.T @ middle @ to_z)
