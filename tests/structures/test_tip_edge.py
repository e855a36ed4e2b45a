"""Line contact at a tip edge: Hertz inside, a wedge at the edge, nothing with the path alone."""

import math

import numpy as np
import pytest

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.hertz import ContactBody, layer_constant, line_contact
from flexgear.gears.paths import stage_paths
from flexgear.model.load import load_case
from flexgear.structures.tooth_influence.influence import ToothInfluence
from flexgear.structures.tooth_influence.tip_edge import (
    LESS,
    Edges,
    at_tip,
    contact,
    edge_layer,
    tip_ends,
)

STEEL, DEPTH, RADIUS = (2.1e11, 0.3), 3.6e-3, 0.25
ANGLE = math.radians(115.0)


@pytest.fixture(scope="module")
def layer():
    return edge_layer(ANGLE, STEEL[1])


def edges(layer, apex):
    depth = np.full(len(apex), DEPTH)
    bodies = [ContactBody(*STEEL, d, "layer") for d in (depth, 1.1 * depth)]
    radius = np.full(len(apex), RADIUS)
    return Edges(layer, *bodies, radius, apex), line_contact(*bodies, radius)


def load_of(half_width):
    """Line load under which Hertz's contact is so wide."""
    return half_width**2 * math.pi / (8 * RADIUS * (1 - STEEL[1] ** 2) / STEEL[0])


def test_middle_of_the_layer_is_a_half_plane_with_its_constant(layer):
    """(2/π)(ln(1/r) + κ − 1/2) in c, from half a depth on, where elements do not show."""
    i = np.searchsorted(layer.place, 1.0)
    distance = np.abs(layer.place - layer.place[i])
    far = (distance > 0.4) & (layer.place < 3.0)
    expected = 2 / math.pi * (layer_constant(STEEL[1]) - 0.5 - np.log(distance[far]))
    assert layer.middle[i][far] == pytest.approx(expected, abs=2e-3)


def test_edge_is_a_wedge(layer):
    """Sinks with the logarithm of Flamant's wedge under a load on the edge, across its flank."""
    tilt = (math.pi - ANGLE) / 2
    shares = math.cos(tilt) ** 2 / (ANGLE + math.sin(ANGLE))
    shares += math.sin(tilt) ** 2 / (ANGLE - math.sin(ANGLE))
    near, far = np.searchsorted(layer.place, (0.004, 0.012))
    slope = np.diff(layer.end[0, [far, near]]) / math.log(layer.place[far] / layer.place[near])
    assert slope == pytest.approx(2 * shares, rel=0.02)
    assert 2 * shares > 1.5 * 2 / math.pi


@pytest.mark.parametrize("half_width", [0.3, 0.5])
def test_well_inside_the_flank_it_is_hertz(layer, half_width):
    """Solved, and as what a contact that ends well before the edge sinks more."""
    load = load_of(half_width * DEPTH)
    edge, hertz = edges(layer, DEPTH * np.array([1.8, 2.0]))
    more, rests = edge.pressed(hertz, load)
    assert np.abs(more / hertz.secant(load)).max() < 1e-3
    assert rests == pytest.approx(edge.apex)
    approach, rests = edge._solved(1, load)
    assert approach == pytest.approx(hertz.approach(load)[1], rel=3e-3)
    assert rests == pytest.approx(edge.apex[1], rel=1e-3)


def test_both_ways_to_the_contact_meet_where_it_clears_the_edge(layer):
    """Solved and by the sinking of a line load, per cent of Hertz's approach."""
    half = 0.1 * DEPTH
    edge, hertz = edges(layer, half * np.array([2.99, 3.01]))
    more, _ = edge.pressed(hertz, load_of(half))
    assert more[0] == pytest.approx(more[1], abs=0.01 * hertz.secant(load_of(half))[0])


def test_softer_the_nearer_to_the_edge_and_the_further_beyond(layer):
    apex = DEPTH * np.linspace(-2.0, 2.0, 15)
    edge, hertz = edges(layer, apex)
    more, rests = edge.pressed(hertz, load_of(0.3 * DEPTH))
    assert (np.diff(more) < 0).all() and more[0] > 1.5 * hertz.secant(load_of(0.3 * DEPTH))[0]
    assert (np.diff(rests) > 0).all() and rests[0] > 0  # the load stays on the flank


def test_contact_is_complementary(layer):
    load = load_of(0.3 * DEPTH)
    for apex in (-1.0, 0.0, 0.3):
        gap = ((layer.place - apex) ** 2 - min(apex, 0.0) ** 2) * DEPTH**2 / (2 * RADIUS)
        compliance = (1 - STEEL[1] ** 2) / STEEL[0] * (layer.end + layer.middle)
        force, approach = contact(compliance, gap, load)
        room = gap + compliance @ force - approach
        assert force.sum() == pytest.approx(load) and force.min() >= 0
        assert room.min() > -1e-12 * approach and abs(room @ force) < 1e-12 * load * approach


@pytest.mark.parametrize("kind", ["ring", "sun"])
def test_the_law_at_the_tips_of_a_case(kind):
    """Exactly what is solved at its two loads, rising with the load, Hertz's further in; the flank
    continued past its tip leaves the gap of the tip edge to first order; no tips on a path only."""
    keys = {
        "stage.helix_angle_deg": "0",
        "stage.gear_mesh.model": "face_load",
        "stage.ring.fe.fits": "[]",
    }
    case = load_case("wind-5mw", keys).view()
    path = stage_paths(case, {"sun": 8e5, "ring": 8e5})[kind, ""]
    assert path.slices is not None
    ends = tip_ends(path, path.slices)
    assert [end.member for end in ends] == [1, 0]
    members = [_stub(tooth, case.stage.normal_module) for tooth in _gears(case, kind)]
    for end in ends:
        tip = at_tip(end, members, 1.0, 1e6)
        beyond = 0.02 * path.base_pitch
        gap, apex = end.edge.gap(beyond), end.edge.apex(beyond)
        rolls = [float(r) for r in end.edge.rolls(0.0)]
        inverse = 1 / rolls[0] - 1 / rolls[1] if kind == "ring" else 1 / rolls[0] + 1 / rolls[1]
        assert gap == pytest.approx(apex**2 * abs(inverse) / 2, rel=0.03)
        assert (np.diff(tip.s) > 0).all()
        inner, outer = (0, -1) if end.last > end.s else (-1, 0)
        assert tip.s[outer] == pytest.approx(end.last)
        assert tip.alpha[inner] == tip.beta[inner] == tip.inward[inner] == 0.0
        for load in (1e6, LESS * 1e6):
            assert tip.alpha[outer] - tip.beta[outer] * math.log(load) > 0
        middle = tip.at(np.array(np.mean([path.s_lo, path.s_hi])))
        assert middle.alpha == middle.beta == middle.inward == 0.0
    only = load_case("wind-5mw", {**keys, "stage.gear_mesh.path_only": "true"}).view()
    path = stage_paths(only, {"sun": 8e5, "ring": 8e5})[kind, ""]
    assert tip_ends(path, path.slices) == []


def _gears(case, kind):
    g = stage_geometry(case)
    return g.planet, g.gears[kind]


def _stub(tooth, module):
    """An influence of which only the layer is asked."""
    roll = np.array([tooth.roll_length(tooth.tip_radius), tooth.roll_length(tooth.form_radius)])
    none = np.zeros((0, 0))
    depth = np.full(2, 0.2 * module)
    return ToothInfluence(roll, np.array([-1.0, 1.0]), 0.0, none, depth, *STEEL)
