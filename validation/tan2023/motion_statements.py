"""Statements about vibration of sun, planet and ring tooth: Figures 14-16 and 20-22."""

from functools import partial

import numpy as np
import xarray as xr

from flexgear.arrays import Array
from flexgear.results.stage_part import displacement_of
from tan2023 import measures
from tan2023.findings import Finding, reference, statement
from tan2023.runs import Runs

MICRO = 1e6
TUNING = (
    "mean shifts grow with flexibility; which variant vibrates more hangs on how near multiples of "
    "the gear-mesh frequency lie to its natural frequencies, so on unpublished stiffnesses"
)
CALIBRATED = "calibrated by rim thickness and bolt stiffness at standard fidelity, not validated"


def motions(runs: Runs, data: xr.Dataset) -> dict[str, Array]:
    """In-plane and axial motion (t, 3) of sun, planet 1 (against the drive flange), tooth 1, µm."""
    planet = displacement_of(data, "planet").isel(body=0).to_numpy()[:, :3].copy()
    planet[:, 1] -= runs.geometry.center_distance * measures.drive_rotation(data)
    return {
        "sun": displacement_of(data, "sun").to_numpy()[:, :3] * MICRO,
        "planet 1": planet * MICRO,
        "tooth 1": measures.tooth_node(data) * MICRO,
    }


def _larger_when_flexible(runs: Runs, body: str) -> Finding:
    """Largest in-plane displacement and vibration (peak-to-peak), flexible and rigid."""
    both = {n: motions(runs, d)[body] for n, d in runs.steady.items()}
    largest = {n: np.abs(u).max(axis=0) for n, u in both.items()}
    size = {n: float(np.linalg.norm(u[:, :2], axis=1).max()) for n, u in both.items()}
    swing = {n: np.ptp(u, axis=0) for n, u in both.items()}
    text = "; ".join(
        f"{n} x {v[0]:.1f}, y {v[1]:.1f}, z {v[2]:.1f} (peak-to-peak {swing[n][0]:.1f}, "
        f"{swing[n][1]:.1f}, {swing[n][2]:.1f})"
        for n, v in largest.items()
    )
    return Finding(f"largest in µm: {text}", bool(size["flexible"] > size["rigid"]), TUNING)


for figure, body in ((14, "sun"), (15, "planet 1")):
    statement(
        figure,
        published=f"{'the sun' if body == 'sun' else body} moves more when bodies bend",
        tolerance="largest in-plane displacement, flexible over rigid; reported",
        demanded=False,
        name=f"{body.removesuffix(' 1')}_moves_more_when_flexible",
    )(partial(_larger_when_flexible, body=body))


@statement(
    16,
    published="the ring's tooth moves more when bodies bend, and its vibration changes most",
    tolerance="in-plane displacement, flexible over rigid; ratio of peak-to-peak the largest",
)
def tooth_moves_more_when_flexible(runs: Runs) -> Finding:
    finding = _larger_when_flexible(runs, "tooth 1")
    ratio = {}
    for body in ("sun", "planet 1", "tooth 1"):
        swing = {
            n: float(np.ptp(motions(runs, d)[body][:, :2], axis=0).max())
            for n, d in runs.steady.items()
        }
        ratio[body] = swing["flexible"] / swing["rigid"]
    text = ", ".join(f"{n} {v:.1f}" for n, v in ratio.items())
    return Finding(
        f"{finding.computed}; in-plane peak-to-peak, flexible over rigid: {text}",
        bool(finding.holds and max(ratio, key=lambda n: ratio[n]) == "tooth 1"),
        "a rigid ring only turns on its bolts: hardly any ripple gets through",
    )


