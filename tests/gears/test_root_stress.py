"""Root stress of ISO 6336-3 against the fillet that a rack cuts, limits and equilibrium."""

import math
from dataclasses import replace

import numpy as np
import pytest
from gears.stages import Gear
from scipy.optimize import brentq

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.nominal_stress import (
    outer_single_contact,
    stage_root_stress,
    virtual_teeth,
    virtual_tooth,
)
from flexgear.gears.power_flow import power_flow
from flexgear.gears.tool import CutterTool, PlainTool
from flexgear.gears.tooth import tooth_geometry
from flexgear.model.load import load_case

GEARS = [
    Gear(),
    Gear(17, 0.0, root_fillet=0.38),
    Gear(60, -0.3, pressure_angle=math.radians(25)),
    Gear(12, 0.5, dedendum=1.4, root_fillet=0.25),
]


def by_the_standard(teeth, gear, free=0.0):
    """s_Fn/m, distance of the section from the centre over m, ρ_F/m: ISO 6336-3:2006, equations 10
    to 16, with the residual protuberance s_pr/m."""
    alpha, rho, g = gear.pressure_angle, gear.root_fillet, gear.root_fillet - gear.dedendum
    g += gear.profile_shift
    e = math.pi / 4 - gear.dedendum * math.tan(alpha)
    e += free / math.cos(alpha) - (1 - math.sin(alpha)) * rho / math.cos(alpha)
    h = 2 / teeth * (math.pi / 2 - e) - math.pi / 3
    theta = brentq(lambda a: a - 2 * g / teeth * math.tan(a) + h, -0.1, 1.5, xtol=1e-15)
    reach = g / math.cos(theta) - rho
    return (
        teeth * math.sin(math.pi / 3 - theta) + math.sqrt(3) * reach,
        (teeth * math.cos(math.pi / 3 - theta) + reach) / 2,
        rho + 2 * g**2 / (math.cos(theta) * (teeth * math.cos(theta) ** 2 - 2 * g)),
    )


@pytest.mark.parametrize("protuberance", [0.0, 0.05])
@pytest.mark.parametrize("helix", [0.0, 0.3])
@pytest.mark.parametrize("gear", GEARS)
def test_the_section_of_a_racks_gear_is_the_standards(gear, helix, protuberance):
    m = gear.normal_module
    tool = PlainTool(protuberance=protuberance * m, grinding_allowance=0.4 * protuberance * m)
    gear = replace(gear, helix_angle=helix, tool=tool)
    section = virtual_tooth(tooth_geometry(gear, gear), gear, gear).root.section
    ratios = np.array([section.thickness, section.distance, section.fillet_radius]) / m
    teeth = virtual_teeth(gear.teeth, gear)
    assert ratios == pytest.approx(by_the_standard(teeth, gear, 0.6 * protuberance), rel=1e-6)


@pytest.mark.parametrize("teeth", [60, 93, 150])
def test_a_rings_radius_is_near_that_of_a_substitute_rack(teeth):
    """A rack of tip radius ρ_fPv = ρ_fP + (x_0 + h_fP − ρ_fP)^1.95/(3.156 · 1.036^z_0) of the
    edition of 2006, rolled with z_n < 0, is a fit to what cutters leave."""
    gear = Gear(teeth, 0.0, normal_module=1.0, tool=PlainTool(teeth=25))
    tooth = tooth_geometry(gear, gear, internal=True)
    assert isinstance(tooth.tool, CutterTool)
    alpha, rho = gear.pressure_angle, gear.root_fillet
    virtual = rho + (gear.dedendum - rho) ** 1.95 / (3.156 * 1.036**tooth.tool.teeth)
    g = virtual - gear.dedendum
    e = math.pi / 4 - gear.dedendum * math.tan(alpha)
    e -= (1 - math.sin(alpha)) * rho / math.cos(alpha)
    h = -2 / teeth * (math.pi / 2 - e) - math.pi / 6
    theta = brentq(lambda a: a + 2 * g / teeth * math.tan(a) + h, -0.1, 1.5, xtol=1e-15)
    radius = 2 * g**2 / (math.cos(theta) * (-teeth * math.cos(theta) ** 2 - 2 * g)) + virtual
    assert tooth.root.section.fillet_radius == pytest.approx(radius, rel=0.05)


def test_a_rings_section_is_where_60_degree_tangents_touch():
    gear = Gear(93, 0.1)
    root = tooth_geometry(gear, gear, internal=True).root
    points = root.points(4000)
    slopes = np.degrees(np.arctan2(np.diff(points[:, 1]), np.diff(points[:, 0])))
    k = int(np.argmax(slopes > 60))
    section = root.section
    assert 2 * points[k, 1] == pytest.approx(section.thickness, abs=1e-3 * gear.normal_module)
    assert points[k, 0] == pytest.approx(section.distance, abs=1e-3 * gear.normal_module)


def test_with_many_teeth_ring_and_rack_have_straight_flanks():
    """Tooth of a rack: centre of the fillet at h_f − ρ below and s/2 + (h_f − ρ) tan α + ρ/cos α
    beside; the 30° (60°) tangent touches it ρ sin below that and ρ cos nearer."""
    gear = Gear(teeth=4_000_000, profile_shift=0.0)
    m, a, rho = gear.normal_module, gear.pressure_angle, gear.root_fillet
    deep = gear.dedendum - rho
    beside = math.pi / 4 + deep * math.tan(a) + rho / math.cos(a)
    sections = {
        30: tooth_geometry(gear, gear).root.section,
        60: tooth_geometry(gear, gear, internal=True).root.section,
    }
    for tangent, section in sections.items():
        at = math.radians(tangent)
        assert section.thickness / m == pytest.approx(2 * (beside - rho * math.cos(at)), rel=1e-4)
        depth = abs(section.distance - gear.teeth * m / 2) / m
        assert depth == pytest.approx(deep + rho * math.sin(at), rel=1e-4)
        assert section.fillet_radius / m == pytest.approx(rho, rel=1e-4)


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
    stresses = stage_root_stress(view, g, forces)
    assert set(stresses) == {
        ("sun", "planet"),
        ("sun", "sun"),
        ("ring", "planet"),
        ("ring", "ring"),
    }
    for one in stresses.values():
        # outside these a figure of ISO 6336-3 is no tooth root
        assert 0.5 < one.form_factor < 4 and 1.2 < one.notch_factor < 4
        assert one.section.thickness / (2 * one.section.fillet_radius) > 1
        assert 0.75 <= one.helix_factor <= 1
    doubled = stage_root_stress(view, g, {slot: -2 * f for slot, f in forces.items()})
    for key, one in doubled.items():
        assert one.stress == pytest.approx(2 * stresses[key].stress, rel=1e-12)


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
