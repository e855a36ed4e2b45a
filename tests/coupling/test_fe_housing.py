"""An FE housing given as reduced matrices: rigid limit, springs in series, weight, refusals."""

import numpy as np
import pytest
from cheap_bodies import Joints
from coupled import make_bodies, make_case
from heavy_stage import SMALL, G, mass_of
from trains import mount, spur_pair, write

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.face.model import assembled
from flexgear.files.matrices.body import ReducedMatrices
from flexgear.files.matrices.exchange import write_reduced
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.structures.bodies import rigid_rows

MASS = np.diag([60.0, 60, 60, 6, 6, 6])  # of each node
MOUNT = mount("8e8", "6e8", "5e8", "7e8")
ANGLES = np.array([0.3, 2.0])


def written(folder, places, stiff):
    """Keys of a housing with nodes at these places (m), each joined to the mount by a joint of that
    stiffness along and about each axis."""
    x = np.array(list(places.values()))
    joints = Joints(x)
    for k in range(1, len(x)):
        joints.add(0, k, stiff, stiff)
    assert next(iter(places)) == "mount_1"
    body = ReducedMatrices("housing", tuple(places), x, joints.k, np.kron(np.eye(len(x)), MASS))
    write_reduced(body, folder, "npz")
    return {
        "housing.kind": "reduced",
        "housing.fe_mesh_file": str(folder / "housing.npz"),
        "housing.fe_mesh_nodes": str(folder / "housing_nodes.csv"),
        "housing.fe_mesh_unit": "m",
    }


def places_of(bodies, shaft_end, shift=(0.0, 0.0, 0.0)):
    """Where the supports of the bundled stage stand, after the mount at the origin, m."""
    ring, carrier = bodies.values()
    places = {"mount_1": (0.0, 0.0, 0.0)}
    for name, place in zip(ring.node_names, ring.positions, strict=True):
        if not name.startswith("tooth"):
            places[f"stage.{name}"] = place + np.array(shift)
    for side in ("drive", "far"):
        at = carrier.node_names.index(f"bearing_{side}")
        places[f"stage.carrier_{side}"] = carrier.positions[at] + np.array(shift)
    places["stage.output"] = shaft_end + np.array(shift)
    return places


def stage_on(housing, **settings):
    """The small stage under its weight on a housing; all modes kept."""
    case = make_case(**SMALL, **MOUNT, **housing, **settings).with_(gravity=(0.0, -G, 0.0))
    system = build_system(case.case, make_bodies(case))
    return revolution(modal_system(system), ANGLES, case.case.inputs[0].torque)


@pytest.fixture(scope="module")
def places():
    case = make_case(**SMALL)
    bodies = make_bodies(case)
    shaft = build_system(case.case, bodies).body("stage.shaft")
    return places_of(bodies, shaft.position("end"))


@pytest.mark.slow
@pytest.mark.parametrize("gap", [{}, {"stage.carrier.bearing_far.clearance_um": "60"}])
def test_a_stiff_fe_housing_is_the_lumped_one(tmp_path, places, gap):
    """What its joints yield falls as one over their stiffness."""
    x = np.array(list(places.values()))
    rigid = rigid_rows(x)
    inertia = rigid.T @ np.kron(np.eye(len(x)), MASS) @ rigid
    assert abs(inertia[3:, 3:] - np.diag(np.diag(inertia)[3:])).max() < 1e-6 * inertia[3, 3]
    lumped = {
        "housing.kind": "lumped",
        "housing.mass_kg": str(inertia[0, 0]),
        "housing.inertia_kg_m2": str(np.diag(inertia)[3:].tolist()),
    }
    reference, off = stage_on(lumped, **gap), []
    for stiff in (1e11, 1e12):
        equilibrium = stage_on(written(tmp_path, places, stiff), **gap)
        off.append(
            np.abs(equilibrium.pair_load - reference.pair_load).max() / reference.pair_load.max()
        )
    assert off[1] < 1e-3
    assert off[1] < 0.15 * off[0]


def test_the_mount_of_a_housing_takes_all_weight(tmp_path, places):
    """Also its own; beside it only the moments that the stage's torques leave."""
    equilibrium = stage_on(written(tmp_path, places, 3e9))
    weight = mass_of(equilibrium.modal.system) * G
    held = Recovery(equilibrium).link_force("housing_mount_1")
    assert equilibrium.closure.max() < 1e-8
    assert held[:, :3] == pytest.approx(np.tile([0, -weight, 0], (2, 1)), abs=1e-8 * weight)
    torques = equilibrium.torques.sum(axis=1)  # the ports'; the housing takes the ring's
    assert held[:, 5] == pytest.approx(torques, rel=1e-8)


