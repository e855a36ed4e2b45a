"""Lines that spectra of a train are expected to have: gear meshes, planets, shafts, bearings.

Frequencies are what a sensor hears that turns with ω_sensor about the axis (0: on the housing).

Gear mesh of a planetary stage: f_m = z_r |ω_c − ω_r|/2π. N equal planets at φ_i give a sensor N
times one signal, one after the other, of the planet pass θ_c − θ_sensor + φ_i and of the phase of
their gear mesh z_r (θ_c − θ_r + φ_i). What is H times the gear mesh beside n times the pass

    f = |H z_r (ω_c − ω_r) + n (ω_c − ω_sensor)| / 2π

is a sum of N phasors of equal size, and its share of what N planets in phase would give is

    |Σ_i exp(j (H z_r + n) φ_i)| / N ,

for equal spacing 1 where (H z_r + n) mod N = 0 and else 0 (McFadden and Smith 1985, Proc. IMechE
199C:65). Planets that differ, ring errors that do not repeat with the planets, and a path of the
sound that depends on more than the pass bring the others.

A tooth of sun or ring meets planet i when the carrier has turned against it by φ_i: multiples k of
f_m/z with the share of N phasors at the order k, so N f_m/z for equal spacing. Forces of one gear
mesh have f_m/z and all its multiples, whatever the spacing. A planet's flank meets one gear once a
turn against the carrier, f_m/z_p; a root that gives way, ring and sun, twice.

Bearings: with γ = (d/D_pw) cos α, Z elements and f_r the speed of one ring against the other
(Harris, Rolling Bearing Analysis)

    outer Z f_r (1 − γ)/2,   inner Z f_r (1 + γ)/2,   spin of an element f_r (1 − γ²) D_pw/(2 d) ,

and the cage turns against the ring that stands still under the load, with f_r (1 + γ)/2 if that is
the inner one, f_r (1 − γ)/2 if the outer. Those of planets turn with the carrier: their inner ring
is the pin's. A defect of an element strikes both rings, so at twice its spin.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexgear.gears.bearings.nominal import bearing_speed
from flexgear.gears.power_flow import PowerFlow, StageFlow, power_flow
from flexgear.gears.radii import role_of
from flexgear.model.names import GEAR_MESH, PLANET_PASS, SHAFT

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.stage import Stage
    from flexgear.model.stage_view import BearingPlace, StageView

SIDEBAND, TOOTH_FAULT, BEARING = "sideband", "tooth fault", "bearing"
PASS = "pass"  # row of the line of all planets that pass
HARMONICS = 3  # of the gear mesh that are listed
SHOWN, WHOLE = 0.1, 0.995  # least share that tables show; one that needs no mention
CANCELLED = 1e-9  # share of N phasors that is rounding
SAME = 1e-9  # relative, of speeds that are one
TURN = 2 * math.pi


@dataclass(frozen=True)
class ExpectedLine:
    """A line of a spectrum at the speeds of a power flow.

    kind: "gear mesh", "sideband", "shaft", "planet pass", "tooth fault" or "bearing"; label: what
    it is, without its stage; frequency: Hz; share: of what N planets in phase would give, 1 where
    planets do not matter. harmonic: H of gear meshes and sidebands, else 0. row: what it is in a
    table of lines of its kind, the label if empty; bearing: whose line it is.
    """

    stage: str
    kind: str
    label: str
    frequency: float
    share: float = 1.0
    harmonic: int = 0
    row: str = ""
    bearing: str = ""

    def order(self, speed: float) -> float:
        """Order of the line over the rotation of a member at ``speed``, rad/s."""
        return TURN * self.frequency / abs(speed)


def phasor_share(order: float, angles: Sequence[float]) -> float:
    """|Σ exp(j order φ_i)|/N of planets at angles (N,) rad."""
    return float(abs(np.exp(1j * order * np.asarray(angles)).mean()))


def expected_lines(
    case: Case,
    flow: PowerFlow | None = None,
    *,
    harmonics: int = HARMONICS,
    sensor_speed: float = 0.0,
) -> tuple[ExpectedLine, ...]:
    """Expected lines of a case, stage by stage, without those of stationary parts; of lines that
    planets cancel only the orders of the gear mesh. harmonics: of the gear meshes; sensor_speed: of
    the body with the sensor, rad/s about +z."""
    speeds = power_flow(case) if flow is None else flow
    return tuple(
        line
        for at in speeds.stages
        for line in _of_stage(case.view(at.name), at, harmonics, sensor_speed)
        if line.frequency > 0.0 and (line.share > CANCELLED or line.kind == GEAR_MESH)
    )


def _of_stage(
    view: StageView, flow: StageFlow, harmonics: int, sensor: float
) -> Iterator[ExpectedLine]:
    teeth = _parallel if view.stage.kind == "parallel" else _planetary
    yield from teeth(view.stage, flow, harmonics, sensor)
    for place in view.bearings:
        speed = abs(bearing_speed(place, flow))
        turns = speed > SAME * abs(flow.carrier_speed)  # else the stage turns as one piece
        yield from _bearing(view.name, place, speed / TURN if turns else 0.0)


def _planetary(
    stage: Stage, flow: StageFlow, harmonics: int, sensor: float
) -> Iterator[ExpectedLine]:
    assert stage.ring is not None
    rolling = flow.carrier_speed - flow.ring_speed
    if abs(rolling) <= SAME * max(abs(flow.carrier_speed), abs(flow.ring_speed)):
        rolling = 0.0  # it turns as one piece
    gear_mesh = stage.ring.teeth * rolling / TURN
    passing = (flow.carrier_speed - sensor) / TURN
    for harmonic in range(1, harmonics + 1 if rolling else 1):
        yield from _sidebands(stage, gear_mesh, passing, harmonic)
    yield from shaft_lines(stage, flow, sensor)
    yield from pass_lines(stage, flow, sensor)
    yield from _tooth_faults(stage, abs(gear_mesh))


def shaft_lines(stage: Stage, flow: StageFlow, sensor: float = 0.0) -> Iterator[ExpectedLine]:
    """Turns of a stage's members against a sensor, labelled by their parts."""
    for part in stage.members:
        frequency = abs(getattr(flow, f"{role_of(part)}_speed") - sensor) / TURN
        yield ExpectedLine(stage.name, SHAFT, part, frequency)


