"""``flexgear doctor`` and ``flexgear cache``."""

import importlib.metadata
import json
import shutil

import numpy as np
import pytest

from flexgear.cli import system_commands
from flexgear.model.errors import FlexgearError
from flexgear.structures import store
from flexgear.structures.reduced import ReducedBody


@pytest.fixture(autouse=True)
def healthy(monkeypatch, cache):
    monkeypatch.setattr("flexgear.views.render.require_rendering", lambda: None)
    monkeypatch.setattr(system_commands, "_loads", lambda library: True)
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: ["numpy>=1.26", "x>=1; extra"])


def findings(flexgear):
    code, out, _ = flexgear("doctor", "--json")
    report = json.loads(out)
    assert report["healthy"] == (code == 0)
    return code, {one["what"]: one for one in report["findings"]}


def test_doctor_suggests_nothing_where_all_is_well(flexgear):
    code, checks = findings(flexgear)
    assert code == 0
    assert "numpy" in checks["packages"]["found"]
    assert not any(one["mend"] for one in checks.values())


def test_missing_libraries_come_with_their_line(flexgear, monkeypatch):
    monkeypatch.setattr(system_commands.sys, "platform", "linux")
    monkeypatch.setattr(system_commands, "_loads", lambda library: library != "libEGL.so.1")
    code, checks = findings(flexgear)
    assert code == 1
    assert "libEGL.so.1" in checks["system libraries"]["found"]
    assert checks["system libraries"]["mend"].endswith("libegl1")
    out = flexgear("doctor")[1]
    assert "!!  system libraries" in out
    assert "apt-get install" in out


def test_old_and_missing_packages(flexgear, monkeypatch):
    monkeypatch.setattr(
        importlib.metadata, "requires", lambda name: ["numpy>=99.1", "not-there-at-all>=1"]
    )
    packages = findings(flexgear)[1]["packages"]
    assert "is older than 99.1" in packages["found"]
    assert "not-there-at-all is missing" in packages["found"]
    assert "pip install" in packages["mend"]


def test_rendering_cache_and_disk(flexgear, monkeypatch):
    def refuses():
        raise FlexgearError("no GL")

    monkeypatch.setattr("flexgear.views.render.require_rendering", refuses)
    monkeypatch.setattr(system_commands, "_writable", lambda folder: folder.name != "cache")
    usage = shutil.disk_usage("/")._replace(free=1 << 20)
    monkeypatch.setattr(shutil, "disk_usage", lambda place: usage)
    code, checks = findings(flexgear)
    assert code == 1
    assert "no GL" in checks["rendering"]["found"]
    assert "only" in checks["results"]["found"]
    assert "cache --clear" in checks["results"]["mend"]


def test_a_place_that_cannot_be_written(flexgear, monkeypatch):
    monkeypatch.setattr(system_commands, "_writable", lambda folder: False)
    assert "FLEXGEAR_CACHE" in findings(flexgear)[1]["cache"]["mend"]


PIN = "tolerance.errors.pin_tangential.standard_deviation_um=10"
KEYS = ("a" * 64, "0123456789abcdef" * 4)


def fill(place):
    """Two bodies, a draft that a killed run left, an interrupted sweep; files of others."""
    body = ReducedBody(
        name="ring", node_names=("a",), positions=np.zeros((1, 3)), mass=np.eye(6),
        stiffness=np.eye(6), n_modes=0, report={}, points=np.zeros((4, 3)),
        cells=np.arange(4).reshape(1, 4), recovery=np.zeros((12, 6), dtype=np.float32),
    )  # fmt: skip
    for key in KEYS:
        store.cached(key, lambda: body)
    draft = place / "reduced" / ".draft.01234567.partial"
    draft.mkdir()
    (draft / "lock").write_bytes(b"")
    study = place / "sweep" / KEYS[0]
    study.mkdir(parents=True)
    (study / "one.json").write_bytes(bytes(1000))
    (place / "reduced" / "notes").write_text("mine")
    (place / "thesis.tex").write_text("mine, too")
    return place


def test_cache_prints_its_place_size_and_entries(flexgear, cache):
    place = fill(cache)
    sizes = [f.stat().st_size for key in KEYS for f in place.rglob(f"{key}/*")]
    text = json.loads(flexgear.quiet("cache", "--json"))
    assert text == {
        "place": str(place), "cleared": False, "size_bytes": sum(sizes),
        "kinds": {
            "reduced bodies": {"entries": 2, "size_bytes": sum(sizes) - 1000},
            "influences of loaded teeth": {"entries": 0, "size_bytes": 0},
            "interrupted sweeps": {"entries": 1, "size_bytes": 1000},
            "interrupted tolerance studies": {"entries": 0, "size_bytes": 0},
            "interrupted ratings": {"entries": 0, "size_bytes": 0},
            "compiled loops": {"entries": 0, "size_bytes": 0},
        },
    }  # fmt: skip
    text = flexgear.out("cache")
    assert f"kept in {place}" in text and "1 in 1 kB" in text


def test_clear_removes_what_flexgear_keeps_and_nothing_else(flexgear, cache):
    place = fill(cache)
    text = flexgear.out("cache", "--clear")
    assert f"removed from {place}" in text and "1 in 1 kB" in text
    left = sorted(str(f.relative_to(place)) for f in place.rglob("*") if f.is_file())
    assert left == ["reduced/notes", "thesis.tex"]
    (place / "thesis.tex").unlink()
    (place / "reduced" / "notes").unlink()
    assert flexgear("cache", "--clear")[0] == 0
    assert not place.exists()
    assert flexgear("cache", "--clear")[0] == 0
    code, text, _ = flexgear("cache")
    assert code == 0 and "0 in 0 B" in text


def test_a_cache_that_cannot_be_used_is_one_line_and_costs_nothing(flexgear, cache, tmp_path):
    cache.write_text("no folder")
    code, text, err = flexgear(
        "tolerance", "lin-parker", "--samples", 10, "--set", PIN, "--no-pictures", "-q",
        "--out", tmp_path / "out",
    )  # fmt: skip
    assert code == 0 and "10 samples" in text
    assert err.count("\n") == 1
    assert err.startswith("flexgear: cannot") and str(cache)[:30] in err  # long values are cut
