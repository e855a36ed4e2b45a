"""Bearings of rated cases: rows alone, thrust, what cannot be in equilibrium."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from flexgear.model.load import load_case
from flexgear.model.load_cases import LoadCase
from flexgear.results.report.study_tables import rating_tables
from flexgear.studies import rating as study
from flexgear.studies.rating import rate, worst_of

RIGID = {
    **{f"stage.{b}.flexible": "false" for b in ("ring.fe", "carrier.fe", "sun.shaft")},
    "stage.errors": None, "rating.k_h_beta": "1.2", "rating.k_v": "1.05",
    "rating.gear_mesh_cycles": "2", "rating.positions_per_gear_mesh": "2",
}  # fmt: skip
ROLLERS = {
    "dynamic_rating_kn": "5500", "static_rating_kn": "9000", "rolling": "roller",
    "elements.count": "24", "elements.diameter_mm": "60", "elements.pitch_diameter_mm": "500",
    "elements.length_mm": "100", "elements.profile": "straight", "elements.edge_stress": "false",
}  # fmt: skip
TILTED = {"elements.contact_angle_deg": "15"}
PAIR = {"elements.rows": "2", "elements.spacing_mm": "200"}


def _rated(planet=None, far=None, hours=(1000.0,), **changes):
    """wind-5mw with data of the bearings of its planets and at the far seat of its carrier, in load
    cases of so many hours."""
    keys = {f"stage.planet_bearing.{key}": value for key, value in (planet or {}).items()}
    keys |= {f"stage.carrier.bearing_far.{key}": value for key, value in (far or {}).items()}
    load = LoadCase(hours=1.0, torque=4e6, moment=(1e6, 5e5, 0.0))
    named = ({"name": f"{k}", "hours": h} for k, h in enumerate(hours))
    cases = tuple(load.model_copy(update=each) for each in named)
    return rate(load_case("wind-5mw", RIGID | keys | changes).with_(load_cases=cases), workers=1)


def _loaded(monkeypatch, *forces):
    """All bearings under these forces and moments (p, 6) of each load case in place of the
    model's."""
    of_cases = itertools.cycle(forces)

    def with_forces(deviated):
        loads, forces = worst_of(deviated), np.array(next(of_cases))
        return replace(loads, supports=dict.fromkeys(loads.supports, forces))

    monkeypatch.setattr(study, "worst_of", with_forces)  # after what is stored on disk


def _part(rating, name):
    return {part.name: part for part in rating.parts}[name]


def test_rows_without_equilibrium_are_not_assessed_and_the_others_are():
    """A single row of tapered rollers carries neither radial load nor moment without thrust."""
    rating = _rated(planet=ROLLERS | TILTED, far=ROLLERS | TILTED | PAIR)
    assert "give both of the pair" in rating.not_assessed["stage.planet_bearings"]
    assert math.isnan(_part(rating, "stage.planet_bearing_1").life)
    assert 0.0 < _part(rating, "stage.carrier_far").life < math.inf


@pytest.mark.parametrize("rows", [{}, PAIR])
def test_rows_are_where_their_springs_act(rows):
    """Springs that do not resist tilt carry no moment about z, so that the rows do not."""
    aligned = {"tilt_nm_per_rad": "0", "z_mm": "40"}
    factors = _part(_rated(far=ROLLERS | rows | aligned), "stage.carrier_far").factors[0]
    assert factors["F_r"].value > 1e5
    assert factors["M"].value < 1e-6 * factors["F_r"].value


