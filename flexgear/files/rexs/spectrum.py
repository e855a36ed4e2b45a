"""Load cases of a REXS file as ``[[load_cases]]``.

The duration of a load case is ``operating_time`` of the gear unit (``load_duration`` up to REXS
1.2), or its share of the total time, ``operating_time_fraction`` (``load_duration_fraction``). A
duration of zero marks an extreme load.

K_A is an input of every rating and becomes a key: the largest of the file, and what gear meshes and
load cases have in its place. The other load factors of a file are results as a
rule, and as keys they would replace those of the model: the case has them in comments.
"""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from flexgear.files.case_text import Datum, Section
from flexgear.files.rexs.document import LoadCase, number, read
from flexgear.files.rexs.ports import (
    POWER,
    SPEED,
    TORQUE,
    PortWriter,
    forces_of,
    ports_of,
    put_forces,
)
from flexgear.files.rexs.tables import APPLICATION_FACTOR, LOAD_FACTORS, PORT
from flexgear.model.errors import InputError
from flexgear.model.load_cases import SUM_OF_HOURS

_TIME = ("operating_time", "load_duration")
_SHARE = ("operating_time_fraction", "load_duration_fraction")
_MOST_OVER_RATED = 1.2  # torque of a load case with duration over the rated one
_TOTAL_HOURS = 20_000.0  # h, assumed if a file gives only shares
Factors = dict[tuple[str, str, str], float]  # load factors by stage, kind of gear mesh and key


def write_load_cases(ports: PortWriter) -> set[int]:
    """Write load cases that have a duration, and load factors, at the end of a case; returns the
    ids of the load cases. ports: of the rated one. InputError for a duration that is none."""
    text, document = ports.case, ports.assembly.document
    written: dict[str, Any] = tomllib.loads(text.text())
    if "output" not in written:
        return set()
    train = _Train(ports, written)
    with document.values_of(None):  # of the model, not of the selected load case
        total_time = number(document.kind("gear_unit"), _TIME, "h")
    names = [load_case.name for load_case in document.load_cases]
    applied = [read([c], APPLICATION_FACTOR) for c in document.kind("cylindrical_stage")]
    for load_case in document.load_cases:
        with document.values_of(load_case):
            applied += [read([c], APPLICATION_FACTOR) for c in document.kind("cylindrical_stage")]
    largest, rated = _largest(applied), Factors()
    text.section("[rating]").take(APPLICATION_FACTOR.key, largest)
    if largest is not None:
        rated["", "", APPLICATION_FACTOR.key] = largest.value
    _put_factors(ports, "rating", rated)
    over_rated, shares = dict[int, float](), list[float]()
    for load_case in document.load_cases:
        with document.values_of(load_case):
            hours = _hours(ports, load_case, total_time, shares)
            if hours is not None:
                name = load_case.name if names.count(load_case.name) == 1 else ""
                over_rated[load_case.id] = train.write(name or f"load case {load_case.id}", hours)
                _put_factors(ports, "load_cases", {**rated})
    if any(section.is_comment for section in text.sections):
        text.warn("load factors of the file are in comments; those of the model count")
    if shares and abs(sum(shares) - 1.0) > SUM_OF_HOURS:
        text.warn(f"shares of time add up to {100.0 * sum(shares):.4g} %")
    highest = max(over_rated, key=over_rated.__getitem__, default=None)
    selected = document.load_case
    if highest is not None and over_rated[highest] > _MOST_OVER_RATED and selected is not None:
        text.warn(
            f"load case {highest} has {over_rated[highest]:.3g} times the torque of load case"
            f" {selected.id}, the rated one; --load-case {highest} takes it as rated"
        )
    return {*over_rated}


