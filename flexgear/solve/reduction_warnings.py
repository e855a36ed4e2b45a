"""Warnings about reduced bodies whose errors exceed the promised ones."""

import math
from collections.abc import Collection, Mapping
from typing import Any

from flexgear.coupling.pace import case_pace
from flexgear.model.bodies import MAX_MODES
from flexgear.model.case import Case
from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.structures.estimate import AT_END, PROMISED
from flexgear.structures.reduced import ReducedBody

OTHER_TIE = {"root": "flank", "flank": "root"}


def reduction_warnings(
    case: Case, bodies: Mapping[BodyName, ReducedBody], rigid: Collection[BodyName]
) -> list[str]:
    """A line for every body, unless it is rigid, whose reduction error exceeds the promised one."""
    texts, pace = [], case_pace(case)
    for name, body in bodies.items():
        if name in rigid:
            continue
        view = case.view(name.stage)
        if fault := _static_fault(body.report):
            remedy = _remedy(view, name.part, body.report.get("static_error_load") or "")
            texts.append(f"{name}: {fault}; {remedy}")
        if fault := _frequency_fault(body.report, pace.reduction_limit_of(name)):
            key = view.key(f"{name.part}.fe.fixed_interface_modes")
            most = body.report.get("fixed_interface_modes", 0) >= MAX_MODES
            remedy = "lower solver.gear_mesh_orders, as more modes are refused"
            texts.append(f"{name}: {fault}; {remedy if most else f'raise {key}'}")
    return texts


def _frequency_fault(report: Mapping[str, Any], limit_hz: float) -> str:
    """Warning about a reduction's frequencies; "" without a fault."""
    error, limit = report.get("frequency_error", 0.0), report.get("frequency_limit_hz", math.inf)
    if error is None:  # the body was given as matrices
        return ""
    if error > PROMISED:
        return (
            f"frequencies up to {limit:.5g} Hz are up to {100 * error:.2g} % too high in the "
            f"reduced body, above {100 * PROMISED:g} %"
        )
    if limit < limit_hz * (1 - 1e-9):
        return (
            f"{report['fixed_interface_modes']} fixed-interface modes answer for frequencies up to "
            f"{limit:.5g} Hz, and {limit_hz:.5g} Hz are asked for"
        )
    return ""


def _static_fault(report: Mapping[str, Any]) -> str:
    """Text that a reduction's static error exceeds the promised one, and under which load; "" if it
    does not."""
    error = report.get("static_error")
    if error is None or error <= PROMISED:
        return ""
    load = f" (load: {report['static_error_load']})" if report.get("static_error_load") else ""
    return f"static error {100 * error:.3g} %{load}, above {100 * PROMISED:g} %"


def _remedy(view: StageView, name: str, load: str) -> str:
    """Advice on how to reduce the static error of a body under a load, or to see its effect: FE
    influence on teeth that are tied at their roots includes the bending of the rim along the face.
    """
    key = view.key(f"{name}.fe.flexible")
    comparison = f"compare with {key} = false to see how much its bending matters"
    tie = view.fe_tie(name) if name in ("ring", "planet") else None
    if tie is None:
        return comparison
    changes = {f"{name}.fe.tie": OTHER_TIE[tie]}
    if AT_END in load and view.gear_mesh.tooth_compliance != "fe":
        changes = {"gear_mesh.tooth_compliance": "fe"}
        if tie != "root":
            changes[f"{name}.fe.tie"] = "root"
    keys = " and ".join(f'{view.key(key)} = "{value}"' for key, value in changes.items())
    return f"try {keys}, or {comparison}"
