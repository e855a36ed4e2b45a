"""The coupled system: constant matrices, rigid motions, contact blocks and loads.

``mass`` and ``stiffness`` have all that does not depend on angles: bodies, bearings, bolts,
splines. Gear meshes and supports that are not invariant to rotation are rows of ``kernels.pairs``,
which act on the contact blocks.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.arrays import Array
from flexgear.coupling.gear_meshes import GearMeshLabel, StageFrame
from flexgear.coupling.laws.dampers import DAMPERS
from flexgear.coupling.machines import Brake, MachineLaw
from flexgear.coupling.pair_data import PairData
from flexgear.coupling.springs import LawBearing
from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName
from flexgear.structures.bodies import Body, rigid_rows


def variant_label(bodies: Iterable[BodyName], rigid: Collection[BodyName]) -> str:
    """Label of the flexible bodies of a system: "flexible", "rigid", or names of parts joined by +,
    by stage if stages differ; "lumped" without flexible bodies in the case."""
    stages: dict[str, dict[str, bool]] = {}
    for body in bodies:
        stages.setdefault(body.stage, {})[body.part] = body not in rigid
    labels = {}
    for stage, parts in stages.items():
        flexible = [part for part, is_flexible in parts.items() if is_flexible]
        labels[stage] = {0: "rigid", len(parts): "flexible"}.get(len(flexible), "+".join(flexible))
    if len(set(labels.values())) < 2:
        return next(iter(labels.values()), "lumped")
    return ", ".join(f"{stage}: {label}" for stage, label in labels.items())


@dataclass(frozen=True)
class Link:
    """Constant spring: force = matrix @ (rows @ q), 6 components.

    name: e.g. "stage.bolt_03"; rows: (6, d) relative motion in the axes of the link; matrix: (6, 6)
    N/m, N, N·m/rad; kind: "bolt", "fit" or "spline" of the supports of a ring, "planet_bearing", or
    "". A joint has (12, d) rows, the motions of both ends.
    """

    name: str
    rows: Array
    matrix: Array
    kind: str = ""


@dataclass(frozen=True)
class RotatingFrameSupport:
    """Spring between nodes in different rotating frames, with force K (R(θ) u − R(θ') u'). rows,
    housing: (6, d) motions of the two nodes, each in its frame; matrix: (6, 6) in fixed axes;
    angle, housing_angle: indices of the angles of their frames, −1 for fixed axes."""

    name: str
    rows: Array
    housing: Array
    matrix: Array
    angle: int = 0
    housing_angle: int = -1


@dataclass(frozen=True)
class Damping:
    """Damping of the system without gear meshes: 2ζω = 2 ratio ω + α + β ω²; ``ratios`` of the
    first elastic modes in place of ``ratio``."""

    ratio: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    ratios: tuple[float, ...] = ()

    def rate(self, omega: Array) -> Array:
        """Damping rates 2ζω (n,) of modes of ω (n,), rad/s, in any order; zero for rigid modes. The
        modes must include the lowest elastic ones."""
        elastic, ratio = omega > 0, np.full(len(omega), self.ratio)
        rising = np.argsort(np.where(elastic, omega, np.inf), kind="stable")
        first = rising[: min(len(self.ratios), int(elastic.sum()))]
        ratio[first] = self.ratios[: len(first)]
        return np.where(elastic, 2 * ratio * omega + self.alpha + self.beta * omega**2, 0.0)


@dataclass(frozen=True)
class Port:
    """Member with an external torque; row (d,) gives its rotation, rad. rated_torque: external
    torque at rated load, N·m; reaction: whether the torque follows from equilibrium with those of
    the other ports."""

    name: str
    row: Array
    rated_torque: float = 0.0
    reaction: bool = False


class BodyCoordinates:
    """Coordinates (d,) of bodies in the order of ``bodies``."""

    bodies: Sequence[Body]

    @property
    def size(self) -> int:
        """Number of coordinates d."""
        return sum(b.size for b in self.bodies)

    def slice_of(self, body: str) -> slice:
        """Slice of the coordinates of one body."""
        target = self.body(body)
        start = sum(b.size for b in takewhile(lambda b: b is not target, self.bodies))
        return slice(start, start + target.size)

    def body(self, name: str) -> Body:
        """Body of a name. Raises FlexgearError if there is none."""
        for b in self.bodies:
            if b.name == name:
                return b
        raise FlexgearError(f"there is no body {name!r} in the system")

    def body_of(self, member: str) -> Body:
        """Body of a member: the shaft of a sun if there is one, the left half of a ring in two."""
        name = BodyName.parse(member)
        names = [name, BodyName.of(name.stage, name.part, side="left")]
        if name.part == "sun":
            names.append(BodyName.of(name.stage, "shaft"))
        return next(b for one in names for b in self.bodies if b.name == one)

    def node_rows(self, body: str, node: str) -> Array:
        """Rows (6, d) of the motion of a node in the frame of its body."""
        rows = np.zeros((6, self.size))
        rows[:, self.slice_of(body)] = self.body(body).node(node)
        return rows


@dataclass(frozen=True)
class System(BodyCoordinates):
    """Coupled gear train in physical coordinates (d,).

    mass, stiffness: (d, d), constant part; rigid: (d, r) M-orthonormal motions without elastic
    force of the constant part; rolling: (d, F) motion per radian of each of the F independent
    rotations when the train rolls without deflection; input_rows: (F, d) rows of those rotations;
    angles: (A, d) rows of the angles on which gear meshes and rotating supports depend; blocks:
    (6 n_b, d) motion of the contact blocks; ports: inputs, then the output; machines: law at each
    port; input_speeds: rated, rad/s; gear_meshes: label of every gear mesh m; gyroscopic,
    centripetal: (d, d) at rated speed, for M q̈ + G q̇ + (K − C) q, or None; rigid_bodies: flexible
    bodies of the case that are modelled as rigid; variant: ``variant_label``; ring_frames: index of
    the angle of the frame of an FE ring by body, −1 for a fixed frame; support_names: name of the
    support or joint of each row of rotating supports.
    """

    variant: str
    rigid_bodies: frozenset[BodyName]
    bodies: tuple[Body, ...]
    mass: Array
    stiffness: Array
    rigid: Array
    rolling: Array
    input_rows: Array
    angles: Array
    blocks: Array
    ports: tuple[Port, ...]
    pairs: PairData
    gear_meshes: tuple[GearMeshLabel, ...]
    links: tuple[Link, ...]
    rotating_frame_supports: tuple[RotatingFrameSupport, ...]
    damping: Damping
    machines: tuple[MachineLaw, ...]
    rated_torque: float
    input_speeds: tuple[float, ...] = ()
    gyroscopic: Array | None = None
    centripetal: Array | None = None
    bearings: tuple[LawBearing, ...] = ()
    header: dict[str, float | str] = field(default_factory=dict)
    frames: dict[str, StageFrame] = field(default_factory=dict)
    ring_frames: dict[str, int] = field(default_factory=dict)
    support_names: tuple[str, ...] = ()

    @property
    def port_rows(self) -> Array:
        """Rows (P, d) of all ports."""
        return np.vstack([p.row for p in self.ports])

    @property
    def dampers(self) -> Array:
        """Damping matrix C (d, d) of dampers at bearings, supports, joints and ports at zero
        angles, and of brakes linearised at rated speed, N s/m, N m s/rad."""
        out = np.zeros_like(self.mass)
        for bearing in self.bearings:
            if bearing.law == DAMPERS.name:
                out += bearing.relative.T @ (bearing.parameters[:, None] * bearing.relative)
        for port, brake in zip(self.ports, self.machines, strict=True):
            if isinstance(brake, Brake) and brake.rated_speed > 0:
                slope = brake.exponent * brake.rated_torque / brake.rated_speed
                out += slope * np.outer(port.row, port.row)
        return out

    @property
    def torque_names(self) -> list[str]:
        """Names of the ports and springs whose torque a sensor may measure."""
        names = [port.name for port in self.ports] + [link.name for link in self.links]
        supports = [support.name for support in self.rotating_frame_supports]
        return list(dict.fromkeys(names + supports))

    @property
    def rated_port_torques(self) -> Array:
        """Rated external torques (P,) of the ports, N·m."""
        return np.array([p.rated_torque for p in self.ports])

    def proportional_torques(self, first: Array) -> Array:
        """External torques (k, P) with ``first`` (k,), N·m, on the first port and the others in
        rated proportion, or at rated value if the rated torque of the first port is zero."""
        share = first / self.rated_torque if self.rated_torque else np.ones_like(first)
        out: Array = np.outer(share, self.rated_port_torques)
        out[:, 0] = first
        return out

    @property
    def rated_input_speeds(self) -> Array:
        """Rated speeds (F,) of the independent rotations, rad/s."""
        return np.asarray(self.input_speeds, dtype=float)

    @property
    def rolling_rates(self) -> Array:
        """Velocities (6 n_b,) of the contact blocks when the train rolls at rated speed; zero in
        free vibration."""
        if not self.input_speeds:
            return np.zeros(len(self.blocks))
        return np.asarray(self.blocks @ (self.rolling @ self.rated_input_speeds))

    @property
    def reactions(self) -> NDArray[np.int64]:
        """Indices of the F ports whose torque follows from equilibrium."""
        return np.array([i for i, p in enumerate(self.ports) if p.reaction], dtype=np.int64)

    def theta(self, input_angles: Array) -> Array:
        """Angles (…, A) of the rolling train at independent rotations (…, F), rad."""
        return np.asarray(input_angles @ (self.angles @ self.rolling).T)

    def ring_turn(self, body: str) -> Array:
        """Row (d,) of the rotation of the frame of an FE ring, zero for other bodies."""
        at = self.ring_frames.get(body, -1)
        return np.asarray(self.angles[at]) if at >= 0 else np.zeros(self.size)

    def own_rows(self, body: str, node: str) -> Array:
        """Rows (6, d) of the motion of a node in the frame of its body, for an FE ring without the
        rotation of that frame."""
        spin = rigid_rows(self.body(body).position(node))[:, 5]
        return self.node_rows(body, node) - np.outer(spin, self.ring_turn(body))

    def with_(self, **changes: object) -> Self:
        """Copy with changed fields."""
        return replace(self, **changes)  # type: ignore[arg-type]


def orthonormal_rigid(mass: Array, motions: Array) -> Array:
    """M-orthonormal basis of motions (d, r), by Cholesky decomposition of their Gram matrix."""
    if not motions.shape[1]:
        return motions
    gram = motions.T @ mass @ motions
    lower = linalg.cholesky(gram, lower=True)
    return linalg.solve_triangular(lower, motions.T, lower=True).T


def without_rigid_forces(stiffness: Array, mass: Array, rigid: Array) -> Array:
    """Stiffness Pᵀ K P with P = I − Φ_r Φ_rᵀ M, under which rigid motions cause no force. It
    removes round-off of reductions, which would cause a spurious torque under large rotations.
    Raises FlexgearError if a spring resists a rigid motion by more than round-off."""
    force = np.abs(stiffness @ rigid).max(axis=0)
    allowed = 1e-6 * np.abs(stiffness).max() * np.abs(rigid).max(axis=0)
    if np.any(force > allowed):
        raise FlexgearError(
            "a spring resists the free rolling of the train (stiffness about the axis of rotation "
            "in a bearing or coupling); set it to zero"
        )
    left = mass @ rigid
    k = stiffness - left @ (rigid.T @ stiffness)
    k = k - (k @ rigid) @ left.T
    return 0.5 * (k + k.T)
