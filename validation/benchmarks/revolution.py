"""A quasi-static revolution of 1 000 positions against a dense solution at each position."""

from statistics import median

import numpy as np
import scipy.linalg as sla
from coupled import TORQUE, shaped

from benchmarks.record import Comparison, Report
from benchmarks.stages import real_system
from benchmarks.timing import interleaved
from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.modes import rows_at
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.kernels.elements import row_motions
from flexgear.coupling.modal import ModalSystem, modal_system
from flexgear.coupling.system import System
from flexgear.results.load_sharing import load_sharing
from flexgear.structures.linalg.dense import single_threaded_blas

POSITIONS = 1000
DENSE = {"quick": 5, "full": 20}
REPEATS = {"quick": 2, "full": 3}


def run(report: Report, size: str) -> None:
    """Pair loads, load sharing, motion of every ring tooth and of the sun; one thread."""
    system = real_system(size)
    with single_threaded_blas():
        modal = modal_system(system, 3000.0)
        angles = np.linspace(0, 2 * np.pi, POSITIONS, endpoint=False)
        few = angles[:: POSITIONS // DENSE[size]][: DENSE[size]]
        whole_revolution(modal, few)  # compiles
        seconds, answers = interleaved(
            {
                "own": lambda: whole_revolution(modal, angles),
                "dense": lambda: np.array([dense_position(system, angle) for angle in few]),
            },
            REPEATS[size],
        )
        equilibrium = revolution(modal, few, TORQUE)
        motion = Recovery(equilibrium).motion(np.eye(system.size))
        error = np.abs(answers["dense"] - motion).max() / np.abs(motion).max()
    report.add(
        Comparison(
            "Quasi-static revolution",
            "dense solution of all coordinates at every position",
            f"wind-5mw, FE bodies, {modal.modes.shape[1]} of {system.size} coordinates, "
            f"{POSITIONS} positions",
            seconds["own"].over(POSITIONS),
            seconds["dense"].over(len(few)),
            1,
            unit="position",
            check=f"motion agrees to {error:.0e}; the peer's time is of {len(few)} positions",
        )
    )
    whole = seconds["own"].work
    report.say(
        "quasi-static revolution of 1 000 positions with load sharing and deflections",
        f"{median(whole):.2f} s ({min(whole):.2f} to {max(whole):.2f}); below 2 s is wanted",
    )


def whole_revolution(modal: ModalSystem, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Load sharing of the ring's gear meshes (p,) and deflections (p, k) over positions."""
    equilibrium = revolution(modal, angles, TORQUE)
    system = modal.system
    force = shaped(equilibrium).sum(axis=-1)[:, 0]
    nodes = [("stage.ring", n) for n in _teeth(system)] + [("stage.shaft", "sun")]
    rows = np.vstack([system.node_rows(body, node) for body, node in nodes])
    return load_sharing(force, float(force.mean())), Recovery(equilibrium).motion(rows)


def _teeth(system: System) -> list[str]:
    return [n for n in system.body("stage.ring").node_names if n.startswith("tooth_")]


def dense_position(system: System, angle: float) -> np.ndarray:
    """Motion (d,) without rolling: [K + V^T k V, o; input_angles, 0] [q; T] = [load; 0], pairs in
    tension dropped until none is left."""
    rows, n = rows_at(system, angle)
    vectors, k, offset = (
        row_motions(rows, n, system.blocks),
        rows.row["stiffness"][:n],
        rows.row["offset"][:n],
    )
    d = system.size
    left, right = np.zeros((d + 1, d + 1)), np.zeros(d + 1)
    left[:d, d], left[d, :d] = system.ports[-1].row, system.input_rows[0]
    active = np.ones(n, dtype=bool)
    while True:
        va, ka = vectors[active], k[active]
        left[:d, :d] = system.stiffness + (va.T * ka) @ va
        right[:d] = system.ports[0].row * TORQUE - va.T @ (ka * offset[active])
        # scaled, or the output torque's unit would spoil the pivots
        scale = 1 / np.sqrt(np.append(np.diag(left)[:d], 1.0))
        q = scale * sla.solve(scale[:, None] * left * scale, scale * right)
        carry = k * (vectors @ q[:d] + offset) > 0
        if np.array_equal(carry, active):
            return q[:d]
        active = carry
