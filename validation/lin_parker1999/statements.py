"""Printed frequencies, types and multiplicities against the package and the plain equations."""

import numpy as np
from rows import INDEPENDENT, Row, compared, gathered, number, reference

from lin_parker1999.package import KINDS, SortedModes, by_equations, by_package

PAPER = "lin_parker1999"
PRINTED = (3, 4)
NUMBERS = (3, 4, 5, 6, 7, 8)
TIGHT = 1e-6  # package against plain equations, relative


def rows() -> list[Row]:
    """All rows of this paper."""
    return gathered(PAPER, printed_frequencies, types_and_multiplicities, package_and_equations,
                    planet_modes)  # fmt: skip


def frequency(modes: SortedModes, quantity: str) -> float:
    """Of reference.csv's "N = 3, rotational 2"."""
    _, _, kind, place = quantity.replace(",", "").split()[-4:]
    return modes.different(kind)[int(place) - 1]


def printed_frequencies() -> list[Row]:
    """Every printed frequency."""
    out = []
    for quantity, line in reference(PAPER).items():
        planets = int(quantity.removeprefix("N = ").partition(",")[0])
        plain = frequency(by_equations(planets), quantity)
        why = f"the paper's equations give {number(plain)} Hz"
        out.append(compared(PAPER, line, frequency(by_package(planets), quantity), why=why))
    return out


def types_and_multiplicities() -> list[Row]:
    """Six single rotational modes, six translational pairs, three planet modes N − 3 times."""
    out = []
    for planets in NUMBERS:
        modes = by_package(planets)
        expected = {"rotational": [1] * 6, "translational": [2] * 6}
        expected["planet"] = [planets - 3] * 3 if planets > 3 else []
        got = {kind: modes.multiplicities(kind) for kind in KINDS}
        out.append(
            Row(
                PAPER,
                "sections on mode types",
                f"N = {planets}: modes by type and multiplicity",
                "6 rotational × 1, 6 translational × 2, 3 planet × (N − 3)",
                ", ".join(f"{kind}: {text(m)}" for kind, m in got.items()),
                "exact",
                got == expected and sum(modes.counts().values()) == 9 + 3 * planets,
                "types by kinetic energy, not by gaps between frequencies",
            )
        )
    return out


def text(multiplicities: list[int]) -> str:
    """[2, 2, 2] -> "3 × 2"."""
    kinds = sorted(set(multiplicities))
    return " and ".join(f"{multiplicities.count(m)} × {m}" for m in kinds) or "none"


def package_and_equations() -> list[Row]:
    """Every frequency of the package against the plain equations."""
    out = []
    for planets in NUMBERS:
        ours, plain = by_package(planets).frequencies, by_equations(planets).frequencies
        off = float(np.abs(ours[1:] / plain[1:] - 1).max())
        out.append(
            Row(
                PAPER,
                "equations of motion",
                f"N = {planets}: all {len(ours)} frequencies, package against plain matrices",
                "the paper's equations, assembled without the package",
                f"largest relative difference {off:.1e}; rigid mode {ours[0]:.1e} Hz",
                f"{TIGHT:g}",
                off < TIGHT and ours[0] < 0.1,
                "two formulations of the same physics differ by rounding only",
                INDEPENDENT,
            )
        )
    return out


def planet_modes() -> list[Row]:
    """Planet modes do not depend on the number of planets."""
    four = np.array(by_package(4).different("planet"))
    off = max(
        float(np.abs(np.array(by_package(n).different("planet")) / four - 1).max())
        for n in NUMBERS[2:]
    )
    row = Row(
        PAPER,
        "planet modes",
        "their frequencies for N = 4 … 8",
        "the same for any number of planets",
        f"largest relative difference {off:.1e}",
        f"{TIGHT:g}",
        off < TIGHT,
        "central members are at rest, so each planet vibrates on its own springs",
    )
    return [row]
