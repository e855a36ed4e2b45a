"""docs/benchmarks.md, written by the run."""

from pathlib import Path

from benchmarks.record import Comparison, Report, plain

HEAD = """# Benchmarks

Every figure is a ratio: the peer's time over flexgear's, both measured in one run, on the same
matrices or the same case, in turns (all candidates once, then all again). Above 1 flexgear is
faster. The ratio is the median over repetitions, the spread its smallest and largest. Times depend
on the machine, ratios much less; differences below 1.4 are ties.

Where more than one thread may work, ratio and times are of wall time; what runs on one thread is
compared by processor time, which on an idle machine is the same. "By processor time" is the ratio
of the work of all threads: it does not see that flexgear shares work out among threads, nor that
others may use the machine.

Whole commands are measured against the last release, in processes of their own and with warm
caches: the newest tag, or the commit that raised the version; `FLEXGEAR_RELEASE=COMMIT` names
another.

`make bench` runs everything again and writes this page; `make bench BENCH=--quick` tries it out in
results/benchmarks, `make bench BENCH='--only steps'` runs one group there. Peers are optional:
`pip install 'flexgear[bench]'` brings Exudyn, `apt-get install calculix-ccx` CalculiX.
"""

NOT_COMPARABLE = """## What is not comparable

* **Exudyn** ties patches rigidly (RBE2) in this comparison, so flexgear does too; its averaging
  patches are weighted by nodes, flexgear's by area, and would give other numbers. Exudyn stores the
  modes only; flexgear also makes reduced matrices and the recovery at mesh vertices. Exudyn's
  solver is SciPy's.
* **CalculiX** reads its deck and writes its results within its time; both clamp the bolted face.
* **Assembly**: plain forms give the two matrices only; flexgear's assembly gives the scalar mass
  matrix as well.
* **The bare kernel** is no peer but a yardstick: it solves one position of the same stage over and
  over, without search for loaded pairs, damping, moving teeth, velocities or outputs, in plain
  compiled loops. A step may cost less, as flexgear computes its sums by vector instructions
  and skips modes and channels that do not act on one another.
* **Dense steps** use all coordinates, flexgear the kept modes and the static rest of the contact
  dofs. How far that is from all coordinates is a matter of the tests, not of this page; that
  the steps are the same is checked here with all modes kept.
* **solve_ivp** runs in the same kept modes on a right-hand side compiled by flexgear, over a short
  span of steady running and to a tolerance that it chooses steps for; flexgear's step is fixed.
  Explicit rules are bound by the highest kept mode, so that more modes or stiffer contact cost them
  more steps. A right-hand side in plain Python would be many times slower.
* **Dense solution of positions** gives the same motion as the revolution, whose time includes load
  sharing and the deflection of all ring teeth.
"""


def write(report: Report, path: Path, pictures: list[Path]) -> None:
    """The page with its table, figures and machine."""
    lines = [HEAD]
    by_stem = {p.stem: p for p in pictures}
    lines += ["## Ratios\n", *_table(report.comparisons), ""]
    lines += _picture(by_stem, "benchmarks-ratios", "Ratios with their spread")
    if report.figures:
        lines += ["## Other figures\n", "| what | figure |", "|---|---|"]
        lines += [f"| {what} | {value} |" for what, value in report.figures.items()]
        lines.append("")
    lines += _picture(by_stem, "benchmarks-steps", "Cost of a step over kept modes and planets")
    lines += _picture(by_stem, "benchmarks-size", "Assembly and reduction over size")
    lines.append(NOT_COMPARABLE)
    lines.append("## Skipped\n")
    skipped = [f"* {peer}: {why}" for peer, why in report.skipped.items()]
    lines += [*(skipped or ["Nothing."]), ""]
    lines += ["## Machine\n", "| | |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in report.machine.items()]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


def _table(comparisons: list[Comparison]) -> list[str]:
    rows = [
        "| what | peer | size | ratio | spread | runs | by processor time | flexgear | peer | per "
        "| threads | check |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for c in comparisons:
        spread = (
            f"{plain(min(c.ratios))} to {plain(max(c.ratios))}" if len(c.ratios) > 1 else "one run"
        )
        rows.append(
            f"| {c.group} | {c.peer_name} | {c.size} | **{plain(c.ratio)}** | {spread} "
            f"| {len(c.ratios)} | {plain(c.work_ratio)} | {_time(c.times[0])} "
            f"| {_time(c.times[1])} | {c.unit} | {c.threads} | {c.check} |"
        )
    return rows


def _time(seconds: float) -> str:
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e6:.3g} µs"


def _picture(by_stem: dict[str, Path], stem: str, title: str) -> list[str]:
    return [f"![{title}](pictures/{stem}.png)\n"] if stem in by_stem else []
