"""Every unit of every dimension, there and back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgear.model.units import _SUFFIXES, Quantity, unit_name


@pytest.mark.parametrize("dimension", _SUFFIXES)
@given(value=st.floats(-1e12, 1e12))
def test_there_and_back(dimension, value):
    q = Quantity(dimension)
    for suffix in q.suffixes:
        assert q.from_si(q.to_si(value, suffix), suffix) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("dimension", "suffix", "value", "si"),
    [
        ("length", "mm", 430, 0.43),
        ("length", "um", 36.8, 36.8e-6),
        ("angle", "deg", 180, math.pi),
        ("speed", "rpm", 60, 2 * math.pi),
        ("torque", "knm", 4000, 4e6),
        ("stiffness", "n_per_um", 1, 1e6),
        ("stiffness", "kn_per_mm", 1, 1e6),
        ("stiffness per face width", "n_per_mm_um", 14, 14e9),
        ("modulus", "gpa", 210, 210e9),
        ("density", "g_per_cm3", 7.85, 7850),
        ("inertia", "t_m2", 2, 2000),
        ("force", "kn", 2, 2000),
        ("power", "mw", 5, 5e6),
        ("power", "kw", 6.4, 6400),
        ("acceleration", "m_per_s2", 9.81, 9.81),
    ],
)
def test_factors_by_hand(dimension, suffix, value, si):
    assert Quantity(dimension).to_si(value, suffix) == pytest.approx(si, rel=1e-15)


def test_every_suffix_has_a_printed_name():
    for units in _SUFFIXES.values():
        for suffix in units:
            assert "_" not in unit_name(suffix)
