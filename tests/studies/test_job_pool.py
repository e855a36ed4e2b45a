"""Jobs in processes: order, failures, processes that die, Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from interrupts import hear_interrupts
from threadpoolctl import threadpool_info

from flexgear.model.errors import FlexgearError, InputError
from flexgear.studies import job_pool
from flexgear.studies.job_pool import Outcome, run_jobs


def square(x: float) -> float:
    if x == 3:
        raise InputError("file", "key", "is wrong", "correct it")
    if x == 4:
        return 1 / 0
    return x * x


def slow_first(x: int) -> int:
    time.sleep(0.3 if x == 0 else 0.0)
    return x


def dies(x: int) -> int:
    if x == 1:
        os._exit(9)
    return x


def threads(_: int) -> int:
    np.ones((4, 4)) @ np.ones((4, 4))
    return max((p["num_threads"] for p in threadpool_info()), default=1)


def never_called(x: int) -> int:
    raise AssertionError(x)


@pytest.mark.parametrize("workers", [None, 1])
def test_results_in_order_and_failures_as_messages(workers):
    counts = []
    found = run_jobs(square, [1, 3, 4, 5], workers, counts.append)
    assert [o.value for o in found] == [1, None, None, 25]
    assert found[1].message == "file: key: is wrong -- correct it"
    assert "ZeroDivisionError" in found[2].message
    assert "\n" not in found[2].message
    assert counts == [1, 2, 3, 4]


def test_no_jobs():
    assert run_jobs(never_called, [], 2) == []


def test_processes_keep_the_order_and_one_thread_each():
    assert [o.value for o in run_jobs(slow_first, [0, 1, 2, 3], 2)] == [0, 1, 2, 3]
    assert {o.value for o in run_jobs(threads, [0, 1], 2)} == {1}


def test_a_process_that_dies_costs_its_own_job_only():
    found = run_jobs(dies, [0, 1, 2], 2)
    assert [o.value for o in found] == [0, None, 2]
    assert "memory" in found[1].message


def test_quick_jobs_start_no_processes(monkeypatch):
    monkeypatch.setattr(job_pool, "_in_processes", never_called)
    assert run_jobs(square, [1, 2]) == [Outcome(1), Outcome(4)]


def test_long_jobs_start_processes(monkeypatch):
    asked = []
    monkeypatch.setattr(job_pool, "STARTING", 0.0)
    monkeypatch.setattr(job_pool, "_in_processes", lambda f, jobs, left, *_: asked.extend(left))
    run_jobs(square, [1, 2, 5])
    assert asked == [1, 2]


def test_an_interrupt_is_passed_on():
    def stop(_: int) -> int:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_jobs(stop, [1], 1)


SCRIPT = """
import sys, time
sys.path.insert(0, {here!r})
from flexgear.studies.job_pool import run_jobs
import sleepers
if __name__ == "__main__":
    print("started", flush=True)
    run_jobs(sleepers.sleep, [sys.argv[1] + str(k) for k in range(4)], 2)
"""
SLEEPERS = """
import os, time
def sleep(path):
    with open(path, "w") as file:
        file.write(str(os.getpid()))
    time.sleep(60)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_no_process_outlives_the_one_that_started_it(tmp_path, how):
    (tmp_path / "sleepers.py").write_text(SLEEPERS)
    (tmp_path / "main.py").write_text(SCRIPT.format(here=str(tmp_path)))
    first = subprocess.Popen(
        [sys.executable, str(tmp_path / "main.py"), str(tmp_path / "pid_")],
        stderr=subprocess.PIPE,
        preexec_fn=hear_interrupts,
    )
    files = [tmp_path / "pid_0", tmp_path / "pid_1"]
    deadline = time.monotonic() + 60
    while not all(f.exists() and f.read_text() for f in files):
        assert time.monotonic() < deadline
        time.sleep(0.1)
    first.send_signal(how)
    first.communicate(timeout=30)
    workers = [int(f.read_text()) for f in files]
    deadline = time.monotonic() + 10
    while any(running(w) for w in workers):
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert not (tmp_path / "pid_3").exists()


def running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except OSError:
        return False
    return not zombie(pid)


def zombie(pid: int) -> bool:
    """Whether a process has ended and waits to be collected (by a parent that is gone)."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return False


def test_one_line_of_any_error():
    def fail(_: int) -> int:
        raise FlexgearError("two\nlines")

    assert run_jobs(fail, [0], 1)[0].message == "two lines"
