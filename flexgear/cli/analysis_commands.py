"""Commands for single analyses: equilibrium, modes, a transient, variants side by side."""

from __future__ import annotations

import itertools
import math
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
import xarray as xr

from flexgear.analysis.modes import modes as natural_modes
from flexgear.cli.display import as_json_text, present, progress, shown, table, warn
from flexgear.cli.long_runs import Save, kept, saved_names
from flexgear.cli.options import (
    AsJson,
    CaseName,
    Quiet,
    Rigid,
    Settings,
    read_case,
    refuse_for_stages,
    rigid_parts,
)
from flexgear.cli.outputs import Force, OutFile, claim_file, save_or_rescue
from flexgear.cli.train_analyses import Shown, modes_of_train, simulate_of_train, static_of_train
from flexgear.cli.train_compare import compare_train, compare_trains
from flexgear.coupling.build import build_system
from flexgear.coupling.pace import stage_pace, too_coarse
from flexgear.coupling.system import Variant
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.results.dataset import save
from flexgear.results.flanks import GEARS, flanks_said, tooth_loads
from flexgear.results.harmonics import radial_harmonics, star_angle
from flexgear.results.origin import origin_of_case
from flexgear.results.sinks import Ranges, Several
from flexgear.results.summary import RPM, finite, sharing_summary, stage_histories
from flexgear.studies.long_run import refuse_endless
from flexgear.studies.reduction_warnings import stage_warnings
from flexgear.studies.single_runs import equilibria, stage_stepping
from flexgear.studies.single_runs import simulate as run_transient
from flexgear.studies.stage_bodies import stage_bodies, stage_modal, variant_of


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(static)
    app.command()(modes)
    app.command()(simulate)
    app.command()(compare)


