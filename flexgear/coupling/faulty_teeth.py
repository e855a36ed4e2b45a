"""Teeth of a kind of gear mesh whose pairs have tables of their own, and how these are numbered.

With A groups of faulty teeth of the gear and B of planets' teeth, each group one fault or one set
of them, the tables of the kind lie side by side from its first one on: of sound teeth, of the
gear's groups 1 … A, and the same again for every group of planets' teeth. A pair takes the table

    first + a + (1 + A) b ,   a, b: groups of its teeth, 0 of sound ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Ints
from flexgear.gears.contact import GearMeshPath


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
