"""Sizes of what gear-mesh models leave out, against closed forms."""

import math

import numpy as np
import pytest
from gears.stages import planetary, seen

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.neglected_effects import (
    friction_share,
    neglected_effects,
    pin_sag,
    rim_compliance,
    rim_rows,
)
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case


def test_a_ring_pressed_on_its_diameter_gives_way_as_timoshenko_says():
    rows = [rim_rows(angle, -1.0, 0.0, 0.0) for angle in (0.0, math.pi)]
    way = sum(rows) * rim_compliance(3.0, 0.2)
    shorter = sum(float(np.sum(row * way)) for row in rows)
    assert shorter == pytest.approx((math.pi / 4 - 2 / math.pi) * 0.2**3 / 3.0, rel=1e-6)


def test_turning_the_whole_ring_s_load_about_a_place_beside_it_is_force_and_couple():
    """A couple bends a ring as two tangential forces apart by its arm do."""
    arm = 1e-4
    apart = (rim_rows(0.3, 0.0, 1.0, arm) - rim_rows(0.3, 0.0, 1.0, -arm)) / (2 * arm)
    # v' of the radial displacement: a couple is two radial forces close together
    step = 1e-6
    near = (rim_rows(0.3 + step, 1.0, 0.0, 0.0) - rim_rows(0.3 - step, 1.0, 0.0, 0.0)) / (2 * step)
    first = slice(0, 20)
    turned = rim_rows(0.3, 0.0, 1.0, 0.0) - near
    np.testing.assert_allclose(apart[:, first], turned[:, first], atol=1e-7)


def test_a_pin_whose_seat_is_its_span_sags_as_a_beam_with_both_ends_built_in():
    assert pin_sag(5.0, 0.3, 0.3, 7.0, math.inf) == pytest.approx(5.0 * 0.3**3 / (384 * 7.0))


def test_a_pin_loaded_on_a_short_seat_bends_by_the_moment_in_its_middle():
    seat = 1e-4  # curvature M/EI = F L/(8 EI) over the seat
    expected = 5.0 * 0.3 / 8 * seat**2 / (8 * 7.0)
    assert pin_sag(5.0, 0.3, seat, 7.0, math.inf) == pytest.approx(expected, rel=1e-3)


def test_friction_takes_what_summing_over_the_path_gives():
    g = stage_geometry(seen(planetary()))
    for slot, sense in (("sun", 1.0), ("ring", -1.0)):
        gear_mesh, gear = g.gear_meshes[slot], g.gears[slot]
        s = np.linspace(gear_mesh.s_lo, gear_mesh.s_hi, 20001)
        pitch_point = g.planet.base_radius * math.tan(gear_mesh.working_angle)
        # flanks slide by the difference of the speeds of both gears' radii of curvature
        turned = g.planet.base_radius / gear.base_radius
        slide = np.abs((s - pitch_point) * (1.0 + sense * turned)) / g.planet.base_radius
        assert friction_share(g, slot, 0.05) == pytest.approx(0.05 * slide.mean(), rel=1e-3)


@pytest.mark.parametrize("name", ["grc-750kw", "wind-5mw", "lin-parker"])
def test_sizes_follow_what_the_case_has(name):
    case = load_case(name)
    flow = power_flow(case).stages[0]
    found = neglected_effects(case.view(flow.name), flow.gear_mesh_forces)
    rim = case.stages[0].planet.bore_diameter > 0
    assert any(key.startswith("free_planet_rim") for key in found) == rim
    assert ("pin_bends_in_planet_um" in found) == (case.stages[0].form("carrier") == "fe")
    assert all(math.isfinite(size) and size > 0 for size in found.values())
    twice = neglected_effects(
        case.view(flow.name), {k: 2 * f for k, f in flow.gear_mesh_forces.items()}
    )
    for key, size in found.items():
        linear = key.endswith(("_um", "_n"))
        assert twice[key] == pytest.approx((2 if linear else 1) * size)


def test_planets_that_ovalise_in_the_model_are_not_estimated():
    case = load_case("wind-5mw")
    lumped = neglected_effects(case.view(), forces := power_flow(case).stages[0].gear_mesh_forces)
    case = case.with_(**{"stage.planet.fe.tie": "root"})
    flexible = neglected_effects(case.view(), forces)
    assert not any(key.startswith("free_planet_rim") for key in flexible)
    assert neglected_effects(case.view().with_rigid(["planet"]), forces) == lumped
