"""Every public name exists, and importing the package loads nothing heavy."""

import subprocess
import sys

import pytest

import flexgear


@pytest.mark.parametrize("name", flexgear.__all__)
def test_public_name_is_there(name):
    assert getattr(flexgear, name) is not None
    assert name in dir(flexgear)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nothing_like_it"):
        flexgear.nothing_like_it  # noqa: B018


def test_import_alone_is_light():
    code = "import sys, flexgear; print([m for m in ('gmsh', 'numba', 'vtk') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
