"""The step kernel of a transient against other ways to take the same steps."""

from statistics import median

import numpy as np
from coupled import TORQUE

from benchmarks.bare_kernel import bare_data, bare_steps
from benchmarks.dense_steps import DenseSteps
from benchmarks.integrators import Integrator
from benchmarks.record import Comparison, Report
from benchmarks.stages import Run, cheap_system, real_case, real_system, steady_run
from benchmarks.timing import interleaved
from flexgear.analysis.start import start_state
from flexgear.analysis.step_plan import Adaptive
from flexgear.coupling.modal import ModalSystem, chosen_modal, modal_system
from flexgear.coupling.pace import case_pace
from flexgear.coupling.system import System
from flexgear.structures.linalg.dense import single_threaded_blas

STEP, FINE = 1e-4, 2e-5  # s, steady running and near torque steps
LIMIT_HZ = 3000.0
STEP_TOLERANCE = 5e-3  # step_tolerance
STEPS = {"quick": 2000, "full": 10000}
SPANS = {"quick": 0.2, "full": 1.0}  # s, of real-time factors
REVOLUTION = {"quick": 0.5, "full": 5.32}  # s, the same of the case as it is: one of the carrier
DENSE_STEPS = {"quick": 20, "full": 100}
SPAN = {"quick": 0.01, "full": 0.01}  # s, of solve_ivp
SHORT = 1e-3  # s, of solve_ivp in all coordinates
TOLERANCE = 1e-7  # relative, of solve_ivp: the error is then a step's or less
REPEATS = {"quick": 2, "full": 5}
# LSODA's Jacobian by differences is begun anew at every kink: minutes for 10 ms on FE bodies
METHODS = (("RK45", "DOP853"), ("RK45", "DOP853", "LSODA"))
GROUP = "Time step of a transient"


def run(report: Report, size: str) -> None:
    """All on one thread."""
    with single_threaded_blas():
        fidelity = {"full": "FE bodies", "quick": "coarse FE bodies"}[size]
        systems = {"cheap bodies": cheap_system(), fidelity: real_system(size)}
        for name, system in systems.items():
            modal = modal_system(system, LIMIT_HZ)
            text = f"wind-5mw, {name}, {modal.modes.shape[1]} of {system.size} coordinates"
            against_bare(report, modal, text, size)
            real_time(report, modal, name, size, SPANS[size])
            against_integrators(report, modal, text, size, METHODS[name == "cheap bodies"])
            against_all_coordinates(report, system, modal, text, size)
            against_dense(report, system, modal, text, size)
        as_shipped(report, size)


def as_shipped(report: Report, size: str) -> None:
    """The bundled case with the modes it keeps, at fixed steps and at steps by a tolerance."""
    modal = chosen_modal(real_system(size), case_pace(real_case(size).case))
    modes = modal.modes.shape[1]
    real_time(report, modal, "the case as it is", size, REVOLUTION[size])
    text = f"wind-5mw as it is, {modes} of {modal.system.size} coordinates"
    against_bare(report, modal, text, size)
    count = round(REVOLUTION[size] / STEP)
    run = steady_run(modal, STEP, count, adaptive=Adaptive(STEP_TOLERANCE, FINE, 64 * FINE))
    seconds, _ = interleaved({"own": run}, REPEATS[size])
    factors = [STEP * count / s for s in seconds["own"].work]
    report.say(
        f"real-time factor, the case as it is over {REVOLUTION[size]:g} s, {modes} kept modes, "
        f"step_tolerance {STEP_TOLERANCE:g}",
        f"{median(factors):.2f} ({min(factors):.2f} to {max(factors):.2f})",
    )


def against_bare(report: Report, modal: ModalSystem, text: str, size: str) -> None:
    """The least a step has to do; the ratio is below 1."""
    steady = steady_run(modal, STEP, STEPS[size])
    data = bare_data(modal, STEP)
    eta = steady.start.eta.copy()
    bare_steps(data, 2, eta.copy())
    seconds, _ = interleaved(
        {"own": steady, "bare": lambda: bare_steps(data, STEPS[size], eta.copy())},
        REPEATS[size],
    )
    times = median(seconds["own"].work) / median(seconds["bare"].work)
    report.add(
        Comparison(
            GROUP,
            "bare kernel: two modal products, contact matrix, Cholesky",
            text,
            seconds["own"].over(STEPS[size]),
            seconds["bare"].over(STEPS[size]),
            1,
            unit="step",
            check=f"{len(data.stiffness)} contact rows on {len(data.modes)} channels in both; "
            f"flexgear takes {times:.1f} times the bare",
        )
    )


