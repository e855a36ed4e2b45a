"""Errors: wrong input of a user, and failures at run time."""

from __future__ import annotations

import re

MOST_ECHOED = 80  # characters of a value that a message repeats


class FlexgearError(Exception):
    """A run failed for another reason than the user's input; one line."""


class FlexgearWarning(UserWarning):
    """A warning to the user in one line, for Python's ``warnings``."""


class InputError(FlexgearError):
    """Wrong input: file or section, key, problem, remedy; one line."""

    def __init__(self, where: str, key: str, problem: str, remedy: str) -> None:
        self.where, self.problem, self.remedy = where, shortened(problem), shortened(remedy)
        self.key = shortened(key)
        path = where if len(where) <= 4 * MOST_ECHOED else _middle(where, 2 * MOST_ECHOED)
        super().__init__(f"{path}: {self.key}: {self.problem} -- {self.remedy}")

    def _render_traceback_(self) -> list[str]:
        """The line, which a notebook shows in place of a traceback."""
        return [f"InputError: {self}"]


def echo(value: object) -> str:
    """A value as it was written, at most 80 characters of it, on one line."""
    try:
        text = re.sub(r"\s*\n\s*", " ", repr(value))
    except ValueError:  # Python does not print whole numbers of more than 4 300 digits
        text = "a whole number of thousands of digits"
    except RecursionError:
        text = "a list in lists"
    return text if len(text) <= MOST_ECHOED else f"{text[: MOST_ECHOED - 1]}…"


def shortened(text: str) -> str:
    """A text in which no word is longer than 80 characters."""
    return re.sub(rf"\S{{{MOST_ECHOED + 1},}}", lambda word: _middle(word[0], MOST_ECHOED), text)


def _middle(text: str, most: int) -> str:
    """Shorten a text to ``most`` characters by cutting out its middle: of a path the file name
    matters."""
    half = (most - 1) // 2
    return f"{text[:half]}…{text[-half:]}"
