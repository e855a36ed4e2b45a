"""Single analyses of a train on the command line: equilibrium, modes, a transient."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import typer
import xarray as xr

from flexgear.cli.display import Report, as_json_text, present, progress, shown, table, warn
from flexgear.cli.long_runs import kept
from flexgear.cli.options import refuse_for_trains
from flexgear.cli.outputs import save_or_rescue
from flexgear.coupling.pace import too_coarse
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.results.dataset import save
from flexgear.results.energy_balance import energy_account, largest_residual
from flexgear.results.sinks import Ranges, Several
from flexgear.results.summary import RPM
from flexgear.results.train_summary import distance_summary, force_ranges, sharing_summary_of
from flexgear.studies.long_run import refuse_endless
from flexgear.studies.reduction_warnings import train_warnings
from flexgear.studies.train_dataset import TrainContext, context_of
from flexgear.studies.train_model import (
    coupled_train,
    flexible_stages,
    train_bodies,
    train_variants,
    variant_label,
)
from flexgear.studies.train_modes import (
    crossing_rows,
    mode_rows,
    top_shares,
    train_campbell,
    train_modes,
    usual_limit,
)
from flexgear.studies.train_static import position_figures, train_equilibria
from flexgear.studies.train_transient import (
    cut_short,
    simulate_train,
    train_histories,
    train_stepping,
)

LISTED_CROSSINGS = 12


@dataclass(frozen=True)
class Shown:
    """How results come out: JSON, no progress, file for the dataset and what of it is kept."""

    as_json: bool
    quiet: bool
    out: Path | None = None
    names: tuple[str, ...] = ()

    def wrote(self) -> None:
        """Say where the dataset is."""
        if self.out is not None and not self.as_json:
            typer.echo(f"\nwrote {shown(str(self.out))}")

    def keep(self, data: xr.Dataset) -> None:
        """Write the dataset if a file was named."""
        if self.out is not None:
            save_or_rescue(partial(save, data), self.out)


def put_together(train: Case, rigid: tuple[str, ...], report: Report) -> TrainContext:
    """The coupled train with components of its flexible stages made rigid."""
    if not flexible_stages(train):
        refuse_for_trains(train, rigid=rigid)
    variants = train_variants(train, rigid)
    bodies = train_bodies(train, report)
    warn(train_warnings(train, bodies, variants))
    system = coupled_train(train, bodies=bodies, variants=variants)
    return context_of(train, system, variant_label(variants))


def static_of_train(
    train: Case,
    angles_deg: list[float],
    torque_nm: float | None,
    rigid: tuple[str, ...],
    way: Shown,
) -> None:
    """Equilibria at rotations of the first member of given speed."""
    with progress(way.quiet) as report:
        context = put_together(train, rigid, report)
        data = train_equilibria(context, np.radians(angles_deg), torque_nm, report)
    way.keep(data)
    positions = {
        f"{angle:g} deg": position_figures(context, data.isel(position=k))
        for k, angle in enumerate(angles_deg)
    }
    if way.as_json:
        closure = data.attrs["closure_max"]
        typer.echo(as_json_text({**positions, "closure": closure}))
        return
    lead = str(data["master"][0].item())
    typer.echo(f"{train.name}, {context.variant}: equilibrium, {lead} turned by")
    for angle, figures in positions.items():
        typer.echo(f"\n{angle}")
        for section, rows in figures.items():
            typer.echo("")
            table(f"  {section}", {f"  {k}": v for k, v in rows.items()})
    way.wrote()


def modes_of_train(
    train: Case,
    limit_hz: float | None,
    angle_deg: float,
    rigid: tuple[str, ...],
    campbell: bool,
    way: Shown,
) -> None:
    """Natural modes, or the Campbell diagram's crossings."""
    with progress(way.quiet) as report:
        context = put_together(train, rigid, report)
        limit_hz = usual_limit(context) if limit_hz is None else limit_hz
        if campbell:
            data = train_campbell(context, limit_hz=limit_hz)
        else:
            data = train_modes(context, angle=math.radians(angle_deg), limit_hz=limit_hz)
    way.keep(data)
    if campbell:
        _show_campbell(context, data, way)
    else:
        _show_modes(context, data, limit_hz, way)
    way.wrote()


def _show_modes(
    context: TrainContext, data: xr.Dataset, limit_hz: float | None, way: Shown
) -> None:
    rows = mode_rows(data)
    if way.as_json:
        found = {"variant": context.variant, "modes": rows}
        typer.echo(as_json_text(found))
        return
    upto = "" if limit_hz is None else f" up to {limit_hz:g} Hz"
    typer.echo(f"{context.train.name}, {context.variant}: {len(rows)} modes{upto}")
    typer.echo("      no.  frequency Hz  type                      kinetic energy; strain energy")
    at = 0
    while at < len(rows):
        row, same = rows[at], _repeated(rows, at)
        number = f"{at + 1}" if same == 1 else f"{at + 1}-{at + same}"
        times = f" x{same}" if same > 1 else ""
        moving = _said(top_shares(row["kinetic_energy"]))
        strained = _said(top_shares(row["strain_energy"]))
        typer.echo(
            f"  {number:>7} {row['frequency_hz']:13.3f}  {row['type'] + times:<24}  "
            f"{moving}{'; ' + strained if strained else ''}"
        )
        at += same


