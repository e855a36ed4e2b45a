"""Equilibria of a case: at given positions, over cycles of a stage's gear mesh, and load sharing.

Gear-mesh cycles are solved with perfect gears and pins, but with flank modifications: errors of
single teeth do not have the period of the gear mesh. For a flexible ring, whose cycles differ by
the position of bolts, several cycles are solved, spread over a turn. Load sharing of a train that
is linear in its errors is computed at all positions of the error cycle, that of other trains over a
number of whole gear-mesh cycles, spread over the error cycle.
"""

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.analysis.equilibrium import revolution
from flexgear.arrays import Array
from flexgear.gears.bearings.basic_life import bearing_life_hours
from flexgear.gears.bearings.nominal import bearing_speed
from flexgear.model.errors import FlexgearError
from flexgear.model.stage import Stage
from flexgear.results.face_load import OVER_POSITIONS, face_figures, positions_for, with_orders
from flexgear.results.labelled_dataset import coordinate, groups_in, labelled_dataset
from flexgear.results.load_sharing import (
    cycle_maxima,
    sharing_coefficients,
    sharing_histories,
    without_rounding,
)
from flexgear.results.stage_figures import bearing_forces, root_extremes
from flexgear.results.time_figures import displacement_summary
from flexgear.solve.angles import (
    cycles_of_train,
    lead_speed,
    one_turn,
    samples_of_stage,
    stage_motions,
)
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.dataset import equilibrium_data, result_attrs, result_labels
from flexgear.solve.linear import LinearTrain, linear_train, why_not_linear
from flexgear.solve.model import Model, first_torque, rated_rotations

UNLOADED = 1e-6  # force over the largest below which it is rounding, 2e-8 beside FE planets


def static(
    model: Model,
    carrier_angle: ArrayLike = 0.0,
    torque: float | None = None,
    progress: Progress = silent,
    **attrs: Any,
) -> xr.Dataset:
    """Dataset of the equilibria at p positions.

    carrier_angle (p,): rotations of the reference member (the first port of given speed that is not
    zero, mostly a carrier), rad, all other rotations being in rated proportion; they are the
    coordinate ``lead_angle`` of the dataset. ``solve.angles.lead_angles`` gives them from angles of
    a stage. torque: on the first input, N·m, the others in rated proportion; rated if left out.
    attrs: further attributes. InputError for a torque that is not finite."""
    system, lead = model.system, np.atleast_1d(np.asarray(carrier_angle, dtype=float))
    equilibrium = revolution(
        model.modal,
        rated_rotations(system, lead),
        first_torque(system, torque),
        lambda share: progress("equilibria", share),
    )
    data = equilibrium_data(
        model, equilibrium, closure_max=float(equilibrium.closure.max()), **attrs
    )
    return data.assign_coords(lead_angle=coordinate("lead_angle", "position", lead))


def position_figures(model: Model, data: xr.Dataset) -> dict[str, Any]:
    """Figures of one position of a dataset of equilibria; units are the ends of their names."""
    force = without_rounding(data["gear_mesh_force"].to_numpy(), float(np.abs(model.rated).max()))
    factor = data["planet_load_factor"].to_numpy()
    groups = groups_in(data)
    figures: dict[str, Any] = {
        "port_torque_nm": data["port_torque"].to_series().to_dict(),
        "gear_mesh_force_n": {g: force[gear_meshes].tolist() for g, gear_meshes in groups.items()},
        "planet_load_factor": {
            g: factor[gear_meshes].tolist()
            for g, gear_meshes in groups.items()
            if np.all(np.isfinite(factor[gear_meshes]))
        },
        "distance_from_axis_um": displacement_summary(data),
    }
    if "face_line_load" in data:
        figures["face_load"] = {
            flank: {k: v for k, v in of_flank.items() if k not in OVER_POSITIONS}
            for flank, of_flank in face_figures(data.expand_dims("position")).items()
        }
        figures |= _root_stress(model, data.expand_dims("position"))
    loads = bearing_loads(model, data)
    for key, of_planets in (("planet_bearing", True), ("bearing", False)):
        of_kind = {name: row for name, (row, planet) in loads.items() if planet == of_planets}
        figures |= {key: of_kind} if of_kind else {}
    if "sensor_static" in data:
        values, units = data["sensor_static"], data["static_sensor_unit"]
        figures["sensors"] = {
            str(name): {"value": float(values.sel(static_sensor=name)), "unit": str(unit.item())}
            for name, unit in zip(values["static_sensor"].to_numpy(), units, strict=True)
        }
    return figures


