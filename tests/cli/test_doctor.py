"""``flexgear doctor``: what is missing is named with the line that mends it."""

import importlib.metadata
import json
import shutil

import pytest

from flexgear.cli import system_commands
from flexgear.model.errors import FlexgearError


@pytest.fixture(autouse=True)
def healthy(monkeypatch, tmp_path):
    monkeypatch.setenv("FLEXGEAR_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("flexgear.views.probe.require_rendering", lambda: None)
    monkeypatch.setattr(system_commands, "_loads", lambda library: True)
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: ["numpy>=1.26", "x>=1; extra"])


def findings(flexgear):
    code, out, _ = flexgear("doctor", "--json")
    found = json.loads(out)
    assert found["healthy"] == (code == 0)
    return code, {one["what"]: one for one in found["findings"]}


def test_all_is_well(flexgear):
    code, found = findings(flexgear)
    assert code == 0
    assert "numpy" in found["packages"]["found"]
    assert not any(one["mend"] for one in found.values())


def test_missing_libraries_come_with_their_line(flexgear, monkeypatch):
    monkeypatch.setattr(system_commands.sys, "platform", "linux")
    monkeypatch.setattr(system_commands, "_loads", lambda library: library != "libEGL.so.1")
    code, found = findings(flexgear)
    assert code == 1
    assert "libEGL.so.1" in found["system libraries"]["found"]
    assert found["system libraries"]["mend"].endswith("libegl1")
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

    monkeypatch.setattr("flexgear.views.probe.require_rendering", refuses)
    monkeypatch.setattr(system_commands, "_writable", lambda folder: folder.name != "cache")
    usage = shutil.disk_usage("/")._replace(free=1 << 20)
    monkeypatch.setattr(shutil, "disk_usage", lambda place: usage)
    code, found = findings(flexgear)
    assert code == 1
    assert "no GL" in found["rendering"]["found"]
    assert "only" in found["results"]["found"]
    assert "cache --clear" in found["results"]["mend"]


def test_a_place_that_cannot_be_written(flexgear, monkeypatch):
    monkeypatch.setattr(system_commands, "_writable", lambda folder: False)
    assert "FLEXGEAR_CACHE" in findings(flexgear)[1]["cache"]["mend"]
