"""Numerical options of a train."""

from __future__ import annotations

from pydantic import Field

from flexgear.model.solver import PaceKeys
from flexgear.model.units import Time


class TrainSolver(PaceKeys):
    """settle: start-up left out of load sharing. positions_per_gear_mesh: quasi-static positions a
    gear-mesh cycle. Without modes_to and modes_accuracy trains of rigid bodies keep all modes.
    """

    positions_per_gear_mesh: int = Field(default=16, ge=2, le=10000)
    settle: Time | None = Field(default=None, ge=0.0, le=1e6)
