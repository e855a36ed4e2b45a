"""Left and right flanks of REXS are the right drive and coast flanks, by geometry and back."""

import numpy as np
import pytest
from rexs_samples import MM, NM, again, planetary

from flexgear.files.rexs.from_case import model_of_case, not_written
from flexgear.files.rexs.tables import FACES, tooth_side
from flexgear.gears.paths import flank_name, modified_flanks, stage_paths, tooth_sides
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case

BACKWARDS = {
    "herringbone": {"inputs.0.torque_knm": "-100"},
    "lin-parker": {"inputs.0.torque_nm": "-100"},
    "grc-750kw": {"inputs.0.torque_knm": "-325"},
}
SENSES = [(name, sense) for name in BACKWARDS for sense in (1, -1)]
GROUND = {
    "tip_relief": "{ amount_um = 30, length_mm = 3 }",
    "root_relief": "{ amount_um = 12, length_mm = 2, form = 'parabolic' }",
    "profile_crowning_um": "5",
    "lead_crowning_um": "-8",
    "profile_slope_um": "4",
    "helix_slope_um": "7",
    "twist_um": "-3",
    "end_relief": "{ amount_um = 20, length_mm = 6, end = '+z' }",
}


def directed(name, sense, more=None):
    return load_case(name, {**(BACKWARDS[name] if sense < 0 else {}), **(more or {})})


def seen(normal, up, datum):
    """Left or right for who looks at the face at the ``datum`` end from outside, ``up`` upwards."""
    to_the_right = np.cross([0.0, 0.0, -datum], [*up, 0.0])
    return "right" if to_the_right[:2] @ normal > 0 else "left"


@pytest.mark.parametrize(("name", "sense"), SENSES)
def test_loaded_flanks_are_those_of_the_geometry(name, sense):
    """A flank's outward normal is against the force on its tooth; a ring's tooth points inward."""
    case = directed(name, sense)
    for stage in case.stages:
        view, whole = case.view(stage.name), power_flow(case)
        flow, last = whole.stage(stage.name), stage.members[-1]  # carrier, or gear
        forward = flow.sun_gear_mesh_force >= 0
        assert forward == (whole.branch_torque[f"{stage.name}.{last}"] > 0)
        sides = tooth_sides(stage.kind, forward)
        for path in stage_paths(view, flow.gear_mesh_forces).values():
            if path.carries and path.kind.startswith("sun"):  # its compression holds the torque
                assert path.gear_arm * flow.sun_torque > 0
            touch = path.tangent_point - (path.s_lo + path.s_hi) / 2 * path.normal_xy
            mate = view.part(path.kind.gear)
            hub = view.part("planet")
            for datum in (1, -1):
                words = {
                    hub: seen(-path.normal_xy, touch, datum),
                    mate: seen(
                        path.normal_xy,
                        (touch + [path.center_distance, 0.0]) * (-1 if mate == "ring" else 1),
                        datum,
                    ),
                }
                for part, word in words.items():
                    side = sides[part, flank_name(part, path)]
                    assert side == tooth_side(word, part == "ring", datum)
                assert words[hub] == words[mate]  # left touches left: ISO 21771


def settings(case):
    """Other modifications on every flank, and some of both flanks, of every gear."""
    settings, scale = {}, 1
    for k, stage in enumerate(case.stages):
        parts = ("sun", "planet", "ring") if stage.kind == "planetary" else ("pinion", "gear")
        for part in parts:
            where = f"stages.{k}.{part}.modifications"
            names = ("sun", "ring") if part == "planet" else ("drive", "coast")
            for flank, keys in zip(names, (list(GROUND), list(GROUND)[::2]), strict=True):
                for key in keys:
                    value = GROUND[key].replace("amount_um = ", f"amount_um = {scale}")
                    if key.endswith("_um"):
                        value = f"{float(GROUND[key]) * scale:g}"
                    settings[f"{where}.{flank}.{key}"] = value
                scale += 1
            settings[f"{where}.helix_slope_um"] = "-2"
            settings[f"{where}.profile_slope_um"] = "1"
    return settings


