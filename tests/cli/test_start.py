"""What commands load at their start, and what the package holds."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from flexgear.cli.entry import COMMANDS, UNCOMPILED, is_compiled, loaded_command
from flexgear.coupling.build import build_system
from flexgear.model.load import load_case

SOLVES = {"numba", "xarray", "pandas", "h5py", "skfem", "gmsh", "meshio", "cvxopt"}
SHOWS = {"matplotlib", "pyvista", "plotly", "PIL", "jinja2"}
MODEL = {"numpy", "scipy", "pydantic", "flexgear.model.case", "flexgear.gears"}


@cache
def loaded(*arguments):
    """Names of all modules that a command of its own has imported when it ends."""
    code = (
        "import sys, atexit\n"
        "atexit.register(lambda: print(*sys.modules, file=sys.stderr))\n"
        "from flexgear.cli import main\n"
        f"main({list(arguments)!r})\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return set(done.stderr.split()), done.stdout


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_help_and_version_load_nothing_of_what_commands_need(option):
    modules, _ = loaded(option)
    assert not modules & (MODEL | SOLVES | SHOWS)


def test_the_module_is_the_command():
    command = [sys.executable, "-m", "flexgear", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and done.stdout == loaded("--version")[1]


def test_check_loads_neither_solvers_nor_pictures():
    modules, shown = loaded("check", "wind-5mw")
    assert "input power" in shown
    assert not modules & (SOLVES | SHOWS | {"flexgear.analysis", "flexgear.views", "rich"})


def test_a_command_that_solves_compiles():
    assert is_compiled(["modes", "wind-5mw"]) and is_compiled([]) and is_compiled(["--help"])
    assert not is_compiled(["--debug", "check", "wind-5mw"])
    assert set(UNCOMPILED) < set(COMMANDS)


def test_every_line_of_the_list_is_whole_and_every_command_there():
    _, shown = loaded("--help")
    for name, home in COMMANDS.items():
        assert home.about in shown
        assert loaded_command(name).help.strip()


CASES = [
    ("wind-5mw", {}),
    ("wind-5mw", {"stage.gear_mesh.model": "face_load"}),
    ("herringbone", {}),
    ("nrel-5mw", {}),
    ("grc-750kw", {}),
]
ROLLING = """
import sys
import numpy as np
from test_start import CASES, rolling
np.savez(sys.argv[1], *[rolling(*case) for case in CASES])
assert "numba" not in sys.modules
"""


def rolling(name, keys):
    """Motions of the bodies as a train turns, its flexible ones rigid."""
    case = load_case(name, keys)
    return build_system(case, {}, case.flexible_bodies, bending=False).rolling


def test_loops_that_are_not_compiled_give_the_same(tmp_path):
    paths = os.pathsep.join([os.path.dirname(__file__), *filter(None, sys.path)])
    env = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths}
    file = tmp_path / "rolling.npz"
    subprocess.run([sys.executable, "-c", ROLLING, file], env=env, check=True, timeout=120)
    with np.load(file) as plain:
        for case, values in zip(CASES, plain.values(), strict=True):
            np.testing.assert_allclose(values, rolling(*case), rtol=1e-12, atol=1e-14)


ROOT = Path(__file__).parents[2]
DISTRIBUTION = {"skfem": "scikit-fem", "PIL": "pillow", "vtkmodules": "vtk"}


def third_party() -> set[str]:
    """Distributions of all modules that the package imports, wherever the line stands."""
    modules = set()
    for path in (ROOT / "flexgear").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                modules.add(node.module.split(".")[0])
    standard = set(sys.stdlib_module_names) | {"flexgear", "__future__"}
    return {DISTRIBUTION.get(name, name.replace("_", "-")) for name in modules - standard}


def test_imports_are_dependencies():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    names = {re.split(r"[><=\[ ]", line)[0] for line in project["dependencies"]}
    imported = third_party()
    assert imported - names == {"IPython"}  # which is there where a notebook runs
    assert names - imported == {"h5netcdf"}  # for users who open results with xarray
