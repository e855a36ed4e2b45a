"""Tables and statements of the paper beside power flow and bearing life: list of rows."""

from collections.abc import Iterable
from dataclasses import replace
from statistics import mean

from rows import Row, compared, gathered

from flexgear.gears.bearings.basic_life import rating_life_hours
from flexgear.gears.radii import stage_radii
from yang2019 import printed_rules as printed
from yang2019.lives import consistent_life, life_by_rule, mixture, printed_life
from yang2019.trains import (
    CARRIER,
    PAPER,
    RATED,
    RATIOS,
    RING,
    RPM,
    SUN,
    consistent,
    power_ratio,
    printed_speeds,
    published,
    ring_speed,
    single_rotor,
    train,
)

SIX = RATIOS[:6]  # up to 6/4, which the paper finds fit for use
KILO = 1e3


def rows() -> list[Row]:
    """Every row of the paper."""
    return gathered(PAPER, table_2, table_3, table_4, table_7, table_8, table_9, lives, words)


def row(quantity: str, computed: float, why: str = "", digits: int = 6) -> Row:
    """A published quantity beside a computed one."""
    return compared(PAPER, published()[quantity], computed, digits, why)


def aside(quantity: str, label: str, computed: float, why: str = "", digits: int = 6) -> Row:
    """The same published quantity beside what another rule gives; nothing is demanded."""
    line = replace(published()[quantity], tolerance=None, reason=why)
    line = replace(line, quantity=f"{quantity}, {label}")
    return compared(PAPER, line, computed, digits)


def table_2() -> Iterable[Row]:
    """Ratios and diameters that follow from teeth and module."""
    one, flow = train("nrel-5mw"), single_rotor()
    speed = flow.speed
    ratios = (
        speed[SUN] / speed[CARRIER],
        speed["stage_2.sun"] / speed["stage_2.carrier"],
        abs(speed["stage_3.pinion"] / speed["stage_3.gear"]),
    )
    for stage, ratio in zip(one.stages, ratios, strict=True):
        name = stage.name.replace("_", " ")
        radii = stage_radii(one.view(stage.name))
        yield row(f"ratio of {name}", ratio)
        parts = ("pinion", "gear") if stage.kind == "parallel" else ("sun", "planet", "ring")
        for part, slot in zip(parts, ("sun", "planet", "ring"), strict=False):
            diameter = 2 * radii.reference[slot] * KILO
            yield row(f"reference diameter, {part} of {name}", diameter, digits=7)
    last = one.stages[2]
    assert last.pinion is not None
    root = 2 * stage_radii(one.view(last.name)).reference["sun"]
    root -= 2 * last.normal_module * (1.25 - last.pinion.profile_shift)
    yield row("root diameter, pinion of stage 3", root * KILO)


def table_3() -> Iterable[Row]:
    """Ring speed from the balance of torques at the given powers."""
    for text in (*RATIOS, "9/1"):
        yield row(f"n_b1 at {text}", ring_speed(text) / RPM)
    text = "1/9"
    per = ring_speed(text) / RPM / (published()[f"n_x1 at {text}"].value * power_ratio(text))
    yield row("n_b1/(n_x1 phi)", per, "torques of carrier and ring are as 75 to 56", digits=7)
    one = single_rotor()
    pull = 2 * one.stage("stage_1").tangential_force
    yield row(
        "coefficient of n_x1 in F_xc",
        RATED / (pull * one.speed[CARRIER]),
        "equation 12 enters no table, and equation 13 agrees with statics",
    )


def table_4() -> Iterable[Row]:
    """Sun speeds at the printed rotor speeds."""
    for name, member in (("n_a1", SUN), ("n_a2", "stage_2.sun")):
        for text in RATIOS:
            yield row(f"{name} at {text}", printed_speeds(text, "output").speed[member] / RPM)
    far = {t: _from_590(t) for t in RATIOS}
    name = "largest distance of n_a2 from 590 r/min, 1/9 to 6/4"
    yield row(name, max(far[t] for t in SIX), digits=4)
    for text in ("7/3", "8/2"):
        yield row(f"distance of n_a2 from 590 r/min at {text}", far[text], digits=4)


