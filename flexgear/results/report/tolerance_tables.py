"""What the report says of a tolerance study: tables and verdicts from its summary."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from flexgear.results.report.parts import Level, Row, Table, Verdict
from flexgear.results.report.wording import number, with_unit, words

SECTION = "tolerance"
_SPREADS = (  # key of the summary, what it is, unit
    ("load_sharing", "largest load sharing factor K over one turn of the carrier", ""),
    ("k_h_beta", "largest face load factor K_Hβ", ""),
    ("largest_line_load_n_per_mm", "largest line load", "N/mm"),
)
_RARE = 0.05  # share of sets above the standard's value that is let pass


def tolerance_tables(summary: Mapping[str, Any]) -> list[Table]:
    """Spread of every figure of the study by group of gear meshes; summary:
    ``tolerance_summary``."""
    drawn = [
        Row("sets of parts", summary["samples"]),
        Row("of them without an equilibrium, left out", summary["failed"]),
        Row("seed of the random numbers", str(summary["seed"])),
    ]
    tables = [Table(SECTION, "what was drawn", drawn)]
    for key, about, unit in _SPREADS:
        for group, figures in summary.get(key, {}).items():
            rows = list(_spread(figures, unit, summary["confidence"]))
            tables.append(Table(SECTION, f"{words(group)}, {about}", rows))
    return tables


def _spread(figures: Mapping[str, Any], unit: str, confidence: float) -> Iterator[Row]:
    yield Row("errors as stated", figures["as_stated"], unit)
    yield Row("mean", (figures["mean"] or {}).get("value"), unit)
    yield Row("standard deviation", figures["standard_deviation"], unit)
    for percent, quantile in figures["quantiles"].items():
        yield Row(f"{percent} % of sets stay below", (quantile or {}).get("value"), unit)
        if quantile is not None:
            ends = " … ".join(with_unit(quantile[end]) for end in ("low", "high"))
            yield Row(
                f"{percent} % of sets, {100 * confidence:g} % interval", f"{ends} {unit}".rstrip()
            )
    if figures.get("iec_61400_4") is not None:
        yield Row("assumed by IEC 61400-4", figures["iec_61400_4"])
        above = figures["share_above_iec_61400_4"]
        yield Row("sets above it", None if above is None else above["value"], "share")


def tolerance_verdicts(summary: Mapping[str, Any]) -> list[Verdict]:
    """How many sets exceed what IEC 61400-4 assumes, by group, and sets that have no
    equilibrium."""
    verdicts = [
        _verdict(words(group), figures) for group, figures in summary["load_sharing"].items()
    ]
    if summary["failed"]:
        text = f"{summary['failed']} of {summary['samples']} sets"
        verdicts.append(Verdict("bad", "equilibrium", text, "They have none and are left out."))
    return verdicts


def _verdict(group: str, figures: Mapping[str, Any]) -> Verdict:
    subject, above = f"load sharing, {group}", figures.get("share_above_iec_61400_4")
    if above is None:
        mean = figures["mean"]
        text = "–" if mean is None else f"K {number(mean['value'])} in the mean"
        return Verdict("note", subject, text, "IEC 61400-4 states no value to hold it to.")
    limit = number(figures["iec_61400_4"])
    level: Level = "good" if above["high"] is not None and above["high"] <= _RARE else "watch"
    return Verdict(
        level, subject, f"{with_unit(above['value'], 'share')} of sets",
        f"So many have a larger K than the {limit} that IEC 61400-4 assumes.",
    )  # fmt: skip
