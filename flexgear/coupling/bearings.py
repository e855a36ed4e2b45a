"""Bearings with a law of their own: which law it is, and what of their stiffness stays linear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.laws import LAWS, law_number
from flexgear.coupling.laws.law import CENTERING
from flexgear.model.springs import Bearing, at_height

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LawBearing:
    """A bearing with a law of its own, named like its spring.

    rows, outer_rows: (6, d) motion of inner and outer ring at the bearing's middle z (m, along the
    axis from its node), each in its own frame. The law acts in the outer ring's; angle: of the
    system's by which the inner ring's has turned against it, −1 where they are the same. inner,
    outer: contact nodes, −1 for the housing; law: name; parameters: of the law.
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

    @property
    def relative(self) -> Array:
        """(6, d) motion of the inner ring less that of the outer one before anything has turned."""
        return np.asarray(self.rows - self.outer_rows)

    @property
    def components(self) -> list[int]:
        """Components of ``rows`` that the law acts on."""
        return list(LAWS[law_number(self.law)].components)

    @property
    def has_parts(self) -> bool:
        """Whether the law says what parts of the bearing carry."""
        return LAWS[law_number(self.law)].part_loads is not None

    @property
    def part_rows(self) -> int:
        """Rows of its parts."""
        return int(self.part_loads(np.zeros((1, 6))).shape[1])

    def part_loads(self, motion: Array) -> Array:
        """What the bearing's parts carry at motions (t, 6), as the law says it, N."""
        of_parts = LAWS[law_number(self.law)].part_loads
        if of_parts is None:
            raise KeyError(f"the law {self.law!r} of {self.name} knows no parts")
        return of_parts(self.parameters, motion[:, self.components])


def own_law(bearing: Bearing) -> tuple[str, Array] | None:
    """Name and parameters of the law that a bearing states, None for a linear one."""
    for law in LAWS:
        parameters = law.stated_by(bearing)
        if parameters is not None:
            return law.name, np.asarray(parameters, dtype=float)
    return None


def linear_part(bearing: Bearing, matrix: Array) -> Array:
    """Stiffness (6, 6) that stays a spring: all of a linear bearing, else without what the law
    acts on but for its centering."""
    law = own_law(bearing)
    if law is None:
        return matrix
    share, to_node = np.ones(6), at_height(-bearing.z)
    share[list(LAWS[law_number(law[0])].components)] = np.sqrt(CENTERING)
    middle = (to_node.T @ matrix @ to_node) * np.outer(share, share)
    to_z = at_height(bearing.z)
    return np.asarray(to_z.T @ middle @ to_z)
