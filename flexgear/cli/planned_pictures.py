"""Which pictures the run of a train gets; how they are drawn is the views' business."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from flexgear.gears.flanks import modified_flanks
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.stage_flow import StageFlow
from flexgear.model.case import Case
from flexgear.results.pieces import between
from flexgear.results.report.wording import of_stage, window_words
from flexgear.results.root_stress import root_figures
from flexgear.results.settling import settled, window_of
from flexgear.results.spectrum import force_spectra
from flexgear.results.tooth_pattern import (
    ToothPattern,
    carrying_sets,
    gear_pattern,
    planet_pattern,
)
from flexgear.views import face_load_charts, gear_mesh_charts, mode_charts, sharing_charts
from flexgear.views.campbell_chart import campbell_chart
from flexgear.views.flank_drawing import flank_drawing
from flexgear.views.gauge_chart import gauges_chart
from flexgear.views.pattern_charts import tooth_rows_chart
from flexgear.views.root_stress_chart import root_stress_chart
from flexgear.views.spectrum_chart import spectrum_chart
from flexgear.views.stage_drawing import front_drawing, section_drawing

MOST_SHOWN = 4000  # samples of a transient in a picture
MOST_READ = 1_000_000  # samples of a transient that a picture reads, the last ones
CYCLES_SHOWN = 12  # gear-mesh cycles of a stage in its close-up


Draw = Callable[[], Any]
Plan = dict[str, tuple[str, Draw]]  # caption and how to draw, by file name


def drawings_plan(case: Case, flow: PowerFlow) -> Plan:
    """Drawings of every stage by file name: caption and how to make them."""
    plan: Plan = {}
    for stage in case.stages:
        view, stage_title = case.view(stage.name), stage.name.replace("_", " ").capitalize()
        front, section = (partial(f, view) for f in (front_drawing, section_drawing))
        plan[f"drawing_front_{stage.name}"] = (f"{stage_title} to scale, front", front)
        plan[f"drawing_section_{stage.name}"] = (f"{stage_title} to scale, section", section)
    return plan | flanks_plan(case, flow)


def flanks_plan(case: Case, flow: PowerFlow) -> Plan:
    """Topographies of all modified flanks by file name: caption and how to make them."""
    plan: Plan = {}
    for stage in case.stages:
        stage_title = stage.name.replace("_", " ").capitalize()
        view = case.view(stage.name)
        paths = stage_paths(view, flow.stage(stage.name).gear_mesh_forces)
        for flank in modified_flanks(view, paths):
            plan[f"flank_{stage.name}_{flank.part}_{flank.name}"] = (
                f"{stage_title}: modified {flank.part} flank, {flank.name}",
                partial(flank_drawing, flank, stage_title),
            )
    return plan


def stages_plan(flow: PowerFlow, data: Mapping[str, xr.Dataset]) -> Plan:
    """Figures of any case by file name: caption and how to make them."""
    plan: Plan = {
        "power_flow": (
            "Speeds, torques and powers of the members",
            partial(sharing_charts.power_flow_chart, flow),
        ),
        "modes": (
            "Natural modes by type and energy",
            partial(mode_charts.modes_chart, data["modes"]),
        ),
        "campbell": (
            "Frequencies over speed, and what excites them",
            partial(campbell_chart, data["campbell"]),
        ),
    }
    plan |= _face_plan(flow, data)
    for stage in flow.stages:
        name = f"sharing_{stage.name}"
        if name in data:
            plan[name] = (
                f"Load sharing{of_stage(stage.name)}, quasi-static, over one turn",
                partial(sharing_charts.sharing_chart, data[name]),
            )
    return plan | _transient_plan(flow, data)


def _face_plan(flow: PowerFlow, data: Mapping[str, xr.Dataset]) -> Plan:
    """Pictures of load along the face, root stress and gear-mesh cycles, of pairs in slices."""
    plan: Plan = {}
    equilibria = data["equilibrium"]
    if "face_line_load" in equilibria:
        plan["face_line_load"] = (
            "Load along the face of every gear mesh, in the mean of the positions",
            partial(face_load_charts.along_face_chart, equilibria),
        )
        plan["face_contact_pattern"] = (
            "Contact pattern: largest line load over path and face",
            partial(face_load_charts.contact_pattern, equilibria),
        )
    if "gear_mesh_misalignment_by_cause" in equilibria:  # not in runs of earlier versions
        plan["face_misalignment"] = (
            "Misalignment of every gear mesh by what causes it",
            partial(face_load_charts.misalignment_chart, equilibria),
        )
        for stage in flow.stages:
            plan |= _rows_of_teeth(equilibria, stage.name)
    for stage in flow.stages:
        if root_figures(equilibria, stage.name):
            plan[f"root_stress_{stage.name}"] = (
                f"Root stress of {stage.name.replace('_', ' ')} over the positions and along "
                "the face (thin: fillets on the other side of the teeth)",
                partial(root_stress_chart, equilibria, stage.name),
            )
        cycles = data.get(f"gear_mesh_cycles_{stage.name}")
        if cycles is not None:
            plan[f"face_transmission_error_{stage.name}"] = (
                f"Transmission error{of_stage(stage.name)}, planet 1, over a gear-mesh cycle "
                "without errors",
                partial(gear_mesh_charts.transmission_error_chart, cycles),
            )
            plan[f"face_stiffness_{stage.name}"] = (
                f"Stiffness of the gear meshes{of_stage(stage.name)} over a cycle",
                partial(gear_mesh_charts.stiffness_chart, cycles),
            )
    return plan


def _transient_plan(flow: PowerFlow, data: Mapping[str, xr.Dataset]) -> Plan:
    """Forces, spectra, sharing, displacements and gauges of the transient in its window."""
    plan: Plan = {}
    transient = data["transient"]
    window = window_words(window_of(transient).figures)
    for stage in flow.stages:
        of, name = of_stage(stage.name), stage.name
        if stage.gear_mesh_frequency:
            plan[f"transient_forces_{name}"] = (
                f"Gear-mesh forces{of} in time, the last {CYCLES_SHOWN} gear-mesh cycles",
                partial(_forces, transient, stage),
            )
            plan[f"spectrum_{name}"] = (
                f"Spectrum of the gear-mesh forces{of}, planet 1, gear-mesh frequency "
                f"{stage.gear_mesh_frequency:.5g} Hz, {window}",
                partial(_spectrum, transient, stage),
            )
        if stage.kind == "planetary" and _shares(transient, name):
            plan[f"transient_sharing_{name}"] = (
                f"Load sharing{of} in time, {window}",
                partial(_sharing, transient, name),
            )
    plan["transient_displacements"] = (
        f"Displacement of central members in time, {window}",
        partial(_displacements, transient),
    )
    if "gauge_strain" in transient:
        plan["equilibrium_gauges"] = (
            "Strain of the gauges, equilibria",
            partial(gauges_chart, data["equilibrium"]),
        )
        plan["transient_gauges"] = (
            f"Strain of the gauges in time, {window}",
            partial(_gauges, transient),
        )
    return plan


def _of_stage(data: xr.Dataset, stage: str) -> xr.Dataset:
    """The gear meshes of one stage."""
    return data.isel(gear_mesh=np.flatnonzero(data["stage"].to_numpy() == stage))


def _shares(data: xr.Dataset, stage: str) -> bool:
    """Whether a stage has planets that share a load."""
    return stage in data["group_stage"].to_numpy()


def _forces(data: xr.Dataset, stage: StageFlow) -> Any:
    """Chart of a stage's gear-mesh forces in its last cycles."""
    end = float(data.variables["time"][-1])
    near = between(data, end - CYCLES_SHOWN / stage.gear_mesh_frequency)
    return sharing_charts.gear_mesh_forces(_of_stage(near, stage.name))


