"""Tables of a report, from the case, its power flow and the summary of a run."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from flexgear.gears.expected_lines import expected_lines, line_rows
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.report import case_reports
from flexgear.model.case import Case
from flexgear.model.names import FlankName
from flexgear.model.section import quantity_of
from flexgear.model.units import Quantity, unit_name
from flexgear.results.face_load import CYCLE_FIGURES, FLANK_FIGURES, misalignment_of_groups
from flexgear.results.quantities import Figure
from flexgear.results.report.parts import Row, Table, row, row_of, rows, rows_of
from flexgear.results.report.sharing import groups_of
from flexgear.results.report.wording import (
    FACTOR,
    excitation_words,
    number,
    of_stage,
    signed,
    titled_by_stage,
    window_words,
    with_unit,
    words,
)
from flexgear.results.stage_figures import (
    GEAR_MESHES,
    LIVES,
    MEMBERS,
    PLANET_BEARINGS,
    ROOTS,
    SEATS,
    TRAIN,
)
from flexgear.results.time_figures import DISTANCES, DROP, FORCES, RIM, STAGE_DROP, STEADY

Summary = Mapping[str, Any]
GEOMETRY, GEAR_MESH_PART = "geometry", "gear_meshes"
GEAR_MESH_SECTIONS = ("gear_mesh", "ring_gear_mesh", "sun_gear_mesh")
_TITLES = {
    "not_modelled": "not modelled, with its size",
    "missing_on_flanks": "missing on modified flanks, least and most",
}
ROUNDING = 1e-9  # of the load of a planet bearing, of the largest order of a ring
NOISE = 1e-6  # of a load or an energy, rounding of the solver
REDUCTION = (  # listed figures of a reduced body
    "fe_dofs", "interface_dofs", "fixed_interface_modes", "static_error", "frequency_error",
    "frequency_limit_hz",
)  # fmt: skip
TIMES = {
    "bodies": "meshing and reduction",
    "coupled_systems": "coupling",
    "transients": "transients, after all else is done",
}


def tables(case: Case, flow: PowerFlow, summary: Summary) -> list[Table]:
    """All tables of a run, in the order of the page."""
    parts = (
        stage_tables(case),
        _power(summary),
        _forces(summary),
        face_tables(summary),
        _sharing(summary),
        _bearings(case, flow, summary),
        deflection_tables(summary),
        _expected(case, flow),
        _sensors(summary),
        _drops(summary),
        _modes(summary),
        _accuracy(summary),
    )
    return [table for part in parts for table in part if table.rows]


def stage_tables(case: Case) -> Iterator[Table]:
    """Tables of assembly, gears, gear meshes, modified flanks and neglected effects."""
    for stage, report in case_reports(case).items():
        for name, section_rows in report.items():
            section = GEAR_MESH_PART if name in GEAR_MESH_SECTIONS else GEOMETRY
            title = f"{words(stage)} {_TITLES.get(name, words(name))}".strip()
            yield Table(section, title, rows_of(section_rows))


def _power(summary: Summary) -> Iterator[Table]:
    flow = summary["power_flow"]
    yield Table("power", "whole train", list(rows(TRAIN, flow)))
    for name, member in flow["members"].items():
        yield Table("power", words(name), list(rows(MEMBERS, member)))


def _forces(summary: Summary) -> Iterator[Table]:
    for name, figures in summary["stages"].items():
        yield Table(
            GEAR_MESH_PART,
            titled_by_stage("from the power flow", name),
            list(rows(GEAR_MESHES, figures)),
        )
        title = titled_by_stage("root stress by finite elements", name)
        yield Table("face", title, list(rows(ROOTS, figures)))
    transient = summary["transient"]
    forces, window = list(rows(FORCES, transient)), window_words(transient)
    yield Table(GEAR_MESH_PART, "forces in time", forces, window=window)


def _sharing(summary: Summary) -> Iterator[Table]:
    sharing = summary["load_sharing"]
    for variant, stages in sharing["quasi_static"].items():
        factors = [row for figures in stages.values() for row in _coefficients(figures)]
        yield Table("sharing", f"{variant}, equilibria", factors)
    for variant, figures in sharing["transient"].items():
        factors, window = list(_coefficients(figures)), window_words(figures)
        yield Table("sharing", f"{variant}, in time", factors, window=window)


_COEFFICIENTS = {
    "instantaneous": "K at the worst instant",
    "mean-based": "mean-based factor (largest loads of gear-mesh cycles)",
    "cycle-based": "cycle-based factor (the same, lightly loaded planets too)",
    "iec_61400_4": "assumed by IEC 61400-4",
}


def _coefficients(figures: Mapping[str, Any]) -> Iterator[Row]:
    for group, of_group in groups_of(figures).items():
        for key, label in _COEFFICIENTS.items():
            yield Row(f"{words(group)}, {label}", of_group.get(key), FACTOR)


def _bearings(case: Case, flow: PowerFlow, summary: Summary) -> Iterator[Table]:
    over = f"load of the same damage over {summary['equilibrium_window']}"
    for at in flow.stages:
        figures, rounding = summary["stages"][at.name], ROUNDING * at.planet_bearing_force
        radial = at.planet_bearing_radial
        loads = [
            *rows(PLANET_BEARINGS, figures),
            Row("load, tangential, against the rotation", at.planet_bearing_tangential, "N"),
            Row("load, radial, outward", radial if abs(radial) > rounding else 0.0, "N"),
            Row("bearings side by side", case.stage(at.name).planet_bearing.count),
        ]
        for title, lines in (
            ("planet bearings", loads if at.kind == "planetary" else []),
            ("bearings on the housing", list(rows(SEATS, figures))),
            (f"basic rating life (ISO 281), {over}", list(rows(LIVES, figures))),
        ):
            yield Table("bearings", titled_by_stage(title, at.name), lines)


def deflection_tables(summary: Summary) -> Iterator[Table]:
    """Tables of displacements of members and ring, stress outside on it and its shape."""
    window = window_words(summary["transient"])
    distances = list(rows(DISTANCES, summary["transient"]))
    yield Table("deflections", "largest displacement from the axis", distances, window=window)
    for stage, figures in summary.get("steady", {}).items():
        at = of_stage(stage)
        title = f"ring tooth node 1{at}, largest values"
        yield Table("deflections", title, list(rows(STEADY, figures)), window=window)
        title = f"stress along the circumference outside on the ring{at}, equilibria at mid-face"
        yield Table("deflections", title, list(rows(RIM, figures)))
        sizes = figures["radial_harmonics_um"]
        visible = [k for k, size in enumerate(sizes) if size > ROUNDING * max(sizes)]
        orders = [Row(f"order {k}", 1e-6 * sizes[k], "m") for k in visible]
        largest = sorted(orders, key=lambda row: -float(row.value or 0))[:6]
        title = f"radial shape of the ring{at}, largest orders round the circle"
        yield Table("deflections", title, sorted(largest, key=orders.index))


def _expected(case: Case, flow: PowerFlow) -> Iterator[Table]:
    lines = expected_lines(case, flow)
    for stage in case.stages:
        title = titled_by_stage("expected lines of a sensor on the housing", stage.name)
        figures = line_rows(lines, stage.name)
        yield Table("dynamics", title, rows_of(figures, "Hz"))


def _sensors(summary: Summary) -> Iterator[Table]:
    lines = list[Row]()
    for name, level in summary.get("sensors", {}).items():
        unit = "strain" if level["unit"] == "1" else level["unit"]
        lines.append(Row(f"{name}, mean", level["mean"], unit))
        lines.append(Row(f"{name}, root mean square about it", level["rms_about_mean"], unit))
    yield Table("dynamics", "sensors", lines, window=window_words(summary["transient"]))


def _drops(summary: Summary) -> Iterator[Table]:
    for depth, variants in summary["torque_steps"].items():
        for variant, drop in variants.items():
            every = list(rows(DROP, drop))
            for stage in (s for s in summary.get("steady", ()) if s in drop):
                of_ring = rows(STAGE_DROP, drop[stage])
                every += [replace(row, label=f"{row.label}{of_stage(stage)}") for row in of_ring]
            title = f"torque drop to {with_unit(float(depth), 'N m')}, {variant}"
            yield Table("dynamics", title, every)


def _modes(summary: Summary) -> Iterator[Table]:
    lines, count = [], 0
    for mode in summary["modes"]["lowest"]:
        times = mode["multiplicity"]
        kind = mode["type"] + (f", {times} alike" if times > 1 else "")
        lines.append(Row(f"mode {count + 1}: {kind}", mode["frequency_hz"], "Hz"))
        count += times
    yield Table("modes", "lowest modes at rest or rated speed", lines)
    kinds = summary["modes"]["types"].items()
    yield Table("modes", "modes found by type", [Row(words(kind), n) for kind, n in kinds])
    yield from meetings(summary["resonance"])


def meetings(resonance: Mapping[str, Any]) -> Iterator[Table]:
    """Excitations within the margin of natural frequencies at the operating speeds."""
    within = with_unit(resonance["margin"], "share")
    for cause, title in (
        ("ideal", "excited by perfect gears"),
        ("errors", "excited by errors alone"),
    ):
        lines = [_meeting(row) for row in resonance["met"] if row["cause"] == cause]
        yield Table("modes", f"{title}, within {within}", lines)


def _meeting(row: Mapping[str, Any]) -> Row:
    plural = "s" if len(row["modes"]) > 1 else ""
    modes = f"mode{plural} {' and '.join(map(str, row['modes'][:2]))}"
    speed = "" if row["speed_factor"] == 1.0 else f" at {row['speed_factor']:.3g} of rated speed"
    order = "" if row["excited_index"] is None else f", of the order {row['excited_index']}"
    force = row["force_share"]
    raised = "" if force is None else f"; force if met {number(100 * force, 2)} %"
    return Row(
        f"{excitation_words(row['excitation'])}{speed} at {modes}",
        f"{with_unit(row['frequency_hz'], 'Hz')}, {signed(100 * row['away'], 1)} % from "
        f"{with_unit(row['mode_frequency_hz'], 'Hz')}, {row['type']}; k of the mode "
        f"{row['nodal_index']}{order}{raised}",
    )


def _share(label: str, value: float | None) -> Row:
    """Row of a share, zero if it is rounding."""
    return Row(label, value if value is None or value > NOISE else 0.0, "share")


def _accuracy(summary: Summary) -> Iterator[Table]:
    closure = summary.get("equilibrium_closure_max")
    figures = {**summary["system"], **summary.get("solver", {})}
    keys = ("coordinates", "kept_modes", "modes_estimate", "time_step_s", "step_time_step_s")
    solution = [
        *(row_of(key, figures.get(key)) for key in keys),
        Row("steps of steady running", summary["transient"]["steps"]),
        _share("forces left over in the equilibria, of the load", closure),
        _share("energy not accounted for", summary["energy_residual"]),
    ]
    yield Table("accuracy", "solution", solution)
    for name, reduction in summary.get("reduction", {}).items():
        lines = [row_of(key, reduction.get(key)) for key in REDUCTION]
        yield Table("accuracy", f"reduction of {words(name)}", [*lines, *rim_rows(reduction)])
    side_by_side = {f"transient_{variant}" for variant in summary["load_sharing"]["transient"]}
    times = {n: value for n, value in summary["timing_s"].items() if n not in side_by_side}
    lines = [Row(TIMES.get(name, words(name)), value, "s") for name, value in times.items()]
    yield Table("accuracy", "wall time", lines)


ORDERS = {
    "transmission_error_orders_um": "transmission error",
    "unloaded_transmission_error_orders_um": "unloaded transmission error",
}
STIFFNESS = "gear_mesh_stiffness_n_per_um"
LISTED = 3  # orders of the gear mesh


def face_tables(summary: Mapping[str, Any]) -> Iterator[Table]:
    """Tables of each variant: figures of groups of gear meshes, misalignment by cause, gear-mesh
    cycles; values are the largest of the planets."""
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
    """Row of a ring's reduction: bending of the rim along the face over that of a tooth, and
    whether tooth pairs include it."""
    if "rim_error" in reduction:
        rim_text = "included" if reduction["rim_counts"] else "left out"
        label = f"bending of the rim along the face within a tooth, over the tooth's ({rim_text})"
        yield Row(label, reduction["rim_error"], "share")


def _largest(
    name: str, every: Sequence[Mapping[str, Any]], figures: Sequence[Figure]
) -> Iterator[Row]:
    """Rows of the largest value of each figure over several flanks."""
    for figure in figures:
        sizes = [of_flank[figure.path] for of_flank in every if figure.path in of_flank]
        if figure.label and sizes:
            largest = row(figure, max(sizes, key=abs))
            yield replace(largest, label=f"{name}, {largest.label}")


def _of_cycles(name: str, every: Sequence[Mapping[str, Any]]) -> Iterator[Row]:
    """Rows of gear-mesh cycles; none for flanks that are unloaded at some positions."""
    stiffness = [flank_figures[STIFFNESS] for flank_figures in every if STIFFNESS in flank_figures]
    for key, pick in (("min", min), ("mean", max), ("max", max)):
        if stiffness:
            size = pick(flank_figures[key] for flank_figures in stiffness)
            yield Row(f"{name}, stiffness of the gear mesh, {key}", 1e6 * size, "N/m")
    yield from _largest(name, every, CYCLE_FIGURES)
    for key, label in ORDERS.items():
        amplitudes = zip(
            *(flank_figures[key][:LISTED] for flank_figures in every if key in flank_figures),
            strict=True,
        )
        for order, sizes in enumerate(amplitudes, 1):
            yield Row(f"{name}, {label}, order {order}", 1e-6 * max(sizes), "m")


MAX_ENTRIES = 12  # of a list that are printed


def case_tables(case: Case) -> list[Table]:
    """Tables of all parameters, one for each stage and each other section, without load cases,
    which only a rating uses."""
    top = [
        Row("name", case.name),
        Row("title", case.title or "–"),
        Row("kinematics", case.kinematics),
    ]
    tables = [Table("case", "general", top)]
    for stage in case.stages:
        tables.append(Table("case", words(stage.name or "stage"), list(_rows(stage))))
    for name in type(case).model_fields:
        value = getattr(case, name)
        if isinstance(value, BaseModel):
            tables.append(Table("case", words(name), list(_rows(value))))
        elif name not in ("stages", "load_cases") and _has_models(value):
            rows = [row for k, item in enumerate(value) for row in _rows(item, f"{k + 1} · ")]
            tables.append(Table("case", words(name), rows))
    return [table for table in tables if table.rows]


def _has_models(value: Any) -> bool:
    """Whether a value is a list of sections."""
    return isinstance(value, tuple) and bool(value) and isinstance(value[0], BaseModel)


def _rows(section: BaseModel, before: str = "") -> Iterator[Row]:
    """Rows of a section and its nested sections, without keys that are not given."""
    for name in type(section).model_fields:
        value = getattr(section, name)
        label = before + words(name)
        if isinstance(value, BaseModel):
            yield from _rows(value, f"{label} · ")
        elif _has_models(value):
            for k, item in enumerate(value):
                yield from _rows(item, f"{label} {k + 1} · ")
        elif value is not None and value != ():
            yield Row(label, _text(value, quantity_of(type(section), name)))


def _text(value: Any, quantity: Quantity | None) -> str:
    """Text of a value with its SI unit if keys may have it, else with the usual unit."""
    if isinstance(value, tuple):
        listed = ", ".join(_text(v, quantity) for v in value[:MAX_ENTRIES])
        return listed if len(value) <= MAX_ENTRIES else f"{listed}, … ({len(value)} values)"
    if quantity is not None and isinstance(value, int | float):
        usual, *_ = suffixes = quantity.suffixes
        suffix = next((s for s in suffixes if quantity.to_si(1.0, s) == 1.0), usual)
        unit = "angle" if quantity.dimension == "angle" else unit_name(suffix)
        return with_unit(quantity.from_si(float(value), suffix), unit)
    return with_unit(value) if isinstance(value, bool | str | int | float) else str(value)
