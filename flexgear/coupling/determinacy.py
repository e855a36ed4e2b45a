"""Determinacy of a coupled train: supports, joints and gear meshes leave only its rotations free.

Free motions q deform neither constant springs nor gear meshes: K q = 0, V q = 0. There must be as
many as the train has independent rotations; with more some body has no support, with fewer a
support prevents rotation.
"""

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

ROUND_OFF = 1e-6  # compression of a row over the largest that counts as zero
LEAST_MOTION = 1e-6  # motion of a body over the largest; less counts as zero
LEAST_INERTIA = 1e-20  # mass or inertia over the largest of a train; less counts as zero
MOST_KEYS = 3  # that a message lists

# by direction: components of the motion of a node, text of messages, key of a spring
DIRECTIONS = {
    "radial": ((0, 1), "sideways", "radial_n_per_m"),
    "axial": ((2,), "along the axis", "axial_n_per_m"),
    "tilt": ((3, 4), "against tilting", "tilt_nm_per_rad"),
    "rotation": ((5,), "against turning", "torsion_nm_per_rad"),
}
# the housing's springs are proposed first, those of bodies on other members after the others
_LATER = {"housing": -1, "shaft": 1, "planet": 2}
_BOLTS = {
    "radial_n_per_m": "stiffness_radial_n_per_m",
    "axial_n_per_m": "stiffness_axial_n_per_m",
    "tilt_nm_per_rad": "stiffness_axial_n_per_m",
    "torsion_nm_per_rad": "stiffness_tangential_n_per_m",
}


def require_masses(bodies: Sequence[Body], source: str, mass: Array) -> None:
    """Raises InputError for a body without inertia in any direction e (eᵀ M e ≈ 0), whose natural
    frequency would be infinite. mass: of all bodies (d, d); source: of the case, for messages."""
    inertias: dict[str, list[tuple[float, Body, str]]] = {"mass": [], "inertia": []}
    for body, direction, rows in _possible_springs(bodies):
        for row in rows:
            at = np.flatnonzero(row)
            if at.size:  # a planar body has no axial motion
                kind = "mass" if direction in ("radial", "axial") else "inertia"
                inertia = float(row[at] @ mass[np.ix_(at, at)] @ row[at])
                inertias[kind].append((inertia, body, direction))
    for kind, entries in inertias.items():
        largest = max((inertia for inertia, _, _ in entries), default=0.0)
        for inertia, body, direction in entries:
            if not inertia > LEAST_INERTIA * largest:
                unit = "kg" if kind == "mass" else "kg m²"
                raise InputError(
                    source, _mass_key(body.name, direction),
                    f"leaves {_body_text(body.name)} {inertia:g} {unit} {DIRECTIONS[direction][1]}",
                    f"give its true value; the largest in the train is {largest:.3g} {unit}",
                )  # fmt: skip


def _mass_key(name: BodyName, direction: str) -> str:
    """Key of the case for the mass or inertia of a body in a direction."""
    stage, part = name.stage, name.part
    key = {"rotation": "inertia_kg_m2", "tilt": "tilt_inertia_kg_m2"}.get(direction, "mass_kg")
    if part == "output":  # behind a sun's shaft
        return f"{key} of the port at {stage}.sun"
    if part == "housing":
        return f"housing.{key}"
    return stage_key(stage, f"{'ring.hub' if part == 'hub' else part}.{key}")


def holding_rows(
    pairs: PairData, blocks: Array, angles: int, bearing_rows: Sequence[Array] = ()
) -> Array:
    """Rows (n, d) that constrain bodies in addition to constant springs: gear meshes of sound teeth
    at θ = 0, and rows (d,) of nonlinear bearings. angles: number of angles."""
    pairs = pairs.sound  # else nothing touches while a missing tooth is alone on the path
    rows = pair_rows(pairs)
    n, _ = build_rows(pairs, rows, np.zeros(angles), carrying_flanks(pairs))
    return np.array([*row_motions(rows, n, blocks)[rows.row["kind"][:n] >= 0], *bearing_rows])


def free_motions(rigid: Array, contact: Array) -> Array:
    """Motions (d, k) among ``rigid`` (d, r) that compress no row of ``contact`` (n, d)."""
    # rows are scaled by the sum of the sizes of their terms, so that round-off stays small; motions
    # themselves have relative errors of about 1e-8 if soft springs act beside stiff ones
    scale = (np.abs(contact) @ np.abs(rigid)).max(axis=1, keepdims=True, initial=0.0)
    scale = np.maximum(scale, 1e-3 * scale.max(initial=1e-300))
    return np.asarray(rigid @ linalg.null_space((contact @ rigid) / scale, rcond=ROUND_OFF))


def rolling_motions(
    bodies: Sequence[Body], source: str, rigid: Array, contact: Array, input_rows: Array
) -> Array:
    """Rolling motions (d, F), without compression of gear meshes, per radian of each rotation.

    rigid (d, r): motions without elastic force; contact (n, d): rows of ``holding_rows``;
    input_rows (F, d): rows of the independent rotations. Raises InputError if more or fewer motions
    are free.
    """
    free = free_motions(rigid, contact)
    if free.shape[1] > len(input_rows):
        raise loose_fault(bodies, source, free, len(input_rows))
    if free.shape[1] < len(input_rows):
        problem = "a support or joint holds a member that should turn"
        remedy = "take the stiffness about the axis out of it, or name the member in held"
        raise InputError(source, "held", problem, remedy)
    rotations = input_rows @ free
    if np.linalg.cond(rotations) > 1e9:
        problem = "members whose speeds are given do not turn freely"
        raise InputError(source, "inputs", problem, "check their supports")
    return np.asarray(free @ np.linalg.inv(rotations))


