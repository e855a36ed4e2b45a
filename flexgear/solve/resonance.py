"""Excitations near natural frequencies at the operating speeds of a case: figures and verdict."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np
import xarray as xr

from flexgear.analysis.excitation import folded
from flexgear.model.case import Case
from flexgear.model.names import GEAR_MESH, SHAFT, ExcitationName
from flexgear.results.report.parts import Level
from flexgear.results.report.wording import excitation_words, number, with_unit, words
from flexgear.solve.campbell import ERRORS, IDEAL, LEAST
from flexgear.solve.modes import index_word

MAX_LISTED = 24  # meetings in a summary
WATCHED = 0.05  # amplitude over mean gear-mesh force, from which the level is "watch"
SAME_SPEED = 1e-9


def resonance_figures(case: Case, campbell: xr.Dataset, modes: xr.Dataset) -> dict[str, Any]:
    """Section ``resonance`` of a summary; campbell, modes: datasets of the same modes.

    ``met`` lists excitations within ``margin`` of a natural frequency at an operating speed, modes
    of equal frequency together. Those that occur with perfect planets come first, then those that
    only errors cause, each in the order of the force at exact resonance.
    """
    rows = sorted(_rows(case, campbell, modes), key=_rank)
    # stages whose gear-mesh stiffness is not constant or nearly so
    varying = {stage for stage, _, share in _gear_mesh_lines(campbell) if share >= LEAST}
    return {
        "margin": float(campbell.attrs["margin"]),
        "speed_factors": [float(f) for f in np.atleast_1d(campbell.attrs["operating_factors"])],
        "orders": gear_mesh_orders(campbell),
        "unknown_spectrum": [stage for stage in gear_mesh_orders(campbell) if stage not in varying],
        "ideal": sum(row["cause"] == IDEAL for row in rows),
        "errors": sum(row["cause"] == ERRORS for row in rows),
        "met": rows[:MAX_LISTED],
    }


def _rank(row: Mapping[str, Any]) -> tuple[bool, float, float]:
    force = row["force_share"]
    return row["cause"] != IDEAL, -math.inf if force is None else -force, abs(row["away"])


def gear_mesh_orders(campbell: xr.Dataset) -> dict[str, list[int | float]]:
    """Orders of the gear meshes by stage."""
    orders: dict[str, list[int | float]] = {}
    for stage, order, _ in _gear_mesh_lines(campbell):
        orders.setdefault(stage, []).append(int(order) if order.is_integer() else order)
    return orders


def _gear_mesh_lines(campbell: xr.Dataset) -> Iterator[tuple[str, float, float]]:
    """Stage, order and share of the excitations by gear meshes."""
    names = ("kind", "stage", "order", "share")
    columns = (campbell[f"excitation_{name}"].to_numpy().tolist() for name in names)
    for kind, *line in zip(*columns, strict=True):
        if kind == GEAR_MESH:
            yield tuple(line)


def _rows(case: Case, campbell: xr.Dataset, modes: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Rows of ``met``, unsorted: meetings, with modes of equal frequency together."""
    if "meeting" not in campbell.sizes:
        return
    names = ("excitation", "factor", "away", "mode", "frequency", "index", "cause", "force")
    columns = (campbell[f"meeting_{name}"].to_numpy().tolist() for name in names)
    kinds = modes["type"].to_numpy().tolist()
    lines = {str(name): k for k, name in enumerate(campbell["excitation"].to_numpy())}
    for (label, factor, away), rows in groupby(zip(*columns, strict=True), itemgetter(0, 1, 2)):
        first, *others = rows
        mode, frequency, index, cause, force = first[3:]
        line = campbell.isel(excitation=lines[label])
        planets = case.stage(line["excitation_stage"].item()).planets
        excited = line["excitation_index"].item()
        yield {
            "excitation": label,
            "speed_factor": factor,
            "frequency_hz": frequency,
            "modes": [mode, *(row[3] for row in others)],
            "mode_frequency_hz": frequency / (1.0 + away),
            "type": kinds[mode - 1] if mode <= len(kinds) else "",
            "away": away,
            "nodal_index": _mode_index(index, planets),
            "excited_index": excited if excited >= 0 else None,
            "cause": cause,
            "force_share": force if math.isfinite(force) else None,
        }


def _mode_index(index: int, planets: int) -> str:
    """The nodal index of a mode as text: "0", "1 or 4", or the text of its code."""
    if index < 0:
        return index_word(index)
    other = -index % planets
    return f"{index}" if other == folded(index, planets) else f"{index} or {other}"


