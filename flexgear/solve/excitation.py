"""What excites a train at its rated speeds: orders of the gear meshes, turns of shafts, planets."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexgear.analysis.gyroscopic import ExcitationLine
from flexgear.analysis.nodal_index import excited_index
from flexgear.model.machine import machines_of
from flexgear.model.names import GEAR_MESH, PLANET_PASS, SHAFT, ExcitationName
from flexgear.model.stage import Stage
from flexgear.solve.model import Model

SHARE = 0.1  # of the stage's largest harmonic of gear-mesh stiffness
LEAST = 1e-3  # of the mean stiffness
RESOLVED = 4  # positions of the cycle for a harmonic that counts
USUAL = (1, 2, 3)  # orders of gear meshes whose stiffness tells none
TURNS = (1, 2)  # orders of a shaft's turn: unbalance and eccentricity, misalignment
SAME = 1e-9  # relative, of frequencies that are one


@dataclass(frozen=True)
class Excitation:
    """A line of the Campbell diagram.

    label: its name; share: amplitude of the gear-mesh
    stiffness over its mean, NaN where nothing is known of it; index: k that it drives in a stage of
    equal planets, −1 where it drives none of equal parts.
    """

    line: ExcitationLine
    label: ExcitationName
    share: float = math.nan
    index: int = -1

    @property
    def stage(self) -> str:
        """Stage that it is of."""
        return self.label.stage

    @property
    def kind(self) -> str:
        """What excites: GEAR_MESH, SHAFT or PLANET_PASS."""
        return self.label.kind


def excitations(
    model: Model, highest_hz: float, orders: tuple[float, ...] | None = None
) -> tuple[Excitation, ...]:
    """All lines up to ``highest_hz`` at rated speed.

    orders: of all gear meshes; those that their stiffness shows unless given: at least a tenth of
    the stage's largest harmonic and a thousandth of the mean. Where there is none (constant
    stiffness, or overlap that makes it so), the first three.
    """
    excited: list[Excitation] = []
    for number, stage in enumerate(model.case.stages):
        base = model.flow.stages[number].gear_mesh_frequency
        if base <= 0.0:
            continue
        shares = _shares(model, number)
        shown = _shown(shares) if orders is None else orders
        usual = [o for o in shown if o == 1 or o * base <= highest_hz]
        for order in usual:
            share = float(shares[int(order)]) if order in range(len(shares)) else math.nan
            index = excited_index(order, _driver_teeth(stage), stage.planets)
            line = ExcitationLine(float(order), base)
            name = ExcitationName.of(GEAR_MESH, stage.name, order)
            excited.append(Excitation(line, name, share, index))
    return (*excited, *_turning(model))


def _shown(shares: np.ndarray) -> tuple[float, ...]:
    largest = shares[1:].max(initial=0.0)
    least = max(SHARE * largest, LEAST)
    shown = [float(o) for o in range(1, len(shares)) if shares[o] >= least]
    return tuple(shown) or USUAL


def _shares(model: Model, stage: int) -> np.ndarray:
    """Largest |k_l|/k̄ of any gear mesh of a stage by order from 0 on."""
    shares = [
        np.abs(cycle.harmonic_stiffness()) / cycle.stiffness.mean()
        for m, cycle in model.mean_springs.cycles.items()
        if model.system.gear_meshes[m].stage == stage
    ]
    if not shares:
        return np.zeros(1)
    largest = np.max(shares, axis=0)
    return largest[: 1 + 2 * (len(largest) - 1) // RESOLVED]


def _driver_teeth(stage: Stage) -> int:
    gear = stage.pinion or stage.sun
    assert gear is not None  # a stage is parallel or has a sun
    return gear.teeth


def _turning(model: Model) -> Iterator[Excitation]:
    """Shafts that turn, those of one speed once, and planets that pass a place of their ring."""
    flow, frequencies = model.flow, list[float]()
    for stage in model.case.stages:
        for part in stage.members:
            base = abs(flow.speed[f"{stage.name}.{part}"]) / (2 * math.pi)
            if base == 0.0 or any(
                abs(base - frequency) <= SAME * base for frequency in frequencies
            ):
                continue
            frequencies.append(base)
            for order in TURNS:
                line = ExcitationLine(float(order), base)
                yield Excitation(line, ExcitationName.of(SHAFT, stage.name, order, part))
        stage_flow = flow.stage(stage.name)
        passes = (
            stage.planets * abs(stage_flow.carrier_speed - stage_flow.ring_speed) / (2 * math.pi)
        )
        if stage.kind == "planetary" and passes > 0.0:
            name = ExcitationName.of(PLANET_PASS, stage.name, 1)
            line = ExcitationLine(1.0, passes)
            yield Excitation(line, name)


def operating_factors(model: Model) -> tuple[float, ...]:
    """Speeds over the rated ones at which the case runs for long: rated, and where the speed of a
    port is given or controlled its constant speed, each of its steps, the last one of a series."""
    factors = {1.0}
    for port, machine in zip(model.case.ports, machines_of(model.case), strict=True):
        rated = model.flow.speed[port.member]
        if machine is None or not machine.follows_speed or rated == 0.0:
            continue
        if machine.kind == "constant":
            held = [machine.steady(rated)]
        else:
            held = list(machine.values if machine.kind == "steps" else machine.values[-1:])
        factors |= {float(f"{abs(speed / rated):.9g}") for speed in held if speed != 0.0}
    return tuple(sorted(factors))