def pass_lines(stage: Stage, flow: StageFlow, sensor: float) -> Iterator[ExpectedLine]:
    """Planets of a planetary stage that pass a sensor; row PASS: all N in a turn."""
    for order, share in _orders_of_planets(stage):
        row = PASS if order == stage.planets else f"{PASS}, order {order}"
        frequency = order * abs(flow.carrier_speed - sensor) / TURN
        yield ExpectedLine(stage.name, PLANET_PASS, f"planets {row}", frequency, share, row=row)


def _sidebands(
    stage: Stage, gear_mesh: float, passing: float, harmonic: int
) -> Iterator[ExpectedLine]:
    """Lines of one harmonic: the gear mesh itself and its sidebands, up to the rate of N turns
    of the carrier beside it."""
    if abs(passing) * TURN < SAME * abs(gear_mesh):  # planets stay where they are: none cancels
        yield _order(stage, harmonic, harmonic * abs(gear_mesh))
        return
    assert stage.ring is not None
    for n in range(-stage.planets, stage.planets + 1):
        share = phasor_share(harmonic * stage.ring.teeth + n, stage.planet_angles)
        frequency = abs(harmonic * gear_mesh + n * passing)
        sense = n if gear_mesh * passing > 0 else -n  # + is above the gear mesh
        turns = f"{'+' if sense > 0 else '−'}{abs(n)} carrier turn{'s' * (abs(n) > 1)}" if n else ""
        yield _order(stage, harmonic, frequency, share, turns)


def _order(
    stage: Stage, harmonic: int, frequency: float, share: float = 1.0, beside: str = ""
) -> ExpectedLine:
    """Line of a harmonic of the gear mesh, or of a sideband."""
    kind, row = (SIDEBAND, beside) if beside else (GEAR_MESH, f"order {harmonic}")
    label = f"gear mesh {harmonic} {beside}".rstrip()
    return ExpectedLine(stage.name, kind, label, frequency, share, harmonic, row)


def _orders_of_planets(stage: Stage) -> Iterator[tuple[int, float]]:
    """Orders up to N at which N planets do not cancel, and their shares."""
    for order in range(1, stage.planets + 1):
        share = phasor_share(order, stage.planet_angles)
        if share > CANCELLED:
            yield order, share


