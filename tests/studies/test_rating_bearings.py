"""Bearings of rated cases: rows alone, thrust, what cannot be in equilibrium."""

import math
from dataclasses import replace

import numpy as np
import pytest

from flexgear.model.load import load_case
from flexgear.model.load_cases import LoadCase
from flexgear.results.report.study_tables import rating_tables
from flexgear.solve.bin_loads import loads_in_bin
from flexgear.studies import rating as study
from flexgear.studies.rating import rate

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


def _rated(planet=None, far=None, **changes):
    """wind-5mw with data of the bearings of its planets and at the far seat of its carrier."""
    keys = {f"stage.planet_bearing.{key}": value for key, value in (planet or {}).items()}
    keys |= {f"stage.carrier.bearing_far.{key}": value for key, value in (far or {}).items()}
    cases = (LoadCase(name="a", hours=1000.0, torque=4e6, moment=(1e6, 5e5, 0.0)),)
    return rate(load_case("wind-5mw", RIGID | keys | changes).with_(load_cases=cases), workers=1)


def _part(rating, name):
    return {part.name: part for part in rating.parts}[name]


def test_rows_without_equilibrium_are_not_assessed_and_the_others_are():
    """A single row of tapered rollers carries neither radial load nor moment without thrust."""
    rating = _rated(planet=ROLLERS | TILTED, far=ROLLERS | TILTED | PAIR)
    assert "give both rows of its pair" in rating.not_assessed["stage.planet_bearings"]
    assert math.isnan(_part(rating, "stage.planet_bearing_1").life)
    assert 0.0 < _part(rating, "stage.carrier_far").life < math.inf


def test_a_single_row_is_where_its_springs_act():
    """Springs that do not resist tilt carry no moment about z, so that the row does not."""
    aligned = {"tilt_nm_per_rad": "0", "z_mm": "40"}
    factors = _part(_rated(far=ROLLERS | aligned), "stage.carrier_far").factors[0]
    assert factors["F_r"].value > 1e5
    assert factors["M"].value < 1e-6 * factors["F_r"].value


def test_a_thrust_alone_wears_out_rows_that_carry_it(monkeypatch):
    """240 kN on one of two rows that face one another: Q = F_a/(Z sin α) on all of its rollers,
    L = ((Q/Q_ci)^4.5 + (Q/Q_ce)^4.5)^(−8/9)."""

    def with_thrust(train, load_bin):
        loads = loads_in_bin(train, load_bin)
        thrust = {name: np.array([[0, 0, 2.4e5, 0, 0, 0]]) for name in loads.supports}
        return replace(loads, supports=thrust)

    monkeypatch.setattr(study, "loads_in_bin", with_thrust)
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


def test_a_life_without_lubricant_is_said_to_be_basic():
    oil = {
        "lubricant.viscosity_40_mm2_per_s": "320", "lubricant.temperature_c": "65",
        "lubricant.contamination": "0.5",
    }  # fmt: skip
    for lubricant, basic in (({}, True), (oil, False)):
        first = rating_tables(_rated(planet=ROLLERS | PAIR, **lubricant))[0]
        row = next(row for row in first.rows if "planet bearings" in row.label)
        assert ("basic life" in str(row.value)) == basic
