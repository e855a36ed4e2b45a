"""Ctrl-C before there is anything to stop, and pressed more than once."""

from __future__ import annotations

import subprocess
import sys

import pytest
from interrupts import hear_interrupts

from flexgear.cli import entry

WHILE_LOADING = """
import builtins, os, signal
real = builtins.__import__
def interrupted(name, *rest):
    if name == "typer":
        os.kill(os.getpid(), signal.SIGINT)
    return real(name, *rest)
builtins.__import__ = interrupted
from flexgear.cli import main
main(["cases"])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")
def test_while_libraries_load():
    found = subprocess.run(
        [sys.executable, "-c", WHILE_LOADING],
        capture_output=True, text=True, check=False, preexec_fn=hear_interrupts,
    )  # fmt: skip
    assert (found.returncode, found.stdout) == (1, "")
    assert found.stderr == "flexgear: stopped; nothing half-written was left\n"


def test_again_while_it_is_closing(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(entry.time, "monotonic", lambda: now[0])
    press = entry._Stop()
    with pytest.raises(KeyboardInterrupt):
        press(2, None)
    now[0] += 0.9 * entry.CLOSING
    press(2, None)
    now[0] += 0.2 * entry.CLOSING  # whatever swallowed the first
    with pytest.raises(KeyboardInterrupt):
        press(2, None)
