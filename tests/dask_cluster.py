"""A Dask cluster in a process of its own, as users start one."""

import os
import socket
import subprocess
import sys
import time
from contextlib import contextmanager

SCRIPT = """
import asyncio, sys
from distributed import Nanny, Scheduler

async def main(port):
    async with Scheduler(host="127.0.0.1", port=port, dashboard=False) as scheduler:
        async with Nanny(scheduler.address, nthreads=1):
            await scheduler.finished()

if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1])))
"""


@contextmanager
def cluster():
    """Yield the address of a scheduler with one worker, which knows the tests' modules."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(port)],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=env,
    )  # fmt: skip
    try:
        for _ in range(300):
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        yield f"tcp://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(30)
