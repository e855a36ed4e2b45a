"""Hertzian line contact: closed forms, tangent, reference points, units."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j1

from flexgear.gears.hertz import ContactBody, layer_constant, line_contact, relative_radius

STEEL = ContactBody(210e9, 0.3, 2e-3)
SOFT = ContactBody(110e9, 0.25, 3e-3, "layer")
LOADS = np.geomspace(1e2, 2e6, 9)


def test_half_width_and_pressure_of_textbook_cylinders():
    """Steel on steel, ρ = 10 mm, 1 N/mm: a² = 4wρ/(πE*), p² = wE*/(πρ), p a π/2 = w."""
    contact = line_contact(STEEL, STEEL, 10e-3)
    modulus = 210e9 / (2 * (1 - 0.3**2))
    assert contact.half_width(1e3) == pytest.approx(
        math.sqrt(4 * 1e3 * 10e-3 / (math.pi * modulus))
    )
    assert contact.pressure(1e3) == pytest.approx(math.sqrt(1e3 * modulus / (math.pi * 10e-3)))
    w = math.pi / 2 * contact.pressure(LOADS) * contact.half_width(LOADS)
    assert w == pytest.approx(LOADS, rel=1e-12)


def test_approach_of_equal_bodies_is_weber_and_banaschek():
    radius, load = 12e-3, 4e5
    contact = line_contact(STEEL, replace(STEEL, depth=5e-3), radius)
    c, a = STEEL.compliance, contact.half_width(load)
    expected = 2 * c / math.pi * load * (math.log(4 * 2e-3 * 5e-3 / a**2) - 0.3 / 0.7)
    assert contact.approach(load) == pytest.approx(expected, rel=1e-13)


def test_tangent_is_the_derivative():
    contact = line_contact(STEEL, SOFT, 15e-3)
    step = 1e-5 * LOADS
    by_differences = (contact.approach(LOADS + step) - contact.approach(LOADS - step)) / (2 * step)
    assert contact.tangent(LOADS) == pytest.approx(by_differences, rel=1e-8)
    assert contact.approach(0.0) == 0.0
    top = contact.largest_line_load
    assert contact.tangent(top) == pytest.approx(0.0, abs=1e-12 * contact.beta)
    assert (contact.tangent(LOADS) > 0).all() and top > LOADS[-1]


def test_law_of_a_slice():
    contact, length = line_contact(STEEL, SOFT, 15e-3), 0.02
    scale, limit = contact.of_slice(length)
    force = LOADS * length
    assert scale * force * np.log(limit / force) == pytest.approx(contact.approach(LOADS))


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_layer_is_hertz_pressure_on_a_bonded_layer(poisson):
    """Against the whole Fourier integral of Hertz's pressure, narrow against the layer."""
    narrow, k = 1e-3, 3 - 4 * poisson  # a/h

    def sunk(t):
        share = 1.0
        if t < 20:
            below = 2 * k * math.cosh(2 * t) + 1 + k**2 + 4 * t**2
            share = (2 * k * math.sinh(2 * t) - 4 * t) / below
        return 2 * j1(narrow * t) / (narrow * t) * share / t

    parts = [0.0, 1.0, 20.0, *np.arange(1, 60) / narrow]
    whole = sum(quad(sunk, *ends, limit=200)[0] for ends in itertools.pairwise(parts))
    assert whole == pytest.approx(math.log(2 / narrow) + layer_constant(poisson), abs=2e-4)


def test_length_is_a_strip_on_a_half_space():
    """Boussinesq's displacement at the middle of Hertz's pressure, long against its width."""
    length, a = 1.0, 1e-3
    body = replace(STEEL, depth=length, reference="length")
    x = a * np.cos((np.arange(400) + 0.5) * math.pi / 400)  # Chebyshev nodes of √(1 − x²)
    weight = (1 - (x / a) ** 2) / np.sum(1 - (x / a) ** 2)
    sunk = body.compliance / math.pi * np.sum(weight * 2 * np.arcsinh(length / (2 * np.abs(x))))
    expected = 2 * body.compliance / math.pi * (math.log(2 * length / a) + body.constant)
    assert expected == pytest.approx(sunk, rel=1e-3)


def test_relative_radius():
    assert relative_radius(2.0, 3.0, internal=False) == pytest.approx(1.2)
    assert relative_radius(2.0, 3.0, internal=True) == pytest.approx(6.0)
