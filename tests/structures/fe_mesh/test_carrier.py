"""Shape, symmetry and patches of the carrier's FE mesh."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from scipy.spatial import cKDTree

from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh.carrier_mesh import carrier_fe_mesh
from flexgear.structures.fe_mesh.fe_mesh import FeMesh, facet_areas

from .small_bodies import keys, wind_carrier


@pytest.fixture(scope="module")
def carrier() -> FeMesh:
    return carrier_fe_mesh(wind_carrier())


def rotation(angle: float) -> np.ndarray:
    c, s = cos(angle), sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("move", ["turn", "mirror"])
def test_carrier_repeats_after_every_planet_and_in_the_mirror(carrier: FeMesh, move: str) -> None:
    moved = carrier.points @ (rotation(2 * pi / 5) if move == "turn" else np.diag([1, -1, 1]))
    distance, image = cKDTree(carrier.points).query(moved)
    assert distance.max() < 1e-14
    assert keys(image[carrier.cells]) == keys(carrier.cells)
    after = "pin_2" if move == "turn" else "pin_1"
    assert keys(image[carrier.facets["pin_1"]]) == keys(carrier.facets[after])


@pytest.mark.parametrize("slenderness", [10, 24])
@pytest.mark.parametrize(("fidelity", "sides"), [("quick", 8), ("standard", 16)])
def test_slender_pins_are_round_all_along(slenderness: float, fidelity: str, sides: int) -> None:
    """Pushed out to their true volume, their surface is not far beyond that of a prism of as many
    sides: no section is far from the circle. Those of quick are half as fine."""
    p = wind_carrier(pin_diameter=0.48 / slenderness, fidelity=fidelity)
    fe_mesh = carrier_fe_mesh(p)
    at = fe_mesh.points[fe_mesh.facets["pin_1"]]
    off = np.hypot(at[..., 0] - p.center_distance, at[..., 1])
    inscribed = sqrt(2 * pi / (sides * sin(2 * pi / sides)))  # to the polygon of the same area
    assert off.mean() / (p.pin_diameter / 2) == pytest.approx(
        inscribed, rel=0.18 if fidelity == "quick" else 0.022
    )
    assert fe_mesh.quality() > 1e-3


@pytest.mark.parametrize("scale", [1, 1 / 16])
@pytest.mark.parametrize(("gap", "least"), [(0.48, 19.2), (0.2, 10)])
def test_pins_too_thin_are_refused_before_meshing(gap: float, least: float, scale: float) -> None:
    pins = (1.01e-3 * least, 0.99e-3 * least)
    good, bad = (
        wind_carrier(plate_gap=gap, gear_face_width=0.1, pin_diameter=d).in_units_of(1 / scale)
        for d in pins
    )
    good.check()
    with pytest.raises(InputError, match=r"pin_diameter: pins of .* are too thin") as refused:
        bad.check()
    assert f"at least {least * scale:.3g} mm" in str(refused.value)


def test_seats_and_drive_face_are_where_the_parameters_say(carrier: FeMesh) -> None:
    p = wind_carrier()
    z_plate = -p.plate_gap / 2 - p.plate_thickness_drive
    drive = carrier.points[carrier.facets["drive"]]
    assert drive[..., 2] == pytest.approx(z_plate - p.hub_length)
    seat = carrier.points[carrier.facets["bearing_drive"]]
    assert np.hypot(seat[..., 0], seat[..., 1]) == pytest.approx(p.seat_drive_diameter / 2)
    assert seat[..., 2].max() == pytest.approx(z_plate)
    assert seat[..., 2].min() == pytest.approx(z_plate - p.seat_drive_width)
    far = carrier.points[carrier.facets["bearing_far"]]
    assert np.hypot(far[..., 0], far[..., 1]) == pytest.approx(p.seat_far_diameter / 2)
    assert far[..., 2].max() == pytest.approx(
        p.plate_gap / 2 + p.plate_thickness_far + p.seat_far_width
    )


def test_planets_run_free_between_the_plates(carrier: FeMesh) -> None:
    """Between the plates nothing but the pins is nearer to a pin than the planet's tip."""
    p = wind_carrier()
    middle = carrier.points[np.abs(carrier.points[:, 2]) < p.gear_face_width / 2]
    for i in range(5):
        axis = p.center_distance * np.array([cos(2 * pi * i / 5), sin(2 * pi * i / 5)])
        off = np.linalg.norm(middle[:, :2] - axis, axis=1)
        assert not ((off > 0.6 * p.pin_diameter) & (off < p.planet_tip_radius)).any()


