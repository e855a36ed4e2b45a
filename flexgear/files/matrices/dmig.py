"""Nastran DMIG bulk data: real matrices by grid point and component.

DMIG NAME 0 IFO TIN …, then columns DMIG NAME GJ CJ _ G1 C1 A1 _ G2 C2 A2 …; IFO 6 is symmetric,
given as one triangle. Fields of 8 letters, of 16 (DMIG*), or separated by commas; component 0 is a
scalar point, a modal coordinate. Source: MSC Nastran quick reference guide.
"""

from __future__ import annotations

import re

from flexgear.files.matrices.entries import Entries
from flexgear.model.errors import InputError

_SYMMETRIC = 6


def read_dmig(text: str, where: str) -> dict[str, Entries]:
    """All real DMIG matrices of bulk data, by name."""
    matrices: dict[str, Entries] = {}
    try:
        for card in _cards(text):
            name, first = card[1].upper(), card[2].strip()
            if first in ("", "0"):
                if int(card[4] or 1) > 2:
                    raise ValueError(f"{name} is complex")
                matrices[name] = Entries(symmetric=int(card[3]) == _SYMMETRIC)
                continue
            column = int(first), int(card[3] or 0)
            for k in range(5, len(card) - 2, 4):
                if card[k].strip():
                    row = int(card[k]), int(card[k + 1] or 0)
                    matrices[name].add(row, column, _number(card[k + 2]))
    except (IndexError, KeyError, ValueError) as error:
        raise InputError(
            where, "DMIG", f"cannot be read: {error}", "write real DMIG cards with their header"
        ) from None
    return matrices


def _cards(text: str) -> list[list[str]]:
    """DMIG cards with their continuation lines, as fields; field 0 is the card's name."""
    cards: list[list[str]] = []
    inside = False
    for raw in text.splitlines():
        line = raw.split("$")[0].rstrip()
        if not line:
            continue
        if re.match(r"DMIG\b", line, re.IGNORECASE):
            cards.append(_fields(line))
            inside = True
        elif inside and line[0] in "*+ ,":
            cards[-1] += _fields(line)[1:]
        else:
            inside = False
    return cards


def _fields(line: str) -> list[str]:
    """Ten fields, without the last, which names the continuation."""
    if "," in line:
        return [f.strip() for f in (line.split(",") + [""] * 9)[:9]]
    wide = "*" in line[:8]
    step, count = (16, 4) if wide else (8, 8)
    body = line[8:].ljust(step * count)
    return [line[:8].strip(), *(body[k * step : (k + 1) * step].strip() for k in range(count))]


def _number(text: str) -> float:
    """Nastran writes 1.2-5 and 1.2D-5 for 1.2e-5."""
    plain = text.strip().upper().replace("D", "E")
    return float(re.sub(r"(?<=[0-9.])([+-])", r"E\1", plain) if "E" not in plain else plain)
