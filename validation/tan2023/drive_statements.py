"""Statements about speed and load sharing: Figures 10, 19, 25."""

from collections.abc import Callable
from functools import partial

import numpy as np
import xarray as xr

from flexgear.analysis.step_plan import Stepping
from flexgear.analysis.transient import Drive, run_in_memory
from flexgear.arrays import Array
from flexgear.coupling.modal import ModalSystem
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from flexgear.results.load_sharing import LEAST_SHARE, load_sharing
from flexgear.results.stage_part import of_kind, pairs_of, ring_force_spread, ring_sharing
from tan2023 import measures
from tan2023.findings import Finding, reference, statement
from tan2023.measures import RPM
from tan2023.runs import (
    DROPS,
    EIGHT,
    FLEXIBLE,
    RIGID,
    SHORT_START,
    Runs,
    Variant,
    label,
    model_of,
    side_by_side,
)


def inertias(runs: Runs) -> str:
    """The inertias that decide how the speed moves."""
    case = runs.case.case
    drive, output = (case.port_inertia(port.member) for port in case.ports)
    return (
        f"drive {drive:.3g} kg m², output {output:.3g} kg m² at the sun's shaft, "
        f"brake torque ~ speed^{case.output.brake_exponent:g} (all chosen)"
    )


@statement(10, published="speed settles at 11.27 r/min", tolerance="mean of a revolution, 0.1 %")
def speed_is_rated(runs: Runs) -> Finding:
    expected = reference()["carrier_speed"]
    mean = float(runs.steady["flexible"]["stage_speed"].mean()) * RPM
    assert expected.tolerance is not None
    return Finding(
        f"{mean:.4f} r/min; {inertias(runs)}",
        bool(abs(mean / expected.value - 1) <= expected.tolerance),
    )


@statement(
    10,
    published="from the start the speed rises to the rated one and stays",
    tolerance="settling time within 2 % of J/c",
)
def speed_settles_as_inertia_over_damping(runs: Runs) -> Finding:
    up = runs.start_up
    tau = up.inertia / up.damping
    time = up.data["time"].to_numpy()
    late = time > 0.25 * tau
    decay = measures.decay_time(time[late], up.train_speed[late], runs.case.case.inputs[0].speed)
    return Finding(
        f"{decay:.4f} s against J/c = {up.inertia:.4g}/{up.damping:.4g} = {tau:.4f} s",
        bool(abs(decay / tau - 1) < 0.02),
    )


@statement(
    10,
    published="(not in the paper) speed at half torque",
    tolerance="brake law within 0.1 %",
)
def half_torque_follows_the_brake(runs: Runs) -> Finding:
    n = runs.case.case.output.brake_exponent
    expected = 0.5 ** (1 / n) * runs.case.case.inputs[0].speed * RPM
    speed = runs.half_torque["stage_speed"].to_numpy()[-1000:]
    weight = np.hanning(len(speed))  # torsional vibration dies slowly and has no mean
    mean = float(weight @ speed / weight.sum()) * RPM
    return Finding(
        f"{mean:.4f} r/min against {expected:.4f}, mean of the last second",
        bool(abs(mean / expected - 1) < 1e-3),
    )


@statement(
    10,
    published="the deeper the torque drop, the larger the fluctuation of speed",
    tolerance="lowest speeds in order 2e6, 4e5, 2e5 N m",
)
def dips_grow_with_the_drop(runs: Runs) -> Finding:
    low = [float(runs.drops[t]["stage_speed"].min()) * RPM for t in DROPS]
    text = ", ".join(f"{t:.1g} N m: {v:.2f}" for t, v in zip(DROPS, low, strict=True))
    return Finding(f"lowest speed in r/min, {text}", bool(low[0] > low[1] > low[2]))


def _steady_forces(runs: Runs, case: StageView, modal: ModalSystem) -> Array:
    """Ring gear-mesh forces (t, N) over a fifth of a revolution, started at equilibrium."""
    torque = case.case.inputs[0].torque
    span = 2 * np.pi / 5 / case.case.inputs[0].speed
    drive = Drive(lambda t: np.full_like(t, torque))
    run = run_in_memory(modal, drive, Stepping(span, 1e-4, 1e-3))
    ring = [label.kind == "ring" for label in modal.system.gear_meshes]
    return np.asarray(run.pair_load[:, ring].sum(axis=-1))


def error_sets(runs: Runs) -> dict[str, StageView]:
    """Cases that differ in manufacturing errors only."""
    return {
        "no errors": runs.perfect_case,
        "tooth errors of the case": runs.case,
        "and pin 1 off by 30 µm": runs.case.with_(
            **{"stage.errors.pin_tangential": (30e-6, 0.0, 0.0, 0.0, 0.0)}
        ),
    }


def steady_sharing(runs: Runs) -> dict[str, dict[str, tuple[float, float]]]:
    """Mean and largest K by error set and variant."""

    def compute() -> dict[str, dict[str, tuple[float, float]]]:
        mean_force = power_flow(runs.case.case).stages[0].ring_gear_mesh_force
        sets = error_sets(runs)
        jobs: dict[str, Callable[[], Array]] = {}
        for name, case in sets.items():
            for v in EIGHT:
                modal = runs.erroneous(case, v).modal
                jobs[f"{name}|{label(v)}"] = partial(_steady_forces, runs, case, modal)
        factors: dict[str, dict[str, tuple[float, float]]] = {name: {} for name in sets}
        for key, force in side_by_side(jobs).items():
            name, bends = key.split("|")
            k = load_sharing(force, mean_force)
            factors[name][bends] = (float(np.nanmean(k)), float(np.nanmax(k)))
        return factors

    return runs.once("steady_sharing", compute)


