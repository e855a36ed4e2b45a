"""Commands for single analyses: equilibria, modes, a transient."""

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from typer import Option

from flexgear.cli import analysis_views as views
from flexgear.cli import options
from flexgear.cli.analysis import Analysis, assembled
from flexgear.cli.display import progress, warn
from flexgear.coupling.pace import too_coarse
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import InputError
from flexgear.model.units import RPM, size_text
from flexgear.results.dataset_file import chosen, dataset_file, reopened
from flexgear.results.load_sharing import ROUNDING
from flexgear.results.result_quantities import RESULT_QUANTITIES
from flexgear.results.run_folder import transient_file
from flexgear.results.settling import SensorRanges, WindowedRanges, window_edges, window_of
from flexgear.results.sinks import DatasetSink, Ranges, RunSize, SinkGroup
from flexgear.results.summary import sharing_summary_of
from flexgear.results.time_figures import (
    distance_summary,
    energy_balance,
    force_ranges,
    largest_residual,
    stage_histories,
)
from flexgear.solve.angles import lead_angles
from flexgear.solve.campbell import campbell as over_speed
from flexgear.solve.long_run import TimedRun, end_of, refuse_endless
from flexgear.solve.model import Model
from flexgear.solve.modes import mode_rows, usual_limit
from flexgear.solve.modes import modes as natural_modes
from flexgear.solve.result_warnings import (
    growing_forces,
    large_motions,
    largest_motions,
    motion_histories,
    pulling_teeth,
    reversed_pairs,
    two_senses,
    without_rounding,
)
from flexgear.solve.static import static as equilibria
from flexgear.solve.transient import cut_short, fault_warnings, stepping_of, train_histories
from flexgear.solve.transient import simulate as run_transient

LARGEST = 1e9  # Hz, s, or times the rated torque
Save = Annotated[
    list[str] | None,
    Option(
        "--save", metavar="NAME", help="Variable to write to --out; repeatable. All if left out."
    ),
]

NO_SAMPLES = (
    "sensors have no samples in the settled part, as their filter is longer: simulate longer, or "
    "raise recorder.sampling_rate_hz"
)
CONSTANT = 1e-3  # of the largest torque of a port, below which a change is not reported


def static(
    analysis: Analysis,
    angle_deg: Annotated[
        list[float] | None, Option(help="Rotation of the carrier (first input); repeatable.")
    ] = None,
    torque_nm: Annotated[
        float | None, Option(help="Torque of the drive; rated unless given.")
    ] = None,
) -> None:
    """Static equilibrium at angles: gear-mesh forces, load sharing, displacements."""
    degrees = angle_deg or [0.0]
    with analysis.model() as (model, report):
        data = equilibria(model, _turned(model, degrees), torque_nm, report)
    analysis.save(data)
    positions = {
        f"{angle:g} deg": views.equilibrium_figures(model, data.isel(position=slice(k, k + 1)))
        for k, angle in enumerate(degrees)
    }
    notes = views.equilibrium_warnings(model, data, positions)
    figures = {**positions, "closure": data.attrs["closure_max"], "neglected": notes}
    analysis.show(figures, partial(views.show_equilibria, model, data, positions, notes))


def _turned(model: Model, degrees: list[float]) -> NDArray[np.float64]:
    """Rotations (rad) of the reference member when the first input has turned by ``degrees``."""
    return lead_angles(model.case, model.flow, np.radians(degrees))