def _root_stress(model: Model, data: xr.Dataset) -> dict[str, Any]:
    """Entry ``root_stress_mpa`` by stage and gear; empty without root stress."""
    stresses: dict[str, dict[str, Any]] = {}
    for view in (model.case.view(stage.name) for stage in model.case.stages):
        for role, stress in root_extremes(data, view.name).items():
            stresses.setdefault(view.name, {})[view.part(role)] = stress
    return {"root_stress_mpa": stresses} if stresses else {}


def bearing_loads(model: Model, data: xr.Dataset) -> dict[str, tuple[dict[str, float], bool]]:
    """Radial and axial force that every bearing carries at one position, N, the direction of the
    radial one, degrees, the tilting moment about its own z, N m, if any, the least oil film
    of a plain bearing, and the basic rating life under this load, h, where the case has a rating;
    and whether it is a planet's bearing.

    Directions count in the sense of rotation from x of the axes of ``bearing_force``, on pins from
    radially outward.
    """
    out, least = {}, UNLOADED * float(np.abs(model.rated).max())
    for stage in model.flow.stages:
        for place, _, name, force in bearing_forces(model.case.view(stage.name), data):
            planet, speed = place.part == "planet", bearing_speed(place, stage)
            x, y, z = (float(v) for v in (-force if planet else force))
            size = math.hypot(x, y)
            size = size if size > least else 0.0
            row = {
                "force_n": size,
                "direction_deg": round(math.degrees(math.atan2(y, x)), 6) + 0.0 if size else 0.0,
                "axial_n": z if abs(z) > max(UNLOADED * size, least * (not planet)) else 0.0,
            }
            moment = data["bearing_force"].sel(support=name).to_numpy()[3:5]
            tilt = math.hypot(*moment - place.bearing.z * np.array([-force[1], force[0]]))
            if tilt > least * model.case.stage(stage.name).face_width:
                row["tilting_moment_nm"] = tilt
            if planet and "film_thickness" in data:
                film = float(data["film_thickness"].sel(bearing=str(name)))
                row |= {"oil_film_um": 1e6 * film} if math.isfinite(film) else {}
            life = bearing_life_hours(place.bearing, size, speed, row["axial_n"])
            if life is not None and math.isfinite(life):
                row["life_h"] = life
            out[str(name)] = row, planet
    return out


CYCLES = 7  # for a flexible ring; prime, to have few common factors with planets and bolts


def gear_mesh_cycles(model: Model, stage: str, progress: Progress = silent) -> xr.Dataset:
    """Dataset of the equilibria without errors over cycles of a stage's gear mesh under rated
    torque, with orders of the transmission error up to ``solver.static_orders`` and the phase
    ``gear_mesh_phase`` in cycles, for the flanks of the stage, which must turn."""
    phase, lead = _positions(model, stage)
    ideal = model.without_errors() if model.has_errors else model
    data = static(ideal, lead, progress=progress, stage=stage)
    data = data.isel(flank=data["flank_stage"].to_numpy() == stage)
    return with_orders(data, phase, model.case.solver.static_orders)


def sliced_stages(model: Model) -> list[str]:
    """Names of the stages that turn and whose tooth pairs have slices."""
    return [s.name for s in _turning(model) if s.gear_mesh.model == "face_load"]


def shared_stages(model: Model) -> list[str]:
    """Names of the stages that turn and have more than one planet."""
    return [s.name for s in _turning(model) if s.planets > 1]


def _turning(model: Model) -> list[Stage]:
    motions = stage_motions(model.case, model.flow)
    return [s for s, motion in zip(model.case.stages, motions, strict=True) if motion.theta]


