"""Placement of a user's FE mesh, compared with the positions of its groups in the case.

The area-weighted centres c of the groups are compared with their positions p in the case. The rigid
motion x = R c + t that fits p best (least squares of the coordinates that the case states) is the
misplacement of the whole body. The FE mesh is refused where this motion exceeds _BODY of a tooth
pitch across the axis or of the face width along it, and where a single group is off by more than
_GROUP of these. If the motion corrects all groups, the message states the keys that apply it.
"""

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil, degrees, log10
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from flexgear.arrays import Array
from flexgear.model.bodies import FeMeshSource
from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh.fe_mesh import FeMesh, facet_areas, triangles
from flexgear.structures.fe_mesh.files import read_fe_mesh
from flexgear.structures.fe_mesh.groups import Groups

_BODY = 0.02  # tolerance of the whole body, in pitches and face widths
_GROUP = 0.2  # the same of one group, whose border follows the cells; flanks are half a pitch apart


@dataclass(frozen=True)
class Placement:
    """Position x = R X + shift of points X of a file: R turns by ``turn`` (rad) about the fixed x,
    then y, then z axis; shift in m."""

    shift: tuple[float, ...] = (0.0, 0.0, 0.0)
    turn: tuple[float, ...] = (0.0, 0.0, 0.0)

    @property
    def rotation(self) -> Rotation:
        """Rotation R."""
        return Rotation.from_euler("xyz", self.turn)

    def of(self, points: Array) -> Array:
        """Points (n, 3) m of the file in the frame of the case."""
        if not any(self.turn):
            return points + np.array(self.shift)
        return points @ self.rotation.as_matrix().T + np.array(self.shift)


def fe_mesh_of_file(source: FeMeshSource, groups: Groups, size: float, where: str) -> FeMesh:
    """The user's FE mesh in the case's placement. InputError unless its groups are at their
    positions.

    size: largest dimension of the body, m; where: source of the case.
    """
    file, key = str(source.fe_mesh_file), f"stage.{groups.body}.fe.fe_mesh_file"
    if source.fe_mesh == "reduced":
        problem = "is reduced: there is no FE mesh"
        remedy = "name the other component"
        raise InputError(where, f"stage.{groups.body}.fe.fe_mesh", problem, remedy)
    placement = Placement(source.fe_mesh_shift, source.fe_mesh_turn)
    stems = tuple(f.stem for f in groups.families if f.numbered)
    try:
        read = _read(_stamp(file), file, source.fe_mesh_unit, tuple(groups.needed), size, stems)
        fe_mesh = replace(read, points=placement.of(read.points))
        check_place(fe_mesh, groups, placement, file)
    except InputError as fault:
        what = ": ".join(dict.fromkeys([file, fault.key]))
        problem = f"{what}: {fault.problem}"
        raise InputError(where, key, problem, fault.remedy) from None
    return fe_mesh


def check_place(fe_mesh: FeMesh, groups: Groups, placement: Placement, path: str) -> None:
    """InputError with group, positions and remedy unless every group is at its position in the
    case.

    fe_mesh: in the frame of the case, by `placement`; path: of its file.
    """
    _refuse_extra(fe_mesh, groups, path)
    actual = _ActualPlacement(fe_mesh, groups)
    motion, shift = actual.best_motion()
    corrected = motion.apply(actual.centres) + shift
    if actual.is_off_as_a_whole(motion, shift) and actual.misfit(corrected).max() <= 1.0:
        worst = int(np.argmax(np.linalg.norm(corrected - actual.centres, axis=1)))
        problem = f"{actual.where(worst)}; the whole FE mesh is out of place"
        remedy = _keys(groups, placement, motion, shift)
        raise InputError(path, actual.names[worst], problem, remedy)
    _refuse_clockwise(actual, path)
    _refuse_group(actual, path)
    _refuse_helix(fe_mesh, actual, path)


