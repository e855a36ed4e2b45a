"""Base class of the sections of a case, and properties of their fields."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Annotated, Any, ClassVar, Self, TypeVar, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    ModelWrapValidatorHandler,
    Tag,
    ValidationError,
    model_validator,
)
from pydantic_core import InitErrorDetails

from flexgear.model.units import Quantity

Absent = Mapping[str, tuple[str, str]]  # problem and remedy by pattern of the begin of a key


class Section(BaseModel):
    """Frozen parameters in SI; unknown keys and wrong types are refused. absent: keys that a user
    may look for, of what flexgear does not model or states elsewhere."""

    absent: ClassVar[Absent] = {}

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, ser_json_inf_nan="strings"
    )

    @classmethod
    def required(cls, data: Mapping[str, Any]) -> list[Missing]:
        """Keys missing in ``data`` (raw, SI) that its other keys require."""
        return []

    def __repr_args__(self) -> Iterator[tuple[str, Any]]:
        """Keys and values in the ``repr``: those that were stated, not the defaults."""
        keys = (key for key in type(self).model_fields if key in self.model_fields_set)
        return ((key, getattr(self, key)) for key in keys)

    def _check(self) -> None:
        """Raise Refusal for contradictory keys; checks of base classes come first."""

    def _refuse_set(self, keys: Iterable[str], problem: str, remedy: str = "take it out") -> None:
        """Raise Refusal for the first of these keys whose value is not the default."""
        for key in keys:
            if getattr(self, key) != type(self).model_fields[key].default:
                raise Refusal(key, problem, remedy)

    def _require_set(self, keys: Iterable[str], problem: str, remedy: str = "") -> None:
        """Raise Missing for the first of these keys without a value."""
        for key in keys:
            if getattr(self, key) in (None, ""):
                raise Missing(key, problem, remedy)

    def _stated(self, keys: Iterable[str] = ()) -> dict[str, Any]:
        """Values that are not None of these keys, or of all keys."""
        values = {key: getattr(self, key) for key in keys or type(self).model_fields}
        return {key: value for key, value in values.items() if value is not None}

    def _keep_one(self, key: str, other: str, because: str = "") -> None:
        """Raise Refusal if two keys are both given."""
        if getattr(self, key) is not None and getattr(self, other) is not None:
            raise Refusal(key, f"is given beside {other}{because}", "keep one of them")

    @model_validator(mode="wrap")
    @classmethod
    def _checked(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Validate; then call ``_check`` of every base class.

        Missing keys by ``required`` are reported together with pydantic's errors.
        """
        missing = cls.required(data) if isinstance(data, Mapping) else []
        if not missing:
            section = handler(data)
            for base in reversed(cls.__mro__):
                if "_check" in vars(base):
                    vars(base)["_check"](section)
            return section
        lines: list[InitErrorDetails] = [
            {"type": "value_error", "loc": (), "input": data, "ctx": {"error": key}}
            for key in missing
        ]
        try:
            handler(data)
        except ValidationError as fault:
            lines += error_details(fault)
        raise ValidationError.from_exception_data(cls.__name__, lines)


def error_details(fault: ValidationError, *below: str) -> list[InitErrorDetails]:
    """Errors of a ValidationError to raise again, with ``below`` in front of their locations."""
    return [
        {
            "type": line["type"],
            "loc": (*below, *line["loc"]),
            "input": line["input"],
            "ctx": line.get("ctx", {}),
        }
        for line in fault.errors()
    ]


class Refusal(ValueError):
    """Contradictory keys of a section; converted to InputError when a case is read."""

    def __init__(self, key: str, problem: str, remedy: str) -> None:
        self.key, self.problem, self.remedy = key, problem, remedy
        super().__init__(f"{key}: {problem} -- {remedy}")


@contextmanager
def below(key: str) -> Iterator[None]:
    """Context that puts ``key.`` in front of the key of a Refusal."""
    try:
        yield
    except Refusal as refusal:
        raise type(refusal)(f"{key}.{refusal.key}", refusal.problem, refusal.remedy) from None