@statement(
    16,
    published="tooth node 1 peaks at 118.4 µm in y, 36.8 in x, 12.5 in z: y > x > z",
    tolerance="order y > x > z",
)
def tooth_peaks_y_x_z(runs: Runs) -> Finding:
    x, y, z = measures.peaks(runs.steady["flexible"])
    return Finding(
        f"x {x:.1f}, y {y:.1f}, z {z:.1f} µm",
        bool(y > x > z),
        "y is mostly the turning of the whole ring on its bolts",
    )


def _near(runs: Runs, axis: int) -> Finding:
    name = "xyz"[axis]
    value = float(measures.peaks(runs.steady["flexible"])[axis])
    expected = reference()[f"tooth_1_{name}"]
    off = value / expected.value - 1
    text = f"{value:.1f} µm against {expected.value:g}, {100 * off:+.1f} %"
    if expected.tolerance is None:
        return Finding(text, None, expected.reason)
    if runs.fidelity != "standard":
        return Finding(text, None, f"{CALIBRATED}; this is {runs.fidelity}")
    return Finding(text, bool(abs(off) <= expected.tolerance), CALIBRATED)


CALIBRATED_PEAK = "5 %, by labelled calibration"
for axis, peak, accepted in (
    (0, 36.8, CALIBRATED_PEAK), (1, 118.4, CALIBRATED_PEAK), (2, 12.5, "reported"),
):  # fmt: skip
    name = "xyz"[axis]
    statement(
        16, published=f"{name} peak {peak:g} µm", tolerance=accepted, name=f"tooth_{name}_peak"
    )(partial(_near, axis=axis))


def tooth_humps(runs: Runs) -> measures.Humps:
    """Humps of tooth node 1 over the steady revolution, flexible."""
    stage = runs.case.stage
    return measures.humps(runs.steady["flexible"], stage.planets, stage.ring.teeth)


@statement(
    16,
    published="humps of tooth node 1 are 2π/5 of carrier angle apart",
    tolerance="five humps, mean 2π/5, each within 3 %",
)
def humps_are_a_planet_spacing_apart(runs: Runs) -> Finding:
    spacing, expected = tooth_humps(runs).spacing, reference()["hump_spacing"]
    off = spacing / expected.value - 1
    assert expected.tolerance is not None
    return Finding(
        f"spacings {spacing.min():.4f} to {spacing.max():.4f} rad (2π/5 = {expected.value:.4f})",
        bool(np.all(np.abs(off) <= expected.tolerance)),
    )


@statement(
    16,
    published="x peaks before y and z",
    tolerance="in each of the five humps, gear-mesh ripple filtered out",
)
def x_peaks_first(runs: Runs) -> Finding:
    x, y, z = tooth_humps(runs).angle
    spacing = 2 * np.pi / runs.case.stage.planets
    return Finding(
        f"x {np.mean(y - x):.3f} rad before y ({np.mean(y - x) / spacing:.0%} of 2π/5), "
        f"{np.mean(z - x):.3f} rad before z",
        bool(np.all(x < y) and np.all(x < z)),
    )


@statement(
    16,
    published="low-frequency waves with gear-mesh vibration on top",
    tolerance="orders 93 ± 12 of the carrier angle above those just below; ripple below humps",
)
def ripple_rides_on_the_humps(runs: Runs) -> Finding:
    data = runs.steady["flexible"]
    angle, u = data["stage_angle"].to_numpy(), measures.tooth_node(data)
    grid = angle[0] + 2 * np.pi * np.arange(8192) / 8192
    teeth = runs.case.stage.ring.teeth
    lines = np.abs(np.fft.rfft(np.stack([np.interp(grid, angle, v) for v in u.T]), axis=-1))
    # planets pass one after the other: side bands at ± multiples of the planet number belong to it
    near = lines[:, teeth - 12 : teeth + 13].sum(axis=-1)
    beside = lines[:, teeth - 45 : teeth - 20].sum(axis=-1)
    ripple = tooth_humps(runs).ripple
    return Finding(
        f"ripple over humps, peak to peak: x {ripple[0]:.2f}, y {ripple[1]:.2f}, "
        f"z {ripple[2]:.2f}; orders 93 ± 12 hold {np.min(near / beside):.1f} times those below",
        bool(np.all(near > beside) and np.all(ripple[:2] < 1)),
    )