def static(
    case: CaseName,
    angle_deg: Annotated[
        list[float] | None,
        typer.Option("--angle-deg", help="Rotation of the carrier (first input); repeatable."),
    ] = None,
    torque_nm: Annotated[
        float | None, typer.Option("--torque-nm", help="Torque of the drive; rated unless given.")
    ] = None,
    rigid: Rigid = None,
    out: OutFile = None,
    force: Force = False,
    settings: Settings = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Static equilibrium at angles: gear-mesh forces, load sharing, displacements."""
    found, parts = read_case(case, settings), rigid_parts(rigid)
    claim_file(out, origin_of_case(found), force)
    if isinstance(found, Case):
        static_of_train(found, angle_deg or [0.0], torque_nm, parts, Shown(as_json, quiet, out))
        return
    with progress(quiet) as report:
        bodies, variant = stage_bodies(found, report), variant_of(found, parts)
        warn(stage_warnings(found, bodies.both, variant))
        modal = stage_modal(found, bodies, variant)
        angles = np.radians(angle_deg or [0.0])
        _, data = equilibria(found, modal, angles, torque_nm, report)
    if out is not None:
        save_or_rescue(partial(save, data), out)
    figures = {
        f"{math.degrees(float(a)):g} deg": _position(data.isel(position=k), found.stage.planets)
        for k, a in enumerate(angles)
    }
    present(f"{found.name}, {data.attrs['variant']}: equilibrium", figures, as_json)
    _wrote(out, as_json)


def _position(data: xr.Dataset, planets: int) -> dict[str, Any]:
    star = radial_harmonics(data["tooth_displacement"].to_numpy())
    largest = np.abs(data["tooth_displacement"].to_numpy()).max(axis=0)
    return {
        "input_torque_nm": float(data["input_torque"]),
        "output_torque_nm": float(data["output_torque"]),
        "ring_mesh_force_n": data["ring_gear_mesh_force"].to_numpy().tolist(),
        "sun_mesh_force_n": data["sun_gear_mesh_force"].to_numpy().tolist(),
        "load_sharing": _number(data["load_sharing"]),
        "planet_force_spread": float(data["planet_force_spread"]),
        "tooth_displacement_largest_um": (1e6 * largest).tolist(),
        f"radial_harmonic_{planets}_um": float(1e6 * np.abs(star[planets])),
        f"star_angle_{planets}_deg": math.degrees(float(star_angle(star, planets))),
        "closure": float(data["closure"]),
    }


def _number(value: xr.DataArray) -> float | None:
    return float(value) if np.isfinite(value) else None


def modes(
    case: CaseName,
    limit_hz: Annotated[
        float | None,
        typer.Option(
            "--limit-hz", help="Highest frequency; modes_band_hz, or all of a lumped train."
        ),
    ] = None,
    angle_deg: Annotated[
        float, typer.Option("--angle-deg", help="Rotation of the carrier (first input).")
    ] = 0.0,
    campbell: Annotated[
        bool, typer.Option("--campbell", help="Over speed, with gear-mesh orders (trains).")
    ] = False,
    out: OutFile = None,
    force: Force = False,
    rigid: Rigid = None,
    settings: Settings = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Natural modes of the coupled train: frequencies, types, the components that move."""
    if limit_hz is not None and not limit_hz > 0:
        raise InputError("--limit-hz", f"{limit_hz:g}", "is not positive", "e.g. 500")
    found, parts = read_case(case, settings, loaded=False), rigid_parts(rigid)
    claim_file(out, origin_of_case(found), force)
    if isinstance(found, Case):
        way = Shown(as_json, quiet, out)
        modes_of_train(found, limit_hz, angle_deg, parts, campbell, way)
        return
    refuse_for_stages(found, campbell=campbell, out=out)
    limit_hz = stage_pace(found).band if limit_hz is None else limit_hz
    with progress(quiet) as report:
        bodies, variant = stage_bodies(found, report), variant_of(found, parts)
        warn(stage_warnings(found, bodies.both, variant))
        system = build_system(found, bodies.ring, bodies.carrier, variant)
        result = natural_modes(system, carrier_angle=math.radians(angle_deg), limit_hz=limit_hz)
    rows: list[dict[str, Any]] = [
        {
            "frequency_hz": float(f),
            "kinetic_energy": {name: float(share[k]) for name, share in result.energy.items()},
        }
        for k, f in enumerate(result.frequencies)
    ]
    if as_json:
        typer.echo(as_json_text({"variant": system.variant.label, "modes": rows}))
        return
    typer.echo(f"{found.name}, {system.variant.label}: {len(rows)} modes up to {limit_hz:g} Hz")
    for k, row in enumerate(rows):
        energy = sorted(row["kinetic_energy"].items(), key=lambda item: -item[1])[:3]
        moving = ", ".join(f"{name} {100 * share:.0f} %" for name, share in energy)
        typer.echo(f"  {k + 1:3d}  {row['frequency_hz']:10.3f} Hz   {moving}")


def simulate(
    case: CaseName,
    out: OutFile = None,
    force: Force = False,
    duration_s: Annotated[
        float | None,
        typer.Option("--duration-s", help="One revolution (of the slowest stage) unless given."),
    ] = None,
    torque_share: Annotated[
        float | None, typer.Option("--torque-share", help="Of rated torque (trains).")
    ] = None,
    rigid: Rigid = None,
    energy: Annotated[bool, typer.Option("--energy", help="Keep the energy account.")] = False,
    save_only: Save = None,
    settings: Settings = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Transient under the case's drive; a train's under constant torques."""
    if duration_s is not None and not duration_s > 0:
        raise InputError("--duration-s", f"{duration_s:g}", "is not positive", "e.g. 1.5")
    found, parts, names = read_case(case, settings), rigid_parts(rigid), saved_names(save_only, out)
    claim_file(out, origin_of_case(found), force)
    if isinstance(found, Case):
        share = 1.0 if torque_share is None else torque_share
        if not share > 0:
            raise InputError("--torque-share", f"{share:g}", "is not positive", "e.g. 1.5")
        way = Shown(as_json, quiet, out, tuple(names))
        simulate_of_train(found, duration_s, share, energy, parts, way)
        return
    refuse_for_stages(found, torque_share=torque_share)
    refuse_endless(stage_stepping(found, found.drive, duration_s), found.source)
    ranges = Ranges(stage_histories)
    with kept(out, names, quiet) as sinks, progress(quiet) as report:
        bodies, variant = stage_bodies(found, report), variant_of(found, parts)
        warn(
            [
                *too_coarse(stage_pace(found), found.solver),
                *stage_warnings(found, bodies.both, variant),
            ]
        )
        modal = stage_modal(found, bodies, variant)
        run = run_transient(
            found, modal, duration=duration_s, energy=energy, progress=report,
            sink=Several([ranges, *sinks]),
        )  # fmt: skip
    most = ranges.largest
    carrying = {gear: {w: most[f"{gear}_{w}"] for w in ("drive", "coast")} for gear in GEARS}
    figures = {
        "time_s": run.simulated,
        "wall_time_s": run.wall,
        "steps": int(run.data.attrs["steps"]),
        "second_reduction": finite(modal.figures),
        "carrier_speed_rpm": _range(ranges, "carrier_speed", RPM),
        "ring_mesh_force_n_mean": float(ranges.mean["ring_gear_mesh_force"].mean()),
        "carrying_flank": {gear: flanks_said(xr.Dataset(w)) for gear, w in carrying.items()},
        **{f"{gear}_tooth_load_n": _range(ranges, f"{gear}_load") for gear in GEARS},
        "load_sharing_max": _number(most["load_sharing"]),
        "planet_force_spread_max": float(most["planet_force_spread"]),
    }
    title = f"{found.name}, {run.data.attrs['variant']}: transient"
    if as_json:
        present(title, {"transient": figures}, True)
    else:
        table(title, figures)
    _wrote(out, as_json)


def _range(ranges: Ranges, name: str, factor: float = 1.0) -> dict[str, float]:
    least, most = ranges.least[name].min(), ranges.largest[name].max()
    return {"min": float(least) * factor, "max": float(most) * factor}


def compare(
    case: CaseName,
    positions: Annotated[
        int, typer.Option("--positions", min=1, help="Carrier angles until planets stand alike.")
    ] = 40,
    cycles: Annotated[
        int | None,
        typer.Option("--cycles", min=1, help="Gear-mesh cycles to look at (trains)."),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option("--against", metavar="CASE", help="Another train: forces, bearing life."),
    ] = None,
    settings: Settings = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Flexible and rigid variants side by side; of a train its load sharing by every analysis."""
    found = read_case(case, settings)
    if isinstance(found, Case):
        if against is None:
            compare_train(found, cycles, as_json, quiet)
            return
        other = read_case(against, None)
        if not isinstance(other, Case):
            raise InputError("--against", against, "is a flexible stage", "name a train")
        compare_trains(found, other, as_json)
        return
    refuse_for_stages(found, cycles=cycles, against=against)
    angles = np.linspace(0, found.stage.planet_period, positions, endpoint=False)
    figures: dict[str, dict[str, Any]] = {}
    with progress(quiet) as report:
        bodies = stage_bodies(found, report)
        warn(stage_warnings(found, bodies.both, Variant()))
        for k, choice in enumerate(itertools.product((True, False), repeat=3)):
            report("variants", k / 8)
            variant = Variant(*choice)
            _, data = equilibria(found, stage_modal(found, bodies, variant), angles)
            figures[variant.label] = {
                "load_sharing": sharing_summary(data),
                "ring_tooth_load_n_max": float(tooth_loads(data, "ring").max()),
                "tooth_displacement_um_max": 1e6 * float(np.abs(data["tooth_displacement"]).max()),
                "sun_wind_up_mrad_mean": 1e3 * float(data["sun_displacement"].sel(dof="rz").mean()),
            }
        report("variants", 1.0)
    if as_json:
        present("", figures, True)
        return
    period = math.degrees(found.stage.planet_period)
    typer.echo(f"{found.name}: equilibria at rated torque over {period:g} deg of the carrier")
    typer.echo("  flexible        K mean    K max   tooth load kN   tooth node µm   sun mrad")
    for label, row in figures.items():
        k = row["load_sharing"]
        typer.echo(
            f"  {label:<14}{k['mean']:8.4f} {k['max']:8.4f}"
            f" {row['ring_tooth_load_n_max'] / 1e3:15.1f}"
            f" {row['tooth_displacement_um_max']:15.1f} {row['sun_wind_up_mrad_mean']:11.3f}"
        )


def _wrote(out: Path | None, as_json: bool) -> None:
    if out is not None and not as_json:
        typer.echo(f"\nwrote {shown(str(out))}")
