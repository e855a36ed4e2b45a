"""Warnings about results: large motions, neglected effects.

**Large motions.** Paths of contact, pressure angles and pairs in contact are those of gears in
their nominal positions. A displacement u of a member changes a centre distance by up to u, and the
play between flanks by up to 2 u sin α cos β_b. So u is compared with a tenth of the module, with
the clearance between tips and roots and, for linear contact, which has no coast flanks, with
j/(2 sin α cos β_b), j the backlash of the case or the least recommended one. Teeth of an FE ring
count as a member. Planets are compared with the module only, without the mean rotation of a stage's
planets about the axis, which does not change distances.

**Neglected effects.** ``gears.report.neglected_effects`` estimates lengths that the models of gear
meshes neglect. A sentence states those that exceed a tenth of a headline figure of the same stage.
Load sharing depends on the compliance of the planets' load paths. Rims that deflect by d more than
teeth, which deflect by t, reduce the excess K − 1 in equilibria by at most a share d/(t + d). Pins
inside planets do not count: their mean deflection is that of the carrier in the model.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from flexgear.gears.contact import GearMeshKind
from flexgear.gears.geometry import bottom_clearance, least_backlash, stage_geometry
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.report import RIM_KEYS, neglected_effects
from flexgear.model.case import Case
from flexgear.model.names import BodyName, FlankName, GroupName
from flexgear.model.stage_view import StageView
from flexgear.results.report.sharing import Sharing, first_variant, sharings
from flexgear.results.report.wording import (
    factor,
    module_text,
    number,
    of_stage,
    titled_by_stage,
    with_unit,
    words,
)
from flexgear.results.run_orders import MOTION_ROUNDING
from flexgear.results.time_figures import axis_distance

ForceRanges = Mapping[str, Mapping[str, float]]
PULLED = (
    'teeth pull, as contact is linear; contact_law = "one-sided" of gear_mesh lets flanks part.'
)
GROWN = 10.0  # largest over mean gear-mesh force, above which a line names parametric instability
SMALL = 0.1  # displacement over the module up to which paths of contact are right to a twentieth
CONSEQUENCE = (
    "Paths of contact, pressure angles and which teeth touch are those of gears in their places; "
    "stiffen their supports, or take figures as a rough guide."
)


def motion_histories(data: xr.Dataset) -> xr.Dataset:
    """Dataset with ``axis_distance`` of bodies, of planets without their mean rotation about the
    axis, and for FE rings ``tooth_distance``, radial and tangential displacement of teeth, m."""
    motion = _without_common_turn(data["body_displacement"])
    histories = xr.Dataset({"axis_distance": axis_distance(xr.Dataset({motion.name: motion}))})
    if "tooth_displacement" in data:
        x, y = (data["tooth_displacement"].sel(axis=k, drop=True) for k in "xy")
        histories["tooth_distance"] = np.hypot(x, y)
    return histories


def _without_common_turn(motion: xr.DataArray) -> xr.DataArray:
    """Motion (…, body, dof) of bodies minus the mean tangential motion of each stage's planets."""
    planets: dict[str, list[int]] = {}
    for i, body in enumerate(map(BodyName.parse, map(str, motion["body"].to_numpy()))):
        if body.part == "planet":
            planets.setdefault(body.stage, []).append(i)
    uy = motion["dof"].to_numpy().tolist().index("uy")
    values = motion.to_numpy().copy()
    for at in planets.values():
        values[..., at, uy] -= values[..., at, uy].mean(axis=-1, keepdims=True)
    return motion.copy(deep=False, data=values)  # does not read coordinates of files


def largest_motions(histories: xr.Dataset) -> dict[str, float]:
    """Largest of ``motion_histories`` by body, m; those of ring teeth as "stage.ring teeth"."""
    distances = histories["axis_distance"]
    top = distances.max([d for d in distances.dims if d != "body"])
    motions = dict(zip(map(str, top["body"].to_numpy()), top.to_numpy().tolist(), strict=True))
    if "tooth_distance" in histories:
        stages = histories["tooth_stage"].to_numpy()
        for stage in dict.fromkeys(stages.tolist()):
            teeth = histories["tooth_distance"].isel(tooth=stages == stage)
            motions[f"{stage}.ring teeth"] = float(teeth.max())
    return motions


