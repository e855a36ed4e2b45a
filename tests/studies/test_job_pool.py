"""Many runs here and in processes of this machine."""

import os
import signal
import subprocess
import sys

import pytest
from interrupts import hear_interrupts, listening, processes_with, wait_until
from threadpoolctl import threadpool_info

from flexgear.model.errors import FlexgearError
from flexgear.studies import dask_pool, job_pool
from flexgear.studies.early_workers import DIED, Outcome
from flexgear.studies.job_pool import completed, run_jobs


def times(shared, x):
    if x == 3:
        raise FlexgearError("three is odd")
    return shared * x


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch):
    """Jobs that were given to other processes, which do them backwards."""
    remote_jobs = []

    def completed(function, shared, jobs, _):
        remote_jobs.extend(jobs)
        for k in reversed(range(len(jobs))):
            yield k, Outcome(function(shared, jobs[k]))

    monkeypatch.setattr(job_pool, "completed", completed)
    monkeypatch.setattr(dask_pool, "completed", completed)
    monkeypatch.setattr(job_pool, "processors", lambda: 2)
    return remote_jobs


@pytest.mark.parametrize("workers", [None, 1])
def test_short_work_is_done_here(workers, elsewhere):
    outcomes = list(run_jobs(times, 2, [1, 3, 4], workers=workers))
    assert outcomes == [(0, Outcome(2)), (1, Outcome(None, "three is odd")), (2, Outcome(8))]
    assert elsewhere == []


def test_one_worker_is_this_process_however_long_it_takes(elsewhere, monkeypatch):
    monkeypatch.setattr(job_pool, "STARTING", 0.0)
    assert len(list(run_jobs(times, 2, [1, 2], workers=1))) == 2
    assert elsewhere == []


def test_long_work_goes_to_workers_but_for_the_first_job(elsewhere, monkeypatch):
    monkeypatch.setattr(job_pool, "STARTING", 0.0)
    outcomes = dict(run_jobs(times, 2, [1, 5, 7]))
    assert outcomes == {0: Outcome(2), 1: Outcome(10), 2: Outcome(14)}
    assert elsewhere == [5, 7]


def test_a_single_processor_never_starts_others(elsewhere, monkeypatch):
    monkeypatch.setattr(job_pool, "processors", lambda: 1)
    monkeypatch.setattr(job_pool, "STARTING", 1e-12)
    assert len(list(run_jobs(times, 2, [1, 2, 4]))) == 3
    assert elsewhere == []


@pytest.mark.parametrize("where", [{"workers": 2}, {"scheduler": "tcp://x:1"}])
def test_all_jobs_go_to_other_processes_where_workers_or_a_scheduler_are_set(where, elsewhere):
    assert dict(run_jobs(times, 2, [1, 2], **where)) == {0: Outcome(2), 1: Outcome(4)}
    assert elsewhere == [1, 2]


@pytest.mark.parametrize("where", [{}, {"workers": 1}, {"workers": 2}, {"scheduler": "x"}])
def test_no_jobs_have_no_outcomes(where):
    assert list(run_jobs(times, 2, [], **where)) == []


def test_an_interrupt_is_passed_on():
    def stop(shared, job):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        list(run_jobs(stop, None, [1], workers=1))


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


def outcomes(shared, jobs, workers):
    by_job = dict(completed(job, shared, jobs, workers))
    return [by_job[k] for k in range(len(jobs))]


@posix
def test_results_errors_and_lost_workers(tmp_path):
    """A lost worker costs only its runs; a run that takes every worker with it is given up."""
    jobs = [1, 3, -1, 2, -99, 4, 5, 6]
    results = outcomes((str(tmp_path), os.getpid()), jobs, workers=2)
    assert [o.value for o in results] == [1, None, 1, 4, None, 16, 25, 1]
    assert results[1].message == "three is odd"
    assert results[4].message == DIED
    assert sorted(os.listdir(tmp_path)) == ["-1_0", "-99_0", "-99_1", "-99_2"]


SLEEPERS = """
import os, time

def sleep(folder, number):
    open(os.path.join(folder, f"began_{number}"), "w").close()
    time.sleep(600)
"""
MAIN = """
import sys
from flexgear.studies.job_pool import completed
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
        assert len(processes_with(mark)) >= 3  # itself and two workers
        assert listening(processes_with(mark)) == set()
    finally:
        first.kill()
        first.wait()
    wait_until(lambda: not processes_with(mark), 20)
    wait_until(lambda: not list(scratch.iterdir()), 20)


class Counted:
    """What runs share: it is changed by each of them where it stays."""

    def __init__(self):
        self.runs = 0


def count(shared, _):
    shared.runs += 1
    return shared.runs


def test_objects_that_runs_share_are_put_together_once_in_each_worker():
    """On a worker, too: what costs seconds to put together is put together once in each."""
    runs = dict(run_jobs(count, Counted(), [0] * 6, workers=2))
    assert sorted(outcome.value for outcome in runs.values())[-1] >= 3
