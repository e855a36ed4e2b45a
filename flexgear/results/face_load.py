"""Figures of the load along the face, over the positions of a dataset of equilibria.

K_Hβ of ISO 6336-1 is the largest over the mean line load along the face, where W(z) is what all
pairs of a gear mesh carry at z in the mean of a cycle, by FE influence in the mean of a section of
the face (``gears.face_load``); here of the positions of a dataset, which have to be spread evenly
over whole cycles of the gear mesh for that. K_Hα in the sense of the same
standard is the largest load of a tooth pair over that of a gear mesh whose pairs share ideally.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from flexgear.gears.face_load import factor_along
from flexgear.model.names import FlankName


END = 2.0  # K at which a tilted tooth begins to leave its other end: see docs/face_load.md
EDGES = {  # what carries, how much is much, and what helps
    "tip": (
        "tip edges carry off the path of contact",
        "the",
        "tip relief takes it away (flexgear modify --relief)",
    ),
    "face_end": (
        "an end of the face carries",
        "twice the",
        "helix slope, crowning or end relief even it out (flexgear modify)",
    ),
}


def face_figures(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Figures over all positions of a dataset of equilibria, of every flank that carries, by its
    name; none where pairs have no slices."""
    if "face_line_load" not in data:
        return {}
    figures = {}
    for name in map(str, data["flank"].to_numpy()):
        of_flank = data.sel(flank=name)
        load = of_flank["face_line_load"].mean("position").to_numpy()
        if not load.max() > 0:
            continue
        figures[name] = {
            "k_h_beta": factor_along(load, float(of_flank["face_section"].max())),
            "k_h_alpha": _sharing_factor(of_flank),
            "instantaneous_peak_factor": float(of_flank["instantaneous_peak_factor"].max()),
            **_edges(of_flank),
            "largest_contact_pressure_mpa": 1e-6 * float(of_flank["largest_contact_pressure"].max()),
            "largest_line_load_n_per_mm": 1e-3 * float(of_flank["largest_line_load"].max()),
            "misalignment_um": 1e6 * float(of_flank["gear_mesh_misalignment"].mean()),
            "misalignment_by_cause_um": _causes(of_flank),
            **_mean_and_swing(of_flank, "transmission_error"),
            **_mean_and_swing(of_flank, "unloaded_transmission_error"),
        }
    return figures


def misalignment_of_groups(figures: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Misalignment by cause, µm, of ``face_figures``, by group of gear meshes: of the planet whose
    causes together are the largest, since those of a leaning sun cancel in a mean."""
    worst: dict[str, dict[str, float]] = {}
    for flank, values in figures.items():
        group, by_cause = FlankName.parse(flank).group, values["misalignment_by_cause_um"]
        if abs(sum(by_cause.values())) > abs(sum(worst.get(group, {}).values())):
            worst[group] = by_cause
    return worst


def _sharing_factor(of_flank: xr.Dataset) -> float:
    """K_Hα of one flank: largest load of a pair over that which pairs sharing by their nominal
    stiffness on the path of contact would have, the force of the gear mesh being the same."""
    load, stiffness = of_flank["pair_load"], of_flank["pair_stiffness"]
    ideal = load.sum("slot") * stiffness / stiffness.sum("slot")
    return float(load.max() / ideal.max())


def _edges(of_flank: xr.Dataset) -> dict[str, float]:
    """How much edges of one flank carry, and at what share of the positions they are in contact:
    tips that carry more than the mean line load, ends of the face more than ``END`` times it."""
    mean = of_flank["mean_line_load"]
    return {
        "tip_load_share_max": float(of_flank["tip_load_share"].max()),
        "tip_line_load_n_per_mm": 1e-3 * float(of_flank["tip_line_load"].max()),
        "tip_contact_positions": float((of_flank["tip_line_load"] > mean).mean()),
        "face_end_line_load_n_per_mm": 1e-3 * float(of_flank["face_end_line_load"].max()),
        "face_end_contact_positions": float((of_flank["face_end_line_load"] > END * mean).mean()),
        "mean_line_load_n_per_mm": 1e-3 * float(mean.mean()),
    }


def edge_warnings(figures: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """A line for each group of gear meshes in ``face_figures`` whose tips or ends of the face carry
    much, of the flank where they carry most."""
    texts = []
    for edge, (edge_text, limit, remedy) in EDGES.items():
        size, often = f"{edge}_line_load_n_per_mm", f"{edge}_contact_positions"
        groups: dict[str, list[Mapping[str, Any]]] = {}
        for flank, values in figures.items():
            if values[often] > 0:
                groups.setdefault(FlankName.parse(flank).group, []).append(values)
        for group, every in groups.items():
            values = max(every, key=lambda x: float(x[size]))
            texts.append(
                f"{group}: {edge_text} up to {values[size]:.4g} N/mm, and more than {limit} mean line load "
                f"of {values['mean_line_load_n_per_mm']:.4g} N/mm at {100 * values[often]:.3g} % of the "
                f"positions; {remedy}"
            )
    return texts


def _mean_and_swing(of_flank: xr.Dataset, error: str) -> dict[str, float]:
    """Mean and peak to peak, µm, of one flank."""
    values = of_flank[error].to_numpy()[np.isfinite(of_flank["transmission_error"].to_numpy())]
    return {
        f"{error}_um": 1e6 * float(values.mean()),
        f"{error}_peak_to_peak_um": 1e6 * float(np.ptp(values)),
    }


def _causes(of_flank: xr.Dataset) -> dict[str, float]:
    """Mean misalignment by cause, µm, of one flank; without what its gear mesh does not have."""
    shares = of_flank["gear_mesh_misalignment_by_cause"]
    every = {str(c): shares.sel(cause=c).to_numpy() for c in shares["cause"].to_numpy()}
    return {c: 1e6 * float(np.nanmean(v)) for c, v in every.items() if np.nan_to_num(v).any()}
