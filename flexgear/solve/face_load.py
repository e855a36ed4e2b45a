"""Variables of datasets for load along the face: line loads, pressure, misalignment and causes."""

from collections.abc import Callable, Collection, Mapping
from functools import cache, partial
from typing import Any

import numpy as np

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.line_loads import (
    CAUSES,
    LineLoads,
    edge_loads,
    first_touch,
    gear_mesh_stiffness,
    line_loads,
    pairs_at,
    tilt_by_cause,
)
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Transient
from flexgear.arrays import Array
from flexgear.coupling.pair_data import KINDS, PairData
from flexgear.gears.hertz import ContactBody, line_contact, relative_radius
from flexgear.gears.slices import with_ends
from flexgear.solve.model import Model
from flexgear.solve.stresses import FILLETS, MEMBERS, root_arrays


def face_arrays(model: Model, recovery: Recovery, only: Collection[str] = ()) -> dict[str, Any]:
    """Variables of a result whose pairs have slices; empty without slices. Transients have no
    variables by slice, unless ``solver.line_loads_in_time``. only: names of variables that are
    needed beside root stresses, all if empty."""
    result = recovery.result
    loads = line_loads(result)
    if loads is None:
        return {}
    load = _sliced_load(result, loads)
    pairs = model.system.pairs
    width = 2.0 * pairs.half_face
    pressure = cache(lambda: _pressure(model, loads))
    largest = cache(lambda: largest_line_load(pairs, loads))

    def by_cause() -> Array:
        causes = np.moveaxis(tilt_by_cause(recovery), -1, 0)
        return np.stack([_by_load(tilt, load) for tilt in causes], axis=-1) * width[:, None]

    arrays = _chosen(only, {
        "largest_line_load": largest,
        "largest_contact_pressure": lambda: np.nan_to_num(pressure()).max(axis=(2, 3)),
        "transmission_error": lambda: _by_load(loads.approach, load),
        "gear_mesh_misalignment": lambda: _by_load(loads.tilt, load) * width,
        "gear_mesh_misalignment_by_cause": by_cause,
    })  # fmt: skip
    by_slice = isinstance(result, Equilibrium) or model.case.solver.line_loads_in_time
    places = face_places(pairs) if by_slice else np.zeros(0)
    arrays |= root_arrays(model.root_tables, recovery, loads, places)
    if not by_slice:
        return arrays
    edges, positions = cache(lambda: edge_loads(pairs, loads)), cache(lambda: pairs_at(result))
    return arrays | _chosen(only, {
        **{name: partial(np.asarray, x) for name, x in _flank_geometry(pairs).items()},
        "pair_planet_tooth": lambda: (positions().planet_tooth + 1).astype(np.int16),
        "mean_line_load": lambda: edges().mean,
        "instantaneous_peak_factor": lambda: largest() / edges().mean,
        "tip_load_share": lambda: edges().tip_share,
        "tip_line_load": lambda: edges().tip,
        "face_end_line_load": lambda: edges().end,
        "line_load": lambda: loads.line_load,
        "contact_pressure": pressure,
        "slice_position": lambda: loads.z,
        "slice_path": lambda: loads.path,
        "face_line_load": lambda: along_face(pairs, loads),
        "unloaded_transmission_error": lambda: first_touch(pairs, loads, positions().error),
        "gear_mesh_stiffness": lambda: gear_mesh_stiffness(result, loads),
    })  # fmt: skip


def _chosen(only: Collection[str], variables: Mapping[str, Callable[[], Any]]) -> dict[str, Any]:
    """Values of the variables named in ``only``, or of all if it is empty."""
    return {name: make() for name, make in variables.items() if not only or name in only}


def face_labels(model: Model) -> dict[str, list[Any]]:
    """Labels of the axes: places along the face, causes, members of a pair, fillets."""
    return {
        "face": face_places(model.system.pairs).tolist(),
        "cause": list(CAUSES),
        "pair_member": list(MEMBERS),
        "fillet": list(FILLETS),
    }


def face_places(pairs: PairData) -> Array:
    """Places along the face over its width, −1/2 … 1/2: at middles and ends of slices."""
    return np.linspace(-0.5, 0.5, 2 * int(pairs.slices.max(initial=0)) + 1)


