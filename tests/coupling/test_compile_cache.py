"""Machine code is kept for the content of all that it was made of."""

import ast
import gc
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest
from numba import njit, typeof
from numba.core import event

import flexgear
import flexgear.coupling.compiled
from flexgear.coupling import laws
from flexgear.coupling.compile_cache import is_plain, tuple_fields

ROOT = Path(flexgear.__file__).parent
TOGETHER = (ROOT / "coupling", ROOT / "analysis")
KEEP = """
from pathlib import Path
from flexgear.coupling.compile_cache import keep_by_content
keep_by_content([Path(__file__).parent])
"""
CALLER = """
from numba import njit
from inner import part
@njit(cache=True)
def whole(x):
    return part(x) + 1.0
print(whole(1.0), sum(whole.stats.cache_hits.values()))
"""
FILES = {
    "inner.py": "from numba import njit\nfrom innermost import FACTOR, twice\n"
    "@njit(inline='always')\ndef part(x):\n    return FACTOR * twice(x)\n",
    "innermost.py": "from numba import njit\nfrom constants import FACTOR\n"
    "@njit(cache=True)\ndef twice(x):\n    return 2.0 * x\n",
    "constants.py": "FACTOR = 1.0\n",
    "beside.py": "from typing import NamedTuple\nclass Rows(NamedTuple):\n    one: int\n",
}
EDITS = {
    "inner.py": ("FACTOR * twice(x)", "5.0 + FACTOR * twice(x)", "8.0"),
    "innermost.py": ("2.0 * x", "3.0 * x", "9.0"),
    "constants.py": ("1.0", "2.0", "12.0"),
    "beside.py": ("one: int", "other: int", "12.0"),
}


def ran(folder):
    """What it gives, and how often the code was there."""
    out = subprocess.run(
        [sys.executable, "caller.py"], cwd=folder, capture_output=True, text=True, check=True
    )
    return out.stdout.split()


def test_an_edit_of_what_is_compiled_into_a_function_compiles_it_anew(tmp_path):
    """An inlined function of another file, what that calls, a constant, a named tuple's fields; and
    nothing else."""
    (tmp_path / "caller.py").write_text(KEEP + CALLER)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    assert ran(tmp_path) == ["3.0", "0"]
    (tmp_path / "beside.py").write_text(FILES["beside.py"] + "\nx = 1\n")
    assert ran(tmp_path) == ["3.0", "1"]
    for name, (old, new, result) in EDITS.items():
        (tmp_path / name).write_text(FILES[name].replace(old, new))
        assert ran(tmp_path) == [result, "0"], name


def test_fields_of_named_tuples_alone_count(tmp_path):
    (tmp_path / "a.py").write_text("class A(NamedTuple):\n    x: int  # m\n    y: float = 1.0\n")
    assert tuple_fields([tmp_path / "a.py"]) == "A: x, y"
    assert "StepData: modal, channels, elements" in tuple_fields(TOGETHER[1].glob("*.py"))


@pytest.mark.parametrize(
    "path",
    [p for f in TOGETHER for p in sorted(f.rglob("*.py")) if "@njit" in p.read_text("utf-8")],
    ids=lambda p: p.stem,
)
def test_all_that_compiled_functions_take_from_other_files_is_in_their_stamps(path):
    """Compiled functions and plain constants; and every stamp is a text of that."""
    dotted = ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
    module = importlib.import_module(dotted.removesuffix(".__init__"))
    own = [
        f for f in vars(module).values()
        if hasattr(f, "py_func") and f.py_func.__module__ == module.__name__
    ]  # fmt: skip
    for function in own:
        used = set(function.py_func.__code__.co_names) & imported(module)
        for name in used:
            value = vars(module)[name]
            assert hasattr(value, "py_func") or is_plain(value), f"{function}: {name}"
        if hasattr(function._cache, "_impl"):
            assert isinstance(function._cache._impl.locator.get_source_stamp(), str)


def compiled_from(module):
    """Names of all modules whose compiled functions go into those of a module."""
    found = {f.py_func.__module__ for f in vars(module).values() if hasattr(f, "py_func")}
    others = found - {module.__name__}
    return others.union(*(compiled_from(sys.modules[name]) for name in others))