def test_where_a_stage_stands_in_a_housing_changes_nothing_without_tilt(tmp_path, places):
    """Nodes are found by name: a stage moved along the axis with its supports carries the same on
    a housing that hardly yields."""
    case = make_case(**SMALL)
    bodies = make_bodies(case)
    moved = places_of(bodies, np.array(places["stage.output"]), shift=(0.0, 0.0, 1.5))
    equilibria = []
    for at in (places, moved):
        (tmp_path / str(len(equilibria))).mkdir()
        keys = written(tmp_path / str(len(equilibria)), at, 1e13)
        case = make_case(**SMALL, **dict.fromkeys(MOUNT, "1e13"), **keys)
        system = build_system(case.case, bodies)
        equilibria.append(revolution(modal_system(system), ANGLES, case.case.inputs[0].torque))
    a, b = (one.pair_load for one in equilibria)
    assert np.abs(a - b).max() < 1e-4 * a.max()


GEARS = {"pinion": (21, 3e8), "gear": (63, 5e8)}  # teeth and radial stiffness of the bearing, N/m
PAIR = spur_pair(
    *(f"teeth = {z}, support = {{ radial_n_per_m = {k} }}" for z, k in GEARS.values())
).replace("[[stages]]", "[[stages]]\nposition_deg = 40")


def test_walls_of_a_housing_and_bearings_are_springs_in_series(tmp_path):
    """Each gear stands on a wall of stiffness w, and on a bearing k on it: k w/(k + w) together."""
    wall, force = 4e8, {}
    nodes = {"mount_1": (0.0, 0.0, 0.0), "stage_1.pinion": (0.0, 0.0, 0.3)}
    nodes["stage_1.gear"] = (0.17, 0.1, 0.3)
    x = np.array(list(nodes.values()))
    joints = Joints(x)
    for k in (1, 2):  # walls that shift at their own node, and do not tilt
        rows = np.zeros((6, len(joints.k)))
        rows[:, 6 * k : 6 * k + 6] = np.eye(6)
        rows[:, :6] = -rigid_rows(x[k], x[0])[:6]
        joints.k += rows.T @ np.diag([wall, wall, 1e13, 1e12, 1e12, 1e12]) @ rows
    body = ReducedMatrices("housing", tuple(nodes), x, joints.k, np.kron(np.eye(3), MASS))
    write_reduced(body, tmp_path, "npz")
    fe = {
        "housing.kind": "reduced",
        "housing.fe_mesh_file": str(tmp_path / "housing.npz"),
        "housing.fe_mesh_nodes": str(tmp_path / "housing_nodes.csv"),
        "housing.fe_mesh_unit": "m",
        **dict.fromkeys(MOUNT, "1e14"),
    }
    series = {
        f"stages.stage_1.{gear}.support.radial_n_per_m": repr(k * wall / (k + wall))
        for gear, (_, k) in GEARS.items()
    }
    for name, keys in (("fe", fe), ("series", series)):
        system = build_system(load_case(write(tmp_path, PAIR), keys))
        equilibrium = revolution(modal_system(system), np.array([0.0, 0.2]), system.rated_torque)
        recovery = Recovery(equilibrium)
        moved = [recovery.node(f"stage_1.{g}", f"stage_1.{g}")[:, :2] for g in GEARS]
        force[name] = np.hstack([*moved, 1e-9 * equilibrium.pair_load.sum(axis=-1)])
    assert np.abs(force["fe"] - force["series"]).max() < 1e-5 * np.abs(force["series"]).max()
    tilt = "housing.mount.tilt_nm_per_rad"
    with pytest.raises(InputError, match=f"{tilt}.* holds housing .* more nodes mount_1") as caught:
        build_system(load_case(write(tmp_path, PAIR), fe | {tilt: "0"}))
    assert "joint" not in str(caught.value)
    axes = '[[sensors]]\nname = "{0}"\non = "housing"\nmeasures = "displacement"\ndirection = "{0}"'
    at_wall = axes + '\nnode = "stage_1.gear"\n'
    text = PAIR + at_wall.format("x") + at_wall.format("y")
    values = (
        assembled(load_case(write(tmp_path, text), fe), ()).static()["sensor_static"].to_numpy()
    )
    normal = 500 / (63 * 0.002 * np.cos(np.radians(20)))  # N, by the torque on the gear
    assert np.hypot(*values[0]) == pytest.approx(normal / wall, rel=1e-4)
    with pytest.raises(InputError, match="node: is missing, and housing is given by matrices"):
        load_case(write(tmp_path, text.replace('node = "stage_1.gear"', "")), fe)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda at: at.pop("stage.bolt_03"), "lacks stage.bolt_03 -- give this name to the node"),
        (lambda at: at.update({"stage.carrier_far": (0.9, 0.0, 0.4)}),
         "stage.carrier_far is .* mm from where the first support of its stage puts it"),
    ],
)  # fmt: skip
def test_nodes_that_are_not_where_supports_stand_are_refused(tmp_path, places, change, message):
    at = dict(places)
    change(at)
    with pytest.raises(InputError, match=message) as caught:
        stage_on(written(tmp_path, at, 1e12))
    assert "\n" not in str(caught.value)


