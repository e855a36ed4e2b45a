"""Headlines of ratings: stresses in teeth beside what the case allows, lives of bearings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.nominal_stress import pitch_point_pressure
from flexgear.gears.tooth_faults import NOT_ASSESSED
from flexgear.model.bearings import Rolling
from flexgear.model.names import FlankName, GroupName, NodeName
from flexgear.model.stage_view import StageView
from flexgear.model.units import Quantity
from flexgear.results.report.sharing import first_variant, sharings
from flexgear.results.report.wording import factor, number, with_unit, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline, Level
from flexgear.solve.headlines.loads import peaks_of_stage


@dataclass(frozen=True)
class _Kind:
    """A kind of stress. key: of a gear, its allowable; exponent: of the force that it grows with;
    computed, nominal: what it is, from the load along the face and by formula alone."""

    key: str
    exponent: float
    computed: str
    nominal: str


@dataclass(frozen=True)
class _Part:
    """Stresses of one kind in a stage. gears: by the name of a stress, whose stress it is, a gear
    or both of a gear mesh; computed: from the load along the face, not by formula alone."""

    findings: Findings
    stage: str
    kind: _Kind
    gears: Mapping[str, tuple[str, ...]]
    computed: bool

    def allowable(self, name: str) -> float | None:
        """Allowable of a stress, Pa; of two gears in contact the lower one, None where the case
        gives none."""
        stage = self.findings.case.view(self.stage).stage
        limits = [getattr(getattr(stage, gear), self.kind.key) for gear in self.gears[name]]
        return min((limit for limit in limits if limit is not None), default=None)


_ROOT = _Kind(
    "allowable_root_stress",
    1.0,
    "by finite elements, largest of the equilibria",
    "nominal, of ISO 6336-3 without load factors",
)
_FLANK = _Kind(
    "allowable_flank_pressure",
    0.5,  # of Hertz
    "along the face, largest of the equilibria",
    "nominal at the pitch point, without load factors",
)


def _root_stress(findings: Findings) -> Iterator[Answer]:
    for stage, figures in findings.summary["stages"].items():
        computed = {gear: f["max"] for gear, f in figures.get("root_stress_mpa", {}).items()}
        stresses = computed or figures.get("nominal_root_stress_mpa", {})
        gears = {gear: (gear,) for gear in stresses}
        yield from _largest(_Part(findings, stage, _ROOT, gears, bool(computed)), stresses)


def _flank_pressure(findings: Findings) -> Iterator[Answer]:
    flanks = first_variant(findings.summary.get("face_load", {}))
    for stage in findings.summary["stages"]:
        view = findings.case.view(stage)
        stresses: dict[str, float] = {}
        gears: dict[str, tuple[str, ...]] = {}
        for flank, figures in flanks.items():
            group = FlankName.parse(flank).group
            if group.stage == stage and "largest_contact_pressure_mpa" in figures:
                largest = figures["largest_contact_pressure_mpa"]
                gear_mesh = _gear_mesh(view, group)
                stresses[gear_mesh] = max(stresses.get(gear_mesh, 0.0), largest)
                gears[gear_mesh] = (view.part(group.kind), view.part("planet"))
        computed = bool(stresses)
        if not computed:
            geometry, forces = stage_geometry(view), findings.flow.stage(stage).gear_mesh_forces
            for role, force in forces.items():
                if role in geometry.gear_meshes and force:
                    gear_mesh = _gear_mesh(view, GroupName.of(stage, role))
                    pressure = pitch_point_pressure(view, geometry, role, force)
                    stresses[gear_mesh] = pressure / 1e6
                    gears[gear_mesh] = (view.part(role), view.part("planet"))
        yield from _largest(_Part(findings, stage, _FLANK, gears, computed), stresses)


def _gear_mesh(view: StageView, group: GroupName) -> str:
    """ "sun gear mesh", "sun left gear mesh"; of a parallel stage "gear mesh", "left gear mesh"."""
    part = group.side if view.stage.kind == "parallel" else group.part
    return f"{part} gear mesh".strip()


def _largest(part: _Part, stresses_mpa: Mapping[str, float]) -> Iterator[Answer]:
    """The stress of a stage that uses most of its allowable, and the others beside it; the largest
    where none has an allowable, and nothing of a stage without load."""
    stage, loaded = part.stage, {g: 1e6 * s for g, s in stresses_mpa.items() if s > 0.0}
    if not loaded:
        return
    basis = part.kind.computed if part.computed else part.kind.nominal
    allowed = {gear: part.allowable(gear) for gear in loaded}
    gear, *others = sorted(
        loaded, key=lambda g: (-loaded[g] / (allowed[g] or math.inf), -loaded[g])
    )
    beside = "".join(f"; {words(g)} {_of(loaded[g], allowed[g])}" for g in others)
    sentence, limit = f"{words(gear).capitalize()}, {basis}{beside}.", allowed[gear]
    figure = _of(loaded[gear], limit)
    if limit is None:
        open_sentence = f"{sentence} Not assessed: no allowable stress given."
        yield Answer("open", stage, loaded[gear] / 1e6, figure, open_sentence)
        return
    level, reason = _held(part, loaded[gear], limit)
    unheld = [words(g) for g in loaded if allowed[g] is None]
    if unheld and level == "good":
        level = "note"  # of the other gears nothing is known
    missing = f" No allowable stress given: {', '.join(unheld)}." if unheld else ""
    sentence += f" {words(gear).capitalize()}: {reason}{missing}"
    yield Answer(level, stage, loaded[gear] / 1e6, figure, sentence, limit / 1e6)


def _held(part: _Part, stress: float, limit: float) -> tuple[Level, str]:
    """Verdict on a stress, Pa, and its reason: the stress as it is, and scaled to the largest
    gear-mesh force of the run, beside the allowable. A stress by formula is never within limits,
    since it knows nothing of the load along the face."""
    ratio = max((p.ratio for p in peaks_of_stage(part.findings, part.stage)), default=1.0)
    in_equilibria = 1.0
    if part.computed:
        every = sharings(part.findings.summary["load_sharing"])
        in_equilibria = next((s.in_equilibria or 1.0 for s in every if s.stage == part.stage), 1.0)
    peak = stress * max(1.0, ratio / in_equilibria) ** part.kind.exponent
    reason = (
        f"{_percent(stress / limit)} of the allowable; {number(peak / 1e6)} MPa, "
        f"{_percent(peak / limit)}, with the largest gear-mesh force, {factor(ratio)} × nominal."
    )
    if stress > limit:
        return "bad", reason
    if peak > limit:
        return "watch", reason
    if part.computed:
        return "good", reason
    return "note", f"{reason} No verdict: the load along the face is not computed."


def _of(stress: float, limit: float | None) -> str:
    """ "246.6 of 400 MPa"."""
    beside = "" if limit is None else f" of {number(limit / 1e6)}"
    return f"{number(stress / 1e6)}{beside} MPa"


def _percent(share: float) -> str:
    return f"{number(100.0 * share, 3)} %"


ROOT_STRESS = Headline(
    "root_stress", "Root stress", "MPa", "largest stress in the roots of the teeth", "face",
    _root_stress, "allowable_root_stress of the gear",
)  # fmt: skip
FLANK_PRESSURE = Headline(
    "flank_pressure", "Flank pressure", "MPa", "largest Hertz pressure between flanks", "face",
    _flank_pressure, "allowable_flank_pressure of the gears in contact",
)  # fmt: skip


UNIT = Quantity("life")
LOADS = {"planet_bearing_force_n": "planet bearing", "carrier_bearing_force_n": "carrier bearing"}


def _life(findings: Findings) -> Iterator[Answer]:
    over = findings.summary["equilibrium_window"]
    for stage, figures in findings.summary["stages"].items():
        lives: Mapping[str, float] = figures.get("bearing_life_h", {})
        missing = _unrated(figures, lives)
        if lives:
            required = _required(findings.case.view(stage), lives)
            shares = {n: lives[n] / hours for n, hours in required.items() if hours is not None}
            name = min(shares or lives, key=lambda n: (shares or lives)[n])
            nominal = figures.get("nominal_planet_bearing_life_h")
            beside = (
                "" if nominal is None else f" Nominal, planet bearing: {with_unit(nominal, 'h')}."
            )
            without = ", ".join(words(n) for n, hours in required.items() if hours is None)
            unasked = "No required life given" + (f": {without}." if shares else ".")
            sentence = (
                f"{words(name).capitalize()}, under the constant load of the same damage over "
                f"{over}. {unasked if without else ''}{beside} {missing}"
            )
            life, limit = lives[name], required[name]
            level: Level = "note"
            figure = with_unit(life, "h")
            if limit is not None:
                figure += f" of {with_unit(limit, 'h')} required"
                if life < limit:
                    level = "bad"
                elif not (without or missing):  # else of some bearings nothing is known
                    level = "good"
            yield Answer(level, stage, life, figure, " ".join(sentence.split()), limit, over)
        elif missing:
            yield Answer("open", stage, None, "no rating given", f"Not assessed. {missing}")


def _required(view: StageView, names: Iterable[str]) -> dict[str, float | None]:
    """Required life of bearings by their names in a summary, h; None where the case has none."""
    bearings: dict[str, Rolling] = {"planet_bearing": view.stage.planet_bearing}
    bearings |= {f"carrier_bearing_{side}": seat for side, seat in view.seat_bearings.items()}
    seconds = {name: bearings[NodeName.parse(name).kind].required_life for name in names}
    return {n: None if s is None else UNIT.from_si(s, "h") for n, s in seconds.items()}


def _unrated(figures: Mapping[str, Any], lives: Mapping[str, float]) -> str:
    """Bearings that have no life, with their loads."""
    loads, rated = [], {NodeName.parse(name).kind for name in lives}
    for key, name in LOADS.items():
        rating = figures.get(key, {})
        sides = rating if isinstance(rating, Mapping) else {"": rating}
        for side, load in sides.items():
            if load and f"{name} {side}".strip().replace(" ", "_") not in rated:
                at = f", {words(side)} side" if side else ""
                loads.append(f"{name}{at} ({with_unit(load, 'N')})")
    return f"No dynamic rating given: {', '.join(loads)}." if loads else ""


def _faults(findings: Findings) -> Iterator[Answer]:
    faults = findings.case.faults
    if faults:
        listed = "; ".join(fault.words for fault in faults)
        sentence = f"{listed}. Not assessed: {NOT_ASSESSED}."
        count = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
        yield Answer("open", "", float(len(faults)), count, sentence)


FAULTS = Headline(
    "faults", "Faults", "1", "number of faults of teeth and bearings, which headlines and "
    "ratings do not assess", "geometry", _faults,
)  # fmt: skip
BEARING_LIFE = Headline(
    "bearing_life", "Bearing life", "h",
    "shortest basic rating life (ISO 281) of the bearings of planets and carriers, under the "
    "constant load of the same damage over the positions of equilibria", "bearings", _life,
    "required_life of the bearing", is_least=True,
)  # fmt: skip
