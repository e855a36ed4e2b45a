"""How a case's ``[solver]`` wants its time steps chosen."""

from __future__ import annotations

from typing import Any

from flexgear.analysis.step_plan import Adaptive
from flexgear.analysis.transient import Steps
from flexgear.coupling.pace import Pace
from flexgear.model.solver import Solver


def adaptive_steps(solver: Solver, pace: Pace) -> Adaptive | None:
    """Step sizes by an error estimate, or None where they are given."""
    if solver.step_tolerance == 0.0:
        return None
    return Adaptive(solver.step_tolerance, pace.shortest_time_step, pace.longest_time_step)


def step_attributes(steps: Steps) -> dict[str, Any]:
    """Attributes of a dataset: steps taken, steps refused, and how many of which size."""
    sizes = ", ".join(f"{h:.4g} s: {count}" for h, count in sorted(steps.by_size.items()))
    return {"steps": steps.taken, "steps_refused": steps.refused, "step_sizes": sizes}
