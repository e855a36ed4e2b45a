"""Load cases of a rating with their durations, in a case, a CSV table or time series."""

from __future__ import annotations

import re
from collections.abc import Iterator
from glob import glob
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pydantic import Field

from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import (
    number_in,
    quantity_in,
    read_cells,
    require_one,
    require_titles,
)
from flexgear.model.machine import LOAD_COLUMNS
from flexgear.model.names import Member
from flexgear.model.rating import ForcedFactors, GearMeshFactors
from flexgear.model.read import Written, nearest
from flexgear.model.section import Missing, Refusal, Section, accepted_keys, quantity_of
from flexgear.model.train import Forces, Moments
from flexgear.model.units import Force, Power, Speed, Time, Torque

if TYPE_CHECKING:
    from flexgear.model.case import Case


_CHANNEL = re.compile(r"(-?)\s*([^\[\]()]+?)\s*(?:[\[(]([^\[\]()]*)[\])])?")


class Channel(NamedTuple):
    """A channel of a file. sign: factor on its values; unit: "" for the unit in the file."""

    sign: float
    name: str
    unit: str


def channel_of(text: str) -> Channel | None:
    """The channel named by "NAME", "-NAME" or "NAME [unit]"; None for other text."""
    match = _CHANNEL.fullmatch(text.strip())
    return Channel(-1.0 if match[1] else 1.0, match[2], match[3] or "") if match else None


YEAR = 8784.0  # h, of a leap year


def files_named(pattern: str) -> list[str]:
    """Files that match a pattern such as "dlc12/*.outb"; none for a pattern with a zero byte."""
    return [] if "\0" in pattern else glob(pattern, recursive=True)


class DesignLoadCase(Section):
    """Files that represent some hours of each year.

    name: of the design load case. files: a file, or a pattern such as "dlc12/*.outb", relative to
    the case's folder. hours_per_year: divided between the files in proportion to their durations.
    extreme: whether only its extreme loads count, without duration.
    """

    name: str
    files: str
    hours_per_year: float | None = Field(default=None, ge=0.0, le=YEAR)
    extreme: bool = False

    def _check(self) -> None:
        if self.extreme:
            self._refuse_set(["hours_per_year"], "is given beside extreme", "keep one of them")
        else:
            remedy = "add hours_per_year, or extreme = true"
            self._require_set(["hours_per_year"], "is missing", remedy)

    def paths(self, where: str) -> list[Path]:
        """The files in the order of their names; InputError if there are none."""
        paths = sorted(Path(name) for name in files_named(self.files))
        if not paths:
            problem = f"'{self.files}' names no file"
            raise InputError(where, "load_series.design_load_cases", problem, "check the path")
        return paths


