"""A flexible stage: all a user states about one planetary stage, validated, frozen, in SI."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import Field, ValidationError, model_validator

from flexgear.model.brake import Brake
from flexgear.model.carrier import Carrier
from flexgear.model.case_name import check_case_name
from flexgear.model.content import content_hash, file_digest
from flexgear.model.drive import Drive
from flexgear.model.faults import input_error
from flexgear.model.gear_mesh import Damping, GearMesh
from flexgear.model.history_files import read_histories
from flexgear.model.housing import Housing
from flexgear.model.inertia import Inertias
from flexgear.model.material import Material
from flexgear.model.ports import MemberLoad
from flexgear.model.read import Written, is_place, put
from flexgear.model.ring import Ring
from flexgear.model.section import Refusal, Section
from flexgear.model.shaft import Shaft
from flexgear.model.solver import Solver
from flexgear.model.springs import Bearings
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView
from flexgear.model.tolerance import StageTolerance
from flexgear.model.train_errors import TrainErrors
from flexgear.model.units import Acceleration

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.train_stage import TrainStage

_NOT_PHYSICAL = {"name", "title", "source", "tolerance"}
_FILE_KEYS = (("ring", "fe_mesh_file"), ("carrier", "fe_mesh_file"), ("drive", "file"))


class FlexibleStage(Section):
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
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, 0.0, 0.0)
    loads: tuple[MemberLoad, ...] = ()
    gear_mesh: GearMesh = GearMesh()
    damping: Damping = Damping()
    errors: TrainErrors = TrainErrors()
    tolerance: StageTolerance = StageTolerance()
    solver: Solver = Field(default_factory=Solver)

    @model_validator(mode="after")
    def _consistent(self) -> FlexibleStage:
        _check_across(self)
        return self

    def view(self) -> StageView:
        """The stage as gear theory sees it."""
        tie = self.ring.tie
        return StageView(self.source, self.material, self._as_one_of_many(), "stage", "", tie)

    def as_case(self) -> Case:
        """The stage as a case of one stage: carrier driven, sun loaded, ring held."""
        from flexgear.model.case import case_of_stage

        return case_of_stage(self)

    def _as_one_of_many(self) -> TrainStage:
        from flexgear.model.train_stage import TrainStage

        try:
            return TrainStage.model_validate(
                {"name": "stage", "case": self.name, "flexible": self}, strict=True
            )
        except ValidationError as fault:
            raise input_error(TrainStage, fault, self.source, Written()) from None

    def content_hash(self, *sections: str) -> str:
        """SHA-256 of what the case says physically (or of the named sections), 64 hex digits.

        Name, title and spelling do not count; files that are named count by what is in them.
        """
        data = self.model_dump(mode="python", exclude=_NOT_PHYSICAL)
        for section, key in _FILE_KEYS:
            data[section][key] = file_digest(data[section][key])
        if sections:
            data = {name: data[name] for name in sections}
        return content_hash(data)

    def with_(self, **changes: Any) -> FlexibleStage:
        """A copy with SI values changed, validated again: with_(**{"stage.planets": 4}).

        Keys are field paths without units, joined by "." or "__"; lists by number.
        """
        data = self.model_dump(mode="python")
        for key, value in changes.items():
            path: list[str | int] = [
                int(p) if is_place(p) else p for p in key.replace("__", ".").split(".")
            ]
            if isinstance(value, Section):
                value = value.model_dump(mode="python")
            put(data, path, value, "with_", key)
        return validated_stage(data, "with_", Written())

    def to_dict(self) -> dict[str, Any]:
        """Plain data in SI, as it is written beside results."""
        return self.model_dump(mode="json")


def resolve_files(data: dict[str, Any], folder: Path) -> None:
    """Paths are relative to the case file; the torque series is read."""
    for section, key in _FILE_KEYS:
        inside = data.get(section)
        if isinstance(inside, dict) and isinstance(inside.get(key), str):
            inside[key] = os.path.abspath(folder / os.path.expanduser(inside[key]))
    read_histories(data, folder)


def validated_stage(data: dict[str, Any], where: str, written: Written) -> FlexibleStage:
    """The case of plain SI data; InputError names each key as it was written."""
    try:
        return FlexibleStage.model_validate(data)
    except ValidationError as fault:
        raise input_error(FlexibleStage, fault, where, written) from None


def _check_across(case: FlexibleStage) -> None:
    """Checks between sections."""
    check_case_name(case.name)
    case.errors.require_planets(case.stage.planets)
    bore, pin = case.stage.planet.bore_diameter, case.carrier.pin_diameter
    if 0.0 < bore <= pin:
        raise Refusal(
            "carrier.pin_diameter",
            f"a pin of {pin * 1e3:g} mm does not go into the planets' bore of {bore * 1e3:g} mm",
            "lower it, or raise stage.planet.bore_diameter_mm",
        )
    half = case.stage.face_width / 2 * (1 + 1e-9)
    bands = [("fits", k, fit) for k, fit in enumerate(case.ring.fits)]
    bands += [("splines", k, spline) for k, spline in enumerate(case.ring.splines)]
    for name, k, fit in bands:
        if fit.band[0] < -half or fit.band[1] > half:
            raise Refusal(
                f"ring.{name}.{k}.z",
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
