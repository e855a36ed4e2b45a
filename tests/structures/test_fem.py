"""Stiffness and mass: equal to plain forms and to CalculiX, order of convergence, closed forms."""

import shutil
import subprocess

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp
from plain_meshes import TO_VTK, annulus, box, plain_matrices, rigid_modes, tetrahedra
from scipy.sparse.linalg import eigsh, spsolve
from scipy.spatial import cKDTree
from skfem import Basis
from skfem.models.poisson import mass

from flexgear.structures.fe_mesh.fe_mesh import EDGES_VTK
from flexgear.structures.fem.assembly import FeModel, point_sample

STEEL = (210e9, 0.3, 7850.0)


pytestmark = pytest.mark.usefixtures("one_thread")


MESHES = {
    "hex": annulus((12, 2, 2)),
    "tet": tetrahedra(annulus((10, 1, 1))),
    "warped": box((3, 2, 2), warp=lambda x: x + 0.03 * np.sin(7 * x[:, [1, 2, 0]])),
}


@pytest.mark.parametrize("name", MESHES)
def test_batched_matrices_equal_plain_forms(name):
    model = FeModel(MESHES[name], *STEEL)
    k, m = plain_matrices(MESHES[name], *STEEL)
    assert abs(model.stiffness - k).max() < 1e-12 * abs(k).max()
    assert abs(model.mass - m).max() < 1e-12 * abs(m).max()
    assert abs(model.stiffness - model.stiffness.T).max() == 0.0


@pytest.mark.parametrize("name", MESHES)
def test_free_body_has_exactly_six_rigid_modes(name):
    model = FeModel(MESHES[name], *STEEL)
    values = sla.eigh(model.stiffness.toarray(), model.mass.toarray(), eigvals_only=True)
    assert np.abs(values[:6]).max() < 1e-6 * values[6]
    force = model.stiffness @ rigid_modes(model)
    assert np.abs(force).max() < 1e-10 * abs(model.stiffness).max()


def test_mass_is_density_times_volume():
    model = FeModel(box((2, 2, 2), (1.0, 0.2, 0.3)), *STEEL)
    rigid = rigid_modes(model)
    inertia = rigid.T @ (model.mass @ rigid)
    assert inertia[0, 0] == pytest.approx(7850 * 0.06, rel=1e-12)
    assert inertia[5, 5] == pytest.approx(7850 * 0.06 * (1.0 + 0.04) / 3, rel=1e-12)


def lame(points, inner=0.75, outer=1.0, pressure=1e8):
    """Radial displacement A r + B / r of a thick cylinder under inner pressure, plane strain."""
    e, nu, _ = STEEL
    factor = pressure * inner**2 / (outer**2 - inner**2) * (1 + nu) / e
    r = np.hypot(points[:, 0], points[:, 1])
    u = factor * ((1 - 2 * nu) * r + outer**2 / r)
    return np.column_stack([u * points[:, 0] / r, u * points[:, 1] / r, 0 * r])


def clamped_solve(model, held, values):
    """u (n, 3) without volume load, given displacements (n, 3) at held nodes."""
    fixed = np.repeat(held, 3)
    u = np.where(held[:, None], values, 0.0).ravel()
    k = model.stiffness.tocsc()
    u[~fixed] = spsolve(k[~fixed][:, ~fixed], -k[~fixed][:, fixed] @ u[fixed])
    return u


