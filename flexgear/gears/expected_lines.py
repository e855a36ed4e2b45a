"""Expected lines of vibration spectra of a train: gear meshes, planets, shafts, bearings.

Frequencies are those at a sensor that rotates at ω_sensor about the axis (0: on the housing).

Gear mesh of a planetary stage: f_m = z_r |ω_c − ω_r|/2π. The signals of N equal planets at φ_i
differ only in the phase of the planet pass, θ_c − θ_sensor + φ_i, and of the gear mesh,
z_r (θ_c − θ_r + φ_i). The component of order H of the gear mesh and order n of the planet pass

    f = |H z_r (ω_c − ω_r) + n (ω_c − ω_sensor)| / 2π

is a sum of N phasors of equal size. Its share, relative to N planets in phase, is

    |Σ_i exp(j (H z_r + n) φ_i)| / N ,

for equal spacing 1 where (H z_r + n) mod N = 0 and else 0 (McFadden and Smith 1985, Proc. IMechE
199C:65). Differences between planets, ring errors that do not repeat with the planets, and a
transfer path that depends on more than the planet pass excite the other lines.

An FE ring gives way more between its N_b bolts than at them. What planet i feels of it at its place
ψ_i = θ_c − θ_r + φ_i repeats with teeth and bolts, so its forces and motions have the orders
H z_r + k N_b of ψ_i, with frequency and share as above with that in place of H z_r; forces of one
gear mesh have n = 0 at any spacing. Of products only H z_r ± N_b are listed, without sidebands: in
forces of wind-5mw and star-ring they have up to 0.2 and 21 % of gear-mesh order 1, those with k = 2
0.006 and 0.3 %. Fits and splines are alike all round, and a rigid ring moves on evenly spaced bolts
(three or more) as on one spring.

A tooth of sun or ring meets planet i when the carrier has turned relative to the gear by φ_i. This
gives multiples k of f_m/z with the share of N phasors at order k, so N f_m/z for equal spacing.
Forces of one gear mesh have f_m/z and all its multiples at any spacing. A flank of a planet meets
one gear once in a turn relative to the carrier, f_m/z_p; the root of a weak planet tooth is loaded
by ring and sun, twice in a turn.

The same two teeth of z_1 and z_2 meet in every lcm(z_1, z_2) gear meshes, the hunting tooth. Where
d = gcd(z_1, z_2) > 1, a tooth only ever meets every d-th one of the other gear; wear that follows
this pattern repeats with the assembly phase, f_m/d.

Bearings: with γ = (d/D_pw) cos α, Z elements and f_r the speed of one ring against the other
(Harris, Rolling Bearing Analysis)

    outer Z f_r (1 − γ)/2,   inner Z f_r (1 + γ)/2,   spin of an element f_r (1 − γ²) D_pw/(2 d) ,

and the cage turns at f_r (1 + γ)/2 relative to a stationary inner ring, at f_r (1 − γ)/2 relative
to a stationary outer ring, where stationary is relative to the load. In planet bearings that is the
inner ring, on the pin. A defect of an element strikes both rings, so at twice its spin.
"""

import math
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from flexgear.gears.bearings.nominal import bearing_speed
from flexgear.gears.power_flow import PowerFlow, StageFlow, power_flow
from flexgear.gears.radii import gears_by_role, role_of
from flexgear.model.case import Case
from flexgear.model.faults import stage_of_fault
from flexgear.model.names import BOLT_PASS, GEAR_MESH, PLANET_PASS, SHAFT
from flexgear.model.stage import Stage
from flexgear.model.stage_view import BearingPlace, StageView

SIDEBAND, TOOTH_FAULT, BEARING = "sideband", "tooth fault", "bearing"
SAME_TEETH, ALIAS = "same teeth", "alias"
PASS = "pass"  # row of the line at N planet passes in a turn
OF_ONE_PLANET = (GEAR_MESH, BOLT_PASS)  # lines of its forces, also where N planets cancel
HARMONICS = 3  # of the gear mesh that are listed
LEAST_SHARE, FULL_SHARE = 0.1, 0.995  # least share in tables; share above which none is printed
CANCELLED = 1e-9  # share of N phasors that is rounding
SAME_SPEED = 1e-9  # relative difference of speeds that count as equal
TURN = 2 * math.pi


