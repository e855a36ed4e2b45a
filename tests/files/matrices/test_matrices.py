"""Reduced matrices go out and come back to the last digit; other programs' are read and judged."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.io
from reduced_samples import beam, frequencies, ring

from flexgear.files.matrices.body import check, read_table, table_text
from flexgear.files.matrices.exchange import FORMATS, read_reduced, write_reduced
from flexgear.files.matrices.formats import op4_text, read_op4
from flexgear.model.errors import InputError

BODIES = {"beam": beam, "ring": ring}
MM = 1e3


def matrix_files(folder, name):
    skipped = ("_nodes.csv", "_vertices.csv")
    return [f for f in sorted(folder.glob(f"{name}*")) if not f.name.endswith(skipped)]


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", BODIES)
def test_round_trip(tmp_path, name, form):
    body = BODIES[name]()
    written = write_reduced(body, tmp_path, form)
    assert all(path.is_file() for path in written)
    matrices = read_reduced(matrix_files(tmp_path, name), tmp_path / f"{name}_nodes.csv")
    assert matrices.node_names == body.node_names and matrices.modes == body.modes
    assert np.array_equal(matrices.positions, body.positions)
    for key in ("stiffness", "mass", "recovery"):
        expected = getattr(body, key)
        if expected is not None:
            scale = np.abs(expected).max()
            assert np.abs(getattr(matrices, key) - expected).max() <= 1e-12 * scale


@pytest.mark.parametrize("name", BODIES)
def test_independent_readers_give_the_same_frequencies(tmp_path, name):
    body = BODIES[name]()
    expected = frequencies(body.stiffness, body.mass)
    write_reduced(body, tmp_path, "mtx")
    k, m = (scipy.io.mmread(tmp_path / f"{name}_{key}.mtx") for key in ("stiffness", "mass"))
    assert frequencies(k, m) == pytest.approx(expected, rel=1e-6)
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    write_reduced(body, tmp_path, "op4")
    matrices = op4.read(str(tmp_path / f"{name}.op4"))
    assert frequencies(matrices["kred"], matrices["mred"]) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("sparse", ["dense", "bigmat", "nonbigmat"])
@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("endian", ["<", ">"])
def test_op4_of_another_program(tmp_path, sparse, binary, endian):
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    rng = np.random.default_rng(1)
    a = np.where(rng.random((7, 5)) < 0.4, 0.0, rng.normal(size=(7, 5)))
    a[:, 3] = 0.0
    b = np.diag([1.0, -2e-30, 3e200])
    path = tmp_path / "other.op4"
    op4.write(str(path), {"KAA": a, "MAA": b}, binary=binary, sparse=sparse, endian=endian)
    matrices = read_op4(path.read_bytes(), str(path))
    assert np.array_equal(matrices["KAA"], a) and np.array_equal(matrices["MAA"], b)


def test_op4_of_ours_is_read_by_ours():
    a = np.array([[0.0, 1.5, -3e-90], [0.0, 0.0, np.pi]])
    assert np.array_equal(read_op4(op4_text({"A": a}).encode(), "")["A"], a)
    assert read_op4(op4_text({"A": 1e-200 * a}).encode(), "")["A"].any() == np.False_


def dmig(name, matrix, ids, modes):
    """DMIG* cards of the lower triangle by columns."""
    places = [(i, c) for i in ids for c in range(1, 7)] + [(i, 0) for i in modes]
    lines = [f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}"]
    for j, (node, component) in enumerate(places):
        lines.append(f"DMIG*   {name:16s}{node:16d}{component:16d}")
        for i in range(j, len(places)):
            if matrix[i, j]:
                value = f"{matrix[i, j]:.9E}".replace("E", "D")
                lines.append(f"*       {places[i][0]:16d}{places[i][1]:16d}{value:>16s}")
    return "\n".join(["$ made by hand", *lines, "GRID    1"])


def abaqus(matrix, ids):
    places = [(i, c) for i in ids for c in range(1, 7)]
    size = len(places)
    return "\n".join(
        f"{places[i][0]},{places[i][1]}, {places[j][0]},{places[j][1]}, {matrix[i, j]:.17e}"
        for i in range(size)
        for j in range(i + 1)
        if matrix[i, j]
    )


def user_element(stiffness, mass, ids):
    rows = [
        "** ELEMENT NODES",
        "** " + ", ".join(map(str, ids)),
        f"*USER ELEMENT, NODES={len(ids)}, LINEAR",
    ]
    rows += ["1, 2, 3, 4, 5, 6"] + [f"{k}, 1, 2, 3, 4, 5, 6" for k in range(2, len(ids) + 1)]
    for name, matrix in (("STIFFNESS", stiffness), ("MASS", mass)):
        rows.append(f"*MATRIX, TYPE={name}")
        lower = [f"{matrix[i, j]:.17e}" for i in range(len(matrix)) for j in range(i + 1)]
        rows += [", ".join(lower[k : k + 4]) for k in range(0, len(lower), 4)]
    return "\n".join(rows)


def without_modes(body):
    """Its interface alone: Guyan's reduction."""
    n = 6 * len(body.node_names)
    return replace(
        body, stiffness=body.stiffness[:n, :n], mass=body.mass[:n, :n], recovery=None, points=None
    )