class LoadSeries(Section):
    """Time series in OpenFAST (.out, .outb), CSV or netCDF files, sorted into bins of torque, speed
    and loads on the first input.

    A channel is "NAME", "-NAME" with opposite sign, or "NAME [unit]" if the file gives no unit.

    years: design life. design_load_cases: files and their hours. time, torque, speed: channels;
    torque acts on the first input from outside, both positive about +z. force, moment: channels of
    the force on the first input along x, y, z and of the moment about x, y; "" for none. azimuth:
    channel of the angle by which the axes of force and moment have turned about z, if these are the
    rotor's axes; loads are binned in fixed axes. start: time to skip at the beginning of each file.
    torque_step, speed_step, force_step, moment_step: widths of the bins, whose edges are integer
    multiples; if left out, a twentieth of rated torque, a quarter of rated speed, for moments half
    of rated torque.

    damage  the torque with the same damage as all samples of the bin by n |T|^exponent
    edge    the upper edge of torque and loads, which is conservative

    value: torque and loads of a bin. exponent: of the damage sum; 6.6 for flanks of case-hardened
    gears.
    """

    years: float = Field(gt=0.0, le=100.0)
    design_load_cases: tuple[DesignLoadCase, ...] = Field(min_length=1)
    time: str = "Time"
    torque: str
    speed: str
    force: tuple[str, str, str] = ("", "", "")
    moment: tuple[str, str] = ("", "")
    azimuth: str = ""
    start: Time = Field(default=0.0, ge=0.0, le=1e6)
    torque_step: Torque | None = Field(default=None, gt=0.0, le=1e9)
    speed_step: Speed | None = Field(default=None, gt=0.0, le=1e4)
    force_step: Force | None = Field(default=None, gt=0.0, le=1e9)
    moment_step: Torque | None = Field(default=None, gt=0.0, le=1e9)
    value: Literal["damage", "edge"] = "damage"
    exponent: float = Field(default=6.6, ge=1.0, le=20.0)

    def _check(self) -> None:
        single = {key: getattr(self, key) for key in ("time", "torque", "speed", "azimuth")}
        listed = {f"force.{k}": text for k, text in enumerate(self.force)}
        listed |= {f"moment.{k}": text for k, text in enumerate(self.moment)}
        for key, text in (single | listed).items():
            needed = key in ("time", "torque", "speed")
            if (text or needed) and channel_of(text) is None:
                problem = f"{echo(text)} names no channel"
                raise Refusal(key, problem, 'write "RotTorq", or "RotTorq [kN m]"')
        if any(self.force) and self.force_step is None:
            raise Missing("force_step", remedy="add force_step_kn, the width of the bins of force")
        hours = sum(case.hours_per_year or 0.0 for case in self.design_load_cases)
        if hours > YEAR:
            problem = f"last {hours:g} h a year together, and a year has {YEAR:g}"
            raise Refusal("design_load_cases", problem, "correct their hours_per_year")
        names = [case.name for case in self.design_load_cases]
        for k, name in enumerate(names):
            if name in names[:k]:
                problem = f"{echo(name)} occurs twice"
                raise Refusal(f"design_load_cases.{k}.name", problem, "give each a unique name")

    @property
    def channels(self) -> dict[str, tuple[Channel, str]]:
        """Channels that are given, with their dimensions, by quantity: time, torque, speed,
        azimuth, force_x … moment_y."""
        texts = {
            "time": (self.time, "time"),
            "torque": (self.torque, "torque"),
            "speed": (self.speed, "speed"),
            "azimuth": (self.azimuth, "angle"),
        }
        texts |= {f"force_{a}": (t, "force") for a, t in zip("xyz", self.force, strict=True)}
        texts |= {f"moment_{a}": (t, "torque") for a, t in zip("xy", self.moment, strict=True)}
        parsed = {name: (channel_of(text), dimension) for name, (text, dimension) in texts.items()}
        return {name: (c, dimension) for name, (c, dimension) in parsed.items() if c is not None}

    @property
    def hours(self) -> float:
        """Hours of all design load cases in the life."""
        return self.years * sum(case.hours_per_year or 0.0 for case in self.design_load_cases)


SUM_OF_HOURS = 1e-3  # relative tolerance of total hours, since tables are printed with 4 digits
_PLAIN = ("name", "hours", "cycles", "extreme", "back_driven")  # titles without a unit
FACTORS = tuple(ForcedFactors.model_fields)  # likewise, after the name of a stage, too
SHARE = "share"  # title of hours as shares of the total
AXES = ("x", "y", "z")
_OF_STATE = {"speed": "speed", "torque": "torque", "power": "power", **LOAD_COLUMNS}
FLAGS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False, "": False}


class MemberState(Section):
    """State of one member in a load case. Speeds and torques of ports that are left out follow the
    first given one in rated proportion; a load that is left out is taken from ``loads``.

    speed: of a port. torque: on the member of a port from outside, positive about +z. power: into
    the train at a port, which gives the torque power / speed. force, moment: along x, y, z on any
    member; the moment about the axis of a port is its torque. frame: axes of force and moment.
    """

    speed: Speed | None = Field(default=None, ge=-1e4, le=1e4)
    torque: Torque | None = Field(default=None, ge=-1e9, le=1e9)
    power: Power | None = Field(default=None, ge=-1e9, le=1e9)
    force: Forces | None = None
    moment: Moments | None = None
    frame: Literal["fixed", "carrier"] = "fixed"

    def _check(self) -> None:
        self._keep_one("power", "torque")


class OtherMember(MemberState):
    """State of a port other than the first input, or of any member with a load.

    member: name of the member.
    """

    member: Member


class LoadCase(MemberState, ForcedFactors):
    """A steady state with its duration, or an extreme one without. Its keys speed to frame are
    those of the first input; its load factors replace those of ``rating``.

    name: unique, shown in tables. hours: in the whole life. cycles: revolutions of the first input,
    in place of hours. extreme: whether the load is static and has no duration. back_driven: whether
    power intentionally flows against its rated direction, as when a motor brakes. members: other
    ports, and loads on other members. gear_meshes: load factors of some of them. source, line: file
    and line from which it was read.
    """

    name: str = ""
    hours: float | None = Field(default=None, ge=0.0, le=1e7)
    cycles: float | None = Field(default=None, ge=0.0, le=1e15)
    extreme: bool = False
    back_driven: bool = False
    members: tuple[OtherMember, ...] = ()
    gear_meshes: tuple[GearMeshFactors, ...] = ()
    source: str = ""
    line: int = 0

    def _check(self) -> None:
        if self.extreme:
            problem = "is given for an extreme load, which is static"
            self._refuse_set(["hours", "cycles"], problem, "keep one of them")
        elif self.cycles is None:
            remedy = "add hours or cycles, or extreme = true"
            self._require_set(["hours"], "is missing", remedy)
        self._keep_one("cycles", "hours")

    def states(self, first: str) -> Iterator[tuple[str, str, MemberState]]:
        """Prefix of the keys, member and state of each member; ``first``: member of the first
        input."""
        yield "", first, self
        for k, other in enumerate(self.members):
            yield f"members[{k}].", other.member, other


