"""Defects of races and rollers: loads against circles that touch, lines of a run, bad input."""

import numpy as np
import pytest
from coupled import make_bodies, stage_system
from scipy.signal import find_peaks
from stepped import energy_error, stepped
from trains import spur_pair, stage_train

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Drive
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.gears.expected_lines import expected_lines
from flexgear.model.errors import InputError
from flexgear.model.load import load_case

COUNT, ROLLER, PITCH, GAP, LENGTH = 16, 5e-3, 30e-3, 1e-5, 0.02
INNER, OUTER = PITCH - ROLLER, PITCH + ROLLER
WIDTH, DEPTH, PLACE = 3e-3, 6e-5, 1.5
BEARING = {
    "rolling": '"roller"', "dynamic_rating_kn": "100", "rollers.count": f"{COUNT}",
    "rollers.length_mm": f"{1e3 * LENGTH}", "rollers.clearance_um": f"{1e6 * GAP}",
    "elements.diameter_mm": f"{2e3 * ROLLER}", "elements.pitch_diameter_mm": f"{2e3 * PITCH}",
}  # fmt: skip
FAULT = """
[[faults]]
kind = "{kind}"
bearing = "planet_bearing"
planet = 2
width_mm = {width}
depth_um = {depth}
position_deg = {place}
"""


def faulty(folder, kind="outer_race", depth=DEPTH, more="", **keys):
    place = np.degrees(PLACE)
    head = FAULT.format(kind=kind, width=1e3 * WIDTH, depth=1e6 * depth, place=place) + more
    bearing = {f"stage.planet_bearing.{key}": value for key, value in BEARING.items()}
    return stage_train(folder, planets=3, head=head, **{**bearing, **keys})


def turns(planet):
    """Angles of cage and roller about their axes when the outer race has turned by ``planet`` and
    the inner one stands: speeds of both contacts of a roller that does not slip."""
    contacts = np.array([[PITCH, ROLLER], [PITCH, -ROLLER]])  # of cage and roller at outer, inner
    return np.linalg.solve(contacts, [OUTER * planet, 0.0])


def drop(angle, radius, circle):
    """By how much a circle of radius ``circle`` inside (or, negative, outside) one of ``radius``
    goes into a gap of it, ``angle`` off its middle on the circle of the gap."""
    angle = np.abs((angle + np.pi) % (2 * np.pi) - np.pi)
    edge = 0.5 * WIDTH / radius - angle
    if edge <= 0:
        return 0.0
    off, touching = radius * np.sin(edge), abs(circle)
    height = radius * np.cos(edge) - np.copysign(np.sqrt(touching**2 - off**2), circle)
    return min(DEPTH, abs(height - (radius - circle)))


def drop_by_hand(kind, roller, at, planet):
    """Of a roller at ``at`` in the carrier's axes."""
    cage, own_turn = turns(planet)
    if kind == "outer_race":
        return drop(at - planet - PLACE, OUTER, ROLLER)
    if kind == "inner_race":
        return drop(at - PLACE, INNER, -ROLLER)
    if roller != 0:
        return 0.0
    turned = own_turn - cage + PLACE  # against the line to the bearing's axis
    return drop(turned, ROLLER, OUTER) + drop(turned + np.pi, ROLLER, -INNER)


