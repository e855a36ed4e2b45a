"""One stage of a train seen as gear functions see a flexible stage."""

from __future__ import annotations

from dataclasses import dataclass

from flexgear.model.material import Material
from flexgear.model.stage import Stage
from flexgear.model.train_errors import TrainErrors
from flexgear.model.train_gear_mesh import TrainGearMesh


@dataclass(frozen=True)
class StageView:
    """What gear functions read of a case. source: how messages name the stage."""

    source: str
    material: Material
    stage: Stage
    gear_mesh: TrainGearMesh
    errors: TrainErrors
