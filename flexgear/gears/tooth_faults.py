"""Effect of tooth faults on tooth pairs: depth of pits, missing and softer pairs.

A pit or wear of depth d over a patch of a flank is a gap beside those of modified flanks, along the
normal N, at every slice of a contact line (mean over the slice's width). Its edges are not rounded
by contact, nor sharper than a slice. A missing tooth takes the stiffness of its pairs away, on and
off the path of contact. A cracked root makes slices yield by ΔC f more under forces f,

    k_j → k_j/(1 + k_j c_j),   c_j = Σ_i ΔC_ji f_i/f_j, the load taken even along the line,

where slices are springs beside each other; where they bend each other ΔC adds to the flexibility
between them (``gears.slices.bent``). ΔC is that of ``structures.tooth_influence.of_case``.

Pairs that are one spring have of their slices

    k = Σ_T k_j,   z_c = Σ_T k_j z_j/k,   gap = Σ_T k_j d_j/k,   T = {j: d_j < δ},

which is their law F(δ) and its slope exactly where they have approached by δ, the deflection of the
gear mesh under its mean load: slices over a pit deeper than that carry nothing. Where all of a line
lies over deeper pits, T are the slices over the shallowest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import PLACES, flank_name
from flexgear.gears.radii import role_of
from flexgear.gears.slices import Line, Slices, cut
from flexgear.gears.stiffness import pair_law
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.errors import InputError
from flexgear.model.faults import Fault, stage_of_fault

if TYPE_CHECKING:
    from flexgear.model.stage_view import StageView

WITHIN_SLICE = 8  # places over which depth is averaged
MOST_CUT = 0.8  # of the root section, that a crack may cut
SAME_DEPTH = 1e-9
NOT_ASSESSED = (
    "ratings, nominal and root stresses are those of sound teeth, lives those of sound races; that "
    "faults grow is not modelled"
)

Numbered = tuple[int, Fault]  # place among the case's faults
Softness = Callable[[GearMeshPath, Slices], Array]  # ΔC (S, K, K) m/N between slices


@dataclass(frozen=True)
class FaultGroups:
    """Teeth of a kind of gear mesh with the same faults, from 0: of the gear, and (planet, tooth)
    of the planets, with the faults that act on its flanks.

    With A groups of teeth of the gear, tables of pairs lie side by side from the first one of the
    kind on: of sound teeth, of the gear's groups 1 … A, and the same again for every group of
    planets' teeth. A pair takes the table

        first + a + (1 + A) b ,   a, b: groups of its teeth, 0 of sound ones.
    """

    gear: dict[tuple[Numbered, ...], tuple[int, ...]]
    planets: dict[tuple[Numbered, ...], tuple[tuple[int, int], ...]]

    @property
    def of_pairs(self) -> list[tuple[Numbered, ...]]:
        """Faults of pairs in the order of their tables; none of the first."""
        return [
            (*of_gear, *of_planet)
            for of_planet in ((), *self.planets)
            for of_gear in ((), *self.gear)
        ]

    def gear_table(self, teeth: int) -> Ints:
        """What each tooth of the gear adds to the number of the table (teeth,)."""
        out = np.zeros(teeth, dtype=np.int64)
        for a, group in enumerate(self.gear.values(), 1):
            out[list(group)] = a
        return out

    def planet_table(self, planet: int, teeth: int) -> Ints:
        """What each tooth of a planet adds to it (teeth,)."""
        out = np.zeros(teeth, dtype=np.int64)
        for b, group in enumerate(self.planets.values(), 1):
            out[[tooth for of, tooth in group if of == planet]] = b * (1 + len(self.gear))
        return out


def faults_of_stage(view: StageView) -> list[Numbered]:
    """Faults of a stage's teeth that change something. InputError where one does not fit its
    tooth."""
    faults = [
        (k, fault)
        for k, fault in enumerate(view.case.faults)
        if stage_of_fault(view.case, fault).name == view.name and not fault.of_bearing
    ]
    return [(k, fault) for k, fault in faults if not fault.is_sound]


def faulty_gears(view: StageView) -> set[str]:
    """ "sun", "planet", "ring" where teeth have faults; pinion and gear count as sun and planet."""
    return {role_of(fault.gear) for _, fault in faults_of_stage(view)}


def fault_report(view: StageView, paths: Sequence[GearMeshPath]) -> dict[str, str]:
    """A line for each fault of a stage by its number in the case, and that ratings leave them out.
    InputError where one does not fit its tooth."""
    for path in paths:
        fault_groups(view, path)
    lines = {
        f"fault_{k}": fault.words
        for k, fault in enumerate(view.case.faults)
        if stage_of_fault(view.case, fault).name == view.name
    }
    return lines | ({"not_assessed": NOT_ASSESSED} if lines else {})


def fault_groups(view: StageView, path: GearMeshPath) -> FaultGroups:
    """Groups of equal faults of the gear meshes of a path."""
    roles = path.kind.gear, "planet"
    of_teeth: dict[str, dict[tuple[int, int], list[Numbered]]] = {role: {} for role in roles}
    for number, fault in faults_of_stage(view):
        for role, count in zip(roles, (path.gear_teeth, path.planet_teeth), strict=True):
            part = view.part(role)
            if fault.gear != part or (fault.side or "") != path.side:
                continue
            if fault.flank not in (None, flank_name(part, path)):
                continue
            _require_on_tooth(view, (number, fault), tooth_of(path, role))
            teeth = range(count) if fault.tooth is None else [fault.tooth - 1]
            for tooth in teeth:
                key = (fault.planet or 1) - 1, tooth
                of_teeth[role].setdefault(key, []).append((number, fault))
    gear: dict[tuple[Numbered, ...], tuple[int, ...]] = {}
    planets: dict[tuple[Numbered, ...], tuple[tuple[int, int], ...]] = {}
    for (_, tooth), faults in of_teeth[roles[0]].items():
        gear[tuple(faults)] = (*gear.get(tuple(faults), ()), tooth)
    for at, faults in of_teeth["planet"].items():
        planets[tuple(faults)] = (*planets.get(tuple(faults), ()), at)
    return FaultGroups(gear, planets)


def tooth_of(path: GearMeshPath, role: str) -> ToothGeometry:
    """The tooth of "planet", or of its mate."""
    return path.off_path.planet if role == "planet" else path.off_path.gear


def with_faults(
    view: StageView,
    path: GearMeshPath,
    force: float,
    faults: Sequence[Numbered],
    softness: Softness | None,
) -> GearMeshPath:
    """A path of pairs with these faults, before flexibility between slices is added.

    force: of the gear mesh, N; softness: compliance of all cracks among the faults; None without
    cracks, or where it is added to the flexibility between slices.
    """
    if not faults:
        return path
    lines, springs = path.slices, path.slices is None
    if lines is None:
        ends = (path.s_lo, path.s_hi)
        law = pair_law(view, stage_geometry(view), path.kind.gear, force)
        lines = cut(law, Line(ends, ends, path.slope, path.half_face), PLACES)
    missing = any(fault.kind == "missing_tooth" for _, fault in faults)
    soft = np.zeros_like(lines.z) if softness is None else _even_load(softness(path, lines), lines)
    stiffness = np.zeros_like(soft) if missing else lines.stiffness / (1 + lines.stiffness * soft)
    depth = sum((_depth(view, path, lines, fault) for _, fault in faults), np.zeros_like(lines.z))
    if springs:
        return _as_spring(path, lines, stiffness, depth, abs(force) / path.mean_stiffness)
    changed = replace(lines.with_stiffness(stiffness), gap=lines.gap + depth)
    return replace(path, slices=changed)


def _even_load(flexibility: Array, lines: Slices) -> Array:
    """c_j (S, K) m/N under a load even along z: ΔC w/w_j, w the slices' widths."""
    wide = lines.width > 0.0
    motion = np.einsum("sij,sj->si", flexibility, lines.width)
    return np.divide(motion, lines.width, out=np.zeros_like(motion), where=wide)


