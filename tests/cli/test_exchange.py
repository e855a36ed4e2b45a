"""flexgear import: what it writes is checked and solved by the other commands."""

import json

import numpy as np
import pytest
from reduced_samples import beam, frequencies
from rexs_samples import planetary, three_stages
from stage_samples import made_of

from flexgear.cli import exchange_commands
from flexgear.files.matrices.exchange import read_reduced
from flexgear.structures.reduced import ReducedBody


@pytest.mark.parametrize("make", [planetary, three_stages])
def test_imported_case_is_solved(flexgear, tmp_path, monkeypatch, make):
    monkeypatch.chdir(tmp_path)
    make().write(tmp_path / "box.rexs")
    assert "wrote box.toml" in flexgear.quiet("import", "box.rexs")
    for command in ("check", "static"):
        flexgear.out(command, "box.toml", *(["-q"] if command == "static" else []))
    assert "is there already" in flexgear.refused("import", "box.rexs")
    assert "#:schema" not in (tmp_path / "box.toml").read_text()
    flexgear("schema", "--out", "flexgear.schema.json")
    code, out, _ = flexgear("import", "box.rexs", "--force", "--json")
    assert (tmp_path / "box.toml").read_text().startswith("#:schema ./flexgear.schema.json\n")
    assert code == 0 and json.loads(out)["case"] == "box.toml"


def test_bad_file_is_one_line(flexgear, tmp_path):
    (tmp_path / "bad.rexs").write_text("<model")
    command = ("import", tmp_path / "bad.rexs", "--out", tmp_path / "x.toml")
    assert " -- " in flexgear.refused(*command)
    assert not (tmp_path / "x.toml").exists()


def test_export(flexgear, tmp_path):
    target = tmp_path / "nrel.rexs"
    assert "REXS does not hold" in flexgear.quiet("export", "nrel-5mw", "--rexs", target)
    flexgear.out("import", target, "--out", tmp_path / "back.toml")
    for wrong in (["--rexs", target], ["--rexs", tmp_path / "x.xml"], []):
        assert " -- " in flexgear.refused("export", "nrel-5mw", *wrong)


@pytest.mark.parametrize("form", ["op4", "mtx", "npz"])
def test_export_of_reduced_bodies(flexgear, tmp_path, monkeypatch, form):
    """Ring and carrier with their way back; the folder is not overwritten unasked."""
    b, none = beam(), np.zeros((0, 3))
    body = ReducedBody(
        "ring", b.node_names, b.positions, b.mass, b.stiffness, b.modes, {}, b.points,
        none.astype(int), b.recovery.astype(np.float32),
    )  # fmt: skip
    sources = made_of(lambda stage: dict.fromkeys(stage.fe_bodies, body))
    monkeypatch.setattr(exchange_commands, "fe_sources", sources)
    command = ["export", "wind-5mw", "--reduced", tmp_path / "out", "--format", form, "-q"]
    flexgear.quiet(*command, "--recovery")
    for name in ("ring", "carrier"):
        files = [f for f in (tmp_path / "out").glob(f"{name}*") if f.suffix != ".csv"]
        found = read_reduced(files, tmp_path / "out" / f"{name}_nodes.csv")
        assert found.recovery.shape == b.recovery.shape
        assert frequencies(found.stiffness, found.mass) == pytest.approx(
            frequencies(b.stiffness, b.mass), rel=1e-9
        )
    assert "is there already" in flexgear.refused(*command)
    for wrong in (["--format", "pdf"], ["--component", "sun"]):
        flexgear.refused("export", "wind-5mw", "--reduced", tmp_path / "x", *wrong)
    assert "lumped members" in flexgear.refused("export", "nrel-5mw", "--reduced", tmp_path / "x")
