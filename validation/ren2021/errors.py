"""Errors along the lines of action: by geometry, and with the signs that the paper prints.

e > 0 is excess of material. A gear whose centre stands at c off its axis adds to eq. 3's deflection
what a displacement c would; geometry therefore gives

    sun          E_s cos β_b sin((ω_s − ω_c) t + β_s + α_t − φ_i)
    planet       −E_p cos β_b sin((ω_p − ω_c) t + β_p ± α_t)          + sun, − ring
    ring         E_r cos β_b sin(−ω_c t + β_r − α_t − φ_i)
    carrier      −E_c cos β_b sin(β_c − φ_i ± α_t)                     + sun, − ring

as pins carry their planets along. The paper leaves out cos β_b, turns the planet's sign in the ring
gear meshes, takes the carrier's tangential part only, and gives it opposite signs in sun and ring
gear meshes in eqs. 15 and 16, but the same in eq. 20. Tooth errors are E sin(ω_m t + 2π γ_i) with
γ_i = z φ_i/2π; phases β are zero, as the paper names none.
"""

from dataclasses import dataclass

import numpy as np
from linear import Harmonic

from flexgear.arrays import Array
from ren2021.equations import Stage

SIGNS = ("geometry", "equation 20", "equation 16")


@dataclass(frozen=True)
class Errors:
    """Amplitudes, m: eccentricities of sun, planets (each), rings, carrier; tooth errors."""

    sun: float = 0.0
    planets: tuple[float, ...] = ()
    ring: float = 0.0
    carrier: float = 0.0
    sun_tooth: float = 0.0
    ring_tooth: float = 0.0


def harmonics(stage: Stage, errors: Errors, signs: str) -> list[Harmonic]:
    """Error of every gear mesh, in the order of `equations.deflections`."""
    if signs not in SIGNS:
        raise ValueError(f"signs: {signs!r} is none of {SIGNS}")
    at, phi, ones = stage.transverse_angle, stage.angles, np.ones(stage.planets)
    geometry = signs == "geometry"
    scale = float(np.cos(stage.base_helix)) if geometry else 1.0
    planets = np.array(errors.planets or (0.0,) * stage.planets)
    none = (0 * ones, 0 * ones)
    sun = (scale * (1 if geometry else -1) * errors.sun * ones, at - phi)
    ring = (scale * errors.ring * ones, -at - phi)
    terms = [
        (stage.sun_relative, sun, none),
        (
            stage.planet_relative,
            (-scale * planets, at * ones),
            ((-scale if geometry else 1.0) * planets, -at * ones),
        ),
        (-stage.carrier_speed, none, ring),
        (0.0, *_carrier(stage, errors.carrier, signs)),
        (
            stage.gear_mesh_rate,
            (errors.sun_tooth * ones, stage.sun_teeth * phi),
            (errors.ring_tooth * ones, stage.ring_teeth * phi),
        ),
    ]
    return [
        Harmonic(rate, np.r_[at_sun[0], at_sun[0], at_ring[0], at_ring[0]],
                 np.r_[at_sun[1], at_sun[1], at_ring[1], at_ring[1]])
        for rate, at_sun, at_ring in terms
        if at_sun[0].any() or at_ring[0].any()
    ]  # fmt: skip


def _carrier(
    stage: Stage, error: float, signs: str
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """(amplitudes, phases) at the sun and at the ring gear meshes of a carrier off its axis."""
    at, phi, ones = stage.transverse_angle, stage.angles, np.ones(stage.planets)
    if signs == "geometry":
        along = -error * float(np.cos(stage.base_helix)) * ones
        return (along, at - phi), (along, -at - phi)
    tangential = error * float(np.cos(at)) * ones
    if signs == "equation 16":
        return (tangential, -phi), (-tangential, -phi)
    return (-tangential, -phi), (-tangential, -phi)
