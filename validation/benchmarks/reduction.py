r"""Reduction against SciPy's default solver.

Plain way: one sparse LU (splu as SciPy ships it, COLAMD ordering) of the bordered matrix

    [K s B^T; s B 0] [x; lambda] = [g; s q],   s = mean of K's diagonal,

which gives constraint modes (g = 0, q = I) and, inside SciPy's Lanczos, fixed-interface modes
(q = 0).
"""

from statistics import median

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from benchmarks.record import Comparison, Report
from benchmarks.rings import dofs_text, fixed_frequencies, ring_model
from benchmarks.timing import interleaved
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.fem.ties import Interface
from flexgear.structures.linalg.dense import THREADS
from flexgear.structures.reduction import reduce

MODES = {"quick": 10, "full": 30}
REPEATS = {"quick": 1, "full": 2}


def run(report: Report, size: str) -> None:
    """The quick ring with all 120 interface nodes."""
    _, model, interface = ring_model("37k")
    count = MODES[size]
    candidates = {
        "own": lambda: own_reduction(model, interface, count),
        "plain": lambda: plain_reduction(model, interface, count),
    }
    seconds, answers = interleaved(candidates, REPEATS[size])
    text = f"ring, {dofs_text(model.dofs)}, {interface.size} interface dofs, {count} modes"
    names = {"plain": "splu and eigsh as SciPy ships them, bordered system"}
    for key, name in names.items():
        stiffness, frequencies = (
            np.abs(a - b).max() / np.abs(b).max()
            for a, b in zip(answers["own"], answers[key], strict=True)
        )
        report.add(
            Comparison(
                "Reduction to interface nodes and fixed-interface modes",
                name,
                text,
                seconds["own"],
                seconds[key],
                THREADS,
                check=f"interface stiffness agrees to {stiffness:.0e}, "
                f"frequencies to {frequencies:.0e}",
            )
        )
    report.say(
        "reduction of the quick ring (s, median)",
        ", ".join(f"{k} {median(v.wall):.1f}" for k, v in seconds.items()),
    )


def own_reduction(
    model: FeModel, interface: Interface, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Interface stiffness N/m and fixed-interface frequencies Hz by flexgear's general path."""
    reduction = reduce(model, interface, count)
    return reduction.condensation.stiffness, fixed_frequencies(reduction)


def plain_reduction(
    model: FeModel, interface: Interface, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """The same by SciPy alone, and the reduced mass matrix, which a reduction has to make too."""
    d, b = model.dofs, interface.size
    scale = float(model.stiffness.diagonal().mean())  # pivots of like size
    rows = scale * interface.rows
    factor = splu(sp.block_array([[model.stiffness, rows.T], [rows, None]]).tocsc())
    right = np.zeros((d + b, b))
    right[d:] = scale * np.eye(b)
    solution = factor.solve(right)
    psi, stiffness = solution[:d], -scale * solution[d:]

    def fixed(g: np.ndarray) -> np.ndarray:
        return factor.solve(np.concatenate([g, np.zeros(b)]))[:d]

    values, vectors = eigsh(
        model.stiffness,
        count,
        model.mass,
        sigma=0.0,
        OPinv=LinearOperator((d, d), matvec=fixed, dtype=float),
    )
    basis = np.hstack([psi, vectors])
    basis.T @ (model.mass @ basis)
    return stiffness, np.sqrt(np.sort(values)) / (2 * np.pi)
