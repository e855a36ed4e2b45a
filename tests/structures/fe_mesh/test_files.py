"""Files: what is written is read back; what is wrong with a user's file is said in one line."""

from pathlib import Path

import meshio
import numpy as np
import pytest

from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh.carrier_mesh import carrier_fe_mesh
from flexgear.structures.fe_mesh.fe_mesh import FeMesh, facet_areas
from flexgear.structures.fe_mesh.files import read_fe_mesh, write_fe_mesh
from flexgear.structures.fe_mesh.gears import ring_fe_mesh
from flexgear.structures.fe_mesh.inp import read_inp

from .small_bodies import keys, small_ring, wind_carrier

FORMATS = ("vtu", "msh", "inp")
CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float
)
TOP = np.array([[4, 5, 6, 7]])


@pytest.fixture(scope="module")
def bodies() -> dict[str, FeMesh]:
    return {
        "ring": ring_fe_mesh(small_ring(bolt_holes=True)),
        "carrier": carrier_fe_mesh(wind_carrier()),
    }


def save(path: Path, cells: list, data: dict | None = None, points: np.ndarray = CUBE) -> Path:
    meshio.Mesh(points, cells, cell_data=data or {}).write(path)
    return path


def one_line(error: pytest.ExceptionInfo[Exception], *parts: str) -> None:
    text = str(error.value)
    assert "\n" not in text
    for part in parts:
        assert part in text


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("body", ["ring", "carrier"])
def test_round_trip_keeps_vertices_cells_and_patches(
    bodies: dict[str, FeMesh], body: str, suffix: str, tmp_path: Path
) -> None:
    before = bodies[body]
    write_fe_mesh(before, tmp_path / f"body.{suffix}")
    after = read_fe_mesh(tmp_path / f"body.{suffix}", "m", list(before.facets))
    digits = 1e-13 if suffix == "inp" else 0.0  # CalculiX reads 20 characters
    np.testing.assert_allclose(after.points, before.points, rtol=digits, atol=0.0)
    np.testing.assert_array_equal(after.cells, before.cells)
    assert set(after.facets) == set(before.facets)
    for name, facets in before.facets.items():
        assert keys(after.facets[name]) == keys(facets), name
    assert [p.name for p in tmp_path.iterdir()] == [f"body.{suffix}"]


def test_deck_holds_right_handed_c3d8(bodies: dict[str, FeMesh], tmp_path: Path) -> None:
    write_fe_mesh(bodies["ring"], tmp_path / "ring.inp")
    text = (tmp_path / "ring.inp").read_text()
    assert "*ELEMENT, TYPE=C3D8, ELSET=EALL" in text
    deck = read_inp(tmp_path / "ring.inp")
    nodes = deck.points[deck.blocks[0][1]]
    e = nodes[:, [1, 3, 4]] - nodes[:, :1]
    assert (np.linalg.det(e) > 0.0).all()


def test_surface_faces_of_a_deck_are_numbered_as_in_calculix(tmp_path: Path) -> None:
    """CalculiX manual: C3D8 face 1 is 1-2-3-4, 2 is 5-8-7-6, 3 is 1-5-6-2, 4 is 2-6-7-3, …"""
    nodes = "\n".join(f"{i}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(CUBE.tolist(), 11))
    deck = (
        "*Heading\n two\n*Node\n" + nodes + "\n*Element, type=C3D8R,\n elset=Body\n"
        "7, 11, 12, 13, 14, 15, 16,\n17, 18\n** a remark\n*Surface, name=Right\n7, S4\n"
        "*Surface, name=Top, type=ELEMENT\nBody, S2\n*Nset, nset=low, generate\n11, 14, 1\n"
    )
    (tmp_path / "a.inp").write_text(deck)
    m = read_fe_mesh(tmp_path / "a.inp", "m", ["Right", "Top", "low"])
    assert (m.points[m.facets["Right"]][..., 0] == 1.0).all()
    assert (m.points[m.facets["Top"]][..., 2] == 1.0).all()
    assert (m.points[m.facets["low"]][..., 2] == 0.0).all()


def test_shell_elements_of_a_deck_name_a_patch(tmp_path: Path) -> None:
    nodes = "\n".join(f"{i}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(CUBE.tolist(), 1))
    (tmp_path / "a.inp").write_text(
        f"*NODE\n{nodes}\n*ELEMENT, TYPE=C3D8\n1,1,2,3,4,5,6,7,8\n"
        "*ELEMENT, TYPE=S4, ELSET=lid\n2,5,6,7,8\n"
    )
    m = read_fe_mesh(tmp_path / "a.inp", "m", ["lid"])
    assert keys(m.facets["lid"]) == keys(TOP)


def test_msh_of_gmsh_itself_is_read_with_its_physical_groups(tmp_path: Path) -> None:
    from flexgear.structures.fe_mesh.session import gmsh_session

    with gmsh_session("box") as gmsh:
        box = gmsh.model.occ.addBox(0, 0, 0, 300, 200, 100)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [box], name="steel")
        gmsh.model.addPhysicalGroup(2, [1], name="wall")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 80)
        gmsh.model.mesh.generate(3)
        for order in (1, 2):
            gmsh.model.mesh.setOrder(order)
            gmsh.write(str(tmp_path / f"box{order}.msh"))
    for order in (1, 2):
        m = read_fe_mesh(tmp_path / f"box{order}.msh", "mm", ["wall"], expected_size=0.3)
        assert m.kind == "tet"
        assert m.volume() == pytest.approx(0.006)
        assert facet_areas(m.points, m.facets["wall"]).sum() == pytest.approx(0.02)


