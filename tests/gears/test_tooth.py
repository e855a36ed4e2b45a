"""Teeth as their tools make them: closed forms, roots against cut envelopes, warnings."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cut_teeth import envelope
from cut_teeth.of_case import cut_gear, gear_of
from gears.stages import Gear, flexible_errors
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.implausible_teeth import lowest_contact, tip_trimming, tooth_warnings
from flexgear.gears.tool import PlainTool
from flexgear.gears.tooth import base_helix_angle, inverse_involute, involute
from flexgear.model.load import load_case
from flexgear.model.section import Refusal

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
    if not tooth.root.is_undercut:
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


def test_pitch_deviations_belong_to_flanks_and_to_the_seed():
    over = {"stage.errors.ring_pitch_um": "5", "stage.errors.planet_pitch_um": "4"}
    e, again = (flexible_errors(load_case("wind-5mw", over).view()) for _ in range(2))
    other = flexible_errors(load_case("wind-5mw", {**over, "stage.errors.seed": "2"}).view())
    assert np.array_equal(e["ring"].gear_tooth, again["ring"].gear_tooth)
    assert not np.array_equal(e["ring"].gear_tooth, other["ring"].gear_tooth)
    assert e["ring"].gear_tooth.shape == (93,)
    assert e["ring"].planet_tooth.shape == (5, 33)
    assert 3e-6 < e["ring"].gear_tooth.std() < 7e-6
    assert np.allclose(e["ring"].gear_tooth.mean(), 0)
    assert np.all(e["sun"].gear_tooth == 0)
    # the flank that meets the ring when driving meets the sun when driven
    assert np.array_equal(e["ring"].planet_tooth, e["sun_coast"].planet_tooth)
    assert np.array_equal(e["sun"].planet_tooth, e["ring_coast"].planet_tooth)
    assert not np.array_equal(e["ring"].planet_tooth, e["sun"].planet_tooth)


def unit(teeth, profile_shift=0.0, **changes):
    """A gear of module 1 m."""
    return replace(Gear(normal_module=1.0), teeth=teeth, profile_shift=profile_shift, **changes)


FREED = PlainTool(protuberance=0.05, grinding_allowance=0.03)
CUT = {  # and whether it is a ring
    "sun": (unit(21, 0.3), False),
    "undercut": (unit(12), False),
    "helical with protuberance": (unit(31, helix_angle=0.3, tool=FREED), False),
    "shaped": (unit(34, 0.2, tool=PlainTool(teeth=25, profile_shift=-0.1)), False),
    "ring": (unit(93), True),
    "shifted ring": (unit(56, -0.5, root_fillet=0.2), True),
    "helical ring": (unit(75, 0.1, helix_angle=0.4, tool=PlainTool(30, 0.2)), True),
    "ring with protuberance": (unit(93, tool=replace(FREED, teeth=36)), True),
}


def distance(points, chain):
    """From points (n, 2) to a chain of straight edges (k, 2)."""
    start, edge = chain[:-1], np.diff(chain, axis=0)
    share = ((points[:, None] - start) * edge).sum(axis=2) / (edge**2).sum(axis=1)
    foot = start + np.clip(share, 0.0, 1.0)[..., None] * edge
    return np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1)


@pytest.mark.parametrize("name", CUT)
def test_the_tool_in_3000_positions_leaves_this_tooth(name):
    """Flank and root from tip to root circle, within 2e-6 modules."""
    gear, internal = CUT[name]
    tooth = gear.tooth(internal)
    line = envelope.side(cut_gear(gear, gear, internal=internal))
    cut = np.column_stack([line.real, line.imag])
    below = tooth.outward * (abs(line) - tooth.form_radius) < 0
    assert below.any() and not below.all()
    assert distance(cut[below], tooth.root.points(2000)).max() < 2e-6
    across = abs(line) * (np.angle(line) - tooth.half_angle(abs(line)))
    assert np.abs(across[~below]).max() < 2e-6
    clear = line[:-5]  # of the root circle, where angles say nothing
    assert tooth.root.half_angle(abs(clear)) == pytest.approx(np.angle(clear), abs=2e-6)
    assert abs(line[-1]) == pytest.approx(tooth.root_radius, rel=1e-12)
    assert tooth.root.end_angle == pytest.approx(np.angle(line[-1]), abs=1e-12)


@pytest.mark.parametrize("name", [name for name in CUT if "protuberance" not in name])
def test_the_involute_begins_where_the_tools_flank_ends(name):
    """Rack: ρ_F = r sin α − (h_f − x − ρ(1 − sin α_n))/sin α; cutter: a_0 sin α_0 ∓ the roll length
    of its own flank's end; undercut gears end at a cut, further out."""
    gear, internal = CUT[name]
    tooth = gear.tooth(internal)
    end = envelope.tool_of(cut_gear(gear, gear, internal=internal)).flank_end
    roll = tooth.roll_length(tooth.form_radius)
    if name == "undercut":
        assert tooth.root.is_undercut and end < 0 < roll
    else:
        assert not tooth.root.is_undercut and roll == pytest.approx(end, rel=1e-9)


