"""`make bench`: run all groups and write docs/benchmarks.md with its pictures.

A quick run, or one of some groups only, writes beside its results instead, so that a page in docs
is always of one whole run.
"""

import argparse
import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parents[2] / "tests"
sys.path.insert(0, str(TESTS))  # the tests' cheap bodies

from benchmarks import (  # noqa: E402
    assembly,
    calculix,
    commands,
    cyclic,
    exudyn_peer,
    face_load,
    growth,
    page,
    pictures,
    reduction,
    revolution,
    steps,
)
from benchmarks.machine import machine  # noqa: E402
from benchmarks.record import Report  # noqa: E402

GROUPS = {
    "commands": commands,
    "assembly": assembly,
    "reduction": reduction,
    "exudyn": exudyn_peer,
    "cyclic": cyclic,
    "calculix": calculix,
    "steps": steps,
    "growth": growth,
    "revolution": revolution,
    "face_load": face_load,
}
ROOT = TESTS.parent
RESULTS = ROOT / "results" / "benchmarks"


def main() -> None:
    """Parse, run, write."""
    parser = argparse.ArgumentParser(prog="make bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes, few repetitions")
    parser.add_argument("--only", nargs="+", choices=GROUPS, help="some groups")
    parser.add_argument("--resume", action="store_true", help="go on with an interrupted run")
    parser.add_argument("--redraw", action="store_true", help="page and pictures of the last run")
    options = parser.parse_args()
    size = "quick" if options.quick else "full"
    whole = not (options.quick or options.only)
    saved = RESULTS / ("full.json" if whole else "trial.json")
    if (options.redraw or options.resume) and not saved.exists():
        parser.error("there is no such run yet; leave --redraw or --resume out")
    report = Report.load(saved) if options.redraw or options.resume else Report(machine=machine())
    for name in [] if options.redraw else options.only or GROUPS:
        if name in report.done:
            continue
        print(name, flush=True)
        GROUPS[name].run(report, size)
        report.done.append(name)
        report.save(saved)
    folder = ROOT / "docs" if whole else RESULTS
    drawn = pictures.draw(report, folder / "pictures")
    page.write(report, folder / "benchmarks.md", drawn)
    print(folder.relative_to(ROOT) / "benchmarks.md")


if __name__ == "__main__":
    main()