def test_a_thrust_alone_wears_out_rows_that_carry_it(monkeypatch):
    """240 kN on one of two rows that face one another: Q = F_a/(Z sin α) on all of its rollers,
    L = ((Q/Q_ci)^4.5 + (Q/Q_ce)^4.5)^(−8/9)."""

    _loaded(monkeypatch, [[0, 0, 2.4e5, 0, 0, 0]])
    rating = _rated(planet=ROLLERS | PAIR, far=ROLLERS | TILTED | PAIR)
    part, angle = _part(rating, "stage.carrier_far"), math.radians(15)
    curved = (1 - 0.12 * math.cos(angle)) / (1 + 0.12 * math.cos(angle))
    t, one = 1.038 * curved ** (143 / 108), 2.4e5 / 24 / math.sin(angle)
    row = 5500e3 / 0.83 / 24 / math.cos(angle) / 2 ** (7 / 9)
    inner = row / 0.378 * (1 + t**4.5) ** (2 / 9)
    outer = row / 0.364 * (1 + t**-4.5) ** (2 / 9)
    turns = 1e6 * ((one / inner) ** 4.5 + (one / outer) ** 4.5) ** (-8 / 9)
    assert part.cycles[0] / part.damage[0] == pytest.approx(turns, rel=1e-6)
    assert _part(rating, "stage.planet_bearing_1").life == math.inf  # left to ribs


def test_a_moment_alone_loads_rows_like_opposite_forces(monkeypatch):
    """M at a spacing s is ±M/s on narrow rows, as is a radial load of 2 M/s, whichever way the
    moment turns; basic life does not count it, and is not assessed then."""
    narrow = ROLLERS | PAIR | {"elements.length_mm": "20", "elements.spacing_mm": "1000"}
    basic = {"dynamic_rating_kn": "9000", "static_rating_kn": "9000", "rolling": "roller"}
    lives = []
    for force in ([2e6, 0, 0, 0, 0, 0], [0, 0, 0, 6e5, -8e5, 0], [1e-9, -1e-9, 1e-9, 0, 1e6, 0]):
        _loaded(monkeypatch, [force])
        rating = _rated(planet=narrow | {"z_mm": "0"}, far=basic)
        part = _part(rating, "stage.planet_bearing_1")
        lives.append([*part.safety, part.life])
    assert lives[1] == pytest.approx(lives[0], rel=1e-2)
    assert lives[2] == pytest.approx(lives[0], rel=1e-2)
    assert "the moment is left out" in rating.not_assessed["stage.carrier_far"]


def test_moments_are_about_the_radial_load_and_across_it(monkeypatch):
    """By hand: (4, −3) is the normal on the right of a load along (3, 4)."""
    _loaded(monkeypatch, [[3e5, 4e5, 0, 3e3 + 4e2, 4e3 - 3e2, 0]])
    sheet = _part(_rated(planet=ROLLERS | {"z_mm": "0"}), "stage.planet_bearing_1").factors[0]
    moments = [sheet[symbol].value for symbol in ("M_x", "M_y", "M")]
    assert moments == pytest.approx([5e3, -5e2, math.hypot(5e3, 5e2)], rel=1e-9)


def test_basic_life_names_both_loads_that_it_leaves_out(monkeypatch):
    """Thrust of 0.3 F_r, and 0.2 N m/N across two halves that are 2 √(0.16/4) m apart."""
    _loaded(monkeypatch, [[1e6, 0, 3e5, 0, 2e5, 0]])
    rating = _rated({"dynamic_rating_kn": "9000", "rolling": "roller"})
    part = _part(rating, "stage.planet_bearing_1")
    reason = "by the radial load alone, as thrust and the moment are left out"
    assert part.estimates == {"equivalent_load": reason} and part.holds is None
    (text,) = (r.value for r in rating_tables(rating)[0].rows if "planet bearings" in r.label)
    assert f"no verdict: equivalent load {reason}." in text


@pytest.mark.parametrize(("moment", "verdict"), [(7.3e4, True), (7.4e4, None)])
def test_what_a_life_leaves_out_is_weighed_over_the_spectrum(monkeypatch, moment, verdict):
    """1 MN for 900 h beside M alone for 100 h. By hand, with halves 2 √(0.16/4) m apart,
    2 F_M = M/0.2 m, which does the damage of 0.19 F_r at M = 0.038 · 9^0.3 MN m = 73.5 kN m."""
    basic = {"dynamic_rating_kn": "9000", "rolling": "roller", "z_mm": "0"}
    _loaded(monkeypatch, [[1e6, 0, 0, 0, 0, 0]], [[0, 0, 0, 0, moment, 0]])
    part = _part(_rated(basic, hours=(900.0, 100.0)), "stage.planet_bearing_1")
    assert part.holds is verdict


