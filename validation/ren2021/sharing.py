"""Load sharing of the stage by the paper's formulas, by samples and in closed form."""

from dataclasses import dataclass

import numpy as np
from linear import Linear, cycle_shares

from flexgear.arrays import Array
from ren2021.equations import Stage, Supports
from ren2021.errors import Errors, harmonics

SAMPLES = 16  # a gear-mesh cycle
E = 20e-6  # m, the paper's size of every error
CASES = {
    "all errors": Errors(E, (E, E, E), E, E, E, E),
    "sun eccentricity": Errors(sun=E),
    "eccentricity of planet 1": Errors(planets=(E, 0.0, 0.0)),
}


@dataclass(frozen=True)
class Sharing:
    """Eqs. 21-24: by gear meshes of one side (sun left, sun right, ring left, ring right) and
    planet, and of the system; ``momentary``: largest N F_i/ΣF at any instant."""

    parts: Array  # (4, N)
    momentary: float

    @property
    def system(self) -> float:
        """LSC of eq. 24."""
        return float(self.parts.max())

    @property
    def sun(self) -> float:
        """Largest of the sun's gear meshes."""
        return float(self.parts[:2].max())


def cycle_times(stage: Stage, cycles: int) -> Array:
    """SAMPLES times in each of ``cycles`` gear-mesh cycles, spread over the common period, s."""
    chosen = np.unique(np.linspace(0, stage.cycles - 1, min(cycles, stage.cycles)).astype(int))
    positions = chosen[:, None] + np.arange(SAMPLES) / SAMPLES
    return np.asarray(positions.ravel() * 2 * np.pi / stage.gear_mesh_rate)


def sharing(
    stage: Stage,
    system: Linear,
    errors: Errors,
    signs: str,
    quasi_static: bool = True,
    cycles: int = 2000,
) -> Sharing:
    """Load sharing in the steady state; ``cycles`` of the common period's are evaluated."""
    time = cycle_times(stage, cycles)
    forces = system.forces(harmonics(stage, errors, signs), time, quasi_static)
    sides = np.split(forces, 4, axis=1)
    count = len(time) // SAMPLES
    momentary = max(float((f.max(axis=1) / f.mean(axis=1)).max()) for f in sides)
    parts = [1 + np.abs(cycle_shares(f, count) - 1).max(axis=0) for f in sides]  # eq. 22
    return Sharing(np.array(parts), momentary)


def compliance(stage: Stage, supports: Supports) -> float:
    """Series compliance of a planet's load path for uneven loads with three planets, m/N.

    In the transverse plane, P_i the force of both halves of gear mesh i. Loads of three planets
    that sum to zero move each central member by 3P/2 over its stiffness, along the line of action
    of the planet that carries them; the planet's rotation makes sun and ring loads equal, so that

        C = 1/(2 k_sp cos²β_b) + 1/(2 k_rp cos²β_b) + 3/(2 k_s) + 3/(4 k_r) + 6 cos²α/k_c
            + 4 cos²α/k_p .
    """
    c2, b2 = np.cos(stage.transverse_angle) ** 2, np.cos(stage.base_helix) ** 2
    gear_meshes = 0.5 / b2 * (1 / stage.sun_stiffness + 1 / stage.ring_stiffness)
    centre = 1.5 / supports.sun + 0.75 / supports.ring + 6 * c2 / supports.carrier
    return float(gear_meshes + centre + 4 * c2 / supports.planet)


def compatible_sharing(stage: Stage, supports: Supports, error: Array) -> float:
    """Largest K of errors summed over both gear meshes of each planet, (positions, N), along N.

    K_i = 1 + (e_i − mean e)/(cos β_b C P_0), P_0 = T_s/(N r_s): for three planets any uneven part
    of the errors is a translation of the central members.
    """
    load = stage.torque / (stage.planets * stage.sun_radius)
    uneven = error - error.mean(axis=1, keepdims=True)
    path = np.cos(stage.base_helix) * compliance(stage, supports) * load
    return float(1 + (uneven / path).max())
