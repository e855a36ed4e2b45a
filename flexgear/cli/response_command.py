"""``flexgear response``: steady states of a stage over speed or torque, with all branches."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

import numpy as np
import typer
import xarray as xr
from scipy.signal import find_peaks

from flexgear.cli import options
from flexgear.cli.analysis_commands import put_together
from flexgear.cli.analysis_views import Output
from flexgear.cli.display import Report, as_json_text, progress, table
from flexgear.model.units import RPM
from flexgear.results.origin import origin_of_case
from flexgear.results.quantities import number
from flexgear.results.report.wording import with_unit
from flexgear.solve.linear_response import linear_response
from flexgear.solve.model import Model
from flexgear.solve.response import response as steady_states
from flexgear.solve.turning_points import BESIDE, KINDS
from flexgear.views.linear_response_chart import linear_response_chart
from flexgear.views.response_chart import response_chart
from flexgear.views.style import save_figure

LISTED = 12  # resonances, jumps and ranges that the screen lists
LEAST_SHARE = 0.01  # of a peak: a mode with less is not named
PROMINENT = 0.02  # of the largest force: what a peak rises above its sides


def response(
    case: options.CaseName,
    speed_range: Annotated[
        tuple[float, float] | None,
        typer.Option("--speed-range", help="Lowest and highest speed over rated; 0.2 1.5."),
    ] = None,
    torque_range: Annotated[
        tuple[float, float] | None,
        typer.Option("--torque-range", help="The same of torque, at one speed."),
    ] = None,
    speed: Annotated[
        float, typer.Option("--speed", help="Speed over rated, with --torque-range.")
    ] = 1.0,
    torque: Annotated[float, typer.Option("--torque", help="Torques over rated.")] = 1.0,
    stage: Annotated[
        str, typer.Option("--stage", help="Whose gear meshes excite; the first that turns.")
    ] = "",
    harmonics: Annotated[
        int | None,
        typer.Option("--harmonics", help="Of the gear-mesh frequency; follow from the case."),
    ] = None,
    linear: Annotated[
        bool,
        typer.Option(
            "--linear",
            help="At mean stiffness, to the transmission error; modal shares.",
        ),
    ] = False,
    out: options.OutFile = None,
    force: options.Force = False,
    rigid: options.Rigid = None,
    settings: options.Settings = None,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Frequency response with all branches: peaks, jumps, lost contact over speed or torque."""
    source = options.read_case(case, settings)
    parts, output = options.rigid_parts(rigid, source), Output(as_json, out)
    output.claim(origin_of_case(source), force)
    with progress(quiet) as report:
        model = put_together(source, parts, report)
        if linear:
            _linear(model, speed_range, report, output)
            return
        data = steady_states(
            model,
            speeds=speed_range,
            torques=torque_range,
            speed=speed,
            torque=torque,
            stage=stage,
            harmonics=harmonics,
            progress=report,
        )
    output.keep(data)
    if output.picture is not None:
        save_figure(response_chart(data), output.picture, dpi=150)
    figures = response_figures(data)
    if as_json:
        typer.echo(as_json_text(figures))
    else:
        show_response(model, data, figures)
    output.wrote()


def _linear(
    model: Model, speeds: tuple[float, float] | None, report: Report, output: Output
) -> None:
    """The linear forced response: peaks of gear-mesh forces, and the modes that make them."""
    data = linear_response(model, speeds, progress=report)
    output.keep(data)
    if output.picture is not None:
        save_figure(linear_response_chart(data), output.picture, dpi=150)
    peaks = [_linear_peak(data.isel(peak=k)) for k in range(data.sizes.get("peak", 0))]
    if output.as_json:
        typer.echo(as_json_text({"peaks": peaks}))
    else:
        typer.echo(f"{model.case.name}: response to the static transmission error, mean stiffness")
        for peak in peaks[:LISTED]:
            modes = ", ".join(f"mode {m} {100 * s:.0f} %" for m, s in peak["modes"].items())
            typer.echo(
                f"  {peak['gear_mesh']}, order {peak['order']}, {peak['speed_share']:.4g} of rated "
                f"speed: {with_unit(peak['force_n'], 'N')} ({modes})"
            )
    output.wrote()


def _linear_peak(row: xr.Dataset) -> dict[str, Any]:
    """A peak, with the shares of the three modes that have most of it."""
    share = row["peak_mode_share"].to_numpy()
    most = np.argsort(-np.abs(share))[:3]
    numbers = row["kept_mode"].to_numpy()
    return {
        "gear_mesh": str(row["peak_gear_mesh"].values),
        "order": int(row["peak_order"]),
        "speed_share": float(row["peak_factor"]),
        "force_n": float(row["peak_force"]),
        "modes": {int(numbers[k]): float(share[k]) for k in most if abs(share[k]) >= LEAST_SHARE},
    }


