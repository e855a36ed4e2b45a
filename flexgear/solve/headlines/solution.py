"""Headline of the solution: flexgear's own checks, in one line while they are within limits.

Mean forces and speeds are held to those of the power flow, equilibria and the energy balance to
zero, reductions to the error that they promise, the harmonic solution to the transient.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flexgear.model.names import GroupName
from flexgear.results.report.wording import number, titled_by_stage, window_words, with_unit, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline, Level
from flexgear.solve.result_warnings import PROMISED

Summary = Mapping[str, Any]
AGREES, DIFFERS = 0.01, 0.05  # of what a speed or mean force should be
CLOSED = 1e-6  # share of the load that an equilibrium may leave over
BALANCED, UNBALANCED = 0.01, 0.05  # share of the energy not accounted for
NEGLIGIBLE = 1e-4  # of the energy: smaller residuals are no figures


@dataclass(frozen=True)
class Check:
    """One check of the solution. what: its name; figure: its value; within, outside: sentences for
    within and outside limits."""

    level: Level
    what: str
    figure: str
    within: str
    outside: str


def _solution(findings: Findings) -> Iterator[Answer]:
    """One line of the checks within limits, a line for each of the others."""
    within = []
    for check in _checks(findings.summary):
        if check.level == "good":
            within.append(check.within)
        else:
            yield Answer(check.level, "", None, f"{check.what}: {check.figure}", check.outside)
    if within:
        sentence = "; ".join(dict.fromkeys(within))
        text = f"{sentence[0].upper()}{sentence[1:]}."
        yield Answer("good", "", None, "checks within limits", text)


def _checks(summary: Summary) -> Iterator[Check]:
    yield from _forces(summary)
    yield from _speeds(summary)
    closure = summary.get("equilibrium_closure_max")
    if closure is not None:
        level: Level = "good" if closure <= CLOSED else "bad"
        yield Check(level, "Equilibria", "not closed", "forces balance", balance_sentence(closure))
    for name, reduction in summary.get("reduction", {}).items():
        error = reduction.get("static_error")
        if error is not None:
            figure, promised = _percent(error), _percent(PROMISED)
            yield Check(
                "good" if error <= PROMISED else "watch",
                f"Reduced {words(name)}",
                figure,
                f"static error of the reduced {words(name)} {figure}",
                f"Static error beside the full FE mesh; up to {promised} is promised.",
            )
    residual = summary["energy_residual"]
    if residual is not None:
        figure = _percent(max(residual, NEGLIGIBLE))
        yield Check(
            _level(residual, BALANCED, UNBALANCED),
            "Energy balance",
            figure,
            f"energy balance closes within {figure}",
            "Of the energy in motion that work and losses do not account for.",
        )
    yield from _modes(summary)


def _level(away: float, agrees: float, differs: float) -> Level:
    return "good" if away <= agrees else "watch" if away <= differs else "bad"


def _forces(summary: Summary) -> Iterator[Check]:
    """Mean forces of gear meshes beside those of the power flow."""
    away: dict[str, float] = {}
    for label, force in summary["transient"]["gear_mesh_force"].items():
        group = GroupName.parse(label)
        expected = summary["stages"][group.stage].get(f"{group.kind}_gear_mesh_force_n")
        if expected:
            away[group] = abs(abs(force["mean_n"]) / expected - 1.0)
    if not away:
        return
    worst = max(away, key=lambda n: away[n])
    sentence = (
        f"By so much the mean force of {words(worst)} differs from the power flow's, "
        f"{window_words(summary['transient'])}."
    )
    yield Check(
        _level(away[worst], AGREES, DIFFERS),
        "Mean gear-mesh force",
        _percent(away[worst]),
        "mean forces agree with the power flow",
        sentence,
    )


def _speeds(summary: Summary) -> Iterator[Check]:
    """Check of the speed of the pins against the ring."""
    for stage, of_ring in summary.get("steady", {}).items():
        speed = of_ring["carrier_speed_rpm_mean"]
        expected = summary["stages"][stage]["pin_speed_rpm"]
        if not expected:
            continue
        yield Check(
            _level(abs(speed / expected - 1.0), AGREES, DIFFERS),
            titled_by_stage("Pins against ring", stage),
            with_unit(speed, "r/min"),
            "speeds agree with the power flow",
            f"The power flow gives {with_unit(expected, 'r/min')}.",
        )


def _modes(summary: Summary) -> Iterator[Check]:
    """Check of the effect of dropped modes, and of the difference to the harmonic solution."""
    system = summary["system"]
    band, estimate = system.get("modes_band_hz"), system["modes_estimate"]
    if band is not None:
        upto = with_unit(band, "Hz")
        error = "–" if estimate is None else _percent(estimate)
        yield Check(
            "watch" if estimate is None else "good",
            "Modes kept",
            f"{system['kept_modes']} up to {with_unit(system['modes_limit_hz'], 'Hz')}",
            f"error of the modal truncation at most {error} up to {upto}",
            f"They do not cover the band of {upto}.",
        )
    difference = summary["harmonic"].get("largest_difference")
    if difference is not None:
        below = "less than " if difference < NEGLIGIBLE else ""
        figure = _percent(max(difference, NEGLIGIBLE))
        yield Check(
            "good" if difference <= AGREES else "watch",
            "Harmonic solution",
            figure,
            f"harmonic solution and transient differ by {below}{figure} of the largest force",
            "Of the largest force, by which the harmonic solution and the transient differ.",
        )


def balance_sentence(closure: float) -> str:
    """Whether equilibria are in balance; closure: share of the load that is left over."""
    if closure <= CLOSED:
        return "All forces are in balance."
    return f"Forces are not in balance: {with_unit(closure, 'share')} of the load is left over."


def _percent(share: float) -> str:
    """An estimate in per cent, two digits."""
    return f"{number(100.0 * share, 2)} %"


SOLUTION = Headline(
    "solution", "Solution", "", "flexgear's own checks: forces, speeds, closure, energy, errors of "
    "reductions and of modes left out", "accuracy", _solution,
)  # fmt: skip
