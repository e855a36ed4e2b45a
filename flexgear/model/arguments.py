"""What a user hands to a public function: of the wrong type it is one clear line, not a traceback
from somewhere inside."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.errors import PydanticUserError

from flexgear.model.errors import InputError, echo

F = TypeVar("F", bound=Callable[..., Any])
# options of commands, as functions call them
ARGUMENTS = {"--set": "overrides", "--rigid": "rigid"}
_ANY = ConfigDict(arbitrary_types_allowed=True)


def checked(function: F, name: str) -> F:
    """The function, which raises InputError with its name and that of the first argument that it
    does not know or whose type is not the one of its signature."""
    signature, place = inspect.signature(function), f"flexgear.{name}()"
    adapters: dict[str, Callable[[Any], object]] = {}

    @wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError as error:
            remedy = f"it takes {', '.join(signature.parameters)}"
            raise InputError(place, "arguments", str(error), remedy) from None
        if not adapters:
            adapters.update(_adapters(function, signature))
        for argument, value in bound.arguments.items():
            try:
                adapters[argument](value)
            except (ValidationError, TypeError, ValueError):
                wanted = signature.parameters[argument].annotation
                problem = f"{echo(value)} is of the wrong type"
                raise InputError(place, argument, problem, f"give {wanted}") from None
        try:
            return function(*args, **kwargs)
        except InputError as fault:
            if fault.where not in ARGUMENTS:
                raise
            where = f"{place}: {ARGUMENTS[fault.where]}"
            raise InputError(where, fault.key, fault.problem, fault.remedy) from fault

    return cast(F, called)


def _adapters(
    function: Callable[..., Any], signature: inspect.Signature
) -> dict[str, Callable[[Any], object]]:
    """Validators by argument: each returns the value or raises."""
    several = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    return {
        name: _anything if parameter.kind in several else _adapter(parameter, function.__globals__)
        for name, parameter in signature.parameters.items()
    }


def _adapter(argument: inspect.Parameter, names: dict[str, Any]) -> Callable[[Any], object]:
    wanted = str(argument.annotation)
    if "ArrayLike" in wanted:  # a union of all that NumPy could turn into one
        optional = argument.default is None
        return lambda value: None if optional and value is None else np.asarray(value, dtype=float)
    try:
        hint = eval(wanted, names)  # an annotation of flexgear's own source
    except NameError:  # a class that its module imports for type checkers alone
        return lambda value: _require(wanted in {c.__name__ for c in type(value).__mro__})
    if inspect.isclass(hint) and hint.__module__.partition(".")[0] in ("flexgear", "xarray"):
        return lambda value: _require(isinstance(value, hint))
    try:
        return TypeAdapter(hint, config=_ANY).validate_python
    except PydanticUserError:  # models have settings of their own
        return TypeAdapter(hint).validate_python


def _require(holds: bool) -> None:
    if not holds:
        raise TypeError


def _anything(value: Any) -> None:
    """Takes every value."""
