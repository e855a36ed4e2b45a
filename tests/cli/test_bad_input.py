"""Whatever a user gets wrong ends in one line that names it, and in exit code 2 (failures: 1)."""

import errno
import os
import shlex
import signal
import subprocess
import sys
import time

import pytest
from interrupts import hear_interrupts

from flexgear.cli import case_commands

FLEXGEAR = [sys.executable, "-c", "from flexgear.cli import main; main()"]


def one_line(err: str) -> str:
    assert err.count("\n") == 1, err
    assert err.startswith("flexgear: ")
    assert "Traceback" not in err
    return err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "wind-5mW"], ["wind-5mw"]),
        (["check", "nowhere.toml"], ["nowhere.toml", "no such file"]),
        (["check"], ["CASE"]),
        (["chekc", "wind-5mw"], ["chekc"]),
        (["check", "wind-5mw", "--sett", "a=1"], ["--sett"]),
        (["check", "wind-5mw", "--set", "planets"], ["--set", "KEY=VALUE"]),
        (["check", "wind-5mw", "--set", "stage.planet=4"], ["did you mean planets?", "section"]),
        (["check", "wind-5mw", "--set", "fidelity=quick"], ["write solver.fidelity"]),
        (
            ["check", "nrel-5mw", "--set", "stages.1.sun.plate_gap_mm=3"],
            ["write stages.1.carrier.fe.plate_gap_mm"],
        ),
        (
            ["check", "nrel-5mw", "--set", "joints.0.members=3"],
            ["joints.0.members: is not a known key -- use one of first, second, "],
        ),
        (
            ["sweep", "wind-5mw", "plate_gap_mm=3,4", "--measure", "modes"],
            ["did you mean half_gap_mm? Or write stage.carrier.fe.plate_gap_mm"],
        ),
        (
            ["check", "wind-5mw", "--set", "stage.backlash_sun_umx=4"],
            ["did you mean backlash_sun_um?"],
        ),
        (["check", "wind-5mw", "--set", "solver=quick"], ["write it as [solver]"]),
        (["static", "wind-5mw", "--rigid", "sun"], ["--rigid", "sun", "carrier"]),
        (
            ["static", "wind-5mw", "--angle-deg", "x"],
            ["--angle-deg: x: is not a number -- give a number"],
        ),
        (
            ["response", "wind-5mw", "--speed-range", "1", "b"],
            ["--speed-range: b: is not a number"],
        ),
        (["tolerance", "wind-5mw", "--samples", "2.5"], ["--samples: 2.5: is not a whole number"]),
        (["rate", "wind-5mw", "--workers", "0"], ["--workers: 0: is too small -- give at least 1"]),
        (["static", "wind-5mw", "--tilt"], ["--tilt", "see flexgear static --help"]),
        (["modes", "wind-5mw", "--limit-hz", "0"], ["--limit-hz", "positive"]),
        (["simulate", "wind-5mw", "--duration-s", "-1"], ["--duration-s"]),
        (["mesh", "wind-5mw", "--component", "sun"], ["--component", "sun"]),
        (["mesh", "wind-5mw", "--export", "a.vtu"], ["--export", "--component ring"]),
        (["cases", "wind-6mw"], ["wind-6mw", "wind-5mw"]),
    ],
)
def test_wrong_arguments_are_refused(flexgear, arguments, words):
    flexgear.refused(*arguments, says=words)


def test_run_into_a_file_is_refused_before_any_work(flexgear, tmp_path):
    (tmp_path / "taken").write_text("")
    flexgear.refused("run", "wind-5mw", "--out", tmp_path / "taken", says=["name a folder"])


def test_a_full_disk_is_one_line(flexgear, monkeypatch, tmp_path):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    code, _, err = flexgear("cases", "wind-5mw", "--copy", tmp_path / "mine.toml")
    assert code == 1
    assert "No space left" in one_line(err)
    assert "free some space" in err
    assert list(tmp_path.iterdir()) == []


def test_a_bug_is_one_line_too_unless_debugging(flexgear, monkeypatch):
    def bug(*_):
        raise ZeroDivisionError("of mine")

    monkeypatch.setattr(case_commands, "derived", bug)
    code, _, err = flexgear("check", "wind-5mw")
    assert code == 1
    assert "please report it (ZeroDivisionError: of mine)" in one_line(err)
    with pytest.raises(ZeroDivisionError):
        flexgear("check", "wind-5mw", "--debug")


@pytest.mark.skipif(sys.platform == "win32", reason="a shell's pipes")
@pytest.mark.parametrize("reader", ["head -1", "true"])
def test_a_reader_that_leaves_is_no_failure(reader):
    """Of either stream; what failed for another reason fails all the same."""
    flexgear = " ".join(map(shlex.quote, FLEXGEAR))
    script = (
        f"{flexgear} check lin-parker 2>&1 | {reader}; echo ${{PIPESTATUS[0]}};"
        f"{flexgear} cases nowhere 2>&1 | true; echo ${{PIPESTATUS[0]}}"
    )
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True)
    assert [line for line in done.stdout.splitlines() if len(line) == 1] == ["0", "2"]
    assert done.stderr == ""


@pytest.mark.parametrize("command", [[], ["check"], ["run"]])
def test_short_form_of_help(flexgear, command):
    assert flexgear(*command, "-h") == flexgear(*command, "--help")


@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    [
        signal.SIGINT,
        *(pytest.param(n, marks=pytest.mark.slow) for n in (signal.SIGTERM,)),
    ],
)
def test_interrupted_run_leaves_nothing(tmp_path, number):
    env = {**os.environ, "FLEXGEAR_CACHE": str(tmp_path / "cache"), "OMP_NUM_THREADS": "1"}
    command = [*FLEXGEAR, "run", "wind-5mw", "--out", str(tmp_path / "out"), "--set"]
    started = subprocess.Popen(
        [*command, "solver.fidelity=quick"],
        stderr=subprocess.PIPE,
        text=True,
        env=env,
        preexec_fn=hear_interrupts,
    )
    assert started.stderr.readline()  # the first stage has begun
    time.sleep(0.5)
    started.send_signal(number)
    err = started.communicate(timeout=60)[1]
    assert started.returncode == 1
    assert err.splitlines()[-1] == "flexgear: stopped; nothing half-written was left"
    assert "Traceback" not in err
    left = [p for p in tmp_path.rglob("*") if p.is_file()]
    assert left == []
    assert not list(tmp_path.glob(".*"))
