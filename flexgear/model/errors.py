"""Errors: what a user wrote wrongly, and what failed at run time."""

from __future__ import annotations


class FlexgearError(Exception):
    """A run failed for a reason that is not the user's input; one line."""


class FlexgearWarning(UserWarning):
    """Something was amiss and put right, or needs an eye kept on it; one line, for ``warnings``."""


class InputError(FlexgearError):
    """Something a user wrote: file or section, key, what is wrong, what to do; one line."""

    def __init__(self, where: str, key: str, problem: str, remedy: str) -> None:
        self.where, self.key, self.problem, self.remedy = where, key, problem, remedy
        super().__init__(f"{where}: {key}: {problem} -- {remedy}")
