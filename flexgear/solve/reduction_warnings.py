"""What is to be said about reductions whose errors are larger than promised."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

from flexgear.model.case import Case
from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.solve.bodies import reduction_limit
from flexgear.structures.estimate import PROMISED
from flexgear.structures.reduced import ReducedBody

_OTHER_TIE = {"root": "flank", "flank": "root"}


def reduction_warnings(
    case: Case, bodies: Mapping[BodyName, ReducedBody], rigid: Collection[BodyName]
) -> list[str]:
    """A line for every body that bends and misses the promise; rigid: those that do not bend."""
    texts = []
    for name, body in bodies.items():
        if name in rigid:
            continue
        view = case.view(name.stage)
        if fault := _fault(body.report):
            texts.append(f"{name}: {fault}; {_remedy(view, name.part)}")
        if fault := _frequency_fault(body.report, reduction_limit(case)):
            key = view.key(f"{name.part}.fe.fixed_interface_modes")
            texts.append(f"{name}: {fault}; raise {key}")
    return texts


def _frequency_fault(report: Mapping[str, Any], limit_hz: float) -> str:
    """What is wrong with a reduction's frequencies, empty where nothing is."""
    error, to = report.get("frequency_error", 0.0), report.get("frequency_limit_hz", math.inf)
    if error is None:  # a body that was given reduced
        return ""
    if error > PROMISED:
        return (
            f"frequencies up to {to:.5g} Hz are up to {100 * error:.2g} % too high in the reduced "
            f"body, above {100 * PROMISED:g} %"
        )
    if to < limit_hz * (1 - 1e-9):
        return (
            f"{report['fixed_interface_modes']} fixed-interface modes answer for frequencies up to "
            f"{to:.5g} Hz, and {limit_hz:.5g} Hz are asked for"
        )
    return ""


def _fault(report: Mapping[str, Any]) -> str:
    """What is wrong with a reduction, empty where nothing is."""
    error = report.get("static_error")
    if error is None or error <= PROMISED:
        return ""
    load = f" (load: {report['static_error_load']})" if report.get("static_error_load") else ""
    return f"static error {100 * error:.1f} %{load}, above {100 * PROMISED:g} %"


def _remedy(view: StageView, name: str) -> str:
    """What makes the error smaller, or shows how little it matters."""
    ways = []
    if name == "ring":
        ways.append(f'try {view.key("ring.fe.tie")} = "{_OTHER_TIE[view.ring.tie]}"')
    key = view.key(f"{name}.fe.flexible")
    ways.append(f"compare with {key} = false to see how much its bending matters")
    return ", or ".join(ways)
