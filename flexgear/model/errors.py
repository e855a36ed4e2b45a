"""Exceptions for wrong input and for failures at run time, and their texts."""

import re
from datetime import date, time

MAX_ECHO = 80  # characters of a value in a message


class FlexgearError(Exception):
    """A failure that is not due to the user's input; the message is one line."""


class FlexgearWarning(UserWarning):
    """A warning to the user; the message is one line."""


class InputError(FlexgearError):
    """Wrong input; the message is one line with file or section, key, problem and remedy."""

    def __init__(self, where: str, key: str, problem: str, remedy: str) -> None:
        self.where, self.problem, self.remedy = where, shortened(problem), shortened(remedy)
        self.key = shortened(key)
        path = where if len(where) <= 4 * MAX_ECHO else _without_middle(where, 2 * MAX_ECHO)
        super().__init__(printable(f"{path}: {self.key}: {self.problem} -- {self.remedy}"))

    def _render_traceback_(self) -> list[str]:
        """The message, which notebooks show instead of a traceback."""
        return [f"InputError: {self}"]


def printable(text: str) -> str:
    """The text in one line: line breaks and other unprintable characters become escapes (\\n)."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def echo(value: object) -> str:
    """Text of a value for messages, on one line and at most 80 characters long."""
    try:
        written = str(value) if isinstance(value, date | time) else repr(value)  # as in TOML
        text = re.sub(r"\s*\n\s*", " ", written)
    except ValueError:  # Python does not print integers of more than 4 300 digits
        text = "a whole number of thousands of digits"
    except RecursionError:
        text = "a deeply nested list"
    return text if len(text) <= MAX_ECHO else f"{text[: MAX_ECHO - 1]}…"


def shortened(text: str) -> str:
    """The text with words longer than 80 characters shortened."""
    return re.sub(rf"\S{{{MAX_ECHO + 1},}}", lambda word: _without_middle(word[0], MAX_ECHO), text)


def _without_middle(text: str, length: int) -> str:
    """The text without its middle, ``length`` characters long; of a path the file name remains."""
    half = (length - 1) // 2
    return f"{text[:half]}…{text[-half:]}"