@dataclass(frozen=True)
class MotionShare:
    """Displacement of a body, m, with the limit for small displacements, m, and the quantity to
    which the limit refers (``beside``), in words."""

    body: str
    size: float
    beside: str
    limit: float


def motion_shares(case: Case, motions: Mapping[str, float]) -> dict[str, list[MotionShare]]:
    """Displacements of the bodies of each stage with all their limits; for several bodies of one
    kind, such as planets, the largest. motions: displacements by body, m."""
    by_stage: dict[str, list[MotionShare]] = {}
    for stage in case.stages:
        limits = small_against(case.view(stage.name))
        bodies: dict[str, tuple[float, str]] = {}
        for name, size in motions.items():
            body = BodyName.parse(name)
            if body.stage == stage.name:
                bodies[body.part] = max((size, name), bodies.get(body.part, (0.0, "")))
        shares = [
            MotionShare(name, size, beside, limit)
            for kind, (size, name) in sorted(bodies.items(), key=lambda item: -item[1][0])
            for beside, limit in limits.items()
            if name and (kind != "planet" or beside == next(iter(limits)))
        ]
        if shares:
            by_stage[stage.name] = shares
    return by_stage


def large_motions(case: Case, motions: Mapping[str, float]) -> list[str]:
    """A line for each stage in which displacements exceed their limits; motions: by body, m."""
    lines = []
    for shares in motion_shares(case, motions).values():
        large = [s for s in shares if s.size > s.limit]
        if large:
            references = " and ".join(dict.fromkeys(s.beside for s in large))
            bodies = ", ".join(
                dict.fromkeys(f"{words(s.body)} by {with_unit(s.size, 'm')}" for s in large)
            )
            lines.append(f"Motion that is not small beside {references}: {bodies}. {CONSEQUENCE}")
    return lines


def pulling_teeth(case: Case, groups: Iterable[str]) -> list[str]:
    """A line for each stage with linear contact that has one of these groups of gear meshes, in
    which forces of both senses act."""
    stages = dict.fromkeys(GroupName.parse(group).stage for group in groups)
    return [
        f"Gear-mesh forces{of_stage(stage)} act in both senses: {PULLED}"
        for stage in stages
        if case.view(stage).gear_mesh.contact_law == "linear"
    ]


def growing_forces(case: Case, forces: ForceRanges) -> list[str]:
    """A line for each stage with linear contact in which a gear-mesh force exceeds ``GROWN`` times
    its mean, as vibration that grows by itself does. forces: of ``force_ranges``."""
    lines = dict[str, str]()
    for group, f in forces.items():
        stage, largest = GroupName.parse(group).stage, max(-f["min_n"], f["max_n"])
        ratio = largest / abs(f["mean_n"]) if f["mean_n"] else 0.0
        if ratio > GROWN and case.view(stage).gear_mesh.contact_law == "linear":
            lines[stage] = (
                f"Gear-mesh forces{of_stage(stage)} reach {number(ratio, 2)} times their mean: "
                "flexgear stability shows at which speeds vibration grows by itself."
            )
    return list(lines.values())


def reversed_pairs(case: Case, most: Mapping[str, float]) -> list[str]:
    """A line for each parallel stage with linear contact under a torque against its rated sense.
    most: largest force of each group of gear meshes, N, negative where all forces are reversed."""
    return [
        f"Torque{of_stage(stage.name)} is against the rated sense: {PULLED} Loads of bearings are "
        "those of gears that teeth pull together."
        for stage in case.stages
        if stage.kind == "parallel"
        and stage.gear_mesh.contact_law == "linear"
        and any(GroupName.parse(g).stage == stage.name and f < 0.0 for g, f in most.items())
    ]


def without_rounding(case: Case, forces: ForceRanges) -> ForceRanges:
    """Gear meshes whose largest force is above rounding, E b times ``MOTION_ROUNDING``; E b is
    about ten times the stiffness of teeth of face width b. forces: of ``force_ranges``."""
    width = max(stage.face_width for stage in case.stages)
    least = MOTION_ROUNDING * case.material.young_modulus * width
    return {g: f for g, f in forces.items() if max(-f["min_n"], f["max_n"]) > least}


