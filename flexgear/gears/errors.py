"""Manufacturing errors as compression of tooth pairs, m; positive is excess of material.

They follow the gears' angles, not time: the harmonic part runs with the pair's path coordinate,
2π s/p_bt, so it has gear-mesh frequency at any speed; pitch deviations belong to numbered teeth.
Single-tooth deviation after Tan et al. 2023, eq. 19: e = ½ (f_a + f_b) sin(…).
A pin displaced by (r, t) in planet axes moves the planet along, δ = −N·(r, t, 0).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.contact import GearMeshPath, gear_mesh_paths

if TYPE_CHECKING:
    from flexgear.model.flexible_stage import FlexibleStage

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PairErrors:
    """Errors of one gear mesh kind.

    harmonic_amplitude m, harmonic_phase rad, offset m: (N,); gear_tooth (z,) and planet_tooth
    (N, z_p): pitch deviations by tooth number, m. Runout, Σ_h A sin(rate · angle + phase):
    runout_amplitude m and runout_phase rad (N, H), runout_rate (H,) per rad, runout_angle (H,) 0
    for the stage's θ, 1 for the carrier's absolute angle.
    """

    harmonic_amplitude: Array
    harmonic_phase: Array
    offset: Array
    gear_tooth: Array
    planet_tooth: Array
    runout_amplitude: Array = field(default_factory=lambda: np.zeros((0, 0)))
    runout_rate: Array = field(default_factory=lambda: np.zeros(0))
    runout_phase: Array = field(default_factory=lambda: np.zeros((0, 0)))
    runout_angle: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))


def pitch_deviations(rng: np.random.Generator, shape: tuple[int, ...], deviation: float) -> Array:
    """Random single-tooth deviations of given standard deviation, mean zero on every gear."""
    values = rng.normal(0.0, 1.0, shape)  # drawn even for 0, so that one gear's draw is its own
    values -= values.mean(axis=-1, keepdims=True)
    return deviation * values


def pair_errors(
    case: FlexibleStage, paths: Mapping[str, GearMeshPath] | None = None
) -> dict[str, PairErrors]:
    """Errors of all four gear-mesh kinds; paths: those of the case, if they are known.

    Every flank has its own pitch deviations. A planet tooth's flank that touches the ring when
    the carrier drives touches the sun when it is driven, and the other way about.
    """
    stage, e = case.stage, case.errors
    n = stage.planets
    rng = np.random.default_rng(e.seed)
    ring = pitch_deviations(rng, (2, stage.ring.teeth), e.ring_pitch)
    sun = pitch_deviations(rng, (2, stage.sun.teeth), e.sun_pitch)
    planet = pitch_deviations(rng, (2, n, stage.planet.teeth), e.planet_pitch)
    pitch = {
        "ring": (ring[0], planet[0]),
        "sun": (sun[0], planet[1]),
        "ring_back": (ring[1], planet[1]),
        "sun_back": (sun[1], planet[0]),
    }
    radial, tangential = np.zeros(n), np.zeros(n)
    radial[: len(e.pin_radial)] = e.pin_radial
    tangential[: len(e.pin_tangential)] = e.pin_tangential
    out = {}
    for kind, path in (paths or gear_mesh_paths(case)).items():
        gear = "ring" if kind.startswith("ring") else "sun"
        front = not kind.endswith("back")
        amplitude = 0.5 * (getattr(e, f"{gear}_tooth") + e.planet_tooth)
        phase = getattr(e, f"{gear}_phase")
        nx, ny = path.normal_xy / np.sqrt(1 + path.slope**2)
        out[kind] = PairErrors(
            harmonic_amplitude=np.full(n, amplitude if front else 0.0),
            harmonic_phase=np.full(n, phase),
            offset=-(nx * radial + ny * tangential),
            gear_tooth=pitch[kind][0],
            planet_tooth=pitch[kind][1],
            runout_amplitude=np.zeros((n, 0)),
            runout_phase=np.zeros((n, 0)),
        )
    return out
