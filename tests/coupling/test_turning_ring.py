"""An FE ring that turns, a carrier that is held: the same stage seen from another frame."""

import numpy as np
import pytest
from coupled import make_case, make_system
from stepped import Jumping, energy_error, jump, stepped
from turning_ring import HUB, STANDS, SUPPORT, cheap, held_case, lumped

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.linear_dynamics import whirl_modes
from flexgear.analysis.modes import classify, modes, springs_at
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system, require_workable
from flexgear.coupling.modal import modal_system
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.stiffness import compliance, pair_law
from flexgear.model.case import validated_case
from flexgear.model.read import Written
from flexgear.structures.bodies import rotation, turn

TEETH_RING, TEETH_SUN = 93, 27
PARTS = ("sun", "ring", "carrier")
RELATIVE = np.array([0.0, 0.013, 0.4, 2.0])  # θ = φ_carrier − φ_ring, rad


def solved(case, angles):
    system = build_system(case, cheap(case))
    return revolution(modal_system(system), angles, system.rated_torque)


@pytest.fixture
def held_ring(tmp_path):
    case = held_case(tmp_path, "ring", "sun", "carrier")
    return solved(case, (1 + TEETH_RING / TEETH_SUN) * RELATIVE)


def test_star_carries_the_loads_of_the_stage_with_held_ring(tmp_path, held_ring):
    """Only the angle between carrier and ring counts for forces in equilibrium.

    The ring's bolts stand on a hub that can only turn, so in the ring's frame as in the housing.
    """
    case = held_case(tmp_path, "carrier", "sun", "ring", **HUB, **STANDS)
    star = solved(case, (TEETH_RING / TEETH_SUN) * RELATIVE)
    assert np.allclose(star.theta[:, star.modal.system.pairs.angle[0]], RELATIVE, atol=1e-12)
    largest = np.abs(held_ring.pair_load).max()
    assert np.array_equal(star.pair_tooth, held_ring.pair_tooth)
    assert np.abs(star.pair_load - held_ring.pair_load).max() < 1e-8 * largest
    planets = [f"stage.planet_{i + 1}" for i in range(5)]
    pins = [("stage.carrier", f"pin_{i + 1}") for i in range(5)]
    for body, node in (*zip(planets, planets, strict=True), ("stage.shaft", "sun"), *pins):
        a, b = (_seen_from_carrier(r, body, node) for r in (star, held_ring))
        assert np.abs(a - b).max() < 1e-8 * np.abs(b).max()
    hub = Recovery(star).node("stage.hub", "stage.hub")[:, 5]
    ring = star.modal.system.body("stage.ring")
    teeth = [name for name in ring.node_names if name.startswith("tooth")]
    a, b = (np.stack([Recovery(r).node("stage.ring", n) for n in teeth]) for r in (star, held_ring))
    position = np.array([ring.position(name) for name in teeth])
    a[..., :2] -= hub[None, :, None] * (position[:, None, 1::-1] * [-1.0, 1.0])
    a[..., 5] -= hub
    for part in (slice(0, 3), slice(3, 6)):
        assert np.abs(a - b)[..., part].max() < 1e-8 * np.abs(b[..., part]).max()


def _seen_from_carrier(result, body, node):
    """Motion in the plane of a node less the carrier's rotation about the axis, in its axes."""
    motion = Recovery(result).node(body, node)
    wind_up = Recovery(result).node("stage.carrier", "bearing_drive")[:, 5]
    carrier = result.modal.system.body("stage.carrier")
    if "planet" in body:
        motion[:, 1] -= wind_up * np.linalg.norm(carrier.position("pin_1"))
    if body == "stage.carrier":
        x, y, _ = carrier.position(node)
        motion[:, :2] -= wind_up[:, None] * np.array([-y, x])
    return motion[:, :5]


NODAL = {  # planets in phase, everything as many-fold
    4: {
        "stage.planets": "4", "stage.sun.teeth": "28", "stage.planet.teeth": "32",
        "stage.ring.teeth": "92", "stage.planet.bore_diameter_mm": "400",
        "stage.ring.fe.bolts.number": "24",
    },
    5: {
        "stage.planets": "5", "stage.sun.teeth": "30", "stage.planet.teeth": "30",
        "stage.ring.teeth": "90", "stage.planet.bore_diameter_mm": "380",
        "stage.carrier.fe.pin_diameter_mm": "360",
    },
}  # fmt: skip


KINDS = (
    ("rigid", "rotational", "axial", "rotational-axial"),
    ("translational", "tilting", "translational-tilting"),
    ("planet",),
)


