r"""Time scales of a case, and the steps, samples, modes and durations that follow from them.

Two frequencies are in every case. The gear meshes excite at the orders of their frequency f_z, of
which results are wanted up to n; the inertias of two gears swing on the stiffness of their gear
mesh at

    f_E = √(k̄/m_red)/2π,   1/m_red = r_b1²/J_1 + r_b2²/J_2

(ISO 6336-1:2019, resonance speed of method B; a held gear has J → ∞). The band is the larger of
n f_z and the lowest f_E: tooth loads amplify what lies about f_E, and a jump of the torque sets it
going; gears that swing faster than all that is asked for follow statically. Everything else are
shares of the band's period: average acceleration lengthens periods by (ωh)²/12, 0.2 % at the top
of the band with forty steps a period; peaks of tooth loads are a per cent low with eight samples.
After a jump a hundred periods pass with the finer step.
Nothing here has a unit of its own: a case of another size and speed gets the same steps a period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from flexgear.coupling.connections import flanks
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.machine import TorqueDrops, machines_of, series_of
from flexgear.model.solver import MOST_REFINED, Solver

STEPS = 40  # a period of the band's top in steady running
FINE_STEPS = 100  # the same near a jump of the torque
SAMPLES = 8  # stored, a period of the band's top
PERIODS = 100  # of the slowest gear mesh's own vibration, which a jump may last; e^(-2π 100 ζ)
SHORTEST, LONGEST = 40, 4  # a steady step over the shortest one, the longest over a steady one
ACCURACY = 0.01  # of the contact's flexibility, where no modes are asked for
REGAINED = 2.0  # time constants of the speed after a torque drop: seven eighths
ENOUGH_STEPS, ENOUGH_SAMPLES = 10, 2  # a period of what is asked for: fewer do not show it
EVEN = 1e-9  # of a number that was given to the last digit
LEAST_STEPS = 2  # a period of f_E: fewer and gears ring from step to step


@dataclass(frozen=True)
class Pace:
    """Numbers of one case, as given or derived; s and Hz.

    gear_mesh: highest gear mesh frequency; orders: wanted of it; resonance: lowest own frequency
    f_E of a gear mesh; band: up to which the modes must answer; settling: after a jump; start_up:
    left out of what is steady; modes_to, modes_accuracy: None where not asked for; series: members
    whose machine or load follows one, and the step under it; reasons: why, by name of a derived
    value.
    """

    gear_mesh: float
    orders: int
    resonance: float
    band: float
    time_step: float
    step_time_step: float
    series_time_step: float
    shortest_time_step: float
    longest_time_step: float
    output_interval: float
    settling: float
    start_up: float
    modes_to: float | None
    modes_accuracy: float | None
    reduction_limit: float
    series: tuple[str, ...]
    reasons: dict[str, str]

    @property
    def highest_frequency(self) -> float:
        """Highest frequency that results are wanted for, Hz."""
        return self.orders * self.gear_mesh

    @property
    def figures(self) -> dict[str, float]:
        """Figures of `check`, summaries and datasets; names end in units."""
        values = {
            "gear_mesh_frequency_hz": self.gear_mesh,
            "gear_mesh_orders": self.orders,
            "gear_mesh_resonance_hz": self.resonance,
            "modes_band_hz": self.band,
            "time_step_s": self.time_step,
            "step_time_step_s": self.step_time_step,
            "output_interval_s": self.output_interval,
            "settling_s": self.settling,
            "start_up_s": self.start_up,
            "reduction_limit_hz": self.reduction_limit,
        }
        if self.series:
            values["series_time_step_s"] = self.series_time_step
        if self.modes_accuracy is not None:
            values["modes_accuracy"] = self.modes_accuracy
        return values

    @property
    def modes_by_default(self) -> bool:
        """Whether the case leaves open which modes are kept."""
        return "modes_accuracy" in self.reasons

    @property
    def summary(self) -> dict[str, Any]:
        """Figures, and reasons of the derived ones."""
        return {**self.figures, "reasons": self.reasons}


def case_pace(case: Case) -> Pace:
    """Pace of a case at its rated speeds: of its fastest gear mesh."""
    flow, resonances = power_flow(case), list[float]()
    for stage in case.stages:
        view, forces = case.view(stage.name), flow.stage(stage.name).gear_mesh_forces
        for path, mass in flanks(view, stage_paths(view, forces)):
            resonances.append(math.sqrt(path.mean_stiffness / mass) / (2 * math.pi))
    highest = max(stage.gear_mesh_frequency for stage in flow.stages)
    return _pace(highest, min(resonances), case.solver, series_of(case))


def timed_drops(case: Case) -> TorqueDrops:
    """The case's torque drops with all their times, s. Defaults: settling before the drop and
    during it; after it until the speed has regained seven eighths of its dip, but at most a turn of
    the first input."""
    steps, settling = case.drive.steps, case_pace(case).settling
    speed = abs(power_flow(case).speed[case.inputs[0].member])
    turn = 2 * math.pi / speed if speed else math.inf
    after = max(settling, min(REGAINED * speed_time_constant(case), turn))
    return steps.model_copy(
        update={
            "start": settling if steps.start is None else steps.start,
            "duration": settling if steps.duration is None else steps.duration,
            "after": after if steps.after is None else steps.after,
        }
    )


def speed_time_constant(case: Case) -> float:
    """τ = Σ J_p ω_p² / Σ n P of speed against brakes T ~ ωⁿ, s: inertias J_p at the ports, powers P
    of the brakes; inf without brakes, for n = 0 and at zero speed."""
    flow = power_flow(case)
    taken = sum(
        machine.brake_exponent * abs(flow.power[port.member])
        for port, machine in zip(case.ports, machines_of(case), strict=True)
        if machine is not None and machine.law == "brake"
    )
    if taken == 0:
        return math.inf
    ports = [port.member for port in case.ports]
    twice_kinetic = sum(case.port_inertia(member) * flow.speed[member] ** 2 for member in ports)
    return twice_kinetic / taken


def _pace(gear_mesh: float, resonance: float, solver: Solver, series: tuple[str, ...]) -> Pace:
    """Steps, samples and modes from the highest gear-mesh frequency and the lowest f_E, Hz."""
    orders = solver.gear_mesh_orders
    highest, reasons = orders * gear_mesh, {}

    def chosen(name: str, derived: float, why: str, key: str = "") -> float:
        value = getattr(solver, key or name)
        if value is None:
            reasons[name] = why
            return derived
        return float(value)

    by_order = f"order {orders} of the gear mesh frequency of {gear_mesh:.5g} Hz"
    by_inertia = f"gears of these inertias swing on their gear mesh at {resonance:.5g} Hz"
    why = by_order if highest > resonance else by_inertia
    band = chosen("modes_band", max(highest, resonance), why)
    top = f"of the band's top, {band:.5g} Hz"
    step = chosen("time_step", 1 / (STEPS * band), f"1/{STEPS} of a period {top}")
    longest = chosen("longest_time_step", LONGEST * step, f"{LONGEST} steps of steady running")
    least = min(longest, max(step / SHORTEST, longest / 2**MOST_REFINED))
    shortest = chosen("shortest_time_step", least, f"1/{SHORTEST} step of steady running")
    fine = chosen(
        "step_time_step", min(step, 1 / (FINE_STEPS * band)), f"1/{FINE_STEPS} of a period {top}"
    )
    in_series = step if solver.time_step is not None and solver.step_time_step is None else fine
    if series:
        key = "time_step" if in_series == step else "step_time_step"
        reasons["series_time_step"] = f"{key}, under what {' and '.join(series)} follows"
    accuracy = solver.modes_accuracy
    if solver.modes_to is None and accuracy is None:
        accuracy = ACCURACY
        reasons["modes_accuracy"] = "where bodies bend; rigid ones keep all modes"
    settling = PERIODS / min(band, resonance)
    by_periods = f"{PERIODS} periods of {min(band, resonance):.5g} Hz"
    reasons["settling"] = by_periods
    return Pace(
        gear_mesh=gear_mesh,
        orders=orders,
        resonance=resonance,
        band=band,
        time_step=step,
        step_time_step=fine,
        series_time_step=in_series,
        shortest_time_step=shortest,
        longest_time_step=longest,
        output_interval=chosen("output_interval", 1 / (SAMPLES * band),
                               f"1/{SAMPLES} of a period {top}"),
        settling=settling,
        start_up=chosen("start_up", settling, by_periods, "settle"),
        modes_to=solver.modes_to,
        modes_accuracy=accuracy,
        reduction_limit=chosen("reduction_limit", band, "the band of the modes"),
        series=series,
        reasons=reasons,
    )  # fmt: skip


def pace_sections(pace: Pace, solver: Solver) -> dict[str, dict[str, Any]]:
    """Sections of `check`: figures, reasons of the derived ones, and warnings of coarse
    settings."""
    sections: dict[str, dict[str, Any]] = {"solver": pace.figures, "solver_reasons": pace.reasons}
    notes = too_coarse(pace, solver)
    if notes:
        sections["too_coarse"] = {str(k): note for k, note in enumerate(notes, 1)}
    return sections


def too_coarse(pace: Pace, solver: Solver) -> list[str]:
    """Settings of the case that do not resolve its orders, one line each."""
    order = (
        f"order {pace.orders} of the gear mesh frequency lies at {pace.highest_frequency:.5g} Hz"
    )
    swing = f"gears swing on their gear mesh at {pace.resonance:.5g} Hz"
    notes = list[str]()

    def say(key: str, value: float, fault: str, remedy: str) -> None:
        notes.append(f"solver.{key} = {value:.4g} is {fault}; {remedy}, or leave it out")

    steps = {order: ENOUGH_STEPS * pace.highest_frequency, swing: LEAST_STEPS * pace.resonance}
    why, least = max(steps.items(), key=lambda item: item[1])
    if solver.step_tolerance == 0.0 and pace.time_step * least > 1 + EVEN:
        say("time_step_s", pace.time_step, f"too coarse: {why}", f"at most {1 / least:.3g} s")
    finest = FINE_STEPS * pace.band
    if pace.series and solver.step_tolerance == 0.0 and pace.series_time_step * finest > 1 + EVEN:
        say(
            "time_step_s" if solver.step_time_step is None else "step_time_step_s",
            pace.series_time_step,
            f"taken under the series that {' and '.join(pace.series)} follows, and is too coarse "
            f"for what changes there as fast as the band's top of {pace.band:.5g} Hz",
            f"at most {1 / finest:.3g} s",
        )
    least = ENOUGH_SAMPLES * pace.highest_frequency
    if pace.output_interval * least > 1 + EVEN:
        fault = f"too coarse: {order}, and peaks fall between the samples"
        say("output_interval_s", pace.output_interval, fault, f"at most {1 / least:.3g} s")
    modes = min(pace.band, pace.modes_to or math.inf)
    if modes < pace.highest_frequency:
        key = "modes_to_hz" if modes != pace.band else "modes_band_hz"
        say(key, modes, f"too low: {order}", "raise it")
    if solver.duration is not None and 0 < solver.duration * pace.gear_mesh < 1:
        period = f"a period of the gear mesh takes {1 / pace.gear_mesh:.3g} s"
        say("duration_s", solver.duration, f"too short: {period}", "raise it")
    return notes
