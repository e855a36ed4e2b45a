"""Paths of contact of any stage, by kind of gear mesh and side.

Planetary stages have the paths of ``contact``; halves of a double-helical stage have those of a
helical stage each, the left one (−z) with ``planet_hand`` and the right one with the other hand, in
phase at their mid-planes. Both flanks are given always. Which carries, follows from the torque: the
drive flank where the carrier is driven for θ̇ > 0 (or drives for θ̇ < 0), the coast flank otherwise.

Parallel stage: the pinion is the sun and the gear the planet of one gear mesh "sun", θ is the
rotation of the gear, and its axes are x from the pinion's axis to the gear's. The drive flank
carries where the gear drives the pinion for θ̇ > 0, as the planet drives the sun of a planetary
stage, but the gear turns the other way: its force is n = (sin α, cos α), which turns it backwards,
T_p = r_b (−cos α, sin α), and the pair goes from the gear's root to its tip, ds/dθ = +r_b,gear. All
of that is the coast flank of a sun gear mesh, under the name of what it does. At θ = 0 pinion tooth
0 and gear tooth 0 touch at the pitch point.

Modified flanks of a stage: which flank of a gear meets which, and the gaps of its pairs.

A gear with one gear mesh has a drive flank, which carries the rated torque, and a coast flank. A
planet's flanks have the names of the mates that they meet under the rated torque, "sun" and "ring";
under a torque of the other sense each meets the other mate. A flank is ground once: its active
profile is the path of contact with the mate of its name, whichever it meets.

In a double-helical stage the left half (−z) is the mirror image of the right one: z of a
modification counts from the middle of a half towards its outer end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.gears.contact import (
    ASSEMBLY_TOLERANCE,
    GearMeshKind,
    GearMeshPath,
    Start,
    assembly_mismatch,
    gear_mesh_path,
    planetary_starts,
)
from flexgear.gears.geometry import (
    PER_PAIR_MODELS,
    StageGeometry,
    stage_geometry,
)
from flexgear.gears.modifications import Flank, Gap, gaps_of
from flexgear.gears.profile_contact import FlankPair, ProfileContact, profile_contact
from flexgear.gears.slices import Line, cut
from flexgear.gears.stiffness import (
    SAMPLES,
    Law,
    harmonic_wave,
    line_load,
    mean_stiffness,
    pair_law,
    stiffness_wave,
)
from flexgear.model.section import Refusal

if TYPE_CHECKING:
    from flexgear.model.stage_view import StageView


_OTHER = {"sun": "ring", "ring": "sun"}


@dataclass(frozen=True)
class GearFlank:
    """One flank of a gear with its modifications.

    part: the gear as the stage calls it; name: of the flank; gaps: functions of the missing
    material, one for each modification, none for an involute.
    """

    part: str
    name: str
    flank: Flank
    gaps: tuple[Gap, ...]

    def surface(self, points: int) -> tuple[Array, Array, Array]:
        """ρ from the root end to the tip, z from −z to +z (points,), and the gap there (points,
        points), m."""
        rho = np.linspace(self.flank.root, self.flank.tip, points)
        z = self.flank.half_face * np.linspace(-1.0, 1.0, points)
        return rho, z, self.gap(rho[:, None], z)

    def gap(self, rho: Array, z: Array) -> Array:
        """Material missing at ρ and z (any shapes that broadcast), m, in the transverse section."""
        total = np.zeros(np.broadcast_shapes(np.shape(rho), np.shape(z)))
        for missing in self.gaps:
            total += missing(rho, z)
        return total


def flank_name(part: str, path: GearMeshPath) -> str:
    """Name of the flank of ``part`` that a gear mesh uses."""
    if part == "planet":
        return path.kind.gear if path.carries else _OTHER[path.kind.gear]
    return "drive" if path.carries else "coast"


def tooth_sides(kind: str, forward: bool) -> dict[tuple[str, str], int]:
    """Side of its tooth that each (part, flank) is on: +1 towards +θ about +z, −1 the other.

    A gear mesh loads the side that its torque on the gear turns away from. kind: of the stage;
    forward: whether the carrier drives its stage towards +z under the rated torque (the gear its
    pinion), or is driven towards −z: forces of gear meshes ≥ 0 (``stage_flow``).
    """
    sense = 1 if forward else -1
    if kind == "parallel":  # pinion and gear turn each other's way back
        parts, side = ("pinion", "gear"), sense
    else:
        parts, side = ("sun", "ring"), -sense
    out = {(part, "drive"): side for part in parts} | {(part, "coast"): -side for part in parts}
    return (
        out if kind == "parallel" else out | {("planet", "sun"): -sense, ("planet", "ring"): sense}
    )


def gear_flanks(view: StageView, paths: Mapping[GearMeshKind, GearMeshPath]) -> list[GearFlank]:
    """Both flanks of every gear; paths: by kind, of a stage or of a half. InputError for
    modifications that leave a flank."""
    out = []
    for kind in [kind for kind in paths if not kind.coast]:
        parts = (view.part("planet"), view.part(kind.gear))
        for part, flank in zip(parts, _active(paths[kind], kind.gear), strict=True):
            names = (kind.gear,) if part == "planet" else ("drive", "coast")
            out += [GearFlank(part, name, flank, _gaps(view, part, name, flank)) for name in names]
    return out


def modified_flanks(
    view: StageView, paths: Mapping[tuple[GearMeshKind, str], GearMeshPath]
) -> list[GearFlank]:
    """Flanks that are no involutes, of the right half if there are two; paths: by kind and side
    (``stage_paths``)."""
    side = "right" if view.stage.double_helical else ""
    half = {kind: path for (kind, of), path in paths.items() if of == side}
    return [flank for flank in gear_flanks(view, half) if flank.gaps]


def flank_pairs(
    view: StageView, paths: Mapping[GearMeshKind, GearMeshPath], mirrored: bool
) -> dict[GearMeshKind, FlankPair | None]:
    """Flanks that meet in every kind of gear mesh, None where both are involutes.

    mirrored: whether the half is the mirror image of what the case
    says. Raises InputError where the model of the gear mesh follows no pair along its path.
    """
    flanks = {(flank.part, flank.name): flank for flank in gear_flanks(view, paths)}
    out: dict[GearMeshKind, FlankPair | None] = {}
    for kind, path in paths.items():
        planet, gear = (
            flanks[part, flank_name(part, path)]
            for part in (view.part("planet"), view.part(kind.gear))
        )
        out[kind] = _of_pair(path, planet, gear, mirrored) if planet.gaps or gear.gaps else None
    if view.gear_mesh.model not in PER_PAIR_MODELS and any(out.values()):
        raise view.refuse(
            "gear_mesh.model",
            f"{view.gear_mesh.model!r} follows no pair along its path, so modified flanks have no "
            "place",
            'use "per_pair", "face_load" or "lumped", or take the modifications out',
        )
    return out


def _of_pair(path: GearMeshPath, planet: GearFlank, gear: GearFlank, mirrored: bool) -> FlankPair:
    sign = -1.0 if mirrored else 1.0
    return FlankPair(
        lambda rho, z: planet.gap(rho, sign * z),
        lambda rho, z: gear.gap(rho, sign * z),
        path.off_path,
    )


def _active(path: GearMeshPath, role: str) -> tuple[Flank, Flank]:
    """Flanks of the planet and of its mate over the path of contact."""
    reach = path.center_distance * math.sin(path.alpha)
    ends = [s + reach if role == "ring" else reach - s for s in (path.s_lo, path.s_hi)]
    return (
        Flank(path.s_hi, path.s_lo, path.half_face, path.base_radius_planet),
        Flank(ends[0], ends[1], path.half_face, path.base_radius_gear),
    )


def _gaps(view: StageView, part: str, name: str, flank: Flank) -> tuple[Gap, ...]:
    modifications = getattr(view.stage, part).modifications
    try:
        return tuple(gaps_of(modifications.of(name), flank))
    except Refusal as r:
        key = f"{part}.modifications.{modifications.key(name, r.key)}"
        raise view.refuse(key, r.problem, r.remedy) from None


PathKey = tuple[GearMeshKind, str]
Ground = Callable[[tuple[float, float]], ProfileContact]  # by the span of the path, m
DEEPEST = 3.0
PLACES = 65  # slices over which a gap is averaged
OTHER_HAND = {"right": "left", "left": "right"}


def stage_paths(view: StageView, forces: Mapping[str, float]) -> dict[PathKey, GearMeshPath]:
    """Paths by (kind, side); side "", or "left" and "right" halves.

    forces: normal force of one gear mesh of "sun" and "ring" at rated load, N, for stiffness that
    depends on it (``stiffness``) and for the flanks that carry: of "sun" and "ring" where it is not
    negative. Raises InputError for gears that cannot mesh and planets that do not
    assemble.
    """
    g, stage = stage_geometry(view), view.stage
    require_assembly(view, g)
    if not stage.double_helical:
        paths = _half_paths(view, g, forces)
        return {(kind, ""): path for kind, path in paths.items()}
    offset = stage.half_offset
    return {
        (kind, side): replace(path, side=side, z_offset=z)
        for side, z in (("left", -offset), ("right", offset))
        for kind, path in _half_paths(view, g, forces, side).items()
    }


def assembly_misfit(view: StageView, g: StageGeometry) -> float:
    """Largest distance of a planet's sun tooth from its position by planet 1, in sun pitches."""
    if view.stage.kind == "parallel":
        return 0.0
    return float(np.abs(assembly_mismatch(g, np.asarray(view.stage.planet_angles))).max())