def test_drive_side_mirrors_the_whole_carrier(carrier: FeMesh) -> None:
    other = carrier_fe_mesh(wind_carrier(drive_side="+z"))
    np.testing.assert_array_equal(other.points, carrier.points * [1.0, 1.0, -1.0])
    assert keys(other.facets["drive"]) == keys(carrier.facets["drive"])


@pytest.mark.parametrize("drive_side", ["-z", "+z"])
def test_patches_look_outward(drive_side: str) -> None:
    m = carrier_fe_mesh(wind_carrier(drive_side=drive_side))
    surface = {tuple(np.roll(f, -int(np.argmin(f))).tolist()) for f in m.boundary}
    for name, facets in m.facets.items():
        rolled = {tuple(np.roll(f, -int(np.argmin(f))).tolist()) for f in facets}
        assert rolled <= surface, name


UNEQUAL = (0.0, 87.0, 177.0, 273.0)  # gaps of 87, 90, 96 and 87 degrees


def unequal(degrees: tuple[float, ...]) -> FeMesh:
    angles = tuple(np.radians(degrees))
    return carrier_fe_mesh(wind_carrier(planets=len(degrees), planet_angles=angles))


@pytest.mark.parametrize("degrees", [None, UNEQUAL])
def test_pins_stand_at_their_angles_with_their_true_volume(degrees: tuple | None) -> None:
    m = carrier_fe_mesh(wind_carrier()) if degrees is None else unequal(degrees)
    p, angles = wind_carrier(), np.radians(degrees or 72 * np.arange(5))
    centre, volumes = m.points[m.cells].mean(axis=1), m.quadrature()[1].sum(axis=1)
    for i, angle in enumerate(angles, 1):
        axis = p.center_distance * np.array([cos(angle), sin(angle)])
        at = m.points[m.facets[f"pin_{i}"]]
        off = np.linalg.norm(at[..., :2] - axis, axis=-1)
        assert np.ptp(off) < 1e-12
        assert 1.0 < off.mean() / (p.pin_diameter / 2) < 1.12  # eight sides at quick
        assert at[..., 2].min() == pytest.approx(-p.plate_gap / 2)
        assert at[..., 2].max() == pytest.approx(p.plate_gap / 2)
        inside = np.linalg.norm(centre[:, :2] - axis, axis=1) < 0.6 * p.pin_diameter
        inside &= np.abs(centre[:, 2]) < p.plate_gap / 2
        exact = pi * p.pin_diameter**2 / 4 * p.plate_gap
        assert volumes[inside].sum() == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("pin_bore", [0.0, 0.12])
@pytest.mark.parametrize("degrees", [None, UNEQUAL])
def test_half_sectors_close_the_surface(degrees: tuple | None, pin_bore: float) -> None:
    """Each edge of it belongs to two facets: no gap between sectors, nothing across a bore."""
    angles = None if degrees is None else tuple(np.radians(degrees))
    m = carrier_fe_mesh(wind_carrier(planets=4, planet_angles=angles, pin_bore=pin_bore))
    middle = m.points[m.boundary].mean(axis=1)
    assert cKDTree(middle).query(middle, k=2)[0][:, 1].min() > 1e-6
    edges = np.sort(np.concatenate([m.boundary[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]))
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    areas = [facet_areas(m.points, m.facets[f"pin_{i}"]).sum() for i in range(1, 5)]
    assert areas == pytest.approx([areas[0]] * 4, rel=1e-9)


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (2, 0, 3, 1)])
def test_equal_gaps_from_another_angle_on_are_the_same_carrier_turned(order: tuple) -> None:
    plain = carrier_fe_mesh(wind_carrier(planets=4))
    m = unequal(tuple(17.0 + 90.0 * i for i in order))
    distance, image = cKDTree(m.points).query(plain.points @ rotation(np.radians(17.0)))
    assert distance.max() < 1e-12
    for name, i in enumerate(order, 1):
        assert keys(image[plain.facets[f"pin_{i + 1}"]]) == keys(m.facets[f"pin_{name}"])


