"""What an output may replace, and that the place is tried before the work."""

import errno
import json
import os
import sys
import tempfile

import numpy as np
import pytest
import xarray as xr

from flexgear.cli import analysis, analysis_commands, run_commands
from flexgear.cli.display import by_figure
from flexgear.files import atomic
from flexgear.model.load import bundled_text
from flexgear.results.origin import Origin, origin_of

PIN = "tolerance.errors.pin_tangential.standard_deviation_um=10"
TEXT = bundled_text("lin-parker")


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(TEXT)
    return path


@pytest.fixture
def no_work(monkeypatch):
    """Nothing is computed: what is refused is refused before."""

    def worked(*_, **__):
        raise AssertionError("the work began")

    for module in (analysis, analysis_commands):
        monkeypatch.setattr(module, "assembled", worked)
    monkeypatch.setattr(run_commands, "reduced_bodies", worked)
    monkeypatch.setattr("flexgear.cli.sweep_command.run_sweep", worked)
    monkeypatch.setattr("flexgear.studies.tolerance.tolerance", worked)
    monkeypatch.setattr("flexgear.structures.sources.fe_body.FeBody.fe_mesh", worked)


def refused(result, *words):
    code, out, err = result
    assert (code, out) == (2, ""), err
    assert err.count("\n") == 1 and all(word in err for word in words), err


WRITERS = [
    ("static", "mine.toml"),
    ("modes", "mine.toml"),
    ("simulate", "mine.toml"),
    ("sweep", "mine.toml", "stage.planets=3,4"),
]


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("command", WRITERS)
def test_a_file_of_the_user_is_not_replaced(flexgear, mine, monkeypatch, command):
    monkeypatch.chdir(mine.parent)
    (mine.parent / "mine.nc").write_text("measured")
    refused(flexgear(*command, "--out", "mine.nc"), "mine.nc", "no result of mine", "--force")
    if command[0] != "sweep":
        refused(flexgear(*command, "--out", "mine.toml"), "mine.toml", "--force")
    assert mine.read_text() == TEXT
    assert (mine.parent / "mine.nc").read_text() == "measured"


def test_results_of_the_same_case_are_replaced_and_others_kept(flexgear, mine):
    out = mine.parent / "a.nc"
    assert flexgear("static", mine, "-q", "--out", out)[0] == 0
    assert origin_of(out) == Origin("mine", str(mine))
    mine.write_text(TEXT.replace("planets = 4", "planets = 3"))
    assert flexgear("modes", mine, "-q", "--out", out)[0] == 0  # edited: still the same case
    mine.write_text('name = "renamed"\n' + TEXT)
    assert flexgear("modes", mine, "-q", "--out", out)[0] == 0  # renamed: the same file
    before = out.read_bytes()
    refused(flexgear("static", "lin-parker", "-q", "--out", out), "holds a result of renamed")
    assert out.read_bytes() == before
    assert flexgear("static", "lin-parker", "-q", "--out", out, "--force")[0] == 0
    assert origin_of(out) == Origin("lin-parker", "lin-parker")


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("command", WRITERS[::3])
@pytest.mark.parametrize(
    "place", [".", "", "folder", "new/", "mine.toml/a.nc", "x" * 300, "/dev/null"]
)
def test_places_that_no_file_can_have(flexgear, mine, monkeypatch, command, place):
    monkeypatch.chdir(mine.parent)
    (mine.parent / "folder").mkdir()
    if command[0] == "sweep":
        place = {"folder": "folder.nc", ".": "", "new/": "", "x" * 300: "x" * 300 + ".nc"}.get(
            place, place
        )
        (mine.parent / "folder.nc").mkdir()
    refused(flexgear(*command, "--out", place), "name")
    assert {p.name for p in mine.parent.iterdir()} <= {"mine.toml", "folder", "folder.nc"}


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("command", ["run", "tolerance", "sweep"])
def test_a_folder_that_cannot_be_written(flexgear, mine, monkeypatch, command):
    real = os.replace

    def across(source, target):
        if str(target).endswith(".tried"):
            raise OSError(18, "Invalid cross-device link")
        real(source, target)

    monkeypatch.setattr(atomic.os, "replace", across)
    more = {"sweep": ["stage.planets=3,4"], "tolerance": ["--set", PIN]}.get(command, [])
    code, _, err = flexgear(command, mine, *more, "--out", mine.parent / "out")
    assert code == 1
    assert err.endswith("out: Invalid cross-device link\n") and err.count("\n") == 1
    assert [p.name for p in mine.parent.iterdir()] == ["mine.toml"]
    refused(flexgear(command, mine, *more, "--out", ""), "name")


