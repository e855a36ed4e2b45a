"""Small structured meshes the tests make themselves, and their matrices by plain scikit-fem."""

from dataclasses import dataclass, field

import numpy as np
from skfem import Basis, BilinearForm, ElementVector
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from flexgear.structures.bodies import rigid_motion
from flexgear.structures.fem.assembly import INTEGRATION_ORDER, scalar_basis

FROM_VTK = [6, 2, 5, 7, 1, 3, 4, 0]
TO_VTK = [7, 4, 1, 5, 6, 2, 0, 3]
SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))


@dataclass(frozen=True)
class PlainFeMesh:
    """The attributes of `fe_mesh.FeMesh` that assembly reads."""

    points: np.ndarray
    cells: np.ndarray
    kind: str = "hex"
    facets: dict[str, np.ndarray] = field(default_factory=dict)


def box(n=(4, 2, 2), size=(1.0, 0.2, 0.3), warp=None) -> PlainFeMesh:
    """A block of n hexahedra; `warp` maps points (m, 3) elsewhere."""
    axes = [np.linspace(0, s, k + 1) for s, k in zip(size, n, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([k + 1 for k in n])
    facets = {
        "x0": _quads(number[0]),
        "x1": _quads(number[-1]),
        "z0": _quads(number[:, :, 0]),
        "z1": _quads(number[:, :, -1]),
    }
    points = points if warp is None else warp(points)
    return PlainFeMesh(points, _bricks(number, SQUARE), "hex", facets)


def annulus(n=(24, 2, 2), inner=0.75, outer=1.0, width=0.3, teeth=0) -> PlainFeMesh:
    """A ring of n = (around, radial, axial) hexahedra about z, centred at z = 0.

    Patches: "inner", "outer", "end_minus", "end_plus"; with teeth = k the inner surface is cut
    into "patch_001"... of equal arcs (n[0] must be a multiple of k).
    """
    around, radial, axial = n
    angle = 2 * np.pi * np.arange(around) / around
    r = np.linspace(inner, outer, radial + 1)
    z = np.linspace(-width / 2, width / 2, axial + 1)
    a, r3, z3 = np.meshgrid(angle, r, z, indexing="ij")
    points = np.stack([r3 * np.cos(a), r3 * np.sin(a), z3], -1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(around, radial + 1, axial + 1)
    number = np.concatenate([number, number[:1]])
    facets = {
        "inner": _quads(number[:, 0]),
        "outer": _quads(number[:, -1]),
        "end_minus": _quads(number[:, :, 0]),
        "end_plus": _quads(number[:, :, -1]),
    }
    if teeth:
        strip = around // teeth
        for t in range(teeth):
            part = number[t * strip : (t + 1) * strip + 1, 0]
            facets[f"patch_{t + 1:03d}"] = _quads(part)
    turned = [place[::-1] for place in SQUARE]  # radius and angle are a left-handed pair
    return PlainFeMesh(points, _bricks(number, turned), "hex", facets)


def tetrahedra(fe_mesh: PlainFeMesh) -> PlainFeMesh:
    """The same body in tetrahedra: six to a hexahedron round the diagonal 0-6."""
    ring = [1, 2, 3, 7, 4, 5]
    parts = [[0, ring[i], ring[(i + 1) % 6], 6] for i in range(6)]
    cells = np.concatenate([fe_mesh.cells[:, TO_VTK][:, p] for p in parts])
    return PlainFeMesh(fe_mesh.points, cells, "tet", {})


def _bricks(number: np.ndarray, square) -> np.ndarray:
    """Hexahedra between nodes numbered (i, j, k); square: (i, j) of the corners, anticlockwise."""
    m, n, o = np.subtract(number.shape, 1)
    corners = [(*place, k) for k in (0, 1) for place in square]
    cells = [number[i : i + m, j : j + n, k : k + o].ravel() for i, j, k in corners]
    return np.stack(cells, -1)[:, FROM_VTK]


def _quads(number: np.ndarray) -> np.ndarray:
    return np.stack(
        [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1
    ).reshape(-1, 4)


def plain_matrices(fe_mesh, young_modulus, poisson_ratio, density):
    """Stiffness (N/m) and mass (kg) CSR by plain forms, slow and short; dofs of `assemble`."""
    scalar = scalar_basis(fe_mesh)
    basis = Basis(scalar.mesh, ElementVector(scalar.elem), intorder=INTEGRATION_ORDER)

    @BilinearForm
    def inertia(u, v, _):
        return density * dot(u, v)

    elasticity = linear_elasticity(*lame_parameters(young_modulus, poisson_ratio))
    return elasticity.assemble(basis).tocsr(), inertia.assemble(basis).tocsr()


def rigid_modes(model):
    """Rigid motion of a model's nodes (3n, 6) for unit ux, uy, uz, tx, ty, tz about the origin."""
    return rigid_motion(model.nodes).reshape(-1, 6)