@settings(max_examples=40, deadline=None)
@given(teeth=st.integers(8, 40), shift=st.floats(-0.5, 0.8))
def test_a_rack_undercuts_below_the_textbooks_shift(teeth, shift):
    """x_min = h_f − ρ(1 − sin α) − z sin² α/2. What is taken off grows with the third power of the
    shift that is missing: 0.006 before it, it is less than 1e-7 of the module."""
    gear = unit(teeth, shift)
    sine = math.sin(gear.pressure_angle)
    least = gear.dedendum - gear.root_fillet * (1 - sine) - teeth * sine**2 / 2
    if abs(shift - least) < 6e-3:
        return
    root = gear.tooth().root
    assert root.is_undercut == (shift < least)
    assert (root.undercut > 0) == (shift < least)


def test_protuberance_frees_the_flank_by_what_the_grinding_leaves():
    """s_pr = pr_P0 − q, and the flank ends further out the larger that is."""
    small, large = (
        unit(40, tool=PlainTool(protuberance=p, grinding_allowance=0.02)) for p in (0.03, 0.06)
    )
    for gear in (small, large):
        left = gear.tool.protuberance - gear.tool.grinding_allowance
        assert gear.tooth().root.undercut == pytest.approx(left, rel=0.05)
    assert small.tooth().form_radius < large.tooth().form_radius
    equal = unit(40, tool=PlainTool(protuberance=0.03, grinding_allowance=0.03))
    assert equal.tooth().root.section == unit(40).tooth().root.section


def test_root_circle_and_working_angle_of_a_cutter():
    """inv α_0 = inv α + 2 tan α (x + x_0)/(z + z_0), d_f = 2 a_0 + d_a0 with the ring's z < 0."""
    tool = PlainTool(teeth=30, profile_shift=-0.2, tip_diameter=32.1)
    tooth = unit(80, 0.3, tool=tool).tooth(True)
    alpha = math.radians(20)
    angle = brentq(
        lambda a: involute(a) - involute(alpha) - 2 * math.tan(alpha) * 0.1 / (30 - 80), 0.1, 0.6
    )
    distance = 25 * math.cos(alpha) / math.cos(angle)
    assert tooth.tool.working_angle(tooth.base_radius) == pytest.approx(angle, rel=1e-10)
    assert tooth.root_radius == pytest.approx(distance + 32.1 / 2, rel=1e-12)
    assert abs(complex(tooth.root.at(0.0))) == pytest.approx(tooth.root_radius, rel=1e-12)


def test_a_tip_too_narrow_for_its_radius_is_fully_round():
    """Then no land of the root circle is left between two teeth."""
    tooth = unit(60, root_fillet=0.6).tooth(True)
    assert tooth.tool.tip_radius < 0.6
    assert tooth.root.end_angle == pytest.approx(tooth.pitch_angle / 2, abs=1e-12)
    rack = unit(40, root_fillet=0.6).tooth()
    # half the tip's width and the slope of its flank: ρ = (π/4 − h_f tan α) cos α/(1 − sin α)
    alpha = math.radians(20)
    widest = (math.pi / 4 - 1.25 * math.tan(alpha)) * math.cos(alpha) / (1 - math.sin(alpha))
    assert rack.tool.tip_radius == pytest.approx(widest, rel=1e-9)


@settings(max_examples=30, deadline=None)
@given(teeth=st.integers(60, 200), shift=st.floats(-0.5, 0.0), planet=st.floats(0.2, 0.48))
def test_half_of_a_rings_teeth_make_what_planets_reach(teeth, shift, planet):
    """With the stated rule for the cutter the ring's involute covers the tips of any planet at
    zero shift in sum, and goes up to the ring's own tip where the planet's base tangent point
    lies before that; for rings without positive shift."""
    mate = unit(round(planet * teeth), -shift).tooth()
    ring = unit(teeth, shift, root_fillet=0.38).tooth(True)
    assert ring.tool.teeth == teeth // 2
    reached = mate.roll_length(mate.tip_radius) + mate.tangent_distance(ring, ring.transverse_angle)
    assert reached <= ring.roll_length(ring.form_radius) + 1e-9
    tip = ring.roll_length(ring.tip_radius)
    if tip >= mate.tangent_distance(ring, ring.transverse_angle):
        cutter = ring.tool.distance * math.sin(ring.tool.working_angle(ring.base_radius))
        assert tip >= cutter - 1e-9


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"dedendum": 2.3}, "dedendum"),
        ({"tool": PlainTool(tip_diameter=20.0)}, "tool.teeth"),
        ({"internal": True, "tool": PlainTool(teeth=40)}, "tool.teeth"),
        ({"internal": True, "tool": PlainTool(tip_diameter=5.0)}, "tool.tip_diameter_mm"),
        ({"tool": PlainTool(protuberance=0.1, protuberance_angle=0.4)}, "tool.protuberance_angle"),
    ],
)
def test_tools_that_cannot_be_are_refused(changes, key):
    with pytest.raises(Refusal) as refused:
        unit(40).tooth(**changes)
    assert refused.value.key == key