def real_time(report: Report, modal: ModalSystem, name: str, size: str, span: float) -> None:
    """Simulated over processor time, outputs every millisecond and the run's set-up included."""
    runs = {h: steady_run(modal, h, round(span / h)) for h in (STEP, FINE)}
    seconds, _ = interleaved({str(h): r for h, r in runs.items()}, REPEATS[size])
    for h in runs:
        factors = [span / s for s in seconds[str(h)].work]
        report.say(
            f"real-time factor, {name} over {span:g} s, {modal.modes.shape[1]} kept modes, "
            f"dt = {h:g} s",
            f"{median(factors):.2f} ({min(factors):.2f} to {max(factors):.2f})",
        )


def against_integrators(
    report: Report, modal: ModalSystem, text: str, size: str, names: tuple[str, ...]
) -> None:
    """SciPy's solve_ivp over a short span, per simulated second."""
    span, steps = SPAN[size], round(SPAN[size] / STEP)
    steady = steady_run(modal, STEP, STEPS[size])
    exact = Run(modal, STEP / 100, 100 * steps, steady.start, span)()["eta"][-1]
    moved = np.abs(exact - steady.start.eta)[modal.rigid_count :].max()

    def error(eta: np.ndarray) -> float:
        return float(np.abs(eta - exact)[modal.rigid_count :].max() / moved)

    methods = {m: Integrator(modal, TORQUE, m, TOLERANCE) for m in names}
    seconds, answers = interleaved(
        {
            "own": steady,
            **{m: lambda i=i: i.run(steady.start, span) for m, i in methods.items()},
        },
        min(REPEATS[size], 3),
    )
    ours = error(Run(modal, STEP, steps, steady.start, span)()["eta"][-1])
    for m, integrator in methods.items():
        report.add(
            Comparison(
                GROUP,
                f"solve_ivp, {m}, rtol {TOLERANCE:g}, right-hand side compiled by flexgear",
                text,
                seconds["own"].over(STEPS[size] * STEP),
                seconds[m].over(span),
                1,
                unit="simulated second",
                check=f"{integrator.evaluations / steps:.1f} evaluations for a step; elastic "
                f"motion within {error(answers[m]):.0e} of steps a hundred times finer, "
                f"flexgear {ours:.0e}",
            )
        )


def against_all_coordinates(
    report: Report, system: System, modal: ModalSystem, text: str, size: str
) -> None:
    """solve_ivp without the second reduction, as one would write it first."""
    steady = steady_run(modal, STEP, STEPS[size])
    full = modal_system(system)
    start = start_state(full, TORQUE)
    integrator = Integrator(full, TORQUE, "RK45", TOLERANCE)
    seconds, _ = interleaved(
        {"own": steady, "RK45": lambda: integrator.run(start, SHORT)}, min(REPEATS[size], 3)
    )
    highest = full.omega.max() / (2 * np.pi)
    report.add(
        Comparison(
            GROUP,
            f"solve_ivp, RK45, rtol {TOLERANCE:g}, all coordinates",
            text,
            seconds["own"].over(STEPS[size] * STEP),
            seconds["RK45"].over(SHORT),
            1,
            unit="simulated second",
            check=f"{integrator.evaluations * STEP / SHORT:.0f} evaluations for a step of "
            f"{STEP:g} s: highest mode {highest / 1e3:.0f} kHz; {SHORT * 1e3:g} ms",
        )
    )


def against_dense(report: Report, system: System, modal: ModalSystem, text: str, size: str) -> None:
    """Dense matrices of all coordinates; answers are compared with all modes kept."""
    steps = DENSE_STEPS[size]
    full = modal_system(system)
    all_modes = steady_run(full, STEP, steps, STEP * steps)
    steady = steady_run(modal, STEP, STEPS[size])
    peers = {w: DenseSteps(full, TORQUE, STEP, w) for w in ("refactor", "woodbury")}
    seconds, answers = interleaved(
        {
            "own": steady,
            **{w: lambda p=p: p.run(all_modes.start, steps) for w, p in peers.items()},
        },
        min(REPEATS[size], 3),
    )
    motion = full.modes @ all_modes()["eta"][-1]
    roll = system.rolling @ (system.input_rows @ motion)
    names = {
        "refactor": "dense Cholesky at every step",
        "woodbury": "dense inverse, Woodbury update",
    }
    for way, name in names.items():
        error = np.abs(answers[way] - motion).max() / np.abs(motion - roll).max()
        report.add(
            Comparison(
                GROUP,
                name,
                text,
                seconds["own"].over(STEPS[size]),
                seconds[way].over(steps),
                1,
                unit="step",
                check=f"motion agrees to {error:.0e} when flexgear keeps all modes too",
            )
        )
