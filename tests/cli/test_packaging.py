"""What the package imports is what it asks for; an optional import is an extra."""

import ast
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
DISTRIBUTION = {"skfem": "scikit-fem", "PIL": "pillow", "vtkmodules": "vtk"}


def third_party() -> set[str]:
    """Distributions of all modules that the package imports, wherever the line stands."""
    found = set()
    for path in (ROOT / "flexgear").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                found.add(node.module.split(".")[0])
    known = set(sys.stdlib_module_names) | {"flexgear", "__future__"}
    return {DISTRIBUTION.get(name, name.replace("_", "-")) for name in found - known}


def test_imports_are_dependencies():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    names = {re.split(r"[><=\[ ]", line)[0] for line in project["dependencies"]}
    assert third_party() - names == {"IPython"}  # which is there where a notebook runs
    assert names - third_party() == {"h5netcdf"}  # for users who open results with xarray
