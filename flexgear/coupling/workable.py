"""What cannot work is said before any work: gears, generators of FE meshes, supports.

Every command asks ``require_workable`` first. Nothing is checked here that the work itself does not
check: the coupled system is built from the same code on rigid rings and carriers, whose rigid
motions are those of the finite-element bodies.
"""

from __future__ import annotations

import math

from flexgear.coupling.build import build_system
from flexgear.coupling.system import System
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.kinematics import longest_time_step
from flexgear.gears.paths import require_assembly, stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView, inside
from flexgear.structures.bodies import Body
from flexgear.structures.sources.of_case import fe_sources


def require_workable(case: Case) -> None:
    """InputError, with the key and what to do, for a case that no analysis could be made of."""
    flow = power_flow(case)
    _require_steps(case, max(stage.gear_mesh_frequency for stage in flow.stages))
    for stage in case.stages:
        if not stage.is_flexible:
            forces = flow.stage(stage.name).gear_mesh_forces
            stage_paths(case.view(stage.name), forces)
            continue
        with inside(case, stage):
            _require_stage(case.view(stage.name))
    for stage in case.stages:
        _require_influences(case.view(stage.name))
    rigid_system(case)


def rigid_system(case: Case) -> System:
    """The coupled train with its flexible bodies made rigid by the case's sizes."""
    bodies: dict[BodyName, Body] = {}
    for stage in case.stages:
        if stage.is_flexible:
            with inside(case, stage):
                view = case.view(stage.name)
                for name, source in fe_sources(view).items():
                    bodies[name] = source.rigid(from_files=False)
    return build_system(case, bodies, case.flexible_bodies, bending=False)


def _require_steps(case: Case, frequency: float) -> None:
    """Time steps see every tooth pair of the fastest gear mesh (Hz) come and go."""
    longest, period = longest_time_step(frequency), 1 / frequency if frequency else math.inf
    steps = case.solver.step_tolerance == 0.0
    for key in ["time_step", "step_time_step"] if steps else ["longest_time_step"]:
        step = getattr(case.solver, key)
        if step is not None and step > longest:
            raise InputError(
                case.source,
                f"solver.{key}_s",
                f"a step of {step:.3g} s is too long for a gear-mesh period of {period:.3g} s",
                f"at most {longest:.3g} s; ten times less shows what the gear mesh excites",
            )


def _require_stage(view: StageView) -> None:
    """Gears mesh and assemble; FE meshes can be made, or their files are there and in place."""
    require_assembly(view, stage_geometry(view))
    for source in fe_sources(view).values():
        source.check()


def _require_influences(view: StageView) -> None:
    if "fe" in (view.gear_mesh.tooth_compliance, view.gear_mesh.root_stress):
        from flexgear.structures.tooth_influence import require_influences  # half of the package

        require_influences(view)
