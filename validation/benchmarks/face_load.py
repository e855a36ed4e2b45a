"""Load along the face: what slices cost beside single pairs, and against all slices at once."""

from statistics import median

import numpy as np
import scipy.linalg as sla

from benchmarks.record import Comparison, Report
from benchmarks.stages import steady_run
from benchmarks.timing import interleaved
from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.modes import rows_at
from flexgear.coupling.kernels.elements import between_rows, row_motions
from flexgear.coupling.laws.slices import COUNT, FIRST
from flexgear.model.load import load_case
from flexgear.solve.model import Model, assemble
from flexgear.solve.static import static
from flexgear.structures.linalg.dense import single_threaded_blas

STEP = 1e-4
STEPS = {"quick": 400, "full": 4000}
POSITIONS = {"quick": 100, "full": 1000}
DENSE = {"quick": 3, "full": 10}
REPEATS = {"quick": 2, "full": 5}
FACE = {"stage.gear_mesh.model": "face_load"}
MODELS = {
    "single pairs": {},
    "slices beside each other": FACE,
    "slices with FE influence": {**FACE, "stage.gear_mesh.tooth_compliance": "fe"},
}
SINGLE, BESIDE, COUPLED = MODELS


def run(report: Report, size: str) -> None:
    """wind-5mw on quick FE bodies, 15 slices, ten gear meshes; one thread."""
    case = load_case("wind-5mw", {"solver.fidelity": "quick"})
    with single_threaded_blas():
        models = {name: assemble(case.with_(**keys)) for name, keys in MODELS.items()}
        steps(report, models, size)
        equilibria(report, models, size)
        against_dense(report, models[COUPLED], size)


def steps(report: Report, models: dict[str, Model], size: str) -> None:
    """A step of a transient over that of single pairs."""
    runs = {name: steady_run(m.modal, STEP, STEPS[size]) for name, m in models.items()}
    seconds, _ = interleaved(runs, REPEATS[size])
    for name, limit in ((BESIDE, 10), (COUPLED, 20)):
        pairs = zip(seconds[name].work, seconds[SINGLE].work, strict=True)
        ratios = [one / other for one, other in pairs]
        report.say(
            f"time of a step, {name}, over that with single pairs",
            f"{median(ratios):.1f} ({min(ratios):.1f} to {max(ratios):.1f}); {limit} is allowed",
        )


def equilibria(report: Report, models: dict[str, Model], size: str) -> None:
    """A revolution of warm-started equilibria, alone and with all outputs."""
    count = POSITIONS[size]
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    for name in (BESIDE, COUPLED):
        model = models[name]
        torque = model.system.rated_torque
        revolution(model.modal, angles[:3], torque)  # compiles
        seconds, _ = interleaved(
            {
                "alone": lambda m=model, t=torque: revolution(m.modal, angles, t),
                "all": lambda m=model: static(m, angles),
            },
            REPEATS[size],
        )
        each = [1e3 * s / count for s in seconds["alone"].work]
        report.say(
            f"an equilibrium, {name}",
            f"{median(each):.2f} ms ({min(each):.2f} to {max(each):.2f}); below 5 ms is wanted",
        )
        whole = [1000 * s / count for s in seconds["all"].work]
        report.say(
            f"1 000 positions with all outputs, {name}",
            f"{median(whole):.1f} s ({min(whole):.1f} to {max(whole):.1f}); below 10 s is wanted",
        )