@dataclass(frozen=True)
class ExpectedLine:
    """Line of a spectrum at the speeds of a power flow.

    kind: "gear mesh", "sideband", "shaft", "planet pass", "bolt pass", "tooth fault", "same teeth",
    "bearing" or "alias"; label: name of the line, without the stage; frequency: Hz; share:
    amplitude relative to N planets in phase, 1 where planets do not matter; harmonic: H of gear
    meshes, their sidebands and products with bolts, else 0; row: name in a table of lines of this
    kind, ``label`` if empty; bearing: name of the bearing of the line; turn: frequency at which a
    bearing's defect turns relative to the load, Hz, which is the distance of sidebands, 0 if it
    does not turn; turn_label: what turns with it; carrier_modulates: whether sensors hear it change
    with a carrier's turn; faulty: whether the case has the fault.
    """

    stage: str
    kind: str
    label: str
    frequency: float
    share: float = 1.0
    harmonic: int = 0
    row: str = ""
    bearing: str = ""
    turn: float = 0.0
    turn_label: str = ""
    carrier_modulates: bool = False
    faulty: bool = False

    def order(self, speed: float) -> float:
        """Order of the line over the rotation of a member at ``speed``, rad/s."""
        return TURN * self.frequency / abs(speed)


def phasor_share(order: float, angles: Sequence[float]) -> float:
    """Share |Σ exp(j order φ_i)|/N of planets at angles φ (N,), rad."""
    return float(abs(np.exp(1j * order * np.asarray(angles)).mean()))


def expected_lines(
    case: Case,
    flow: PowerFlow | None = None,
    *,
    harmonics: int = HARMONICS,
    sensor_speed: float = 0.0,
) -> tuple[ExpectedLine, ...]:
    """Expected lines of a case, stage by stage. harmonics: number of harmonics of each gear mesh
    and bolt pass; sensor_speed: of the body with the sensor, rad/s about +z. Lines of stationary
    parts are left out; of lines with share 0 only harmonics of gear meshes and bolts are listed."""
    speeds = power_flow(case) if flow is None else flow
    return tuple(
        line
        for stage in speeds.stages
        for line in _of_stage(case.view(stage.name), stage, harmonics, sensor_speed)
        if line.frequency > 0.0 and (line.share > CANCELLED or line.kind in OF_ONE_PLANET)
    )


def _of_stage(
    view: StageView, flow: StageFlow, harmonics: int, sensor: float
) -> Iterator[ExpectedLine]:
    teeth = _parallel if view.stage.kind == "parallel" else _planetary
    faults = [f for f in view.case.faults if stage_of_fault(view.case, f).name == view.name]
    gears = {fault.gear for fault in faults if not fault.of_bearing}
    yield from teeth(view.stage, flow, harmonics, sensor, gears)
    for place in view.bearings:
        defects = {f.kind for f in faults if f.of_bearing and view.key(f.bearing) == place.key}
        speed = abs(bearing_speed(place, flow))
        turns = speed > SAME_SPEED * abs(flow.carrier_speed)  # else the stage turns as one piece
        yield from _bearing(view.name, place, speed / TURN if turns else 0.0, defects)


def _planetary(
    stage: Stage, flow: StageFlow, harmonics: int, sensor: float, faulty: Set[str]
) -> Iterator[ExpectedLine]:
    """Lines of a planetary stage; faulty: gears with a faulty tooth in the case."""
    assert stage.ring is not None
    rolling = flow.carrier_speed - flow.ring_speed
    if abs(rolling) <= SAME_SPEED * max(abs(flow.carrier_speed), abs(flow.ring_speed)):
        rolling = 0.0  # the stage turns as one rigid body
    gear_mesh = stage.ring.teeth * rolling / TURN
    passing = (flow.carrier_speed - sensor) / TURN
    on_planet = rolling and abs(sensor - flow.planet_speed) <= SAME_SPEED * abs(rolling)
    teeth, beside = stage.ring.teeth, _turning if on_planet else _sidebands
    of_both = [(0, 0), *product((0, -1, 1), bolt_counts(stage))]  # sign of bolts in a product
    for (sign, count), harmonic in product(of_both, range(1, harmonics + 1 if rolling else 1)):
        order = abs(harmonic * (teeth if sign or not count else count) + sign * count)
        if count and order % teeth == 0:
            continue  # a harmonic of the gear mesh
        for frequency, share, sideband in beside(stage, order, rolling / TURN, passing):
            if not sign:
                yield _order(stage, harmonic, frequency, share, sideband, count)
            elif not sideband:
                label = f"gear mesh {harmonic} {'−+'[sign > 0]}{count} bolts"
                yield ExpectedLine(stage.name, BOLT_PASS, label, frequency, share, harmonic)
    yield from shaft_lines(stage, flow, sensor)
    if not on_planet:
        yield from pass_lines(stage, flow, sensor)
    yield from _tooth_faults(stage, abs(gear_mesh), faulty)
    yield from _same_teeth(stage, abs(gear_mesh))


def bolt_counts(stage: Stage) -> list[int]:
    """Numbers N_b of the bolts of every circle of a stage's FE ring, which gives way between."""
    fe = stage.ring.fe if stage.ring else None
    circles = fe.bolt_circles if fe and fe.flexible else ()
    return sorted({circle.number for circle in circles if circle.number > 1})


