"""Small trains for tests of speeds and torques: unshifted gears, what turns turns freely."""

from flexgear.model.bodies import Material
from flexgear.model.case import Case
from flexgear.model.stage import Stage
from flexgear.model.train import Input, Joint, Output

STEEL = Material(young_modulus=206e9, poisson_ratio=0.3, density=7850.0)
HOLD = {"support": {"tangential": 1e9}}
BEARING = {"radial": 1e8, "axial": 1e8, "tilt": 1e4}


def planetary(name="a", sun=24, planet=36, ring=None, held=("ring",), **keys) -> dict:
    """A planetary stage; ``held``: its parts that have a support against turning."""
    gear = {"addendum": 0.8}
    data = {
        "name": name,
        "planets": 3,
        "normal_module": 0.01,
        "pressure_angle": 0.35,
        "face_width": 0.1,
        "sun": {"teeth": sun, **gear},
        "planet": {"teeth": planet, **gear},
        "ring": {"teeth": ring or sun + 2 * planet, **gear},
        "carrier": {},
        "planet_bearing": BEARING,
        "allow_unassemblable": True,
    }
    for part in held:
        data[part] = {**data[part], **HOLD}
    return {**data, **keys}


def parallel(name="p", pinion=20, gear=60, **keys) -> dict:
    """A gear pair."""
    return {
        "name": name,
        "kind": "parallel",
        "normal_module": 0.01,
        "pressure_angle": 0.35,
        "face_width": 0.1,
        "pinion": {"teeth": pinion, "addendum": 0.8},
        "gear": {"teeth": gear, "addendum": 0.8},
        **keys,
    }


def joint(first: str, second: str) -> Joint:
    return Joint(first=first, second=second, torsion=1e9)


def train(*stages: dict, inputs, output, joints=(), held=(), **keys) -> Case:
    """inputs: {member: {"speed": …, "torque": …}}; output: (member, {…}); joints: pairs."""
    return Case(
        material=STEEL,
        stages=tuple(Stage.model_validate(stage) for stage in stages),
        inputs=tuple(Input(member=member, **values) for member, values in inputs.items()),
        output=Output(member=output[0], **output[1]),
        joints=tuple(joint(*pair) for pair in joints),
        held=held,
        source="test.toml",
        **keys,
    )