def require_same_flanks(first, second):
    for old, new in zip(first.stages, second.stages, strict=True):
        for part in ("sun", "planet", "ring") if old.kind == "planetary" else ("pinion", "gear"):
            for flank in ("sun", "ring") if part == "planet" else ("drive", "coast"):
                a, b = (_numbers(getattr(s, part).modifications.of(flank)) for s in (old, new))
                assert a == pytest.approx(b, rel=1e-12), (part, flank)


def _numbers(modifications):
    """Amounts, lengths, and words as numbers, by key."""
    words = {"linear": 0.0, "parabolic": 1.0, "both": 0.0, "+z": 1.0, "-z": -1.0}
    out = {}
    for key, value in modifications.model_dump(exclude_none=True).items():
        for name, one in (value if isinstance(value, dict) else {"": value}).items():
            out[f"{key}.{name}"] = words.get(one, one)
    return out


@pytest.mark.parametrize(("name", "sense"), SENSES)
def test_flanks_come_back(tmp_path, name, sense):
    """Both hands, both senses of torque, internal gears, halves, parallel stages."""
    case = directed(name, sense, settings(load_case(name)))
    copy, conversion = again(case, tmp_path)
    require_same_flanks(case, copy)
    assert not any(
        "loaded_tooth_flank" in line or "no datum" in line for line in conversion.assumed
    )
    assert not any("modifications" in line for line in not_written(case))
    kinds = ("relief", "crowning", "slope", "twist", "flank")
    assert not [line for line in conversion.left_out if line.startswith(kinds)]


def test_outer_ends_of_halves():
    """z of a modification counts outwards: in the left half to the datum face, at −z of all."""
    case = load_case("herringbone", {"stage.sun.modifications.end_relief": GROUND["end_relief"]})
    model = model_of_case(case)
    flanks = {roles["gear"]: roles["left"] for kind, _, roles in model.relations if kind == "flank"}
    sun = [n + 1 for n, (_, name, _) in enumerate(model.components) if name == "stage.sun"]
    ends = [
        (
            model.components[n - 1][2]["u_coordinate_on_shaft"],
            model.components[r["referenced"] - 1][0],
        )
        for n in sun
        if n in flanks
        for kind, _, r in model.relations
        if kind == "reference" and r["origin"] == flanks[n]
    ]
    assert [kind for _, kind in sorted(ends)] == [f"end_relief_{face}" for face in FACES]


def ground(m, gears, **sides):
    """Give flanks of gears components: side -> (kind, attributes)."""
    for gear in gears:
        for side, flank in zip(("left", "right"), m.flanks(gear), strict=True):
            for kind, attributes in sides.get(side, ()):
                m.relate("reference", origin=flank, referenced=m.add(kind, **attributes))
    return m


def slope(amount):
    return ("helix_slope", {"helix_slope": (amount, "mum")})


def tip(amount):
    sizes = {"tip_relief_depth": (amount, "mum"), "tip_relief_datum_length": (3.0, MM)}
    return ("tip_relief", {**sizes, "shape_of_relief": ("linear", "")})


def end(face, amount):
    sizes = {f"end_relief_{k}_{face}": v for k, v in
             (("depth", (amount, "mum")), ("length", (10.0, MM)))}  # fmt: skip
    return (f"end_relief_{face}", {**sizes, "shape_of_relief": ("linear", "")})


def gears_of(m):
    return [m.sun, m.ring, *m.planets]


def test_the_carrier_drives_right_flanks_of_the_ring(tmp_path):
    """Datum face against u: a carrier that drives about +u loads the sun's left flank, the ring's
    right one, and the planet's left one at the sun; under the other torque all change."""
    m = ground(planetary(), gears_of(planetary()), left=[tip(30.0)], right=[tip(20.0)])
    for sense, left in ((1, ("drive", "coast", "sun")), (-1, ("coast", "drive", "ring"))):
        m.set(m.load, torque_around_u_axis=(sense * 3000.0, NM))
        case, conversion = m.case(tmp_path)
        stage = case.stages[0]
        assert stage.gear_mesh.model == "per_pair"
        for part, flank in zip(("sun", "ring", "planet"), left, strict=True):
            assert getattr(stage, part).modifications.of(flank).tip_relief.amount == 30e-6
            other = {"drive": "coast", "coast": "drive", "sun": "ring", "ring": "sun"}[flank]
            assert getattr(stage, part).modifications.of(other).tip_relief.amount == 20e-6
        assert sum("no datum_face_orientation" in line for line in conversion.assumed) == 3