def two_senses(forces: ForceRanges) -> list[str]:
    """Groups of gear meshes whose teeth both push and pull during a run. forces: least and largest
    force of each group, of ``force_ranges``; below ``ROUNDING`` of the train's largest force one
    counts as none."""
    largest = max((max(-f["min_n"], f["max_n"]) for f in forces.values()), default=0.0)
    return [g for g, f in forces.items() if min(-f["min_n"], f["max_n"]) > ROUNDING * largest]


def beyond_all_planets(case: Case, sharing: Mapping[str, float]) -> Iterator[str]:
    """Groups of gear meshes with a load sharing factor K above the number N of planets: as all N
    forces add up to N times their mean, one of the others is negative."""
    for group, factor_of_group in sharing.items():
        if factor_of_group > case.view(GroupName.parse(group).stage).stage.planets:
            yield group


def small_against(view: StageView) -> dict[str, float]:
    """Limits for small displacements, m, by the quantity to which they refer in words, the module
    first; the least of all gear meshes."""
    g, module = stage_geometry(view), view.stage.normal_module
    limits = {f"the module of {module_text(module)}": SMALL * module}
    if not g.overridden:
        room = min(
            min(bottom_clearance(g.gears[role], g.planet, g.center_distance))
            for role in g.gear_meshes
        )
        limits[f"the room of {with_unit(room, 'm')} between tips and roots"] = room
    if view.gear_mesh.contact_law == "linear":
        plays = []
        for gear_mesh in g.gear_meshes.values():
            play = gear_mesh.backlash or least_backlash(g.center_distance, module)
            rate = 2.0 * math.sin(gear_mesh.working_angle) * math.cos(g.base_helix_angle)
            plays.append((play / rate, play))
        limit, play = min(plays)
        limits[f"the backlash of {with_unit(play, 'm')}, which linear contact leaves out"] = limit
    return limits


VISIBLE = 0.01  # change of K, the last digit of mesh load factors in standards
ROUNDING = 1e-6  # length over the largest length
LEAST_ORDER = 2  # of a ring's deformation; 0 is expansion, 1 displacement
EFFECTS = {"rim": "ovalising planet rims", "pin": "pins bending inside planets"}


@dataclass(frozen=True)
class Length:
    """A length among the figures of a run. subject: its name; value: m; sentence: description."""

    subject: str
    stage: str
    value: float
    sentence: str = ""


def lengths(summary: Mapping[str, Any]) -> Iterator[Length]:
    """Deflections and transmission errors of a run, without those that are rounding."""
    every = [*_axis_distance(summary), *_rings(summary), *transmission_errors(summary)]
    largest = max((length.value for length in every), default=0.0)
    yield from (length for length in every if length.value > ROUNDING * largest)


def _axis_distance(summary: Mapping[str, Any]) -> Iterator[Length]:
    """Largest displacement of a body from the axis in the transient."""
    distances = summary["transient"]["displacement_um_max"]
    if distances:
        name = max(distances, key=lambda n: distances[n])
        stage = BodyName.parse(name).stage
        yield Length("Largest displacement from the axis", stage, 1e-6 * distances[name])


def _rings(summary: Mapping[str, Any]) -> Iterator[Length]:
    """Largest radial harmonic of each FE ring, and largest displacement of its tooth node 1."""
    for stage, ring in summary.get("steady", {}).items():
        wave = max(ring["radial_harmonics_um"][LEAST_ORDER:])
        tooth = max(ring["tooth_displacement_peak_um"].values())
        yield Length(titled_by_stage("Ring shape", stage), stage, 1e-6 * wave)
        yield Length(titled_by_stage("Ring tooth", stage), stage, 1e-6 * tooth)


def transmission_errors(summary: Mapping[str, Any]) -> Iterator[Length]:
    """Largest peak-to-peak transmission error in every stage with load along the face."""
    largest: dict[str, tuple[float, str]] = {}
    for flank, flank_figures in first_variant(summary.get("face_load", {})).items():
        size = flank_figures.get("transmission_error_peak_to_peak_um")
        stage = FlankName.parse(flank).group.stage
        if size is not None and size > largest.get(stage, (0.0, ""))[0]:
            largest[stage] = size, flank
    for stage, (size, flank) in largest.items():
        sentence = f"Peak to peak over the equilibria, largest at {words(flank)}."
        subject = titled_by_stage("Transmission error", stage)
        yield Length(subject, stage, 1e-6 * size, sentence)


