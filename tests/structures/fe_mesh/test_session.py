"""gmsh leaves the process as it found it."""

import os
import signal
import sys

import pytest

from flexgear.structures.fe_mesh.session import gmsh_session


@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_are_heard_while_gmsh_works_and_after(number):
    heard = []
    before = signal.signal(number, lambda *_: heard.append(number))
    try:
        with gmsh_session("empty"):
            os.kill(os.getpid(), number)
        os.kill(os.getpid(), number)
    finally:
        signal.signal(number, before)
    assert heard == [number, number]
