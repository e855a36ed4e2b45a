"""Power that runs round closed loops of a train without ever leaving it.

Branch powers are a flow between shafts (members joined to each other) and stages. Where a train
branches and closes again, the flow may hold a directed cycle: a shaft or stage passes power on
that comes back to it. *Circulating power* is what such cycles carry: each directed cycle is cut by
its smallest branch until none is left, and the cut is what circulates. Without a closed loop, or
where the parallel branches all lead from input to output (power split), it is zero. For one loop
the value is unique; for loops that share branches, cycles with fewest branches are cut first.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Literal

Node = tuple[Literal["shaft", "stage"], str]
SMALL = 1e-9  # of the largest branch power


@dataclass
class Branch:
    """Power ``power`` (W, > 0) from node ``tail`` to node ``head``."""

    tail: Node
    head: Node
    power: float


def circulating_power(
    branch_power: dict[str, float], shaft_of: dict[str, str], stage_of: dict[str, str]
) -> tuple[float, dict[str, float]]:
    """Sum over all cycles, and how much runs through each stage; W.

    branch_power: power into the stage at each member; shaft_of, stage_of: the member's shaft and
    stage.
    """
    largest = max((abs(p) for p in branch_power.values()), default=0.0)
    branches = []
    for member, power in branch_power.items():
        if abs(power) > SMALL * largest:
            shaft: Node = ("shaft", shaft_of[member])
            stage: Node = ("stage", stage_of[member])
            tail, head = (shaft, stage) if power > 0 else (stage, shaft)
            branches.append(Branch(tail, head, abs(power)))
    total, through = 0.0, dict.fromkeys(stage_of.values(), 0.0)
    while cycle := _shortest_cycle(branches):
        cut = min(b.power for b in cycle)
        total += cut
        for branch in cycle:
            branch.power -= cut
            kind, name = branch.head
            if kind == "stage":
                through[name] += cut
        branches = [b for b in branches if b.power > SMALL * largest]
    return total, through


def shafts(members: tuple[str, ...], joints: list[tuple[str, str]]) -> dict[str, str]:
    """Each member's shaft, named after its first member."""
    shaft = {member: member for member in members}
    for first, second in joints:
        low, high = sorted((shaft[first], shaft[second]), key=members.index)
        shaft = {m: low if s == high else s for m, s in shaft.items()}
    return shaft


def _shortest_cycle(branches: list[Branch]) -> list[Branch]:
    """Branches of a directed cycle with the fewest branches; empty where there is none."""
    best: list[Branch] = []
    for start in branches:
        back = _path(branches, start.head, start.tail)
        if back is not None and (not best or len(back) + 1 < len(best)):
            best = [start, *back]
    return best


def _path(branches: list[Branch], begin: Node, end: Node) -> list[Branch] | None:
    """Shortest way from ``begin`` to ``end`` along the flow."""
    came: dict[Node, Branch | None] = {begin: None}
    queue = deque([begin])
    while queue:
        node = queue.popleft()
        if node == end:
            path: list[Branch] = []
            step = came[node]
            while step is not None:
                path.insert(0, step)
                step = came[step.tail]
            return path
        for branch in branches:
            if branch.tail == node and branch.head not in came:
                came[branch.head] = branch
                queue.append(branch.head)
    return None
