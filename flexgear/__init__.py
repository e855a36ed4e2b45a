"""flexgear: dynamics of planetary gear trains whose rings, carriers and shafts bend.

The public face: from a case to a labelled result.

    case = flexgear.load_case("wind-5mw")
    model = flexgear.assemble(case, rigid=["ring"])
    static = flexgear.static(model, carrier_angle=[0.0, 0.1])
    run = flexgear.transient(model, duration=0.5)

Names are imported when they are first used, so that `import flexgear` is fast and a command that
needs no FE mesh never loads gmsh.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in typing, which takes a while to load
if TYPE_CHECKING:
    from typing import Any

__version__ = "0.2.0"

_HOME = {
    "Case": "flexgear.model.case",
    "load_case": "flexgear.model.load",
    "FlexgearError": "flexgear.model.errors",
    "InputError": "flexgear.model.errors",
    "power_flow": "flexgear.gears.power_flow",
    "Model": "flexgear.solve.model",
    "assemble": "flexgear.solve.model",
    "static": "flexgear.solve.static",
    "modes": "flexgear.solve.modes",
    "campbell": "flexgear.solve.campbell",
    "transient": "flexgear.solve.transient",
    "deformed": "flexgear.solve.deformed",
    "mode_field": "flexgear.solve.deformed",
    "deformed_grid": "flexgear.views.render",
    "field_grid": "flexgear.views.render",
    "save_series": "flexgear.views.field_series",
    "swing": "flexgear.views.field_series",
    "run": "flexgear.solve.run",
    "stage_part": "flexgear.results.stage_part",
    "radial_harmonics": "flexgear.results.harmonics",
    "sweep": "flexgear.studies.sweep",
    "tolerance": "flexgear.studies.tolerance",
}

__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    """A public name from the module that owns it."""
    if name not in _HOME:
        raise AttributeError(f"module 'flexgear' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