def sensitivity(runs: Runs) -> dict[str, Array]:
    """Peaks (3,) of tooth node 1 in µm with other rims and bolts, quick mesh, statics."""

    def compute() -> dict[str, Array]:
        base, bolts = runs.case.ring.rim_thickness, runs.case.ring.bolts
        rim, tangential = (
            "stage.ring.fe.rim_thickness_mm",
            "stage.ring.fe.bolts.stiffness_tangential_n_per_m",
        )
        radial = "stage.ring.fe.bolts.stiffness_radial_n_per_m"
        changes = {
            "as in the case": {},
            "rim −20 %": {rim: f"{0.8e3 * base:.9g}"},
            "rim +20 %": {rim: f"{1.2e3 * base:.9g}"},
            "bolts tangentially ×½": {tangential: f"{0.5 * bolts.stiffness_tangential:.9g}"},
            "bolts tangentially ×2": {tangential: f"{2 * bolts.stiffness_tangential:.9g}"},
            "bolts radially ×½": {radial: f"{0.5 * bolts.stiffness_radial:.9g}"},
            "bolts radially ×2": {radial: f"{2 * bolts.stiffness_radial:.9g}"},
        }
        return {name: measures.peaks(runs.other_ring(**c)) for name, c in changes.items()}

    return runs.once("sensitivity", compute)


@statement(
    16,
    published="(not in the paper) what decides the micrometres",
    tolerance="demanded: shown; x falls with the rim, y with the bolts' tangential stiffness",
)
def rim_and_bolts_decide(runs: Runs) -> Finding:
    by_change = sensitivity(runs)
    text = "; ".join(f"{n}: {v[0]:.1f}, {v[1]:.1f}, {v[2]:.1f}" for n, v in by_change.items())
    return Finding(
        f"x, y, z in µm, statics, quick mesh: {text}",
        bool(
            by_change["rim −20 %"][0] > by_change["rim +20 %"][0]
            and by_change["bolts tangentially ×½"][1] > by_change["bolts tangentially ×2"][1]
        ),
    )


def _falls_in_the_drop(runs: Runs, body: str) -> Finding:
    parts, good = [], True
    for name, data in runs.main_drop.items():
        time = data["time"].to_numpy()
        size = np.linalg.norm(motions(runs, data)[body][:, :2], axis=1)
        before = float(size[(time > 0.5) & (time < 1.0)].mean())
        during = float(size[(time > 1.05) & (time < 1.2)].mean())
        good &= during < before
        parts.append(f"{name} {before:.1f} to {during:.1f} µm")
    return Finding("mean in-plane displacement before and in the drop: " + "; ".join(parts), good)


for figure, body, words in (
    (20, "sun", "the sun's"), (21, "planet 1", "the planet's"), (22, "tooth 1", "the ring tooth's"),
):  # fmt: skip
    statement(
        figure,
        published=f"{words} displacement falls with the torque",
        tolerance="mean, both variants",
        name=f"{body.removesuffix(' 1')}_calms_in_the_drop",
    )(partial(_falls_in_the_drop, body=body))


@statement(
    22,
    published="the flexible model shows details of the tooth's motion that a rigid one cannot",
    tolerance="peak-to-peak of x, flexible at least ten times rigid",
)
def flexible_tooth_shows_more(runs: Runs) -> Finding:
    swing = {n: float(np.ptp(motions(runs, d)["tooth 1"][:, 0])) for n, d in runs.main_drop.items()}
    return Finding(
        ", ".join(f"{n} {v:.1f} µm" for n, v in swing.items()),
        bool(swing["flexible"] > 10 * swing["rigid"]),
    )
