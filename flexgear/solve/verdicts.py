"""Verdicts of a run: its figures held to what they should be, in plain words.

Load sharing is held to the mesh load factor of IEC 61400-4:2012 for the number of planets
(``results.load_sharing``), speeds and mean forces to the power flow's, reductions to the error that
they promise, equilibria and the energy account to zero. Deflections have no limit here: they are
notes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from flexgear.results.report.parts import Level, Verdict
from flexgear.results.report.tables import groups_of, own_variant, stage_figures
from flexgear.results.report.wording import number, said, words
from flexgear.solve.reduction_warnings import PROMISED

Summary = Mapping[str, Any]
AGREES, STRAYS = 0.01, 0.05  # of what a speed or mean force should be
CLOSED = 1e-6  # share of the load that an equilibrium may leave over
BALANCED, UNBALANCED = 0.01, 0.05  # share of the energy not accounted for
STANDARD = "IEC 61400-4:2012"


def verdicts(summary: Summary) -> list[Verdict]:
    """What the first screen of a report says, the most important first."""
    parts = (
        _warnings(summary),
        _sharing(summary),
        _speeds(summary),
        _forces(summary),
        _deflections(summary),
        _rigid_beside_flexible(summary),
        _errors(summary),
    )
    return [verdict for part in parts for verdict in part]


def _warnings(summary: Summary) -> Iterator[Verdict]:
    for text in summary["warnings"]:
        yield Verdict("watch", "Warning", "", text)


def _sharing(summary: Summary) -> Iterator[Verdict]:
    """Of each group of gear meshes: the standard's value is one of equilibria, dynamics come on top
    of it; without equilibria steady running in time is held to it."""
    found = summary["load_sharing"]
    static, dynamic_factors = (
        _largest(*own_variant(found["quasi_static"]).values()),
        _largest(own_variant(found["transient"])),
    )
    for group in dict.fromkeys([*static, *dynamic_factors]):
        k, assumed = static.get(group) or dynamic_factors[group]
        way = "in equilibria" if group in static else "in time"
        most = f"Largest factor at any instant, {way}"
        dynamic = dynamic_factors[group][0] if group in static and group in dynamic_factors else k
        level: Level = "note"
        sentence = f"{most}; {STANDARD} has no value for that number of planets."
        if assumed is not None:
            level = "bad" if k > assumed else "watch" if dynamic > assumed else "good"
            compared = "within" if k <= assumed else "above"
            sentence = (
                f"{most}, {compared} the {assumed:.2f} that {STANDARD} assumes for the number of "
                "planets."
            )
        if group in static and group in dynamic_factors:
            above = assumed is not None and k <= assumed < dynamic
            sentence += f" With dynamics, in time: {dynamic:.3f}{', above it' if above else ''}."
        yield Verdict(level, f"Load sharing, {words(group)}", f"K = {k:.3f}", sentence)
    if not static and not dynamic_factors:
        yield Verdict("note", "Load sharing", "–", "No planets share a load in this case.")


def _largest(*stages: Mapping[str, Any]) -> dict[str, tuple[float, float | None]]:
    """Largest momentary factor and the standard's, by group of gear meshes."""
    return {
        group: (one["instantaneous"], one["iec_61400_4"])
        for figures in stages
        for group, one in groups_of(figures).items()
        if one["instantaneous"] is not None
    }


def _speeds(summary: Summary) -> Iterator[Verdict]:
    wanted = stage_figures(summary, "kinematics")
    for stage, one in stage_figures(summary, "steady").items():
        at = f", {words(stage)}" if stage else ""
        yield _against(
            f"Carrier speed{at}",
            one["carrier_speed_rpm_mean"],
            wanted[stage]["carrier_speed_rpm"],
            "r/min",
        )


