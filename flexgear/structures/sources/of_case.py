"""FE bodies of a stage; each member has the module of its name in this package."""

from importlib import import_module
from typing import Any

from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.structures.sources.fe_body import FeBody


def fe_sources(view: StageView) -> dict[BodyName, FeBody]:
    """Sources of all FE bodies of a stage, by body."""
    modules = {name: import_module(f"{__package__}.{name.part}") for name in view.fe_bodies}
    return {name: module.source(view) for name, module in modules.items()}


def common_parameters(view: StageView, part: str) -> dict[str, Any]:
    """Parameters of the source of a member that do not depend on the kind of body."""
    key = BodyName.of(view.name, part)
    return {
        "key": key,
        "section": view.fe_bodies[key],
        "material": view.material,
        "cyclic": view.case.solver.cyclic == "auto",
        "limit_hz": view.case.solver.reduction_limit,
    }
