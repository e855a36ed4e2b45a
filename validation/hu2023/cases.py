"""The bundled case `pitch-drive` as numbers for the plain equations."""

from functools import cache

import numpy as np

from flexgear.model.case import Case
from flexgear.model.load import load_case
from flexgear.model.member import GearMember
from hu2023.equations import Drive, Stage


@cache
def train() -> Case:
    """The bundled case."""
    case = load_case("pitch-drive")
    assert isinstance(case, Case)
    return case


@cache
def drive() -> Drive:
    """What the case holds; masses that it leaves out as discs of the reference diameters."""
    case = train()
    splines = [joint.tangential for joint in case.joints] + [1.41e9]  # Table 3: the output's
    stages = []
    for stage, spline in zip(case.stages, splines, strict=True):
        sun, planet, ring, carrier = stage.sun, stage.planet, stage.ring, stage.carrier
        assert sun and planet and ring and carrier
        assert stage.gear_mesh.sun_stiffness and stage.gear_mesh.ring_stiffness
        assert carrier.mass and carrier.equivalent_mass
        teeth = (sun.teeth, planet.teeth, ring.teeth)
        base = 0.5 * stage.normal_module * np.cos(stage.pressure_angle)
        distance = stage.center_distance
        assert distance
        angles = [
            float(np.arccos(base * z / distance))
            for z in (teeth[0] + teeth[1], teeth[2] - teeth[1])
        ]
        stages.append(
            Stage(
                teeth=teeth,
                module=stage.normal_module,
                angles=(angles[0], angles[1]),
                carrier_support=carrier.support.stiffness[0],
                spline=spline,
                stiffness=(stage.gear_mesh.sun_stiffness, stage.gear_mesh.ring_stiffness),
                carrier_mass=carrier.mass,
                sun_support=None if sun.kinematics == "torsional" else sun.support.stiffness[0],
                bearing=stage.planet_bearing.stiffness[0],
                sun=disc(sun, stage.normal_module, stage.face_width, base),
                planet=disc(planet, stage.normal_module, stage.face_width, base),
                carrier_inertia=carrier.equivalent_mass,
            )
        )
    return Drive(stages=tuple(stages))


def disc(gear: GearMember, module: float, width: float, base: float) -> tuple[float, float]:
    """Mass and J/r_b² (kg) of a steel disc of the reference diameter with the gear's bore."""
    outer, inner = 0.5 * module * gear.teeth, 0.5 * (gear.bore_diameter or 0.0)
    mass = np.pi * (outer**2 - inner**2) * width * train().material.density
    inertia = 0.5 * mass * (outer**2 + inner**2)
    return float(mass), float(inertia / (base * gear.teeth) ** 2)