def modes(
    analysis: Analysis,
    limit_hz: Annotated[
        float | None, Option(help="Highest frequency; modes_band_hz, or all of a lumped train.")
    ] = None,
    angle_deg: Annotated[
        float | None,
        Option(
            help="Gear meshes as at this rotation of the carrier (first input) instead of their "
            "mean stiffness over a gear-mesh cycle."
        ),
    ] = None,
    campbell: Annotated[
        bool,
        Option("--campbell", help="Frequencies over speed, excitations and resonances."),
    ] = False,
) -> None:
    """Natural modes of the coupled train: frequencies, types, moving components."""
    _require_positive("--limit-hz", limit_hz, "500")
    if campbell:
        option = "--campbell, which takes the mean stiffness of gear meshes"
        options.refuse_beside(option, {"--angle-deg": angle_deg is not None})
    every = limit_hz is not None
    with analysis.model(loaded=False) as (model, _):
        limit_hz = usual_limit(model) if limit_hz is None else limit_hz
        angle = None if angle_deg is None else float(_turned(model, [angle_deg])[0])
        if any(band < (limit_hz or 0.0) for band in model.pace.member_bands.values()):
            warn([f"modes are accurate up to the bands of bodies: {model.pace.band_note}"])
        data = natural_modes(model, angle=angle, limit_hz=limit_hz)
        if campbell:
            at_rest, data = data, over_speed(model, limit_hz=limit_hz)
    analysis.save(data)
    if campbell:
        figures = views.campbell_figures(model, data, at_rest)
        analysis.show(figures, partial(views.show_campbell, model, data, figures["resonance"]))
    else:
        rows = mode_rows(data)
        figures = {"variant": model.variant, "modes": rows}
        if ratios := model.damping_ratios:
            figures["damping_ratios"] = ratios
        analysis.show(figures, partial(views.show_modes, model, rows, limit_hz, every=every))


def _require_positive(option: str, value: float | None, example: str) -> None:
    """InputError for a value of an option that is not positive, or beyond all reason."""
    if value is not None and not 0 < value <= LARGEST:
        problem = f"is beyond {LARGEST:g}" if value > LARGEST else "is not positive"
        raise InputError(option, f"{value:g}", problem, f"e.g. {example}")


def simulate(
    analysis: Analysis,
    duration_s: Annotated[
        float | None,
        Option(help="One turn of the slowest stage unless given."),
    ] = None,
    torque_share: Annotated[float, Option(help="Factor on all torques.")] = 1.0,
    energy: Annotated[bool, Option("--energy", help="Keep the energy balance.")] = False,
    start_from: Annotated[
        Path | None,
        Option(
            "--from",
            help="Continue from the end of another transient of the train: its file, or the folder "
            "of a run. Machines and loads may differ.",
        ),
    ] = None,
    save_only: Save = None,
) -> None:
    """Transient under the case's drive."""
    _require_positive("--duration-s", duration_s, "1.5")
    _require_positive("--torque-share", torque_share, "1.5")
    case, parts = analysis.read()
    names = saved_names(save_only, analysis.out)
    start = None if start_from is None else reopened(transient_file(start_from))
    begin = 0.0 if start is None else end_of(start, case.source)
    flow = power_flow(case)
    usual = stepping_of(case, flow, duration_s, start=begin)
    refuse_endless(usual, case.source)
    account, motions = Ranges(energy_balance), Ranges(motion_histories)
    with (
        run_sinks(analysis.out, names, analysis.quiet) as sinks,
        progress(analysis.quiet) as report,
    ):
        model = assembled(case, parts, report)
        edges = window_edges(usual.duration, case.solver.settle, begin)
        ranges = partial(WindowedRanges, edges=edges)
        whole, sensors = ranges(train_histories), SensorRanges(edges)
        rings = {s: ranges(partial(stage_histories, stage=s)) for s in case.fe_ring_stages}
        watching = [whole, motions, sensors, *rings.values(), *([account] if energy else [])]
        short = [] if duration_s is not None else cut_short(case, flow)
        warn([*too_coarse(model.pace, case.solver), *fault_warnings(model, duration_s), *short])
        run = run_transient(
            model, duration=duration_s, torque_share=torque_share, energy=energy, progress=report,
            start=start, sink=SinkGroup([*watching, *sinks]),
        )  # fmt: skip
    settled = float(run.data.attrs["settle_s"])
    figures = _figures(model, run, whole.since(settled))
    if case.sensors:
        figures["sensors"] = sensors.figures(settled)
        if not figures["sensors"]:
            warn([NO_SAMPLES])
    figures |= {stage: views.transient_figures(r.since(settled)) for stage, r in rings.items()}
    if energy:
        figures["energy_residual"] = largest_residual(account)
    distance = views.farthest(figures["distance_from_axis_um_max"])
    notes = views.neglected_lines(model, distance, torque_share)
    forces = without_rounding(case, figures["gear_mesh_force"])
    notes += pulling_teeth(case, two_senses(forces)) + growing_forces(case, forces)
    notes += reversed_pairs(case, {g: f["max_n"] for g, f in forces.items()})
    notes += large_motions(case, largest_motions(motions.largest))
    title = f"{case.name}, {model.variant}: transient"
    analysis.show(
        {"transient": {**figures, "neglected": notes}},
        partial(views.show_transient, title, figures, notes),
    )


