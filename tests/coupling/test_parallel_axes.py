"""Where the gear of a parallel stage stands turns nothing but the direction of its forces.

Turned as a whole about its axes by φ, a train with its loads, its weight and its supports that are
not alike all round is the same machine: the pinion's gear stands at φ, a carrier is φ further.
"""

import math

import numpy as np
import pytest
from trains import STEEL, lumped_housing, planetary, write

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.model.load import load_case
from flexgear.structures.bodies import rotation

TRAIN = (
    STEEL
    + planetary(3, 5, 60, 18, 27, 72)
    + """
[[stages]]
kind = "parallel"
normal_module_mm = 4
pressure_angle_deg = 20
face_width_mm = 70
pinion = { teeth = 22, support = { radial_n_per_m = 4e8 } }
gear = { teeth = 61 }
[[joints]]
first = "stage_1.sun"
second = "stage_2.gear"
torsion_nm_per_rad = 1e7
radial_n_per_m = 3e8
[[inputs]]
member = "stage_1.carrier"
speed_rpm = 20
torque_nm = 20000
[output]
member = "stage_2.pinion"
"""
)
HOUSING = lumped_housing("50", "[2, 2, 3]", "2e8", "2e8", "4e6", "5e6")
GAP = {"stages.stage_2.gear.support.clearance_um": "80"}


UNEVEN = np.diag([6e8, 2e8, 0.0, 0.0, 0.0, 0.0])  # of the gear, stiffer along one direction
FORCE, WEIGHT = np.array([2e4, -5e4, 0.0]), np.array([0.0, -9.81, 0.0])


def turned(folder, angle, **settings):
    """Gear-mesh forces and torques at the ports of the train turned by an angle, rad."""
    to_fixed = rotation(angle)
    axes = np.kron(np.eye(2), to_fixed)
    force, weight = ((to_fixed @ vector).round(9).tolist() for vector in (FORCE, WEIGHT))
    gear = "stages.stage_2.gear.support"
    alike = f"{gear}.clearance_um" in settings  # a gap is all round
    support = {"radial_n_per_m": "4e8"} if alike else {
        "full_si": str((axes @ UNEVEN @ axes.T).tolist())
    }  # fmt: skip
    keys = {f"{gear}.{key}": value for key, value in support.items()}
    keys |= {"stages.stage_2.position_deg": str(math.degrees(angle))}
    keys |= {"gravity_m_per_s2": str(weight), **settings}
    text = TRAIN + f'[[loads]]\nmember = "stage_2.gear"\nforce_n = {force}\n'
    system = build_system(load_case(write(folder, text), keys))
    carrier = np.array([0.3, 1.7]) + angle
    equilibrium = revolution(modal_system(system), carrier, system.rated_torque)
    return equilibrium.pair_load.sum(axis=-1), equilibrium.torques


@pytest.mark.parametrize("angle", [0.5 * math.pi, 2.0])
@pytest.mark.parametrize(
    "settings", [{}, HOUSING, {**HOUSING, **GAP}], ids=["ground", "housing", "gap"]
)
def test_a_train_turned_as_a_whole_carries_the_same_loads(tmp_path, angle, settings):
    (loads, torques), (turned_loads, others) = (
        turned(tmp_path, a, **settings) for a in (0.0, angle)
    )
    assert np.abs(turned_loads - loads).max() < 1e-8 * np.abs(loads).max()
    assert np.abs(others - torques).max() < 1e-8 * np.abs(torques).max()
