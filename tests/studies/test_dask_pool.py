"""Runs on a Dask cluster by its address: results, errors, credentials."""

import math
import shlex
import socket
import subprocess
import sys
import time
from pathlib import Path

import psutil
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
        outcomes = dict(completed(job, 2, [1, 2, 3, 6], address))
        assert [outcomes[k].value for k in range(4)] == [1, 4, None, 1]
        assert outcomes[2].message == "three is odd"
        # and again: it belongs to others and is left running
        outcomes = dict(completed(math.pow, 2.0, [2.0, math.inf, "x"], address))
        assert [outcomes[k].value for k in range(3)] == [4.0, math.inf, None]
        assert "TypeError" in outcomes[2].message


@pytest.mark.parametrize("address", ["tls://127.0.0.1:9", "nonsense://x", "127.0.0.1:no"])
def test_an_address_that_cannot_be_called(address):
    with pytest.raises(InputError, match="--scheduler"):
        reach(address)
    assert get_scheduler() is None  # else files could not be written here any more


GUIDE = Path(__file__).parents[2] / "docs" / "howto" / "cluster.md"


def test_the_guide_opens_no_port_to_others(tmp_path):
    """Its first commands, as they stand there, listen at the loopback address: tasks are pickles,
    and Dask takes all addresses unless told otherwise; all others name theirs."""
    lines = [x for x in GUIDE.read_text("utf-8").splitlines() if x.startswith(("dask s", "dask w"))]
    assert len(lines) == 4 and all(" --host " in line for line in lines)
    scheduler, worker = (shlex.split(line.removesuffix("&")) for line in lines[:2])
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    replaced = {"8786": port, "tcp://127.0.0.1:8786": f"tcp://127.0.0.1:{port}", "4": "1"}
    replaced["127.0.0.1:8787"] = "127.0.0.1:0"
    started = []
    try:
        for command in (scheduler, worker):
            command = [sys.executable, "-m", *(replaced.get(word, word) for word in command)]
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            started.append(subprocess.Popen(command, cwd=tmp_path, **quiet))
            assert _waits(lambda: int(port) in {number for _, number in _listening(started)})
        assert _waits(lambda: len(_listening(started[1:])) >= 2)
        sockets = _listening(started)
        assert {address for address, _ in sockets} == {"127.0.0.1"}
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(30)


def _waits(condition):
    """Whether it comes true within a minute."""
    return any(condition() or time.sleep(0.2) for _ in range(300))


def _listening(started):
    """Addresses and ports at which processes and what they started listen."""
    every = [psutil.Process(p.pid) for p in started]
    every += [child for one in every for child in one.children(recursive=True)]
    connections = [c for one in every for c in one.net_connections("inet") if c.status == "LISTEN"]
    return {(c.laddr.ip, c.laddr.port) for c in connections}


def test_certificates_are_asked_for_before_anything_is_called(monkeypatch):
    monkeypatch.setattr("distributed.Client", None)
    with pytest.raises(InputError, match=r"names no certificates.*client\.key"):
        reach("tls://127.0.0.1:9")
