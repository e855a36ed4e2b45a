"""Headline of bearings: the shortest basic rating life."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from flexgear.model.names import NodeName
from flexgear.results.report.wording import with_unit, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline

LOADS = {"planet_bearing_force_n": "planet bearing", "carrier_bearing_force_n": "carrier bearing"}


def _life(findings: Findings) -> Iterator[Answer]:
    over = findings.summary.get("equilibrium_window", "the positions of equilibria")
    for stage, figures in findings.summary["stages"].items():
        lives: Mapping[str, float] = figures.get("bearing_life_h", {})
        missing = _unrated(figures, lives)
        if lives:
            name = min(lives, key=lambda n: lives[n])
            nominal = figures.get("nominal_planet_bearing_life_h")
            beside = (
                "" if nominal is None else f" Nominal, planet bearing: {with_unit(nominal, 'h')}."
            )
            sentence = (
                f"{words(name).capitalize()}, under the constant load of the same damage over "
                f"{over}. No required life given.{beside} {missing}"
            )
            life = lives[name]
            yield Answer("note", stage, life, with_unit(life, "h"), sentence.strip(), window=over)
        elif missing:
            yield Answer("open", stage, None, "no rating given", f"Not assessed. {missing}")


def _unrated(figures: Mapping[str, Any], lives: Mapping[str, float]) -> str:
    """Bearings that have no life, with their loads."""
    loads, rated = [], {NodeName.parse(name).kind for name in lives}
    for key, name in LOADS.items():
        rating = figures.get(key, {})
        sides = rating if isinstance(rating, Mapping) else {"": rating}
        for side, load in sides.items():
            if load and f"{name} {side}".strip().replace(" ", "_") not in rated:
                at = f", {words(side)} side" if side else ""
                loads.append(f"{name}{at} ({with_unit(load, 'N')})")
    return f"No dynamic rating given: {', '.join(loads)}." if loads else ""


BEARING_LIFE = Headline(
    "bearing_life", "Bearing life", "h",
    "shortest basic rating life (ISO 281) of the bearings of planets and carriers, under the "
    "constant load of the same damage over the positions of equilibria", "bearings", _life,
)  # fmt: skip
