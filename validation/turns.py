"""Where a stage is looked at, in the angle that `fg.static` asks for: that of the case's lead.

The lead is the first port of given speed, often not the carrier: in grc-750kw the generator's
shaft, which makes 81.5 turns while the carrier makes one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.solve.angles import lead_speed, stage_motions
from flexgear.solve.model import Model

Array = NDArray[np.float64]


def lead_angles(model: Model, stage: str, angles: Array) -> Array:
    """Rotations rad of the lead at which the stage has turned by ``angles`` rad: its carrier
    against its ring, the gear of a parallel stage."""
    theta = next(m.theta for m in stage_motions(model.case, model.flow) if m.name == stage)
    return np.asarray(angles * lead_speed(model.case, model.flow) / theta)
