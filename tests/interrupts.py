"""Commands that are interrupted as a terminal does it, and what is left of them."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

FLEXGEAR = [sys.executable, "-c", "from flexgear.cli import main; main()"]


def interrupted(arguments, cache, files, presses=1):
    """Exit code and stderr of a flexgear command that hears Ctrl-C when its cache has ``files``.

    presses: how often; the later ones hit it while it is closing.
    """
    run = subprocess.Popen(
        [*FLEXGEAR, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True, env={**os.environ, "FLEXGEAR_CACHE": str(cache)},
        preexec_fn=hear_interrupts,
    )  # fmt: skip
    try:
        wait_until(lambda: len(list(cache.glob(files))) >= 3 or run.poll() is not None)
        assert run.poll() is None, run.communicate()
        assert listening(processes_with(f"FLEXGEAR_CACHE={cache}")) == set()
        for _ in range(presses):
            os.killpg(run.pid, signal.SIGINT)
            time.sleep(0.05)
        err = run.communicate(timeout=60)[1]
    finally:
        run.kill()
    return run.returncode, err


def hear_interrupts():
    """For ``preexec_fn``: children of a shell's background job ignore SIGINT otherwise, those of
    nohup SIGHUP."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def wait_until(true, seconds=400.0):
    """AssertionError when it takes too long."""
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline, "nothing happens"
        time.sleep(0.05)


def processes_with(variable):
    """Numbers of processes that were started with this in their environment (Linux)."""
    pids = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            if variable.encode() in (place / "environ").read_bytes().split(b"\0"):
                pids.append(int(place.name))
        except OSError:  # ended, or somebody else's
            continue
    return pids


def listening(processes):
    """Ports on which any of these processes waits for TCP connections (Linux)."""
    ports = set()
    for process in processes:
        place = Path("/proc") / str(process)
        try:
            held = {os.readlink(fd) for fd in (place / "fd").iterdir()}
            tables = [(place / "net" / name).read_text() for name in ("tcp", "tcp6")]
        except OSError:  # ended meanwhile
            continue
        for line in "".join(table.partition("\n")[2] for table in tables).splitlines():
            _, local, _, state, *_, inode = line.split()[:10]
            if state == "0A" and f"socket:[{inode}]" in held:
                ports.add(int(local.rpartition(":")[2], 16))
    return ports
