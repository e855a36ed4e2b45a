"""Time scales of a case, and default time steps, samples, modes and durations.

Gear meshes excite at orders of the gear-mesh frequency f_z, up to the order n of the case. The
inertias of two gears vibrate on the stiffness of their gear mesh at

    f_E = √(k̄/m_red)/2π,   1/m_red = r_b1²/J_1 + r_b2²/J_2

(ISO 6336-1:2019, resonance speed of method B; a held gear has J → ∞). The band is the larger of
n f_z and the lowest f_E: tooth loads are amplified near f_E, and a torque step excites it; gears
with a higher f_E follow statically. Above the highest f_E inertia isolates: vibration by a given
transmission error of frequency f has (f_E/f)² of its static force. So by default n is 10 for gears
up to their highest f_E, 10 (f_E/f_z)² above it, but at least 3. Defaults are fractions of the
period at the top of the band: average acceleration lengthens periods by (ωh)²/12, 0.2 % with
forty steps a period; with eight samples a period peaks of tooth loads are one per cent low. After a
torque step a hundred periods are computed with the finer step. So cases of any size and speed have
the same steps a period.

Bodies that only gear meshes tie to the fast stages of a train have the band of the stages that they
belong to, if no key of the solver states one: the ring of a slow stage answers for orders of its
own gear mesh, not of a generator's pinion, whose vibration reaches it through the inertia of the
members between. Above its band a body follows statically. Bodies with sensors have the band of the
recorder.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from flexgear.coupling.connections import flanks
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.machine import TorqueDrops, machines_of, series_of
from flexgear.model.names import BodyName, MemberName
from flexgear.model.solver import GEAR_MESH_ORDERS, MAX_STEP_HALVINGS, Solver
from flexgear.model.train import shafts

STEPS = 40  # in steady running, per period at the top of the band
FINE_STEPS = 100  # after a torque step, per period at the top of the band
SAMPLES = 8  # stored, per period at the top of the band
PERIODS = 100  # of the lowest f_E that a transient lasts, by which it decays to e^(-2π 100 ζ)
SHORTEST, LONGEST = 40, 4  # steady step over the shortest, longest over the steady step
ACCURACY = 0.01  # of the contact's flexibility, by default
LEAST_ORDERS = 3  # that are resolved however fast the gears turn
RECOVERY = 2.0  # time constants of the speed after a torque drop: 7/8 of the dip is recovered
ENOUGH_STEPS, ENOUGH_SAMPLES = 10, 2  # per period of the highest order, to resolve it
LEAST_STEPS = 2  # per period of f_E; with fewer the solution oscillates from step to step
ROUNDING = 1e-9  # relative, of values given with all digits
LOWER = 0.9  # share of the highest band below which members have one of their own


@dataclass(frozen=True)
class Pace:
    """Time steps, samples and modes of one case, given or derived; s and Hz.

    gear_mesh: highest gear-mesh frequency; orders: number of its orders that are resolved;
    resonance: lowest f_E; band: highest frequency of the modes; settling: duration of a transient
    after a torque step; start_up: duration excluded from steady results; modes_to, modes_accuracy:
    None if not used; series: members whose machine or load follows a time series, during which the
    step is series_time_step; reasons: explanation by name of a derived value; member_bands: band of
    members whose band is lower.
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
    member_bands: Mapping[str, float]

    def band_of(self, body: BodyName) -> float:
        """Highest frequency of the modes of a body, Hz."""
        return self.member_bands.get(body.member, self.band)

    def reduction_limit_of(self, body: BodyName) -> float:
        """Frequency up to which a reduced body is compared with the unreduced one, Hz."""
        return self.band_of(body) if "reduction_limit" in self.reasons else self.reduction_limit

    @property
    def band_note(self) -> str:
        """Bands of the members whose band is lower than that of the train; "" without any."""
        names = [f"{name} {band:.4g} Hz" for name, band in self.member_bands.items()]
        return f"{', '.join(names)}; solver.modes_band_hz states one for all" if names else ""

    @property
    def highest_frequency(self) -> float:
        """Highest frequency that results resolve, Hz."""
        return self.orders * self.gear_mesh

    @property
    def figures(self) -> dict[str, float]:
        """Figures for ``check``, summaries and datasets; names end in units."""
        lower = self.member_bands.values()
        values = {
            "gear_mesh_frequency_hz": self.gear_mesh,
            "gear_mesh_orders": self.orders,
            "gear_mesh_resonance_hz": self.resonance,
            "modes_band_hz": self.band,
            **({"lowest_modes_band_hz": min(lower)} if lower else {}),
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
    def summary(self) -> dict[str, Any]:
        """Figures, and reasons of derived values."""
        return {**self.figures, "reasons": self.reasons}


def case_pace(case: Case) -> Pace:
    """Pace of a case at rated speeds."""
    flow, resonances = power_flow(case), dict[str, list[float]]()
    for stage in case.stages:
        view, forces = case.view(stage.name), flow.stage(stage.name).gear_mesh_forces
        resonances[stage.name] = [
            math.sqrt(path.mean_stiffness / mass) / (2 * math.pi)
            for path, mass in flanks(view, stage_paths(view, forces))
        ]
    highest = max(stage.gear_mesh_frequency for stage in flow.stages)
    every = [frequency for of_stage in resonances.values() for frequency in of_stage]
    pace = _pace(highest, every, case.solver, series_of(case))
    stated = case.solver.modes_band or case.solver.modes_to
    if stated or not case.flexible_stages or case.housing.kind != "rigid":
        return pace
    orders = case.solver.static_orders
    stages = {
        name: max(orders * flow.stage(name).gear_mesh_frequency, min(of_stage))
        for name, of_stage in resonances.items()
    }
    pace = replace(pace, member_bands=_lower_bands(case, stages, pace.band))
    reasons = {"lowest_modes_band": pace.band_note} if pace.member_bands else {}
    return replace(pace, reasons=pace.reasons | reasons)


def _lower_bands(case: Case, stages: Mapping[str, float], highest: float) -> dict[str, float]:
    """Bands of members that are well below the highest, Hz: the largest ``stages`` of all members
    that bearings and joints tie to one another, or the recorder's if one of them has a sensor."""
    bands, ties = dict[str, float](), [(joint.first, joint.second) for joint in case.joints]
    for stage in case.stages:
        parts = stage.members
        if stage.kind == "planetary":
            parts = (*parts, "planet")
            ties.append((f"{stage.name}.planet", f"{stage.name}.carrier"))
        bands |= {MemberName.of(stage.name, part): stages[stage.name] for part in parts}
    for sensor in case.sensors:
        member = BodyName.parse(sensor.on).member
        for name in [member] if member in bands else bands:  # a joint, or a support
            bands[name] = max(bands[name], case.recorder.band or highest)
    first = shafts(list(bands), ties)
    largest = {name: max(bands[m] for m in bands if first[m] == first[name]) for name in bands}
    return {name: band for name, band in largest.items() if band < LOWER * highest}


def timed_drops(case: Case) -> TorqueDrops:
    """Torque drops of a case with all times, s. Defaults: settling before and during the drop;
    after it two time constants of the speed (``speed_time_constant``), at most one turn of the
    first input and at least settling."""
    steps, settling = case.drive.steps, case_pace(case).settling
    speed = abs(power_flow(case).speed[case.inputs[0].member])
    turn = 2 * math.pi / speed if speed else math.inf
    after = max(settling, min(RECOVERY * speed_time_constant(case), turn))
    return steps.model_copy(
        update={
            "start": settling if steps.start is None else steps.start,
            "duration": settling if steps.duration is None else steps.duration,
            "after": after if steps.after is None else steps.after,
        }
    )


def speed_time_constant(case: Case) -> float:
    """Time constant τ = Σ J_p ω_p² / Σ n P of the speed against brakes with T ~ ωⁿ, s. J_p:
    inertias at the ports; P: powers of the brakes. inf without brakes, for n = 0 and at zero
    speed."""
    flow = power_flow(case)
    brake_power = sum(
        machine.brake_exponent * abs(flow.power[port.member])
        for port, machine in zip(case.ports, machines_of(case), strict=True)
        if machine is not None and machine.law == "brake"
    )
    if brake_power == 0:
        return math.inf
    ports = [port.member for port in case.ports]
    twice_kinetic = sum(case.port_inertia(member) * flow.speed[member] ** 2 for member in ports)
    return twice_kinetic / brake_power


def _pace(
    gear_mesh: float, resonances: Sequence[float], solver: Solver, series: tuple[str, ...]
) -> Pace:
    """Pace from the highest gear-mesh frequency and the f_E of all gear meshes, Hz."""
    resonance, last_resonance, reasons = min(resonances), max(resonances), dict[str, str]()
    orders = solver.static_orders
    if solver.gear_mesh_orders is None and gear_mesh > last_resonance:
        share = (last_resonance / gear_mesh) ** 2
        orders = max(LEAST_ORDERS, math.floor(orders * share))
        reasons["gear_mesh_orders"] = (
            f"at least {LEAST_ORDERS}, else {GEAR_MESH_ORDERS} times {share:.2g}, the share of "
            f"vibratory forces that inertia leaves above the gears' last resonance on a gear mesh, "
            f"{last_resonance:.5g} Hz"
        )
    highest = orders * gear_mesh

    def chosen(name: str, default: float, reason: str, key: str = "") -> float:
        value = getattr(solver, key or name)
        if value is None:
            reasons[name] = reason
            return default
        return float(value)

    by_order = f"order {orders} of the gear-mesh frequency of {gear_mesh:.5g} Hz"
    by_inertia = f"gears vibrate on their gear mesh at {resonance:.5g} Hz"
    reason = by_order if highest > resonance else by_inertia
    band = chosen("modes_band", max(highest, resonance), reason)
    top = f"of the band's top, {band:.5g} Hz"
    step = chosen("time_step", 1 / (STEPS * band), f"1/{STEPS} of a period {top}")
    longest = chosen("longest_time_step", LONGEST * step, f"{LONGEST} steps of steady running")
    least = min(longest, max(step / SHORTEST, longest / 2**MAX_STEP_HALVINGS))
    shortest = chosen("shortest_time_step", least, f"1/{SHORTEST} step of steady running")
    fine = chosen(
        "step_time_step", min(step, 1 / (FINE_STEPS * band)), f"1/{FINE_STEPS} of a period {top}"
    )
    in_series = step if solver.time_step is not None and solver.step_time_step is None else fine
    if series:
        key = "time_step" if in_series == step else "step_time_step"
        reasons["series_time_step"] = f"{key}, during the series of {' and '.join(series)}"
    accuracy = solver.modes_accuracy
    if solver.modes_to is None and accuracy is None:
        accuracy = ACCURACY
        reasons["modes_accuracy"] = "for flexible bodies; rigid ones keep all modes"
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
        member_bands={},
    )  # fmt: skip


