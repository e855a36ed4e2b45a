"""flexgear: dynamics of planetary stages whose ring, carrier and sun shaft bend, and of trains.

The public face. Names are imported when they are first used, so that `import flexgear` is fast and
a command that needs no FE mesh never loads gmsh.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in typing, which takes a while to load
if TYPE_CHECKING:
    from typing import Any

__version__ = "0.1.0"

_HOME = {
    "FlexibleStage": "flexgear.model.flexible_stage",
    "Case": "flexgear.model.case",
    "load_case": "flexgear.model.load",
    "load_stage": "flexgear.model.load",
    "FlexgearError": "flexgear.model.errors",
    "InputError": "flexgear.model.errors",
    "stage_geometry": "flexgear.gears.geometry",
    "power_flow": "flexgear.gears.power_flow",
    "ring_body": "flexgear.structures.build",
    "carrier_body": "flexgear.structures.build",
    "Variant": "flexgear.coupling.system",
    "build_system": "flexgear.coupling.build",
    "train_system": "flexgear.coupling.train",
    "modal_system": "flexgear.coupling.modal",
    "radial_harmonics": "flexgear.results.harmonics",
    "load_sharing": "flexgear.results.load_sharing",
    "stage_bodies": "flexgear.studies.stage_bodies",
    "stage_modal": "flexgear.studies.stage_bodies",
    "variant_of": "flexgear.studies.stage_bodies",
    "equilibria": "flexgear.studies.single_runs",
    "simulate": "flexgear.studies.single_runs",
    "run_stage": "flexgear.studies.stage_run",
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