def test_rounding_beside_a_thrust_takes_no_verdict(monkeypatch):
    """By hand P = Y F_a, Y = 0.67 cot 20°, of two rows under thrust alone, as of a helical sun."""
    _loaded(monkeypatch, [[1e-9, 0, 3e5, 4e-10, 1e-10, 0]])
    thrust = {"thrust.contact_angle_deg": "20", "thrust.rows": "2"}
    rating = _rated({"dynamic_rating_kn": "9000", "rolling": "roller"} | thrust)
    part = _part(rating, "stage.planet_bearing_1")
    assert not part.estimates and part.holds
    load = 0.67 * 3e5 / math.tan(math.radians(20))
    assert part.cycles[0] / part.damage[0] == pytest.approx(
        1e6 * (9e6 / load) ** (10 / 3), rel=1e-9
    )


def test_a_moment_that_alternates_does_the_damage_of_both_its_values(monkeypatch):
    """As in planets whose carrier bears a hub moment; of three values nearly that of all three."""
    middle = ROLLERS | PAIR | {"z_mm": "0"}

    def rated(moments):
        _loaded(monkeypatch, [[1.5e6, 0, 0, 4e4, moment, 0] for moment in moments])
        part = _part(_rated(planet=middle), "stage.planet_bearing_1")
        return np.array([part.damage[0], *part.of_rows, 1 / part.safety[0]])

    low, high = rated([-4e4]), rated([8e4])
    both = [*((low + high) / 2)[:3], high[3]]
    assert rated([8e4, -4e4, 8e4, -4e4]) == pytest.approx(both, rel=1e-9)
    mean = rated([2e4])
    assert rated([8e4, 2e4, -4e4, 2e4])[:3] == pytest.approx((both[:3] + mean[:3]) / 2, rel=0.05)
    assert mean[0] < 0.8 * both[0]


def test_a_life_without_lubricant_is_said_to_be_basic():
    oil = {
        "lubricant.viscosity_40_mm2_per_s": "320", "lubricant.temperature_c": "65",
        "lubricant.contamination": "0.5",
    }  # fmt: skip
    for lubricant, basic in (({}, True), (oil, False)):
        first = rating_tables(_rated(planet=ROLLERS | PAIR, **lubricant))[0]
        row = next(row for row in first.rows if "planet bearings" in row.label)
        assert ("basic life" in str(row.value)) == basic


def test_static_safety_is_that_of_the_largest_load(monkeypatch):
    """By hand 5 C_0/(i Z Q_max) with Q_max = 4.08 F/(i Z) of rollers without clearance or profile:
    S_0 = 5/4.08 C_0/F at the largest of all positions; the sheet says what it stands on."""
    _loaded(monkeypatch, [[f, 0, 0, 0, 0, 0] for f in (1e6, 2e6, 5e5, 1e6)])
    middle = ROLLERS | PAIR | {"z_mm": "0"}
    part = _part(_rated(planet=middle), "stage.planet_bearing_1")
    assert part.safety == pytest.approx(5 / 4.08 * 9000 / 2000, rel=0.01)
    overloaded = _rated(planet=middle, **{"rating.application_factor": "1.2"})
    by_teeth = _part(overloaded, "stage.planet_bearing_1")
    assert by_teeth.safety == part.safety and "without K_A" in by_teeth.factors[0]["F_r"].source
    assert "K_A" not in part.factors[0]["F_r"].source
    rows = [row.value for row in rating_tables(overloaded)[0].rows if "bearings" in row.label]
    assert all("loads without K_A 1.2" in text for text in rows)
    sheet = part.factors[0]
    assert sheet["S_0"].value == part.safety[0] and sheet["C_0"].value == 9e6
    assert "ring stationary" in sheet["L_10r"].source
    rated = _rated(planet={k: v for k, v in middle.items() if "rating" not in k})
    sheet = _part(rated, "stage.planet_bearing_1").factors[0]
    assert "estimated by ISO 281" in sheet["C"].source and "ISO 76" in sheet["C_0"].source