@pytest.mark.parametrize("kind", ["outer_race", "inner_race", "roller"])
def test_rollers_are_let_down_as_circles_are(tmp_path, kind):
    """Loads of all rollers at many angles: each from the planet's motion, its place in rolling
    without slip, and two circles at the edge of a gap. The other planets' bearings are sound."""
    system = build_system(faulty(tmp_path, kind))
    carrier = np.linspace(0.0, 6.0, 97)
    equilibrium = revolution(modal_system(system), carrier, system.rated_torque)
    recovery = Recovery(equilibrium)
    two = next(b for b in system.bearings if b.name.endswith("bearing_2"))
    assert [b.turned >= 0 for b in system.bearings] == [False, True, False]
    loads = recovery.bearing_loads(two.name)[:, 0]
    motion = recovery.motion(two.relative)[:, :2]  # planet less pin
    stiffness = 35948 * (1e3 * LENGTH) ** (8 / 9) * 1e3 ** (10 / 9)
    expected, sound = np.zeros_like(loads), np.zeros_like(loads)
    for k, angle in enumerate(carrier):
        planet = -94 / 34 * angle
        for i in range(COUNT):
            at = 2 * np.pi * i / COUNT + turns(planet)[0] + np.pi
            closed = -motion[k] @ [np.cos(at), np.sin(at)] - GAP
            down = drop_by_hand(kind, i, at, planet)
            expected[k, i] = stiffness * max(closed - down, 0.0) ** (10 / 9)
            sound[k, i] = stiffness * max(closed, 0.0) ** (10 / 9)
    scale = loads.max()
    np.testing.assert_allclose(loads, expected, rtol=0, atol=2e-3 * scale)
    assert (sound - expected).max() > 0.2 * scale  # rollers under load do pass the defect


@pytest.mark.slow
def test_motion_of_a_run_has_the_lines_of_the_bearing(tmp_path):
    """An outer race that turns with its planet: lines at the rollers' pass beside the planet's
    turns, expected by the catalogue's formula; without depth rollers pass a load that stands as
    often as a defect of the inner race. The energy account closes."""
    size = {}
    for depth in (DEPTH, 0.0):
        case = faulty(tmp_path, depth=depth)
        lines = {line.row: line.frequency for line in expected_lines(case) if line.bearing}
        turn = 94 / 34 * 100 / 60
        assert lines["outer race"] == pytest.approx(COUNT / 2 * turn * INNER / PITCH, rel=1e-9)
        modal = modal_system(build_system(case), 3000.0)
        rated = modal.system.rated_torque
        run = stepped(
            modal, Drive(lambda t, torque=rated: np.full_like(t, torque)), 2.6, 5e-5, 1e-3,
            track_energy=depth > 0,
        )  # fmt: skip
        window = run.time > 0.6
        two = next(b for b in modal.system.bearings if b.name.endswith("bearing_2"))
        path = Recovery(run).motion(two.relative)[window, 1]  # of the planet against the pin
        size[depth] = np.abs(np.fft.rfft((path - path.mean()) * np.hanning(len(path))))
        frequency = np.fft.rfftfreq(len(path), 1e-3)
        if depth:
            assert energy_error(run) < 1e-3
    expected = lines["outer race"] + turn * np.arange(-1, 2)
    band = np.abs(frequency - expected[1]) < 1.5 * turn
    peaks, _ = find_peaks(size[DEPTH][band])
    largest = sorted(peaks, key=lambda k: size[DEPTH][band][k])[-3:]
    np.testing.assert_allclose(np.sort(frequency[band][largest]), expected, atol=0.5)
    sound = size[0.0] * (frequency > 2.0)
    assert frequency[sound.argmax()] == pytest.approx(lines["inner race"], abs=0.5)
    assert sound[band].max() < 1e-2 * min(sound.max(), size[DEPTH][band].max())


@pytest.mark.parametrize(
    ("more", "keys", "message"),
    [
        ("", {"faults.0.row": "2"}, "faults.0.row: 2 is beyond its 1 rows"),
        ("", {"faults.0.width_mm": "20"}, "faults.0.width_mm"),
        ("", {"faults.0.depth_um": "40000"}, "radius of the rollers"),
        ("", {"faults.0.bearing": '"carrier.bearing_far"'}, "planet"),
        ("", {"faults.0.planet": "4"}, "beyond the 3 planets"),
        ("tooth = 3\n", {}, "is not a key of the kind outer_race"),
        ("", {"faults.0.kind": '"outer"'}, "faults.0.kind"),
        ("", {"stage.planet_bearing.elements": None}, "has no elements"),
        (
            "",
            {"stage.planet_bearing.rollers": None},
            r"faults\[0\].bearing: planet_bearing of stage has no rollers -- add planet_bear",
        ),
    ],
)
def test_impossible_defects_are_refused(tmp_path, more, keys, message):
    with pytest.raises(InputError, match=message):
        faulty(tmp_path, more=more, **keys)


