"""flexgear import: what it writes is checked and solved by the other commands."""

import json

import pytest
from rexs_samples import planetary, three_stages


@pytest.mark.parametrize("make", [planetary, three_stages])
def test_imported_case_is_solved(flexgear, tmp_path, monkeypatch, make):
    monkeypatch.chdir(tmp_path)
    make().write(tmp_path / "box.rexs")
    code, out, err = flexgear("import", "box.rexs")
    assert (code, err) == (0, "") and "wrote box.toml" in out
    for command in ("check", "static"):
        code, out, err = flexgear(command, "box.toml", *(["-q"] if command == "static" else []))
        assert code == 0, err
    code, out, err = flexgear("import", "box.rexs")
    assert code == 2 and "is there already" in err and err.count("\n") == 1
    code, out, _ = flexgear("import", "box.rexs", "--force", "--json")
    assert code == 0 and json.loads(out)["case"] == "box.toml"


def test_bad_file_is_one_line(flexgear, tmp_path):
    (tmp_path / "bad.rexs").write_text("<model")
    code, out, err = flexgear("import", tmp_path / "bad.rexs", "--out", tmp_path / "x.toml")
    assert (code, out, err.count("\n")) == (2, "", 1) and " -- " in err
    assert not (tmp_path / "x.toml").exists()


def test_export(flexgear, tmp_path):
    target = tmp_path / "nrel.rexs"
    code, out, err = flexgear("export", "nrel-5mw", "--rexs", target)
    assert (code, err) == (0, "") and "REXS does not hold" in out
    code, out, err = flexgear("import", target, "--out", tmp_path / "back.toml")
    assert code == 0, err
    for wrong in (["--rexs", target], ["--rexs", tmp_path / "x.xml"], []):
        code, out, err = flexgear("export", "nrel-5mw", *wrong)
        assert (code, out, err.count("\n")) == (2, "", 1) and " -- " in err
