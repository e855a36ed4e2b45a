"""Tables of the load along the face, from the summary of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from flexgear.results.face_load import misalignment_of_groups
from flexgear.results.report.parts import Row, Table
from flexgear.results.report.wording import words

ERRORS = (
    ("transmission_error", "transmission error"),
    ("unloaded_transmission_error", "unloaded transmission error"),
)


def face_tables(summary: Mapping[str, Any]) -> Iterator[Table]:
    """By variant: every flank over a turn, causes of misalignment, gear-mesh cycles."""
    for variant, flanks in summary.get("face_load", {}).items():
        rows = [row for flank, one in flanks.items() for row in _of_flank(words(flank), one)]
        yield Table("face", f"{variant}, equilibria", rows)
        causes = [
            Row(f"{words(group)}, {cause}", 1e-6 * size, "m")
            for group, found in misalignment_of_groups(flanks).items()
            for cause, size in found.items()
        ]
        title = f"{variant}, misalignment over the face by cause, planet misaligned most"
        yield Table("face", title, causes)
        rows = [row for flank, one in flanks.items() for row in _of_cycles(words(flank), one)]
        yield Table("face", f"{variant}, gear-mesh cycles without errors", rows)


def _of_flank(name: str, one: Mapping[str, Any]) -> Iterator[Row]:
    yield Row(f"{name}, face load factor K_Hβ (ISO 6336-1)", one["k_h_beta"])
    yield Row(f"{name}, transverse load factor K_Hα (ISO 6336-1)", one["k_h_alpha"])
    yield Row(f"{name}, largest over mean line load at any instant", one["instantaneous_peak_factor"])
    yield Row(f"{name}, largest line load", one["largest_line_load_n_per_mm"], "N/mm")
    for edge, said in (("tip", "off the path of contact"), ("face_end", "at an end of the face")):
        yield Row(f"{name}, largest line load {said}", one[f"{edge}_line_load_n_per_mm"], "N/mm")
        often = one[f"{edge}_contact_positions"]
        yield Row(f"{name}, edge contact {said}, of the positions", often, "share")
    yield Row(f"{name}, largest Hertz pressure", 1e6 * one["largest_contact_pressure_mpa"], "Pa")
    yield Row(f"{name}, misalignment over the face", 1e-6 * one["misalignment_um"], "m")
    for key, said in ERRORS:
        size = one.get(f"{key}_peak_to_peak_um")
        if size is not None:
            yield Row(f"{name}, {said} peak to peak", 1e-6 * size, "m")


def _of_cycles(name: str, one: Mapping[str, Any]) -> Iterator[Row]:
    """What ``solve.gear_mesh_cycles`` found; nothing of a flank that does not carry throughout."""
    if "gear_mesh_stiffness_n_per_um" not in one:
        return
    stiffness = one["gear_mesh_stiffness_n_per_um"]
    for key, said in (("min", "least"), ("mean", "mean"), ("max", "largest")):
        yield Row(f"{name}, stiffness of the gear mesh, {said}", 1e6 * stiffness[key], "N/m")
    for key, said in ERRORS:
        yield Row(f"{name}, {said} peak to peak", 1e-6 * one[f"{key}_cycle_peak_to_peak_um"], "m")
        for order, size in enumerate(one[f"{key}_orders_um"][:3], 1):
            yield Row(f"{name}, {said}, order {order}", 1e-6 * size, "m")
