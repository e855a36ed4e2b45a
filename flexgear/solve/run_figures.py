"""Figures of a run, as ``summary.json`` has them: powers, stages, transients, torque drops."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.coupling.pace import timed_drops
from flexgear.gears.bearing_life import bearing_life_hours, planet_bearing_life_hours
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.root_stress import largest_root_stress
from flexgear.gears.stage_flow import StageFlow
from flexgear.model.case import Case
from flexgear.model.member import PlanetBearing
from flexgear.model.names import MemberName
from flexgear.model.stage_view import StageView
from flexgear.model.units import RPM
from flexgear.results.energy_balance import energy_account, largest_residual
from flexgear.results.pieces import between, ranges_of
from flexgear.results.root_stress import root_figures
from flexgear.results.settling import settled, window_of
from flexgear.results.summary import (
    distance_summary,
    drop_summary,
    finite,
    force_ranges,
    rim_stress_summary,
    steady_summary,
    torque_step_summary,
)
from flexgear.solve.angles import stage_motions
from flexgear.solve.long_run import TimedRun
from flexgear.solve.model import Model
from flexgear.solve.static import UNLOADED
from flexgear.solve.transient import train_histories

Array = NDArray[np.float64]


def depth_name(torque: float) -> str:
    """Name of a torque drop by the torque it drops to: "0.4e6" for 4e5 N·m, "1200" for 1200."""
    return f"{torque / 1e6:g}e6" if abs(torque) >= 1e5 else f"{torque:g}"


def flow_summary(flow: PowerFlow) -> dict[str, Any]:
    """Speeds, torques from outside and powers of all members."""
    members = {
        name: {
            "speed_rpm": speed * RPM,
            "torque_on_stage_nm": flow.branch_torque[name],
            "power_into_stage_w": flow.branch_power[name],
            **({"outside_torque_nm": flow.torque[name]} if name in flow.torque else {}),
        }
        for name, speed in flow.speed.items()
    }
    return {
        "mobility": flow.mobility,
        "input_power_w": flow.input_power,
        "circulating_power_w": flow.circulating_power,
        "members": members,
    }


def stages_summary(model: Model, equilibria: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Frequencies, mean forces, nominal root stresses, error cycles, bearing lives of the stages.

    equilibria: from whose positions the loads of bearings are.
    """
    flow, train = model.flow, model.case
    motions, lives = stage_motions(train, flow), planet_bearing_life_hours(train, flow)
    out: dict[str, dict[str, Any]] = {}
    for stage, motion in zip(train.stages, motions, strict=True):
        stage_flow = flow.stage(stage.name)
        out[stage.name] = {
            "kind": stage.kind,
            "gear_mesh_frequency_hz": stage_flow.gear_mesh_frequency,
            "rolling_power_w": stage_flow.stage_power,
            "sun_gear_mesh_force_n": abs(stage_flow.sun_gear_mesh_force),
            "error_cycle_gear_meshes": motion.cycle.gear_meshes,
        }
        view = train.view(stage.name)
        out[stage.name]["nominal_root_stress_mpa"] = {
            view.part(role): value / 1e6
            for role, value in largest_root_stress(view, stage_flow.gear_mesh_forces).items()
        }
        roots = root_figures(equilibria, stage.name)
        if roots:
            out[stage.name]["root_stress_mpa"] = {
                view.part(s): stress for s, stress in roots.items()
            }
        if stage.kind == "planetary":
            out[stage.name] |= {
                "ring_gear_mesh_force_n": abs(stage_flow.ring_gear_mesh_force),
                "planet_bearing_force_n": stage_flow.planet_bearing_force,
                "planet_speed_in_carrier_rpm": stage_flow.planet_relative_speed * RPM,
            }
        if math.isfinite(lives.get(stage.name, math.inf)):
            out[stage.name]["nominal_planet_bearing_life_h"] = lives[stage.name]
        least = UNLOADED * float(np.abs(model.rated).max())
        seats = _seat_loads(view, equilibria, least)
        if seats:
            largest = {side: float(load.max()) for side, load in seats.items()}
            out[stage.name]["carrier_bearing_force_n"] = largest
        over_positions = _lives(view, stage_flow, seats, equilibria, least)
        if over_positions:
            out[stage.name]["bearing_life_h"] = over_positions
    return out


def _lives(
    view: StageView,
    flow: StageFlow,
    seats: Mapping[str, Array],
    equilibria: xr.Dataset,
    least: float,
) -> dict[str, float]:
    """L₁₀ₕ of the bearings of planets and of a carrier's seats, under the constant loads of the
    same damage over the positions; without those that have no rating or do not wear."""
    lives = {}
    bearing = view.stage.planet_bearing
    if view.stage.kind == "planetary" and isinstance(bearing, PlanetBearing):
        for name in map(MemberName.parse, equilibria["bearing"].to_numpy().tolist()):
            if name.stage == view.name:
                force = equilibria["planet_bearing_force"].sel(bearing=name).to_numpy()
                load = _loaded(np.hypot(force[:, 0], force[:, 1]), least)
                speed = flow.planet_relative_speed
                lives[name.part] = bearing_life_hours(bearing, load, speed)
    for side, load in seats.items():
        seat = view.seat_bearings[side]
        lives[f"carrier_bearing_{side}"] = bearing_life_hours(seat, load, flow.carrier_speed)
    return {n: life for n, life in lives.items() if life is not None and math.isfinite(life)}


