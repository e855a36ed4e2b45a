"""flexgear: dynamics of planetary gear trains with flexible rings, planets, carriers and shafts.

The public face, from a case to labelled results and their pictures:

    import flexgear as fg

    case = fg.load_case("wind-5mw", planets=5)
    model = case.assemble()
    equilibria = model.static(angle_deg=range(0, 72, 3))
    run = model.transient(duration=0.5)
    equilibria.fg.plot.ring_star()
    fg.compare(flexible=run, rigid=model.rigid("ring").transient(duration=0.5)).plot()

Names are imported when they are first used, so that `import flexgear` is fast and a command that
needs no FE mesh never loads gmsh.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in typing, which takes a while to load
if TYPE_CHECKING:
    from typing import Any

    from flexgear.face.accessor import Comparison as Comparison
    from flexgear.face.accessor import compare as compare
    from flexgear.face.accessor import open_dataset as open_dataset
    from flexgear.face.blocks import contact_paths as contact_paths
    from flexgear.face.blocks import geometry as geometry
    from flexgear.face.blocks import pair_stiffness as pair_stiffness
    from flexgear.face.blocks import reduce_fe_mesh as reduce_fe_mesh
    from flexgear.face.case import Case as Case
    from flexgear.face.case import load_case as load_case
    from flexgear.face.model import Model as Model
    from flexgear.face.runs import Rating as Rating
    from flexgear.face.runs import Run as Run
    from flexgear.face.runs import read_run as read_run
    from flexgear.face.runs import report as report
    from flexgear.gears.power_flow import power_flow as power_flow
    from flexgear.model.errors import FlexgearError as FlexgearError
    from flexgear.model.errors import InputError as InputError
    from flexgear.results.stage_part import stage_part as stage_part
    from flexgear.results.time_figures import radial_harmonics as radial_harmonics
    from flexgear.studies.sweep import sweep as sweep
    from flexgear.studies.tolerance import tolerance as tolerance
    from flexgear.views.field_series import save_series as save_series
    from flexgear.views.field_series import swing as swing
    from flexgear.views.render import field_grid as field_grid

__version__ = "0.2.0"

_NAMES = {  # by module
    "face.case": ("Case", "load_case"),
    "face.model": ("Model",),
    "face.runs": ("Run", "Rating", "read_run", "report"),
    "face.accessor": ("Comparison", "compare", "open_dataset"),
    "model.errors": ("FlexgearError", "InputError"),
    "face.blocks": ("geometry", "contact_paths", "pair_stiffness", "reduce_fe_mesh"),
    "gears.power_flow": ("power_flow",),
    "views.render": ("field_grid",),
    "views.field_series": ("save_series", "swing"),
    "results.stage_part": ("stage_part",),
    "results.time_figures": ("radial_harmonics",),
    "studies.sweep": ("sweep",),
    "studies.tolerance": ("tolerance",),
}
_MODULES = {name: f"flexgear.{module}" for module, names in _NAMES.items() for name in names}

_METHODS = {
    "assemble",
    "run",
    "rate",
    "static",
    "modes",
    "campbell",
    "stability",
    "linear_response",
    "transient",
    "deformed",
    "mode_field",
}
__all__ = ["__version__", *_MODULES]


def __getattr__(name: str) -> Any:
    """A public name, imported from its module; functions check the types of their arguments."""
    if name not in _MODULES:
        hint = "; cases and models have it as a method" if name in _METHODS else ""
        raise AttributeError(f"module 'flexgear' has no attribute {name!r}{hint}")
    from importlib import import_module

    module = import_module(_MODULES[name])
    attribute = getattr(module, name)
    if not isinstance(attribute, type):
        from flexgear.model.arguments import checked

        attribute = checked(attribute)
    if _MODULES[name].startswith("flexgear.studies."):
        import_module("flexgear.face.accessor")  # datasets have ``.fg`` from here on
        attribute = import_module("flexgear.face.notebook").with_bars(attribute)
    globals()[name] = attribute
    return attribute


def __dir__() -> list[str]:
    return sorted(__all__)
