"""Load factors of ISO 6336-1:2006, method B: dynamic, face and transverse load factors.

Dynamic factor (clause 6): with the reduced mass m_red per face width on the line of action and the
gear-mesh stiffness c_γα the resonance ratio is N = 2π f/√(c_γα/m_red), f the gear-mesh frequency.
With w = F_t K_A K_γ/b

    B_p = c' f_pb,eff/w,  B_f = c' f_fα,eff/w,  B_k = |1 − c' C_a/w|
    N ≤ N_S      K_v = 1 + N (C_v1 B_p + C_v2 B_f + C_v3 B_k)
    N ≤ 1.15     K_v = 1 + C_v1 B_p + C_v2 B_f + C_v4 B_k
    N ≥ 1.5      K_v = C_v5 B_p + C_v6 B_f + C_v7,  straight between 1.15 and 1.5
    N_S = 0.85, or 0.5 + 0.35 √(w/100) below w = 100 N/mm

    m_red = 1/(1/m_planet + N_planets/m_gear),  m = J/(b r_b²);  a gear at rest has m = ∞

which is the standard's m_red of pinion and wheel, of sun and planets, and of planets in a fixed
ring. f_pb,eff and f_fα,eff are the larger deviation of the two gears less the running-in allowances
y_p, y_f, both by the rule for y_α. C_a: mean relief at both ends of the path; without relief
C_ay = (σ_Hlim/97 − 18.45)²/18 + 1.5 µm (σ_Hlim N/mm², mean of both). B_k = 1 for accuracy grades 6
and coarser. Deviations of a grade: ISO 1328-1, edition 1995 or 2013.

Transverse load factors (clause 8), w_H = w K_v K_Hβ:

    K_Hα = K_Fα = ε_γ/2 (0.9 + 0.4 q)            ε_γ ≤ 2,  q = c_γα (f_pb − y_α)/w_H
                = 0.9 + 0.4 q √(2 (ε_γ − 1)/ε_γ)  above
    1 ≤ K_Hα ≤ ε_γ/(ε_α Z_ε²),  1 ≤ K_Fα ≤ ε_γ/(0.25 ε_α + 0.75)

with f_fα − y_f in place of f_pb − y_α where f_fα is larger; a case may halve f_pb (8.3.2).

Face load factor of the root (7.2): K_Fβ = K_Hβ^{N_F}, N_F = 1/(1 + h/b + (h/b)²), h/b ≤ 1/3, the
larger of both gears. c', c_γα fall with (w/100 N/mm)^{1/4} below that load (9.3), everywhere.
"""

import bisect
import math
from typing import Literal

from flexgear.gears.nominal_stress import flank_load_share
from flexgear.gears.rating.pair import GearPair, PairLoad, RatedGear
from flexgear.gears.rating.steels import THROUGH_HARDENED

LOW_LOAD = 1e5  # N/m, below which c' falls
COARSE_GRADE = 6  # finest accuracy grade with B_k = 1
RANGES = (  # mm, of module, reference diameter, face width; ISO 1328-1:1995
    (0.5, 2, 3.5, 6, 10, 16, 25, 40, 70),
    (5, 20, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6000, 8000, 10000),
    (4, 10, 20, 40, 80, 160, 250, 400, 650, 1000),
)
Deviation = Literal["pitch", "profile", "helix"]
SLOPE_SIGNS = tuple(  # of f_ma, of trains 1 to 4 with the worst deviations
    {"sun": sun, "ring": ring} for sun in (1.0, -1.0) for ring in (1.0, -1.0)
)


def tolerance(pair: GearPair, gear: RatedGear, kind: Deviation) -> float | None:
    """Deviation of a gear, m: of the case, or by its accuracy grade A; None without both.

    ISO 1328-1 (m, d, b in mm, deviation in µm), times 2^{(A−5)/2} and rounded to 0.1 below 5 µm,
    0.5 up to 10 µm and 1 above:

            "pitch" f_pt             "profile" f_fα              "helix" f_Hβ
    1995    0.3 (m + 0.4 √d) + 4     2.5 √m + 0.17 √d + 0.5      0.07 √d + 0.45 √b + 3
    2013    0.001 d + 0.4 m + 5      0.55 m + 5                  0.05 √d + 0.35 √b + 4

    In 1995 m, d and b are geometric means of the ends of their ranges.
    """
    stated: float | None = getattr(gear.data, f"{kind}_deviation")
    if stated is not None or gear.data.accuracy_grade is None:
        return stated
    sizes = (pair.stage.normal_module, gear.reference_diameter, pair.stage.face_width)
    m, d, b = (1e3 * size for size in sizes)
    if pair.rules.edition == 2006:
        m, d, b = (_range_mean(x, ends) for x, ends in zip((m, d, b), RANGES, strict=True))
    root_d, root_b = math.sqrt(d), math.sqrt(b)
    grade_5 = {
        "pitch": (0.3 * (m + 0.4 * root_d) + 4.0, 0.001 * d + 0.4 * m + 5.0),
        "profile": (2.5 * math.sqrt(m) + 0.17 * root_d + 0.5, 0.55 * m + 5.0),
        "helix": (0.07 * root_d + 0.45 * root_b + 3.0, 0.05 * root_d + 0.35 * root_b + 4.0),
    }
    value = 2.0 ** ((gear.data.accuracy_grade - 5) / 2) * grade_5[kind][pair.rules.edition != 2006]
    step = 0.1 if value < 5.0 else 0.5 if value <= 10.0 else 1.0
    return 1e-6 * step * math.floor(value / step + 0.5)


