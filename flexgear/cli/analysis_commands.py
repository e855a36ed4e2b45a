"""Commands for single analyses: equilibrium, modes, a transient, variants side by side."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from flexgear.cli import options
from flexgear.cli.analysis_views import (
    Output,
    campbell_figures,
    equilibrium_figures,
    equilibrium_warnings,
    farthest,
    neglected_lines,
    ring_histories,
    show_campbell,
    show_equilibria,
    show_modes,
    show_transient,
    transient_figures,
)
from flexgear.cli.display import Report, progress, size_text, warn
from flexgear.coupling.pace import too_coarse
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.units import RPM
from flexgear.results.dataset_file import chosen, dataset_file, load
from flexgear.results.origin import origin_of_case
from flexgear.results.result_quantities import RESULT_QUANTITIES
from flexgear.results.run_folder import ended_run
from flexgear.results.settling import SensorRanges, WindowedRanges, window_edges, window_of
from flexgear.results.sinks import Coming, DatasetSink, Ranges, Several
from flexgear.results.summary import finite, sharing_summary_of
from flexgear.results.time_figures import (
    distance_summary,
    energy_account,
    force_ranges,
    largest_residual,
)
from flexgear.solve.angles import lead_angles
from flexgear.solve.bodies import reduced_bodies, rigid_bodies
from flexgear.solve.campbell import campbell as over_speed
from flexgear.solve.carried_state import end_of
from flexgear.solve.long_run import TimedRun, refuse_endless
from flexgear.solve.model import Model, assemble
from flexgear.solve.modes import mode_rows, usual_limit
from flexgear.solve.modes import modes as natural_modes
from flexgear.solve.result_warnings import (
    large_motions,
    largest_motions,
    motion_histories,
    reduction_warnings,
)
from flexgear.solve.static import static as equilibria
from flexgear.solve.transient import cut_short, stepping_of, train_histories
from flexgear.solve.transient import simulate as run_transient


def put_together(case: Case, rigid: tuple[str, ...], report: Report) -> Model:
    """The coupled model of a case with these parts of its flexible stages rigid."""
    variant = rigid_bodies(case, rigid)
    model = assemble(case, bodies=reduced_bodies(case, report, variant), variant=variant)
    warn(reduction_warnings(case, model.bodies, variant))
    return model


@contextlib.contextmanager
def model_of(
    name: str,
    settings: list[str] | None,
    rigid: list[str] | None,
    output: Output,
    force: bool,
    quiet: bool,
    *,
    loaded: bool = True,
) -> Iterator[tuple[Model, Report]]:
    """The coupled model of the case that a command names, and what reports progress in the block;
    that the output may be written is checked before FE bodies are made."""
    case = options.read_case(name, settings, loaded=loaded)
    parts = options.rigid_parts(rigid, case)
    output.claim(origin_of_case(case), force)
    with progress(quiet) as report:
        yield put_together(case, parts, report), report


def static(
    case: options.CaseName,
    angle_deg: Annotated[
        list[float] | None,
        typer.Option("--angle-deg", help="Rotation of the carrier (first input); repeatable."),
    ] = None,
    torque_nm: Annotated[
        float | None, typer.Option("--torque-nm", help="Torque of the drive; rated unless given.")
    ] = None,
    rigid: options.Rigid = None,
    out: options.OutFile = None,
    force: options.Force = False,
    settings: options.Settings = None,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Static equilibrium at angles: gear-mesh forces, load sharing, displacements."""
    output, degrees = Output(as_json, out), angle_deg or [0.0]
    with model_of(case, settings, rigid, output, force, quiet) as (model, report):
        data = equilibria(model, _turned(model, degrees), torque_nm, report)
    output.keep(data)
    positions = {
        f"{angle:g} deg": equilibrium_figures(model, data.isel(position=slice(k, k + 1)))
        for k, angle in enumerate(degrees)
    }
    beside = equilibrium_warnings(model, data)
    figures = {**positions, "closure": data.attrs["closure_max"], "neglected": beside}
    output.show(figures, partial(show_equilibria, model, data, positions, beside))


def _turned(model: Model, degrees: list[float]) -> NDArray[np.float64]:
    """Rotations (rad) of the reference member at which the first input has turned by these."""
    return lead_angles(model.case, model.flow, np.radians(degrees))


