"""Modified flanks: closed forms of every modification, which flank has it, its mean over a helical
contact line, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trains import stage_train

from flexgear.gears.modifications import MODIFICATIONS, Flank, gaps_of
from flexgear.gears.paths import gear_flanks, stage_paths
from flexgear.gears.slices import Line, cut
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.modifications import EndRelief, FlankModifications, FlankTable, Relief
from flexgear.model.read import tuples_of

EXTERNAL = Flank(tip=0.030, root=0.010, half_face=0.05, base_radius=0.06)
INTERNAL = Flank(tip=0.040, root=0.060, half_face=0.05, base_radius=0.12)
FLANKS = pytest.mark.parametrize("flank", [EXTERNAL, INTERNAL])


def missing(flank, height, z, **keys):
    """What a flank lacks at the share ``height`` of its active profile and at z."""
    rho = flank.root + np.asarray(height) * (flank.tip - flank.root)
    return sum(gap(rho, np.asarray(z)) for gap in gaps_of(FlankModifications(**keys), flank))


@FLANKS
@pytest.mark.parametrize(
    ("keys", "height", "z", "expected"),
    [
        ({"profile_crowning": 8e-6}, [0, 0.25, 0.5, 1], 0.02, [8e-6, 2e-6, 0, 8e-6]),
        ({"profile_slope": 8e-6}, [0, 0.25, 0.5, 1], 0.02, [-4e-6, -2e-6, 0, 4e-6]),
        ({"lead_crowning": 8e-6}, 0.3, [-0.05, -0.025, 0, 0.05], [8e-6, 2e-6, 0, 8e-6]),
        ({"helix_slope": 8e-6}, 0.3, [-0.05, -0.025, 0, 0.05], [-4e-6, -2e-6, 0, 4e-6]),
        ({"twist": 8e-6}, [0, 0, 1, 1, 0.5], [-0.05, 0.05, 0.05, 0.025, 0.05],
         [2e-6, -2e-6, 2e-6, 1e-6, 0]),
        ({"tip_relief": Relief(amount=8e-6, length=0.01)}, [0.5, 0.75, 1], 0, [0, 4e-6, 8e-6]),
        ({"tip_relief": Relief(amount=8e-6, length=0.01, form="parabolic")}, [0.4, 0.75, 1], 0,
         [0, 2e-6, 8e-6]),
        ({"root_relief": Relief(amount=8e-6, length=0.01)}, [-0.1, 0, 0.25, 0.6], 0,
         [8e-6, 8e-6, 4e-6, 0]),
        ({"end_relief": EndRelief(amount=8e-6, length=0.02)}, 0.2, [-0.05, -0.04, 0.03, 0.05],
         [8e-6, 4e-6, 0, 8e-6]),
        ({"end_relief": EndRelief(amount=8e-6, length=0.02, form="parabolic", end="+z")}, 0.2,
         [-0.05, 0.04, 0.05], [0, 2e-6, 8e-6]),
        ({"end_relief": EndRelief(amount=8e-6, length=0.08, end="-z")}, 0.2, [-0.05, -0.01, 0.05],
         [8e-6, 4e-6, 0]),
    ],
)  # fmt: skip
def test_closed_forms(flank, keys, height, z, expected):
    """Amounts are at the tip of external and internal gears alike, and at the same end in z."""
    np.testing.assert_allclose(missing(flank, height, z, **keys), expected, rtol=0, atol=1e-18)


@FLANKS
def test_relief_that_starts_at_a_diameter(flank):
    """The same as the length between the roll lengths of that circle and of the tip."""
    start = 0.4 * flank.tip + 0.6 * flank.root
    diameter = 2 * np.hypot(start, flank.base_radius)
    height = np.linspace(-0.1, 1.0, 23)
    by_diameter, by_length = (
        missing(flank, height, 0.0, tip_relief=Relief(amount=1e-5, form="parabolic", **begins))
        for begins in ({"start_diameter": diameter}, {"length": abs(flank.tip - start)})
    )
    np.testing.assert_allclose(by_diameter, by_length, rtol=0, atol=1e-17)


amounts = st.floats(-1e-4, 1e-4)
sizes = st.floats(1e-7, 1e-4)
forms = st.sampled_from(["linear", "parabolic"])
reliefs = st.builds(Relief, amount=sizes, length=st.floats(1e-4, 0.02), form=forms)
everything = st.fixed_dictionaries(
    {
        **dict.fromkeys(
            ("profile_crowning", "profile_slope", "lead_crowning", "helix_slope", "twist"), amounts
        ),
        "tip_relief": reliefs,
        "root_relief": reliefs,
        "end_relief": st.builds(
            EndRelief, amount=sizes, length=st.floats(1e-4, 0.05), form=forms,
            end=st.sampled_from(["both", "+z", "-z"]),
        ),
    }
)  # fmt: skip


@given(everything, st.sampled_from([EXTERNAL, INTERNAL]))
def test_modifications_add_up_and_keep_their_bounds(keys, flank):
    """Anywhere on the active profile and the face."""
    height, z = np.linspace(0, 1, 9)[:, None], np.linspace(-0.05, 0.05, 11)
    alone = {k: missing(flank, height, z, **{k: v}) for k, v in keys.items()}
    whole = missing(flank, height, z, **keys)
    np.testing.assert_allclose(whole, sum(alone.values()), rtol=0, atol=1e-18)
    assert np.isfinite(whole).all() and whole.shape == (9, 11)
    lowest = {"profile_slope": 0.5, "helix_slope": 0.5, "twist": 0.25}
    for name, gap in alone.items():
        amount = getattr(keys[name], "amount", keys[name])
        low, high = sorted((-lowest[name] * amount, lowest[name] * amount)) if name in lowest else (
            min(amount, 0.0), max(amount, 0.0))  # fmt: skip
        assert np.all(np.broadcast_to(gap, whole.shape) >= low - 1e-18)
        assert np.all(gap <= high + 1e-18)


def test_every_modification_has_its_key():
    assert set(MODIFICATIONS) == set(FlankModifications.model_fields)


def modified(folder, keys, **changes):
    """The small stage with these keys of its modifications."""
    settings = {f"stage.{name}": str(value) for name, value in keys.items()}
    return stage_train(folder, **{"stage.gear_mesh.model": '"per_pair"', **settings, **changes})


def paths(train, sign=1.0):
    view = train.view(train.stages[0].name)
    return {k: p for (k, _), p in stage_paths(view, dict.fromkeys(("sun", "ring"), sign)).items()}


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("planet_flank", ["sun", "ring"])
def test_a_planet_s_flank_meets_the_other_mate_under_the_other_torque(tmp_path, planet_flank, sign):
    """A flank is a side of the tooth: the same sign of the moment that loads on it have."""
    keys = {f"planet.modifications.{planet_flank}.lead_crowning_um": 9}
    by_kind = paths(modified(tmp_path, keys), sign)
    has = {kind for kind, path in by_kind.items() if path.gap_grid.any()}
    carrying = planet_flank if sign > 0 else f"{planet_flank}_coast"
    assert carrying in has
    side = np.sign(by_kind[carrying].planet_arm)
    assert has == {kind for kind, path in by_kind.items() if np.sign(path.planet_arm) == side}


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("gear", ["sun", "ring"])
@pytest.mark.parametrize("flank", ["drive", "coast"])
def test_drive_and_coast_flanks_of_a_gear(tmp_path, gear, flank, sign):
    """The coast flank of a case is the drive flank of the one whose torque has the other sign."""
    by_kind = paths(modified(tmp_path, {f"{gear}.modifications.{flank}.lead_crowning_um": 9}), sign)
    has = [kind for kind, path in by_kind.items() if path.gap_grid.any()]
    assert has == [gear if (flank == "drive") == (sign > 0) else f"{gear}_coast"]


def test_keys_of_one_flank_replace_those_of_both(tmp_path):
    keys = {"ring.modifications.lead_crowning_um": 6, "ring.modifications.helix_slope_um": 8,
            "ring.modifications.coast.lead_crowning_um": 0}  # fmt: skip
    train = modified(tmp_path, keys)
    flanks = gear_flanks(train.view("stage"), paths(train))
    gaps = {one.name: one.gap(0.0, np.array([0.0, 0.03])) for one in flanks if one.part == "ring"}
    np.testing.assert_allclose(gaps["drive"], [0.0, 10e-6], atol=1e-18)
    np.testing.assert_allclose(gaps["coast"], [0.0, 4e-6], atol=1e-18)


def test_halves_of_a_double_helical_stage_mirror_each_other(tmp_path):
    """A slope takes material off at the outer end of both halves."""
    keys = {"helix_angle_deg": 20, "double_helical": "true", "half_gap_mm": 20,
            "planet.modifications.helix_slope_um": 12}  # fmt: skip
    train = modified(tmp_path, keys)
    by_half = stage_paths(train.view("stage"), {"sun": 1.0, "ring": 1.0})
    for kind in ("sun", "ring", "sun_coast", "ring_coast"):
        left, right = by_half[kind, "left"], by_half[kind, "right"]
        assert np.abs(right.gap_grid).max() > 1e-6
        np.testing.assert_allclose(left.gap_grid, right.gap_grid, atol=1e-15)
        assert left.slope == -right.slope


RELIEF = {"amount_um": "40", "length_mm": "6"}


@pytest.mark.parametrize(("form", "power"), [("linear", 1), ("parabolic", 2)])
@pytest.mark.parametrize("gear", ["planet", "sun", "ring"])
def test_relief_of_a_spur_gear_rises_from_its_start_to_its_tip(tmp_path, gear, form, power):
    """The planet's tip is at the end of the path with the largest s, those of sun and ring at the
    other; both flanks have it, other gear meshes do not. Flanks touch where the least is left:
    40 µm over 6 mm of the path are steep."""
    keys = {f"{gear}.modifications.tip_relief.{k}": v for k, v in RELIEF.items()}
    keys[f"{gear}.modifications.tip_relief.form"] = f'"{form}"'
    for kind, path in paths(modified(tmp_path, keys)).items():
        if gear not in ("planet", kind.removesuffix("_coast")):
            assert not path.gap_grid.any()
            continue
        reach = path.center_distance * np.sin(path.alpha)
        rolls = {"planet": path.s_grid, "sun": reach - path.s_grid, "ring": reach + path.s_grid}
        ends = {"planet": path.s_hi, "sun": reach - path.s_lo, "ring": reach + path.s_lo}
        mate = rolls[kind.removesuffix("_coast")]
        internal = kind.startswith("ring")
        radius = rolls["planet"] * mate / (mate + (-1 if internal else 1) * rolls["planet"])
        base = path.base_radius_planet if gear == "planet" else path.base_radius_gear
        y = np.linspace(-2e-3, 0.0, 1501)  # along the profile, from the tip inwards
        outward = -1 if gear == "ring" else 1
        roll = np.sqrt(np.maximum(rolls[gear][:, None] ** 2 + 2 * outward * base * y, 0.0))
        left = np.clip(1 - outward * (ends[gear] - roll) / 6e-3, 0, 1)
        least = (40e-6 * left**power + y**2 / (2 * radius[:, None])).min(axis=1)
        less = 40e-6 * left[:, -1] ** power - least  # by a parabola, which it is to a tenth
        assert np.all(abs(path.gap_grid - least) <= 0.1 * less + 2e-8)
        assert 25e-6 < path.gap_grid.max() < 40e-6


def test_mean_gap_over_a_helical_contact_line():
    """Even stiffness, gap x on a path 0 … 1: the mean of x over what is inside."""
    slope, half = 0.4, 0.25
    slices = cut(np.ones_like, Line((0.0, 1.0), (0.0, 1.0), slope, half), 7, lambda s, z: s)
    s = slices.s[1:-1]
    low, high = np.clip(s - 0.1, 0, 1), np.clip(s + 0.1, 0, 1)
    np.testing.assert_allclose(slices.mean_gap[1:-1], 0.5 * (low + high), rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"planet.modifications.tip_relief": "{ amount_um = 9, length_mm = 100 }"},
         r"stage\.planet\.modifications\.tip_relief\.length.*: 100 mm is longer than the path"),
        ({"planet.modifications.sun.root_relief": "{ amount_um = 9, length_mm = 99 }"},
         r"stage\.planet\.modifications\.sun\.root_relief\.length.*longer than the path"),
        ({"ring.modifications.drive.tip_relief": "{ amount_um = 9, start_diameter_mm = 900 }"},
         r"ring\.modifications\.drive\.tip_relief\.start_diameter.*not on the active profile"),
        ({"sun.modifications.end_relief": "{ amount_um = 9, length_mm = 40 }"},
         r"sun\.modifications\.end_relief\.length.*longer than half of the face, 30 mm"),
        ({"sun.modifications.end_relief": '{ amount_um = 9, length_mm = 70, end = "+z" }'},
         r"end_relief\.length.*longer than the face, 60 mm"),
        ({"sun.modifications.tip_relief": "{ amount_um = 9 }"},
         r"sun\.modifications\.tip_relief\.length.*is missing.*start_diameter_mm"),
        ({"sun.modifications.tip_relief":
          "{ amount_um = 9, length_mm = 2, start_diameter_mm = 110 }"},
         r"start_diameter.*is given beside length"),
        ({"planet.modifications.drive.lead_crowning_um": "8"}, r"drive: is not a known key"),
    ],
)  # fmt: skip
def test_modifications_that_do_not_fit_are_one_line(tmp_path, keys, message):
    with pytest.raises(InputError, match=message) as fault:
        paths(modified(tmp_path, keys))
    assert "\n" not in str(fault.value)


def test_a_gear_mesh_without_paths_has_no_modified_flanks(tmp_path):
    keys = {"sun.modifications.lead_crowning_um": 5, "gear_mesh.model": '"constant"'}
    with pytest.raises(InputError, match="'constant' does not follow pairs along the path"):
        paths(modified(tmp_path, keys))


def plane(flank, rho, z):
    """A gap linear in ρ and z, which a table holds exactly; m."""
    return 1e-5 + 2e-4 * rho - 1e-4 * z + 3e-3 * rho * z


@FLANKS
@pytest.mark.parametrize("axis", ["roll_angles", "diameters"])
def test_a_table_is_bilinear_in_roll_length_and_z(flank, axis):
    rho = np.sort([flank.tip, 0.7 * flank.tip + 0.3 * flank.root, flank.root])
    z = np.array([-0.05, 0.01, 0.05])
    places = {"roll_angles": rho / flank.base_radius,
              "diameters": 2 * np.hypot(rho, flank.base_radius)}[axis]  # fmt: skip
    gaps = plane(flank, rho[:, None], z)
    table = {axis: tuple(places), "z": tuple(z), "gaps": tuple(map(tuple, gaps))}
    at, along = np.linspace(rho[0], rho[-1], 7)[:, None], np.linspace(-0.05, 0.05, 5)
    (gap,) = gaps_of(FlankModifications(table=FlankTable(**table)), flank)
    np.testing.assert_allclose(gap(at, along), plane(flank, at, along), rtol=0, atol=1e-16)
    outside = gap(np.array([rho[0] - 1.0, rho[-1] + 1.0]), np.array([-1.0, 1.0]))
    np.testing.assert_allclose(outside, [gaps[0, 0], gaps[-1, -1]], rtol=1e-12)


@FLANKS
def test_a_single_trace_holds_over_the_rest_of_the_flank(flank):
    """Of the helix at one diameter, and of the profile at one z."""
    rho = np.sort([flank.tip, flank.root])
    lead = {"roll_angles": (float(rho.mean()) / flank.base_radius,), "z": (-0.05, 0.05),
            "gaps": ((0.0, 4e-6),)}  # fmt: skip
    profile = {"roll_angles": tuple(rho / flank.base_radius), "z": (0.0,),
               "gaps": ((0.0,), (4e-6,))}  # fmt: skip
    points = [(lead, rho, 0.025 * np.ones(2)), (profile, rho @ [0.25, 0.75], np.array([0.04]))]
    for trace, at, along in points:
        (gap,) = gaps_of(FlankModifications(table=FlankTable(**trace)), flank)
        np.testing.assert_allclose(gap(at, along), 3e-6, rtol=1e-12)


GRID = "# measured\nz_mm; diameter_mm; gap_um; who\n-30; 105; 1,5; x\n30; 105; 2; x\n{}"


@pytest.mark.slow
def test_a_table_from_a_csv_file(tmp_path):
    """Points in any order, in the file's units; the same case with the table written out; the
    file's content, not its name, is in the hash."""
    (tmp_path / "sun.csv").write_text(GRID.format("30; 110; 4; x\n-30; 110; 3; x\n"))
    key = "sun.modifications.drive.table"
    read = modified(tmp_path, {key: '{ file = "sun.csv" }'})
    table = read.stages[0].sun.modifications.drive.table
    assert table.diameters == (0.105, 0.110) and table.z == (-0.03, 0.03)
    assert table.gaps == ((1.5e-6, 2e-6), (3e-6, 4e-6))
    written = modified(tmp_path, {
        f"{key}.diameters_mm": [105, 110], f"{key}.z_mm": [-30, 30],
        f"{key}.gaps_um": [[1.5, 2], [3, 4]],
    })  # fmt: skip
    a, b = paths(read), paths(written)
    assert a["sun"].gap_grid.max() > 1e-6 and not a["sun_coast"].gap_grid.any()
    np.testing.assert_array_equal(a["sun"].gap_grid, b["sun"].gap_grid)
    assert (
        Case.model_validate(tuples_of(read.to_dict(), "case", "")).content_hash()
        == read.content_hash()
    )
    first = read.content_hash()
    (tmp_path / "again.csv").write_text(GRID.format("30; 110; 4; x\n-30; 110; 3; x\n"))
    assert modified(tmp_path, {key: '{ file = "again.csv" }'}).content_hash() == first
    (tmp_path / "sun.csv").write_text(GRID.format("30; 110; 4; x\n-30; 110; 3,1; x\n"))
    assert modified(tmp_path, {key: '{ file = "sun.csv" }'}).content_hash() != first


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("30; 110; 4; x\n", r"flank table: has 3 points, but 2 different diameter_mm and 2 diff"),
        ("-30; 110; 4; x\n30; 105; 4; x\n", "line 6: repeats a point"),
        ("-30; 110; much; x\n", "line 5, gap_um: 'much' is not a number"),
        ("-30; 110; 4000; x\n30; 110; 4; x\n", r"table\.gaps.*reach 4 mm, beyond 2 mm"),
        ("-30; 190; 4; x\n30; 190; 4; x\n", r"table\.diameters: 105 … 190 mm do not fit the act"),
        ("-99; 110; 4; x\n", "has 3 points"),
        ("-30;110;4;x\n30;110;4;x\n99;105;0;x\n99;110;0;x\n", r"reaches 99 mm, beyond the face"),
    ],
)
def test_csv_tables_that_are_refused(tmp_path, rows, message):
    (tmp_path / "sun.csv").write_text(GRID.format(rows))
    with pytest.raises(InputError, match=message) as fault:
        paths(modified(tmp_path, {"sun.modifications.table": '{ file = "sun.csv" }'}))
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("z_mm,gap_um\n1,2\n", r"column roll_angle or diameter: is not among.*roll_angle_deg"),
        ("roll_angle_deg,z_mm,gap_n\n1,2,3\n", r"column gap: .*name a column gap_mm"),
        ("roll_angle_deg,z_mm,gap_um\n", "flank table: has no rows"),
        ("", "flank table: is empty -- give columns roll_angle_deg, z_mm, gap_mm"),
    ],
)
def test_csv_files_that_are_no_table(tmp_path, text, message):
    (tmp_path / "sun.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        modified(tmp_path, {"sun.modifications.table": '{ file = "sun.csv" }'})
