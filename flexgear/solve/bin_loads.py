"""Equilibria of a train in the bins of a load spectrum, from one assembly, and its load factors.

Only torques and loads on members differ between bins: bodies, coupling and modes are those of the
case. Every gear mesh is solved over whole gear-mesh cycles, spread over the period after which
planets, errors and fixed directions in space repeat. The factors of N gear meshes that share a
load, in a double-helical stage those of both halves, follow from the mean force F̄_ic and the mean
line load W̄_ic(z) of gear mesh i over gear-mesh cycle c:

    K_γ = N F̄_ic/Σ_j F̄_jc,   K_Hβ = max_z W̄_ic(z) / mean_z W̄_ic(z).

K_Hα is the largest load of a tooth pair over that of an accurate gear mesh under the same force
(ISO 6336-1). All three are those of one planet in one cycle, with the largest product K_γ K_Hβ, the
largest mean line load. (The product of the largest factors of different planets or times would be
too large, and those of the planet with the largest K_γ may miss the sector of a ring that a hub
moment loads.)

The dynamic factor from the train's motion at one speed and torque is

    K_v = max_{t,i} F_i(t) / max_{p,i} F_i,p

with the gear-mesh forces F_i of planet i over the end of a transient t and over quasi-static
positions p. It includes the vibration of the whole train with its bodies and bearings
and the errors of the case, but no excitation that the model lacks (by mean stiffness, or tooth
deviations that the case does not state), whereas method B of ISO 6336-1 takes deviations from an
accuracy grade.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium, revolution
from flexgear.arrays import Array
from flexgear.gears.error_cycle import AngleSamples
from flexgear.gears.load_bins import LoadBin, case_in_bin
from flexgear.gears.power_flow import power_flow
from flexgear.gears.slices import factor_along
from flexgear.model.case import Case
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.machine import Machine, machines_of
from flexgear.model.names import GroupName, MemberName
from flexgear.model.train import MemberLoad, varying
from flexgear.results.face_load import sharing_factor
from flexgear.results.labelled_dataset import groups_of
from flexgear.results.load_sharing import carry_together, without_rounding
from flexgear.solve.angles import samples_of_stage, stage_motions
from flexgear.solve.dataset import equilibrium_data
from flexgear.solve.model import Model, assemble, rated_forces, rated_rotations
from flexgear.solve.start_vibration import decay_duration
from flexgear.solve.stresses import (
    OF_FLANKS,
    OF_ROOTS,
    GroupStresses,
    HeldRoots,
    group_stresses,
    held_roots,
)
from flexgear.solve.transient import RATED_DRIVE, simulate

REVERSE = 1e-9  # gear-mesh force over the rated one of the other sense, above which it is reversed
EQUAL_LOAD = 1e-3  # relative difference of load factors below which loads are equal
POSITIONS, SPUR_POSITIONS = 8, 32  # in a gear-mesh cycle; of spur gears with load along the face
PAIRS = ("pair_load", "pair_stiffness")
NEEDED = (  # variables of the equilibria's dataset
    *PAIRS, "gear_mesh_force", "face_line_load", "face_section",
    "carrier_angle", "ring_angle", "bearing_force", *OF_FLANKS, *OF_ROOTS,
)  # fmt: skip


@dataclass(frozen=True)
class GroupLoads:
    """Loads of a group of gear meshes that share a load, in one bin.

    k_gamma, k_h_beta, k_h_alpha: of ``planet`` (from 1) in ``cycle`` (index of the cycles solved),
    NaN where the model does not give them. largest_share: largest K_γ of any planet and cycle.
    drive: whether the flanks of rated torque carry. largest_force: of one gear mesh, N. k_v: by the
    train's motion, NaN if not computed. stresses: over the teeth, for gear meshes with load along
    the face. deviated: number of the train, if several with random deviations are rated. alike:
    whether the largest K_γ K_Hβ of every planet differ by less than ``EQUAL_LOAD``. halving: larger
    relative change of the largest K_γ K_Hβ with every second position, and with every second cycle.
    """

    k_gamma: float
    k_h_beta: float
    k_h_alpha: float
    planet: int
    cycle: int
    largest_share: float
    drive: bool
    largest_force: float
    k_v: float = math.nan
    stresses: GroupStresses | None = None
    deviated: int = 0
    alike: bool = False
    halving: float = 0.0

    @property
    def largest_line_load(self) -> float:
        """K_γ K_Hβ, or K_γ without K_Hβ: measure for comparing planets, times and trains."""
        return self.k_gamma * (1.0 if math.isnan(self.k_h_beta) else self.k_h_beta)


@dataclass(frozen=True)
class BinLoads:
    """Loads in a bin.

    groups: loads of loaded groups of gear meshes by name; supports: forces, N, and moments, N·m,
    (p, 6) of bearings and other supports by name, over the positions of their stage, in the axes of
    their links; carrier_angle: (p,) by stage, rad; closure: largest of the equilibria."""

    groups: Mapping[GroupName, GroupLoads]
    supports: Mapping[str, Array]
    carrier_angle: Mapping[str, Array]
    closure: float


@dataclass(frozen=True)
class SpectrumTrain:
    """A train and its load bins. It is assembled when a bin is first solved, in each process
    separately."""

    case: Case
    bins: tuple[LoadBin, ...]

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("case", "bins")}

    @cached_property
    def largest_loads(self) -> dict[tuple[str, str], Array]:
        """Largest components (6,) of the loads on members in any bin, by member and frame, in the
        order of the model's load histories."""
        largest: dict[tuple[str, str], Array] = {}
        for load in (load for load_bin in self.bins for load in load_bin.loads):
            place = (str(load.member), str(load.frame))
            largest[place] = np.maximum(largest.get(place, np.zeros(6)), np.abs(load.first))
        return largest

    @cached_property
    def solved_case(self) -> Case:
        """The case, with one-sided contact in stages of linear contact that a bin loads in the
        other sense than rated torque. Linear contact would pull gears together there at the flanks
        of rated torque, whereas the other flanks separate them: bearings of shafts feel that."""
        rated, reverse = power_flow(self.case).stages, dict[str, str]()
        for load_bin in self.bins:
            loaded = power_flow(case_in_bin(self.case, load_bin)).stages
            for before, now in zip(rated, loaded, strict=True):
                first, second = before.sun_gear_mesh_force, now.sun_gear_mesh_force
                opposite = (first >= 0.0) != (second >= 0.0)
                if opposite and abs(second) > REVERSE * abs(first):
                    reverse[f"stages.{before.name}.gear_mesh.contact_law"] = "one-sided"
        return self.case.with_(**reverse)

    @cached_property
    def model(self) -> Model:
        """The model with a load history for each load component on members, which bins set."""
        loads = tuple(_rising(*place, size) for place, size in self.largest_loads.items())
        return assemble(self.solved_case.with_(loads=loads))

    def release(self) -> None:
        """Free the memory of the model, which is assembled again on its next use."""
        vars(self).pop("model", None)

    @cached_property
    def samples(self) -> dict[str, AngleSamples]:
        """Positions of every stage that turns, by name."""
        case, cycles = self.model.case, self.case.rating.gear_mesh_cycles
        motions = stage_motions(case, self.model.flow)
        return {
            m.name: samples_of_stage(case, motions, k, cycles, False, _positions(case, m.name))
            for k, m in enumerate(motions)
            if m.theta
        }