def require_assembly(view: StageView, g: StageGeometry) -> None:
    """InputError where planets do not find their teeth, unless the case allows it."""
    if view.stage.allow_unassemblable or assembly_misfit(view, g) <= ASSEMBLY_TOLERANCE:
        return
    raise view.refuse(
        "planets",
        f"the planets do not assemble: (z_s + z_r)/N = {g.assembly:.4g}",
        "choose tooth numbers with (z_s + z_r)/N whole, or planet_positions that assemble, "
        "or set allow_unassemblable = true",
    )


def _half_paths(
    view: StageView, g: StageGeometry, forces: Mapping[str, float], side: str = ""
) -> dict[GearMeshKind, GearMeshPath]:
    """Paths of a stage with one helix, or of one half."""
    hand: str = view.stage.planet_hand
    hand = OTHER_HAND[hand] if side == "right" else hand
    laws = {role: pair_law(view, g, role, forces[role]) for role in g.gear_meshes}
    if view.stage.kind == "parallel":
        starts = _parallel_starts(g)
    else:
        starts = planetary_starts(g, np.asarray(view.stage.planet_angles, dtype=float))
    half_face, forward = view.stage.face_width / 2, forces["sun"] >= 0
    paths = {
        kind: replace(
            gear_mesh_path(
                g, kind, start, planet_hand=hand, half_face=half_face, law=laws[kind.gear]
            ),
            carries=kind.coast != forward,
        )
        for kind, start in starts.items()
    }
    flanks = flank_pairs(view, paths, mirrored=side == "left")
    if view.gear_mesh.model in PER_PAIR_MODELS:
        followed = {}
        for kind, path in paths.items():
            law, force, pair = laws[kind.gear], forces[kind.gear], flanks[kind]
            ground = None if pair is None else partial(_profile, view, g, path, force, pair)
            if view.gear_mesh.model == "face_load":
                followed[kind] = _in_slices(view, path, law, force, ground)
            else:
                followed[kind] = path if ground is None else _as_springs(path, law, ground)
        return followed
    carrying = {path.kind.gear: path for path in paths.values() if path.carries}
    return {
        kind: replace(path, wave=_wave(view, g, path, carrying[kind.gear], forces[kind.gear]))
        for kind, path in paths.items()
    }


