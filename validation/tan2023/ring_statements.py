"""Statements about deformation at equilibrium: Figures 7, 8, 9, 13."""

import numpy as np

from flexgear.arrays import Array
from flexgear.results.stage_part import displacement_of
from flexgear.results.time_figures import radial_harmonics
from tan2023 import measures
from tan2023.findings import Finding, statement
from tan2023.runs import FLEXIBLE, Runs

MICRO = 1e6


def pair_curves(runs: Runs) -> dict[str, dict[str, Array]]:
    """Pair stiffness and harmonic error over the path of contact at z = 0, ring and sun."""
    pairs = runs.modal(FLEXIBLE).system.pairs
    curves = {}
    for g, name in enumerate(("ring", "sun")):
        position = pairs.table_start[g] + pairs.table_step[g] * np.arange(pairs.k_table.shape[1])
        use = pairs.k_table[g] > 0
        first = g * runs.case.stage.planets  # gear mesh of planet 1
        error = pairs.error_amplitude[first] * np.sin(
            2 * np.pi * position / pairs.pitch[first] + pairs.error_phase[first]
        )
        curves[name] = {
            "position": position[use],
            "stiffness": pairs.k_table[g][use],
            "error": error[use],
        }
    return curves


@statement(
    7,
    published="pair stiffness rises to one maximum and falls again during a tooth's contact; the "
    "error is a sine at gear-mesh frequency (values and axes are not stated in the text)",
    tolerance="one maximum, inside the middle half of the contact",
)
def pair_stiffness_rises_and_falls(runs: Runs) -> Finding:
    parts, good = [], True
    for name, c in pair_curves(runs).items():
        k = c["stiffness"]
        top = int(k.argmax())
        rises = np.all(np.diff(k[: top + 1]) > -1e-9 * k.max())
        falls = np.all(np.diff(k[top:]) < 1e-9 * k.max())
        good &= bool(rises and falls and 0.25 < top / len(k) < 0.75)
        parts.append(
            f"{name} peak {k.max() * 1e-9:.2f} kN/µm at {top / len(k):.0%} of the contact, "
            f"error ±{np.abs(c['error']).max() * MICRO:.1f} µm"
        )
    return Finding("; ".join(parts), good)


@statement(
    8,
    published="the deformed ring is a five-pointed star",
    tolerance="orders not divisible by 5 below 10 % of order 5",
)
def ring_is_a_pentagram(runs: Runs) -> Finding:
    size, _ = measures.star(runs.star_turn)
    orders = np.arange(size.shape[1])
    others = size[:, (orders % 5 != 0) & (orders <= 20)].max()
    least = size[:, 5].min()
    first = size[0]
    text = ", ".join(f"order {n}: {first[n]:.2f}" for n in (0, 5, 10, 15))
    return Finding(
        f"radial harmonics in µm: {text}; largest other order ≤ 20: {others:.2f} "
        f"({others / least:.1%} of order 5)",
        bool(others < 0.1 * least),
    )


@statement(
    8,
    published="the star turns with the carrier",
    tolerance="arg(c₅)/5 within 0.5° of the carrier angle, 16 angles over a turn",
)
def star_follows_the_carrier(runs: Runs) -> Finding:
    _, off = measures.star(runs.star_turn)
    worst = np.rad2deg(np.abs(off).max())
    return Finding(f"largest deviation {worst:.3f}°", bool(worst < 0.5))


@statement(
    8,
    published="planets shift tangentially against the carrier's rotation",
    tolerance="every planet, both carrier angles",
)
def planets_shift_against_the_rotation(runs: Runs) -> Finding:
    shift = measures.tangential_shift(runs.star, runs.geometry.center_distance) * MICRO
    return Finding(
        f"tangential shift against the drive flange {shift.min():.0f} to {shift.max():.0f} µm",
        bool(np.all(shift < 0)),
    )


@statement(
    8,
    published="the sun hardly moves radially",
    tolerance="below 5 % of the planets' shift (ours; the paper gives none)",
)
def sun_hardly_moves_radially(runs: Runs) -> Finding:
    sun = np.hypot(*displacement_of(runs.star, "sun").to_numpy()[:, :2].T).max() * MICRO
    planets = (
        np.abs(measures.tangential_shift(runs.star, runs.geometry.center_distance)).max() * MICRO
    )
    return Finding(
        f"{sun:.1f} µm, {sun / planets:.1%} of the planets' {planets:.0f} µm",
        bool(sun < 0.05 * planets),
        "a floating sun between five equal loads; what is left comes from planets that are at "
        "different phases of their gear meshes",
    )


