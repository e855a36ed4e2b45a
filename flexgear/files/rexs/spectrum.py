"""Load cases of a REXS file as ``[[load_cases]]``.

The duration of a load case is ``operating_time`` of the gear unit (``load_duration`` up to REXS
1.2), or its share of the total time, ``operating_time_fraction`` (``load_duration_fraction``). A
duration of zero marks an extreme load.
"""

import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.files.case_text import CaseText, Datum, Section
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Document, LoadCase, number
from flexgear.files.rexs.ports import POWER, SPEED, TORQUE, forces_of, ports_of, put_forces
from flexgear.files.rexs.shafts import SunShaft
from flexgear.files.rexs.stages import Member
from flexgear.files.rexs.tables import PORT
from flexgear.model.errors import InputError
from flexgear.model.load_cases import SUM_OF_HOURS

_TIME = ("operating_time", "load_duration")
_SHARE = ("operating_time_fraction", "load_duration_fraction")
_MOST_OVER_RATED = 1.2  # torque of a load case with duration over the rated one
_TOTAL_HOURS = 20_000.0  # h, assumed if a file gives only shares


def write_load_cases(
    document: Document,
    assembly: Assembly,
    text: CaseText,
    members: list[Member],
    shafts: Mapping[Member, SunShaft],
    where: str,
) -> set[int]:
    """Write the load cases that have a duration at the end of a case; returns their ids. shafts: of
    suns; where: name of the file. InputError for a duration that is none."""
    written: dict[str, Any] = tomllib.loads(text.text())
    ports = [*written.get("inputs", ()), *([written["output"]] if "output" in written else [])]
    if "output" not in written:
        return set()
    ids: set[int] = set()
    largest: tuple[float, int | None] = _MOST_OVER_RATED, None
    rated = {port.member.name: port for port in ports_of(assembly, members)}
    loaded = {load["member"] for load in written.get("loads", ())}  # a load case may unload them
    with document.values_of(None):  # of the model, not of the selected load case
        total_time = number(document.kind("gear_unit"), _TIME, "h")
    shares: list[float] = []
    for load_case in document.load_cases:
        with document.values_of(load_case):
            hours = _hours(document, load_case, total_time, text, where, shares)
            if hours is None:
                continue
            ids.add(load_case.id)
            section = text.section("[[load_cases]]")
            alike = [other.name for other in document.load_cases].count(load_case.name) > 1
            name = "" if alike else load_case.name
            section.put("name", name or f"load case {load_case.id}", "")
            if hours.value > 0.0:
                section.put("hours", hours.value, hours.source)
            else:
                section.put("extreme", True, f"{hours.source}: no duration")
            sections = {written["inputs"][0]["member"]: section}
            states = {port.member.name: port for port in ports_of(assembly, members)}
            back_driven = ""
            for keys in ports:
                port = states.get(keys["member"])
                if port is None or not keys.keys() & {row.key for row in PORT}:
                    continue
                section = _section(text, sections, keys["member"], port.loads[0].label)
                if SPEED.key in keys:
                    section.take(SPEED.key, port.speed)
                if keys.keys() & {TORQUE.key, POWER.key}:
                    port.take_torque(section)
                    ratio = port.torque_over(rated[keys["member"]])
                    if hours.value > 0.0 and ratio > largest[0]:
                        largest = ratio, load_case.id
                    if port.is_back_driven(rated[keys["member"]]) and not back_driven:
                        back_driven = port.loads[0].label
            if back_driven:
                why = f"{back_driven}: power against the rated direction"
                sections[written["inputs"][0]["member"]].put("back_driven", True, why)
            sums: dict[str, tuple[Array, list[str]]] = {}
            for load, on, values in forces_of(assembly, members, shafts):
                total, labels = sums.get(on.name, (np.zeros(len(values)), []))
                sums[on.name] = total + values, [*labels, load.label]
            for member, (total, labels) in sums.items():
                if member not in loaded and not total.any():
                    continue
                source = " + ".join(labels)
                section = _section(text, sections, member, source)
                put_forces(section, total.tolist(), source)
    if shares and abs(sum(shares) - 1.0) > SUM_OF_HOURS:
        text.warn(f"shares of time add up to {100.0 * sum(shares):.4g} %")
    over, highest = largest
    if highest is not None and document.load_case is not None:
        text.warn(
            f"load case {highest} has {over:.3g} times the torque of load case"
            f" {document.load_case.id}, the rated one; --load-case {highest} takes it as rated"
        )
    return ids


def _section(text: CaseText, sections: dict[str, Section], member: str, why: str) -> Section:
    """The section of a member in the load case that is being written, created if missing."""
    if member not in sections:
        sections[member] = text.section("[[load_cases.members]]")
        sections[member].put("member", member, why)
    return sections[member]


def _hours(
    document: Document, load_case: LoadCase, total_time: Datum | None, text: CaseText, where: str,
    shares: list[float],
) -> Datum | None:  # fmt: skip
    """Duration of a load case, h; None if the file does not state it. A share of the total time is
    appended to ``shares``. InputError for a value that is no number, or negative."""
    stated = {attribute.id for _, attribute in load_case.attributes}
    units = document.kind("gear_unit")
    names, unit = (_TIME, "h") if stated & {*_TIME} else (_SHARE, "none")
    if not stated & {*names}:
        return None
    share = number(units, names, unit)
    if share is None or share.value < 0.0:
        problem = "is no duration" if share is None else f"{share.value:g} is negative"
        key = f"load case {load_case.id}, {min(stated & {*names})}"
        raise InputError(where, key, problem, "correct it; 0 marks an extreme load")
    if unit == "h":
        return share
    shares.append(share.value)
    if total_time is None:
        line = f"load cases have only shares of time: of {_TOTAL_HOURS:g} h in all, assumed"
        if line not in text.assumed:
            text.warn(line)
    total = _TOTAL_HOURS if total_time is None else total_time.value
    return Datum(share.value * total, f"{share.source}, of {total:g} h")