@pytest.mark.parametrize("full", [["a.nc"], ["a.nc", "flexgear-"]])
def test_a_disk_that_fills_up_meanwhile(flexgear, mine, monkeypatch, tmp_path_factory, full):
    """Finished work goes to where there is room, and the message says where."""
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    monkeypatch.setattr(tempfile, "tempdir", str(elsewhere))
    real = atomic._flush_to_disk

    def refuses(path):
        if path.name == "a.nc" and (len(full) > 1 or not path.is_relative_to(elsewhere)):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(path)

    monkeypatch.setattr(atomic, "_flush_to_disk", refuses)
    code, _, err = flexgear("static", mine, "-q", "--out", mine.parent / "a.nc")
    assert code == 1 and err.count("\n") == 1
    assert "a.nc: No space left on device" in err
    files = list(elsewhere.glob("*/a.nc"))
    assert len(files) == (1 if len(full) == 1 else 0)
    assert all(err.endswith(f"kept as {path}\n") and origin_of(path) for path in files)
    assert [p.name for p in mine.parent.iterdir()] == ["mine.toml"]


def summary(folder, case="mine", **more):
    text = json.dumps({"case": case, "content_hash": "0", **more})
    folder.mkdir(exist_ok=True)
    (folder / "summary.json").write_text(text)


@pytest.mark.usefixtures("no_work")
def test_a_folder_is_replaced_only_where_it_holds_results_of_the_case(flexgear, mine):
    out = mine.parent / "out"

    def allowed(*more):
        """Whether the work would begin."""
        code, _, err = flexgear("run", mine, "--out", out, *more)
        assert code == (1 if "the work began" in err else 2), err
        return code == 1

    assert allowed()
    summary(out)
    (out / "notes.txt").write_text("the user's")
    (out / "pictures").mkdir()
    (out / "pictures" / "a.png").write_text("")
    assert allowed()
    for other in ({"case": "other"}, {"result": "tolerance"}):
        summary(out, **other)
        assert not allowed()
        assert allowed("--force")
    (out / "summary.json").unlink()
    assert not allowed()  # somebody's pictures
    summary(out, result="run")
    (out / "measured.nc").write_text("")
    assert not allowed()
    (out / "measured.nc").unlink()
    refused(flexgear("tolerance", mine, "--set", PIN, "--out", out), "holds a run of mine")
    os.mkfifo(out / "report.html")
    refused(flexgear("run", mine, "--out", out), "report.html")


def test_the_same_study_again(flexgear, mine):
    """Pictures beside datasets are replaced with them, those of others are not."""
    out = mine.parent / "out"
    command = ("sweep", mine, "stage.planets=3,4", "--measure", "frequencies", "-q", "--out", out)
    for _ in range(2):
        assert flexgear(*command)[::2] == (0, "")
    (out / "sweep.nc").unlink()
    refused(flexgear(*command), "sweep_frequenc", ".png")


def test_exported_fe_meshes_say_their_case(flexgear, tmp_path):
    from flexgear.structures.fe_mesh.fe_mesh import FeMesh
    from flexgear.structures.fe_mesh.files import fe_mesh_case, read_fe_mesh, write_fe_mesh

    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    facets = {"face": np.array([[0, 1, 3, 2]])}
    brick = FeMesh(corners, np.array([[0, 4, 2, 1, 6, 5, 3, 7]]), "hex", facets)
    for suffix in ("vtu", "msh", "inp"):
        path = tmp_path / f"a.{suffix}"
        write_fe_mesh(brick, path, "mein Fall--ü?>")
        assert fe_mesh_case(path) == "mein Fall--ü?>"
        assert origin_of(path) == Origin("mein Fall--ü?>")
        assert set(read_fe_mesh(path).facets) == {"face"}
        mesh = ("mesh", "wind-5mw", "-c", "ring", "-q", "--export", path)
        refused(flexgear(*mesh), "holds a result of mein Fall")
    write_fe_mesh(brick, path)
    assert fe_mesh_case(path) is None
    refused(flexgear("mesh", "wind-5mw", "-c", "ring", "--export", tmp_path / "a.stl"), ".stl")