def _from_590(text: str) -> float:
    """Distance of n_a2 from 590 r/min, %."""
    return 100 * abs(printed_speeds(text, "output").speed["stage_2.sun"] / RPM / 590 - 1)


def table_7() -> Iterable[Row]:
    """Tangential forces on the sun's reference circle at 5 MW through the train."""
    for text in RATIOS:
        flow = printed_speeds(text, "output")
        yield row(f"F_tc1 at {text}", flow.stage("stage_1").tangential_force / KILO)
        yield row(f"n_x2 at {text}", flow.speed["stage_2.carrier"] / RPM)
        yield row(f"F_tc2 at {text}", flow.stage("stage_2").tangential_force / KILO)
    flow = consistent("5/5")
    yield aside(
        "F_tc1 at 5/5",
        "on the sun's working circle",
        flow.stage("stage_1").sun_working_force / KILO,
        "planets sit at 863 mm, not 810 mm; ring mesh "
        f"{flow.stage('stage_1').ring_working_force / KILO:.1f} kN, for it has another working "
        "angle; the normal force is the same",
    )


def table_8() -> Iterable[Row]:
    """Torques, and bearing speeds by the printed rules and by z_b/z_c."""
    for text in RATIOS:
        flow = printed_speeds(text, "output")
        yield row(f"T_x1 at {text}", printed_speeds(text, "carrier").torque[CARRIER] / KILO)
        yield row(f"T_b1 at {text}", -printed_speeds(text, "ring").torque[RING] / KILO)
        yield row(f"T_x2 at {text}", flow.stage("stage_2").carrier_torque / KILO)
        yield row(f"T_b2 at {text}", -flow.stage("stage_2").ring_torque / KILO)
        rule = printed.bearing_speed_1(flow.speed[CARRIER], -flow.speed[RING])
        yield row(f"omega_1 at {text}", rule, "printed rule: z_b/z_a (ω_x + ω_b)")
        yield aside(
            f"omega_1 at {text}",
            "consistent",
            abs(flow.stage("stage_1").planet_relative_speed),
            "planet against carrier: z_b/z_c (ω_x + ω_b)",
        )
        rule = printed.bearing_speed_2(flow.speed[CARRIER], -flow.speed[RING])
        yield row(f"omega_2 at {text}", rule, "printed rule: 2p/(p − 1) ω_x2")
        yield aside(
            f"omega_2 at {text}",
            "consistent",
            abs(flow.stage("stage_2").planet_relative_speed),
            "planet against carrier: z_b/z_c ω_x2; 2p/(p − 1) would need 37.5 planet teeth, not 36",
        )
    yield _imbalance()


def _imbalance() -> Row:
    """The two printed torques of stage 1 against each other."""
    figures = published()
    worst = max(
        RATIOS,
        key=lambda t: abs(figures[f"T_b1 at {t}"].value / figures[f"T_x1 at {t}"].value - 56 / 75),
    )
    ratio = figures[f"T_b1 at {worst}"].value / figures[f"T_x1 at {worst}"].value
    flow = consistent(worst)
    held = -flow.torque[RING] / flow.torque[CARRIER]
    return Row(
        PAPER, "Table 8", f"T_b1/T_x1 at {worst}", f"{ratio:.6f}",
        f"{held:.6f} ({100 * (held / ratio - 1):+.2g} %)", "0.15 %",
        bool(abs(held / ratio - 1) < 1.5e-3),
        "z_b/(z_a + z_b) in any equilibrium. Printed torques are power over a rotor speed of two "
        "decimals, so they miss it by as much as that speed is rounded; each is met above with its "
        "own rotor's power given, both together cannot be",
    )  # fmt: skip


