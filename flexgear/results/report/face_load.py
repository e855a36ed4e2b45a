"""Tables of the load along the face, from the summary of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from flexgear.model.names import FlankName
from flexgear.results.face_load import misalignment_of_groups
from flexgear.results.report.parts import Row, Table
from flexgear.results.report.wording import words

# key of a figure -> what it is, unit, and by what it comes into that unit
OF_FLANK = {
    "k_h_beta": ("face load factor K_Hβ (ISO 6336-1)", "", 1.0),
    "k_h_alpha": ("transverse load factor K_Hα (ISO 6336-1)", "", 1.0),
    "instantaneous_peak_factor": ("largest over mean line load at any instant", "", 1.0),
    "largest_line_load_n_per_mm": ("largest line load", "N/mm", 1.0),
    "tip_line_load_n_per_mm": ("largest line load off the path of contact", "N/mm", 1.0),
    "tip_contact_positions": ("edge contact of tips, of the positions", "share", 1.0),
    "face_end_line_load_n_per_mm": ("largest line load at an end of the face", "N/mm", 1.0),
    "face_end_contact_positions": ("edge contact of face ends, of the positions", "share", 1.0),
    "largest_contact_pressure_mpa": ("largest Hertz pressure", "Pa", 1e6),
    "misalignment_um": ("misalignment over the face", "m", 1e-6),
    "transmission_error_peak_to_peak_um": ("transmission error peak to peak", "m", 1e-6),
    "unloaded_transmission_error_peak_to_peak_um": ("the same unloaded", "m", 1e-6),
}
OF_CYCLES = {
    "transmission_error_cycle_peak_to_peak_um": ("transmission error peak to peak", "m", 1e-6),
    "unloaded_transmission_error_cycle_peak_to_peak_um": ("the same unloaded", "m", 1e-6),
}
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
        rows = [row for name, every in groups.items() for row in _rows(name, every, OF_FLANK)]
        yield Table("face", f"{variant}, equilibria, largest of the planets", rows)
        split = {n: values for n, values in flanks.items() if "misalignment_by_cause_um" in values}
        causes = [
            Row(f"{words(group)}, {cause}", 1e-6 * size, "m")
            for group, shares in misalignment_of_groups(split).items()
            for cause, size in shares.items()
        ]
        title = f"{variant}, misalignment over the face by cause, planet misaligned most"
        yield Table("face", title, causes)
        rows = [row for name, every in groups.items() for row in _of_cycles(name, every)]
        yield Table("face", f"{variant}, gear-mesh cycles without errors, largest of the planets", rows)


def rim_rows(reduction: Mapping[str, Any]) -> Iterator[Row]:
    """Of a ring's reduction: how much of a tooth's bending along the face its rim adds, and whether
    tooth pairs take it in."""
    if "rim_error" in reduction:
        rim_text = "counted" if reduction["rim_counts"] else "left out"
        label = f"bending of the rim along the face within a tooth, of the tooth's own ({rim_text})"
        yield Row(label, reduction["rim_error"], "share")


def _rows(
    name: str,
    every: Sequence[Mapping[str, Any]],
    figures: Mapping[str, tuple[str, str, float]],
) -> Iterator[Row]:
    for key, (label, unit, by) in figures.items():
        values = [flank_figures[key] for flank_figures in every if key in flank_figures]
        if values:
            yield Row(f"{name}, {label}", by * max(values, key=abs), unit)


def _of_cycles(name: str, every: Sequence[Mapping[str, Any]]) -> Iterator[Row]:
    """What ``solve.gear_mesh_cycles`` found; nothing of flanks that do not carry throughout."""
    stiffness = [flank_figures[STIFFNESS] for flank_figures in every if STIFFNESS in flank_figures]
    for key, pick in (("min", min), ("mean", max), ("max", max)):
        if stiffness:
            size = pick(flank_figures[key] for flank_figures in stiffness)
            yield Row(f"{name}, stiffness of the gear mesh, {key}", 1e6 * size, "N/m")
    yield from _rows(name, every, OF_CYCLES)
    for key, label in ORDERS.items():
        amplitudes = zip(*(flank_figures[key][:SHOWN] for flank_figures in every if key in flank_figures), strict=True)
        for order, sizes in enumerate(amplitudes, 1):
            yield Row(f"{name}, {label}, order {order}", 1e-6 * max(sizes), "m")
