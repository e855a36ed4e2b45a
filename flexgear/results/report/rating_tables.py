"""What the report says of a rating: verdicts and tables, the weakest part first."""

from __future__ import annotations

import math
from collections.abc import Iterator

from flexgear.gears.rating.rate import Factor
from flexgear.model.units import RPM
from flexgear.results.rating import LIMITS, RatedPart, Rating
from flexgear.results.report.parts import Level, Row, Table, Verdict
from flexgear.results.report.wording import number, titled_by_stage, with_unit, words

SECTION, GEARS, SPECTRUM = "rating", "rating_gears", "spectrum"
MOST_BINS = 60  # of a spectrum that are listed
LONGEST, LEAST = 1e7, 1e-6  # life in h, and damage, beyond which no digits are printed
SYMBOLS = {"flank": "S_H", "root": "S_F", "bearing": "load factor"}


def rating_verdicts(rating: Rating) -> list[Verdict]:
    """The weakest flank, root and bearing of every stage, and what is not assessed."""
    verdicts, seen = [], set()
    for part in rating.ranked:
        if (part.stage, part.kind) not in seen:
            seen.add((part.stage, part.kind))
            subject = titled_by_stage(LIMITS[part.kind], part.stage)
            sentence = f"{words(part.name)}: {_sentence(rating, part)}"
            verdicts.append(Verdict(_level(part), subject, _figure(part), sentence, SECTION))
    if rating.reliability is not None:
        figure = with_unit(rating.reliability, "share")
        text = f"That no part of the gearbox fails within {number(rating.hours)} h."
        verdicts.append(Verdict("note", "Reliability", figure, text, SECTION))
    names = ", ".join(words(name) for name in rating.not_assessed)
    verdicts.append(Verdict("open", "Not assessed", "", f"{names}: see below.", SECTION))
    return verdicts


def _level(part: RatedPart) -> Level:
    holds = part.holds
    return "note" if holds is None else "good" if holds else "bad"


def _figure(part: RatedPart) -> str:
    """ "S_H 1.12 of 1.25", "life 1.3e5 h of 1.7e5 h"."""
    if part.kind == "bearing":
        asked = "" if math.isnan(part.required) else f" of {_hours(part.required)}"
        return f"life {_hours(part.life)}{asked}"
    return f"{SYMBOLS[part.kind]} {number(part.least_safety, 3)} of {number(part.required)}"


def _sentence(rating: Rating, part: RatedPart) -> str:
    """Where the least safety is from, damage, life, and which bin makes most of it."""
    worst, at = rating.bins[part.worst_bin].name, part.governing_bin
    governed = "" if at is None or part.kind == "bearing" else f"least in {rating.bins[at].name}; "
    return governed + _damage(rating, part, worst)


def _damage(rating: Rating, part: RatedPart, worst: str) -> str:
    if not math.isfinite(part.damage_sum):
        over = "above static strength" if part.damage_sum > 0 else "no load case with a duration"
        return f"{over}, most loaded in {worst}."
    if part.damage_sum == 0.0:
        return f"no damage; {worst} loads it most."
    share = with_unit(part.damage[part.worst_bin] / part.damage_sum, "share")
    life = "" if part.kind == "bearing" else f", life {_hours(part.life)}"
    text = (
        f"damage {number(part.damage_sum)} in {_hours(rating.hours)}{life}; {worst} makes {share}"
    )
    return f"{text} of it."


def _hours(value: float) -> str:
    return "over 10⁷ h" if value >= LONGEST else f"{number(value, 3)} h"


def rating_tables(rating: Rating) -> list[Table]:
    """All tables of a rating."""
    listed = [Row(words(p.name), f"{_figure(p)}; {_sentence(rating, p)}") for p in rating.ranked]
    reserves = [Row(words(p.name), p.reserve) for p in rating.ranked if math.isfinite(p.reserve)]
    missing = [Row(words(name), why) for name, why in rating.not_assessed.items()]
    every = [
        Table(SECTION, "weakest part first", listed),
        Table(SECTION, "factor on all loads within the limits", reserves),
        Table(SECTION, "not assessed", missing),
        Table(SPECTRUM, "load bins", list(_bins(rating))),
        *_gear_meshes(rating),
        *_parts(rating),
    ]
    return [table for table in every if table.rows]


def _bins(rating: Rating) -> Iterator[Row]:
    first = rating.case.inputs[0].member
    for load_bin in rating.bins[:MOST_BINS]:
        how_long = "extreme" if load_bin.extreme else f"{number(load_bin.hours)} h"
        torque = with_unit(load_bin.torque[first], "N m")
        speed = f"{number(load_bin.speed[first] * RPM)} r/min"
        loads = ", ".join(words(load.member) for load in load_bin.loads)
        beside = f", loads on {loads}" if loads else ""
        yield Row(load_bin.name, f"{torque}, {speed}, {how_long}{beside}")
    if len(rating.bins) > MOST_BINS:
        yield Row("and more", len(rating.bins) - MOST_BINS)


def _gear_meshes(rating: Rating) -> Iterator[Table]:
    """Load factors of every group of gear meshes in the bin in which they are largest."""
    for gear_mesh in rating.gear_meshes:
        loaded = [b for b, factors in enumerate(gear_mesh.factors) if factors]
        if loaded:
            torque = [abs(rating.bins[b].torque[rating.case.inputs[0].member]) for b in loaded]
            b = loaded[torque.index(max(torque))]
            title = f"{words(gear_mesh.name)}, load factors in {rating.bins[b].name}"
            yield Table(GEARS, title, [_row(f) for f in gear_mesh.factors[b]])


def _parts(rating: Rating) -> Iterator[Table]:
    """Every factor of every part, in the bin that damages it most."""
    for part in rating.parts:
        b = part.worst_bin
        title = f"{words(part.name)} in {rating.bins[b].name}"
        section = "bearings" if part.kind == "bearing" else GEARS
        yield Table(section, title, [_row(f) for f in part.factors[b]] if part.factors else [])


def _row(factor: Factor) -> Row:
    """ "K_γ, load sharing (computed, planet 3)"."""
    label = f"{factor.symbol}, {factor.meaning} ({factor.source})"
    unit = {"MPa": "MPa", "1": ""}.get(factor.unit, factor.unit)
    return Row(label, factor.value, unit)
