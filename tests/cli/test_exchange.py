"""Commands that write and read what other programs do: REXS, reduced matrices, load spectra."""

import json

import numpy as np
import pytest
from openfast_files import write_outb
from reduced_samples import beam, frequencies
from rexs_samples import planetary, three_stages
from small_train import SMALL
from stage_samples import sources_of_bodies

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


def test_export(flexgear, tmp_path):
    target = tmp_path / "nrel.rexs"
    assert "not in the file" in flexgear.quiet("export", "nrel-5mw", "--rexs", target)
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
    sources = sources_of_bodies(lambda stage: dict.fromkeys(stage.fe_bodies, body))
    monkeypatch.setattr(exchange_commands, "fe_sources", sources)
    command = ["export", "wind-5mw", "--reduced", tmp_path / "out", "--format", form, "-q"]
    flexgear.quiet(*command, "--recovery")
    for name in ("ring", "carrier"):
        files = [f for f in (tmp_path / "out").glob(f"{name}*") if f.suffix != ".csv"]
        matrices = read_reduced(files, tmp_path / "out" / f"{name}_nodes.csv")
        assert matrices.recovery.shape == b.recovery.shape
        assert frequencies(matrices.stiffness, matrices.mass) == pytest.approx(
            frequencies(b.stiffness, b.mass), rel=1e-9
        )
    assert "is there already" in flexgear.refused(*command)
    for wrong in (["--format", "pdf"], ["--component", "sun"]):
        flexgear.refused("export", "wind-5mw", "--reduced", tmp_path / "x", *wrong)
    assert "lumped members" in flexgear.refused("export", "nrel-5mw", "--reduced", tmp_path / "x")


TRAIN = SMALL.replace("teeth = 60", "teeth = 60, addendum = 0.8")  # no interference
SERIES = """
[load_series]
years = 20
torque = "RotTorq"
speed = "RotSpeed"
moment = ["LSSGagMys", "LSSGagMzs"]

[[load_series.design_load_cases]]
name = "1.2"
files = "dlc12/*.outb"
hours_per_year = 3000
"""


@pytest.fixture
def case(tmp_path):
    time = np.arange(0.0, 600.0, 0.1)
    wave = np.sin(0.05 * time)
    columns = {
        "Time": time,
        "RotTorq": 0.8 + 0.2 * wave,
        "RotSpeed": 9.5 + 0.6 * wave,
        "LSSGagMys": 0.2 * np.sin(0.6 * time),
        "LSSGagMzs": 0.1 * np.cos(0.6 * time),
    }
    (tmp_path / "dlc12").mkdir()
    write_outb(tmp_path / "dlc12" / "a.outb", columns)
    path = tmp_path / "mine.toml"
    path.write_text(TRAIN + SERIES)
    return path


def test_bins_are_printed_written_and_drawn(flexgear, case, tmp_path):
    out = tmp_path / "bins.csv"
    code, shown, err = flexgear("spectrum", case, "--out", out, "-q")
    assert (code, err) == (0, "")
    assert "60000" in shown and "1.0000 (exponent 6.6)" in shown
    assert "largest bending moment" in shown
    assert len(out.read_text().splitlines()) > 10
    assert out.with_suffix(".png").stat().st_size > 1000
    code, _, err = flexgear("spectrum", case, "--out", out, "-q")
    assert code == 2 and "is there already" in err and err.count("\n") == 1
    code, shown, _ = flexgear("spectrum", case, "-q", "--json")
    assert code == 0
    assert sum(b["hours"] for b in json.loads(shown)["bins"]) == pytest.approx(60_000)
