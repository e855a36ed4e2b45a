"""Rated motion of a stage that stands alone, and the steps of time that its gear meshes allow."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flexgear.gears.power_flow import power_flow

if TYPE_CHECKING:
    from flexgear.gears.stage_flow import StageFlow
    from flexgear.model.flexible_stage import FlexibleStage

LEAST_STEPS = 4  # of a transient in a gear-mesh period


def rated_flow(stage: FlexibleStage) -> StageFlow:
    """Speeds, torques and mean forces at the rated speed and torque of the drive."""
    return power_flow(stage.as_case()).stages[0]


def longest_time_step(gear_mesh_frequency: float) -> float:
    """A quarter of a gear-mesh period, s; infinite at rest.

    With longer steps pairs come and go unseen between two of them, and stiffness that rises and
    falls once a period is not followed.
    """
    return 1.0 / (LEAST_STEPS * gear_mesh_frequency) if gear_mesh_frequency else math.inf
