"""gmsh leaves the process as it found it."""

import os
import signal
import subprocess
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


@pytest.mark.skipif(os.name == "nt", reason="signals are those of POSIX")
def test_a_pipe_without_a_reader_is_still_an_error():
    """gmsh would have the process die of it, silently: of a helper that is gone, of `| head`."""
    script = (
        "import os\n"
        "from flexgear.structures.fe_mesh.session import gmsh_session\n"
        "with gmsh_session('any'):\n"
        "    pass\n"
        "reader, writer = os.pipe()\n"
        "os.close(reader)\n"
        "try:\n"
        "    os.write(writer, b'x')\n"
        "except BrokenPipeError:\n"
        "    print('told')\n"
    )
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (found.returncode, found.stdout) == (0, "told\n")