def test_a_case_is_copied_over_nothing(flexgear, mine):
    mine.write_text("mine")
    refused(flexgear("cases", "lin-parker", "--copy", mine), "--force")
    refused(flexgear("cases", "lin-parker", "--copy", mine.parent), "folder")
    assert mine.read_text() == "mine"
    assert flexgear("cases", "lin-parker", "--copy", mine, "--force")[0] == 0
    assert mine.read_text() == TEXT


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("name", ["../../../escape", "..", "", "a/b", "a\\nb", " ", "x" * 300])
def test_names_that_lead_elsewhere(flexgear, mine, monkeypatch, name):
    monkeypatch.chdir(mine.parent)
    mine.write_text(f'name = "{name}"\n' + TEXT)
    for command in (
        ("check", mine),
        ("run", mine),
        ("check", "wind-5mw", "--set", f'name="{name}"'),
    ):
        refused(flexgear(*command), "name: ", "cannot name a file")
    assert [p.name for p in mine.parent.iterdir()] == ["mine.toml"]


def test_a_dataset_of_another_program_or_a_damaged_one_is_nobody_s(flexgear, mine):
    out = mine.parent / "own.nc"
    xr.Dataset({"a": ("x", [1.0, 2.0])}, attrs={"title": "mine"}).to_netcdf(out, engine="h5netcdf")
    refused(flexgear("static", mine, "-q", "--out", out), "no result of mine")
    out.write_bytes(out.read_bytes()[:1000])
    refused(flexgear("static", mine, "-q", "--out", out), "no result of mine")


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes there")
def test_names_of_files_that_are_no_text(flexgear, mine):
    odd = mine.parent / os.fsdecode(b"\xff\xfe")
    odd.mkdir()
    os.rename(mine, odd / os.fsdecode(b"\xfd.toml"))
    refused(flexgear("static", odd / os.fsdecode(b"\xfd.toml")), "name: ", "cannot name a file")
    (odd / "mine.toml").write_text(TEXT)
    out = odd / os.fsdecode(b"\xfc.nc")
    for _ in range(2):
        assert flexgear("static", odd / "mine.toml", "-q", "--out", out)[0] == 0
    refused(flexgear("check", "lin-parker", "--set", os.fsdecode(b"title=\xff")), "--set")


def test_render_of_no_run_is_an_input_fault(flexgear, tmp_path):
    refused(flexgear("render", tmp_path), "summary.json is missing")
    refused(flexgear("render", tmp_path / "nowhere"), "nowhere")
    summary(tmp_path)
    refused(flexgear("render", tmp_path), "case.json is missing")
    (tmp_path / "case.json").write_text("[" * 5000)
    refused(flexgear("render", tmp_path), "cannot be read, case.json")
    (tmp_path / "case.json").write_text("{}")
    refused(flexgear("render", tmp_path), "cannot be read, summary.json: version is missing")
    (tmp_path / "summary.json").write_text("[" * 5000)
    refused(flexgear("render", tmp_path), "cannot be read, summary.json")
    (tmp_path / "summary.json").unlink()
    os.mkfifo(tmp_path / "summary.json")
    refused(flexgear("render", tmp_path), "device or pipe")
    os.mkfifo(tmp_path / "transient.nc")
    for command in (["orders", tmp_path], ["simulate", "lin-parker", "--from", tmp_path]):
        refused(flexgear(*command), "transient.nc: dataset: is a device or pipe")


def test_rows_with_many_figures_stand_side_by_side():
    """A row a figure, in the order of the names; a dash for what one of them does not have."""
    many = {
        "a": {str(k): k for k in range(8)},
        "b": {**{str(k): -k for k in range(7)}, "x": {"y": 5}},
    }
    assert by_figure(many) == {
        "of": ["a", "b"], **{str(k): [k, -k] for k in range(7)}, "7": [7, None], "x, y": [None, 5],
    }  # fmt: skip
    few = {"a": {"force": 1.0, "angle": 2.0}}
    assert by_figure(few) is few
    assert by_figure({}) == {}
