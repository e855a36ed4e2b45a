"""Runs on Dask: results, errors, lost workers, clusters by address, ends."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys

import pytest
from dask_cluster import cluster
from interrupts import hear_interrupts, processes_with, wait_until
from threadpoolctl import threadpool_info

from flexgear.model.errors import FlexgearError
from flexgear.studies.dask_pool import completed, reach
from flexgear.studies.outcome import ALL_DIED, DIED, Outcome

pytestmark = pytest.mark.slow
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")


def job(shared, number):
    """What the runs of these tests do; ``shared`` is a folder and the process of the tests."""
    folder, tests = shared
    if number == 3:
        raise FlexgearError("three\nis odd")
    if number == 6:
        return max((p["num_threads"] for p in threadpool_info()), default=1)
    if number < 0:  # takes as many workers with it
        assert os.getpid() != tests
        marks = [name for name in os.listdir(folder) if name.startswith(f"{number}_")]
        if len(marks) < -number:
            open(os.path.join(folder, f"{number}_{len(marks)}"), "w").close()
            os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def outcomes(shared, jobs, **options):
    found = dict(completed(job, shared, jobs, **options))
    return [found[k] for k in range(len(jobs))]


@posix
def test_results_errors_and_lost_workers(tmp_path):
    """A lost worker costs only its runs; a run that takes every worker with it is given up."""
    jobs = [1, 3, -1, 2, -99, 4, 5, 6]
    found = outcomes((str(tmp_path), os.getpid()), jobs, workers=2)
    assert [o.value for o in found] == [1, None, 1, 4, None, 16, 25, 1]
    assert found[1].message == "three is odd"
    assert found[4].message == DIED
    assert sorted(os.listdir(tmp_path)) == ["-1_0", "-99_0", "-99_1", "-99_2"]


def test_cluster_by_address():
    with cluster() as address:
        reach(address)
        found = outcomes(("", 0), [1, 2, 4], scheduler=address)
        assert [o.value for o in found] == [1, 4, 16]
        # and again: it belongs to others and is left running
        found = dict(completed(math.pow, 2.0, [2.0, math.inf, "x"], scheduler=address))
        assert [found[k].value for k in range(3)] == [4.0, math.inf, None]
        assert "TypeError" in found[2].message


def end_dask(tests, number):
    """Takes the scheduler with it, which is the parent of its workers."""
    assert tests not in (os.getpid(), os.getppid())
    os.kill(os.getppid(), signal.SIGKILL)


@posix
def test_runs_that_lose_dask_itself_are_failures():
    found = dict(completed(end_dask, os.getpid(), [1, 2], workers=1))
    assert found == {0: Outcome(None, ALL_DIED), 1: Outcome(None, ALL_DIED)}


def test_no_jobs():
    assert outcomes(("", 0), []) == []


SLEEPERS = """
import os, time

def sleep(folder, number):
    open(os.path.join(folder, f"began_{number}"), "w").close()
    time.sleep(600)
"""
MAIN = """
import sys
from flexgear.studies.dask_pool import completed
from sleepers import sleep
list(completed(sleep, sys.argv[1], range(4), workers=2))
"""


@posix
@pytest.mark.skipif(not os.path.isdir("/proc"), reason="looks for processes in /proc")
def test_no_process_outlives_the_one_that_started_it(tmp_path):
    """Not even where it is killed. Its script needs no ``if __name__ == "__main__"``."""
    (tmp_path / "sleepers.py").write_text(SLEEPERS)
    (tmp_path / "main.py").write_text(MAIN)
    mark, scratch = f"FLEXGEAR_TEST={tmp_path}", tmp_path / "tmp"
    scratch.mkdir()
    first = subprocess.Popen(
        [sys.executable, str(tmp_path / "main.py"), str(tmp_path)], preexec_fn=hear_interrupts,
        env={**os.environ, "FLEXGEAR_TEST": str(tmp_path), "TMPDIR": str(scratch)},
    )  # fmt: skip
    try:
        wait_until(lambda: len(list(tmp_path.glob("began_*"))) == 2 or first.poll() is not None)
        assert len(processes_with(mark)) >= 4  # itself, Dask's process, two workers
    finally:
        first.kill()
        first.wait()
    wait_until(lambda: not processes_with(mark), 20)
    assert list(scratch.glob("flexgear-*")) == []
