"""Load spectra of REXS: load cases with durations become those of a case, and the other way.

A load case lasts for ``operating_time`` of the gear unit (``load_duration`` up to REXS 1.2), or for
a share of the whole time, ``operating_time_fraction`` (``load_duration_fraction``). No time at all
marks an extreme load.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.files.case_text import CaseText, Section
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Datum, Document, LoadCase, number
from flexgear.files.rexs.outgoing import Outgoing
from flexgear.files.rexs.ports import Port, forces_of, ports_of
from flexgear.files.rexs.stages import Member
from flexgear.gears.load_bins import HOUR, LoadBin
from flexgear.model.train import MemberLoad

_TIME = ("operating_time", "load_duration")
_SHARE = ("operating_time_fraction", "load_duration_fraction")
_WHOLE = 20_000.0  # h, where a file gives shares alone


def write_load_cases(
    document: Document, assembly: Assembly, text: CaseText, members: list[Member]
) -> set[int]:
    """Write load cases that have a duration behind the ports of a case; ids of those written."""
    written: dict[str, Any] = tomllib.loads(text.text())
    ports = [*written.get("inputs", ()), *([written["output"]] if "output" in written else [])]
    if "output" not in written:
        return set()
    ids: set[int] = set()
    with document.values_of(LoadCase(0, 0, [])):  # of the model, not of the load case that is rated
        whole = number(document.kind("gear_unit"), _TIME, "h")
    for load_case in document.load_cases:
        with document.values_of(load_case):
            hours = _hours(document, load_case, whole, text)
            if hours is None:
                continue
            ids.add(load_case.id)
            section = text.section("[[load_cases]]")
            section.put("name", f"load case {load_case.id}", "")
            if hours.value > 0.0:
                section.put("hours", hours.value, hours.source)
            else:
                section.put("extreme", True, f"{hours.source}: no duration")
            sections = {written["inputs"][0]["member"]: section}
            states = {port.member.name: port for port in ports_of(assembly, members)}
            for keys in ports:
                port = states.get(keys["member"])
                if port is not None and keys.keys() & {"speed_rpm", "torque_nm", "power_kw"}:
                    section = _section(text, sections, keys["member"], port.loads[0].label)
                    _take(section, keys, port)
            for member, load, source in _forces(assembly, members):
                section = _section(text, sections, member, source)
                section.put("force_n", load[:3], f"{source}: v, w, u directions")
                section.put("moment_nm", [*load[3:], 0.0], f"{source}: about v and w")
    return ids


def _forces(assembly: Assembly, members: list[Member]) -> Iterator[tuple[str, list[float], str]]:
    """Members, sums of the forces and moments on them, and where these come from."""
    sums: dict[str, tuple[list[float], list[str]]] = {}
    for load, member, values in forces_of(assembly, members):
        before, labels = sums.get(member.name, ([0.0] * len(values), []))
        sums[member.name] = (
            [a + b for a, b in zip(before, values, strict=True)],
            [*labels, load.label],
        )
    for name, (total, labels) in sums.items():
        yield name, total, " + ".join(labels)


def _section(text: CaseText, sections: dict[str, Section], member: str, why: str) -> Section:
    """The section of a member in the load case that is being written."""
    if member not in sections:
        sections[member] = text.section("[[load_cases.members]]")
        sections[member].put("member", member, why)
    return sections[member]


def _take(section: Section, keys: Mapping[str, Any], port: Port) -> None:
    """Speed and torque of a port in a load case, where the case gives them."""
    if "speed_rpm" in keys:
        section.take("speed_rpm", port.speed)
    if "torque_nm" in keys or "power_kw" in keys:
        if port.torque is not None:
            section.take("torque_nm", port.torque)
        else:
            section.take("power_kw", port.power)


def _hours(
    document: Document, load_case: LoadCase, whole: Datum | None, text: CaseText
) -> Datum | None:
    """How long a load case lasts, h; None where the file does not say."""
    stated = {attribute.id for _, attribute in load_case.attributes}
    units = document.kind("gear_unit")
    if stated & {*_TIME}:
        return number(units, _TIME, "h")
    share = number(units, _SHARE, "none") if stated & {*_SHARE} else None
    if share is None:
        return None
    if whole is None:
        line = f"load cases have shares of time alone: of {_WHOLE:g} h in all, assumed"
        if line not in text.assumed:
            text.warn(line)
    total = _WHOLE if whole is None else whole.value
    return Datum(share.value * total, f"{share.source}, of {total:g} h")


class LoadIds(NamedTuple):
    """Ids of the gear unit, of members' shafts, of external loads at ports and of forces on
    members."""

    unit: int
    shafts: Mapping[str, int]
    ports: Mapping[str, int]
    forces: Mapping[str, list[int]]


def is_written(load: MemberLoad) -> bool:
    """Whether REXS has an attribute for a load: constant, in fixed axes, no torque."""
    return not load.is_history and load.frame == "fixed" and load.moment[2] == 0


def force_attributes(load: Array) -> dict[str, float]:
    """Attributes of a load, force N and moment N m (6,) along x, y, z = v, w, u."""
    x, y, z, mx, my, _ = (float(part) for part in load)
    return {
        "force_u_direction": z, "force_v_direction": x, "force_w_direction": y,
        "torque_around_v_axis": mx, "torque_around_w_axis": my,
    }  # fmt: skip


def add_load_cases(
    bins: Sequence[LoadBin], rated: Sequence[MemberLoad], model: Outgoing, ids: LoadIds
) -> None:
    """Add load bins to a model that has its components; rated: loads that these have already."""
    for load_bin in bins:
        model.begin_load_case()
        model.result(ids.unit, operating_time=HOUR * load_bin.hours)
        for member, speed in load_bin.speed.items():
            model.result(ids.shafts[member], rotational_speed=speed)
        for member, number_of_load in ids.ports.items():
            torque = load_bin.torque[member]
            power = torque * load_bin.speed[member]
            model.result(number_of_load, torque_around_u_axis=torque, power=power)
        for member, numbers in ids.forces.items():
            loads = [load for load in load_bin.loads if load.member == member]
            if loads == [load for load in rated if load.member == member]:
                continue
            total = sum((load.first for load in filter(is_written, loads)), np.zeros(6))
            for k, number_of_load in enumerate(numbers):
                model.result(number_of_load, **force_attributes(np.zeros(6) if k else total))
