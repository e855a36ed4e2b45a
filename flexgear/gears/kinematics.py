"""The steps of time that a gear mesh allows."""

from __future__ import annotations

import math

LEAST_STEPS = 4  # of a transient in a gear-mesh period


def longest_time_step(gear_mesh_frequency: float) -> float:
    """A quarter of a gear-mesh period, s; infinite at rest.

    With longer steps pairs come and go unseen between two of them, and stiffness that rises and
    falls once a period is not followed.
    """
    return 1.0 / (LEAST_STEPS * gear_mesh_frequency) if gear_mesh_frequency else math.inf
