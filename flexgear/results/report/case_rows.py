"""The case of a run as rows of words and units, from the model itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from flexgear.model.case import Case
from flexgear.model.units import Quantity
from flexgear.results.report.parts import Row, Table
from flexgear.results.report.wording import with_unit, words

UNITS = {
    "length": "m",
    "angle": "angle",
    "time": "s",
    "frequency": "Hz",
    "rate": "1/s",
    "speed": "rad/s",
    "torque": "N m",
    "force": "N",
    "power": "W",
    "acceleration": "m/s²",
    "stiffness": "N/m",
    "rotational stiffness": "N m/rad",
    "rotational damping": "N m s/rad",
    "stiffness per face width": "N/m²",
    "modulus": "Pa",
    "density": "kg/m³",
    "mass": "kg",
    "inertia": "kg m²",
}
MOST = 12  # entries of a list that are written out


def case_tables(case: Case) -> list[Table]:
    """Every parameter: one table for each stage and each other part of the case."""
    top = [
        Row("name", case.name),
        Row("title", case.title or "–"),
        Row("kinematics", case.kinematics),
    ]
    tables = [Table("case", "general", top)]
    for stage in case.stages:
        tables.append(Table("case", words(stage.name or "stage"), list(_rows(stage))))
    for name in type(case).model_fields:
        value = getattr(case, name)
        if isinstance(value, BaseModel):
            tables.append(Table("case", words(name), list(_rows(value))))
        elif name != "stages" and isinstance(value, tuple) and value and _is_model(value[0]):
            rows = [row for k, item in enumerate(value) for row in _rows(item, f"{k + 1} · ")]
            tables.append(Table("case", words(name), rows))
    return [table for table in tables if table.rows]


def _is_model(value: Any) -> bool:
    return isinstance(value, BaseModel)


def _rows(section: BaseModel, before: str = "") -> Iterator[Row]:
    """Rows of a section and of those inside it; what is not given is left out."""
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        label = before + words(name)
        if isinstance(value, BaseModel):
            yield from _rows(value, f"{label} · ")
        elif isinstance(value, tuple) and value and _is_model(value[0]):
            for k, item in enumerate(value):
                yield from _rows(item, f"{label} {k + 1} · ")
        elif value is not None and value != ():
            unit = next((UNITS.get(m.dimension, "") for m in _marks(field)), "")
            yield Row(label, _text(value, unit))


def _marks(field: Any) -> Iterator[Quantity]:
    """Quantities that a field's annotation carries, also inside an optional or a list."""
    yield from (m for m in field.metadata if isinstance(m, Quantity))
    yield from _inside(field.annotation)


def _inside(annotation: Any) -> Iterator[Quantity]:
    yield from (m for m in getattr(annotation, "__metadata__", ()) if isinstance(m, Quantity))
    for part in getattr(annotation, "__args__", ()):
        yield from _inside(part)


def _text(value: Any, unit: str) -> str:
    if isinstance(value, tuple):
        shown = ", ".join(_text(v, unit) for v in value[:MOST])
        return shown if len(value) <= MOST else f"{shown}, … ({len(value)} values)"
    if isinstance(value, bool | str | int | float):
        return with_unit(float(value) if unit else value, unit)
    return str(value)
