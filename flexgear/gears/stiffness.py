"""Stiffness of tooth pairs and gear meshes: laws along the path of contact, contact lines, waves.

k'(ξ) is the stiffness per unit face width along the 3D line of action, ξ ∈ [0, 1] the position on
the path of contact. A pair with the contact line s(z) = s + t z has stiffness and centre

    k(s) = ∫ k'(ξ(s + t z)) dz,   z_c(s) = ∫ k' z dz / k,

over the part of the face on the path. Both follow exactly from the running integrals of k' and k' ξ
on a fine grid; a spur pair is the limit t → 0.

The stiffness of a whole gear mesh is a periodic wave over one base pitch, x = (s − s_lo)/p_b; pairs
are on the path for s − s_lo ∈ [0, ε p_b] modulo p_b. With k̄ the mean of the wave and ε_α, ε_β
transverse contact and overlap ratio:

    constant      k̄
    rectangular   k̄ + Δ [n(x) − ε_α],  n(x) pairs on the path, Δ = k̄/ε_α
    fourier       k̄ + Δ ε_α Σ_{h=1…H} c_h cos 2πh (x − ε_α/2),
                  c_h = 2 sin(πhε_α)/(πhε_α) · sin(πhε_β)/(πhε_β)

A case may give the step Δ, or the amplitudes and phases of all terms (``harmonic_wave``). The wave
"fourier" is n(x) averaged over the face of a helical gear mesh, proportional to the total length of
its contact lines; for ε_β = 0 it is the series of the rectangular wave,
n(x) = ε + Σ 2 sin(πhε)/(πh) cos 2πh(x − ε/2). Hu et al. 2023, eq. 4 is the same for ε_β = 0 with
k_single = k̄/ε_α = k_max − k_min and the origin in the middle of the double-contact zone
(1 < ε < 2), which gives the sign (−1)^h; the print has (−1)^{-1}, and the carrier's frequency in
place of the gear-mesh frequency.

Mean after ISO 6336-1:2006, 9.3.2: c_γ = c' (0.75 ε_α + 0.25) per face width.

Models "per_pair", "face_load" and "lumped" have the shape of their law, scaled by a mean that the
case may give. Waves (constant, rectangular, fourier) have pairs of constant stiffness per length of
contact line, k' = k̄/(ε_α b), with the mean k̄ of the case, else c_γ b of ISO 6336-1.

The compliance of FE bodies is not counted twice: k' becomes k'/(1 − σ), where σ(ξ) is the share of
the compliance (after Weber and Banaschek) that the FE mesh includes. With the tie "flank" σ is the
tooth and its foundation; with "root" it is the foundation (the rim below the tooth), and only for
the law "weber-banaschek": ISO's c' and tables are not changed.

``force`` is the normal force, N, of one gear mesh of "sun" or "ring" at rated load. Only the law of
Weber and Banaschek depends on it, by the logarithm of Hertz's contact.
"""

import math
from collections.abc import Callable

import numpy as np
import scipy  # loads a subpackage at its first use

from flexgear.arrays import Array
from flexgear.gears.geometry import PER_PAIR_MODELS, StageGeometry
from flexgear.gears.radii import gears_by_role
from flexgear.gears.weber_banaschek import PairCompliance, Side, pair_compliance
from flexgear.model.stage_view import StageView

Law = Callable[[Array], Array]  # k'(ξ), N/m²
STEEL_YOUNG = 206e9  # Pa; c' of ISO 6336-1 is that of steel


def iso_theoretical_stiffness(
    virtual_teeth: tuple[float, float], shifts: tuple[float, float]
) -> float:
    """Theoretical single stiffness c'_th = 1/q' per unit face width, N/m²; ISO 6336-1:2006, 9.3.
    virtual_teeth: z_n, ∞ of a ring; shifts: profile shifts; planet or pinion first."""
    z1, inverse2, (x1, x2) = virtual_teeth[0], 1.0 / virtual_teeth[1], shifts
    q = (
        0.04723 + 0.15551 / z1 + 0.25791 * inverse2 - 0.00635 * x1 - 0.11654 * x1 / z1
        - 0.00193 * x2 - 0.24188 * x2 * inverse2 + 0.00529 * x1**2 + 0.00182 * x2**2
    )  # fmt: skip
    return 1e9 / q  # N/(mm µm) -> N/m²


