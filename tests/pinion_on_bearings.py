"""A helical gear pair on two bearings a shaft: case, forces by statics, lives by hand."""

import math

from trains import STEEL, write

from flexgear.model.load import load_case
from flexgear.results.rating_files import rating_rows
from flexgear.studies.rating import rate

TORQUE, RPM = 800.0, 1500.0  # of the pinion, which drives
A, B = {"pinion": 0.08, "gear": 0.05}, {"pinion": 0.12, "gear": 0.11}  # m
TEETH, MODULE, HELIX = {"pinion": 21, "gear": 64}, 4.0, 14.0
PLAIN = {"dynamic_rating_kn": 120, "static_rating_kn": 150, "rolling": '"roller"'}
HOURS = 2000.0


def table(values):
    return "{ " + ", ".join(f"{key} = {value}" for key, value in values.items()) + " }"


def supports(part, locating, free=PLAIN):
    """One bearing free along the axis at −A, one with thrust at +B, softer."""
    at_a = {"z_mm": -1e3 * A[part], "radial_n_per_m": 8e8, **free}
    at_b = {"z_mm": 1e3 * B[part], "radial_n_per_m": 3e8, "axial_n_per_m": 2e8, **locating}
    return f"[{table(at_a)}, {table(at_b)}]"


def text(hand="right", position=0.0, torque=TORQUE, locating=PLAIN, more="", free=PLAIN):
    return f"""{STEEL}
[[stages]]
kind = "parallel"
normal_module_mm = {MODULE}
pressure_angle_deg = 20
helix_angle_deg = {HELIX}
planet_hand = "{hand}"
face_width_mm = 50
position_deg = {position}
pinion = {{ teeth = {TEETH["pinion"]}, support = {supports("pinion", locating, free)} }}
gear = {{ teeth = {TEETH["gear"]}, support = {supports("gear", locating, free)} }}
[stages.gear_mesh]
model = "constant"
[[inputs]]
member = "stage_1.pinion"
speed_rpm = {RPM}
torque_nm = {torque}
[output]
member = "stage_1.gear"
[rating]
k_h_beta = 1.0
[[load_cases]]
name = "rated"
hours = {HOURS}
torque_nm = {torque}
[[load_cases]]
name = "gust"
extreme = true
torque_nm = {2 * torque}
{more}
"""


def by_hand(hand="right", torque=TORQUE):
    """Radial force on both bearings of each shaft, and the thrust, N.

    The tooth force on the pinion in its own x (towards the gear) and y (across) at the arm r; on
    the gear the opposite at −r. A right-handed pinion that drives anticlockwise is pushed along +z.
    """
    helix, normal = math.radians(HELIX), math.radians(20)
    radius = {part: 5e-4 * MODULE * z / math.cos(helix) for part, z in TEETH.items()}
    across = -torque / radius["pinion"]
    thrust = abs(across) * math.tan(helix)
    right = 1 if hand == "left" else -1  # of the pinion; the hand is the gear's
    force = (
        -abs(across) * math.tan(normal) / math.cos(helix),
        across,
        right * math.copysign(thrust, torque),
    )
    loads = {}
    for part, sign, arm in (("pinion", 1, radius["pinion"]), ("gear", -1, -radius["gear"])):
        x, y, z = (sign * f for f in force)
        span = A[part] + B[part]
        far_x = (A[part] * x - arm * z) / span  # moments about the bearing at −A
        far_y = A[part] * y / span
        loads[part] = math.hypot(x - far_x, y - far_y), math.hypot(far_x, far_y)
    return loads, thrust


def life(load, speed_rpm, exponent=10 / 3, rating=120e3):
    return 1e6 * (rating / load) ** exponent / (60 * speed_rpm)


SPEEDS = {"pinion": RPM, "gear": RPM * TEETH["pinion"] / TEETH["gear"]}


def cot(degrees):
    return 1 / math.tan(math.radians(degrees))


def of(**thrust):
    return {"thrust": table(thrust)}


BALL = {**PLAIN, "rolling": '"ball"'}


def rated(tmp_path, locating, **options):
    rating = rate(load_case(write(tmp_path, text(locating=locating, **options))), workers=1)
    rows = {tuple(row[:3]): row[3] for row in rating_rows(rating)}
    return rating, lambda name, symbol, of="rated": rows.get((f"stage_1.{name}", of, symbol))
