"""Neglected effects beside the figures that they are not small against.

``gears.left_out`` sizes what the models of gear meshes leave out. Where that is more than a tenth
of a headline figure of the same stage, a sentence names both. Load sharing has no length: what
errors do to it goes with the stiffness of the planets' paths, so there the lengths are compared by
which the teeth of a planet give way.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from flexgear.gears.gear_mesh_kind import GearMeshKind
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.left_out import left_out
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.results.report.headlines import Headline, headlines
from flexgear.results.report.sharing import Sharing, sharing_title, sharings
from flexgear.results.report.wording import factor, number, said

SMALL = 0.1  # of a figure: effects up to there may be neglected without a word
UNEVEN = 1e-3  # K above one that errors make
_WORDS = {"rim": "planet rims that go oval", "pin": "pins that bend inside planets"}


def neglected(case: Case, flow: PowerFlow, summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """For each headline figure of a run that is not large against what is left out: "figure" (its
    name), "value_um" or "load_sharing", "effects_um" and "sentence"."""
    found = list(beside_lengths(case, flow, headlines(summary)))
    for sharing in sharings(summary["load_sharing"]):
        found += _beside_sharing(case, flow, sharing)
    return found


def beside_lengths(
    case: Case, flow: PowerFlow, figures: Iterable[Headline], torque_share: float = 1.0
) -> Iterator[dict[str, Any]]:
    """The same of lengths; torque_share: of the rated torque, at which they are."""
    for one in figures:
        effects = {
            name: size
            for name, (size, _) in _effects(case, flow, one.stage, torque_share).items()
            if size > SMALL * one.value
        }
        if effects:
            left = " and ".join(f"{_WORDS[n]} (up to {_about(x)})" for n, x in effects.items())
            yield {
                "figure": one.subject,
                "value_um": 1e6 * one.value,
                "effects_um": {name: 1e6 * size for name, size in effects.items()},
                "sentence": f"{one.subject}, {said(one.value, 'm')}: left out are {left}.",
            }


def _beside_sharing(case: Case, flow: PowerFlow, sharing: Sharing) -> list[dict[str, Any]]:
    """K of a stage, whose errors meet softer paths with what is left out."""
    k = max(x for x in (sharing.in_equilibria, sharing.in_time) if x is not None)
    effects = _effects(case, flow, sharing.stage)
    soft = sum(way for _, way in effects.values())
    teeth = _teeth(case, flow, sharing.stage)
    if k - 1.0 < UNEVEN or soft <= SMALL * teeth:
        return []
    title = sharing_title(sharing)
    left = " and ".join(_WORDS[name] for name in effects)
    return [
        {
            "figure": title,
            "load_sharing": k,
            "effects_um": {name: 1e6 * size for name, (size, _) in effects.items()},
            "sentence": f"{title}, K = {factor(k)}: left out are {left}; the teeth of a planet "
            f"give way by {_about(teeth)}, with them by up to {_about(soft)} more, so that the "
            "load would be shared more evenly.",
        }
    ]


def _effects(
    case: Case, flow: PowerFlow, stage: str, share: float = 1.0
) -> dict[str, tuple[float, float]]:
    """By name the largest length of an effect, and by how much with it a planet gives way along
    both lines of action together, m; empty where the stage has none."""
    if all(s.name != stage for s in case.stages):
        return {}
    view = case.view(stage)
    sizes = left_out(view, flow.stage(stage).gear_mesh_forces)
    rims = [v for key, v in sizes.items() if key.startswith("free_planet_rim")]
    found = {"rim": (max(rims), sum(rims))} if rims else {}
    if "pin_bends_in_planet_um" in sizes:
        meshes = stage_geometry(view).gear_meshes.values()
        pin = sizes["pin_bends_in_planet_um"]
        found["pin"] = pin, pin * sum(math.cos(m.working_angle) for m in meshes)
    scale = 1e-6 * abs(share)
    return {name: (scale * size, scale * way) for name, (size, way) in found.items()}


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