def _positions(case: Case, name: str) -> int:
    """Number of positions in a gear-mesh cycle of a stage, as the case says or by default.

    The stress of a spur tooth is largest at the ends of single contact, which equally spaced
    positions miss by up to their spacing: in trials with 8 of them the largest stress was up to
    5 % too low, with 32 about 1 %.
    """
    stage = case.stage(name)
    spur = stage.gear_mesh.model == "face_load" and not stage.helix_angle
    return case.rating.positions_per_gear_mesh or (SPUR_POSITIONS if spur else POSITIONS)


def _rising(member: str, frame: str, size: Array) -> MemberLoad:
    """A load that rises from zero to ``size`` (6,), N and N·m: it gives the model a load history
    for each component, which the bins set."""
    none, parts = (0.0, 0.0, 0.0), tuple(map(float, size))
    return MemberLoad.model_validate(
        {
            "member": member,
            "frame": frame,
            "times": (0.0, 1.0),
            "forces": (none, parts[:3]),
            "moments": (none, parts[3:]),
        }
    )


def model_in_bin(train: SpectrumTrain, load_bin: LoadBin) -> Model:
    """The model under the loads of a bin, without new assembly."""
    case, model = case_in_bin(train.solved_case, load_bin), train.model
    flow = power_flow(case)
    pairs, sizes = model.system.pairs, model.system.pairs.load_size.copy()
    places = list(train.largest_loads)
    components = np.zeros((len(places), 6))
    for load in load_bin.loads:
        components[places.index((str(load.member), str(load.frame)))] += load.first
    share = np.array([components[k, c] / size for k, c, size in varying(model.case.loads)])
    varies = pairs.load_history >= 0
    sizes[varies] = share[pairs.load_history[varies]]
    fastest, rated = max(model.flow.speed.items(), key=lambda item: abs(item[1]))
    sizes[pairs.load_grows == 1] = (flow.speed[fastest] / rated) ** 2 if rated else 0.0
    system = model.system.with_(pairs=pairs._replace(load_size=sizes))
    return replace(
        model,
        case=case,
        flow=flow,
        system=system,
        rated=rated_forces(flow, model.gear_meshes.names),
        shared_modal=replace(model.modal, system=system),
        with_errors=model,
    )


