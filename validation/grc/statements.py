"""Published load sharing beside the computed one."""

from __future__ import annotations

from pathlib import Path

from rows import Row, reference

from grc.runs import extreme, sharing

PUBLISHED = reference(Path(__file__).with_name("reference.csv"))
STATICS = "three planets round a free sun share torque equally by statics; see source.md"


def rows() -> list[Row]:
    """Figures side by side, and the published trends."""
    torque, moment = sharing(), extreme()
    tapered = max(sharing(tapered=True).factor, extreme(tapered=True).factor)
    bound = PUBLISHED["K_gamma with preloaded tapered rollers"].value
    return [
        _row("K_gamma in pure torque", torque.factor, STATICS),
        _row("K_gamma under extreme rotor moment", moment.factor, STATICS),
        _row("K_gamma with preloaded tapered rollers", tapered, "", tapered < bound, "below"),
        _row("largest row over the expected load", torque.worst_row,
             "the carrier twists; sizes of rows and carrier are chosen"),
        _trend("a rotor moment raises K_gamma", torque.factor, moment.factor),
        _trend("with tapered rollers it is lower than with clearance", tapered, moment.factor),
        _trend("clearance of the carrier bearings raises K_gamma under moments",
               moment.factor, extreme(clearance=0.3).factor),
        _trend("and the load of the worst row", moment.worst_row,
               extreme(clearance=0.3).worst_row),
    ]  # fmt: skip


def _row(
    quantity: str, value: float, why: str, holds: bool | None = None, demand: str = "reported"
) -> Row:
    line = PUBLISHED[quantity]
    reason = "; ".join(part for part in (line.reason, why) if part)
    return Row("grc", line.where, quantity, line.text, f"{value:.3f}", demand, holds, reason)


def _trend(statement: str, low: float, high: float) -> Row:
    computed = f"{low:.3f} to {high:.3f}"
    return Row("grc", "both papers", statement, "stated", computed, "rises", high > low)