def _as_spring(
    path: GearMeshPath, lines: Slices, stiffness: Array, depth: Array, approach: float
) -> GearMeshPath:
    """Pairs as one spring, tangent to the law of their slices at an approach, m."""
    shallowest = depth.min(axis=1, keepdims=True)
    touching = (depth < approach) | (depth <= shallowest * (1.0 + SAME_DEPTH))
    stiffness = np.where(touching, stiffness, 0.0)
    k, before = stiffness.sum(axis=1), lines.stiffness.sum(axis=1)
    held = k > 0.0

    def mean(values: Array, out: Array) -> Array:
        return np.divide((stiffness * values).sum(axis=1), k, out=out, where=held)

    share = np.divide(k, before, out=np.zeros_like(k), where=before > 0.0)
    shift = mean(lines.z, lines.centre.copy()) - lines.centre
    at = path.s_grid
    return replace(
        path,
        k_grid=path.k_grid * np.interp(at, lines.s, share),
        zc_grid=path.zc_grid + np.interp(at, lines.s, shift),
        gap_grid=path.gap_grid + np.interp(at, lines.s, mean(depth, np.zeros_like(k))),
    )


def _depth(view: StageView, path: GearMeshPath, lines: Slices, fault: Fault) -> Array:
    """Depth (S, K) m of a pit or wear, mean over each slice."""
    if fault.kind not in ("spall", "wear"):
        return np.zeros_like(lines.z)
    role = "planet" if fault.gear == view.part("planet") else path.kind.gear
    tooth, total = tooth_of(path, role), np.zeros_like(lines.z)
    first, last = sorted(map(tooth.roll_length, _diameters(tooth, fault)))
    low, high = _ends_along_face(path, fault)
    for k in range(WITHIN_SLICE):
        z = lines.z + lines.width * ((k + 0.5) / WITHIN_SLICE - 0.5)
        s = np.clip(lines.s[:, None] + path.slope * z, *lines.span)
        roll = np.nan_to_num(path.off_path.rolls(s)[0 if role == "planet" else 1], nan=-1.0)
        inside = (roll >= first) & (roll <= last) & (z >= low) & (z <= high)
        shape = np.ones_like(roll)
        if fault.kind == "wear":
            shape = 1.0 - ((2.0 * roll - first - last) / (last - first)) ** 2
        total += np.where(inside, shape, 0.0)
    return (fault.depth or 0.0) / WITHIN_SLICE * total


