"""Loads that error estimates put on a body: lines on tooth flanks, pressure on pin seats."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexgear.structures.fem import FeModel, Sample, facet_sample, point_sample

_MARGIN = 0.08  # of the flank's height kept between a load line and the flank's border
END_SHARE = 0.2  # of the face width under a load at one end; a shorter contact line carries little
AT_END = " end "  # in the names of these
_SLACK = 0.2  # flat triangles on a twisted flank leave the cells by this much at most


@dataclass(frozen=True, eq=False)
class ProbeLoad:
    """Point forces (m, 3) N at a sample's points, meant for one interface node."""

    node: str
    case: str
    sample: Sample = field(repr=False)
    forces: NDArray[np.float64] = field(repr=False)

    def wrench(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Statically equivalent force and moment (6,) at a position."""
        moment = np.cross(self.sample.points - position, self.forces).sum(axis=0)
        return np.concatenate([self.forces.sum(axis=0), moment])


def tooth_lines(
    model: FeModel, teeth: Iterable[int], face_width: float, outward: float
) -> list[ProbeLoad]:
    """Unit normal loads on flanks: at tip, pitch and root height, over the face and at its ends.

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
        for height, radius in heights.items():
            for end, (a, b) in spans.items():
                z = 0.5 * (a + b) + 0.5 * (b - a) * x
                points, normals = flank.at(radius, z)
                sample = point_sample(model, points, 0.5 * w, slack=_SLACK)
                forces = -0.5 * w[:, None] * normals
                loads.append(ProbeLoad(f"tooth_{tooth + 1:03d}", height + end, sample, forces))
    return loads


def pin_pressures(model: FeModel, pins: int, angles: NDArray[np.float64]) -> list[ProbeLoad]:
    """Cosine pressure on pin seats, along x and y of the planet: whole seat and its halves."""
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
    """A flank as flat triangles over (radius, z)."""

    def __init__(self, model: FeModel, patch: str) -> None:
        facets = np.asarray(model.fe_mesh.facets[patch])
        if facets.shape[1] == 4:
            facets = np.concatenate([facets[:, [0, 1, 2]], facets[:, [0, 2, 3]]])
        self.corners = np.asarray(model.fe_mesh.points)[facets]  # (k, 3, 3)
        radius = np.hypot(self.corners[..., 0], self.corners[..., 1])
        self.flat = np.stack([radius, self.corners[..., 2]], axis=-1)  # (k, 3, 2)
        self.radii = (float(radius.min()), float(radius.max()))
        normal = np.cross(
            self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]
        )
        self.normal = normal / np.linalg.norm(normal, axis=1)[:, None]

    def at(
        self, radius: float, z: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
