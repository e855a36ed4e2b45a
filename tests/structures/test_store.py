"""The cache of reduced bodies: whole entries or none, damaged ones made again."""

import shutil
import signal
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from flexgear.model.errors import FlexgearWarning
from flexgear.structures import cache, store
from flexgear.structures.reduced import ReducedBody

KEY = "0123456789abcdef" * 4


def body(seed=0):
    rng = np.random.default_rng(seed)
    return ReducedBody(
        name="ring",
        node_names=("a", "b"),
        positions=rng.standard_normal((2, 3)),
        mass=rng.standard_normal((15, 15)),
        stiffness=rng.standard_normal((15, 15)),
        n_modes=3,
        report={"static_error": 0.01, "tie": "root"},
        points=rng.standard_normal((4, 3)),
        cells=np.arange(4).reshape(1, 4),
        recovery=rng.standard_normal((12, 15)).astype(np.float32),
        probe_cases=(("b", "tip"),),
        probe_loads=rng.standard_normal((2, 12, 1)),
    )


def test_round_trip(tmp_path):
    calls = []

    def compute():
        calls.append(1)
        return body()

    first = store.cached("k1", compute, tmp_path)
    again = store.cached("k1", compute, tmp_path)
    assert len(calls) == 1
    for name in ("positions", "mass", "stiffness", "points", "cells", "recovery", "probe_loads"):
        assert np.array_equal(getattr(first, name), getattr(body(), name))
        assert np.array_equal(getattr(again, name), getattr(body(), name))
    assert again.report == body().report
    assert again.node_names == ("a", "b")
    assert again.probe_cases == (("b", "tip"),)
    q = np.ones(15)
    assert np.allclose(again.recover(q), body().recover(q))


def test_a_body_that_two_need_at_once_is_computed_once(tmp_path):
    begun, shares = threading.Event(), []

    def slowly():
        begun.set()
        time.sleep(0.5)
        return body()

    with ThreadPoolExecutor() as pool:
        first = pool.submit(store.cached, "k1", slowly, tmp_path)
        begun.wait()
        again = store.cached("k1", lambda: body(1), tmp_path, shares.append)
    assert np.array_equal(first.result().mass, again.mass)
    assert shares[0] == 0.0 and shares[-1] == 1.0
    assert [entry.name for entry in (tmp_path / "reduced").iterdir()] == ["k1"]


@pytest.mark.skipif(sys.platform == "win32", reason="locks of POSIX")
def test_who_waits_for_a_process_that_is_killed_computes_the_body(tmp_path):
    """Its lock file is removed with the next entry, or when the cache is emptied."""
    text = (
        "import sys, time, pathlib; from flexgear.structures import store\n"
        "store.cached(sys.argv[2], lambda: print('begun', flush=True) or time.sleep(60), "
        "pathlib.Path(sys.argv[1]))"
    )
    command = [sys.executable, "-c", text, str(tmp_path), KEY]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        entry = store.cached(KEY, body, tmp_path, lambda _: other.kill())
        assert np.array_equal(entry.mass, body().mass)
    with subprocess.Popen(
        [*command[:-2], str(tmp_path / "b"), KEY], stdout=subprocess.PIPE
    ) as other:
        other.stdout.readline()
        other.kill()
    assert (tmp_path / "b" / "reduced" / f".{KEY}.lock").exists()
    store.cached("k2", body, tmp_path / "b")
    assert [entry.name for entry in (tmp_path / "b" / "reduced").iterdir()] == ["k2"]


def written(tmp_path):
    """The entry of a body in a cache of its own."""
    store.cached("k1", body, tmp_path)
    return tmp_path / "reduced" / "k1"


def require_repair(tmp_path):
    """A damaged entry is made again, which is said, and good from then on."""
    with pytest.warns(FlexgearWarning, match=r"k1.* is damaged .*computed again"):
        again = store.cached("k1", lambda: body(1), tmp_path)
    assert np.array_equal(again.mass, body(1).mass)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        entry = store.cached("k1", body, tmp_path)
    assert np.array_equal(entry.mass, body(1).mass)
    assert entry.report == body(1).report


