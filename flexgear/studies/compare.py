"""Comparison of load sharing by several analyses of one train, and of two trains."""

import math
from collections.abc import Mapping
from typing import Any

from flexgear.gears.bearings.nominal import bearing_life_ratios
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.model.case import Case
from flexgear.results.rating import PARTS, RatedPart, Rating
from flexgear.results.stage_figures import nominal_figures
from flexgear.results.summary import sharing_summary_of
from flexgear.solve.bodies import Progress, named, silent
from flexgear.solve.model import Model
from flexgear.solve.run_transients import is_static
from flexgear.solve.static import shared_stages, stages_sharing
from flexgear.solve.transient import simulate

REFERENCE = "reference_"  # prefix of keys with figures of the reference train
Figures = dict[str, dict[str, Any]]


def compare_sharing(
    models: Mapping[str, Model],
    *,
    cycles: int | None = None,
    transient: bool = True,
    progress: Progress = silent,
) -> dict[str, Figures]:
    """Load sharing by "variant: analysis", then group of gear meshes and definition.

    Analyses: quasi-static over the error cycle, transient of a train that does not roll in one
    equilibrium.
    """
    out: dict[str, Figures] = {}
    for label, model in models.items():
        quasi: Figures = {}
        for stage in shared_stages(model):
            data = stages_sharing(model, stage, cycles=cycles, progress=progress)
            quasi |= sharing_summary_of(data)
        out[f"{label}: quasi-static"] = quasi
        if is_static(model):
            continue
        if transient:
            run = simulate(model, progress=named(label, progress))
            out[f"{label}: transient"] = sharing_summary_of(run.data)
    return out


def against(case: Case, reference: Case) -> Figures:
    """Speeds, torques, mean forces and bearing life of two trains, by name of the case.

    Life ratios assume the same bearings where not both trains state dynamic ratings; stages are
    matched by name. Lives in hours need a dynamic rating of the bearings in the case.
    """
    flow, other = power_flow(case), power_flow(reference)
    second = reference.name if reference.name != case.name else f"{reference.name}, reference"
    figures: Figures = {
        case.name: _flow_figures(case, flow),
        second: _flow_figures(reference, other),
    }
    ratios = bearing_life_ratios(case, flow, reference, other)
    figures["bearing_life_ratio"] = {
        f"{bearing}_{kind}": ratio for kind, of in ratios.items() for bearing, ratio in of.items()
    }
    return figures


RATED = ("load_reserve", "safety", "damage_sum", "life")


def lives(first: Rating, second: Rating) -> Figures:
    """Reserve, safety, damage and life of flanks, roots and bearings of two rated trains, the
    weakest part of the first train first, and the life ratio of parts with one name."""
    others = {part.name: part for part in second.ranked}
    figures: Figures = {}
    for part in first.ranked:
        other = others.pop(part.name, None)
        figures[part.name] = _of_part(part, "") | (
            {} if other is None else _of_part(other, REFERENCE)
        )
        if other is not None and other.life and math.isfinite(other.life):
            figures[part.name]["life_ratio"] = part.life / other.life
    return figures | {name: _of_part(part, REFERENCE) for name, part in others.items()}


def _of_part(part: RatedPart, prefix: str) -> dict[str, Any]:
    """Figures of a part by key: prefix, name of the quantity, unit."""
    values = {name: (PARTS[name][0].units, PARTS[name][1](part)) for name in RATED}
    return {
        f"{prefix}{name}" + ("" if unit == "1" else f"_{unit}"): value
        for name, (unit, value) in values.items()
    }


def _flow_figures(case: Case, flow: PowerFlow) -> dict[str, Any]:
    rows: dict[str, Any] = {"input_power_w": flow.input_power}
    for stage in flow.stages:
        figures = nominal_figures(case.view(stage.name), stage)
        rows |= {f"{stage.name}_{key}": value for key, value in figures.items()}
    return rows
