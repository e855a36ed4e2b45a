"""Roots that tools leave: against brute force, closed forms and limits."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from cut_teeth import envelope
from cut_teeth.gear import Gear as CutGear
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from flexgear.gears.tool import PLAIN_TOOL, CutterTool, PlainTool
from flexgear.gears.tooth import involute, tooth_geometry
from flexgear.model.section import Refusal


@dataclass(frozen=True)
class Gear:
    """A rack and what is cut with it; module 1 m."""

    teeth: int = 31
    profile_shift: float = 0.0
    addendum: float = 1.0
    dedendum: float = 1.25
    root_fillet: float = 0.3
    normal_module: float = 1.0
    pressure_angle: float = math.radians(20)
    helix_angle: float = 0.0
    tool: PlainTool = PLAIN_TOOL
    internal: bool = False

    @property
    def tooth(self):
        return tooth_geometry(self, self, internal=self.internal)


FREED = PlainTool(protuberance=0.05, grinding_allowance=0.03)
CUT = {
    "sun": Gear(21, 0.3),
    "undercut": Gear(12),
    "helical with protuberance": Gear(31, helix_angle=0.3, tool=FREED),
    "shaped": Gear(34, 0.2, tool=PlainTool(teeth=25, profile_shift=-0.1)),
    "ring": Gear(93, internal=True),
    "shifted ring": Gear(56, -0.5, root_fillet=0.2, internal=True),
    "helical ring": Gear(75, 0.1, helix_angle=0.4, tool=PlainTool(30, 0.2), internal=True),
    "ring with protuberance": Gear(93, tool=replace(FREED, teeth=36), internal=True),
}


def numbers(gear):
    """The same gear for the brute-force cutter, which has the cutter's teeth by the stated rule."""
    teeth = gear.tool.teeth or (math.ceil(gear.teeth / 3) if gear.internal else 0)
    return CutGear(
        teeth=gear.teeth,
        module=gear.normal_module,
        internal=gear.internal,
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
    gear = CUT[name]
    tooth, line = gear.tooth, envelope.side(numbers(gear))
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


@pytest.mark.parametrize("name", [name for name, gear in CUT.items() if not gear.tool.protuberance])
def test_the_involute_begins_where_the_tools_flank_ends(name):
    """Rack: ρ_F = r sin α − (h_f − x − ρ(1 − sin α_n))/sin α; cutter: a_0 sin α_0 ∓ the roll length
    of its own flank's end; undercut gears end at a cut, further out."""
    gear = CUT[name]
    roll, end = (
        gear.tooth.roll_length(gear.tooth.form_radius),
        envelope.tool_of(numbers(gear)).flank_end,
    )
    if name == "undercut":
        assert gear.tooth.root.freed and end < 0 < roll
    else:
        assert not gear.tooth.root.freed and roll == pytest.approx(end, rel=1e-9)


@pytest.mark.parametrize("turn", [0.2, 0.5, 0.9])
def test_normals_pass_through_the_pitch_point_when_the_tip_cuts(turn):
    """A point on the root, ρ out along its normal: the centre of the rack's tip, which then stands
    h_f − x − ρ below the pitch point's tangent and on the line from the pitch point."""
    gear = Gear(24, 0.1)
    tooth = gear.tooth
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
    """x_min = h_f − ρ(1 − sin α) − z sin² α/2."""
    gear = Gear(teeth, shift)
    sine = math.sin(gear.pressure_angle)
    least = gear.dedendum - gear.root_fillet * (1 - sine) - teeth * sine**2 / 2
    if abs(shift - least) < 2e-3:
        return
    root = gear.tooth.root
    assert root.freed == (shift < least)
    assert (root.missing > 0) == (shift < least)


def test_protuberance_frees_the_flank_by_what_the_grinding_leaves():
    """s_pr = pr_P0 − q, and the flank ends further out the larger that is."""
    small, large = (
        Gear(40, tool=PlainTool(protuberance=p, grinding_allowance=0.02)) for p in (0.03, 0.06)
    )
    for gear in (small, large):
        left = gear.tool.protuberance - gear.tool.grinding_allowance
        assert gear.tooth.root.missing == pytest.approx(left, rel=0.05)
    assert small.tooth.form_radius < large.tooth.form_radius
    equal = Gear(40, tool=PlainTool(protuberance=0.03, grinding_allowance=0.03))
    assert equal.tooth.root.section == Gear(40).tooth.root.section


def test_a_cutter_as_large_as_its_ring_leaves_its_own_tip():
    """z_0 → z: the tool is the space, whose corner has the tool's radius; few teeth roll more."""
    radii = [
        Gear(90, internal=True, tool=PlainTool(teeth=teeth)).tooth.root.section.fillet_radius
        for teeth in (20, 40, 89)
    ]
    assert radii[0] > radii[1] > radii[2] > 0.3
    assert radii[2] == pytest.approx(0.3, rel=2e-3)


def test_root_circle_and_working_angle_of_a_cutter():
    """inv α_0 = inv α + 2 tan α (x + x_0)/(z + z_0), d_f = 2 a_0 + d_a0 with the ring's z < 0."""
    tool = PlainTool(teeth=30, profile_shift=-0.2, tip_diameter=32.1)
    tooth = Gear(80, 0.3, internal=True, tool=tool).tooth
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
    gear = Gear(60, root_fillet=0.6, internal=True)
    tooth = gear.tooth
    assert tooth.tool.tip_radius < 0.6
    assert tooth.root.end_angle == pytest.approx(tooth.pitch_angle / 2, abs=1e-12)
    rack = Gear(40, root_fillet=0.6).tooth
    # half the tip's width and the slope of its flank: ρ = (π/4 − h_f tan α) cos α/(1 − sin α)
    alpha = math.radians(20)
    widest = (math.pi / 4 - 1.25 * math.tan(alpha)) * math.cos(alpha) / (1 - math.sin(alpha))
    assert rack.tool.tip_radius == pytest.approx(widest, rel=1e-9)


def test_cutter_of_a_ring_by_the_stated_rule():
    """A third of the ring's teeth, or as many more as make the flank up to its tip."""
    assert isinstance(Gear(93, internal=True).tooth.tool, CutterTool)
    assert Gear(93, internal=True).tooth.tool.teeth == 31
    more = Gear(45, -0.2, addendum=0.9, internal=True).tooth
    base, teeth = more.base_radius, more.tool.teeth
    assert teeth > 15

    def reach(z):
        alpha = math.radians(20)
        wanted = involute(alpha) - 0.4 * math.tan(alpha) / (z - 45)
        angle = brentq(lambda a: involute(a) - wanted, 0.1, 0.8)
        return (base - z / 2 * math.cos(alpha)) * math.tan(angle)

    tip = more.roll_length(more.tip_radius)
    assert reach(teeth) <= tip < reach(teeth - 1)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"dedendum": 2.3}, "dedendum"),
        ({"tool": PlainTool(tip_diameter=20.0)}, "tool.teeth"),
        ({"internal": True, "teeth": 40, "tool": PlainTool(teeth=40)}, "tool.teeth"),
        (
            {"internal": True, "teeth": 80, "tool": PlainTool(tip_diameter=5.0)},
            "tool.tip_diameter_mm",
        ),
        ({"tool": PlainTool(protuberance=0.1, protuberance_angle=0.4)}, "tool.protuberance_angle"),
    ],
)
def test_tools_that_cannot_be_are_refused(changes, key):
    with pytest.raises(Refusal) as refused:
        replace(Gear(), **changes).tooth  # noqa: B018
    assert refused.value.key == key
