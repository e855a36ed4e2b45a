"""Manufacturing errors as compression of gear meshes, m; positive is excess of material.

Every error is a displacement of something, and the compression of a gear mesh

    δ = N·(u_gear(C) − u_planet(C)) + e

says what it does: e is what δ would be if the body itself moved so. In planet axes (x radial, y
tangential), with N = cos β_b (n_x, n_y), φ planet angle, θ stage angle, Θ the carrier's absolute
angle, and the gears turning in the carrier by t_s θ, t_p θ, t_r θ (t_s = z_r/z_s, t_p = −z_r/z_p,
t_r = −1; parallel stage: t_s = −z_gear/z_pinion, t_p = 1):

    sun, ring eccentric      e = +E N·(cos ψ, sin ψ),  ψ = t θ + β − φ
    ring displaced in space  e = +A N·(cos ψ, sin ψ),  ψ = γ − Θ − φ
    planet eccentric         e = −E N·(cos ψ, sin ψ),  ψ = t_p θ + β,  on both gear meshes
    pin displaced (r, t)     e = −N·(r, t)             on both gear meshes
    all pins by E_c at β_c   e = −E_c N·(cos(β_c − φ), sin(β_c − φ)): the carrier's eccentricity
    helix slope f of a flank e = −f cos β_b z/b: f is missing towards +z, as in ``modifications``
    planet teeth thicker     e = +½ Δs cos α_t cos β_b on both gear meshes; Δs transverse, on the
                             reference circle; half of it is on each flank

with n_x cos ψ + n_y sin ψ = sin(ψ + δ), tan δ = n_x/n_y. So a sun mesh that drives the planet, n =
(sin α, cos α), has +E_s sin(ψ_s + α) and −E_p sin(ψ_p + α); its ring mesh, n = (−sin α, cos α), has
+E_r sin(ψ_r − α) and −E_p sin(ψ_p − α); the carrier −E_c sin(β_c − φ ± α).

Compared with that, Ren et al. 2021, eq. 16 has the wrong sign for the sun, for the planet at the
ring (so that a planet acts on its gear meshes with opposite signs, against its eq. 3) and for the
carrier at the sun, keeps of the carrier only the tangential part, and leaves out cos β_b, which its
eq. 3 has. With the same size and opposite signs at sun and ring the carrier's error is rolled away
by the planet. In Hu et al. 2023, eq. 1, where e is taken off the deflection, ring and ring offset
have the wrong sign, the planet at the sun and the carrier at the ring.

Deviations of teeth follow the gears' angles, not time: the harmonic part, ½ (f_a + f_b) sin(…)
after Tan et al. 2023, eq. 19, runs with the pair's path coordinate, 2π s/p_bt, so it has gear-mesh
frequency at any speed; pitch deviations belong to numbered teeth. Both flanks have them, as either
may carry. Halves of a double-helical stage are cut one by one: they share all errors but the random
pitch deviations.

Error cycle of a stage, after which all errors repeat, and its sampling.

The unit is the gear-mesh cycle: the carrier turning by one ring tooth, relative to the ring; sun,
planets and ring then all turn relative to the carrier by one tooth of their own. So an error of
the sun is back after z_s cycles, one of a planet after z_p, one of the ring after z_r, one that
stands in space (ring offset, gravity, a support of unequal stiffness) after |z_r / ν|, ν being the
absolute turns of the carrier in one turn relative to the ring (1 while the ring is held). A given
tooth of the sun meets a given tooth of a planet, and that a given tooth of the ring, again after

    C = lcm(z_s, z_p, z_r) gear-mesh cycles = C / z_r turns of the carrier.

Of a parallel stage the cycle is the gear turning by one tooth, C = lcm(z_pinion, z_gear). The error
cycle of a train is the least common multiple over its stages, which soon is millions of turns; it
is then sampled by whole gear-mesh cycles w_i = i g mod C with g prime to C and near C / 1.618…, so
that any z consecutive i meet each of the z phases of an error exactly once.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.gears.contact import GearMeshKind, GearMeshPath
from flexgear.gears.paths import PathKey, flank_name
from flexgear.gears.radii import gears_by_role
from flexgear.gears.tooth import transverse_angle
from flexgear.model.errors import FlexgearError

if TYPE_CHECKING:
    from flexgear.model.gear_mesh import GearErrors
    from flexgear.model.stage import Stage
    from flexgear.model.stage_view import StageView


SOURCES = ("sun", "planet", "ring", "housing")  # pinion and gear count as sun and planet
CANDIDATES = 64  # multipliers that are tried for an even spread
HORIZON = 10**8  # gear-mesh cycles; beyond, angles in double precision lose the phase


@dataclass(frozen=True)
class ErrorCycle:
    """gear_meshes: gear-mesh cycles until errors come back; per_turn: gear-mesh cycles in one turn
    of the stage angle θ (carrier relative to ring; wheel of a parallel stage)."""

    gear_meshes: int
    per_turn: int

    @property
    def turns(self) -> Fraction:
        """Turns of θ until errors come back."""
        return Fraction(self.gear_meshes, self.per_turn)


@dataclass(frozen=True)
class TrainTurn:
    """A stage in a train: its error cycle and its turns of θ per turn of the input coordinate."""

    cycle: ErrorCycle
    rate: Fraction


@dataclass(frozen=True)
class AngleSamples:
    """angles: (w · per_gear_mesh,) rad, rising, of θ or of the input coordinate; whole gear-mesh
    cycles one after the other, so that load sharing by cycle works on them. gear_mesh: (w,) number
    of each cycle; complete: whether they are the whole error cycle."""

    angles: Array
    gear_mesh: NDArray[np.int64]
    per_gear_mesh: int
    complete: bool


def error_cycle(
    stage: Stage,
    sources: Iterable[str] = SOURCES,
    carrier_turns: Fraction = Fraction(1),
) -> ErrorCycle:
    """Error cycle of a stage under errors of the given sources.

    carrier_turns: absolute turns of the carrier per turn of θ (1: ring held, 0: carrier held,
    which leaves what stands in space constant). FlexgearError for an unknown source.
    """
    sources = tuple(sources)
    unknown = [s for s in sources if s not in SOURCES]
    if unknown:
        raise FlexgearError(f"{unknown[0]!r} is no source of errors; take {', '.join(SOURCES)}")
    teeth = {role: gear.teeth for role, gear in gears_by_role(stage).items()}
    per_turn = teeth.get("ring", teeth["planet"])
    periods = [Fraction(teeth[s]) for s in sources if s in teeth]
    # gears of a parallel stage stand in the housing: nothing turns against it but they themselves
    if "housing" in sources and "ring" in teeth and carrier_turns != 0:
        periods.append(Fraction(per_turn) / abs(carrier_turns))
    return ErrorCycle(int(_common([Fraction(1), *periods])), per_turn)


def error_sources(errors: GearErrors, *, housing: bool = False) -> tuple[str, ...]:
    """Sources that these errors have; housing: whether anything else stands in space."""
    sources = {
        "sun": errors.sun_eccentricity or errors.sun_pitch,
        "planet": any(errors.planet_eccentricity) or errors.planet_pitch,
        "ring": errors.ring_eccentricity or errors.ring_pitch,
        "housing": housing or errors.ring_offset,
    }
    return tuple(s for s in SOURCES if sources[s])


def train_cycle(turns: Sequence[TrainTurn]) -> Fraction:
    """Turns of the input coordinate until the errors of all stages come back together."""
    moving = [t for t in turns if t.rate != 0]
    if not moving:
        raise FlexgearError("no stage of the train turns: there is no error cycle")
    return _common([t.cycle.turns / abs(t.rate) for t in moving])


def exact_rate(speed: float, lead: float) -> Fraction:
    """speed / lead as the fraction of tooth numbers that it is, denominators up to a million.

    Speeds that are given freely (two inputs) have no common period; theirs is then rounded to
    the nearest such fraction, which only matters beyond a million turns.
    """
    return Fraction(speed / lead).limit_denominator()


def sample_train_angles(
    turns: Sequence[TrainTurn], window: int, per_gear_mesh: int, most: int
) -> AngleSamples:
    """Input angles that sample the error cycle of a train.

    window: the stage whose gear-mesh cycles are sampled whole, ``per_gear_mesh`` positions each,
    ``most`` of them at most, spread over the error cycle of all stages.
    """
    sampled = turns[window]
    if sampled.rate == 0:
        raise FlexgearError("the stage whose gear-mesh cycles are to be sampled does not turn")
    step = 1 / (abs(sampled.rate) * sampled.cycle.per_turn)
    count = int(train_cycle(turns) / step)
    if count > HORIZON:
        count = max(HORIZON // sampled.cycle.gear_meshes, 1) * sampled.cycle.gear_meshes
    if per_gear_mesh < 1 or most < 1:
        raise FlexgearError("sampling needs at least one position and one gear-mesh cycle")
    complete = count <= most
    chosen = np.arange(count) if complete else spread(count, most)
    within = np.arange(per_gear_mesh) / per_gear_mesh
    angles = 2 * math.pi * float(step) * (chosen[:, None] + within).ravel()
    return AngleSamples(angles, chosen.astype(np.int64), per_gear_mesh, complete)


def spread(count: int, most: int) -> NDArray[np.int64]:
    """``most`` different numbers below ``count``, rising: i g mod count, g prime to count.

    g is the first beside count/φ whose largest gap is below three mean ones, or the best of many:
    what is prime to count next to the golden section may lie next to a simple fraction, too.
    """
    golden = round(count * (math.sqrt(5) - 1) / 2)
    near = (
        x for d in range(count) for x in dict.fromkeys((golden + d, golden - d))
        if x > 0 and math.gcd(x, count) == 1
    )  # fmt: skip
    steps = np.arange(most, dtype=np.int64)
    best, widest = steps, math.inf
    for g in islice(near, CANDIDATES):
        positions = np.sort(steps * g % count)
        gap = float(np.diff(np.append(positions, positions[0] + count)).max())
        if gap < widest:
            best, widest = positions, gap
        if gap * most < 3 * count:
            break
    return best


def _common(periods: Sequence[Fraction]) -> Fraction:
    """Least common multiple: lcm of numerators over gcd of denominators, in lowest terms."""
    return Fraction(
        math.lcm(*(p.numerator for p in periods)), math.gcd(*(p.denominator for p in periods))
    )


LEAST_STEPS = 4  # of a transient in a gear-mesh period


def longest_time_step(gear_mesh_frequency: float) -> float:
    """A quarter of a gear-mesh period, s; infinite at rest.

    With longer steps pairs come and go unseen between two of them, and stiffness that rises and
    falls once a period is not followed.
    """
    return 1.0 / (LEAST_STEPS * gear_mesh_frequency) if gear_mesh_frequency else math.inf


STAGE_ANGLE, CARRIER_ANGLE = 0, 1


@dataclass(frozen=True)
class PairErrors:
    """Errors of one gear mesh kind.

    harmonic_amplitude m, harmonic_phase rad, offset m, slope along the face m/m: (N,); gear_tooth
    (z,) and planet_tooth (N, z_p): pitch deviations by tooth number, m. Runout, Σ_h A sin(rate ·
    angle + phase): runout_amplitude m and runout_phase rad (N, H), runout_rate (H,) per rad,
    runout_angle (H,) 0 for the stage's θ, 1 for the carrier's absolute angle.
    """

    harmonic_amplitude: Array
    harmonic_phase: Array
    offset: Array
    slope: Array
    gear_tooth: Array
    planet_tooth: Array
    runout_amplitude: Array
    runout_rate: Array
    runout_phase: Array
    runout_angle: NDArray[np.int64]


def pitch_deviations(rng: np.random.Generator, shape: tuple[int, ...], deviation: float) -> Array:
    """Random single-tooth deviations of given standard deviation, mean zero on every gear."""
    values = rng.normal(0.0, 1.0, shape)  # drawn even for 0, so that one gear's draw is its own
    values -= values.mean(axis=-1, keepdims=True)
    return deviation * values


@dataclass(frozen=True)
class TurningVector:
    """Displacement ``size`` (N,) m towards rate · angle + place (N,) rad, in planet axes."""

    size: Array
    place: Array
    rate: float
    angle: int = STAGE_ANGLE


def stage_turns(stage: Stage) -> dict[str, float]:
    """Rotation of sun, planet and ring (pinion and gear) in the carrier for one radian of θ."""
    teeth = {role: gear.teeth for role, gear in gears_by_role(stage).items()}
    if stage.kind == "parallel":
        return {"sun": -teeth["planet"] / teeth["sun"], "planet": 1.0}
    z = teeth["ring"]
    return {"sun": z / teeth["sun"], "planet": -z / teeth["planet"], "ring": -1.0}


def stage_errors(
    view: StageView, paths: Mapping[PathKey, GearMeshPath]
) -> dict[PathKey, PairErrors]:
    """Errors of every gear mesh in ``paths``."""
    stage, e = view.stage, view.errors
    pitch = _pitch_by_path(stage, e, {side for _, side in paths})
    return {key: _errors_of(stage, e, path, pitch[key]) for key, path in paths.items()}


def errors_closing(drive: PairErrors, coast: PairErrors, half_face: float) -> Array:
    """The most (N,) m that errors close of the backlash of a gear mesh, from those of both flanks:
    what turns gears or moves them along the teeth they touch closes one flank and opens the other.
    """
    phasors = [e.runout_amplitude * np.exp(1j * e.runout_phase) for e in (drive, coast)]
    teeth = [e.gear_tooth.max() + e.planet_tooth.max(axis=1) for e in (drive, coast)]
    return np.asarray(
        drive.offset
        + coast.offset
        + np.abs(phasors[0] + phasors[1]).sum(axis=1)
        + np.abs(drive.harmonic_amplitude)
        + np.abs(coast.harmonic_amplitude)
        + np.abs(drive.slope + coast.slope) * half_face
        + teeth[0]
        + teeth[1]
    )


def _errors_of(
    stage: Stage, e: GearErrors, path: GearMeshPath, pitch: tuple[Array, Array]
) -> PairErrors:
    """Errors of teeth, pins, gear bodies, carrier and ring on one kind of gear mesh."""
    role, n = path.kind.gear, len(path.s0)
    turning = [(v, 1.0) for v in _gear_vectors(stage, e, role)]
    turning += [(v, -1.0) for v in _planet_vectors(stage, e)]
    amplitude, phase = np.zeros((n, len(turning))), np.zeros((n, len(turning)))
    for h, (vector, sign) in enumerate(turning):
        amplitude[:, h], phase[:, h] = projected(path, vector, sign)
    size, place = _gear_mesh_harmonic(e, role)
    return PairErrors(
        harmonic_amplitude=np.full(n, size),
        harmonic_phase=np.full(n, place),
        offset=_pins(stage, e, path) + _carrier(stage, e, path) + _thickness(stage, e, path),
        slope=_helix_slopes(stage, e, path, role),
        gear_tooth=pitch[0],
        planet_tooth=pitch[1],
        runout_amplitude=amplitude,
        runout_phase=phase,
        runout_rate=np.array([v.rate for v, _ in turning], dtype=float),
        runout_angle=np.array([v.angle for v, _ in turning], dtype=np.int64),
    )


def in_plane_normal(path: GearMeshPath) -> Array:
    """cos β_b (n_x, n_y): what of N lies in the plane of rotation, in planet axes."""
    return path.cos_base_helix * path.normal_xy


def projected(path: GearMeshPath, vector: TurningVector, sign: float) -> tuple[Array, Array]:
    """Amplitude ≥ 0 (m) and phase (rad) of sign · N·vector as A sin(rate · angle + phase), (N,)."""
    nx, ny = in_plane_normal(path)
    phase = vector.place + math.atan2(nx, ny) + (0.0 if sign > 0 else math.pi)
    return math.hypot(nx, ny) * vector.size, phase


def _gear_vectors(stage: Stage, e: GearErrors, role: str) -> list[TurningVector]:
    """Where sun or ring lies off its place, as every planet sees it."""
    phi = np.asarray(stage.planet_angles, dtype=float)
    ones = np.ones(len(phi))
    size, phase = getattr(e, f"{role}_eccentricity"), getattr(e, f"{role}_eccentricity_phase")
    vectors = []
    if size:
        vectors.append(TurningVector(size * ones, phase - phi, stage_turns(stage)[role]))
    if role == "ring" and e.ring_offset:
        place = e.ring_offset_phase - phi
        vectors.append(TurningVector(e.ring_offset * ones, place, -1.0, CARRIER_ANGLE))
    return vectors


def _planet_vectors(stage: Stage, e: GearErrors) -> list[TurningVector]:
    size = np.array(e.of_planets("planet_eccentricity", stage.planets))
    if not size.any():
        return []
    place = np.array(e.of_planets("planet_eccentricity_phase", stage.planets))
    return [TurningVector(size, place, stage_turns(stage)["planet"])]


def _carrier(stage: Stage, e: GearErrors, path: GearMeshPath) -> Array:
    """All pins displaced by the same vector of the carrier's frame, (N,) m."""
    phi = np.asarray(stage.planet_angles, dtype=float)
    towards = e.carrier_eccentricity_phase - phi
    nx, ny = in_plane_normal(path)
    return -e.carrier_eccentricity * (nx * np.cos(towards) + ny * np.sin(towards))


