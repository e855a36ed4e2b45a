"""K_Hβ of the bundled cases, by what tilts their gears, and what a proposal gains."""

from rows import FLEXGEAR, Row

from face_load import by_fe, rim
from face_load.runs import Even, even, gained, proposal

CASES = by_fe.CASES
TUNED = "z_mm of the planet bearings, which moves their springs from mid-face"


def rows(fidelity: str) -> list[Row]:
    """Every gear mesh flexible and rigid; slices; z_mm; proposals."""
    lines: list[Row] = []
    for case in CASES:
        bends, rigid = (even(case, fidelity, stiff) for stiff in (False, True))
        for group, one in bends.items():
            lines += [_pair(case, group, rigid[group], one), _tilt(case, group, rigid[group], one)]
            lines += [_causes(case, group, rigid[group], one)]
        lines += _proposals(case, fidelity)
    lines += _bearing_place(fidelity) + _slices(fidelity)
    again = fidelity != "quick"
    return lines + by_fe.rows(again) + rim.rows(again)


def _reported(case: str, quantity: str, text: str, why: str) -> Row:
    return Row("face_load", case, quantity, "–", text, "reported", None, why, "")


def _pair(case: str, group: str, rigid: Even, bends: Even) -> Row:
    why = "largest of all planets over a gear-mesh cycle; slices beside each other"
    text = f"{rigid.k_h_beta:.3f} rigid, {bends.k_h_beta:.3f} flexible"
    return _reported(case, f"K_Hβ, {group}", text, why)


def _tilt(case: str, group: str, rigid: Even, bends: Even) -> Row:
    text = f"{rigid.misalignment:.1f} µm rigid, {bends.misalignment:.1f} µm flexible"
    more = bends.misalignment - rigid.misalignment
    why = f"ring, carrier and shaft: {more:+.1f} µm; rigid: bearings, and helices' moments"
    return _reported(case, f"misalignment over the face, {group}", text, why)


def _causes(case: str, group: str, rigid: Even, bends: Even) -> Row:
    """By which bodies and bearings gears are tilted, in the mean of the positions."""
    text, less = (
        ", ".join(f"{cause} {round(size, 1) + 0.0:+.1f}" for cause, size in one.causes.items())
        for one in (bends, rigid)
    )
    why = f"planet misaligned most, flexible; rigid: {less} µm"
    return _reported(case, f"misalignment by cause, {group}", f"{text} µm", why)


def _proposals(case: str, fidelity: str) -> list[Row]:
    change, lines = proposal(case, fidelity), []
    amounts = ", ".join(
        f"{key.split('.')[-2]} {key.split('.')[-1]} {1e6 * x:.0f} µm"
        for key, x in change.amounts.items()
    )
    for group in even(case, fidelity, False):
        before, after = gained(change, group, "largest_line_load_n_per_mm")
        factor = gained(change, group, "k_h_beta")
        text = f"{before:.0f} to {after:.0f} N/mm, K_Hβ {factor[0]:.3f} to {factor[1]:.3f}"
        lines.append(
            Row(
                "face_load",
                case,
                f"proposed flanks: largest line load, {group}",
                "–",
                text,
                "does not rise by 2 %",
                after < 1.02 * before,
                amounts,
                FLEXGEAR,
            )
        )
    return lines


def _bearing_place(fidelity: str) -> list[Row]:
    """What the bundled case had tuned, tried again."""
    lines = []
    for z in ("-30", "0", "30"):
        changes = (
            {} if z == "-30" else {"stage.planet_bearing.z_mm": z}
        )  # the first is the case's own
        ring, sun = _of_stage("wind-5mw", fidelity, False, **changes)
        tilts = f"tilt {ring.misalignment:.0f}, {sun.misalignment:.0f} µm"
        text = f"ring {ring.k_h_beta:.3f}, sun {sun.k_h_beta:.3f}; {tilts}"
        lines.append(_reported("wind-5mw", f"K_Hβ with z_mm = {z}", text, TUNED))
    return lines


def _of_stage(
    case: str, fidelity: str, rigid: bool, slices: int = 15, **changes: str
) -> tuple[Even, Even]:
    """Ring and sun of a case of one stage."""
    by_group = even(case, fidelity, rigid, slices=slices, **changes)
    ring, sun = (next(one for g, one in by_group.items() if g.endswith(k)) for k in ("ring", "sun"))
    return ring, sun


def _slices(fidelity: str) -> list[Row]:
    fifteen, more = (_of_stage("wind-5mw", fidelity, True, slices=n) for n in (15, 31))
    worst = max(
        abs(many.k_h_beta / few.k_h_beta - 1) for many, few in zip(more, fifteen, strict=True)
    )
    text = f"{100 * worst:.2f} %"
    return [
        Row(
            "face_load",
            "wind-5mw",
            "15 against 31 slices, K_Hβ",
            "within 1 %",
            text,
            "1 %",
            worst < 0.01,
            "slices beside each other",
            FLEXGEAR,
        )
    ]
