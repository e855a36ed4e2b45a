"""Printout of single analyses: equilibria, modes, Campbell diagram, transients."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import typer
import xarray as xr

from flexgear.cli.display import columns, key_table, show_table, table
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.implausible_bearings import without_tilt
from flexgear.model.bodies import Planet
from flexgear.model.names import BOLT_PASS, GEAR_MESH, PLANET_PASS, SHAFT, BodyName
from flexgear.model.ring import Ring
from flexgear.model.units import RPM
from flexgear.results.labelled_dataset import groups_in
from flexgear.results.load_sharing import without_rounding
from flexgear.results.quantities import number
from flexgear.results.report.sharing import DEFINITION
from flexgear.results.report.tables import meetings
from flexgear.results.report.wording import number as value_number
from flexgear.results.report.wording import (
    signal_scale,
    titled_by_stage,
    window_words,
    with_unit,
    words,
)
from flexgear.results.sinks import Ranges
from flexgear.results.stage_figures import StageRun
from flexgear.results.stage_part import (
    GEARS,
    flank_names,
    halves,
    of_kind,
    ring_force_spread,
    ring_sharing,
    stage_part,
)
from flexgear.results.time_figures import displacement_summary, radial_harmonics, star_angle
from flexgear.solve.campbell import LEAST, crossing_rows
from flexgear.solve.headlines.ratings import radial_alone
from flexgear.solve.headlines.solution import balance_sentence
from flexgear.solve.model import Model
from flexgear.solve.modes import top_shares
from flexgear.solve.resonance import gear_mesh_orders, resonance_figures, resonance_verdict, span
from flexgear.solve.result_warnings import (
    ROUNDING,
    Length,
    beside_lengths,
    large_motions,
    largest_motions,
    motion_histories,
    pulling_teeth,
    reversed_pairs,
)
from flexgear.solve.static import position_figures

BEARINGS = ("planet_bearing", "bearing")  # sections of figures
SHAPELESS = 1e-6  # radial shape over displacement of a ring below which it is rounding


def equilibrium_figures(model: Model, data: xr.Dataset) -> dict[str, Any]:
    """Figures of one position (a dataset with that position alone)."""
    rings: dict[str, Any] = {}
    for stage, inside in model.case.fe_ring_stages.items():
        parts = {side: stage_part(data, stage, side) for side in halves(data, stage)}
        figures = {s: _ring_figures(part, inside.stage.planets) for s, part in parts.items()}
        if len(parts) == 1:
            rings |= {stage: figures["left"]}
            continue
        force = {s: float(of_kind(p, "ring")["gear_mesh_force"].sum()) for s, p in parts.items()}
        total = sum(force.values())
        for side, of_half in figures.items():
            share = 2.0 * force[side] / total if total else None
            rings[f"{stage} {side} half"] = {"half_load": share, **of_half}
    return {**rings, **position_figures(model, data.isel(position=0))}


def _ring_figures(part: xr.Dataset, planets: int) -> dict[str, Any]:
    """Figures of one position of a flexible stage, or of one half."""
    displacement = part["tooth_displacement"].isel(position=0).to_numpy()
    star = radial_harmonics(displacement)
    largest = without_rounding(np.abs(displacement).max(axis=0))
    size = float(np.abs(star[planets]))
    size = size if size > SHAPELESS * float(largest.max()) else 0.0
    return {
        "load_sharing": number(ring_sharing(part)[0]),
        "planet_force_spread": number(without_rounding(ring_force_spread(part)[0], largest=1.0)),
        "tooth_displacement_largest_um": (1e6 * largest).tolist(),
        f"radial_harmonic_{planets}_um": 1e6 * size,
        **({f"star_angle_{planets}_deg": math.degrees(star_angle(star, planets))} if size else {}),
    }


LIVES = (
    "lives are those under the constant load of one position; `flexgear run` has that of the same "
    "damage over all positions, `flexgear rate` the lives under load cases"
)


def equilibrium_warnings(
    model: Model, data: xr.Dataset, positions: Mapping[str, dict[str, Any]]
) -> list[str]:
    """Sentences on neglected effects that are not small in these positions, large motions, and what
    the figures of the positions do not count."""
    rated = model.system.rated_torque
    torque = abs(float(data["port_torque"].isel(port=0).max()) / rated) if rated else 0.0
    notes = neglected_lines(model, _equilibrium_lengths(model, data), torque)
    factors = data["planet_load_factor"].min("position").to_numpy()
    groups = groups_in(data).items()
    notes += pulling_teeth(model.case, (g for g, at in groups if np.min(factors[at]) < -ROUNDING))
    force = data["gear_mesh_force"].to_numpy()
    notes += reversed_pairs(model.case, {g: float(force[:, at].max()) for g, at in groups})
    for view in (model.case.view(stage.name) for stage in model.case.stages):
        notes += without_tilt(view, stage_geometry(view))
    kinds = [figures.get(kind, {}) for figures in positions.values() for kind in BEARINGS]
    lives = {name for rows in kinds for name, row in rows.items() if "life_h" in row}
    left_out = {
        name: share
        for stage in model.flow.stages
        for label, share in StageRun(model.case.view(stage.name), stage, data, 0, 0.0, torque)
        .not_in_life()
        .items()
        if (name := f"{stage.name}.{label}") in lives
    }
    notes += [LIVES] * bool(lives) + ([f"lives by {radial_alone(left_out)}"] if left_out else [])
    return notes + large_motions(model.case, largest_motions(motion_histories(data)))


def show_equilibria(
    model: Model, data: xr.Dataset, positions: Mapping[str, dict[str, Any]], notes: list[str]
) -> None:
    """Print the figures of every position and the notes."""
    member = str(data["input_coordinate"][0].item())
    typer.echo(f"{model.case.name}, {model.variant}: equilibrium")
    for angle, figures in positions.items():
        typer.echo(f"\n{words(member)} turned by {angle}")
        for section, rows in figures.items():
            if rows:
                typer.echo("")
                if section == "sensors":
                    rows = {name: _reading(**each) for name, each in rows.items()}
                key_table(section, rows, "  ")
    typer.echo("\n" + "\n".join([balance_sentence(data.attrs["closure_max"]), *notes]))


def _equilibrium_lengths(model: Model, data: xr.Dataset) -> Iterator[Length]:
    """Largest distance of a member from the axis, and largest deflection of each flexible ring,
    over all positions."""
    yield from farthest(displacement_summary(data))
    for stage, view in model.case.fe_ring_stages.items():
        if BodyName.of(stage, "ring") in model.system.rigid_bodies:
            continue
        star = radial_harmonics(stage_part(data, stage)["tooth_displacement"].to_numpy())
        size = float(np.abs(star[..., view.stage.planets]).max())
        yield Length(titled_by_stage("Ring shape", stage), stage, size, "")


def farthest(distances_um: Mapping[str, float]) -> Iterator[Length]:
    """Distance of the central member that is farthest from the axis, as a single length."""
    if distances_um and max(distances_um.values()) > 0.0:
        name = max(distances_um, key=lambda n: distances_um[n])
        subject = f"Distance of {words(name)} from the axis"
        yield Length(subject, BodyName.parse(name).stage, 1e-6 * distances_um[name], "")


def neglected_lines(model: Model, lengths: Iterator[Length], torque_share: float) -> list[str]:
    """Sentences on neglected effects that are not small in comparison with ``lengths``."""
    rigid = {body.name.alike for body in model.system.bodies if body.rigid}
    effects = beside_lengths(model.case, model.flow, lengths, torque_share, rigid)
    return [str(effect["sentence"]) for effect in effects]


QUICK_RIMS = (
    "bending frequencies of rings and planets on FE meshes of fidelity quick were up to 4.4 % high "
    "in trials (docs/theory.md, section 7); --set solver.fidelity=standard: 1 %, thin rims 3 %"
)


MAX_MODES = 40  # that are printed where no limit is asked for


def show_modes(
    model: Model, rows: list[dict[str, Any]], limit_hz: float | None, *, every: bool
) -> None:
    """Print a line for each frequency and type, of the lowest modes unless ``every`` is set."""
    limit = "" if limit_hz is None else f" up to {limit_hz:g} Hz"
    typer.echo(f"{model.case.name}, {model.variant}: {len(rows)} modes{limit}")
    lines = [("no.", "frequency Hz", "type", "kinetic energy; strain energy")]
    at = 0
    while at < len(rows) and (every or at < MAX_MODES):
        row = rows[at]
        same = [r for r in rows[at : at + row["multiplicity"]] if r["type"] == row["type"]]
        times = f" x{len(same)}" if len(same) > 1 else ""
        energies = (
            ", ".join(f"{words(name)} {100 * share:.0f} %" for name, share in top_shares(row[of]))
            for of in ("kinetic_energy", "strain_energy")
        )
        lines.append((
            "-".join(dict.fromkeys((str(at + 1), str(at + len(same))))),
            f"{row['frequency_hz']:.3f}", row["type"] + times, "; ".join(filter(None, energies)),
        ))  # fmt: skip
        at += len(same)
    columns(lines, ">><<")
    if at < len(rows):
        top = math.ceil(rows[-1]["frequency_hz"])
        typer.echo(f"{len(rows) - at} more up to {top} Hz: --limit-hz {top} prints all")
    bodies = model.case.flexible_bodies.items()
    rims = {b for b, x in bodies if isinstance(x, Ring | Planet) and x.fe_mesh == "generate"}
    if rims - model.system.rigid_bodies and model.case.solver.fidelity == "quick":
        typer.echo(QUICK_RIMS)
    if ratios := model.damping_ratios:
        typer.echo("\ndamping.ratios, of modes of the train without gear meshes")
        values = zip(ratios["frequency_hz"], ratios["ratio"], strict=True)
        columns([(f"  {hz:.3f} Hz", f"{ratio:g}") for hz, ratio in values], "><")


def campbell_figures(model: Model, data: xr.Dataset, modes: xr.Dataset) -> dict[str, Any]:
    """Frequencies over speed, crossings and the verdict on resonance; modes: those at rest."""
    figures = resonance_figures(model.case, data, modes)
    level, _, sentence = resonance_verdict(figures)
    slopes = zip(data["excitation"].to_numpy(), data["excitation_slope"].to_numpy(), strict=True)
    return {
        "variant": model.variant,
        "gyroscopic": bool(data.attrs["gyroscopic"]),
        "speed_factor": data["speed_factor"].to_numpy().tolist(),
        "frequency_hz": data["campbell_frequency"].to_numpy().T.tolist(),
        "excitation_hz": {str(name): float(slope) for name, slope in slopes},
        "crossings": crossing_rows(data),
        "resonance": {**figures, "level": level, "verdict": sentence},
    }


def show_campbell(model: Model, data: xr.Dataset, figures: dict[str, Any]) -> None:
    """Print the excitations, their meetings with modes, and the verdict on resonance."""
    typer.echo(
        f"{model.case.name}, {model.variant}: {data.sizes['mode']} modes from rest to "
        f"{float(data['speed_factor'][-1]):g} times rated speed"
    )
    if not data.attrs["gyroscopic"]:
        typer.echo("frequencies do not depend on speed: the case has gyroscopic = false")
    for line in _excitation_lines(data):
        typer.echo(line)
    for each in meetings(figures):
        if each.rows:
            typer.echo("")
            show_table(each)
    count, total = len(figures["met"]), figures["ideal"] + figures["errors"]
    notes = []
    if any(row["force_share"] is not None for row in figures["met"]):
        notes.append("force if met: a gear mesh's over its mean, of one planet's teeth alone")
    if count < total:
        notes.append(f"{count} of {total} meetings are listed")
    if notes:
        typer.echo("; ".join(notes))
    typer.echo(f"\nresonance: {figures['verdict']}")


def _excitation_lines(data: xr.Dataset) -> Iterator[str]:
    """Lines on the excitations of each kind and stage, from the lowest to the highest frequency."""
    if not data.sizes["excitation"]:
        yield "nothing turns at rated speed, so nothing excites"
        return
    kind, stage = (data[f"excitation_{n}"].to_numpy() for n in ("kind", "stage"))
    hz, share = (data[f"excitation_{n}"].to_numpy() for n in ("slope", "share"))
    orders = gear_mesh_orders(data)
    yield "excitations at rated speed"
    for name, of_name in orders.items():
        at = (kind == GEAR_MESH) & (stage == name)
        part = np.nan_to_num(share[at])
        varies = (
            f"its stiffness varies by {100 * part.min():.2g} to {100 * part.max():.2g} % there"
            if part.max(initial=0.0) >= LEAST
            else "its stiffness is constant, or nearly so"
        )
        reach = f"{hz[at].min():.5g} to {hz[at].max():.5g} Hz"
        yield f"  gear mesh of {words(name)}: orders {span(of_name)}, {reach}; {varies}"
    others = {SHAFT: "turns of shafts, orders 1 and 2", PLANET_PASS: "planets that pass",
              BOLT_PASS: "bolts of FE rings that planets pass"}  # fmt: skip
    for other, what in others.items():
        at = kind == other
        if at.any():
            ends = dict.fromkeys(f"{hz:.4g}" for hz in (hz[at].min(), hz[at].max()))
            yield f"  {what}: {' to '.join(ends)} Hz"


def transient_figures(ranges: Ranges) -> dict[str, Any]:
    """Figures of a transient of a flexible stage from the ranges of ``stage_histories``."""
    most, of_pairs = ranges.largest, dict[str, Any]()
    if "ring_load" in most:
        carrying = {gear: {w: most[f"{gear}_{w}"] for w in ("drive", "coast")} for gear in GEARS}
        names = {gear: flank_names(xr.Dataset(w)) for gear, w in carrying.items()}
        loads = {f"{gear}_tooth_load_n": _range(ranges, f"{gear}_load") for gear in GEARS}
        of_pairs = {"carrying_flank": names, **loads}
    return {
        "carrier_speed_against_ring_rpm": _range(ranges, "stage_speed", RPM),
        "ring_mesh_force_n_mean": float(ranges.mean["ring_force"].mean()),
        **of_pairs,
        "load_sharing_max": number(most["load_sharing"]),
        "planet_force_spread_max": number(most["planet_force_spread"]),
    }


def _range(ranges: Ranges, name: str, factor: float = 1.0) -> dict[str, float]:
    low, high = ranges.least[name].min(), ranges.largest[name].max()
    return {"min": float(low) * factor, "max": float(high) * factor}


def show_transient(title: str, figures: dict[str, Any], notes: list[str]) -> None:
    """Print the figures of a transient and the window of time that they describe."""
    core = 1.0 / figures["realtime_factor"] if figures["realtime_factor"] else math.nan
    rows = {
        "simulated": with_unit(figures["time_s"], "s"),
        "window of the figures": window_words(figures),
        "reason": figures["settling"],
        "time stepping": f"{figures['steps']} steps, {with_unit(core, 's')} of one core for 1 s",
    }
    if "energy_residual" in figures:
        rows["residual of the energy balance"] = with_unit(figures["energy_residual"], "share")
    table(title, rows)
    for name, value in figures.items():
        if isinstance(value, dict) and value and name != "second_reduction":
            typer.echo("")
            title = "mean_port_torque_nm" if name == "port_torque_nm" else name
            plain = _level if name == "sensors" else _plain
            key_table(title, {k: plain(v) for k, v in value.items()})
    last = [*([DEFINITION] if figures["load_sharing"] else []), *notes]
    if last:
        typer.echo("\n" + "\n".join(last))


def _reading(value: float, unit: str) -> str:
    """Text of what a sensor reads in an equilibrium."""
    unit, by = signal_scale((value,), unit)
    return f"{value_number(by * value)} {unit}"


def _level(figures: Mapping[str, Any]) -> str:
    """Text of the level of a sensor: mean, rms about it, range, or the value that is constant."""
    mean, rms, low, high = (figures[k] for k in ("mean", "rms_about_mean", "min", "max"))
    unit, by = signal_scale((mean, low, high), figures["unit"])
    if low == high:
        return f"constant, {value_number(by * mean)} {unit}"
    texts = [value_number(by * x) for x in (mean, rms, low, high)]
    return f"mean {texts[0]} {unit}, rms about it {texts[1]}, from {texts[2]} to {texts[3]} {unit}"


def _plain(value: Any) -> Any:
    """A mapping without entries that are None; other values as they are."""
    if not isinstance(value, dict):
        return value
    if value.get("instantaneous", 1.0) is None:
        return "not defined, as at times the planets together carry no load"
    return {k: v for k, v in value.items() if v is not None}
