"""For all tests: properties are judged by what they find, not by how long a busy machine takes.

In CI the examples are the same at every call: what is merged is not judged by a throw of dice.
Everywhere else they are new ones; what they find is a fault all the same.

Compiled loops are taken from the cache of the commands; each of the tests' processes has one
thread for products of matrices, or they get in each other's way.
"""

import gc
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "Agg")

import pytest
from hypothesis import settings

from flexgear.files.cache_folder import cache_directory

# tests give flexgear caches of their own, and compile nothing anew in each
os.environ.setdefault("NUMBA_CACHE_DIR", str(cache_directory() / "compiled"))

settings.register_profile("flexgear", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("flexgear")

gc.disable()  # to look for garbage while all tests are read takes a third of the time


def pytest_collection_finish():
    """What is imported by now stays: to look through it for garbage takes a tenth of the time."""
    gc.freeze()
    gc.enable()
    gc.set_threshold(20_000, 20, 20)


@pytest.fixture
def cache(tmp_path_factory, monkeypatch):
    """A cache of the test's own, beside ``tmp_path``; it is not there yet."""
    place = tmp_path_factory.mktemp("own") / "cache"
    monkeypatch.setenv("FLEXGEAR_CACHE", str(place))
    return place
