"""Load sharing and displacements of the drive's equations over the period of a stage."""

from dataclasses import dataclass

import numpy as np
from linear import Harmonic, Linear, cycle_shares

from flexgear.arrays import Array
from hu2023.equations import Drive

SAMPLES = 16  # a gear-mesh cycle


@dataclass(frozen=True)
class StageFigures:
    """Of one stage: largest shares outside and inside by eqs. 19 and 20; lowest force over the
    mean; largest radial displacement of sun and carrier, amplitude of the carrier's Y, m."""

    outside: float
    inside: float
    lowest: float
    sun_float: float
    carrier_float: float
    carrier_amplitude: float


def cycle_times(drive: Drive, j: int, cycles: int = 900) -> Array:
    """SAMPLES times in each of ``cycles`` gear-mesh cycles, spread over the stage's period, s."""
    stage = drive.stages[j]
    chosen = np.unique(np.linspace(0, stage.cycles - 1, min(cycles, stage.cycles)).astype(int))
    positions = chosen[:, None] + np.arange(SAMPLES) / SAMPLES
    return np.asarray(positions.ravel() * 2 * np.pi / gear_mesh_rate(drive, j))


def gear_mesh_rate(drive: Drive, j: int) -> float:
    """ω_m = z_s (ω_s − ω_c), rad/s."""
    stage = drive.stages[j]
    return drive.sun_speed(j) * (1 - 1 / stage.ratio) * stage.teeth[0]


def stage_figures(
    drive: Drive,
    system: Linear,
    j: int,
    errors: list[Harmonic],
    quasi_static: bool,
    cycles: int = 900,
) -> StageFigures:
    """Stage j from 0 under the errors of all stages."""
    time = cycle_times(drive, j, cycles)
    count = len(time) // SAMPLES
    forces = system.forces(errors, time, quasi_static)
    sides = [forces[:, drive.gear_meshes(j, kind)] for kind in ("sun", "ring")]
    shares = [float(cycle_shares(side, count).max()) for side in sides]
    motion = system.motion(errors, time, quasi_static)
    carrier, sun = drive.carrier(j), drive.first(j)
    y = motion[:, carrier + 2]
    floats = drive.stages[j].sun_support is not None
    return StageFigures(
        *shares,
        lowest=float(sides[0].min()) / drive.mean_force(j),
        sun_float=float(np.hypot(*motion[:, sun + 1 : sun + 3].T).max()) if floats else 0.0,
        carrier_float=float(np.hypot(*motion[:, carrier + 1 : carrier + 3].T).max()),
        carrier_amplitude=float(np.ptp(y)) / 2,
    )