@pytest.mark.parametrize("file", ["mass.npy", "recovery.npy", "header.json"])
@pytest.mark.parametrize("damage", ["cut", "empty", "gone", "folder", "dangling link"])
def test_damaged_entries_are_computed_again(tmp_path, file, damage):
    path = written(tmp_path) / file
    content = path.read_bytes()
    path.unlink()
    if damage == "cut":
        path.write_bytes(content[: len(content) // 2])
    elif damage == "empty":
        path.touch()
    elif damage == "folder":
        path.mkdir()
    elif damage == "dangling link":
        path.symlink_to(tmp_path / "nowhere")
    require_repair(tmp_path)


@pytest.mark.parametrize("file", ["mass.npy", "recovery.npy", "header.json"])
def test_no_flipped_bit_goes_unnoticed(tmp_path, file):
    """Wherever it is: names, figures, checksums of the header, heads and data of arrays."""
    path = written(tmp_path) / file
    content = path.read_bytes()
    places = np.random.default_rng(0).choice(8 * len(content), 60, replace=False)
    for at in map(int, places):
        flipped = bytearray(content)
        flipped[at // 8] ^= 1 << at % 8
        path.write_bytes(flipped)
        with pytest.warns(FlexgearWarning, match="damaged"):
            assert store.load(path.parent) is None
        written(tmp_path)
    written(tmp_path)
    path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    require_repair(tmp_path)


def test_an_entry_of_another_body_or_format_is_none(tmp_path, monkeypatch):
    """Copied under another name, or written by another version under the same."""
    entry = written(tmp_path)
    shutil.copytree(entry, entry.with_name("k2"))
    with pytest.warns(FlexgearWarning, match="k2.* is damaged"):
        assert store.load(entry.with_name("k2")) is None
    with monkeypatch.context() as patch:
        patch.setattr(store, "FORMAT", "another")
        with pytest.warns(FlexgearWarning, match="k1.* is damaged"):
            assert store.load(entry) is None


@pytest.mark.parametrize("what", ["file", "link"])
def test_a_file_in_the_place_of_an_entry_is_replaced(tmp_path, what):
    (tmp_path / "reduced").mkdir()
    if what == "file":
        (tmp_path / "reduced" / "k1").write_text("not a folder")
    else:
        (tmp_path / "reduced" / "k1").symlink_to(tmp_path / "nowhere")
    require_repair(tmp_path)


def test_an_entry_that_may_not_be_read_or_removed_costs_only_its_making(tmp_path, monkeypatch):
    entry = written(tmp_path)
    header = (entry / "header.json").read_bytes()

    def refused(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(entry), "open", refused)
    monkeypatch.setattr("os.open", refused)
    monkeypatch.setattr(shutil, "rmtree", lambda *_args, **_kwargs: None)
    with pytest.warns(FlexgearWarning, match="Permission denied"):
        assert np.array_equal(store.cached("k1", lambda: body(1), tmp_path).mass, body(1).mass)
    monkeypatch.undo()
    assert (entry / "header.json").read_bytes() == header


def test_a_cache_that_is_no_folder_costs_no_body(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.warns(FlexgearWarning, match=r"cannot keep .*FLEXGEAR_CACHE"):
        assert np.array_equal(store.cached("k1", body, tmp_path / "file").mass, body().mass)


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_a_limit_on_the_size_of_files_costs_no_body(tmp_path):
    """As a full disk or a quota in earnest: the system itself refuses."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    deaf = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.warns(FlexgearWarning, match=r"cannot keep the reduced ring in .*: \w.*;"):
            entry = store.cached("k1", body, tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, deaf)
    assert np.array_equal(entry.mass, body().mass)
    assert not list((tmp_path / "reduced").iterdir())


def test_directory_follows_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("FLEXGEAR_CACHE", str(tmp_path / "here"))
    assert store.cache_directory() == tmp_path / "here"
    monkeypatch.delenv("FLEXGEAR_CACHE")
    assert store.cache_directory().name == "flexgear"


def test_keys_tell_content_apart_to_the_last_digit():
    key = cache.content_key(a=1.0, b=("x", 2), c=np.arange(3.0))
    assert key == cache.content_key(c=np.arange(3.0), b=["x", 2], a=1.0)
    assert key != cache.content_key(a=np.nextafter(1.0, 2), b=("x", 2), c=np.arange(3.0))
    assert key != cache.content_key(a=1.0, b=("x", 2), c=np.array([0.0, 1.0, 2.1]))
