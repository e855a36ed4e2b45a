"""Series of loads: files of design load cases, their channels, and bins to sort them into."""

from __future__ import annotations

import re
from glob import glob
from pathlib import Path
from typing import Literal, NamedTuple

from pydantic import Field, model_validator

from flexgear.model.errors import InputError, echo
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Force, Speed, Time, Torque

_CHANNEL = re.compile(r"(-?)\s*([^\[\]()]+?)\s*(?:[\[(]([^\[\]()]*)[\])])?")


class Channel(NamedTuple):
    """A channel of a file. sign: that its values are taken by; unit: "" for the file's."""

    sign: float
    name: str
    unit: str


def channel_of(text: str) -> Channel | None:
    """The channel that "NAME", "-NAME" or "NAME [unit]" names; None where it is none of these."""
    match = _CHANNEL.fullmatch(text.strip())
    return Channel(-1.0 if match[1] else 1.0, match[2], match[3] or "") if match else None


class DesignLoadCase(Section):
    """Files that share some hours of each year.

    name: of the design load case. files: a file, or a pattern such as "dlc12/*.outb", from the
    case's folder. hours_per_year: shared by the files in proportion to their durations. extreme:
    whether only its extreme loads count, without duration.
    """

    name: str
    files: str
    hours_per_year: float | None = Field(default=None, ge=0.0, le=8784.0)
    extreme: bool = False

    @model_validator(mode="after")
    def _duration(self) -> DesignLoadCase:
        if not self.extreme and self.hours_per_year is None:
            raise Missing("hours_per_year", remedy="add hours_per_year, or extreme = true")
        if self.extreme and self.hours_per_year is not None:
            raise Refusal("hours_per_year", "is given beside extreme", "keep one of them")
        return self

    def paths(self, where: str) -> list[Path]:
        """The files, in the order of their names; InputError where there is none."""
        paths = sorted(Path(name) for name in glob(self.files, recursive=True))
        if not paths:
            problem = f"'{self.files}' names no file"
            raise InputError(where, "load_series.design_load_cases", problem, "check the path")
        return paths


class LoadSeries(Section):
    """Series of OpenFAST (.out, .outb), CSV or netCDF files, sorted into bins of torque, speed and
    loads on the first input.

    A channel is "NAME", "-NAME" for its opposite, or "NAME [unit]" where the file gives no unit.

    years: of the life. design_load_cases: files and their hours. time, torque, speed: channels;
    torque acts on the first input from outside, both positive about +z. force, moment: channels of
    the loads on the first input along x, y, z, of a moment x, y; "" for none. azimuth: channel of
    the angle by which the axes of force and moment have turned about z, where these are the
    rotor's; a load is binned in fixed axes. start: time that is left out at the beginning of each
    file. torque_step, speed_step, force_step, moment_step: widths of the bins, whose edges are
    whole multiples; left out, a twentieth of rated torque, a quarter of rated speed, for moments
    half of rated torque.

    damage  the torque that does the damage of all samples of the bin by n |T|^exponent
    edge    the upper edge of torque and loads, on the safe side

    value: torque and loads of a bin. exponent: 6.6 is that of flanks of case-hardened gears.
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

    @model_validator(mode="after")
    def _channels(self) -> LoadSeries:
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
        names = [case.name for case in self.design_load_cases]
        for k, name in enumerate(names):
            if name in names[:k]:
                problem = f"{echo(name)} is there twice"
                raise Refusal(f"design_load_cases.{k}.name", problem, "give each its own name")
        return self

    @property
    def channels(self) -> dict[str, tuple[Channel, str]]:
        """Channels and their dimensions by what they are of: time, torque, speed, azimuth, force_x
        … moment_y; those that are named."""
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
