"""What a user hands to a public function: of the wrong type it is one clear line, not a traceback
from somewhere inside."""

from __future__ import annotations

import builtins
import inspect
from collections.abc import Callable
from functools import cache, partial, wraps
from typing import Annotated, Any, TypeVar, cast

import numpy as np
from pydantic import ConfigDict, InstanceOf, PlainValidator, ValidationError, validate_call

from flexgear.model.errors import InputError, echo

F = TypeVar("F", bound=Callable[..., Any])
_NUMBERS = Annotated[Any, PlainValidator(lambda value: np.asarray(value, dtype=float))]


def checked(function: F) -> F:
    """The function with its arguments checked by pydantic against the types of its signature.

    InputError names the function and the first argument that is unknown or of another type. A fault
    that names an option of a command is raised with the argument of that name instead.
    """
    parameters = inspect.signature(function).parameters
    place = f"flexgear.{function.__qualname__}()"

    @wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        try:
            _acceptance(function)(*args, **kwargs)
        except ValidationError as fault:
            raise _wrong_argument(place, parameters, fault.errors()[0]) from None
        try:
            return function(*args, **kwargs)
        except InputError as fault:
            if not fault.where.startswith("--"):
                raise
            option = fault.where.removeprefix("--")
            where = f"{place}: {option}" if option in parameters else place
            raise InputError(where, fault.key, fault.problem, fault.remedy) from fault

    return cast(F, called)


@cache
def _acceptance(function: Callable[..., Any]) -> Callable[..., None]:
    """What takes the arguments of a function and raises ValidationError of those of other types."""
    signature, classes = inspect.signature(function), _Classes(function.__globals__)

    def accept(*args: Any, **kwargs: Any) -> None:
        """Nothing is done with them."""

    accept.__annotations__ = {
        name: eval(parameter.annotation, {}, classes)  # of flexgear's own source
        for name, parameter in signature.parameters.items()
        if name != "self"
    }
    accept.__signature__ = signature  # type: ignore[attr-defined]
    return validate_call(config=ConfigDict(arbitrary_types_allowed=True))(accept)


class _Classes(dict[str, Any]):
    """What names in annotations stand for: objects of flexgear are instances of their classes, not
    data to make them from; of a class that a module imports for type checkers alone, its name."""

    def __init__(self, names: dict[str, Any]) -> None:
        super().__init__(vars(builtins) | names | {"ArrayLike": _NUMBERS})

    def __getitem__(self, name: str) -> Any:
        if name not in self:
            return Annotated[Any, PlainValidator(partial(_require_class, name))]
        value = super().__getitem__(name)
        of_flexgear = inspect.isclass(value) and value.__module__.startswith("flexgear.")
        return InstanceOf[value] if of_flexgear else value  # type: ignore[misc, valid-type]


def _require_class(name: str, value: object) -> object:
    """The value if a class of that name is among those that it is an instance of."""
    if name not in {c.__name__ for c in type(value).__mro__}:
        raise ValueError(name)
    return value


def _wrong_argument(place: str, parameters: Any, line: Any) -> InputError:
    """The complaint of a ValidationError of a call."""
    names, argument = list(parameters), line["loc"][0]
    if line["type"].endswith(("_argument", "_argument_values")):
        problem = f"{line['msg'].lower()} {argument}"
        takes = ", ".join(name for name in names if name != "self")
        return InputError(place, "arguments", problem, f"it takes {takes}")
    if isinstance(argument, int):
        argument = names[min(argument, len(names) - 1)]
    hint = parameters.get(argument, parameters[names[-1]]).annotation
    hint = hint.replace("ArrayLike", "a number or an array of numbers")
    problem = f"{echo(line['input'])} is of the wrong type"
    return InputError(place, argument, problem, f"give {hint}")