def _repeated(rows: list[dict[str, Any]], at: int) -> int:
    """How many modes from ``at`` on are of one frequency and type."""
    first, end = rows[at], at + 1
    while (
        end < min(len(rows), at + first["multiplicity"])
        and rows[end]["type"] == first["type"]
        and abs(rows[end]["frequency_hz"] - first["frequency_hz"]) <= 1e-6 * first["frequency_hz"]
    ):
        end += 1
    return end - at


def _said(shares: list[tuple[str, float]]) -> str:
    return ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares)


def _show_campbell(context: TrainContext, data: xr.Dataset, way: Shown) -> None:
    rows = crossing_rows(data)
    if way.as_json:
        found = {
            "variant": context.variant,
            "gyroscopic": bool(data.attrs["gyroscopic"]),
            "speed_factor": data["speed_factor"].to_numpy().tolist(),
            "frequency_hz": data["campbell_frequency"].to_numpy().T.tolist(),
            "excitation_hz": {
                str(n): float(f)
                for n, f in zip(
                    data["excitation"].to_numpy(), data["excitation_slope"].to_numpy(), strict=True
                )
            },
            "crossings": rows,
        }
        typer.echo(as_json_text(found))
        return
    typer.echo(
        f"{context.train.name}, {context.variant}: {data.sizes['mode']} modes from rest to "
        f"{float(data['speed_factor'][-1]):g} times rated speed"
    )
    if not data.attrs["gyroscopic"]:
        typer.echo("frequencies do not depend on speed: the case has gyroscopic = false")
    nearest = sorted(rows, key=lambda r: abs(r["speed_factor"] - 1))[:LISTED_CROSSINGS]
    typer.echo(f"{len(rows)} crossings with gear-mesh orders; those nearest to rated speed:")
    for row in nearest:
        typer.echo(
            f"  {row['speed_factor']:7.3f} of rated speed  {row['frequency_hz']:11.3f} Hz  "
            f"mode {row['mode']:3d}  {row['excitation']}"
        )


def simulate_of_train(
    train: Case,
    duration_s: float | None,
    torque_share: float,
    energy: bool,
    rigid: tuple[str, ...],
    way: Shown,
) -> None:
    """Transient under constant torques from equilibrium at rated speed."""
    refuse_endless(train_stepping(train, power_flow(train), duration_s), train.source)
    rest, account = Ranges(train_histories), Ranges(energy_account)
    with kept(way.out, way.names, way.quiet) as sinks, progress(way.quiet) as report:
        context = put_together(train, rigid, report)
        short = [] if duration_s is not None else cut_short(train, context.flow)
        warn([*too_coarse(context.pace, train.solver), *short])
        run = simulate_train(
            context,
            duration=duration_s,
            torque_share=torque_share,
            energy=energy,
            progress=report,
            sink=Several([rest, *([account] if energy else []), *sinks]),
        )
    least, mean, most = rest.least, rest.mean, rest.largest
    figures: dict[str, Any] = {
        "time_s": run.simulated,
        "settle_s": float(run.data.attrs["settle_s"]),
        "wall_time_s": run.wall,
        "realtime_factor": run.realtime_factor,
        "steps": int(run.data.attrs["steps"]),
        "speed_rpm": {
            str(m): {
                "min": float(least["master_speed"].sel(master=m)) * RPM,
                "max": float(most["master_speed"].sel(master=m)) * RPM,
            }
            for m in most["master"].to_numpy()
        },
        "port_torque_nm": {
            str(p): float(mean["port_torque"].sel(port=p)) for p in mean["port"].to_numpy()
        },
        "gear_mesh_force": force_ranges(*(d["gear_mesh_force"] for d in (least, mean, most))),
        "load_sharing": sharing_summary_of(run.data),
        "distance_from_axis_um_max": distance_summary(most["axis_distance"]),
    }
    if energy:
        figures["energy_residual"] = largest_residual(account)
    if way.as_json:
        present("", {"transient": figures}, True)
    else:
        _show_transient(f"{train.name}, {context.variant}: transient", figures)
    way.wrote()


def _show_transient(title: str, figures: dict[str, Any]) -> None:
    single = {k: v for k, v in figures.items() if not isinstance(v, dict)}
    table(title, single)
    for name, rows in figures.items():
        if isinstance(rows, dict) and rows:
            typer.echo("")
            table(name.replace("_", " "), {k: _plain(v) for k, v in rows.items()})


def _plain(value: Any) -> Any:
    """Mappings without what has no number."""
    if not isinstance(value, dict):
        return value
    return {k: v for k, v in value.items() if v is not None}
