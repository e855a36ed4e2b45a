"""Machine code of loops is kept for the content of all that it was made of."""

import ast
import importlib
import inspect
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numba
import pytest

import flexgear
from flexgear.compiled import SOURCES, cached, code_folder, compilation_times

ROOT = Path(flexgear.__file__).parent
CALLER = """
import warnings
with warnings.catch_warnings(record=True) as heard:
    warnings.simplefilter("always")
    {limit}
    import numba
    import numpy as np
    from flexgear.compiled import code_folder
    folder = code_folder()
    {call}
own = [str(w.message) for w in heard if w.category.__name__ == "FlexgearWarning"]
cached = folder is not None and any(folder.rglob("*.nbi"))
print(value, cached, len(own), numba.config.CACHE_DIR)
"""
SLICES = """
    from flexgear.coupling.laws.coupled_slices import forces_of
    one_slice = np.ones((1, 1)), np.zeros((1, 1)), np.array([[0.0, 1.0, 0.25]])
    value = forces_of(*one_slice)[0][0, 0]
"""
DIVISION = """
    from flexgear.structures.linalg.sparse import forward
    x = np.array([[8.0]])
    forward(np.array([0, 1]), np.array([0]), np.array([2.0]), x)
    value = x[0, 0]
"""
NO_ROOM = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (256, 256))"


def ran(place, cache, limit="pass", call=SLICES):
    """What the program prints with the package in ``place``: value, cached or not, warnings, and
    numba's own folder."""
    code = CALLER.format(limit=limit, call=call.strip())
    out = subprocess.run(
        [sys.executable, "-B", "-c", code], cwd=place, check=True,
        capture_output=True, text=True, env={"FLEXGEAR_CACHE": str(cache), "PATH": ""},
    )  # fmt: skip
    return out.stdout.split()


@pytest.fixture
def copied(tmp_path):
    """A copy of the package, to be edited."""
    ignored = shutil.ignore_patterns("__pycache__", "cases", "templates")
    shutil.copytree(ROOT, tmp_path / "flexgear", ignore=ignored)
    return tmp_path


@pytest.mark.slow
def test_an_edit_of_any_source_of_loops_compiles_anew_and_no_other_does(copied):
    cache = copied / "cache"
    # without a folder of its own: numba's setting is as empty as before
    assert ran(copied, cache) == ["4.0", "True", "0"]
    folders = list((cache / "compiled").iterdir())
    for edited in ("gears/power_flow.py", "coupling/system.py", "analysis/equilibrium.py"):
        (copied / "flexgear" / edited).open("a").write("\n# edited\n")
    ran(copied, cache)
    assert list((cache / "compiled").iterdir()) == folders
    law = copied / "flexgear" / "coupling" / "laws" / "coupled_slices.py"
    law.write_text(law.read_text().replace("left[j] = x[j]", "left[j] = 2 * x[j]", 1))
    assert ran(copied, cache)[:3] == ["8.0", "True", "0"]
    assert len(list((cache / "compiled").iterdir())) == 2


def is_source(file, sources=SOURCES):
    return file.relative_to(ROOT).as_posix().startswith(sources)


def test_all_that_is_compiled_is_among_the_sources():
    compiled = [
        file for file in ROOT.rglob("*.py")
        if re.search(r"^@(njit|compiled_law)|= njit\(", file.read_text("utf-8"), re.MULTILINE)
    ]  # fmt: skip
    assert [file for file in compiled if not is_source(file)] == []
    assert len(compiled) > 20


def data_from_elsewhere(file, sources):
    """Constants, named tuples and modules that a file imports from flexgear's files which are no
    sources; functions and other classes are no part of machine code."""
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not node.module.startswith("flexgear"):
            continue
        module = importlib.import_module(node.module)
        for alias in node.names:
            if not hasattr(module, alias.name):  # a module that nobody has imported yet
                importlib.import_module(f"{node.module}.{alias.name}")
            value = getattr(module, alias.name)
            origin = value if inspect.ismodule(value) else module
            data = not callable(value) or (isinstance(value, type) and issubclass(value, tuple))
            if data and not is_source(Path(origin.__file__), sources):
                yield f"{node.module}.{alias.name} in {file.relative_to(ROOT)}"


