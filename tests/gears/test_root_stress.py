"""Root stress of ISO 6336-3 against the fillet that a rack cuts, limits and equilibrium."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import brentq

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.root_stress import (
    drawn_section,
    outer_single_contact,
    rack_section,
    stage_root_stress,
    virtual_tooth,
)
from flexgear.gears.tooth import tooth_geometry
from flexgear.model.load import load_case


@dataclass(frozen=True)
class Gear:
    """A spur rack and what is cut with it."""

    teeth: int = 31
    profile_shift: float = 0.2
    addendum: float = 1.0
    dedendum: float = 1.25
    root_fillet: float = 0.3
    normal_module: float = 5e-3
    pressure_angle: float = math.radians(20)
    helix_angle: float = 0.0


GEARS = [
    Gear(),
    Gear(17, 0.0, root_fillet=0.38),
    Gear(60, -0.3, pressure_angle=math.radians(25)),
    Gear(12, 0.5, dedendum=1.4, root_fillet=0.25),
]


def cut_fillet(gear, turn):
    """Point of the fillet, and its tangent's angle with the tooth's middle line, that a rack's tip
    arc cuts when the gear stands turned by ``turn``: the normal at a point of contact passes
    through the pitch point, wherever the arc is (law of gearing). No formula of ISO is used."""
    m, a = gear.normal_module, gear.pressure_angle
    r, rho = gear.teeth * m / 2, gear.root_fillet * m
    depth = (gear.dedendum - gear.root_fillet - gear.profile_shift) * m
    # the middle of a rack's space is that of the gear's tooth
    flank = (gear.dedendum - gear.root_fillet) * m * math.tan(a) + rho / math.cos(a)
    centre = np.array([r - depth, math.pi * m / 4 + flank + r * turn])
    away = (centre - [r, 0.0]) / np.hypot(*(centre - [r, 0.0]))
    point = centre + rho * away
    c, s = math.cos(turn), math.sin(turn)
    back = np.array([[c, s], [-s, c]])
    return back @ point, back @ away


@pytest.mark.parametrize("gear", GEARS)
def test_the_section_is_where_30_degree_tangents_touch_the_fillet_that_a_rack_cuts(gear):
    def off(turn):
        _, normal = cut_fillet(gear, turn)
        return math.atan2(abs(normal[0]), abs(normal[1])) - math.radians(30)

    m = gear.normal_module
    turns = np.linspace(-0.6, 0.0, 4000)
    values = np.array([off(t) for t in turns])
    last = np.nonzero(np.diff(np.sign(values)))[0]
    sections = []
    for i in last:
        turn = brentq(off, turns[i], turns[i + 1], xtol=1e-15)
        point, _ = cut_fillet(gear, turn)
        h = 1e-6
        (p0, n0), (p1, n1) = cut_fillet(gear, turn - h), cut_fillet(gear, turn + h)
        radius = np.hypot(*(p1 - p0)) / np.hypot(*(n1 - n0))
        sections.append((2 * abs(point[1]), point[0], radius))
    found = rack_section(gear.teeth, gear, gear)
    here = (found.thickness, found.distance, found.fillet_radius)
    errors = [np.abs(np.array(s) - here).max() / m for s in sections]
    assert sections and min(errors) < 1e-6


@pytest.mark.parametrize("internal", [False, True])
def test_a_rings_section_is_where_60_degree_tangents_touch_the_drawn_fillet(internal):
    gear = Gear(93 if internal else 31, 0.1)
    tooth = tooth_geometry(gear, gear, internal=internal)
    section, fillet = drawn_section(tooth), tooth.fillet
    point = np.array([section.distance, section.thickness / 2])
    normal = (np.array(fillet.centre) - point) / tooth.fillet_radius
    assert np.hypot(*normal) == pytest.approx(1.0, abs=1e-6)
    tangent = math.degrees(math.atan2(abs(normal[0]), abs(normal[1])))
    assert tangent == pytest.approx(60 if internal else 30, abs=1e-4)


def test_with_many_teeth_ring_and_rack_have_straight_flanks():
    """Tooth of a rack: centre of the fillet at h_f − ρ below and s/2 + (h_f − ρ) tan α + ρ/cos α
    beside; the 30° (60°) tangent touches it ρ sin below that and ρ cos nearer."""
    gear = Gear(teeth=4_000_000, profile_shift=0.0)
    m, a, rho = gear.normal_module, gear.pressure_angle, gear.root_fillet
    deep = gear.dedendum - rho
    beside = math.pi / 4 + deep * math.tan(a) + rho / math.cos(a)
    sections = {
        30: rack_section(gear.teeth, gear, gear),
        60: drawn_section(tooth_geometry(gear, gear, internal=True)),
    }
    for tangent, found in sections.items():
        at = math.radians(tangent)
        assert found.thickness / m == pytest.approx(2 * (beside - rho * math.cos(at)), rel=1e-4)
        depth = abs(found.distance - gear.teeth * m / 2) / m
        assert depth == pytest.approx(deep + rho * math.sin(at), rel=1e-4)
        assert found.fillet_radius / m == pytest.approx(rho, rel=1e-4)


def test_the_outer_point_of_single_contact_is_one_base_pitch_from_where_the_path_begins():
    """Of a spur pair the virtual gear is the gear itself: the start of the path plus p_b."""
    one, two = Gear(23), Gear(41, -0.1)
    gear, mate = tooth_geometry(one, one), tooth_geometry(two, two)
    low, high = gear.path_of_contact(mate, gear.transverse_angle)
    ratio = (high - low) / gear.base_pitch
    virtual = virtual_tooth(gear, one, one)
    radius = outer_single_contact(virtual, gear.base_pitch, ratio)
    assert gear.roll_length(radius) == pytest.approx(low + gear.base_pitch, rel=1e-12)


@pytest.mark.parametrize("name", ["wind-5mw", "grc-750kw"])
def test_stress_grows_with_load_and_falls_with_face_width(name):
    case = load_case(name)
    flow = power_flow(case).stages[0]
    view = case.view(flow.name)
    g, forces = stage_geometry(view), flow.gear_mesh_forces
    found = stage_root_stress(view, g, forces)
    assert set(found) == {("sun", "planet"), ("sun", "sun"), ("ring", "planet"), ("ring", "ring")}
    for one in found.values():
        # outside these a figure of ISO 6336-3 is no tooth root
        assert 0.5 < one.form_factor < 4 and 1.2 < one.notch_factor < 4
        assert one.section.thickness / (2 * one.section.fillet_radius) > 1
        assert 0.75 <= one.helix_factor <= 1
    doubled = stage_root_stress(view, g, {slot: -2 * f for slot, f in forces.items()})
    for key, one in doubled.items():
        assert one.stress == pytest.approx(2 * found[key].stress, rel=1e-12)


def test_bending_part_is_the_nominal_stress_of_a_beam():
    """Y_F F_t/(b m) = 6 F_n h cos α_F/(b s²), F_n = F_t/cos α: bending of the section, without the
    compression that ISO leaves out."""
    case = load_case("wind-5mw")
    flow = power_flow(case).stages[0]
    view = case.view(flow.name)
    stage, g = view.stage, stage_geometry(view)
    for (slot, _), one in stage_root_stress(view, g, flow.gear_mesh_forces).items():
        normal = abs(flow.gear_mesh_forces[slot]) * math.cos(g.base_helix_angle)
        normal *= math.cos(g.transverse_angle) / math.cos(stage.pressure_angle)
        moment = normal * math.cos(one.load_angle) * one.lever
        bending = 6 * moment / (stage.face_width * one.section.thickness**2)
        assert one.stress == pytest.approx(bending * one.notch_factor * one.helix_factor, rel=1e-12)
