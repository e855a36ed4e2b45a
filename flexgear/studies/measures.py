"""Measures of a parameter study: modes, power flow, bearing life, load sharing, loads, motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.analysis.mode_types import classify
from flexgear.gears.bearings.basic_life import BALL, ROLLER, life_ratio
from flexgear.gears.error_cycle import TrainTurn, error_cycle
from flexgear.gears.power_flow import PowerFlow, StageFlow, power_flow
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.read import nearest
from flexgear.results.labelled_dataset import groups_in
from flexgear.results.rating import PARTS
from flexgear.results.sinks import Ranges, SensorRecord, Several
from flexgear.results.stage_part import GEARS, stage_part, tooth_loads
from flexgear.results.time_figures import axis_distance, central_distance
from flexgear.solve.angles import samples_of_stage, stage_motions
from flexgear.solve.bodies import reduced_bodies
from flexgear.solve.model import Model, assemble
from flexgear.solve.result_warnings import large_motions, largest_motions, motion_histories
from flexgear.solve.static import shared_stages, stages_sharing, static
from flexgear.solve.transient import simulate, train_histories
from flexgear.studies.rating import rate
from flexgear.studies.sensor_measures import sensor_levels, sensor_signals

MeasuredValues = dict[str, xr.DataArray]


@dataclass(frozen=True)
class Measure:
    """name: as on the command line; about: in words; of: point -> arrays by variable name."""

    name: str
    about: str
    of: Callable[[Any], MeasuredValues]


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
    """The largest of each array, by label."""
    data = [float(np.max(np.asarray(v))) for v in values.values()]
    return array(data, units, meaning, **{dim: list(values)})


FLOAT_CYCLES = 120  # gear-mesh cycles of each stage in which displacements are looked at
STATISTICS = ("mean", "largest")
WARNING = "warning"
NEEDS = {
    "tooth_load": "a ring that bends",
    "tooth_displacement": "a ring that bends",
    "sensors": "[[sensors]]",
    "sensor_signals": "[[sensors]]",
    "life": "load cases",
}


@dataclass(frozen=True)
class Point:
    """A case and the one it is compared with; what several measures need is worked out once."""

    case: Case
    reference: Case
    modes: int

    @cached_property
    def flow(self) -> PowerFlow:
        """Speeds, torques and powers."""
        return power_flow(self.case)

    @cached_property
    def model(self) -> Model:
        """The case put together."""
        return assemble(self.case, bodies=reduced_bodies(self.case))

    @cached_property
    def sharing(self) -> list[xr.Dataset]:
        """Quasi-static load sharing of every stage with planets, over its error cycle."""
        stages = shared_stages(self.model)
        if not stages:
            raise FlexgearError("no stage that turns has planets that share a load")
        return [stages_sharing(self.model, stage) for stage in stages]

    @cached_property
    def equilibria(self) -> xr.Dataset:
        """Equilibria in gear-mesh cycles of every stage.

        They are spread over the cycle of all errors there may be, so that the same positions are
        looked at whichever errors a study sets to zero.
        """
        case = self.case
        motions = tuple(
            replace(m, turn=TrainTurn(error_cycle(stage), m.turn.rate))
            for m, stage in zip(stage_motions(case, self.flow), case.stages, strict=True)
        )
        lead = [
            samples_of_stage(case, motions, k, FLOAT_CYCLES, linear=False).angles
            for k, motion in enumerate(motions)
            if motion.theta != 0
        ]
        return static(self.model, np.concatenate(lead))

    @cached_property
    def transient(self) -> tuple[xr.Dataset, Ranges]:
        """Transient at rated torque, without its samples, and their ranges after settling."""
        rest = Ranges(train_histories)
        return simulate(self.model, sink=Several([rest, self.recorded])).data, rest

    @cached_property
    def recorded(self) -> SensorRecord:
        """What sensors record in the transient."""
        return SensorRecord()

    @property
    def warnings(self) -> list[str]:
        """Motions that are not small, of what measures asked for, or of the equilibrium where the
        lead is at zero; none where the train was not put together or carries nothing."""
        solved = self.__dict__
        if "model" not in solved or self.case.output is None:
            return []
        still = solved["equilibria"] if "equilibria" in solved else static(self.model)
        motions = largest_motions(motion_histories(still))
        if "transient" in solved:
            in_time = largest_motions(solved["transient"][1].largest)
            motions |= {name: max(size, motions[name]) for name, size in in_time.items()}
        return large_motions(self.case, motions)


def _elastic(point: Point) -> tuple[NDArray[np.float64], tuple[str, ...], list[list[int]]]:
    """Natural frequencies above the rigid motions, rising, Hz, their types as ``solve.modes`` has
    them, and which of them are repeated ones."""
    natural, system = point.model.natural_modes(), point.model.system
    rigid, bodies = int(np.sum(natural.frequencies == 0)), system.bodies
    types = classify(natural.frequencies, natural.shapes, system.mass, bodies, rigid=rigid)
    groups = [[i - rigid for i in group] for group in types.groups if group[0] >= rigid]
    return natural.frequencies[rigid:], tuple(types.kinds[rigid:]), groups


def _frequencies(point: Point) -> MeasuredValues:
    """The lowest elastic frequencies and their types."""
    every, kinds, _ = _elastic(point)
    f = every[: point.modes]
    ticks = range(1, len(f) + 1)
    return {
        "frequency": array(f, "Hz", "natural frequency", mode=ticks),
        "mode_type": array(np.array(kinds[: len(f)], dtype=str), "", "type of mode", mode=ticks),
    }


def _frequencies_by_type(point: Point) -> MeasuredValues:
    """The lowest different elastic frequencies of every type of mode."""
    f, kinds, groups = _elastic(point)
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


def _members(point: Point, name: str, units: str, about: str) -> MeasuredValues:
    values: dict[str, float] = getattr(point.flow, name)
    return {name: array(list(values.values()), units, about, member=list(values))}


def _speeds(point: Point) -> MeasuredValues:
    stages = point.flow.stages
    return {
        **_members(point, "speed", "rad/s", "speed of the member"),
        "planet_relative_speed": _of_stages(
            stages, lambda s: s.planet_relative_speed, "rad/s", "speed of planets to their carrier"
        ),
        "gear_mesh_frequency": _of_stages(
            stages, lambda s: s.gear_mesh_frequency, "Hz", "gear-mesh frequency"
        ),
    }


def _torques(point: Point) -> MeasuredValues:
    about = "torque by the rest of the train on the member"
    return {"torque": _members(point, "branch_torque", "N m", about)["branch_torque"]}


def _powers(point: Point) -> MeasuredValues:
    flow, about = point.flow, "power that enters the stage at the member"
    return {
        "power": _members(point, "branch_power", "W", about)["branch_power"],
        "rolling_power": _of_stages(
            flow.stages, lambda s: s.stage_power, "W", "rolling power of the stage, sun to ring"
        ),
        "circulating_power": array(flow.circulating_power, "W", "power round closed loops"),
    }


def _mean_forces(point: Point) -> MeasuredValues:
    forces: dict[str, Callable[[StageFlow], float]] = {
        "mean_sun_gear_mesh_force": lambda s: abs(s.sun_gear_mesh_force),
        "mean_ring_gear_mesh_force": lambda s: abs(s.ring_gear_mesh_force),
        "mean_planet_bearing_force": lambda s: s.planet_bearing_force,
    }
    return {
        name: _of_stages(point.flow.stages, of, "N", f"{name.replace('_', ' ')} of a planet")
        for name, of in forces.items()
    }


def _bearing_life(point: Point) -> MeasuredValues:
    """L₁₀ in time over that of the unchanged case; stages that carry nothing are left out."""
    reference_stages = {s.name: s for s in power_flow(point.reference).stages}
    lives = {
        s.name: (s, reference_stages[s.name]) for s in point.flow.stages if s.kind == "planetary"
    }
    loaded = {
        name: pair
        for name, pair in lives.items()
        if all(s.planet_bearing_force and s.planet_relative_speed for s in pair)
    }
    kinds = {"ball": BALL, "roller": ROLLER}
    values = [
        [
            life_ratio(
                s.planet_bearing_force, s.planet_relative_speed,
                r.planet_bearing_force, r.planet_relative_speed, exponent,
            )
            for s, r in loaded.values()
        ]
        for exponent in kinds.values()
    ]  # fmt: skip
    about = (
        "basic rating life of planet bearings under nominal loads over that of the unchanged case"
    )
    return {"life_ratio": array(values, "1", about, bearing=list(kinds), stage=list(loaded))}


OF_RATING = ("load_reserve", "damage_sum", "life")
LONGEST = 1e7  # h, beyond which lives are not told apart


def _life(point: Point) -> MeasuredValues:
    """Of the weakest flank, root and bearing of every stage under the case's load cases."""
    rating = rate(point.case, workers=1)
    if not rating.hours:
        raise FlexgearError("no load case has a duration: give hours, or a spectrum")
    labels = [f"{stage} {kind}" for stage, kind in rating.weakest]
    figures = MeasuredValues()
    for name in OF_RATING:
        quantity, of = PARTS[name]
        values = [of(part) for part in rating.weakest.values()]
        if name == "life":
            values = [min(value, LONGEST) for value in values]
        figures[name] = array(values, quantity.units, quantity.meaning, part=labels)
    return figures


