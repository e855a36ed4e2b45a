"""Manufacturing errors as compression e of gear meshes, m; positive is excess of material.

An error is a displacement of a flank, and adds to the compression of a gear mesh at contact point C

    δ = N·(u_gear(C) − u_planet(C)) + e

as the same displacement of the body would. In planet axes (x radial, y tangential), with
N = cos β_b (n_x, n_y), φ planet angle, θ stage angle, Θ absolute angle of the carrier, and angles
t_s θ, t_p θ, t_r θ of the gears relative to the carrier (t_s = z_r/z_s, t_p = −z_r/z_p, t_r = −1;
parallel stage: t_s = −z_gear/z_pinion, t_p = 1):

    sun, ring eccentric      e = +E N·(cos ψ, sin ψ),  ψ = t θ + β − φ
    ring displaced in space  e = +A N·(cos ψ, sin ψ),  ψ = γ − Θ − φ
    planet eccentric         e = −E N·(cos ψ, sin ψ),  ψ = t_p θ + β,  on both gear meshes
    pin displaced (r, t)     e = −N·(r, t)             on both gear meshes
    all pins by E_c at β_c   e = −E_c N·(cos(β_c − φ), sin(β_c − φ)): the carrier's eccentricity
    helix slope f of a flank e = −f cos β_b z/b: f is missing towards +z, as in ``modifications``
    thicker planet teeth     e = +½ Δs cos α_t cos β_b on both gear meshes; Δs transverse, on the
                             reference circle, half on each flank

with n_x cos ψ + n_y sin ψ = sin(ψ + δ), tan δ = n_x/n_y. So the gear mesh of a sun that drives the
planet, n = (sin α, cos α), has +E_s sin(ψ_s + α) and −E_p sin(ψ_p + α); that of the ring,
n = (−sin α, cos α), has +E_r sin(ψ_r − α) and −E_p sin(ψ_p − α); the carrier has
−E_c sin(β_c − φ ± α) in both.

Ren et al. 2021, eq. 16 has the wrong sign for the sun, for the planet at the ring (a planet then
acts on its two gear meshes with opposite signs, against eq. 3 there) and for the carrier at the
sun; it has only the tangential part of the carrier's error, and lacks cos β_b, which eq. 3 has.
With equal size and opposite signs at sun and ring, rotation of the planet would cancel the
carrier's error. In Hu et al. 2023, eq. 1, where e is subtracted from the deflection, the signs of
ring, ring offset, planet at the sun and carrier at the ring are wrong.

Deviations of teeth are functions of the gears' angles, not of time: the first harmonic,
½ (f_a + f_b) sin(…) after Tan et al. 2023, eq. 19, has the phase 2π s/p_bt of the pair's path
coordinate, so gear-mesh frequency at any speed; pitch deviations belong to numbered teeth. Drive
and coast flanks have them. Both halves of a double-helical stage have the same errors except the
random pitch deviations.
"""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array, Complex
from flexgear.gears.contact import GearMeshKind, GearMeshPath
from flexgear.gears.paths import PathKey, flank_name
from flexgear.gears.radii import gears_by_role
from flexgear.gears.tooth import transverse_angle
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView

STAGE_ANGLE, CARRIER_ANGLE = 0, 1