def resonance_verdict(figures: Mapping[str, Any]) -> tuple[Level, str, str]:
    """Level, figure and sentence on excitations near natural frequencies at operating speeds.

    The level is "watch" if an excitation of a stage with equal planets would change a gear-mesh
    force by a twentieth or more at exact resonance, or by an unknown amount.
    """
    rows: Sequence[Mapping[str, Any]] = figures["met"]
    margin, speeds = with_unit(figures["margin"], "share"), _speeds(figures["speed_factors"])
    unknown = _unknown(figures)
    if not rows:
        orders = orders_words(figures["orders"])
        text = f"{orders} keep {margin} off all natural frequencies {speeds}.{unknown}"
        return ("note" if unknown else "good"), "clear", text
    ideal, other = (next((r for r in rows if r["cause"] == c), None) for c in (IDEAL, ERRORS))
    sentences, level = [], "note"
    if ideal is not None:
        force = ideal["force_share"]
        level = "watch" if force is None or force >= WATCHED else "note"
        raised = "" if force is None else f"; at exact resonance {_force(force)}"
        sentences.append(f"{_met(ideal)}, which perfect gears excite{raised}.")
    if other is not None:
        force = other["force_share"]
        raised = "" if force is None else f"; with a single planet {_force(force)}"
        of_shaft = ExcitationName.parse(other["excitation"]).kind == SHAFT
        errors = "run-out or unbalance" if of_shaft else "unequal planets"
        sentences.append(f"{_met(other)}, which only errors excite, such as {errors}{raised}.")
    counts = f"{figures['ideal']} excited by perfect gears, {figures['errors']} only with errors"
    text = f"Orders within {margin} of a mode {speeds}: {counts}. {' '.join(sentences)}{unknown}"
    figure = with_unit(rows[0]["frequency_hz"], "Hz")
    return ("watch" if level == "watch" else "note"), figure, text


def _force(share: float) -> str:
    return f"a gear-mesh force would vary by {number(100 * share, 2)} % of its mean"


def _met(row: Mapping[str, Any]) -> str:
    """A meeting in words: "Order 7 of the gear mesh, 122.3 Hz, lies 4.5 % above modes 6 and 7 (…,
    117 Hz)"; "on" for a distance below 0.05 %."""
    numbers = " and ".join(map(str, row["modes"][:2]))
    modes = f"mode{'s' if len(row['modes']) > 1 else ''} {numbers}"
    away = f"{100 * abs(row['away']):.1f}"
    side = f"{away} % {'above' if row['away'] > 0 else 'below'}" if float(away) else "on"
    kind, natural = row["type"], with_unit(row["mode_frequency_hz"], "Hz")
    return (
        f"{excitation_words(row['excitation'])}, {with_unit(row['frequency_hz'], 'Hz')}, lies "
        f"{side} {modes} ({kind}{', ' * bool(kind)}{natural})"
    )


def _unknown(figures: Mapping[str, Any]) -> str:
    """Sentence on stages of constant stiffness, whose excitation is unknown; "" without any."""
    stages = figures["unknown_spectrum"]
    if not stages:
        return ""
    of = "" if stages == ["stage"] else f" of {', '.join(map(words, stages))}"
    return (
        f" The gear-mesh stiffness{of} is constant in this model, or hardly varies: it does not "
        "tell which orders teeth excite, and the first three are looked at."
    )


def _speeds(factors: Sequence[float]) -> str:
    if all(abs(f - 1.0) <= SAME_SPEED for f in factors):
        return "at rated speed"
    return "at " + ", ".join(f"{f:.3g}" for f in factors) + " times rated speed"


def orders_words(orders: Mapping[str, Sequence[float]]) -> str:
    """The analysed orders in words: "Orders 1 to 4 of stage one and turns of shafts"."""
    named = [
        f"{span(list(numbers))}{'' if stage == 'stage' else f' of {words(stage)}'}"
        for stage, numbers in orders.items()
    ]
    if not named:
        return "Turns of shafts"
    several = sum(map(len, orders.values())) > 1
    return f"Order{'s' if several else ''} {', '.join(named)} and turns of shafts"


def span(orders: list[float]) -> str:
    """Rising orders in words: "1 to 4 and 7"."""
    runs: list[list[float]] = []
    for order in orders:
        if runs and order == runs[-1][-1] + 1:
            runs[-1].append(order)
        else:
            runs.append([order])
    texts = [f"{r[0]:g} to {r[-1]:g}" if len(r) > 1 else f"{r[0]:g}" for r in runs]
    return " and ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)