def _positions(model: Model, stage: str) -> tuple[Array, Array]:
    """Phases (p,) of the gear mesh in cycles, and rotations (p,) of the reference member, rad."""
    motion = next(m for m in stage_motions(model.case, model.flow) if m.name == stage)
    per_turn, solver = motion.cycle.per_turn, model.case.solver
    per_cycle = max(positions_for(solver.static_orders), solver.positions_per_gear_mesh)
    count = min(CYCLES, per_turn) if stage in model.case.fe_ring_stages else 1
    start = np.floor(np.arange(count) * per_turn / count)
    phase = (start[:, None] + np.arange(per_cycle) / per_cycle).ravel()
    ratio = abs(lead_speed(model.case, model.flow) / motion.theta)
    return phase, 2.0 * math.pi / per_turn * ratio * phase


SHOWN_CYCLES = 200  # largest number of gear-mesh cycles with all positions in a dataset
CHUNK = 20_000  # positions solved together


def stages_sharing(
    model: Model, stage: str, *, cycles: int | None = None, progress: Progress = silent
) -> xr.Dataset:
    """Dataset of the load sharing of one planetary stage under rated torque: positions of one turn
    of the stage, largest values of every solved gear-mesh cycle, and coefficients over all cycles.
    cycles: largest number of cycles; see ``samples_of_stage``. FlexgearError for a stage with less
    than two planets or without rotation."""
    number = model.case.stage_index(stage)
    motions = stage_motions(model.case, model.flow)
    linear = linear_train(model.system) if why_not_linear(model.system) is None else None
    every = cycles_of_train(motions, number)
    if model.case.stages[number].planets < 2:
        raise FlexgearError(f"{stage} has no planets that share a load")
    samples = samples_of_stage(model.case, motions, number, cycles, linear is not None)
    force = _forces(model, linear, samples.angles, progress, f"{stage}: load sharing")
    columns = model.gear_meshes.of_stage(stage)
    names = tuple(model.gear_meshes.names[k] for k in columns)
    per_cycle = float(samples.per_gear_mesh)
    turn = one_turn(
        motions[number], lead_speed(model.case, model.flow), int(per_cycle), SHOWN_CYCLES
    )
    turn_force = (  # already solved where the error cycle is one turn
        force[:, columns]
        if np.array_equal(turn, samples.angles)
        else _forces(model, linear, turn, progress, f"{stage}: one turn")[:, columns]
    )
    return labelled_dataset(
        "position",
        np.arange(len(turn)),
        {
            "input_angle": rated_rotations(model.system, turn),
            "gear_mesh_force": turn_force,
            "rated_gear_mesh_force": model.rated[columns],
            **sharing_histories(turn_force, model.rated[columns], names),
            **sharing_coefficients(force[:, columns], names, {stage: per_cycle}),
            "cycle_maximum": cycle_maxima(force[:, columns], per_cycle),
            "cycle_number": samples.gear_mesh,
        },
        result_attrs(
            model,
            stage=stage,
            cycles=float("inf") if every is None else every,
            cycles_looked_at=len(samples.gear_mesh),
            positions_per_gear_mesh=samples.per_gear_mesh,
            complete=int(every is not None and len(samples.gear_mesh) == every),
        ),
        result_labels(model),
        names,
    )


def _forces(
    model: Model, linear: LinearTrain | None, lead: Array, progress: Progress, progress_text: str
) -> Array:
    """Gear-mesh forces (p, G), N, at rotations ``lead`` (p,) of the reference member, rad."""
    system = model.system
    parts: list[Array] = []
    for first in range(0, len(lead), CHUNK):
        input_angles = rated_rotations(system, lead[first : first + CHUNK])
        if linear is not None:
            parts.append(linear.forces(input_angles) @ model.gear_meshes.sign)
        else:

            def watch(share: float, done: int = first) -> None:
                progress(progress_text, (done + share * CHUNK) / max(len(lead), CHUNK))

            equilibrium = revolution(model.modal, input_angles, system.rated_torque, watch)
            parts.append(model.gear_meshes.forces(equilibrium.pair_load))
    progress(progress_text, 1.0)
    return without_rounding(np.concatenate(parts))


def sharing_attrs(data: xr.Dataset) -> dict[str, Any]:
    """Figures on the sampling of a dataset of load sharing, for summaries."""
    cycles = float(data.attrs["cycles"])
    return {
        "error_cycle_gear_meshes": int(cycles) if np.isfinite(cycles) else None,
        "gear_meshes_looked_at": int(data.attrs["cycles_looked_at"]),
        "complete": bool(data.attrs["complete"]),
    }
