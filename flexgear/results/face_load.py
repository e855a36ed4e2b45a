"""Figures of the load along the face, over the positions of a dataset of equilibria.

K_Hβ of ISO 6336-1 is the ratio of the largest to the mean line load W(z) along the face. W(z) is
the sum over all pairs of a gear mesh, averaged over the positions, which must be evenly spaced over
whole gear-mesh cycles; with FE influence it is also averaged over sections of the face
(``gears.slices``). K_Hα is the ratio of the largest load of a tooth pair to that of a gear mesh
whose pairs share the load ideally.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.slices import factor_along
from flexgear.model.names import FlankName
from flexgear.results.quantities import Figure, values

if TYPE_CHECKING:
    import xarray as xr

TILT_ROUNDING = 1e-8  # misalignment over the largest transmission error, below which it is rounding
TRANSMISSION, UNLOADED = "transmission_error", "unloaded_transmission_error"
_END_LIMIT = 2.0  # K at which a tilted tooth pair loses contact at one end: see docs/face_load.md
_EDGES = {  # by edge: load, limit, remedy
    "tip": (
        "tip edges carry load off the path of contact",
        "the",
        "tip relief prevents it (flexgear modify --relief)",
    ),
    "face_end": (
        "an end of the face carries",
        "twice the",
        "helix slope, crowning or end relief reduce it (flexgear modify)",
    ),
}


def face_figures(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """``FLANK_FIGURES`` of all loaded flanks in a dataset of equilibria, by name of the flank.
    Empty if tooth pairs have no slices."""
    if "face_line_load" not in data:
        return {}
    flanks = {str(name): data.sel(flank=name) for name in data["flank"].to_numpy()}
    loaded = {n: f for n, f in flanks.items() if float(_along_face(f).max()) > 0}
    return {name: values(FLANK_FIGURES, of_flank) for name, of_flank in loaded.items()}


def cycle_figures(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """``CYCLE_FIGURES`` over gear-mesh cycles of the flanks that are loaded at all positions."""
    flanks = {str(name): data.sel(flank=name) for name in data["flank"].to_numpy()}
    return {
        name: values(CYCLE_FIGURES, of_flank)
        for name, of_flank in flanks.items()
        if np.isfinite(of_flank["transmission_error_order"]).all()
    }


def misalignment_of_groups(figures: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Misalignment by cause, µm, in ``face_figures``, by group of gear meshes.

    Values are those of the planet with the largest sum, since the effects of a tilted sun cancel in
    the mean over planets.
    """
    worst: dict[str, dict[str, float]] = {}
    for flank, of_flank in figures.items():
        group, by_cause = FlankName.parse(flank).group, of_flank["misalignment_by_cause_um"]
        if abs(sum(by_cause.values())) > abs(sum(worst.get(group, {}).values())):
            worst[group] = by_cause
    return worst


def sharing_factor(of_flank: xr.Dataset) -> float:
    """K_Hα of one flank: ratio of the largest load of a pair to the largest one if pairs shared the
    same gear-mesh force in proportion to their nominal stiffness on the path of contact."""
    names = ("pair_load", "pair_stiffness")
    load, stiffness = (of_flank[name].transpose(..., "slot").to_numpy() for name in names)
    force, total = (np.nansum(x, axis=-1, keepdims=True) for x in (load, stiffness))
    ideal = np.divide(force * stiffness, total, out=np.zeros_like(stiffness), where=total > 0.0)
    return float(np.nanmax(load) / np.nanmax(ideal))