def test_integer_arrays_named_like_patches_are_read_from_vtu(tmp_path: Path) -> None:
    cells = [("hexahedron", [range(8)]), ("quad", [[4, 5, 6, 7], [0, 3, 2, 1]])]
    data = {"lid": [np.array([0]), np.array([1, 0])]}
    m = read_fe_mesh(save(tmp_path / "a.vtu", cells, data), "m", ["lid"])
    assert keys(m.facets["lid"]) == keys(TOP)


def test_left_handed_cells_are_renumbered_and_facets_turned_outward(tmp_path: Path) -> None:
    cells = [("hexahedron", [[4, 5, 6, 7, 0, 1, 2, 3]]), ("quad", [[7, 6, 5, 4]])]
    data = {"lid": [np.array([0]), np.array([1])]}
    m = read_fe_mesh(save(tmp_path / "a.vtu", cells, data), "m", ["lid"])
    assert m.volume() == pytest.approx(1.0)
    p = m.points[m.facets["lid"][0]]
    assert np.cross(p[1] - p[0], p[2] - p[0])[2] > 0.0


def test_straight_quadratic_cells_lose_their_middle_nodes(tmp_path: Path) -> None:
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)]
    edges += [(0, 4), (1, 5), (2, 6), (3, 7)]
    points = np.vstack([CUBE, [(CUBE[a] + CUBE[b]) / 2 for a, b in edges]])
    path = save(tmp_path / "a.vtu", [("hexahedron20", [range(20)])], points=points)
    assert len(read_fe_mesh(path).points) == 8
    points[9] += [0.1, 0.0, 0.0]
    path = save(tmp_path / "b.vtu", [("hexahedron20", [range(20)])], points=points)
    with pytest.raises(InputError) as error:
        read_fe_mesh(path)
    one_line(error, "b.vtu", "curved", "10.0 %")


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_unit_slip_is_named_with_its_remedy(
    bodies: dict[str, FeMesh], suffix: str, tmp_path: Path
) -> None:
    ring = bodies["ring"]
    in_mm = FeMesh(ring.points * 1000.0, ring.cells, ring.kind, ring.facets)
    path = tmp_path / f"ring.{suffix}"
    write_fe_mesh(in_mm, path)
    for expected in (0.5, None):
        with pytest.raises(InputError) as error:
            read_fe_mesh(path, "m", expected_size=expected)
        one_line(error, path.name, "fe_mesh_unit", '"mm"')
    back = read_fe_mesh(path, "mm", expected_size=0.5)
    np.testing.assert_allclose(back.points, ring.points, atol=1e-15)


def test_missing_groups_are_listed_in_one_line(bodies: dict[str, FeMesh], tmp_path: Path) -> None:
    write_fe_mesh(bodies["ring"], tmp_path / "ring.msh")
    groups = ["outer", *(f"tooth_root_{j:03d}" for j in range(30, 60)), "bolt_99"]
    with pytest.raises(InputError) as error:
        read_fe_mesh(tmp_path / "ring.msh", "m", groups)
    one_line(error, "24 of 32 missing", "tooth_root_037", "and 18 more")


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        ([("hexahedron", [range(8)]), ("tetra", [[0, 1, 3, 4]])], "mixed element types"),
        ([("hexahedron", [range(8)]), ("wedge", [[0, 1, 2, 4, 5, 6]])], "mixed element types"),
        ([("quad", [[0, 1, 2, 3]])], "no solid cells"),
        ([("hexahedron", [[0, 2, 1, 3, 4, 5, 6, 7]])], "inside out"),
        ([("tetra", [[0, 1, 3, 4], [5, 7, 6, 2]])], "2 pieces"),
        ([("tetra", 3 * [[0, 1, 3, 4]])], "4 facets belong to more than two cells"),
        ([("hexahedron", [[*range(7), 99]])], "name points that are not there"),
    ],
)
def test_bodies_that_are_none_are_refused(cells: list, says: str, tmp_path: Path) -> None:
    path = save(tmp_path / "a.vtu", cells)
    with pytest.raises(InputError) as error:
        read_fe_mesh(path)
    one_line(error, "a.vtu", says)


def test_a_group_off_the_cells_is_refused(tmp_path: Path) -> None:
    cells = [("hexahedron", [range(8)]), ("quad", [[0, 1, 6, 7]])]
    path = save(tmp_path / "a.vtu", cells, {"cut": [np.array([0]), np.array([1])]})
    with pytest.raises(InputError) as error:
        read_fe_mesh(path, "m", ["cut"])
    one_line(error, "cut", "no facets of the solid cells")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("*NODE\n1\n2, 1\n", "no solid cells"),
        ("*NODE\n1, 0\n*ELEMENT, TYPE=C3D8\n1e30\n", "*ELEMENT"),
        (f"*ELEMENT, TYPE=C3D4\n{', '.join(['9' * 30] * 5)}\n", "*ELEMENT"),
        (f"*NSET, NSET=A\n1\n{', '.join('A' * 40)}\n", "more numbers than a mesh has"),
    ],
)
def test_odd_input_decks_are_refused(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "a.inp").write_text(text)
    with pytest.raises(InputError) as error:
        read_fe_mesh(tmp_path / "a.inp")
    one_line(error, says)


@pytest.mark.parametrize("suffix", FORMATS)
def test_broken_files_are_refused(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{suffix}"
    path.write_text("*NODE\n1, x, y\n" if suffix == "inp" else "nothing like it\n")
    with pytest.raises(InputError) as error:
        read_fe_mesh(path)
    one_line(error, path.name)
    path.write_text("")
    with pytest.raises(InputError):
        read_fe_mesh(path)


@pytest.mark.parametrize(("name", "says"), [("no.msh", "no such file"), ("no.stl", ".stl")])
def test_wrong_path_and_suffix_are_refused(name: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        read_fe_mesh(tmp_path / name)
    one_line(error, says)
