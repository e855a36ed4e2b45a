"""gmsh leaves the process as it found it."""

import os
import signal
import subprocess
import sys
import threading

import gmsh
import pytest

from flexgear.model.errors import FlexgearError
from flexgear.structures.fe_mesh.carrier_mesh import carrier_fe_mesh
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.session import gmsh_session

from .small_bodies import require_same, wind_carrier


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
    process = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (process.returncode, process.stdout) == (0, "told\n")


def test_meshing_works_off_the_main_thread_and_leaves_gmsh_finalised() -> None:
    meshes: list[FeMesh] = []
    threads = [
        threading.Thread(target=lambda: meshes.append(carrier_fe_mesh(wind_carrier())))
        for _ in range(2)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(meshes) == 2
    require_same(*meshes)
    assert not gmsh.isInitialized()


def test_an_exception_while_meshing_leaves_gmsh_finalised() -> None:
    def fail() -> None:
        with gmsh_session("x") as session:
            session.model.geo.addPlaneSurface([99])
            session.model.geo.synchronize()
            session.model.mesh.generate(7)

    with pytest.raises(FlexgearError, match="gmsh could not make"):
        fail()
    assert not gmsh.isInitialized()
    with pytest.raises(KeyError), gmsh_session("x"):
        raise KeyError("ours")
    assert not gmsh.isInitialized()