def loads_in_bin(train: SpectrumTrain, load_bin: LoadBin) -> BinLoads:
    """Loads and factors of a bin from equilibria over all positions."""
    model = model_in_bin(train, load_bin)
    lead = np.concatenate([s.angles for s in train.samples.values()] or [np.zeros(1)])
    result = _equilibria(model, load_bin, lead)
    data = equilibrium_data(model, result, NEEDED)
    groups, supports, carrier = dict[GroupName, GroupLoads](), dict[str, Array](), {}
    first = 0
    for stage, samples in train.samples.items():
        of_stage = data.isel(position=slice(first, first + len(samples.angles)))
        first += len(samples.angles)
        rated = float(max(model.rated.max(), train.model.rated.max()))  # a bin may have none
        groups |= _groups(model, of_stage, stage, samples.per_gear_mesh, rated)
        carrier[stage] = of_stage["carrier_angle"].sel(turning_stage=stage).to_numpy()
        for name in map(str, of_stage["support"].to_numpy() if "support" in data else ()):
            if MemberName.parse(name).stage == stage:
                supports[name] = of_stage["bearing_force"].sel(support=name).to_numpy()
    if train.case.rating.dynamic_factor == "train":
        factors = dynamic_factors(model.case, {n: g.largest_force for n, g in groups.items()})
        groups = {n: replace(g, k_v=factors.get(n, math.nan)) for n, g in groups.items()}
    return BinLoads(groups, supports, carrier, float(result.closure.max()))


def _equilibria(model: Model, load_bin: LoadBin, lead: Array) -> Equilibrium:
    """Equilibria in a bin at rotations (p,) of the reference member, rad."""
    torques = np.array([[load_bin.torque[p.name] for p in model.system.ports]])
    return revolution(model.modal, rated_rotations(model.system, lead), torques)


