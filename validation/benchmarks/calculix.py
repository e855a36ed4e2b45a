"""Frequencies of the same FE mesh by CalculiX: a cross-check, and its time beside ours."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from benchmarks.record import Comparison, Report
from benchmarks.rings import dofs_text, ring_fe_mesh_of_size
from benchmarks.timing import interleaved
from flexgear.structures.fe_mesh.fe_mesh import EDGES_VTK, FeMesh
from flexgear.structures.fe_mesh.inp import write_inp
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.linalg.dense import THREADS, single_threaded_blas
from flexgear.structures.linalg.sparse import Factor

MODES = {"quick": 8, "full": 24}
REPEATS = {"quick": 1, "full": 2}
HELD = "end_plus"  # the bolted face


def run(report: Report, size: str) -> None:
    """The quick ring clamped at its bolted face."""
    program = shutil.which("ccx")
    if program is None:
        report.skip("CalculiX", "ccx is not installed (Debian: apt-get install calculix-ccx)")
        return
    case, fe_mesh = ring_fe_mesh_of_size("37k")
    m, count = case.material, MODES[size]
    steel = (m.young_modulus, m.poisson_ratio, m.density)
    with tempfile.TemporaryDirectory() as folder, single_threaded_blas():
        deck = Path(folder) / "ring.inp"
        write_deck(fe_mesh, deck, steel, count)
        seconds, answers = interleaved(
            {
                "own": lambda: frequencies(fe_mesh, steel, count),
                "ccx": lambda: calculix_frequencies(program, deck),
            },
            REPEATS[size],
        )
    error = np.abs(answers["own"] / answers["ccx"][:count] - 1).max()
    report.add(
        Comparison(
            "Frequencies of the clamped ring",
            "CalculiX, *FREQUENCY",
            f"ring, {dofs_text(fe_mesh.quadratic_dofs)}, {count} frequencies",
            seconds["own"],
            seconds["ccx"],
            THREADS,
            check=f"frequencies agree to {error:.0e}",
        )
    )


def frequencies(fe_mesh: FeMesh, steel: tuple[float, float, float], count: int) -> np.ndarray:
    """Lowest frequencies, Hz: assembly, one factorisation, ARPACK."""
    model = FeModel(fe_mesh, *steel)
    z = model.nodes[:, 2]
    free = z < z.max() - 1e-9
    dofs = np.repeat(free, 3)
    stiffness = model.stiffness[dofs][:, dofs].tocsr()
    mass = model.mass[dofs][:, dofs].tocsr()
    factor = Factor(stiffness)
    inverse = LinearOperator(mass.shape, lambda v: factor.solve(v.ravel()))
    values = eigsh(stiffness, count, mass, sigma=0.0, OPinv=inverse, return_eigenvectors=False)
    return np.sqrt(np.sort(values)) / (2 * np.pi)


def write_deck(fe_mesh: FeMesh, path: Path, steel: tuple[float, float, float], count: int) -> None:
    """flexgear's own deck with middle nodes added (C3D20), the material and a frequency step."""
    plain = path.with_suffix(".plain")
    with plain.open("w") as stream:
        write_inp(fe_mesh, stream)
    text = plain.read_text()
    head, rest = text.split("*ELEMENT", 1)
    sets = rest[rest.index("*SURFACE") :]
    points, cells = np.asarray(fe_mesh.points), fe_mesh.vtk_cells
    n = len(points)
    pairs = np.sort(cells[:, np.array(EDGES_VTK["hex"])], axis=2)
    edges, number = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    middle = points[edges].mean(axis=1)
    # VTK, Abaqus and CalculiX alike: edges of the bottom, of the top, then the upright ones
    nodes = np.hstack([cells, n + number.reshape(len(cells), 12)]) + 1
    held = np.flatnonzero(np.append(points, middle, axis=0)[:, 2] > points[:, 2].max() - 1e-9) + 1
    with path.open("w") as out:
        out.write(head)
        for i, (x, y, z) in enumerate(middle.tolist(), n + 1):
            out.write(f"{i}, {x:.13e}, {y:.13e}, {z:.13e}\n")
        out.write("*ELEMENT, TYPE=C3D20, ELSET=EALL\n")
        for i, row in enumerate(nodes.tolist(), 1):
            words = list(map(str, [i, *row]))
            out.write(", ".join(words[:11]) + ",\n" + ", ".join(words[11:]) + "\n")
        out.write(sets)
        out.write("*NSET, NSET=HELD\n" + ",\n".join(map(str, held)) + "\n")
        young, poisson, density = steel
        out.write(f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{young!r}, {poisson!r}\n")
        out.write(f"*DENSITY\n{density!r}\n*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n")
        out.write(f"*BOUNDARY\nHELD, 1, 3\n*STEP\n*FREQUENCY\n{count}\n*END STEP\n")


def calculix_frequencies(program: str, deck: Path) -> np.ndarray:
    """Frequencies, Hz, of a deck."""
    done = subprocess.run(
        [program, deck.stem],
        cwd=deck.parent,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "OMP_NUM_THREADS": str(THREADS)},
    )
    if "Job finished" not in done.stdout:
        raise ArithmeticError(f"CalculiX failed: {done.stdout[-500:]}")
    omegas = []
    text = deck.with_suffix(".dat").read_text().split("P A R T I C I P A T I O N")[0]
    for line in text.splitlines():
        words = line.split()
        if len(words) == 5 and words[0].isdigit():
            omegas.append(float(words[2]))
    return np.array(omegas) / (2 * np.pi)
