"""The paper's figures and findings against the package and the corrected equations."""

from functools import cache, partial

import numpy as np
from rows import CLOSED_FORM, INDEPENDENT, Row, compared, gathered, number, reference
from scipy.linalg import eigh
from trains import gear_mesh_forces

from hu2023 import comparison, studies
from hu2023.cases import drive
from hu2023.comparison import KINDS, STAGES, bundled, flow, momentary, quasi_static, sharing
from hu2023.equations import matrices
from hu2023.errors import harmonics
from hu2023.sharing import StageFigures, cycle_times, gear_mesh_rate, stage_figures

PAPER = "hu2023"
published = partial(reference, PAPER)
line = partial(Row, PAPER)  # where, quantity, published, computed, tolerance, holds, why
MM = 1e3
RPM = 30 / np.pi
PACKAGE_POINTS = (0, 3, 6)  # of studies.SIZES
EQUAL = 1e-9  # K − 1 of a free sun on three planets


def rows() -> list[Row]:
    """All rows of this paper."""
    return gathered(PAPER, speeds_and_torques, mean_forces, package_and_equations, free_sun,
                    printed_sharing, fitted_sharing, sun_float, carrier_displacement,
                    figure_10, figure_11, figure_12)  # fmt: skip


@cache
def by_equations(j: int, signs: str, static: bool) -> StageFigures:
    """Stage j by the plain equations."""
    base = drive()
    return stage_figures(base, matrices(base), j, harmonics(base, signs=signs), static, 400)


def speeds_and_torques() -> list[Row]:
    """Of the three suns, from power flow."""
    out = []
    for j in STAGES:
        speed = abs(flow().speed[f"stage_{j + 1}.sun"]) * RPM
        out.append(compared(PAPER, published()[f"speed of sun {j + 1}"], speed))
    for j in STAGES:
        torque = abs(flow().stage(f"stage_{j + 1}").sun_torque)
        out.append(compared(PAPER, published()[f"torque on sun {j + 1}"], torque))
    return out


def mean_forces() -> list[Row]:
    """Mean gear-mesh forces of the coupled model without errors."""
    run = comparison.without_errors()
    forces = gear_mesh_forces(run.at(np.linspace(0.0, 1.0, 5)))
    out = []
    for j in STAGES:
        each = forces[:, run.columns(j, "sun") + run.columns(j, "ring")]
        expected = drive().mean_force(j)
        off = float(np.abs(each / expected - 1).max())
        rigid = abs(flow().stage(f"stage_{j + 1}").sun_gear_mesh_force)
        out.append(
            line("Table 2", f"mean gear-mesh force of stage {j + 1}, coupled drive",
                 f"T/(N r_bs) = {number(expected)} N (from Table 2)",
                 f"{number(float(each.mean()))} N, sun and ring; power flow {number(rigid)} N",
                 "0.05 %", off < 5e-4 and abs(rigid / expected - 1) < 5e-4)
        )  # fmt: skip
    return out


def package_and_equations() -> list[Row]:
    """Forces of the package position by position, and number of coordinates."""
    base = drive()
    system = matrices(base)
    off = 0.0
    for j in STAGES:
        time = cycle_times(base, j, comparison.CYCLES)
        plain = system.forces(harmonics(base), time, True)
        ours = gear_mesh_forces(quasi_static(j))
        for k in STAGES:
            for kind in KINDS.values():
                columns = bundled().columns(k, kind)
                gap = np.abs(ours[:, columns] - plain[:, base.gear_meshes(k, kind)]).max()
                off = max(off, float(gap) / base.mean_force(k))
    count = len(bundled().modal.system.mass)
    return [
        line("section 3.1", "degrees of freedom", "43", str(count), "exact", count == 43),
        line("eqs. 1–15", "package against plain equations, all gear meshes and positions", "–",
             f"forces differ by {off:.1e} of the mean", "1e-6", off < 1e-6,
             "two formulations of the same physics, errors by geometry in both", INDEPENDENT),
    ]  # fmt: skip