IDS = (107, 12, 55)  # not in the order of their numbers


def table(ids, body, modes=()):
    rows = [f"{i},{name},{','.join(repr(float(x)) for x in p)}" for i, name, p in
            zip(ids, body.node_names, body.positions, strict=True)]  # fmt: skip
    return "\n".join(["id,name,x_m,y_m,z_m", *rows, *(f"{i},mode,,," for i in modes)])


def test_dmig(tmp_path):
    body, modes = beam(), (901, 903, 902, 905, 904)
    text = dmig("KAAX", body.stiffness, IDS, modes) + "\n" + dmig("MAAX", body.mass, IDS, modes)
    (tmp_path / "body.pch").write_text(text)
    (tmp_path / "nodes.csv").write_text(table(IDS, body, modes))
    matrices = read_reduced([tmp_path / "body.pch"], tmp_path / "nodes.csv")
    assert np.abs(matrices.stiffness - body.stiffness).max() < 1e-9 * body.stiffness.max()
    assert frequencies(matrices.stiffness, matrices.mass) == pytest.approx(
        frequencies(body.stiffness, body.mass), rel=1e-5
    )


@pytest.mark.parametrize("form", ["list", "user element"])
def test_abaqus_and_calculix(tmp_path, form):
    body = without_modes(beam())
    (tmp_path / "nodes.csv").write_text(table(IDS, body))
    files = [tmp_path / "sub.mtx"]
    if form == "list":
        files = [tmp_path / "x_STIF1.mtx", tmp_path / "x_MASS1.mtx"]
        files[0].write_text(abaqus(body.stiffness, IDS))
        files[1].write_text(abaqus(body.mass, IDS))
    else:
        files[0].write_text(user_element(body.stiffness, body.mass, IDS))
    matrices = read_reduced(files, tmp_path / "nodes.csv")
    assert np.array_equal(matrices.stiffness, body.stiffness) and np.array_equal(
        matrices.mass, body.mass
    )


def test_millimetres_and_tonnes(tmp_path):
    """N, mm, t, s: energies are in mJ; read, they are the body in SI."""
    body = beam()
    n = len(body.node_names)
    scale = np.full(len(body.stiffness), np.sqrt(1e-3))
    scale[: 6 * n] = np.tile([1e-3] * 3 + [1.0] * 3, n)  # q in m of q in mm, rad, t^½ mm
    in_mm = replace(
        body,
        stiffness=1e3 * body.stiffness * np.outer(scale, scale),
        mass=1e3 * body.mass * np.outer(scale, scale),
    )
    assert in_mm.mass[6 * n :, 6 * n :] == pytest.approx(np.eye(body.modes), abs=1e-9)
    write_reduced(in_mm, tmp_path, "npz")
    matrices = read_reduced([tmp_path / "beam.npz"], tmp_path / "beam_nodes.csv", units="mm")
    for key in ("stiffness", "mass"):
        assert getattr(matrices, key) == pytest.approx(getattr(body, key), rel=1e-12, abs=1e-6)
    mass = check(body, "beam")["mass_kg"]
    assert check(matrices, "beam")["mass_kg"] == pytest.approx(mass)
    unconverted = read_reduced([tmp_path / "beam.npz"], tmp_path / "beam_nodes.csv")
    with pytest.raises(InputError, match="same unit"):
        check(unconverted, "beam")


@pytest.mark.parametrize("name", BODIES)
def test_good_bodies_pass(name):
    body = BODIES[name]()
    figures = check(body, name)
    assert figures["rigid_residual"] < 1e-9 and figures["modes"] == body.modes
    assert figures["first_frequency_hz"] == pytest.approx(
        frequencies(body.stiffness, body.mass)[0], rel=1e-6
    )
    if name == "beam":
        volume = np.pi / 4 * (0.4 * (0.1**2 - 0.02**2) + 0.6 * 0.14**2)
        assert figures["mass_kg"] == pytest.approx(7850 * volume)