def test_a_law_that_is_added_compiles_no_solver_anew():
    """It enters in ``coupling/laws/__init__.py``, of which no solver is made, and solvers take as
    many laws whatever their number."""
    solvers = [
        p for p in sorted((ROOT / "analysis").glob("*.py")) if "@njit" in p.read_text("utf-8")
    ]
    assert len(solvers) > 5
    for path in solvers:
        module = importlib.import_module(f"flexgear.analysis.{path.stem}")
        assert laws.__name__ not in compiled_from(module), path.stem
        assert not any(value is laws.LAWS for value in vars(module).values()), path.stem
    every = laws.functions(range(len(laws.LAWS)))
    assert len(every) == len(laws.functions([])) == laws.ROOM > len(laws.LAWS)
    assert len({typeof(one) for one in every}) == 1


def imported(module):
    """Names that a module takes from others of flexgear."""
    nodes = ast.walk(ast.parse(inspect.getsource(module)))
    froms = (n for n in nodes if isinstance(n, ast.ImportFrom))
    ours = (n for n in froms if (n.module or "").startswith("flexgear."))
    return {alias.asname or alias.name for node in ours for alias in node.names}


WITHOUT_ROOM = """
import resource
from numba import njit
from flexgear.coupling.compile_cache import live_without_room
live_without_room()
resource.setrlimit(resource.RLIMIT_FSIZE, (256, 256))  # a file cut short, as on a full disk
@njit(cache=True)
def twice(x):
    return 2.0 * x
print(twice(1.0), sum(twice.stats.cache_hits.values()))
"""


def test_code_that_cannot_be_kept_runs_all_the_same(tmp_path):
    (tmp_path / "caller.py").write_text(WITHOUT_ROOM)
    assert ran(tmp_path) == ran(tmp_path) == ["2.0", "0"]


OF_A_CLASS = """
from numba import njit
from flexgear.coupling.compile_cache import live_without_room
from classes import {0} as Kept
live_without_room()
@njit(cache=True)
def first(x):
    return x[0]
print(first(Kept(1.0)), sum(first.stats.cache_hits.values()))
"""


def test_code_kept_for_a_class_that_is_no_more_is_compiled_again_and_kept(tmp_path):
    """As of an older version in the same place."""
    kept = "from typing import NamedTuple\nclass {}(NamedTuple):\n    one: float\n"
    for name, hits in (("Old", "0"), ("Old", "1"), ("New", "0"), ("New", "1")):
        (tmp_path / "classes.py").write_text(kept.format(name))
        (tmp_path / "caller.py").write_text(OF_A_CLASS.format(name))
        assert ran(tmp_path) == ["1.0", hits]


class Watch(event.Listener):
    """Whether Python collects garbage when compilations begin."""

    def __init__(self):
        self.seen = []

    def on_start(self, event):
        self.seen.append(gc.isenabled())

    def on_end(self, event):
        pass


@pytest.mark.parametrize("collects", [True, False])
def test_garbage_is_not_collected_while_code_is_compiled_and_as_before_afterwards(collects):
    def fails(x):
        return unknown_name(x)  # noqa: F821

    inner = njit(lambda x: x + 1)
    outer = njit(lambda x: inner(x))
    (gc.enable if collects else gc.disable)()
    try:
        with event.install_listener("numba:compile", Watch()) as watch:
            assert outer(1) == 2
            with pytest.raises(Exception, match="unknown_name"):
                njit(fails)(1)
        assert watch.seen == [False, False, False]
        assert gc.isenabled() is collects
    finally:
        gc.enable()


NOWHERE = """
import os, warnings
from numba.core import caching
caching.CacheImpl._locator_classes.clear()  # as numba does it where no folder can be written
with warnings.catch_warnings(record=True) as heard:
    warnings.simplefilter("always")
    from flexgear.analysis import many_errors, transient
    from flexgear.coupling import laws
    from flexgear.structures.cyclic import projection
    from flexgear.structures.linalg import elimination, tall_products
own = [str(w.message) for w in heard if w.category.__name__ == "FlexgearWarning"]
energy, force, _ = laws.respond(laws.LINEAR_LAW, [3.0, 0.0], __import__("numpy").ones((2, 1)))
print(len(own), "NUMBA_CACHE_DIR" in own[0], force[0, 0])
"""


def test_without_a_folder_code_is_compiled_in_memory_and_it_is_said_once(tmp_path):
    """A read-only container and a user without a home: no traceback, one line, also for workers."""
    (tmp_path / "caller.py").write_text(NOWHERE)
    assert ran(tmp_path) == ["1", "True", "3.0"]
