"""A body with an FE mesh, generated or of a file, or given as reduced matrices.

parameters -> FE mesh -> nodes tied to its surfaces -> reduced body with weight, recovery and its
errors, from the cache where it was made before; or rigid, of the same mass. What a kind of body
adds to this: ``ring.py``, ``planet.py``, ``carrier.py``.
"""

from __future__ import annotations

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from flexgear.arrays import Array
from flexgear.model.bodies import MOST_MODES, FeMeshSource, Material
from flexgear.model.errors import InputError
from flexgear.model.input_file import MOST_FE_MESH, require_regular
from flexgear.model.names import BodyName, NodeName
from flexgear.structures.bodies import Body, Spring, rigid_rows, rigid_variant, stiffness_at
from flexgear.structures.cache import content_key
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.groups import Groups
from flexgear.structures.fe_mesh.placement import fe_mesh_of_file
from flexgear.structures.fe_mesh.solids import Solid, fe_mesh_of_solid
from flexgear.structures.reduced import Progress, ReducedBody, silent
from flexgear.structures.sources.matrices import given_body
from flexgear.structures.store import cached, is_cached

if TYPE_CHECKING:
    from flexgear.structures.estimate import ProbeLoad
    from flexgear.structures.fem.assembly import FeModel
    from flexgear.structures.reduction import AnyCondensation


@dataclass(frozen=True, eq=False)
class TiedNode:
    """A node of a body and the surface that carries it. place: (3,) m; tie: averaging (RBE3), rigid
    (RBE2), or of a seat about an axis along z; patch: facets of the FE mesh, "" for a disc of a
    diameter (m) in an end face, at an angle (rad)."""

    name: NodeName
    place: Array = field(repr=False)
    tie: Literal["averaging", "rigid", "seat"] = "averaging"
    patch: str = ""
    diameter: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True, eq=False)
