"""Studies behind the statements, as tables of the page: title, head, rows of text."""

from __future__ import annotations

from dataclasses import dataclass

from tan2023.drive_statements import drop_spread, steady_sharing
from tan2023.load_statements import compliance_study
from tan2023.motion_statements import sensitivity
from tan2023.runs import EIGHT, Runs, label


@dataclass(frozen=True)
class Table:
    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]


def tables(runs: Runs) -> list[Table]:
    """Which compliance causes how much; load sharing of eight variants; rim and bolts."""
    study = compliance_study(runs)
    cause = Table(
        "Tooth load against the stiffness split, planet 1, statics without errors: which "
        "compliance causes how much",
        ("variant", "ring: peak", "ring: before (+) by", "sun: peak", "sun: before (+) by"),
        [
            (
                name,
                f"{100 * (p['ring'].ratio - 1):+.1f} %",
                f"{100 * p['ring'].lead:+.1f} % of the contact",
                f"{100 * (p['sun'].ratio - 1):+.1f} %",
                f"{100 * p['sun'].lead:+.1f} % of the contact",
            )
            for name, p in study.items()
        ],
    )
    steady, spread = steady_sharing(runs), drop_spread(runs)
    sharing = Table(
        "Load sharing by flexible components: K steady (mean, largest) and the largest spread "
        "(max − min)/rated mean in a drop to 4e5 N·m (errors of the case)",
        ("flexible", *(f"K, {name}" for name in steady), "spread in the drop"),
        [
            (
                label(v) if label(v) != "rigid" else "none (all rigid)",
                *(f"{k[label(v)][0]:.4f}, {k[label(v)][1]:.4f}" for k in steady.values()),
                f"{spread[label(v)]:.4f}",
            )
            for v in EIGHT
        ],
    )
    rim = Table(
        "Peaks of tooth node 1 in µm by rim and bolts (statics without errors, quick FE mesh)",
        ("change", "x", "y", "z"),
        [(name, *(f"{u:.1f}" for u in v)) for name, v in sensitivity(runs).items()],
    )
    return [cause, sharing, rim]
