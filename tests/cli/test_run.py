"""run and render on cheap bodies: every file, the summary's keys, pictures again."""

import json
import shutil

import pytest
from stage_samples import doubtful_stage

from flexgear.cli import pictures, run_commands
from flexgear.cli.entry import run
from flexgear.model.errors import FlexgearError
from flexgear.results import dataset_file
from flexgear.results.dataset_file import load
from flexgear.results.stage_part import stage_part
from flexgear.results.summary import missing_keys
from flexgear.studies.early_workers import Outcome

FAST = [
    "--set", "solver.gear_mesh_orders=5",
    "--set", "solver.time_step_s=2e-4",
    "--set", "solver.step_time_step_s=5e-5",
    "--set", "drive.steps.torques_nm=[2e6]",
    "--set", "drive.steps.start_s=0.1",
    "--set", "drive.steps.duration_s=0.05",
    "--set", "inputs.0.speed_rpm=40",
]  # fmt: skip


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Folder, exit code and warnings of one run without pictures, shared by the tests."""
    warnings = []
    out = tmp_path_factory.mktemp("results") / "mine"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flexgear.solve.bodies.stage_bodies", lambda s, *_: doubtful_stage(s))
        patch.setattr(run_commands, "warn", warnings.extend)
        code = run(["run", "wind-5mw", "--no-pictures", "--out", str(out), *FAST])
    return out, code, warnings


@pytest.fixture(scope="module")
def content(finished):
    """What is read from the folder, for tests that change nothing of it."""
    return run_commands.read_folder(finished[0])


def test_a_case_of_a_version_with_other_keys_is_one_line(flexgear, finished, tmp_path):
    shutil.copy(finished[0] / "summary.json", tmp_path)
    case = json.loads((finished[0] / "case.json").read_text()) | {"an_earlier_key": 1}
    (tmp_path / "case.json").write_text(json.dumps(case))
    says = "case.json: an_earlier_key is not as in this version's cases -- run the case again"
    flexgear.refused("render", tmp_path, says=[says])


def test_run_writes_results_and_summary(finished, content):
    out, code, warnings = finished
    assert code == 0
    summary = json.loads((out / "summary.json").read_text())
    assert len(warnings) == 1
    assert warnings == summary["warnings"]  # others stand beside their figures
    assert not {*warnings} & {one["sentence"] for one in summary["neglected"]}
    assert missing_keys(summary) == []
    assert summary["case"] == "wind-5mw"
    assert summary["timing_s"]["bodies"] >= 0
    data = load(out / "torque_step_2e6.nc")
    assert data.attrs["content_hash"] == summary["content_hash"]
    assert stage_part(data, "stage")["gear_mesh_force"].attrs["units"] == "N"
    assert [p.name for p in out.parent.iterdir()] == ["mine"]  # no stage left behind


@pytest.mark.slow
@pytest.mark.usefixtures("no_pixels")
@pytest.mark.parametrize("broken", ["draw", "write_report"])
def test_pictures_that_fail_cost_no_results(monkeypatch, tmp_path, capsys, broken):
    """Whatever the drawing does, a bug of its own included: the work before it is not lost."""

    def fails(*_):
        raise ValueError("no room for a label")

    out, short = tmp_path / "mine", ["--set", "solver.duration_s=0.02"]
    with monkeypatch.context() as patch:
        patch.setattr(pictures, broken, fails)
        assert run(["run", "lin-parker", "--quiet", "--out", str(out), *short]) == 1
    (warning,) = (line for line in capsys.readouterr().err.splitlines() if "pictures" in line)
    assert (
        "no room for a label" in warning and f"complete in {out}" in warning and "render" in warning
    )
    summary = json.loads((out / "summary.json").read_text())
    assert missing_keys(summary) == []
    assert load(out / "transient.nc").sizes["time"] > 10
    assert [p.name for p in tmp_path.iterdir()] == ["mine"]
    assert run(["render", str(out), "--quiet"]) == 0  # as the message says
    assert (out / "report.html").exists()


def test_a_finished_folder_is_read_again(content):
    assert content.case.content_hash() == content.summary["content_hash"]
    assert list(content.rings[0].runs("transient")) == ["flexible", "rigid"]
    assert set(content.fields) == {"stage.ring", "stage.carrier"}


def test_large_datasets_are_read_piece_by_piece(finished, content, monkeypatch):
    monkeypatch.setattr(dataset_file, "MAX_IN_MEMORY", 0)
    name = "torque_step_2e6"
    pieces = run_commands.read_folder(finished[0]).datasets[name]
    assert not pieces.variables["pair_load"]._in_memory
    assert pieces.identical(content.datasets[name])


def test_pictures_that_fail_leave_an_older_folder_alone(flexgear, finished, monkeypatch, tmp_path):
    (tmp_path / "summary.json").write_text("older")

    def broken(content, source, place, *_):
        (place / "half.png").write_text("half a picture")
        raise FlexgearError("cannot draw")

    monkeypatch.setattr(pictures, "draw", broken)
    code, _, err = flexgear("render", finished[0], "--quiet", "--out", tmp_path)
    assert code == 1
    assert err == "flexgear: cannot draw\n"
    assert [p.name for p in tmp_path.rglob("*")] == ["summary.json"]
    assert not list(tmp_path.parent.glob(".*.partial"))


def test_any_process_draws_a_run_from_its_folder(finished, content, tmp_path, monkeypatch):
    """Pictures of a process that reads the folder are those of the one that has the run."""
    monkeypatch.setattr(pictures, "_of_folders", {})
    folders = finished[0], tmp_path / "there"
    for name in ("load_sharing", "torque_step_2e6_energy"):
        from_folder = pictures._picture(folders, name)
        in_memory = pictures.Pictures(content, tmp_path / "here").picture(name)
        assert from_folder.caption == in_memory.caption
        assert from_folder.file.read_bytes() == in_memory.file.read_bytes()
    assert list(pictures._of_folders) == [folders]  # read once


def test_what_another_process_could_not_draw_is_drawn_here(
    finished, content, tmp_path, monkeypatch
):
    class Lost:
        def completed(self, function, folders, names):
            yield from ((k, Outcome(None, "its process died")) for k in range(len(names)))

    drawn = []
    monkeypatch.setattr(
        pictures.Pictures,
        "picture",
        lambda self, name: drawn.append(name) or pictures.Picture(name, "modes", "", "", None),
    )
    pictures.drawn_side(content, finished[0], tmp_path, lambda *_: None, Lost())
    assert {"ring_3d", "ring_star", "ring_star_turning", "load_sharing"} <= set(drawn)
    assert pictures._of_folders == {}
