"""Headline of bearings: the shortest basic rating life."""

from __future__ import annotations

from collections.abc import Iterator

from flexgear.results.report.wording import said, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline


def _life(findings: Findings) -> Iterator[Answer]:
    for stage, figures in findings.summary["stages"].items():
        lives = {
            f"carrier bearing, {words(side)} side": life
            for side, life in figures.get("carrier_bearing_life_h", {}).items()
        }
        if "planet_bearing_life_h" in figures:
            lives["planet bearing"] = figures["planet_bearing_life_h"]
        loads = {
            f"carrier bearing, {words(side)} side": load
            for side, load in figures.get("carrier_bearing_force_n", {}).items()
        }
        if "planet_bearing_force_n" in figures:
            loads = {"planet bearing": figures["planet_bearing_force_n"], **loads}
        unrated = ", ".join(
            f"{name} ({said(load, 'N')})" for name, load in loads.items() if name not in lives
        )
        missing = f"No dynamic rating given: {unrated}." if unrated else ""
        if lives:
            name = min(lives, key=lambda n: lives[n])
            sentence = f"{name.capitalize()}, at rated torque. No required life given. {missing}"
            life = lives[name]
            yield Answer("note", stage, life, said(life, "h"), sentence.strip())
        elif loads:
            yield Answer("open", stage, None, "no rating given", f"Not assessed. {missing}")


BEARING_LIFE = Headline(
    "bearing_life", "Bearing life", "h",
    "shortest basic rating life (ISO 281) of the bearings of planets and carriers", "bearings",
    _life,
)  # fmt: skip
