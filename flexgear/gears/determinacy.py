"""Determinacy of a train: ties between members, mobility, missing or surplus speeds and torques.

Every tie is one row Σ c_m ω_m = 0 over the speeds of members:

    planetary   r_s ω_s + r_r ω_r − (r_s + r_r) ω_c = 0   (Willis, base radii), divided by r_s
    parallel    r_p ω_p + r_g ω_g = 0, divided by r_p
    joint       ω_first − ω_second = 0
    held        ω = 0

A case of n members with c independent ties has mobility M = n − c. It needs M speeds; of its p
ports p − M need a torque, as the matrix of the torques is the transpose of that of the speeds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg

from flexgear.arrays import Array
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import is_overridden, stage_radii
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import MemberName
from flexgear.model.stage_view import StageView
from flexgear.model.train import Input, Output
from flexgear.model.units import RPM


@dataclass(frozen=True)
class Tie:
    """Tie Σ c_m ω_m = 0 of the speeds of members, with c_m by name of the member. kind: "stage",
    "joint" or "held"; name: of the stage, the joint or the member in the case."""

    kind: str
    name: str
    coefficients: dict[str, float]

    @property
    def label(self) -> str:
        """Name of the tie in messages: "joint a – b", "held a", "stage s"."""
        return f"{self.kind} {self.name}"


@dataclass(frozen=True)
class Members:
    """Names of all members in the order of the stages, ties between them, and ports. loads: further
    moments about z by member, N m; of a torque history its value at t = 0."""

    source: str
    names: tuple[MemberName, ...]
    ties: tuple[Tie, ...]
    ports: tuple[Input | Output, ...]
    loads: dict[str, float]

    @cached_property
    def tie_rows(self) -> Array:
        """Matrix of the ties, (ties, members)."""
        return self._rows([tie.coefficients for tie in self.ties])

    def port_rows(self, ports: Sequence[Input | Output]) -> Array:
        """Matrix (ports, members) that selects the members of ports."""
        return self._rows([{port.member: 1.0} for port in ports])

    def _rows(self, coefficients: Sequence[Mapping[str, float]]) -> Array:
        rows = np.zeros((len(coefficients), len(self.names)))
        for row, by_member in zip(rows, coefficients, strict=True):
            for member, coefficient in by_member.items():
                row[self.names.index(member)] += coefficient
        return rows


def members_of(case: Case) -> Members:
    """Members, ties and ports of a case. Raises InputError for gears that do not mesh."""
    ties = [_stage_tie(case.view(stage.name)) for stage in case.stages]
    for joint in case.joints:
        name = f"{joint.first} – {joint.second}"
        ties.append(Tie("joint", name, {joint.first: 1.0, joint.second: -1.0}))
    ties += [Tie("held", member, {member: 1.0}) for member in case.held_members()]
    loads = dict.fromkeys((load.member for load in case.loads), 0.0)
    for load in case.loads:
        loads[load.member] += float(load.first[5])
    return Members(case.source, case.member_names(), tuple(ties), case.ports, loads)


def _stage_tie(view: StageView) -> Tie:
    stage = view.stage
    # stage_geometry refuses teeth that do not mesh, which radii from a publication need not satisfy
    base = (stage_radii if is_overridden(stage) else stage_geometry)(view).base
    if stage.kind == "planetary":
        ratio = base["ring"] / base["sun"]
        row = {"sun": 1.0, "ring": ratio, "carrier": -1.0 - ratio}
    else:
        row = {"pinion": 1.0, "gear": base["planet"] / base["sun"]}
    return Tie("stage", stage.name, {f"{stage.name}.{part}": c for part, c in row.items()})


RANK_TOLERANCE = 1e-9  # singular value over the largest


def rank(matrix: Array) -> int:
    """Number of independent rows."""
    if 0 in matrix.shape:
        return 0
    values = np.linalg.svd(matrix, compute_uv=False)
    return int((values > RANK_TOLERANCE * values[0]).sum())


def require_free_ties(members: Members) -> int:
    """Mobility of the members. Raises InputError where ties are redundant or nothing can turn."""
    rows = members.tie_rows
    if rank(rows) < len(rows):
        involved = [members.ties[k] for k in _first_loop(rows)]
        kinds = " or ".join(sorted({t.kind for t in involved} - {"stage"}, reverse=True))
        key = "joints" if any(t.kind == "joint" for t in involved) else "held"
        problem = (
            f"{', '.join(t.label for t in involved)} are redundant, so torques between them are "
            "undetermined"
        )
        raise InputError(members.source, key, problem, f"remove one {kinds}")
    mobility = len(members.names) - len(rows)
    if mobility == 0:
        held = ", ".join(t.name for t in members.ties if t.kind == "held") or "nothing"
        problem = f"mobility 0: nothing can turn (held: {held})"
        raise InputError(members.source, "held", problem, "release a member or a joint")
    return mobility


def _first_loop(rows: Array) -> list[int]:
    """Indices of the rows in the first linear dependence: its last row follows from the others."""
    for end in range(1, len(rows) + 1):
        repeated = linalg.null_space(rows[:end].T, rcond=RANK_TOLERANCE)
        if repeated.shape[1]:
            return [k for k, c in enumerate(repeated[:, 0]) if abs(c) > 1e-6]
    return []


def require_speeds(members: Members, mobility: int) -> None:
    """Raises InputError unless exactly ``mobility`` independent speeds are given."""
    driven = [p for p in members.ports if p.speed is not None]
    head = f"mobility {mobility}, and {_listed(driven, 'speed')}"
    conditions = np.vstack([members.tie_rows, members.port_rows(driven)])
    independent = rank(conditions)
    if len(driven) > mobility:
        problem = f"overdetermined: {head}{_clash(members, driven)}"
        remedy = f"remove {_count(len(driven) - mobility, 'speed')} (give power or torque instead)"
        raise InputError(members.source, _key(members, driven[-1]), problem, remedy)
    if independent == len(members.names):
        return
    free = linalg.null_space(conditions, rcond=RANK_TOLERANCE)
    spread = np.linalg.norm(free, axis=1)
    open_members = [m for m, s in zip(members.names, spread, strict=True) if s > 1e-6]
    ports = [p.member for p in members.ports if p.speed is None and p.member in open_members]
    missing = len(members.names) - independent
    if len(driven) == mobility:
        problem = f"{head}, but they depend on each other"
    else:
        problem = f"underdetermined: {head}"
    give = f"give {_count(missing, 'speed')} at {' or '.join(ports)}, or " if ports else ""
    instead = "give them at other members, or " if len(driven) == mobility and not ports else ""
    remedy = f"{give}{instead}hold, join or drive {' or '.join(open_members)}"
    raise InputError(members.source, "inputs", problem, remedy)


def require_torques(members: Members, mobility: int) -> None:
    """Raises InputError unless exactly ports − mobility independent torques or powers are given."""
    torques = [p for p in members.ports if p.given_torque is not None]
    without_torque = [p for p in members.ports if p.given_torque is None]
    needed = len(members.ports) - mobility
    head = (
        f"{len(members.ports)} ports and mobility {mobility} need {_count(needed, 'torque')}, "
        f"and {_listed(torques, 'torque')}"
    )
    if len(torques) > needed:
        remedy = f"remove {_count(len(torques) - needed, 'torque or power value')}"
        key = _key(members, torques[-1])
        raise InputError(members.source, key, f"overdetermined: {head}", remedy)
    if len(torques) < needed:
        raise InputError(
            members.source, "inputs", f"underdetermined: {head}",
            f"give {_count(needed - len(torques), 'torque or power value')} at "
            f"{' or '.join(p.member for p in without_torque)}",
        )  # fmt: skip
    if rank(np.vstack([members.tie_rows, members.port_rows(without_torque)])) < len(members.names):
        raise InputError(
            members.source, "inputs",
            f"{head}, but they act on the same part of the train and leave "
            f"{' and '.join(p.member for p in without_torque)} open",
            "give the torque of one of these instead",
        )  # fmt: skip


def _key(members: Members, port: Input | Output) -> str:
    """Key of a port in the case."""
    return "output" if isinstance(port, Output) else f"inputs[{members.ports.index(port)}]"


def _count(number: int, noun: str) -> str:
    return f"{number or 'no'} {noun}" + ("s" if number != 1 else "")


def _listed(ports: list[Input | Output], noun: str) -> str:
    """ "1 speed is given (a)"."""
    verb = "is" if len(ports) == 1 else "are"
    names = f" ({', '.join(p.member for p in ports)})" if ports else ""
    return f"{_count(len(ports), noun)} {verb} given{names}"


def _clash(members: Members, driven: list[Input | Output]) -> str:
    """Clause of a message with the first given speed that follows from those before it, and the
    speed that they imply; "" if all are independent."""
    ties = members.tie_rows
    for k, port in enumerate(driven):
        conditions = np.vstack([ties, members.port_rows(driven[:k])])
        if rank(np.vstack([conditions, members.port_rows([port])])) > rank(conditions):
            continue
        values = [p.speed or 0.0 for p in driven[:k]]
        speeds = np.linalg.lstsq(conditions, np.array([0.0] * len(ties) + values), rcond=None)[0]
        implied = speeds[members.names.index(port.member)]
        return (
            f"; the others make {port.member} turn at {implied * RPM:.6g} r/min, "
            f"given are {(port.speed or 0.0) * RPM:.6g}"
        )
    return ""