def _in_slices(
    view: StageView, path: GearMeshPath, law: Law, force: float, ground: Ground | None
) -> GearMeshPath:
    """A path with slices of its pairs; tips touch off the path where the gap is below ``DEEPEST``
    times the approach of one pair that carries all of ``force``, N; ground: of modified flanks."""
    options, span = view.gear_mesh, (path.s_lo, path.s_hi)
    if not options.path_only:
        stiffness = float(law(np.array([0.5]))[0]) * 2.0 * path.half_face
        span = path.off_path.span(DEEPEST * abs(force) / stiffness)

    def gap(s: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
        return path.off_path.gap(np.clip(s, *span))  # rounding aside, lines end there

    line = Line((path.s_lo, path.s_hi), span, path.slope, path.half_face)
    slices = cut(law, line, options.slices, None if options.path_only else gap)
    if ground is not None:
        slices = slices.ground(ground(span), law, line)
    return replace(path, slices=slices)


def _as_springs(path: GearMeshPath, law: Law, ground: Ground) -> GearMeshPath:
    """A path whose pairs are one spring each, with the mean gap of modified flanks."""
    ends = (path.s_lo, path.s_hi)
    line = Line(ends, ends, path.slope, path.half_face)
    slices = cut(law, line, PLACES)
    modified = slices.ground(ground(ends), law, line)
    before, after = slices.stiffness.sum(axis=1), modified.stiffness.sum(axis=1)
    share = np.divide(after, before, out=np.ones_like(after), where=before > 0.0)
    return replace(
        path,
        k_grid=path.k_grid * np.interp(path.s_grid, slices.s, share),
        zc_grid=np.interp(path.s_grid, slices.s, modified.centre),
        gap_grid=np.interp(path.s_grid, slices.s, modified.mean_gap),
    )


def _profile(
    view: StageView,
    g: StageGeometry,
    path: GearMeshPath,
    force: float,
    flanks: FlankPair,
    span: tuple[float, float],
) -> ProfileContact:
    """Contact across the profile of modified flanks, at the mean line load."""
    material = view.material
    pressed = 2.0 * (1.0 - material.poisson_ratio**2) / (math.pi * material.young_modulus)
    load = line_load(view, g, path.kind.gear, force)
    return profile_contact(flanks, span, path.half_face, pressed, load)


def _wave(
    view: StageView, g: StageGeometry, path: GearMeshPath, carrying: GearMeshPath, force: float
) -> NDArray[np.float64]:
    """Stiffness (T,) over a base pitch of a path; carrying: that of the flank that carries, on
    which the phases of given terms are counted. InputError where it falls to zero."""
    role = path.kind.gear
    options, gear_mesh = view.gear_mesh, g.gear_meshes[role]
    mean, ratio = mean_stiffness(view, g, role, force), gear_mesh.transverse_contact_ratio
    if shares := options.of(role, "harmonic_shares"):
        key = f"{role}_harmonic_shares"
        s = path.s_lo + np.arange(SAMPLES) / SAMPLES * path.base_pitch
        s = carrying.s0[0] + carrying.rate / path.rate * (s - path.s0[0])
        phases = options.of(role, "harmonic_phases") or (0.0,) * len(shares)
        turns = s / path.base_pitch
        wave = harmonic_wave(mean, np.array(shares), np.array(phases), turns)
    else:
        key, step = f"{role}_stiffness_step", options.of(role, "stiffness_step")
        stiffness = options.of(role, "stiffness")
        depth = 1.0 if step is None or stiffness is None else step * ratio / stiffness
        wave = stiffness_wave(
            options.model, mean, ratio, gear_mesh.overlap_ratio, options.harmonics, depth=depth
        )
        if step is None:
            return wave
    if wave.min() <= 0.0:
        low = f"{100 * wave.min() / mean:.3g} %"
        raise view.refuse(
            f"gear_mesh.{key}", f"lets the stiffness fall to {low} of its mean", "lower it"
        )
    return wave


def _parallel_starts(g: StageGeometry) -> dict[GearMeshKind, Start]:
    """Starting positions of pinion and gear on the drive and the coast flank at θ = 0."""
    zero = np.zeros(1, np.int64)
    pitch_point = g.planet.base_radius * math.tan(g.sun_gear_mesh.working_angle)
    coast, gear_tooth, pinion_tooth = _coast_of_parallel(g, pitch_point)
    return {
        GearMeshKind.SUN: (np.array([pitch_point]), zero, zero),
        GearMeshKind.SUN_COAST: (np.array([coast]), zero + pinion_tooth, zero + gear_tooth),
    }


def _coast_of_parallel(g: StageGeometry, drive: float) -> tuple[float, int, int]:
    """Coast flanks when tooth 0 of both gears touches at s = drive: s of the pair nearest to
    ``drive``, and its teeth of gear and pinion.

    From ``contact``: s = r_b,gear (π + α + Δ − γ) with the half angle Δ at the base circle and the
    place γ of the gear's tooth; on the drive flank, mirrored, −γ. So s_drive + s_coast of one tooth
    of the gear is 2 r_b,gear (π + α + Δ). Likewise for the pinion with σ = α + Δ − ρ/r_b,pinion.
    """
    pinion, gear, gear_mesh = g.sun, g.planet, g.sun_gear_mesh
    angle, pitch = gear_mesh.working_angle, gear_mesh.base_pitch
    same_tooth = 2 * gear.base_radius * (math.pi + angle + gear.base_half_angle) - drive
    steps = round((same_tooth - drive) / pitch)
    coast = same_tooth - steps * pitch
    reach = (pinion.base_radius + gear.base_radius) * math.tan(angle)
    turned = 2 * (angle + pinion.base_half_angle) - (2 * reach - drive - coast) / pinion.base_radius
    return coast, steps, round(turned * pinion.teeth / (2 * math.pi))
