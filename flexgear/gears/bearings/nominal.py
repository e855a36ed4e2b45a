"""Nominal loads and lives of bearings, by the forces of a power flow.

A planet bearing carries the forces of both gear meshes. Sun, ring and carrier have no resultant
force in a stage whose planets share the load evenly. A pinion or a gear is a rigid shaft on the
springs of its supports under the force f of its gear mesh: u = (Σ Kₖ)⁺ f, and support k carries
fₖ = Kₖ u. Where a joint passes forces of another gear to it, equilibria of the train have its loads
(``is_alone``). The force on the pinion, with x from pinion to gear, y in the sense of
its rotation, and T the torque of the rest of the train on it:

    F_x = −|F_t| tan α_wt,   F_t = −T/r_w,   F_z = ∓F_t tan β_b/cos α_wt of right, left hand

(double-helical: F_z = 0), at r_w from its axis; that on the gear is opposite, on the other side.

Between two trains L/L' = (ω'/ω) (C P'/(C' P))^p.
"""

import math
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.bearings.basic_life import (
    EXPONENTS,
    bearing_life_hours,
    equivalent_load,
    paired_force,
)
from flexgear.gears.power_flow import PowerFlow, StageFlow
from flexgear.gears.radii import role_of, stage_radii
from flexgear.model.case import Case
from flexgear.model.stage_view import BearingPlace, StageView

# components of motion without rotation about the axis, by kinematics
COMPONENTS = {"planar": (0, 1), "axial": (0, 1, 2), "spatial": (0, 1, 2, 3, 4)}


class NominalBearing(NamedTuple):
    """Nominal loads and life of a bearing. radial, axial, equivalent: loads of all bearings side by
    side, N; life_hours: L₁₀ₕ, None without a dynamic rating, inf at rest or without load."""

    place: BearingPlace
    radial: float
    axial: float
    equivalent: float
    life_hours: float | None


def bearing_speed(place: BearingPlace, flow: StageFlow) -> float:
    """Speed of the inner relative to the outer ring, rad/s."""
    if place.part == "planet":
        return flow.planet_relative_speed
    return float(getattr(flow, f"{role_of(place.part)}_speed"))


def nominal_bearings(view: StageView, flow: StageFlow) -> dict[str, NominalBearing]:
    """Nominal bearings of the planets (one for all), or of pinion and gear, by label."""
    bearings = {}
    for place in view.bearings:
        force, mate = _force(view, flow, place), view.mate(place)
        mate_force = None if mate is None else _force(view, flow, mate)
        if force is not None and mate is not None and mate_force is not None:
            force = paired_force(place.bearing, force, mate.bearing, mate_force)
        if force is not None:
            radial, axial = math.hypot(force[0], force[1]), abs(float(force[2]))
            equivalent = float(equivalent_load(place.bearing, radial, axial)[0])
            life = bearing_life_hours(place.bearing, radial, bearing_speed(place, flow), axial)
            bearings[place.label] = NominalBearing(place, radial, axial, equivalent, life)
    return bearings


def bearing_life_ratios(
    case: Case, flow: PowerFlow, other: Case, other_flow: PowerFlow
) -> dict[str, dict[str, float]]:
    """Ratio of nominal lives of bearings to those of another train by kind and name, such as
    "stage_1_planet_bearing": (C₁P₂/(C₂P₁))^p ω₂/ω₁, with C₁ = C₂ where not both trains state a
    dynamic rating; only bearings that both trains have, turning under load."""
    states = [
        {
            f"{stage.name}_{label}": (
                (place := nominal.place).bearing.count * (place.bearing.dynamic_rating or 0.0),
                nominal.equivalent,
                abs(bearing_speed(place, stage)),
            )
            for stage in each.stages
            for label, nominal in nominal_bearings(train.view(stage.name), stage).items()
        }
        for train, each in ((case, flow), (other, other_flow))
    ]
    first, second = ({name: x for name, x in state.items() if all(x[1:])} for state in states)
    factors = dict[str, tuple[float, float]]()  # of C/P, and of the time of a revolution
    for name in (name for name in first if name in second):
        (rating, load, speed), (other_rating, other_load, other_speed) = first[name], second[name]
        stated = rating / other_rating if rating and other_rating else 1.0
        factors[name] = stated * other_load / load, other_speed / speed
    return {
        kind: {name: share**p * time for name, (share, time) in factors.items()}
        for kind, p in EXPONENTS.items()
    }


