"""What cannot work is said before any work: gears, generators of FE meshes, supports.

Every command asks ``require_workable`` first. Nothing is checked here that the work itself does not
check: the coupled system is built from the same code on rigid stand-ins of ring and carrier, whose
rigid motions are those of the finite-element bodies.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.build import build_system
from flexgear.coupling.system import System, Variant
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.kinematics import longest_time_step
from flexgear.gears.paths import require_assembly, stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.carrier import Carrier
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.ring import Ring
from flexgear.model.ring_supports import ring_supports
from flexgear.model.stage_view import StageView, inside, spoken
from flexgear.structures.fe_mesh import require_generated
from flexgear.structures.halves import whole_ring
from flexgear.structures.reduced import ReducedBody

Array = NDArray[np.float64]
RIGID = Variant(False, False, False)


def require_workable(case: Case) -> None:
    """InputError, with the key and what to do, for a case that no analysis could be made of."""
    with spoken(case):
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
        system_of_stand_ins(case)


def system_of_stand_ins(case: Case) -> System:
    """The coupled train with rigid bodies in the place of those that bend."""
    bodies = {}
    for stage in case.stages:
        if stage.is_flexible:
            with inside(case, stage):
                bodies[stage.name] = stand_ins(case.view(stage.name))
    return build_system(case, bodies, dict.fromkeys(bodies, RIGID), bending=False)


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
    for name in view.fe_parts:
        part: Ring | Carrier = getattr(view, name)
        if part.fe_mesh == "generate":
            require_generated(view, name)
        else:
            _require_file(view, name, Path(str(part.fe_mesh_file)))


def _require_file(view: StageView, name: str, file: Path) -> None:
    from flexgear.structures.build import require_file  # half of the package

    if not file.is_file():
        key = f"{name}.fe_mesh_file"
        problem = "is a folder" if file.is_dir() else "there is no such file"
        raise InputError(view.source, key, f"{file}: {problem}", "check the path")
    require_file(view, name)


def _require_influences(view: StageView) -> None:
    if "fe" in (view.gear_mesh.tooth_compliance, view.gear_mesh.root_stress):
        from flexgear.structures.tooth_influence import require_influences  # half of the package

        require_influences(view)


def stand_ins(view: StageView) -> tuple[ReducedBody | None, ReducedBody | None]:
    """Ring and carrier of a stage as rigid bodies of the size of the case; None where lumped."""
    return (
        _ring_stand_in(view) if "ring" in view.fe_parts else None,
        _carrier_stand_in(view) if "carrier" in view.fe_parts else None,
    )


def _ring_stand_in(view: StageView) -> ReducedBody:
    geometry, width = stage_geometry(view), view.stage.face_width
    nodes = {
        **_circle("tooth_{:03d}", view.ring_gear.teeth, geometry.ring.reference_radius),
        **{support.node: support.place for support in ring_supports(view.ring, width)},
    }
    inner = geometry.ring.root_radius
    outer = inner + view.ring.rim_thickness
    mass = view.material.density * math.pi * (outer**2 - inner**2) * width
    return whole_ring(view, _stand_in("ring", nodes, mass))


def _carrier_stand_in(view: StageView) -> ReducedBody:
    c, side = view.carrier, 1.0 if view.carrier.drive_side == "+z" else -1.0
    drive = 0.5 * c.plate_gap + c.plate_thickness_drive
    far = 0.5 * (c.plate_gap + c.seat_far.width) + c.plate_thickness_far
    radius = stage_geometry(view).center_distance
    nodes = {
        "drive": (0.0, 0.0, side * (drive + c.hub_length)),
        "bearing_drive": (0.0, 0.0, side * (drive + 0.5 * c.seat_drive.width)),
        "bearing_far": (0.0, 0.0, -side * far),
        **{
            f"pin_{i + 1}": (radius * math.cos(phi), radius * math.sin(phi), 0.0)
            for i, phi in enumerate(view.stage.planet_angles)
        },
    }
    plates = math.pi * (c.plate_diameter / 2) ** 2 * 2 * c.plate_thickness_drive
    return _stand_in("carrier", nodes, view.material.density * plates)


def _circle(
    name: str, number: int, radius: float, z: float = 0.0, first: float = 0.0
) -> dict[str, tuple[float, float, float]]:
    angles = first + 2 * math.pi * np.arange(number) / max(number, 1)
    return {
        name.format(k + 1): (radius * math.cos(a), radius * math.sin(a), z)
        for k, a in enumerate(angles)
    }


def _stand_in(name: str, nodes: dict[str, tuple[float, float, float]], mass: float) -> ReducedBody:
    """The mass shared by the nodes, each a ball about as far across as the body's nodes reach."""
    positions = np.array(list(nodes.values()))
    each, reach = mass / len(positions), np.abs(positions).max()
    node = each * np.array([1, 1, 1, *3 * [0.1 * reach**2]])
    size = 6 * len(positions)
    return ReducedBody(
        name=name,
        node_names=tuple(nodes),
        positions=positions,
        mass=np.diag(np.tile(node, len(positions))),
        stiffness=np.zeros((size, size)),
        n_modes=0,
        report={},
        points=np.zeros((0, 3)),
        cells=np.zeros((0, 8), dtype=np.int64),
        recovery=np.zeros((0, size), dtype=np.float32),
    )
