"""``flexgear tolerance``: what is printed, written and drawn, refused and resumed."""

import json
import os
import re
import sys

import numpy as np
import pytest
from dask_cluster import cluster
from interrupts import interrupted, processes_with, wait_until
from PIL import Image
from report_pages import require_sound
from tolerance_results import study_data

from flexgear.results.dataset_file import load
from flexgear.results.report.wording import number
from flexgear.studies import tolerance as tolerances

PIN = "tolerance.errors.pin_tangential.standard_deviation_um=10"
PARTS = ("carrier", "ring", "sun")
LOOSE = [f"--set=stage.{part}.support.radial_n_per_m=0" for part in PARTS]


pytestmark = pytest.mark.usefixtures("cache")


def test_figures_dataset_and_picture(flexgear, tmp_path, cache):
    out = tmp_path / "new" / "study"
    text = flexgear.out(
        "tolerance", "lin-parker", "--samples", 40, "--set", PIN, "--out", out, "-q"
    )
    assert "lin-parker, lumped: 40 samples" in text
    assert "ring, largest load sharing factor K" in text and "\n  mean" in text
    assert "99 %" in text and " … –" in text  # too few samples for its upper end
    assert f"wrote {out}" in text
    names = sorted(p.name for p in out.iterdir())
    assert names == ["report.html", "summary.json", "tolerance.nc", "tolerance.png"]
    require_sound(out / "report.html", "tolerance", "case")
    page = (out / "report.html").read_text()
    plain = re.sub(r"<(script|style).*?</\1>|<[^>]+>", " ", page, flags=re.DOTALL)
    spread = json.loads((out / "summary.json").read_text())["load_sharing"]
    group, spread = next(iter(spread.items()))
    ends = [one["low"] for one in spread["quantiles"].values() if one is not None]
    assert ends and all(f"{number(low)} …" in plain for low in ends)  # of every quantile
    assert number(spread["mean"]["value"]) in plain and "Tolerance study" in plain
    assert "40" in plain and not any(key in plain for key in (*spread, group) if "_" in key)
    assert list((tmp_path / "new").iterdir()) == [out]
    with Image.open(out / "tolerance.png") as picture:
        assert picture.size[0] > 1000
    data = load(out / "tolerance.nc")
    assert data.sizes["sample"] == 40
    assert data["error_size"].attrs["units"] == "m"
    assert list(data["size"].to_numpy()) == [f"stage.pin_tangential {i}" for i in (1, 2, 3, 4)]
    assert not (cache / "tolerance").exists()


def test_json_is_the_summary(flexgear, tmp_path):
    arguments = ("tolerance", "wind-5mw", "--samples", 25, "--seed", 3, "--json", "-q")
    figures = json.loads(flexgear.out(*arguments, "--no-pictures", "--out", tmp_path / "a"))
    assert figures == json.loads((tmp_path / "a" / "summary.json").read_text())
    assert (figures["samples"], figures["seed"], figures["failed"]) == (25, 3, 0)
    assert figures["positions"] == {"stage ring": 372, "stage sun": 372}
    ring = figures["load_sharing"]["stage ring"]
    assert ring["iec_61400_4"] == 1.35
    assert ring["share_above_iec_61400_4"]["value"] == 0
    median = ring["quantiles"]["50"]
    assert median["low"] < median["value"] < median["high"]
    assert ring["quantiles"]["99"]["high"] is None
    largest = load(tmp_path / "a" / "tolerance.nc")["load_sharing_max"].sel(group="stage ring")
    assert ring["mean"]["value"] == pytest.approx(float(largest.mean()), rel=1e-12)
    assert not (tmp_path / "a" / "tolerance.png").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["lin-parker"], ["lin-parker: tolerance.errors", "has no error of a part"]),
        (["wind-5mw", "--set", "tolerance.samples=1"], ["--set: tolerance.samples", "outside 2"]),
        (["wind-5mw", "--samples", "1"], ["samples"]),
        (["wind-5mw", "--seed", "x"], ["seed"]),
        (["no-such-case"], ["neither a file nor a bundled case"]),
        (
            ["lin-parker", "--set", PIN, "--scheduler", "nowhere"],
            ["--scheduler: nowhere: names no port -- e.g. tcp://host:8786"],
        ),
        (["lin-parker", "--set", PIN, *LOOSE], []),  # no equilibrium
        (
            ["lin-parker", "--set", PIN, "--set", "inputs.0.torque_nm=0"],
            ["planets: there is no stage whose planets share a load", "torque that are not zero"],
        ),
    ],
)
def test_bad_arguments_of_tolerance_are_one_line_and_no_files(
    flexgear, tmp_path, monkeypatch, arguments, words
):
    monkeypatch.chdir(tmp_path)
    flexgear.refused("tolerance", *arguments, "-q", says=words)
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == []


@pytest.mark.parametrize("pictures", ["--pictures", "--no-pictures"])
def test_a_study_without_any_equilibrium_writes_nothing(flexgear, tmp_path, monkeypatch, pictures):
    nowhere = study_data(gaps=list(range(50)))
    monkeypatch.setattr(tolerances, "tolerance", lambda *_, **__: nowhere)
    says = ["tolerance.errors: leave no set of parts with an equilibrium"]
    study = ("tolerance", "lin-parker", "--set", PIN, pictures, "--out", tmp_path / "x", "-q")
    flexgear.refused(*study, says=says)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")
def test_ctrl_c_while_workers_work(tmp_path, cache):
    """Pressed again and again: one line beside the progress, no process left, and what was done is
    kept."""
    command = ("tolerance", "lin-parker", "--samples", 200000, "--workers", 2, "--set", PIN,
               "--out", tmp_path / "out")  # fmt: skip
    code, err = interrupted(command, cache, "tolerance/*/*.pickle", presses=3)
    assert code == 1
    lines = [line for line in err.splitlines() if not line.startswith("samples")]  # progress
    assert len(lines) == 1, err
    assert lines[0].startswith("flexgear: stopped with ")
    assert lines[0].endswith("00 of 200000 samples done; the same command goes on from there")
    assert not list(tmp_path.iterdir())
    if os.path.isdir("/proc"):
        wait_until(lambda: not processes_with(f"FLEXGEAR_CACHE={cache}"), 20)


@pytest.mark.slow
def test_studies_and_sweeps_on_a_cluster_give_the_same(flexgear, tmp_path):
    """Studies and sweeps on a cluster give what they give here."""
    local, remote = tmp_path / "here", tmp_path / "there"
    command = ("tolerance", "lin-parker", "--samples", 250, "--set", PIN, "-q", "--no-pictures")
    assert flexgear(*command, "--out", local)[::2] == (0, "")
    with cluster() as address:
        assert flexgear(*command, "--out", remote, "--scheduler", address)[0] == 0
        sweep = ("sweep", "lin-parker", "stage.planets=3,4", "--measure", "frequencies", "-q",
                 "--no-pictures")  # fmt: skip
        assert flexgear(*sweep, "--out", remote, "--scheduler", address)[0] == 0
    assert flexgear(*sweep, "--out", local, "--workers", 1)[0] == 0
    for name in ("tolerance.nc", "sweep.nc"):
        assert load(local / name).identical(load(remote / name))
    assert np.isfinite(load(remote / "tolerance.nc")["load_sharing_max"]).all()
