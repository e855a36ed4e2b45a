"""Whether supports, joints and gear meshes leave a train exactly its rotations as free motions.

Free motions q resist neither constant springs nor gear meshes: K q = 0, V q = 0. Among the rigid
motions of all bodies they are as many as the train has independent rotations, or some body is loose
(more) or held (fewer).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import pair_rows, row_motions
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.pair_data import PairData, carrying_flanks
from flexgear.coupling.system import orthonormal_rigid
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName
from flexgear.model.stage_view import stage_key
from flexgear.structures.bodies import Body

ROUND_OFF = 1e-6  # of the largest compression, below which a row is not compressed
MOVES = 1e-6  # of the largest motion, below which a body counts as at rest
LIGHT = 1e-20  # of the largest mass or inertia of a train, below which one is none
MOST_KEYS = 3  # that a message lists

# directions of a node: rows, how messages call it, and the key of a spring against it
DIRECTIONS = {
    "radial": ((0, 1), "sideways", "radial_n_per_m"),
    "axial": ((2,), "along the axis", "axial_n_per_m"),
    "tilt": ((3, 4), "against tilting", "tilt_nm_per_rad"),
    "rotation": ((5,), "against turning", "torsion_nm_per_rad"),
}
# a sun's shaft hangs on its spline, planets on the carrier: asked for when what holds these stands
_LATER = {"shaft": 1, "planet": 2}
_BOLTS = {
    "radial_n_per_m": "stiffness_radial_n_per_m",
    "axial_n_per_m": "stiffness_axial_n_per_m",
    "tilt_nm_per_rad": "stiffness_axial_n_per_m",
    "torsion_nm_per_rad": "stiffness_tangential_n_per_m",
}


def require_masses(bodies: Sequence[Body], source: str, mass: Array) -> None:
    """Raise InputError for a body without inertia in a direction in which springs, gear meshes or
    ports act on it (eᵀ M e ≈ 0): its natural frequency would be infinite."""
    inertias: dict[str, list[tuple[float, Body, str]]] = {"mass": [], "inertia": []}
    for body, direction, rows in _places(bodies):
        for row in rows:
            at = np.flatnonzero(row)
            if at.size:  # a planar body has no axial motion
                kind = "mass" if direction in ("radial", "axial") else "inertia"
                inertia = float(row[at] @ mass[np.ix_(at, at)] @ row[at])
                inertias[kind].append((inertia, body, direction))
    for kind, every in inertias.items():
        largest = max((inertia for inertia, _, _ in every), default=0.0)
        for inertia, body, direction in every:
            if not inertia > LIGHT * largest:
                unit = "kg" if kind == "mass" else "kg m²"
                raise InputError(
                    source, _mass_key(body.name, direction),
                    f"leaves {_body_text(body.name)} {inertia:g} {unit} {DIRECTIONS[direction][1]}",
                    f"give what is there; the largest here has {largest:.3g} {unit}",
                )  # fmt: skip


def _mass_key(name: BodyName, direction: str) -> str:
    """Key of a body's mass or inertia in a direction."""
    stage, part = name.stage, name.part
    key = {"rotation": "inertia_kg_m2", "tilt": "tilt_inertia_kg_m2"}.get(direction, "mass_kg")
    if part == "output":  # behind a sun's shaft
        return f"{key} of the port at {stage}.sun"
    if part == "housing":
        return f"housing.{key}"
    return stage_key(stage, f"{'ring.hub' if part == 'hub' else part}.{key}")


def holding_rows(pairs: PairData, blocks: Array, angles: int, more: Sequence[Array] = ()) -> Array:
    """Rows (n, d) of the gear meshes at θ = 0, and of ``more``, which constrain the bodies beside
    constant springs."""
    rows = pair_rows(pairs)
    n, _ = build_rows(pairs, rows, np.zeros(angles), carrying_flanks(pairs))
    return np.array([*row_motions(rows, n, blocks)[rows.row["kind"][:n] >= 0], *more])


def free_motions(rigid: Array, contact: Array) -> Array:
    """Motions (d, k) among ``rigid`` (d, r) that compress no row of ``contact`` (n, d)."""
    # each row against what its terms could add up to, so that round-off stays small; where soft
    # springs stand beside stiff ones the motions themselves carry some 1e-8 of it
    scale = (np.abs(contact) @ np.abs(rigid)).max(axis=1, keepdims=True, initial=0.0)
    scale = np.maximum(scale, 1e-3 * scale.max(initial=1e-300))
    return np.asarray(rigid @ linalg.null_space((contact @ rigid) / scale, rcond=ROUND_OFF))


def rolling_motions(
    bodies: Sequence[Body], source: str, rigid: Array, contact: Array, input_rows: Array
) -> Array:
    """Motions (d, F) in which no gear mesh is compressed, one radian of each input coordinate.

    rigid (d, r): motions without elastic force; contact (n, d): rows of the gear meshes; input_rows
    (F, d). InputError where the train is loose beyond its F rotations, or held.
    """
    rolled = free_motions(rigid, contact)
    if rolled.shape[1] > len(input_rows):
        raise loose_fault(bodies, source, rolled, len(input_rows))
    if rolled.shape[1] < len(input_rows):
        raise InputError(
            source, "held", "a support or joint holds a member that should turn",
            "take the stiffness about the axis out of it, or name the member in held",
        )  # fmt: skip
    turn = input_rows @ rolled
    if np.linalg.cond(turn) > 1e9:
        raise InputError(
            source, "inputs", "members whose speeds are given do not turn freely",
            "check their supports",
        )  # fmt: skip
    return np.asarray(rolled @ np.linalg.inv(turn))


