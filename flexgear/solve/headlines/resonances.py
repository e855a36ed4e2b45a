"""Headline of resonance: what meets natural frequencies at the operating speeds."""

from __future__ import annotations

from collections.abc import Iterator

from flexgear.solve.headlines.declaration import Answer, Findings, Headline
from flexgear.solve.resonance import resonance_verdict


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
