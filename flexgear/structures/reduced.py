r"""A reduced body: mass and stiffness on named 6-dof nodes and modal coordinates.

u ~ Psi q_b + Phi eta, coordinates q = [q_b, eta]; q_b = six dofs (ux, uy, uz in m; tx, ty, tz in
rad) of each node in node order, eta scaled by Phi^T M Phi = I (kg^(1/2) m).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.model.names import BodyName, NodeName
from flexgear.structures.bodies import Body, node_motions
from flexgear.structures.kinematics import rigid_motion
from flexgear.structures.strain import strain_of_gradient, vertex_gradient
from flexgear.structures.tooth_shapes import RimFlexibility


def _no_probes() -> NDArray[np.float64]:
    return np.zeros((2, 0, 0))


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """Result of a reduction, with the way back to the full field.

    positions (n, 3) m; mass, stiffness (d, d) with d = 6 n + n_modes; report: sizes, options and
    error estimates; points (p, 3) m and cells: the vertices and cells `recover` speaks of;
    recovery (3p, d) float32: [Psi, Phi] at the vertices; probe_cases: (node, load case) of every
    load of the static check, probe_loads (2, b, n) N, N m: what the full model's interface feels of
    it, and the wrench at the node that stands for it (`estimate`); rim: what the teeth of a ring
    yield along the face besides (`tooth_influence.rim`), where that counts.
    """

    name: str
    node_names: tuple[str, ...]
    positions: NDArray[np.float64]
    mass: NDArray[np.float64] = field(repr=False)
    stiffness: NDArray[np.float64] = field(repr=False)
    n_modes: int
    report: dict[str, Any] = field(repr=False)
    points: NDArray[np.float64] = field(repr=False)
    cells: NDArray[np.int64] = field(repr=False)
    recovery: NDArray[np.float32] = field(repr=False)
    probe_cases: tuple[tuple[str, str], ...] = field(default=(), repr=False)
    probe_loads: NDArray[np.float64] = field(default_factory=_no_probes, repr=False)
    rim: RimFlexibility | None = field(default=None, repr=False)

    @cached_property
    def nodes(self) -> tuple[NodeName, ...]:
        """Names of the nodes with their kinds, halves and numbers."""
        return tuple(map(NodeName.parse, self.node_names))

    @property
    def interface_dofs(self) -> int:
        """Six for each node."""
        return 6 * len(self.node_names)

    def node_slice(self, name: str) -> slice:
        """The six coordinates of a node."""
        try:
            start = 6 * self.node_names.index(name)
        except ValueError:
            raise KeyError(f"{self.name} has no interface node '{name}'") from None
        return slice(start, start + 6)

    def with_(self, **changes: Any) -> ReducedBody:
        """A copy with some attributes replaced."""
        return replace(self, **changes)

    def as_body(self) -> Body:
        """As the coupled system sees it: its node dofs come first."""
        return Body(
            name=BodyName.of("", self.name),
            node_names=tuple(self.node_names),
            positions=np.asarray(self.positions),
            mass=self.mass,
            stiffness=self.stiffness,
            node_map=np.eye(self.interface_dofs, self.mass.shape[0]),
            rigid_motions=self.rigid_modes(),
        )

    def rigid_modes(self) -> NDArray[np.float64]:
        """Coordinates (d, 6) of unit rigid motion about the origin: ux, uy, uz, tx, ty, tz."""
        return node_motions(self.positions, len(self.mass))

    def recover(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacements (p, 3[, k]) in m at the mesh vertices for coordinates q (d[, k]).

        The rigid motion nearest to q is taken through exactly, only the rest through the stored
        single-precision field: large rigid rotations cost no accuracy.
        """
        q = np.asarray(q, dtype=float)
        columns = q.reshape(len(q), -1)
        rigid = self.rigid_modes()
        motion = np.linalg.lstsq(rigid, columns, rcond=None)[0]
        rest = columns - rigid @ motion
        elastic = np.asarray(self.recovery @ rest.astype(np.float32), dtype=np.float64)
        exact = rigid_motion(self.points).reshape(-1, 6) @ motion
        return (elastic + exact).reshape((len(self.points), 3) + q.shape[1:])

    @cached_property
    def vertex_gradient(self) -> sp.csr_matrix:
        """(3p, p): derivatives at the mesh vertices of values there; see ``strain``."""
        return vertex_gradient(self.points, self.cells)

    def strain(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Strain (p, 6) at the mesh vertices for coordinates q (d,), in the order of
        ``strain.COMPONENTS``, from the displacements of the vertices around each."""
        rows = (self.vertex_gradient @ self.recover(q)).reshape(len(self.points), 3, 3)
        return strain_of_gradient(rows.swapaxes(1, 2))
