"""K_Hβ with slices that bend each other by FE influence: stored, since the gears take minutes.

Of rigid and flexible bodies in 15 slices, and of flexible ones in twice as many.

`python -m face_load.by_fe` in validation/ writes by_fe.csv, from FE bodies of quick fidelity; full
`make validate` computes it again.
"""

import csv
from pathlib import Path

from rows import FLEXGEAR, STORED, Row

from face_load.runs import even
from flexgear.files.atomic import atomic_file

CASES = ("wind-5mw", "grc-750kw")
TABLE = Path(__file__).with_name("by_fe.csv")
SAME = 0.01  # other versions of mesh generators
MORE = 31  # slices
COLUMNS = ("rigid", "flexible", f"flexible, {MORE} slices")
CONVERGED = 0.01
WHY = "teeth bend as plates, ends of the face are softer; stored"


def computed() -> dict[tuple[str, str], tuple[float, ...]]:
    """K_Hβ with rigid and flexible bodies, and of these in ``MORE`` slices, by case and kind of
    gear mesh."""
    factors = {}
    for case in CASES:
        rigid, bends = (even(case, "quick", stiff, "fe") for stiff in (True, False))
        finer = even(case, "quick", False, "fe", MORE)
        for group in bends:
            factors[case, group] = tuple(one[group].k_h_beta for one in (rigid, bends, finer))
    return factors


def stored() -> dict[tuple[str, str], tuple[float, ...]]:
    """by_fe.csv, as ``computed``."""
    with TABLE.open(encoding="utf-8", newline="") as stream:
        return {
            (line["case"], line["gear mesh"]): tuple(float(line[name]) for name in COLUMNS)
            for line in csv.DictReader(stream)
        }


def rows(again: bool) -> list[Row]:
    """What is stored; again: compared with what is computed."""
    now = computed() if again else {}
    lines = []
    for (case, group), factors in stored().items():
        text = f"{factors[0]:.3f} rigid, {factors[1]:.3f} flexible"
        demand, holds = "reported", None
        if again:
            off = max(abs(b / a - 1) for a, b in zip(factors, now[case, group], strict=True))
            text, demand, holds = f"{text}; {100 * off:.2f} % off", f"{100 * SAME:g} %", off < SAME
        name = f"K_Hβ by FE influence, {group}"
        against = STORED if again else ""
        lines.append(Row("face_load", case, name, "–", text, demand, holds, WHY, against))
        change = factors[2] / factors[1] - 1
        name = f"15 against {MORE} slices by FE influence, {group}"
        text = f"{factors[1]:.3f} and {factors[2]:.3f}: {100 * change:+.2f} %"
        limit, holds = f"{100 * CONVERGED:g} %", abs(change) < CONVERGED
        why = "both are stored"
        lines.append(Row("face_load", case, name, "within 1 %", text, limit, holds, why, FLEXGEAR))
    return lines


def main() -> None:
    """Compute and write by_fe.csv."""
    with atomic_file(TABLE) as path, path.open("w", encoding="utf-8", newline="") as stream:
        out = csv.writer(stream, lineterminator="\n")
        out.writerow(["case", "gear mesh", *COLUMNS])
        for (case, group), factors in computed().items():
            out.writerow([case, group, *(f"{one:.5f}" for one in factors)])


if __name__ == "__main__":
    main()
