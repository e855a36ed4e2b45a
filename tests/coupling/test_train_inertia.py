"""Inertia at ports and joints counts once: kinetic energy of the rolling train in closed form."""

import numpy as np
import pytest
from coupled import make_bodies
from train_contexts import mixed
from trains import STEEL, stage_train, write

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.coupling.springs import behind_spline
from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case

STEEL_DENSITY = 7850.0
ALONE = (
    STEEL
    + """
[[stages]]
case = "wind-5mw"
[[inputs]]
member = "stage_1.carrier"
speed_rpm = 11.27
torque_knm = 4000
[output]
member = "stage_1.sun"
"""
)


def disc(outer, inner, width):
    """Polar inertia of a hollow steel cylinder, kg m²."""
    return np.pi / 2 * STEEL_DENSITY * width * (outer**4 - inner**4)


def polar(body):
    """Polar inertia of a cheap body about the axis, kg m²: Σ m r² + J of its nodes."""
    m = np.diag(body.mass).reshape(-1, 6)
    return float((m[:, 0] * (body.positions[:, :2] ** 2).sum(axis=1) + m[:, 5]).sum())


def flexible_inertia(case, carrier):
    """Σ J (ω/ω_carrier)² of a flexible stage's own bodies, ports apart, and ω_sun/ω_carrier."""
    stage, g = case.stage, stage_geometry(case)
    z_s, z_p, z_r = (getattr(stage, name).teeth for name in ("sun", "planet", "ring"))
    sun, planet = 1 + z_r / z_s, (z_r - z_p) / z_p
    bores = {name: getattr(stage, name).bore_diameter / 2 for name in ("sun", "planet")}
    discs = {
        name: disc(getattr(g, name).reference_radius, bores[name], stage.face_width)
        for name in bores
    }
    mass = (
        np.pi * STEEL_DENSITY * stage.face_width
        * (g.planet.reference_radius**2 - bores["planet"] ** 2)
    )  # fmt: skip
    shaft = sum(
        disc(s.outer_diameter / 2, s.inner_diameter / 2, s.length) for s in case.shaft.sections
    )
    planets = stage.planets * (mass * g.center_distance**2 + discs["planet"] * planet**2)
    return polar(carrier) + planets + (discs["sun"] + shaft) * sun**2, sun


def energy(system):
    """Twice the kinetic energy of rolling at one radian per second of the first port."""
    phi = system.rolling[:, 0]
    return float(phi @ system.mass @ phi)


def test_a_flexible_stage_before_another(tmp_path):
    train, bodies = mixed(tmp_path)
    inertia, ratio = flexible_inertia(train.view(train.stages[0].name), bodies["first.carrier"])
    second = train.stages[1]
    radius = {
        g: second.normal_module * getattr(second, g).teeth / 2 / np.cos(second.helix_angle)
        for g in ("pinion", "gear")
    }
    behind = disc(radius["gear"], 0.0, second.face_width)
    pinion = (disc(radius["pinion"], 0.0, second.face_width) + 500.0) * (95 / 24) ** 2
    expected = 1e6 + inertia + (behind + pinion) * ratio**2
    assert energy(build_system(train, bodies)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("settings", "drive", "output"),
    [({}, 1e6, 4e4), ({"inputs.0.inertia_kg_m2": "7e5", "output.inertia_kg_m2": "3e3"}, 7e5, 3e3)],
    ids=["from the stage's case", "from the ports"],
)
def test_ends_that_are_ports(tmp_path, settings, drive, output):
    train = load_case(write(tmp_path, ALONE), settings)
    bodies = make_bodies(train.view(train.stages[0].name))
    inertia, ratio = flexible_inertia(train.view(train.stages[0].name), bodies["stage_1.carrier"])
    expected = inertia + drive + output * ratio**2
    system = build_system(train, bodies)
    assert energy(system) == pytest.approx(expected, rel=1e-9)


def test_lumped_members_have_no_inertia_of_ports_twice(tmp_path):
    train = stage_train(tmp_path)
    ratio, planet = 1 + 94 / 26, (94 - 34) / 34
    orbit = 4e-3 * (26 + 34) / 2
    expected = 0.3 + 2 + (0.004 + 0.2) * ratio**2 + 4 * (4 * orbit**2 + 0.01 * planet**2)
    assert energy(build_system(train)) == pytest.approx(expected, rel=1e-12)


def test_torque_passes_the_spline_into_the_next_stage(tmp_path):
    """Spline and joint in series: the twist over both is T (1/k_spline + 1/k_joint)."""
    train, bodies = mixed(tmp_path)
    equilibrium = revolution(modal_system(build_system(train, bodies)), np.zeros((1, 1)), 4e6)
    system = equilibrium.modal.system
    assert not [b.name for b in system.bodies if b.name.endswith("output")]
    ends = [("first.shaft", "end"), ("second.gear", "second.gear")]
    rows = [system.node_rows(*end)[5] for end in ends]
    rest = rows[0] - rows[1] - (rows[0] - rows[1]) @ system.rolling @ system.input_rows
    from flexgear.analysis.recovery import Recovery

    twist = float(Recovery(equilibrium).motion(rest[None])[0, 0])
    torque = 4e6 * 27 / 120
    spline = train.view(train.stages[0].name).shaft.spline.torsion
    assert abs(twist) == pytest.approx(torque * (1 / spline + 1 / 1e8), rel=1e-6)


def test_springs_in_series():
    """k1 k2/(k1 + k2) in every direction, at either end; none where one of them is 0."""
    spline = np.array([2e9, 2e9, 1e10, 1e5, 1e5, 5e8])
    joint = np.array([1e9, 3e8, 0.0, 1e6, 0.0, 1e8])
    both = np.kron([[1, -1], [-1, 1]], np.diag(joint))
    series = spline * joint / (spline + joint)
    for end in (0, 1):
        stiffness = behind_spline(both, np.diag(spline), end)
        expected = np.kron([[1, -1], [-1, 1]], np.diag(series))
        assert np.abs(stiffness - expected).max() <= 1e-12 * spline.max()
    twice = behind_spline(behind_spline(both, np.diag(spline), 0), np.diag(spline), 1)
    once = behind_spline(both, np.diag(spline / 2), 0)
    assert np.abs(twice - once).max() <= 1e-12 * spline.max()