def _force(view: StageView, flow: StageFlow, place: BearingPlace) -> Array | None:
    """Force (3,) on a bearing, N; None if statics does not define it."""
    if place.part == "planet":
        return np.array([flow.planet_bearing_radial, flow.planet_bearing_tangential, 0.0])
    kinematics = view.case.kinematics_of(f"{view.name}.{place.part}")
    if flow.kind != "parallel" or kinematics not in COMPONENTS or not is_alone(view, place.part):
        return None
    free = list(COMPONENTS[kinematics])
    supports = view.stage.member(place.part).supports.values()
    stiffness = np.sum([support.matrix for support in supports], axis=0)[np.ix_(free, free)]
    load = gear_force(view, flow, place.part)[free]
    motion = np.linalg.lstsq(stiffness, load, rcond=1e-12)[0]
    return np.asarray(place.bearing.matrix[:3, free] @ motion)


def is_alone(view: StageView, part: str) -> bool:
    """Whether joints pass nothing but torque to a member, or thrust of gears that have none."""
    member, case = f"{view.name}.{part}", view.case
    for joint in case.joints:
        if member in (joint.first, joint.second):
            other = case.stage(joint.second if member == joint.first else joint.first)
            springs, thrust = joint.stiffness, other.helix_angle and not other.double_helical
            if joint.is_shaft or any((*springs[:2], *springs[3:5])) or (springs[2] and thrust):
                return False
    return True


def blocked_loads(view: StageView, flow: StageFlow, place: BearingPlace) -> tuple[float, float]:
    """Thrust of helical teeth on a bearing in the power flow, N, and its moment, N m, where
    equilibria have none, as the member cannot move along its axis or tilt; zero of others, and
    thrust of bearings without axial stiffness."""
    part, bearing = place.part, place.bearing
    kinematics = view.case.kinematics_of(f"{view.name}.{part}")
    if kinematics == "spatial" or part in ("carrier", "ring"):
        return 0.0, 0.0
    thrust, moment = flow.sun_axial_force, 0.0
    if part == "planet":
        thrust, moment = 0.0, flow.planet_tilting_moment
    elif part in ("pinion", "gear"):
        force = gear_force(view, flow, part)
        thrust, moment = force[2], math.hypot(*force[3:5])
    moves = kinematics == "axial" or bearing.stiffness[2] == 0.0
    return 0.0 if moves else abs(float(thrust)), moment


def gear_force(view: StageView, flow: StageFlow, part: str) -> Array:
    """Force and moment (6,) of the gear mesh on the pinion or gear of a parallel stage at its
    middle, in the axes of the stage, N and N m."""
    radii, stage = stage_radii(view), view.stage
    angle, sides = radii.working_angles["sun"], len(stage.sides)
    tangential = -sides * flow.sun_working_force
    right = 1.0 if stage.planet_hand == "left" else -1.0  # of the pinion
    axial = -right * tangential * math.tan(radii.base_helix_angle) / math.cos(angle)
    force = np.array([-abs(tangential) * math.tan(angle), tangential, axial if sides == 1 else 0.0])
    arm = radii.base["sun"] / math.cos(angle)
    if part == "gear":
        force, arm = -force, -radii.base["planet"] / math.cos(angle)
    c, s = math.cos(stage.position), math.sin(stage.position)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.hstack([turn @ force, turn @ np.cross([arm, 0.0, 0.0], force)])
