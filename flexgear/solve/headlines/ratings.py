"""Headlines of ratings: stresses in teeth compared with allowable ones, lives of bearings."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.nominal_stress import pitch_point_pressure
from flexgear.gears.tooth_faults import NOT_ASSESSED
from flexgear.model.member import GearMember
from flexgear.model.names import FlankName, GroupName, NodeName
from flexgear.model.stage_view import StageView
from flexgear.model.units import Quantity
from flexgear.results.load_sharing import ROUNDING
from flexgear.results.report.sharing import first_variant
from flexgear.results.report.wording import factor, number, with_unit, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline, Level
from flexgear.solve.headlines.loads import peaks_of_stage


@dataclass(frozen=True)
class _Kind:
    """A kind of stress. key: key of the allowable stress in a gear; exponent: of the force in the
    stress; computed, nominal: words for stress from the load along the face, and by formula."""

    key: str
    exponent: float
    computed: str
    nominal: str

    def allowable(self, view: StageView, *gears: str) -> float | None:
        """Lowest allowable stress of some gears, Pa; None if the case has none."""
        limits = [getattr(getattr(view.stage, gear), self.key) for gear in gears]
        return min((limit for limit in limits if limit is not None), default=None)


Stresses = Mapping[str, tuple[float, float | None]]  # by gear or gear mesh, with allowables, Pa
_ROOT = _Kind(
    "allowable_root_stress",
    1.0,
    "by finite elements, largest of the equilibria",
    "nominal, of ISO 6336-3:2006 without load factors",
)
_FLANK = _Kind(
    "allowable_flank_pressure",
    0.5,  # by Hertz
    "along the face, largest of the equilibria",
    "nominal at the pitch point, without load factors",
)


def _root_stress(findings: Findings) -> Iterator[Answer]:
    for stage, figures in findings.summary["stages"].items():
        view = findings.case.view(stage)
        computed = {gear: f["max"] for gear, f in figures.get("root_stress_mpa", {}).items()}
        sizes = computed or figures.get("nominal_root_stress_mpa", {})
        stresses = {g: (1e6 * size, _ROOT.allowable(view, g)) for g, size in sizes.items()}
        yield from _largest(findings, stage, _ROOT, bool(computed), stresses)


def _flank_pressure(findings: Findings) -> Iterator[Answer]:
    flanks = first_variant(findings.summary.get("face_load", {}))
    for stage in findings.summary["stages"]:
        view, sizes = findings.case.view(stage), dict[GroupName, float]()
        for flank, figures in flanks.items():
            group = FlankName.parse(flank).group
            if group.stage == stage and "largest_contact_pressure_mpa" in figures:
                size = 1e6 * figures["largest_contact_pressure_mpa"]
                sizes[group] = max(sizes.get(group, 0.0), size)
        computed = bool(sizes)
        if not computed:
            geometry, forces = stage_geometry(view), findings.flow.stage(stage).gear_mesh_forces
            sizes = {
                GroupName.of(stage, view.part(role)): pitch_point_pressure(
                    view, geometry, role, force
                )
                for role, force in forces.items()
                if role in geometry.gear_meshes and force
            }
        stresses = {
            _gear_mesh(view, group): (
                size, _FLANK.allowable(view, view.part(group.role), view.part("planet"))
            )
            for group, size in sizes.items()
        }  # fmt: skip
        yield from _largest(findings, stage, _FLANK, computed, stresses)


def _gear_mesh(view: StageView, group: GroupName) -> str:
    """Name of a group: "sun gear mesh", "sun left gear mesh"; in a parallel stage "gear mesh",
    "left gear mesh"."""
    part = group.side if view.stage.kind == "parallel" else group.part
    return f"{part} gear mesh".strip()


def _largest(
    findings: Findings, stage: str, kind: _Kind, computed: bool, stresses: Stresses
) -> Iterator[Answer]:
    """The answer on stress in a stage: the stress with the largest utilisation, or the largest
    stress without allowables, and all others in its sentence; none without load. computed: whether
    stresses are those by the load along the face."""
    loaded = {g: (size, limit) for g, (size, limit) in stresses.items() if size > 0.0}
    if not loaded:
        return
    limits = {g: f" of {number(limit / 1e6)}" if limit else "" for g, (_, limit) in loaded.items()}
    texts = {g: f"{number(size / 1e6)}{limits[g]} MPa" for g, (size, _) in loaded.items()}
    use = {g: (-size / (limit or math.inf), -size) for g, (size, limit) in loaded.items()}
    gear, *others = sorted(loaded, key=lambda g: use[g])
    basis = kind.computed if computed else kind.nominal
    others_text = "".join(f"; {words(g)} {texts[g]}" for g in others)
    sentence, (size, limit) = f"{words(gear).capitalize()}, {basis}{others_text}.", loaded[gear]
    if limit is None:
        sentence += " Not assessed: no allowable stress given."
        view = findings.case.view(stage)
        gear_member = view.stage.member(view.part("planet"))
        if isinstance(gear_member, GearMember) and gear_member.rating.steel:
            sentence += " `flexgear rate` assesses it by the steels."
        yield Answer("open", stage, size / 1e6, texts[gear], sentence)
        return
    level, reason = _assessed(findings, stage, kind, computed, size, limit)
    unlimited = [words(g) for g, (_, allowed) in loaded.items() if allowed is None]
    if unlimited and level == "good":
        level = "note"  # the other gears are not assessed
    missing = f" No allowable stress given: {', '.join(unlimited)}." if unlimited else ""
    sentence += f" {words(gear).capitalize()}: {reason}{missing}"
    yield Answer(level, stage, size / 1e6, texts[gear], sentence, limit / 1e6)


def _assessed(
    findings: Findings, stage: str, kind: _Kind, computed: bool, stress: float, limit: float
) -> tuple[Level, str]:
    """Verdict on a stress, Pa, and its reason: utilisation of the allowable by this stress, and by
    the stress scaled to the largest gear-mesh force of the run. A stress by formula, without the
    load along the face, never gets the level "good"."""
    ratio = max((p.ratio for p in peaks_of_stage(findings, stage)), default=1.0)
    sharing = findings.sharings.get(stage) if computed else None
    in_equilibria = (sharing and sharing.in_equilibria) or 1.0
    peak = stress * max(1.0, ratio / in_equilibria) ** kind.exponent
    use, peak_use = (with_unit(size / limit, "share") for size in (stress, peak))
    reason = (
        f"{use} of the allowable; {number(peak / 1e6)} MPa, {peak_use}, with the largest "
        f"gear-mesh force, {factor(ratio)} × nominal."
    )
    if stress > limit:
        return "bad", reason
    if peak > limit:
        return "watch", reason
    if computed:
        return "good", reason
    view = findings.case.view(stage)
    lacks = "load" if view.gear_mesh.model != "face_load" else "root stress"
    return "note", f"{reason} No verdict: the {lacks} along the face is not computed."


ROOT_STRESS = Headline(
    "root_stress", "Root stress", "MPa", "largest stress in the roots of the teeth", "face",
    _root_stress, "allowable_root_stress of the gear",
)  # fmt: skip
FLANK_PRESSURE = Headline(
    "flank_pressure", "Flank pressure", "MPa", "largest Hertz pressure between flanks", "face",
    _flank_pressure, "allowable_flank_pressure of the gears in contact",
)  # fmt: skip


UNIT = Quantity("life")
LOADS = {  # kinds of bearings by keys of figures; "" where figures name them
    "planet_bearing_force_n": "planet bearing",
    "carrier_bearing_force_n": "carrier bearing",
    "bearing_force_n": "",
}


def _life(findings: Findings) -> Iterator[Answer]:
    over = findings.summary["equilibrium_window"]
    for stage, figures in findings.summary["stages"].items():
        lives: Mapping[str, float] = figures.get("bearing_life_h", {})
        left_out: Mapping[str, float] = figures.get("not_in_bearing_life", {})
        alone = f"By {radial_alone(left_out)}." if left_out else ""
        view = findings.case.view(stage)
        missing = _unrated(view, figures, {**left_out, **lives})
        film, touches = _film(view, figures)
        if lives:
            bearings = {label: place.bearing for place in view.bearings for label in place.labels}
            seconds = {name: bearings[name].required_life for name in lives}
            required = {n: None if s is None else UNIT.from_si(s, "h") for n, s in seconds.items()}
            shares = {n: lives[n] / hours for n, hours in required.items() if hours is not None}
            name = min(shares or lives, key=lambda n: (shares or lives)[n])
            nominal = figures.get("nominal_planet_bearing_life_h")
            nominal_text = (
                "" if nominal is None else f" Nominal, planet bearing: {with_unit(nominal, 'h')}."
            )
            without = ", ".join(words(n) for n, hours in required.items() if hours is None)
            not_required = "No required life given" + (f": {without}." if shares else ".")
            sentence = (
                f"{words(name).capitalize()}, under the constant load of the same damage over "
                f"{over}. {alone} {not_required if without else ''}{nominal_text} {missing} "
                f"{film}"
            )
            life, limit = lives[name], required[name]
            level: Level = "note"
            figure = with_unit(life, "h")
            if limit is not None:
                figure += f" of {with_unit(limit, 'h')} required"
                if life < limit:
                    level = "bad"
                elif not (without or missing or left_out):  # all bearings are assessed
                    level = "good"
            level = "bad" if touches else level
            yield Answer(level, stage, life, figure, " ".join(sentence.split()), limit, over)
        elif missing or film or alone:
            level, figure = "open", "no rating given" if missing else "no radial load"
            if film and not missing:
                figure = f"oil film {number(figures['least_film_um'])} µm"
            if touches:
                level, figure = "bad", "surfaces touch"
            assessed = f"Not assessed. {alone} {missing}" if missing or alone else ""
            sentence = " ".join(f"{assessed} {film}".split())
            yield Answer(level, stage, None, figure, sentence, window=over)


def radial_alone(shares: Mapping[str, float]) -> str:
    """Words that follow "by" in a sentence on lives without thrust or moment. shares: of thrust or
    moment in the radial load, by bearing."""
    worst = max(shares, key=lambda n: shares[n])
    share = with_unit(shares[worst], "share") if shares[worst] < 10.0 else "over 1 000 %"
    others = f" and {len(shares) - 1} more" if len(shares) > 1 else ""
    return (
        f"the radial load alone, without verdict: {words(worst)}{others}, on which thrust or "
        f"moment is {share} of it; `thrust` counts the former, `flexgear rate` with `elements` both"
    )


def _film(view: StageView, figures: Mapping[str, Any]) -> tuple[str, bool]:
    """Sentence on the least oil film of plain planet bearings, "" without any; and whether it is so
    thin that pin and planet touch."""
    bearing, least = view.stage.planet_bearing, figures.get("least_film_um")
    if bearing.journal is None or least is None:
        return "", False
    limit = 1e6 * bearing.journal.least_film
    sentence = f"Plain planet bearings have no rating life: least oil film {number(least)} µm"
    return f"{sentence}, surfaces touch at {number(limit)} µm.", least <= limit


def _unrated(view: StageView, figures: Mapping[str, Any], with_rating: Iterable[str]) -> str:
    """Sentence that names the loaded rolling bearings without a rating, with their loads; "" if all
    are rated. with_rating: labels of those that have one."""
    plain = view.stage.planet_bearing.journal is not None
    rated = {kind for name in with_rating for kind in (name, NodeName.parse(name).kind)}
    radial, titles = dict[str, float](), dict[str, str]()
    for key, name in LOADS.items():
        if plain and key == "planet_bearing_force_n":
            continue
        value = figures.get(key, {})
        for side, load in (value if isinstance(value, Mapping) else {"": value}).items():
            bearing = f"{name} {side}".strip().replace(" ", "_")
            radial[bearing] = load or 0.0
            titles[bearing] = f"{name}, {words(side)} side" if name and side else words(bearing)
    axial = figures.get("axial_bearing_force_n", {})
    least = ROUNDING * max([*radial.values(), *axial.values()], default=0.0)
    named = []
    for bearing in {**radial, **axial}:
        loads = {"": radial.get(bearing, 0.0), "axial ": axial.get(bearing, 0.0)}
        sizes = [f"{way}{with_unit(load, 'N')}" for way, load in loads.items() if load > least]
        if sizes and bearing not in rated:
            named.append(f"{titles.get(bearing, words(bearing))} ({', '.join(sizes)})")
    return f"No dynamic rating given: {', '.join(named)}." if named else ""


def _faults(findings: Findings) -> Iterator[Answer]:
    faults = findings.case.faults
    if faults:
        several = len(findings.case.stages) > 1
        listed = "; ".join(
            f"{fault.stage.replace('_', ' ')}: {fault.words}" if several else fault.words
            for fault in faults
        )
        sentence = f"{listed}. Not assessed: {NOT_ASSESSED}."
        count = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
        yield Answer("open", "", float(len(faults)), count, sentence)


FAULTS = Headline(
    "faults", "Faults", "1", "number of faults of teeth and bearings, which headlines and "
    "ratings do not assess", "geometry", _faults,
)  # fmt: skip
BEARING_LIFE = Headline(
    "bearing_life", "Bearing life", "h",
    "shortest basic rating life (ISO 281) of the bearings, under the "
    "constant load of the same damage over the positions of equilibria", "bearings", _life,
    "required_life of the bearing", is_least=True,
)  # fmt: skip
