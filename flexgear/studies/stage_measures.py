"""Measures of a flexible stage: modes, and equilibria at rated torque over the planets' period."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from flexgear.coupling.modal import ModalSystem
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.results.flanks import GEARS, tooth_loads
from flexgear.results.load_sharing import load_sharing
from flexgear.studies.measure import (
    Found,
    Measure,
    array,
    frequencies,
    frequencies_by_type,
    largest,
)
from flexgear.studies.single_runs import equilibria
from flexgear.studies.stage_bodies import stage_bodies, stage_modal, variant_of

POSITIONS = 40  # equilibria over one period of the planets


@dataclass(frozen=True)
class StagePoint:
    """A flexible stage; what several measures need is worked out once."""

    case: FlexibleStage
    modes: int

    @cached_property
    def modal(self) -> ModalSystem:
        """The coupled stage; its bodies come from the cache."""
        return stage_modal(self.case, stage_bodies(self.case), variant_of(self.case))

    @cached_property
    def equilibria(self) -> xr.Dataset:
        """Equilibria at rated torque until planets stand where planets stood."""
        angles = np.linspace(0.0, self.case.stage.planet_period, POSITIONS, endpoint=False)
        return equilibria(self.case, self.modal, angles)[1]


def _sharing(point: StagePoint) -> Found:
    data = point.equilibria
    rated = data.attrs["rated_mean_force_n"]
    forces = {kind: data[f"{kind}_gear_mesh_force"].to_numpy() for kind in GEARS}
    factors = {
        kind: load_sharing(force, rated if kind == "ring" else np.abs(force).mean())
        for kind, force in forces.items()
    }
    return {"load_sharing": largest(factors, "1", "largest N F / sum F", "gear_mesh")}


def _tooth_load(point: StagePoint) -> Found:
    loads = {gear: tooth_loads(point.equilibria, gear).to_numpy() for gear in GEARS}
    return {"tooth_load": largest(loads, "N", "largest load of a tooth pair", "gear_mesh")}


def _tooth_displacement(point: StagePoint) -> Found:
    moved = np.abs(point.equilibria["tooth_displacement"].to_numpy()).max(axis=(0, 1))
    about = "largest displacement of a ring tooth node, global axes"
    return {"tooth_displacement": array(moved, "m", about, axis=list("xyz"))}


STAGE_MEASURES = (
    Measure(
        "frequencies",
        "lowest natural frequencies and their types",
        lambda p: frequencies(p.modal.system, p.modes),
    ),
    Measure(
        "frequencies_by_type",
        "lowest natural frequencies of every type of mode",
        lambda p: frequencies_by_type(p.modal.system, p.modes),
    ),
    Measure("load_sharing", "largest load sharing factor over one period of the planets", _sharing),
    Measure(
        "tooth_load", "largest load of a tooth pair over one period of the planets", _tooth_load
    ),
    Measure(
        "tooth_displacement",
        "largest displacement of the ring's tooth nodes over one period of the planets",
        _tooth_displacement,
    ),
)
STAGE_USUAL = ("frequencies", "load_sharing")
