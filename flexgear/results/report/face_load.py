"""Tables of the load along the face, from the summary of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from flexgear.model.names import FlankName
from flexgear.results.face_load import CYCLE_FIGURES, FLANK_FIGURES, misalignment_of_groups
from flexgear.results.figure import Figure
from flexgear.results.report.figure_rows import row
from flexgear.results.report.parts import Row, Table
from flexgear.results.report.wording import words

ORDERS = {
    "transmission_error_orders_um": "transmission error",
    "unloaded_transmission_error_orders_um": "unloaded transmission error",
}
STIFFNESS = "gear_mesh_stiffness_n_per_um"
SHOWN = 3  # orders of the gear mesh


def face_tables(summary: Mapping[str, Any]) -> Iterator[Table]:
    """By variant: every group of gear meshes over a turn, causes of misalignment, gear-mesh cycles;
    of its planets the largest. Of runs of earlier versions what they hold of it."""
    for variant, flanks in summary.get("face_load", {}).items():
        groups: dict[str, list[Mapping[str, Any]]] = {}
        for flank, values in flanks.items():
            groups.setdefault(words(FlankName.parse(flank).group), []).append(values)
        rows = [r for name, every in groups.items() for r in _largest(name, every, FLANK_FIGURES)]
        yield Table("face", f"{variant}, equilibria, largest of the planets", rows)
        split = {n: values for n, values in flanks.items() if "misalignment_by_cause_um" in values}
        causes = [
            Row(f"{words(group)}, {cause}", 1e-6 * size, "m")
            for group, shares in misalignment_of_groups(split).items()
            for cause, size in shares.items()
        ]
        title = f"{variant}, misalignment over the face by cause, planet misaligned most"
        yield Table("face", title, causes)
        rows = [r for name, every in groups.items() for r in _of_cycles(name, every)]
        yield Table(
            "face", f"{variant}, gear-mesh cycles without errors, largest of the planets", rows
        )


def rim_rows(reduction: Mapping[str, Any]) -> Iterator[Row]:
    """Of a ring's reduction: how much of a tooth's bending along the face its rim adds, and whether
    tooth pairs take it in."""
    if "rim_error" in reduction:
        rim_text = "counted" if reduction["rim_counts"] else "left out"
        label = f"bending of the rim along the face within a tooth, of the tooth's own ({rim_text})"
        yield Row(label, reduction["rim_error"], "share")


def _largest(
    name: str, every: Sequence[Mapping[str, Any]], figures: Sequence[Figure]
) -> Iterator[Row]:
    """Rows of figures, of several flanks the largest of each."""
    for figure in figures:
        sizes = [of_flank[figure.path] for of_flank in every if figure.path in of_flank]
        if figure.label and sizes:
            largest = row(figure, max(sizes, key=abs))
            yield replace(largest, label=f"{name}, {largest.label}")


def _of_cycles(name: str, every: Sequence[Mapping[str, Any]]) -> Iterator[Row]:
    """What ``gear_mesh_cycles`` found; nothing of flanks that do not carry throughout."""
    stiffness = [flank_figures[STIFFNESS] for flank_figures in every if STIFFNESS in flank_figures]
    for key, pick in (("min", min), ("mean", max), ("max", max)):
        if stiffness:
            size = pick(flank_figures[key] for flank_figures in stiffness)
            yield Row(f"{name}, stiffness of the gear mesh, {key}", 1e6 * size, "N/m")
    yield from _largest(name, every, CYCLE_FIGURES)
    for key, label in ORDERS.items():
        amplitudes = zip(
            *(flank_figures[key][:SHOWN] for flank_figures in every if key in flank_figures),
            strict=True,
        )
        for order, sizes in enumerate(amplitudes, 1):
            yield Row(f"{name}, {label}, order {order}", 1e-6 * max(sizes), "m")
