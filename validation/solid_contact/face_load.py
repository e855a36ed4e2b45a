"""The same tooth pair by flexgear: slices of one contact line between rigid bodies.

Slices, influences and line contact are those of the gear mesh of ``plane_contact/case.toml``; no
other pair touches. They bend each other by FE influence ("fe"), or are springs beside each other
("width": Weber and Banaschek's stiffness per width).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from plane_contact.cases import CASE
from scipy.optimize import brentq

from flexgear.arrays import Array
from flexgear.coupling.laws.coupled_slices import forces_of
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.structures.tooth_influence.of_case import pair_bending


@dataclass(frozen=True)
class Pair:
    """Slices of the planet–ring pair at one place: z (K,) m; stiffness (K,) N/m of springs, or
    bending as ``forces_of`` takes it."""

    z: Array
    stiffness: Array
    bending: Array | None

    def forces(self, approach: float, tilt: float) -> Array:
        """(K,) N when the bodies come nearer by w₀ + w₁ z, m and rad."""
        overlap = approach + tilt * self.z
        if self.bending is None:
            return np.asarray(self.stiffness * np.maximum(overlap, 0.0))
        forces = forces_of(overlap[None], np.zeros((1, len(overlap))), self.bending[None])
        return np.asarray(forces[0][0])

    def approach(self, force: float, tilt: float) -> float:
        """w₀ at which they press with a force, m."""

        def excess(approach: float) -> float:
            return float(self.forces(approach, tilt).sum()) - force

        return float(brentq(excess, 0.0, 1e-3, xtol=1e-12))


@cache
def pair(s: float, slices: int, compliance: str = "fe") -> Pair:
    """At the path coordinate s, m; "fe" takes a minute where no cache has it."""
    keys = {
        "stage.gear_mesh.tooth_compliance": compliance,
        "stage.gear_mesh.slices": str(slices),
    }
    case = load_case(CASE, keys).view()
    forces = power_flow(case.case).stages[0].gear_mesh_forces
    path = stage_paths(case, forces)["ring", ""]
    lines = path.slices
    if lines is None:
        raise RuntimeError("case.toml has no slices along the face")
    place = np.searchsorted(lines.s, s)
    share = (s - lines.s[place - 1]) / (lines.s[place] - lines.s[place - 1])

    def at(table: Array) -> Array:
        return np.asarray((1 - share) * table[place - 1] + share * table[place])

    bending = None
    if compliance == "fe":
        contact = pair_bending(case, path, lines, forces["ring"])
        lower = contact.flexibility[:, *np.tril_indices(slices)]
        bending = np.concatenate([at(table) for table in (contact.scale, contact.limit, lower)])
    return Pair(at(lines.z), at(lines.stiffness), bending)
