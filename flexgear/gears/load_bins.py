"""Load bins: speeds, torques and loads of all members of a train in each load case, by statics."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.bearings.nominal import COMPONENTS
from flexgear.gears.determinacy import members_of, rank
from flexgear.gears.power_flow import NOISE, PowerFlow, power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.load_cases import FACTORS, SUM_OF_HOURS, LoadCase, MemberState, title_of
from flexgear.model.names import MemberName
from flexgear.model.rating import RatedGearMesh
from flexgear.model.train import Input, MemberLoad
from flexgear.model.units import RPM

HOUR = 3600.0  # s
TOLERANCE = 0.01  # relative, of redundant values: tables are rounded and include losses
MOST_TORQUE, LEAST_TORQUE = 50.0, 1 / 200  # over rated torque; N m for kN m is a factor of 1000
MOST_SPEED = 8.0  # over rated speed; r/min for rad/s is a factor of 9.5
Stated = Mapping[str, tuple[str, float]]  # key and value by member


@dataclass(frozen=True)
class LoadBin:
    """Steady state of a train with its duration.

    hours: 0 of an extreme load; torque: external torque on the member of each port, N m, positive
    about +z; speed: of every member, rad/s; loads: constant loads on members; extreme: whether it
    is a static load without duration; back_driven: whether power may flow against its rated
    direction; source: file and line for messages; factors: load factors of gear meshes in place of
    those of the case's ``rating``.
    """

    name: str
    hours: float
    torque: Mapping[str, float]
    speed: Mapping[str, float]
    loads: tuple[MemberLoad, ...]
    extreme: bool = False
    back_driven: bool = False
    source: str = ""
    factors: tuple[RatedGearMesh, ...] = ()

    def turns(self, speed: float) -> float:
        """Number of turns at ``speed``, rad/s, in the bin: 3600 h |ω| / 2π."""
        return HOUR * self.hours * abs(speed) / (2.0 * math.pi)


def case_in_bin(case: Case, load_bin: LoadBin) -> Case:
    """Case with the speeds, torques, loads and rules of rating of a bin in place of its own. It has
    no other load cases, so that results of a bin do not store them."""

    def restated(port: Any) -> Any:
        values: dict[str, float | None] = {"power": None} if isinstance(port, Input) else {}
        if port.speed is not None:
            values["speed"] = load_bin.speed[port.member]
        if port.given_torque is not None:
            values["torque"] = load_bin.torque[port.member]
        return port.model_copy(update=values)

    ports = {"inputs": tuple(map(restated, case.inputs))}
    if case.output is not None:
        ports["output"] = restated(case.output)
    loads = {"loads": load_bin.loads, "load_cases": (), "load_series": None}
    rules = {"rating": case.rating.in_load_case(load_bin.factors, load_bin.extreme)}
    return case.model_copy(update={**loads, **ports, **rules})


def bins_of_load_cases(case: Case, more: Sequence[LoadCase] = ()) -> tuple[LoadBin, ...]:
    """Load bins of the load cases of a case and of ``more``, in their order, without those of zero
    hours beside others. Raises InputError for speeds and torques that contradict the kinematics or
    statics of the train, for values that suggest a wrong sign or unit, and for turns whose hours
    miss the total."""
    load_cases = _with_names((*case.load_cases, *more))
    if not load_cases:
        return ()
    case.require_load()
    train = _Train(case, load_cases)
    bins = tuple(train.bin_of(k, load_case) for k, load_case in enumerate(load_cases))
    train.require_unit(bins)
    total, hours = case.spectrum.total_hours, sum(load_bin.hours for load_bin in bins)
    turns = any(load_case.cycles for load_case in load_cases)
    if total is not None and turns and abs(hours / total - 1.0) > SUM_OF_HOURS:
        problem = f"is {total:g}, but hours and turns of the load cases add up to {hours:g}"
        remedy = "correct hours, cycles or the total"
        raise InputError(case.source, "spectrum.total_hours", problem, remedy)
    return tuple(b for b in bins if b.hours or b.extreme) or bins


DIRECTIONS = ("forces along x", "forces along y", "forces along z", "moments about x",
              "moments about y")  # fmt: skip


def idle_loads(case: Case, loads: Iterable[tuple[str, Array]]) -> dict[str, str]:
    """Reasons, by "loads on stage.carrier", why components of loads (6,) on members have no effect:
    the member does not move in their direction. The last component is a torque."""
    idle = dict[str, str]()
    for member, components in loads:
        free, name = COMPONENTS.get(case.kinematics_of(member), ()), MemberName.parse(member)
        texts = [text for k, text in enumerate(DIRECTIONS) if components[k] and k not in free]
        if texts:
            key = case.view(name.stage).key(name.part)
            idle[f"loads on {member}"] = (
                f"{', '.join(texts)} have no effect, as it does not move there; set "
                f'{key}.kinematics = "spatial"'
            )
    return idle


def _factors(load_case: LoadCase) -> Iterator[RatedGearMesh]:
    """Load factors that a load case states: of all gear meshes, then of some."""
    for_all = {key: getattr(load_case, key) for key in FACTORS}
    if any(for_all.values()):
        yield RatedGearMesh(**for_all)
    for some in load_case.gear_meshes:
        yield RatedGearMesh(**dict(some))


def _with_names(load_cases: Sequence[LoadCase]) -> tuple[LoadCase, ...]:
    """Load cases with unique names: "load case 3" of a third one without a name; the number is
    added to a name that another one has."""
    taken, named = {load_case.name for load_case in load_cases}, list[LoadCase]()
    used = set[str]()
    for number, load_case in enumerate(load_cases, 1):
        name = load_case.name or f"load case {number}"
        if name in used or (not load_case.name and name in taken):
            name = f"{name} (number {number})"
        used.add(name)
        named.append(load_case.model_copy(update={"name": name}))
    return tuple(named)


def _completed(
    rows: Array, right: Array, places: Mapping[str, int], stated: Stated,
    rated: Mapping[str, float], ports: Mapping[str, float],
    refuse: Callable[[str, str, float, float], None],
) -> Array:  # fmt: skip
    """Solution x of equations A x = b, completed by stated values and then by values of ports.

    rows, right: A and b; places: index in x by member; stated: values of a load case; rated: of all
    members; ports: rated values of the ports, which are scaled by the ratio of the first stated
    value to its rated one; refuse: called with member, key, value and implied value where a stated
    value contradicts the equations before.
    """

    def add(place: int, value: float) -> float:
        """Adds x[place] = value unless the equations determine x[place]; returns x[place]."""
        nonlocal rows, right
        extended = np.vstack([rows, np.eye(rows.shape[1])[None, place]])
        if rank(extended) == rank(rows):
            return float(np.linalg.lstsq(rows, right, rcond=None)[0][place])
        rows, right = extended, np.append(right, value)
        return value

    ratio = next((v / rated[m] for m, (_, v) in stated.items() if rated[m]), 1.0)
    for member, (key, value) in stated.items():
        implied = add(places[member], value)
        if abs(value - implied) > TOLERANCE * max(abs(value), abs(implied)):
            refuse(member, key, value, implied)
    for member, value in ports.items():
        add(places[member], value * ratio)
    return np.asarray(np.linalg.solve(rows, right), dtype=np.float64)


class _Train:
    """Statics of a train under the speeds and torques of load cases."""

    def __init__(self, case: Case, load_cases: Sequence[LoadCase]) -> None:
        self.case, self.members, self.load_cases = case, members_of(case), load_cases
        self.flow: PowerFlow = power_flow(case)
        self.ties = self.members.tie_rows
        self.first = case.inputs[0].member
        self.rated_torque = {
            p.member: self.flow.torque[p.member] - self.members.loads.get(p.member, 0.0)
            for p in self.members.ports
        }

    def bin_of(self, k: int, load_case: LoadCase) -> LoadBin:
        """Load bin of load case number k."""
        states = list(load_case.states(self.first))
        if load_case.line:  # titles of a table have the name of the member
            states = [(f"{member}." if at else "", member, s) for at, member, s in states]
        speed = self._speeds(k, states)
        self._check_loads(k, states)
        loads = self._loads(states)
        moments = dict.fromkeys((load.member for load in loads), 0.0)
        for load in loads:
            moments[load.member] += float(load.first[5])
        torque = self._torques(k, load_case, states, speed, moments)
        turn = abs(speed[self.first])
        if load_case.cycles and turn == 0.0:
            self._refuse(k, "cycles", f"are turns of {self.first}, which is at rest", "give hours")
        hours = load_case.hours or 0.0
        if load_case.cycles:
            hours = load_case.cycles * 2.0 * math.pi / turn / HOUR
        source = load_case.source + (f" line {load_case.line}" if load_case.line else "")
        return LoadBin(
            load_case.name, hours, torque, speed, loads, load_case.extreme, load_case.back_driven,
            source or f"load_cases[{k}]", tuple(_factors(load_case)),
        )  # fmt: skip

    def _refuse(self, k: int, key: str, problem: str, remedy: str) -> None:
        load_case = self.load_cases[k]
        if load_case.source:
            place = f"line {load_case.line}" if load_case.line else load_case.name
            key = title_of(load_case, key) if load_case.line else key
            raise InputError(load_case.source, f"{place}, {key}", problem, remedy)
        raise InputError(self.case.source, f"load_cases[{k}].{key}", problem, remedy)

    def _check_loads(self, k: int, states: list[tuple[str, str, MemberState]]) -> None:
        """Raises InputError for forces and moments so large that their unit must be wrong."""
        stages = (s.gear_mesh_forces.values() for s in self.flow.stages)
        largest_force = max((abs(f) for s in stages for f in s), default=0.0)
        rated = {
            "force": ("N", "force of a gear mesh", largest_force),
            "moment": ("N m", "torque", max(map(abs, self.rated_torque.values()))),
        }
        for at, member, state in states:
            for key, (unit, name, reference) in rated.items():
                largest = max(map(abs, getattr(state, key) or (0.0,)))
                if reference and largest > MOST_TORQUE * reference:
                    problem = f"is {largest:.4g} {unit} on {member}, {largest / reference:.4g}"
                    problem = f"{problem} times the largest rated {name}, {reference:.6g}"
                    self._refuse(k, f"{at}{key}", problem, f"check the unit: {unit} for k{unit}?")

    def _loads(self, states: list[tuple[str, str, MemberState]]) -> tuple[MemberLoad, ...]:
        """Loads of the case, replaced on members for which the load case has loads."""
        stated = [s for s in states if s[2].force is not None or s[2].moment is not None]
        loads = [load for load in self.case.loads if load.member not in {s[1] for s in stated}]
        none = (0.0, 0.0, 0.0)
        loads += [
            MemberLoad(
                member=member, force=state.force or none, moment=state.moment or none,
                frame=state.frame,
            )
            for _, member, state in stated
        ]  # fmt: skip
        return tuple(loads)

    def _speeds(self, k: int, states: list[tuple[str, str, MemberState]]) -> dict[str, float]:
        """Speeds of all members from those of the load case, completed in rated proportion."""
        stated = {m: (f"{at}speed", s.speed) for at, m, s in states if s.speed is not None}
        for member, (key, value) in stated.items():
            rated = self.flow.speed[member]
            if rated and abs(value) > MOST_SPEED * abs(rated):
                problem = f"{value * RPM:.6g} r/min is {abs(value / rated):.3g} times the rated"
                self._refuse(k, key, f"{problem} {rated * RPM:.6g} r/min", "check the unit")

        def refuse(member: str, key: str, value: float, implied: float) -> None:
            problem = f"is {value * RPM:.6g} r/min, but the train makes {member} turn at"
            self._refuse(k, key, f"{problem} {implied * RPM:.6g}", "correct it, or leave it out")

        names, ties = self.members.names, self.ties
        places: dict[str, int] = {member: place for place, member in enumerate(names)}
        ports = {p.member: p.speed for p in self.members.ports if p.speed is not None}
        speeds = _completed(
            ties, np.zeros(len(ties)), places, stated, self.flow.speed, ports, refuse
        )
        speeds = np.where(abs(speeds) > NOISE * abs(speeds).max(), speeds, 0.0)
        return dict(zip(names, speeds.tolist(), strict=True))

    def _torques(
        self, k: int, load_case: LoadCase, states: list[tuple[str, str, MemberState]],
        speed: Mapping[str, float], moments: Mapping[str, float],
    ) -> dict[str, float]:  # fmt: skip
        """Torques of all ports from those of the load case, completed in rated proportion:

            Gᵀ λ + Pᵀ T = −M

        with the matrix G of the ties, P of the ports and the moments M of loads.
        """
        stated: dict[str, tuple[str, float]] = {}
        for at, member, state in states:
            if state.torque is not None:
                stated[member] = (f"{at}torque", state.torque)
            elif state.power is not None:
                if not speed[member]:
                    problem = f"is given, and {member} is at rest"
                    self._refuse(k, f"{at}power", problem, "give its torque")
                stated[member] = (f"{at}power", state.power / speed[member])
        for member, (key, value) in stated.items():
            self._check_torque(k, load_case, member, key, value, speed[member])

        def refuse(member: str, key: str, value: float, implied: float) -> None:
            problem = f"makes {value:.6g} N m on {member}, but the other torques make it"
            remedy = "leave it out, or correct it: the train has no losses"
            self._refuse(k, key, f"{problem} {implied:.6g}", remedy)

        every, ties = list(self.members.ports), len(self.ties)
        rows = np.vstack([self.ties, self.members.port_rows(every)]).T
        right = np.array([-moments.get(member, 0.0) for member in self.members.names])
        places = {port.member: ties + place for place, port in enumerate(every)}
        ports = {p.member: p.given_torque for p in every if p.given_torque is not None}
        solved = _completed(rows, right, places, stated, self.rated_torque, ports, refuse)
        return dict(zip(places, (solved[ties:] + 0.0).tolist(), strict=True))

    def _check_torque(
        self, k: int, load_case: LoadCase, member: str, key: str, value: float, speed: float
    ) -> None:
        """Raises InputError for a torque so large that its unit must be wrong, or whose power flows
        against the rated direction."""
        rated, rated_speed = self.rated_torque[member], self.flow.speed[member]
        if not rated:
            return
        if abs(value) > MOST_TORQUE * abs(rated):
            problem = f"makes {value:.6g} N m on {member}, {abs(value / rated):.4g} times the rated"
            self._refuse(k, key, f"{problem} {rated:.6g}", "check the unit: N m for kN m?")
        sense = value * speed / (rated * rated_speed) if speed and rated_speed else value / rated
        if sense < 0.0 and not load_case.back_driven:
            problem = f"makes {value:.6g} N m on {member}, against the rated sense of its power"
            if value * rated > 0.0:
                problem = f"has its rated sense, but {member} turns the other way, by its speed"
            remedy = f"turn a sign (rated: {rated:.6g} N m, {rated_speed * RPM:.6g} r/min), or set"
            remedy = f"{remedy} back_driven = true"
            self._refuse(k, key, problem, remedy)

    def require_unit(self, bins: tuple[LoadBin, ...]) -> None:
        """Raises InputError where torques of all bins are far below rated: kN m for N m."""
        rated = self.rated_torque[self.first]
        largest = max(abs(b.torque[self.first]) for b in bins)
        if rated and 0.0 < largest < LEAST_TORQUE * abs(rated):
            problem = f"have at most {largest:.6g} N m on {self.first}, {largest / abs(rated):.2g}"
            problem = f"{problem} of the rated {rated:.6g}"
            remedy = "check the unit: kN m for N m?"
            raise InputError(self.case.source, "load_cases", problem, remedy)
