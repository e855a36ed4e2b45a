"""Type checks of the arguments of public functions, with InputError in place of tracebacks."""

import builtins
import inspect
from collections.abc import Callable
from functools import cache, partial, wraps
from typing import Annotated, Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike
from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    InstanceOf,
    PlainValidator,
    Strict,
    ValidationError,
    validate_call,
)

from flexgear.model.errors import InputError, echo

F = TypeVar("F", bound=Callable[..., Any])
Numbers = ArrayLike  # a number or a sequence of numbers
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1)]


def _numbers(value: object) -> object:
    """The argument if it is a number or an array of numbers; ValueError otherwise."""
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or not array.size:
        raise ValueError
    return value


def _sequence(value: object) -> object:
    """The argument if it is a number or an array (n,) without NaN; ValueError otherwise."""
    array = np.asarray(_numbers(value), dtype=float)
    if array.ndim > 1 or np.isnan(array).any():
        raise ValueError
    return value


def _number(value: object) -> object:
    """The argument if it is a number; ValueError for NaN, text and booleans."""
    if isinstance(value, str | bytes | bool) or value != value:
        raise ValueError
    return value


_TYPES = {  # by name in annotations
    "ArrayLike": Annotated[Any, PlainValidator(_numbers)],
    "Numbers": Annotated[Any, PlainValidator(_sequence)],
    "float": Annotated[float, BeforeValidator(_number)],
    "int": Annotated[int, BeforeValidator(_number)],
    "str": Annotated[str, Strict()],
    "bool": Annotated[bool, Strict()],
    "Positive": Annotated[Positive, BeforeValidator(_number)],
    "Count": Annotated[Count, BeforeValidator(_number)],
}
_DESCRIPTIONS = {  # of types, in messages
    "ArrayLike": "a number or an array of numbers",
    "Numbers": "a number or a sequence of numbers",
    "Positive": "a number above zero",
    "Count": "a whole number above zero",
    "Progress": "a function of the name of a step and the share of it that is done",
}
_ARGUMENTS = {"speed_range": "speeds", "torque_range": "torques"}  # by command-line option


def checked(function: F) -> F:
    """Decorator that checks the arguments of a function against the types of its signature.

    InputError names the function and the first argument that is unknown or of a wrong type. In an
    InputError about a command-line option, the argument of that name replaces the option. The
    types are read from source text: the module has ``from __future__ import annotations``.
    """
    parameters = inspect.signature(function).parameters
    place = f"flexgear.{function.__qualname__}()"

    @wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        try:
            _argument_validator(function)(*args, **kwargs)
        except ValidationError as fault:
            raise _wrong_argument(place, parameters, fault.errors()[0]) from None
        try:
            return function(*args, **kwargs)
        except InputError as fault:
            if not fault.where.startswith("--"):
                raise
            option = fault.where.removeprefix("--").replace("-", "_")
            names = (option, option.rpartition("_")[0], _ARGUMENTS.get(option))
            named = [f": {name}" for name in names if name in parameters]
            where = place + "".join(named[:1])
            raise InputError(where, fault.key, fault.problem, fault.remedy) from fault

    return cast(F, called)


@cache
def _argument_validator(function: Callable[..., Any]) -> Callable[..., None]:
    """A function with the same signature that raises ValidationError for wrong arguments."""
    signature, classes = inspect.signature(function), _Classes(function.__globals__)

    def accept(*args: Any, **kwargs: Any) -> None:
        """Do nothing: pydantic checks the arguments."""

    accept.__annotations__ = {
        name: eval(parameter.annotation, {}, classes)
        for name, parameter in signature.parameters.items()
        if name != "self"
    }
    accept.__signature__ = signature  # type: ignore[attr-defined]
    return validate_call(config=ConfigDict(arbitrary_types_allowed=True))(accept)


class _Classes(dict[str, Any]):
    """Types by name in annotations. Arguments of flexgear's classes must be instances. Classes that
    a module imports only for type checkers are compared by name."""

    def __init__(self, names: dict[str, Any]) -> None:
        super().__init__(vars(builtins) | names | _TYPES)

    def __getitem__(self, name: str) -> Any:
        if name not in self:
            return Annotated[Any, PlainValidator(partial(_require_class, name))]
        value = super().__getitem__(name)
        of_flexgear = inspect.isclass(value) and value.__module__.startswith("flexgear.")
        return InstanceOf[value] if of_flexgear else value  # type: ignore[misc, valid-type]


def _require_class(name: str, value: object) -> object:
    """The value if its class or a base class has this name; ValueError otherwise."""
    if name not in {c.__name__ for c in type(value).__mro__}:
        raise ValueError
    return value


def _wrong_argument(place: str, parameters: Any, line: Any) -> InputError:
    """The InputError for one line of a call's ValidationError."""
    names, argument = list(parameters), line["loc"][0]
    if line["type"].endswith(("_argument", "_argument_values")):
        problem = f"{line['msg'].lower()} {argument}"
        takes = ", ".join(name for name in names if name != "self")
        return InputError(place, "arguments", problem, f"it takes {takes}")
    if isinstance(argument, int):
        argument = names[min(argument, len(names) - 1)]
    hint = parameters.get(argument, parameters[names[-1]]).annotation.replace(" | None", " or None")
    for name, remedy in _DESCRIPTIONS.items():
        hint = hint.replace(name, remedy)
    fault = "not positive" if line["type"].startswith("greater_than") else "of the wrong type"
    problem = f"{echo(line['input'])} is {fault}"
    return InputError(place, argument, problem, f"give {hint}")
