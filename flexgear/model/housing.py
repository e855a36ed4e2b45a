"""Gearbox housing: rigid ground, one lumped mass on its mount, or an FE body given reduced."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.springs import Springs
from flexgear.model.units import Inertia, Mass

_OF_FILES = ("fe_mesh_file", "fe_mesh_mass_file", "fe_mesh_nodes")


class Housing(Section):
    """Housing that the bearings and bolts stand on.

    kind: rigid, the ground; lumped, a rigid body on a mount; or reduced, an FE body that another
    program reduced. mass: of the lumped one. inertia: about x, y, z. mount: springs between it and
    the ground; of a reduced one at each of its nodes mount_1, mount_2 …. fe_mesh_file:
    stiffness and mass of the reduced one. fe_mesh_mass_file: the mass, where it stands in a file of
    its own. fe_mesh_nodes: table of its nodes, CSV, each named as the support that stands on it.
    fe_mesh_unit: "mm" is N, mm, t, s and "m" SI.
    """

    kind: Literal["rigid", "lumped", "reduced"] = "rigid"
    mass: Mass = Field(default=0.0, ge=0.0, le=1e7)
    inertia: tuple[Inertia, Inertia, Inertia] = (0.0, 0.0, 0.0)
    mount: Springs = Springs()
    fe_mesh_file: str | None = None
    fe_mesh_mass_file: str | None = None
    fe_mesh_nodes: str | None = None
    fe_mesh_unit: Literal["m", "mm"] = "mm"

    @property
    def stiffness(self) -> tuple[float, ...]:
        """Diagonal of the mount's stiffness, (6,)."""
        return self.mount.stiffness

    @model_validator(mode="after")
    def _complete(self) -> Housing:
        if self.kind == "lumped":
            if self.mass <= 0 or min(self.inertia) <= 0:
                raise Refusal("mass", "a lumped housing needs mass and inertia", "give both")
            if min(self.mount.stiffness) <= 0:
                raise Refusal(
                    "mount", "a lumped housing needs stiffness in all six directions", "give them"
                )
        return self

    @model_validator(mode="after")
    def _files_of_a_reduced_one(self) -> Housing:
        for key in _OF_FILES if self.kind != "reduced" else ():
            if getattr(self, key) is not None:
                raise Refusal(key, "is of reduced matrices", 'set kind = "reduced"')
        if self.kind != "reduced":
            return self
        if not self.fe_mesh_file:
            raise Missing("fe_mesh_file", "is missing", "name the file of its stiffness and mass")
        if not self.fe_mesh_nodes:
            raise Missing("fe_mesh_nodes", "is missing", "name the table of nodes (CSV)")
        if self.mass or any(self.inertia):
            key = "mass" if self.mass else "inertia"
            raise Refusal(key, "is that of a lumped housing", "take it out: the files hold it")
        if min(self.mount.stiffness[:3]) <= 0:
            raise Refusal(
                "mount", "a housing needs stiffness along all three axes", "give radial and axial"
            )
        return self
