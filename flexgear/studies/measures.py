"""Measures of a parameter study: modes, power flow, bearing life, load sharing, loads, motions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.analysis.modes import classify
from flexgear.gears.bearings.nominal import bearing_life_ratios
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.read import nearest
from flexgear.results.labelled_dataset import groups_in
from flexgear.results.orders import SINGLE
from flexgear.results.rating import PARTS
from flexgear.results.run_orders import motion_rounding
from flexgear.results.sinks import SENSOR_TIME
from flexgear.results.stage_part import GEARS, has_pairs, stage_part, tooth_loads
from flexgear.results.time_figures import axis_distance, central_distance
from flexgear.solve.static import shared_stages
from flexgear.studies.rating import rate
from flexgear.studies.study_point import Point

MeasuredValues = dict[str, xr.DataArray]
OfPoint = TypeVar("OfPoint", bound=Callable[[Any], MeasuredValues])


@dataclass(frozen=True)
class Measure:
    """A measure of one point of a study.

    about: its meaning in words; of: function of a point that returns arrays by variable name;
    needs: section or body that a case must have for it, "" for every case.
    """

    about: str
    of: Callable[[Any], MeasuredValues]
    needs: str = ""


MEASURES: dict[str, Measure] = {}  # by name as on the command line


def measure(about: str, needs: str = "") -> Callable[[OfPoint], OfPoint]:
    """Decorator that adds a function of a ``Point`` to ``MEASURES`` under its name."""

    def register(of: OfPoint) -> OfPoint:
        MEASURES[of.__name__] = Measure(about, of, needs)
        return of

    return register


LABELS = {
    "mode": "number of the mode above the rigid motions, by rising frequency",
    "type": "type of mode",
    "number": "number among the different frequencies of this type",
    "gear_mesh": "gear meshes of the stage",
    "group": "gear meshes of all planets of a stage, kind and side",
    "body": "member, or node that stands for it",
    "statistic": "over all positions or times",
    "definition": "definition of load sharing",
    "member": "member of the train",
    "stage": "stage of the train",
    "bearing": "kind of bearing: ball or roller",
    "place": "bearing of the train",
    "axis": "direction",
    "part": "the weakest flank, root or bearing of a stage",
}


def array(
    values: ArrayLike, units: str, meaning: str, **labels: Sequence[int] | Sequence[str]
) -> xr.DataArray:
    """Values with their unit; labels: dimension -> labels, in the order of the axes."""
    coords = {
        dim: (dim, list(ticks), {"units": "1" if dim in ("mode", "number") else "",
                                 "long_name": LABELS[dim]})
        for dim, ticks in labels.items()
    }  # fmt: skip
    about = {"units": units, "long_name": meaning}
    return xr.DataArray(np.asarray(values), coords, tuple(labels), attrs=about)


def largest(values: Mapping[str, ArrayLike], units: str, meaning: str, dim: str) -> xr.DataArray:
    """Largest value of each array, by label."""
    data = [float(np.max(np.asarray(v))) for v in values.values()]
    return array(data, units, meaning, **{dim: list(values)})


STATISTICS = ("mean", "largest")
WARNING = "warning"
RING, SENSORS, LOADS = "a flexible ring", "[[sensors]]", "load cases"


def _elastic_modes(point: Point) -> tuple[NDArray[np.float64], tuple[str, ...], list[list[int]]]:
    """Natural frequencies above the rigid motions, rising, Hz, their types as of ``solve.modes``,
    and indices of the modes of each distinct frequency."""
    natural, system = point.model.natural_modes(), point.model.system
    rigid, bodies = int(np.sum(natural.frequencies == 0)), system.bodies
    types = classify(natural.frequencies, natural.shapes, system.mass, bodies, rigid=rigid)
    groups = [[i - rigid for i in group] for group in types.groups if group[0] >= rigid]
    return natural.frequencies[rigid:], tuple(types.kinds[rigid:]), groups


@measure("lowest natural frequencies and their types")
def frequencies(point: Point) -> MeasuredValues:
    """The lowest elastic frequencies and their types."""
    elastic, kinds, _ = _elastic_modes(point)
    f = elastic[: point.modes]
    ticks = range(1, len(f) + 1)
    return {
        "frequency": array(f, "Hz", "natural frequency", mode=ticks),
        "mode_type": array(np.array(kinds[: len(f)], dtype=str), "", "type of mode", mode=ticks),
    }


@measure("lowest natural frequencies of every type of mode")
def frequencies_by_type(point: Point) -> MeasuredValues:
    """The lowest distinct elastic frequencies of every type of mode."""
    f, kinds, groups = _elastic_modes(point)
    columns: dict[str, list[float]] = {}
    for group in groups:
        for kind in dict.fromkeys(kinds[i] for i in group):
            columns.setdefault(kind, []).append(float(f[group[0]]))
    longest = min(point.modes, max(map(len, columns.values()), default=0))
    values = np.full((len(columns), longest), np.nan)
    for k, column in enumerate(columns.values()):
        values[k, : len(column[:longest])] = column[:longest]
    about = "natural frequency, repeated ones once"
    labels: dict[str, Any] = {"type": list(columns), "number": range(1, longest + 1)}
    return {"frequency_by_type": array(values, "Hz", about, **labels)}


@measure("quasi-static load sharing by three definitions")
def load_sharing(point: Point) -> MeasuredValues:
    """Largest load sharing of the planets over the error cycle of every stage."""
    coefficients = xr.concat([d["load_sharing_coefficient"] for d in point.sharing], "group")
    return {"load_sharing": _coefficients(coefficients, "quasi-static load sharing")}


def _coefficients(coefficients: xr.DataArray, about: str) -> xr.DataArray:
    """Coefficients by definition and group of gear meshes."""
    values = coefficients.transpose("definition", "group")
    names = {d: [str(n) for n in values[d].to_numpy()] for d in ("definition", "group")}
    return array(values.to_numpy(), "1", f"{about}, largest of the planets", **names)


@measure("largest quasi-static gear-mesh forces")
def gear_mesh_forces(point: Point) -> MeasuredValues:
    """Largest force of a gear mesh: over the error cycle in stages whose planets share a load, over
    the equilibria in all other stages."""
    shared = shared_stages(point.model)
    forces = {
        name: force
        for data in (point.sharing if shared else [])
        for name, force in _by_group(data, "cycle_maximum").items()
    }
    if len(shared) < len(point.case.stages):
        forces = _by_group(point.equilibria, "gear_mesh_force") | forces
    about = "largest quasi-static force of a gear mesh"
    return {"gear_mesh_force_max": largest(forces, "N", about, "group")}


def _by_group(data: xr.Dataset, name: str) -> dict[str, xr.DataArray]:
    """Values of gear meshes, by group of those that share a load."""
    return {group: data[name].isel(gear_mesh=at) for group, at in groups_in(data).items()}


@measure("quasi-static displacements of suns, rings, carriers")
def displacements(point: Point) -> MeasuredValues:
    """Mean and largest distance of members from the axis over the equilibria."""
    distances = axis_distance(point.equilibria)
    samples = [d for d in distances.dims if d != "body"]
    return {
        "displacement": _distances(distances.mean(samples), distances.max(samples), "quasi-static")
    }


def _distances(mean: xr.DataArray, maximum: xr.DataArray, about: str) -> xr.DataArray:
    """Mean and largest distance (body,) of central members from their axis, without the rolling
    motion."""
    pair = [central_distance(distance, maximum) for distance in (mean, maximum)]
    return array(
        np.stack(pair), "m", f"distance of the member from its axis, {about}",
        statistic=STATISTICS, body=[str(n) for n in pair[0]["body"].to_numpy()],
    )  # fmt: skip


@measure("load sharing of a transient")
def transient_sharing(point: Point) -> MeasuredValues:
    """Largest load sharing of the planets in the settled window."""
    data, _ = point.transient
    if "load_sharing_coefficient" not in data:
        raise FlexgearError("no stage has planets that share a load")
    coefficients = data["load_sharing_coefficient"]
    return {"transient_sharing": _coefficients(coefficients, "load sharing after settling")}


@measure("largest gear-mesh forces of a transient")
def transient_forces(point: Point) -> MeasuredValues:
    """Largest force of a gear mesh in the settled transient."""
    forces = _by_group(point.settled.largest, "gear_mesh_force")
    about = "largest force of a gear mesh after settling"
    return {"transient_force_max": largest(forces, "N", about, "group")}


@measure("displacements of suns, rings, carriers in a transient")
def transient_displacements(point: Point) -> MeasuredValues:
    """Mean and largest distance of members from the axis in the settled window."""
    mean, maximum = (d["axis_distance"] for d in (point.settled.mean, point.settled.largest))
    return {"transient_displacement": _distances(mean, maximum, "after settling")}


@measure("root mean square of what sensors measure in a transient", SENSORS)
def sensors(point: Point) -> MeasuredValues:
    """Root mean square of every signal about its mean, in the settled window."""
    data, signal = point.signals, point.signals["sensor_signal"]
    rest = signal.to_numpy()[data[SENSOR_TIME].to_numpy() >= data.attrs["settle_s"]]
    if not len(rest):
        raise FlexgearError("the settled part is too short for the filter of its sensors")
    about = {"units": "", "long_name": "root mean square about its mean of a signal, SI"}
    time, units = data[SENSOR_TIME].to_numpy(), signal["sensor_unit"].to_numpy().tolist()
    noise = np.array([motion_rounding(unit, time) for unit in units])
    rms = rest.std(axis=0)
    rms[rms <= np.maximum(noise, SINGLE * np.abs(rest).max(axis=0))] = 0.0
    return {"sensor_rms": xr.DataArray(rms, signal["sensor"].coords, "sensor", attrs=about)}


@measure("what sensors measure in a transient, sample by sample", SENSORS)
def sensor_signals(point: Point) -> MeasuredValues:
    """Signals of sensors and rotations of the inputs by sample number, the time of the first sample
    and the sampling interval."""
    data = point.signals
    time = data[SENSOR_TIME].to_numpy()
    if len(time) < 2:
        raise FlexgearError("the transient is too short for the filter of its sensors")
    about = {"units": "1", "long_name": "number of a sample, from 0"}
    samples = xr.Variable("sample", np.arange(len(time)), about)
    values = {
        name: data[name]
        .drop_vars(SENSOR_TIME)
        .rename({SENSOR_TIME: "sample"})
        .assign_coords(sample=samples)
        for name in ("sensor_signal", "sensor_input_angle")
    }
    values["sensor_start"] = array(time[0], "s", "time of the first sample")
    values["sensor_interval"] = array(time[1] - time[0], "s", "time between two samples")
    return values


@measure("speeds of members and planets, gear-mesh frequencies")
def speeds(point: Point) -> MeasuredValues:
    """Speeds of the power flow."""
    of, about = partial(_of_stages, point), "speed of planets to their carrier"
    return {
        "speed": _members(point.flow.speed, "rad/s", "speed of the member"),
        "planet_relative_speed": of("planet_relative_speed", "rad/s", about),
        "gear_mesh_frequency": of("gear_mesh_frequency", "Hz", "gear-mesh frequency"),
    }


@measure("torques on all members")
def torques(point: Point) -> MeasuredValues:
    """Torques of the power flow."""
    about = "torque by the rest of the train on the member"
    return {"torque": _members(point.flow.branch_torque, "N m", about)}


@measure("powers of members, rolling and circulating power")
def powers(point: Point) -> MeasuredValues:
    """Powers of the power flow."""
    flow, about = point.flow, "power that enters the stage at the member"
    rolling = "rolling power of the stage, sun to ring"
    return {
        "power": _members(flow.branch_power, "W", about),
        "rolling_power": _of_stages(point, "stage_power", "W", rolling),
        "circulating_power": array(flow.circulating_power, "W", "power round closed loops"),
    }


def _members(values: Mapping[str, float], units: str, about: str) -> xr.DataArray:
    """Values by member."""
    return array(list(values.values()), units, about, member=list(values))


def _of_stages(point: Point, name: str, units: str, about: str) -> xr.DataArray:
    """Values of an attribute of ``StageFlow``, by stage."""
    stages = point.flow.stages
    values = [getattr(stage, name) for stage in stages]
    return array(values, units, about, stage=[stage.name for stage in stages])


@measure("mean forces of gear meshes and planet bearings")
def mean_forces(point: Point) -> MeasuredValues:
    """Mean forces of the power flow."""
    names = ("sun_gear_mesh_force", "ring_gear_mesh_force", "planet_bearing_force")
    of = partial(_of_stages, point)
    return {
        f"mean_{name}": abs(of(name, "N", f"mean {name.replace('_', ' ')} of a planet"))
        for name in names
    }


@measure("largest load of a tooth pair of flexible rings", RING)
def tooth_load(point: Point) -> MeasuredValues:
    """Largest load of a tooth pair in stages with an FE ring, on the loaded flank. FlexgearError
    where waves of stiffness stand for pairs."""
    if not has_pairs(point.equilibria):
        raise FlexgearError('waves of stiffness have no tooth pairs: use model = "per_pair"')
    loads = {
        f"{stage} {gear}": tooth_loads(stage_part(point.equilibria, stage), gear).to_numpy()
        for stage in point.case.fe_ring_stages
        for gear in GEARS
    }
    return {"tooth_load": largest(loads, "N", "largest load of a tooth pair", "gear_mesh")}


@measure("largest displacement of the tooth nodes of flexible rings", RING)
def tooth_displacement(point: Point) -> MeasuredValues:
    """Largest displacement of the tooth nodes of each FE ring over the equilibria, by axis."""
    stages = list(point.case.fe_ring_stages)
    largest_of = [
        np.abs(stage_part(point.equilibria, s)["tooth_displacement"].to_numpy()).max(axis=(0, 1))
        for s in stages
    ]
    about = "largest displacement of a ring tooth node, fixed axes"
    return {"tooth_displacement": array(largest_of, "m", about, stage=stages, axis=list("xyz"))}


@measure("rating life of bearings of planets, pinions and gears over that of the case")
def bearing_life(point: Point) -> MeasuredValues:
    """Ratio of L₁₀ (in time) to that of the unchanged case, of bearings that turn under load."""
    reference = power_flow(point.reference)
    ratios = bearing_life_ratios(point.case, point.flow, point.reference, reference)
    values = [list(by_place.values()) for by_place in ratios.values()]
    about = "basic rating life of bearings under nominal loads over that of the unchanged case"
    places = list(ratios["ball"])
    return {"life_ratio": array(values, "1", about, bearing=list(ratios), place=places)}


RATING_QUANTITIES = ("load_reserve", "damage_sum", "life")
LONGEST_LIFE = 1e7  # h; recorded for every longer life, too


@measure("load reserve by safety, damage and life under the case's load cases", LOADS)
def life(point: Point) -> MeasuredValues:
    """Load reserve, damage and life of the weakest flank, root and bearing of every stage."""
    rating = rate(point.case, workers=1)
    if not rating.hours:
        raise FlexgearError("no load case has a duration: give hours, or a spectrum")
    labels = [f"{stage} {kind}" for stage, kind in rating.weakest]
    figures = MeasuredValues()
    for name in RATING_QUANTITIES:
        quantity, of = PARTS[name]
        values = [of(part) for part in rating.weakest.values()]
        if name == "life":
            values = [min(value, LONGEST_LIFE) for value in values]
        figures[name] = array(values, quantity.units, quantity.meaning, part=labels)
    return figures


def measures_of(case: Case) -> dict[str, Measure]:
    """Measures that can be taken of a case, by name."""
    available = {
        "": True,
        RING: bool(case.fe_ring_stages),
        SENSORS: bool(case.sensors),
        LOADS: bool(case.load_cases or case.load_series),
    }
    return {name: m for name, m in MEASURES.items() if available[m.needs]}


def chosen_measures(case: Case, names: Sequence[str]) -> tuple[str, ...]:
    """The named measures; without names frequencies and load sharing, or speeds where no planets
    share a load. InputError for a measure that the case cannot have."""
    by_name = measures_of(case)
    for name in names:
        if name not in by_name:
            problem, remedy = "is no measure", nearest(name, list(by_name))
            if name in MEASURES:
                problem = f"needs {MEASURES[name].needs}"
            elif alike := [n for n, m in MEASURES.items() if name.lower() in m.about]:
                remedy = f"use {' or '.join(alike)}"
            raise InputError("--measure", name, problem, f"{remedy}; see flexgear sweep -h")
    shared = any(stage.planets > 1 for stage in case.stages)
    usual = ("frequencies", "load_sharing" if shared else "speeds")
    return tuple(dict.fromkeys(names)) or usual


def measured(shared: tuple[Case, Sequence[str], int], case: Case) -> MeasuredValues:
    """Measured arrays of one point by variable name, its warnings under ``WARNING``.

    shared: the case without the changes of the study, the names of the measures, and the number of
    natural modes to list.
    """
    reference, names, modes = shared
    point, figures = Point(case, reference, modes), MeasuredValues()
    for name in chosen_measures(case, names):  # not every point has the usual measures
        figures |= MEASURES[name].of(point)
    if lines := point.warnings:
        figures[WARNING] = array("; ".join(lines), "", "warnings of the point")
    return figures
