"""Members of a case and what ties their speeds: stages, joints, held members; and its ports.

Every tie is one row Σ c_m ω_m = 0 over member speeds:

    planetary   r_s ω_s + r_r ω_r − (r_s + r_r) ω_c = 0   (Willis, base radii), divided by r_s
    parallel    r_p ω_p + r_g ω_g = 0, divided by r_p
    joint       ω_first − ω_second = 0
    held        ω = 0
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import is_overridden, stage_radii
from flexgear.model.names import MemberName

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.stage_view import StageView


@dataclass(frozen=True)
class Tie:
    """One row Σ c_m ω_m = 0. kind: "stage", "joint" or "held"; name: as the user wrote it."""

    kind: str
    name: str
    coefficients: dict[str, float]

    @property
    def label(self) -> str:
        """How messages call it: "joint a – b", "held a", "stage s"."""
        return f"{self.kind} {self.name}"


@dataclass(frozen=True)
class Port:
    """A member that outside drives or loads: rad/s and N m (on the member); None if not given.

    key: "inputs[0]" … or "output".
    """

    member: str
    key: str
    speed: float | None
    torque: float | None


@dataclass(frozen=True)
class Members:
    """Names of all members in the order of the stages, ties of their speeds, ports.

    loads: moments about z that are given on top (N m) by member, those of histories at t = 0.
    """

    source: str
    names: tuple[MemberName, ...]
    ties: tuple[Tie, ...]
    ports: tuple[Port, ...]
    loads: dict[str, float]


def members_of(case: Case) -> Members:
    """Members, ties and ports of a case. Raises InputError for gears that cannot mesh."""
    ties = [_stage_tie(case.view(stage.name)) for stage in case.stages]
    for joint in case.joints:
        name = f"{joint.first} – {joint.second}"
        ties.append(Tie("joint", name, {joint.first: 1.0, joint.second: -1.0}))
    ties += [Tie("held", member, {member: 1.0}) for member in case.held_members()]
    ports = [
        Port(port.member, f"inputs[{k}]", port.speed, port.given_torque)
        for k, port in enumerate(case.inputs)
    ]
    if case.output is not None:
        ports.append(Port(case.output.member, "output", case.output.speed, case.output.torque))
    loads = dict.fromkeys((load.member for load in case.loads), 0.0)
    for load in case.loads:
        loads[load.member] += float(load.first[5])
    return Members(case.source, case.member_names(), tuple(ties), tuple(ports), loads)


def _stage_tie(view: StageView) -> Tie:
    stage = view.stage
    # true teeth mesh, and planets do not collide; of printed radii nothing is known but themselves
    radii = stage_radii(view) if is_overridden(stage) else stage_geometry(view).radii
    if stage.kind == "planetary":
        ratio = radii.ring / radii.sun
        row = {"sun": 1.0, "ring": ratio, "carrier": -1.0 - ratio}
    else:
        row = {"pinion": 1.0, "gear": radii.planet / radii.sun}
    return Tie("stage", stage.name, {f"{stage.name}.{part}": c for part, c in row.items()})