def response_figures(data: xr.Dataset) -> dict[str, Any]:
    """Resonances, jumps, changes of stability and ranges without contact of a response."""
    over = data.attrs["over"]
    name = f"response_{over}_share"
    parameter, stable = data[name].to_numpy(), data["stable"].to_numpy() == 1
    force = data["response_gear_mesh_force"].sel(measure="maximum").max("gear_mesh").to_numpy()
    lost = data["lost_contact_share"].max("gear_mesh").to_numpy() > 0.0
    back = data["back_contact_share"].max("gear_mesh").to_numpy() > 0.0
    branch = data["response_branch"].to_numpy()
    return {
        "over": over,
        "stage": data.attrs["stage"],
        "harmonics": int(data.attrs["harmonics"]),
        "doubling_change": number(data.attrs["doubling_change"]),
        "complete": bool(data.attrs["complete"]),
        "states": len(parameter),
        "peaks": [
            {f"{over}_share": float(parameter[k]), "force_n": float(force[k])}
            for k in _peaks(force, branch, stable)
        ],
        "jumps": [
            {
                f"{over}_share": float(p["turning_point_parameter"]),
                "sense": "up" if int(p["turning_point_sense"]) > 0 else "down",
                "force_n": float(p["turning_point_force"]),
                "to_force_n": number(p["turning_point_target_force"]),
            }
            for p in _rows(data, "turning_point")
        ],
        "stability_changes": [
            {
                f"{over}_share": float(p["stability_change_parameter"]),
                "kind": KINDS[int(p["stability_change_kind"])],
            }
            for p in _rows(data, "stability_change")
        ],
        "lost_contact": _ranges(parameter, branch, lost & stable),
        "back_contact": _ranges(parameter, branch, back & stable),
    }


def _rows(data: xr.Dataset, dim: str) -> Iterator[xr.Dataset]:
    return (data.isel({dim: k}) for k in range(data.sizes[dim]))


def _peaks(force: np.ndarray, branch: np.ndarray, stable: np.ndarray) -> list[int]:
    """States at peaks of the force along curves that are stable, or beside stable ones; the largest
    first."""
    out: list[int] = []
    for curve in np.unique(branch):
        at = np.flatnonzero(branch == curve)
        tops, _ = find_peaks(force[at], prominence=PROMINENT * force[at].max())
        beside = np.convolve(stable[at], np.ones(2 * BESIDE + 1), "same") > 0
        out += [int(at[k]) for k in tops if beside[k]]
    return sorted(out, key=lambda k: -force[k])[:LISTED]


def _ranges(parameter: np.ndarray, branch: np.ndarray, where: np.ndarray) -> list[list[float]]:
    """Lowest and highest λ of pieces of curves in which something holds, joined."""
    pieces, first = list[list[float]](), 0
    for k in range(1, len(where) + 1):
        if k < len(where) and where[k] == where[first] and branch[k] == branch[first]:
            continue
        if where[first]:
            piece = parameter[first:k]
            pieces.append([float(piece.min()), float(piece.max())])
        first = k
    joined = list[list[float]]()
    for low, high in sorted(pieces):
        if joined and low <= joined[-1][1]:
            joined[-1][1] = max(joined[-1][1], high)
        else:
            joined.append([low, high])
    return joined


def show_response(model: Model, data: xr.Dataset, figures: dict[str, Any]) -> None:
    """Print what a response says."""
    over = figures["over"]
    low, high = (float(f(data[f"response_{over}_share"])) for f in (np.min, np.max))
    change = figures["doubling_change"]
    rows = {
        f"{over} over rated": f"{low:g} to {high:g}, {figures['states']} steady states",
        "reference member": f"{data['response_speed'].min().item() * RPM:.5g} to "
        f"{data['response_speed'].max().item() * RPM:.5g} rpm",
        "gear mesh": f"{data['gear_mesh_frequency'].min().item():.5g} to "
        f"{data['gear_mesh_frequency'].max().item():.5g} Hz",
        "harmonics": f"{figures['harmonics']}; "
        + (
            "how much more of them change is not known"
            if change is None
            else f"twice as many change the motion by {with_unit(change, 'share')} of its range"
        ),
    }
    table(f"{model.case.name}, {model.variant}: response of {figures['stage']}", rows)
    for line in _lines(figures):
        typer.echo(line)
    if data.attrs["left_out"]:
        typer.echo(f"left out, as it does not repeat with the gear mesh: {data.attrs['left_out']}")
    if not figures["complete"]:
        typer.echo(
            "a curve could not be followed to its end: try more --harmonics, a shorter range, or "
            "more damping of the gear meshes"
        )


def _lines(figures: dict[str, Any]) -> Iterator[str]:
    over = figures["over"]
    share = f"{over}_share"
    yield ""
    for row in figures["peaks"][:LISTED]:
        force = with_unit(row["force_n"], "N")
        yield f"  peak at {row[share]:.4g}: gear-mesh force up to {force}"
    for row in figures["jumps"]:
        to = row["to_force_n"]
        target = "" if to is None else f" to {with_unit(to, 'N')}"
        moving = "rising" if row["sense"] == "up" else "falling"
        yield (
            f"  jump of a sweep of {moving} {over} at {row[share]:.4g}: from "
            f"{with_unit(row['force_n'], 'N')}{target}"
        )
    for row in figures["stability_changes"][:LISTED]:
        if row["kind"] != KINDS[0]:
            yield f"  stability changes at {row[share]:.4g}: {row['kind']}"
    for name, what in (("lost_contact", "teeth lose contact"), ("back_contact", "backs touch")):
        spans = [f"{a:.4g} to {b:.4g}" for a, b in figures[name]]
        yield f"  {what}: {', '.join(spans) if spans else 'nowhere on stable branches'}"
