"""Hurty-Craig-Bampton modes of Exudyn's FEMinterface: rigid patches, the same K, M and nodes."""

import contextlib
import io
from typing import Any

import numpy as np

from benchmarks.record import Comparison, Report
from benchmarks.rings import dofs_text, fixed_frequencies, small_ring
from benchmarks.timing import interleaved
from flexgear.structures.fem.assembly import FeModel, facet_sample
from flexgear.structures.fem.ties import interface_of, rigid_tie
from flexgear.structures.linalg.dense import THREADS
from flexgear.structures.reduction import reduce

STEP = {"quick": 8, "full": 3}  # every so many teeth have a patch
MODES = {"quick": 10, "full": 20}
REPEATS = {"quick": 1, "full": 2}


def run(report: Report, size: str) -> None:
    """Roots of some teeth and both fits of a small ring as rigid patches (RBE2)."""
    try:
        from exudyn.FEM import FEMinterface
    except ImportError:
        report.skip("Exudyn", "not installed (pip install 'flexgear[bench]')")
        return
    model, count = small_ring(), MODES[size]
    roots = sorted(name for name in model.fe_mesh.facets if name.startswith("tooth_root"))
    names = [*roots[:: STEP[size]], "fit_1", "fit_2"]
    ties = []
    for name in names:
        sample = facet_sample(model, model.fe_mesh.facets[name])
        nodes = np.unique(sample.interpolation.indices)
        ties.append(rigid_tie(name, model.nodes[nodes].mean(axis=0), sample))
    interface = interface_of(model, ties)
    patches = [tie.nodes.tolist() for tie in ties]
    taken = np.concatenate(patches)
    if len(np.unique(taken)) != len(taken):
        raise AssertionError("patches share nodes, which Exudyn does not take")

    seconds, answers = interleaved(
        {
            "own": lambda: fixed_frequencies(reduce(model, interface, count)),
            "exudyn": lambda: craig_bampton(FEMinterface(), model, patches, count),
        },
        REPEATS[size],
    )
    error = np.abs(answers["exudyn"] / answers["own"] - 1).max()
    report.add(
        Comparison(
            "Reduction to rigid patches and fixed-interface modes",
            "Exudyn, ComputeHurtyCraigBamptonModes (RBE2)",
            f"ring, {dofs_text(model.dofs)}, {len(patches)} patches, {count} modes",
            seconds["own"],
            seconds["exudyn"],
            THREADS,
            check=f"frequencies agree to {error:.0e}",
        )
    )


def craig_bampton(fem: Any, model: FeModel, patches: list[list[int]], count: int) -> np.ndarray:
    """Fixed-interface frequencies, Hz, of Exudyn."""
    from exudyn.FEM import HCBstaticModeSelection

    fem.nodes = {"Position": model.nodes}
    fem.stiffnessMatrix, fem.massMatrix = model.stiffness, model.mass
    with contextlib.redirect_stdout(io.StringIO()):
        fem.ComputeHurtyCraigBamptonModes(
            patches, count, computationMode=HCBstaticModeSelection.RBE2,
            excludeRigidBodyMotion=False, timerTreshold=10**9,
        )  # fmt: skip
    return np.sqrt(np.sort(fem.eigenValues)) / (2 * np.pi)
