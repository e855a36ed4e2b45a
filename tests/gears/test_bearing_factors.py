"""Factors of bearing ratings: life factor, viscosity, contamination, f_c and f_0."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgear.gears.bearings.bearing import (
    dynamic_rating,
    static_rating,
)
from flexgear.gears.bearings.reference_life import (
    contamination_factor,
    life_modification,
    reference_viscosity,
    viscosity_100,
    viscosity_at,
)
from flexgear.gears.bearings.rows import BallRow, RollerRow
from flexgear.model.bearings import Lubricant

MM = 1e-3


@pytest.mark.parametrize("rolling", ["ball", "roller"])
@pytest.mark.parametrize("kappa", [0.4, 1.0])
def test_branches_of_the_life_factor_meet(rolling, kappa):
    ratios = np.array([0.01, 0.1, 0.3])
    below, above = (life_modification(rolling, kappa + d, ratios) for d in (-1e-9, 1e-9))
    assert below == pytest.approx(above, rel=2e-3)


@given(
    kappa=st.floats(0.1, 6), ratio=st.floats(1e-4, 5), rolling=st.sampled_from(["ball", "roller"])
)
def test_life_factor_grows_with_film_and_cleanliness(kappa, ratio, rolling):
    a = life_modification(rolling, kappa, ratio)
    assert 0.09 < a <= 50
    assert life_modification(rolling, kappa * 1.1, ratio) >= a * 0.998
    assert life_modification(rolling, kappa, ratio * 1.1) >= a * (1 - 1e-12) or kappa < 0.11
    assert life_modification(rolling, 9.0, ratio) == life_modification(rolling, 4.0, ratio)


def test_viscosity():
    """Points of D341 lie on its line; VI 95 of ISO VG oils as oil makers print them."""
    oil = Lubricant(viscosity_40=320e-6, viscosity_100=24e-6, temperature=338.15)
    for temperature, viscosity in ((313.15, 320e-6), (373.15, 24e-6)):
        lubricant = oil.model_copy(update={"temperature": temperature})
        assert viscosity_at(lubricant) == pytest.approx(viscosity, rel=1e-9)
    middle = math.log10(math.log10(1e6 * viscosity_at(oil) + 0.7))
    ends = [math.log10(math.log10(v + 0.7)) for v in (320, 24)]
    share = math.log(338.15 / 313.15) / math.log(373.15 / 313.15)
    assert middle == pytest.approx(ends[0] + share * (ends[1] - ends[0]), rel=1e-12)
    table = {5.0: (40.23, 28.49), 10.0: (147.7, 82.87), 20.0: (493.2, 229.5), 30.0: (1023, 422.0)}
    for thin, (low, high) in table.items():  # L and H of ASTM D2270, VI = 100 (L − ν_40)/(L − H)
        thick = low - 0.95 * (low - high)
        assert 1e6 * viscosity_100(1e-6 * thick) == pytest.approx(thin, rel=3e-3)
    assert viscosity_at(Lubricant(viscosity_40=320e-6)) is None
    assert viscosity_at(Lubricant(viscosity_40=320e-6, operating_viscosity=9e-5)) == 9e-5


def test_reference_viscosity_and_contamination():
    """By hand, at 500 and 2000 r/min; branches of ν_1 meet at 1000 within a per cent."""
    per_rpm = math.pi / 30
    assert reference_viscosity(0.2, 500 * per_rpm) == pytest.approx(
        45000e-6 / 500**0.83 / math.sqrt(200), rel=1e-9
    )
    assert reference_viscosity(0.2, -2000 * per_rpm) == pytest.approx(
        4500e-6 / math.sqrt(2000 * 200), rel=1e-9
    )
    low, high = (reference_viscosity(0.2, n * per_rpm) for n in (999.99, 1000.01))
    assert low == pytest.approx(high, rel=0.03)
    clean, dirty = (
        contamination_factor(Lubricant(viscosity_40=1e-4, cleanliness=code), 0.1, 1.0)
        for code in ("-/13/10", "-/19/16")
    )
    assert clean == pytest.approx(1 - 0.5663 / 100 ** (1 / 3)) and dirty == pytest.approx(
        0.135, rel=0.01
    )
    assert contamination_factor(Lubricant(viscosity_40=1e-4, contamination=0.3), 0.1, 1) == 0.3
    assert contamination_factor(Lubricant(viscosity_40=1e-4), 0.1, 1.0) is None


@pytest.mark.parametrize(
    ("gamma", "factor"),
    [(0.01, 52.1), (0.05, 74.1), (0.1, 84.2), (0.16, 88.5), (0.2, 88.7), (0.3, 83.8)],
)
def test_rating_of_rollers_meets_the_table_of_f_c(gamma, factor):
    """ISO 281:2007, table 7."""
    row = RollerRow(10, 1 * MM, 1 * MM / gamma, length=1 * MM)
    assert dynamic_rating(row, 1) / 1.1 / 10**0.75 == pytest.approx(factor, rel=1e-3)


@pytest.mark.parametrize(
    ("gamma", "factor"), [(0.05, 46.7), (0.1, 55.5), (0.16, 59.6), (0.2, 59.9), (0.3, 56.0)]
)
def test_rating_of_balls_meets_the_table_of_f_c(gamma, factor):
    """ISO 281:2007, table 2: one row and angular contact; less with two rows of deep grooves."""
    row = BallRow(8, 20 * MM, 20 * MM / gamma, inner_groove=10.4 * MM, outer_groove=10.6 * MM)
    rated = 1.3 * factor * 8 ** (2 / 3) * 20**1.8
    assert dynamic_rating(row, 1) == pytest.approx(rated, rel=2e-3)
    assert dynamic_rating(row, 2) == pytest.approx(2**0.7 * 0.9 / 0.95 * rated, rel=2e-3)
    angle = math.radians(40)
    turned = replace(row, contact_angle=angle, pitch_diameter=20 * MM * math.cos(angle) / gamma)
    faced = (2 * math.cos(angle)) ** 0.7 * rated
    assert dynamic_rating(turned, 2) == pytest.approx(faced, rel=2e-3)
    large = replace(row, diameter=30 * MM, pitch_diameter=30 * MM / gamma)
    assert dynamic_rating(large, 1) == pytest.approx(3.647 * factor * 4 * 30**1.4, rel=2e-3)


@pytest.mark.parametrize(
    ("gamma", "factor"), [(1e-6, 14.7), (0.1, 16.4), (0.12, 15.9), (0.2, 14.0)]
)
def test_static_rating_of_balls_meets_the_table_of_f_0(gamma, factor):
    """ISO 76:2006, table 1."""
    row = BallRow(5, 1 * MM, 1 * MM / gamma, inner_groove=0.52 * MM, outer_groove=0.53 * MM)
    assert static_rating(row, 1) / 5 == pytest.approx(factor, rel=5e-3)
