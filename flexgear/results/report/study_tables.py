"""Verdicts and tables of a rating and of a tolerance study."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from flexgear.gears.rating.sheet import CAUSE, Sheet, value_of
from flexgear.model.units import RPM
from flexgear.results.rating import LIMITS, RatedPart, Rating
from flexgear.results.report.parts import Level, Row, Table, Verdict
from flexgear.results.report.wording import (
    FACTOR,
    life_text,
    number,
    rounded,
    titled_by_stage,
    with_unit,
    words,
)
from flexgear.results.tolerance_dataset import SPREADS

RATING, GEARS, SPECTRUM = "rating", "rating_gears", "spectrum"
MAX_BINS = 60  # of a spectrum that are listed
MIN_DAMAGE = 1e-6  # below which no digits are printed
EVEN = 1e-3  # relative difference of loads below which equal parts count as equally loaded
DIRECT = "direct path: computed stress at every point of the teeth, beyond ISO 6336"
POSITIONS = ("s/g", "z/b", "φ", "planet")  # symbols of the position of the largest stress
LEVELS: dict[bool | None, Level] = {None: "note", True: "good", False: "bad"}  # by holds
SYMBOLS = {"flank": "S_H", "root": "S_F", "bearing": "load factor"}


def rating_verdicts(rating: Rating) -> list[Verdict]:
    """Verdicts on the weakest flank, root and bearing of each stage, and on unassessed parts."""
    verdicts, equal = [], rating.equal
    for part in rating.weakest.values():
        subject = titled_by_stage(LIMITS[part.kind], part.stage)
        beside = equal_parts(rating, equal[part.alike])
        sentence = f"{words(part.alike)}: {beside}{_sentence(rating, part)}"
        level, group = LEVELS[part.holds], (part.stage, part.kind)
        others = [p for p in rating.ranked if (p.stage, p.kind) == group]
        unjudged = {p.alike: 0 for p in others if p.estimates}
        if level == "good" and unjudged:  # which may be weaker than by their estimates
            level = "note"
            sentence += f" Without a verdict: {', '.join(map(words, unjudged))}."
        below = {
            p.alike: p.direct["S_direct"].value for p in reversed(others) if p.is_below_directly
        }
        failing = {p.alike: _figure(p) for p in reversed(others) if p.holds is False}
        if level != "bad" and failing:  # behind a weaker part without a verdict
            level = "bad"
            listed = ", ".join(f"{words(name)} {figure}" for name, figure in failing.items())
            sentence += f" Outside limits: {listed}."
        if level != "bad" and below:
            level = "watch"
            listed = ", ".join(f"{words(name)} {number(s, 3)}" for name, s in below.items())
            sentence += f" Below the limit by the direct path, beyond ISO 6336: {listed}."
        verdicts.append(Verdict(level, subject, _figure(part), sentence, RATING))
    if rating.reliability is not None:
        figure = with_unit(rating.reliability, "share")
        text = f"Probability that no assessed part fails within {number(rating.hours)} h"
        doubtful = sum(bool(part.estimates) and not part.missing for part in rating.parts)
        text += f"; {doubtful} without a verdict count by their estimates." if doubtful else "."
        verdicts.append(Verdict("note", "Reliability", figure, text, RATING))
    verdicts += _extreme(rating)
    names = ", ".join(words(name) for name in rating.not_assessed)
    reasons = [gear_mesh.missing for gear_mesh in rating.gear_meshes]
    if reasons and all(reasons):
        first = ", ".join(dict.fromkeys(of_gear_mesh[0] for of_gear_mesh in reasons))
        more = "; what else is missing stands below" if max(map(len, reasons)) > 1 else ""
        verdicts.insert(0, Verdict("open", "Gears", "not assessed", f"{first}{more}.", RATING))
    verdicts.append(Verdict("open", "Not assessed", "", f"{names}: see below.", RATING))
    return verdicts


def _extreme(rating: Rating) -> list[Verdict]:
    """The verdict on the smallest safety of a tooth under an extreme load, if there is one."""
    every = [
        (float(part.safety[b]), part.required_in(b), part, load_bin.name)
        for part in rating.ranked
        for b, load_bin in enumerate(rating.bins)
        if load_bin.extreme and part.kind != "bearing" and math.isfinite(part.safety[b])
    ]
    if not every:
        return []
    safety, required, part, name = min(every, key=lambda x: x[0] / x[1])
    figure = f"{SYMBOLS[part.kind]} {number(safety, 3)} of {number(required)}"
    level: Level = "good" if safety >= required else "bad"
    text = f"{words(part.name)} in {name}."
    yield_ratios = [
        (sheet["S_0.2"].value, part.name, load_bin.name)
        for part in rating.ranked
        for load_bin, sheet in zip(rating.bins, part.factors, strict=True)
        if load_bin.extreme and "S_0.2" in sheet
    ]
    if yield_ratios:
        ratio, root, name = min(yield_ratios)
        text += f" Fillets of the {words(root)} yield first:"
        text += f" σ_0.2 is {number(ratio, 3)} σ_F in {name}."
    return [Verdict(level, "Extreme loads", figure, text, RATING)]


def _figure(part: RatedPart) -> str:
    """Text such as "S_H 1.12 of 1.25", "life 13 000 h (1.48 years) of 17 000 h (1.94 years)"."""
    if part.kind == "bearing":
        required = "" if math.isnan(part.required) else f" of {life_text(part.required)}"
        return f"life {life_text(part.life)}{required}"
    return f"{SYMBOLS[part.kind]} {number(part.least_safety, 3)} of {number(part.limit)}"


def equal_parts(rating: Rating, parts: Sequence[RatedPart]) -> str:
    """Text about equal parts, weakest first, such as "5 planets, worst is planet 3; "; "" for a
    single part."""
    weakest, texts = parts[0], list[str]()
    b = weakest.worst_bin if weakest.governing_bin is None else weakest.governing_bin
    even = all(math.isclose(part.load[b], weakest.load[b], rel_tol=EVEN) for part in parts)
    if len({part.side for part in parts}) > 1:
        texts.append("2 halves alike; " if even else f"2 halves, worst is the {weakest.side} one; ")
    planets = rating.case.stage(weakest.stage).planets
    if weakest.planets and planets > 1:
        planet = 0 if even and weakest.kind == "bearing" else weakest.planets[b]
        worst = f", worst is planet {planet}; " if planet else " alike; "
        texts.append(f"{planets} planets{worst}")
    return "".join(texts)


def _sentence(rating: Rating, part: RatedPart) -> str:
    """Load case of the smallest safety, damage, and the load case with most of the damage."""
    worst, at, total = rating.bins[part.worst_bin].name, part.governing_bin, part.damage_sum
    texts = [] if at is None or part.kind == "bearing" else [f"least in {rating.bins[at].name}"]
    if (direct := value_of(part.direct, "S_direct")) < part.least_safety:
        texts.append(f"{number(direct, 3)} by the direct path")
    if math.isnan(total):
        texts.append(f"no load case with a duration, most loaded in {worst}")
    elif math.isinf(total):
        texts.append(f"above static strength in {worst}")
    elif total < MIN_DAMAGE:
        texts.append("damage below 10⁻⁶")
    else:
        share = with_unit(part.damage[part.worst_bin] / total, "share")
        texts.append(f"damage {rounded(total)}, {share} of it in {worst}")
        texts += [f"largest load factor there {part.cause}"] if part.cause else []
        if part.of_rows.size > 1:
            row = int(part.of_rows.argmax())
            texts.append(f"row {row + 1} of {part.of_rows.size} alone {rounded(part.of_rows[row])}")
        texts += [] if part.kind == "bearing" else [f"life {life_text(part.life)}"]
    if {"R", "Y_M"} <= (lines := part.factors[part.worst_bin]).keys():
        mean_stress = number(lines["Y_M"].value, 3)
        texts.append(f"Y_M {mean_stress} by loads of both senses, whose changes are not counted")
    static = [s for s in part.safety.tolist() if math.isfinite(s)]
    if part.kind == "bearing" and static:
        texts.append(f"static safety {number(min(static), 3)}")
    sheets = [x for g in rating.gear_meshes if g.name.stage == part.stage for x in g.factors]
    applied = {value_of(sheet, "K_A", 1.0) for sheet in sheets} - {1.0}
    if part.kind == "bearing" and applied:
        texts.append(f"loads without K_A {number(max(applied))}")
    if part.kind == "bearing" and not any(
        {"L_nmr", "L_nm"} & sheet.keys() for sheet in part.factors
    ):
        by_radial = any("L_10" in x and "P" not in x for x in part.factors)
        alone = " of the radial load alone" if by_radial else ""
        texts.append(f"basic life{alone}, without the lubricant's factor a_ISO")
    couples = [2.0 * x["F_M"].value / x["F_r"].value for x in part.factors if "F_M" in x]
    if couples:
        share = with_unit(max(couples), "share")
        texts.append(f"the moment does not count, which is {share} of the radial load on each half")
    if part.estimates:
        reasons = ", ".join(f"{spelled(key)} {rule}" for key, rule in part.estimates.items())
        texts.append(f"no verdict: {reasons}")
    return f"{'; '.join(texts)}."


def rating_tables(rating: Rating, parts: bool = True) -> list[Table]:
    """Tables of a rating; parts: whether they include every factor of every part."""
    listed = [
        Row(
            words(name),
            f"{_figure(p[0])}, load reserve {number(p[0].reserve, 3)}; "
            f"{equal_parts(rating, p)}{_sentence(rating, p[0])}",
        )
        for name, p in rating.equal.items()
        if not p[0].missing
    ]
    missing = [Row(words(name), why) for name, why in rating.not_assessed.items()]
    every = [
        Table(RATING, "weakest part first, with the factor on all loads within its limits", listed),
        *(_one_by_one(rating) if parts else ()),
        Table(RATING, DIRECT, [_direct(p[0]) for p in rating.equal.values() if p[0].direct]),
        Table(RATING, "not assessed", missing),
        Table(SPECTRUM, "load bins", list(_bins(rating))),
        *_gear_meshes(rating),
        *(_parts(rating) if parts else ()),
    ]
    return [table for table in every if table.rows]


def _one_by_one(rating: Rating) -> Iterator[Table]:
    """Folded tables of the single parts of each set of equal parts."""
    for name, parts in rating.equal.items():
        if len(parts) > 1 and not parts[0].missing:
            rows = [Row(words(p.name), f"{_figure(p)}; {_sentence(rating, p)}") for p in parts]
            yield Table(RATING, f"{words(name)}, one by one", rows, folded=True)


def _direct(part: RatedPart) -> Row:
    """Row such as "safety 1.17, norm 1.27; stress 1.12 of the norm: form 1.17; at z/b -0.13"."""
    lines = part.direct
    causes = ", ".join(f"{s} {number(f.value, 3)}" for s, f in lines.items() if f.meaning == CAUSE)
    where = [f"{s} {with_unit(f.value, f.unit)}" for s, f in lines.items() if s in POSITIONS]
    return Row(
        words(part.name),
        f"safety {number(lines['S_direct'].value, 3)}, norm {number(part.least_safety, 3)}; stress "
        f"{number(lines['σ_direct/σ'].value, 3)} of the norm: {causes}; at {', '.join(where)}",
    )


def _bins(rating: Rating) -> Iterator[Row]:
    first = rating.case.inputs[0].member
    for load_bin in rating.bins[:MAX_BINS]:
        hours = f"{number(load_bin.hours)} h" if load_bin.hours else "no duration"
        how_long = "extreme" if load_bin.extreme else hours
        torque = with_unit(load_bin.torque[first], "N m")
        speed = f"{number(load_bin.speed[first] * RPM)} r/min"
        loads = ", ".join(words(load.member) for load in load_bin.loads)
        loads_text = f", loads on {loads}" if loads else ""
        yield Row(load_bin.name, f"{torque}, {speed}, {how_long}{loads_text}")
    if len(rating.bins) > MAX_BINS:
        yield Row("and more", len(rating.bins) - MAX_BINS)


def _gear_meshes(rating: Rating) -> Iterator[Table]:
    """Load factors of each group of gear meshes, in the load bin that does most damage to the gears
    of its stage; among bins of equal damage, in the one with the largest torque."""
    first = rating.case.inputs[0].member
    for gear_mesh in rating.gear_meshes:
        stage, damage = gear_mesh.name.stage, np.zeros(len(rating.bins))
        for part in rating.parts:
            if part.kind != "bearing" and part.stage == stage:
                damage += np.nan_to_num(part.damage, posinf=math.inf)
        loaded = [b for b, factors in enumerate(gear_mesh.factors) if factors]
        if loaded:
            b = max(loaded, key=lambda b: (damage[b], abs(rating.bins[b].torque[first])))
            title = f"{words(gear_mesh.name)}, load factors in {rating.bins[b].name}"
            pair = gear_mesh.name.kind == "pinion"
            factors = gear_mesh.factors[b].items()
            yield Table(
                GEARS, title, _rows({k: f for k, f in factors if not (pair and k == "K_γ")})
            )


def _parts(rating: Rating) -> Iterator[Table]:
    """Factors of each part in its worst bin; of equal parts all but the weakest are folded."""
    equal = rating.equal
    for part in rating.parts:
        b, folded = part.worst_bin, part is not equal[part.alike][0]
        title = f"{words(part.name)} in {rating.bins[b].name}"
        section = "bearings" if part.kind == "bearing" else GEARS
        yield Table(section, title, _rows(part.factors[b]), folded)
        yield Table(section, f"{words(part.name)}, direct path", _rows(part.direct), folded)


def _rows(sheet: Sheet) -> list[Row]:
    """Rows with labels such as "K_γ, load sharing of the planets (computed, planet 3)"."""
    lines = sheet.items()
    return [Row(f"{symbol}, {f.meaning} ({f.source})", f.value, f.unit) for symbol, f in lines]


def in_words(table: Table) -> Table:
    """The table with names written as words, for pages."""
    rows = [
        Row(spelled(r.label), spelled(r.value) if isinstance(r.value, str) else r.value, r.unit)
        for r in table.rows
    ]
    return replace(table, title=spelled(table.title), rows=rows)


def spelled(text: str) -> str:
    """A text with names written as words: "wind_4" -> "wind 4"; keys and symbols of one letter
    remain: "key static_rating", "m_n"."""
    name = r"(?<!\bkey )(?<!\.)\b[a-z][a-z0-9]+(?:_[a-z0-9]+)+\b"
    return re.sub(name, lambda match: match[0].replace("_", " "), text)


TOLERANCE = "tolerance"
_MAX_SHARE = 0.05  # of sets above the standard's value for a good verdict


def tolerance_tables(summary: Mapping[str, Any]) -> list[Table]:
    """Tables of the scatter of each figure of a tolerance study, by group of gear meshes; summary:
    that of ``tolerance_summary``."""
    drawn = [
        Row("sets of parts", summary["samples"]),
        Row("of them without an equilibrium, left out", summary["failed"]),
        Row("seed of the random numbers", str(summary["seed"])),
    ]
    tables = [Table(TOLERANCE, "what was drawn", drawn)]
    interval = f"{100 * summary['confidence']:g} % interval"
    for spread in SPREADS.values():
        for group, figures in summary.get(spread.key, {}).items():
            caption = f"{words(group)}, {spread.meaning} ({interval})"
            tables.append(Table(TOLERANCE, caption, list(_spread(figures, spread.printed))))
    return tables


def _spread(figures: Mapping[str, Any], unit: str) -> Iterator[Row]:
    of_value = unit or FACTOR
    yield Row("errors as stated", figures["as_stated"], of_value)
    yield Row("mean", _estimate(figures["mean"], of_value))
    yield Row("standard deviation", figures["standard_deviation"], unit)
    for percent, quantile in figures["quantiles"].items():
        yield Row(f"{percent} % of sets stay below", _estimate(quantile, of_value))
    if figures.get("iec_61400_4") is not None:
        yield Row("assumed by IEC 61400-4", figures["iec_61400_4"], FACTOR)
        yield Row("sets above it", _estimate(figures["share_above_iec_61400_4"], "share"))


def _estimate(estimate: Mapping[str, Any] | None, unit: str) -> str:
    """Text of an estimate with its confidence interval."""
    if estimate is None:
        return "–"
    value, low, high = (with_unit(estimate[name], unit) for name in ("value", "low", "high"))
    return f"{value} ({low} … {high})"


def tolerance_verdicts(summary: Mapping[str, Any]) -> list[Verdict]:
    """Verdicts on the samples above the value of IEC 61400-4, one for groups with equal verdicts,
    and on samples without equilibrium."""
    groups: dict[Verdict, list[str]] = {}
    for group, figures in summary["load_sharing"].items():
        groups.setdefault(_verdict(figures), []).append(words(group))
    verdicts = [
        replace(verdict, subject=f"{verdict.subject}, {', '.join(of)}")
        for verdict, of in groups.items()
    ]
    if summary["failed"]:
        text = f"{summary['failed']} of {summary['samples']} sets"
        verdicts.append(Verdict("bad", "equilibrium", text, "They have none and are left out."))
    return verdicts


def _verdict(figures: Mapping[str, Any]) -> Verdict:
    """The verdict on a group, without the name of the group."""
    subject, above = "load sharing", figures.get("share_above_iec_61400_4")
    if above is None:
        mean = figures["mean"]
        text = "–" if mean is None else f"K {number(mean['value'])} in the mean"
        return Verdict("note", subject, text, "IEC 61400-4 states no limit.")
    limit = number(figures["iec_61400_4"])
    sentence = f"These sets have a larger K than the {limit} that IEC 61400-4 assumes."
    level: Level = "good" if above["high"] is not None and above["high"] <= _MAX_SHARE else "watch"
    if level == "watch" and above["value"] <= _MAX_SHARE:
        high = "more" if above["high"] is None else f"up to {with_unit(above['high'], 'share')}"
        sentence += f" The share of all sets may be {high}: draw more samples."
    return Verdict(level, subject, f"{with_unit(above['value'], 'share')} of sets", sentence)
