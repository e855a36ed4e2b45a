"""K_Hβ of the bundled cases, by what tilts their gears, and what a proposal gains."""

from __future__ import annotations

from rows import Row

from face_load.runs import Even, causes, even, gained, proposal

CASES = ("wind-5mw", "grc-750kw")
TUNED = "z_mm of the planet bearings, which moves their springs from mid-face"


def rows(fidelity: str) -> list[Row]:
    """Every gear mesh flexible and rigid; slices; z_mm; proposals."""
    found: list[Row] = []
    for case in CASES:
        bends, rigid = (even(case, fidelity, stiff) for stiff in (False, True))
        found += [_pair(case, "K_Hβ, ring", rigid.ring, bends.ring)]
        found += [_pair(case, "K_Hβ, sun", rigid.sun, bends.sun)]
        found += [_tilt(case, "ring", rigid.ring_tilt, bends.ring_tilt)]
        found += [_tilt(case, "sun", rigid.sun_tilt, bends.sun_tilt)]
        found += _causes(case, fidelity)
        found += _proposals(case, fidelity)
    found += _bearing_place(fidelity) + _slices(fidelity)
    if fidelity != "quick":
        found += _by_fe(fidelity)
    return found


def _pair(case: str, quantity: str, rigid: float, bends: float) -> Row:
    why = "largest of all planets over a gear-mesh cycle; slices beside each other"
    text = f"{rigid:.3f} rigid, {bends:.3f} flexible"
    return Row("face_load", case, quantity, "–", text, "reported", None, why)


def _tilt(case: str, kind: str, rigid: float, bends: float) -> Row:
    text = f"{rigid:.1f} µm rigid, {bends:.1f} µm flexible"
    why = f"ring, carrier and shaft: {bends - rigid:+.1f} µm; rigid: bearings, and helices' moments"
    quantity = f"misalignment over the face, {kind}"
    return Row("face_load", case, quantity, "–", text, "reported", None, why)


def _causes(case: str, fidelity: str) -> list[Row]:
    """By which bodies and bearings gears are tilted, in the mean of the positions."""
    bends, rigid = (causes(case, fidelity, stiff) for stiff in (False, True))
    found = []
    for group, by_cause in bends.items():
        text = ", ".join(
            f"{cause} {round(size, 1) + 0.0:+.1f} µm" for cause, size in by_cause.items()
        )
        less = ", ".join(
            f"{cause} {round(size, 1) + 0.0:+.1f}" for cause, size in rigid[group].items()
        )
        quantity = f"misalignment by cause, {group.rpartition(' ')[2]}"
        why = f"planet misaligned most, flexible; rigid: {less} µm"
        found.append(Row("face_load", case, quantity, "–", text, "reported", None, why))
    return found


def _proposals(case: str, fidelity: str) -> list[Row]:
    made, found = proposal(case, fidelity), []
    amounts = ", ".join(
        f"{key.split('.')[-2]} {key.split('.')[-1]} {1e6 * x:.0f} µm"
        for key, x in made.amounts.items()
    )
    for kind in ("ring", "sun"):
        before, after = gained(made, kind, "largest_line_load_n_per_mm")
        factor = gained(made, kind, "k_h_beta")
        text = f"{before:.0f} to {after:.0f} N/mm, K_Hβ {factor[0]:.3f} to {factor[1]:.3f}"
        found.append(
            Row(
                "face_load",
                case,
                f"proposed flanks: largest line load, {kind}",
                "–",
                text,
                "does not rise by 2 %",
                after < 1.02 * before,
                amounts,
            )
        )
    return found


def _bearing_place(fidelity: str) -> list[Row]:
    """What the bundled case had tuned, tried again."""
    found = []
    for z in ("-30", "0", "30"):
        one: Even = even("wind-5mw", fidelity, False, **{"bearings.planet.z_mm": z})
        tilts = f"tilt {one.ring_tilt:.0f}, {one.sun_tilt:.0f} µm"
        text = f"ring {one.ring:.3f}, sun {one.sun:.3f}; {tilts}"
        found.append(
            Row(
                "face_load", "wind-5mw", f"K_Hβ with z_mm = {z}", "–", text, "reported", None, TUNED
            )
        )
    return found


def _slices(fidelity: str) -> list[Row]:
    fifteen, more = (
        even("wind-5mw", fidelity, True, **{"gear_mesh.slices": n}) for n in ("15", "31")
    )
    worst = max(abs(more.ring / fifteen.ring - 1), abs(more.sun / fifteen.sun - 1))
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
        )
    ]


def _by_fe(fidelity: str) -> list[Row]:
    found = []
    for rigid in (True, False):
        one = even("wind-5mw", fidelity, rigid, "fe")
        text = f"ring {one.ring:.3f}, sun {one.sun:.3f}"
        name = "rigid" if rigid else "flexible"
        found.append(
            Row(
                "face_load",
                "wind-5mw",
                f"K_Hβ by FE influence, {name}",
                "–",
                text,
                "reported",
                None,
                "teeth bend as plates, ends of the face are softer",
            )
        )
    return found
