"""Headline on the solution: checks of the results, in one line while they are within limits.

Mean forces and speeds are compared with those of the power flow, residuals of equilibria and of the
energy balance with zero, errors of reductions with the promised one.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flexgear.model.names import GroupName
from flexgear.results.report.sharing import forces_of_halves
from flexgear.results.report.wording import number, titled_by_stage, window_words, with_unit, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline, Level
from flexgear.structures.estimate import PROMISED

Summary = Mapping[str, Any]
AGREES, DIFFERS = 0.01, 0.05  # limits for relative differences: of "good", of "watch"
CLOSED = 1e-6  # limit for the residual of an equilibrium over its load
BALANCED, UNBALANCED = 0.01, 0.05  # limits for energy residuals: of "good", of "watch"
NEGLIGIBLE = 1e-4  # relative residual below which this value is printed


@dataclass(frozen=True)
class Check:
    """One check of the solution. name: its title; figure: its value in words; within, outside:
    texts for a value within and outside limits."""

    level: Level
    name: str
    figure: str
    within: str
    outside: str


def _solution(findings: Findings) -> Iterator[Answer]:
    """One answer for all checks within limits, and one for each check outside."""
    within = []
    for check in _checks(findings.summary):
        if check.level == "good":
            within.append(check.within)
        else:
            yield Answer(check.level, "", None, f"{check.name}: {check.figure}", check.outside)
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
            of_body = f"{name}: static error"  # its warning names the load and a remedy
            warning = next((text for text in summary["warnings"] if of_body in text), "")
            yield Check(
                "good" if error <= PROMISED else "watch",
                f"Reduced {words(name)}",
                figure,
                f"static error of the reduced {words(name)} {figure}",
                f"Static error beside the full FE mesh; up to {promised} is promised. {warning}",
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


def _level(difference: float, agrees: float, differs: float) -> Level:
    return "good" if difference <= agrees else "watch" if difference <= differs else "bad"


def _forces(summary: Summary) -> Iterator[Check]:
    """Check of the mean gear-mesh forces against the power flow, in a double-helical stage of the
    mean of both halves, whose sum alone follows from the torque."""
    differences: dict[GroupName, float] = {}
    for group, forces in forces_of_halves(summary["transient"]).items():
        expected = summary["stages"][group.stage].get(f"{group.role}_gear_mesh_force_n")
        if expected:
            differences[group] = abs(sum(forces.values()) / len(forces) / expected - 1.0)
    if not differences:
        return
    worst = max(differences, key=lambda n: differences[n])
    sentence = (
        f"Difference of the mean force of {words(worst)} from that of the power flow, "
        f"{window_words(summary['transient'])}."
    )
    yield Check(
        _level(differences[worst], AGREES, DIFFERS),
        "Mean gear-mesh force",
        _percent(differences[worst]),
        "mean forces agree with the power flow",
        sentence,
    )


def _speeds(summary: Summary) -> Iterator[Check]:
    """Check of the speed of the pins relative to the ring."""
    for stage, ring in summary.get("steady", {}).items():
        speed = ring["carrier_speed_rpm_mean"]
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
    """Check of the modal truncation."""
    system = summary["system"]
    band, estimate = system.get("modes_band_hz"), system["modes_estimate"]
    if band is not None:
        lowest = system.get("lowest_modes_band_hz")
        upto = with_unit(band, "Hz")
        if lowest is not None:
            upto += (
                f", of bodies that only slower gear meshes excite up to {with_unit(lowest, 'Hz')}"
            )
        error = "–" if estimate is None else _percent(estimate)
        yield Check(
            "watch" if estimate is None else "good",
            "Modes kept",
            f"{system['kept_modes']}, the highest of {with_unit(system['modes_limit_hz'], 'Hz')}",
            f"error of the modal truncation at most {error} up to {upto}",
            f"They do not cover the band of {upto}.",
        )


def balance_sentence(closure: float) -> str:
    """Sentence on whether equilibria are in balance; closure: largest residual over the load."""
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