def modes(
    case: options.CaseName,
    limit_hz: Annotated[
        float | None,
        typer.Option(
            "--limit-hz", help="Highest frequency; modes_band_hz, or all of a lumped train."
        ),
    ] = None,
    angle_deg: Annotated[
        float | None,
        typer.Option(
            "--angle-deg",
            help="With gear meshes as they are at this rotation of the carrier (first input), and "
            "not with their mean stiffness over a gear-mesh cycle.",
        ),
    ] = None,
    campbell: Annotated[
        bool,
        typer.Option(
            "--campbell", help="Over speed, with what excites them and where it meets them."
        ),
    ] = False,
    out: options.OutFile = None,
    force: options.Force = False,
    rigid: options.Rigid = None,
    settings: options.Settings = None,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Natural modes of the coupled train: frequencies, types, the components that move."""
    if limit_hz is not None and not limit_hz > 0:
        raise InputError("--limit-hz", f"{limit_hz:g}", "is not positive", "e.g. 500")
    if campbell and angle_deg is not None:
        raise InputError(
            "--angle-deg", f"{angle_deg:g}", "is given beside --campbell, which takes the mean "
            "stiffness of gear meshes", "take one of them out",
        )  # fmt: skip
    output = Output(as_json, out)
    with model_of(case, settings, rigid, output, force, quiet, loaded=False) as (model, _):
        limit_hz = usual_limit(model) if limit_hz is None else limit_hz
        if campbell:
            data = over_speed(model, limit_hz=limit_hz)
            rest = natural_modes(model, limit_hz=limit_hz)
        else:
            angle = None if angle_deg is None else float(_turned(model, [angle_deg])[0])
            data = natural_modes(model, angle=angle, limit_hz=limit_hz)
    output.keep(data)
    if campbell:
        figures = campbell_figures(model, data, rest)
        output.show(figures, partial(show_campbell, model, data, figures["resonance"]))
    else:
        rows = mode_rows(data)
        figures = {"variant": model.variant, "modes": rows}
        output.show(figures, partial(show_modes, model, rows, limit_hz))


def simulate(
    case: options.CaseName,
    out: options.OutFile = None,
    force: options.Force = False,
    duration_s: Annotated[
        float | None,
        typer.Option("--duration-s", help="One revolution (of the slowest stage) unless given."),
    ] = None,
    torque_share: Annotated[
        float, typer.Option("--torque-share", help="Factor on all torques.")
    ] = 1.0,
    rigid: options.Rigid = None,
    energy: Annotated[bool, typer.Option("--energy", help="Keep the energy account.")] = False,
    start_from: Annotated[
        Path | None,
        typer.Option(
            "--from",
            help="Go on where another transient of the train has ended: its file, or the folder of "
            "a run. Machines and loads may differ.",
        ),
    ] = None,
    save_only: Save = None,
    settings: options.Settings = None,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Transient under the case's drive."""
    if duration_s is not None and not duration_s > 0:
        raise InputError("--duration-s", f"{duration_s:g}", "is not positive", "e.g. 1.5")
    source = options.read_case(case, settings)
    parts, names = options.rigid_parts(rigid, source), saved_names(save_only, out)
    options.claim_file(out, origin_of_case(source), force)
    if not torque_share > 0:
        raise InputError("--torque-share", f"{torque_share:g}", "is not positive", "e.g. 1.5")
    start = None if start_from is None else load(ended_run(start_from))
    begin = 0.0 if start is None else end_of(start, source.source)
    stepping = stepping_of(source, power_flow(source), duration_s, start=begin)
    refuse_endless(stepping, source.source)
    edges = window_edges(stepping.duration, source.solver.settle, begin)
    ranges = partial(WindowedRanges, edges=edges)
    whole, account = ranges(train_histories), Ranges(energy_account)
    motions, sensors = Ranges(motion_histories), SensorRanges(edges)
    rings = {stage: ranges(partial(ring_histories, stage)) for stage in source.fe_ring_stages}
    with run_sinks(out, names, quiet) as sinks, progress(quiet) as report:
        model = put_together(source, parts, report)
        short = [] if duration_s is not None else cut_short(source, model.flow)
        warn([*too_coarse(model.pace, source.solver), *short])
        run = run_transient(
            model,
            duration=duration_s,
            torque_share=torque_share,
            energy=energy,
            progress=report,
            start=start,
            sink=Several(
                [whole, motions, sensors, *rings.values(), *([account] if energy else []), *sinks]
            ),
        )
    settled = float(run.data.attrs["settle_s"])
    figures = _figures(model, run, whole.since(settled))
    if source.sensors:
        figures["sensors"] = sensors.figures(settled)
    figures |= {stage: transient_figures(r.since(settled)) for stage, r in rings.items()}
    if energy:
        figures["energy_residual"] = largest_residual(account)
    distance = farthest(figures["distance_from_axis_um_max"])
    beside = neglected_lines(model, distance, torque_share)
    beside += large_motions(source, largest_motions(motions.largest))
    title = f"{source.name}, {model.variant}: transient"
    words = partial(show_transient, title, figures, beside)
    Output(as_json, out).show({"transient": {**figures, "neglected": beside}}, words)


def _figures(model: Model, run: TimedRun, rest: Ranges) -> dict[str, Any]:
    """Summary figures of a transient of any case; rest: ranges over its settled window."""
    least, mean, most = rest.least, rest.mean, rest.largest
    return {
        "time_s": run.simulated,
        **window_of(run.data, float(run.data.attrs["end_time_s"])).figures,
        "wall_time_s": run.wall,
        "realtime_factor": run.realtime_factor,
        "steps": int(run.data.attrs["steps"]),
        "second_reduction": finite(model.modal.figures),
        "speed_rpm": {
            str(m): {
                "min": float(least["input_speed"].sel(input_coordinate=m)) * RPM,
                "max": float(most["input_speed"].sel(input_coordinate=m)) * RPM,
            }
            for m in most["input_coordinate"].to_numpy()
        },
        "port_torque_nm": {
            str(p): float(mean["port_torque"].sel(port=p)) for p in mean["port"].to_numpy()
        },
        "inertia_torque_nm": {
            str(m): {
                "min": float(least["inertia_torque"].sel(input_coordinate=m)),
                "max": float(most["inertia_torque"].sel(input_coordinate=m)),
            }
            for m in most["input_coordinate"].to_numpy()
        },
        "gear_mesh_force": force_ranges(rest),
        "load_sharing": sharing_summary_of(run.data),
        "distance_from_axis_um_max": distance_summary(most["axis_distance"]),
    }


Save = Annotated[
    list[str] | None,
    typer.Option(
        "--save", metavar="NAME", help="Variable to write to --out; repeatable. All if left out."
    ),
]


def saved_names(save: Sequence[str] | None, out: Path | None) -> list[str]:
    """Names of ``--save``; InputError for one that no run has, and where nothing is written."""
    names = [n.strip() for text in save or [] for n in text.split(",") if n.strip()]
    if names and out is None:
        raise InputError("--save", names[0], "has no file to go to", "add --out FILE")
    for name in names:
        if name not in RESULT_QUANTITIES:
            raise InputError("--save", name, "is not a variable", "e.g. gear_mesh_force")
    return names


@contextlib.contextmanager
def run_sinks(out: Path | None, names: Sequence[str], quiet: bool) -> Iterator[list[DatasetSink]]:
    """Sinks that print how much is coming and write it to ``out``, complete at the block's end."""
    watchers: list[DatasetSink] = [] if quiet else [Forecast(out, names)]
    if out is None:
        yield watchers
        return
    with dataset_file(out, names) as file:
        yield [*watchers, file]


class Forecast(DatasetSink):
    """A sink that prints how many samples are coming, on stderr, and stores none."""

    def __init__(self, out: Path | None, names: Sequence[str]) -> None:
        self._out, self._names = out, names

    def begin(self, coming: Coming) -> None:
        """Print the number of samples and the size of the file."""
        text = f"transient: {coming.samples} samples"
        if self._out is not None:
            written = replace(coming, pattern=chosen(coming.pattern, self._names))
            text += f", {size_text(written.size)} in {self._out} before compression"
        typer.echo(text, err=True)
