"""Only regular files of a bounded size are read, and nothing ever waits for a pipe."""

import os
import sys

import pytest

from flexgear.model import input_file
from flexgear.model.content import file_digest
from flexgear.model.errors import InputError
from flexgear.model.load import bundled_text, load_case
from flexgear.structures.fe_mesh.files import read_fe_mesh

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes and devices are of POSIX")
CSV = {"drive.kind": "csv"}


@pytest.mark.parametrize("device", [None, "/dev/zero", "/dev/null"])
def test_pipes_and_devices_are_refused(tmp_path, device):
    path = tmp_path / "endless.inp"
    if device is None:
        os.mkfifo(path)
    else:
        path.symlink_to(device)
    for read in (
        lambda: load_case(path),
        lambda: load_case("wind-5mw", {**CSV, "drive.file": str(path)}).view(),
        lambda: read_fe_mesh(path),
    ):
        with pytest.raises(InputError, match="is a device or pipe"):
            read()
    case = load_case("wind-5mw", {"stage.ring.fe.fe_mesh_file": str(path)}).view()
    assert case.case.content_hash() and file_digest(str(path)).startswith("missing:")


def test_huge_files_are_refused_unread(tmp_path):
    for name, read in (
        ("a.toml", load_case),
        ("a.csv", lambda path: load_case("wind-5mw", {**CSV, "drive.file": str(path)}).view()),
        ("a.inp", read_fe_mesh),
    ):
        with open(tmp_path / name, "wb") as file:
            file.truncate(1 << 40)  # a file with a hole
        with pytest.raises(InputError, match=r"is larger than \d+ MB"):
            read(tmp_path / name)


def test_a_file_that_grows_is_read_no_further_than_allowed(tmp_path, monkeypatch):
    path = tmp_path / "a.toml"
    path.write_bytes(b"x" * 100)
    monkeypatch.setattr(input_file, "require_regular", lambda *_: None)
    with pytest.raises(InputError, match="is larger"):
        input_file.read_bytes(path, "case file", 99)
    assert input_file.read_bytes(path, "case file", 100) == b"x" * 100


def test_a_folder_does_not_hide_a_bundled_case(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lin-parker").mkdir()
    assert load_case("lin-parker").source == "lin-parker"
    (tmp_path / "mine").mkdir()
    with pytest.raises(InputError, match="mine: case file: is a folder"):
        load_case("mine")
    (tmp_path / "wind-5mw").write_text(bundled_text("wind-5mw").replace("[stage]", "[stagge]", 1))
    with pytest.raises(InputError, match="stagge"):
        load_case("wind-5mw").view()


@pytest.mark.parametrize("word", ["a\0b", "~nobody-of-that-name/a", "", "x" * 5000, "loop"])
def test_odd_names_of_files_are_one_line(tmp_path, monkeypatch, word):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    for read in (
        lambda: load_case(word),
        lambda: load_case(f"{word}.toml"),
        lambda: load_case("wind-5mw", {**CSV, "drive.file": word or '""'}).view(),
        lambda: load_case("nrel-5mw", {"stages.0.case": word or '""'}),
    ):
        with pytest.raises(InputError) as caught:
            read()
        assert len(str(caught.value)) < 600
