"""Cost of a step over the number of kept modes, and over the number of planets.

A run is timed with all its steps and with a fifth of them; the difference leaves out what a run
takes before its first step (receptances, work space).
"""

import numpy as np

from benchmarks.record import Curve, Report
from benchmarks.stages import Run, cheap_system, planet_system, steady_run
from benchmarks.timing import interleaved
from flexgear.analysis.modes import rows_at
from flexgear.coupling.modal import ModalSystem, modal_system
from flexgear.structures.linalg.dense import single_threaded_blas

STEP = 1e-4
LIMITS_HZ = (300.0, 1500.0, 3000.0, 5000.0, 8000.0, None)  # None: every coordinate
PLANETS = range(3, 9)
STEPS = {"quick": 2000, "full": 10000}
REPEATS = {"quick": 2, "full": 5}


def run(report: Report, size: str) -> None:
    """Cheap bodies of the tests; one thread; no outputs but the last sample."""
    steps = STEPS[size]
    with single_threaded_blas():
        system = cheap_system()
        by_modes = {}
        for limit in LIMITS_HZ:
            modal = modal_system(system, limit)
            by_modes[modal.modes.shape[1]] = _runs(modal, steps)
        x, y = _measured(by_modes, steps, REPEATS[size])
        slope, base = np.polyfit(x, y, 1)
        error = np.abs(np.polyval([slope, base], x) / y - 1).max()
        report.curves.append(
            Curve("modes", "flexgear, one-sided contact", "kept modes", "time per step (µs)", x, y)
        )
        report.say(
            "cost of a step over kept modes",
            f"{base:.1f} µs + {slope * 1e3:.0f} ns a mode for {x[0]:.0f} to {x[-1]:.0f} modes, "
            f"straight within {100 * error:.0f} %",
        )
        by_planets, rows = {}, []
        for planets in PLANETS:
            modal = modal_system(planet_system(planets), 3000.0)
            by_planets[planets] = _runs(modal, steps)
            rows.append(rows_at(modal.system)[1])
        x, y = _measured(by_planets, steps, REPEATS[size])
        label = "flexgear, modes to 3 kHz"
        report.curves.append(Curve("planets", label, "planets", "time per step (µs)", x, y))
        report.say(
            "cost of a step over planets",
            f"exponent {_exponent(x, y):.2f} from {x[0]:.0f} to {x[-1]:.0f} planets "
            f"({rows[0]} to {rows[-1]} contact rows); below 2 is wanted",
        )


def _runs(modal: ModalSystem, steps: int) -> tuple[Run, Run]:
    """All steps, and a fifth of them."""
    few = steps // 5
    return steady_run(modal, STEP, steps, steps * STEP), steady_run(modal, STEP, few, few * STEP)


def _measured(
    runs: dict[int, tuple[Run, Run]], steps: int, repeats: int
) -> tuple[list[float], list[float]]:
    """Sizes and medians of time per step, µs."""
    candidates = {f"{k} {part}": run for k, pair in runs.items() for part, run in enumerate(pair)}
    seconds, _ = interleaved(candidates, repeats)
    y = []
    for k in runs:
        whole, few = np.median(seconds[f"{k} 0"].work), np.median(seconds[f"{k} 1"].work)
        y.append(1e6 * float(whole - few) / (steps - steps // 5))
    return [float(k) for k in runs], y


def _exponent(x: list[float], y: list[float]) -> float:
    """p of y ~ x^p by least squares in logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
