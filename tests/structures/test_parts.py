"""Rings and carriers that are rigid: their nodes and mass follow from sizes, nothing is meshed."""

import numpy as np
import pytest

from flexgear.model.load import load_case
from flexgear.structures.bodies import rigid_rows
from flexgear.structures.fe_mesh.files import write_fe_mesh
from flexgear.structures.fe_mesh.solids import cylinder, prism, solid_of_fe_mesh
from flexgear.structures.sources.carrier import source as carrier_source
from flexgear.structures.sources.ring import source as ring_source

PARTS = {"ring": ring_source, "carrier": carrier_source}
HOLES = {
    "stage.ring.fe.bolts.holes": "true",
    "stage.ring.fe.bolts.number": "20",
    "stage.carrier.fe.pin_bore_mm": "100",
}


def apart(matrix, expected):
    scale = np.sqrt(np.diag(expected))
    return np.abs((matrix - expected) / scale / scale[:, None]).max()


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("wind-5mw", {}),
        ("wind-5mw", HOLES),
        ("wind-5mw", {"stage.carrier.fe.drive_side": "+z"}),
        ("ev-reducer", {"stage.planet_positions_deg": "[0, 91, 180, 272]"}),
    ],
)
def test_mass_and_nodes_are_those_of_the_fe_mesh(name, settings, part):
    """The FE mesh has chords for circles: its mass is off by some thousandths, and the middle of a
    seat by some millionths."""
    view = load_case(name, {"solver.fidelity": "standard", **settings}).view()
    source = PARTS[part](view)
    fe_mesh, rigid = source.fe_mesh(), source.rigid()
    assert apart(rigid.mass, solid_of_fe_mesh(fe_mesh).rigid_mass(view.material.density)) < 4e-3
    nodes = source.nodes(fe_mesh)
    assert tuple(node.name for node in nodes) == rigid.node_names
    size = np.abs(fe_mesh.points).max()
    assert rigid.positions == pytest.approx(
        np.array([node.place for node in nodes]), abs=3e-5 * size
    )
    assert np.array_equal(rigid.node_map, rigid_rows(rigid.positions))


def test_a_file_s_mass_is_its_own(tmp_path):
    """Half as wide a ring in the file: half the mass, while the case's sizes say otherwise."""
    narrow = load_case(
        "wind-5mw",
        {"solver.fidelity": "quick", "stage.face_width_mm": "215", "stage.ring.fe.fits": "[]"},
    ).view()
    write_fe_mesh(ring_source(narrow).fe_mesh(), tmp_path / "ring.msh", "narrow")
    view = narrow.with_(
        **{"stage.ring.fe.fe_mesh": "file",
           "stage.ring.fe.fe_mesh_file": str(tmp_path / "ring.msh"),
           "stage.ring.fe.fe_mesh_unit": "m"},
    )  # fmt: skip
    expected = solid_of_fe_mesh(ring_source(narrow).fe_mesh()).rigid_mass(view.material.density)
    assert apart(ring_source(view).rigid().mass, expected) < 1e-6
    assert apart(ring_source(view).rigid(from_files=False).mass, expected) > 1e-5


def test_halves_of_a_ring_are_images_of_each_other():
    single = load_case("wind-5mw").view()
    wide = {"stage.double_helical": True, "stage.half_gap": 0.05, "stage.carrier.fe.plate_gap": 1.0}
    double = single.with_(**wide)
    half, whole = ring_source(single).rigid(), ring_source(double).rigid()
    n = len(half.node_names)
    assert whole.node_names[::n] == ("tooth_left_001", "tooth_right_001")
    assert whole.mass[0, 0] == pytest.approx(2 * half.mass[0, 0])
    assert whole.mass[:3, 3:] == pytest.approx(0.0, abs=1e-9 * whole.mass[5, 5])
    offset = 0.5 * (0.05 + single.stage.face_width)
    expected = 2 * (half.mass[3, 3] + half.mass[0, 0] * offset**2)
    assert whole.mass[3, 3] == pytest.approx(expected)
    assert whole.positions[:n] == pytest.approx(half.positions - [0, 0, offset])
    assert whole.positions[n:] == pytest.approx(whole.positions[:n] * [1, 1, -1])


def test_closed_forms_of_solids():
    turn = np.linspace(0, 2 * np.pi, 4000, endpoint=False)
    circle = 0.1 * np.column_stack([np.cos(turn), np.sin(turn)]) + [0.3, -0.2]
    one, two = prism(circle, -0.1, 0.25), cylinder(0.1, -0.1, 0.25, (0.3, -0.2))
    assert one.rigid_mass(7850.0) == pytest.approx(two.rigid_mass(7850.0), rel=1e-5, abs=1e-9)
    box = prism(np.array([[0, 0], [2, 0], [2, 1], [0, 1.0]]), 0.0, 3.0)
    moved = box.shifted(-np.array([1, 0.5, 1.5])).rigid_mass(2.0)
    inertia = 12.0 / 12 * np.array([1 + 9, 4 + 9, 4 + 1])  # m (b² + c²)/12
    assert moved == pytest.approx(np.diag([12, 12, 12, *inertia]), abs=1e-12)
    assert box.mirrored().first == pytest.approx(box.first * [1, 1, -1])