def neglected(case: Case, flow: PowerFlow, summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Neglected effects that are not small against headline figures of a run, one row for each
    figure: "figure" (its name), "stage", "value_um" or "load_sharing", "effects_um", "sentence"."""
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
    """Rows of ``neglected`` for lengths. torque_share: torque over rated torque in ``figures``;
    rigid: rigid bodies of the model, also where the case states them as flexible."""
    for figure in figures:
        rated = effects_of(case, flow, figure.stage, rigid)
        sizes = {name: abs(torque_share) * size for name, size in rated.items()}
        effects = {n: size for n, size in sizes.items() if size > SMALL * figure.value}
        if effects:
            named = " and ".join(f"{EFFECTS[n]} (up to {_about(x)})" for n, x in effects.items())
            yield {
                "figure": figure.subject,
                "stage": figure.stage,
                "value_um": 1e6 * figure.value,
                "effects_um": {name: 1e6 * size for name, size in effects.items()},
                "sentence": f"{figure.subject}, {with_unit(figure.value, 'm')}: "
                f"the model neglects {named}.",
            }


def _beside_sharing(case: Case, flow: PowerFlow, sharing: Sharing) -> list[dict[str, Any]]:
    """Row of ``neglected`` for K of a stage in equilibria, empty where planets' rims hardly change
    it; without equilibria for K in time."""
    k = sharing.in_equilibria if sharing.in_equilibria is not None else sharing.in_time
    rims, _ = _estimates(case.view(sharing.stage), flow)
    deflection = sum(rims)
    stage = sharing.stage
    forces = flow.stage(stage).gear_mesh_forces
    paths = stage_paths(case.view(stage), forces)
    side = "left" if case.stage(stage).double_helical else ""
    # deflection of a planet's teeth along both lines of action together
    teeth = sum(
        abs(forces[kind.gear]) / paths[kind, side].mean_stiffness
        for kind in (GearMeshKind.SUN, GearMeshKind.RING)
    )
    if k is None or not deflection:
        return []
    least = 1.0 + (k - 1.0) * teeth / (teeth + deflection)
    if k - least < VISIBLE or deflection <= SMALL * teeth:
        return []
    title = titled_by_stage("Load sharing", sharing.stage)
    sentence = (
        f"{title}, K = {factor(k)}: the model neglects {EFFECTS['rim']}. The teeth of a planet "
        f"deflect by {_about(teeth)}, its rim by up to {_about(deflection)} more, so that planets "
        f"share the load more evenly than computed: K is between {factor(least)} and {factor(k)}."
    )
    row = {"figure": title, "stage": sharing.stage, "load_sharing": k}
    return [{**row, "effects_um": {"rim": 1e6 * max(rims)}, "sentence": sentence}]


def effects_of(
    case: Case, flow: PowerFlow, stage: str, rigid: Collection[BodyName] = ()
) -> dict[str, float]:
    """Neglected effects of a stage at rated torque: largest length, m, by name. rigid: see
    ``beside_lengths``."""
    if all(s.name != stage for s in case.stages):
        return {}
    view = case.view(stage)
    view = view.with_rigid([name.part for name in view.fe_bodies if name in rigid])
    rims, pin = _estimates(view, flow)
    return ({"rim": max(rims)} if rims else {}) | ({"pin": pin} if pin else {})


def _estimates(view: StageView, flow: PowerFlow) -> tuple[list[float], float]:
    """Deflections of a planet's rim along its lines of action, and of its pin, m; no or zero
    deflection where the model has it."""
    sizes = neglected_effects(view, flow.stage(view.name).gear_mesh_forces)
    rims = [1e-6 * sizes[key] for key in RIM_KEYS.values() if key in sizes]
    return rims, 1e-6 * sizes.get("pin_bends_in_planet_um", 0.0)


def _about(size: float) -> str:
    """An estimated length, m, in words: µm with three digits."""
    return f"{number(1e6 * size, 3)} µm"
