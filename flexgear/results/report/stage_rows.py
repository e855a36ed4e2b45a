"""What ``flexgear check`` tells about stages (``gears.report``) in an engineer's words.

Keys there end in their unit and may name a gear or a gear mesh; a key that has no words here is told
by its own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

from flexgear.gears.report import case_report
from flexgear.model.case import Case
from flexgear.results.report.parts import Row, Table
from flexgear.results.report.wording import number, said, split_unit, words

GEOMETRY, MESH = "geometry", "meshes"
_PITCHES = "pitches"
_SHARE = "share"
# key, {part} for a gear or gear mesh in it: what is said, unit where the key does not end in it
_SAID = {
    "planets": ("number of planets", ""),
    "(z_sun + z_ring)/N": ("teeth of sun and ring together, over the number of planets", ""),
    "assembles": ("all planets find their teeth", ""),
    "largest_misfit_of_a_sun_tooth_in_pitches": ("largest misfit of a sun tooth", _PITCHES),
    "center_distance_mm": ("centre distance", ""),
    "planet_clearance_mm": ("gap between the tips of neighbouring planets", ""),
    "transverse_pressure_angle_deg": ("transverse pressure angle, reference circle", ""),
    "base_helix_angle_deg": ("helix angle, base circle", ""),
    "face_width_of_a_half_mm": ("face width of one half", ""),
    "radii": ("radii", ""),
    "teeth": ("number of teeth", ""),
    "working_pressure_angle_deg": ("working transverse pressure angle", ""),
    "contact_ratio": ("total contact ratio", ""),
    "path_of_contact_mm": ("path of contact, ends from the planet's base tangent point", ""),
    "backlash_um": ("normal backlash", ""),
    "place_of_first_pair_in_pitches": ("first pair of planet 1, from the start of the path", _PITCHES),
    "phase_of_planets_in_pitches": ("phases of the planets against planet 1", _PITCHES),
    "stiffness": ("model of the stiffness", ""),
    "mean_stiffness_n_per_m": ("stiffness of all pairs together, mean", ""),
    "least_stiffness_n_per_m": ("stiffness of all pairs together, least", ""),
    "largest_stiffness_n_per_m": ("stiffness of all pairs together, largest", ""),
    "pair_stiffness_peak_n_per_m": ("largest stiffness of one pair", ""),
    "iso_single_stiffness_n_per_mm_um": ("stiffness of one pair per face width, c′ of ISO 6336-1", ""),
    "nominal_root_stress_iso_6336_3_{part}_mpa": (
        "nominal root stress of the {part} (ISO 6336-3, no load factors)", ""),
    "form_and_notch_factor_{part}": ("form factor and notch factor of the {part}", ""),
    "coefficient_of_friction": ("coefficient of friction, assumed", ""),
    "friction_loss_share_{part}": ("power lost in friction, of that passing the {part}", _SHARE),
    "friction_force_{part}_n": ("friction force, across the line of action, {part}", ""),
    "free_planet_rim_gives_way_{part}_um": (
        "oval planet rim, the most that it yields at the {part}", ""),
    "pin_bends_in_planet_um": ("bending of a pin inside its planet", ""),
}  # fmt: skip
_MODELS = {
    "per_pair": "each pair of teeth is a spring",
    "face_load": "each pair of teeth in slices along the face",
    "lumped": "one spring for all pairs, with their sum",
    "constant": "one constant spring",
    "rectangular": "rectangular wave",
    "fourier": "wave of some harmonics",
}
_TITLES = {
    "not_modelled": "not modelled, with its size",
    "missing_on_flanks": "missing on modified flanks, least and most",
}


def stage_tables(case: Case) -> Iterator[Table]:
    """Tables of assembly, gears, gear meshes, modified flanks and what is not modelled."""
    for name, rows in case_report(case).items():
        section = MESH if name.endswith("gear_mesh") else GEOMETRY
        before, _, last = name.rpartition(" ")
        title = f"{words(before)} {_TITLES.get(last, words(last))}".strip()
        yield Table(section, title, [_row(key, value) for key, value in rows.items()])


def _row(key: str, value: Any) -> Row:
    label, unit = _told(key)
    if key == "stiffness":
        return Row(label, _MODELS.get(value, words(value)))
    if isinstance(value, Sequence) and not isinstance(value, str):
        return Row(label, ", ".join(number(float(v)) for v in value) + f" {unit}".rstrip())
    if isinstance(value, bool):
        return Row(label, said(value))
    return Row(label, words(value) if isinstance(value, str) else value, unit)


def _told(key: str) -> tuple[str, str]:
    """Words and unit of a key."""
    label, unit = split_unit(key)
    for pattern, (text, own) in _SAID.items():
        before, _, after = pattern.partition("{part}")
        found = re.fullmatch(f"{re.escape(before)}(.*){re.escape(after)}", key)
        if key == pattern or ("{part}" in pattern and found):
            part = words(found[1]) if found and found.groups() else ""
            return text.replace("{part}", part), own or unit
    return label, unit
