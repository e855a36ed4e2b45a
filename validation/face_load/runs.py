"""Equilibria over gear-mesh cycles with slices: the planetary stages of wind-5mw and grc-750kw,
flexible and rigid."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

import flexgear as fg
from flexgear.results.face_load import face_figures, misalignment_of_groups
from flexgear.solve.angles import lead_angles
from flexgear.solve.model import Model, assemble
from flexgear.solve.static import static
from flexgear.studies.modify import Proposal, propose_modifications

POSITIONS = 12  # of a gear-mesh cycle
FEW_MODES = {  # equilibria need none; of grc-750kw the bodies of validation/grc
    "stages.0.ring.fe.fixed_interface_modes": "20",
    "stages.0.carrier.fe.fixed_interface_modes": "20",
    "solver.reduction_limit_hz": "100",
}


@dataclass(frozen=True)
class Even:
    """Of a kind of gear mesh: K_Hβ and misalignment over the face, µm, the largest of all planets;
    causes: misalignment by cause, µm, of the planet misaligned most."""

    k_h_beta: float
    misalignment: float
    causes: dict[str, float]


def bodies_at(case: str, fidelity: str) -> dict[str, str]:
    """Keys of FE bodies. At standard they have all modes, which validation/tan2023 needs."""
    if fidelity == "quick" or case == "grc-750kw":
        return {"solver.fidelity": "quick", **FEW_MODES}
    return {"solver.fidelity": fidelity}


@cache
def model(
    case: str, fidelity: str, rigid: bool, compliance: str, slices: int = 15, **changes: str
) -> Model:
    """The case put together with so many slices in its planetary stage."""
    loaded = fg.load_case(case, {**bodies_at(case, fidelity), **changes})
    sliced = {"model": "face_load", "contact_law": "one-sided", "tooth_compliance": compliance}
    sliced |= {"slices": slices}
    every = {f"stages.{stage(case)}.gear_mesh.{key}": value for key, value in sliced.items()}
    return assemble(loaded.with_(**every), ["all"] if rigid else [])


def stage(case: str) -> str:
    """Name of the planetary stage of a bundled case."""
    (name,) = (s.name for s in fg.load_case(case).stages if s.kind != "parallel")
    return name


def equilibria(put: Model, stage: str) -> xr.Dataset:
    """Over one gear-mesh cycle of a stage."""
    ring = put.case.stage(stage).ring
    assert ring is not None
    cycle = 2 * np.pi / ring.teeth * np.arange(POSITIONS) / POSITIONS
    return static(put, lead_angles(put.case, put.flow, cycle, stage))


@cache
def even(
    case: str,
    fidelity: str,
    rigid: bool,
    compliance: str = "width",
    slices: int = 15,
    **changes: str,
) -> dict[str, Even]:
    """Figures by kind of gear mesh ("lss ring")."""
    put = model(case, fidelity, rigid, compliance, slices, **changes)
    every, by_group = face_figures(equilibria(put, stage(case))), {}
    for group, causes in misalignment_of_groups(every).items():
        of_group = [one for name, one in every.items() if name.startswith(f"{group} ")]
        by_group[group] = Even(
            max(one["k_h_beta"] for one in of_group),
            max((one["misalignment_um"] for one in of_group), key=abs),
            causes,
        )
    return by_group


@cache
def proposal(case: str, fidelity: str) -> Proposal:
    """Flanks that even the load out."""
    return propose_modifications(model(case, fidelity, False, "width"), stage(case), trials=30)


def gained(change: Proposal, group: str, key: str) -> tuple[float, float]:
    """Largest figure of a kind of gear mesh before and after."""

    def largest(figures: dict[str, dict[str, Any]]) -> float:
        return max(float(one[key]) for name, one in figures.items() if name.startswith(f"{group} "))

    return largest(change.before[1.0]), largest(change.after[1.0])
