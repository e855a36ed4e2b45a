"""The cache of reduced bodies: whole entries or none, damaged ones made again."""

import numpy as np
import pytest

from flexgear.model.errors import FlexgearError
from flexgear.structures import store
from flexgear.structures.reduced import ReducedBody


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


@pytest.mark.parametrize("file", ["mass.npy", "recovery.npy", "header.json"])
@pytest.mark.parametrize("damage", ["cut", "gone", "flipped"])
def test_damaged_entries_are_computed_again(tmp_path, file, damage):
    store.cached("k1", body, tmp_path)
    path = tmp_path / "reduced" / "k1" / file
    content = bytearray(path.read_bytes())
    path.unlink()
    if damage == "cut":
        path.write_bytes(content[: len(content) // 2])
    elif damage == "flipped":
        content[-3] ^= 0xFF
        path.write_bytes(content)
    again = store.cached("k1", lambda: body(1), tmp_path)
    assert np.array_equal(again.mass, body(1).mass)
    assert np.array_equal(store.cached("k1", body, tmp_path).mass, body(1).mass)


def test_an_interrupted_computation_leaves_nothing(tmp_path):
    def compute():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        store.cached("k1", compute, tmp_path)
    assert not list(tmp_path.rglob("*.npy"))


def test_a_refusing_disk_is_one_clear_line(tmp_path, monkeypatch):
    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "save", full)
    with pytest.raises(FlexgearError, match=r"No space left.*FLEXGEAR_CACHE"):
        store.cached("k1", body, tmp_path)
    assert not list((tmp_path / "reduced").iterdir())


def test_directory_follows_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("FLEXGEAR_CACHE", str(tmp_path / "here"))
    assert store.cache_directory() == tmp_path / "here"
    monkeypatch.delenv("FLEXGEAR_CACHE")
    assert store.cache_directory().name == "flexgear"


def test_keys_tell_content_apart_to_the_last_digit():
    key = store.content_key(a=1.0, b=("x", 2), c=np.arange(3.0))
    assert key == store.content_key(c=np.arange(3.0), b=["x", 2], a=1.0)
    assert key != store.content_key(a=np.nextafter(1.0, 2), b=("x", 2), c=np.arange(3.0))
    assert key != store.content_key(a=1.0, b=("x", 2), c=np.array([0.0, 1.0, 2.1]))
