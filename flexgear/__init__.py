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

    from flexgear.gears.power_flow import power_flow as power_flow
    from flexgear.model.case import Case as Case
    from flexgear.model.errors import FlexgearError as FlexgearError
    from flexgear.model.errors import InputError as InputError
    from flexgear.model.load import load_case as load_case
    from flexgear.results.harmonics import radial_harmonics as radial_harmonics
    from flexgear.results.stage_part import stage_part as stage_part
    from flexgear.solve.campbell import campbell as campbell
    from flexgear.solve.deformed import deformed as deformed
    from flexgear.solve.deformed import mode_field as mode_field
    from flexgear.solve.model import Model as Model
    from flexgear.solve.model import assemble as assemble
    from flexgear.solve.modes import modes as modes
    from flexgear.solve.run import run as run
    from flexgear.solve.static import static as static
    from flexgear.solve.transient import transient as transient
    from flexgear.studies.sweep import sweep as sweep
    from flexgear.studies.tolerance import tolerance as tolerance
    from flexgear.views.field_series import save_series as save_series
    from flexgear.views.field_series import swing as swing
    from flexgear.views.render import deformed_grid as deformed_grid
    from flexgear.views.render import field_grid as field_grid

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
    """A public name from the module that owns it; functions look at their arguments' types."""
    if name not in _HOME:
        raise AttributeError(f"module 'flexgear' has no attribute {name!r}")
    from importlib import import_module

    attribute = getattr(import_module(_HOME[name]), name)
    if not isinstance(attribute, type):
        from flexgear.model.arguments import checked

        attribute = checked(attribute, name)
    globals()[name] = attribute
    return attribute


def __dir__() -> list[str]:
    return sorted(__all__)