@dataclass(frozen=True)
class PairErrors:
    """Errors of one kind of gear mesh at N planets.

    harmonic_amplitude m, harmonic_phase rad: (N, L), Σ A_l sin(2π l s/p_b + φ_l) with l = 1 … L;
    offset m, slope along the face m/m: (N,); gear_tooth
    (z,) and planet_tooth (N, z_p): pitch deviations by tooth number, m. Runout is
    Σ_h A sin(rate · angle + phase): runout_amplitude m and runout_phase rad (N, H), runout_rate
    (H,) rad/rad, runout_angle (H,) ``STAGE_ANGLE`` θ or ``CARRIER_ANGLE`` Θ.
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
    """Random single pitch deviations (…, teeth) of a standard deviation, with mean zero on each
    gear."""
    values = rng.normal(0.0, 1.0, shape)  # also if 0: other gears keep their random numbers
    values -= values.mean(axis=-1, keepdims=True)
    return deviation * values


@dataclass(frozen=True)
class TurningVector:
    """Vector displacement e^{i rate angle} in the axes of N planets. displacement: (N,) m, radial +
    i tangential, at angle zero; angle: ``STAGE_ANGLE`` or ``CARRIER_ANGLE``."""

    displacement: Complex
    rate: float
    angle: int = STAGE_ANGLE


def stage_turns(stage: Stage) -> dict[str, float]:
    """Rotation t of sun, planet and ring (pinion, gear) relative to the carrier per radian of θ."""
    teeth = {role: gear.teeth for role, gear in gears_by_role(stage).items()}
    if stage.kind == "parallel":
        return {"sun": -teeth["planet"] / teeth["sun"], "planet": 1.0}
    z = teeth["ring"]
    return {"sun": z / teeth["sun"], "planet": -z / teeth["planet"], "ring": -1.0}


def stage_errors(
    view: StageView, paths: Mapping[PathKey, GearMeshPath]
) -> dict[PathKey, PairErrors]:
    """Errors of every gear mesh in ``paths``."""
    stage, e = view.stage, view.stage.errors
    pitch = _pitch_by_path(stage, e, {side for _, side in paths})
    errors = {key: _errors_of(stage, e, path, pitch[key]) for key, path in paths.items()}
    if e.harmonic_on_coast == "opposite":
        drives = {(k.gear, side): (k, side) for (k, side), path in paths.items() if path.carries}
        for key in [key for key, path in paths.items() if not path.carries]:
            drive = drives[key[0].gear, key[1]]
            errors[key] = _opposite(errors[key], paths[key], errors[drive], paths[drive])
    return errors


def _opposite(
    coast: PairErrors, path: GearMeshPath, drive: PairErrors, drive_path: GearMeshPath
) -> PairErrors:
    """Errors of coast flanks with harmonics opposite to those of the drive flanks. −A sin(π − x)
    where the drive flanks have A sin x, x = 2π l s/p_b + φ: pairs move in opposite directions along
    the two paths."""
    starts = 2.0 * math.pi * (path.s0 + drive_path.s0)[:, None] / path.base_pitch
    orders = np.arange(1, drive.harmonic_phase.shape[1] + 1)
    phase = math.pi - drive.harmonic_phase - orders * starts
    return replace(coast, harmonic_amplitude=-drive.harmonic_amplitude, harmonic_phase=phase)


def errors_closing(drive: PairErrors, coast: PairErrors, half_face: float) -> Array:
    """Largest reduction (N,) of the backlash of a gear mesh by errors, m. The sum over both flanks:
    an error that acts like a rotation of a gear has opposite signs on them and leaves the backlash
    as it is."""
    phasors = [e.runout_amplitude * np.exp(1j * e.runout_phase) for e in (drive, coast)]
    teeth = [e.gear_tooth.max() + e.planet_tooth.max(axis=1) for e in (drive, coast)]
    return np.asarray(
        drive.offset
        + coast.offset
        + np.abs(phasors[0] + phasors[1]).sum(axis=1)
        + np.abs(drive.harmonic_amplitude + coast.harmonic_amplitude).sum(axis=1)
        + np.abs(drive.slope + coast.slope) * half_face
        + teeth[0]
        + teeth[1]
    )


def _errors_of(
    stage: Stage, e: GearErrors, path: GearMeshPath, pitch: tuple[Array, Array]
) -> PairErrors:
    """Errors of teeth, pins, gear bodies, carrier and ring in one kind of gear mesh. pitch: pitch
    deviations of gear (z,) and planets (N, z_p), m. With N = n_x + i n_y in the plane of rotation,
    N·v of a vector v e^{iψ} is Re(N̄ v e^{iψ}) = |N̄ v| sin(ψ + arg i N̄ v)."""
    role, n = path.kind.gear, len(path.s0)
    normal = path.cos_base_helix * complex(*path.normal_xy).conjugate()
    turning = _turning(stage, e, role)
    waves = normal * np.array([v.displacement for v in turning], dtype=complex).reshape(-1, n).T
    harmonics = _gear_mesh_harmonics(e, role)
    return PairErrors(
        harmonic_amplitude=np.tile(np.abs(harmonics), (n, 1)),
        harmonic_phase=np.tile(np.angle(harmonics), (n, 1)),
        offset=_thickness(stage, e, path) - (normal * _pins(stage, e)).real,
        slope=_helix_slopes(stage, e, path, role),
        gear_tooth=pitch[0],
        planet_tooth=pitch[1],
        runout_amplitude=np.abs(waves),
        runout_phase=np.angle(1j * waves),
        runout_rate=np.array([v.rate for v in turning], dtype=float),
        runout_angle=np.array([v.angle for v in turning], dtype=np.int64),
    )


def _turning(stage: Stage, e: GearErrors, role: str) -> list[TurningVector]:
    """Displacements of the gear ``role`` ("sun" or "ring") in the axes of every planet, and minus
    those of the planets."""
    turns, vectors = stage_turns(stage), []
    to_planet_axes = np.exp(-1j * np.asarray(stage.planet_angles, dtype=float))
    size, phase = getattr(e, f"{role}_eccentricity"), getattr(e, f"{role}_eccentricity_phase")
    if size:
        vectors.append(TurningVector(cmath.rect(size, phase) * to_planet_axes, turns[role]))
    if role == "ring" and e.ring_offset:
        offset = cmath.rect(e.ring_offset, e.ring_offset_phase)
        vectors.append(TurningVector(offset * to_planet_axes, -1.0, CARRIER_ANGLE))
    sizes = np.array(e.of_planets("planet_eccentricity", stage.planets))
    if sizes.any():
        phases = np.array(e.of_planets("planet_eccentricity_phase", stage.planets))
        vectors.append(TurningVector(-sizes * np.exp(1j * phases), turns["planet"]))
    return vectors


def _pins(stage: Stage, e: GearErrors) -> Complex:
    """Displacement (N,) of the pins, radial + i tangential, m: position error of each pin plus the
    carrier's eccentricity."""
    radial, tangential = (
        np.array(e.of_planets(name, stage.planets)) for name in ("pin_radial", "pin_tangential")
    )
    phase = e.carrier_eccentricity_phase - np.asarray(stage.planet_angles, dtype=float)
    return np.asarray(radial + 1j * tangential + e.carrier_eccentricity * np.exp(1j * phase))


