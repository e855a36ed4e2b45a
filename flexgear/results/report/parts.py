"""Rows, tables, verdicts and sections of a report, and labels and units of keys.

Keys end in their unit and may contain the name of a gear or gear mesh. A key without a label here
is printed as its words.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Literal

from flexgear.results.face_load import FLANK_FIGURES
from flexgear.results.quantities import Figure
from flexgear.results.report.wording import (
    FACTOR,
    digits_of,
    number,
    scale,
    split_unit,
    with_unit,
    words,
)
from flexgear.results.stage_figures import STAGE_FIGURES

Level = Literal["good", "watch", "bad", "note", "open"]
Value = float | str | None
MARKS: dict[Level, str] = {
    "bad": "outside limits",
    "watch": "look at this",
    "good": "within limits",
    "open": "not assessed",
    "note": "for information",
}

SECTIONS = {  # in the order of the page: heading and description
    "rating": ("Safety and life", "The weakest parts first, and what is not assessed."),
    "spectrum": ("Load spectrum", "Loads of the train and their durations."),
    "rating_gears": (
        "Gears, factor by factor",
        "Load factors of every gear mesh, and strength of flanks and roots, each with its source.",
    ),
    "geometry": (
        "Geometry",
        "Gears, centre distances and supports, as the case states them.",
    ),
    "power": ("Power flow", "Speeds, torques and powers of the members in steady running."),
    "gear_meshes": (
        "Gear meshes",
        "Contact ratios, gear-mesh forces and loads of tooth pairs.",
    ),
    "face": ("Load along the face", "Distribution of load along the face, and misalignment."),
    "sharing": (
        "Load sharing",
        "Distribution of load between the planets. K is the largest load of a planet over "
        "the mean of all, at the worst instant; 1 is perfectly even.",
    ),
    "tolerance": ("Tolerance study", "How far random errors of the parts spread the load sharing."),
    "bearings": ("Bearings", "What bearings carry, and their basic rating life."),
    "deflections": ("Deflections", "How far ring, carrier, sun and planets move under load."),
    "dynamics": ("Dynamics", "Steady running and torque drops in time, and their spectra."),
    "modes": ("Natural modes", "Frequencies, mode types and excitations."),
    "accuracy": ("Accuracy", "Errors of reduction, time step and equilibrium."),
    "case": ("The case", "Every parameter of the run, defaults included."),
}


@dataclass(frozen=True)
class Row:
    """A figure with its label. unit: SI, or another unit of ``wording.with_unit``."""

    label: str
    value: Value
    unit: str = ""


@dataclass(frozen=True)
class Table:
    """Rows below a title in a section; folded: whether the page hides them until opened; window:
    time window of the rows in words, such as "from 1 to 2 s", "" without one."""

    section: str
    title: str
    rows: Sequence[Row]
    folded: bool = False
    window: str = ""

    @property
    def heading(self) -> str:
        """The title, followed by the window of time if the figures have one."""
        return f"{self.title}, {self.window}" if self.window else self.title


@dataclass(frozen=True)
class Verdict:
    """A verdict of the first screen: subject, figure and sentence.

    level: "good" or "bad" against a limit, "watch" for a figure that needs attention, "note"
    without a limit, "open" if data of the case are missing. section: section with the details.
    """

    level: Level
    subject: str
    figure: str
    sentence: str
    section: str = ""


PRINTED = {
    "µm": ("m", 1e-6),
    "MPa": ("Pa", 1e6),
    "N/µm": ("N/m", 1e6),
    "1/min": ("r/min", 1.0),
    "1": ("", 1.0),
}


def row(figure: Figure, value: Any, name: str = "") -> Row:
    """The row of a figure; name: replaces angle brackets in its path."""
    unit, by = PRINTED.get(figure.unit, (figure.unit, 1.0))
    label = figure.label.format(name=words(name))
    return Row(label, value if value is None else by * value, figure.printed or unit)


def rows(figures: Iterable[Figure], section: Mapping[str, Any]) -> Iterator[Row]:
    """Rows of the figures of a section that have a label, in the order of declaration and by
    name."""
    for first, group in groupby((f for f in figures if f.label), key=lambda f: f.names[0]):
        if first in section:
            yield from _rows([(f, f.names[1:]) for f in group], section[first])


def _rows(figures: list[tuple[Figure, list[str]]], value: Any, name: str = "") -> Iterator[Row]:
    (figure, keys), *_ = figures
    if not keys:
        yield row(figure, value, name)
    elif keys[0].startswith("<"):
        for inner_name, inner in value.items():
            yield from _rows([(f, rest[1:]) for f, rest in figures], inner, inner_name)
    else:
        for f, rest in figures:
            if rest[0] in value:
                yield from _rows([(f, rest[1:])], value[rest[0]], name)


ROUNDING = 1e-6  # of the largest figure of a section, below which figures are zero
_PITCHES = "pitches"
_SHARE = "share"
# labels of keys, {part} for the name of a gear or gear mesh; with units of keys without a suffix
_WORDS: dict[str, str | tuple[str, str]] = {
    "planets": "number of planets",
    "bearing_life_ratio": "bearing life of the first case over that of the second (of equal "
    "bearings where a rating is missing)",
    "{part}_ball": "{part}, of balls",
    "{part}_roller": "{part}, of rollers",
    "(z_sun + z_ring)/N": "sun and ring teeth over number of planets",
    "assembles": "all planets assemble",
    "largest_misfit_of_a_sun_tooth_in_pitches": ("largest misfit of a sun tooth", _PITCHES),
    "center_distance_mm": "centre distance",
    "planet_clearance_mm": "gap between the tips of neighbouring planets",
    "transverse_pressure_angle_deg": "transverse pressure angle, reference circle",
    "base_helix_angle_deg": "helix angle, base circle",
    "face_width_of_a_half_mm": "face width of one half",
    "teeth": "number of teeth",
    "tool": "tool that cuts the teeth",
    "cutter_teeth": "number of teeth of the cutter",
    "start_of_involute_diameter_mm": "root form diameter, where the involute begins",
    "working_pressure_angle_deg": "working transverse pressure angle",
    "contact_ratio": "total contact ratio",
    "path_of_contact_mm": "path of contact, ends from the base tangent point of planet or gear",
    "backlash_um": "normal backlash",
    "backlash_by": "source of the backlash",
    "errors_close_up_to_um": "backlash closed by manufacturing errors, at most",
    "place_of_first_pair_in_pitches": (
        "first pair (of planet 1), from the start of the path",
        _PITCHES,
    ),
    "phase_of_planets_in_pitches": ("phases of the planets relative to planet 1", _PITCHES),
    "stiffness": "stiffness model",
    "mean_stiffness_n_per_m": "stiffness of all pairs together, mean",
    "least_stiffness_n_per_m": "stiffness of all pairs together, least",
    "largest_stiffness_n_per_m": "stiffness of all pairs together, largest",
    "pair_stiffness_peak_n_per_m": "largest stiffness of one pair",
    "iso_single_stiffness_n_per_mm_um": "stiffness of one pair per face width, c′ of ISO 6336-1",
    "nominal_contact_pressure_mpa": (
        "nominal contact pressure at the pitch point (ISO 6336-2, without helix angle "
        "factor and load factors)"
    ),
    "nominal_root_stress_iso_6336_3_{part}_mpa": (
        "nominal root stress of the {part} (ISO 6336-3:2006, no load factors)"
    ),
    "form_and_notch_factor_{part}": "form factor and notch factor of the {part}",
    "coefficient_of_friction": "coefficient of friction, assumed",
    "friction_loss_share_{part}": (
        "power lost in friction, share of that through the {part}",
        _SHARE,
    ),
    "friction_force_{part}_n": "friction force, across the line of action, {part}",
    "free_planet_rim_gives_way_{part}_um": "oval planet rim, largest deflection at the {part}",
    "pin_bends_in_planet_um": "bending of a pin inside its planet",
    "gear_mesh_force_n": "normal force of the gear mesh",
    "sun_tangential_force_n": "tangential part of it, sun",
    "ring_tangential_force_n": "tangential part of it, ring",
    "planet_bearing_force_direction_deg": (
        "its direction, from radial outward in the sense of rotation"
    ),
    "sun_axial_force_n": "axial force on the sun towards +z, on the ring towards −z",
    "error_cycle_turns": "turns of carrier against ring, or of gear, until errors repeat",
    "error_cycle_s": "time until errors repeat",
    "gear_mesh_orders": "orders of the gear-mesh frequency that results cover",
    "gear_mesh_resonance_hz": "gears vibrate on their gear mesh at",
    "modes_band_hz": "modes are accurate up to",
    "lowest_modes_band_hz": "of bodies that only slower gear meshes excite up to",
    "modes_accuracy": ("allowed error by dropped modes", _SHARE),
    "modes_estimate": ("error by dropped modes", _SHARE),
    "modes_limit_hz": "highest mode",
    "kept_modes": "modes kept",
    "time_step_s": "time step, steady running",
    "step_time_step_s": "time step, after a jump of torque",
    "rayleigh_acts_on": "alpha and beta act on",
    "rayleigh_leaves_undamped": "not on",
    "damping_there": "damping of these",
    "series_time_step_s": "time step, under a series of a machine or load",
    "output_interval_s": "time between samples",
    "settling_s": "fine steps after a jump of torque last",
    "reduction_limit_hz": "reduced bodies are checked up to",
    "dofs": "degrees of freedom",
    "instantaneous": ("K at the worst instant", FACTOR),
    "mean-based": ("mean-based factor", FACTOR),
    "cycle-based": ("cycle-based factor", FACTOR),
    "iec_61400_4": ("assumed by IEC 61400-4", FACTOR),
    "min_n": "least",
    "mean_n": "mean",
    "max_n": "largest",
    "distance_from_axis_um_max": ("largest distance from the axis", "µm"),
    "load_sharing_max": ("largest load sharing factor K", FACTOR),
    "planet_force_spread_max": ("largest spread of the planets' forces, over the mean", _SHARE),
    "ring_mesh_force_n_mean": ("mean force of the ring gear meshes", "N"),
    "load_sharing": ("load sharing factor K", FACTOR),
    "half_load": ("load of this half, over an even share", FACTOR),
    "planet_load_factor": ("load of each planet over the mean", FACTOR),
    "planet_force_spread": ("spread of the planets' forces, over the mean", _SHARE),
    "distance_from_axis_um": "distance from the axis",
    "tooth_displacement_largest_um": "ring teeth, largest displacement along x, y, z",
    "radial_harmonic_{part}_um": "radial shape of the ring, order {part}",
    "star_angle_{part}_deg": "crest of that shape at",
    "fe_dofs": "degrees of freedom of the FE mesh",
    "interface_dofs": "degrees of freedom of the interface",
    "fixed_interface_frequency_max_hz": "highest of them",
    "static_error": ("static error", _SHARE),
    "static_error_cases": ("by load", _SHARE),
    "frequency_error": ("frequency error", _SHARE),
    "frequency_limit_hz": "compared up to",
    "frequency_error_on_these_supports": "on the supports of the case",
    "tie": "teeth or bores are tied to their node at",
    "misalignment_by_cause_um, {part}": ("misalignment by the {part}", "µm"),
    "tip_load_share_max": ("largest share of the load off the path of contact", _SHARE),
    **{figure.path: figure.label for figure in (*STAGE_FIGURES, *FLANK_FIGURES) if figure.label},
}
_VALUES = {
    "per_pair": "one spring for each tooth pair",
    "face_load": "slices along the face of each tooth pair",
    "lumped": "one spring with the sum of all pairs",
    "constant": "one constant spring",
    "rectangular": "rectangular wave",
    "fourier": "wave of some harmonics",
}


def label_and_unit(key: str) -> tuple[str, str]:
    """Label and unit of a key: "base_pitch_mm" -> ("base pitch", "mm")."""
    label, unit = split_unit(key)
    for pattern, text in _WORDS.items():
        before, _, after = pattern.partition("{part}")
        match = re.fullmatch(f"{re.escape(before)}(.*){re.escape(after)}", key)
        if key == pattern or ("{part}" in pattern and match):
            part = words(match[1]) if match and match.groups() else ""
            text, unit = (text, unit) if isinstance(text, str) else text
            return text.replace("{part}", part), unit
    return label, unit


def row_of(key: str, value: Any, unit: str = "") -> Row:
    """The row of a key and its value; unit: for a key without a unit suffix."""
    label, stated_unit = label_and_unit(key)
    unit = stated_unit or unit
    if isinstance(value, Mapping):
        texts = (  # "order 1: 2 708.3 Hz", as thousands are separated by spaces
            f"{r.label}{':' if r.label[-1:].isdigit() else ''} {with_unit(r.value, r.unit)}"
            for r in rows_of(value, unit)
        )
        return Row(label, ", ".join(texts))
    if isinstance(value, Sequence) and not isinstance(value, str):
        return Row(label, listed(value, unit))
    if isinstance(value, bool):
        return Row(label, with_unit(value))
    if isinstance(value, str):
        return Row(label, _VALUES.get(value, value) if key == "stiffness" else value)
    return Row(label, value, unit)


def rows_of(figures: Mapping[str, Any], unit: str = "") -> list[Row]:
    """Rows of all figures of a section."""
    return [row_of(key, value, unit) for key, value in figures.items()]


def titled(key: str, figures: Mapping[str, Any]) -> tuple[str, dict[str, str]]:
    """Title of a section and its texts by label. If the key ends in a unit, all numbers are in one
    scale of that unit, which the title states."""
    title, unit = label_and_unit(key)
    lists = [v if isinstance(v, Sequence) else [v] for v in figures.values()]
    if not unit or unit == FACTOR or not all(_are_numbers(values) for values in lists):
        rows = rows_of(figures, unit)
        return title, {row.label: with_unit(row.value, row.unit) for row in rows}
    every = [v for values in lists for v in values]
    least = ROUNDING * max((abs(v) for v in every if math.isfinite(v)), default=0.0)
    lists = [[v if abs(v) >= least else 0.0 for v in values] for values in lists]
    printed, by = scale(every, unit)
    texts = (_joined(values, by, unit) for values in lists)
    labels = (label_and_unit(name)[0] for name in figures)
    return f"{title} ({printed})", dict(zip(labels, texts, strict=True))


def listed(values: Sequence[Any], unit: str) -> str:
    """Values separated by commas, followed by the unit that suits the largest."""
    if not _are_numbers(values) or unit == FACTOR:
        return ", ".join(with_unit(v, unit) for v in values)
    printed, by = scale(values, unit)
    return f"{_joined(values, by, unit)} {printed}".rstrip()


def _are_numbers(values: Sequence[Any]) -> bool:
    return all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)


def _joined(values: Sequence[float], by: float, unit: str) -> str:
    return ", ".join(number(v * by, digits_of(unit)) for v in values)