def table_9() -> Iterable[Row]:
    """Forces on planet bearings by the printed radii and by equilibrium."""
    for text in RATIOS:
        torque = printed_speeds(text, "carrier").torque[CARRIER]
        rule = printed.bearing_force_1(torque) / KILO
        yield row(f"F_c1 at {text}", rule, "printed rule: T_x1/(3 · 0.810 m)")
        bearing = consistent(text).stage("stage_1")
        yield aside(
            f"F_c1 at {text}",
            "consistent",
            bearing.planet_bearing_force / KILO,
            f"T_x1/(3 · 0.863 m) = {bearing.planet_bearing_tangential / KILO:.2f} kN tangentially "
            f"and {bearing.planet_bearing_radial / KILO:.2f} kN radially, since the working angles "
            "of sun and ring mesh differ",
        )
        torque = printed_speeds(text, "output").stage("stage_2").carrier_torque
        rule = printed.bearing_force_2(torque) / KILO
        yield row(f"F_c2 at {text}", rule, "printed rule: T_x2/(3 · 0.516 m)")
        bearing = consistent(text).stage("stage_2")
        yield aside(
            f"F_c2 at {text}",
            "consistent",
            bearing.planet_bearing_force / KILO,
            "planets sit at 0.584 m; reference radii would give 0.567 m; 0.516 m is neither",
        )


def lives() -> Iterable[Row]:
    """Life ratios by the printed, mixed rules and by one rule for both turbines."""
    mixed = {
        1: "printed rule: bearing speed by 2p/(p − 1) for the single rotor, by p for the double; "
        "forces of Table 9, single rotor at 0.810 m",
        2: "printed rule: radius 0.567 m for the single rotor, 0.516 m (Table 9) for the double",
    }
    for text in RATIOS:
        for stage, why in mixed.items():
            yield row(f"L_{stage} at {text}", printed_life(text, stage), why, digits=5)
            yield _consistent_life(text, stage)
    for text in ("5/5", "1/9"):
        force = printed.bearing_force_1(printed_speeds(text, "carrier").torque[CARRIER])
        yield aside(
            f"L_1 at {text}",
            "equation 21 as it stands",
            life_by_rule(text, 1, force),
            "0.810 m in both forces; only 5/5 of Table 9 was computed so",
            digits=5,
        )


def _consistent_life(text: str, stage: int) -> Row:
    """What remains with one speed rule and one radius for both turbines, and why it differs."""
    ratio, rule, undo = (
        consistent_life(text, stage),
        printed_life(text, stage),
        mixture(text, stage),
    )
    explained = rule * undo.speeds * undo.radii
    speeds = f"one rule for both speeds: × (p − 1)/2 = {undo.speeds:.4f}; " if stage == 1 else ""
    line = published()[f"L_{stage} at {text}"]
    return Row(
        PAPER, line.where, f"{line.quantity}, consistent", line.text,
        f"{ratio:.4f} ({100 * (ratio / line.value - 1):+.2f} %)",
        "0.1 % of the printed rule with its mixtures undone",
        bool(abs(ratio / explained - 1) < 1e-3),
        f"{speeds}one radius for both: × {undo.radii:.4f}; the printed rule's {rule:.4f} becomes "
        f"{explained:.4f}",
    )  # fmt: skip


def words() -> Iterable[Row]:
    """What the text concludes."""
    figures, one = published(), single_rotor()
    flows = {text: consistent(text) for text in RATIOS}
    for k in (1, 2):
        name = f"mean L_{k}, 1/9 to 6/4"
        yield row(name, mean(figures[f"L_{k} at {t}"].value for t in SIX), "of Table 9", digits=5)
        clean = mean(consistent_life(t, k) for t in SIX)
        yield aside(name, "consistent", clean, "mean of the consistent ratios", digits=5)
    half = [f.torque[CARRIER] / one.torque[CARRIER] for f in flows.values()]
    half += [
        f.stage(s).tangential_force / one.stage(s).tangential_force
        for f in flows.values()
        for s in ("stage_1", "stage_2")
    ]
    yield Row(
        PAPER, "section 5.3, conclusion 1", "torques and forces over the single rotor's",
        "nearly half smaller", f"{min(half):.3f} to {max(half):.3f} of the single rotor's",
        "0.45 to 0.6", bool(min(half) > 0.45 and max(half) < 0.6),
        "they fall as the sun's speed rises: twice as fast at 5 MW",
    )  # fmt: skip
    yield from _life_conclusions()
    flow = flows["5/5"]
    first, second = flow.stage("stage_1"), flow.stage("stage_2")
    yield row("T_x1/T_x2", first.carrier_torque / second.carrier_torque, digits=4)
    yield row("T_b1/T_b2", first.ring_torque / second.ring_torque, digits=4)
    yield from _absolute_lives()
    yield _rolling_power()


