"""Influence between slices of contact lines on a tooth, from the compliance of its flank.

A slice spreads its load evenly along its piece of the contact line: b_i (n,) are the means over
the piece of the FE shape functions at the flank's nodes, and the mean displacement there is
b_i^T u. So

    C_ij = b_i^T D b_j        displacement of slice i along the normal per force on slice j, m/N

for any contact line, oblique ones too, without a table by position: it is symmetric and never
indefinite wherever slices lie, and between nodes it is the FE solution itself, not a guess.
(Interpolating C between tabulated contact lines would need a table for every slope and every set of
slices; interpolating a table over two points of the flank would be neither symmetric nor definite.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.gears.hertz import ContactBody
from flexgear.structures.tooth_influence.flank import coarse_rows

Array = NDArray[np.float64]

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # of a slice's piece within a layer
_TOGETHER = 200  # contact lines at a time


@dataclass(frozen=True, eq=False)
class ToothInfluence:
    """Compliance of one flank of a tooth, without the dip of line contact.

    roll: (p + 1,) rows of FE nodes by √(r² − r_b²), the place on the line of action from the gear's
    own base tangent point, m, equally spaced in roll²; z: (q + 1,) layer borders along the face,
    equally spaced, m; depth: (p + 1,) at which the dip is cut off, m; own: D (n, n) m/N, nodes by
    row and layer border, then middles between rows, then between layer borders; neighbour: (2, m,
    m) m/N, from first, middle and last row to the same of the next tooth in +θ and of the one after
    that, None where neighbours are not counted; slope: d roll/dz of contact lines on this flank (±
    tan β_b); young Pa, poisson.

    As made it is the −θ flank of a tooth with the gear's hand of helix. The slope tells flank and
    hand apart as far as ``own`` depends on them.
    """

    roll: Array
    z: Array
    depth: Array
    own: Array
    neighbour: Array | None
    slope: float
    young: float
    poisson: float

    def matrix(self, roll: Array, z: Array, width: Array) -> Array:
        """C (…, K, K) m/N of slices: roll, z of their middles and axial width (…, K) m.

        Symmetric; positive definite while there are fewer slices than nodes along the face.
        Slices beyond the flank's ends act at its ends.
        """
        shape = np.broadcast_shapes(np.shape(roll), np.shape(z), np.shape(width))
        k, n = shape[-1], len(self.own)
        lines = (np.broadcast_to(a, shape).reshape(-1, k) for a in (roll, z, width))
        roll, z, width = (np.ascontiguousarray(a, dtype=float) for a in lines)
        out = np.empty((len(roll), k, k))
        for start in range(0, len(roll), _TOGETHER):
            some = slice(start, start + _TOGETHER)
            means = self.averages(roll[some].ravel(), z[some].ravel(), width[some].ravel())
            motion = (means @ self.own).reshape(-1, k, n)
            c = motion @ means.toarray().reshape(-1, k, n).swapaxes(1, 2)
            out[some] = 0.5 * (c + c.swapaxes(1, 2))
        return out.reshape(*shape, k)

    def coupling(
        self,
        slices: tuple[Array, Array, Array],
        beside: tuple[Array, Array, Array],
        apart: int = 1,
    ) -> Array:
        """C (…, K, K') m/N: displacement of slices on a tooth per force on slices of the next one
        in +θ, or the one after that (apart 2); each (roll, z, width), (…, K) m. ValueError where
        neighbours are not counted."""
        if self.neighbour is None:
            raise ValueError("neighbouring teeth of this body couple through its own FE model")
        shape, other = np.shape(slices[0]), np.shape(beside[0])[-1]
        one, two = (self._coarse_averages(*(np.ravel(a) for a in s)) for s in (slices, beside))
        between = self.neighbour[apart - 1]
        motion = (one @ between).reshape(-1, shape[-1], len(between))
        means = two.toarray().reshape(-1, other, len(between))
        return np.asarray(motion @ means.swapaxes(1, 2)).reshape(*shape, other)

    def contact_body(self, roll: Array) -> ContactBody:
        """The layer whose line contact belongs to ``matrix``, at places (K,) on the flank."""
        order = np.argsort(self.roll)
        depth = np.interp(roll, self.roll[order], self.depth[order])
        return ContactBody(self.young, self.poisson, depth, "layer")

    def turned(self) -> ToothInfluence:
        """The +θ flank: half a turn about the tooth's radial axis, z -> −z, +θ <-> −θ."""
        near = self.neighbour
        neighbour = None if near is None else self._flipped_coarse(near.swapaxes(1, 2))
        flipped = self._flipped(self.own)
        return replace(self, own=flipped, neighbour=neighbour, slope=-self.slope)

    def mirrored(self) -> ToothInfluence:
        """The same flank with the other hand of helix: z -> −z."""
        neighbour = None if self.neighbour is None else self._flipped_coarse(self.neighbour)
        flipped = self._flipped(self.own)
        return replace(self, own=flipped, neighbour=neighbour, slope=-self.slope)

    def averages(self, roll: Array, z: Array, width: Array) -> sp.csr_matrix:
        """Rows b_i (K, n): means over slices of the shape functions of the flank's nodes."""
        rows, columns = len(self.roll), len(self.z)
        row, x, column, y, weights = self._places(roll, z, width)
        corner = row * columns + column
        between_rows = rows * columns + row * columns + column
        between_layers = (2 * rows - 1) * columns + row * (columns - 1) + column
        nodes = [corner, corner + columns, corner + columns + 1, corner + 1]
        nodes += [between_rows, between_rows + 1]
        nodes += [between_layers, between_layers + columns - 1]
        return _means(np.stack(nodes), weights * _serendipity(x, y), len(self.own))

    def _coarse_averages(self, roll: Array, z: Array, width: Array) -> sp.csr_matrix:
        """The same on first, middle and last row (parabola in roll²), linear along the face."""
        columns = len(self.z)
        row, x, column, y, weights = self._places(roll, z, width)
        at, last = row + 0.5 * (1 + x), len(self.roll) - 1
        middle = coarse_rows(len(self.roll))[1]
        along = [
            (at - middle) * (at - last) / (middle * last),
            at * (last - at) / (middle * (last - middle)),
            at * (at - middle) / (last * (last - middle)),
        ]
        shape = [a * share for a in along for share in (0.5 * (1 - y), 0.5 * (1 + y))]
        nodes = [k * columns + column + step for k in range(3) for step in (0, 1)]
        return _means(np.stack(nodes), weights * np.stack(shape), 3 * columns)

    def _places(self, roll: Array, z: Array, width: Array) -> tuple[Array, ...]:
        """Points (K, p) of slices, cut at layer borders: element row and place in it, −1 … 1,
        element column and place in it, weight (a slice's sum to 1)."""
        roll, z, half = (np.asarray(a, dtype=float) for a in (roll, z, 0.5 * np.asarray(width)))
        step, count = self.z[1] - self.z[0], len(self.z) - 1
        first = np.clip(np.floor((z - half - self.z[0]) / step + 1e-9), 0, count - 1)
        pieces = int(np.ceil(2 * half.max() / step - 1e-9)) + 1
        borders = self.z[0] + step * (first[:, None] + np.arange(pieces + 1))
        borders[:, 0], borders[:, -1] = -np.inf, np.inf  # beyond the face's ends, too
        cut = np.clip(borders, (z - half)[:, None], (z + half)[:, None])
        middle, reach = 0.5 * (cut[:, 1:] + cut[:, :-1]), 0.5 * np.diff(cut, axis=1)
        at = (middle[..., None] + reach[..., None] * _POINTS).reshape(len(z), -1)
        weights = (0.5 * reach / half[:, None])[..., None] * _WEIGHTS
        place = np.maximum(roll[:, None] + self.slope * (at - z[:, None]), 0.0)
        top, bottom = self.roll[0] ** 2, self.roll[-1] ** 2
        row, x = _element((place**2 - top) / (bottom - top), len(self.roll) - 1)
        column, y = _element((at - self.z[0]) / (step * count), count)
        return row, x, column, y, weights.reshape(len(z), -1)

    def flipped_nodes(self) -> NDArray[np.int64]:
        """Number (n,) of the node where z -> −z takes each node of the flank."""
        rows, columns = len(self.roll), len(self.z)
        counts = ((rows, columns), (rows - 1, columns), (rows, columns - 1))
        start, order = 0, []
        for shape in counts:
            size = shape[0] * shape[1]
            order.append(start + np.arange(size).reshape(shape)[:, ::-1].ravel())
            start += size
        return np.concatenate(order)

    def _flipped(self, matrix: Array) -> Array:
        at = self.flipped_nodes()
        return matrix[np.ix_(at, at)] if matrix.size else matrix

    def _flipped_coarse(self, blocks: Array) -> Array:
        at = np.arange(blocks.shape[1]).reshape(3, -1)[:, ::-1].ravel()
        return blocks[:, at[:, None], at]


def _element(share: Array, count: int) -> tuple[Array, Array]:
    """Element and place in it, −1 … 1, of shares 0 … 1 of so many equal ones, held inside."""
    at = np.clip(share, 0.0, 1.0) * count
    number = np.minimum(at.astype(np.int64), count - 1)
    return number, 2 * (at - number) - 1


def _serendipity(x: Array, y: Array) -> Array:
    """Shape functions (8, …) of the corners (−,−), (+,−), (+,+), (−,+), of the middles of the sides
    y = ∓1, and of those of x = ∓1."""
    corners = [
        0.25 * (1 + a * x) * (1 + b * y) * (a * x + b * y - 1)
        for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    sides = [0.5 * (1 - x**2) * (1 + b * y) for b in (-1, 1)]
    return np.stack([*corners, *sides, *(0.5 * (1 - y**2) * (1 + a * x) for a in (-1, 1))])


def _means(nodes: NDArray[np.int64], shape: Array, count: int) -> sp.csr_matrix:
    """Means (K, count) over the points of slices; nodes, weighted shape: (functions, K, points)."""
    slices = np.broadcast_to(np.arange(nodes.shape[1])[:, None], nodes.shape)
    entries = (shape.ravel(), (slices.ravel(), nodes.ravel()))
    return sp.csr_matrix(entries, shape=(nodes.shape[1], count))
