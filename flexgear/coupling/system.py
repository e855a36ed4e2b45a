"""The coupled system: constant matrices, rigid motions, contact blocks and loads.

Everything that does not change with the carrier angle is in ``mass`` and ``stiffness``: bodies,
bearings, bolts, spline. Gear meshes and supports that are not invariant to rotation are rows of
``kernels.pairs`` and enter every solve through the contact blocks.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.arrays import Array, Ints
from flexgear.coupling.gear_meshes import GearMeshLabel, StageFrame
from flexgear.coupling.laws.dampers import DAMPERS
from flexgear.coupling.machines import MachineLaw
from flexgear.coupling.pair_data import PairData
from flexgear.coupling.springs import LawBearing
from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName
from flexgear.structures.bodies import Body, rigid_rows


def variant_label(bodies: Iterable[BodyName], rigid: Collection[BodyName]) -> str:
    """Flexible bodies in words: "flexible", "rigid", or their parts joined by +, stage by stage
    where stages differ; "lumped" where there are none."""
    stages: dict[str, dict[str, bool]] = {}
    for body in bodies:
        stages.setdefault(body.stage, {})[body.part] = body not in rigid
    labels = {}
    for stage, parts in stages.items():
        flexible = [part for part, bends in parts.items() if bends]
        labels[stage] = {0: "rigid", len(parts): "flexible"}.get(len(flexible), "+".join(flexible))
    if len(set(labels.values())) < 2:
        return next(iter(labels.values()), "lumped")
    return ", ".join(f"{stage}: {label}" for stage, label in labels.items())


@dataclass(frozen=True)
class Link:
    """A constant spring between two node maps: force = matrix @ (rows @ q), 6 components.

    name: e.g. "stage.bolt_03"; rows: (6, d) relative motion in the link's axes; matrix: (6, 6) N/m,
    N, N·m/rad; kind: "bolt", "fit" or "spline" of a ring's supports, "planet_bearing", or "".
    """

    name: str
    rows: Array
    matrix: Array
    kind: str = ""


@dataclass(frozen=True)
class RotatingFrameSupport:
    """A spring between nodes whose frames turn against each other: force K (R(θ) u − R(θ') u').

    rows, housing: (6, d) motion of the node and of its partner, each in its own frame; matrix:
    (6, 6) in fixed axes; angle, housing_angle: which of the system's angles the frame of each has
    turned by, −1 for fixed axes.
    """

    name: str
    rows: Array
    housing: Array
    matrix: Array
    angle: int = 0
    housing_angle: int = -1


@dataclass(frozen=True)
class Damping:
    """Damping of the assembled system without gear meshes: 2ζω = 2·ratio·ω, or α + β ω²; ratios: of
    its first elastic modes, in place of ratio."""

    ratio: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    ratios: tuple[float, ...] = ()

    def rate(self, omega: Array) -> Array:
        """2ζω (n,) rad/s of modes of ω (n,) in any order, among them the lowest elastic ones; rigid
        modes are never damped."""
        elastic, ratio = omega > 0, np.full(len(omega), self.ratio)
        first = self.first_modes(omega)
        ratio[first] = self.ratios[: len(first)]
        return np.where(elastic, 2 * ratio * omega + self.alpha + self.beta * omega**2, 0.0)

    def first_modes(self, omega: Array) -> Ints:
        """Numbers, by rising ω (n,), of the elastic modes that ``ratios`` are of."""
        rising = np.argsort(np.where(omega > 0, omega, np.inf), kind="stable")
        return rising[: min(len(self.ratios), int(np.sum(omega > 0)))]


@dataclass(frozen=True)
class Port:
    """Where torque enters or leaves: row (d,) gives the rotation of the member, rad.

    rated_torque: N·m from outside on the member at rated load; reaction: it is not given but
    balances the others in an equilibrium.
    """

    name: str
    row: Array
    rated_torque: float = 0.0
    reaction: bool = False


class BodyCoordinates:
    """Coordinates (d,) of bodies, one behind the other."""

    bodies: Sequence[Body]

    @property
    def size(self) -> int:
        """Number of coordinates d."""
        return sum(b.size for b in self.bodies)

    def slice_of(self, body: str) -> slice:
        """Coordinates of one body."""
        target = self.body(body)
        start = sum(b.size for b in takewhile(lambda b: b is not target, self.bodies))
        return slice(start, start + target.size)

    def body(self, name: str) -> Body:
        """The body of this name."""
        for b in self.bodies:
            if b.name == name:
                return b
        raise FlexgearError(f"there is no body {name!r} in the system")

    def node_rows(self, body: str, node: str) -> Array:
        """Rows (6, d) that give the motion of one node in its body's frame."""
        rows = np.zeros((6, self.size))
        rows[:, self.slice_of(body)] = self.body(body).node(node)
        return rows


@dataclass(frozen=True)
class System(BodyCoordinates):
    """Coupled gear train in physical coordinates (d,).

    mass, stiffness: (d, d), constant part; rigid: (d, r) M-orthonormal motions that the constant
    part does not resist; rolling: (d, F) motion of all coordinates per radian of each of the F
    independent rotations when the train rolls without deflection; input_rows: (F, d) rows that give
    those rotations; angles: (A, d) rows that give the angles on which gear meshes and turning
    supports depend (stage angles, carriers); blocks: (6 n_b, d) motion of the contact blocks;
    ports: where torque acts, inputs before the output; machines: what hangs there; input_speeds:
    rated, rad/s; gear_meshes: label of every gear mesh m; gyroscopic, centripetal: (d, d) at rated
    speed, for M q̈ + G q̇ + (K − C) q, or None; rigid_bodies: those that do not bend of the bodies
    that may; variant: ``variant_label``; ring_frames: of FE rings by body which of the angles their
    frame has turned by, −1 where it stands; support_names: of the support or joint that each of the
    rows of turning supports belongs to.
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
        """C (d, d) N s/m, N m s/rad of the dampers at bearings, supports, joints and ports, before
        anything has turned."""
        out = np.zeros_like(self.mass)
        for bearing in self.bearings:
            if bearing.law == DAMPERS.name:
                out += bearing.relative.T @ (bearing.parameters[:, None] * bearing.relative)
        return out

    @property
    def rated_port_torques(self) -> Array:
        """Rated external torques (P,) of the ports, N·m."""
        return np.array([p.rated_torque for p in self.ports])

    def proportional_torques(self, first: Array) -> Array:
        """External torques (k, P) with ``first`` (k,) N·m on the first port, the others in rated
        proportion; as rated where the first one's is zero, as nothing scales them then."""
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
        """Rates (6 B,) of the contact blocks when the train rolls at rated speed; zero in free
        vibration, which has no speed."""
        if not self.input_speeds:
            return np.zeros(len(self.blocks))
        return np.asarray(self.blocks @ (self.rolling @ self.rated_input_speeds))

    @property
    def reactions(self) -> NDArray[np.int64]:
        """Numbers of the ports whose torque balances the others, as many as input_rows."""
        return np.array([i for i, p in enumerate(self.ports) if p.reaction], dtype=np.int64)

    def theta(self, input_angles: Array) -> Array:
        """Angles (…, A) of the rolling train at independent rotations (…, F), rad."""
        return np.asarray(input_angles @ (self.angles @ self.rolling).T)

    def ring_turn(self, body: str) -> Array:
        """Row (d,) of the rotation of an FE ring's frame, zero of any other body."""
        at = self.ring_frames.get(body, -1)
        return np.asarray(self.angles[at]) if at >= 0 else np.zeros(self.size)

    def own_rows(self, body: str, node: str) -> Array:
        """Motion (6, d) of a node in its body's frame, of an FE ring against that frame's turn."""
        spin = rigid_rows(self.body(body).position(node))[:, 5]
        return self.node_rows(body, node) - np.outer(spin, self.ring_turn(body))

    def with_(self, **changes: object) -> System:
        """A copy with the given fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]


def orthonormal_rigid(mass: Array, motions: Array) -> Array:
    """M-orthonormal basis of the given motions (d, r), by Cholesky of their Gram matrix."""
    if not motions.shape[1]:
        return motions
    gram = motions.T @ mass @ motions
    lower = linalg.cholesky(gram, lower=True)
    return linalg.solve_triangular(lower, motions.T, lower=True).T


def without_rigid_forces(stiffness: Array, mass: Array, rigid: Array) -> Array:
    """Pᵀ K P with P = I − Φ_r Φ_rᵀ M: rigid motion of any size makes no force at all.

    Round-off of a reduction would otherwise turn a large rotation into spurious torque. Only
    round-off is taken off: FlexgearError where a spring really resists a rigid motion.
    """
    resisted = np.abs(stiffness @ rigid).max(axis=0)
    allowed = 1e-6 * np.abs(stiffness).max() * np.abs(rigid).max(axis=0)
    if np.any(resisted > allowed):
        raise FlexgearError(
            "a spring resists the free rolling of the train (stiffness about the axis of rotation "
            "in a bearing or coupling); set it to zero"
        )
    left = mass @ rigid
    k = stiffness - left @ (rigid.T @ stiffness)
    k = k - (k @ rigid) @ left.T
    return 0.5 * (k + k.T)
