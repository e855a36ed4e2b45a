"""Power flow of the double rotor at each power ratio, and of the single rotor.

The upwind rotor (UR) drives the ring of stage 1, the downwind rotor (DR) its carrier, against each
other: carrier speeds are positive here, ring speeds negative. φ = P_UR / P_DR.
"""

import math
from functools import cache, partial
from typing import Literal

from rows import reference

from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.model.case import Case
from flexgear.model.load import load_case

PAPER = "yang2019"
RPM = math.pi / 30
RATED = 5e6  # W
SINGLE_SPEED = 12.1 * RPM  # rated speed of the single rotor
RATIOS = ("1/9", "2/8", "3/7", "4/6", "5/5", "6/4", "7/3", "8/2")  # 9/1 is in Table 3 only
CARRIER, RING, SUN = "stage_1.carrier", "stage_1.ring", "stage_1.sun"
OUTPUT = "stage_3.pinion"
Rated = Literal["carrier", "ring", "output"]


published = partial(reference, "yang2019")


def power_ratio(text: str) -> float:
    """ "2/8" -> 0.25."""
    top, bottom = text.split("/")
    return float(top) / float(bottom)


def rotor_powers(text: str) -> tuple[float, float]:
    """P_UR (ring) and P_DR (carrier), W; equations 3 and 4."""
    phi = power_ratio(text)
    return RATED * phi / (1 + phi), RATED / (1 + phi)


@cache
def train(name: str) -> Case:
    """A bundled case."""
    case = load_case(name)
    assert isinstance(case, Case)
    return case


@cache
def double_rotor(
    carrier: float, ring: float, powers: tuple[float, float], rated: Rated
) -> PowerFlow:
    """Flow at both rotors' speeds (rad/s, rotors positive in their own sense).

    powers: of ring and carrier, W. With both speeds given one port alone can have its power, the
    others follow from torque balance: rated says which, "output" the sum of both powers.
    """
    ends: dict[str, dict[str, float]] = {CARRIER: {"speed": carrier}, RING: {"speed": -ring}}
    output: dict[str, float] = {}
    if rated == "output":
        speed = double_rotor(carrier, ring, powers, "carrier").speed[OUTPUT]
        output["torque"] = -sum(powers) / speed
    else:
        port, power = (RING, powers[0]) if rated == "ring" else (CARRIER, powers[1])
        ends[port]["power"] = power
    return power_flow(
        train("double-rotor-5mw").with_(
            inputs=tuple({"member": member, **values} for member, values in ends.items()),
            output={"member": OUTPUT, **output},
        )
    )


def printed_speeds(text: str, rated: Rated) -> PowerFlow:
    """Flow at Table 3's rounded speeds."""
    carrier, ring = (published()[f"{name} at {text}"].value * RPM for name in ("n_x1", "n_b1"))
    return double_rotor(carrier, ring, rotor_powers(text), rated)


def ring_speed(text: str) -> float:
    """Speed at which the ring's share of the power needs just its torque; rad/s.

    The torque is that of the balance with the carrier's, whatever the ring's speed.
    """
    carrier = published()[f"n_x1 at {text}"].value * RPM
    powers = rotor_powers(text)
    return powers[0] / -double_rotor(carrier, 1.0, powers, "carrier").torque[RING]


def consistent(text: str) -> PowerFlow:
    """Flow at Table 3's carrier speed and the ring speed that belongs to it, not rounded."""
    carrier = published()[f"n_x1 at {text}"].value * RPM
    return double_rotor(carrier, ring_speed(text), rotor_powers(text), "output")


@cache
def single_rotor() -> PowerFlow:
    """The NREL gearbox with all power on its carrier."""
    return power_flow(
        train("nrel-5mw").with_(
            inputs=({"member": CARRIER, "speed": SINGLE_SPEED, "power": RATED},),
            output={"member": OUTPUT},
        )
    )
