"""Reduction sector by sector against the general path, over the size of the ring."""

import inspect
from statistics import median

import numpy as np

from benchmarks.record import Comparison, Curve, Report
from benchmarks.rings import dofs_text, fixed_frequencies, ring_fe_mesh_of_size
from benchmarks.timing import interleaved
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.linalg.dense import THREADS
from flexgear.structures.reduction import reduce
from flexgear.structures.sources.reducing import tied
from flexgear.structures.sources.ring import source as ring_source

REPEATS = {"quick": {"37k": 1}, "full": {"37k": 2, "57k": 2, "133k": 1, "314k": 1}}
ALONE = {"quick": (), "full": ("1M",)}  # sizes at which the general path takes too long here
MODES = {"quick": 10, "full": 60}
LIMIT = 1e-8  # both paths on the same mesh


def run(report: Report, size: str) -> None:
    """From the FE mesh to the reduced body with all 120 interface nodes."""
    if "sectors" not in inspect.signature(reduce).parameters:
        report.skip("cyclic path", "this version of flexgear has no cyclic reduction")
        return
    count = MODES[size]
    curves: dict[str, tuple[list[float], list[float]]] = {"cyclic": ([], []), "general": ([], [])}
    for name, repeats in REPEATS[size].items():
        case, fe_mesh = ring_fe_mesh_of_size(name)
        seconds, answers = interleaved(
            {
                "cyclic": lambda case=case, mesh=fe_mesh: by_sectors(case, mesh, count),
                "general": lambda case=case, mesh=fe_mesh: in_general(case, mesh, count),
            },
            repeats,
        )
        errors = [
            float(np.abs(a - b).max() / np.abs(b).max())
            for a, b in zip(answers["cyclic"], answers["general"], strict=True)
        ]
        if max(errors) > LIMIT:
            raise AssertionError(f"cyclic and general path differ by {max(errors):.1e}")
        report.add(
            Comparison(
                "Reduction by cyclic symmetry",
                "flexgear's general path (CHOLMOD)",
                f"ring, {dofs_text(fe_mesh.quadratic_dofs)}, {count} modes",
                seconds["cyclic"],
                seconds["general"],
                THREADS,
                check=f"interface stiffness agrees to {errors[0]:.0e}, frequencies to "
                f"{errors[1]:.0e}",
            )
        )
        for path, (dofs, times) in curves.items():
            dofs.append(float(fe_mesh.quadratic_dofs))
            times.append(median(seconds[path].wall))
    for name in ALONE[size]:
        case, fe_mesh = ring_fe_mesh_of_size(name)
        seconds, _ = interleaved({"cyclic": lambda c=case, m=fe_mesh: by_sectors(c, m, count)}, 1)
        curves["cyclic"][0].append(float(fe_mesh.quadratic_dofs))
        curves["cyclic"][1].append(median(seconds["cyclic"].wall))
    for path, (dofs, times) in curves.items():
        report.curves.append(Curve("cyclic", f"{path} path", "dofs", "time (s)", dofs, times))


def by_sectors(case: StageView, fe_mesh: FeMesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Interface stiffness N/m and frequencies Hz, one sector of the ring's teeth at a time."""
    from flexgear.structures.cyclic.condensation import sector_counts

    m = case.material
    model = FeModel(fe_mesh, m.young_modulus, m.poisson_ratio, m.density)
    reduction = reduce(
        model,
        tied(model, ring_source(case).nodes(model.fe_mesh)),
        count,
        sectors=sector_counts(case.stage.ring.teeth),
    )
    if reduction.condensation.path.startswith("general"):
        raise AssertionError(f"the ring was not reduced by sectors: {reduction.condensation.path}")
    return reduction.condensation.stiffness, fixed_frequencies(reduction)


def in_general(case: StageView, fe_mesh: FeMesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The same on the whole ring."""
    m = case.material
    model = FeModel(fe_mesh, m.young_modulus, m.poisson_ratio, m.density)
    reduction = reduce(model, tied(model, ring_source(case).nodes(model.fe_mesh)), count)
    return reduction.condensation.stiffness, fixed_frequencies(reduction)
