"""``summary.json``, the figures of a run for programs: keys with path, unit and meaning.

The declarations are used by the manual, `json_schema` and `missing_keys`. Angle brackets in a path
stand for names in the case. Names end in units; values without a number are null. `build_summary`
refuses incomplete summaries and numbers that are not finite.
"""

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
from flexgear.results.time_figures import DROP, RIM, STAGE_DROP, STEADY, TRANSIENT

VERSION = 3  # of the schema
FREE = ("<figure>", "<key>")  # path elements for any keys and values

WINDOW = (
    Figure("window_s", "s", "start and end of the evaluated part of the run: the settled part, or "
           "the whole run if it has not settled"),
    Figure("settled", "", "whether the run has settled; null if settle_s is given, or if unknown"),
    Figure("settling", "", "reason for `settled`"),
    Figure("begins", "", "in equilibrium; in the steady motion to first order, if vibration from "
           "equilibrium would last beyond the usual duration; at the end of another transient"),
)  # fmt: skip
KEYS: tuple[Figure, ...] = (
    Figure("case", "", "name of the case", ALWAYS),
    Figure("result", "", '"run"'),
    Figure("version", "", "version of flexgear", ALWAYS),
    Figure("content_hash", "", "SHA-256 of the case", ALWAYS),
    Figure("schema_version", "", "version of this list of keys; earlier runs have none"),
    Figure("variant", "", "description of the flexible bodies", ALWAYS),
    Figure("equilibrium_window", "", "description of the positions of the equilibria"),
    Figure("errors_given", "", "whether any gear, pin or carrier has errors"),
    *below("system", (
        Figure("bodies", "1", "number of bodies of the coupled system", ALWAYS),
        Figure("coordinates", "1", "number of coordinates of the coupled system", ALWAYS),
        Figure("kept_modes", "1", "number of elastic modes in equilibria and transients", ALWAYS),
        Figure("modes_limit_hz", "Hz", "highest frequency of these modes; null: all", ALWAYS),
        Figure("modes_band_hz", "Hz", "band in which modes of flexible bodies are accurate"),
        Figure("lowest_modes_band_hz", "Hz", "the same of bodies that only slower gear meshes "
               "excite; missing where all bodies have one band"),
        Figure("modes_estimate", "1",
               "largest relative error by neglected modes within this band", ALWAYS),
    )),
    *below("power_flow", TRAIN),
    *below("power_flow.members.<member>", MEMBERS),
    *below("stages.<stage>", STAGE_FIGURES),
    Figure("modes.lowest", "", "frequency_hz, type and multiplicity of the lowest twelve", ALWAYS),
    Figure("modes.types.<type>", "1", "number of modes of each type", ALWAYS),
    *below("resonance", (
        Figure("margin", "1", "relative difference of natural and excitation frequency below which "
               "they count as coincident", ALWAYS),
        Figure("speed_factors", "1", "operating speeds over rated speed", ALWAYS),
        Figure("orders.<stage>", "1", "analysed orders of the gear-mesh frequency",
               ALWAYS),
        Figure("unknown_spectrum", "",
               "stages whose gear-mesh stiffness hardly varies, so that it determines no orders"),
        Figure("ideal", "1", "number of coincidences excited with equal planets", ALWAYS),
        Figure("errors", "1", "number of coincidences excited only by unequal planets, run-out or "
               "unbalance", ALWAYS),
        Figure("met", "", "the first 24 coincidences: excitation, frequencies, modes, relative "
               "difference, nodal index k of the modes and of the order, cause, force_share as "
               "`meeting_force`", ALWAYS),
    )),
    *below("load_sharing.quasi_static.<variant>.<stage>", (
        Figure("error_cycle_gear_meshes", "1", "gear-mesh cycles of the whole error cycle"),
        Figure("gear_meshes_looked_at", "1", "number of sampled gear-mesh cycles"),
        Figure("complete", "", "whether all cycles were sampled"),
        Figure("<group>.<definition>", "1", "load sharing coefficient of equilibria", ALWAYS),
    )),
    *below("load_sharing.transient.<variant>", (
        Figure("<group>.<definition>", "1",
               "load sharing coefficient of the transient in its window", ALWAYS),
        *WINDOW,
    )),
    Figure("transient.duration_s", "s", "simulated time", ALWAYS),
    *below("transient", WINDOW),
    Figure("transient.steps", "1", "time steps", ALWAYS),
    *below("transient", TRANSIENT),
    Figure("sensors.<sensor>.unit", "", "unit of what the sensor measures, 1 of strain"),
    *below("sensors.<sensor>", (
        Figure("mean", "", "mean over the window of the transient, SI"),
        Figure("rms_about_mean", "", "root mean square about it"),
        Figure("min", "", "least value"),
        Figure("max", "", "largest value"),
    )),
    Figure("motion_um_max.<member>", "µm", "largest displacement of a member from the axis, or of "
           "the teeth of an FE ring, in equilibria and in the transient"),
    Figure("torque_steps.<torque>.<variant>.window_s", "s",
           "start and end of the evaluated part of the run, which begins at the drop"),
    *below("torque_steps.<torque>.<variant>", DROP),
    *below("torque_steps.<torque>.<variant>.<stage>", STAGE_DROP),
    Figure("headlines", "",
           "verdicts of the first screen of the report, the worst first: see below"),
    Figure("neglected", "", "headline figures less than ten times as large as a neglected effect: "
           "`figure`, `stage`, `value_um` or `load_sharing`, `effects_um`, `sentence`"),
    Figure("energy_residual", "1",
           "largest imbalance of the energy balance; null without one", ALWAYS),
    Figure("equilibrium_closure_max", "1", "largest imbalance of an equilibrium"),
    Figure("solver.<key>", "", "steps, samples and bands derived from the case, with reasons"),
    Figure("warnings", "", "warnings that are not in the headlines", ALWAYS),
    Figure("timing_s.<part>", "s", "wall time", ALWAYS),
    Figure("realtime_factor", "1", "simulated time over processor time of the transient", ALWAYS),
    Figure("reduction.<body>.fe_dofs", "1", "degrees of freedom of the FE mesh", WITH_SECTION),
    Figure("reduction.<body>.<figure>", "1, Hz", "interface dofs, modes, `static_error`, "
           "`frequency_error` up to `frequency_limit_hz`, tie, fidelity"),
    *below("steady.<stage>", (*STEADY, *RIM)),
    *below("face_load.<variant>.<flank>", (*FLANK_FIGURES, *CYCLE_FIGURES)),
)  # fmt: skip


