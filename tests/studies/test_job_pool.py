"""Runs here or elsewhere: what is done where, order, failures, Ctrl-C."""

from __future__ import annotations

import pytest

from flexgear.model.errors import FlexgearError
from flexgear.studies import dask_pool, job_pool
from flexgear.studies.early_workers import Outcome
from flexgear.studies.job_pool import run_jobs


def times(shared, x):
    if x == 3:
        raise FlexgearError("three is odd")
    return shared * x


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch):
    """Jobs that were given to other processes, which do them backwards."""
    given = []

    def completed(function, shared, jobs, _):
        given.extend(jobs)
        for k in reversed(range(len(jobs))):
            yield k, Outcome(function(shared, jobs[k]))

    monkeypatch.setattr(job_pool, "completed", completed)
    monkeypatch.setattr(dask_pool, "completed", completed)
    monkeypatch.setattr(job_pool, "processors", lambda: 2)
    return given


@pytest.mark.parametrize("workers", [None, 1])
def test_short_work_is_done_here(workers, elsewhere):
    found = list(run_jobs(times, 2, [1, 3, 4], workers=workers))
    assert found == [(0, Outcome(2)), (1, Outcome(None, "three is odd")), (2, Outcome(8))]
    assert elsewhere == []


def test_one_worker_is_this_process_however_long_it_takes(elsewhere, monkeypatch):
    monkeypatch.setattr(job_pool, "STARTING", 0.0)
    assert len(list(run_jobs(times, 2, [1, 2], workers=1))) == 2
    assert elsewhere == []


def test_long_work_goes_to_workers_but_for_the_first_job(elsewhere, monkeypatch):
    monkeypatch.setattr(job_pool, "STARTING", 0.0)
    found = dict(run_jobs(times, 2, [1, 5, 7]))
    assert found == {0: Outcome(2), 1: Outcome(10), 2: Outcome(14)}
    assert elsewhere == [5, 7]


def test_a_single_processor_never_starts_others(elsewhere, monkeypatch):
    monkeypatch.setattr(job_pool, "processors", lambda: 1)
    monkeypatch.setattr(job_pool, "STARTING", 1e-12)
    assert len(list(run_jobs(times, 2, [1, 2, 4]))) == 3
    assert elsewhere == []


@pytest.mark.parametrize("where", [{"workers": 2}, {"scheduler": "tcp://x:1"}])
def test_all_of_it_elsewhere_when_asked_for(where, elsewhere):
    assert dict(run_jobs(times, 2, [1, 2], **where)) == {0: Outcome(2), 1: Outcome(4)}
    assert elsewhere == [1, 2]


@pytest.mark.parametrize("where", [{}, {"workers": 1}, {"workers": 2}, {"scheduler": "x"}])
def test_no_jobs(where):
    assert list(run_jobs(times, 2, [], **where)) == []


def test_an_interrupt_is_passed_on():
    def stop(shared, job):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        list(run_jobs(stop, None, [1], workers=1))