class Spectrum(Section):
    """Load cases of a table, in addition to those of ``load_cases``.

    file: CSV with a row for each load case under titles that are keys of ``load_cases``: name,
    hours or cycles, extreme and back_driven (1 or 0), speed_rpm, torque_knm or power_mw, force_x_kn
    … moment_z_knm, frame, k_gamma … k_f_alpha; for other members with their name in front:
    stage.sun.torque_nm, for some gear meshes those of stage, kind or both: stage_1.ring.k_h_beta;
    in place of hours also share, of total_hours. total_hours: sum of the hours of all load cases,
    for a check.
    """

    file: str | None = None
    total_hours: float | None = Field(default=None, gt=0.0, le=1e7)


def check_load_cases(case: Case) -> None:
    """Check names, members and total hours of the load cases of a case; raises Refusal."""
    for key in ("load_cases", "load_series"):
        if getattr(case, key) and (case.output is None or not case.inputs):
            raise Refusal(key, "is given for a case without inputs and output", "add them")
    names: dict[str, int] = {}
    for k, load_case in enumerate(case.load_cases):
        if load_case.name and load_case.name in names:
            problem = f"{echo(load_case.name)} is also the name of number {names[load_case.name]}"
            raise Refusal(f"load_cases.{k}.name", problem, "give each a unique name")
        names[load_case.name] = k + 1
        _check_members(case, k, load_case)
    total = case.spectrum.total_hours
    hours = [c.hours for c in case.load_cases if c.hours is not None]
    hours += [case.load_series.hours] if case.load_series else []
    timed = all(c.cycles is None for c in case.load_cases)
    if total is not None and hours and timed and abs(sum(hours) / total - 1.0) > SUM_OF_HOURS:
        problem = f"is {total:g}, but the hours of all load cases add up to {sum(hours):g}"
        raise Refusal("spectrum.total_hours", problem, "correct the hours or the total")


def _check_members(case: Case, k: int, load_case: LoadCase) -> None:
    ports = [port.member for port in case.ports]
    seen: list[str] = []
    for place, member, state in load_case.states(case.inputs[0].member):
        key = f"load_cases.{k}.{place.replace('[', '.').replace(']', '')}"
        if member not in case.member_names():
            problem = f"{echo(member)} is not a member"
            raise Refusal(f"{key}member", problem, nearest(member, case.member_names()))
        if member in seen:
            problem = f"{member} has values already"
            raise Refusal(f"{key}member", problem, "give them in one place")
        seen.append(member)
        stated = [q for q in ("speed", "torque", "power") if getattr(state, q) is not None]
        if stated and member not in ports:
            problem = f"is given for {member}, which is neither input nor output"
            raise Refusal(f"{key}{stated[0]}", problem, f"name one of {', '.join(ports)}")
        if member in ports and state.moment is not None and state.moment[2] != 0.0:
            problem = f"has a component about the axis of {member}, which is the torque of a port"
            raise Refusal(f"{key}moment", problem, "give it as torque, and 0 here")


def take_spectrum(data: dict[str, Any], written: Written) -> None:
    """Append the rows of the spectrum's table to the load cases in SI data of a case."""
    spectrum = data.get("spectrum")
    if not isinstance(spectrum, dict) or not isinstance(spectrum.get("file"), str):
        return
    cases = list(data.get("load_cases") or ())
    total = spectrum.get("total_hours")
    for row in read_load_cases(Path(spectrum["file"]), len(cases), written, total):
        cases.append(row)
    data["load_cases"] = tuple(cases)