def _figures(model: Model, run: TimedRun, settled: Ranges) -> dict[str, Any]:
    """Summary figures of a transient; settled: ranges of histories over its settled window."""
    mean = settled.mean
    ports = _ends(settled, "port_torque", 1.0)
    least = ROUNDING * max(abs(end) for ends in ports.values() for end in ends.values())
    return {
        "time_s": run.simulated,
        **window_of(run.data, float(run.data.attrs["end_time_s"])).figures,
        "wall_time_s": run.wall,
        "realtime_factor": run.realtime_factor,
        "steps": int(run.data.attrs["steps"]),
        "second_reduction": model.modal.figures,
        "speed_rpm": _ends(settled, "input_speed", RPM),
        "port_torque_nm": {
            str(p): float(mean["port_torque"].sel(port=p)) for p in mean["port"].to_numpy()
        },
        "port_torque_range_nm": {
            port: ends
            for port, ends in ports.items()
            if ends["max"] - ends["min"] > CONSTANT * max(abs(ends["max"]), abs(ends["min"]))
        },
        "inertia_torque_nm": _ends(settled, "inertia_torque", 1.0, least),
        "gear_mesh_force": force_ranges(settled),
        "load_sharing": sharing_summary_of(run.data),
        "distance_from_axis_um_max": distance_summary(settled.largest["axis_distance"]),
    }


def _ends(
    ranges: Ranges, name: str, factor: float, rounding: float = 0.0
) -> dict[str, dict[str, float]]:
    """Least and largest value of every input coordinate or port, times ``factor``; 0 up to
    ``rounding``."""
    both = (r[name].to_series() for r in (ranges.least, ranges.largest))
    least, largest = (ends.where(ends.abs() > rounding, 0.0) for ends in both)
    return {
        str(m): {"min": float(low) * factor, "max": float(high) * factor}
        for (m, low), high in zip(least.items(), largest, strict=True)
    }


def saved_names(save: Sequence[str] | None, out: Path | None) -> list[str]:
    """Names given with ``--save``; InputError for an unknown name, or names without ``--out``."""
    names = [n.strip() for text in save or [] for n in text.split(",") if n.strip()]
    if names and out is None:
        raise InputError("--save", names[0], "has no file to go to", "add --out FILE")
    for name in names:
        if name not in RESULT_QUANTITIES:
            raise InputError("--save", name, "is not a variable", "e.g. gear_mesh_force")
    return names


@contextlib.contextmanager
def run_sinks(out: Path | None, names: Sequence[str], quiet: bool) -> Iterator[list[DatasetSink]]:
    """Context of sinks that print the size of a transient in advance and write it to ``out``."""
    watchers: list[DatasetSink] = [] if quiet else [Forecast(out, names)]
    if out is None:
        yield watchers
        return
    with dataset_file(out, names) as file:
        yield [*watchers, file]


class Forecast(DatasetSink):
    """A sink that prints the number of samples and the size of the file before a transient."""

    def __init__(self, out: Path | None, names: Sequence[str]) -> None:
        self._out, self._names = out, names

    def begin(self, run_size: RunSize) -> None:
        """Print the number of samples and the size of the file."""
        text = f"transient: {run_size.samples} samples"
        if self._out is not None:
            written = replace(run_size, pattern=chosen(run_size.pattern, self._names))
            text += f", {size_text(written.size)} in {self._out} before compression"
        typer.echo(text, err=True)
