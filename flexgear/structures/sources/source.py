"""What a body is made from, as meshing, tying and reducing see it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from flexgear.model.bodies import Material
from flexgear.model.names import BodyName, NodeName
from flexgear.structures.fe_mesh import FeMesh

if TYPE_CHECKING:
    from flexgear.structures.estimate import ProbeLoad
    from flexgear.structures.fem import FeModel
    from flexgear.structures.fem.assembly import FeMeshLike

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TiedNode:
    """A node of a body and the surface that carries it.

    place: (3,) m; tie: averaging (RBE3), rigid (RBE2), or of a seat about an axis along z; patch:
    facets of the FE mesh, "" for a disc of a diameter (m) in an end face, at an angle (rad).
    """

    name: NodeName
    place: Array = field(repr=False)
    tie: Literal["averaging", "rigid", "seat"] = "averaging"
    patch: str = ""
    diameter: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True)
class Accuracy:
    """How a body is reduced.

    modes: fixed-interface modes that are kept; cyclic: whether sectors are looked for; limit_hz: up
    to which frequencies are judged, None: all that were compared; fidelity: of the FE mesh.
    """

    modes: int
    cyclic: bool
    limit_hz: float | None
    fidelity: str


class BodySource(Protocol):
    """key: of the body; material; accuracy: of its reduction."""

    key: BodyName
    material: Material
    accuracy: Accuracy

    @property
    @abstractmethod
    def repeats(self) -> int:
        """Number of teeth or pins by which it may repeat round the axis."""

    @property
    @abstractmethod
    def ties(self) -> tuple[str, str]:
        """What its nodes act on, and how, in words of the report."""

    @abstractmethod
    def fe_mesh(self) -> FeMesh:
        """Its FE mesh; InputError where it is refused."""

    @abstractmethod
    def nodes(self, fe_mesh: FeMeshLike | None = None) -> list[TiedNode]:
        """All nodes, with places on the surfaces of an FE mesh, of the parameters without one."""

    @abstractmethod
    def supports(self, node_names: tuple[str, ...], stiffness: Array) -> Array:
        """Stiffness (b, b) of all that holds it to ground at its nodes, for error estimates;
        stiffness: K_bb of the free body."""

    @abstractmethod
    def probe_loads(self, model: FeModel) -> Sequence[ProbeLoad]:
        """Loads of the static check."""
