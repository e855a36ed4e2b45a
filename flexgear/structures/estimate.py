"""Errors of a reduced body against its FE model.

Static, under lines of load on tooth flanks and pressure on pin seats. Both models have the same
supports S at the interface nodes. Under a load f on the surface the interface of the full model
moves by

    (K_bb + S) q = Psi^T f            (exact: Schur complement of K + B^T S B),

that of the reduced model, whose load is the statically equivalent wrench w at the node of the
tooth (pin), by (K_bb + S) q_r = E w. With t the translation of the loaded node, the error of a load
case is |t - t_r| / |t|.

Shapes. Deformation of a gear's rim along the face within a tooth, beyond the rigid motion of its
node (``tooth_influence.rim``), adds dC to the influence C of the tooth between slices. The error of
a line load f without it is max |dC f| / max |C f| over the loaded slices, relative to the tooth's
deflection there. The flexibility of the supports does not depend on the distribution of load along
the face and is not part of C.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.linalg as sla

from flexgear.arrays import Array
from flexgear.structures.fe_mesh.fe_mesh import triangles
from flexgear.structures.fem.assembly import FeModel, Sample, facet_sample, point_sample
from flexgear.structures.linalg.dense import blocks
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.reduction import Reduction

_MARGIN = 0.08  # distance of a load line from the flank's border, over the flank's height
END_SHARE = 0.2  # of the face width under a load at one end; a shorter contact line carries little
AT_END = " end "  # part of the names of load cases at one end
_SLACK = 0.2  # reference coordinates by which flat triangles on a twisted flank may leave the cells


@dataclass(frozen=True, eq=False)
class ProbeLoad:
    """A load case: point forces (m, 3) N at the points of a sample, and the node that carries them
    in the reduced body."""

    node: str
    case: str
    sample: Sample = field(repr=False)
    forces: Array = field(repr=False)

    def wrench(self, position: Array) -> Array:
        """Statically equivalent force and moment (6,) N, N m at a position (3,) m."""
        moment = np.cross(self.sample.points - position, self.forces).sum(axis=0)
        return np.concatenate([self.forces.sum(axis=0), moment])


def tooth_lines(
    model: FeModel, teeth: Iterable[int], face_width: float, outward: float
) -> list[ProbeLoad]:
    """Unit loads along the normals of flanks, on lines at tip, pitch and root height, over the
    whole face and at either end.

    teeth: 0-based; outward: +1 where the tip is the flank's largest radius, −1 on a ring.
    """
    loads = []
    half = 0.5 * face_width
    x, w = np.polynomial.legendre.leggauss(10)
    spans = {
        "": (-half, half),
        f"{AT_END}-z": (-half, -half + END_SHARE * face_width),
        f"{AT_END}+z": (half - END_SHARE * face_width, half),
    }
    for tooth in teeth:
        flank = _Flank(model, f"tooth_flank_{tooth + 1:03d}")
        tip, root = flank.radii if outward < 0 else flank.radii[::-1]
        margin = _MARGIN * (root - tip)
        heights = {"tip": tip + margin, "pitch": 0.5 * (tip + root), "root": root - margin}
        lines = {
            height + end: flank.at(radius, 0.5 * (a + b) + 0.5 * (b - a) * x)
            for height, radius in heights.items()
            for end, (a, b) in spans.items()
        }
        points = np.concatenate([at for at, _ in lines.values()])
        sample = point_sample(model, points, np.tile(0.5 * w, len(lines)), slack=_SLACK)
        for k, (case, (_, normals)) in enumerate(lines.items()):
            forces = np.zeros_like(points)
            forces[k * len(x) : (k + 1) * len(x)] = -0.5 * w[:, None] * normals
            loads.append(ProbeLoad(f"tooth_{tooth + 1:03d}", case, sample, forces))
    return loads


def pin_pressures(model: FeModel, pins: int, angles: Array) -> list[ProbeLoad]:
    """Unit loads by cosine pressure on pin seats, radially and tangentially about the carrier's
    axis: on the whole seat and on its halves.

    angles: of the pins (N,), rad.
    """
    loads = []
    for pin in range(pins):
        name = f"pin_{pin + 1}"
        seat = facet_sample(model, model.fe_mesh.facets[name])
        axis = seat.weights @ seat.points / seat.weights.sum()
        normal = seat.points - axis
        normal[:, 2] = 0.0
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        c, s = np.cos(angles[pin]), np.sin(angles[pin])
        for label, direction in {
            "radial": np.array([c, s, 0.0]),
            "tangential": np.array([-s, c, 0.0]),
        }.items():
            pressure = seat.weights * np.maximum(0.0, -normal @ direction)
            z = seat.points[:, 2] - axis[2]
            for end, part in {"": z < np.inf, " half -z": z < 0, " half +z": z > 0}.items():
                forces = -(pressure * part)[:, None] * normal
                total = np.linalg.norm(forces.sum(axis=0))
                loads.append(ProbeLoad(name, label + end, seat, forces / total))
    return loads


class _Flank:
    """A flank as triangles, which are also described by (radius, z) of their corners."""

    def __init__(self, model: FeModel, patch: str) -> None:
        facets = triangles(model.fe_mesh.facets[patch])
        self.corners = np.asarray(model.fe_mesh.points)[facets]  # (k, 3, 3)
        radius = np.hypot(self.corners[..., 0], self.corners[..., 1])
        self.flat = np.stack([radius, self.corners[..., 2]], axis=-1)  # (k, 3, 2)
        self.radii = (float(radius.min()), float(radius.max()))
        normal = np.cross(
            self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]
        )
        self.normal = normal / np.linalg.norm(normal, axis=1)[:, None]

    def at(self, radius: float, z: Array) -> tuple[Array, Array]:
        """Points (m, 3) at one radius and positions z (m,), with unit normals (m, 3)."""
        target = np.column_stack([np.full(len(z), radius), z])
        edges = np.stack([self.flat[:, 1] - self.flat[:, 0], self.flat[:, 2] - self.flat[:, 0]], -1)
        away = target[:, None] - self.flat[None, :, 0]  # (m, k, 2)
        local = np.einsum("kij,mkj->mki", np.linalg.inv(edges), away)
        weight = np.concatenate([1 - local.sum(-1, keepdims=True), local], axis=-1)  # (m, k, 3)
        best = weight.min(axis=-1).argmax(axis=1)
        inside = np.clip(weight[np.arange(len(z)), best], 0.0, None)
        inside /= inside.sum(axis=1)[:, None]
        return np.einsum("mv,mvi->mi", inside, self.corners[best]), self.normal[best]


PROMISED = 0.02  # largest error without a warning, or without shapes of the teeth
_BLOCK = 32  # vectors of loads that are processed together
_FREE = 1e-12  # smallest eigenvalue of a stiffness with unit diagonal that leaves no motion free


def with_probe_loads(reduction: Reduction, loads: Sequence[ProbeLoad]) -> ReducedBody:
    """The reduced body with Psi^T f and E w of loads, from which ``static_errors`` follow for any
    supports."""
    condensation = reduction.condensation
    interface = condensation.interface
    probe_loads = np.zeros((2, interface.size, len(loads)))
    for block in blocks(len(loads), _BLOCK):
        nodal = [load.sample.load(load.forces) for load in loads[block]]
        probe_loads[0, :, block] = condensation.constraint_load(np.column_stack(nodal))
    for column, load in enumerate(loads):
        node = interface.node_names.index(load.node)
        probe_loads[1, 6 * node : 6 * node + 6, column] = load.wrench(interface.positions[node])
    cases = tuple((load.node, load.case) for load in loads)
    return reduction.body.with_(probe_cases=cases, probe_loads=probe_loads)


def is_held(stiffness: Array) -> bool:
    """Whether a stiffness (b, b) leaves no motion free."""
    diagonal = np.diag(stiffness)
    if not np.all(diagonal > 0.0):
        return False
    scale = 1 / np.sqrt(diagonal)
    lowest = sla.eigvalsh(stiffness * scale * scale[:, None], subset_by_index=(0, 0))
    return bool(lowest[0] >= _FREE)


def static_errors(body: ReducedBody, supports: Array) -> dict[str, float]:
    """Largest error of the loaded nodes' translations, by the name of the load case; supports
    (b, b) N/m. Empty where the supports leave the body free to move.
    """
    b, count = body.interface_dofs, len(body.probe_cases)
    stiffness = body.stiffness[:b, :b] + supports
    if not is_held(stiffness):
        return {}
    full, reduced = np.split(np.linalg.solve(stiffness, np.hstack([*body.probe_loads])), 2, axis=1)
    rows = np.array([body.node_slice(node).start for node, _ in body.probe_cases], dtype=int)
    at = rows + np.arange(3)[:, None], np.arange(count)
    error = np.linalg.norm(full[at] - reduced[at], axis=0) / np.linalg.norm(full[at], axis=0)
    worst: dict[str, float] = {}
    for (_, case), error_of_case in zip(body.probe_cases, error, strict=True):
        worst[case] = max(float(error_of_case), worst.get(case, 0.0))
    return worst


def largest_tooth_error(cases: Mapping[str, float], shapes: float | None = None) -> dict[str, Any]:
    """Entries of a gear's report as ``largest_error``, of the load cases over the whole face alone
    and, if given, of ``shapes``, the error at the ends of teeth without shapes along the face."""
    even = {case: error for case, error in cases.items() if AT_END not in case}
    if shapes is not None:
        even["end of the face, beside the tooth's own deflection"] = shapes
    return largest_error(even)


def largest_error(cases: Mapping[str, float]) -> dict[str, Any]:
    """Entries of a report: the largest static error and its load case; None without load cases."""
    load = max(cases, key=cases.__getitem__, default=None)
    return {"static_error": None if load is None else cases[load], "static_error_load": load}


def shape_errors(influence: Array, left_out: Array, loads: Array) -> Array:
    """Errors (n,) of loads f (n, K) without dC: max |dC f| / max |C f| over the loaded slices.
    influence: C, left_out: dC, both (K, K) m/N."""
    included, omitted = (np.abs(loads @ c.T) * (loads > 0.0) for c in (influence, left_out))
    return np.asarray(omitted.max(axis=1) / included.max(axis=1))