def vibration_motions(mass: Array, rigid: Array, contact: Array) -> tuple[Array, Array]:
    """Free motions (d, F) in free vibration, M-orthonormal, and rows (F, d) that give their
    coordinates; F = 0 if supports resist all rotations."""
    motions = orthonormal_rigid(mass, free_motions(rigid, contact))
    return motions, motions.T @ mass


def loose_fault(bodies: Sequence[Body], source: str, free: Array, allowed: int) -> InputError:
    """InputError that proposes springs which leave only ``allowed`` of the free motions (d, k).
    Springs are chosen one by one where they constrain most motions: at members before planets, and
    against rotation only if no other spring constrains a motion."""
    loose: list[tuple[Body, str]] = []
    springs = _possible_springs(bodies)
    while free.shape[1] > allowed:
        constrained = [_rank(rows @ free, free) for _, _, rows in springs]
        best = int(np.argmax(constrained))
        if constrained[best] == 0:
            break
        body, direction, rows = springs[best]
        loose.append((body, direction))
        free = free @ linalg.null_space(rows @ free, rcond=LEAST_MOTION)
    if not loose:
        return InputError(source, "held", "nothing holds a rotation", "name a member in held")
    motions: dict[str, dict[str, None]] = {}
    for body, direction in loose:
        motions.setdefault(_body_text(body.name), {})[DIRECTIONS[direction][1]] = None
    keys = list(dict.fromkeys(_spring_key(bodies, body.name, d) for body, d in loose))
    others = f" and at {_and(keys[1:])}" if 1 < len(keys) <= MOST_KEYS else ""
    others = ", likewise for the others" if len(keys) > MOST_KEYS else others
    tilts = all(body.name.part == "planet" and d == "tilt" for body, d in loose)
    alternative = ", or hold them by a joint"
    if all(body.name.part == "housing" for body, _ in loose):
        alternative = (
            "" if loose[0][0].rigid else ", or give the housing more nodes mount_1, mount_2 …"
        )
    elif tilts:
        alternative = ', or gear_mesh.model = "face_load", whose slices resist tilting'
    remedy = f"give a stiffness there{others}{alternative}"
    lumped = all("support." in key or "planet_bearing." in key for key in keys)
    if lumped and all(d in ("axial", "tilt") for _, d in loose):
        remedy += ', or give each of these members kinematics = "planar"'
    moving = _and([f"{name} {_and(list(directions))}" for name, directions in motions.items()])
    return InputError(source, keys[0], f"nothing holds {moving}", remedy)


def _possible_springs(bodies: Sequence[Body]) -> list[tuple[Body, str, Array]]:
    """Springs that could support bodies: body, direction, rows (m, d); in order of preference."""
    size = sum(body.size for body in bodies)
    ordered: dict[tuple[bool, int, int], tuple[Body, str, Array]] = {}
    start = 0
    for k, body in enumerate(bodies):
        for n, (direction, (rows, _, _)) in enumerate(DIRECTIONS.items()):
            planet = body.name.part == "planet"
            if planet and direction == "radial":
                rows = (0,)  # planets roll along their tangential axis
            spring_rows = np.zeros((len(rows), size))
            motion = body.rigid_motions.T if body.rigid else body.node_map
            spring_rows[:, start : start + body.size] = motion[list(rows)]
            later, number = _LATER.get(body.name.part, 0), len(DIRECTIONS) * k + n
            ordered[direction == "rotation", later, number] = (body, direction, spring_rows)
        start += body.size
    return [ordered[key] for key in sorted(ordered)]


def _rank(motions: Array, free: Array) -> int:
    """Number of free motions (d, k) that a spring would constrain: rank of ``motions`` (m, k), the
    motions of its rows."""
    values = np.linalg.svd(motions, compute_uv=False)
    return int((values > LEAST_MOTION * np.abs(free).max(initial=1e-300)).sum())


def _body_text(name: BodyName) -> str:
    """Name of a body in messages; one name for all planets of a stage."""
    if name.part != "planet":
        return name
    return f"planets of {name.stage}" if name.stage else "planets"


def _spring_key(bodies: Sequence[Body], name: BodyName, direction: str) -> str:
    """Key of the case for the spring that would support a body in a direction."""
    stage, part, key = name.stage, name.part, DIRECTIONS[direction][2]
    sections = {"housing": "housing.mount"}
    if part == "output":  # behind a sun's shaft
        return f"bearing.{key} of the port at {stage}.sun"
    if BodyName.of(stage, "output") not in [body.name for body in bodies]:
        sections["shaft"] = "joints"  # in series with its spline
    if part in sections:
        return f"{sections[part]}.{key}"
    holders = {"hub": "ring.hub.bearing", "planet": "planet_bearing", "shaft": "sun.shaft.spline"}
    body = next(b for b in bodies if b.name == name)
    if len(body.node_names) > 1:
        holders["carrier"] = "carrier.bearing_drive"
        if part == "ring":
            return stage_key(stage, _ring_key(body, key))
    return stage_key(stage, f"{holders.get(part, f'{part}.support')}.{key}")


def _ring_key(ring: Body, key: str) -> str:
    """Key of the supports of a flexible ring: its bolts, else its splines or fits."""
    kinds = {node.kind for node in ring.nodes}
    if "bolt" in kinds:
        return f"ring.fe.bolts.{_BOLTS[key]}"
    return f"ring.fe.{'splines' if 'spline' in kinds else 'fits'}.0.stiffness_{key}"


def _and(names: Sequence[str]) -> str:
    """Names joined as "a", "a and b", "a, b and c"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
