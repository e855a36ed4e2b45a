"""Assembly of stiffness and mass against plain scikit-fem forms on the same FE mesh."""

import numpy as np
import scipy.sparse as sp
from plain_meshes import plain_matrices

from benchmarks.record import Comparison, Curve, Report
from benchmarks.rings import dofs_text, ring_fe_mesh_of_size
from benchmarks.timing import interleaved
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.linalg.dense import single_threaded_blas

REPEATS = {"quick": {"37k": 1}, "full": {"37k": 2, "57k": 1, "314k": 1}}
LIMIT = 1e-12


def run(report: Report, size: str) -> None:
    """Both matrices by both ways; entries must agree to 1e-12 of the largest."""
    dofs, times, plain = [], [], []
    for name, repeats in REPEATS[size].items():
        case, fe_mesh = ring_fe_mesh_of_size(name)
        m = case.material
        steel = (m.young_modulus, m.poisson_ratio, m.density)

        def ours(fe_mesh=fe_mesh, steel=steel):
            model = FeModel(fe_mesh, *steel)
            return model.stiffness, model.mass

        def forms(fe_mesh=fe_mesh, steel=steel):
            return plain_matrices(fe_mesh, *steel)

        with single_threaded_blas():
            seconds, answers = interleaved({"own": ours, "plain": forms}, repeats)
        errors = [difference(a, b) for a, b in zip(answers["own"], answers["plain"], strict=True)]
        if max(errors) > LIMIT:
            raise AssertionError(f"assembly differs from plain forms by {max(errors):.1e}")
        report.add(
            Comparison(
                "Assembly of stiffness and mass",
                "plain scikit-fem forms",
                f"ring, {dofs_text(fe_mesh.quadratic_dofs)}",
                seconds["own"],
                seconds["plain"],
                1,
                check=f"entries agree to {max(errors):.0e} of the largest",
            )
        )
        dofs.append(float(fe_mesh.quadratic_dofs))
        times.append(float(np.median(seconds["own"].work)))
        plain.append(float(np.median(seconds["plain"].work)))
    for label, y in (("flexgear", times), ("plain scikit-fem forms", plain)):
        report.curves.append(Curve("assembly", label, "dofs", "processor time (s)", dofs, y))


def difference(a: sp.csr_matrix, b: sp.csr_matrix) -> float:
    """Largest difference of entries over the largest entry."""
    return float(abs(a - b).max() / abs(b).max())