@pytest.mark.parametrize("digits", [8, 7])
def test_bodies_in_files_of_few_digits_pass(digits):
    """Rounding gives rigid motions a little stiffness, up or down; a body in two parts, whose
    motions are six more, is still none."""
    body = beam()
    k = np.array([[float(f"{x:.{digits}g}") for x in row] for row in body.stiffness])
    n = len(k)
    scale = 1.0 / np.sqrt(np.diag(k))
    values = np.linalg.eigvalsh(k * scale[:, None] * scale)
    assert np.count_nonzero(values < 1e-9) < 6  # so small that they were counted
    figures = check(replace(body, stiffness=k), "beam")
    expected = frequencies(body.stiffness, body.mass)[0]
    assert figures["first_frequency_hz"] == pytest.approx(expected, rel=1e-4)
    parts = replace(
        body,
        node_names=(*body.node_names, *(f"other_{name}" for name in body.node_names)),
        positions=np.vstack([body.positions] * 2),
        stiffness=np.kron(np.eye(2), body.stiffness),
        mass=np.kron(np.eye(2), body.mass),
    )
    interface = 6 * len(body.node_names)
    order = [j + part * n for part in (0, 1) for j in range(interface)]
    order += [j + part * n for part in (0, 1) for j in range(interface, n)]
    square = np.ix_(order, order)
    parts = replace(parts, stiffness=parts.stiffness[square], mass=parts.mass[square])
    with pytest.raises(InputError, match="has 12 motions without stiffness"):
        check(parts, "parts")


def spoiled(what):
    body = beam()
    k, m = body.stiffness.copy(), body.mass.copy()
    if what == "asymmetric":
        k[0, 6] *= 1.01
    elif what == "supported":
        k[0, 0] *= 1.5
    elif what == "loose":
        k[:, 4], k[4, :] = 0.0, 0.0
    elif what == "negative mass":
        m *= -1
    elif what == "wild mode":
        k[-1, -1], k[-1, -2], k[-2, -1] = 1e-300, 1e300, 1e300
    elif what == "endless mass":
        m *= 1e308 / m.max()
    elif what == "lengths":
        return replace(body, positions=1e3 * body.positions)
    elif what == "nan":
        k[0, 0] = np.nan
    elif what == "other size":
        m = m[:-1, :-1]
    elif what == "small":
        k = m = np.eye(12)
    return replace(body, stiffness=k, mass=m)


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("asymmetric", "not symmetric"),
        ("supported", "resists rigid motion"),
        ("loose", "rigid motion|without stiffness"),
        ("negative mass", "not positive"),
        ("endless mass", "not positive"),
        ("wild mode", "too large beside"),
        ("lengths", "positions are multiplied by 0.001"),
        ("nan", "not finite"),
        ("other size", "rows, the stiffness"),
        ("small", "need a square matrix"),
    ],
)
def test_bad_bodies_are_refused(what, message):
    with pytest.raises(InputError, match=message):
        check(spoiled(what), "beam")


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.op4", op4_text({"KAA": np.eye(3)}).encode()[:60]),
        ("a.npz", b"PK\3\4 no zip"),
        ("a.mtx", b"%%MatrixMarket matrix coordinate real general\n2 2 9\n1 1 1\n"),
        ("a.mtx", b"1,1,1,1\n"),
        ("a.pch", b"DMIG    KAAX    1       1\n"),
        ("a.txt", b"hello"),
        ("a.op4", b"\x18\0\0\0" + b"\1\0\0\0" * 9),
    ],
)
def test_files_that_are_not_whole(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    (tmp_path / "nodes.csv").write_text(table(IDS, beam()))
    with pytest.raises(InputError) as caught:
        read_reduced([tmp_path / name], tmp_path / "nodes.csv")
    assert "\n" not in str(caught.value) and "index" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "lack positions"), ("id,x\n1,2", "lack positions"),
        ("id,x_m,y_m,z_m\n1,0,0,zero", "zero"),
        ("id,x_m,y_m,z_m,z_m\n1,0,0,0,1", "column z_m: occurs twice -- keep one of them"),
        ("id,x_m,y_m,z_m\n1,0,0,0\n1,0,0,1", "equal ids"),
        ("id,name,x_m,y_m,z_m\n1,mount_1,0,0,0\n2,mount_1,0,0,1", "'mount_1' is the name of sev"),
    ],
)  # fmt: skip
def test_bad_tables(tmp_path, text, words):
    (tmp_path / "nodes.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_table(tmp_path / "nodes.csv")


def test_a_seventh_dof_is_no_missing_node(tmp_path):
    (tmp_path / "nodes.csv").write_text(table(IDS, beam()))
    for line, words in (("107, 7, 12, 1, 5.0", "node 107 has a dof 7"), ("9, 1, 12, 1, 5.0", "9")):
        (tmp_path / "x_STIF1.mtx").write_text(line)
        with pytest.raises(InputError, match=words):
            read_reduced([tmp_path / "x_STIF1.mtx"], tmp_path / "nodes.csv")


def test_table_in_millimetres_is_the_same(tmp_path):
    body = beam()
    text = table_text(body.node_names, body.positions, body.modes)
    rows = [line.split(",") for line in text.splitlines()]
    in_mm = [",".join(rows[0]).replace("_m", "_mm")]
    in_mm += [
        ",".join([*r[:3], *(repr(MM * float(v)) if v else "" for v in r[3:])]) for r in rows[1:]
    ]
    (tmp_path / "nodes.csv").write_text("\n".join(in_mm))
    table = read_table(tmp_path / "nodes.csv")
    assert table.positions == pytest.approx(body.positions, rel=1e-12)
    assert table.names == body.node_names and len(table.mode_ids) == body.modes
