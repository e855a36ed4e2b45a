"""Hub of an FE ring that turns: what its bolts, fits and splines stand on."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.springs import Bearing
from flexgear.model.units import Inertia, Length, Mass


class Hub(Section):
    """A rigid body that turns with the ring; drive, load or joint of the ring act on it.

    kinematics: "spatial", or "torsional" of a hub that can only turn about the axis and so has no
    mass, tilt_inertia and bearing. mass: of the hub. inertia: about the axis. tilt_inertia: about a
    diameter. z: of its centre from the middle of the face. bearing: springs to the housing.
    """

    kinematics: Literal["spatial", "torsional"] = "spatial"
    mass: Mass | None = Field(default=None, gt=0.0, le=1e7)
    inertia: Inertia = Field(gt=0.0, le=1e12)
    tilt_inertia: Inertia | None = Field(default=None, gt=0.0, le=1e12)
    z: Length = Field(default=0.0, ge=-5.0, le=5.0)
    bearing: Bearing | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Hub:
        for key in ("mass", "tilt_inertia", "bearing"):
            present = getattr(self, key) is not None
            if self.kinematics == "spatial" and not present:
                problem = "is missing of a hub that moves in all directions"
                raise Missing(key, problem, 'give it, or kinematics = "torsional"')
            if self.kinematics == "torsional" and present:
                problem = 'is that of a hub that moves, but kinematics is "torsional"'
                raise Refusal(key, problem, "take one of the two out")
        return self