@statement(
    19,
    published="steady load sharing is worse (K larger) when bodies bend",
    tolerance="reported without a demanded sign: eight variants, with and without errors",
)
def steady_sharing_by_variant(runs: Runs) -> Finding:
    study = steady_sharing(runs)
    text = "; ".join(
        f"{name}: flexible {v['flexible'][0]:.4f}, rigid {v['rigid'][0]:.4f}"
        for name, v in study.items()
    )
    worse = [n for n, v in study.items() if v["flexible"][0] > v["rigid"][0]]
    return Finding(
        f"mean K, {text}; flexible above rigid in {len(worse)} of {len(study)} sets of errors",
        None,
        "bending bodies even out what errors and gear-mesh phases put unevenly; the sign depends "
        "on which bodies are rigid, on errors and damping",
    )


@statement(
    25,
    published="the torque step raises K markedly",
    tolerance="largest K in the drop above the largest steady one",
)
def sharing_worsens_in_the_drop(runs: Runs) -> Finding:
    steady = float(np.nanmax(ring_sharing(runs.steady["flexible"])))
    drop = float(np.nanmax(ring_sharing(runs.main_drop["flexible"])))
    return Finding(f"largest K {steady:.3f} steady, {drop:.3f} in the drop", bool(drop > steady))


@statement(
    25,
    published="in the drop load sharing is better when bodies bend than when they are rigid",
    tolerance="largest spread (max − min)/rated mean from the drop on, flexible below all-rigid",
)
def spread_is_smaller_when_flexible(runs: Runs) -> Finding:
    start = runs.case.case.drive.steps.start
    spread = {n: transient_spread(d, start) for n, d in runs.main_drop.items()}
    k = {n: float(np.nanmax(ring_sharing(d))) for n, d in runs.main_drop.items()}
    return Finding(
        f"spread {spread['flexible']:.4f} flexible, {spread['rigid']:.4f} rigid; "
        f"largest K {k['flexible']:.3f} and {k['rigid']:.3f}",
        bool(spread["flexible"] < spread["rigid"]),
    )


@statement(
    25,
    published="(not in the paper) the same for the bundled case as it is: one-sided contact, "
    "heavier drive",
    tolerance="spread, flexible below all-rigid; no negative tooth load",
)
def bundled_case_agrees(runs: Runs) -> Finding:
    case = load_case("wind-5mw", overrides={"solver.fidelity": runs.fidelity}).view()

    def one(v: Variant) -> xr.Dataset:
        return runs.short_drop(model_of(case, runs.bodies, v), 4e5)

    variants = side_by_side({label(v): partial(one, v) for v in (FLEXIBLE, RIGID)})
    spread = {n: transient_spread(d, SHORT_START) for n, d in variants.items()}
    pairs = [pairs_of(d, g, "drive") for d in variants.values() for g in ("ring", "sun")]
    lowest = min(float(p["load"].min()) for p in pairs)
    return Finding(
        f"drive {case.case.inputs[0].inertia:.3g} kg m²: spread {spread['flexible']:.4f} flexible, "
        f"{spread['rigid']:.4f} rigid; lowest tooth load {lowest:.1f} N",
        bool(spread["flexible"] < spread["rigid"] and lowest >= 0),
    )


@statement(
    25,
    published="(not in the paper) K has no meaning where the gear-mesh force passes zero",
    tolerance="never evaluated below 3 % of rated ΣF",
)
def sharing_is_not_evaluated_without_load(runs: Runs) -> Finding:
    rated = power_flow(runs.case.case).stages[0].ring_gear_mesh_force * runs.case.stage.planets
    left_out, good = 0, True
    for data in (*runs.main_drop.values(), *runs.drops.values()):
        total = np.abs(of_kind(data, "ring")["gear_mesh_force"].sum("gear_mesh").to_numpy())
        low = total < LEAST_SHARE * rated
        k = ring_sharing(data).to_numpy()
        good &= bool(np.all(np.isnan(k[low])) and np.all(np.isfinite(k[~low])))
        left_out += int(low.sum())
    return Finding(f"{left_out} samples left out of all drops", good and left_out > 0)


def transient_spread(data: xr.Dataset, start: float) -> float:
    """Largest force spread (max − min)/rated mean from a torque drop at ``start`` s on."""
    return float(ring_force_spread(data).sel(time=slice(start, None)).max())


def drop_spread(runs: Runs) -> dict[str, float]:
    """Largest force spread over a drop to 4e5 N m by variant, errors of the case."""

    def compute() -> dict[str, float]:
        def one(v: Variant) -> float:
            return transient_spread(runs.short_drop(runs.model(v), 4e5), SHORT_START)

        for v in EIGHT:
            runs.modal(v)
        return side_by_side({label(v): partial(one, v) for v in EIGHT})

    return runs.once("drop_spread", compute)


@statement(
    25,
    published="the ring's flexibility is what absorbs the shock",
    tolerance="reported: spread by variant",
)
def spread_by_variant(runs: Runs) -> Finding:
    spreads = drop_spread(runs)
    return Finding(
        "largest spread in a drop at 0.05 s: "
        + ", ".join(f"{n} {v:.4f}" for n, v in spreads.items()),
        None,
        "which body absorbs the shock is seen by comparing the variants with one body rigid",
    )
