"""Neglected effects beside the figures that they are not small against.

``gears.neglected_effects`` sizes what the models of gear meshes leave out. Where that is more than
a tenth of a headline figure of the same stage, a sentence names both. Load sharing has no length:
what errors do to it goes with the stiffness of the planets' paths, so there the lengths are
compared by which the teeth of a planet give way.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flexgear.gears.gear_mesh_kind import GearMeshKind
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.neglected_effects import RIM_KEYS, neglected_effects
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.names import BodyName, FlankName
from flexgear.results.report.sharing import Sharing, own_variant, sharing_title, sharings
from flexgear.results.report.wording import (
    factor,
    number,
    titled_by_stage,
    window_words,
    with_unit,
    words,
)

SMALL = 0.1  # of a figure: neglected effects up to this share are not mentioned
UNEVEN = 1e-3  # K above one that errors make
ROUNDING = 1e-6  # of the largest length
LEAST_ORDER = 2  # of a ring's shape: 0 is its size, 1 its place
EFFECTS = {"rim": "ovalising planet rims", "pin": "pins bending inside planets"}


@dataclass(frozen=True)
class Length:
    """A length with its name and what it is the largest of; stage: that it belongs to; value: m."""

    subject: str
    stage: str
    value: float
    sentence: str


def lengths(summary: Mapping[str, Any]) -> Iterator[Length]:
    """Of a run: deflections and transmission errors, but for those that are zero or rounding."""
    every = [*_distance(summary), *_rings(summary), *transmission_errors(summary)]
    largest = max((length.value for length in every), default=0.0)
    yield from (length for length in every if length.value > ROUNDING * largest)


def _distance(summary: Mapping[str, Any]) -> Iterator[Length]:
    transient = summary["transient"]
    far = transient["displacement_um_max"]
    if far:
        name = max(far, key=lambda n: far[n])
        sentence = f"{words(name).capitalize()}, {window_words(transient)}."
        stage = BodyName.parse(name).stage
        yield Length("Largest displacement from the axis", stage, 1e-6 * far[name], sentence)


def _rings(summary: Mapping[str, Any]) -> Iterator[Length]:
    for stage, stage_figures in summary.get("steady", {}).items():
        orders = stage_figures["radial_harmonics_um"]
        order = max(range(LEAST_ORDER, len(orders)), key=lambda n: orders[n])
        yield Length(
            titled_by_stage("Ring shape", stage), stage, 1e-6 * orders[order],
            f"Radial amplitude of its largest wave, {order} round the ring, in equilibrium.",
        )  # fmt: skip
        peaks = stage_figures["tooth_displacement_peak_um"]
        axis = max(peaks, key=lambda n: peaks[n])
        yield Length(
            titled_by_stage("Ring tooth", stage), stage, 1e-6 * peaks[axis],
            f"Largest displacement of tooth node 1 along {axis}, {window_words(stage_figures)}.",
        )  # fmt: skip


def transmission_errors(summary: Mapping[str, Any]) -> Iterator[Length]:
    """Of every stage with load along the face, the largest of its gear meshes."""
    largest: dict[str, tuple[float, str]] = {}
    for flank, flank_figures in own_variant(summary.get("face_load", {})).items():
        size = flank_figures.get("transmission_error_peak_to_peak_um")
        stage = FlankName.parse(flank).group.stage
        if size is not None and size > largest.get(stage, (0.0, ""))[0]:
            largest[stage] = size, flank
    for stage, (size, flank) in largest.items():
        sentence = f"Peak to peak over the equilibria, largest at {words(flank)}."
        subject = titled_by_stage("Transmission error", stage)
        yield Length(subject, stage, 1e-6 * size, sentence)


def neglected(case: Case, flow: PowerFlow, summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """For each headline figure of a run that is not large against what is left out: "figure" (its
    name), "value_um" or "load_sharing", "effects_um" and "sentence"."""
    effects = list(beside_lengths(case, flow, lengths(summary)))
    for sharing in sharings(summary["load_sharing"]):
        effects += _beside_sharing(case, flow, sharing)
    return effects


def beside_lengths(
    case: Case,
    flow: PowerFlow,
    figures: Iterable[Length],
    torque_share: float = 1.0,
    rigid: Collection[BodyName] = (),
) -> Iterator[dict[str, Any]]:
    """The same of lengths; torque_share: of the rated torque, at which they are; rigid: bodies that
    do not bend in the model, whatever the case says."""
    for figure in figures:
        rated = effects_of(case, flow, figure.stage, rigid)
        sizes = {name: abs(torque_share) * size for name, (size, _) in rated.items()}
        effects = {n: size for n, size in sizes.items() if size > SMALL * figure.value}
        if effects:
            left = " and ".join(f"{EFFECTS[n]} (up to {_about(x)})" for n, x in effects.items())
            yield {
                "figure": figure.subject,
                "stage": figure.stage,
                "value_um": 1e6 * figure.value,
                "effects_um": {name: 1e6 * size for name, size in effects.items()},
                "sentence": f"{figure.subject}, {with_unit(figure.value, 'm')}: "
                f"the model neglects {left}.",
            }


def _beside_sharing(case: Case, flow: PowerFlow, sharing: Sharing) -> list[dict[str, Any]]:
    """K of a stage, whose errors meet softer paths with what is left out."""
    k = max(x for x in (sharing.in_equilibria, sharing.in_time) if x is not None)
    effects = effects_of(case, flow, sharing.stage)
    soft = sum(way for _, way in effects.values())
    teeth = _teeth(case, flow, sharing.stage)
    if k - 1.0 < UNEVEN or soft <= SMALL * teeth:
        return []
    title = sharing_title(sharing)
    left = " and ".join(EFFECTS[name] for name in effects)
    return [
        {
            "figure": title,
            "stage": sharing.stage,
            "load_sharing": k,
            "effects_um": {name: 1e6 * size for name, (size, _) in effects.items()},
            "sentence": f"{title}, K = {factor(k)}: the model neglects {left}. The teeth of "
            f"a planet deflect by {_about(teeth)}; these effects add up to {_about(soft)}, so that "
            "planets share the load more evenly than computed.",
        }
    ]


def effects_of(
    case: Case, flow: PowerFlow, stage: str, rigid: Collection[BodyName] = ()
) -> dict[str, tuple[float, float]]:
    """By name the largest length of an effect at rated torque, and by how much with it a planet
    gives way along both lines of action together, m; empty where the stage has none."""
    if all(s.name != stage for s in case.stages):
        return {}
    view = case.view(stage)
    view = view.with_rigid([name.part for name in view.fe_bodies if name in rigid])
    sizes = neglected_effects(view, flow.stage(stage).gear_mesh_forces)
    rims = [sizes[key] for key in RIM_KEYS.values() if key in sizes]
    effects = {"rim": (max(rims), sum(rims))} if rims else {}
    if "pin_bends_in_planet_um" in sizes:
        meshes = stage_geometry(view).gear_meshes.values()
        pin = sizes["pin_bends_in_planet_um"]
        effects["pin"] = pin, pin * sum(math.cos(m.working_angle) for m in meshes)
    return {name: (1e-6 * size, 1e-6 * more) for name, (size, more) in effects.items()}


def _about(size: float) -> str:
    """A length of an estimate: three digits."""
    return f"{number(1e6 * size, 3)} µm"


def _teeth(case: Case, flow: PowerFlow, stage: str) -> float:
    """By how much the teeth of a planet give way at rated torque along both lines of action, m."""
    forces = flow.stage(stage).gear_mesh_forces
    paths = stage_paths(case.view(stage), forces)
    side = "left" if case.stage(stage).double_helical else ""
    return sum(
        abs(forces[kind.gear]) / paths[kind, side].mean_stiffness
        for kind in (GearMeshKind.SUN, GearMeshKind.RING)
    )