def missing_keys(summary: Mapping[str, Any]) -> list[str]:
    """Dotted names of required keys that a summary does not have."""
    missing: dict[str, None] = {}
    for key in KEYS:
        if key.needed == ALWAYS or (key.needed and key.names[0] in summary):
            missing |= dict.fromkeys(_missing(summary, key.names, ""))
    return list(missing)


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
    """JSON schema (draft 2020-12) of ``summary.json``; rows: schemas of keys with lists."""
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
    """Add the schema of a key to the schema of an object."""
    name, *rest = names
    schema |= {"type": "object", "additionalProperties": schema.get("additionalProperties", False)}
    properties = schema.setdefault("properties", {})
    if name.startswith("<"):
        if name in FREE:
            schema["additionalProperties"] = leaf
            return
        properties, name = schema, "additionalProperties"
        schema[name] = schema[name] or {}
    if not rest:
        properties[name] = {**properties.get(name, {}), **leaf}
        return
    _add(properties.setdefault(name, {}), rest, leaf)


LOWEST = 12  # number of modes in a summary


def build_summary(**pieces: Any) -> dict[str, Any]:
    """The summary as plain data; pieces: its top-level keys. Raises FlexgearError with the names of
    all missing keys and values that are not finite."""
    summary = plain({"schema_version": VERSION, **pieces})
    faults = [f"{key} is missing" for key in missing_keys(summary)]
    faults += [f"{key} is not a finite number" for key in not_finite(summary)]
    if faults:
        raise FlexgearError("the summary is incomplete: " + "; ".join(faults))
    return summary


def not_finite(value: Any, at: str = "") -> Iterator[str]:
    """Dotted names of numbers that are not finite."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from not_finite(inner, f"{at}.{key}".lstrip("."))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from not_finite(inner, f"{at}[{i}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield at


def modes_summary(data: xr.Dataset) -> dict[str, Any]:
    """Lowest modes, repeated ones once, and numbers of modes by type."""
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
    """Load sharing coefficients of all groups of gear meshes, by group and definition."""
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