def roots_in_bin(
    train: SpectrumTrain, load_bin: LoadBin, group: GroupName, at: tuple[int, int], member: int
) -> HeldRoots:
    """Root stress of a gear's teeth on a fixed body, at the planet and cycle ``at`` (from 0) of a
    group; member: 0 the planet, 1 the gear that it meshes with."""
    model, samples = model_in_bin(train, load_bin), train.samples[group.stage]
    first = at[1] * samples.per_gear_mesh
    lead = samples.angles[first : first + samples.per_gear_mesh]
    result = _equilibria(model, load_bin, lead)
    names = [name.group for name in model.gear_meshes.names]
    gear_mesh = [k for k, name in enumerate(names) if name == group][at[0]]
    forces = np.nansum(np.abs(result.pair_load), axis=(0, 2))
    flanks = np.flatnonzero(model.gear_meshes.sign[:, gear_mesh])
    return held_roots(model.root_tables, result, int(flanks[np.argmax(forces[flanks])]), member)


def _groups(
    model: Model, data: xr.Dataset, stage: str, per_cycle: int, rated: float
) -> dict[GroupName, GroupLoads]:
    """Loads of the groups of a stage from positions in whole gear-mesh cycles of ``per_cycle``
    positions; rated: largest force of a gear mesh at rated load, N."""
    names, loads, view = model.gear_meshes.names, {}, model.case.view(stage)
    force = without_rounding(data["gear_mesh_force"].to_numpy(), rated)
    gear_mesh = model.case.stage(stage).gear_mesh
    by_group = groups_of(names, 1)
    for group, at in by_group.items():
        key = (group.stage, group.kind)
        means = force[:, at].reshape(-1, per_cycle, len(at)).mean(axis=1)
        if group.stage != stage or not carry_together(means).all():
            continue
        drive = bool(means.sum() > 0)
        together = [k for g, ks in by_group.items() if (g.stage, g.kind) == key for k in ks]
        shares = _shares(force, at, together, per_cycle)
        flanks, along, stresses = None, np.ones_like(shares), None
        if gear_mesh.model in ("per_pair", "face_load"):
            # with linear contact the drive flanks also carry reversed loads
            sense = "drive" if drive or gear_mesh.contact_law == "linear" else "coast"
            flanks = data.sel(flank=[f"{names[k]} {sense}" for k in at])
        if flanks is not None and gear_mesh.model == "face_load":
            along = _face_factors(flanks, per_cycle)
            stresses = group_stresses(flanks, view, group, per_cycle)
        cycle, planet = np.unravel_index(int(np.argmax(shares * along)), shares.shape)
        largest, fewer = (shares * along).max(axis=0), [(shares * along)[::2]]
        if per_cycle % 2 == 0:
            fewer.append(_shares(force[::2], at, together, per_cycle // 2))
            if flanks is not None and gear_mesh.model == "face_load":
                every_second = flanks.isel(position=slice(None, None, 2))
                fewer[1] *= _face_factors(every_second, per_cycle // 2)
        k_h_alpha = math.nan
        if flanks is not None:
            window = slice(cycle * per_cycle, (cycle + 1) * per_cycle)
            of_flank = flanks[[*PAIRS]].isel(position=window, flank=planet)
            k_h_alpha = sharing_factor(abs(of_flank))
        loads[group] = GroupLoads(
            k_gamma=float(shares[cycle, planet]),
            k_h_beta=float(along[cycle, planet]) if gear_mesh.model == "face_load" else math.nan,
            k_h_alpha=k_h_alpha,
            planet=int(planet) + 1,
            cycle=int(cycle),
            largest_share=float(shares.max()),
            drive=drive,
            largest_force=float(abs(force[:, at]).max()),
            stresses=stresses,
            alike=bool(largest.min() > (1.0 - EQUAL_LOAD) * largest.max()),
            halving=max(abs(float(x.max() / largest.max()) - 1.0) for x in fewer),
        )
    return loads


def _shares(force: Array, at: NDArray[np.int64], together: list[int], per_cycle: int) -> Array:
    """K_γ (cycles, N) of the gear meshes ``at`` that share a load with all ``together``; force: of
    all gear meshes at ``per_cycle`` positions in each cycle, N."""
    means = force[:, at].reshape(-1, per_cycle, len(at)).mean(axis=1)
    of_all = force[:, together].reshape(-1, per_cycle, len(together)).mean(axis=(1, 2))
    return np.asarray(means / of_all[:, None])


def _face_factors(flanks: xr.Dataset, per_cycle: int) -> Array:
    """K_Hβ (cycles, flanks) of flanks over each of their gear-mesh cycles; 1 without load."""
    load = flanks["face_line_load"].to_numpy()
    load = load.reshape(-1, per_cycle, *load.shape[1:]).mean(axis=1)
    section = flanks["face_section"].to_numpy()
    return np.array(
        [
            [factor_along(w, s) if w.any() else 1.0 for w, s in zip(c, section, strict=True)]
            for c in load
        ]
    )


def _steadily_driven(case: Case) -> Case:
    """The case with machines that keep its rated state, that of a bin: brakes have the torque of
    statics. A member that gives power has constant torque in place of a brake, and then the first
    one that takes power brakes. Loads on members keep their value at t = 0, as in statics."""
    power, machines = power_flow(case).power, machines_of(case)
    by_member = dict(zip((port.member for port in case.ports), machines, strict=True))
    brakes = {m: x for m, x in by_member.items() if x is not None and x.law == "brake"}
    by_member |= {m: x.model_copy(update={"brake_torque": None}) for m, x in brakes.items()}
    if driving := [member for member in brakes if power[member] > 0.0]:
        by_member |= dict.fromkeys(driving, Machine())
        by_member[min(by_member, key=lambda m: power[m] >= 0.0)] = Machine(law="brake")
    ports = [p.model_copy(update={"machine": by_member[p.member]}) for p in case.ports]
    none: dict[str, Any] = {"times": (), "forces": (), "moments": (), "file": None}
    loads = [
        load.model_copy(update={**none, "force": tuple(first[:3]), "moment": tuple(first[3:])})
        for load, first in ((load, load.first.tolist()) for load in case.loads)
    ]
    steady = {"inputs": tuple(ports[:-1]), "output": ports[-1], "loads": tuple(loads)}
    return case.model_copy(update=steady)


PERIODS = 40.0  # of the slowest gear mesh, over which K_v is evaluated
MAX_PERIODS = 800.0  # before them, with weak damping


def is_excited(case: Case) -> bool:
    """Whether teeth excite the train: by stiffness that varies, errors or faults."""
    stages = case.stages
    steady = all(s.gear_mesh.model == "constant" and s.errors == GearErrors() for s in stages)
    return not steady or bool(case.faults)


def dynamic_factors(case: Case, quasi_static: Mapping[GroupName, float]) -> dict[GroupName, float]:
    """K_v by group of gear meshes, of those in ``quasi_static`` with their largest quasi-static
    forces, N; empty for a train at rest or if keys state all; 1 where neither teeth excite it nor
    FE gears, which are stiffer at their bolts. Evaluated over the last ``PERIODS`` of a transient,
    after the settling time of the case, or as many periods and the decay of vibration."""
    if None not in [case.rating.forced(name.stage, name.role).k_v for name in quasi_static]:
        return {}
    of_gears = [stage.form(part) for stage in case.stages for part in ("ring", "planet")]
    if not is_excited(case) and "fe" not in of_gears:
        return dict.fromkeys(quasi_static, 1.0)
    model = assemble(_steadily_driven(case))
    frequencies = [s.gear_mesh_frequency for s in model.flow.stages if s.gear_mesh_frequency]
    if not frequencies or not quasi_static:
        return {}
    evaluated = PERIODS / min(frequencies)
    before = case.solver.settle
    if before is None:
        before = decay_duration(model, evaluated)
        before = min(before, MAX_PERIODS / min(frequencies))
    data = simulate(model, duration=before + evaluated, drive=RATED_DRIVE).data
    force = abs(data["gear_mesh_force"].sel(time=slice(before, None)).to_numpy())
    return {
        group: float(force[:, at].max()) / quasi_static[group]
        for group, at in groups_of(model.gear_meshes.names, 1).items()
        if group in quasi_static
    }