@pytest.mark.parametrize("degrees", [(0.0, 75.0), (250.0, 0.0, 100.0)])
def test_a_web_in_a_wide_gap_is_that_of_equal_spacing(degrees: tuple) -> None:
    m, p = unequal(degrees), wind_carrier(planets=len(degrees))
    web = p.web(pi / len(degrees))
    middle = m.points[np.abs(m.points[:, 2]) < 0.3 * p.plate_gap]
    around = np.arctan2(middle[:, 1], middle[:, 0])[np.hypot(*middle[:, :2].T) > web.start]
    pins = np.sort(np.radians(degrees))
    widest = np.argmax(np.diff(pins, append=pins[0] + 2 * pi))
    ends = np.append(pins, pins[0] + 2 * pi)[widest : widest + 2]
    off = np.abs((around - ends.mean() + pi) % (2 * pi) - pi)
    reach = off[off < (ends[1] - ends[0]) / 2 - 2 * p.pin_diameter / p.center_distance / 2]
    assert reach.max() == pytest.approx(web.edge_angle, rel=1e-6)


@pytest.mark.parametrize(
    "changes",
    [
        {"planets": 3, "web_width": 0.6},
        {"planets": 4, "pin_bore": 0.05},
        {"planets": 6, "planet_tip_radius": 0.26, "pin_diameter": 0.16},
        {"hub_outer_diameter": 1.0, "pin_seat_width": 0.43},
        {"hub_outer_diameter": 1.1, "hub_bore": 0.1},
        {"planets": 2, "web_width": 0.4},
    ],
)
def test_other_carriers_mesh_too(changes: dict) -> None:
    m = carrier_fe_mesh(wind_carrier(**changes))
    assert m.quality() > 0.02
    assert len([n for n in m.facets if n.startswith("pin_")]) == changes.get("planets", 5)


def test_circles_that_nearly_touch_are_refined() -> None:
    """0.4 mm between bore and seat: coarse chords would cross, and Netgen would crash on that."""
    close = wind_carrier(pin_bore=0.08, seat_far_diameter=2 * (0.54466 + 0.04) + 0.0008)
    m = carrier_fe_mesh(close)
    assert m.quality() > 0.0
    assert m.quadratic_dofs > carrier_fe_mesh(wind_carrier(pin_bore=0.08)).quadratic_dofs


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"planets": 6}, "planets"),
        ({"plate_gap": 0.42}, "plate_gap"),
        ({"plate_diameter": 1.3}, "plate_diameter"),
        ({"pin_bore": 0.3}, "pin_bore"),
        ({"hub_bore": 0.9, "hub_outer_diameter": 1.2}, "hub_bore"),
        ({"hub_length": 0.1}, "hub_length"),
        ({"web_inner_radius": 0.45}, "web_inner_radius"),
        ({"plate_diameter": 1.5, "web_width": 0.9}, "web_width"),
        ({"planets": 4, "planet_tip_radius": 0.18, "web_width": 1.3}, "web_width"),
        ({"seat_drive_diameter": 0.3}, "stage.carrier.fe.seat_drive.diameter"),
        ({"pin_diameter": -0.1}, "pin_diameter"),
        ({"pin_seat_width": 0.6}, "pin_seat_width"),
    ],
)
def test_impossible_carriers_are_refused_by_key(changes: dict, key: str) -> None:
    with pytest.raises(InputError) as error:
        carrier_fe_mesh(wind_carrier(**changes))
    assert key in str(error.value)
    assert "\n" not in str(error.value)
