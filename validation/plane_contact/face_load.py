"""The same gear pairs by flexgear's slices (`gear_mesh.model = "face_load"`) between rigid bodies.

With rigid bodies and straight teeth the whole face moves alike, so the equilibrium of slices is one
equation for the approach δ at each place: Σ k (δ − gap)₊ over the pairs = line load, with stiffness
and gap of flexgear's table of slices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_stage
from plane_contact.cases import CASE, RELIEF_MM, RELIEF_UM, Loading

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Loaded:
    """Transmission error (places,) m and pair loads (places, 3) N/m."""

    error: Array
    loads: Array


def loaded(kind: str, loading: Loading, s: Array, stiffness: str = "weber-banaschek") -> Loaded:
    """At places s (places,) of the middle pair; kind: "sun" or "ring"."""
    keys = {
        "stage.gear_mesh.pair_stiffness": stiffness,
        "stage.gear_mesh.path_only": str(loading.path_only).lower(),
    }
    for name in ("planet", kind) if loading.relieved else ():
        relief = f"stage.{name}.tip_relief"
        keys |= {f"{relief}.amount_um": str(RELIEF_UM), f"{relief}.length_mm": str(RELIEF_MM)}
        keys[f"{relief}.form"] = "linear"
    view = load_stage(CASE, keys)
    rated = power_flow(view.case).stages[0].gear_mesh_forces
    forces = {name: loading.share * force for name, force in rated.items()}
    path = stage_paths(view, forces)[kind, ""]
    slices, face = path.slices, 2.0 * path.half_face
    low, high = slices.span
    place = s[:, None] + path.base_pitch * np.array([-1, 0, 1])
    inside = (place >= low) & (place <= high)
    k = np.where(inside, np.interp(place, slices.s, slices.stiffness.sum(axis=1) / face), 0.0)
    gap = np.interp(place, slices.s, slices.gap[:, 0])
    load = forces[kind] / face
    error = np.array([_approach(*pairs, load) for pairs in zip(k, gap, strict=True)])
    return Loaded(error, k * np.maximum(error[:, None] - gap, 0.0))


def _approach(k: Array, gap: Array, load: float) -> float:
    """δ with Σ k (δ − gap)₊ = load."""
    most = gap[k > 0].max() + 1.01 * load / k[k > 0].min()
    return float(brentq(lambda d: (k * np.maximum(d - gap, 0.0)).sum() - load, 0.0, most))