@pytest.mark.parametrize(("held", "planets"), [("ring", 5), ("carrier", 4)])
def test_nodal_diameters_of_the_ring_tell_the_kinds_of_modes(tmp_path, held, planets):
    """With N planets rotational modes hold diameters jN, translational jN ± 1, planet modes the
    rest: a symmetry by 2π/N splits the motions into those that turn by 0, ±1, … of a period. What
    sun and carrier do, and the energy of all central members, tell the same kinds."""
    more = {**SUPPORT, **STANDS} if held == "carrier" else {}
    other = {"ring": "carrier", "carrier": "ring"}[held]
    case = held_case(tmp_path, held, "sun", other, **NODAL[planets], **more)
    bodies = cheap(case, bolts=case.stages[0].ring.fe.bolts.number)
    system, teeth = build_system(case, bodies), case.stages[0].ring.teeth
    natural = modes(system, springs_at(system).stiffness, limit_hz=2500.0)
    rows = [system.node_rows("stage.ring", f"tooth_{j + 1:03d}")[:3] for j in range(teeth)]
    axes = rotation(2 * np.pi * np.arange(teeth) / teeth)
    motion = np.einsum("jad,dm->jam", np.stack(rows), natural.shapes)
    turned = np.einsum("jba,jbm->jam", axes, motion)  # radial, tangential, axial
    size = np.abs(np.fft.fft(turned, axis=0)).max(axis=1)  # (teeth, m) by nodal diameter
    diameter = np.minimum(np.arange(teeth) % planets, -np.arange(teeth) % planets)
    share = np.stack([size[diameter == n].max(axis=0) for n in range(planets // 2 + 1)])
    share /= size.max(axis=0)
    takes_part = size.max(axis=0) > 1e-6 * size.max()
    assert np.sort(share, axis=0)[-2, takes_part].max() < 1e-6
    kind = np.minimum(np.argmax(share, axis=0), 2)  # rotational, translational, planet modes
    assert all(np.sum(kind[takes_part] == k) > 5 for k in range(3))
    for body, node in (("stage.shaft", "sun"), ("stage.carrier", "drive")):
        moved = np.abs(system.node_rows(body, node) @ natural.shapes)[:, takes_part]
        moved /= moved.max(axis=1, keepdims=True)
        turns, tilts = moved[[2, 5]], moved[[0, 1, 3, 4]]
        assert turns[:, kind[takes_part] != 0].max() < 1e-6
        assert tilts[:, kind[takes_part] != 1].max() < 1e-6
    shapes, bodies = natural.shapes, system.bodies
    types = np.array(classify(natural.frequencies, shapes, system.mass, bodies, rigid=1).kinds)
    for k, allowed in enumerate(KINDS):
        assert set(types[takes_part & (kind == k)]) <= {*allowed, "elastic"}


ROLES = [(a, b, c) for a in PARTS for b in PARTS for c in PARTS if len({a, b, c}) == 3]


FORMS = [(), ("ring",), ("carrier",), ("sun",), ("ring", "sun"), ()]  # lumped in place of FE


@pytest.mark.parametrize(("roles", "forms"), list(zip(ROLES, FORMS, strict=True)))
def test_any_member_is_held_driven_and_output_whatever_its_body(tmp_path, roles, forms):
    """Torques of the lever: sun z_s, ring z_r, carrier −(z_s + z_r), at any angle and shares."""
    held, first, second = roles
    more = SUPPORT if held != "ring" else {}
    more = more | (STANDS if held == "carrier" else {})
    case = held_case(tmp_path, held, first, second, speed=10.0, **more)
    case = lumped(case, *forms)
    require_workable(case)
    equilibrium = solved(case, np.array([0.0, 0.35]))
    lever = {"sun": TEETH_SUN, "ring": TEETH_RING, "carrier": -(TEETH_SUN + TEETH_RING)}
    assert np.allclose(equilibrium.torques[:, 0], 9e5)
    assert np.allclose(equilibrium.torques[:, 1], 9e5 * lever[second] / lever[first], rtol=1e-9)
    assert equilibrium.closure.max() < 1e-8
    forces = power_flow(case).stages[0].gear_mesh_forces
    for kind in ("ring", "sun"):
        columns = [
            k for k, m in enumerate(equilibrium.modal.system.gear_meshes) if m.kind.startswith(kind)
        ]
        total = equilibrium.pair_load[:, columns].sum(axis=(1, 2))
        assert np.allclose(total, 5 * abs(forces[kind]), rtol=1e-9)


TWO_INPUTS = """
[[inputs]]
member = "stage.ring"
speed_rpm = 12
inertia_kg_m2 = 1e5
"""


def test_turning_everything_and_renaming_planets_change_nothing(tmp_path):
    """Two inputs: a turn α of the whole stage does nothing, a turn of the carrier by 2π/N gives
    each planet the loads of the next one."""
    case = held_case(tmp_path, "ring", "carrier", "sun", **SUPPORT, more=TWO_INPUTS)
    alpha, step = 0.9, 2 * np.pi / 5
    angles = np.array([[0.2, -0.1], [0.2 + alpha, -0.1 + alpha], [0.2 + step, -0.1]])
    equilibrium = solved(case, angles)
    loads = {(m.kind, m.planet): k for k, m in enumerate(equilibrium.modal.system.gear_meshes)}
    ring = [[equilibrium.pair_load[p, loads["ring", i]] for i in range(5)] for p in range(3)]
    largest = np.max(ring)
    assert np.abs(np.subtract(ring[0], ring[1])).max() < 1e-9 * largest
    for i in range(5):
        load, next_load = np.sort(ring[2][i]), np.sort(ring[0][(i + 1) % 5])
        assert np.abs(load - next_load).max() < 1e-9 * largest


FORCE, MOMENT = np.array([2e4, -3e4, 1e4]), np.array([4e3, 5e3, 0.0])
STAR_SUPPORTS = {  # springs to the housing: body, node
    "stage.carrier_drive": ("stage.carrier", "bearing_drive"),
    "stage.carrier_far": ("stage.carrier", "bearing_far"),
    "stage.hub": ("stage.hub", "stage.hub"),
    "stage.output": ("stage.output", "stage.output"),
}


def star_reactions(result, sample):
    """Force and moment (6,) of the housing on a star at the origin, in fixed axes."""
    system, recovery, total = result.modal.system, Recovery(result), np.zeros(6)
    for name, (body, node) in STAR_SUPPORTS.items():
        angle = result.theta[sample, system.frames["stage"].ring] if body == "stage.hub" else 0.0
        force = -turn(float(angle)) @ recovery.link_force(name)[sample]
        place = system.body(body).position(node)  # on the axis
        total += np.r_[force[:3], force[3:] + np.cross(place, force[:3])]
    return total


@pytest.mark.parametrize("member", ["ring", "sun"])
def test_six_components_at_the_ports_of_a_star_reach_its_supports(tmp_path, member):
    """On the hub of a ring that turns, and behind the spline of the sun; fixed axes in both."""
    case = held_case(tmp_path, "carrier", "sun", "ring", **SUPPORT, **STANDS)
    load = {"member": f"stage.{member}", "force": tuple(FORCE), "moment": tuple(MOMENT)}
    plain, loaded = (solved(c, np.array([0.0, 1.3])) for c in (case, case.with_(loads=(load,))))
    body = {"ring": "stage.hub", "sun": "stage.output"}[member]
    place = plain.modal.system.body(body).position(body)
    expected = -np.r_[FORCE, MOMENT + np.cross(place, FORCE)]
    for sample in (0, 1):
        more = star_reactions(loaded, sample) - star_reactions(plain, sample)
        assert more == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


UNEVEN = {  # so that the hub feels in what direction it stands
    "stage.ring.hub.bearing.radial_x_n_per_m": "1e9",
    "stage.ring.hub.bearing.radial_y_n_per_m": "6e9",
}


@pytest.mark.parametrize("held", ["carrier", "sun"])
def test_no_energy_appears_where_the_ring_turns(tmp_path, held):
    """A torque drop at the output end of a stage whose FE ring is driven or drives."""
    first = {"carrier": "sun", "sun": "ring"}[held]
    second = {"carrier": "ring", "sun": "carrier"}[held]
    more = {**SUPPORT, **UNEVEN, **(STANDS if held == "carrier" else {})}
    case = held_case(tmp_path, held, first, second, **more)
    modal = modal_system(build_system(case, cheap(case)), 600.0)
    run = stepped(modal, jump(9e5, 3e5, 0.02, 0.05), 0.08, 2e-5, 1e-3, track_energy=True)
    assert energy_error(run) < 1e-3
    turned = np.ptp(run.theta[:, modal.system.pairs.angle[0]])
    assert turned > 0.05 * abs(speed_of(case))


def test_teeth_of_a_turning_ring_change_flanks_without_energy_from_nowhere(tmp_path):
    """The torque turns round: coast flanks are met in time, however far the ring has turned."""
    case = held_case(tmp_path, "sun", "carrier", "ring", **SUPPORT)
    modal, lost, beside = modal_system(build_system(case, cheap(case)), 1500.0), [], []
    drive = Jumping(lambda t: np.interp(t, [0.005, 0.015], [9e5, -6e5]), jumps=(0.005, 0.015))
    kinds = np.array([m.kind for m in modal.system.gear_meshes])
    coast = np.array([kind.endswith("_coast") for kind in kinds])
    for step in (4e-5, 1e-5):
        run = stepped(modal, drive, 0.04, step, 2e-4, track_energy=True)
        lost.append(energy_error(run))
        e = run.energy
        beside.append(np.ptp(e["parametric_work"]) / (e["elastic"] + e["pair_elastic"]).max())
        carried = run.pair_load.sum(axis=-1)
        assert carried[0, ~coast].min() > 0 == np.abs(carried[0, coast]).max()
        assert carried[:, coast].max() > 0.2 * carried[0].max()
        assert carried.max() < 2 * carried[0].max()
    assert np.ptp(run.theta[:, modal.system.frames["stage"].ring]) > 0.1
    assert lost[1] < min(1e-3, 0.5 * lost[0])
    assert max(beside) < 1e-2


def speed_of(case):
    speed = power_flow(case).speed
    return speed["stage.carrier"] - speed["stage.ring"]


WEBER = {"stage.gear_mesh.pair_stiffness": "weber-banaschek"}


@pytest.mark.parametrize("tie", ["root", "flank"])
def test_the_gear_mesh_of_a_rigid_ring_has_the_compliance_that_the_fe_ring_held(tie):
    case = make_case(**WEBER, **{"stage.ring.fe.tie": tie})
    g, force = stage_geometry(case), power_flow(case.case).stages[0].gear_mesh_forces["ring"]
    split = compliance(case, g, "ring", force)
    held = split.share("gear", tie)
    bends, rigid = (pair_law(c, g, "ring", force) for c in (case, case.with_rigid(["ring"])))
    np.testing.assert_allclose(rigid(split.xi), bends(split.xi) * (1.0 - held))
    assert held.min() > 0.05


def test_the_rigid_variant_has_the_stiffness_of_a_ring_that_does_not_bend():
    rigid = make_system(["ring"], **WEBER).pairs
    bends, stiff = (
        make_system(**WEBER, **k).pairs for k in ({}, {"stage.ring.fe.flexible": "false"})
    )
    ring, sun = (rigid.table[rigid.kind == kind][0] for kind in (0, 1))
    np.testing.assert_array_equal(rigid.k_table[ring], stiff.k_table[ring])
    assert rigid.k_table[ring].max() < 0.95 * bends.k_table[ring].max()
    np.testing.assert_array_equal(rigid.k_table[sun], bends.k_table[sun])


POLAR, TILT, SPRING = 9e3, 5e3, 4e8  # of the carrier, kg m², and its support, N m/rad


def whirling(tmp_path, speed):
    """A stage with an elastic ring whose rigid carrier tilts alone: planets and sun are planar, and
    pins give them neither axial force nor moment. Its modes in the carrier's frame."""
    case = lumped(held_case(tmp_path, "ring", "carrier", "sun", speed=speed), "carrier", "sun")
    data = case.model_dump(mode="python")
    data["gyroscopic"] = True
    stage = data["stages"][0]
    for name in ("sun", "planet"):
        stage[name]["kinematics"] = "planar"
    stage["planet_bearing"] |= {"axial": 0.0, "tilt": 0.0, "z": 0.0}
    data["inputs"][0]["inertia"] = 0.0
    stage["carrier"] |= {"inertia": POLAR, "tilt_inertia": TILT, "kinematics": "spatial"}
    stage["carrier"]["support"] |= {"tilt": SPRING}
    case = validated_case(data, "test", Written())
    system = build_system(case, cheap(case))
    stiffness = system.stiffness + springs_at(system).stiffness
    whirl = whirl_modes(system.mass, stiffness, system.gyroscopic, system.centripetal)
    tilt = system.node_rows("stage.carrier", "stage.carrier")[3:5]
    return system, whirl, tilt


@pytest.mark.slow
def test_a_carrier_that_spins_on_tilt_springs_whirls_forward_and_backward(tmp_path):
    """In space ω² ∓ (J_p/J_t) Ω ω − k/J_t = 0; axes that turn with it see ω ∓ Ω."""
    speed = 600.0
    system, whirl, tilt = whirling(tmp_path, speed)
    spin = speed * np.pi / 30
    half, natural = 0.5 * POLAR / TILT * spin, np.sqrt(SPRING / TILT)
    forward, backward = (np.hypot(half, natural) + sign * half for sign in (1, -1))
    shapes = whirl.shapes
    size = np.sqrt(np.einsum("im,ij,jm->m", shapes.conj(), system.mass, shapes).real)
    alone = np.argsort(np.abs(tilt @ shapes).max(axis=0) / size)[-2:]
    omega = np.sort(2 * np.pi * whirl.frequencies[alone])
    expected = np.sort([forward - spin, backward + spin])
    np.testing.assert_allclose(omega, expected, rtol=1e-6)
    assert abs(expected[1] - expected[0]) > 1e-4 * natural
