"""Supports, planet bearings, their ratings and rolling elements from REXS files."""

import math

import numpy as np
import pytest
from rexs_samples import MM, at, bearing, planetary


def test_springs_side_by_side(imported):
    """Two radial springs: sum, centre of stiffness, and what their distance adds against tilt."""
    stage = imported(planetary())[0].stages[0]
    k, z = np.array([2e9, 3e9]), np.array([-0.2, -0.1])  # from the gears' middle at u = 50 mm
    centre = k @ z / k.sum()
    support = stage.carrier.support
    assert support.radial == k.sum() and support.axial == 4e8
    assert support.z == pytest.approx(centre)
    assert support.tilt == pytest.approx(k @ (z - centre) ** 2)
    assert stage.planet_bearing.radial == 2e9
    assert stage.planet_bearing.tilt == pytest.approx(2e9 * 0.02**2)
    assert stage.ring.support.torsion == pytest.approx(5e8)


def test_bearings_by_their_coordinate_on_shafts(imported):
    """A bearing or coupling without a position in space is at its coordinate on either shaft."""
    expected, _ = imported(planetary())
    m = planetary()
    seats = [(m.main[0], "inner", 50.0), (m.main[1], "inner", 150.0), (m.fixed, "inner", 50.0)]
    seats += [(b, "outer", (30.0, 70.0)[k % 2]) for k, b in enumerate(m.planet_bearings)]
    for joint, side, u in seats:
        m.set(joint, support_vector=None, u_axis_vector=None,
              **{f"u_coordinate_on_shaft_{side}_side": (u, MM)})  # fmt: skip
    assert imported(m)[0].content_hash() == expected.content_hash()


def test_static_and_fatigue_ratings_of_bearings(imported):
    m = planetary()
    for number in m.planet_bearings:
        m.set(number, bearing_type=("ball", ""), fatigue_limit_load=(160.0, "kN"),
              radial_dynamic_load_rating=(900.0, "kN"),
              radial_static_load_rating=(1400.0, "kN"))  # fmt: skip
    case, conversion = imported(m)
    bearing = case.stages[0].planet_bearing
    assert not any("rating" in line or "fatigue" in line for line in conversion.left_out)
    assert (bearing.dynamic_rating, bearing.static_rating) == (9e5, 1.4e6)
    assert bearing.fatigue_load_limit == 1.6e5
    m.set(m.planet_bearings[1], radial_dynamic_load_rating=(700.0, "kN"))
    case, conversion = imported(m)
    assert case.stages[0].planet_bearing.dynamic_rating == 7e5
    assert any("the lowest of 2 bearings" in line for line in conversion.assumed)


def with_rollers(m, **row):
    """Planet bearings with one row of 14 rollers each, 40 mm apart."""
    for number in m.planet_bearings:
        m.set(number, radial_dynamic_load_rating=(900.0, "kN"), bearing_type=(BEARING, "none"),
              operating_radial_bearing_clearance=(60.0, "mum"))  # fmt: skip
        of_row = {"number_of_rolling_elements": (14, "none"),
                  "reference_diameter_rolling_bearing": (150.0, MM)} | row  # fmt: skip
        part = m.part(number, "rolling_bearing_row", **of_row)
        m.part(part, "rolling_element", diameter_of_rolling_element=(24.0, MM),
               length_of_rolling_element=(30.0, MM))  # fmt: skip
    return m


BEARING = "radial_roller_bearing"


def test_rolling_elements_of_radial_bearings(imported):
    case, conversion = imported(with_rollers(planetary()))
    bearing = case.stages[0].planet_bearing
    elements = bearing.elements
    assert (bearing.count, elements.count) == (2, 14)
    sizes = (elements.pitch_diameter, elements.diameter, elements.length, elements.spacing)
    assert sizes == pytest.approx((0.15, 0.024, 0.03, 0.04))
    assert elements.clearance == pytest.approx(30e-6)
    assert any('profile = "logarithmic"' in line for line in conversion.assumed)
    assert not any("rolling_" in line for line in conversion.left_out)


def test_rolling_elements_with_a_contact_angle_or_of_unequal_rows_are_listed(imported):
    m = with_rollers(planetary())
    m.set(m.of("rolling_bearing_row")[1], number_of_rolling_elements=(15, "none"))
    for model in (m, with_rollers(planetary(), pressure_angle=(15.0, "deg"))):
        case, conversion = imported(model)
        assert case.stages[0].planet_bearing.elements is None
        assert any("rolling_element" in line for line in conversion.left_out)