class _ActualPlacement:
    """Groups (n,) of a user's FE mesh: names, families, and their centres (n, 3) in the FE mesh and
    positions (n, 3) in the case, m."""

    def __init__(self, fe_mesh: FeMesh, groups: Groups) -> None:
        self.groups = groups
        pairs = [
            (f, name, place)
            for f in groups.families
            for name, place in zip(f.names, f.places, strict=True)
            if name in fe_mesh.facets
        ]
        self.families = [f for f, _, _ in pairs]
        self.names = [name for _, name, _ in pairs]
        self.places = np.array([place for _, _, place in pairs])
        self.centres = np.array([fe_mesh.centre(name) for name in self.names])
        self.side = np.array([f.side for f in self.families], dtype=float)
        self.radial = np.array([f.radial for f in self.families])

    def best_motion(self) -> tuple[Rotation, Array]:
        """R and t that fit the centres to their positions best, where the case states these."""
        size = float(np.abs(self.centres - self.centres.mean(axis=0)).max())
        stated = np.isfinite(self.places)
        guess = np.where(stated, self.places, 0.0)
        guess[:, 2] += np.where(stated[:, 2], 0.0, self.side * size)
        used = stated.any(axis=1)
        middle, target = self.centres[used].mean(axis=0), guess[used].mean(axis=0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # points on one line do not determine a rotation
            start, _ = Rotation.align_vectors(guess[used] - target, self.centres[used] - middle)

        def off(x: Array) -> Array:
            turned = (Rotation.from_rotvec(x[:3]) * start).apply(self.centres - middle)
            return np.asarray((turned + target + size * x[3:] - self.places)[stated] / size)

        tight = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
        best = least_squares(off, np.zeros(6), **tight).x
        rotation = Rotation.from_rotvec(best[:3]) * start
        return rotation, target + size * best[3:] - rotation.apply(middle)

    def is_off_as_a_whole(self, motion: Rotation, shift: Array) -> bool:
        """Whether a motion exceeds the tolerance of the whole body."""
        g, turn = self.groups, motion.as_rotvec()
        across = max(abs(turn[2]) * g.radius, float(np.hypot(*shift[:2])))
        along = max(float(np.hypot(*turn[:2])) * g.radius, abs(float(shift[2])))
        return across > _BODY * g.pitch or along > _BODY * g.face_width

    def misfit(self, centres: Array) -> Array:
        """Distance (n,) of the groups' centres (n, 3) m from their positions over their
        tolerances."""
        g = self.groups
        open_across = np.isnan(self.places[:, 0])
        places = np.where(np.isnan(self.places), centres, self.places)
        radius, angle = np.hypot(*places[:, :2].T), np.arctan2(places[:, 1], places[:, 0])
        radial = centres[:, 0] * np.cos(angle) + centres[:, 1] * np.sin(angle) - radius
        around = centres[:, 1] * np.cos(angle) - centres[:, 0] * np.sin(angle)
        on_axis = radius < _GROUP * g.pitch
        allowed = np.where(on_axis, _GROUP * g.pitch, self.radial)
        across = np.maximum(np.abs(radial) / allowed, np.abs(around) / (_GROUP * g.pitch))
        along = np.abs(centres[:, 2] - places[:, 2]) / (_GROUP * g.face_width)
        wrong_side = np.where(self.side * centres[:, 2] < 0.0, np.inf, 0.0)
        return np.maximum.reduce([np.where(open_across, 0.0, across), along, wrong_side])

    def where(self, i: int) -> str:
        """Actual and expected position of group i, for a message."""
        sign = "+" if self.side[i] > 0 else "-"
        stated = self.groups.point(self.places[i])
        belongs = f"at {stated}" if stated else f"on the {sign}z side"
        if stated and self.side[i] and np.isnan(self.places[i, 2]):
            belongs += f" on the {sign}z side"
        return f"its centre is at {self.groups.point(self.centres[i])} but belongs {belongs}"


def _refuse_extra(fe_mesh: FeMesh, groups: Groups, path: str) -> None:
    """InputError for numbered groups that the case does not have."""
    for f in groups.families:
        if not f.numbered:
            continue
        strange = [n for n in fe_mesh.facets if re.fullmatch(rf"{f.stem}_\d+", n)]
        extra = sorted(set(strange) - set(f.names))
        if extra:
            more = f", nor are {len(extra) - 1} more" if extra[1:] else ""
            problem = f"is none of the {len(f.names)} groups {f.stem}_… that the case has{more}"
            remedy = f"correct {f.says}, or rename or take out the group"
            raise InputError(path, extra[0], problem, remedy)


def _keys(groups: Groups, placement: Placement, motion: Rotation, shift: Array) -> str:
    """Remedy with the keys that place the FE mesh correctly: the present placement followed by a
    motion, with few digits."""
    fine = 0.05 * _BODY
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # after a quarter turn about y: x and z are one
        turn = (motion * placement.rotation).as_euler("xyz", degrees=True)
    mm = 1e3 * (motion.apply(np.array(placement.shift)) + shift)
    off = 1e3 * fine * np.array([groups.pitch, groups.pitch, groups.face_width])
    keys = {
        "shift_mm": [_roundest(v, slack) for v, slack in zip(mm, off, strict=True)],
        "turn_deg": [_roundest(v, degrees(fine * groups.pitch / groups.radius)) for v in turn],
    }
    set_now = {"shift_mm": any(placement.shift), "turn_deg": any(placement.turn)}
    settings = [
        f"stage.{groups.body}.fe.fe_mesh_{key} = {_numbers(values)}"
        for key, values in keys.items()
        if any(values) or set_now[key]
    ]
    return f"set {' and '.join(settings)}, or correct the file or its groups"


def _refuse_clockwise(actual: _ActualPlacement, path: str) -> None:
    """InputError for groups numbered clockwise: |mean e^{i(θ + θ_place)}| is then 1, and
    |mean e^{i(θ - θ_place)}| 0."""
    for f in actual.groups.families:
        at = [k for k, family in enumerate(actual.families) if family is f]
        if len(at) < 3:
            continue
        angle, place = (np.arctan2(x[at, 1], x[at, 0]) for x in (actual.centres, actual.places))
        against, along = (abs(np.mean(np.exp(1j * (angle + s * place)))) for s in (1, -1))
        if against > 0.9 > 0.5 > along:
            where = actual.where(at[1])
            problem = f"{where}; {f.stem}_… are numbered clockwise, seen from +z"
            remedy = "number them counter-clockwise from the x axis on, or mirror the FE mesh"
            raise InputError(path, actual.names[at[1]], problem, remedy)


def _refuse_group(actual: _ActualPlacement, path: str) -> None:
    """InputError for the group that is farthest from its position, if beyond its tolerance."""
    misfit = actual.misfit(actual.centres)
    worst, count = int(np.argmax(misfit)), int((misfit > 1.0).sum())
    if count:
        others = f"; {count} of {len(misfit)} groups are out of place" if count > 1 else ""
        says = f"{actual.families[worst].says}, dimensions, sides"
        remedy = f"give that name to the surface that belongs there, or correct the case: {says}"
        raise InputError(path, actual.names[worst], actual.where(worst) + others, remedy)


def _refuse_helix(fe_mesh: FeMesh, actual: _ActualPlacement, path: str) -> None:
    """InputError where the helix moves the ends of a tooth, half a face width from its middle, too
    far from their position."""
    g = actual.groups
    for f in g.families:
        names = [n for n in f.names if n in fe_mesh.facets]
        if f.twist is None or not names:
            continue
        twist = float(np.median([_twist(fe_mesh, name) for name in names]))
        if abs(twist - f.twist) * g.face_width / 2.0 * g.radius > _GROUP * g.pitch:
            has, expected = (degrees(x * g.face_width) for x in (twist, f.twist))
            problem = f"turns by {has:.2f} degrees over the face width, the case's helix by "
            remedy = "correct stage.helix_angle, stage.planet_hand (the ring's too) or the FE mesh"
            raise InputError(path, names[0], f"{problem}{expected:.2f}", remedy)


def _twist(fe_mesh: FeMesh, name: str) -> float:
    """Area-weighted slope dθ/dz of a group's facets, rad/m."""
    ids, centre = triangles(fe_mesh.facets[name]), fe_mesh.centre(name)
    areas = facet_areas(fe_mesh.points, ids)
    away = fe_mesh.points[ids].mean(axis=1) - centre
    radius = np.hypot(*centre[:2])
    around = (away[:, 1] * centre[0] - away[:, 0] * centre[1]) / radius**2
    spread = float(areas @ away[:, 2] ** 2)
    return float(areas @ (around * away[:, 2])) / spread if spread > 0.0 else 0.0


def _roundest(value: float, slack: float) -> float:
    """The number with the fewest decimals within ``slack`` of a value."""
    decimals = range(max(1, ceil(-log10(slack)) + 1))
    tried = (round(float(value), d) for d in decimals)
    return next((v for v in tried if abs(v - value) <= slack), float(value)) + 0.0


def _numbers(values: Sequence[float]) -> str:
    """Values of a key as text: one number where only z is not zero, else three."""
    words = [f"{v:.12g}" for v in values]
    return f"[{', '.join(words)}]" if any(values[:2]) else words[2]


def _stamp(file: str) -> tuple[int, int]:
    """Modification time, ns, and size of a file, which tell whether it has changed; zeros where it
    cannot be read."""
    try:
        status = Path(file).stat()
    except OSError:
        return (0, 0)
    return (status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=2)  # commands read two files before their work and again in it
def _read(stamp: tuple[int, int], *arguments: Any) -> FeMesh:
    return read_fe_mesh(*arguments)