def pace_sections(pace: Pace, solver: Solver) -> dict[str, dict[str, Any]]:
    """Sections of ``check``: figures, reasons of derived values, warnings of coarse settings."""
    sections: dict[str, dict[str, Any]] = {"solver": pace.figures, "solver_reasons": pace.reasons}
    notes = too_coarse(pace, solver)
    if notes:
        sections["too_coarse"] = {str(k): note for k, note in enumerate(notes, 1)}
    return sections


def too_coarse(pace: Pace, solver: Solver) -> list[str]:
    """Warnings about settings of the solver that do not resolve the orders of a case."""
    order = f"order {pace.orders} of the gear-mesh frequency is {pace.highest_frequency:.5g} Hz"
    vibration = f"gears vibrate on their gear mesh at {pace.resonance:.5g} Hz"
    notes = list[str]()

    def warn(key: str, value: float, fault: str, remedy: str) -> None:
        notes.append(f"solver.{key} = {value:.4g} is {fault}; {remedy}, or leave it out")

    steps = {order: ENOUGH_STEPS * pace.highest_frequency, vibration: LEAST_STEPS * pace.resonance}
    reason, least = max(steps.items(), key=lambda item: item[1])
    fixed_steps = solver.step_tolerance == 0.0
    if fixed_steps and pace.time_step * least > 1 + ROUNDING:
        warn("time_step_s", pace.time_step, f"too coarse: {reason}", f"at most {1 / least:.3g} s")
    finest = FINE_STEPS * pace.band
    if fixed_steps and pace.series and pace.series_time_step * finest > 1 + ROUNDING:
        warn(
            "time_step_s" if solver.step_time_step is None else "step_time_step_s",
            pace.series_time_step,
            f"the step during the series of {' and '.join(pace.series)}, and too coarse for "
            f"changes at the top of the band, {pace.band:.5g} Hz",
            f"at most {1 / finest:.3g} s",
        )
    least = ENOUGH_SAMPLES * pace.highest_frequency
    if pace.output_interval * least > 1 + ROUNDING:
        fault = f"too coarse: {order}, and samples miss peaks"
        warn("output_interval_s", pace.output_interval, fault, f"at most {1 / least:.3g} s")
    modes = min(pace.band, pace.modes_to or math.inf)
    if modes < pace.highest_frequency:
        key = "modes_to_hz" if modes != pace.band else "modes_band_hz"
        warn(key, modes, f"too low: {order}", "raise it")
    if solver.duration is not None and 0 < solver.duration * pace.gear_mesh < 1:
        period = f"the period of the gear mesh is {1 / pace.gear_mesh:.3g} s"
        warn("duration_s", solver.duration, f"too short: {period}", "raise it")
    return notes
