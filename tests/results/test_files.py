"""Folders that fill whole or stay as they were."""

import pytest

from flexgear.model.errors import FlexgearError
from flexgear.results.files import staged_folder, write_json


def test_files_move_in_at_the_end_and_replace_older_ones(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "a.txt").write_text("old")
    (out / "mine.txt").write_text("kept")
    with staged_folder(out) as stage:
        (stage / "deep").mkdir()
        (stage / "a.txt").write_text("new")
        (stage / "deep" / "b.txt").write_text("b")
        assert (out / "a.txt").read_text() == "old"
    assert (out / "a.txt").read_text() == "new"
    assert (out / "deep" / "b.txt").read_text() == "b"
    assert (out / "mine.txt").read_text() == "kept"
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError, FlexgearError])
def test_a_block_that_fails_leaves_nothing(tmp_path, error):
    def fill(stage):
        (stage / "a.txt").write_text("new")
        raise error

    with pytest.raises(error), staged_folder(tmp_path / "out") as stage:
        fill(stage)
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(FlexgearError, match="name a folder"), staged_folder(tmp_path / "out"):
        pass


def test_json_holds_no_nan(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "a.json", {"a": float("nan")})
    assert list(tmp_path.iterdir()) == []