def free_sun() -> list[Row]:
    """Three planets on a free sun share equally, whatever the errors."""
    base = drive()
    _, mean, _, force = matrices(base).statics()
    rng = np.random.default_rng(1)
    worst = 0.0
    for _ in range(200):
        all_forces = mean + force @ rng.normal(0, 50e-6, len(mean))
        for j in STAGES[1:]:
            for kind in KINDS.values():
                part = all_forces[base.gear_meshes(j, kind)]
                worst = max(worst, float(part.max() / part.mean() - 1))
    ours = 0.0
    for seed in (1, 2, 3):
        run = comparison.random_errors(seed)
        for j in STAGES[1:]:
            result = comparison.over_period(run, j, 20)
            ours = max(ours, *(momentary(run, result, j, side) - 1 for side in KINDS))
    return [
        line("section 3.2", "K of a free sun on three planets under random errors, quasi-static",
             "1.016 … 1.092", f"K − 1 at most {worst:.1e} (equations, 200 draws), {ours:.1e} "
             "(package, 3 draws, all positions)", "1e-9", max(worst, ours) < EQUAL,
             "three forces on the sun are in equilibrium only if equal; stages 2 and 3",
             CLOSED_FORM)
    ]  # fmt: skip


def printed_sharing() -> list[Row]:
    """Printed K of all stages beside ours."""
    out = []
    for j in STAGES:
        for side in KINDS:
            dynamic = getattr(by_equations(j, "geometry", False), side)
            stepped = comparison.late_shares(j, side)
            ours = sharing(bundled(), quasi_static(j), j, side)
            why = f"harmonic steady state {dynamic:.6g}, time stepping {stepped:.6g}"
            if j == 0:
                lowest = by_equations(0, "geometry", True).lowest
                wrong = getattr(by_equations(0, "equation 1", True), side)
                why += (
                    f"; the linear law lets teeth pull (down to {lowest:.1f} of the mean force): "
                    "real ones would part and leave the load to one planet, K near 3; signs of "
                    f"eq. 1: {wrong:.4g}"
                )
            out.append(compared(PAPER, published()[f"K of stage {j + 1} {side}"], ours, 6, why))
    return out


def fitted_sharing() -> list[Row]:
    """What planet bearings the printed K of stage 1 wants."""
    values = {s: studies.fitted_bearing(s) for s in ("geometry", "equation 1")}
    inside = studies.of(studies.soft_drive(), 0).inside
    return [
        line("section 3.2", "planet bearings of stage 1 that give K = 1.076 outside",
             "not printed", ", ".join(f"{v:.3g} N/m with signs of {s}" for s, v in values.items())
             + f"; K inside is then {inside:.4f} (dynamic)", "reported", None,
             "a fit: a needle bearing of this size has some 1e8 to 1e9 N/m. A planet passes the "
             "force on, so K inside is that outside, not 1.116", "")
    ]  # fmt: skip


def sun_float() -> list[Row]:
    """Radial displacement of the floating suns."""
    out = []
    for j in STAGES[1:]:
        ours = float(np.hypot(*comparison.orbit(j).T).max()) * MM
        base = drive()
        errors = harmonics(base, signs="equation 1")
        motion = matrices(base).motion(errors, comparison.orbit_times(j), True)
        sun = base.first(j)
        wrong = float(np.hypot(*motion[:, sun + 1 : sun + 3].T).max()) * MM
        why = f"with the signs of eq. 1 {wrong:.4f} mm; it follows from the errors alone"
        out.append(compared(PAPER, published()[f"sun float of stage {j + 1}"], ours, 4, why))
    return out


def carrier_displacement() -> list[Row]:
    """Third carrier at 50, 100 and 150 % torque."""
    run, out = bundled(), []
    time = cycle_times(drive(), 2, 40)
    dynamic = by_equations(2, "geometry", False).carrier_amplitude * MM
    rated = run.modal.system.rated_torque
    for what in ("amplitude", "measured"):
        for percent in (50, 100, 150):
            result = run.at(drive().speed * time, 0.01 * percent * rated)
            y = comparison.displacement(run, result, "stage_3.carrier")[:, 1]
            line_ = published()[f"carrier 3 {what}, {percent} % torque"]
            why = f"dynamic {dynamic:.1e} mm at any torque" if what == "amplitude" else ""
            out.append(compared(PAPER, line_, float(np.ptp(y)) / 2 * MM, 3, why))
    out.append(
        line("Table 5", "why the third carrier stays in place", "grows with torque",
             "quasi-static amplitude is zero at 50, 100 and 150 %", "reported", None,
             "equal loads on three even planets leave no radial force on the carrier, at any "
             "torque; in a linear model the part from errors would not depend on torque at all")
    )  # fmt: skip
    return out


