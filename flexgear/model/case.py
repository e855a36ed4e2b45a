"""A case: everything a user states about one planetary stage, validated, frozen, in SI."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from flexgear.model.brake import Brake
from flexgear.model.bundled import bundled_cases, bundled_text
from flexgear.model.carrier import Carrier
from flexgear.model.drive import Drive
from flexgear.model.errors import InputError
from flexgear.model.faults import input_error
from flexgear.model.gear_errors import GearErrors
from flexgear.model.gear_mesh import Damping, GearMesh
from flexgear.model.housing import Housing
from flexgear.model.inertia import Inertias
from flexgear.model.material import Material
from flexgear.model.read import Written, nearest, override_data, parse_toml, put, read_text, to_si
from flexgear.model.ring import Ring
from flexgear.model.section import Refusal, Section
from flexgear.model.shaft import Shaft
from flexgear.model.solver import Solver
from flexgear.model.springs import Bearings
from flexgear.model.stage import Stage
from flexgear.model.torque_series import read_torque_series

_NOT_PHYSICAL = {"name", "title", "source"}
_FILE_KEYS = (("ring", "fe_mesh_file"), ("carrier", "fe_mesh_file"), ("drive", "file"))


class Case(Section):
    """One planetary stage. source: file or bundled name it came from."""

    name: str = "case"
    title: str = ""
    source: str = "case"
    material: Material
    stage: Stage
    ring: Ring
    carrier: Carrier
    shaft: Shaft
    bearings: Bearings
    housing: Housing = Housing()
    inertia: Inertias
    drive: Drive
    brake: Brake = Brake()
    gear_mesh: GearMesh = GearMesh()
    damping: Damping = Damping()
    errors: GearErrors = GearErrors()
    solver: Solver = Field(default_factory=Solver)

    def content_hash(self, *sections: str) -> str:
        """SHA-256 of what the case says physically (or of the named sections), 64 hex digits.

        Name, title and spelling do not count; files that are named count by what is in them.
        """
        data = self.model_dump(mode="python", exclude=_NOT_PHYSICAL)
        for section, key in _FILE_KEYS:
            data[section][key] = _digest(data[section][key])
        if sections:
            data = {name: data[name] for name in sections}
        text = json.dumps(_canonical(data), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def with_(self, **changes: Any) -> Case:
        """A copy with SI values changed, validated again: with_(**{"stage.planets": 4}).

        Keys are field paths without units, joined by "." or "__"; lists by number.
        """
        data = self.model_dump(mode="python")
        for key, value in changes.items():
            path: list[str | int] = [
                int(p) if p.isdigit() else p for p in key.replace("__", ".").split(".")
            ]
            if isinstance(value, Section):
                value = value.model_dump(mode="python")
            put(data, path, value, "with_", key)
        return _validated(data, "with_", Written())

    def to_dict(self) -> dict[str, Any]:
        """Plain data in SI, as it is written beside results."""
        return self.model_dump(mode="json")


def load_case(source: str | Path, overrides: Mapping[str, str] | None = None) -> Case:
    """Read a TOML file or a bundled case by name; overrides are keyed like the TOML keys.

    overrides: {"stage.planets": "4", "stage.face_width_mm": "400"}; they win over the file.
    Raises InputError with one line for anything that is wrong.
    """
    text, where, folder, name = _find(source)
    written = Written()
    data = to_si(Case, parse_toml(text, where), where, written)
    for key, value in (overrides or {}).items():
        path, converted = override_data(Case, key, str(value), written)
        put(data, path, converted, "--set", key)
    data["source"] = where
    data.setdefault("name", name)
    _resolve_files(data, folder)
    return _validated(data, where, written)


def _find(source: str | Path) -> tuple[str, str, Path, str]:
    """Text, how to name it in messages, folder for relative paths, name of the case."""
    path = Path(source)
    if path.exists() or path.suffix or len(path.parts) != 1:
        return read_text(path), str(source), path.parent, path.stem
    if str(source) in bundled_cases():
        return bundled_text(str(source)), str(source), Path(), str(source)
    hint = nearest(str(source), bundled_cases())
    raise InputError(
        str(source), "case", "is neither a file nor a bundled case", f"give a .toml file, or {hint}"
    )


def _resolve_files(data: dict[str, Any], folder: Path) -> None:
    """Paths are relative to the case file; the torque series is read."""
    for section, key in _FILE_KEYS:
        inside = data.get(section)
        if isinstance(inside, dict) and isinstance(inside.get(key), str):
            inside[key] = str((folder / Path(inside[key]).expanduser()).resolve())
    drive = data.get("drive")
    if isinstance(drive, dict) and drive.get("kind") == "csv" and drive.get("file"):
        drive["times"], drive["torques"] = read_torque_series(Path(drive["file"]))


def _validated(data: dict[str, Any], where: str, written: Written) -> Case:
    try:
        case = Case.model_validate(data)
        _check_across(case)
    except ValidationError as fault:
        raise input_error(Case, fault, where, written) from None
    except Refusal as fault:
        known = written.fields.get(fault.key)
        at, key = (known[0], known[1]) if known else (where, fault.key)
        raise InputError(at, key, fault.problem, fault.remedy) from None
    return case


def _check_across(case: Case) -> None:
    """Checks between sections."""
    n = case.stage.planets
    for key in ("pin_tangential", "pin_radial"):
        count = len(getattr(case.errors, key))
        if count not in (0, n):
            raise Refusal(
                f"errors.{key}", f"{count} values for {n} planets", "give one for each planet"
            )
    half = case.stage.face_width / 2 * (1 + 1e-9)
    for k, fit in enumerate(case.ring.fits):
        if fit.band[0] < -half or fit.band[1] > half:
            raise Refusal(
                f"ring.fits.{k}.z",
                f"the band of ±{fit.half_width * 1e3:g} mm leaves the face of ±{half * 1e3:.1f} mm",
                "move it or make it narrower",
            )
    if case.carrier.plate_gap <= case.stage.face_width:
        raise Refusal(
            "carrier.plate_gap",
            f"{case.carrier.plate_gap * 1e3:g} mm leaves no room for planets of "
            f"{case.stage.face_width * 1e3:g} mm face width",
            "make it wider than the face width",
        )


def _digest(path: str | None) -> str | None:
    if path is None:
        return None
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return f"missing:{Path(path).name}"


def _canonical(value: Any) -> Any:
    """Numbers with 12 digits, so that 430 mm and 0.43 m are the same."""
    if isinstance(value, dict):
        return {k: _canonical(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_canonical(v) for v in value]
    if isinstance(value, float):
        return f"{value:.12g}"
    return value
