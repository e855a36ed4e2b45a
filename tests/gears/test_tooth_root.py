"""Roots that tools leave: against brute force, closed forms and limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cut_teeth import envelope
from cut_teeth.gear import Gear as CutGear
from gears.plain_gear import Gear
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from flexgear.gears.tool import PlainTool
from flexgear.gears.tooth import involute
from flexgear.model.section import Refusal


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


def numbers(gear, internal=False):
    """The same gear for the brute-force cutter, which has the cutter's teeth by the stated rule."""
    teeth = gear.tool.teeth or (gear.teeth // 2 if internal else 0)
    return CutGear(
        teeth=gear.teeth,
        module=gear.normal_module,
        internal=internal,
        shift=gear.profile_shift,
        alpha=gear.pressure_angle,
        helix=gear.helix_angle,
        addendum=gear.addendum,
        dedendum=gear.dedendum,
        rounding=gear.root_fillet,
        cutter_teeth=teeth,
        cutter_shift=gear.tool.profile_shift,
        protuberance=gear.tool.protuberance,
        allowance=gear.tool.grinding_allowance,
        ramp=gear.tool.protuberance_angle,
    )


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
    tooth, line = gear.tooth(internal), envelope.side(numbers(gear, internal))
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
    tooth, end = gear.tooth(internal), envelope.tool_of(numbers(gear, internal)).flank_end
    roll = tooth.roll_length(tooth.form_radius)
    if name == "undercut":
        assert tooth.root.freed and end < 0 < roll
    else:
        assert not tooth.root.freed and roll == pytest.approx(end, rel=1e-9)


@pytest.mark.parametrize("turn", [0.2, 0.5, 0.9])
def test_normals_pass_through_the_pitch_point_when_the_tip_cuts(turn):
    """A point on the root, ρ out along its normal: the centre of the rack's tip, which then stands
    h_f − x − ρ below the pitch point's tangent and on the line from the pitch point."""
    gear = unit(24, 0.1)
    tooth = gear.tooth()
    t = turn * tooth.root.form
    point, near, far = (complex(tooth.root.at(x)) for x in (t, t - 1e-6, t + 1e-6))
    normal = -1j * (far - near) / abs(far - near)
    centre = point + gear.root_fillet * normal * math.copysign(1.0, normal.real)
    below = gear.dedendum - gear.profile_shift - gear.root_fillet
    r = tooth.reference_radius

    # turned until the centre stands so deep, on either side of the pitch point
    stands = np.arccos((r - below) / abs(centre)) * np.array([1.0, -1.0])
    turn = np.exp(1j * (stands - np.angle(centre)))
    beside = ((centre * turn - r) * np.conj(normal * turn)).imag
    assert np.abs(beside).min() < 1e-5


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
    assert root.freed == (shift < least)
    assert (root.missing > 0) == (shift < least)


def test_protuberance_frees_the_flank_by_what_the_grinding_leaves():
    """s_pr = pr_P0 − q, and the flank ends further out the larger that is."""
    small, large = (
        unit(40, tool=PlainTool(protuberance=p, grinding_allowance=0.02)) for p in (0.03, 0.06)
    )
    for gear in (small, large):
        left = gear.tool.protuberance - gear.tool.grinding_allowance
        assert gear.tooth().root.missing == pytest.approx(left, rel=0.05)
    assert small.tooth().form_radius < large.tooth().form_radius
    equal = unit(40, tool=PlainTool(protuberance=0.03, grinding_allowance=0.03))
    assert equal.tooth().root.section == unit(40).tooth().root.section


def test_a_cutter_as_large_as_its_ring_leaves_its_own_tip():
    """z_0 → z: the tool is the space, whose corner has the tool's radius; few teeth roll more."""
    radii = [
        unit(90, tool=PlainTool(teeth=teeth)).tooth(True).root.section.fillet_radius
        for teeth in (20, 40, 89)
    ]
    assert radii[0] > radii[1] > radii[2] > 0.3
    assert radii[2] == pytest.approx(0.3, rel=2e-3)


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
