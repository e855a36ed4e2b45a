"""Verdicts of a run: its figures held to what they should be, in plain words.

Load sharing is held to the mesh load factor of IEC 61400-4:2012 for the number of planets
(``results.load_sharing``), speeds and mean forces to the power flow's, reductions to the error that
they promise, equilibria and the energy account to zero, excitations to a margin off the natural
frequencies. Deflections have no limit here: they are notes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from flexgear.results.report.headlines import headlines, titled_by_stage
from flexgear.results.report.parts import Level, Verdict
from flexgear.results.report.sharing import (
    DEFINITION,
    groups_of,
    own_variant,
    sharing_title,
    sharings,
)
from flexgear.results.report.tables import stage_figures
from flexgear.results.report.wording import factor, number, said, window_words, words
from flexgear.solve.reduction_warnings import PROMISED
from flexgear.solve.resonance import resonance_verdict

Summary = Mapping[str, Any]
AGREES, STRAYS = 0.01, 0.05  # of what a speed or mean force should be
CLOSED = 1e-6  # share of the load that an equilibrium may leave over
BALANCED, UNBALANCED = 0.01, 0.05  # share of the energy not accounted for
NEGLIGIBLE = 1e-4  # of the energy: smaller residuals are no figures
WARNING = "Warning"
STANDARD = "IEC 61400-4:2012"


def verdicts(summary: Summary) -> list[Verdict]:
    """What the first screen of a report says, the most important first."""
    parts = (
        _warnings(summary),
        _sharing(summary),
        _lengths(summary),
        _forces(summary),
        _resonance(summary),
        _rigid_beside_flexible(summary),
        _errors(summary),
    )
    beside = {one["figure"]: one["sentence"] for one in summary.get("neglected", ())}
    return [_with_neglected(verdict, beside) for part in parts for verdict in part]


def _with_neglected(verdict: Verdict, beside: Mapping[str, str]) -> Verdict:
    """With the sentence about effects that are left out and not small against the figure."""
    if verdict.subject not in beside:
        return verdict
    level: Level = "watch" if verdict.level in ("good", "note") else verdict.level
    left_out = beside[verdict.subject].partition(": ")[2]
    sentence = f"{verdict.sentence} {left_out[0].upper()}{left_out[1:]}"
    return replace(verdict, level=level, sentence=sentence)


def _warnings(summary: Summary) -> Iterator[Verdict]:
    for text in plain_warnings(summary):
        yield Verdict("watch", WARNING, "", text)


def plain_warnings(summary: Summary) -> list[str]:
    """Warnings that do not stand beside a figure."""
    beside = {one["sentence"] for one in summary.get("neglected", ())}
    return [text for text in summary["warnings"] if text not in beside]


def _sharing(summary: Summary) -> Iterator[Verdict]:
    """Of each stage: the standard's value is one of equilibria, dynamics come on top of it; without
    equilibria K in time is held to it."""
    found = list(sharings(summary["load_sharing"]))
    for one in found:
        both = [k for k in (one.in_equilibria, one.in_time) if k is not None]
        level: Level = "note"
        compared = f"{STANDARD} has no value for that number of planets"
        if one.assumed is not None:
            level = "bad" if both[0] > one.assumed else "good"
            level = "watch" if level == "good" and both[-1] > one.assumed else level
            least, most = min(both) <= one.assumed, max(both) > one.assumed
            stands = ("in part above" if least else "above") if most else "within"
            compared = f"{stands} the {one.assumed:.2f} that {STANDARD} assumes for its planets"
        in_time = f"; in time {one.window}" if one.in_time is not None else ""
        sentence = f"{compared[0].upper()}{compared[1:]}{in_time}. {one.reason}".strip()
        yield Verdict(level, sharing_title(one), f"K = {one.figure}", sentence)
    if found:
        yield Verdict("note", "Definition", "", DEFINITION)
    else:
        groups = own_variant(summary["load_sharing"]["transient"])
        why = "The planets carry no load together, so that K is not defined."
        none = "No planets share a load in this case."
        yield Verdict("note", "Load sharing", "–", why if groups_of(groups) else none)


def _forces(summary: Summary) -> Iterator[Verdict]:
    """Mean forces of each stage's gear meshes beside those of the power flow, and the largest."""
    stages: dict[str, dict[str, Any]] = {}
    for group, force in summary["transient"]["gear_mesh_force"].items():
        stages.setdefault(group.partition(" ")[0], {})[group] = force
    for stage, groups in stages.items():
        known = summary["stages"][stage]
        away, largest = 0.0, max(max(abs(f["max_n"]), abs(f["min_n"])) for f in groups.values())
        for group, force in groups.items():
            role = "ring" if " ring" in group else "sun"
            expected = known.get(f"{role}_gear_mesh_force_n")
            if expected:
                away = max(away, abs(abs(force["mean_n"]) / expected - 1.0))
        level: Level = "good" if away <= AGREES else "watch" if away <= STRAYS else "bad"
        beside = "as the power flow gives" if level == "good" else (
            f"up to {_percent(away)} beside those of the power flow")  # fmt: skip
        figure = ", ".join(
            f"{_part(group)} {said(abs(force['mean_n']), 'N')}".strip()
            for group, force in groups.items()
        )
        most = f"largest {said(largest, 'N')}, {window_words(summary['transient'])}"
        subject = titled_by_stage("Mean gear-mesh forces", stage)
        yield Verdict(level, subject, figure, f"{beside.capitalize()}; {most}.")


def _resonance(summary: Summary) -> Iterator[Verdict]:
    """What meets natural frequencies where the case runs; runs before 0.3 do not say."""
    if "resonance" in summary:
        level, figure, sentence = resonance_verdict(summary["resonance"])
        yield Verdict(level, "Resonance", figure, sentence)