def _thickness(stage: Stage, e: GearErrors, path: GearMeshPath) -> Array:
    """Half the excess thickness (N,) of planet teeth, along the 3D normal, m."""
    excess = np.array(e.of_planets("planet_thickness", stage.planets))
    return 0.5 * math.cos(transverse_angle(stage)) * path.cos_base_helix * excess


def _helix_slopes(stage: Stage, e: GearErrors, path: GearMeshPath, role: str) -> Array:
    """Slope (N,) along the face of the excess of material on both flanks, m/m; the left half of a
    double-helical stage is the mirror image of the right half."""
    flank = flank_name("planet", path)
    missing = np.array(e.of_planets(f"planet_{flank}_helix_slope", stage.planets))
    if path.carries:
        missing = missing + getattr(e, f"{role}_helix_slope")
    outward = -1.0 if path.side == "left" else 1.0
    return -outward * path.cos_base_helix * missing / (2.0 * path.half_face)


def _gear_mesh_harmonics(e: GearErrors, role: str) -> Complex:
    """Complex amplitudes A_l e^{iφ_l} (L,), m, of a gear mesh's error at l = 1 … L times its
    frequency, from the case; the first has in addition the mean deviation of both gears' teeth."""
    stated, phases = getattr(e, f"{role}_gear_mesh"), getattr(e, f"{role}_gear_mesh_phase")
    teeth = 0.5 * (getattr(e, f"{role}_tooth") + e.planet_tooth)
    harmonics = np.zeros(max(len(stated), 1), dtype=complex)
    harmonics[0] = cmath.rect(teeth, getattr(e, f"{role}_phase"))
    for order, size in enumerate(stated):
        harmonics[order] += cmath.rect(size, phases[order] if order < len(phases) else 0.0)
    return harmonics


def _pitch_by_path(
    stage: Stage, e: GearErrors, sides: set[str]
) -> dict[PathKey, tuple[Array, Array]]:
    """Pitch deviations of gear (z,) and planets (N, z_p) by path, m, independent on each flank. The
    planet's drive flank at the ring is its coast flank at the sun. Halves of a double-helical stage
    have independent random numbers."""
    gears = gears_by_role(stage)
    pitch_errors = {}
    for side in sorted(sides):
        seed = e.seed if not side else [e.seed, ("left", "right").index(side)]
        rng = np.random.default_rng(seed)
        deviations = {
            role: pitch_deviations(rng, (2, gears[role].teeth), getattr(e, f"{role}_pitch"))
            for role in ("ring", "sun")
            if role in gears
        }
        planet = pitch_deviations(rng, (2, stage.planets, gears["planet"].teeth), e.planet_pitch)
        for role, gear in deviations.items():
            planet_flanks = planet[::-1] if role == "sun" else planet
            for k, kind in enumerate(GearMeshKind.both(role)):
                pitch_errors[kind, side] = gear[k], planet_flanks[k]
    return pitch_errors
