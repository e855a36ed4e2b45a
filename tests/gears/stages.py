"""Gears and stages that tests share, written down in SI without a case file, and their views."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flexgear.gears.errors import stage_errors
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.gears.tool import PLAIN_TOOL, PlainTool
from flexgear.gears.tooth import ToothGeometry, tooth_geometry
from flexgear.model.bodies import Material
from flexgear.model.load import load_case
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView

STEEL = Material(young_modulus=206e9, poisson_ratio=0.3, density=7850.0)


UNLOADED = {"sun": 0.0, "ring": 0.0}  # for stiffness that does not depend on the load


@dataclass(frozen=True)
class Gear:
    """A rack and what is cut with it; lengths m, angles rad."""

    teeth: int = 31
    profile_shift: float = 0.2
    addendum: float = 1.0
    dedendum: float = 1.25
    root_fillet: float = 0.3
    normal_module: float = 5e-3
    pressure_angle: float = math.radians(20)
    helix_angle: float = 0.0
    tool: PlainTool = PLAIN_TOOL

    def model_copy(self, *, update: dict[str, object]) -> Gear:
        """As gears of a case are changed."""
        return replace(self, **update)  # type: ignore[arg-type]

    def tooth(self, internal: bool = False, **changes: object) -> ToothGeometry:
        """Of this gear, or of one with some numbers changed."""
        gear = replace(self, **changes)  # type: ignore[arg-type]
        return tooth_geometry(gear, gear, internal=internal)


def seen(stage: Stage, source: str = "my.toml") -> StageView:
    """A lumped stage as gear functions see it."""
    case = load_case("lin-parker").model_copy(update={"source": source, "material": STEEL})
    return StageView(case, stage)


def paths_of(stage: Stage):
    """Paths by kind and side of a lumped stage."""
    return stage_paths(seen(stage), UNLOADED)


def flexible_paths(case):
    """Paths by kind of a flexible stage at its rated load."""
    paths = stage_paths(case, power_flow(case.case).stages[0].gear_mesh_forces)
    return {kind: path for (kind, _), path in paths.items()}


def flexible_errors(case):
    """Errors by kind of a flexible stage."""
    paths = stage_paths(case, power_flow(case.case).stages[0].gear_mesh_forces)
    return {kind: e for (kind, _), e in stage_errors(case, paths).items()}


def planetary(**changes) -> Stage:
    """A spur stage that assembles: 3 planets, 24/30/84 teeth of module 10 mm."""
    data = {
        "kind": "planetary", "planets": 3, "normal_module": 0.01,
        "pressure_angle": math.radians(20), "face_width": 0.1, "planet_bearing": {"radial": 1e9},
        "sun": {"teeth": 24}, "planet": {"teeth": 30}, "ring": {"teeth": 84}, "carrier": {},
        **changes,
    }  # fmt: skip
    return Stage(**data)


def helical(**changes) -> Stage:
    """The same with β = 12°."""
    return planetary(**{"helix_angle": math.radians(12), "planet_hand": "right", **changes})


def parallel(**changes) -> Stage:
    """Pinion and gear of 24 and 95 teeth with profile shifts, β = 10°, standing at 40°."""
    data = {
        "kind": "parallel", "normal_module": 0.014, "pressure_angle": math.radians(20),
        "helix_angle": math.radians(10), "planet_hand": "right", "face_width": 0.36,
        "position": math.radians(40),
        "pinion": {"teeth": 24, "profile_shift": 0.48},
        "gear": {"teeth": 95, "profile_shift": 0.669}, **changes,
    }  # fmt: skip
    return Stage(**data)


def lin_parker(planets: int = 3, **changes) -> Stage:
    """Base diameters as printed by Lin and Parker 1999, which do not fit one another."""
    changes.setdefault("gear_mesh", {"sun_stiffness": 5e8, "ring_stiffness": 5e8})
    return planetary(
        planets=planets, normal_module=0.0028, face_width=0.02, allow_unassemblable=True,
        center_distance=0.0884, sun_pressure_angle=math.radians(24.6),
        ring_pressure_angle=math.radians(24.6),
        sun={"teeth": 27, "base_diameter": 0.07742},
        planet={"teeth": 35, "base_diameter": 0.10035},
        ring={"teeth": 99, "base_diameter": 0.27503}, **changes,
    )  # fmt: skip


def pair_indices(path, planet, theta, z=0.0):
    """Indices of the pairs whose contact line is on the path at z."""
    s = path.s0[planet] + path.rate * theta + path.slope * z
    return np.arange(
        math.ceil((path.s_lo - s) / path.base_pitch),
        math.floor((path.s_hi - s) / path.base_pitch) + 1,
    )


def contact(path, planet, index, theta, z=0.0):
    """Point (3,) at which a pair touches at z, in planet axes."""
    s = path.s0[planet] + index * path.base_pitch + path.rate * theta + path.slope * z
    return np.array([*(path.tangent_point - s * path.normal_xy), z])
