"""The short form of a file with one flexible stage: other names for the same keys.

Its sections [ring], [carrier], [shaft], [bearings], [inertia], [drive], [brake], [gear_mesh] and
[errors] stand for keys of the stage, of the input and of the output as ``ALIASES`` lists them, and
what it may leave out are the ports: its carrier is then driven, its sun the output, its ring held.
Files, overrides and messages use either name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from flexgear.model.errors import InputError
from flexgear.model.read import nearest
from flexgear.model.section import Missing

ALIASES = (  # short, long; a name stands before those that it begins with
    ("ring", "stages.0.ring.fe"),
    ("carrier", "stages.0.carrier.fe"),
    ("shaft", "stages.0.sun.shaft"),
    ("bearings.planet", "stages.0.planet_bearing"),
    ("bearings.carrier_drive", "stages.0.carrier.bearing_drive"),
    ("bearings.carrier_far", "stages.0.carrier.bearing_far"),
    ("bearings.sun", "stages.0.sun.support"),
    ("bearings.output", "output.bearing"),
    ("inertia.drive", "inputs.0.inertia"),
    ("inertia.output_mass", "output.mass"),
    ("inertia.output_tilt", "output.tilt_inertia"),
    ("inertia.output", "output.inertia"),
    ("drive.rated_torque", "inputs.0.torque"),
    ("drive.rated_speed", "inputs.0.speed"),
    ("brake.exponent", "output.brake_exponent"),
    ("brake.rated_torque", "output.brake_torque"),
    ("gear_mesh", "stages.0.gear_mesh"),
    ("errors", "stages.0.errors"),
    ("stage", "stages.0"),
)
_SPLIT = ("bearings", "inertia", "brake", "drive")  # their keys go to different places
_PARTS = (  # needed in any file of the short form
    "ring.fe", "carrier.fe", "sun.shaft", "planet_bearing", "carrier.bearing_drive",
    "carrier.bearing_far",
)  # fmt: skip
_AT_PORTS = (  # needed where the ports are those of the short form
    "inputs.0.inertia", "inputs.0.torque", "inputs.0.speed", "output.bearing", "output.inertia",
    "output.mass", "output.tilt_inertia",
)  # fmt: skip


def long_key(key: str) -> str:
    """The key of a case that a key of the short form stands for; any other key as it is."""
    for short, long in ALIASES:
        rest = key[len(short) :]
        if key.startswith(short) and (not rest or rest[0] in "._["):
            return long + rest
    return key


def long_text(text: str) -> str:
    """A text with keys of the short form in it, with those of a case in their place."""
    return re.sub(r"(?<![\w.])[a-z_]+(\.\w+)+", lambda found: long_key(found.group()), text)


def short_text(text: str) -> str:
    """A key, or a text with keys in it, in the words of the short form."""
    text = text.replace("stages[0]", "stage").replace("stages.0", "stage")
    text = text.replace("inputs[0]", "inputs.0")
    for short, long in ALIASES[:-1]:
        spelled = re.escape(long.replace("stages.0", "stage"))
        text = re.sub(rf"(?<![\w.]){spelled}(?![a-zA-Z0-9])", short, text)
    return text


def lengthened(raw: Mapping[str, Any], where: str, known: Sequence[str]) -> dict[str, Any]:
    """Data of a file in the short form under the keys of a case; units still stand in the keys.

    known: keys that a case has itself.
    """
    _refuse_unknown(raw, where, known)
    out: dict[str, Any] = {"stages": {"0": {"name": "stage"}}}
    for key, value in raw.items():
        if key == "inputs" and isinstance(value, list):
            value = {str(k): one for k, one in enumerate(value)}
        if key not in _SPLIT:
            _join(out, long_key(key), value, where, key)
            continue
        if not isinstance(value, Mapping):
            remedy = f"write it as [{key}] with keys below"
            raise InputError(where, key, "is not a section", remedy)
        for name, inside in value.items():
            full = f"{key}.{name}"
            target = long_key(full)
            if target == full and key != "drive":
                good = [s.split(".")[1] for s, _ in ALIASES if s.startswith(f"{key}.")]
                raise InputError(where, full, "is not a known key", nearest(name, good))
            _join(out, target, inside, where, full)
    if "inputs" not in raw:
        out["inputs"] = {"0": {"member": "stage.carrier", **out.get("inputs", {}).get("0", {})}}
    if "output" not in raw:
        out["output"] = {"member": "stage.sun", **out.get("output", {})}
    listed = {name: [*out[name].values()] for name in ("stages", "inputs")}
    return {"held": ["stage.ring"], **out, **listed}


def _refuse_unknown(raw: Mapping[str, Any], where: str, known: Sequence[str]) -> None:
    sections = list(dict.fromkeys(short.partition(".")[0] for short, _ in ALIASES))
    for key in raw:
        if key not in sections and key not in known:
            remedy = nearest(key, [*sections, *known])
            raise InputError(where, key, "is not a known key", remedy)


def _join(out: dict[str, Any], target: str, value: Any, where: str, key: str) -> None:
    """Put a value at a long key, beside what is there; InputError where that says it already."""
    place: Any = out
    *way, last = target.split(".")
    for part in way:
        place[part] = place = dict(place.get(part, {}))
        if not isinstance(place, dict):
            raise InputError(where, key, "has nowhere to stand", "write the stage as [stage]")
    there = place.get(last)
    if there is None:
        place[last] = value
        return
    if isinstance(there, Mapping) and isinstance(value, Mapping) and not {*there} & {*value}:
        place[last] = {**there, **value}
        return
    raise InputError(
        where, key, f"is given twice, also as {short_text(target)}", "keep one of them"
    )


def missing(data: Mapping[str, Any]) -> list[Missing]:
    """What a case in the short form must say and ``data`` (SI) does not."""
    keys = [f"stages.0.{part}" for part in _PARTS]
    ports = [_at(data, "inputs.0.member"), _at(data, "output.member")]
    if ports == ["stage.carrier", "stage.sun"]:
        keys += _AT_PORTS
    return [Missing(key) for key in keys if _at(data, key) is None]


def _at(data: Any, key: str) -> Any:
    """What stands at a key, None where nothing does."""
    for part in key.split("."):
        if part.isdigit():
            data = data[int(part)] if len(data or ()) > int(part) else None
        else:
            data = data.get(part) if isinstance(data, Mapping) else getattr(data, part, None)
    return data
