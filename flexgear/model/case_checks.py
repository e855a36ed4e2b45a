"""Checks between the sections of a train."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexgear.model.errors import echo
from flexgear.model.machine import check_machines
from flexgear.model.names import MemberName
from flexgear.model.read import nearest
from flexgear.model.section import Missing, Refusal

if TYPE_CHECKING:
    from flexgear.model.case import Case


def check_case(case: Case) -> None:
    """Names, ports and supports fit one another; Refusal otherwise."""
    _check_stage_names(case)
    _check_members(case)
    _check_ports(case)
    _check_held(case)
    check_machines(case)
    _check_behind_shafts(case)
    _check_hubs(case)


def _check_stage_names(case: Case) -> None:
    seen: dict[str, int] = {}
    for k, stage in enumerate(case.stages):
        if stage.name in seen:
            raise Refusal(
                f"stages.{k}.name",
                f"{echo(stage.name)} is also the name of stage {seen[stage.name] + 1}",
                "give each stage its own name",
            )
        seen[stage.name] = k


def _check_members(case: Case) -> None:
    """Every member that is named exists."""
    named = [(f"held.{k}", name) for k, name in enumerate(case.held)]
    named += [(f"inputs.{k}.member", port.member) for k, port in enumerate(case.inputs)]
    if case.output is not None:
        named += [("output.member", case.output.member)]
    named += [(f"loads.{k}.member", load.member) for k, load in enumerate(case.loads)]
    for k, joint in enumerate(case.joints):
        named += [(f"joints.{k}.first", joint.first), (f"joints.{k}.second", joint.second)]
    members: list[str] = list(case.member_names())
    for key, name in named:
        if name not in members:
            raise Refusal(key, f"{echo(name)} is not a member", nearest(name, members))


def _check_ports(case: Case) -> None:
    """A member has one role."""
    ports = [(f"inputs.{k}.member", port.member) for k, port in enumerate(case.inputs)]
    if case.output is not None:
        ports.append(("output.member", case.output.member))
    seen: dict[str, str] = {}
    for key, name in ports:
        if name in seen:
            raise Refusal(key, f"{name} is a port already ({seen[name]})", "name another member")
        seen[name] = key
    for k, name in enumerate(case.held):
        if name in seen:
            raise Refusal(
                f"held.{k}", f"{name} is also {seen[name]}", "a held member is no port; drop one"
            )
    for name, key in seen.items():
        if case.kinematics_of(name) == "fixed":
            raise Refusal(key, f"{name} is fixed", 'choose another kinematics than "fixed"')
    for k, joint in enumerate(case.joints):
        for end in ("first", "second"):
            name = getattr(joint, end)
            if case.kinematics_of(name) == "fixed":
                raise Refusal(
                    f"joints.{k}.{end}",
                    f"{name} is fixed",
                    'choose another kinematics than "fixed"',
                )


def _check_held(case: Case) -> None:
    """What is held has a support against turning, and nothing else has but in free vibration."""
    held = case.held_members()
    for name in case.member_names():
        k = case.stage_index(name)
        part = name.part
        if case.stages[k].form(part) == "fe":
            continue  # its own supports, or the hub
        support = case.member(name).support
        turns = case.kinematics_of(name) != "fixed"
        held_output = case.output is None and name in case.held  # there is no torque to take
        splined = case.stages[k].form(part) == "beam"  # the shaft's end stands in the housing
        if (
            name in held
            and turns
            and not support.holds_rotation
            and not held_output
            and not splined
        ):
            raise Refusal(
                f"stages.{k}.{part}.support.tangential",
                f"is zero, so nothing takes the torque of the held {name}",
                f'give it (or torsion), or {part}.kinematics = "fixed"',
            )
        if name not in held and support.holds_rotation and case.output is not None:
            key = "tangential" if support.tangential > 0 else "torsion"
            raise Refusal(
                f"stages.{k}.{part}.support.{key}",
                f"holds the rotation of {name}, which turns",
                f'set it to zero, or name "{name}" in held (a case of free vibration, without '
                "[output], may have it)",
            )


def _check_behind_shafts(case: Case) -> None:
    """What hangs behind the spline of a sun's shaft is a body that can move in all directions."""
    places = [*(f"inputs.{k}" for k in range(len(case.inputs))), "output"]
    for at, port in zip(places, case.ports, strict=False):
        member = MemberName.parse(port.member)
        beam = case.stage(member.stage).form(member.part) == "beam"
        for key in ("inertia", "mass", "tilt_inertia"):
            if beam and getattr(port, key) is None:
                problem = f"is missing, and {port.member} has a shaft whose end carries a body"
                raise Missing(f"{at}.{key}", problem, "give inertia, mass and tilt_inertia")
        for key in ("mass", "tilt_inertia", "bearing"):
            if not beam and getattr(port, key) is not None:
                problem = f"is of a body behind a sun's shaft, but {port.member} has none"
                raise Refusal(f"{at}.{key}", problem, "give it to the member")


def _check_hubs(case: Case) -> None:
    """An FE ring that turns stands on a hub, and only such a ring."""
    held = case.held_members()
    for k, stage in enumerate(case.stages):
        if stage.form("ring") != "fe" or stage.ring is None:
            continue
        turns = f"{stage.name}.ring" not in held
        if turns and stage.ring.hub is None:
            problem = "is missing, and the FE ring turns: its bolts, fits and splines stand on it"
            raise Missing(
                f"stages.{k}.ring.hub", problem, f'add it, or name "{stage.name}.ring" in held'
            )
        if not turns and stage.ring.hub is not None:
            problem = "is that of a ring that turns, but the ring is held"
            raise Refusal(f"stages.{k}.ring.hub", problem, "take it out, or hold another member")
