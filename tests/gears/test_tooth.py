"""One tooth against what is known of the involute without its formulas."""

import math
from dataclasses import replace

import numpy as np
import pytest
from gears.plain_gear import Gear
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgear.gears.tooth import base_helix_angle, inverse_involute, involute

HELICAL = Gear(helix_angle=math.radians(12))
GEARS = st.builds(
    Gear,
    teeth=st.integers(18, 200),
    profile_shift=st.floats(-0.2, 0.4),
    root_fillet=st.floats(0.05, 0.4),
    normal_module=st.floats(5e-4, 0.03),
    pressure_angle=st.floats(math.radians(17.5), math.radians(25)),
    helix_angle=st.floats(0.0, math.radians(30)),
)


def test_span_over_teeth_is_what_a_micrometer_reads():
    """W_k = m_n cos α_n [(k − ½) π + z inv α_t] + 2 x m_n sin α_n (ISO 21771), which is
    ((k − 1) p_b + s_b) cos β_b; s_b is the thickness at the base circle."""
    g, k = HELICAL, 5
    t, a = g.tooth(), g.pressure_angle
    expected = g.normal_module * math.cos(a) * (
        (k - 0.5) * math.pi + g.teeth * involute(t.transverse_angle)
    ) + 2 * g.profile_shift * g.normal_module * math.sin(a)
    base = t.thickness_at(t.base_radius)
    assert base == pytest.approx(2 * t.base_radius * t.base_half_angle, rel=1e-12)
    span = ((k - 1) * t.base_pitch + base) * math.cos(base_helix_angle(g))
    assert span == pytest.approx(expected, rel=1e-12)


@settings(max_examples=30, deadline=None)
@given(gear=GEARS, share=st.floats(0.0, 1.0))
def test_the_tooth_of_a_ring_is_the_space_of_an_external_gear(gear, share):
    """Same circles and, with x of the other sign, thickness and space fill the pitch."""
    gear = replace(gear, teeth=gear.teeth + 60)
    inside = gear.tooth(internal=True)
    outside = gear.tooth(profile_shift=-gear.profile_shift)
    radius = outside.base_radius + share * (outside.tip_radius - outside.base_radius)
    both = inside.half_angle(radius) + outside.half_angle(radius)
    assert both == pytest.approx(math.pi / gear.teeth, abs=1e-14)


@settings(max_examples=30, deadline=None)
@given(gear=GEARS, internal=st.booleans(), share=st.floats(0.2, 1.0))
def test_normals_of_flanks_touch_the_base_circle(gear, internal, share):
    tooth = gear.tooth(internal, teeth=gear.teeth + 60 * internal)
    low, high = sorted((max(tooth.form_radius, tooth.base_radius), tooth.tip_radius))
    radius, step = low + share * (high - low), 1e-6 * high

    def at(r):
        angle = tooth.half_angle(r)
        return r * np.array([np.cos(angle), np.sin(angle)])

    along = (at(radius + step) - at(radius - step)) / (2 * step)
    along /= np.linalg.norm(along)
    # the normal passes the centre at the distance |P · tangent|
    assert abs(at(radius) @ along) == pytest.approx(tooth.base_radius, rel=1e-6)
    assert math.hypot(tooth.roll_length(radius), tooth.base_radius) == pytest.approx(radius)


@settings(max_examples=30, deadline=None)
@given(gear=GEARS, internal=st.booleans())
def test_outline_runs_smoothly_to_the_root_section(gear, internal):
    """Without a kink from the flank into the root, which ends at 30° (60° inside) or begins
    steeper; the root section is the same whatever the number of points."""
    tooth = gear.tooth(internal, teeth=gear.teeth + 60 * internal)
    line = tooth.outline(640)
    ends = np.diff(line.x[-2:])[0], np.diff(line.y[-2:])[0]
    slope = math.degrees(math.atan2(abs(ends[1]), abs(ends[0])))
    assert slope > (60 if internal else 30) - 1
    steps = np.diff(np.column_stack([line.x, line.y]), axis=0)
    angle = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    joint = line.flank_points - 1
    if not tooth.root.freed:
        assert abs(angle[joint] - angle[joint - 1]) < math.radians(2)
    assert tooth.outline(160).root_thickness == pytest.approx(line.root_thickness, rel=1e-9)


def test_path_of_contact_of_an_external_pair_is_the_textbook_s():
    """ε_α = [z_1 (tan α_a1 − tan α_w) + z_2 (tan α_a2 − tan α_w)]/2π."""
    one, two = HELICAL.tooth(), HELICAL.tooth(teeth=47, profile_shift=0.1)
    total = 2 * math.tan(HELICAL.pressure_angle) * 0.3 / 78
    working = inverse_involute(involute(one.transverse_angle) + total)
    low, high = one.path_of_contact(two, working)
    tips = [math.acos(t.base_radius / t.tip_radius) for t in (one, two)]
    expected = sum(
        t.teeth * (math.tan(a) - math.tan(working)) for t, a in zip((one, two), tips, strict=True)
    )
    assert (high - low) / one.base_pitch == pytest.approx(expected / (2 * math.pi), rel=1e-12)
    # the other gear counts the same span from its own base tangent point
    between = one.tangent_distance(two, working)
    assert two.path_of_contact(one, working) == pytest.approx((between - high, between - low))


def test_path_of_contact_with_a_ring_ends_at_both_tips():
    planet = HELICAL.tooth(profile_shift=0.0)
    ring = HELICAL.tooth(internal=True, teeth=95, profile_shift=0.0)
    working = planet.transverse_angle
    low, high = planet.path_of_contact(ring, working)
    distance = (ring.base_radius - planet.base_radius) / math.cos(working)
    # contact points by the cosine rule from both centres
    for s, radius in ((low, ring.tip_radius), (high, None)):
        x = planet.base_radius * math.cos(working) + s * math.sin(working)
        y = -planet.base_radius * math.sin(working) + s * math.cos(working)
        if radius is None:
            assert math.hypot(x, y) == pytest.approx(planet.tip_radius, rel=1e-12)
        else:
            assert math.hypot(distance + x, y) == pytest.approx(radius, rel=1e-12)
    assert not planet.interferes_with(ring, working)
    assert planet.interferes_with(replace(ring, tip_radius=0.9 * ring.tip_radius), working)
