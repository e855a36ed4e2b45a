"""``summary.json``, the figures of a run for programs: every key with path, unit and meaning.

``docs`` lists the keys, `json_schema` is made of them, and `lacking` holds a summary to them. In a
path angle brackets stand for names that the case has. Units end the names; what has no number is
null. `build_summary` puts the pieces together and refuses a summary that is incomplete or holds
anything but finite numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexgear.files.atomic import plain
from flexgear.model.errors import FlexgearError
from flexgear.results.face_load import CYCLE_FIGURES, FLANK_FIGURES
from flexgear.results.quantities import ALWAYS, WITH_SECTION, Figure, below, number
from flexgear.results.stage_figures import MEMBERS, STAGE_FIGURES, TRAIN
from flexgear.results.time_figures import DROP, ORDERS, RIM, STAGE_DROP, STEADY, TRANSIENT

VERSION = 3  # of the schema; 2 had a kind, no stage above figures of an only flexible one, and some
# figures twice
FREE = ("<figure>", "<key>")  # any value, with parts or without

WINDOW = (
    Figure("window_s", "s", "start and end of the part of the run that figures are of: from when "
           "it has settled; all of it where it has not"),
    Figure("settled", "", "whether the run has settled; null where settle_s is given, or unknown"),
    Figure("settling", "", "reason for settled, in words"),
)  # fmt: skip
KEYS: tuple[Figure, ...] = (
    Figure("case", "", "name of the case", ALWAYS),
    Figure("result", "", '"run"'),
    Figure("version", "", "of flexgear", ALWAYS),
    Figure("content_hash", "", "SHA-256 of the case", ALWAYS),
    Figure("schema_version", "", "of this list of keys; earlier runs have none"),
    Figure("variant", "", "flexible bodies, in words", ALWAYS),
    Figure("equilibrium_window", "", "positions of the equilibria, in words"),
    Figure("errors_given", "", "whether any gear, pin or carrier has errors"),
    *below("system", (
        Figure("bodies", "1", "bodies of the coupled system", ALWAYS),
        Figure("coordinates", "1", "its coordinates", ALWAYS),
        Figure("kept_modes", "1", "elastic modes that equilibria and transients keep", ALWAYS),
        Figure("modes_limit_hz", "Hz", "highest of them; null: all", ALWAYS),
        Figure("modes_band_hz", "Hz", "of flexible bodies: band in which modes are accurate"),
        Figure("modes_estimate", "1",
               "largest relative error by dropped modes within this band", ALWAYS),
    )),
    *below("power_flow", TRAIN),
    *below("power_flow.members.<member>", MEMBERS),
    *below("stages.<stage>", STAGE_FIGURES),
    Figure("modes.lowest", "", "frequency_hz, type and multiplicity of the lowest twelve", ALWAYS),
    Figure("modes.types.<type>", "1", "number of modes of each type", ALWAYS),
    *below("resonance", (
        Figure("margin", "1", "share of a natural frequency within which an excitation at an "
               "operating speed meets it", ALWAYS),
        Figure("speed_factors", "1", "these speeds over rated speed", ALWAYS),
        Figure("orders.<stage>", "1", "analysed orders of the gear-mesh frequency",
               ALWAYS),
        Figure("unknown_spectrum", "",
               "stages whose gear-mesh stiffness hardly varies, so that it tells no orders"),
        Figure("ideal", "1", "meetings in which a stage of equal planets is excited", ALWAYS),
        Figure("errors", "1", "meetings that take unequal planets, run-out or unbalance", ALWAYS),
        Figure("met", "", "the first 24 of both: excitation, frequencies, modes, how far they are "
               "apart, nodal index k of the modes and of the order, cause, force_share as "
               "`meeting_force`", ALWAYS),
    )),
    *below("load_sharing.quasi_static.<variant>.<stage>", (
        Figure("error_cycle_gear_meshes", "1", "gear-mesh cycles of the whole error cycle"),
        Figure("gear_meshes_looked_at", "1", "number of sampled ones"),
        Figure("complete", "", "whether these were all"),
        Figure("<group>.<definition>", "1", "load sharing coefficient of equilibria", ALWAYS),
    )),
    *below("load_sharing.transient.<variant>", (
        Figure("<group>.<definition>", "1", "that of the transient in its window", ALWAYS),
        *WINDOW,
    )),
    Figure("transient.duration_s", "s", "simulated time", ALWAYS),
    *below("transient", WINDOW),
    Figure("transient.steps", "1", "time steps", ALWAYS),
    *below("transient", TRANSIENT),
    Figure("motion_um_max.<member>", "µm", "largest displacement of a member from the axis, or of "
           "the teeth of an FE ring from their places, in equilibria and in the transient"),
    *below("harmonic", (
        Figure("reason", "", "why there is no harmonic solution"),
        Figure("frequencies_hz", "Hz", "frequencies that excite the train"),
        Figure("largest_difference", "1",
               "largest difference to the transient over the largest force"),
        Figure("load_sharing.<group>.<definition>", "1",
               "load sharing coefficient of the harmonic solution"),
    )),
    Figure("torque_steps.<torque>.<variant>.window_s", "s",
           "start and end of the part that the figures are of: from the drop on"),
    *below("torque_steps.<torque>.<variant>", DROP),
    *below("torque_steps.<torque>.<variant>.<stage>", STAGE_DROP),
    Figure("headlines", "",
           "verdicts of the first screen of the report, the worst first: see below"),
    Figure("neglected", "", "headline figures that are not ten times as large as an effect that is "
           "left out: `figure`, `stage`, `value_um` or `load_sharing`, `effects_um`, `sentence`"),
    Figure("energy_residual", "1",
           "largest imbalance of the energy balance; null without one", ALWAYS),
    Figure("equilibrium_closure_max", "1", "largest imbalance of an equilibrium"),
    Figure("solver.<key>", "", "steps, samples, bands as they follow from the case, with reasons"),
    Figure("warnings", "", "warnings that no headline states", ALWAYS),
    Figure("timing_s.<part>", "s", "wall time", ALWAYS),
    Figure("realtime_factor", "1", "simulated time over processor time of the transient", ALWAYS),
    Figure("reduction.<body>.fe_dofs", "1", "of the FE mesh", WITH_SECTION),
    Figure("reduction.<body>.<figure>", "1, Hz", "interface dofs, modes, `static_error`, "
           "`frequency_error` up to `frequency_limit_hz`, tie, fidelity"),
    *below("steady.<stage>", (*STEADY, *RIM)),
    *below("face_load.<variant>.<flank>", (*FLANK_FIGURES, *CYCLE_FIGURES)),
)  # fmt: skip


def lacking(summary: Mapping[str, Any]) -> list[str]:
    """Dotted names of keys that a summary must have and has not."""
    lost: dict[str, None] = {}
    for key in KEYS:
        if key.needed == ALWAYS or (key.needed and key.names[0] in summary):
            lost |= dict.fromkeys(_missing(summary, key.names, ""))
    return list(lost)


def _missing(value: Any, names: Sequence[str], at: str) -> Iterator[str]:
    if not names:
        return
    name, *rest = names
    if not isinstance(value, Mapping):
        yield at
    elif name.startswith("<"):
        for key, inner in value.items():
            if isinstance(inner, Mapping) or not rest:
                yield from _missing(inner, rest, f"{at}.{key}")
    elif name not in value:
        yield f"{at}.{name}".lstrip(".")
    else:
        yield from _missing(value[name], rest, f"{at}.{name}".lstrip("."))


def json_schema(rows: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Any]:
    """JSON schema (draft 2020-12) of ``summary.json``; rows: schemas of keys that hold lists."""
    root: dict[str, Any] = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "summary.json of a run of flexgear",
        "description": f"version {VERSION}",
    }
    for key in KEYS:
        _add(root, key.names, _leaf(key, rows or {}))
    root["required"] = [k.path for k in KEYS if k.needed == ALWAYS and "." not in k.path]
    root["properties"]["schema_version"] |= {"const": VERSION}
    return root


def _leaf(key: Figure, rows: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    schema: dict[str, Any] = {"description": key.meaning}
    if key.path in rows:
        return {**schema, **rows[key.path]}
    if key.unit and not key.path.endswith(FREE):
        schema |= {"type": ["number", "null", "array"], "items": {"type": ["number", "null"]}}
        schema["x-unit"] = key.unit
    return schema


def _add(schema: dict[str, Any], names: Sequence[str], leaf: dict[str, Any]) -> None:
    """Put a key below the schema of an object."""
    name, *rest = names
    schema |= {"type": "object", "additionalProperties": schema.get("additionalProperties", False)}
    place = schema.setdefault("properties", {})
    if name.startswith("<"):
        if name in FREE:
            schema["additionalProperties"] = leaf
            return
        place, name = schema, "additionalProperties"
        schema[name] = schema[name] or {}
    if not rest:
        place[name] = {**place.get(name, {}), **leaf}
        return
    _add(place.setdefault(name, {}), rest, leaf)


LOWEST = 12  # modes that a summary lists


def build_summary(**pieces: Any) -> dict[str, Any]:
    """The summary from its pieces (keywords are keys of ``KEYS``), in plain types.

    Further keys are kept; what has no number is None. Raises FlexgearError naming every missing key
    and every value that is not finite.
    """
    summary = plain({"schema_version": VERSION, **pieces})
    faults = [f"{key} is missing" for key in lacking(summary)]
    for stage, figures in summary.get("steady", {}).items():
        harmonics = figures.get("radial_harmonics_um", [])
        if len(harmonics) != ORDERS:
            key = f"steady.{stage}.radial_harmonics_um"
            faults.append(f"{key} has {len(harmonics)} orders, not {ORDERS}")
    faults += [f"{key} is not a finite number" for key in not_finite(summary)]
    if faults:
        raise FlexgearError("the summary is incomplete: " + "; ".join(faults))
    return summary


def finite(figures: Mapping[str, float]) -> dict[str, float | None]:
    """Figures with None where one is infinite, which a summary cannot hold."""
    return {name: value if math.isfinite(value) else None for name, value in figures.items()}


def not_finite(value: Any, at: str = "") -> Iterator[str]:
    """Dotted names of numbers that are infinite or not a number."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from not_finite(inner, f"{at}.{key}".lstrip("."))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from not_finite(inner, f"{at}[{i}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield at


def modes_summary(data: xr.Dataset) -> dict[str, Any]:
    """Lowest modes, repeated ones once, and how many of each type there are."""
    lowest: list[dict[str, Any]] = []
    for k in range(data.sizes["mode"]):
        f, kind = float(data["frequency"][k]), str(data["type"][k].item())
        same = bool(lowest) and lowest[-1]["type"] == kind
        if same and abs(f - lowest[-1]["frequency_hz"]) <= 1e-6 * f:
            continue
        times = int(data["multiplicity"][k])
        lowest.append({"frequency_hz": f, "type": kind, "multiplicity": times})
        if len(lowest) == LOWEST:
            break
    kinds = [str(k) for k in data["type"].to_numpy()]
    return {"lowest": lowest, "types": {k: kinds.count(k) for k in dict.fromkeys(kinds)}}


def sharing_summary_of(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Coefficients of every group of gear meshes that shares a load, by group and definition."""
    if "group" not in data.dims:
        return {}
    definitions = list(map(str, data["definition"].to_numpy()))
    factors = data["load_sharing_coefficient"].transpose("group", "definition").to_numpy()
    assumed = data["mesh_load_factor"].to_numpy()
    return {
        str(group): dict(zip([*definitions, "iec_61400_4"], map(number, row), strict=True))
        for group, row in zip(
            data["group"].to_numpy(), np.column_stack([factors, assumed]), strict=True
        )
    }
