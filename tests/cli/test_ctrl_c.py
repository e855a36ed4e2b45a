"""Ctrl-C before there is anything to stop, and pressed more than once."""

import contextlib
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from interrupts import hear_interrupts

from flexgear.cli import entry, on_stop
from flexgear.solve.bodies import when_done

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


BEFORE = """
import re, signal, sys
before = set(sys.modules)
from flexgear.cli import main
print(*sorted(set(sys.modules) - before))
"""


def test_nothing_is_loaded_before_signals_are_heard():
    done = subprocess.run(
        [sys.executable, "-c", BEFORE], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["__future__", "flexgear", "flexgear.cli", "flexgear.files"]


def test_signals_that_are_ignored_stay_so(monkeypatch):
    monkeypatch.setattr(signal, "getsignal", lambda n: signal.SIG_IGN if n == signal.SIGHUP else 0)
    heard = []
    monkeypatch.setattr(signal, "signal", lambda number, handler: heard.append(number))
    on_stop(signal.SIG_DFL)
    assert heard == [signal.SIGINT, signal.SIGTERM]


@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")
def test_while_libraries_load():
    process = subprocess.run(
        [sys.executable, "-c", WHILE_LOADING],
        capture_output=True, text=True, check=False, preexec_fn=hear_interrupts,
    )  # fmt: skip
    assert (process.returncode, process.stdout) == (1, "")
    assert process.stderr == "flexgear: stopped; nothing half-written was left\n"


def test_a_second_interrupt_while_the_first_one_closes(monkeypatch):
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


def test_an_error_that_a_compiled_loop_makes_of_an_interrupt_is_a_stop(monkeypatch, capsys):
    press = entry._Stop()
    monkeypatch.setattr(signal, "getsignal", lambda number: press)
    for says in ("internal error", "flexgear: stopped; nothing half-written was left\n"):
        assert entry._report(TypeError("missing 1 required positional argument: 'sig'")) == 1
        assert says in capsys.readouterr().err
        with contextlib.suppress(KeyboardInterrupt):
            press(signal.SIGTERM, None)


def test_a_signal_that_another_thread_receives_ends_the_wait():
    """As those of job schedulers often are while bodies are reduced, for a minute."""

    def work():
        time.sleep(0.2)
        signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)
        time.sleep(3)

    begin, before = time.monotonic(), signal.signal(signal.SIGUSR1, entry._Stop())
    with ThreadPoolExecutor() as pool:
        try:
            with pytest.raises(KeyboardInterrupt):
                when_done(pool.submit(work))
            assert time.monotonic() - begin < 2
        finally:
            signal.signal(signal.SIGUSR1, before)