def against_dense(report: Report, model: Model, size: str) -> None:
    """All slices of all pairs as unknowns of one problem."""
    torque = model.system.rated_torque
    angles = np.linspace(0, 2 * np.pi, POSITIONS[size], endpoint=False)
    few = angles[:: POSITIONS[size] // DENSE[size]][: DENSE[size]]
    seconds, answers = interleaved(
        {
            "own": lambda: revolution(model.modal, angles, torque),
            "dense": lambda: [dense_position(model, angle) for angle in few],
        },
        REPEATS[size],
    )
    forces = revolution(model.modal, few, torque).pair_load.sum(axis=2)
    error = np.abs(np.array(answers["dense"]) - forces).max() / forces.max()
    report.add(
        Comparison(
            "Load along the face",
            "all slices of all pairs in one dense problem",
            f"wind-5mw, quick FE bodies, {model.system.size} coordinates, 15 slices",
            seconds["own"].over(len(angles)),
            seconds["dense"].over(len(few)),
            1,
            unit="position",
            check=f"forces agree to {error:.0e}; the peer's time is of {len(few)} positions",
        )
    )


def dense_position(model: Model, angle: float) -> np.ndarray:
    """Gear-mesh forces (M,) N at an angle: Newton's method on motion q, torque T and all slices f,

    K q + Vᵀ f + o T = load,   input_angles q = 0,   C f + h(f) = V q + e − g where f > 0.
    """
    system = model.system
    rows, n = rows_at(system, angle)
    share, flexibility, (scale, limit), gap, owner = _slices(rows, n)
    flexibility = flexibility + share @ between_rows(rows, n) @ share.T
    vectors, free = (
        share @ row_motions(rows, n, system.blocks),
        share @ rows.row["offset"][:n] - gap,
    )
    d, count = system.size, len(gap)
    left, right = np.zeros((d + 1 + count, d + 1 + count)), np.zeros(d + 1 + count)
    left[:d, :d], left[:d, d], left[d, :d] = (
        system.stiffness,
        system.ports[-1].row,
        system.input_rows[0],
    )
    right[:d] = system.ports[0].row * system.rated_torque
    f, touch, q = np.zeros(count), np.ones(count, bool), np.zeros(d)
    f[:] = 1e-3 * limit
    for _ in range(100):
        floor = np.maximum(f, 1e-9 * limit)
        ratio = np.log(limit / floor)
        slope = np.where(f > floor, ratio - 1, ratio)
        left[:d, d + 1 :] = vectors.T * touch
        left[d + 1 :, :d] = -vectors * touch[:, None]
        left[d + 1 :, d + 1 :] = flexibility * np.outer(touch, touch) + np.diag(
            np.where(touch, scale * slope, 1.0)
        )
        right[d + 1 :] = touch * (free - scale * f * (ratio - slope))
        stiff = np.diag(left)[:d]
        size = np.append(1 / np.sqrt(stiff + 1e-9 * stiff.max()), np.ones(1 + count))
        size[d + 1 :] = 1 / np.sqrt(np.diag(left)[d + 1 :])
        solution = size * sla.solve(size[:, None] * left * size, size * right)
        moved = np.abs(solution[d + 1 :] - f).max()
        q, f = solution[:d], solution[d + 1 :]
        overlap = vectors @ q + free - flexibility @ f
        pulls, closes = f < 0, ~touch & (overlap > 1e-12 * np.abs(overlap).max())
        f[pulls] = 0.0
        if not pulls.any() and not closes.any() and moved < 1e-9 * f.max():
            return np.bincount(owner, f, len(system.pairs.s0))
        touch = (touch | closes) & ~pulls
    raise AssertionError("no answer")


def _slices(rows, n: int):
    """Shares (S, n) of slices in rows, flexibility, scales and limits, gaps, gear meshes."""
    shares, blocks, scales, limits, gaps, owners = [], [], [], [], [], []
    for e in np.flatnonzero(rows.element["rows"] == 2):
        first, parameters = rows.element["first"][e], rows.parameters[e]
        if first >= n:
            continue
        count = int(parameters[COUNT])
        t, _, g, a, limit = parameters[FIRST : FIRST + 5 * count].reshape(5, count)
        share = np.zeros((count, n))
        share[:, first], share[:, first + 1] = 1 - t, t
        lower = np.zeros((count, count))
        at = np.tril_indices(count)
        lower[at] = parameters[FIRST + 5 * count :][: len(at[0])]
        shares.append(share)
        blocks.append(lower + np.tril(lower, -1).T)
        scales.append(a)
        limits.append(limit)
        gaps.append(g)
        owners.append(np.full(count, rows.row["owner"][first]))
    contact = np.concatenate(scales), np.concatenate(limits)
    owner, gap = np.concatenate(owners), np.concatenate(gaps)
    return np.vstack(shares), sla.block_diag(*blocks), contact, gap, owner
