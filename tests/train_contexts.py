"""Trains put together for the tests of their studies."""

from dataclasses import replace
from functools import cache

from stage_samples import cheap_stage
from trains import STEEL, stage_train, write

from flexgear.model.load import load_case
from flexgear.solve.model import assemble
from flexgear.structures.tooth_influence.influence import influence_of
from flexgear.structures.tooth_influence.of_case import influence_parameters

BUNDLED = ("lin-parker", "double-rotor-5mw", "nrel-5mw", "herringbone", "pitch-drive")


def put_together(train, **options):
    return assemble(train, **options)


def rigid_stage(case):
    """A single flexible stage with all of its bodies rigid, without making what does not bend."""
    return put_together(case, rigid=["all"], bodies=cheap_stage(case.view()))


@cache
def bundled(name):
    """A bundled train as it is."""
    return put_together(load_case(name))


def one_stage(folder, **overrides):
    """The spur stage of the tests."""
    return put_together(stage_train(folder, **overrides))


def coarse_teeth(view, divisions, **changes):
    """FE influences of the teeth of a stage by gear, on coarse segments; not kept."""
    steel = view.material.young_modulus, view.material.poisson_ratio
    return {
        gear: influence_of(
            replace(influence_parameters(view, gear), divisions=divisions, **changes), *steel
        )
        for gear in ("planet", "sun", "ring")
    }


def behind_wind(speed_rpm, rest):
    """A train whose first stage, driven at its carrier, is that of wind-5mw, as text."""
    first = f"""
[[inputs]]
member = "first.carrier"
speed_rpm = {speed_rpm}
torque_knm = 4000
inertia_kg_m2 = 1e6
[[stages]]
name = "first"
case = "wind-5mw"
[[stages]]
name = "second"
"""
    return STEEL + first + rest


MIXED = behind_wind(
    11.27,
    """
kind = "parallel"
normal_module_mm = 14
pressure_angle_deg = 20
helix_angle_deg = 10
planet_hand = "right"
face_width_mm = 360
[stages.pinion]
teeth = 24
support = { radial_n_per_m = 1e9, axial_n_per_m = 1e9, tilt_nm_per_rad = 1e8 }
[stages.gear]
teeth = 95
support = { radial_n_per_m = 1e9, axial_n_per_m = 1e9, tilt_nm_per_rad = 1e8 }
[[joints]]
first = "first.sun"
second = "second.gear"
torsion_nm_per_rad = 1e8
axial_n_per_m = 1e7
[output]
member = "second.pinion"
inertia_kg_m2 = 500
[solver]
time_step_s = 2e-4
output_interval_ms = 1
""",
)

TWO_FLEXIBLE = behind_wind(
    2,
    """
case = "wind-5mw"
[[joints]]
first = "first.sun"
second = "second.carrier"
torsion_nm_per_rad = 1e9
axial_n_per_m = 1e8
radial_n_per_m = 1e8
tilt_nm_per_rad = 1e7
[output]
member = "second.sun"
""",
)


def mixed(folder):
    """A train with a flexible stage and its cheap bodies."""
    train = load_case(write(folder, MIXED, 'kinematics = "spatial"\n'))
    return train, cheap_stage(train.view("first"))
