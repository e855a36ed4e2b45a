"""Checks of a case as a whole: names, ports, supports and hubs against one another."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexgear.model.errors import echo
from flexgear.model.faults import check_faults
from flexgear.model.load_cases import check_load_cases
from flexgear.model.machine import check_machines
from flexgear.model.names import MemberName
from flexgear.model.rating import check_rating, check_thrust
from flexgear.model.read import nearest
from flexgear.model.section import Missing, Refusal
from flexgear.model.sensor import check_sensors
from flexgear.model.stage import ONE_SET_OF_TEETH

if TYPE_CHECKING:
    from flexgear.model.case import Case

_MAX_NAME_LENGTH = 100  # characters, since a file name is limited to 255 bytes


def check_case_name(name: str) -> None:
    """Raise Refusal for a name that cannot be part of a file name, or contains a path."""
    bad = not name.isprintable() or any(sign in name for sign in '/\\:*?"<>|')
    if bad or name != name.strip(" .") or not 0 < len(name) <= _MAX_NAME_LENGTH:
        remedy = f'give name = "…" of letters, digits, hyphens, at most {_MAX_NAME_LENGTH} of them'
        raise Refusal("name", f"{echo(name)} cannot name a file of results", remedy)


def check_case(case: Case) -> None:
    """Check names, ports and supports of a case against one another; raises Refusal."""
    _check_stage_names(case)
    _check_members(case)
    _check_ports(case)
    _check_held(case)
    check_machines(case)
    check_load_cases(case)
    check_rating(case)
    check_thrust(case)
    check_faults(case)
    _check_behind_shafts(case)
    _check_hubs(case)
    check_sensors(case)


def _check_stage_names(case: Case) -> None:
    seen: dict[str, int] = {}
    for k, stage in enumerate(case.stages):
        if stage.name in seen:
            problem = f"{echo(stage.name)} is also the name of stage {seen[stage.name] + 1}"
            raise Refusal(f"stages.{k}.name", problem, "give each stage a unique name")
        seen[stage.name] = k


def _ports(case: Case) -> list[tuple[str, str]]:
    """Key and member of each input and the output."""
    ports = [(f"inputs.{k}.member", port.member) for k, port in enumerate(case.inputs)]
    return ports if case.output is None else [*ports, ("output.member", case.output.member)]


def _joint_ends(case: Case) -> list[tuple[str, str]]:
    """Key and member of each end of the joints."""
    ends = ("first", "second")
    return [(f"joints.{k}.{e}", getattr(j, e)) for k, j in enumerate(case.joints) for e in ends]


def _check_members(case: Case) -> None:
    """Raise Refusal for the name of a member that does not exist."""
    named = [(f"held.{k}", name) for k, name in enumerate(case.held)] + _ports(case)
    named += [(f"loads.{k}.member", load.member) for k, load in enumerate(case.loads)]
    members: list[str] = list(case.member_names())
    for key, name in named + _joint_ends(case):
        if name in members:
            continue
        remedy = nearest(name, members)
        if name.rpartition(".")[2].startswith("planet"):
            remedy = f"{remedy}; {ONE_SET_OF_TEETH}"
        raise Refusal(key, f"{echo(name)} is not a member", remedy)


def _check_ports(case: Case) -> None:
    """Raise Refusal for a port that is another port, held or fixed, and for a fixed joint end."""
    seen: dict[str, str] = {}
    for key, name in _ports(case):
        if name in seen:
            raise Refusal(key, f"{name} is a port already ({seen[name]})", "name another member")
        seen[name] = key
    for k, name in enumerate(case.held):
        if name in seen:
            problem = f"{name} is also {seen[name]}"
            raise Refusal(f"held.{k}", problem, "a held member is no port; delete one")
    for key, name in _ports(case) + _joint_ends(case):
        if case.kinematics_of(name) == "fixed":
            raise Refusal(key, f"{name} is fixed", 'choose another kinematics than "fixed"')


def _check_held(case: Case) -> None:
    """Raise Refusal for a held member without support against rotation, and a loaded member with
    one."""
    held = case.held_members()
    for name in case.member_names():
        k, part = case.stage_index(name), name.part
        form, member = case.stages[k].form(part), case.member(name)
        if form == "fe":
            continue  # the supports of the FE body or its hub hold it
        is_supported = (
            member.holds_rotation
            or form == "beam"  # the spline of the shaft is connected to the housing
            or case.kinematics_of(name) == "fixed"
            or (case.output is None and name in case.held)  # there is no torque
        )
        if name in held and not is_supported:
            problem = f"is zero, so nothing supports the torque of the held {name}"
            remedy = f'give it (or torsion), or {part}.kinematics = "fixed"'
            raise Refusal(f"stages.{k}.{part}.support.tangential", problem, remedy)
        if name not in held and member.holds_rotation and case.output is not None:
            at, support = next(x for x in member.supports.items() if x[1].holds_rotation)
            key = "tangential" if support.tangential > 0 else "torsion"
            raise Refusal(
                f"stages.{k}.{part}.{at}.{key}",
                f"prevents the rotation of {name}, which rotates",
                f'set it to zero, or name "{name}" in held (only a case of free vibration, without '
                "[output], may have it)",
            )


def _check_behind_shafts(case: Case) -> None:
    """Check keys of ports at suns with a beam shaft: such a port is a body behind the spline of the
    shaft, which needs inertia, mass and tilt_inertia, while other ports have no mass of their own.
    Raises Missing or Refusal."""
    for (key_of_member, _), port in zip(_ports(case), case.ports, strict=True):
        at, member = key_of_member.removesuffix(".member"), MemberName.parse(port.member)
        beam = case.stage(member.stage).form(member.part) == "beam"
        for key in ("inertia", "mass", "tilt_inertia"):
            if beam and getattr(port, key) is None:
                problem = f"is missing, and {port.member} has a shaft with a body at its end"
                raise Missing(f"{at}.{key}", problem, "give inertia, mass and tilt_inertia")
        for key in ("mass", "tilt_inertia", "bearing"):
            if not beam and getattr(port, key) is not None:
                problem = f"is for the body at the end of a sun's shaft, but {port.member} has none"
                raise Refusal(f"{at}.{key}", problem, "give it to the member")


def _check_hubs(case: Case) -> None:
    """Check that FE rings have a hub if and only if they rotate; raises Missing or Refusal."""
    held = case.held_members()
    for k, stage in enumerate(case.stages):
        if stage.form("ring") != "fe" or stage.ring is None:
            continue
        turns = f"{stage.name}.ring" not in held
        if turns and stage.ring.hub is None:
            problem = "is missing, and the FE ring rotates: bolts, fits and splines connect to it"
            remedy = f'add it, or name "{stage.name}.ring" in held'
            raise Missing(f"stages.{k}.ring.hub", problem, remedy)
        if not turns and stage.ring.hub is not None:
            problem = "is for a rotating ring, but the ring is held"
            raise Refusal(f"stages.{k}.ring.hub", problem, "delete it, or hold another member")