@pytest.mark.parametrize("contact", [0.0, 30.0])
def test_the_outer_race_of_a_carrier_stands(contact):
    """A seat on the housing: in space the defect stays where it is, and rollers come to it with the
    cage, whose speed depends on the contact angle as in catalogues; the loads add up to the seat's
    force."""
    keys = {f"stage.carrier.bearing_drive.{key}": value for key, value in BEARING.items()}
    keys |= {"stage.carrier.bearing_drive.rollers.length_mm": "200"}
    if contact:
        keys["stage.carrier.bearing_drive.elements.contact_angle_deg"] = f"{contact}"
    across = ROLLER * np.cos(np.radians(contact))
    sizes = {"width": WIDTH, "depth": DEPTH, "position": PLACE}
    fault = {"kind": "outer_race", "bearing": "carrier.bearing_drive", **sizes}
    case = load_case("wind-5mw", keys).with_(faults=(fault,))
    stage = case.view()
    system = stage_system(stage, make_bodies(stage))
    seat = next(b for b in system.bearings if b.turned >= 0)
    carrier = np.linspace(0.0, 6.0, 41)
    reach = np.array([[1e-4 * np.cos(PLACE), 1e-4 * np.sin(PLACE), 0.0, 0.0, 0.0, 0.0]])
    for angle in carrier:
        theta = np.full((1, 1 + seat.turned), angle)
        loads = seat.part_loads(reach, theta)[0, 0]  # of a displacement in space
        at = 2 * np.pi * np.arange(COUNT) / COUNT + 0.5 * (1 - across / PITCH) * angle  # in space
        down = np.array([drop(a - PLACE, PITCH + across, ROLLER) for a in at])
        closed = 1e-4 * np.cos(at - PLACE) - GAP - down
        stiffness = 35948 * 200 ** (8 / 9) * 1e3 ** (10 / 9)
        expected = stiffness * np.maximum(closed, 0.0) ** (10 / 9)
        near = 4e-3 if contact else 2e-3
        np.testing.assert_allclose(loads, expected, rtol=0, atol=near * expected.max())


LOADED = -1.5  # a place where the pinion's force acts
SUPPORT = f"""{{ radial_n_per_m = 3e8, rolling = "roller", dynamic_rating_kn = 100,
rollers = {{ count = {COUNT}, length_mm = {1e3 * LENGTH}, clearance_um = {1e6 * GAP} }},
elements = {{ diameter_mm = {2e3 * ROLLER}, pitch_diameter_mm = {2e3 * PITCH} }} }}"""
SHAFT_DEFECT = f"""
[[faults]]
kind = "KIND"
bearing = "BEARING"
width_mm = {1e3 * WIDTH}
depth_um = {1e6 * DEPTH}
position_deg = {np.degrees(LOADED)}
"""


def pair_with_defect(kind, bearing="pinion.support", kinematics="planar", pinion=SUPPORT):
    """TOML text of a spur pair whose pinion, with 30 of 60 teeth, is on rollers."""
    gears = [
        f'teeth = {teeth}, mass_kg = 2, inertia_kg_m2 = 0.01, kinematics = "{motion}", '
        f"support = {support.replace(chr(10), ' ')}"
        for teeth, motion, support in ((30, kinematics, pinion), (60, "planar", SUPPORT))
    ]
    text = spur_pair(*gears, 'model = "constant"', torque=2e3, output="brake_exponent = 0")
    return text + SHAFT_DEFECT.replace("KIND", kind).replace("BEARING", bearing)


