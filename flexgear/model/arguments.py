"""What a user hands to a public function: of the wrong type it is one clear line, not a traceback
from somewhere inside."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.errors import PydanticUserError

from flexgear.model.errors import InputError, echo

F = TypeVar("F", bound=Callable[..., Any])
_ANY = ConfigDict(arbitrary_types_allowed=True)


def checked(function: F) -> F:
    """The function with its arguments checked against the types of its signature.

    InputError names the function and the first argument that is unknown or of another type. A fault
    that names an option of a command is raised with the argument of that name instead.
    """
    signature, place = inspect.signature(function), f"flexgear.{function.__qualname__}()"
    adapters: dict[str, Callable[[Any], object]] = {}

    @wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError as error:
            takes = ", ".join(name for name in signature.parameters if name != "self")
            raise InputError(place, "arguments", str(error), f"it takes {takes}") from None
        if not adapters:
            adapters.update(_adapters(function, signature))
        for argument, label, value in _values(bound):
            try:
                adapters[argument](value)
            except (ValidationError, TypeError, ValueError):
                problem = f"{echo(value)} is of the wrong type"
                annotation = signature.parameters[argument].annotation
                hint_text = str(annotation).replace("ArrayLike", "a number or an array of numbers")
                raise InputError(place, label, problem, f"give {hint_text}") from None
        try:
            return function(*args, **kwargs)
        except InputError as fault:
            if not fault.where.startswith("--"):
                raise
            option = fault.where.removeprefix("--")
            where = f"{place}: {option}" if option in signature.parameters else place
            raise InputError(where, fault.key, fault.problem, fault.remedy) from fault

    return cast(F, called)


def _values(bound: inspect.BoundArguments) -> Iterator[tuple[str, str, Any]]:
    """Parameter, name and value of every argument; keywords that no parameter has by their own."""
    for name, value in bound.arguments.items():
        kind = bound.signature.parameters[name].kind
        if kind == inspect.Parameter.VAR_POSITIONAL:
            yield from ((name, name, element) for element in value)
        elif kind == inspect.Parameter.VAR_KEYWORD:
            yield from ((name, key, element) for key, element in value.items())
        elif name != "self":
            yield name, name, value


def _adapters(
    function: Callable[..., Any], signature: inspect.Signature
) -> dict[str, Callable[[Any], object]]:
    """Validators by argument: each returns the value or raises."""
    return {
        name: _adapter(parameter, function.__globals__)
        for name, parameter in signature.parameters.items()
        if name != "self"
    }


def _adapter(argument: inspect.Parameter, names: dict[str, Any]) -> Callable[[Any], object]:
    hint_text = str(argument.annotation)
    optional = argument.default is None
    if hint_text.startswith("Mapping["):  # of keys and values that the function looks at
        return lambda value: _require(isinstance(value, Mapping) or (optional and value is None))
    if "ArrayLike" in hint_text:  # a union of all that NumPy could turn into one
        return lambda value: None if optional and value is None else np.asarray(value, dtype=float)
    try:
        hint = eval(hint_text, names)  # an annotation of flexgear's own source
    except NameError:  # a class that its module imports for type checkers alone
        return lambda value: _require(hint_text in {c.__name__ for c in type(value).__mro__})
    if inspect.isclass(hint) and hint.__module__.partition(".")[0] in ("flexgear", "xarray"):
        return lambda value: _require(isinstance(value, hint))
    try:
        return TypeAdapter(hint, config=_ANY).validate_python
    except PydanticUserError:  # models have settings of their own
        return TypeAdapter(hint).validate_python


def _require(holds: bool) -> None:
    if not holds:
        raise TypeError