def test_data_of_compiled_functions_is_among_the_sources():
    files = [file for file in ROOT.rglob("*.py") if is_source(file)]
    assert [text for file in files for text in data_from_elsewhere(file, SOURCES)] == []
    fewer = tuple(source for source in SOURCES if source != "coupling/pair_data.py")
    missed = [text for file in files for text in data_from_elsewhere(file, fewer)]
    assert "flexgear.coupling.pair_data.LOAD in analysis/kernels/step.py" in missed
    assert "flexgear.coupling.pair_data.PairData in coupling/kernels/elements.py" in missed


@pytest.mark.parametrize("limit", ["pass", NO_ROOM])
def test_without_room_code_is_compiled_in_memory_and_it_is_said_once(tmp_path, limit):
    """A folder that cannot be made, and a disk that is full: no traceback, one line."""
    cache = tmp_path / "cache"
    if limit == "pass":
        cache.write_text("a file in its place")
    assert ran(ROOT.parent, cache, limit, DIVISION)[:3] == ["4.0", "False", "1"]


def test_code_of_another_level_of_optimisation_is_kept_apart():
    code = "from flexgear.compiled import fingerprint; print(fingerprint())"
    prints = {
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True,
            env={**os.environ, "NUMBA_OPT": level},
        ).stdout
        for level in ("1", "3")
    }  # fmt: skip
    assert len(prints) == 2


def test_threads_that_compile_at_once_do_not_take_the_folder_from_each_other():
    together = threading.Barrier(2)

    def compiled(wait, cache):
        """A stand-in for a decorator of numba's, which reads the folder before and after."""

        def decorate(function):
            before = numba.config.CACHE_DIR
            time.sleep(wait)
            return before, numba.config.CACHE_DIR

        return decorate

    def one(wait):
        together.wait()
        return cached(compiled, wait=wait)(len)

    with ThreadPoolExecutor(2) as pool:
        folders = list(pool.map(one, [0.1, 0.3]))
    assert folders == [(str(code_folder()), str(code_folder()))] * 2


def test_times_of_steps_are_without_compilation():
    """As the first run of a case of its kind would seem a hundred times slower."""
    function = numba.njit(lambda x: x + 1)
    with compilation_times() as first:
        begin = time.perf_counter()
        function(1.0)
        whole = time.perf_counter() - begin
    with compilation_times() as second:
        function(2.0)
    assert 0.5 * whole < sum(first) <= whole
    assert second == []


AHEAD = """
import gc
from numba.core.dispatcher import Dispatcher
import flexgear as fg
from flexgear.analysis.kernels.step import advance
from flexgear.solve.run_transients import compile_loops
case = fg.load_case("ev-reducer", **{"solver.fidelity": "quick"})
def signatures():
    trains = [f for f in gc.get_objects() if isinstance(f, Dispatcher)
              and not f.__module__.startswith("flexgear.structures")]  # of FE reductions
    return {(f.__name__, s) for f in trains for s in f.overloads}
compile_loops(case)
before = signatures()
model = case.assemble()
model.natural_modes(100.0)
model.static(angle_deg=[0.0, 1.0])
model.transient(duration=1e-3)
print(len(advance.signatures), sorted(name for name, _ in signatures() - before))
"""


@pytest.mark.slow
def test_loops_compiled_ahead_are_those_of_flexible_bodies():
    """Rigid bodies have arrays of the same types, so that nothing is left to compile."""
    run = subprocess.run([sys.executable, "-c", AHEAD], capture_output=True, text=True, check=True)
    assert run.stdout.split(maxsplit=1) == ["1", "[]\n"]
