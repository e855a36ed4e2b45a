"""Cost of a step over the number of kept modes, and over the number of planets."""

from __future__ import annotations

import numpy as np

from benchmarks.record import Curve, Report
from benchmarks.stages import cheap_system, planet_system, steady_run
from benchmarks.timing import interleaved
from flexgear.analysis.modes import rows_at
from flexgear.coupling.modal import modal_system
from flexgear.structures.tall import single_threaded_blas

STEP = 1e-4
LIMITS_HZ = (300.0, 1500.0, 3000.0, 5000.0, 8000.0, None)  # None: every coordinate
PLANETS = range(3, 9)
STEPS = {"quick": 1000, "full": 5000}
REPEATS = {"quick": 2, "full": 5}


def run(report: Report, size: str) -> None:
    """Cheap bodies of the tests; one thread; no outputs but the last sample."""
    steps = STEPS[size]
    with single_threaded_blas():
        system = cheap_system()
        by_modes = {}
        for limit in LIMITS_HZ:
            modal = modal_system(system, limit)
            by_modes[modal.modes.shape[1]] = steady_run(modal, STEP, steps, steps * STEP)
        x, y = _measured(by_modes, steps, REPEATS[size])
        slope, base = np.polyfit(x, y, 1)
        apart = np.abs(np.polyval([slope, base], x) / y - 1).max()
        report.curves.append(
            Curve("modes", "flexgear, one-sided contact", "kept modes", "time per step (µs)", x, y)
        )
        report.say(
            "cost of a step over kept modes",
            f"{base:.1f} µs + {slope * 1e3:.0f} ns a mode for {x[0]:.0f} to {x[-1]:.0f} modes, "
            f"straight within {100 * apart:.0f} %",
        )
        by_planets, rows = {}, []
        for planets in PLANETS:
            modal = modal_system(planet_system(planets), 3000.0)
            by_planets[planets] = steady_run(modal, STEP, steps, steps * STEP)
            rows.append(rows_at(modal.system)[1])
        x, y = _measured(by_planets, steps, REPEATS[size])
        label = "flexgear, modes to 3 kHz"
        report.curves.append(Curve("planets", label, "planets", "time per step (µs)", x, y))
        report.say(
            "cost of a step over planets",
            f"exponent {_exponent(x, y):.2f} from {x[0]:.0f} to {x[-1]:.0f} planets "
            f"({rows[0]} to {rows[-1]} contact rows); below 2 is wanted",
        )


def _measured(runs: dict, steps: int, repeats: int) -> tuple[list[float], list[float]]:
    """Sizes and medians of time per step, µs."""
    seconds, _ = interleaved({str(k): r for k, r in runs.items()}, repeats)
    y = [1e6 * float(np.median(seconds[str(k)].work)) / steps for k in runs]
    return [float(k) for k in runs], y


def _exponent(x: list[float], y: list[float]) -> float:
    """p of y ~ x^p by least squares in logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
