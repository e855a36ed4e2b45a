"""What a REXS model does not say of a case."""

from __future__ import annotations

from flexgear.model.case import Case
from flexgear.model.flank_table import FLANKS
from flexgear.model.member import MatedGear, PlanetGear
from flexgear.model.member_load import MemberLoad
from flexgear.model.modifications import FlankModifications
from flexgear.model.section import Section

_WRITTEN = {
    "name", "title", "source", "gravity", "material", "stages", "joints", "held", "inputs",
    "output", "loads",
}  # fmt: skip
_OF_PORTS = {"member", "speed", "torque", "power", "inertia"}


def not_written(case: Case) -> list[str]:
    """What the model does not say of the case, in words."""
    lost = _set(case, "", _WRITTEN)
    for k, port in enumerate(case.ports):
        where = "output" if port is case.output else f"inputs[{k}]"
        lost += _set(port, f"{where}.", _OF_PORTS)
    lost += [f"loads on {load.member}" for load in case.loads if not is_written(load)]
    for stage in case.stages:
        keys = ("errors", "gear_mesh")
        defaults = {k: type(stage).model_fields[k].default for k in keys}
        lost += [f"stages.{stage.name}.{k}" for k in keys if getattr(stage, k) != defaults[k]]
        for name in (*stage.members, "planet"):
            member = getattr(stage, name, None)
            if getattr(member, "inertia", None) or getattr(member, "equivalent_mass", None):
                lost.append(f"stages.{stage.name}.{name}: its moment of inertia")
            if isinstance(member, MatedGear | PlanetGear):
                where = f"stages.{stage.name}.{name}.modifications"
                lost += [f"{where}.{key}" for key in _tables(member.modifications)]
        if stage.is_flexible:
            lost.append(
                f"stages.{stage.name}: FE bodies of ring and carrier, their bearings, shaft"
            )
    return lost


def _tables(modifications: FlankModifications) -> list[str]:
    """Flanks given point by point."""
    owners = {
        "": modifications,
        **{f"{name}.": getattr(modifications, name, None) for name in FLANKS},
    }
    return [f"{name}table" for name, owner in owners.items() if owner is not None and owner.table]


def _set(section: Section, before: str, written: set[str]) -> list[str]:
    """Keys of a section that are set, but for those that are written."""
    return [
        f"{before}{name}"
        for name, field in type(section).model_fields.items()
        if name not in written
        and getattr(section, name) != field.get_default(call_default_factory=True)
    ]


def is_written(load: MemberLoad) -> bool:
    """Whether REXS has an attribute for a load: constant, in fixed axes, no torque."""
    return not load.is_history and load.frame == "fixed" and load.moment[2] == 0
