"""How the gear meshes of a train's stage are modelled where it does not say."""

from __future__ import annotations

from typing import Literal

from flexgear.model.gear_mesh import GearMesh


class TrainGearMesh(GearMesh):
    """Gear-mesh options of a stage of lumped members: constant stiffness, linear contact."""

    model: Literal["per_pair", "lumped", "constant", "rectangular", "fourier"] = "constant"
    contact_law: Literal["one-sided", "linear"] = "linear"
