"""Small trains for tests, written as a user writes them."""

from flexgear import load_case
from flexgear.model.load import bundled_text

STEEL = """
[material]
young_modulus_gpa = 210
poisson_ratio = 0.3
density_kg_per_m3 = 7850
"""

# spur stage that assembles with 3, 4, 5, 6 and 7 planets: (26 + 94) / N, and 7 by position
STAGE = (
    STEEL
    + """
[stage]
planets = {planets}
normal_module_mm = 4
pressure_angle_deg = 20
helix_angle_deg = {helix}
planet_hand = "right"
face_width_mm = 60
allow_unassemblable = true
[stage.sun]
teeth = 26
mass_kg = 3
inertia_kg_m2 = 0.004
tilt_inertia_kg_m2 = 0.003
support = {{ radial_n_per_m = {sun} }}
[stage.planet]
teeth = 34
mass_kg = 4
inertia_kg_m2 = 0.01
tilt_inertia_kg_m2 = 0.006
[stage.ring]
teeth = 94
mass_kg = 30
inertia_kg_m2 = 1.2
tilt_inertia_kg_m2 = 0.7
support = {{ radial_n_per_m = 1e9, tangential_n_per_m = 1e10 }}
[stage.carrier]
mass_kg = 25
inertia_kg_m2 = 0.3
tilt_inertia_kg_m2 = 0.2
support = {{ radial_n_per_m = 1e9 }}
[stage.planet_bearing]
radial_n_per_m = 5e8
[stage.gear_mesh]
model = "constant"
sun_stiffness_n_per_m = 6e8
ring_stiffness_n_per_m = 8e8
[[inputs]]
member = "stage.carrier"
speed_rpm = 100
torque_nm = 3000
inertia_kg_m2 = 2
[output]
member = "stage.sun"
inertia_kg_m2 = 0.2
"""
)


def planetary(planets, module, face, sun, planet, ring):
    """TOML text of a stage whose ring is fixed, by sizes in mm and numbers of teeth."""
    return f"""
[[stages]]
planets = {planets}
normal_module_mm = {module}
pressure_angle_deg = 20
face_width_mm = {face}
sun = {{ teeth = {sun} }}
planet = {{ teeth = {planet} }}
ring = {{ teeth = {ring}, kinematics = "fixed" }}
carrier = {{ support = {{ radial_n_per_m = 1e9 }} }}
planet_bearing = {{ radial_n_per_m = 1e9 }}
"""


RING_HELD = {
    "stage.planet.teeth": "16",  # seven of them have room
    "stage.ring.teeth": "58",
    "stage.ring.addendum": "0.6",
    "stage.ring.kinematics": "fixed",
    "stage.ring.support.radial_n_per_m": "0",
    "stage.ring.support.tangential_n_per_m": "0",
}
BEARING = "support = { radial_n_per_m = 1e9 }"


def spur_pair(
    pinion=f"teeth = 30, {BEARING}", gear=f"teeth = 60, {BEARING}", gear_mesh="", *,
    backlash=None, speed=10, torque=500, sections="", output="",
):  # fmt: skip
    """TOML text of two spur gears of module 4 mm, the gear as input: what their tables hold, lines
    of the gear mesh, sections behind it, lines of the output; backlash, µm."""
    gap = "" if backlash is None else f"backlash_sun_um = {backlash}"
    return f"""{STEEL}
[[stages]]
kind = "parallel"
normal_module_mm = 4
pressure_angle_deg = 20
face_width_mm = 40
{gap}
pinion = {{ {pinion} }}
gear = {{ {gear} }}
[stages.gear_mesh]
{gear_mesh}
{sections}
[[inputs]]
member = "stage_1.gear"
speed_rpm = {speed}
torque_nm = {torque}
[output]
member = "stage_1.pinion"
{output}
"""


def mount(radial, axial, tilt, torsion):
    """Keys of what a housing stands on, N/m and N m/rad."""
    directions = {"radial_n": radial, "axial_n": axial, "tilt_nm": tilt, "torsion_nm": torsion}
    return {
        f"housing.mount.{name}_per_{'m' if name.endswith('_n') else 'rad'}": value
        for name, value in directions.items()
    }


def lumped_housing(mass, inertia, *stiffness):
    """Keys of a lumped housing, kg and kg m², on its ``mount``."""
    keys = {"housing.kind": "lumped", "housing.mass_kg": mass, "housing.inertia_kg_m2": inertia}
    return keys | mount(*stiffness)


def write(folder, text, head="", name="train.toml"):
    """A train as a file."""
    path = folder / name
    path.write_text(head + text, encoding="utf-8")
    return path


def stage_train(folder, *, planets=4, sun="0", helix=0, head="", **overrides):
    """The spur stage as a train; overrides by TOML key."""
    path = write(folder, STAGE.format(planets=planets, sun=sun, helix=helix), head)
    return load_case(path, overrides=overrides)


def free_stage(folder, ports="", **settings):
    """lin-parker without inputs and output, or with the ports given."""
    text, rest = bundled_text("lin-parker").split("[[inputs]]")
    text += ports + rest[rest.index("[damping]") :]
    path = folder / "free.toml"
    path.write_text(text, encoding="utf-8")
    return load_case(path, settings)