def _of_stages(
    stages: tuple[StageFlow, ...], of: Callable[[StageFlow], float], units: str, about: str
) -> xr.DataArray:
    return array([of(s) for s in stages], units, about, stage=[s.name for s in stages])


def _load_sharing(point: Point) -> MeasuredValues:
    coefficients = xr.concat([d["load_sharing_coefficient"] for d in point.sharing], "group")
    return {"load_sharing": _coefficients(coefficients, "quasi-static load sharing")}


def _transient_sharing(point: Point) -> MeasuredValues:
    data, _ = point.transient
    if "load_sharing_coefficient" not in data:
        raise FlexgearError("no stage has planets that share a load")
    coefficients = data["load_sharing_coefficient"]
    return {"transient_sharing": _coefficients(coefficients, "load sharing after settling")}


def _coefficients(coefficients: xr.DataArray, about: str) -> xr.DataArray:
    """Coefficients by definition and group of gear meshes."""
    values = coefficients.transpose("definition", "group")
    names = {d: [str(n) for n in values[d].to_numpy()] for d in ("definition", "group")}
    return array(values.to_numpy(), "1", f"{about}, largest of the planets", **names)


def _gear_mesh_forces(point: Point) -> MeasuredValues:
    forces = {
        name: force
        for data in point.sharing
        for name, force in _by_group(data, "cycle_maximum").items()
    }
    about = "largest quasi-static gear-mesh force of a planet"
    return {"gear_mesh_force_max": largest(forces, "N", about, "group")}


