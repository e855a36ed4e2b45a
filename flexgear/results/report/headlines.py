"""Lengths of the first screen: how far members and rings move, and by how much teeth stay behind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flexgear.results.report.sharing import own_variant
from flexgear.results.report.tables import stage_figures
from flexgear.results.report.wording import window_words, words

ROUNDING = 1e-6  # of the largest length
LEAST_ORDER = 2  # of a ring's shape: 0 is its size, 1 its place


@dataclass(frozen=True)
class Headline:
    """A figure with its name and what it is the largest of; stage: that it belongs to; value: m."""

    subject: str
    stage: str
    value: float
    sentence: str


def headlines(summary: Mapping[str, Any]) -> Iterator[Headline]:
    """Of a run, the most important first; those that are zero but for rounding are none."""
    lengths = [*_distance(summary), *_rings(summary), *_transmission_error(summary)]
    largest = max((one.value for one in lengths), default=0.0)
    yield from (one for one in lengths if one.value > ROUNDING * largest)


def titled_by_stage(what: str, stage: str) -> str:
    """A title with its stage, but for the only one, which the short form calls "stage"."""
    return what if stage in ("", "stage") else f"{what}, {words(stage)}"


def _distance(summary: Mapping[str, Any]) -> Iterator[Headline]:
    transient = summary["transient"]
    far = transient["displacement_um_max"]
    if far:
        name = max(far, key=lambda n: far[n])
        sentence = f"{words(name).capitalize()}, {window_words(transient)}."
        stage = name.rpartition(".")[0]
        yield Headline("Largest distance from the axis", stage, 1e-6 * far[name], sentence)


def _rings(summary: Mapping[str, Any]) -> Iterator[Headline]:
    for stage, one in stage_figures(summary, "steady").items():
        orders = one["radial_harmonics_um"]
        order = max(range(LEAST_ORDER, len(orders)), key=lambda n: orders[n])
        yield Headline(
            titled_by_stage("Ring shape", stage), stage or "stage", 1e-6 * orders[order],
            f"Radial amplitude of its largest wave, {order} round the ring, in equilibrium.",
        )  # fmt: skip
        peaks = one["tooth_displacement_peak_um"]
        axis = max(peaks, key=lambda n: peaks[n])
        yield Headline(
            titled_by_stage("Ring tooth", stage), stage or "stage", 1e-6 * peaks[axis],
            f"Largest displacement of tooth node 1 along {axis}, {window_words(one)}.",
        )  # fmt: skip


def _transmission_error(summary: Mapping[str, Any]) -> Iterator[Headline]:
    largest: dict[str, tuple[float, str]] = {}
    for flank, one in own_variant(summary.get("face_load", {})).items():
        size = one.get("transmission_error_peak_to_peak_um")
        stage = flank.partition(" ")[0]
        if size is not None and size > largest.get(stage, (0.0, ""))[0]:
            largest[stage] = size, flank
    for stage, (size, flank) in largest.items():
        sentence = f"Peak to peak over the equilibria, largest at {words(flank)}."
        subject = titled_by_stage("Transmission error", stage)
        yield Headline(subject, stage, 1e-6 * size, sentence)
