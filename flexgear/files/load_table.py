"""Load bins as a table that ``[spectrum]`` reads."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from flexgear.gears.load_bins import LoadBin
from flexgear.model.load_cases import AXES
from flexgear.model.units import Quantity

RPM = Quantity("speed")
LOADS = (*(f"force_{axis}_n" for axis in AXES), *(f"moment_{axis}_nm" for axis in AXES))


def table_of_bins(bins: Sequence[LoadBin], ports: Sequence[str]) -> str:
    """CSV text with a row for each bin; ports: members of inputs and output.

    Speed and torque are those of the first input, and of the others where there are more than two
    ports. Constant loads stand under their members; those over time stay in the case.
    """
    others = ports[1:] if len(ports) > 2 else ()
    loads = [
        {load.member: load for load in load_bin.loads if not load.is_history} for load_bin in bins
    ]
    loaded = list(dict.fromkeys(member for by_member in loads for member in by_member))
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    head = ["name", "hours", "extreme", "back_driven", "speed_rpm", "torque_nm"]
    head += [f"{port}.{key}" for port in others for key in ("speed_rpm", "torque_nm")]
    for member in loaded:
        before = "" if member == ports[0] else f"{member}."
        head += [f"{before}{key}" for key in _keys(member, ports)] + [f"{before}frame"]
    rows.writerow(head)
    for load_bin, by_member in zip(bins, loads, strict=True):
        row = [load_bin.name, "" if load_bin.extreme else _text(load_bin.hours)]
        row += [str(int(load_bin.extreme)), str(int(load_bin.back_driven))]
        for port in (ports[0], *others):
            row += [_text(RPM.from_si(load_bin.speed[port], "rpm")), _text(load_bin.torque[port])]
        for member in loaded:
            keys = _keys(member, ports)
            load = by_member.get(member)
            row += ["0"] * len(keys) if load is None else [
                _text(load.first[LOADS.index(key)]) for key in keys
            ]  # fmt: skip
            row.append("fixed" if load is None else load.frame)
        rows.writerow(row)
    return text.getvalue()


def _keys(member: str, ports: Sequence[str]) -> list[str]:
    """Components of a load on a member; about the axis of a port there is its torque alone."""
    return [key for key in LOADS if key != "moment_z_nm" or member not in ports]


def _text(value: float) -> str:
    return f"{value:.15g}"
