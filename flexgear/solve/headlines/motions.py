"""Headlines of motion: deflections, transmission error, neglected effects, resonance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from flexgear.results.report.wording import number, window_words, with_unit, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline, Level
from flexgear.solve.resonance import resonance_verdict
from flexgear.solve.result_warnings import (
    CONSEQUENCE,
    EFFECTS,
    Length,
    effects_of,
    motion_shares,
    motions_of_summary,
    transmission_errors,
)


def _deflections(findings: Findings) -> Iterator[Answer]:
    summary = findings.summary
    motions = motions_of_summary(summary)
    window = f"in equilibria and {window_words(summary['transient'])}"
    for stage, shares in motion_shares(findings.case, motions).items():
        worst = max(shares, key=lambda s: s.size / s.limit)
        farthest = max(shares, key=lambda s: s.size)
        sentence = (
            f"{words(worst.body).capitalize()}, {_share(worst.size / worst.limit)} of the limit "
            f"for small displacements beside {worst.beside}; {window}."
        )
        if farthest.body != worst.body:
            sentence += f" Largest: {words(farthest.body)}, {with_unit(farthest.size, 'm')}."
        if worst.size > worst.limit:
            sentence += f" {CONSEQUENCE}"
        shown = f"{with_unit(worst.size, 'm')} of {with_unit(worst.limit, 'm')}"
        level: Level = "good" if worst.size <= worst.limit else "bad"
        size, limit = 1e6 * worst.size, 1e6 * worst.limit
        yield Answer(level, stage, size, shown, sentence, limit, window)


def _share(ratio: float) -> str:
    return f"{number(100.0 * ratio, 2)} %"


def _transmission_error(findings: Findings) -> Iterator[Answer]:
    for length in transmission_errors(findings.summary):
        shown = with_unit(length.value, "m")
        yield Answer("note", length.stage, 1e6 * length.value, shown, length.sentence)


def _neglected(findings: Findings) -> Iterator[Answer]:
    """Effects that are left out beside the figures that they are not small against."""
    rows = findings.summary.get("neglected", ())
    by_stage: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        by_stage.setdefault(str(row.get("stage", "")), []).append(row)
    for stage, of_stage in by_stage.items():
        effects: dict[str, float] = {}
        for row in of_stage:
            effects |= row["effects_um"]
        lengths = [r for r in of_stage if "value_um" in r]
        beside = [Length(r["figure"], "", 1e-6 * r["value_um"], "") for r in lengths]
        named = ", ".join(f"{x.subject.lower()} {with_unit(x.value, 'm')}" for x in beside)
        sizes = ", ".join(f"{EFFECTS[n]} up to {number(x, 3)} µm" for n, x in effects.items())
        sentences = [f"{sizes[0].upper()}{sizes[1:]}."]
        sentences += [f"They exceed a tenth of: {named}."] if named else []
        sentences += [r["sentence"] for r in of_stage if "load_sharing" in r]
        shown = f"up to {number(max(effects.values()), 3)} µm"
        yield Answer("watch", stage, max(effects.values()), shown, " ".join(sentences))
    case, flow = findings.case, findings.flow
    small = {name for s in case.stages for name in effects_of(case, flow, s.name)}
    if small and not by_stage:
        about = " and ".join(text for name, text in EFFECTS.items() if name in small)
        yield Answer("good", "", None, "small", f"Up to a tenth of the figures: {about}.")


DEFLECTIONS = Headline(
    "deflections", "Deflections", "µm",
    "displacement of the member that uses most of what its gears allow", "deflections",
    _deflections,
    "a tenth of the module, the room between tips and roots, with linear contact the backlash",
)  # fmt: skip
TRANSMISSION_ERROR = Headline(
    "transmission_error", "Transmission error", "µm",
    "largest peak to peak of a gear mesh over the equilibria", "face", _transmission_error,
)  # fmt: skip
NEGLECTED = Headline(
    "neglected_effects", "Neglected effects", "µm",
    "largest effect that the models leave out and that is not small against a figure", "accuracy",
    _neglected, "a tenth of the figure",
)  # fmt: skip


def _resonance(findings: Findings) -> Iterator[Answer]:
    figures = findings.summary.get("resonance")  # runs before 0.3 have none
    if figures is not None:
        level, shown, sentence = resonance_verdict(figures)
        nearest = min((abs(row["away"]) for row in figures["met"]), default=None)
        yield Answer(level, "", nearest, shown, sentence, None)


RESONANCE = Headline(
    "resonance", "Resonance", "1",
    "least distance of an excitation at an operating speed from a natural frequency that it meets, "
    "over that frequency; null: none within the margin", "modes", _resonance,
)  # fmt: skip