def read_load_cases(
    path: Path, before: int, written: Written, total: float | None = None
) -> Iterator[dict[str, Any]]:
    """SI data of a load case for each row of a CSV file. before: number of load cases before the
    first row; total: total hours, for shares."""
    where = str(path)
    header, rows, separator = read_cells(path, "load spectrum")
    columns = [_column(title, where) for title in header]
    if not header:
        raise InputError(where, "load spectrum", "is empty", f"head it {', '.join(_titles()[:6])}")
    for k, (title, column) in enumerate(zip(header, columns, strict=True)):
        same = [header[j] for j in range(k) if columns[j][:3] == column[:3] and column[1]]
        require_one([*same, title], where)
    number = 0
    for number, cells in rows:
        require_titles(cells, header, where, number)
        if len(cells) < len(header):
            problem = f"has {len(cells)} cells under {len(header)} titles"
            remedy = "is the file complete? Cells between separators may be empty"
            raise InputError(where, f"line {number}", problem, remedy)
        row: dict[str, Any] = {"source": where, "line": number}
        at = f"load_cases.{before}"
        for name in LoadCase.model_fields:
            written[f"{at}.{name}"] = (where, f"line {number}, {name}", "", None)
        for title, (member, name, axis, suffix), cell in zip(header, columns, cells, strict=False):
            text, key = cell.strip(), (where, f"line {number}, {title}")
            if name == "frame" and text:
                _state(row, member, name, at)[0][name] = text
            elif name in ("", "name", "frame"):
                row |= {name: text} if name == "name" and text else {}
            elif name in ("extreme", "back_driven"):
                if text.lower() not in FLAGS:
                    raise InputError(*key, f"{echo(text)} is neither 1 nor 0", "give 1 or 0")
                row[name] = FLAGS[text.lower()]
            elif text:
                state, place = _state(row, member, name, at)
                for word in ("member", "stage", "kind"):
                    written[f"{place}.{word}"] = (*key, "", member)
                value = number_in(text, separator, *key)
                quantity = quantity_of(LoadCase, name)
                value = quantity.to_si(value, suffix) if quantity else value
                if suffix == SHARE:
                    if not isinstance(total, float | int):
                        raise InputError(*key, "needs a total", "give spectrum.total_hours")
                    if value > 1.0:
                        remedy = "give fractions of total_hours, not per cent"
                        raise InputError(*key, f"{value:g} is above 1", remedy)
                    value *= total
                if axis:
                    vector = list(state.get(name, (0.0, 0.0, 0.0)))
                    vector[AXES.index(axis)] = value
                    state[name] = tuple(vector)
                else:
                    state[name] = value
                written[f"{place}.{name}"] = (*key, suffix, value)
        for listed in ("members", "gear_meshes"):
            row[listed] = tuple(row.get(listed, {}).values())
        before += 1
        yield row
    if not number:
        raise InputError(where, "load spectrum", "has titles, but no load case", "add rows")


def _state(row: dict[str, Any], place: str, key: str, at: str) -> tuple[dict[str, Any], str]:
    """Data of a row to which a key belongs, and the path to them: of the first input and all gear
    meshes ("" as ``place``), or of the member or the stage and kind of gear meshes ``place``."""
    if not place:
        return row, at
    listed, begin = "members", {"member": place}
    if key in FACTORS:
        names = ("kind",) if place in ("sun", "ring") else ("stage", "kind")
        listed, begin = "gear_meshes", dict(zip(names, place.split(".", 1), strict=False))
    states: dict[str, Any] = row.setdefault(listed, {})
    return states.setdefault(place, begin), f"{at}.{listed}.{list(states).index(place)}"


def _column(title: str, where: str) -> tuple[str, str, str, str]:
    """A column title taken apart: what it is about, key, axis and unit; all "" for a title that
    begins with #. It is about a member, "" for the first input, or, if the key is a load factor,
    about gear meshes by stage and kind, "" for all."""
    if title.startswith("#"):
        return "", "", "", ""
    member, _, key = title.rpartition(".")
    key = key.lower()
    if key in ("frame", *FACTORS) or (not member and key in _PLAIN):
        return member, key, "", ""
    if not member and key == SHARE:
        return "", "hours", "", SHARE
    if named := quantity_in(key, _OF_STATE):
        name, _, axis = named[0].partition("_")
        return member, name, axis, named[1]
    keys = [k for k in _titles() if not member or k not in _PLAIN]
    remedy = f"{nearest(key, keys)}; titles that begin with # are ignored"
    raise InputError(where, f"column {echo(title)}", "is not known", remedy)


def title_of(load_case: LoadCase, key: str) -> str:
    """The title of the column of a key, "stage.sun.torque" -> "stage.sun.torque_nm", in the table
    of a load case; the key itself where it has no column, or several."""
    path = Path(load_case.source)
    header = read_cells(path, "load spectrum")[0] if path.is_file() else []
    titles = [title for title in header if title.lower().startswith(f"{key}_".lower())]
    return titles[0] if len(titles) == 1 else key


def _titles() -> list[str]:
    """Usual titles of the table."""
    usual = {"force": "kn", "torque": "knm"}  # of vectors
    of_state = [k for k in accepted_keys(MemberState) if not k.startswith(("force", "moment"))]
    of_loads = [f"{n}_{usual[d]}" for n, d in LOAD_COLUMNS.items()]
    return [*_PLAIN, SHARE, *of_state, *of_loads, *FACTORS]
