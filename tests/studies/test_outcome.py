"""Outcomes: errors as one line, one thread."""

from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from flexgear.model.errors import FlexgearError, InputError
from flexgear.studies.early_workers import Outcome, on_one_thread, outcome_of


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (InputError("file", "key", "is wrong", "correct it"),
         "file: key: is wrong -- correct it"),
        (FlexgearError("two\nlines"), "two lines"),
        (MemoryError(), "out of memory; choose a coarser case"),
        (ZeroDivisionError("by\nzero"),
         "an internal error, please report it (ZeroDivisionError: by zero)"),
        (KeyError(), "an internal error, please report it (KeyError: no message)"),
    ],
)  # fmt: skip
def test_one_line_of_any_error(error, message):
    def fail(shared, job):
        raise error

    assert outcome_of(fail, None, 1) == Outcome(None, message)


def test_a_result():
    assert outcome_of(pow, 3, 4) == Outcome(81)


def test_an_interrupt_is_passed_on():
    def stop(shared, job):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        outcome_of(stop, None, 1)


def test_one_thread():
    def threads(shared, job):
        np.ones((4, 4)) @ np.ones((4, 4))
        return [p["num_threads"] for p in threadpool_info()]

    found = on_one_thread(threads, None, None).value
    assert found
    assert set(found) == {1}
