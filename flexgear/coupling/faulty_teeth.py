"""Teeth of a kind of gear mesh whose pairs have tables of their own, and how these are numbered.

With A groups of faulty teeth of the gear and B of planets' teeth, each group one fault or one set
of them, the tables of the kind lie side by side from its first one on: of sound teeth, of the
gear's groups 1 … A, and the same again for every group of planets' teeth. A pair takes the table

    first + a + (1 + A) b ,   a, b: groups of its teeth, 0 of sound ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.slices import Slices
from flexgear.gears.tooth_faults import fault_groups, with_faults
from flexgear.model.faults import Fault
from flexgear.model.stage_view import StageView

Bent = Callable[[GearMeshPath, Array | None], GearMeshPath]  # slices bend each other, and ΔC


@dataclass(frozen=True)
class FaultyTeeth:
    """Groups of teeth with a path of their own, of one kind of gear mesh.

    gear: (A,) groups of tooth numbers of the gear; planets: (B,) groups of (planet, tooth number);
    all from 0. paths: (1 + B) (1 + A), in the order of the tables; the first is that of sound
    teeth.
    """

    paths: tuple[GearMeshPath, ...]
    gear: tuple[tuple[int, ...], ...] = ()
    planets: tuple[tuple[tuple[int, int], ...], ...] = ()

    def gear_table(self, teeth: int) -> Ints:
        """What each tooth of the gear adds to the number of the table (teeth,)."""
        out = np.zeros(teeth, dtype=np.int64)
        for a, group in enumerate(self.gear, 1):
            out[list(group)] = a
        return out

    def planet_table(self, planet: int, teeth: int) -> Ints:
        """What each tooth of a planet adds to it (teeth,)."""
        out = np.zeros(teeth, dtype=np.int64)
        for b, group in enumerate(self.planets, 1):
            out[[tooth for of, tooth in group if of == planet]] = b * (1 + len(self.gear))
        return out


def _softness(
    view: StageView, cracked: Sequence[Fault], path: GearMeshPath, lines: Slices
) -> Array:
    """ΔC (S, K, K) m/N of cracked teeth together."""
    # half of the package, for cases that have cracks
    from flexgear.structures.tooth_influence.of_case import crack_flexibility

    return np.sum([crack_flexibility(view, path, lines, fault) for fault in cracked], axis=0)


def faulty_teeth(
    view: StageView, path: GearMeshPath, force: float, bend: Bent | None, cracks: bool
) -> FaultyTeeth | None:
    """Those of a stage's gear meshes of one kind; None where all teeth are sound.

    path: of sound teeth, as slices are before they bend each other; force: of the gear mesh, N;
    bend: makes them so with ΔC (S, K, K) m/N of cracks besides, None where they are springs beside
    each other; cracks: whether what they yield is computed (half a minute each, kept).
    """
    groups = fault_groups(view, path)
    if not groups.gear and not groups.planets:
        return None
    paths = []
    for of_planet in ((), *groups.planets):
        for of_gear in ((), *groups.gear):
            faults = (*of_gear, *of_planet)
            cracked = [f for _, f in faults if f.kind == "root_crack" and cracks]
            softness = partial(_softness, view, cracked) if cracked else None
            if bend is None:
                paths.append(with_faults(view, path, force, faults, softness))
                continue
            assert path.slices is not None
            more = softness(path, path.slices) if softness else None
            paths.append(bend(with_faults(view, path, force, faults, None), more))
    return FaultyTeeth(tuple(paths), tuple(groups.gear.values()), tuple(groups.planets.values()))
