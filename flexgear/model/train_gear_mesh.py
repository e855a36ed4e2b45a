"""How the gear meshes of a train's stage are modelled."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from flexgear.model.gear_mesh import GearMesh
from flexgear.model.units import Stiffness


class TrainGearMesh(GearMesh):
    """Gear-mesh options of one stage.

    model: constant, the mean stiffness; rectangular, a wave between the two numbers of pairs in
    contact; fourier, that wave's first ``harmonics`` terms; per_pair and lumped as for a flexible
    stage. ring_stiffness, sun_stiffness: mean, N/m along the 3D normal, of one gear mesh (of each
    half of a double-helical stage); c_γ b of ISO 6336-1 if left out. A parallel stage uses sun_*.
    ring_contact_ratio, sun_contact_ratio: of the waves; from the geometry if left out.
    """

    model: Literal["constant", "rectangular", "fourier", "per_pair", "lumped"] = "constant"  # type: ignore[assignment]
    contact_law: Literal["one-sided", "linear"] = "linear"
    ring_stiffness: Stiffness | None = Field(default=None, gt=0.0, le=1e13)
    sun_stiffness: Stiffness | None = Field(default=None, gt=0.0, le=1e13)
    harmonics: int = Field(default=5, ge=1, le=100)
    ring_contact_ratio: float | None = Field(default=None, ge=1.0, le=20.0)
    sun_contact_ratio: float | None = Field(default=None, ge=1.0, le=20.0)
