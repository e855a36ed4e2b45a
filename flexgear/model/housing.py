"""Gearbox housing: rigid ground or one lumped mass on its mount."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Refusal, Section
from flexgear.model.springs import Springs
from flexgear.model.units import Inertia, Mass


class Housing(Section):
    """Housing that the bearings and bolts stand on.

    kind: rigid, the ground; or lumped, a rigid body on a mount. mass: of the lumped one. inertia:
    about x, y, z. mount: springs between it and the ground.
    """

    kind: Literal["rigid", "lumped"] = "rigid"
    mass: Mass = Field(default=0.0, ge=0.0, le=1e7)
    inertia: tuple[Inertia, Inertia, Inertia] = (0.0, 0.0, 0.0)
    mount: Springs = Springs()

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
