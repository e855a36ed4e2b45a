"""Runs on Dask: results, errors, lost workers, clusters by address."""

from __future__ import annotations

import math
import os
import signal

import pytest
from dask_cluster import cluster

from flexgear.model.errors import FlexgearError, InputError
from flexgear.studies.dask_pool import completed, reach, run_on
from flexgear.studies.job_pool import DIED

pytestmark = pytest.mark.slow


def job(shared, number):
    """What the runs of these tests do."""
    if number == 3:
        raise FlexgearError("three\nis odd")
    if number < 0:  # once for each worker that it takes with it
        marks = os.listdir(shared)
        if len(marks) < -number:
            open(os.path.join(shared, f"{len(marks)}"), "w").close()
            os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def outcomes(shared, jobs, **options):
    found = dict(completed(job, shared, jobs, **options))
    return [found[k] for k in range(len(jobs))]


def test_results_and_errors_come_back():
    found = outcomes("", range(6), workers=2)
    assert [o.value for o in found] == [0, 1, 4, None, 16, 25]
    assert found[3].message == "three is odd"


def test_a_lost_worker_costs_only_its_runs(tmp_path):
    found = outcomes(str(tmp_path), [1, -1, 2, 4, 5, 6], workers=2)
    assert [o.value for o in found] == [1, 1, 4, 16, 25, 36]
    assert len(os.listdir(tmp_path)) == 1


def test_a_run_that_takes_every_worker_with_it_is_given_up(tmp_path):
    found = outcomes(str(tmp_path), [1, -99, 2], workers=1)
    assert [o.value for o in found] == [1, None, 4]
    assert found[1].message == DIED


def test_cluster_by_address():
    with cluster() as address:
        reach(address)
        found = outcomes("", [1, 2, 4], scheduler=address)
        assert [o.value for o in found] == [1, 4, 16]
        # and again: it belongs to others and is left running
        counts = []
        found = run_on(address, math.sqrt, [4.0, -1.0, 9.0], counts.append)
        assert [o.value for o in found] == [2.0, None, 3.0]
        assert "ValueError" in found[1].message
        assert counts == [1, 2, 3]


def test_no_jobs():
    assert outcomes("", []) == []


def test_nobody_at_the_address():
    with pytest.raises(InputError, match=r"--scheduler: tcp://127\.0\.0\.1:1: no Dask scheduler"):
        outcomes("", [1], scheduler="tcp://127.0.0.1:1")
