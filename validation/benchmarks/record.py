"""What a run of the benchmarks found: ratios, curves, skipped peers."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median

from benchmarks.timing import Seconds


def plain(ratio: float) -> str:
    """Three digits without a power of ten: 4800 -> "4 800"."""
    return f"{float(f'{ratio:.3g}'):,g}".replace(",", "\u2009")


@dataclass(frozen=True)
class Comparison:
    """How much longer a peer takes: one ratio a repetition, peer over flexgear.

    own, peer: of one `unit` of work; check: how far answers are apart. What runs on one thread is
    compared by processor time, the rest by wall time.
    """

    group: str
    peer_name: str
    size: str
    own: Seconds
    peer: Seconds
    threads: int
    unit: str = "run"
    check: str = ""

    @property
    def clock(self) -> str:
        """ "work" or "wall": which time is compared."""
        return "work" if self.threads == 1 else "wall"

    @property
    def ratios(self) -> list[float]:
        """Peer over flexgear, repetition by repetition."""
        return self._ratios(self.clock)

    @property
    def work_ratio(self) -> float:
        """Median ratio of processor times."""
        return median(self._ratios("work"))

    @property
    def times(self) -> tuple[float, float]:
        """Medians, s: flexgear, peer."""
        return median(getattr(self.own, self.clock)), median(getattr(self.peer, self.clock))

    @property
    def ratio(self) -> float:
        """Median ratio."""
        return median(self.ratios)

    def _ratios(self, clock: str) -> list[float]:
        ours, peer = getattr(self.own, clock), getattr(self.peer, clock)
        return [p / o for p, o in zip(peer, ours, strict=True)]


@dataclass(frozen=True)
class Curve:
    """Medians of time over a size, for a picture."""

    picture: str
    label: str
    x_label: str
    y_label: str
    x: list[float]
    y: list[float]


@dataclass
class Report:
    """Everything a run has to say."""

    comparisons: list[Comparison] = field(default_factory=list)
    curves: list[Curve] = field(default_factory=list)
    figures: dict[str, str] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)
    machine: dict[str, str] = field(default_factory=dict)
    done: list[str] = field(default_factory=list)

    def add(self, comparison: Comparison) -> None:
        """Keep a comparison and show it."""
        self.comparisons.append(comparison)
        c = comparison
        print(
            f"  {c.size}, {c.peer_name}: {c.ratio:.3g} "
            f"({min(c.ratios):.3g} to {max(c.ratios):.3g}), processor time {c.work_ratio:.3g}; "
            f"{c.times[0]:.3g} s against {c.times[1]:.3g} s a {c.unit}; {c.check}",
            flush=True,
        )

    def say(self, what: str, value: str) -> None:
        """Keep a figure that is no comparison with a peer."""
        self.figures[what] = value
        print(f"  {what}: {value}", flush=True)

    def skip(self, peer: str, why: str) -> None:
        """Name a peer that is left out."""
        self.skipped[peer] = why
        print(f"  {peer} skipped: {why}", flush=True)

    def save(self, path: Path) -> None:
        """Write as JSON."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(self), indent=1))

    @classmethod
    def load(cls, path: Path) -> Report:
        """Read back what `save` wrote."""
        data = json.loads(path.read_text())
        comparisons = [
            Comparison(**{**c, "own": Seconds(**c["own"]), "peer": Seconds(**c["peer"])})
            for c in data["comparisons"]
        ]
        return cls(
            comparisons,
            [Curve(**c) for c in data["curves"]],
            data["figures"],
            data["skipped"],
            data["machine"],
            data["done"],
        )
