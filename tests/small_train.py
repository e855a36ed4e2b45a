"""A small train as TOML text, for tests to change, and the file of a small flexible stage."""

from pathlib import Path

import pytest

from flexgear.model.errors import InputError
from flexgear.model.load import load_case

SMALL_STAGE = Path(__file__).parents[1] / "docs" / "examples" / "stage.toml"

SMALL = """
[material]
young_modulus_gpa = 210
poisson_ratio = 0.3
density_kg_per_m3 = 7850

[[stages]]
planets = 3
normal_module_mm = 2.5
pressure_angle_deg = 20
face_width_mm = 20
sun = { teeth = 20, mass_kg = 1, inertia_kg_m2 = 1e-3 }
planet = { teeth = 20 }
ring = { teeth = 60, support = { radial_n_per_m = 1e8, tangential_n_per_m = 1e9 } }
carrier = { support = { radial_n_per_m = 1e8 } }
planet_bearing = { radial_n_per_m = 1e8 }
errors = { planet_eccentricity_um = [10] }

[[stages]]
kind = "parallel"
normal_module_mm = 2
pressure_angle_deg = 20
face_width_mm = 20
position_deg = 30
pinion = { teeth = 20, support = { radial_n_per_m = 1e8 } }
gear = { teeth = 40, support = { radial_n_per_m = 1e8 } }

[[joints]]
first = "stage_1.sun"
second = "stage_2.gear"
torsion_nm_per_rad = 1e6

[[inputs]]
member = "stage_1.carrier"
speed_rpm = 10
power_kw = 1

[output]
member = "stage_2.pinion"
"""

ALONE = """
[material]
young_modulus_gpa = 210
poisson_ratio = 0.3
density_kg_per_m3 = 7850

[stage]
planets = 3
normal_module_mm = 2.5
pressure_angle_deg = 20
face_width_mm = 20
sun = { teeth = 20 }
planet = { teeth = 20 }
ring = { teeth = 60, kinematics = "fixed" }
carrier = {}
planet_bearing = { radial_n_per_m = 1e8 }

[[inputs]]
member = "stage.carrier"
speed_rpm = 10
torque_nm = 1e3

[output]
member = "stage.sun"
"""

FLEXIBLE = """
kinematics = "spatial"

[material]
young_modulus_gpa = 210
poisson_ratio = 0.3
density_kg_per_m3 = 7850

[[stages]]
case = "wind-5mw"

[stages.ring.fe]
flexible = false

[stages.errors]
carrier_eccentricity_um = 30

[[inputs]]
member = "stage_1.carrier"
speed_rpm = 11.27
torque_nm = 4e6

[output]
member = "stage_1.sun"
"""

LUMPED_PARTS = {  # of the small flexible stage, in the place of what the file has
    "ring": {
        "stage.ring.fe": "", "stage.ring.support.radial_n_per_m": "1e9",
        "stage.ring.support.tangential_n_per_m": "1e9", "stage.ring.support.axial_n_per_m": "1e9",
        "stage.ring.support.tilt_nm_per_rad": "1e6",
    },
    "carrier": {
        "stage.carrier.fe": "", "stage.carrier.bearing_drive": "", "stage.carrier.bearing_far": "",
        "stage.carrier.support.radial_n_per_m": "3e8", "stage.carrier.support.axial_n_per_m": "1e8",
        "stage.carrier.support.tilt_nm_per_rad": "2e4",
    },
    "sun": {
        "stage.sun.shaft": "", "output.inertia_kg_m2": "", "output.mass_kg": "",
        "output.tilt_inertia_kg_m2": "", "output.bearing": "",
        "stage.sun.support.radial_n_per_m": "1e6", "stage.sun.support.axial_n_per_m": "1e8",
        "stage.sun.support.tilt_nm_per_rad": "1e3",
    },
}  # fmt: skip


def refused(path, text, old, new, words):
    """The text with a change is one clear line that begins with the file and has a remedy."""
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=words) as caught:
        load_case(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    assert " -- " in line