def _forces(summary: Summary) -> Iterator[Verdict]:
    for group, force in summary["transient"]["gear_mesh_force"].items():
        stage, _, part = group.partition(" ")
        known = summary["stages"][stage]
        role = "ring" if part.startswith("ring") else "sun"
        expected = known.get(f"{role}_gear_mesh_force_n")
        if expected:
            name = f"Mean gear-mesh force, {words(group)}"
            yield _against(name, abs(force["mean_n"]), expected, "N")


def _against(subject: str, value: float, expected: float, unit: str) -> Verdict:
    """A figure beside the one that the power flow gives."""
    away = abs(value - expected) / abs(expected) if expected else abs(value)
    level: Level = "good" if away <= AGREES else "watch" if away <= STRAYS else "bad"
    share = "" if away < 5e-5 else f", {said(away, 'share')} away"
    sentence = f"The power flow gives {said(expected, unit)}{share}."
    return Verdict(level, subject, said(value, unit), sentence)


def _deflections(summary: Summary) -> Iterator[Verdict]:
    far = summary["transient"]["displacement_um_max"]
    if far and max(far.values()) > 0:
        name = max(far, key=lambda n: far[n])
        yield Verdict("note", "Largest way off the axis", said(1e-6 * far[name], "m"),
                      f"{words(name).capitalize()}, in steady running.")  # fmt: skip
    for stage, one in stage_figures(summary, "steady").items():
        peaks = one["tooth_displacement_peak_um"]
        axis = max(peaks, key=lambda n: peaks[n])
        at = f" of {words(stage)}" if stage else ""
        yield Verdict(
            "note",
            f"Ring tooth{at}",
            said(1e-6 * peaks[axis], "m"),
            f"Largest displacement of tooth node 1 along {axis} in steady running.",
        )


def _rigid_beside_flexible(summary: Summary) -> Iterator[Verdict]:
    """What bending changes in the load sharing of steady running."""
    for stage, one in stage_figures(summary, "steady").items():
        shared = {n: v for n, v in one["load_sharing"].items() if v["mean"] is not None}
        if "rigid" not in shared or len(shared) < 2:
            continue
        name, own = next((n, v) for n, v in shared.items() if n != "rigid")
        rigid = shared["rigid"]["mean"]
        change = 100 * (own["mean"] - rigid) / rigid
        at = f", {words(stage)}" if stage else ""
        yield Verdict("note", f"{name.capitalize()} beside rigid{at}", f"{change:+.2f} %",
                      f"Mean load sharing factor at the ring: {own['mean']:.4f} {name}, "
                      f"{rigid:.4f} with rigid bodies.")  # fmt: skip


def balance_sentence(closure: float) -> str:
    """Whether equilibria are in balance; closure: share of the load that is left over."""
    if closure <= CLOSED:
        return "All forces are in balance."
    return f"Forces are not in balance: {said(closure, 'share')} of the load is left over."


def _errors(summary: Summary) -> Iterator[Verdict]:
    closure = summary.get("equilibrium_closure_max")
    if closure is not None:
        level: Level = "good" if closure <= CLOSED else "bad"
        within = number(closure)
        how = "within rounding" if within == "0" else f"to {within} of the load"
        yield Verdict(level, "Equilibria", "closed" if level == "good" else "not closed",
                      f"Forces balance {how}.")  # fmt: skip
    for name, one in summary.get("reduction", {}).items():
        error = one.get("static_error")
        if error is not None:
            level = "good" if error <= PROMISED else "watch"
            yield Verdict(level, f"Reduced {words(name)}", said(error, "share"),
                          f"Static error beside the full FE mesh; up to {said(PROMISED, 'share')} "
                          "is promised.")  # fmt: skip
    residual = summary["energy_residual"]
    if residual is not None:
        level = "good" if residual <= BALANCED else "watch" if residual <= UNBALANCED else "bad"
        yield Verdict(
            level,
            "Energy account",
            said(residual, "share"),
            "Of the energy in motion that work and losses do not account for.",
        )