class FeBody(ABC):
    """key: of the body; section: of the case, as [stage.ring.fe]; parameters: of the FE mesh, a
    frozen dataclass with ``check()``, ``size`` (m) and ``where``, the file of the case; material;
    cyclic: whether equal sectors are used; limit_hz: highest frequency that is judged, None: all
    that were compared; more_modes: fixed-interface modes where the usual number is not enough."""

    meshed: ClassVar[Any]  # function that makes an FE mesh of ``mesh``
    as_solid: ClassVar[Any]  # and one that makes the solid in closed form
    turning: ClassVar[str] = ""  # node that nothing holds against rotation about the axis

    key: BodyName
    section: FeMeshSource
    parameters: Any
    material: Material
    cyclic: bool
    limit_hz: float | None
    more_modes: int = field(default=0, kw_only=True)

    @property
    def modes(self) -> int:
        """Number of fixed-interface modes: the case's; where it states none, ``usual_modes`` of the
        kind of body, or ``more_modes``."""
        stated = self.section.fixed_interface_modes
        return (self.more_modes or self.section.usual_modes) if stated is None else stated

    @property
    @abstractmethod
    def groups(self) -> Groups:
        """Named groups of its FE mesh and their positions."""

    @property
    @abstractmethod
    def repeats(self) -> int:
        """Number of teeth or pins by which it may repeat round the axis."""

    @property
    @abstractmethod
    def ties(self) -> tuple[str, str]:
        """Surfaces that its nodes act on, and the kind of tie, in words of the report."""

    @abstractmethod
    def nodes(self, fe_mesh: FeMesh | None = None) -> list[TiedNode]:
        """All nodes, with positions on the surfaces of an FE mesh, or of the parameters without
        one."""

    @property
    @abstractmethod
    def springs(self) -> list[Spring]:
        """Springs to ground of the meshed part, in fixed axes."""

    @abstractmethod
    def probe_loads(self, model: FeModel) -> Sequence[ProbeLoad]:
        """Loads of the static check."""

    @abstractmethod
    def _content(self) -> Mapping[str, Any]:
        """What the reduced body depends on in addition to what ``content`` has for every body."""

    def supports(self, node_names: tuple[str, ...], stiffness: Array) -> Array:
        """Stiffness (b, b) of all supports at its nodes, for error estimates, with a stiff spring
        against free rotation; stiffness: K_bb of the free body."""
        supports = stiffness_at(self.springs, node_names)
        if self.turning:
            spin = 6 * node_names.index(self.turning) + 5
            supports[spin, spin] += 1e3 * stiffness[spin, spin]
        return supports

    def content(self) -> dict[str, Any]:
        """Everything that the reduced body depends on; the cache makes its key of it."""
        return {
            "body": self.key.part,
            "fe_mesh": self._fe_mesh_content(),
            "material": self.material.model_dump(),
            "modes": self.modes,
            "cyclic": "auto" if self.cyclic else "off",
            "limit": self.limit_hz,
            **self._content(),
        }

    def check(self) -> None:
        """InputError for an FE mesh or file that is refused, without meshing. A user's FE mesh
        whose reduced body is in the cache was accepted when that was made, and is not compared
        again."""
        if self.section.fe_mesh == "generate":
            self.parameters.check()
            return
        file = Path(str(self.section.fe_mesh_file))
        try:
            require_regular(file, f"stage.{self.key.part}.fe.fe_mesh_file", MOST_FE_MESH)
        except InputError as fault:
            problem = f"{file}: {fault.problem}"
            raise InputError(self.parameters.where, fault.key, problem, fault.remedy) from None
        if self.section.fe_mesh == "reduced":
            self.reduced()
        elif not is_cached(content_key(**self.content())):
            self.fe_mesh()

    def fe_mesh(self) -> FeMesh:
        """The generated FE mesh, or the user's file, placed; InputError where it is refused."""
        if self.section.fe_mesh == "generate":
            generated: FeMesh = self.meshed(self.parameters)
            return generated
        sizes = self.parameters
        return fe_mesh_of_file(self.section, self.groups, sizes.size, sizes.where)

    def reduced(self, progress: Progress = silent, limit_hz: float | None = None) -> ReducedBody:
        """The reduced body, of a double-helical ring its left half; from the cache if it was
        reduced before. limit_hz: highest frequency that is judged; all that were compared where
        neither this nor the case states it. Where the case states no number of modes, there are as
        many as it needs, at most ``MOST_MODES``. Given matrices are taken as they are, without
        error estimates."""
        if self.section.fe_mesh == "reduced":
            return self._given()
        from flexgear.structures.sources.reducing import judged, reduced_body  # half of the package

        def made(source: FeBody) -> ReducedBody:
            return cached(content_key(**source.content()), lambda: reduced_body(source, progress))

        source, limit = self, limit_hz or self.limit_hz or 0.0
        body = made(source)
        while (more := _enough(source, float(body.report["compared_to_hz"]), limit)) > source.modes:
            source = replace(source, more_modes=more)
            body = made(source)
        b = slice(0, body.interface_dofs)
        supports = self.supports(body.node_names, body.stiffness[b, b])
        return judged(body, supports, limit_hz or self.limit_hz)

    def condensed(self) -> tuple[FeModel, AnyCondensation]:
        """The unreduced body and its condensation on its nodes, computed anew."""
        from flexgear.structures.sources.reducing import condensed_body

        return condensed_body(self)

    def solid(self) -> Solid:
        """The generated body in closed form about its middle, of a double-helical ring one half."""
        solid: Solid = self.as_solid(self.parameters)
        return solid

    def whole(self, body: ReducedBody) -> ReducedBody:
        """The whole body of the stage from what ``reduced`` returns."""
        return body

    def rigid(self, from_files: bool = True) -> Body:
        """The whole body, rigid: coordinates are the rigid motion of the frame's origin. A
        generated body has the case's sizes, one with a file of FE mesh or matrices those of the
        file; with from_files = False all have the case's sizes, and no file is read."""
        if from_files and self.section.fe_mesh == "reduced":
            return rigid_variant(self.whole(self._given()).as_body())
        fe_mesh = self.fe_mesh() if from_files and self.section.fe_mesh == "file" else None
        solid = self.solid() if fe_mesh is None else fe_mesh_of_solid(fe_mesh)
        solid, places = self._whole_solid(
            solid, {node.name: node.place for node in self.nodes(fe_mesh)}
        )
        positions = np.array(list(places.values()))
        return Body(
            name=self.key,
            node_names=tuple(places),
            positions=positions,
            mass=solid.rigid_mass(self.material.density),
            stiffness=np.zeros((6, 6)),
            node_map=rigid_rows(positions),
            rigid_motions=np.eye(6),
            rigid=True,
        )

    def _whole_solid(
        self, solid: Solid, places: dict[NodeName, Array]
    ) -> tuple[Solid, dict[NodeName, Array]]:
        """Solid and nodes of the whole body from those of the meshed part."""
        return solid, places

    def _given(self) -> ReducedBody:
        """Its matrices from files. InputError unless they are those of a free body with its
        nodes."""
        places = {node.name: node.place for node in self.nodes()}
        sizes = self.groups.pitch, self.groups.face_width
        mass = float(self.solid().rigid_mass(self.material.density)[0, 0])
        return given_body(self.section, self.key.part, places, sizes, mass, self.parameters.where)

    def _fe_mesh_content(self) -> object:
        """What the FE mesh depends on: the generator's parameters, or the bytes of the user's file,
        its placement, and the positions of the groups that it was compared with."""
        section = self.section
        if section.fe_mesh == "generate" or section.fe_mesh_file is None:
            return replace(self.parameters, where="")  # the case's path changes nothing
        file = section.fe_mesh_file
        try:
            digest = hashlib.sha256(Path(file).read_bytes()).hexdigest()
        except OSError as error:
            raise InputError(
                "case", "fe_mesh_file", f"{file}: {error.strerror}", "check the path"
            ) from None
        put = [section.fe_mesh_unit, section.fe_mesh_shift, section.fe_mesh_turn]
        return ["file", digest, put, self.groups.content()]


def _enough(source: FeBody, reached: float, limit: float) -> int:
    """Number of fixed-interface modes that answers up to ``limit``, Hz, of a body whose present
    number answers up to ``reached``; that number where it is enough or stated by the case. Numbers
    of modes below a frequency f grow as f in plates and shells and as f³ in solids; f² is taken,
    rounded up to twenties, and asked for again where it falls short."""
    if limit <= reached or source.section.fixed_interface_modes is not None:
        return source.modes
    return min(20 * math.ceil(source.modes * (limit / reached) ** 2 / 20), MOST_MODES)