class Missing(Refusal):
    """A missing key that another key requires; one message names all missing keys. Without a
    remedy the message says how to add the key, with its unit."""

    def __init__(self, key: str, problem: str = "is missing", remedy: str = "") -> None:
        super().__init__(key, problem, remedy)


_ONE, _MANY = "<one>", "<many>"
T = TypeVar("T")

# a section written as one table or as a list of tables; see ``takes_one``
OneOrMany = Annotated[
    Annotated[T, Tag(_ONE)] | Annotated[tuple[T, ...], Tag(_MANY)],
    Discriminator(lambda value: _MANY if isinstance(value, (list, tuple)) else _ONE),
]


def location(line: Any) -> list[str | int]:
    """Location of an error of a ValidationError: names of fields and indices of list elements."""
    return [p for p in line["loc"] if isinstance(p, (str, int)) and p not in (_ONE, _MANY)]


def raw_value(data: Any, *keys: str) -> Any:
    """Value at nested keys of a section or of raw data; None if there is none."""
    for key in keys:
        data = data.get(key) if isinstance(data, Mapping) else getattr(data, key, None)
    return data


def _walk(annotation: Any) -> list[Any]:
    """The annotation and all annotations nested in it (Optional, tuple, Annotated)."""
    annotations = [annotation]
    for part in get_args(annotation):
        annotations += _walk(part)
    return annotations


@cache
def quantity_of(section: type[Section], name: str) -> Quantity | None:
    """The quantity of a field, None for a bare number, a word or a section."""
    field = section.model_fields[name]
    inside = [*field.metadata, *_walk(field.annotation)]
    return next((x for x in inside if isinstance(x, Quantity)), None)


@cache
def section_of(section: type[Section], name: str) -> type[Section] | None:
    """The section that a field holds, directly or in a list, else None."""
    inside = _walk(section.model_fields[name].annotation)
    return next((x for x in inside if isinstance(x, type) and issubclass(x, Section)), None)


@cache
def is_list(section: type[Section], name: str) -> bool:
    """Whether a field holds a list."""
    inside = _walk(section.model_fields[name].annotation)
    return any(getattr(x, "__origin__", None) is tuple for x in inside)


@cache
def takes(section: type[Section], name: str, kind: type) -> bool:
    """Whether a field, or the list that it holds, has values of this type."""
    return kind in _walk(section.model_fields[name].annotation)


def takes_one(section: type[Section], name: str) -> bool:
    """Whether a field that holds a list of sections also accepts a single section."""
    inside = _walk(section.model_fields[name].annotation)
    marks = (mark for x in inside for mark in getattr(x, "__metadata__", ()))
    return any(isinstance(mark, Tag) and mark.tag == _ONE for mark in marks)


def accepted_keys(section: type[Section]) -> list[str]:
    """All TOML keys of a section, for each field with its usual unit first."""
    keys: list[str] = []
    for name in section.model_fields:
        quantity = quantity_of(section, name)
        keys += [f"{name}_{s}" for s in quantity.suffixes] if quantity else [name]
    return keys


def usual_key(section: type[Section], name: str) -> str:
    """The TOML key of a field with its usual unit."""
    quantity = quantity_of(section, name)
    return f"{name}_{quantity.suffixes[0]}" if quantity else name


def limits_of(section: type[Section], name: str) -> tuple[float | None, float | None]:
    """Lower and upper limit of a field in SI, of a list those of its values; None without one."""
    low = high = None
    field = section.model_fields[name]
    inside = (limit for x in _walk(field.annotation) for limit in getattr(x, "metadata", ()))
    for limit in (*field.metadata, *inside):
        low = getattr(limit, "ge", getattr(limit, "gt", low))
        high = getattr(limit, "le", getattr(limit, "lt", high))
    return low, high
