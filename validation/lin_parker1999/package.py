"""Modes of the bundled case `lin-parker` by the package, sorted by type."""

from collections import Counter
from dataclasses import dataclass
from functools import cache

import numpy as np

from flexgear.analysis.modes import classify, modes, springs_at
from flexgear.arrays import Array
from flexgear.coupling.build import build_system
from flexgear.model.load import load_case
from lin_parker1999 import equations

KINDS = ("rotational", "translational", "planet")


@dataclass(frozen=True)
class SortedModes:
    """Frequencies (Hz, ascending) and the type of each mode; the rigid one is rotational."""

    frequencies: Array
    kinds: tuple[str, ...]

    def different(self, kind: str) -> list[float]:
        """Frequencies of a type, repeated ones once."""
        out: list[float] = []
        for f, k in zip(self.frequencies, self.kinds, strict=True):
            if k == kind and not (out and np.isclose(f, out[-1], rtol=1e-6, atol=1e-3)):
                out.append(float(f))
        return out

    def multiplicities(self, kind: str) -> list[int]:
        """How often each frequency of a type occurs."""
        every = [f for f, k in zip(self.frequencies, self.kinds, strict=True) if k == kind]
        return [
            sum(np.isclose(f, one, rtol=1e-6, atol=1e-3) for f in every)
            for one in self.different(kind)
        ]

    def counts(self) -> dict[str, int]:
        """Modes by type."""
        return dict(Counter(self.kinds))


@cache
def by_package(planets: int) -> SortedModes:
    """All modes of the bundled case with that many planets, types by energy."""
    train = load_case("lin-parker", {"stage.planets": str(planets)})
    system = build_system(train)
    natural = modes(system, springs_at(system).stiffness)
    types = classify(natural.frequencies, natural.shapes, system.mass, system.bodies, rigid=1)
    kinds = tuple("rotational" if k == "rigid" else k for k in types.kinds)
    return SortedModes(natural.frequencies, kinds)


@cache
def by_equations(planets: int) -> SortedModes:
    """All modes of the paper's equations."""
    p = equations.Parameters()
    frequencies, shapes = equations.modes(planets, p)
    return SortedModes(frequencies, tuple(equations.mode_types(planets, p, shapes)))
