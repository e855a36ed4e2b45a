"""Commands ``flexgear response``, steady states or the linear response over speed, and
``flexgear stability``, bands of parametric instability."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Annotated, Any

import numpy as np
import typer
import xarray as xr
from typer import Option

from flexgear.cli import options
from flexgear.cli.analysis import Analysis
from flexgear.cli.display import columns, table, warn
from flexgear.model.names import GearMeshName
from flexgear.model.units import RPM
from flexgear.results.report.wording import number, of_stage, signal_scale, with_unit, words
from flexgear.solve.linear_response import linear_response
from flexgear.solve.model import Model
from flexgear.solve.response import DOUBLINGS
from flexgear.solve.response import response as steady_states
from flexgear.solve.response_figures import response_figures
from flexgear.solve.stability import ORDERS, SPEEDS
from flexgear.solve.stability import stability as over_speed
from flexgear.solve.turning_points import BRANCH, KINDS, SECOND_FREQUENCY, TURNING
from flexgear.views.vibration_charts import (
    bands_of,
    linear_response_chart,
    period_words,
    response_chart,
    stability_chart,
)

MAX_CHANGE = 0.05  # of motion over its range by twice as many harmonics, above which a line warns
LEAST_CHANGE = 1e-5  # least such change that is stated
TEETH = {
    "one-sided": "lose contact there, which a linear response does not have",
    "linear": 'pull there, as gear_mesh.contact_law = "linear"; take "one-sided"',
}
SAME = 1.001  # ratio of amplitudes of planets alike, and of forces to which a sweep jumps alike
ROUGH = 17  # order from which on the parts of a cycle are long beside half of a mode's period
MAX_LINES = 12  # peaks and changes of stability that are printed
LEAST_SHARE = 0.01  # of a peak: modes with smaller shares are not named
RANGES = {  # of a response, in addition to those without contact
    "several_stable": "several stable states, the start decides",
    "back_contact": "coast flanks in contact",
}
TIMES = {2: "twice", 4: "four times", 8: "eight times", 16: "sixteen times"}
COLUMNS = ("stage", "speeds over rated", "fastest at", "growth", "modes and order")
SpeedRange = Annotated[
    tuple[float, float] | None,
    Option(metavar="LOW HIGH", help="Lowest and highest speed over rated: 0.2 1.5."),
]


def response(
    analysis: Analysis,
    speed_range: SpeedRange = None,
    torque_range: Annotated[
        tuple[float, float] | None,
        Option(metavar="LOW HIGH", help="Torques over rated, at one speed."),
    ] = None,
    speed: Annotated[float, Option(help="Speed over rated, with --torque-range.")] = 1.0,
    torque: Annotated[float, Option(help="Torques over rated.")] = 1.0,
    stage: Annotated[str, Option(help="Exciting stage; the first that turns.")] = "",
    harmonics: Annotated[
        int | None,
        Option(help="Of the gear-mesh frequency in a state; by the case if left out."),
    ] = None,
    doublings: Annotated[
        int,
        Option(help="Of the gear-mesh period; 1: follow states of two periods, too."),
    ] = DOUBLINGS,
    linear: Annotated[
        bool,
        Option(
            "--linear", help="Response to the transmission error at mean stiffness; modal shares."
        ),
    ] = False,
) -> None:
    """Frequency response with all branches: peaks, jumps, lost contact over speed or torque."""
    if linear:
        options.refuse_beside("--linear", {
            "--torque-range": torque_range, "--speed": speed != 1.0, "--torque": torque != 1.0,
            "--stage": stage, "--harmonics": harmonics, "--doublings": doublings != DOUBLINGS,
        })  # fmt: skip
    with analysis.model(pictured=True) as (model, report):
        if linear:
            data = linear_response(model, speed_range, progress=report)
        else:
            data = steady_states(
                model,
                speeds=speed_range,
                torques=torque_range,
                speed=speed,
                torque=torque,
                stage=stage,
                harmonics=harmonics,
                doublings=doublings,
                progress=report,
            )
    analysis.save(data, linear_response_chart if linear else response_chart)
    if linear:
        peaks = [_linear_peak(model, data.isel(peak=k)) for k in range(data.sizes.get("peak", 0))]
        at = data["linear_force_amplitude"][data["linear_force_amplitude"].argmax(...)]
        place = at["gear_mesh"].item(), int(at["gear_mesh_order"]), float(at["speed_factor"])
        largest = _amplitude(model, *place, float(at))
        shown = partial(_show_linear, model, peaks, largest)
        analysis.show({"largest": largest, "peaks": peaks}, shown)
    else:
        figures = response_figures(data)
        analysis.show(figures, partial(show_response, model, data, figures))


def stability(
    analysis: Analysis,
    speed_range: SpeedRange = None,
    count: Annotated[
        int, Option(min=3, help="Number of speeds; expected bands add more.")
    ] = SPEEDS,
    limit_hz: Annotated[
        float | None,
        Option(help="Highest natural frequency of modes that are kept."),
    ] = None,
) -> None:
    """Parametric instability: speeds at which vibration grows by varying gear-mesh stiffness."""
    with analysis.model(pictured=True) as (model, report):
        data = over_speed(model, speed_range, count=count, limit_hz=limit_hz, progress=report)
    analysis.save(data, stability_chart)
    bands = [
        {"stage": stage, "growth_rate_per_s": band.pop("growth_rate"), **band}
        for stage in map(str, data["turning_stage"].to_numpy())
        for band in bands_of(data, stage)
    ]
    analysis.show({"bands": bands}, partial(_show_stability, model, data, bands))


def _show_linear(model: Model, peaks: list[dict[str, Any]], largest: dict[str, Any]) -> None:
    """Print the highest peaks of gear-mesh forces, and the modes with the largest shares; before
    these the largest amplitude if it is none of them, as near the ends of the range."""
    typer.echo(
        f"{model.case.name}, {model.variant}: response to the static transmission error, mean "
        "stiffness"
    )
    if not peaks:
        typer.echo("  no peak in this range")
    highest = max((peak["force_n"] for peak in peaks), default=0.0)
    above = [largest] if largest["force_n"] > SAME * highest else []
    if above:
        typer.echo(
            f"  largest amplitude in this range: {with_unit(largest['force_n'], 'N')}, "
            f"{words(largest['gear_mesh'])}, order {largest['order']}, at "
            f"{largest['speed_share']:.4g} of rated speed"
        )
    alike = _alike_planets(peaks)
    for peak, names in alike[:MAX_LINES]:
        modes = ", ".join(f"mode {m} {100 * s:.0f} %" for m, s in peak["modes"].items())
        typer.echo(
            f"  {words(names)}, order {peak['order']}, {peak['speed_share']:.4g} of rated "
            f"speed: {with_unit(peak['force_n'], 'N')} ({modes})"
        )
    if len(alike) > MAX_LINES:
        typer.echo(f"  and {len(alike) - MAX_LINES} lower ones (--json lists all)")
    lost = [peak for peak in (*peaks, *above) if peak["force_n"] > peak["mean_force_n"]]
    if lost:
        worst = max(lost, key=lambda p: p["force_n"] - p["mean_force_n"])
        law = model.case.view(worst["gear_mesh"].stage).gear_mesh.contact_law
        warn([
            f"{words(worst['gear_mesh'])}: amplitude {with_unit(worst['force_n'], 'N')} at "
            f"{worst['speed_share']:.4g} of rated speed exceeds the mean force of "
            f"{with_unit(worst['mean_force_n'], 'N')}: teeth {TEETH[law]}; leave out --linear to "
            "see how high the resonance is"
        ])  # fmt: skip


def _alike_planets(peaks: list[dict[str, Any]]) -> list[tuple[dict[str, Any], str]]:
    """Peaks, one of all planets that have it at the same height, with the names of gear meshes."""
    alike = dict[tuple[str, ...], list[dict[str, Any]]]()
    for peak in peaks:
        figures = (f"{peak['speed_share']:.4g}", f"{peak['force_n']:.4g}", str(peak["order"]))
        alike.setdefault((peak["gear_mesh"].group, *figures), []).append(peak)
    return [(of[0], GearMeshName.joined([p["gear_mesh"] for p in of])) for of in alike.values()]


def _amplitude(model: Model, name: str, order: int, share: float, force: float) -> dict[str, Any]:
    """An amplitude of the force of a gear mesh, with the mean force there."""
    mean = float(model.mean_forces[model.gear_meshes.names.index(GearMeshName.parse(name))])
    return {"gear_mesh": GearMeshName.parse(name), "order": order, "speed_share": share,
            "force_n": force, "mean_force_n": mean}  # fmt: skip


def _linear_peak(model: Model, row: xr.Dataset) -> dict[str, Any]:
    """A peak with its three largest modal shares."""
    at = (row["peak_gear_mesh"].item(), int(row["peak_order"]), float(row["peak_factor"]))
    share = row["peak_mode_share"].to_numpy()
    largest = np.argsort(-np.abs(share))[:3]
    numbers = row["kept_mode"].to_numpy()
    modes = {int(numbers[k]): float(share[k]) for k in largest if abs(share[k]) >= LEAST_SHARE}
    return {**_amplitude(model, *at, float(row["peak_force"])), "modes": modes}


def show_response(model: Model, data: xr.Dataset, figures: dict[str, Any]) -> None:
    """Print the figures of a response."""
    over = figures["over"]
    low, high = (float(f(data[f"response_{over}_share"])) for f in (np.min, np.max))
    change = figures["doubling_change"]
    least = "less than " if change is not None and change < LEAST_CHANGE else ""  # rounding
    longer = len(figures["longer_periods"])
    rows = {
        f"{over} over rated": f"{low:g} to {high:g}, {figures['states']} steady states on "
        f"{figures['curves']} {'curve' if figures['curves'] == 1 else 'curves'}"
        + (f", {longer} of them with a period of several gear meshes" if longer else ""),
        "reference member": f"{data['response_speed'].min().item() * RPM:.5g} to "
        f"{data['response_speed'].max().item() * RPM:.5g} r/min",
        "gear mesh": f"{data['gear_mesh_frequency'].min().item():.5g} to "
        f"{data['gear_mesh_frequency'].max().item():.5g} Hz",
        "distance of states": f"at most {figures['largest_step']:.2g}: narrower unstable ranges "
        "may be missed" + (", see flexgear stability" if over == "speed" else ""),
        "harmonics": f"{figures['harmonics']}; "
        + (
            "the effect of more harmonics is not known"
            if change is None
            else f"twice as many change the motion by {least}"
            f"{with_unit(max(change, LEAST_CHANGE), 'share')} of its range"
        ),
    }
    table(f"{model.case.name}, {model.variant}: response{of_stage(figures['stage'])}", rows)
    typer.echo("\n".join(dict.fromkeys(_lines(figures))))  # a state may be on two curves
    if data.attrs["left_out"]:
        typer.echo(f"left out, as it does not repeat with the gear mesh: {data.attrs['left_out']}")
    for cut in figures["cuts"]:
        typer.echo(f"a curve is cut {cut}")
    resonance = model.pace.resonance
    highest = figures["harmonics"] * data["gear_mesh_frequency"].min().item()
    if change is not None and change > MAX_CHANGE:
        below = f"{with_unit(highest, 'Hz')} at the lowest speed, below the "
        below += f"{with_unit(resonance, 'Hz')} at which gears vibrate on their gear mesh"
        line = "too few harmonics: peaks may be too low, or missing"
        line += f" (they end at {below})" if highest < resonance else ""
        warn([f"{line}; give more --harmonics, up to 200, over a short range, or simulate"])


def _lines(figures: dict[str, Any]) -> Iterator[str]:
    """Lines on peaks, jumps, changes of stability, sensors and ranges of a response."""
    over = figures["over"]
    share = f"{over}_share"
    yield ""
    largest = figures["largest"]
    highest = max((row["force_n"] for row in figures["peaks"]), default=0.0)
    if largest and largest["force_n"] > highest:
        force = with_unit(largest["force_n"], "N")
        yield f"  largest gear-mesh force of stable states: {force} at {largest[share]:.4g}"
    for row in figures["peaks"]:
        force = with_unit(row["force_n"], "N")
        period = f", {period_words(row['period'])}" if row["period"] > 1 else ""
        yield f"  peak at {row[share]:.4g}: gear-mesh force up to {force}{period}"
    for row in figures["jumps"]:
        to_forces = row["to_forces_n"]  # rising; a state may be on two curves
        different = [to for k, to in enumerate(to_forces) if not k or to > SAME * to_forces[k - 1]]
        targets = " or ".join(with_unit(to, "N") for to in different)
        target = f" to {targets}" if targets else ", to no state of this range"
        moving = "rising" if row["sense"] == "up" else "falling"
        yield (
            f"  jump of a sweep of {moving} {over} at {row[share]:.4g}: from "
            f"{with_unit(row['force_n'], 'N')}{target}"
        )
    for row in figures["stability_changes"][:MAX_LINES]:
        motion = f"of {TIMES[2 * row['period']]} the gear-mesh period"
        if row["kind"] == KINDS[SECOND_FREQUENCY]:
            motion = "that beats with a second frequency"
        elif row["kind"] == KINDS[BRANCH]:
            motion = "that lacks a symmetry of the train"
        curve = row["leaving_curve"]
        followed = f": curve {curve}" if curve else "; not followed"
        if row["kind"] == KINDS[BRANCH] and not curve:
            yield f"  stability changes at {row[share]:.4g}, where no other curve was found"
        elif row["kind"] != KINDS[TURNING]:
            yield f"  motion {motion} branches off at {row[share]:.4g}{followed}"
    if figures["doubled_at_ends"]:
        ends = " and ".join(f"{x:.4g}" for x in figures["doubled_at_ends"])
        wider = "wider " if over == "speed" else ""
        yield f"  the period is doubled at {ends} already: a {wider}range of speeds shows the start"
    for row in figures["longer_periods"]:
        text = f"stable {_spans(row['stable'])}, gear-mesh force up to "
        text = text + with_unit(row["force_n"], "N") if row["stable"] else "unstable"
        yield f"  curve {row['curve']}, {period_words(row['period'])}: {text}"
    for name, row in figures["sensors"].items():
        unit, by = signal_scale([row["rms"]], row["unit"])
        signal = f"{number(by * row['rms'])} {unit}"
        level = f"up to {signal} rms on stable branches, at {row[share]:.4g}"
        yield f"  sensor {name}: {level if row['rms'] else 'constant'}"
    for name, what in {"lost_contact": figures["without_contact"], **RANGES}.items():
        if figures[name] or name != "several_stable":
            yield f"  {what}: {_spans(figures[name]) or 'nowhere on stable branches'}"
    if figures["no_stable"]:
        motion = "motion there has another period or none, see flexgear simulate"
        yield f"  no stable state was found at {_spans(figures['no_stable'])}: {motion}"


def _spans(spans: list[list[float]]) -> str:
    ends = ([f"{x:.4g}" for x in span] for span in spans)
    return ", ".join(" to ".join(dict.fromkeys(span)) for span in ends)


def _show_stability(model: Model, data: xr.Dataset, bands: list[dict[str, Any]]) -> None:
    """Print the analysed range and a line for each band."""
    factor, frequency = (data[n].to_numpy() for n in ("speed_factor", "kept_frequency"))
    counted_modes = "1 mode" if len(frequency) == 1 else f"{len(frequency)} modes"
    typer.echo(
        f"{model.case.name}, {model.variant}: parametric instability from {factor[0]:.4g} to "
        f"{factor[-1]:.4g} times rated speed, {counted_modes} up to "
        f"{with_unit(float(frequency[-1]), 'Hz')}"
    )
    of_mode = dict(zip(data["kept_mode"].values.tolist(), frequency.tolist(), strict=True))
    rows = [
        (
            words(band["stage"]),
            f"{band['lower_factor']:.5g} to {band['upper_factor']:.5g}",
            f"{band['peak_factor']:.4g}",
            with_unit(band["growth_rate_per_s"], "1/s"),
            _meets(band["modes"], band["order"], of_mode),
        )
        for band in bands
    ]
    if rows:
        typer.echo("")
        columns([COLUMNS, *rows])
    else:
        typer.echo("\nno vibration grows: damping is enough, or no stiffness varies")
    slowest = factor[0] * data["stage_gear_mesh_frequency"].min().item()
    highest = math.floor(2.0 * float(frequency[-1]) / slowest)
    if highest > ORDERS:
        line = f"\norders {ORDERS + 1} to {highest} act here, too: bands of these may lie between "
        line += "two speeds (--count)"
        rough = f"; from order {ROUGH} on peaks may be a tenth low, and edges are rough"
        typer.echo(line + (rough if highest >= ROUGH else ""))
    inside = [
        f"{speed:g}"
        for speed in np.atleast_1d(data.attrs["operating_factors"])
        if any(b["lower_factor"] <= speed <= b["upper_factor"] for b in bands)
    ]
    if inside:
        typer.echo(f"\nthe case runs inside a band at {', '.join(inside)} times rated speed")


def _meets(modes: list[int], order: int, frequency: dict[int, float]) -> str:
    """Modes and order of a band: "2 x mode 3 (1234 Hz), order 1"."""
    i, j = modes
    if i == j:
        return f"2 x mode {i} ({with_unit(frequency[i], 'Hz')}), order {order}"
    names = " + ".join(f"mode {m} ({with_unit(frequency[m], 'Hz')})" for m in modes)
    return f"{names}, order {order}"
