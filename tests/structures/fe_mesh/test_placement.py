"""A user's FE mesh that is elsewhere than in the case is refused in one line with what mends it."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_train import FLEXIBLE

from flexgear.coupling.build import require_workable
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.files import write_fe_mesh
from flexgear.structures.fe_mesh.groups import Groups
from flexgear.structures.fe_mesh.placement import Placement, check_place
from flexgear.structures.sources import fe_body
from flexgear.structures.sources.carrier import source as carrier_source
from flexgear.structures.sources.fe_body import FeBody
from flexgear.structures.sources.ring import source as ring_source

BODIES = {"ring": ring_source, "carrier": carrier_source}


def bundled(**changes: object) -> StageView:
    return load_case("wind-5mw", {"solver.fidelity": "quick"}).view().with_(**changes)


@pytest.fixture(scope="module")
def meshes() -> dict[str, FeMesh]:
    return {name: source(bundled()).fe_mesh() for name, source in BODIES.items()}


def moved(fe_mesh: FeMesh, turn: tuple[float, ...], shift: tuple[float, ...]) -> FeMesh:
    """Turned by degrees about the fixed x, then y, then z axis, then shifted by mm."""
    axes = Rotation.from_euler("xyz", turn, degrees=True).as_matrix()
    points = fe_mesh.points @ axes.T + np.array(shift) / 1e3
    return FeMesh(points, fe_mesh.cells, fe_mesh.kind, fe_mesh.facets)


def refusal(fe_mesh: FeMesh, groups: Groups, placement: Placement | None = None) -> str:
    with pytest.raises(InputError) as error:
        check_place(fe_mesh, groups, placement or Placement(), "own.vtu")
    text = str(error.value)
    assert "\n" not in text
    assert text.startswith("own.vtu: ")
    return text


def keys_of(text: str, body: str) -> Placement:
    """The placement that a refusal offers."""
    parts = {}
    for key in ("shift_mm", "turn_deg"):
        match = re.search(
            rf"stage\.{body}\.fe\.fe_mesh_{key} = (\[.*?\]|\S+?)(?=,? and |, or )", text
        )
        words = match[1].strip("[]").split(", ") if match else ["0"]
        numbers = [float(w) for w in words]
        parts[key] = numbers if len(numbers) == 3 else [0.0, 0.0, *numbers]
    return Placement(
        tuple(v / 1e3 for v in parts["shift_mm"]), tuple(np.radians(parts["turn_deg"]).tolist())
    )


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"stage.ring.fe.bolts.holes": True, "stage.ring.fe.bolts.first_angle": 0.05},
        {"stage.ring.fe.tie": "flank", "stage.planet_hand": "left"},
        {"stage.carrier.fe.drive_side": "+z", "stage.ring.fe.end": "+z", "stage.ring.fe.fits": ()},
        {"stage.planets": 4, "stage.planet_positions": tuple(np.radians([87.0, 0, 180, 267]))},
        {"stage.planets": 2},
    ],
)
def test_generated_meshes_are_in_place(changes: dict) -> None:
    case = bundled(**changes)
    for source in BODIES.values():
        check_place(source(case).fe_mesh(), source(case).groups, Placement(), "generated")


@pytest.mark.parametrize("body", ["ring", "carrier"])
@pytest.mark.parametrize(
    ("turn", "shift", "offered"),
    [
        ((0, 0, 0), (0, 0, 115), "fe_mesh_shift_mm = -115"),
        ((0, 0, 10), (0, 0, 0), "fe_mesh_turn_deg = -10"),
        ((0, 90, 0), (0, 0, 0), "fe_mesh_turn_deg = [0, -90, 0]"),
        ((-90, 0, 0), (0, 0, 0), "fe_mesh_turn_deg = [90, 0, 0]"),
        ((0, 0, 0), (7, -3, 0), "fe_mesh_shift_mm = [-7, 3, 0]"),
        ((0, 0, 0.2), (0, 0, 0), "fe_mesh_turn_deg = -0.2"),
        ((0, 2, 0), (0, 0, 0), "fe_mesh_turn_deg = [0, -2, 0]"),
        ((180, 0, 0), (0, 0, 0), "fe_mesh_turn_deg = ["),
        ((20, -70, 145), (2000, 300, -5000), "fe_mesh_shift_mm = ["),
    ],
)
def test_a_moved_mesh_is_refused_with_the_keys_that_mend_it(
    meshes: dict[str, FeMesh], body: str, turn: tuple, shift: tuple, offered: str
) -> None:
    groups, away = BODIES[body](bundled()).groups, moved(meshes[body], turn, shift)
    text = refusal(away, groups)
    assert offered in text
    mended = replace(away, points=keys_of(text, body).of(away.points))
    check_place(mended, groups, Placement(), "mended")
    off = np.linalg.norm(mended.points - meshes[body].points, axis=1)
    assert off.max() < 0.02 * groups.pitch


def test_a_placement_that_is_set_counts_in_the_one_that_is_offered(
    meshes: dict[str, FeMesh],
) -> None:
    away = moved(meshes["ring"], (0, 0, 10), (0, 0, 115))
    half = Placement((0.0, 0.0, -0.1), (0.0, 0.0, float(np.radians(-3))))
    shifted = replace(away, points=half.of(away.points))
    text = refusal(shifted, ring_source(bundled()).groups, half)
    assert (
        "set stage.ring.fe.fe_mesh_shift_mm = -115 and stage.ring.fe.fe_mesh_turn_deg = -10, or"
        in text
    )


def test_an_offset_far_below_a_pitch_is_accepted(meshes: dict[str, FeMesh]) -> None:
    for body, source in BODIES.items():
        groups = source(bundled()).groups
        a_little = moved(meshes[body], (0, 0, 0.02), (2e-3 * groups.pitch, 0, 4.0))
        check_place(a_little, groups, Placement(), "own.vtu")


def renamed(fe_mesh: FeMesh, new: Callable[[str], str]) -> FeMesh:
    return replace(fe_mesh, facets={new(name): rows for name, rows in fe_mesh.facets.items()})


def numbered(name: str, stem: str, change: Callable[[int], int]) -> str:
    if not re.fullmatch(rf"{stem}_\d+", name):
        return name
    digits = name.rsplit("_", 1)[1]
    return f"{stem}_{change(int(digits)):0{len(digits)}d}"


def swapped(a: str, b: str) -> Callable[[str], str]:
    other = {a: b, b: a}
    return lambda name: next((name.replace(k, v) for k, v in other.items() if k in name), name)


def test_clockwise_numbers_are_named(meshes: dict[str, FeMesh]) -> None:
    for body, stem, count in (("ring", "tooth_root", 93), ("carrier", "pin", 5)):
        clockwise = renamed(
            meshes[body],
            lambda name, s=stem, n=count: numbered(name, s, lambda k: (1 - k) % n + 1),
        )
        text = refusal(clockwise, BODIES[body](bundled()).groups)
        assert "clockwise" in text and "_2: " in text.replace("_002", "_2")


@pytest.mark.parametrize(
    ("body", "new", "words"),
    [
        ("ring", swapped("fit_1", "fit_2"), ["fit_", "z 185 mm", "z -185 mm"]),
        ("ring", swapped("end_minus", "end_plus"), ["end_", "2 of 283", "stage.ring.fe.end"]),
        ("ring", swapped("tooth_flank", "tooth_backflank"), ["flank_", "186 of 283"]),
        ("ring", swapped("tooth_root_007", "tooth_root_008"), ["tooth_root_00", "2 of 283"]),
        ("carrier", swapped("bearing_drive", "bearing_far"), ["bearing_", "z side"]),
        ("carrier", swapped("pin_2", "pin_5"), ["pin_", "2 of 8"]),
    ],
)  # fmt: skip
def test_a_misnamed_group_is_named_with_its_two_places(
    meshes: dict[str, FeMesh], body: str, new: Callable[[str], str], words: list[str]
) -> None:
    text = refusal(renamed(meshes[body], new), BODIES[body](bundled()).groups)
    for word in [*words, "its centre is at", "but belongs", "give that name"]:
        assert word in text


@pytest.mark.parametrize(
    ("body", "changes", "words"),
    [
        ("ring", {"stage.planet_hand": "left"}, ["tooth_root_001", "degrees", "planet_hand"]),
        ("ring", {"stage.ring.teeth": 92}, ["tooth_root_093", "stage.ring.teeth"]),
        ("ring", {"stage.ring.fe.fits": ()}, ["fit_1", "stage.ring.fe.fits", "1 more"]),
        ("ring", {"stage.normal_module": 0.02}, ["tooth_", "279 of 283"]),
        (
            "carrier",
            {"stage.carrier.fe.drive_side": "+z"},
            ["drive", "stage.carrier.fe.drive_side"],
        ),
        ("carrier", {"stage.planets": 4}, ["pin_5", "stage.planets"]),
        ("carrier", {"stage.normal_module": 0.017}, ["pin_", "5 of 8"]),
    ],
)
def test_a_mesh_of_another_case_is_refused(
    meshes: dict[str, FeMesh], body: str, changes: dict, words: list[str]
) -> None:
    text = refusal(meshes[body], BODIES[body](bundled(**changes)).groups)
    for word in words:
        assert word in text


def test_holes_that_the_case_has_not_are_refused() -> None:
    holed = ring_source(bundled(**{"stage.ring.fe.bolts.holes": True})).fe_mesh()
    assert "stage.ring.fe.bolts.holes" in refusal(holed, ring_source(bundled()).groups)
    turned = bundled(
        **{"stage.ring.fe.bolts.holes": True, "stage.ring.fe.bolts.first_angle": np.radians(7.2)}
    )
    assert "25 of 308" in refusal(holed, ring_source(turned).groups)


def with_mesh_file(case: StageView, body: str, path: Path, **keys: object) -> StageView:
    values = {"fe_mesh": "file", "fe_mesh_file": str(path), "fe_mesh_unit": "m", **keys}
    return case.with_(**{f"stage.{body}.fe.{key}": value for key, value in values.items()})


@pytest.mark.parametrize("body", ["ring", "carrier"])
@pytest.mark.parametrize("suffix", ["vtu", "msh", "inp"])
def test_the_opposite_motion_puts_a_file_back(
    meshes: dict[str, FeMesh], body: str, suffix: str, tmp_path: Path
) -> None:
    """x = R X + s of the keys undoes X = Rᵀ (x - s) of the file."""
    turn, shift = (0.3, -1.1, 2.0), (0.1, -0.2, 0.115)
    axes = Rotation.from_euler("xyz", turn).as_matrix()
    plain, path = meshes[body], tmp_path / f"own.{suffix}"
    back = (plain.points - shift) @ axes
    write_fe_mesh(FeMesh(back, plain.cells, plain.kind, plain.facets), path)
    case = with_mesh_file(bundled(), body, path, fe_mesh_shift=shift, fe_mesh_turn=turn)
    fe_mesh = BODIES[body](case).fe_mesh()
    assert np.abs(fe_mesh.points - plain.points).max() < 1e-12
    np.testing.assert_array_equal(fe_mesh.cells, plain.cells)
    BODIES[body](case).check()
    with pytest.raises(
        InputError, match=rf"own\.{suffix}: .* set stage\.{body}\.fe\.fe_mesh_shift_mm = \["
    ):
        BODIES[body](with_mesh_file(bundled(), body, path)).check()


def test_one_number_is_along_or_about_the_axis() -> None:
    keys = {
        "stage.ring.fe.fe_mesh_shift_mm": "-115",
        "stage.carrier.fe.fe_mesh_turn_deg": "[0, 0, 10]",
    }
    case = load_case("wind-5mw", keys).view()
    assert case.ring.fe_mesh_shift == (0.0, 0.0, -0.115)
    assert case.carrier.fe_mesh_turn == (0.0, 0.0, pytest.approx(np.radians(10)))
    with pytest.raises(InputError, match="fe_mesh_shift_mm: has 2 numbers"):
        load_case("wind-5mw", {"stage.ring.fe.fe_mesh_shift_mm": "[1, 2]"}).view()


def test_node_sets_that_the_case_has_not_are_refused_too(
    meshes: dict[str, FeMesh], tmp_path: Path
) -> None:
    path = tmp_path / "own.inp"
    write_fe_mesh(meshes["carrier"], path)
    with path.open("a", encoding="utf-8") as deck:
        nodes = "\n".join(str(k + 1) for k in np.unique(meshes["carrier"].facets["pin_1"]))
        deck.write(f"*NSET, NSET=pin_6\n{nodes}\n")
    with pytest.raises(InputError, match="pin_6: is none of the 5 groups"):
        carrier_source(with_mesh_file(bundled(), "carrier", path)).fe_mesh()


def test_where_a_mesh_is_put_and_judged_by_is_part_of_the_caches_key(
    meshes: dict[str, FeMesh], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A body that was in place for one case is looked at again for another."""
    path = tmp_path / "ring.vtu"
    write_fe_mesh(meshes["ring"], path)
    keys = []

    def record(key: str, compute: object, waiting: object) -> object:
        keys.append(key)
        raise KeyError

    monkeypatch.setattr(fe_body, "cached", record)
    plain = with_mesh_file(bundled(), "ring", path)
    for case in (
        plain,
        plain.with_(**{"stage.ring.fe.fe_mesh_shift": (0.0, 0.0, 1e-9)}),
        plain.with_(**{"stage.ring.fe.fe_mesh_turn": (0.0, 0.0, 1e-9)}),
        plain.with_(**{"stage.planet_hand": "left"}),
        plain,
    ):
        with pytest.raises(KeyError):
            ring_source(case).reduced()
    assert len(set(keys)) == 4 and keys[0] == keys[-1]

    read = []
    monkeypatch.setattr(FeBody, "fe_mesh", lambda source: read.append(source))
    monkeypatch.setattr(fe_body, "is_cached", lambda key: key == keys[0])
    ring_source(plain).check()
    assert not read
    ring_source(plain.with_(**{"stage.planet_hand": "left"})).check()
    assert len(read) == 1
    assert plain.bodies_hash() != plain.with_(**{"stage.ring.fe.fe_mesh_turn": 1e-9}).bodies_hash()


def test_a_file_of_a_train_is_named_with_its_stage(
    meshes: dict[str, FeMesh], tmp_path: Path
) -> None:
    path, train = tmp_path / "ring.vtu", tmp_path / "train.toml"
    write_fe_mesh(moved(meshes["ring"], (0, 0, 10), (0, 0, 0)), path)
    own_ring = f"""
fe_mesh = "file"
fe_mesh_file = "{path}"
fe_mesh_unit = "m"
"""
    train.write_text(FLEXIBLE.replace("[stages.ring.fe]\n", "[stages.ring.fe]" + own_ring))
    with pytest.raises(InputError) as error:
        require_workable(load_case(train))
    for word in (
        "train.toml",
        "stages.stage_1.ring.fe.fe_mesh_file",
        "ring.vtu: tooth_root_",
        "turn_deg",
    ):
        assert word in str(error.value)
    back = {"stages.0.ring.fe.fe_mesh_turn_deg": "-10"}
    require_workable(load_case(train, back))
