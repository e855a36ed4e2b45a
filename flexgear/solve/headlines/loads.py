"""Headlines of loads and motions: forces, sharing, deflections, neglected effects, resonance."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flexgear.model.modifications import FlankModifications, GearModifications, PlanetModifications
from flexgear.model.names import FlankName, GroupName
from flexgear.results.report.sharing import (
    Sharing,
    first_variant,
    forces_of_halves,
    groups_of,
    sharings,
)
from flexgear.results.report.wording import factor, number, window_words, with_unit, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline, Level
from flexgear.solve.resonance import resonance_verdict
from flexgear.solve.result_warnings import (
    CONSEQUENCE,
    EFFECTS,
    PULLED,
    effects_of,
    motion_shares,
    transmission_errors,
)

STANDARD = "IEC 61400-4:2012"
PARTED = "flanks part, or the other ones carry."
ALIKE = 5e-5  # K − 1 below which planets carry equal loads: K is printed as 1.0000
UNEVEN = 5e-3  # share of a half over one half, above which it is printed
WHOLE_FACE = 2.0  # K_Hβ up to which a face that is tilted evenly carries over its whole width
ROUNDING = 1e-6  # displacement over the limit for small ones, below which it is zero


@dataclass(frozen=True)
class Peak:
    """Largest force of a stage's gear meshes in one part of a run, over the nominal force."""

    ratio: float
    force: float
    group: str
    window: str
    reversed: bool  # whether a force passes zero


def _peak(findings: Findings, stage: str, figures: Mapping[str, Any], window: str) -> Peak | None:
    """Peak of a stage from the figures of one part of a run; window: this part in words."""
    nominal = findings.summary["stages"][stage]
    peaks = []
    for label, force in figures["gear_mesh_force"].items():
        group = GroupName.parse(label)
        rated = nominal.get(f"{group.role}_gear_mesh_force_n")
        if group.stage == stage and rated:
            largest = max(abs(force["max_n"]), abs(force["min_n"]))
            passes_zero = force["min_n"] * force["max_n"] <= 0.0
            peaks.append(Peak(largest / rated, largest, group.part, window, passes_zero))
    return max(peaks, key=lambda p: p.ratio, default=None)


