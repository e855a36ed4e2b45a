"""Equilibria over gear-mesh cycles with slices: wind-5mw and grc-750kw, flexible and rigid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

import flexgear as fg
from flexgear.results.face_load import face_figures, misalignment_of_groups
from flexgear.solve.angles import lead_angles
from flexgear.solve.model import Model
from flexgear.studies.modify import Proposal, propose_modifications

POSITIONS = 12  # of a gear-mesh cycle
LESS = {  # what validation/grc takes, too: reductions of a minute
    "grc-750kw": {
        "stages.0.ring.fe.fixed_interface_modes": "20",
        "stages.0.carrier.fe.fixed_interface_modes": "20",
        "solver.reduction_limit_hz": "100",
    }
}


@dataclass(frozen=True)
class Even:
    """Of a kind of gear mesh: K_Hβ and misalignment over the face, µm, the largest of all planets;
    causes: misalignment by cause, µm, of the planet misaligned most."""

    k_h_beta: float
    misalignment: float
    causes: dict[str, float]


@cache
def model(
    case: str, fidelity: str, rigid: bool, compliance: str, slices: int = 15, **changes: str
) -> Model:
    """The case put together with so many slices in all its stages."""
    keys = {"solver.fidelity": fidelity, **LESS.get(case, {}), **dict(changes)}
    loaded = fg.load_case(case, keys)
    sliced = {"model": "face_load", "contact_law": "one-sided", "tooth_compliance": compliance}
    sliced |= {"slices": slices}
    every = {
        f"stages.{number}.gear_mesh.{key}": value
        for number in range(len(loaded.stages))
        for key, value in sliced.items()
    }
    return fg.assemble(loaded.with_(**every), ["all"] if rigid else [])


def stages(case: str) -> list[str]:
    """Names of the stages of a bundled case."""
    return [stage.name for stage in fg.load_case(case).stages]


def equilibria(put: Model, stage: str) -> xr.Dataset:
    """Over one gear-mesh cycle of a stage."""
    own = put.case.stage(stage)
    wheel = own.gear if own.kind == "parallel" else own.ring
    assert wheel is not None
    cycle = 2 * np.pi / wheel.teeth * np.arange(POSITIONS) / POSITIONS
    return fg.static(put, lead_angles(put.case, put.flow, cycle, stage))


@cache
def even(
    case: str,
    fidelity: str,
    rigid: bool,
    compliance: str = "width",
    slices: int = 15,
    **changes: str,
) -> dict[str, Even]:
    """Figures by kind of gear mesh ("lss ring"), of every stage over its own cycle."""
    put = model(case, fidelity, rigid, compliance, slices, **changes)
    found = {}
    for stage in stages(case):
        every = face_figures(equilibria(put, stage))
        own = {name: one for name, one in every.items() if name.split()[0] == stage}
        for group, causes in misalignment_of_groups(own).items():
            of_group = [one for name, one in own.items() if name.startswith(f"{group} ")]
            found[group] = Even(
                max(one["k_h_beta"] for one in of_group),
                max((one["misalignment_um"] for one in of_group), key=abs),
                causes,
            )
    return found


@cache
def proposal(case: str, fidelity: str, stage: str) -> Proposal:
    """Flanks that even the load of a stage out."""
    return propose_modifications(model(case, fidelity, False, "width"), stage, trials=30)


def gained(found: Proposal, group: str, key: str) -> tuple[float, float]:
    """Largest figure of a kind of gear mesh before and after."""

    def largest(figures: dict[str, dict[str, Any]]) -> float:
        return max(float(one[key]) for name, one in figures.items() if name.startswith(f"{group} "))

    return largest(found.before[1.0]), largest(found.after[1.0])