def _same_teeth(stage: Stage, gear_mesh: float) -> Iterator[ExpectedLine]:
    """Hunting tooth and assembly phase of every pair of gears; gear_mesh: frequency, Hz."""
    teeth = {role: gear.teeth for role, gear in gears_by_role(stage).items()}
    other = teeth.pop("planet")
    for role, count in teeth.items():
        of = "" if len(teeth) == 1 else f" of {role} and planet"
        common = math.gcd(count, other)
        line = partial(ExpectedLine, stage.name, SAME_TEETH)
        yield line(f"hunting tooth{of}", gear_mesh * common / (count * other))
        if common > 1:
            yield line(f"assembly phase{of}", gear_mesh / common)


def shaft_lines(stage: Stage, flow: StageFlow, sensor: float = 0.0) -> Iterator[ExpectedLine]:
    """Rotation frequency of each member of a stage relative to a sensor; label: the member."""
    for part in stage.members:
        frequency = abs(getattr(flow, f"{role_of(part)}_speed") - sensor) / TURN
        yield ExpectedLine(stage.name, SHAFT, part, frequency)


def pass_lines(stage: Stage, flow: StageFlow, sensor: float) -> Iterator[ExpectedLine]:
    """Orders at which planets of a planetary stage pass a sensor; row ``PASS``: order N."""
    for order, share in _orders_of_planets(stage):
        row = PASS if order == stage.planets else f"{PASS}, order {order}"
        frequency = order * abs(flow.carrier_speed - sensor) / TURN
        yield ExpectedLine(stage.name, PLANET_PASS, f"planets {row}", frequency, share, row=row)


_Beside = tuple[float, float, str]  # frequency, share, and name of a sideband


def _sidebands(stage: Stage, order: int, turn: float, passing: float) -> Iterator[_Beside]:
    """Line of an order of the carrier against the ring, without a name, and its sidebands at up to
    N carrier turns. turn, passing: frequencies of the carrier against the ring and the sensor, Hz,
    with sign."""
    if abs(passing) * TURN < SAME_SPEED * abs(order * turn):  # planets do not pass the sensor
        yield order * abs(turn), 1.0, ""
        return
    for n in range(-stage.planets, stage.planets + 1):
        share = phasor_share(order + n, stage.planet_angles)
        sense = n if turn * passing > 0 else -n  # + is above the order
        turns = f"{'+' if sense > 0 else '−'}{abs(n)} carrier turn{'s' * (abs(n) > 1)}" if n else ""
        yield abs(order * turn + n * passing), share, turns


def _turning(stage: Stage, order: int, turn: float, passing: float) -> Iterator[_Beside]:
    """The same at a sensor on a planet. Rotation and centre of the planet vibrate at the order; as
    the sensor's axis turns with the planet, it measures motion of the centre one turn below and
    above."""
    for sideband, sign in (("", 0), ("−1 planet turn", -1), ("+1 planet turn", 1)):
        yield order * abs(turn) + sign * abs(passing), 1.0, sideband


def _order(
    stage: Stage, harmonic: int, frequency: float, share: float = 1.0, sideband: str = "",
    bolts: int = 0,
) -> ExpectedLine:  # fmt: skip
    """Line of a harmonic of the gear mesh, or of the pass of so many bolts if there are any, or of
    its sideband with the given name."""
    kind, row, label = GEAR_MESH, f"order {harmonic}", f"gear mesh {harmonic}"
    if bolts:
        kind, row = BOLT_PASS, f"{bolts} bolts, order {harmonic}"
        label, harmonic = f"pass of {row}", 0
    if sideband:
        kind, row, label = SIDEBAND, sideband, f"{label} {sideband}"
    return ExpectedLine(stage.name, kind, label, frequency, share, harmonic, row)


def _orders_of_planets(stage: Stage) -> Iterator[tuple[int, float]]:
    """Orders up to N at which N planets do not cancel, and their shares."""
    for order in range(1, stage.planets + 1):
        share = phasor_share(order, stage.planet_angles)
        if share > CANCELLED:
            yield order, share


def _tooth_faults(stage: Stage, gear_mesh: float, faulty: Set[str]) -> Iterator[ExpectedLine]:
    assert stage.sun is not None and stage.ring is not None and stage.planet is not None
    line = partial(ExpectedLine, stage.name, TOOTH_FAULT, carrier_modulates=True)
    for part, gear in (("sun", stage.sun), ("ring", stage.ring)):
        of_case = part in faulty
        for order, share in _orders_of_planets(stage):
            row = part if order == stage.planets else f"{part}, order {order}"
            frequency = order * gear_mesh / gear.teeth
            yield line(f"tooth of {row}", frequency, share, row=row, faulty=of_case)
        if stage.planets > 1:
            row = f"{part} at one gear mesh"
            yield line(f"tooth of {row}", gear_mesh / gear.teeth, row=row, faulty=of_case)
    for times, label in ((1, "flank of a planet"), (2, "tooth root of a planet")):
        yield line(label, times * gear_mesh / stage.planet.teeth, faulty="planet" in faulty)


