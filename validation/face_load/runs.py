"""Equilibria over a gear-mesh cycle with slices: wind-5mw and grc-750kw, flexible and rigid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

import flexgear as fg
from flexgear.results.face_load import face_figures, misalignment_of_groups
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
STAGE = {"wind-5mw": "stage", "grc-750kw": "low_speed"}


@dataclass(frozen=True)
class Even:
    """Largest over planets: K_Hβ and misalignment over the face, µm, of ring and sun."""

    ring: float
    sun: float
    ring_tilt: float
    sun_tilt: float


@cache
def model(case: str, fidelity: str, rigid: bool, compliance: str, **changes: str) -> Model:
    """The case put together with slices."""
    keys = {"solver.fidelity": fidelity, **LESS.get(case, {}), **dict(changes)}
    loaded = fg.load_case(case, keys)
    number = next(k for k, s in enumerate(loaded.stages) if s.kind != "parallel")
    mesh = f"stages.{number}.gear_mesh"
    loaded = loaded.with_(**{f"{mesh}.model": "face_load", f"{mesh}.tooth_compliance": compliance})
    return fg.assemble(loaded, ["all"] if rigid else [])


@cache
def equilibria(
    case: str, fidelity: str, rigid: bool, compliance: str, **changes: str
) -> xr.Dataset:
    """Over one gear-mesh cycle of its planetary stage."""
    put = model(case, fidelity, rigid, compliance, **changes)
    stage = next(s for s in put.case.stages if s.kind != "parallel")
    assert stage.ring is not None
    cycle = 2 * np.pi / stage.ring.teeth * np.arange(POSITIONS) / POSITIONS
    return fg.static(put, cycle)


def even(case: str, fidelity: str, rigid: bool, compliance: str = "width", **changes: str) -> Even:
    """Figures of the planetary stage."""
    data = equilibria(case, fidelity, rigid, compliance, **changes)
    figures = face_figures(data)

    def largest(kind: str, key: str) -> float:
        found = [one[key] for name, one in figures.items() if f" {kind} " in name]
        return max(found, key=abs)

    return Even(
        largest("ring", "k_h_beta"), largest("sun", "k_h_beta"),
        largest("ring", "misalignment_um"), largest("sun", "misalignment_um"),
    )  # fmt: skip


def causes(case: str, fidelity: str, rigid: bool) -> dict[str, dict[str, float]]:
    """Misalignment by cause, µm, of ring and sun: of the planet misaligned most."""
    return misalignment_of_groups(face_figures(equilibria(case, fidelity, rigid, "width")))


@cache
def proposal(case: str, fidelity: str, rigid: bool = False) -> Proposal:
    """Flanks that even the load out."""
    put = model(case, fidelity, rigid, "width")
    stage = next(s.name for s in put.case.stages if s.kind != "parallel")
    return propose_modifications(put, stage, trials=30)


def gained(found: Proposal, kind: str, key: str) -> tuple[float, float]:
    """Largest figure of a kind of gear meshes before and after."""

    def largest(figures: dict[str, dict[str, Any]]) -> float:
        return max(float(one[key]) for name, one in figures.items() if f" {kind} " in name)

    return largest(found.before[1.0]), largest(found.after[1.0])