@dataclass(frozen=True)
class _Train:
    """A train whose load cases are written. ports: of the rated load case; written: the case so
    far. Values are those of the document's present load case."""

    ports: PortWriter
    written: Mapping[str, Any]

    def write(self, name: str, hours: Datum) -> float:
        """Write a load case; returns the largest ratio of a port's torque to the rated one, 0 of a
        load case without duration."""
        section = self.ports.case.section("[[load_cases]]")
        section.put("name", name, "")
        if hours.value > 0.0:
            section.put("hours", hours.value, hours.source)
        else:
            section.put("extreme", True, f"{hours.source}: no duration")
        sections = {self.written["inputs"][0]["member"]: section}
        ratio = self._write_ports(sections)
        self._write_forces(sections)
        return ratio if hours.value > 0.0 else 0.0

    def _write_ports(self, sections: dict[str, Section]) -> float:
        """Write speeds and torques; returns the largest ratio of a torque to the rated one."""
        present = ports_of(self.ports.assembly, self.ports.members)
        states, rated = ({p.member.name: p for p in of} for of in (present, self.ports.ports))
        largest, back_driven = 0.0, ""
        for keys in (*self.written["inputs"], self.written["output"]):
            port = states.get(keys["member"])
            if port is None or not keys.keys() & {row.key for row in PORT}:
                continue
            section = self._section(sections, keys["member"], port.loads[0].label)
            if SPEED.key in keys:
                section.take(SPEED.key, port.speed)
            if keys.keys() & {TORQUE.key, POWER.key}:
                port.take_torque(section)
                rated_port = rated[keys["member"]]
                largest = max(largest, port.torque_over(rated_port))
                if port.is_back_driven(rated_port):
                    back_driven = back_driven or port.loads[0].label
        if back_driven:
            why = f"{back_driven}: power against the rated direction"
            next(iter(sections.values())).put("back_driven", True, why)
        return largest

    def _write_forces(self, sections: dict[str, Section]) -> None:
        """Write forces on members; zeros only on members with a load in the rated load case."""
        loaded = {load["member"] for load in self.written.get("loads", ())}
        for member, (total, source) in forces_of(self.ports).items():
            if member.name in loaded or total.any():
                put_forces(self._section(sections, member.name, source), total, source)

    def _section(self, sections: dict[str, Section], member: str, why: str) -> Section:
        """The section of a member in the load case that is being written, created if missing."""
        if member not in sections:
            sections[member] = self.ports.case.section("[[load_cases.members]]")
            sections[member].put("member", member, why)
        return sections[member]


def _put_factors(ports: PortWriter, parent: str, earlier: Factors) -> None:
    """Write the load factors of the present load case, the largest of all planets and halves, as
    tables below ``parent``, but for K_A in comments, without those in ``earlier``, and add them to
    it; ``earlier`` has those of all gear meshes at empty names."""
    stages = {member.stage_name: member.stage for member in ports.members}
    groups = {(n, kind): m for n, stage in stages.items() for kind, m in stage.gear_meshes.items()}
    for rows, (group, gear_meshes) in product(([APPLICATION_FACTOR], LOAD_FACTORS), groups.items()):
        every = [(r, _largest(read([m.stage], r) for m in gear_meshes)) for r in rows]
        data = {(*group, row.key): d for row, d in every if d is not None}
        for_all = {at: earlier.get(at, earlier.get(("", "", at[-1]))) for at in data}
        factors = {at: d for at, d in data.items() if d.value != for_all[at]}
        if factors:
            section = ports.case.section(f"[[{parent}.gear_meshes]]")
            section.is_comment = rows is LOAD_FACTORS
            section.put("stage", group[0], "")
            section.put("kind", group[1], "")
            for at, datum in factors.items():
                section.take(at[-1], datum)
                earlier[at] = datum.value


def _largest(data: Iterable[Datum | None]) -> Datum | None:
    """The largest value, None without any."""
    return max((d for d in data if d is not None), key=lambda d: d.value, default=None)


def _hours(
    ports: PortWriter, load_case: LoadCase, total_time: Datum | None, shares: list[float]
) -> Datum | None:
    """Duration of a load case, h; None if the file does not state it. A share of the total time is
    appended to ``shares``. InputError for a value that is no number, or negative."""
    stated = {attribute.id for _, attribute in load_case.attributes}
    units, text = ports.assembly.document.kind("gear_unit"), ports.case
    names, unit = (_TIME, "h") if stated & {*_TIME} else (_SHARE, "none")
    if not stated & {*names}:
        return None
    share = number(units, names, unit)
    if share is None or share.value < 0.0:
        problem = "is no duration" if share is None else f"{share.value:g} is negative"
        key = f"load case {load_case.id}, {min(stated & {*names})}"
        raise InputError(ports.where, key, problem, "correct it; 0 marks an extreme load")
    if unit == "h":
        return share
    shares.append(share.value)
    if total_time is None:
        line = f"load cases have only shares of time: of {_TOTAL_HOURS:g} h in all, assumed"
        if line not in text.assumed:
            text.warn(line)
    total = _TOTAL_HOURS if total_time is None else total_time.value
    return Datum(share.value * total, f"{share.source}, of {total:g} h")
