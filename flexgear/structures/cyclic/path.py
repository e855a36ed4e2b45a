"""Whether a body is reduced by its sectors, and why not."""

from __future__ import annotations

from collections.abc import Sequence

from flexgear.structures.cyclic.condensation import CyclicCondensation, cyclic_parts
from flexgear.structures.cyclic.sectors import LEAST, find_sectors
from flexgear.structures.fem import FeModel, Interface


def sector_counts(repeats: int) -> tuple[int, ...]:
    """Numbers of sectors a body with so many teeth or pins may have, most first."""
    return tuple(z for z in range(repeats, LEAST - 1, -1) if repeats % z == 0)


def condense_by_sectors(
    model: FeModel, interface: Interface, counts: Sequence[int]
) -> tuple[CyclicCondensation | None, str]:
    """The condensation by sectors, or None; and which path that is, in words."""
    if not counts:
        return None, "general: sectors not asked for"
    if interface.expansion is not None:
        return None, "general: rigid ties"
    for count in counts:
        sectors = find_sectors(model, (count,))
        if sectors is None:
            continue
        parts = cyclic_parts(model, interface, sectors)
        if parts is None:
            return None, "general: no tie that every sector has lies within its sector"
        return parts, parts.path
    return None, "general: the FE mesh does not repeat by sectors"