def _transient_forces(point: Point) -> MeasuredValues:
    _, rest = point.transient
    forces = _by_group(rest.largest, "gear_mesh_force")
    about = "largest gear-mesh force of a planet after settling"
    return {"transient_force_max": largest(forces, "N", about, "group")}


def _by_group(data: xr.Dataset, name: str) -> dict[str, xr.DataArray]:
    """Values of gear meshes that share a load."""
    return {group: data[name].isel(gear_mesh=at) for group, at in groups_in(data).items()}


def _displacements(point: Point) -> MeasuredValues:
    far = axis_distance(point.equilibria)
    samples = [d for d in far.dims if d != "body"]
    return {"displacement": _distances(far.mean(samples), far.max(samples), "quasi-static")}


def _transient_displacements(point: Point) -> MeasuredValues:
    _, rest = point.transient
    mean, most = (d["axis_distance"] for d in (rest.mean, rest.largest))
    return {"transient_displacement": _distances(mean, most, "after settling")}


def _distances(mean: xr.DataArray, most: xr.DataArray, about: str) -> xr.DataArray:
    """Mean and largest distance (body,) of central members from their axis, rolling taken off."""
    far = [central_distance(distance, most) for distance in (mean, most)]
    return array(
        np.stack(far), "m", f"distance of the member from its axis, {about}",
        statistic=STATISTICS, body=[str(n) for n in far[0]["body"].to_numpy()],
    )  # fmt: skip


def _tooth_load(point: Point) -> MeasuredValues:
    """Of rings with tooth nodes; the flank that carries."""
    loads = {
        f"{stage} {gear}": tooth_loads(stage_part(point.equilibria, stage), gear).to_numpy()
        for stage in _rings(point)
        for gear in GEARS
    }
    return {"tooth_load": largest(loads, "N", "largest load of a tooth pair", "gear_mesh")}


