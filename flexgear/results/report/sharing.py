"""The load sharing factor K = N max F/ΣF of a run, largest over time.

It is computed from equilibria, with errors and deflections, and from transients, in which vibration
adds to the planets' forces. The standard's value (IEC 61400-4) is for equilibria.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flexgear.model.names import GroupName
from flexgear.results.report.wording import factor, window_words

_DIFFERENCE = 0.01  # between factors in equilibria and in time that needs an explanation
DEFINITION = (
    "K is the largest load of a planet over the mean of all, at the worst instant: in equilibria "
    "from errors and deflections alone, in time with the vibration of the gear meshes."
)


@dataclass(frozen=True)
class Sharing:
    """Largest K of a stage over its gear meshes, None if not computed.

    assumed: value of IEC 61400-4 for the number of planets; window: description of the time window;
    halves: largest K of each half of a double-helical stage, by side.
    """

    stage: str
    in_equilibria: float | None
    in_time: float | None
    assumed: float | None
    window: str
    halves: tuple[tuple[str, float], ...] = ()

    @property
    def figure(self) -> str:
        """Text such as "1.0009 in equilibria, 1.563 in time"."""
        factors = ((self.in_equilibria, "in equilibria"), (self.in_time, "in time"))
        return ", ".join(f"{factor(k)} {how}" for k, how in factors if k is not None)

    @property
    def reason(self) -> str:
        """Reason for the difference between the two factors, or for one that is missing in time; ""
        if they hardly differ."""
        if self.in_equilibria is None:
            return ""
        if self.in_time is None:
            return f"K is not defined {self.window}: the planets carry no load at times."
        if self.in_time > self.in_equilibria + _DIFFERENCE:
            return "Vibration of the gear meshes adds to the planets' forces in time."
        if self.in_time < self.in_equilibria - _DIFFERENCE:
            return "In time inertia evens out a part of what errors do in equilibria."
        return ""


def sharings(load_sharing: Mapping[str, Any]) -> Iterator[Sharing]:
    """K of each stage with planets that share a load; load_sharing: section of a summary."""
    static = first_variant(load_sharing["quasi_static"])
    in_time = first_variant(load_sharing["transient"])
    stages: dict[str, tuple[list[float], list[float], float | None]] = {}
    halves: dict[str, dict[str, float]] = {}
    for groups, column in ((groups_of(in_time), 1), *((groups_of(g), 0) for g in static.values())):
        for label, group_figures in groups.items():
            group = GroupName.parse(label)
            stage = stages.setdefault(group.stage, ([], [], group_figures["iec_61400_4"]))
            if group_figures["instantaneous"] is not None:
                stage[column].append(group_figures["instantaneous"])  # type: ignore[union-attr]
                of_sides = halves.setdefault(group.stage, {})
                of_sides[group.side] = max(
                    of_sides.get(group.side, 0.0), group_figures["instantaneous"]
                )
    for name, (equilibria, times, assumed) in stages.items():
        if equilibria or times:
            static, dynamic = (max(factors, default=None) for factors in (equilibria, times))
            sides = tuple((side, k) for side, k in halves[name].items() if side)
            yield Sharing(name, static, dynamic, assumed, window_words(in_time), sides)


def first_variant(by_variant: Mapping[str, Any]) -> Any:
    """Value of the first variant, that of the case; {} if there is none."""
    return next(iter(by_variant.values()), {})


def groups_of(figures: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Figures of load sharing by group of gear meshes."""
    return {name: group for name, group in figures.items() if isinstance(group, Mapping)}


def forces_of_halves(transient: Mapping[str, Any]) -> dict[GroupName, dict[str, float]]:
    """Sizes of the mean gear-mesh forces of a transient, N, by stage and kind, then by side."""
    forces: dict[GroupName, dict[str, float]] = {}
    for label, force in transient.get("gear_mesh_force", {}).items():
        group = GroupName.parse(label)
        of_sides = forces.setdefault(GroupName.of(group.stage, group.kind), {})
        of_sides[group.side] = abs(force["mean_n"])
    return forces