def _life_conclusions() -> Iterable[Row]:
    """Conclusions 2 and 3, and which stage gains more."""
    lives = {k: {t: consistent_life(t, k) for t in RATIOS} for k in (1, 2)}
    for k, low, high in ((1, 3, 5), (2, 2, 4)):
        values = lives[k].values()
        inside = low <= min(values) and max(values) <= high
        yield Row(
            PAPER, "conclusion 2", f"life of planet bearings, stage {k}", f"{low} to {high} times",
            f"{min(values):.2f} to {max(values):.2f} times", "reported", None,
            "" if inside else "the printed figures mix two radii; with one, stage 2 gains more",
        )  # fmt: skip
    more = all(lives[2][t] > lives[1][t] for t in RATIOS)
    yield Row(
        PAPER, "section 5.3.4", "which stage's bearings gain more life", "stage 1, a little",
        "stage 2 at every power ratio" if more else "stage 1 at some power ratios",
        "reported", None,
        "with one rule forces fall by the same factor in both stages, but planets of stage 2 run "
        "1.8 to 2.0 times as fast as under the single rotor, those of stage 1 2.1 to 2.4 times",
    )  # fmt: skip
    shortest = all(lives[k][t] < min(lives[k][u] for u in SIX)
                   for t in ("7/3", "8/2") for k in (1, 2))  # fmt: skip
    yield Row(
        PAPER, "conclusion 3", "power ratios 7/3 and 8/2", "shortest lives",
        "shortest lives" if shortest else "not the shortest", "holds", shortest,
        "n_x1 was chosen lower there, so the sun of stage 1 turns more slowly under more torque",
    )  # fmt: skip


def _absolute_lives() -> Iterable[Row]:
    """L10h with the rated loads of Table 6, which the paper does not print."""
    for stage in ("stage_1", "stage_2"):
        name = f"C of a planet bearing, {stage.replace('_', ' ')}"
        rating = published()[name].value * KILO
        hours = [
            rating_life_hours(rating, s.planet_bearing_force, s.planet_relative_speed)
            for s in (single_rotor().stage(stage), consistent("5/5").stage(stage))
        ]
        yield Row(
            PAPER, "Table 6", f"L10h of one planet bearing, {stage.replace('_', ' ')}",
            "not printed", f"{hours[0]:,.0f} h single, {hours[1]:,.0f} h double rotor at 5/5",
            "reported", None,
            f"C = {rating / KILO:.0f} kN, one bearing a planet, rated load all the time", "",
        )  # fmt: skip


def _rolling_power() -> Row:
    """Power that the teeth of stage 1 pass as seen from the carrier."""
    double, single = (
        abs(f.stage("stage_1").stage_power) for f in (consistent("5/5"), single_rotor())
    )
    loop = max(consistent("5/5").circulating_power, single_rotor().circulating_power)
    return Row(
        PAPER, "Figure 3", "power through the teeth of stage 1 (relative to the carrier)",
        "not printed", f"{double / 1e6:.3f} MW double rotor at 5/5, {single / 1e6:.3f} MW single",
        "reported", None,
        "tooth losses go with it: forces halve, rolling speed more than doubles. Circulating power "
        f"{loop:g} W, for both powers meet and leave by the sun", "",
    )  # fmt: skip
