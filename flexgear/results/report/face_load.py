"""Tables of the load along the face, from the summary of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

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
SHOWN = 3  # orders of the gear mesh


def face_tables(summary: Mapping[str, Any]) -> Iterator[Table]:
    """By variant: every flank over a turn, causes of misalignment, gear-mesh cycles; of runs of
    earlier versions what they hold of it."""
    for variant, flanks in summary.get("face_load", {}).items():
        rows = [row for flank, one in flanks.items() for row in _rows(words(flank), one, OF_FLANK)]
        yield Table("face", f"{variant}, equilibria", rows)
        split = {n: one for n, one in flanks.items() if "misalignment_by_cause_um" in one}
        causes = [
            Row(f"{words(group)}, {cause}", 1e-6 * size, "m")
            for group, found in misalignment_of_groups(split).items()
            for cause, size in found.items()
        ]
        title = f"{variant}, misalignment over the face by cause, planet misaligned most"
        yield Table("face", title, causes)
        rows = [row for flank, one in flanks.items() for row in _of_cycles(words(flank), one)]
        yield Table("face", f"{variant}, gear-mesh cycles without errors", rows)


def _rows(
    name: str, one: Mapping[str, Any], figures: Mapping[str, tuple[str, str, float]]
) -> Iterator[Row]:
    for key, (said, unit, by) in figures.items():
        if key in one:
            yield Row(f"{name}, {said}", by * one[key], unit)


def _of_cycles(name: str, one: Mapping[str, Any]) -> Iterator[Row]:
    """What ``solve.gear_mesh_cycles`` found; nothing of a flank that does not carry throughout."""
    for key, size in one.get("gear_mesh_stiffness_n_per_um", {}).items():
        yield Row(f"{name}, stiffness of the gear mesh, {key}", 1e6 * size, "N/m")
    yield from _rows(name, one, OF_CYCLES)
    for key, said in ORDERS.items():
        for order, size in enumerate(one.get(key, [])[:SHOWN], 1):
            yield Row(f"{name}, {said}, order {order}", 1e-6 * size, "m")
