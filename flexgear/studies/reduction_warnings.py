"""What is to be said about reductions whose errors are larger than promised."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from flexgear.coupling.pace import stage_pace
from flexgear.coupling.system import Variant
from flexgear.model.case import Case
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.structures.reduced import ReducedBody
from flexgear.studies.stage_bodies import variant_of

PROMISED = 0.02  # error of a reduction (``structures.estimate``) without a warning
_FINER = {"quick": "standard", "standard": "fine"}
_OTHER_TIE = {"root": "flank", "flank": "root"}


def stage_warnings(
    case: FlexibleStage, bodies: Sequence[ReducedBody], variant: Variant | None = None
) -> list[str]:
    """A line for every body that bends and misses the promise; variant: what bends."""
    return _warnings(case, bodies, variant or variant_of(case), "", "")


def train_warnings(
    train: Case,
    bodies: Mapping[str, Sequence[ReducedBody]],
    variants: Mapping[str, Variant],
) -> list[str]:
    """The same for every flexible stage; bodies and variants by its name."""
    found = []
    for stage in train.stages:
        if stage.flexible is not None:
            keys = f"stages.{stage.name}.flexible."
            found += _warnings(
                stage.flexible, bodies[stage.name], variants[stage.name], f"{stage.name}.", keys
            )
    return found


def _warnings(
    case: FlexibleStage, bodies: Sequence[ReducedBody], bends: Variant, at: str, keys: str
) -> list[str]:
    """Lines about the bodies that bend; at: before their names, keys: before those of the case."""
    found = []
    for body in bodies:
        if getattr(bends, body.name):
            if said := _fault(body.report):
                found.append(f"{at}{body.name}: {said}; {_remedy(case, body.name, keys)}")
            if said := _frequency_fault(body.report, case):
                found.append(
                    f"{at}{body.name}: {said}; raise {keys}{body.name}.fixed_interface_modes"
                )
    return found


def _frequency_fault(report: Mapping[str, Any], case: FlexibleStage) -> str:
    """What is wrong with a reduction's frequencies, empty where nothing is."""
    error, to = report.get("frequency_error", 0.0), report.get("frequency_limit_hz", math.inf)
    if error > PROMISED:
        return (
            f"frequencies up to {to:.4g} Hz are up to {100 * error:.2g} % too high in the reduced "
            f"body, above {100 * PROMISED:g} %"
        )
    wanted = stage_pace(case).reduction_limit
    if to < wanted * (1 - 1e-9):
        return (
            f"{report['fixed_interface_modes']} fixed-interface modes answer for frequencies up to "
            f"{to:.4g} Hz, and {wanted:.4g} Hz are asked for"
        )
    return ""


def _fault(report: Mapping[str, Any]) -> str:
    """What is wrong with a reduction, empty where nothing is."""
    error = report.get("static_error")
    if error is None or error <= PROMISED:
        return ""
    cases = report.get("static_error_cases", {})
    worst = f" (load: {max(cases, key=cases.__getitem__)})" if cases else ""
    return f"static error {100 * error:.1f} %{worst}, above {100 * PROMISED:g} %"


def _remedy(case: FlexibleStage, name: str, keys: str) -> str:
    """What makes the error smaller, or shows how little it matters."""
    part, ways = getattr(case, name), []
    if part.fe_mesh == "file":
        ways.append("refine its FE mesh")
    elif finer := _FINER.get(case.solver.fidelity):
        ways.append(f'set {keys}solver.fidelity = "{finer}"')
    if name == "ring":
        ways.append(f'try {keys}ring.tie = "{_OTHER_TIE[part.tie]}"')
    ways.append(f"compare with {keys}{name}.flexible = false to see how much its bending matters")
    return ", or ".join(ways)