def test_a_housing_without_a_mount_is_refused(tmp_path, places):
    keys = written(tmp_path, places, 1e12)
    table = tmp_path / "housing_nodes.csv"
    table.write_text(table.read_text().replace("mount_1", "foot"))
    with pytest.raises(InputError, match="has no node mount_1, so nothing holds the housing"):
        stage_on(keys)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"housing.kind": "reduced"}, "housing.fe_mesh_file: is missing"),
        ({"housing.kind": "reduced", "housing.fe_mesh_file": "a.npz"}, "fe_mesh_nodes: is missing"),
        ({"housing.fe_mesh_file": "a.npz"}, 'set kind = "reduced"'),
        ({"housing.kind": "reduced", "housing.fe_mesh_file": "a", "housing.fe_mesh_nodes": "b"},
         "housing.mount: a housing needs stiffness"),
        ({"housing.kind": "reduced", "housing.fe_mesh_file": "a", "housing.fe_mesh_nodes": "b",
          "housing.mass_kg": "5"}, "housing.mass_kg: is for a lumped housing"),
        ({"housing.kind": "reduced", "housing.fe_mesh_file": "/no", "housing.fe_mesh_nodes": "/no",
          **MOUNT}, "housing.fe_mesh_file.*there is no such file"),
    ],
)  # fmt: skip
def test_keys_that_belong_together(keys, message):
    with pytest.raises(InputError, match=message):
        build_system(make_case(**keys).case, make_bodies(make_case()))


def test_bearings_along_a_shaft_stand_on_nodes_of_their_own(tmp_path):
    """On a housing that hardly bends and moves they carry what they carry on the ground."""
    bearings = (
        "support = [{ z_mm = -90, radial_n_per_m = 9e8 }, "
        "{ z_mm = 150, radial_n_per_m = 4e8, axial_n_per_m = 3e8 }]"
    )
    train = write(tmp_path, spur_pair(f"teeth = 30, {bearings}"))
    places = {
        "mount_1": (0.0, 0.0, 0.0),
        "stage_1.pinion_1": (0.2, 0.1, 0.41),
        "stage_1.pinion_2": (0.2, 0.1, 0.65),
        "stage_1.gear": (0.5, 0.1, 0.5),
    }
    stiff = written(tmp_path, {n: np.array(x) for n, x in places.items()}, 1e14)
    force = []
    for keys in ({}, stiff | dict.fromkeys(MOUNT, "1e14")):
        system = build_system(load_case(train, keys))
        equilibrium = revolution(modal_system(system), np.array([0.0, 0.2]), system.rated_torque)
        recovery = Recovery(equilibrium)
        force.append([recovery.link_force(f"stage_1.pinion_support_{k}") for k in (1, 2)])
    on_ground, on_housing = np.array(force)
    assert np.abs(on_housing - on_ground).max() < 1e-4 * np.abs(on_ground).max()
    size = np.hypot(*np.moveaxis(on_ground[:, 0, :2], -1, 0))
    assert size * (0.09, 0.15) == pytest.approx(size[0] * 0.09)  # moments about the gear
    with pytest.raises(InputError, match=r"lacks stage_1.pinion_2 -- give this name to the node"):
        build_system(load_case(train, written(tmp_path, {
            n: np.array(x) for n, x in places.items() if n != "stage_1.pinion_2"
        }, 1e14) | dict.fromkeys(MOUNT, "1e14")))  # fmt: skip