@pytest.mark.parametrize("kind", ["hex", "tet"])
def test_element_converges_with_third_order_on_a_smooth_annulus(kind):
    # Lame's field has no volume load anywhere, so it is exact on the faceted ring as well: what
    # is measured is the element, not the facets
    rng = np.random.default_rng(5)
    a, r, z = (
        rng.uniform(0, 2 * np.pi, 200),
        rng.uniform(0.8, 0.94, 200),
        rng.uniform(-0.1, 0.1, 200),
    )
    points = np.column_stack([r * np.cos(a), r * np.sin(a), z])
    errors = []
    for n in (1, 2, 4):
        bricks = annulus((12 * n, n, n))
        mesh = bricks if kind == "hex" else tetrahedra(bricks)
        model = FeModel(mesh, *STEEL)
        outside = np.isin(np.arange(len(model.nodes)), model.basis.get_dofs().all())
        u = clamped_solve(model, outside, lame(model.nodes))
        at = point_sample(model, points, np.ones(200)).interpolation @ u.reshape(-1, 3)
        errors.append(np.sqrt(np.mean((at - lame(points)) ** 2)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] > 2.7, orders


@pytest.mark.parametrize("order", [2, 3, 4])
def test_thin_ring_bends_in_plane_as_the_closed_form_says(order):
    # omega^2 = n^2 (n^2 - 1)^2 / (n^2 + 1) E I / (rho A R^4)
    h, radius = 0.02, 1.0
    mesh = annulus((72, 1, 1), radius - h / 2, radius + h / 2, 0.02)
    model = FeModel(mesh, *STEEL)
    flat = np.abs(model.nodes[:, 2]) < 1e-12  # symmetric about z = 0: in-plane motion only
    keep = np.ones(model.dofs, dtype=bool)
    keep[3 * np.flatnonzero(flat) + 2] = False
    k, m = model.stiffness[keep][:, keep], model.mass[keep][:, keep]
    values = eigsh(k.tocsc(), k=16, M=m.tocsc(), sigma=-1e3, return_eigenvectors=False)
    n = order
    expected = n**2 * (n**2 - 1) ** 2 / (n**2 + 1) * 210e9 * h**2 / 12 / 7850 / radius**4
    assert np.min(np.abs(np.sqrt(np.abs(values)) / np.sqrt(expected) - 1)) < 5e-3


@pytest.mark.parametrize("name", ["hex", "tet"])
def test_frequencies_equal_those_of_calculix(name, tmp_path):
    program = shutil.which("ccx") or shutil.which("ccx_2.20")
    if program is None:
        pytest.skip("CalculiX (ccx) is not installed")
    mesh = MESHES[name]
    model = FeModel(mesh, *STEEL)
    held = model.nodes[:, 2] < model.nodes[:, 2].min() + 1e-9
    write_calculix(tmp_path / "job.inp", mesh, model, held)
    subprocess.run([program, "job"], cwd=tmp_path, check=True, capture_output=True)
    theirs = read_frequencies(tmp_path / "job.dat")
    free = np.repeat(~held, 3)
    k, m = model.stiffness[free][:, free], calculix_mass(model)[free][:, free]
    ours = np.sqrt(
        np.sort(eigsh(k.tocsc(), len(theirs), m.tocsc(), sigma=0, return_eigenvectors=False))
    )
    assert np.allclose(ours, theirs, rtol=1e-6)


def calculix_mass(model):
    """CalculiX integrates C3D20 as we do, but the mass of C3D10 at four points only."""
    if model.fe_mesh.kind == "hex":
        return model.mass
    basis = Basis(model.basis.mesh, model.basis.elem, intorder=2)
    return sp.kron(STEEL[2] * mass.assemble(basis), sp.identity(3)).tocsr()


def write_calculix(path, mesh, model, held):
    """Clamped at the held nodes, 12 frequencies; C3D20 or C3D10 with explicit middle nodes."""
    hexes = mesh.kind == "hex"
    corners = mesh.cells[:, TO_VTK] if hexes else mesh.cells
    middle = model.nodes[corners[:, np.array(EDGES_VTK[mesh.kind])]].mean(axis=2)
    cells = np.hstack([corners, cKDTree(model.nodes).query(middle)[1]]) + 1
    lines = ["*NODE, NSET=ALL"]
    lines += [
        f"{i + 1}, {x:.12e}, {y:.12e}, {z:.12e}" for i, (x, y, z) in enumerate(model.nodes.tolist())
    ]
    lines.append(f"*ELEMENT, TYPE={'C3D20' if hexes else 'C3D10'}, ELSET=BODY")
    for i, nodes in enumerate(cells.tolist()):
        text = [str(n) for n in [i + 1, *nodes]]
        lines += [", ".join(text[:11]) + ("," if len(text) > 11 else "")]
        lines += [", ".join(text[11:])] if len(text) > 11 else []
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210e9, 0.3", "*DENSITY", "7850"]
    lines += ["*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL", "*BOUNDARY"]
    lines += [f"{n + 1}, 1, 3" for n in np.flatnonzero(held)]
    lines += ["*STEP", "*FREQUENCY", "12", "*END STEP"]
    path.write_text("\n".join(lines) + "\n")


def read_frequencies(path):
    """rad/s from the first table of the .dat file."""
    rows = []
    for line in path.read_text().split("P A R T I C I P A T I O N")[0].splitlines():
        words = line.split()
        if len(words) == 5 and words[0].isdigit():
            rows.append(float(words[2]))
    return np.array(rows)
