"""Whole commands against the last release: both in processes of their own, caches warm.

The last release is the commit that ``FLEXGEAR_RELEASE`` names, else the newest tag, else the commit
that raised the version. Its package is taken out of git into a folder of its own.
"""

import io
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks.record import Comparison, Report
from benchmarks.timing import interleaved
from flexgear.structures.linalg.dense import THREADS

ROOT = Path(__file__).resolve().parents[2]
CALL = "import sys; sys.argv[0] = 'flexgear'; from flexgear.cli import main; main()"
REPEATS = {"quick": 1, "full": 3}
POINTS = {"quick": 20, "full": 200}
OUT = "OUT"  # stands for a new folder in a command's arguments


def commands(size: str) -> dict[str, tuple[int, tuple[str, ...]]]:
    """By what is measured: threads that may work, and arguments."""
    run = ("run", "wind-5mw", "--quiet", "--out", OUT)
    bearings = f"stage.planet_bearing.radial_n_per_m=5e7:5e8:{POINTS[size]}"
    return {
        "help": (1, ("--help",)),
        "check": (1, ("check", "wind-5mw")),
        "static": (1, ("static", "wind-5mw", "--quiet")),
        "modes": (1, ("modes", "wind-5mw", "--quiet")),
        "simulate for 2 s": (1, ("simulate", "wind-5mw", "--duration-s", "2", "--quiet")),
        "run without pictures": (THREADS, (*run, "--no-pictures")),
        "run": (THREADS, run),
        f"sweep of {POINTS[size]} lumped trains": (
            THREADS, ("sweep", "lin-parker", bearings, "--quiet", "--no-pictures", "--out", OUT),
        ),
    }  # fmt: skip


def run(report: Report, size: str) -> None:
    """Every command of this package and of the last release, in turns."""
    try:
        commit, name = last_release()
        older = package_of(commit)
    except (OSError, subprocess.CalledProcessError, tarfile.TarError) as error:
        why = _line(getattr(error, "stderr", None) or str(error))
        report.skip("the last release", f"git does not give it ({why})")
        return
    for what, (threads, arguments) in commands(size).items():
        candidates = {"own": caller(ROOT, arguments), "release": caller(older, arguments)}
        try:
            for call in candidates.values():  # fills caches of bodies and of compiled loops
                call()
            seconds, _ = interleaved(candidates, REPEATS[size])
        except subprocess.CalledProcessError as error:
            report.skip(f"flexgear {name}, {what}", f"it fails ({_line(error.stderr)})")
            continue
        ours, release = seconds["own"], seconds["release"]
        line = " ".join(("flexgear", *arguments)).replace(f" --out {OUT}", "")
        report.add(
            Comparison(
                "Whole command", f"flexgear {name}", what, ours, release, threads, "command", line
            )
        )


def last_release() -> tuple[str, str]:
    """Commit and name of the last release. CalledProcessError where there is none."""
    named = os.environ.get("FLEXGEAR_RELEASE")
    if named is None:
        tag = subprocess.run(
            ["git", "describe", "--tags", "--abbrev=0"], cwd=ROOT, capture_output=True, text=True
        )
        raised = ("log", "-1", "--format=%H", "-G^version = ", "--", "pyproject.toml")
        named = tag.stdout.strip() or _git(*raised).strip()
    commit = _git("rev-parse", "--verify", f"{named}^{{commit}}").strip()
    return commit, named if named != commit else commit[:7]


def package_of(commit: str) -> Path:
    """Folder with the package as it was at a commit; taken out once."""
    folder = ROOT / "results" / "benchmarks" / f"release-{commit[:12]}"
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as place:
            archive = subprocess.run(
                ["git", "archive", commit, "flexgear"], cwd=ROOT, capture_output=True, check=True
            ).stdout
            with tarfile.open(fileobj=io.BytesIO(archive)) as content:
                content.extractall(place, filter="data")
            shutil.copytree(place, folder)
    return folder


def caller(package: Path, arguments: tuple[str, ...]) -> Callable[[], None]:
    """Function that runs a command in a new folder. CalledProcessError where it fails."""

    def call() -> None:
        with tempfile.TemporaryDirectory() as place:
            line = [str(Path(place) / "out") if a == OUT else a for a in arguments]
            subprocess.run(
                [sys.executable, "-c", CALL, *line],
                cwd=place, env={**os.environ, "PYTHONPATH": str(package)}, check=True,
                stdin=subprocess.DEVNULL, capture_output=True, text=True,
            )  # fmt: skip

    return call


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout


def _line(text: str | None) -> str:
    """The last line of what a program says."""
    lines = (text or "").strip().splitlines()
    return lines[-1] if lines else "without a word"