@statement(
    8,
    published="axial shifts of ring, carrier and sun are small",
    tolerance="below a quarter of the planets' tangential shift (ours; the paper gives none)",
)
def axial_shifts_are_small(runs: Runs) -> Finding:
    data = runs.star
    planets = np.abs(measures.tangential_shift(data, runs.geometry.center_distance)).max()
    shifts = {
        "ring": np.abs(data["tooth_displacement"].isel(axis=2)).max(),
        "carrier": np.abs(measures.pins(data).isel(dof=2)).max(),
        "planets": np.abs(displacement_of(data, "planet").isel(dof=2)).max(),
        "sun": np.abs(displacement_of(data, "sun").isel(dof=2)).max(),
    }
    text = ", ".join(f"{n} {float(v) * MICRO:.1f}" for n, v in shifts.items())
    return Finding(
        f"largest |z| in µm: {text}; planets' tangential shift {planets * MICRO:.0f}",
        bool(max(float(v) for v in shifts.values()) < 0.25 * planets),
        "the sun's value is the thrust of its helix over the axial stiffness chosen behind it",
    )


def carrier_under_pin_forces(runs: Runs) -> tuple[Array, Array]:
    """Coordinates of the reduced carrier held at its drive node under clockwise pin forces.

    Force at each pin: rated torque / (N R_c). Returns q (d,) and the tangential motion (N,) of
    the pins, m.
    """
    body, case = runs.carrier, runs.case
    names, k = list(body.node_names), body.stiffness
    force = np.zeros(len(k))
    size = case.case.inputs[0].torque / (case.stage.planets * runs.geometry.center_distance)
    pins = []
    for i, phi in enumerate(case.stage.planet_angles):
        at = 6 * names.index(f"pin_{i + 1}")
        clockwise = np.array([np.sin(phi), -np.cos(phi), 0.0])
        force[at : at + 3] = size * clockwise
        pins.append((at, clockwise))
    held = 6 * names.index("drive") + np.arange(6)
    free = np.setdiff1d(np.arange(len(k)), held)
    q = np.zeros(len(k))
    q[free] = np.linalg.solve(k[np.ix_(free, free)], force[free])
    return q, np.array([-(q[at : at + 3] @ d) for at, d in pins])


@statement(
    9,
    published="with the carrier held at its drive end, pins under clockwise forces shift "
    "clockwise, the sense in which planets shift in Figure 8",
    tolerance="sign, all pins",
)
def carrier_pins_follow_their_load(runs: Runs) -> Finding:
    _, pins = carrier_under_pin_forces(runs)
    stage = measures.tangential_shift(runs.star, runs.geometry.center_distance) * MICRO
    pins = pins * MICRO
    return Finding(
        f"pins {pins.min():.0f} to {pins.max():.0f} µm tangentially (negative: clockwise); "
        f"planets in the stage, bearings included, {stage.mean():.0f} µm",
        bool(np.all(pins < 0) and np.all(stage < 0)),
    )


@statement(
    13,
    published="at a given carrier angle the x displacements of all ring teeth are by and large "
    "symmetric about the origin",
    tolerance="correlation of u_x(φ) with −u_x(φ + π) above 0.8 (ours)",
)
def ring_x_is_odd_across_the_axis(runs: Runs) -> Finding:
    x = runs.steady["flexible"]["tooth_displacement"].isel(axis=0).to_numpy()[::25]
    teeth = x.shape[1]
    phi = 2 * np.pi * np.arange(teeth) / teeth
    across = np.stack([np.interp(phi + np.pi, phi, row, period=2 * np.pi) for row in x])
    value = float(-np.sum(x * across) / np.sqrt(np.sum(x**2) * np.sum(across**2)))
    return Finding(
        f"correlation {value:.3f}",
        bool(value > 0.8),
        "the part in phase is the turning of the whole ring on its bolts; the star itself is "
        "even in x",
    )


@statement(
    13,
    published="every tooth sees humps 2π/5 of carrier angle apart, as planets pass one by one",
    tolerance="order 5 the largest of all orders of the carrier angle, for every tooth",
)
def every_tooth_sees_five_humps(runs: Runs) -> Finding:
    data = runs.steady["flexible"]
    angle, x = data["stage_angle"].to_numpy(), data["tooth_displacement"].isel(axis=0).to_numpy()
    grid = angle[0] + 2 * np.pi * np.arange(4096) / 4096
    spectrum = np.abs(np.fft.rfft(np.stack([np.interp(grid, angle, u) for u in x.T]), axis=-1))[
        :, 1:41
    ]
    dominant = np.argmax(spectrum, axis=-1) + 1
    share = np.mean(dominant == 5)
    return Finding(f"order 5 leads at {share:.0%} of the teeth", bool(share == 1.0))


def star_harmonics(runs: Runs) -> Array:
    """Radial harmonics (orders,) in m at carrier angle 0, no errors."""
    return np.abs(radial_harmonics(runs.star["tooth_displacement"].to_numpy()[0]))[:21]
