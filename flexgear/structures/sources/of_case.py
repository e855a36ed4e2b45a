"""FE bodies of a stage: the module here that has the name of a member makes its body."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.structures.sources.fe_body import FeBody


def fe_sources(view: StageView) -> dict[BodyName, FeBody]:
    """All FE bodies of a stage, of a "carrier" ``sources.carrier.source(view)``."""
    modules = {name: import_module(f"{__package__}.{name.part}") for name in view.fe_bodies}
    return {name: module.source(view) for name, module in modules.items()}


def common_parameters(view: StageView, part: str) -> dict[str, Any]:
    """Parameters that sources of all bodies have."""
    key = BodyName.of(view.name, part)
    return {
        "key": key,
        "section": view.fe_bodies[key],
        "material": view.material,
        "cyclic": view.case.solver.cyclic == "auto",
        "limit_hz": view.case.solver.reduction_limit,
    }
