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
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array, Complex
from flexgear.gears.contact import GearMeshKind, GearMeshPath
from flexgear.gears.paths import PathKey, flank_name
from flexgear.gears.radii import gears_by_role
from flexgear.gears.tooth import transverse_angle

if TYPE_CHECKING:
    from flexgear.model.gear_mesh import GearErrors
    from flexgear.model.stage import Stage
    from flexgear.model.stage_view import StageView


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
    """Displacement (N,) m at the angle zero, radial + i tangential in planet axes, which turns by
    rate · angle."""

    displacement: Complex
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
    """With the harmonic −A sin(π − x) where that of the drive flank is A sin x, x = 2π s/p_b + φ:
    pairs go the other way along the coast flanks' path."""
    starts = 2.0 * math.pi * (path.s0 + drive_path.s0) / path.base_pitch
    phase = math.pi - drive.harmonic_phase - starts
    return replace(coast, harmonic_amplitude=-drive.harmonic_amplitude, harmonic_phase=phase)


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
        + np.abs(drive.harmonic_amplitude + coast.harmonic_amplitude)
        + np.abs(drive.slope + coast.slope) * half_face
        + teeth[0]
        + teeth[1]
    )


def _errors_of(
    stage: Stage, e: GearErrors, path: GearMeshPath, pitch: tuple[Array, Array]
) -> PairErrors:
    """Errors of teeth, pins, gear bodies, carrier and ring on one kind of gear mesh.

    With N = n_x + i n_y in the plane of rotation, N·v of a vector v e^{iψ} is Re(N̄ v e^{iψ}), which
    is |N̄ v| sin(ψ + arg i N̄ v).
    """
    role, n = path.kind.gear, len(path.s0)
    along = path.cos_base_helix * complex(*path.normal_xy).conjugate()
    turning = _turning(stage, e, role)
    waves = along * np.array([v.displacement for v in turning], dtype=complex).reshape(-1, n).T
    size, place = _gear_mesh_harmonic(e, role)
    return PairErrors(
        harmonic_amplitude=np.full(n, size),
        harmonic_phase=np.full(n, place),
        offset=_thickness(stage, e, path) - (along * _pins(stage, e)).real,
        slope=_helix_slopes(stage, e, path, role),
        gear_tooth=pitch[0],
        planet_tooth=pitch[1],
        runout_amplitude=np.abs(waves),
        runout_phase=np.angle(1j * waves),
        runout_rate=np.array([v.rate for v in turning], dtype=float),
        runout_angle=np.array([v.angle for v in turning], dtype=np.int64),
    )


def _turning(stage: Stage, e: GearErrors, role: str) -> list[TurningVector]:
    """Displacements of sun or ring in the axes of every planet, and those of the planet relative to
    them."""
    turns, vectors = stage_turns(stage), []
    towards = np.exp(-1j * np.asarray(stage.planet_angles, dtype=float))
    size, phase = getattr(e, f"{role}_eccentricity"), getattr(e, f"{role}_eccentricity_phase")
    if size:
        vectors.append(TurningVector(cmath.rect(size, phase) * towards, turns[role]))
    if role == "ring" and e.ring_offset:
        offset = cmath.rect(e.ring_offset, e.ring_offset_phase)
        vectors.append(TurningVector(offset * towards, -1.0, CARRIER_ANGLE))
    sizes = np.array(e.of_planets("planet_eccentricity", stage.planets))
    if sizes.any():
        phases = np.array(e.of_planets("planet_eccentricity_phase", stage.planets))
        vectors.append(TurningVector(-sizes * np.exp(1j * phases), turns["planet"]))
    return vectors


def _pins(stage: Stage, e: GearErrors) -> Complex:
    """Displacement of every pin, its own and that of all by the carrier's eccentricity, radial + i
    tangential, (N,) m."""
    radial, tangential = (
        np.array(e.of_planets(name, stage.planets)) for name in ("pin_radial", "pin_tangential")
    )
    towards = e.carrier_eccentricity_phase - np.asarray(stage.planet_angles, dtype=float)
    return np.asarray(radial + 1j * tangential + e.carrier_eccentricity * np.exp(1j * towards))


def _thickness(stage: Stage, e: GearErrors, path: GearMeshPath) -> Array:
    """Half the excess of thickness, along the normal, (N,) m."""
    excess = np.array(e.of_planets("planet_thickness", stage.planets))
    return 0.5 * math.cos(transverse_angle(stage)) * path.cos_base_helix * excess


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