def _part(group: str) -> str:
    """ "stage_1 ring left" -> "ring left"."""
    return group.partition(" ")[2]


def _lengths(summary: Summary) -> Iterator[Verdict]:
    """Deflections and transmission errors, which have no limit."""
    for one in headlines(summary):
        yield Verdict("note", one.subject, said(one.value, "m"), one.sentence)


def _rigid_beside_flexible(summary: Summary) -> Iterator[Verdict]:
    """What bending changes in the load sharing, by the same K in time."""
    variants = summary["load_sharing"]["transient"]
    if "rigid" not in variants or len(variants) < 2:
        return
    name = next(iter(variants))
    found = {
        label: {one.stage: one.in_time for one in sharings({"quasi_static": {}, "transient": only})}
        for label in (name, "rigid")
        for only in [{label: variants[label]}]
    }
    for stage, k in found[name].items():
        rigid = found["rigid"].get(stage)
        if k is not None and rigid is not None:
            subject, figure = (
                titled_by_stage("Load sharing, rigid bodies", stage),
                f"K = {factor(rigid)} in time",
            )
            yield Verdict("note", subject, figure, f"Beside {factor(k)} {name}.")


def balance_sentence(closure: float) -> str:
    """Whether equilibria are in balance; closure: share of the load that is left over."""
    if closure <= CLOSED:
        return "All forces are in balance."
    return f"Forces are not in balance: {said(closure, 'share')} of the load is left over."


def _errors(summary: Summary) -> Iterator[Verdict]:
    """The solver's own checks: one line of those within limits, a line for each of the others."""
    within: list[str] = []
    for verdict, sentence in _solver_checks(summary):
        if verdict.level == "good":
            within.append(sentence)
        else:
            yield verdict
    if within:
        sentence = "; ".join(dict.fromkeys(within))
        yield Verdict("good", "Solution", "within limits", f"{sentence[0].upper()}{sentence[1:]}.")


def _pin_speed(kinematics: Mapping[str, float]) -> float:
    """Of the pins against the ring, r/min; runs before 0.3 have it of rings that stand only."""
    return kinematics.get("pin_speed_rpm", kinematics["carrier_speed_rpm"])


def _solver_checks(summary: Summary) -> Iterator[tuple[Verdict, str]]:
    """Each check, and what is said of it when it is within its limit."""
    wanted = stage_figures(summary, "kinematics")
    for stage, one in stage_figures(summary, "steady").items():
        speed, expected = one["carrier_speed_rpm_mean"], _pin_speed(wanted[stage])
        away = abs(speed - expected) / (abs(expected) or abs(wanted[stage]["sun_speed_rpm"]))
        level: Level = "good" if away <= AGREES else "watch" if away <= STRAYS else "bad"
        sentence = f"The power flow gives {said(expected, 'r/min')}."
        yield (
            Verdict(level, f"Pins against ring{f', {words(stage)}' if stage else ''}",
                    said(speed, "r/min"), sentence),
            "speeds are those of the power flow",
        )  # fmt: skip
    closure = summary.get("equilibrium_closure_max")
    if closure is not None:
        level = "good" if closure <= CLOSED else "bad"
        sentence = balance_sentence(closure)
        verdict = Verdict(
            level, "Equilibria", "closed" if level == "good" else "not closed", sentence
        )
        yield verdict, "forces balance"
    for name, one in summary.get("reduction", {}).items():
        error = one.get("static_error")
        if error is not None:
            level = "good" if error <= PROMISED else "watch"
            figure = _percent(error)
            promised = _percent(PROMISED)
            sentence = f"Static error beside the full FE mesh; up to {promised} is promised."
            yield (
                Verdict(level, f"Reduced {words(name)}", figure, sentence),
                f"reduced {words(name)} errs by {figure} in statics",
            )
    residual = summary["energy_residual"]
    if residual is not None:
        level = "good" if residual <= BALANCED else "watch" if residual <= UNBALANCED else "bad"
        figure = _percent(max(residual, NEGLIGIBLE))
        sentence = "Of the energy in motion that work and losses do not account for."
        verdict = Verdict(level, "Energy balance", figure, sentence)
        below = "less than " if residual < NEGLIGIBLE else ""
        yield verdict, f"{below}{figure} of the energy is not accounted for"
    yield from _mode_checks(summary)


def _percent(share: float) -> str:
    """Of an estimate: two digits."""
    return f"{number(100.0 * share, 2)} %"


def _mode_checks(summary: Summary) -> Iterator[tuple[Verdict, str]]:
    """What the modes that are left out may change, and how far the harmonic solution is away."""
    system = summary["system"]
    band, estimate = system.get("modes_band_hz"), system["modes_estimate"]
    if band is not None:
        upto = said(band, "Hz")
        level: Level = "watch" if estimate is None else "good"
        kept = f"{system['kept_modes']} up to {said(system['modes_limit_hz'], 'Hz')}"
        verdict = Verdict(level, "Modes kept", kept, f"They do not cover the band of {upto}.")
        error = "–" if estimate is None else _percent(estimate)
        yield verdict, f"modes that are left out err by at most {error} up to {upto}"
    difference = summary["harmonic"].get("largest_difference")
    if difference is not None:
        level = "good" if difference <= AGREES else "watch"
        figure = _percent(max(difference, NEGLIGIBLE))
        sentence = "Of the largest force, by which the harmonic solution and the transient differ."
        below = "less than " if difference < NEGLIGIBLE else ""
        within = f"harmonic solution and transient differ by {below}{figure} of the largest force"
        yield Verdict(level, "Harmonic solution", figure, sentence), within