def _tooth_faults(stage: Stage, gear_mesh: float) -> Iterator[ExpectedLine]:
    assert stage.sun is not None and stage.ring is not None and stage.planet is not None
    for part, gear in (("sun", stage.sun), ("ring", stage.ring)):
        for order, share in _orders_of_planets(stage):
            row = part if order == stage.planets else f"{part}, order {order}"
            frequency = order * gear_mesh / gear.teeth
            yield ExpectedLine(
                stage.name, TOOTH_FAULT, f"tooth of {row}", frequency, share, row=row
            )
        if stage.planets > 1:
            row = f"{part} at one gear mesh"
            yield ExpectedLine(
                stage.name, TOOTH_FAULT, f"tooth of {row}", gear_mesh / gear.teeth, row=row
            )
    for times, label in ((1, "flank of a planet"), (2, "tooth root of a planet")):
        frequency = times * gear_mesh / stage.planet.teeth
        yield ExpectedLine(stage.name, TOOTH_FAULT, label, frequency)


def _parallel(
    stage: Stage, flow: StageFlow, harmonics: int, sensor: float
) -> Iterator[ExpectedLine]:
    """Gear mesh with sidebands of both shafts, whose turns are those of their tooth faults."""
    speeds = {"pinion": flow.sun_speed, "gear": flow.planet_speed}
    for harmonic in range(1, harmonics + 1):
        centre = harmonic * flow.gear_mesh_frequency
        yield _order(stage, harmonic, centre)
        for part, speed in speeds.items():
            for sign, text in ((-1, "−"), (1, "+")):
                frequency = centre + sign * abs(speed) / TURN
                yield _order(stage, harmonic, frequency, beside=f"{text}{part}")
    yield from shaft_lines(stage, flow, sensor)
    for part, speed in speeds.items():
        fault = abs(speed) / TURN
        yield ExpectedLine(stage.name, TOOTH_FAULT, f"tooth of {part}", fault, row=part)


def _bearing(stage: str, place: BearingPlace, turns: float) -> Iterator[ExpectedLine]:
    """Lines of a bearing; none where its elements are not stated. turns: of one ring against the
    other, 1/s; the inner ring of a planet's bearing, the outer one of any other, is stationary."""
    elements, rollers = place.bearing.elements, place.bearing.rollers
    if elements is None:
        return
    count = elements.count if rollers is None else rollers.count
    assert count is not None  # the model asks for it
    ratio = elements.diameter / elements.pitch_diameter
    g = ratio * math.cos(elements.contact_angle)
    cage = 1 + g if place.part == "planet" else 1 - g
    name = place.label.replace("_", " ")
    for part, frequency in (
        ("outer race", 0.5 * count * turns * (1 - g)),
        ("inner race", 0.5 * count * turns * (1 + g)),
        ("spin of elements", 0.5 * turns * (1 - g**2) / ratio),
        ("cage", 0.5 * turns * cage),
    ):
        label = f"{name}, {part}"
        yield ExpectedLine(stage, BEARING, label, frequency, row=part, bearing=name)


_KEYS = {
    GEAR_MESH: "gear_mesh",
    SIDEBAND: "beside_order_1",
    SHAFT: "shafts_turn",
    PLANET_PASS: "planet_pass",
    TOOTH_FAULT: "tooth_faults",
}  # in the order in which they are printed


def line_rows(lines: Sequence[ExpectedLine], stage: str) -> dict[str, dict[str, float]]:
    """Frequencies, Hz, of the lines of a stage by kind and label, as in ``check`` and reports.
    Sidebands are those of the first harmonic, named by turns of the carrier; where planets cancel
    in part, their share is in the label; shares below a tenth are left out."""
    rows: dict[str, dict[str, float]] = {key: {} for key in _KEYS.values()}
    for line in (x for x in lines if x.stage == stage):
        if line.kind == SIDEBAND and line.harmonic > 1:
            continue
        label = line.row or line.label
        key = line.bearing.replace(" ", "_") or _KEYS[line.kind]
        share = "" if line.share > WHOLE else f" ({100 * line.share:.0f} %)"
        if line.share < SHOWN:
            share = " (planets cancel it)"
            if line.kind != GEAR_MESH:
                continue
        rows.setdefault(key, {})[f"{label}{share}"] = line.frequency
    return {key: row for key, row in rows.items() if row}
