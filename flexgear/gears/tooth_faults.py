"""Effect of tooth faults on tooth pairs: gaps of pits and wear, missing teeth, cracked roots.

A pit or wear of depth d on a patch of a flank adds a gap, along the normal N, to every slice of a
contact line (mean over the width of the slice); contact does not round its edges. A missing tooth
removes the stiffness of its pairs, on and off the path of contact. A cracked root adds ΔC f to the
deflection of slices under forces f. For independent slices, with a uniform load along the line,

    k_j → k_j/(1 + k_j c_j),   c_j = Σ_i ΔC_ji f_i/f_j;

for coupled slices ΔC is added to their flexibility (``gears.slices.with_flexibility``). ΔC is that
of ``structures.tooth_influence.of_case``.

A pair that is one spring has, from its slices,

    k = Σ_T k_j,   z_c = Σ_T k_j z_j/k,   gap = Σ_T k_j d_j/k,   T = {j: d_j < δ},

which is exact in force and slope at the approach δ, the deflection of the gear mesh under its mean
load: slices over a deeper pit do not touch. If all pits on a line are deeper, T are the slices over
the shallowest.

With a total contact ratio below two a faulty tooth is alone on the path of contact for part of the
cycle. If it is missing, or worn deeper than the gear mesh deflects, tips of the teeth beside it
take the load; a model without contact off the path leaves the gears free there, until the next
pair begins its path with the whole stiffness at whatever approach they have reached. So it does
with pitch deviations of neighbouring teeth that differ by more than this deflection
(``lost_contact``).
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.geometry import PER_PAIR_MODELS, stage_geometry
from flexgear.gears.off_path import SAME_LENGTH
from flexgear.gears.paths import AVERAGED_SLICES, flank_name, stage_paths
from flexgear.gears.radii import role_of
from flexgear.gears.slices import Line, Slices, cut
from flexgear.gears.stiffness import pair_law
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.errors import InputError
from flexgear.model.faults import Fault, stage_of_fault
from flexgear.model.stage_view import StageView

POINTS_IN_SLICE = 8  # over which the depth is averaged
LARGEST_CRACK = 0.8  # of the root section
SAME_DEPTH = 1e-9  # relative difference of depths that count as equal
NEIGHBOURS = 3.0 * math.sqrt(2.0)  # standard deviations: three of the difference of two pitches
NOT_ASSESSED = (
    "ratings, nominal and root stresses are those of sound teeth, lives those of sound races; "
    "growth of faults is not modelled"
)

Numbered = tuple[int, Fault]  # fault with its index in the case
CrackFlexibility = Callable[[GearMeshPath, Slices], Array]  # ΔC (S, K, K), m/N


@dataclass(frozen=True)
class FaultGroups:
    """Groups of teeth with equal faults in one kind of gear mesh.

    gear: teeth of the gear by faults; planets: (planet, tooth) by faults; all from 0. With A groups
    on the gear, the table of a pair has the number

        first + a + (1 + A) b ,   a, b: groups of its teeth on gear and planet, 0 for sound teeth.
    """

    gear: dict[tuple[Numbered, ...], tuple[int, ...]]
    planets: dict[tuple[Numbered, ...], tuple[tuple[int, int], ...]]

    @property
    def of_pairs(self) -> list[tuple[Numbered, ...]]:
        """Faults of pairs by number of their table; none in the first."""
        return [
            (*of_gear, *of_planet)
            for of_planet in ((), *self.planets)
            for of_gear in ((), *self.gear)
        ]

    def gear_table(self, teeth: int) -> Ints:
        """Contribution a (teeth,) of each tooth of the gear to the number of the table."""
        out = np.zeros(teeth, dtype=np.int64)
        for a, group in enumerate(self.gear.values(), 1):
            out[list(group)] = a
        return out

    def planet_table(self, planet: int, teeth: int) -> Ints:
        """Contribution (1 + A) b (teeth,) of each tooth of a planet to the number of the table."""
        out = np.zeros(teeth, dtype=np.int64)
        for b, group in enumerate(self.planets.values(), 1):
            out[[tooth for k, tooth in group if k == planet]] = b * (1 + len(self.gear))
        return out


def faults_of_stage(view: StageView) -> list[Numbered]:
    """Faults of the teeth of a stage that have an effect."""
    return [
        (k, fault)
        for k, fault in enumerate(view.case.faults)
        if stage_of_fault(view.case, fault).name == view.name
        if not (fault.of_bearing or fault.is_sound)
    ]


def faulty_gears(view: StageView) -> set[str]:
    """Roles "sun", "planet", "ring" of gears with faulty teeth; a pinion counts as sun."""
    return {role_of(fault.gear) for _, fault in faults_of_stage(view)}


def fault_report(view: StageView, paths: Sequence[GearMeshPath]) -> dict[str, str]:
    """One line for each fault of a stage by its number in the case, and a note on ratings. Raises
    InputError for a fault that does not fit its tooth."""
    for path in paths:
        fault_groups(view, path)
    lines = {
        f"fault_{k}": fault.words
        for k, fault in enumerate(view.case.faults)
        if stage_of_fault(view.case, fault).name == view.name
    }
    return lines | ({"not_assessed": NOT_ASSESSED} if lines else {})


def lost_contact(view: StageView, forces: Mapping[str, float]) -> Iterator[str]:
    """Warnings about faulty teeth beside which tips would take the load, and such pitch deviations,
    in a model without contact off the path. forces: normal force of one gear mesh of "sun" and
    "ring", N."""
    if view.gear_mesh.model == "face_load" and not view.gear_mesh.path_only:
        return
    doubtful, e = dict[Numbered | str, str](), view.stage.errors
    of_pairs = view.gear_mesh.model in PER_PAIR_MODELS
    pitches = of_pairs and (e.ring_pitch or e.planet_pitch or e.sun_pitch)
    concerned = pitches or faults_of_stage(view)
    for (kind, _), path in stage_paths(view, forces).items() if concerned else ():
        overlap = abs(path.slope) * path.half_face
        alone = path.s_grid > path.s_hi + overlap - path.base_pitch
        alone &= path.s_grid < path.s_lo - overlap + path.base_pitch
        approach = abs(forces[kind.gear]) / path.mean_stiffness
        differ = NEIGHBOURS * math.hypot(getattr(e, f"{kind.gear}_pitch"), e.planet_pitch)
        if path.carries and alone.any() and differ > approach > 0.0:
            sizes = (
                f"by up to {1e6 * differ:.3g} µm, the gear mesh deflects by {1e6 * approach:.3g} µm"
            )
            doubtful[kind.gear] = f"pitches at the {view.part(kind.gear)} differ {sizes}"
        for numbered in itertools.chain(*fault_groups(view, path).of_pairs):
            spring = replace(path, slices=None)
            faulty = with_faults(view, spring, forces[kind.gear], [numbered], None)
            touches = (faulty.k_grid > 0.0) & (faulty.gap_grid < path.gap_grid + approach)
            if path.carries and not touches[alone].all():
                doubtful[numbered] = numbered[1].words
    for words in doubtful.values():
        yield (
            f"{words}: where one pair is alone on the path of contact, tips touch beside the path, "
            f"which gear_mesh.model = {view.gear_mesh.model!r} leaves out here: forces of "
            "transients come out too large, up to several times; take 'face_load' without path_only"
        )


def fault_groups(view: StageView, path: GearMeshPath) -> FaultGroups:
    """Groups of teeth with equal faults on a path. Raises InputError for a fault that does not fit
    its tooth."""
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
    """Tooth geometry of "planet", or of its mate."""
    return path.off_path.planet if role == "planet" else path.off_path.gear


def with_faults(
    view: StageView,
    path: GearMeshPath,
    force: float,
    faults: Sequence[Numbered],
    cracks: CrackFlexibility | None,
) -> GearMeshPath:
    """Path whose pairs have these faults, without flexibility between slices. force: of the gear
    mesh, N; cracks: flexibility of all cracks among the faults, None without cracks, or where it is
    added to the flexibility between slices."""
    if not faults:
        return path
    lines = path.slices
    if lines is None:
        ends = (path.s_lo, path.s_hi)
        law = pair_law(view, stage_geometry(view), path.kind.gear, force)
        lines = cut(law, Line(ends, ends, path.slope, path.half_face), AVERAGED_SLICES)
    stiffness = lines.stiffness
    if any(fault.kind == "missing_tooth" for _, fault in faults):
        stiffness = np.zeros_like(lines.z)
    elif cracks is not None:
        stiffness = stiffness / (1 + stiffness * _crack_compliance(cracks(path, lines), lines))
    depth = sum((_depth(view, path, lines, fault) for _, fault in faults), np.zeros_like(lines.z))
    if path.slices is None:
        return _as_spring(path, lines, stiffness, depth, abs(force) / path.mean_stiffness)
    return replace(path, slices=replace(lines.with_stiffness(stiffness), gap=lines.gap + depth))


def _crack_compliance(flexibility: Array, lines: Slices) -> Array:
    """Compliance c_j (S, K) under a uniform load along z, m/N: ΔC w/w_j, w widths of slices."""
    wide = lines.width > 0.0
    deflection = np.einsum("sij,sj->si", flexibility, lines.width)
    return np.divide(deflection, lines.width, out=np.zeros_like(deflection), where=wide)


def _as_spring(
    path: GearMeshPath, lines: Slices, stiffness: Array, depth: Array, approach: float
) -> GearMeshPath:
    """Path with pairs as one spring, tangent to the law of their slices at an approach, m."""
    shallowest = depth.min(axis=1, keepdims=True)
    touching = (depth < approach) | (depth <= shallowest * (1.0 + SAME_DEPTH))
    stiffness = np.where(touching, stiffness, 0.0)
    k, before = stiffness.sum(axis=1), lines.stiffness.sum(axis=1)

    def mean(values: Array, out: Array) -> Array:
        return np.divide((stiffness * values).sum(axis=1), k, out=out, where=k > 0.0)

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
    """Depth (S, K) of a pit or wear, m, mean over each slice."""
    if fault.kind not in ("spall", "wear"):
        return np.zeros_like(lines.z)
    role = "planet" if fault.gear == view.part("planet") else path.kind.gear
    tooth, total = tooth_of(path, role), np.zeros_like(lines.z)
    first, last = sorted(map(tooth.roll_length, _radii(tooth, fault)))
    least, most = first * (1.0 - SAME_LENGTH), last * (1.0 + SAME_LENGTH)  # with the tip edge
    half = path.half_face
    low = -half if fault.face_start is None else fault.face_start
    high = half if fault.face_end is None else fault.face_end
    if path.side == "left":  # on which the case counts towards −z
        low, high = -high, -low
    for k in range(POINTS_IN_SLICE):
        z = lines.z + lines.width * ((k + 0.5) / POINTS_IN_SLICE - 0.5)
        s = np.clip(lines.s[:, None] + path.slope * z, *lines.span)
        roll = np.nan_to_num(path.off_path.rolls(s)[0 if role == "planet" else 1], nan=-1.0)
        inside = (roll >= least) & (roll <= most) & (z >= low) & (z <= high)
        shape = np.ones_like(roll)
        if fault.kind == "wear":
            shape = 1.0 - ((2.0 * roll - first - last) / (last - first)) ** 2
        total += np.where(inside, shape, 0.0)
    return (fault.depth or 0.0) / POINTS_IN_SLICE * total


def _radii(tooth: ToothGeometry, fault: Fault) -> tuple[float, float]:
    """Radial range of a pit or wear, m."""
    ends = sorted((tooth.form_radius, tooth.tip_radius))
    low = ends[0] if fault.start_diameter is None else 0.5 * fault.start_diameter
    high = ends[1] if fault.end_diameter is None else 0.5 * fault.end_diameter
    return low, high


def _require_on_tooth(view: StageView, numbered: Numbered, tooth: ToothGeometry) -> None:
    """Raises InputError for a patch outside the flank or deeper than half the tooth, and a crack
    too deep for the root."""
    number, fault = numbered
    if fault.kind == "root_crack":
        section = tooth.root.section.thickness
        depth = fault.deepest * np.sin(fault.angle)
        if depth >= LARGEST_CRACK * section:
            raise InputError(
                view.case.source,
                f"faults[{number}].depth{'s' if fault.depths else ''}_mm",
                f"{1e3 * fault.deepest:g} mm cut {100 * depth / section:.0f} % of the root "
                f"section of {1e3 * section:.4g} mm",
                f"at most {100 * LARGEST_CRACK:.0f} %; beyond, take a missing_tooth",
            )
    if fault.kind not in ("spall", "wear"):
        return
    if fault.deepest > tooth.thickness / 2:
        problem = f"{1e3 * fault.deepest:g} mm is more than half of the tooth"
        remedy = f"at most {1e3 * tooth.thickness / 2:.4g} mm; beyond, take a missing_tooth"
        raise InputError(view.case.source, f"faults[{number}].depth", problem, remedy)
    ends = sorted((2.0 * tooth.form_radius, 2.0 * tooth.tip_radius))
    for key in ("start_diameter", "end_diameter"):
        value = getattr(fault, key)
        if value is not None and not ends[0] * (1 - 1e-9) <= value <= ends[1] * (1 + 1e-9):
            problem = f"{1e3 * value:g} mm is outside the flank"
            remedy = f"between {1e3 * ends[0]:.6g} and {1e3 * ends[1]:.6g} mm"
            raise InputError(view.case.source, f"faults[{number}].{key}_mm", problem, remedy)
    if not np.subtract(*_radii(tooth, fault)) < 0.0:
        problem = "leaves nothing of the flank"
        remedy = f"between {1e3 * ends[0]:.6g} and {1e3 * ends[1]:.6g} mm"
        raise InputError(view.case.source, f"faults[{number}].start_diameter_mm", problem, remedy)