@pytest.mark.parametrize("kind", ["outer_race", "inner_race", "roller"])
@pytest.mark.parametrize("member", ["pinion", "sun"])
def test_rollers_of_a_turning_shaft_are_let_down_in_space(tmp_path, member, kind):
    """Its inner race turns with it and the outer one is fixed in space, for a sun, too, whose
    motion is in the axes of the carrier: loads from motion, rolling without slip, and circles."""
    if member == "pinion":
        path = tmp_path / "pair.toml"
        path.write_text(pair_with_defect(kind))
        case, ratio, turning = load_case(path), -2.0, 0.0
    else:
        defect = SHAFT_DEFECT.replace("KIND", kind).replace("BEARING", "sun.support")
        keys = {f"stage.sun.support.{key}": value for key, value in BEARING.items()}
        keys["stage.errors.sun_eccentricity_um"] = "200"  # its force turns with the inner race
        keys["stage.errors.sun_eccentricity_phase_deg"] = f"{np.degrees(LOADED) + 180}"
        case = stage_train(tmp_path, planets=3, sun="3e8", head=defect, **keys)
        sun, ring = case.stages[0].sun.teeth, case.stages[0].ring.teeth
        ratio, turning = 1 + ring / sun, 1.0
    system = build_system(case)
    angles = np.linspace(0.0, 24.0, 193)
    recovery = Recovery(revolution(modal_system(system), angles, system.rated_torque))
    support = next(b for b in system.bearings if b.turned >= 0)
    assert support.name == f"{case.stages[0].name}.{member}_support"
    x, y = recovery.motion(support.rows)[:, :2].T
    in_space = (x + 1j * y) * np.exp(1j * turning * angles)
    loads = recovery.bearing_loads(support.name)[:, 0]
    contacts = np.array([[PITCH, ROLLER], [PITCH, -ROLLER]])
    cage, spin = np.linalg.solve(contacts, [0.0, INNER * ratio])
    stiffness = 35948 * (1e3 * LENGTH) ** (8 / 9) * 1e3 ** (10 / 9)
    expected, sound = np.zeros_like(loads), np.zeros_like(loads)
    for k, angle in enumerate(angles):
        for i in range(COUNT):
            at = 2 * np.pi * i / COUNT + cage * angle
            closed = (in_space[k] * np.exp(-1j * at)).real - GAP
            own_turn = (spin - cage) * angle + LOADED
            down = {
                "outer_race": drop(at - LOADED, OUTER, ROLLER),
                "inner_race": drop(at - LOADED - ratio * angle, INNER, -ROLLER),
                "roller": (i == 0)
                * (drop(own_turn, ROLLER, OUTER) + drop(own_turn + np.pi, ROLLER, -INNER)),
            }[kind]
            expected[k, i] = stiffness * max(closed - down, 0.0) ** (10 / 9)
            sound[k, i] = stiffness * max(closed, 0.0) ** (10 / 9)
    np.testing.assert_allclose(loads, expected, rtol=0, atol=2e-3 * loads.max())
    assert (sound - expected).max() > 0.1 * loads.max()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"bearing": "pinion.suport"},
            "no 'pinion.suport' of stage_1 -- did you mean pinion.support",
        ),
        ({"kinematics": "torsional"}, "pinion has no radial motion, which rollers transmit"),
        ({"bearing": "gear.support.1"}, "there is no 'gear.support.1' of stage_1"),
        ({"pinion": "{ radial_n_per_m = 1e8 }"}, "pinion.support of stage_1 has no rollers"),
    ],
)
def test_defects_of_shaft_bearings_that_cannot_be(tmp_path, changes, message):
    path = tmp_path / "pair.toml"
    path.write_text(pair_with_defect("outer_race", **changes))
    with pytest.raises(InputError, match=message):
        load_case(path)
