"""Life ratios of planet bearings by the printed, mixed rules and by one rule for both turbines."""

from dataclasses import dataclass

from flexgear.gears.bearings.basic_life import ROLLER, rating_life_hours
from yang2019 import printed_rules as printed
from yang2019.trains import (
    CARRIER,
    RING,
    SINGLE_SPEED,
    consistent,
    printed_speeds,
    published,
    single_rotor,
)

KILO = 1e3


def consistent_life(text: str, stage: int) -> float:
    """ISO 281, planet against carrier, force from equilibrium, for double and single rotor."""
    double, single = (
        rating_life_hours(1.0, flow.planet_bearing_force, flow.planet_relative_speed, ROLLER)
        for flow in (train.stage(f"stage_{stage}") for train in (consistent(text), single_rotor()))
    )
    return double / single


def printed_life(text: str, stage: int) -> float:
    """Printed rule with the printed bearing force of Table 9."""
    return life_by_rule(text, stage, published()[f"F_c{stage} at {text}"].value * KILO)


def life_by_rule(text: str, stage: int, force: float) -> float:
    """Printed rule with the double rotor's bearing force (N) as given."""
    flow = printed_speeds(text, "output")
    speeds = flow.speed[CARRIER], -flow.speed[RING]
    single = single_rotor().stage(f"stage_{stage}").carrier_torque
    if stage == 1:
        return printed.life_1(printed.bearing_speed_1(*speeds), force, SINGLE_SPEED, single)
    return printed.life_2(printed.bearing_speed_2(*speeds), force, SINGLE_SPEED, single)


@dataclass(frozen=True)
class Mixture:
    """Factors that undo the two mixtures of the printed rule: speed rules, radii."""

    speeds: float
    radii: float


def mixture(text: str, stage: int) -> Mixture:
    """Of one power ratio and stage. The double rotor's radius is what its printed force holds."""
    if stage == 1:
        torque = printed_speeds(text, "carrier").torque[CARRIER]
        speeds, radius = (printed.P_1 - 1) / 2, printed.RADIUS_1
    else:
        torque = printed_speeds(text, "output").stage("stage_2").carrier_torque
        speeds, radius = 1.0, printed.RADIUS_2_SINGLE
    held = torque / (printed.PLANETS * published()[f"F_c{stage} at {text}"].value * KILO)
    return Mixture(speeds, (radius / held) ** printed.EXPONENT)