def edge_warnings(figures: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Warnings about groups of gear meshes in ``face_figures`` with high loads on tips or ends of
    the face, one line each, with the values of the flank with the highest load."""
    texts = []
    for edge, (edge_text, limit, remedy) in _EDGES.items():
        size, share = f"{edge}_line_load_n_per_mm", f"{edge}_contact_positions"
        groups: dict[str, list[Mapping[str, Any]]] = {}
        for flank, of_flank in figures.items():
            if of_flank[share] > 0:
                groups.setdefault(FlankName.parse(flank).group, []).append(of_flank)
        for group, flanks in groups.items():
            worst = max(flanks, key=lambda x: float(x[size]))
            texts.append(
                f"{group}: {edge_text} up to {worst[size]:.4g} N/mm, and more than {limit} mean"
                f" line load of {worst['mean_line_load_n_per_mm']:.4g} N/mm at"
                f" {100 * worst[share]:.3g} % of the positions; {remedy}"
            )
    return texts


def positions_for(orders: int) -> int:
    """Smallest number of positions per cycle that resolves ``orders`` orders, mean and slope."""
    return 2 * orders + 4


def order_amplitudes(phase: Array, values: Array, orders: int) -> Array:
    """Amplitudes (N,) of orders 1 … N of values (p,), m, at phases (p,), cycles. They are fitted by
    least squares with a mean and a slope for each cycle."""
    cycle = np.floor(phase + 1e-9).astype(int)
    inside = 2.0 * np.pi * (phase - cycle)
    cycle_columns = (cycle[:, None] == np.unique(cycle)).astype(float)
    waves = np.arange(1, orders + 1) * inside[:, None]
    terms = np.hstack(
        [np.cos(waves), np.sin(waves), cycle_columns, cycle_columns * (inside - np.pi)[:, None]]
    )
    coefficients = np.linalg.lstsq(terms, values, rcond=None)[0]
    return np.hypot(coefficients[:orders], coefficients[orders : 2 * orders])


def with_orders(data: xr.Dataset, phase: Array, orders: int) -> xr.Dataset:
    """The dataset of equilibria with amplitudes of transmission errors by order.

    They are missing for flanks that are unloaded at some positions. phase (p,): gear-mesh phase of
    the positions, cycles.
    """
    # loads xarray, which labels of figures do not need
    from flexgear.results.labelled_dataset import coordinate, variable

    variables = {}
    for name in (TRANSMISSION, UNLOADED):
        values = data[name].transpose("position", "flank").to_numpy()
        amplitudes = np.full((values.shape[1], orders), np.nan)
        for m in np.flatnonzero(np.isfinite(values).all(axis=0)):
            amplitudes[m] = order_amplitudes(phase, values[:, m], orders)
        variables[f"{name}_order"] = variable(f"{name}_order", amplitudes)
    return data.assign(variables).assign_coords(
        gear_mesh_order=coordinate("gear_mesh_order", "gear_mesh_order", np.arange(1, orders + 1)),
        gear_mesh_phase=coordinate("gear_mesh_phase", "position", phase),
    )


def _along_face(of_flank: xr.Dataset) -> xr.DataArray:
    """Line load along the face, mean over the positions, N/m."""
    return of_flank["face_line_load"].mean("position")


def _face_factor(of_flank: xr.Dataset) -> float:
    """K_Hβ of one flank."""
    section = float(of_flank["face_section"].max())
    return factor_along(_along_face(of_flank).to_numpy(), section)


def _largest(name: str, by: float = 1.0) -> Callable[[xr.Dataset], float]:
    """Largest value of a variable over the positions."""
    return lambda of_flank: by * float(of_flank[name].max())


def _share_above(name: str, limit: float) -> Callable[[xr.Dataset], float]:
    """Share of the positions at which a line load exceeds ``limit`` times the mean line load."""
    return lambda of_flank: float((of_flank[name] > limit * of_flank["mean_line_load"]).mean())


def _under_load(error: str, statistic: Callable[[Array], Any]) -> Callable[[xr.Dataset], float]:
    """A statistic of a transmission error, µm, over the positions where the flank is loaded."""

    def evaluate(of_flank: xr.Dataset) -> float:
        loaded = np.isfinite(of_flank["transmission_error"].to_numpy())
        return 1e6 * float(statistic(of_flank[error].to_numpy()[loaded]))

    return evaluate


def _peak_to_peak_in_cycle(error: str) -> Callable[[xr.Dataset], float]:
    """Largest peak-to-peak value of a transmission error within one gear-mesh cycle, µm."""

    def evaluate(of_flank: xr.Dataset) -> float:
        cycle = np.floor(of_flank["gear_mesh_phase"].to_numpy() + 1e-9)
        history = of_flank[error].to_numpy()
        return 1e6 * max(float(np.ptp(history[cycle == c])) for c in np.unique(cycle))

    return evaluate


def _orders(error: str) -> Callable[[xr.Dataset], list[float]]:
    """Amplitudes of a transmission error by order, µm."""
    return lambda of_flank: [1e6 * float(a) for a in of_flank[f"{error}_order"].to_numpy()]


def _stiffness(of_flank: xr.Dataset) -> dict[str, float]:
    """Smallest, mean and largest gear-mesh stiffness, N/µm."""
    stiffness = 1e-6 * of_flank["gear_mesh_stiffness"].to_numpy()
    figures = {"min": stiffness.min(), "mean": stiffness.mean(), "max": stiffness.max()}
    return {name: float(value) for name, value in figures.items()}


def _causes(of_flank: xr.Dataset) -> dict[str, float]:
    """Mean misalignment of one flank by cause, µm, without causes that are rounding."""
    mean = 1e6 * misalignment_by_cause(of_flank).mean("position")
    return {str(cause): float(mean.sel(cause=cause)) for cause in mean["cause"].to_numpy()}


def misalignment_by_cause(data: xr.Dataset) -> xr.DataArray:
    """Misalignment over the face, m, by flank and cause; without causes whose share is rounding,
    that is below ``TILT_ROUNDING`` of the largest transmission error under load. In parallel stages
    the cause "sun" is called "pinion"."""
    shares = data["gear_mesh_misalignment_by_cause"]
    least = TILT_ROUNDING * float(abs(data[TRANSMISSION]).max())
    others = [dim for dim in shares.dims if dim != "cause"]
    shares = shares.sel(cause=(abs(shares) > least).any(others))
    if (data["flank_kind"] == "pinion").all():
        shares["cause"] = ["pinion" if c == "sun" else c for c in shares["cause"].to_numpy()]
    return shares


# figures that a single position does not have
OVER_POSITIONS = {
    "tip_contact_positions", "face_end_contact_positions", "transmission_error_peak_to_peak_um",
    "unloaded_transmission_error_peak_to_peak_um",
}  # fmt: skip
FLANK_FIGURES = (
    Figure("k_h_beta", "1",
           "K_Hβ, ratio of largest to mean line load along the face, over all positions",
           "", _face_factor, "face load factor K_Hβ (ISO 6336-1)"),
    Figure("k_h_alpha", "1",
           "K_Hα, ratio of the largest load of a pair to that of an accurate gear mesh with the "
           "same force",
           "", sharing_factor, "transverse load factor K_Hα (ISO 6336-1)"),
    Figure("instantaneous_peak_factor", "1", "largest ratio of peak to mean line load",
           "", _largest("instantaneous_peak_factor"), "largest over mean line load at any instant"),
    Figure("largest_line_load_n_per_mm", "N/mm", "largest line load",
           "", _largest("largest_line_load", 1e-3), "largest line load"),
    Figure("tip_load_share_max", "1",
           "largest share of the load on tip edges off the path of contact",
           of=_largest("tip_load_share")),
    Figure("tip_line_load_n_per_mm", "N/mm", "largest line load on these tip edges",
           "", _largest("tip_line_load", 1e-3), "largest line load off the path of contact"),
    Figure("tip_contact_positions", "1",
           "share of positions where the line load of tip edges exceeds the mean line load",
           "", _share_above("tip_line_load", 1.0), "edge contact of tips, of the positions",
           "share"),
    Figure("face_end_line_load_n_per_mm", "N/mm", "largest line load at an end of the face",
           "", _largest("face_end_line_load", 1e-3), "largest line load at an end of the face"),
    Figure("face_end_contact_positions", "1",
           "share of positions where the line load at an end exceeds twice the mean line load",
           "", _share_above("face_end_line_load", _END_LIMIT),
           "edge contact of face ends, of the positions", "share"),
    Figure("mean_line_load_n_per_mm", "N/mm", "mean line load",
           of=lambda of_flank: 1e-3 * float(of_flank["mean_line_load"].mean())),
    Figure("largest_contact_pressure_mpa", "MPa", "largest Hertz pressure",
           "", _largest("largest_contact_pressure", 1e-6), "largest Hertz pressure"),
    Figure("misalignment_um", "µm", "mean misalignment over the face",
           "", lambda of_flank: 1e6 * float(of_flank["gear_mesh_misalignment"].mean()),
           "misalignment over the face"),
    Figure("misalignment_by_cause_um.<cause>", "µm", "mean misalignment by cause", of=_causes),
    Figure("transmission_error_um", "µm", "mean transmission error under load",
           of=_under_load(TRANSMISSION, np.mean)),
    Figure("transmission_error_peak_to_peak_um", "µm", "its peak-to-peak over all positions",
           "", _under_load(TRANSMISSION, np.ptp), "transmission error peak to peak"),
    Figure("unloaded_transmission_error_um", "µm", "mean unloaded transmission error",
           of=_under_load(UNLOADED, np.mean)),
    Figure("unloaded_transmission_error_peak_to_peak_um", "µm",
           "its peak-to-peak over all positions",
           "", _under_load(UNLOADED, np.ptp), "the same unloaded"),
)  # fmt: skip
CYCLE_FIGURES = (
    Figure("gear_mesh_stiffness_n_per_um.min", "N/µm",
           "smallest gear-mesh stiffness, with bodies fixed", of=_stiffness),
    Figure("gear_mesh_stiffness_n_per_um.mean", "N/µm", "mean gear-mesh stiffness"),
    Figure("gear_mesh_stiffness_n_per_um.max", "N/µm", "largest gear-mesh stiffness"),
    Figure("transmission_error_cycle_peak_to_peak_um", "µm",
           "largest peak-to-peak within a gear-mesh cycle",
           "", _peak_to_peak_in_cycle(TRANSMISSION), "transmission error peak to peak"),
    Figure("transmission_error_orders_um", "µm",
           "amplitudes by order of the gear mesh, from 1", of=_orders(TRANSMISSION)),
    Figure("unloaded_transmission_error_cycle_peak_to_peak_um", "µm",
           "largest peak-to-peak within a gear-mesh cycle",
           "", _peak_to_peak_in_cycle(UNLOADED), "the same unloaded"),
    Figure("unloaded_transmission_error_orders_um", "µm",
           "amplitudes by order of the gear mesh, from 1", of=_orders(UNLOADED)),
)  # fmt: skip
