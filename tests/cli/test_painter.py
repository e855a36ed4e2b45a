"""Work shared with a helper process: all of it is done, whatever becomes of the helper."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from painter_jobs import Wall, dies_elsewhere, fails, fails_elsewhere, never_ends, wall, who

from flexgear.cli import painter
from flexgear.cli.painter import beside

NAMES = [f"picture {i}" for i in range(40)]


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setattr(painter, "cores", lambda: 2)


def shared(work, names=NAMES):
    colours = ("red", "blue")
    content = Wall(os.getpid(), colours)
    return beside(content, [os.getpid(), *colours], wall, work, names)


def started(sheet, seconds=60.0):
    """Wait until the helper has done something, or cannot."""
    deadline = time.monotonic() + seconds
    while not sheet._given[NAMES[0]].done() and not sheet._given[NAMES[0]].running():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def process_of(pool):
    return next(iter(pool._processes.values()))


def test_both_processes_work_on_the_same_content():
    with shared(who) as sheet:
        started(sheet)
        done = sheet.finish()
    assert set(done) == set(NAMES)
    assert {colours for _, colours in done.values()} == {("red", "blue")}
    processes = {process for process, _ in done.values()}
    assert len(processes) == 2
    assert os.getpid() in processes


def test_progress_ends_with_everything_done():
    counts = []
    with shared(who) as sheet:
        sheet.finish(counts.append)
    assert counts[-1] == len(NAMES)
    assert counts == sorted(counts)


@pytest.mark.parametrize("work", [dies_elsewhere, fails_elsewhere])
def test_what_the_helper_cannot_do_is_done_here(work):
    with shared(work) as sheet:
        started(sheet)
        assert sheet.finish() == {name: name for name in NAMES}


def test_an_error_is_that_of_this_process():
    with pytest.raises(ValueError, match="picture"), shared(fails) as sheet:
        sheet.finish()


def test_without_a_second_core_there_is_no_helper(monkeypatch):
    monkeypatch.setattr(painter, "cores", lambda: 1)
    with shared(who) as sheet:
        assert {process for process, _ in sheet.finish().values()} == {os.getpid()}
    assert not sheet._given


def stopped(helpers):
    with shared(never_ends) as sheet:
        helper = process_of(helpers[0])
        os.kill(helper.pid, signal.SIGINT)  # while it loads
        started(sheet)
        os.kill(helper.pid, signal.SIGINT)
        time.sleep(0.2)
        assert helper.is_alive()
        helpers.append(helper)
        raise KeyboardInterrupt


@pytest.mark.skipif(os.name == "nt", reason="signals are those of POSIX")
def test_the_helper_does_not_hear_ctrl_c_but_ends_with_the_block(monkeypatch):
    helpers = []

    class Pool(painter.ProcessPoolExecutor):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            helpers.append(self)

    monkeypatch.setattr(painter, "ProcessPoolExecutor", Pool)
    with pytest.raises(KeyboardInterrupt):
        stopped(helpers)
    helpers[1].join(10)
    assert not helpers[1].is_alive()


@pytest.mark.skipif(os.name == "nt", reason="signals are those of POSIX")
def test_the_helper_ends_with_its_parent_however_that_ends():
    script = (
        "import os, signal\n"
        "from painter_jobs import never_ends, wall\n"
        "from flexgear.cli import painter\n"
        "painter.cores = lambda: 2\n"
        "with painter._helper() as pool:\n"
        "    print(pool.submit(os.getpid).result(), flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    folder = Path(__file__).parents[1]
    command = [sys.executable, "-c", script]
    found = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    helper, deadline = int(found.stdout), time.monotonic() + 20
    while True:
        try:
            os.kill(helper, 0)
        except ProcessLookupError:
            break
        assert time.monotonic() < deadline
        time.sleep(0.05)