def iso_transverse_stiffness(view: StageView, role: str, theoretical: float) -> float:
    """Single stiffness c' of a gear mesh of "sun" or "ring" along the transverse line of action,
    N/m²; ISO 6336-1:2006, 9.3.

        c' = c'_th C_M C_R C_B cosβ E/E_steel,   C_M = 0.8,
        C_B = [1 + 0.5 (1.2 − h_fP/m)] [1 − 0.02 (20° − α_n)],   h_fP, C_R: mean of both gears
    """
    stage, gears = view.stage, gears_by_role(view.stage)
    dedendum = 0.5 * (gears["planet"].dedendum + gears[role].dedendum)
    body = 0.5 * (gears["planet"].body_factor + gears[role].body_factor)
    basic = (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20 - math.degrees(stage.pressure_angle)))
    young = view.material.young_modulus
    return 0.8 * theoretical * body * basic * math.cos(stage.helix_angle) * young / STEEL_YOUNG


def parabola(peak: float, end_ratio: float) -> Law:
    """Law k'(ξ) = peak [1 − (1 − end_ratio)(2ξ − 1)²]."""
    return lambda xi: peak * (1 - (1 - end_ratio) * (2 * xi - 1) ** 2)


def table_law(places: Array, values: Array) -> Law:
    """Law k'(ξ) by linear interpolation of a table: places ξ, values N/m²."""
    return lambda xi: np.interp(xi, places, values)


def pair_stiffness(
    law: Law, s: Array, s_lo: float, s_hi: float, slope: float, half_face: float, grid: int = 2001
) -> tuple[Array, Array]:
    """Stiffness k, N/m, and its centre z_c, m, of pairs at path coordinates s (n,) at mid-face."""
    length = s_hi - s_lo
    if abs(slope) * half_face < 1e-9 * length:  # spur: the whole face has one path coordinate
        xi = (s - s_lo) / length
        inside = (xi >= 0) & (xi <= 1)
        return np.where(inside, 2 * half_face * law(np.clip(xi, 0, 1)), 0.0), np.zeros_like(s)
    places = np.linspace(0.0, 1.0, grid)
    dense = law(places)
    x, value, rise = places[:-1], dense[:-1], np.diff(dense) / np.diff(places)
    low = np.clip((s - abs(slope) * half_face - s_lo) / length, 0, 1)
    high = np.clip((s + abs(slope) * half_face - s_lo) / length, 0, 1)
    # ∫ k' and ∫ k' ξ of a piecewise linear k', exactly
    first, second = (
        scipy.interpolate.PPoly(coefficients, places).antiderivative()
        for coefficients in ([rise, value], [rise, value + rise * x, value * x])
    )
    area, moment = first(high) - first(low), second(high) - second(low)
    # z = (s_lo + ξ L − s)/t and dz = L dξ/|t|
    k = np.maximum(area, 0.0) * length / abs(slope)
    centre = np.divide(moment, area, out=0.5 * (low + high), where=area > 1e-12 * first(1.0))
    z = np.clip((s_lo + centre * length - s) / slope, -half_face, half_face)
    return k, np.where(k > 0, z, 0.0)


SAMPLES = 1024