def _diameters(tooth: ToothGeometry, fault: Fault) -> tuple[float, float]:
    """Radii between which a pit or wear lies, m."""
    ends = sorted((tooth.form_radius, tooth.tip_radius))
    low = ends[0] if fault.start_diameter is None else 0.5 * fault.start_diameter
    high = ends[1] if fault.end_diameter is None else 0.5 * fault.end_diameter
    return low, high


def _ends_along_face(path: GearMeshPath, fault: Fault) -> tuple[float, float]:
    """z between which a pit or wear lies, m; the left half is counted outward, towards −z."""
    half = path.half_face
    low = -half if fault.face_start is None else fault.face_start
    high = half if fault.face_end is None else fault.face_end
    return (-high, -low) if path.side == "left" else (low, high)


def _require_on_tooth(view: StageView, numbered: Numbered, tooth: ToothGeometry) -> None:
    """InputError where a patch is outside the flank, or a crack cuts too much of the root."""
    number, fault = numbered
    if fault.kind == "root_crack":
        section = tooth.root.section.thickness
        across = fault.deepest * np.sin(fault.angle)
        if across >= MOST_CUT * section:
            raise InputError(
                view.case.source,
                f"faults[{number}].depth{'s' if fault.depths else ''}_mm",
                f"{1e3 * fault.deepest:g} mm cut {100 * across / section:.0f} % of the root "
                f"section of {1e3 * section:.4g} mm",
                f"at most {100 * MOST_CUT:.0f} %; beyond, take a missing_tooth",
            )
    if fault.kind not in ("spall", "wear"):
        return
    ends = sorted((2.0 * tooth.form_radius, 2.0 * tooth.tip_radius))
    for key in ("start_diameter", "end_diameter"):
        value = getattr(fault, key)
        if value is not None and not ends[0] * (1 - 1e-9) <= value <= ends[1] * (1 + 1e-9):
            raise InputError(
                view.case.source,
                f"faults[{number}].{key}_mm",
                f"{1e3 * value:g} mm is outside the flank",
                f"between {1e3 * ends[0]:.6g} and {1e3 * ends[1]:.6g} mm",
            )
    if not np.subtract(*_diameters(tooth, fault)) < 0.0:
        raise InputError(
            view.case.source, f"faults[{number}].start_diameter_mm", "leaves nothing of the flank",
            f"between {1e3 * ends[0]:.6g} and {1e3 * ends[1]:.6g} mm",
        )  # fmt: skip