@pytest.mark.parametrize("x_1", [None, 1.0, 0.9])
def test_factors_of_thrust(imported, x_1):
    """e, X, Y of a catalogue; a case has X_1 = 1, as ISO 281, and says where a file has another."""
    m = planetary()
    of_file = {"catalogue_value_e": 0.4, "radial_factor_x_2": 0.67, "axial_factor_y_2": 2.5}
    factors = {key: (value, "none") for key, value in of_file.items()}
    if x_1 is not None:
        factors["radial_factor_x_1"] = (x_1, "none")
    m.set(m.main[0], radial_dynamic_load_rating=(900.0, "kN"), **factors)
    case, conversion = imported(m)
    bearing = next(b for b in case.stages[0].carrier.support if b.dynamic_rating)
    if x_1 == 0.9:
        assert bearing.thrust is None
        assert any("radial_factor_x_1: is 0.9" in line for line in conversion.assumed)
        return
    thrust = bearing.thrust
    assert (thrust.e, thrust.x, thrust.y, thrust.y_1) == (0.4, 0.67, 2.5, 0.0)


@pytest.mark.parametrize("angles", [(25.0,), (-25.0, 25.0), (12.0,), (25.0, 30.0), (25.0, None)])
@pytest.mark.parametrize(
    "kind",
    ["radial_tapered_roller_bearing", "angular_contact_ball_bearing",
     "four_point_contact_ball_bearing"],
)  # fmt: skip
def test_factors_of_thrust_by_the_contact_angle(imported, kind, angles):
    """Of equal rows, in the sense of either; ISO 281 has none of balls below 20 degrees."""
    m = planetary()
    of_file = {"radial_dynamic_load_rating": (900.0, "kN"), "bearing_type": (kind, "none")}
    m.set(m.main[0], **of_file)
    for angle in angles:
        more = {} if angle is None else {"pressure_angle": (angle, "deg")}
        m.part(m.main[0], "rolling_bearing_row", **more)
    case, conversion = imported(m)
    thrust = next(b for b in case.stages[0].carrier.support if b.dynamic_rating).thrust
    equal = {25.0, 12.0 if "roller" in kind else 25.0} >= set(map(abs, (a or 0.0 for a in angles)))
    assert (thrust is not None) == equal
    if thrust is not None:
        assert thrust.contact_angle == pytest.approx(math.radians(abs(angles[0])))
        assert thrust.rows == (2 if "four" in kind else len(angles))
        assert not any("pressure_angle" in line for line in conversion.left_out)


@pytest.mark.parametrize(
    ("words", "directions"),
    [
        (("positive", "negative"), ("+z", "-z")),
        (("negative", "positive"), ("-z", "+z")),
        (("positive", "positive"), (None, None)),
        (("both_directions", "negative"), (None, None)),
    ],
)
def test_single_rows_that_face_one_another_induce_thrust(imported, words, directions):
    """Positive: thrust of the shaft along its u axis is taken by the outer ring (FVA)."""
    m = planetary()
    kind, angle = "radial_tapered_roller_bearing", {"pressure_angle": (15.0, "deg")}
    for each, word in zip(m.main, words, strict=True):
        m.set(each, radial_dynamic_load_rating=(900.0, "kN"), bearing_type=(kind, "none"),
              axial_force_absorption=(word, "none"))  # fmt: skip
        m.part(each, "rolling_bearing_row", **angle)
    places = imported(m)[0].stages[0].carrier.support
    assert tuple(b.thrust.direction for b in sorted(places, key=lambda b: b.z)) == directions


def rolling(m, **attributes):
    """The second main bearing from a catalogue."""
    kind = "rolling_bearing_with_catalog_geometry"
    m.components[m.main[1]] = (kind, "610", {**at(-50), **attributes})


def test_rigid_and_unknown_stiffness_scale_with_the_machine(imported):
    """1e20 N/m becomes ten times E b; a rolling bearing without data a tenth of it."""
    m = planetary()
    m.set(m.main[0], **bearing(1e20, 1e20, -150.0))
    rolling(m)
    case, conversion = imported(m)
    size = 206e9 * 0.06
    assert case.stages[0].carrier.support.radial == pytest.approx(10.1 * size)
    assert any("has no radial_stiffness" in line for line in conversion.assumed)


def test_stiffness_at_the_operating_point(imported):
    """A rolling bearing without a stiffness of its own has the results of its program."""
    m = planetary()
    point = "operating_point_stiffness_f_"
    results = {"v_d_v": 1e9, "w_d_w": 2e9, "u_d_u": 3e8}
    rolling(m, **{f"{point}{key}": (value, "N / m") for key, value in results.items()})
    support = imported(m)[0].stages[0].carrier.support
    assert support.radial == 2e9 + 1.5e9 and support.axial == 4e8 + 3e8