def _parallel(
    stage: Stage, flow: StageFlow, harmonics: int, sensor: float, faulty: Set[str]
) -> Iterator[ExpectedLine]:
    """Lines of a parallel stage: gear mesh with sidebands at the rotation of both shafts, which is
    also the frequency of a faulty tooth. faulty: gears with one in the case."""
    turns = {"pinion": abs(flow.sun_speed) / TURN, "gear": abs(flow.planet_speed) / TURN}
    sides = {"": 0.0} | {f"{'−+'[s > 0]}{p}": s * turns[p] for p in turns for s in (-1, 1)}
    for harmonic, (side, distance) in product(range(1, harmonics + 1), sides.items()):
        frequency = harmonic * flow.gear_mesh_frequency + distance
        yield _order(stage, harmonic, frequency, sideband=side)
    yield from shaft_lines(stage, flow, sensor)
    for part, turn in turns.items():
        name, of_case = f"tooth of {part}", part in faulty
        yield ExpectedLine(stage.name, TOOTH_FAULT, name, turn, row=part, faulty=of_case)
    yield from _same_teeth(stage, flow.gear_mesh_frequency)


def _bearing(
    stage: str, place: BearingPlace, turns: float, defects: Set[str]
) -> Iterator[ExpectedLine]:
    """Lines of a bearing, none without its elements.

    turns: relative speed of both rings, 1/s. Relative to the load the inner ring of a planet
    bearing is stationary, of other bearings the outer ring. A defect of an element turns with the
    cage. defects: kinds of the bearing's defects in the case.
    """
    elements, rollers = place.bearing.elements, place.bearing.rollers
    if elements is None:
        return
    count = elements.count if rollers is None else rollers.count
    assert count is not None  # the model asks for it
    ratio = elements.diameter / elements.pitch_diameter
    g = ratio * math.cos(elements.contact_angle)
    cage = 0.5 * turns * (1 + g if place.part == "planet" else 1 - g)
    of_planet, name = place.part == "planet", place.label.replace("_", " ")
    races, (outer, inner) = 0.5 * count * turns, (turns, 0.0) if of_planet else (0.0, turns)
    for defect, part, frequency, turn, what_turns in (
        ("outer_race", "outer race", races * (1 - g), outer, "outer ring turn"),
        ("inner_race", "inner race", races * (1 + g), inner, "inner ring turn"),
        ("roller", "spin of elements", 0.5 * turns * (1 - g**2) / ratio, cage, "cage turn"),
        ("", "cage", cage, 0.0, ""),
    ):
        yield ExpectedLine(
            stage, BEARING, f"{name}, {part}", frequency, row=part, bearing=name, turn=turn,
            turn_label=what_turns, carrier_modulates=of_planet, faulty=defect in defects,
        )  # fmt: skip


_KEYS = {
    GEAR_MESH: "gear_mesh",
    SIDEBAND: "beside_order_1",
    SHAFT: "shafts_turn",
    PLANET_PASS: "planet_pass",
    BOLT_PASS: "bolt_pass",
    TOOTH_FAULT: "tooth_faults",
    SAME_TEETH: "same_teeth_meet",
}  # in order of printing


def line_rows(lines: Sequence[ExpectedLine], stage: str) -> dict[str, dict[str, float]]:
    """Frequencies, Hz, of the lines of a stage by kind and label, as in ``check`` and reports. Only
    sidebands of the first harmonic of the gear mesh and its products with bolts; a share below
    ``FULL_SHARE`` is in the label; lines with less than ``LEAST_SHARE`` are left out, except
    ``OF_ONE_PLANET``."""
    rows: dict[str, dict[str, float]] = {key: {} for key in _KEYS.values()}
    for line in (x for x in lines if x.stage == stage):
        left_out = {SIDEBAND: line.harmonic != 1, BOLT_PASS: line.harmonic > 1}
        if left_out.get(line.kind):
            continue
        label = line.row or line.label
        key = line.bearing.replace(" ", "_") or _KEYS[line.kind]
        share = "" if line.share > FULL_SHARE else f" ({100 * line.share:.0f} %)"
        if line.share < LEAST_SHARE:
            share = " (planets cancel it)"
            if line.kind not in OF_ONE_PLANET:
                continue
        rows.setdefault(key, {})[f"{label}{share}"] = line.frequency
    return {key: row for key, row in rows.items() if row}