def _torque_drops(findings: Findings) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The torque drops of the case itself, each as description and figures."""
    for depth, variants in findings.summary["torque_steps"].items():
        yield f"in the torque drop to {with_unit(float(depth), 'N m')}", first_variant(variants)


def peaks_of_stage(findings: Findings, stage: str) -> list[Peak]:
    """Largest gear-mesh forces of a stage: in steady running, then in each torque drop."""
    transient = findings.summary["transient"]
    parts = [(window_words(transient), transient), *_torque_drops(findings)]
    return [p for window, part in parts if (p := _peak(findings, stage, part, window))]


def _largest_force(findings: Findings) -> Iterator[Answer]:
    for stage in findings.summary["stages"]:
        peaks = peaks_of_stage(findings, stage)
        if not peaks:
            continue
        peak, steady = max(peaks, key=lambda p: p.ratio), peaks[0]
        level: Level = "note"
        view = findings.case.view(stage)
        where = "" if view.stage.kind == "parallel" else f" at {words(peak.group)}"
        sentence = f"{with_unit(peak.force, 'N')}{where}, {peak.window}"
        if peak is not steady:
            sentence += f"; {factor(steady.ratio)} × in time {steady.window}"
        covered = findings.sharings[stage].assumed if stage in findings.sharings else None
        sentence += (
            f". A rating by nominal load must cover {factor(peak.ratio)} by its load factors"
        )
        if covered is not None and peak.ratio > covered:
            level = "watch"
            rest = factor(peak.ratio / covered)
            sentence += (
                f": the mesh load factor of {STANDARD}, {covered:.2f}, leaves {rest} to K_A and K_v"
            )
        sentence += "."
        if any(p.reversed for p in peaks):
            level = "watch"
            one_sided = view.gear_mesh.contact_law == "one-sided"
            sentence += f" The force of a gear mesh passes zero: {PARTED if one_sided else PULLED}"
        sentence += _excitation(findings, stage)
        figure = f"{factor(peak.ratio)} × nominal"
        yield Answer(level, stage, peak.ratio, figure, sentence, covered, peak.window)


def _excitation(findings: Findings, stage: str) -> str:
    """Sentence on what the gear-mesh model leaves out or adds to the peak: no excitation by gear
    meshes of constant stiffness, sudden contact of spur gears without tip relief; "" otherwise."""
    view = findings.case.view(stage)
    if view.gear_mesh.model == "constant":
        return (
            " The stiffness of its gear meshes is constant in this model, so that tooth pairs "
            "excite no vibration as they come into contact and leave it. Load factors must cover "
            "that, too; a gear mesh with a spring for each tooth pair (key per_pair) computes it."
        )
    if view.gear_mesh.model != "per_pair" or view.stage.helix_angle != 0.0:
        return ""
    roles = ("planet", "sun") if view.stage.kind == "parallel" else ("planet", "sun", "ring")
    parts = [view.part(role) for role in roles if getattr(view.stage, view.part(role), None)]
    unrelieved = [p for p in parts if not _is_relieved(getattr(view.stage, p).modifications)]
    if not unrelieved:
        return ""
    return (
        f" Spur teeth without tip relief ({', '.join(unrelieved)}) take up load at once in this "
        "model, which raises the peak: give them tip relief, or compare with the gear-mesh model "
        "of slices along the face."
    )


def _is_relieved(modifications: GearModifications | PlanetModifications) -> bool:
    """Whether a gear has tip relief on any flank, by key or by table."""
    flanks = [
        modifications,
        *(f for f in vars(modifications).values() if isinstance(f, FlankModifications)),
    ]
    return any((f.tip_relief and f.tip_relief.amount > 0.0) or f.table for f in flanks)


def _load_sharing(findings: Findings) -> Iterator[Answer]:
    """Answers on load sharing. K of equilibria is compared with the mesh load factor of the
    standard, which does not include dynamics; without equilibria K in time."""
    for sharing in findings.sharings.values():
        yield _stage_sharing(findings, sharing)
    together = groups_of(first_variant(findings.summary["load_sharing"]["transient"]))
    if together and not findings.sharings:
        why = "The planets carry no load together, so that K is not defined."
        yield Answer("note", "", None, "–", why)


def _stage_sharing(findings: Findings, sharing: Sharing) -> Answer:
    """The answer on load sharing of one stage."""
    factors = [k for k in (sharing.in_equilibria, sharing.in_time) if k is not None]
    level: Level = "note"
    compared = f"{STANDARD} has no value for that number of planets"
    if sharing.assumed is not None:
        level = "bad" if factors[0] > sharing.assumed else "good"
        level = "watch" if level == "good" and factors[-1] > sharing.assumed else level
        some_within, some_above = min(factors) <= sharing.assumed, max(factors) > sharing.assumed
        side = ("in part above" if some_within else "above") if some_above else "within"
        compared = (
            f"{side} the {sharing.assumed:.2f} that {STANDARD}, of wind turbines, assumes for so "
            "many planets"
        )
    in_time = f"; in time {sharing.window}" if sharing.in_time is not None else ""
    sentences = [f"{compared[0].upper()}{compared[1:]}{in_time}."]
    alike = factors[0] - 1.0 < ALIKE
    if alike or not findings.summary["errors_given"]:
        level = "note" if level == "good" else level
        sentences.append(
            "Apart from vibration planets carry equal loads: the case has no errors that differ "
            "between them (pin positions, run-out), or a floating member compensates for these."
            if alike
            else "No errors given: planets share unevenly by deflections alone."
        )
    sentences += [sharing.reason, _halves(sharing, findings.summary["transient"])]
    drops = [
        (k, window)
        for window, part in _torque_drops(findings)
        for group, k in part["load_sharing"].items()
        if k is not None and GroupName.parse(group).stage == sharing.stage
    ]
    if drops:
        k, window = max(drops)
        sentences.append(f"K = {factor(k)} {window}.")
        if level == "good" and sharing.assumed is not None and k > sharing.assumed:
            level = "watch"
    sentences.append(_rigid(findings, sharing))
    figure = f"K = {sharing.figure}"
    text = " ".join(filter(None, sentences))
    return Answer(level, sharing.stage, max(factors), figure, text, sharing.assumed, sharing.window)


def _halves(sharing: Sharing, transient: Mapping[str, Any]) -> str:
    """Sentence with K in each half of a double-helical stage, and with the half that carries more
    than the other where that is visible; "" for other stages."""
    if not sharing.halves:
        return ""
    text = ", ".join(f"{side} half {factor(k)}" for side, k in sharing.halves)
    shares = [
        (of_sides[side] / total, side, group.kind)
        for group, of_sides in forces_of_halves(transient).items()
        if group.stage == sharing.stage and (total := sum(of_sides.values()))
        for side in of_sides
    ]
    share, side, kind = max(shares, default=(0.5, "", ""))
    if share - 0.5 > UNEVEN:
        text += f". The {side} half carries {number(100 * share, 3)} % of the load at the {kind}"
    return f"K within each half: {text}."


def _rigid(findings: Findings, beside: Sharing) -> str:
    """Sentence with K in time of a stage with rigid bodies, and its window where that is another;
    "" if it is not computed."""
    rigid = findings.summary["load_sharing"]["transient"].get("rigid")
    if rigid is None or len(findings.summary["load_sharing"]["transient"]) < 2:
        return ""
    alone = sharings({"quasi_static": {}, "transient": {"rigid": rigid}})
    same = next((s for s in alone if s.stage == beside.stage), None)
    if same is None or same.in_time is None:
        return ""
    window = "" if same.window == beside.window else f" {same.window}"
    return f"With rigid bodies K = {factor(same.in_time)} in time{window}."


LARGEST_FORCE = Headline(
    "largest_gear_mesh_force",
    "Largest gear-mesh force",
    "1",
    "largest normal force of a gear mesh over the nominal force of the power flow, in the "
    "transient and in torque drops",
    "gear_meshes",
    _largest_force,
    f"mesh load factor of {STANDARD} for the number of planets; K_A and K_v come on top",
)
LOAD_SHARING = Headline(
    "load_sharing",
    "Load sharing",
    "1",
    "K: largest load of a planet over the mean of all, at the worst instant of equilibria and of "
    "the transient",
    "sharing",
    _load_sharing,
    f"mesh load factor of {STANDARD} for the number of planets",
)


def _deflections(findings: Findings) -> Iterator[Answer]:
    summary = findings.summary
    motions = {name: 1e-6 * size for name, size in summary["motion_um_max"].items()}  # m
    window = f"in equilibria and {window_words(summary['transient'])}"
    for stage, shares in motion_shares(findings.case, motions).items():
        if not any(share.size for share in shares):
            continue  # all its bodies can only turn
        worst = max(shares, key=lambda s: s.size / s.limit)
        farthest = max(shares, key=lambda s: s.size)
        size = worst.size if worst.size > ROUNDING * worst.limit else 0.0
        sentence = (
            f"{words(worst.body).capitalize()}, {number(100 * size / worst.limit, 2)} % of the "
            f"limit for small displacements beside {worst.beside}; {window}."
        )
        if farthest.body != worst.body and size:
            sentence += f" Largest: {words(farthest.body)}, {with_unit(farthest.size, 'm')}."
        if worst.size > worst.limit:
            sentence += f" {CONSEQUENCE}"
        figure = f"{with_unit(size, 'm') if size else '0'} of {with_unit(worst.limit, 'm')}"
        level: Level = "good" if size <= worst.limit else "bad"
        yield Answer(level, stage, 1e6 * size, figure, sentence, 1e6 * worst.limit, window)


def _face_load(findings: Findings) -> Iterator[Answer]:
    by_stage: dict[str, list[tuple[float, str]]] = {}
    for flank, figures in first_variant(findings.summary.get("face_load", {})).items():
        stage = FlankName.parse(flank).group.stage
        if figures.get("k_h_beta"):
            by_stage.setdefault(stage, []).append((figures["k_h_beta"], flank))
    for stage, factors in by_stage.items():
        value, flank = max(factors)
        sentence = f"Largest over mean load along the face in equilibria, at {words(flank)}."
        level: Level = "note" if value <= WHOLE_FACE else "watch"
        if level == "watch":
            sentence += (
                " Above 2 part of the face carries little or nothing: flexgear modify proposes "
                "helix slope and crowning that even out the load."
            )
        yield Answer(level, stage, value, f"K_Hβ = {factor(value)}", sentence)


def _transmission_error(findings: Findings) -> Iterator[Answer]:
    for length in transmission_errors(findings.summary):
        figure = with_unit(length.value, "m")
        yield Answer("note", length.stage, 1e6 * length.value, figure, length.sentence)


def _neglected(findings: Findings) -> Iterator[Answer]:
    """Answers on neglected effects that exceed a tenth of a figure, by stage."""
    by_stage: dict[str, list[Mapping[str, Any]]] = {}
    for row in findings.summary.get("neglected", ()):
        by_stage.setdefault(str(row.get("stage", "")), []).append(row)
    for stage, rows in by_stage.items():
        effects: dict[str, float] = {}
        for row in rows:
            effects |= row["effects_um"]
        named = ", ".join(
            f"{row['figure'].lower()} {with_unit(1e-6 * row['value_um'], 'm')}"
            for row in rows
            if "value_um" in row
        )
        sizes = ", ".join(f"{EFFECTS[n]} up to {number(x, 3)} µm" for n, x in effects.items())
        sentences = [f"{sizes[0].upper()}{sizes[1:]}."]
        sentences += [f"They exceed a tenth of: {named}."] if named else []
        sentences += [row["sentence"] for row in rows if "load_sharing" in row]
        figure = f"up to {number(max(effects.values()), 3)} µm"
        yield Answer("watch", stage, max(effects.values()), figure, " ".join(sentences))
    case, flow = findings.case, findings.flow
    small = {name for s in case.stages for name in effects_of(case, flow, s.name)}
    if small and not by_stage:
        about = " and ".join(text for name, text in EFFECTS.items() if name in small)
        yield Answer("good", "", None, "small", f"Up to a tenth of the figures: {about}.")


DEFLECTIONS = Headline(
    "deflections", "Deflections", "µm",
    "displacement of the member that uses most of what its gears allow", "deflections",
    _deflections,
    "a tenth of the module, the room between tips and roots, with linear contact the backlash",
)  # fmt: skip
FACE_LOAD = Headline(
    "face_load", "Load along the face", "1",
    "face load factor K_Hβ: largest over mean load of a gear mesh along the face", "face",
    _face_load,
)  # fmt: skip
TRANSMISSION_ERROR = Headline(
    "transmission_error", "Transmission error", "µm",
    "largest peak to peak of a gear mesh over the equilibria", "face", _transmission_error,
)  # fmt: skip
NEGLECTED = Headline(
    "neglected_effects", "Neglected effects", "µm",
    "largest effect that the models leave out and that is not small against a figure", "accuracy",
    _neglected, "a tenth of the figure",
)  # fmt: skip


def _resonance(findings: Findings) -> Iterator[Answer]:
    figures = findings.summary["resonance"]
    level, figure, sentence = resonance_verdict(figures)
    nearest = min((abs(row["away"]) for row in figures["met"]), default=None)
    yield Answer(level, "", nearest, figure, sentence)


RESONANCE = Headline(
    "resonance", "Resonance", "1",
    "least distance of an excitation at an operating speed from a natural frequency that it meets, "
    "over that frequency; null: none within the margin", "modes", _resonance,
)  # fmt: skip
