"""The package on the bundled case `pitch-drive`: runs that rows and pictures share."""

from collections.abc import Mapping
from functools import cache

import numpy as np
from trains import TrainRun, gear_mesh_forces, put_together

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.transient import Transient
from flexgear.arrays import Array
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.results.load_sharing import RunningSharing
from hu2023 import studies
from hu2023.cases import drive, train
from hu2023.sharing import SAMPLES, cycle_times, gear_mesh_rate

STAGES = (0, 1, 2)
KINDS = {"outside": "sun", "inside": "ring"}
CYCLES = 150  # gear-mesh cycles of a stage's period
STEP, EVERY, SETTLED, END = 5e-5, 5e-4, 0.3, 1.2  # s
ECCENTRIC = (
    "sun_eccentricity", "ring_eccentricity", "carrier_eccentricity", "ring_offset",
    "sun_gear_mesh", "ring_gear_mesh",
)  # fmt: skip


@cache
def flow() -> PowerFlow:
    """Speeds and torques of the bundled case."""
    return power_flow(train())


@cache
def bundled() -> TrainRun:
    """The bundled case."""
    return put_together(train())


def with_changes(changes: Mapping[str, object]) -> TrainRun:
    """The bundled case with SI values changed."""
    return put_together(train().with_(**changes))


def without_errors() -> TrainRun:
    """The bundled case with perfect parts."""
    changes: dict[str, object] = {
        f"stages.stage_{j + 1}.errors.{name}": 0.0 for j in STAGES for name in ECCENTRIC
    }
    for j in STAGES:
        changes[f"stages.stage_{j + 1}.errors.planet_eccentricity"] = ()
        changes[f"stages.stage_{j + 1}.errors.planet_eccentricity_phase"] = ()
    return with_changes(changes)


def random_errors(seed: int) -> TrainRun:
    """Random errors of tens of µm on everything in every stage."""
    rng = np.random.default_rng(seed)
    changes: dict[str, object] = {}
    for j in STAGES:
        at = f"stages.stage_{j + 1}.errors"
        for name in ECCENTRIC:
            changes[f"{at}.{name}"] = float(rng.uniform(0, 60e-6))
        for name in ("pin_radial", "pin_tangential"):
            changes[f"{at}.{name}"] = tuple(map(float, rng.normal(0, 30e-6, 3)))
        changes[f"{at}.planet_eccentricity"] = tuple(map(float, rng.uniform(0, 60e-6, 3)))
        changes[f"{at}.planet_eccentricity_phase"] = tuple(map(float, rng.uniform(0, 6, 3)))
    return with_changes(changes)


def over_period(run: TrainRun, j: int, cycles: int = CYCLES) -> Equilibrium:
    """Equilibria over the period of stage j, SAMPLES positions in each of ``cycles`` cycles."""
    return run.at(drive().speed * cycle_times(drive(), j, cycles))


def mean_based(forces: Array, samples_per_cycle: float) -> float:
    """Coefficient of gear-mesh forces (t, N) of planets that share a load."""
    running = RunningSharing(forces.shape[1], samples_per_cycle)
    running.append(forces)
    return float(running.planets("mean-based").max())


def sharing(run: TrainRun, result: Equilibrium, j: int, side: str) -> float:
    """K of eqs. 19 and 20 of a stage, "outside" or "inside"."""
    forces = gear_mesh_forces(result)[:, run.columns(j, KINDS[side])]
    return mean_based(forces, SAMPLES)


def momentary(run: TrainRun, result: Equilibrium | Transient, j: int, side: str) -> float:
    """Largest N F_i/ΣF at any instant."""
    forces = gear_mesh_forces(result)[:, run.columns(j, KINDS[side])]
    return float((forces.max(axis=1) / forces.mean(axis=1)).max())


def displacement(run: TrainRun, result: Equilibrium | Transient, member: str) -> Array:
    """(positions, 2) x and y of a member in the frame of its stage's carrier, m."""
    x = run.modal.system.slice_of(member).start
    return np.asarray(result.eta @ run.modal.modes[x : x + 2].T)


@cache
def quasi_static(j: int) -> Equilibrium:
    """The bundled case over the period of stage j."""
    return over_period(bundled(), j)


@cache
def orbit_times(j: int, positions: int = 2500) -> Array:
    """Times over the period of stage j, s, that meet all phases of a gear-mesh cycle."""
    count = drive().stages[j].cycles
    stride = (SAMPLES * count // positions) | 1  # odd, so that it runs through the cycle
    return cycle_times(drive(), j, count)[::stride]


@cache
def orbit(j: int) -> Array:
    """x and y of the sun of stage j at ``orbit_times``, (positions, 2), m."""
    result = bundled().at(drive().speed * orbit_times(j))
    return displacement(bundled(), result, f"stage_{j + 1}.sun")


@cache
def over_eccentricity(part: str, size: float) -> dict[str, float]:
    """K of stage 1 with one eccentricity (m), planet bearings as fitted; quasi-static."""
    value = (size,) if part == "planet" else size
    run = with_changes(
        {
            f"stages.stage_1.errors.{part}_eccentricity": value,
            "stages.stage_1.planet_bearing.radial": studies.fitted_bearing(),
        }
    )
    result = over_period(run, 0, studies.CYCLES)
    return {side: sharing(run, result, 0, side) for side in KINDS}


@cache
def over_time() -> Transient:
    """The bundled case in rated running."""
    return bundled().over_time(END, STEP, EVERY)


def late_shares(j: int, side: str) -> float:
    """K of eqs. 19 and 20 from the transient after start-up."""
    result = over_time()
    forces = gear_mesh_forces(result)[result.time >= SETTLED][:, bundled().columns(j, KINDS[side])]
    cycle = 2 * np.pi / gear_mesh_rate(drive(), j) / EVERY
    return mean_based(forces, cycle)