def _seat_loads(view: StageView, equilibria: xr.Dataset, least: float) -> dict[str, Array]:
    """Radial loads of a carrier's seats over the positions, N."""
    if not view.seat_bearings:
        return {}
    force = equilibria["bearing_force"]
    seats = {side: f"{view.name}.carrier_{side}" for side in view.seat_bearings}
    there = set(map(str, force["support"].to_numpy()))  # a bearing without stiffness is no support
    return {
        side: np.hypot(
            *(_loaded(force.sel(support=n, dof=d).to_numpy(), least) for d in ("ux", "uy"))
        )
        for side, n in seats.items()
        if n in there
    }


def _loaded(force: Array, least: float) -> Array:
    """Forces, zero where they are rounding."""
    return np.where(np.abs(force) > least, force, 0.0)


def transient_summary(run: TimedRun) -> dict[str, Any]:
    rest = ranges_of(settled(run.data), train_histories)
    forces = (part["gear_mesh_force"] for part in (rest.least, rest.mean, rest.largest))
    return {
        "duration_s": run.simulated,
        **window_of(run.data).figures,
        "steps": int(run.data.attrs["steps"]),
        "gear_mesh_force": force_ranges(*forces),
        "displacement_um_max": distance_summary(rest.largest["axis_distance"]),
    }


def unsettled_lines(runs: Mapping[str, TimedRun]) -> list[str]:
    """A line for transients that have not settled; their figures are of the whole run."""
    windows = {name: window_of(timed.data) for name, timed in runs.items()}
    unsettled = {name: w for name, w in windows.items() if w.settled is False}
    if not unsettled:
        return []
    names, window = ", ".join(unsettled), next(iter(unsettled.values()))
    return [
        f"transient, {names}: not settled within {window.end:.4g} s ({window.sentence}); largest "
        "values are over the whole run; give a longer solver.duration_s, or more damping"
    ]


def bodies_summary(
    models: Mapping[str, Model],
    datasets: Mapping[str, xr.Dataset],
    runs: Mapping[str, TimedRun],
) -> dict[str, Any]:
    """What only flexible stages have: FE meshes, reductions, steady running of rings."""
    first = next(iter(models.values()))
    case = first.case
    if not case.flexible_stages:
        return {}
    reports = {name: body.report for name, body in first.bodies.items()}
    compared = {n: settled(x.data) for n, x in runs.items() if not models[n].ideal}
    inertias = {port.member: case.port_inertia(port.member) for port in case.ports}
    steady = {
        stage: {
            **steady_summary(compared, datasets["equilibrium_without_errors"], stage),
            **window_of(next(iter(runs.values())).data).figures,
            "equilibrium_closure_max": datasets["equilibrium"].attrs["closure_max"],
            **rim_stress_summary(datasets["equilibrium"], stage),
            "inertia_kg_m2": inertias,
        }
        for stage in case.fe_ring_stages
    }
    return {
        "fe": {name: {"dofs": report["fe_dofs"]} for name, report in reports.items()},
        "reduction": {name: _reduction(report) for name, report in reports.items()},
        "second_reduction": {n: finite(m.modal.figures) for n, m in models.items() if not m.ideal},
        "kinematics": {s: kinematics(first, s) for s in case.flexible_stages},
        "steady": steady,
    }


def kinematics(model: Model, stage: str) -> dict[str, float]:
    """Speeds, frequency, contact ratios and expected force of a flexible stage."""
    flow, geometry = model.flow, stage_geometry(model.case.view(stage))
    stage_flow = flow.stage(stage)
    return {
        "carrier_speed_rpm": flow.speed[f"{stage}.carrier"] * RPM,
        "pin_speed_rpm": (stage_flow.carrier_speed - stage_flow.ring_speed) * RPM,
        "sun_speed_rpm": flow.speed[f"{stage}.sun"] * RPM,
        "gear_mesh_frequency_hz": stage_flow.gear_mesh_frequency,
        "contact_ratio_ring": geometry.ring_mesh.total_contact_ratio,
        "contact_ratio_sun": geometry.sun_mesh.total_contact_ratio,
        "expected_ring_mesh_force_n": abs(stage_flow.ring_gear_mesh_force),
        "planet_bearing_force_n": stage_flow.planet_bearing_force,
    }


def _reduction(report: Mapping[str, Any]) -> dict[str, Any]:
    """Figures of a reduction: what was kept, error estimates (None without), and the tie."""
    plain = (int, float, str, type(None))
    return {k: v for k, v in report.items() if isinstance(v, plain) and k != "fe_dofs"}


def drop_figures(case: Case, timed: TimedRun) -> dict[str, Any]:
    """Figures of a transient with a torque drop, from the moment at which the torque falls."""
    start, duration, after = timed_drops(case).times
    data = between(timed.data, start)  # what comes before lets the train settle
    return {
        **drop_summary(data),
        "window_s": [start, start + duration + after],
        **{stage: torque_step_summary(data, stage) for stage in case.fe_ring_stages},
    }


def residual_of_run(
    first: Model, runs: Mapping[str, TimedRun], drops: Mapping[tuple[float, str], TimedRun]
) -> float | None:
    """Largest energy residual over the torque drops, counted from the drop while steps are fine.

    Without torque drops it is that of the steady revolution; None where no account was kept.
    """
    start, duration, _ = timed_drops(first.case).times
    end = start + duration + first.pace.settling
    balanced = [
        between(timed.data, start, end)
        for (_, label), timed in drops.items()
        if label == first.variant
    ]
    dataset = runs[first.variant].data
    balanced = balanced or ([dataset] if "energy_kinetic" in dataset else [])
    residuals = [largest_residual(ranges_of(data, energy_account)) for data in balanced]
    return max(residuals, default=None)
