"""What all sections of a case have in common."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Annotated, Any, Self, TypeVar, get_args

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


class Section(BaseModel):
    """Frozen parameters in SI; unknown keys and wrong types are refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, ser_json_inf_nan="strings"
    )

    @classmethod
    def required(cls, data: Mapping[str, Any]) -> list[Missing]:
        """Keys that are missing in ``data`` (raw, SI) although its other keys make them
        necessary."""
        return []

    def _check(self) -> None:
        """Refusal of keys that do not fit one another; those of inherited sections come first."""

    def _refuse_set(self, keys: Iterable[str], problem: str, remedy: str = "take it out") -> None:
        """Refusal of the first of these keys whose value is not that of a key left out."""
        for key in keys:
            if getattr(self, key) != type(self).model_fields[key].default:
                raise Refusal(key, problem, remedy)

    def _require_set(self, keys: Iterable[str], problem: str, remedy: str = "") -> None:
        """Missing for the first of these keys without a value."""
        for key in keys:
            if getattr(self, key) in (None, ""):
                raise Missing(key, problem, remedy)

    def _stated(self, keys: Iterable[str] = ()) -> dict[str, Any]:
        """Values of these keys, or of all, where they are not None."""
        values = {key: getattr(self, key) for key in keys or type(self).model_fields}
        return {key: value for key, value in values.items() if value is not None}

    def _keep_one(self, key: str, other: str, because: str = "") -> None:
        """Refusal of a key that is given together with another one."""
        if getattr(self, key) is not None and getattr(self, other) is not None:
            raise Refusal(key, f"is given beside {other}{because}", "keep one of them")

    @model_validator(mode="wrap")
    @classmethod
    def _checked(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """``required`` beside pydantic's own complaints, so that all can be named at once; every
        class's ``_check`` of what has none."""
        lacks = cls.required(data) if isinstance(data, Mapping) else []
        if not lacks:
            section = handler(data)
            for base in reversed(cls.__mro__):
                if "_check" in vars(base):
                    vars(base)["_check"](section)
            return section
        lines: list[InitErrorDetails] = [
            {"type": "value_error", "loc": (), "input": data, "ctx": {"error": key}}
            for key in lacks
        ]
        try:
            handler(data)
        except ValidationError as fault:
            lines += error_details(fault)
        raise ValidationError.from_exception_data(cls.__name__, lines)


def error_details(fault: ValidationError, *below: str) -> list[InitErrorDetails]:
    """Complaints of a ValidationError to raise again, located below the fields named."""
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
    """A check between several keys of one section failed; becomes an InputError when read."""

    def __init__(self, key: str, problem: str, remedy: str) -> None:
        self.key, self.problem, self.remedy = key, problem, remedy
        super().__init__(f"{key}: {problem} -- {remedy}")


@contextmanager
def below(key: str) -> Iterator[None]:
    """Within it, the key of a Refusal stands below another one."""
    try:
        yield
    except Refusal as refusal:
        raise type(refusal)(f"{key}.{refusal.key}", refusal.problem, refusal.remedy) from None


class Missing(Refusal):
    """A key that another one makes necessary; all that are missing are named in one message."""

    def __init__(self, key: str, problem: str = "is missing", remedy: str = "") -> None:
        super().__init__(key, problem, remedy or f"add {key}")


_ONE, _MANY = "<one>", "<many>"
T = TypeVar("T")

# a section written as one table or as a list of tables; see ``takes_one``
OneOrMany = Annotated[
    Annotated[T, Tag(_ONE)] | Annotated[tuple[T, ...], Tag(_MANY)],
    Discriminator(lambda value: _MANY if isinstance(value, (list, tuple)) else _ONE),
]


def location(line: Any) -> list[str | int]:
    """Where a complaint of a ValidationError is, by fields and numbers of list elements."""
    return [p for p in line["loc"] if isinstance(p, (str, int)) and p not in (_ONE, _MANY)]


def raw_value(data: Any, *keys: str) -> Any:
    """Value at nested keys of a section, parsed or not; None without one."""
    for key in keys:
        data = data.get(key) if isinstance(data, Mapping) else getattr(data, key, None)
    return data


def _walk(annotation: Any) -> list[Any]:
    """The annotation and everything inside it (Optional, tuple, Annotated)."""
    annotations = [annotation]
    for part in get_args(annotation):
        annotations += _walk(part)
    return annotations


@cache
def quantity_of(section: type[Section], name: str) -> Quantity | None:
    """The quantity a field states, or None for a bare number, a word or a sub-section."""
    field = section.model_fields[name]
    inside = [*field.metadata, *_walk(field.annotation)]
    return next((x for x in inside if isinstance(x, Quantity)), None)


@cache
def section_of(section: type[Section], name: str) -> type[Section] | None:
    """The sub-section a field holds (directly or as a list), or None."""
    inside = _walk(section.model_fields[name].annotation)
    return next((x for x in inside if isinstance(x, type) and issubclass(x, Section)), None)


@cache
def is_list(section: type[Section], name: str) -> bool:
    """Whether a field holds a list."""
    inside = _walk(section.model_fields[name].annotation)
    return any(getattr(x, "__origin__", None) is tuple for x in inside)


@cache
def takes(section: type[Section], name: str, kind: type) -> bool:
    """Whether a field, or a list that it holds, takes values of a plain type."""
    return kind in _walk(section.model_fields[name].annotation)


def takes_one(section: type[Section], name: str) -> bool:
    """Whether a field that holds a list of sections takes a single one as well."""
    inside = _walk(section.model_fields[name].annotation)
    marks = (mark for x in inside for mark in getattr(x, "__metadata__", ()))
    return any(isinstance(mark, Tag) and mark.tag == _ONE for mark in marks)


def accepted_keys(section: type[Section]) -> list[str]:
    """Every key a section takes in TOML, the usual unit first."""
    keys: list[str] = []
    for name in section.model_fields:
        quantity = quantity_of(section, name)
        keys += [f"{name}_{s}" for s in quantity.suffixes] if quantity else [name]
    return keys


def usual_key(section: type[Section], name: str) -> str:
    """The key of a field as the bundled cases write it."""
    quantity = quantity_of(section, name)
    return f"{name}_{quantity.suffixes[0]}" if quantity else name


def limits_of(section: type[Section], name: str) -> tuple[float | None, float | None]:
    """Plausible range of a field."""
    low = high = None
    for limit in section.model_fields[name].metadata:
        low = getattr(limit, "ge", getattr(limit, "gt", low))
        high = getattr(limit, "le", getattr(limit, "lt", high))
    return low, high
