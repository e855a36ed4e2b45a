"""Errors of Table 4 along the lines of action: by geometry, and with the signs of eq. 1.

e > 0 is excess of material, which eq. 3 subtracts: the paper's e is −e here. By geometry, with
ψ = (rate) t + phase the direction in which a part's centre is displaced (from the x axis of the
carrier frame; planets from their radial axis):

    sun      sun gear meshes   + E_s sin(ψ + α_w − φ_i)
    planet   − E_p sin(ψ + α_w) at the sun, − E_p sin(ψ − α_n) at the ring
    ring     ring gear meshes  + E_r sin(ψ − α_n − φ_i), and the same of its assembly offset A_r
    carrier  − E_c sin(β_c + α_w − φ_i) at the sun, − E_c sin(β_c − α_n − φ_i) at the ring

Eq. 1 differs in the sign of the planet at the sun, of the ring, and of the carrier at the ring, and
keeps the carrier's tangential part only. Table 4's tooth errors are taken at gear-mesh frequency,
with the phases z φ_i: constants, as eq. 1 has them, would shift all planets alike.
"""

from dataclasses import dataclass, replace

import numpy as np
from linear import Harmonic

from flexgear.arrays import Array
from hu2023.equations import PLANETS, Drive

SIGNS = ("geometry", "equation 1")
MICRO = 1e-6


@dataclass(frozen=True)
class Errors:
    """Table 4 for one stage, m and rad: planets' eccentricities have phases of their own."""

    sun: float
    ring: float
    ring_offset: float
    planet: float = 21 * MICRO
    planet_phases: tuple[float, ...] = (0.0, 2 * np.pi / 3, 4 * np.pi / 3)
    carrier: float = 25 * MICRO
    sun_tooth: float = 15 * MICRO
    ring_tooth: float = 20 * MICRO


TABLE_4 = (
    Errors(17 * MICRO, 40 * MICRO, 20 * MICRO),
    Errors(17 * MICRO, 40 * MICRO, 20 * MICRO),
    Errors(22 * MICRO, 41 * MICRO, 30 * MICRO),
)


def changed(j: int, **values: float) -> tuple[Errors, ...]:
    """Table 4 with other errors of stage j."""
    return tuple(replace(e, **values) if k == j else e for k, e in enumerate(TABLE_4))


def harmonics(
    drive: Drive, errors: tuple[Errors, ...] = TABLE_4, signs: str = "geometry"
) -> list[Harmonic]:
    """Errors of all stages' gear meshes, in the order of the rows of `equations.matrices`."""
    if signs not in SIGNS:
        raise ValueError(f"signs: {signs!r} is none of {SIGNS}")
    return [one for j in range(len(drive.stages)) for one in _stage(drive, j, errors[j], signs)]


def _stage(drive: Drive, j: int, e: Errors, signs: str) -> list[Harmonic]:
    stage, phi, ones = drive.stages[j], drive.angles, np.ones(PLANETS)
    aw, an = stage.angles
    sun_speed = drive.sun_speed(j)
    carrier = sun_speed / stage.ratio
    relative = sun_speed - carrier
    turn = 1.0 if signs == "geometry" else -1.0
    phases = np.array(e.planet_phases)
    none = (0 * ones, 0 * ones)
    terms = [
        (relative, (e.sun * ones, aw - phi), none),
        (
            -relative * stage.teeth[0] / stage.teeth[1],
            (-turn * e.planet * ones, phases + aw),
            (-e.planet * ones, phases - an),
        ),
        (-carrier, none, (turn * e.ring * ones, -an - phi)),
        (-carrier, none, (e.ring_offset * ones, -an - phi)),
        (0.0, *_carrier(e.carrier, (aw, an), phi, signs)),
        (
            relative * stage.teeth[0],
            (e.sun_tooth * ones, stage.teeth[0] * phi),
            (e.ring_tooth * ones, stage.teeth[2] * phi),
        ),
    ]
    harmonics = []
    for rate, at_sun, at_ring in terms:
        amplitude, phase = np.zeros((2, 2 * PLANETS * len(drive.stages)))
        for kind, (size, angle) in (("sun", at_sun), ("ring", at_ring)):
            amplitude[drive.gear_meshes(j, kind)] = size
            phase[drive.gear_meshes(j, kind)] = angle
        if amplitude.any():
            harmonics.append(Harmonic(rate, amplitude, phase))
    return harmonics


def _carrier(
    error: float, angles: tuple[float, float], phi: Array, signs: str
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    aw, an = angles
    ones = np.ones(PLANETS)
    if signs == "geometry":
        return (-error * ones, aw - phi), (-error * ones, -an - phi)
    return (-error * np.cos(aw) * ones, -phi), (error * np.cos(an) * ones, -phi)