def _thickness(stage: Stage, e: GearErrors, path: GearMeshPath) -> Array:
    """Half the excess of thickness, along the normal, (N,) m."""
    excess = np.array(e.of_planets("planet_thickness", stage.planets))
    return 0.5 * math.cos(transverse_angle(stage)) * path.cos_base_helix * excess


def _pins(stage: Stage, e: GearErrors, path: GearMeshPath) -> Array:
    """Pins displaced one by one, (N,) m."""
    pins = [e.of_planets(name, stage.planets) for name in ("pin_radial", "pin_tangential")]
    return -in_plane_normal(path) @ np.array(pins)


def _helix_slopes(stage: Stage, e: GearErrors, path: GearMeshPath, role: str) -> Array:
    """Slope (N,) along the face of what both flanks have in excess, m/m; the left half of a
    double-helical stage is the mirror image of the right one."""
    flank = flank_name("planet", path)
    missing = np.array(e.of_planets(f"planet_{flank}_helix_slope", stage.planets))
    if path.carries:
        missing = missing + getattr(e, f"{role}_helix_slope")
    outward = -1.0 if path.side == "left" else 1.0
    return -outward * path.cos_base_helix * missing / (2.0 * path.half_face)


def _gear_mesh_harmonic(e: GearErrors, role: str) -> tuple[float, float]:
    """Amplitude (m) and phase (rad) at gear-mesh frequency: ½ (f'_1 + f'_2) at the tooth errors'
    phase and the gear mesh's own error at its phase, added as phasors."""
    teeth, place = 0.5 * (getattr(e, f"{role}_tooth") + e.planet_tooth), getattr(e, f"{role}_phase")
    amplitude, phase = getattr(e, f"{role}_gear_mesh"), getattr(e, f"{role}_gear_mesh_phase")
    if not amplitude:
        return teeth, place
    return cmath.polar(cmath.rect(teeth, place) + cmath.rect(amplitude, phase))


def _pitch_by_path(
    stage: Stage, e: GearErrors, sides: set[str]
) -> dict[PathKey, tuple[Array, Array]]:
    """Pitch deviations of gear (z,) and planets (N, z_p) by path; every flank has its own.

    A planet's flank that meets the ring when the carrier drives meets the sun when it is driven.
    Halves of a double-helical stage have draws of their own.
    """
    gears = gears_by_role(stage)
    pitch_errors = {}
    for side in sorted(sides):
        seed = e.seed if not side else [e.seed, ("left", "right").index(side)]
        rng = np.random.default_rng(seed)
        drawn = {
            role: pitch_deviations(rng, (2, gears[role].teeth), getattr(e, f"{role}_pitch"))
            for role in ("ring", "sun")
            if role in gears
        }
        planet = pitch_deviations(rng, (2, stage.planets, gears["planet"].teeth), e.planet_pitch)
        for role, gear in drawn.items():
            mate = planet[::-1] if role == "sun" else planet
            for k, kind in enumerate(GearMeshKind.both(role)):
                pitch_errors[kind, side] = gear[k], mate[k]
    return pitch_errors
