"""Equilibria of a train: gear-mesh forces, planet bearings, floats of members."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.analysis.equilibrium import revolution
from flexgear.gears.bearing_life import bearing_life_hours
from flexgear.model.member import PlanetBearing
from flexgear.model.names import MemberName
from flexgear.results.face_load import face_figures
from flexgear.results.group_sharing import without_rounding
from flexgear.results.labelled_dataset import coordinate, groups_in
from flexgear.results.root_stress import root_extremes
from flexgear.results.time_figures import CENTRAL, displacement_summary
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.dataset import equilibrium_data
from flexgear.solve.model import Model, rated_rotations

__all__ = ["CENTRAL", "bearing_loads", "position_figures", "static"]

UNLOADED = 1e-9  # of the load or of the largest gear-mesh force, rounding


def static(
    model: Model,
    carrier_angle: ArrayLike = 0.0,
    torque: float | None = None,
    progress: Progress = silent,
    **attrs: Any,
) -> xr.Dataset:
    """Equilibria at rotations (p,) rad of the lead, the other rotations in rated proportion.

    carrier_angle: of the lead, the first port of given speed that turns: a carrier mostly, but the
    output where only its speed is given; ``solve.angles.lead_angles`` gives it by a stage's own.
    It is the coordinate ``lead_angle`` of the positions; the variable ``carrier_angle`` is that of
    every stage's own carrier. torque: N·m on the first input, the others in rated proportion; rated
    unless given.
    """
    system, lead = model.system, np.atleast_1d(np.asarray(carrier_angle, dtype=float))
    torques = system.rated_torque if torque is None else torque
    equilibrium = revolution(
        model.modal,
        rated_rotations(system, lead),
        torques,
        lambda share: progress("equilibria", share),
    )
    data = equilibrium_data(
        model, equilibrium, closure_max=float(equilibrium.closure.max()), **attrs
    )
    return data.assign_coords(lead_angle=coordinate("lead_angle", "position", lead))


def position_figures(model: Model, data: xr.Dataset) -> dict[str, Any]:
    """Figures of one position of a dataset of equilibria, in the units their names end in."""
    force = without_rounding(data["gear_mesh_force"].to_numpy(), float(np.abs(model.rated).max()))
    factor = data["planet_load_factor"].to_numpy()
    at = groups_in(data)
    figures: dict[str, Any] = {
        "port_torque_nm": _by_label(data["port_torque"], "port"),
        "gear_mesh_force_n": {g: force[gear_meshes].tolist() for g, gear_meshes in at.items()},
        "planet_load_factor": {
            g: factor[gear_meshes].tolist()
            for g, gear_meshes in at.items()
            if np.all(np.isfinite(factor[gear_meshes]))
        },
        "distance_from_axis_um": displacement_summary(data),
    }
    if "face_line_load" in data:
        figures["face_load"] = face_figures(data.expand_dims("position"))
        figures |= _root_stress(model, data.expand_dims("position"))
    if "planet_bearing_force" in data:
        figures["planet_bearing"] = bearing_loads(model, data)
    return figures


def _root_stress(model: Model, data: xr.Dataset) -> dict[str, Any]:
    """``root_stress_mpa`` by stage and gear, empty where no stage has it."""
    views = [model.case.view(stage.name) for stage in model.case.stages]
    stresses = {
        view.name: {
            view.part(role): stress for role, stress in root_extremes(data, view.name).items()
        }
        for view in views
    }
    stresses = {stage: gears for stage, gears in stresses.items() if gears}
    return {"root_stress_mpa": stresses} if stresses else {}


def _by_label(values: xr.DataArray, dim: str) -> dict[str, float]:
    return {
        str(n): float(v) for n, v in zip(values[dim].to_numpy(), values.to_numpy(), strict=True)
    }


def bearing_loads(model: Model, data: xr.Dataset) -> dict[str, dict[str, float]]:
    """Size and direction (from radial outward, in the sense of rotation) of the force on every pin
    at one position; its basic rating life if that load lasted, where the case gives a rating and
    the bearing wears at all."""
    out = {}
    least = UNLOADED * float(np.abs(model.rated).max())
    for name in map(str, data["bearing"].to_numpy()):
        x, y, z = (float(v) for v in data["planet_bearing_force"].sel(bearing=name))
        size = math.hypot(x, y)
        size = size if size > least else 0.0
        out[name] = {
            "force_n": size,
            "direction_deg": round(math.degrees(math.atan2(y, x)), 6) + 0.0 if size else 0.0,
            "axial_n": z if abs(z) > UNLOADED * size else 0.0,
        }
        stage = model.case.stage(MemberName.parse(name).stage)
        speed = model.flow.stage(stage.name).planet_relative_speed
        if isinstance(stage.planet_bearing, PlanetBearing):
            life = bearing_life_hours(stage.planet_bearing, size, speed)
            if life is not None and math.isfinite(life):
                out[name]["life_h"] = life
    return out
