"""Every public name exists, and importing the package loads nothing heavy."""

import inspect
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


def test_the_face_is_small_and_one_thing_is_handed_over():
    """Whoever has a model has its case."""
    assert len(flexgear.__all__) < 24
    for name in flexgear.__all__:
        if not inspect.isfunction(function := getattr(flexgear, name)):
            continue
        found = inspect.signature(function).parameters
        assert not {"case", "model"} <= set(found), name
