"""Runs on a Dask cluster by its address: results, errors, credentials."""

from __future__ import annotations

import math

import pytest
from dask.base import get_scheduler
from dask_cluster import cluster
from threadpoolctl import threadpool_info

from flexgear.model.errors import FlexgearError, InputError
from flexgear.studies.dask_pool import completed, reach

pytestmark = pytest.mark.slow


def job(power, number):
    if number == 3:
        raise FlexgearError("three\nis odd")
    if number == 6:
        return max((p["num_threads"] for p in threadpool_info()), default=1)
    return number**power


def test_cluster_by_address():
    with cluster() as address:
        reach(address)
        found = dict(completed(job, 2, [1, 2, 3, 6], address))
        assert [found[k].value for k in range(4)] == [1, 4, None, 1]
        assert found[2].message == "three is odd"
        # and again: it belongs to others and is left running
        found = dict(completed(math.pow, 2.0, [2.0, math.inf, "x"], address))
        assert [found[k].value for k in range(3)] == [4.0, math.inf, None]
        assert "TypeError" in found[2].message


@pytest.mark.parametrize("address", ["tls://127.0.0.1:9", "nonsense://x", "127.0.0.1:no"])
def test_an_address_that_cannot_be_called(address):
    with pytest.raises(InputError, match="--scheduler"):
        reach(address)
    assert get_scheduler() is None  # else files could not be written here any more