def vibration_motions(mass: Array, rigid: Array, contact: Array) -> tuple[Array, Array]:
    """Motions (d, F) without resistance in free vibration, M-orthonormal, and the rows (F, d) that
    give their share of a motion. There are none where supports resist all rotations."""
    free = free_motions(rigid, contact)
    rolled = orthonormal_rigid(mass, free)
    return rolled, rolled.T @ mass


def loose_fault(bodies: Sequence[Body], source: str, free: Array, allowed: int) -> InputError:
    """InputError that names the bodies and directions in which springs would leave only ``allowed``
    free motions. free (d, k): all free motions. Springs are added one by one where they constrain
    most motions; at members before planets, and against rotation only where nothing else helps."""
    loose: list[tuple[Body, str]] = []
    places = _places(bodies)
    while free.shape[1] > allowed:
        stopped = [_rank(rows @ free, free) for _, _, rows in places]
        best = int(np.argmax(stopped))
        if stopped[best] == 0:
            break
        body, direction, rows = places[best]
        loose.append((body, direction))
        free = free @ linalg.null_space(rows @ free, rcond=MOVES)
    if not loose:
        return InputError(source, "held", "nothing holds a rotation", "name a member in held")
    motions_of: dict[str, dict[str, None]] = {}
    for body, direction in loose:
        motions_of.setdefault(_body_text(body.name), {})[DIRECTIONS[direction][1]] = None
    keys = list(dict.fromkeys(_holder(bodies, body.name, direction) for body, direction in loose))
    more = f" and at {_and(keys[1:])}" if 1 < len(keys) <= MOST_KEYS else ""
    more = ", likewise for the others" if len(keys) > MOST_KEYS else more
    tilts = all(body.name.part == "planet" and d == "tilt" for body, d in loose)
    other = 'gear_mesh.model = "face_load", whose slices do' if tilts else "hold them by a joint"
    remedy = f"give a stiffness there{more}, or {other}"
    if all(d in ("axial", "tilt") for _, d in loose) and all(_is_lumped(key) for key in keys):
        remedy += ', or take kinematics = "planar"'
    moving = _and([f"{name} {_and(list(ways))}" for name, ways in motions_of.items()])
    return InputError(source, keys[0], f"nothing holds {moving}", remedy)


def _is_lumped(key: str) -> bool:
    """Whether the key is that of a lumped member, whose kinematics can be chosen."""
    return "support." in key or "planet_bearing." in key


def _places(bodies: Sequence[Body]) -> list[tuple[Body, str, Array]]:
    """Possible springs: body, direction, rows (m, d); in the order of preference."""
    size = sum(body.size for body in bodies)
    ordered: dict[tuple[bool, int, int], tuple[Body, str, Array]] = {}
    start = 0
    for k, body in enumerate(bodies):
        for n, (direction, (rows, _, _)) in enumerate(DIRECTIONS.items()):
            planet = body.name.part == "planet"
            if planet and direction == "radial":
                rows = (0,)  # along its own tangential axis it rolls
            picked = np.zeros((len(rows), size))
            motion = body.rigid_motions.T if body.rigid else body.node_map
            picked[:, start : start + body.size] = motion[list(rows)]
            later, number = _LATER.get(body.name.part, 0), len(DIRECTIONS) * k + n
            ordered[direction == "rotation", later, number] = (body, direction, picked)
        start += body.size
    return [ordered[key] for key in sorted(ordered)]


def _rank(motions: Array, free: Array) -> int:
    """Number of free motions that a spring on rows would constrain: rank of rows @ free."""
    values = np.linalg.svd(motions, compute_uv=False)
    return int((values > MOVES * np.abs(free).max(initial=1e-300)).sum())


def _body_text(name: BodyName) -> str:
    """A body as messages call it: planets of a stage together."""
    if name.part != "planet":
        return name
    return f"planets of {name.stage}" if name.stage else "planets"


def _holder(bodies: Sequence[Body], name: BodyName, direction: str) -> str:
    """Key of the spring that would support a body."""
    stage, part, key = name.stage, name.part, DIRECTIONS[direction][2]
    of_train = {"housing": "housing.mount", "output": "output.bearing"}
    if BodyName.of(stage, "output") not in [body.name for body in bodies]:
        of_train["shaft"] = "joints"  # in series with its spline
    if part in of_train:
        return f"{of_train[part]}.{key}"
    holders = {"hub": "ring.hub.bearing", "planet": "planet_bearing", "shaft": "sun.shaft.spline"}
    body = next(b for b in bodies if b.name == name)
    if len(body.node_names) > 1:
        holders["carrier"] = "carrier.bearing_drive"
        if part == "ring":
            return stage_key(stage, _ring_key(body, key))
    return stage_key(stage, f"{holders.get(part, f'{part}.support')}.{key}")


def _ring_key(ring: Body, key: str) -> str:
    """Key of the supports of a flexible ring: its bolts, or bands where it has none."""
    kinds = {node.kind for node in ring.nodes}
    if "bolt" in kinds:
        return f"ring.fe.bolts.{_BOLTS[key]}"
    return f"ring.fe.{'splines' if 'spline' in kinds else 'fits'}.0.stiffness_{key}"


def _and(names: Sequence[str]) -> str:
    """ "a", "a and b", "a, b and c"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
