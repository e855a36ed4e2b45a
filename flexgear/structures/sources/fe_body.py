"""FE bodies: with an FE mesh, generated or from a file, or given as reduced matrices.

parameters -> FE mesh -> nodes tied to its surfaces -> reduced body with recovery and error
estimates, from the cache where it is there; or a rigid body of the same mass. The kinds of bodies
are in ``ring.py``, ``planet.py`` and ``carrier.py``.
"""

from __future__ import annotations

import functools
import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from flexgear.arrays import Array
from flexgear.model.bodies import MAX_MODES, FeMeshSource, Material
from flexgear.model.errors import InputError
from flexgear.model.input_file import MAX_FE_MESH_BYTES, require_regular
from flexgear.model.names import BodyName, NodeName
from flexgear.structures.bodies import Body, Spring, rigid_rows, rigid_variant, stiffness_at
from flexgear.structures.cache import content_key
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.groups import Groups
from flexgear.structures.fe_mesh.placement import fe_mesh_of_file
from flexgear.structures.fe_mesh.solids import Solid, solid_of_fe_mesh
from flexgear.structures.reduced import Progress, ReducedBody, silent
from flexgear.structures.sources.matrices import given_body
from flexgear.structures.store import cached, is_cached

if TYPE_CHECKING:
    from flexgear.structures.estimate import ProbeLoad
    from flexgear.structures.fem.assembly import FeModel
    from flexgear.structures.reduction import AnyCondensation


@dataclass(frozen=True, eq=False)
class TiedNode:
    """A node of a body and the surface that it is tied to. place: (3,) m; tie: averaging (RBE3),
    rigid (RBE2), or of a bearing seat about an axis along z; patch: facets of the FE mesh, "" for a
    disc of a diameter (m) in an end face, at an angle (rad)."""

    name: NodeName
    place: Array = field(repr=False)
    tie: Literal["averaging", "rigid", "seat"] = "averaging"
    patch: str = ""
    diameter: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True, eq=False)