def misalignment(pair: GearPair) -> float | None:
    """f_ma = √(f_Hβ1² + f_Hβ2²) of both gears, m; None for a gear without accuracy grade."""
    first, second = (tolerance(pair, gear, "helix") for gear in pair.gears.values())
    return None if first is None or second is None else math.hypot(first, second)


def _range_mean(size: float, ends: tuple[float, ...]) -> float:
    """Geometric mean of the ends of the range of a size; the size itself outside all ranges."""
    k = bisect.bisect_left(ends, size)
    return math.sqrt(ends[k - 1] * ends[k]) if 0 < k < len(ends) else size


def _run_in(gear: RatedGear, deviation: float, velocity: float) -> float | None:
    """Running-in allowance y_α, m; None if steel or strength are unknown. 0.075 f, at most 3 µm,
    for surface-hardened steels; 160/σ_Hlim f for others, at most 12 800/σ_Hlim above 5 m/s and half
    of that above 10 m/s (f in µm, σ_Hlim in N/mm²)."""
    if gear.data.steel is None:
        return None
    if gear.data.steel not in THROUGH_HARDENED:
        return min(0.075 * deviation, 3e-6)
    if gear.flank_strength is None:
        return None
    strength = gear.flank_strength / 1e6
    limit = math.inf if velocity <= 5.0 else (12.8e-3 if velocity <= 10.0 else 6.4e-3) / strength
    return min(160.0 / strength * deviation, limit)


def deviations(
    pair: GearPair, velocity: float, pitch_share: float = 1.0
) -> tuple[float, float] | None:
    """Effective deviations f_pb,eff = f_pb − y_p and f_fα,eff = f_fα − y_f, m; None if accuracy or
    steel of a gear is unknown. pitch_share: share of f_pb that counts."""
    effective: list[float] = []
    kinds: tuple[Deviation, Deviation] = ("pitch", "profile")
    shares = (pitch_share * math.cos(pair.transverse_angle), 1.0)
    for kind, share in zip(kinds, shares, strict=True):
        sizes = [tolerance(pair, gear, kind) for gear in pair.gears.values()]
        largest = share * max((x for x in sizes if x is not None), default=0.0)
        run_in = [_run_in(gear, largest, velocity) for gear in pair.gears.values()]
        allowances = [y for y in run_in if y is not None]
        if None in sizes or None in run_in:
            return None
        effective.append(largest - sum(allowances) / len(allowances))
    return effective[0], effective[1]


def reduced_mass(pair: GearPair) -> float:
    """Reduced mass m_red per face width, kg/m."""
    inverse = 0.0
    for part, gear in pair.gears.items():
        mates = 1 if part == "planet" else pair.stage.planets
        if gear.turns or part == "planet":
            inverse += mates * gear.tooth.base_radius**2 / gear.inertia
    return 1.0 / inverse


def _softened(line_load: float) -> float:
    """Reduction of c' at a load per face width, N/m."""
    return min(line_load / LOW_LOAD, 1.0) ** 0.25


def _tip_relief(pair: GearPair) -> float | None:
    """Tip relief C_a of B_k, m, 0 for grade 6 and coarser; None without relief and strengths."""
    gears = pair.gears.values()
    if any((gear.data.accuracy_grade or 0) >= COARSE_GRADE for gear in gears):
        return 0.0
    if any(gear.relief for gear in gears):
        return sum(gear.relief for gear in gears) / 2
    amounts = [
        1e-6 * ((gear.flank_strength / 97e6 - 18.45) ** 2 / 18.0 + 1.5)
        for gear in gears
        if gear.flank_strength is not None
    ]
    return sum(amounts) / 2 if len(amounts) == len(pair.gears) else None


