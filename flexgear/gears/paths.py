"""Paths of contact of any stage, by kind of gear mesh and side.

Planetary stages have the paths of ``contact``; each half of a double-helical stage has those of a
helical stage, the left one (−z) with ``planet_hand`` and the right one with the other hand, in
phase at their mid-planes. Both flanks always have a path. The torque decides which carries: the
drive flank if the carrier is driven for θ̇ > 0 (or drives for θ̇ < 0), otherwise the coast flank.

Parallel stage: the pinion has the role of the sun and the gear that of the planet in one gear mesh
"sun", θ is the rotation of the gear, and x points from the pinion's axis to the gear's. The drive
flank carries if the gear drives the pinion for θ̇ > 0, like a planet that drives a sun, but the gear
rotates in the opposite sense: the force on it is n = (sin α, cos α), the base tangent point
T_p = r_b (−cos α, sin α), and pairs move from the gear's root to its tip, ds/dθ = +r_b,gear. The
geometry is that of the coast flank of a sun gear mesh. At θ = 0 tooth 0 of pinion and gear touch at
the pitch point.

Modified flanks: a gear with one gear mesh has a drive flank, which carries the rated torque, and a
coast flank. The flanks of a planet are named after the mates that they meet under rated torque,
"sun" and "ring"; under reversed torque each meets the other mate. The active profile of a flank is
the path of contact with the mate of its name. In a double-helical stage the left half (−z) is the
mirror image of the right one: z of a modification counts from the middle of a half towards its
outer end.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial

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
from flexgear.gears.geometry import PER_PAIR_MODELS, StageGeometry, stage_geometry
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
from flexgear.model.faults import stage_of_fault
from flexgear.model.gear_mesh import equal_spacing
from flexgear.model.section import Refusal
from flexgear.model.stage_view import StageView

_OTHER_MATE = {"sun": "ring", "ring": "sun"}


@dataclass(frozen=True)
class GearFlank:
    """One flank of a gear with its modifications. part: name of the gear in the stage; name: of the
    flank; gaps: one function of the missing material for each modification, none for an
    involute."""

    part: str
    name: str
    flank: Flank
    gaps: tuple[Gap, ...]

    def surface(self, points: int) -> tuple[Array, Array, Array]:
        """ρ from root end to tip (points,), z from −z to +z (points,), and gap (points, points) at
        ρ and z; m."""
        rho = np.linspace(self.flank.root, self.flank.tip, points)
        z = self.flank.half_face * np.linspace(-1.0, 1.0, points)
        return rho, z, self.gap(rho[:, None], z)

    def gap(self, rho: Array, z: Array, mirrored: bool = False) -> Array:
        """Missing material in transverse section, m, at ρ and z, or −z if mirrored, of any shapes
        that broadcast."""
        total = np.zeros(np.broadcast_shapes(np.shape(rho), np.shape(z)))
        for missing in self.gaps:
            total += missing(rho, -z if mirrored else z)
        return total


def flank_name(part: str, path: GearMeshPath) -> str:
    """Name of the flank of ``part`` that touches on a path."""
    if part == "planet":
        return path.kind.gear if path.carries else _OTHER_MATE[path.kind.gear]
    return "drive" if path.carries else "coast"


def tooth_sides(kind: str, forward: bool) -> dict[tuple[str, str], int]:
    """Side of the tooth by (part, flank): +1 towards +θ about +z, −1 towards −θ.

    The drive flank is on the side opposite to the torque of the gear mesh on the gear. kind: of the
    stage; forward: whether forces of gear meshes are ≥ 0 (``stage_flow``): the carrier (gear of a
    parallel stage) drives with speed about +z under the rated torque, or is driven about −z.
    """
    sense = 1 if forward else -1
    parts, side = (("pinion", "gear"), sense) if kind == "parallel" else (("sun", "ring"), -sense)
    out = {(part, "drive"): side for part in parts} | {(part, "coast"): -side for part in parts}
    planets = {("planet", "sun"): -sense, ("planet", "ring"): sense}
    return out if kind == "parallel" else out | planets


def gear_flanks(view: StageView, paths: Mapping[GearMeshKind, GearMeshPath]) -> list[GearFlank]:
    """Both flanks of every gear of a stage, or of a half. paths: by kind. Raises InputError for
    modifications that do not fit a flank."""
    out = []
    for kind in [kind for kind in paths if not kind.coast]:
        parts = (view.part("planet"), view.part(kind.gear))
        for part, flank in zip(parts, _active_flanks(paths[kind], kind.gear), strict=True):
            names = (kind.gear,) if part == "planet" else ("drive", "coast")
            out += [GearFlank(part, name, flank, _gaps(view, part, name, flank)) for name in names]
    return out


def modified_flanks(
    view: StageView, paths: Mapping[tuple[GearMeshKind, str], GearMeshPath]
) -> list[GearFlank]:
    """Flanks with modifications, of the right half of a double-helical stage; paths: by kind and
    side (``stage_paths``)."""
    half = "right" if view.stage.double_helical else ""
    half_paths = {kind: path for (kind, side), path in paths.items() if side == half}
    return [flank for flank in gear_flanks(view, half_paths) if flank.gaps]


def flank_pairs(
    view: StageView, paths: Mapping[GearMeshKind, GearMeshPath], mirrored: bool
) -> dict[GearMeshKind, FlankPair | None]:
    """Pair of flanks in each kind of gear mesh, None if both are involutes. mirrored: whether the
    half is the left one of a double-helical stage. Raises InputError for modifications with a
    gear-mesh model that does not follow pairs along the path."""
    flanks = {(flank.part, flank.name): flank for flank in gear_flanks(view, paths)}
    out: dict[GearMeshKind, FlankPair | None] = {}
    for kind, path in paths.items():
        parts = view.part("planet"), view.part(kind.gear)
        planet, gear = (flanks[part, flank_name(part, path)] for part in parts)
        on_planet, on_gear = (partial(flank.gap, mirrored=mirrored) for flank in (planet, gear))
        pair = FlankPair(on_planet, on_gear, path.off_path)
        out[kind] = pair if planet.gaps or gear.gaps else None
    if view.gear_mesh.model not in PER_PAIR_MODELS and any(out.values()):
        raise view.refuse(
            "gear_mesh.model",
            f"{view.gear_mesh.model!r} does not follow pairs along the path, so modified flanks "
            "have no effect",
            'use "per_pair", "face_load" or "lumped", or take the modifications out',
        )
    return out


def _active_flanks(path: GearMeshPath, role: str) -> tuple[Flank, Flank]:
    """Active flanks of the planet and of its mate on a path of contact."""
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


PathKey = tuple[GearMeshKind, str]  # kind and side
ProfileSolver = Callable[[tuple[float, float]], ProfileContact]  # by the span of the path, m
DEEPEST = 3.0  # gap at tips that is still considered, over the approach of one loaded pair
AVERAGED_SLICES = 65  # over which the gap of a pair is averaged
OTHER_HAND = {"right": "left", "left": "right"}


def stage_paths(view: StageView, forces: Mapping[str, float]) -> dict[PathKey, GearMeshPath]:
    """Paths of contact by kind and side ("", or "left" and "right" of a double-helical stage).

    forces: normal force of one gear mesh of "sun" and "ring" at rated load, N: stiffness may depend
    on it, and drive flanks carry where it is not negative. Raises InputError for gears that do not
    mesh and planets that do not assemble.
    """
    return dict(_stage_paths(view, tuple(sorted(forces.items()))))


@lru_cache(maxsize=16)  # a command asks for the same paths up to ten times
def _stage_paths(
    view: StageView, gear_mesh_forces: tuple[tuple[str, float], ...]
) -> dict[PathKey, GearMeshPath]:
    """As ``stage_paths``, which returns a copy of the dictionary."""
    g, stage, forces = stage_geometry(view), view.stage, dict(gear_mesh_forces)
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
    """Largest assembly error of any planet in sun pitches (``assembly_mismatch``)."""
    if view.stage.kind == "parallel":
        return 0.0
    return float(np.abs(assembly_mismatch(g, np.asarray(view.stage.planet_angles))).max())


def require_assembly(view: StageView, g: StageGeometry) -> None:
    """Raises InputError if planets do not assemble, unless the case allows that."""
    stage = view.stage
    if stage.allow_unassemblable or assembly_misfit(view, g) <= ASSEMBLY_TOLERANCE:
        return
    if not np.allclose(stage.planet_angles, equal_spacing(stage.planets)):
        first, *_ = angles = np.degrees(stage.planet_angles)
        misfit = np.abs(assembly_mismatch(g, np.radians(angles)))
        planet, step = int(np.argmax(misfit)), 360.0 / (g.sun.teeth + g.ring.teeth)
        nearest = first + step * np.rint((angles[planet] - first) / step)
        raise view.refuse(
            f"planet_positions_deg[{planet}]",
            f"the planets do not assemble: at {angles[planet]:.6g}° a tooth is "
            f"{misfit[planet]:.3g} pitches off the gap of the sun",
            f"take {nearest:.8g}°; planets assemble at multiples of 360°/(z_s + z_r) = {step:.6g}° "
            "from the first; or set allow_unassemblable = true",
        )
    raise view.refuse(
        "planets",
        f"the planets do not assemble: (z_s + z_r)/N = {g.assembly:.4g}",
        "choose tooth numbers with (z_s + z_r)/N whole, or planet_positions that assemble, "
        "or set allow_unassemblable = true",
    )


def _half_paths(
    view: StageView, g: StageGeometry, forces: Mapping[str, float], side: str = ""
) -> dict[GearMeshKind, GearMeshPath]:
    """Paths by kind of a stage with one helix, or of one half."""
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
        for kind, path in paths.items():
            law, force, pair = laws[kind.gear], forces[kind.gear], flanks[kind]
            profile = None if pair is None else partial(_profile, view, g, path, force, pair)
            if view.gear_mesh.model == "face_load":
                paths[kind] = _with_slices(view, path, law, force, profile)
            elif profile is not None:
                paths[kind] = _with_mean_gap(path, law, profile)
        return paths
    carrying = {path.kind.gear: path for path in paths.values() if path.carries}
    return {
        kind: replace(path, wave=_wave(view, g, path, carrying[kind.gear], forces[kind.gear]))
        for kind, path in paths.items()
    }


def _with_slices(
    view: StageView, path: GearMeshPath, law: Law, force: float, profile: ProfileSolver | None
) -> GearMeshPath:
    """Path with slices of its pairs, for load distribution along the face. Slices reach beyond the
    path to a gap of ``DEEPEST`` times the approach of one pair that carries the whole ``force``, N,
    and of the approach by faults besides; profile: contact of modified flanks."""
    options, span = view.gear_mesh, (path.s_lo, path.s_hi)
    if not options.path_only:
        stiffness = float(law(np.array([0.5]))[0]) * 2.0 * path.half_face
        approach = DEEPEST * abs(force) / stiffness + _room_by_faults(view, path)
        span = path.off_path.span(approach)

    def gap(s: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
        return path.off_path.gap(np.clip(s, *span))  # s exceeds the span by rounding only

    line = Line((path.s_lo, path.s_hi), span, path.slope, path.half_face)
    slices = cut(law, line, options.slices, None if options.path_only else gap)
    if profile is not None:
        slices = slices.modified(profile(span), law, line)
    return replace(path, slices=slices)


def _room_by_faults(view: StageView, path: GearMeshPath) -> float:
    """Largest distance, m, by which faulty teeth of a stage let the gears of a path approach."""
    faults = [x for x in view.case.faults if stage_of_fault(view.case, x).name == view.name]
    if any(fault.kind == "missing_tooth" for fault in faults):
        return path.base_pitch
    return max((x.deepest for x in faults if x.kind in ("spall", "wear")), default=0.0)


def _with_mean_gap(path: GearMeshPath, law: Law, profile: ProfileSolver) -> GearMeshPath:
    """Path with one spring for each pair, with mean gap and stiffness of modified flanks."""
    ends = (path.s_lo, path.s_hi)
    line = Line(ends, ends, path.slope, path.half_face)
    slices = cut(law, line, AVERAGED_SLICES)
    modified = slices.modified(profile(ends), law, line)
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
    """Contact of modified flanks across the profile, at the mean line load."""
    material = view.material
    compliance = 2.0 * (1.0 - material.poisson_ratio**2) / (math.pi * material.young_modulus)
    load = line_load(view, g, path.kind.gear, force)
    return profile_contact(flanks, span, path.half_face, compliance, load)


def _wave(
    view: StageView, g: StageGeometry, path: GearMeshPath, carrying: GearMeshPath, force: float
) -> NDArray[np.float64]:
    """Stiffness (T,) of a gear mesh over a base pitch, N/m. carrying: path of the flank that
    carries rated torque, to which phases of the case refer. Raises InputError where the stiffness
    falls to zero."""
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
    """Contact positions and teeth of pinion and gear at θ = 0, on drive and coast flanks."""
    zero = np.zeros(1, np.int64)
    pitch_point = g.planet.base_radius * math.tan(g.sun_gear_mesh.working_angle)
    coast, gear_tooth, pinion_tooth = _coast_of_parallel(g, pitch_point)
    return {
        GearMeshKind.SUN: (np.array([pitch_point]), zero, zero),
        GearMeshKind.SUN_COAST: (np.array([coast]), zero + pinion_tooth, zero + gear_tooth),
    }


def _coast_of_parallel(g: StageGeometry, drive: float) -> tuple[float, int, int]:
    """Coast contact while teeth 0 of both gears touch at s = drive on their drive flanks: s of the
    pair nearest to ``drive``, and its tooth numbers on gear and pinion.

    By ``contact``, s = r_b,gear (π + α + Δ − γ) with the half angle Δ at the base circle and the
    centre angle γ of the gear's tooth; on the mirrored drive flank +γ. So s_drive + s_coast of one
    tooth of the gear is 2 r_b,gear (π + α + Δ). Likewise for the pinion, σ = α + Δ − ρ/r_b,pinion.
    """
    pinion, gear, gear_mesh = g.sun, g.planet, g.sun_gear_mesh
    angle, pitch = gear_mesh.working_angle, gear_mesh.base_pitch
    same_tooth = 2 * gear.base_radius * (math.pi + angle + gear.base_half_angle) - drive
    steps = round((same_tooth - drive) / pitch)
    coast = same_tooth - steps * pitch
    reach = (pinion.base_radius + gear.base_radius) * math.tan(angle)
    turned = 2 * (angle + pinion.base_half_angle) - (2 * reach - drive - coast) / pinion.base_radius
    return coast, steps, round(turned * pinion.teeth / (2 * math.pi))