def _spectrum(data: xr.Dataset, stage: StageFlow) -> Any:
    """Spectra of a stage's gear-mesh forces in the settled part of a run."""
    return spectrum_chart(force_spectra(settled(data), stage.name, stage.gear_mesh_frequency))


def _sharing(data: xr.Dataset, stage: str) -> Any:
    """Chart of a stage's load sharing in the settled window."""
    settled_part = _of_stage(settled(data, MOST_READ), stage)
    return sharing_charts.sharing_chart(settled_part[["planet_load_factor"]].load())


def _displacements(data: xr.Dataset) -> Any:
    """Chart of how central members move in the settled window."""
    rest = settled(data, MOST_READ)[["body_displacement"]].sel(dof=["ux", "uy"])
    return sharing_charts.displacements_chart(rest.load())


def _gauges(data: xr.Dataset) -> Any:
    """Chart of the gauges, of as many samples as it can show."""
    rest = settled(data)
    step = max(1, rest.sizes["time"] // MOST_SHOWN)
    return gauges_chart(rest.isel(time=slice(None, None, step)))


def _rows_of_teeth(data: xr.Dataset, stage: str) -> Plan:
    """Contact patterns of a stage tooth by tooth; none where no pair of it has slices."""
    plan: Plan = {}
    for kind, side in carrying_sets(data, stage):
        teeth_title = f"{stage} {kind} {side}".strip().replace("_", " ")
        for name, pattern, caption in (
            (
                "",
                gear_pattern,
                f"Contact pattern of {teeth_title}, tooth by tooth, with all planets",
            ),
            (
                "planet_",
                planet_pattern,
                f"Contact pattern of planet 1 with {teeth_title}, tooth by tooth",
            ),
        ):
            file = f"face_rows_{stage}_{name}{kind}_{side}".rstrip("_")
            plan[file] = (caption, partial(_teeth_chart, pattern, data, stage, kind, side))
    return plan


def _teeth_chart(pattern: Callable[..., ToothPattern], data: xr.Dataset, *which: str) -> Any:
    return tooth_rows_chart(pattern(data, *which))
