"""Headline of bearings: the shortest basic rating life."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from flexgear.model.names import NodeName
from flexgear.model.springs import Rolling
from flexgear.model.stage_view import StageView
from flexgear.model.units import Quantity
from flexgear.results.report.wording import with_unit, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline, Level

UNIT = Quantity("life")
LOADS = {"planet_bearing_force_n": "planet bearing", "carrier_bearing_force_n": "carrier bearing"}


def _life(findings: Findings) -> Iterator[Answer]:
    over = findings.summary.get("equilibrium_window", "the positions of equilibria")
    for stage, figures in findings.summary["stages"].items():
        lives: Mapping[str, float] = figures.get("bearing_life_h", {})
        missing = _unrated(figures, lives)
        if lives:
            required = _required(findings.case.view(stage), lives)
            shares = {n: lives[n] / hours for n, hours in required.items() if hours is not None}
            name = min(shares or lives, key=lambda n: (shares or lives)[n])
            nominal = figures.get("nominal_planet_bearing_life_h")
            beside = (
                "" if nominal is None else f" Nominal, planet bearing: {with_unit(nominal, 'h')}."
            )
            without = ", ".join(words(n) for n, hours in required.items() if hours is None)
            unasked = "No required life given" + (f": {without}." if shares else ".")
            sentence = (
                f"{words(name).capitalize()}, under the constant load of the same damage over "
                f"{over}. {unasked if without else ''}{beside} {missing}"
            )
            life, limit = lives[name], required[name]
            level: Level = "note"
            figure = with_unit(life, "h")
            if limit is not None:
                figure += f" of {with_unit(limit, 'h')} required"
                if life < limit:
                    level = "bad"
                elif not (without or missing):  # else of some bearings nothing is known
                    level = "good"
            yield Answer(level, stage, life, figure, " ".join(sentence.split()), limit, over)
        elif missing:
            yield Answer("open", stage, None, "no rating given", f"Not assessed. {missing}")


def _required(view: StageView, names: Iterable[str]) -> dict[str, float | None]:
    """Required life of bearings by their names in a summary, h; None where the case has none."""
    bearings: dict[str, Rolling] = {"planet_bearing": view.stage.planet_bearing}
    bearings |= {f"carrier_bearing_{side}": seat for side, seat in view.seat_bearings.items()}
    seconds = {name: bearings[NodeName.parse(name).kind].required_life for name in names}
    return {n: None if s is None else UNIT.from_si(s, "h") for n, s in seconds.items()}


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
    "required_life of the bearing", is_least=True,
)  # fmt: skip
