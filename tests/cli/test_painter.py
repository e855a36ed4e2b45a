"""Work shared with a helper process: all of it is done, whatever becomes of the helper."""

import os
import signal
import time

import pytest
from painter_jobs import Wall, dies_elsewhere, fails, fails_elsewhere, never_ends, wall, who

from flexgear.cli import painter
from flexgear.cli.painter import Painter, beside

NAMES = [f"picture {i}" for i in range(40)]


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setattr(painter, "cores", lambda: 2)


def shared(work, names=NAMES):
    colours = ("red", "blue")
    content = Wall(os.getpid(), colours)
    return Painter(content, [os.getpid(), *colours], wall, work, names)


def started(sheet, seconds=60.0):
    """Wait until the helper has taken something to do."""
    deadline = time.monotonic() + seconds
    while len(sheet._left) == len(NAMES):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_both_processes_work_on_the_same_content():
    with beside(shared(who)) as sheet:
        started(sheet)
        done = sheet.finish()
    assert set(done) == set(NAMES)
    assert {colours for _, colours in done.values()} == {("red", "blue")}
    processes = {process for process, _ in done.values()}
    assert len(processes) == 2
    assert os.getpid() in processes


def test_progress_ends_with_everything_done():
    counts = []
    with beside(shared(who)) as sheet:
        sheet.finish(counts.append)
    assert counts[-1] == len(NAMES)
    assert counts == sorted(counts)


@pytest.mark.parametrize("work", [dies_elsewhere, fails_elsewhere])
def test_what_the_helper_cannot_do_is_done_here(work):
    with beside(shared(work)) as sheet:
        started(sheet)
        assert sheet.finish() == {name: name for name in NAMES}


def test_an_error_is_that_of_this_process():
    with pytest.raises(ValueError, match="picture"), beside(shared(fails)) as sheet:
        sheet.finish()


def test_without_a_second_core_there_is_no_helper(monkeypatch):
    monkeypatch.setattr(painter, "cores", lambda: 1)
    with beside(shared(who)) as sheet:
        assert {process for process, _ in sheet.finish().values()} == {os.getpid()}
    assert sheet._helper is None


def stopped(sheet):
    with beside(sheet):
        os.kill(sheet._helper.pid, signal.SIGINT)  # while it loads
        started(sheet)
        os.kill(sheet._helper.pid, signal.SIGINT)
        time.sleep(0.2)
        assert sheet._helper.is_alive()
        raise KeyboardInterrupt


@pytest.mark.skipif(os.name == "nt", reason="signals are those of POSIX")
def test_the_helper_does_not_hear_ctrl_c_but_ends_with_the_block():
    sheet = shared(never_ends)
    with pytest.raises(KeyboardInterrupt):
        stopped(sheet)
    assert not sheet._helper.is_alive()