def stiffness_wave(
    model: str,
    mean: float,
    contact_ratio: float,
    overlap_ratio: float = 0.0,
    harmonics: int = 5,
    samples: int = SAMPLES,
    depth: float = 1.0,
) -> Array:
    """Stiffness (samples,) at x = j/samples, N/m, of the wave ``model`` with the mean ``mean``.

    depth: Δ ε_α/k̄ for the step Δ of one more pair. Samples of the rectangular wave are means over
    cells of width 1/samples about x, so that the mean is exact at any contact ratio. Raises
    ValueError for a model that is no wave.
    """
    x = np.arange(samples) / samples
    if model == "constant":
        return np.full(samples, mean)
    if model == "rectangular":
        half = 0.5 / samples
        pairs = pairs_on_path(x - half, x + half, contact_ratio)
        return mean * (1 + depth * (pairs / contact_ratio - 1))
    if model == "fourier":
        # higher orders would be aliased by the samples
        orders = np.arange(1.0, min(harmonics, (samples - 1) // 2) + 1)
        waves = np.cos(2 * np.pi * np.outer(x - contact_ratio / 2, orders))
        coefficients = wave_coefficients(contact_ratio, overlap_ratio, orders)
        return mean * (1 + depth * (waves @ coefficients))
    raise ValueError(f"{model!r} is no stiffness wave")


def harmonic_wave(mean: float, shares: Array, phases: Array, turns: Array) -> Array:
    """Stiffness (n,) k̄ [1 + Σ_h a_h cos(2π h t + φ_h)], N/m. turns: t (n,), position in base
    pitches; shares: a_h (H,); phases: φ_h (H,), rad."""
    orders = np.arange(1.0, len(shares) + 1)
    return mean * (1 + np.cos(2 * np.pi * np.outer(turns, orders) + phases) @ shares)


def pairs_on_path(low: Array, high: Array, contact_ratio: float) -> Array:
    """Number of pairs on the path, averaged over x from ``low`` to ``high``."""
    first = math.floor(-float(np.max(high))) - 1
    last = math.ceil(contact_ratio - float(np.min(low))) + 1
    k = np.arange(first, last + 1)[:, None]
    inside = np.minimum(high + k, contact_ratio) - np.maximum(low + k, 0.0)
    return np.clip(inside, 0.0, None).sum(axis=0) / (high - low)


def wave_coefficients(contact_ratio: float, overlap_ratio: float, orders: Array) -> Array:
    """Coefficients c_h of orders h, relative to the mean; np.sinc(x) is sin(πx)/(πx)."""
    return 2 * np.sinc(orders * contact_ratio) * np.sinc(orders * overlap_ratio)


def iso_mean_stiffness(peak: float, contact_ratio: float, face_width: float) -> float:
    """Mean stiffness c_γ b along the 3D normal, N/m; peak: c' per face width along it, N/m². ISO
    gives the factor for ε_α ≥ 1.2; below that c_γ may be up to a tenth smaller."""
    return peak * (0.75 * contact_ratio + 0.25) * face_width


def iso_numbers(view: StageView, role: str) -> tuple[tuple[int, int], tuple[float, float]]:
    """Teeth and profile shifts of a gear mesh, in the order of ISO's indices 1 and 2. Gear 1 is the
    planet with a ring, or the smaller of two external gears; the shift of a ring is not used."""
    gears = gears_by_role(view.stage)
    first, second = gears["planet"], gears[role]
    if role != "ring" and second.teeth < first.teeth:
        first, second = second, first
    shift = 0.0 if role == "ring" else second.profile_shift
    return (first.teeth, second.teeth), (first.profile_shift, shift)


def iso_peak(view: StageView, role: str) -> float:
    """Peak stiffness c' of one pair of "sun" or "ring", per face width along the 3D normal, N/m².
    ISO's c' holds along the transverse line of action; along the 3D line it is larger by 1/cos²β_b.
    z_n = z/cos³β, ∞ of a ring."""
    stage, cube = view.stage, math.cos(view.stage.helix_angle) ** 3
    (first, second), shifts = iso_numbers(view, role)
    virtual = first / cube, math.inf if role == "ring" else second / cube
    transverse = iso_transverse_stiffness(view, role, iso_theoretical_stiffness(virtual, shifts))
    sin_bb = math.sin(stage.helix_angle) * math.cos(stage.pressure_angle)
    return transverse / (1 - sin_bb**2)


def line_load(view: StageView, g: StageGeometry, role: str, force: float) -> float:
    """Line load w = |F| cosβ_b/(ε_α b), N/m: force over the mean length of contact lines."""
    length = g.gear_meshes[role].transverse_contact_ratio * view.stage.face_width
    return abs(force) * math.cos(g.base_helix_angle) / length


def compliance(view: StageView, g: StageGeometry, role: str, force: float) -> PairCompliance:
    """Compliance of planet and "ring" or "sun" after Weber and Banaschek. Raises InputError without
    load."""
    if force == 0:
        problem = f"weber-banaschek needs a load, but no torque passes the gear mesh ({role})"
        raise view.refuse("gear_mesh.pair_stiffness", problem, "load the train, or use iso6336")
    return pair_compliance(
        g.planet,
        g.gears[role],
        g.gear_meshes[role],
        young=view.material.young_modulus,
        poisson=view.material.poisson_ratio,
        line_load=line_load(view, g, role, force),
    )


def pair_law(view: StageView, g: StageGeometry, role: str, force: float) -> Law:
    """Law k'(ξ) of planet and "ring" or "sun", N/m² along the 3D normal, without the compliance
    that FE bodies of the two include."""
    law = _full_law(view, g, role, force)
    split_law = view.gear_mesh.pair_stiffness == "weber-banaschek"
    sides: tuple[tuple[Side, str], ...] = (("planet", "planet"), ("gear", role))
    with_root = split_law and view.gear_mesh.model in PER_PAIR_MODELS
    fe_sides = [
        (side, tie)
        for side, name in sides
        if (tie := view.fe_tie(name)) == "flank" or (tie and with_root)
    ]
    if not fe_sides:
        return law
    split = compliance(view, g, role, force)
    share = sum(split.share(side, tie) for side, tie in fe_sides)
    return table_law(split.xi, law(split.xi) / (1.0 - share))


def mean_stiffness(view: StageView, g: StageGeometry, role: str, force: float) -> float:
    """Mean stiffness of one gear mesh, or of one half, along the 3D normal, N/m."""
    return law_mean(pair_law(view, g, role, force), view, g, role)


def law_mean(law: Law, view: StageView, g: StageGeometry, role: str) -> float:
    """Mean stiffness of all pairs over a base pitch, ε_α b ∫ k'(ξ) dξ, N/m."""
    xi = np.linspace(0.0, 1.0, 2001)
    mean = float(np.trapezoid(law(xi))) / (len(xi) - 1)
    return g.gear_meshes[role].transverse_contact_ratio * view.stage.face_width * mean


def _full_law(view: StageView, g: StageGeometry, role: str, force: float) -> Law:
    """Stiffness k'(ξ) of a pair per face width, N/m², of both teeth with their foundations, scaled
    so that the gear mesh has the mean stiffness that the case states, if it states one."""
    stiffness: float | None = view.gear_mesh.of(role, "stiffness")
    if view.gear_mesh.model not in PER_PAIR_MODELS:
        ratio, width = g.gear_meshes[role].transverse_contact_ratio, view.stage.face_width
        mean = stiffness or iso_mean_stiffness(iso_peak(view, role), ratio, width)
        return lambda xi: np.full_like(xi, mean / (ratio * width))
    law = _shape(view, g, role, force)
    if stiffness is None:
        return law
    scale = stiffness / law_mean(law, view, g, role)
    return lambda xi: scale * law(xi)


def _shape(view: StageView, g: StageGeometry, role: str, force: float) -> Law:
    """Law k'(ξ) by the key ``pair_stiffness``."""
    options = view.gear_mesh
    if options.pair_stiffness == "weber-banaschek":
        split = compliance(view, g, role, force)
        cos_bb = math.cos(g.base_helix_angle)
        return table_law(split.xi, 1.0 / (split.total * cos_bb**2))
    if options.pair_stiffness == "table":
        assert options.table is not None  # the model refuses a table law without tables
        table = getattr(options.table, role)
        return table_law(np.asarray(table.position), np.asarray(table.stiffness))
    return parabola(iso_peak(view, role), options.end_ratio)
