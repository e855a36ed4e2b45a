"""Type checks of the arguments of public functions, with InputError in place of tracebacks."""

import builtins
import inspect
import re
from collections.abc import Callable, Iterable
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
Count = Annotated[int, Field(ge=1, le=10**6)]


def _numbers(value: object) -> object:
    """The argument if it is a number or an array of numbers; ValueError otherwise."""
    try:
        array = np.asarray(value)
    except TypeError:  # a dataset
        raise ValueError from None
    if array.dtype.kind not in "iuf" or not array.size:
        raise ValueError
    return value


def _sequence(value: object) -> object:
    """Return the argument if it is a finite number or a 1-D array of them, else ValueError."""
    array = np.asarray(_numbers(value), dtype=float)
    if array.ndim > 1 or not np.isfinite(array).all():
        raise ValueError
    return value


def _number(value: object) -> object:
    """The argument if it is a finite number; ValueError for infinity, NaN, text and booleans."""
    if isinstance(value, str | bytes | bool) or value != value or value in (np.inf, -np.inf):
        raise ValueError
    return value


def _whole(value: object) -> object:
    """The argument if it is a whole number of Python or numpy; ValueError otherwise."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise ValueError
    return value


_TYPES = {  # by name in annotations
    "ArrayLike": Annotated[Any, PlainValidator(_numbers)],
    "Numbers": Annotated[Any, PlainValidator(_sequence)],
    "float": Annotated[float, BeforeValidator(_number)],
    "int": Annotated[int, BeforeValidator(_whole)],
    "str": Annotated[str, Strict()],
    "bool": Annotated[bool, Strict()],
    "Positive": Annotated[Positive, BeforeValidator(_number)],
    "Count": Annotated[Count, BeforeValidator(_whole)],
}
_DESCRIPTIONS = {  # of types, in messages
    "ArrayLike": "a number or an array of numbers",
    "Numbers": "a number or a sequence of numbers",
    "Positive": "a number above zero",
    "Count": "a whole number from 1 to 1000000",
    "Progress": "a function of the name of a step and the share of it that is done",
    "Mapping[str, Values | str | Iterable[object]]": 'ranges by key: {"stage.planets": [3, 4]}',
    "Mapping[str, object]": 'values by key: {"stage.planets": 4}',
    "Sequence[str]": 'a list of texts: ["…"]',
    "case.Case": "Case",
    "Case": "a case that fg.load_case returns",
}
_FAULTS = {  # by error type of pydantic
    "greater_than": "not positive", "greater_than_equal": "not positive",
    "less_than_equal": "too large",
}  # fmt: skip
_ARGUMENTS = {  # by command-line option, or place of an error
    "speed_range": "speeds", "torque_range": "torques", "measure": "measures", "rigid": "parts",
    "map": "block_turns", "envelope_hz": "band_hz", "output": "out",
}  # fmt: skip
# places in the errors of functions that have no file
_FUNCTIONS = ("orders", "deformed", "mode_field", "output", "sweep", "with_")


def checked(function: F, owner: str = "") -> F:
    """Decorator that checks the arguments of a function against the types of its signature.

    InputError names the function and the first argument that is unknown or of a wrong type. In an
    InputError about a command-line option, the argument of that name replaces the option; in one
    about a value, the argument with this value is named. The types are read from source text: the
    module has ``from __future__ import annotations``. owner: class of which a function is a method,
    with a dot.
    """
    parameters = inspect.signature(function).parameters
    place = f"flexgear.{owner}{function.__qualname__}()"

    @wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        try:
            _argument_validator(function)(*args, **kwargs)
        except ValidationError as fault:
            raise _wrong_argument(place, parameters, fault.errors()[0]) from None
        try:
            return function(*args, **kwargs)
        except InputError as fault:
            if fault.where not in _FUNCTIONS and not fault.where.startswith("--"):
                raise
            name = _argument_of(fault.where, parameters)
            if not name:
                arguments = inspect.signature(function).bind(*args, **kwargs).arguments
                name = next((n for n, v in arguments.items() if _holds(v, fault.key)), "")
            remedy = re.sub(
                "--[a-z]+[a-z-]*", lambda x: _argument_of(x[0], parameters) or x[0], fault.remedy
            )
            where = f"{place}: {name}" if name and name != fault.key else place
            raise InputError(where, fault.key, fault.problem, remedy) from fault

    return cast(F, called)


def _argument_of(option: str, parameters: Iterable[str]) -> str:
    """The argument for a command-line option or a place of an error; empty if there is none."""
    name = option.removeprefix("--").replace("-", "_")
    names = (_ARGUMENTS.get(name), name, name.rpartition("_")[0])
    return next((n for n in names if n and n in parameters), "")


def _holds(value: object, key: str) -> bool:
    """Whether the value of an argument is text that an error is about, or a list with it."""
    texts = value if isinstance(value, list | tuple) else (value,)
    return any(isinstance(x, str) and key in (x, echo(x)) for x in texts)


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
        arguments = [p for name, p in parameters.items() if name not in ("self", "model")]
        takes = ", ".join("**" * (p.kind is p.VAR_KEYWORD) + p.name for p in arguments)
        by_name = any(p.kind in (p.VAR_KEYWORD, p.KEYWORD_ONLY) for p in arguments)
        if isinstance(argument, int) and by_name:
            problem, takes = "one is given without its name", f"{takes}, such as name=value"
        return InputError(place, "arguments", problem, f"it takes {takes}")
    if isinstance(argument, int):
        argument = names[min(argument, len(names) - 1)]
    hint = parameters.get(argument, parameters[names[-1]]).annotation.replace(" | None", " or None")
    for name, remedy in _DESCRIPTIONS.items():
        hint = hint.replace(name, remedy)
    fault = _FAULTS.get(line["type"], "of the wrong type")
    problem = f"{echo(line['input'])} is {fault}"
    return InputError(place, argument, problem, f"give {hint}")
