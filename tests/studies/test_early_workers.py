"""Outcomes of runs, and workers that are made before they are needed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from interrupts import hear_interrupts
from threadpoolctl import threadpool_info

from flexgear.model.errors import FlexgearError, InputError
from flexgear.studies import early_workers
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
def test_any_error_of_a_job_is_one_line(error, message):
    def fail(shared, job):
        raise error

    assert outcome_of(fail, None, 1) == Outcome(None, message)


def test_the_outcome_of_a_job_holds_its_result():
    assert outcome_of(pow, 3, 4) == Outcome(81)


def test_a_worker_calculates_on_one_thread():
    def threads(shared, job):
        np.ones((4, 4)) @ np.ones((4, 4))
        return [p["num_threads"] for p in threadpool_info()]

    counts = on_one_thread(threads, None, None).value
    assert counts
    assert set(counts) == {1}


linux = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")
SCRIPT = """
import multiprocessing, sys, time
from test_early_workers import answers
from flexgear.studies import early_workers
early_workers.processors = lambda: 3
with early_workers.EarlyWorkers(True, dict) as workers:
    print(*[p.pid for p in multiprocessing.active_children()], flush=True)
    if sys.argv[1:]:
        time.sleep(60)
    found = dict(workers.completed(answers, "at", list(range(40))))
    print(len({o.value.split()[1] for o in found.values() if o.value}), flush=True)
    for k, outcome in sorted(found.items()):
        print(k, (outcome.value or outcome.message).split()[0], flush=True)
"""


def answers(shared, job):
    """Process of a job; job 7 fails, job 9 kills its worker, the result of job 5 cannot be sent."""
    if job == 7:
        raise ValueError("seven")
    if job in (5, 9) and os.environ.get("PARENT") != str(os.getpid()):
        if job == 5:
            return lambda: shared
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.01)
    return f"{shared}{job} {os.getpid()}"


def script(*arguments):
    folders = [os.path.dirname(__file__), *filter(None, sys.path)]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}
    code = "import os; os.environ['PARENT'] = str(os.getpid())\n" + SCRIPT
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        env=env,
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=hear_interrupts,
    )


def gone(pids):
    """Whether no process of these is there but as what its parent has not yet asked for."""
    stats = [Path(f"/proc/{pid}/stat") for pid in pids]
    return all(not s.exists() or s.read_text().rpartition(")")[2].split()[0] == "Z" for s in stats)


@linux
def test_every_job_is_answered_whatever_becomes_of_workers():
    """By two workers and this process, which repeats jobs whose worker died or could not answer."""
    with script() as process:
        try:
            pids, processes, *lines = process.communicate(timeout=60)[0].splitlines()
        finally:
            process.kill()
    assert process.returncode == 0
    assert len(pids.split()) == 2 and int(processes) >= 2
    assert len(lines) == 40
    answers = dict(line.split() for line in lines)
    assert all(answers[str(k)] == f"at{k}" for k in range(40) if k != 7)
    assert answers["7"] == "an"  # an internal error, in one line
    assert gone(pids.split())


@linux
@pytest.mark.parametrize("name", ["SIGKILL", "SIGINT"])
def test_workers_end_with_their_parent(name):
    with script("waits") as process:
        pids = process.stdout.readline().split()
        assert len(pids) == 2 and not gone(pids)
        process.send_signal(getattr(signal, name))
        process.wait(10)
    end = time.monotonic() + 10
    while not gone(pids) and time.monotonic() < end:
        time.sleep(0.05)
    assert gone(pids)


AHEAD = """
import os, sys
from concurrent.futures import wait
from flexgear.studies import early_workers
early_workers.processors = lambda: 2
with early_workers.EarlyWorkers(True, dict) as workers:
    wait([workers.ahead(os.mkdir, sys.argv[1]), workers.ahead(os.rmdir, "no such")])
    print(os.path.isdir(sys.argv[1]), *workers.completed(pow, 2, [3]))
"""


def test_work_ahead_of_jobs_is_done_elsewhere_and_may_fail(tmp_path):
    """In a process of its own, as workers are forked only where there is a single thread."""
    command = [sys.executable, "-c", AHEAD, str(tmp_path / "there")]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == f"True {(0, Outcome(8))}"


def test_one_processor_works_alone(monkeypatch):
    monkeypatch.setattr(early_workers, "processors", lambda: 1)
    with early_workers.EarlyWorkers(True, dict) as workers:
        outcomes = dict(workers.completed(pow, 2, [1, 2, 3]))
        assert workers.ahead(os.mkdir, "/no/such") is None
    assert {k: outcome.value for k, outcome in outcomes.items()} == {0: 2, 1: 4, 2: 8}