def along_face(pairs: PairData, loads: LineLoads) -> Array:
    """Sum (t, M, F) of the line loads of all pairs of a gear mesh at places along the face, N/m."""
    places, count = face_places(pairs), loads.z.shape[-1]
    load = _loads_with_ends(pairs, loads)
    low, high = loads.ends[..., :1], loads.ends[..., 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (places * 2.0 * pairs.half_face[:, None, None] - low) / (high - low)
    on = (share >= 0.0) & (share <= 1.0) & np.isfinite(loads.line_load).all(axis=-1, keepdims=True)
    x = np.where(on, share * count, 0.0)
    # index in ``load``, whose first and last values are half a slice from the next ones
    index = np.where(x < 0.5, 2 * x, np.where(x > count - 0.5, 2 * x - count + 1, x + 0.5))
    first = np.minimum(index.astype(np.int64), count)
    share = index - first
    below, above = (np.take_along_axis(load, first + k, axis=-1) for k in (0, 1))
    return np.asarray(np.where(on, (1.0 - share) * below + share * above, 0.0).sum(axis=2))


def largest_line_load(pairs: PairData, loads: LineLoads) -> Array:
    """Largest line load (t, M) of each gear mesh, including the ends of contact lines, N/m."""
    return np.asarray(_loads_with_ends(pairs, loads).max(axis=(2, 3)))


def _loads_with_ends(pairs: PairData, loads: LineLoads) -> Array:
    """Line loads (t, M, slots, K + 2) including those at the ends of the contact lines, N/m."""
    width = np.nan_to_num(loads.width[..., 0], nan=1.0)  # without a line there is no load
    return with_ends(np.nan_to_num(loads.line_load), 0.5 * sections(pairs)[:, None] / width)


def sections(pairs: PairData) -> Array:
    """Lengths (M,) along the face over which line loads are averaged, m: for coupled slices normal
    base pitch over π, i.e. m_n cos α_n, else 0 (see ``gears.slices``)."""
    return np.where(pairs.coupled == 1, pairs.pitch * pairs.cos_b / np.pi, 0.0)


def _pressure(model: Model, loads: LineLoads) -> Array:
    """Hertz pressure (t, M, slots, K) in the middle of slices, Pa, NaN without a pair: from the
    load per length of the contact line and the radius of relative curvature in the normal section;
    off the path with the radius at its end."""
    pairs, material = model.system.pairs, model.case.material
    body = ContactBody(material.young_modulus, material.poisson_ratio, 1.0)  # depth is not used
    out = np.full_like(loads.line_load, np.nan)
    for m in np.flatnonzero(pairs.slices):
        internal = KINDS[pairs.kind[m]].internal
        offset = pairs.center_distance[m] * abs(pairs.normal[m, 0])
        least = 1e-3 * pairs.pitch[m]
        planet = np.maximum(loads.path[:, m], least)
        gear = np.maximum(offset + planet if internal else offset - planet, least)
        radius = relative_radius(planet, gear, internal=internal) / pairs.cos_b[m]
        load = np.maximum(loads.line_load[:, m] * pairs.cos_b[m], 0.0)
        out[:, m] = line_contact(body, body, radius).pressure(load) / loads.narrowing[:, m]
    return out


def _sliced_load(result: Equilibrium | Transient, loads: LineLoads) -> Array:
    """Loads (t, M, slots) of pairs with slices, N; 0 for all others."""
    return np.where(np.isfinite(loads.force).all(axis=-1), result.pair_load, 0.0)


def _by_load(values: Array, load: Array) -> Array:
    """Mean (t, M) of values of pairs (t, M, slots), weighted by their loads; NaN without load."""
    total = load.sum(axis=-1)
    weighted = np.where(load > 0, np.nan_to_num(values) * load, 0.0).sum(axis=-1)
    return np.asarray(np.divide(weighted, total, out=np.full_like(total, np.nan), where=total > 0))


def _flank_geometry(pairs: PairData) -> dict[str, Array]:
    """Geometry (M,) that relates path coordinates to positions on the flanks of both gears, m."""
    return {
        "path_start": pairs.path_lo,
        "path_end": pairs.path_hi,
        "planet_base_diameter": 2.0 * np.abs(pairs.planet_arm) / pairs.cos_b,
        "gear_base_diameter": 2.0 * np.abs(pairs.gear_arm) / pairs.cos_b,
        "face_section": 0.5 * sections(pairs) / pairs.half_face,
        "gear_roll_offset": pairs.center_distance * np.abs(pairs.normal[:, 0]),
    }


def worst_figures(result: Equilibrium) -> tuple[Array, Array]:
    """Largest line load (M,), N/m, and peak-to-peak transmission error (M,), m, of every flank in
    equilibria whose pairs have slices; the error is zero for flanks not loaded at all positions."""
    loads = line_loads(result)
    assert loads is not None
    error = _by_load(loads.approach, _sliced_load(result, loads))
    loaded = np.isfinite(error).all(axis=0)
    largest = largest_line_load(result.modal.system.pairs, loads).max(axis=0)
    return largest, np.where(loaded, np.ptp(error, axis=0), 0.0)