def _coefficients(ratio: float) -> tuple[float, ...]:
    """Coefficients C_v1 … C_v7 for the total contact ratio ε_γ; ISO 6336-1:2006, table 8."""
    if ratio <= 2.0:
        v2, v3, v4, v6 = 0.34, 0.23, 0.90, 0.47
    else:
        v2, v3 = 0.57 / (ratio - 0.3), 0.096 / (ratio - 1.56)
        v4, v6 = (0.57 - 0.05 * ratio) / (ratio - 1.44), 0.12 / (ratio - 1.74)
    v7 = 0.75 if ratio <= 1.5 else 1.0
    if 1.5 < ratio <= 2.5:
        v7 = 0.125 * math.sin(math.pi * (ratio - 2.0)) + 0.875
    return 0.32, v2, v3, v4, 0.47, v6, v7


def method_b_inputs(pair: GearPair, load: PairLoad, ratio: float) -> dict[str, float]:
    """Inputs of K_v by symbol, in the units of the sheet; empty if accuracy, steel or strength are
    unknown. ratio: K_A K_γ."""
    line_load = ratio * load.tangential_force / pair.stage.face_width
    deviation, relief = deviations(pair, load.velocity), _tip_relief(pair)
    if deviation is None or relief is None:
        return {}
    reduction, mass = _softened(line_load) if line_load else 1.0, reduced_mass(pair)
    natural = math.sqrt(pair.gear_mesh_stiffness * reduction / mass)
    return {
        "c′_th": pair.theoretical_stiffness / 1e9,
        "c′": reduction * pair.single_stiffness / 1e9,
        "c_γα": reduction * pair.gear_mesh_stiffness / 1e9,
        "m_red": mass / 1e3,
        "f_pb,eff": 1e6 * deviation[0],
        "f_fα,eff": 1e6 * deviation[1],
        "C_a": 1e6 * relief,
        "N": 2.0 * math.pi * load.velocity / pair.pitch / natural,
    }


def dynamic_factor(pair: GearPair, load: PairLoad, ratio: float) -> tuple[float, float]:
    """Dynamic factor K_v, 1 without load, and resonance ratio N; NaN if accuracy, steel or strength
    are unknown. ratio: K_A K_γ."""
    line_load = ratio * load.tangential_force / pair.stage.face_width
    inputs = method_b_inputs(pair, load, ratio)
    if not inputs:
        return math.nan, math.nan
    resonance = inputs["N"]
    if line_load == 0.0:
        return 1.0, resonance
    per_load = 1e3 * inputs["c′"] / line_load
    b_p, b_f = per_load * inputs["f_pb,eff"], per_load * inputs["f_fα,eff"]
    b_k = abs(1.0 - per_load * inputs["C_a"])
    c1, c2, c3, c4, c5, c6, c7 = _coefficients(pair.geometry.total_contact_ratio)
    low = 0.85 if line_load >= LOW_LOAD else 0.5 + 0.35 * math.sqrt(line_load / LOW_LOAD)
    if resonance <= low:
        return 1.0 + resonance * (c1 * b_p + c2 * b_f + c3 * b_k), resonance
    near, above = 1.0 + c1 * b_p + c2 * b_f + c4 * b_k, c5 * b_p + c6 * b_f + c7
    share = min(max(resonance - 1.15, 0.0) / 0.35, 1.0)
    return (1.0 - share) * near + share * above, resonance


def root_face_factor(pair: GearPair, face_flank: float) -> float:
    """Face load factor K_Fβ of the root for K_Hβ of the flank, by tooth height over width."""
    gears = pair.gears.values()
    ratio = max(abs(g.tooth.tip_radius - g.tooth.root_radius) / g.face_width for g in gears)
    ratio = min(ratio, 1.0 / 3.0)
    return float(face_flank ** (1.0 / (1.0 + ratio + ratio**2)))


def transverse_factors(
    pair: GearPair, load: PairLoad, ratio: float, other_factors: float
) -> tuple[float, float]:
    """Transverse load factors K_Hα and K_Fα; NaN if accuracy or steel are unknown. ratio: K_A K_γ;
    other_factors: K_v K_Hβ."""
    deviation = deviations(pair, load.velocity, pair.rules.pitch_deviation_share)
    if deviation is None:
        return math.nan, math.nan
    alpha, total = pair.geometry.transverse_contact_ratio, pair.geometry.total_contact_ratio
    flank_limit = total / (alpha * flank_load_share(pair.geometry))
    root_limit = total / (0.25 * alpha + 0.75)
    line_load = ratio * load.tangential_force / pair.stage.face_width
    if line_load == 0.0:
        return flank_limit, root_limit
    stiffness = _softened(line_load) * pair.gear_mesh_stiffness
    share = 0.4 * stiffness * max(deviation) / (line_load * other_factors)
    if total <= 2.0:
        value = total / 2.0 * (0.9 + share)
    else:
        value = 0.9 + share * math.sqrt(2.0 * (total - 1.0) / total)
    return max(min(value, flank_limit), 1.0), max(min(value, root_limit), 1.0)