@pytest.mark.slow
def test_the_other_datum_face_swaps_sides_and_ends(tmp_path):
    """The same machine with its datum faces on the other side, or with gears' own u axes turned."""
    left = [tip(30.0), slope(6.0), end("datum_face", 20.0)]
    right = [tip(20.0), slope(-4.0), end("non_datum_face", 15.0)]
    m = ground(planetary(), gears_of(planetary()), left=left, right=right)
    for gear in gears_of(m):
        m.set(gear, datum_face_orientation=("negative", ""))
    case, conversion = m.case(tmp_path)
    view = case.view("low")  # the case runs: its gear meshes have a place for modified flanks
    assert len(modified_flanks(view, stage_paths(view, {"sun": 1.0, "ring": 1.0}))) == 6
    assert not any("no datum" in line for line in conversion.assumed)
    assert (
        sum("positive where more is missing at the non-datum" in x for x in conversion.assumed) == 1
    )
    drive = case.stages[0].sun.modifications.of("drive")
    assert drive.helix_slope == pytest.approx(6e-6) and drive.end_relief.end == "-z"

    swapped = ground(
        planetary(), gears_of(m),
        left=[tip(20.0), slope(4.0), end("datum_face", 15.0)],
        right=[tip(30.0), slope(-6.0), end("non_datum_face", 20.0)],
    )  # fmt: skip
    turned = swapped.copy()
    for gear in gears_of(m):
        swapped.set(gear, datum_face_orientation=("positive", ""))
        turned.set(
            gear,
            datum_face_orientation=("negative", ""),
            u_axis_vector=((-1.0, 0.0, 0.0), MM),
        )
    for other in (swapped, turned):
        require_same_flanks(case, other.case(tmp_path)[0])


def test_contradictions_on_flanks_are_listed(tmp_path):
    """Contradicting loaded flank; planets that differ; ends that differ; no torque; two of one."""
    m = ground(planetary(), [planetary().sun], left=[tip(30.0), tip(5.0)], right=[tip(20.0)])
    m = ground(m, m.planets[:1], left=[tip(9.0)], right=[tip(9.0)])
    both = [end("datum_face", 20.0), end("non_datum_face", 15.0)]
    m = ground(m, [m.ring], left=both, right=both)
    relation = next(r for k, r in m.relations if k == "stage" and r["gear_1"] == m.sun)
    data = m.add("cylindrical_stage_gear_data", loaded_tooth_flank=("right", ""))
    m.relate("stage_gear_data", stage=relation["stage"], gear=m.sun, stage_gear_data=data)
    case, conversion = m.case(tmp_path)
    text = "\n".join(conversion.assumed)
    assert "not the flank that the torques load" in text
    assert "are not those of cylindrical_gear" in text
    assert (
        "differ and are left out" in text and case.stages[0].ring.modifications.end_relief is None
    )
    assert "has 2 of tip_relief" in text
    assert case.stages[0].sun.modifications.of("drive").tip_relief.amount == 30e-6

    m.set(m.load, torque_around_u_axis=None)  # without a torque the file's word counts
    case, conversion = m.case(tmp_path)
    assert case.output is None
    assert case.stages[0].sun.modifications.of("coast").tip_relief.amount == 30e-6
    m.set(data, loaded_tooth_flank=None)
    assert any("no torque determines the loaded flanks" in x for x in m.case(tmp_path)[1].assumed)


def test_uneven_crowning_and_lone_flanks(tmp_path):
    """A crowning that differs between its ends is the mean of both, of its flank alone."""
    crowning = ("helix_crowning", {
        "helix_crowning_amount_datum_face": (8.0, "mum"),
        "helix_crowning_amount_non_datum_face": (12.0, "mum"),
    })  # fmt: skip
    case, conversion = ground(planetary(), [planetary().sun], left=[crowning]).case(tmp_path)
    modifications = case.stages[0].sun.modifications
    assert modifications.lead_crowning is None and modifications.coast is None
    assert modifications.drive.lead_crowning == pytest.approx(10e-6)
    assert any("the mean is used" in line for line in conversion.assumed)
