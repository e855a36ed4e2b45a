"""Published load sharing beside the computed one, and what each cause does to it."""

from dataclasses import astuple

import numpy as np
from rows import CLOSED_FORM, STORED, Row, reference

from grc.by_cause import CauseFigures, Figures, computed, stored

PUBLISHED = reference("grc")
BUNDLED, TAPERED = "bundled case", "tapered planet and carrier bearings"
TAPERED_TOGETHER = "all tapered, all errors, sun held"
TOGETHER = "all errors and all that holds the sun"
LET_GO = "the same with the sun let go"
STATICS = "three planets round a free sun share torque equally by statics; see source.md"
SAME = 0.02  # of what exceeds one, and of the sun's load: other versions of mesh generators


def with_clearance(gap: float) -> str:
    """Cause whose carrier bearings have that clearance, mm on every side."""
    return BUNDLED if gap == 0.1 else f"carrier bearing clearance {gap:g} mm"


def rows() -> list[Row]:
    """Figures side by side, the published trends, and what changed since the table was written."""
    every = computed()
    bundled, wide, tapered = every[BUNDLED], every[with_clearance(0.3)], every[TAPERED]
    worst = [max(every[name].torque.factor, every[name].moment.factor)
             for name in (TAPERED, TAPERED_TOGETHER)]  # fmt: skip
    bound = PUBLISHED["K_gamma with preloaded tapered rollers"].value
    return [
        _row("K_gamma in pure torque", _range("torque", "factor"), STATICS),
        _row("K_gamma under extreme rotor moment", _range("moment", "factor"), STATICS),
        _row("K_gamma with preloaded tapered rollers", _both(worst), "", max(worst) < bound,
             "below"),
        _row("largest row over the expected load", _range("torque", "row"),
             "the carrier twists; sizes of rows and carrier are chosen"),
        _trend("a rotor moment raises K_gamma", bundled.torque.factor, bundled.moment.factor),
        _trend("with tapered rollers it is lower than with clearance",
               tapered.moment.factor, bundled.moment.factor),
        _trend("and so it is with all causes together",
               every[TAPERED_TOGETHER].moment.factor, every[TOGETHER].moment.factor),
        _trend("clearance of the carrier bearings raises K_gamma under moments",
               bundled.moment.factor, wide.moment.factor),
        _trend("and the load of the worst row", bundled.moment.row, wide.moment.row),
        _let_go(every[LET_GO]),
        *_since_stored(),
    ]  # fmt: skip


def _range(load: str, key: str) -> str:
    """Of the bundled case and with every cause together."""
    return _both([getattr(getattr(computed()[name], load), key) for name in (BUNDLED, TOGETHER)])


def _both(values: list[float]) -> str:
    return f"{values[0]:.3f}; {values[1]:.3f} with all causes together"


def _row(
    quantity: str, computed: str, why: str, holds: bool | None = None, demand: str = "reported"
) -> Row:
    line = PUBLISHED[quantity]
    reason = "; ".join(part for part in (line.reason, why) if part)
    return Row("grc", line.where, quantity, line.text, computed, demand, holds, reason)


def _trend(statement: str, low: float, high: float) -> Row:
    computed = f"{low:.3f} to {high:.3f}"
    return Row("grc", "both papers", statement, "stated", computed, "rises", high > low)


def _let_go(one: CauseFigures) -> Row:
    """No cause acts but through the sun's support and weights."""
    text = f"{one.torque.factor:.3f}, {one.moment.factor:.3f} under the moment"
    holds = max(one.torque.factor, one.moment.factor) < 1.01
    return Row("grc", "statics", "K_gamma with all causes, the sun free in its plane", "1 but for "
               "weights", text, "below 1.01", holds, STATICS, CLOSED_FORM)  # fmt: skip


def _since_stored() -> list[Row]:
    """What causes.csv and the table of source.md have, beside what is computed."""
    off = {}
    for name, now in computed().items():
        old = stored()[name]
        off[name] = max(_distance(old.torque, now.torque), _distance(old.moment, now.moment))
    return [
        Row("grc", "causes.csv", f"stored figures: {name}", "–", f"{100 * x:.2f} % off",
            f"{100 * SAME:g} %", x < SAME, "", STORED)
        for name, x in off.items()
    ]  # fmt: skip


def _distance(old: Figures, new: Figures) -> float:
    """Largest relative change of what exceeds one, and of what holds the sun."""
    return float(np.nanmax(np.abs(np.array(astuple(new)) / np.array(astuple(old)) - 1)))