PROFILE_A = {"stage.planet.dedendum": "1.25", "stage.planet.root_fillet": "0.38"}
SPUR = {"stage.helix_angle_deg": "0"}


def test_radii_that_are_given_close_at_the_centre_distance():
    """Tooth numbers changed beside a working angle and centre distance that stay."""
    keys = {"stage.sun.teeth": "29", "stage.planet.teeth": "21", "stage.ring.teeth": "71"}
    view = load_case("lin-parker", keys).view()
    sun, ring = tooth_warnings(view)
    distance = 1e3 * view.stage.normal_module * (29 + 21) / 2  # 24.6° is the rack's angle, too
    assert f"need {distance:.2f} mm" in sun
    assert f"need {distance:.2f} mm" in ring
    spread = load_case("lin-parker", {"stage.center_distance_mm": "88.6"}).view()
    assert not tooth_warnings(spread)  # within rounding of printed values


def test_a_rings_tip_on_the_root_of_a_planet():
    """In micrometres as the brute-force tooth protrudes where the ring's tip comes; none with
    the remedy that is told."""
    view = load_case("wind-5mw", {**PROFILE_A, **SPUR}).view()
    (text,) = tooth_warnings(view)
    g = stage_geometry(view)
    reach = lowest_contact(g.planet, g.ring, g.ring_gear_mesh.working_angle)
    # by the cosine rule: the ring's tip on the line of action, seen from the planet's centre
    along = g.planet.base_radius * math.tan(g.ring_gear_mesh.working_angle)
    at, sine = (
        g.ring.base_radius / math.cos(g.ring_gear_mesh.working_angle),
        math.sin(g.ring_gear_mesh.working_angle),
    )
    square = at**2 + (along - reach) ** 2 - 2 * at * (along - reach) * sine
    assert math.sqrt(square) == pytest.approx(g.ring.tip_radius, rel=1e-9)
    gear = gear_of(view, "planet")
    radius = math.hypot(gear.base_radius, reach)
    cut = envelope.half_angles(gear, np.array([radius - 1e-6, radius]))[1]
    height = 1e6 * gear.base_radius * (cut - float(gear.half_angle(radius)))
    assert 5 < height < 60
    assert f"protrudes {height:.1f} µm" in text
    assert "planet.dedendum" in text
    assert not tooth_warnings(load_case("wind-5mw", SPUR).view())


def test_a_tip_radius_that_does_not_fit_the_tool_is_warned_of():
    """A rack of depth h_f leaves its tip (π/4 − h_f tan α) cos α/(1 − sin α) modules of radius."""
    keys = {"stage.sun.root_fillet": "0.5", "stage.sun.dedendum": "1.25", **SPUR}
    case = load_case("wind-5mw", keys)
    alpha = case.view().stage.pressure_angle
    full = (math.pi / 4 - 1.25 * math.tan(alpha)) * math.cos(alpha) / (1 - math.sin(alpha))
    (text,) = (t for t in tooth_warnings(case.view()) if "root_fillet" in t)
    assert text.startswith("sun.root_fillet: ") and f"full round tip of {full:.3g} modules" in text
    keys["stage.sun.root_fillet"] = f"{full - 1e-4:.6f}"
    fits = load_case("wind-5mw", keys).view()
    assert not any("root_fillet" in t for t in tooth_warnings(fits))


def test_undercut_shortens_the_path_of_contact():
    keys = {
        "stage.sun.teeth": "12", "stage.planet.teeth": "48", "stage.ring.teeth": "108",
        "stage.planets": "3", **SPUR,
    }  # fmt: skip
    view = load_case("wind-5mw", keys).view()
    texts = tooth_warnings(view)
    assert any("sun: its tool undercuts" in text for text in texts)
    assert any("does not cover the path of contact" in text for text in texts)
    g = stage_geometry(view)
    between = g.planet.tangent_distance(g.sun, g.sun_gear_mesh.working_angle)
    at_end = g.sun.roll_length(g.sun.form_radius)
    assert g.sun_gear_mesh.s_hi == pytest.approx(between - at_end, rel=1e-12)
    assert g.sun_gear_mesh.s_hi < g.planet.roll_length(g.planet.tip_radius)


@pytest.mark.parametrize("teeth", [60, 93])
def test_a_cutter_trims_rings_with_less_than_18_teeth_more(teeth):
    """The textbook's difference for radial infeed, 20° and full depth."""
    for more, trims in ((16, True), (18, False)):
        gear = Gear(teeth, 0.0, root_fillet=0.2, tool=PlainTool(teeth=teeth - more))
        assert (tip_trimming(gear.tooth(internal=True)) > 0.01 * gear.normal_module) == trims