def figure_10() -> list[Row]:
    """K over gear-mesh stiffness."""
    out = []
    for kind, side in (("sun", "outside"), ("ring", "inside")):
        curve = studies.values(studies.over_stiffness(0, kind), side)
        stiff = "external" if kind == "sun" else "internal"
        out.append(
            line("Figure 10(a, b)", f"K of stage 1 {side} over {stiff} gear-mesh stiffness",
                 "grows", f"{curve[0]:.4f} … {curve[-1]:.4f} from 1e8 to 1e10 N/m",
                 "does not fall", bool(np.all(np.diff(curve) > -1e-6)),
                 "less compliance, less evening out; planet bearings as fitted")
        )  # fmt: skip
    base = matrices(drive())
    elastic = np.sqrt(np.maximum(eigh(base.stiffness, base.mass, eigvals_only=True), 0))
    lowest = float(elastic[1] / (2 * np.pi))
    top = [gear_mesh_rate(drive(), j) / (2 * np.pi) for j in STAGES]
    worst = max(
        float(studies.values(studies.over_stiffness(j, kind), side).max())
        for j in STAGES[1:]
        for kind in KINDS.values()
        for side in KINDS
    )
    out.append(
        line("Figure 10(c–f)", "K of stages 2 and 3 over gear-mesh stiffness",
             "jumps at certain stiffness", f"K at most {worst:.6f} from 1e8 to 1e10 N/m",
             "reported", None,
             f"no jump: errors act up to {top[1]:.0f} and {top[2]:.1f} Hz in these stages, the "
             f"lowest mode that shifts members lies at {lowest:.0f} Hz, and the sun is free")
    )  # fmt: skip
    return out


def figure_11() -> list[Row]:
    """K of stage 1 over eccentricities."""
    out = []
    claims = {
        "sun": "K outside grows, inside unchanged",
        "ring": "K inside grows, outside as good as unchanged",
        "planet": "both K grow",
        "carrier": "both K grow",
    }
    for part, claim in claims.items():
        results = studies.over_eccentricity(part, True)
        ends = [studies.values(results, side) for side in KINDS]
        gap = float(np.abs(ends[0] - ends[1]).max())
        text = ", ".join(f"{side} {c[0]:.4f} … {c[-1]:.4f}"
                         for side, c in zip(KINDS, ends, strict=True))  # fmt: skip
        grows = all(bool(np.all(np.diff(c) > 0)) for c in ends)
        both = part in ("planet", "carrier")
        out.append(
            line("Figure 11", f"K of stage 1 over eccentricity of {part}, 0 … 60 µm", claim, text,
                 "both rise" if both else "reported", grows if both else None,
                 "" if both else "a planet in equilibrium passes the same force on: both K are "
                 f"equal (within {gap:.1e}), so both rise")
        )  # fmt: skip
    off = max(
        abs(comparison.over_eccentricity(part, float(studies.SIZES[k]))[side] - c[k])
        for part in studies.PARTS
        for side in KINDS
        for c in [studies.values(studies.over_eccentricity(part, True), side)]
        for k in PACKAGE_POINTS
    )
    out.append(
        line("Figure 11", "its points by the package", "–", f"K differs by {off:.1e} at most from "
             "the equations' curves", "1e-6", off < 1e-6, against=INDEPENDENT)
    )  # fmt: skip
    return out


def figure_12() -> list[Row]:
    """K over tooth errors."""
    out = []
    for j in STAGES:
        for kind, name in (("sun", "external"), ("ring", "internal")):
            results = studies.over_tooth_error(j, kind)
            text = ", ".join(
                f"{side} {c[0]:.6g} … {c[-1]:.6g}"
                for side, c in ((s, studies.values(results, s)) for s in KINDS)
            )
            teeth = drive().stages[j].teeth[0 if kind == "sun" else 2]
            why = (
                f"{teeth} teeth are a multiple of three: equal phases at all planets, which take "
                "the error up together"
                if teeth % 3 == 0
                else f"{teeth} teeth: phases 120° apart, but the sun floats"
            )
            out.append(
                line("Figure 12", f"K of stage {j + 1} over {name} tooth error, 0 … 60 µm",
                     "grows" if j < 2 else "external: grows markedly; internal: unchanged",
                     text, "reported", None, why)
            )  # fmt: skip
    return out