def _tooth_displacement(point: Point) -> MeasuredValues:
    stages = _rings(point)
    largest_of = [
        np.abs(stage_part(point.equilibria, s)["tooth_displacement"].to_numpy()).max(axis=(0, 1))
        for s in stages
    ]
    about = "largest displacement of a ring tooth node, fixed axes"
    return {"tooth_displacement": array(largest_of, "m", about, stage=stages, axis=list("xyz"))}


def _rings(point: Point) -> list[str]:
    stages = list(point.case.fe_ring_stages)
    if not stages:
        raise FlexgearError("no stage has a ring with tooth nodes")
    return stages


def _recorded(point: Point) -> xr.Dataset:
    """The signals of sensors in the transient of a point."""
    attrs = point.transient[0].attrs
    return point.recorded.data.assign_attrs(attrs)


MEASURES = (
    Measure("frequencies", "lowest natural frequencies and their types", _frequencies),
    Measure(
        "frequencies_by_type",
        "lowest natural frequencies of every type of mode",
        _frequencies_by_type,
    ),
    Measure("load_sharing", "quasi-static load sharing by three definitions", _load_sharing),
    Measure("gear_mesh_forces", "largest quasi-static gear-mesh forces", _gear_mesh_forces),
    Measure("displacements", "quasi-static floats of suns, rings, carriers", _displacements),
    Measure("transient_sharing", "load sharing of a transient", _transient_sharing),
    Measure("transient_forces", "largest gear-mesh forces of a transient", _transient_forces),
    Measure(
        "transient_displacements",
        "floats of suns, rings, carriers in a transient",
        _transient_displacements,
    ),
    Measure(
        "sensors",
        "root mean square of what sensors measure in a transient",
        lambda point: sensor_levels(_recorded(point)),
    ),
    Measure(
        "sensor_signals",
        "what sensors measure in a transient, sample by sample",
        lambda point: sensor_signals(_recorded(point)),
    ),
    Measure("speeds", "speeds of members and planets, gear-mesh frequencies", _speeds),
    Measure("torques", "torques on all members", _torques),
    Measure("powers", "powers of members, rolling and circulating power", _powers),
    Measure("mean_forces", "mean forces of gear meshes and planet bearings", _mean_forces),
    Measure("tooth_load", "largest load of a tooth pair of rings that bend", _tooth_load),
    Measure(
        "tooth_displacement",
        "largest displacement of the tooth nodes of rings that bend",
        _tooth_displacement,
    ),
    Measure("bearing_life", "rating life of planet bearings over that of the case", _bearing_life),
    Measure("life", "load reserve, damage and life under the case's load cases", _life),
)


def measures_of(case: Case) -> dict[str, Measure]:
    """Measures that a case has, by name."""
    has = {
        "a ring that bends": bool(case.fe_ring_stages),
        "[[sensors]]": bool(case.sensors),
        "load cases": bool(case.load_cases or case.load_series),
    }
    return {m.name: m for m in MEASURES if has.get(NEEDS.get(m.name, ""), True)}


def chosen_measures(case: Case, names: Sequence[str]) -> tuple[str, ...]:
    """The named measures, or frequencies and load sharing; InputError for one that is not there."""
    by_name = measures_of(case)
    for name in names:
        if name not in by_name:
            problem = f"needs {NEEDS[name]}" if name in NEEDS else "is no measure"
            raise InputError("--measure", name, problem, nearest(name, list(by_name)))
    shared = any(stage.planets > 1 for stage in case.stages)
    usual = ("frequencies", "load_sharing" if shared else "speeds")
    return tuple(dict.fromkeys(names)) or usual


def measured(shared: tuple[Case, Sequence[str], int], case: Case) -> MeasuredValues:
    """Arrays of measures at one point, and ``WARNING`` where there is one.

    shared: of all points: the case without the sweep's changes, the names of the measures, and how
    many natural modes are listed.
    """
    reference, names, modes = shared
    point, figures = Point(case, reference, modes), MeasuredValues()
    for name in names:
        figures |= measures_of(case)[name].of(point)
    if lines := point.warnings:
        figures[WARNING] = array("; ".join(lines), "", "what to mind at the point")
    return figures