class FeBody(ABC):
    """Source of a body with an FE mesh or reduced matrices.

    key: of the body; section: of the case, as [stage.ring.fe]; parameters: of the FE mesh, a frozen
    dataclass with ``check()``, ``size`` (m) and ``where``, the source of the case; cyclic: whether
    equal sectors are used; limit_hz: highest frequency of error estimates, None: all frequencies
    that were compared; more_modes: number of fixed-interface modes where the usual one is too
    small.
    """

    meshed: ClassVar[Any]  # function that makes the FE mesh from ``parameters``
    as_solid: ClassVar[Any]  # function that makes the solid in closed form from ``parameters``
    turning: ClassVar[str] = ""  # node that no support holds against rotation about the axis

    key: BodyName
    section: FeMeshSource
    parameters: Any
    material: Material
    cyclic: bool
    limit_hz: float | None
    more_modes: int = field(default=0, kw_only=True)

    @property
    def modes(self) -> int:
        """Number of fixed-interface modes: that of the case; where it states none, ``more_modes``
        or the ``usual_modes`` of this kind of body."""
        stated = self.section.fixed_interface_modes
        return (self.more_modes or self.section.usual_modes) if stated is None else stated

    @property
    @abstractmethod
    def groups(self) -> Groups:
        """Named groups of its FE mesh and their positions."""

    @property
    @abstractmethod
    def repeats(self) -> int:
        """Number of teeth or pins, of which the number of equal sectors is a divisor."""

    @property
    @abstractmethod
    def ties(self) -> tuple[str, str]:
        """Tied surface and kind of tie, for the report."""

    @abstractmethod
    def nodes(self, fe_mesh: FeMesh | None = None) -> list[TiedNode]:
        """All nodes, at positions by the surfaces of an FE mesh or, without one, by the
        parameters."""

    @property
    @abstractmethod
    def springs(self) -> list[Spring]:
        """Springs to ground of the meshed part, in fixed axes."""

    @abstractmethod
    def probe_loads(self, model: FeModel) -> Sequence[ProbeLoad]:
        """Loads of the static error estimate."""

    @abstractmethod
    def _content(self) -> Mapping[str, Any]:
        """Entries of ``content`` that depend on the kind of body."""

    def supports(self, node_names: tuple[str, ...], stiffness: Array) -> Array:
        """Stiffness (b, b) of all supports at the nodes, for error estimates, with a stiff spring
        against rotation at the node ``turning``; stiffness: K_bb of the free body."""
        supports = stiffness_at(self.springs, node_names)
        if self.turning:
            spin = 6 * node_names.index(self.turning) + 5
            supports[spin, spin] += 1e3 * stiffness[spin, spin]
        return supports

    def content(self) -> dict[str, Any]:
        """All data that the reduced body depends on; the cache key is their hash."""
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
        """InputError for parameters or a file of which no body can be made, without meshing. A
        user's FE mesh whose reduced body is in the cache is not checked again."""
        if self.section.fe_mesh == "generate":
            self.parameters.check()
            return
        file = Path(str(self.section.fe_mesh_file))
        try:
            require_regular(file, f"stage.{self.key.part}.fe.fe_mesh_file", MAX_FE_MESH_BYTES)
        except InputError as fault:
            problem = f"{file}: {fault.problem}"
            raise InputError(self.parameters.where, fault.key, problem, fault.remedy) from None
        if self.section.fe_mesh == "reduced":
            self.reduced()
        elif not is_cached(content_key(**self.content())):
            self.fe_mesh()

    def fe_mesh(self) -> FeMesh:
        """The generated FE mesh, or the user's in its placement; InputError where there is none."""
        if self.section.fe_mesh == "generate":
            generated: FeMesh = self.meshed(self.parameters)
            return generated
        sizes = self.parameters
        return fe_mesh_of_file(self.section, self.groups, sizes.size, sizes.where)

    def reduced(self, progress: Progress = silent, limit_hz: float | None = None) -> ReducedBody:
        """The reduced body, of a double-helical ring its left half, from the cache or computed.

        limit_hz: highest frequency of error estimates, by default that of the case or all that were
        compared. Where the case states no number of modes, the body has as many as it needs for
        frequencies as accurate as promised up to this limit, at most ``MAX_MODES``. Given matrices
        are not changed and have no error estimates.
        """
        if self.section.fe_mesh == "reduced":
            return self._given()
        # lazy: it imports half of the package
        from flexgear.structures.sources.reducing import (
            accurate_to,
            reduced_body,
            unreduced_body,
            with_errors,
        )

        unreduced = functools.cache(lambda: unreduced_body(self, progress))  # once for all modes
        waits = f"{self.key.part}: another process reduces it"

        def reduction(source: FeBody) -> ReducedBody:
            return cached(
                content_key(**source.content()),
                lambda: reduced_body(source, unreduced(), progress),
                waiting=lambda share: progress(waits, share),
            )

        source, limit = self, limit_hz or self.limit_hz or 0.0
        body = reduction(source)
        while (more := _modes_for(source, accurate_to(body), limit)) > source.modes:
            source = replace(source, more_modes=more)
            body = reduction(source)
        b = slice(0, body.interface_dofs)
        supports = self.supports(body.node_names, body.stiffness[b, b])
        return with_errors(body, supports, limit_hz or self.limit_hz)

    def condensed(self) -> tuple[FeModel, AnyCondensation]:
        """The unreduced body and its condensation on its nodes, not from the cache."""
        from flexgear.structures.sources.reducing import unreduced_body

        unreduced = unreduced_body(self)
        return unreduced.model, unreduced.condensation

    def solid(self) -> Solid:
        """The body of the parameters in closed form, of a double-helical ring one half."""
        solid: Solid = self.as_solid(self.parameters)
        return solid

    def whole(self, body: ReducedBody) -> ReducedBody:
        """The whole body from the one that ``reduced`` returns."""
        return body

    def rigid(self, from_files: bool = True) -> Body:
        """The whole body as a rigid one; its coordinates are the motion of the frame's origin.

        Its size is that of the FE mesh or matrices in the user's files, if there are any and
        from_files is true, else that of the case.
        """
        if from_files and self.section.fe_mesh == "reduced":
            return rigid_variant(self.whole(self._given()).as_body())
        fe_mesh = self.fe_mesh() if from_files and self.section.fe_mesh == "file" else None
        solid = self.solid() if fe_mesh is None else solid_of_fe_mesh(fe_mesh)
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
        """The body of the case's matrix files. InputError as of ``given_body``."""
        places = {node.name: node.place for node in self.nodes()}
        sizes = self.groups.pitch, self.groups.face_width
        return given_body(
            self.section,
            self.key.part,
            places,
            sizes,
            self.solid().rigid_mass(self.material.density),
            self.material,
            self.parameters.where,
        )

    def _fe_mesh_content(self) -> object:
        """Data that the FE mesh depends on: the generator's parameters, or the bytes of the user's
        file, its placement, and the positions of the groups that it is compared with."""
        section = self.section
        if section.fe_mesh == "generate" or section.fe_mesh_file is None:
            return replace(self.parameters, where="")  # does not depend on the source of the case
        file = section.fe_mesh_file
        try:
            digest = hashlib.sha256(Path(file).read_bytes()).hexdigest()
        except OSError as error:
            raise InputError(
                "case", "fe_mesh_file", f"{file}: {error.strerror}", "check the path"
            ) from None
        put = [section.fe_mesh_unit, section.fe_mesh_shift, section.fe_mesh_turn]
        return ["file", digest, put, self.groups.content()]


def _modes_for(source: FeBody, reached: float, limit: float) -> int:
    """Number of fixed-interface modes for frequencies up to ``limit``, Hz, from the present number,
    which suffices up to ``reached``, Hz; the present number where it suffices or the case states
    it.

    The number of modes below a frequency f grows as f in plates and shells and as f³ in solids. The
    estimate takes f², rounded up to a multiple of 20; the caller repeats it if it is too low.
    """
    if limit <= reached or source.section.fixed_interface_modes is not None:
        return source.modes
    return min(20 * math.ceil(source.modes * (limit / reached) ** 2 / 20), MAX_MODES)
