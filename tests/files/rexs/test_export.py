"""Cases become REXS 2.0 that is valid, and that read again is the same case."""

import math
import re
from pathlib import Path

import pytest
from rexs_samples import again, case_of_file, exported, planetary, three_stages
from rexs_schema import require_valid
from train_contexts import BUNDLED

from flexgear.files.rexs.from_case import not_written
from flexgear.files.rexs.reading import read_rexs
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.load_bins import bins_of_load_cases, case_in_bin
from flexgear.gears.power_flow import power_flow
from flexgear.gears.rating.steels import allowable_stress
from flexgear.model.load import bundled_text, load_case

CASES = (*BUNDLED, "wind-5mw")
SLOPES = ("profile_slope", "helix_slope", "twist")
GROUND = {
    "stage.sun.modifications.tip_relief": "{ amount_um = 30, length_mm = 12 }",
    "stage.sun.modifications.profile_crowning_um": "6",
    "stage.planet.modifications.lead_crowning_um": "-8",
    "stage.planet.modifications.root_relief": "{ amount_um = 12, length_mm = 5 }",
    "stage.ring.modifications.end_relief": "{ amount_um = 20, length_mm = 15 }",
}


def require_same_gears(first, second):
    for old, new in zip(first.stages, second.stages, strict=True):
        a, b = stage_geometry(first.view(old.name)), stage_geometry(second.view(new.name))
        assert (new.planets, new.planet_hand, new.double_helical) == (
            old.planets, old.planet_hand, old.double_helical
        )  # fmt: skip
        assert new.planet_angles == pytest.approx(old.planet_angles, abs=1e-12)
        for name in ("base", "reference", "working_angles", "center_distance"):
            assert getattr(b, name) == pytest.approx(getattr(a, name), rel=1e-12)
        for slot, tooth in a.gears.items():
            assert _numbers(b.gears[slot]) == pytest.approx(_numbers(tooth), rel=1e-12)
            tools = b.gears[slot].tool, tooth.tool
            assert _numbers(tools[0]) == pytest.approx(_numbers(tools[1]), rel=1e-9)
        for slot, mesh in a.gear_meshes.items():
            scale = old.normal_module * 1e-12
            assert _numbers(b.gear_meshes[slot]) == pytest.approx(
                _numbers(mesh), rel=1e-11, abs=scale
            )


def _numbers(values):
    return {k: v for k, v in vars(values).items() if isinstance(v, (int, float))}


def renamed(values, old, new):
    """Values by member, with the other case's names of stages."""
    names = {a.name: b.name for a, b in zip(old.stages, new.stages, strict=True)}
    return {f"{names[k.split('.')[0]]}.{k.split('.')[1]}": v for k, v in values.items()}


@pytest.mark.parametrize("name", CASES)
def test_round_trip(tmp_path, name):
    case = load_case(name)
    copy = again(case, tmp_path)[0]
    require_same_gears(case, copy)
    a, b = power_flow(case), power_flow(copy)
    assert b.speed == pytest.approx(renamed(a.speed, case, copy), rel=1e-9, abs=1e-9)
    assert b.torque == pytest.approx(renamed(a.torque, case, copy), rel=1e-9, abs=1e-6)
    assert {p.member for p in copy.inputs} == {
        *renamed({p.member: 0 for p in case.inputs}, case, copy)
    }


def test_backlash_comes_back_as_it_is_written(tmp_path):
    """Without the rounding errors of profile shifts, centre distance and their difference."""
    pair = Path(__file__).parents[3] / "docs" / "examples" / "pair.toml"
    text = again(load_case(pair, {"stages.0.helix_angle_deg": 14, "stages.0.planet_hand": "right",
                                  "stages.0.pinion.teeth": 23, "stages.0.gear.teeth": 61,
                                  "stages.0.normal_module_mm": 4}), tmp_path)[1].text  # fmt: skip
    assert re.search(r"^backlash_sun_mm = 0\.06 ", text, re.MULTILINE)


def test_tools_come_back(tmp_path):
    """Rack with protuberance and stock, stated cutter; also where the file has no root diameter."""
    tools = {
        "stage.planet.tool": "{ protuberance_mm = 0.4, grinding_allowance_mm = 0.25 }",
        "stage.ring.tool": "{ teeth = 35, profile_shift = -0.1, protuberance_mm = 0.2 }",
    }
    case = load_case("wind-5mw", tools)
    require_same_gears(case, again(case, tmp_path)[0])
    path = tmp_path / "out.rexs"
    lines = path.read_text("utf-8").splitlines(keepends=True)
    path.write_text("".join(one for one in lines if '"root_diameter"' not in one), "utf-8")
    without = case_of_file(path)[0]
    first, second = (stage_geometry(one.view(one.stages[0].name)).ring for one in (case, without))
    assert second.root_radius == pytest.approx(first.root_radius, rel=1e-9)
    assert second.root.section.thickness == pytest.approx(first.root.section.thickness, rel=1e-6)


def test_modified_flanks_gravity_and_inertia_come_back(tmp_path):
    settings = {**GROUND, "gravity_m_per_s2": "[0.5, -9, 1]", "inputs.0.inertia_kg_m2": "12.5"}
    case = load_case("herringbone", settings)
    copy = again(case, tmp_path)[0]
    for gear in ("sun", "planet", "ring"):
        original, read = (s.member(gear).modifications for s in (case.stages[0], copy.stages[0]))
        for kind, value in original.model_dump(exclude_none=True).items():
            back = read.model_dump(exclude_none=True)[kind]
            assert back == (
                pytest.approx(value)
                if isinstance(value, float)
                else {
                    key: x if isinstance(x, str) else pytest.approx(x) for key, x in value.items()
                }
            )
        assert not any("modifications" in line for line in not_written(case))
    assert copy.gravity == pytest.approx(case.gravity, rel=1e-12)
    assert copy.inputs[0].inertia == 12.5
    masses = [
        s.member(m).mass
        for s in (case.stages[0], copy.stages[0])
        for m in ("sun", "planet", "ring")
    ]
    assert masses[3:] == pytest.approx(masses[:3])


@pytest.mark.parametrize("make", [planetary, three_stages])
def test_imported_cases_survive_export_and_import(tmp_path, make):
    """Springs, held members and joints of an imported case are the same after another turn."""
    case = make().case(tmp_path)[0]
    copy = again(case, tmp_path)[0]
    require_same_gears(case, copy)
    assert copy.held_members() == case.held_members()
    for stage, other in zip(case.stages, copy.stages, strict=True):
        parts = [*stage.members, "planet_bearing"]
        for part in parts:
            a, b = (
                s.planet_bearing if part == "planet_bearing" else s.member(part).support
                for s in (stage, other)
            )
            if getattr(a, "count", 1) == 1:
                assert b.matrix == pytest.approx(a.matrix, rel=1e-9, abs=1e-3), part
    for a, b in zip(case.joints, copy.joints, strict=True):
        assert (a.first, a.second) == (b.first, b.second)
        assert b.stiffness[5] == pytest.approx(a.stiffness[5], rel=1e-9)


@pytest.mark.parametrize("name", [*CASES, "with relief"])
def test_valid_by_the_schema(tmp_path, name):
    sloped = {f"stage.sun.modifications.drive.{k}_um": "5" for k in SLOPES}
    relief = {**GROUND, **sloped, "gravity_m_per_s2": "[0, -9.81, 0]"}
    case = load_case("lin-parker", relief) if name == "with relief" else load_case(name)
    require_valid(exported(case, tmp_path / "out.rexs"))


def test_results_balance(tmp_path):
    """Power of the loads sums to that of what is held, zero; speeds are those of the flow."""
    case = load_case("nrel-5mw")
    document = read_rexs(exported(case, tmp_path / "out.rexs"))
    document.take_load_case(document.load_cases[0])
    powers = [float(c.attributes["power"].value) for c in document.kind("external_load")]
    assert sum(powers) == pytest.approx(0, abs=1e-9 * max(powers))
    assert max(powers) == pytest.approx(5000)
    force = next(c for c in document.kind("cylindrical_stage")).attributes
    expected = abs(power_flow(case).stages[0].sun_gear_mesh_force)  # spur: along the tangent
    assert float(force["nominal_tangential_force_at_base_diameter"].value) == pytest.approx(
        expected
    )


def test_keys_that_rexs_does_not_hold_are_listed():
    missing = not_written(load_case("pitch-drive", {"stages.stage_1.sun.body_factor": 0.9}))
    assert "stages.stage_1.sun.body_factor" in missing
    assert {"damping", "solver", "stages.stage_1.errors", "stages.stage_1.gear_mesh"} <= {*missing}
    assert any("FE bodies" in line for line in not_written(load_case("wind-5mw")))
    keys = {
        "faults": '[{kind = "missing_tooth", gear = "sun", tooth = 1, side = "left"}]',
        "stage.gear_mesh.model": "per_pair",
        "stage.gear_mesh.contact_law": "one-sided",
        "stage.sun.support.damping.radial_n_s_per_m": "5",
        "stage.planet_bearing.damping.axial_n_s_per_m": "5",
    }
    missing = not_written(load_case("herringbone", keys))
    dampers = {f"stages.stage.{x}.damping" for x in ("sun.support", "planet_bearing")}
    assert dampers | {"faults", "stages.stage.gear_mesh"} <= {*missing}


def test_steels_surfaces_and_oil_come_back_with_the_same_strengths(tmp_path):
    """The grade of a steel is not in REXS; its strengths are, as numbers of ISO 6336-5."""
    case = load_case("nrel-5mw")
    back, _ = again(case, tmp_path)
    for old, new in zip(case.stages, back.stages, strict=True):
        for role in ("sun", "planet", "ring") if old.kind == "planetary" else ("pinion", "gear"):
            a, b = getattr(old, role).rating, getattr(new, role).rating
            for place in ("flank", "root"):
                assert b.grade is None and allowable_stress(b, place) == pytest.approx(
                    allowable_stress(a, place)
                )
            keys = ("steel", "vickers_hardness", "core_rockwell_hardness", "accuracy_grade")
            assert [getattr(a, key) for key in keys] == [getattr(b, key) for key in keys]
            roughness = [(r.flank_roughness, r.root_roughness) for r in (a, b)]
            assert roughness[0] == pytest.approx(roughness[1])
    assert back.lubricant.temperature == pytest.approx(case.lubricant.temperature)
    assert back.lubricant.viscosity_40 == pytest.approx(case.lubricant.viscosity_40)


def test_forces_come_back(tmp_path):
    text = """
[[loads]]
member = "stage.sun"
force_n = [10, 20, 30]
moment_nm = [4, 5, 0]
"""
    source = tmp_path / "loaded.toml"
    source.write_text(bundled_text("herringbone") + text, encoding="utf-8")
    (load,) = again(load_case(source), tmp_path)[0].loads
    assert (load.force, load.moment) == ((10, 20, 30), (4, 5, 0))


def test_load_cases_come_back(tmp_path):
    text = """
[[load_cases]]
name = "storm"
hours = 12
torque_knm = 20
moment_nm = [4, 5, 0]
[[load_cases.members]]
member = "stage.carrier"
force_n = [10, 20, 30]
[[load_cases]]
extreme = true
speed_rpm = 0
"""
    for name in ("nrel-5mw", "herringbone"):
        source = tmp_path / f"{name}.toml"
        more = text if name == "herringbone" else ""
        source.write_text(bundled_text(name) + more, encoding="utf-8")
        case = load_case(source)
        bins, back = bins_of_load_cases(case), again(case, tmp_path)[0]
        if name == "herringbone":
            storm, still = back.load_cases
            assert storm.members and not still.members  # no loads of zero
            assert storm.moment == (4, 5, 0) and still.moment is None
        for first, second in zip(bins, bins_of_load_cases(back), strict=True):
            assert second.name == first.name
            assert (first.extreme, second.hours) == (second.extreme, pytest.approx(first.hours))
            assert dict(second.torque) == pytest.approx(dict(first.torque), rel=1e-6)
            assert dict(second.speed) == pytest.approx(dict(first.speed), rel=1e-9)
            loads = {load.member: list(load.first) for load in second.loads if any(load.first)}
            assert loads == {load.member: list(load.first) for load in first.loads}


def test_load_factors_are_with_their_gear_meshes_in_every_load_case(tmp_path):
    """Those of the case, replaced by those of a load case; K_A is with the gear mesh itself."""
    text = """
[rating]
edition = 2006
application_factor = 1.25
k_v = 1.05
least_root_safety = 1.4
[[rating.gear_meshes]]
kind = "sun"
face_width_mm = 200
[[load_cases]]
hours = 12
k_v = 1.1
[[load_cases.gear_meshes]]
kind = "ring"
k_h_beta = 1.3
application_factor = 1.35
[[load_cases]]
hours = 24
"""
    source = tmp_path / "factors.toml"
    source.write_text(bundled_text("herringbone") + text, encoding="utf-8")
    case = load_case(source)
    path = exported(case, tmp_path / "out.rexs")
    require_valid(path)
    document = read_rexs(path)
    assert len(document.load_cases) == 3
    for state, k_v, of_ring in zip(
        document.load_cases, (1.05, 1.1, 1.05), (None, 1.3, None), strict=True
    ):
        with document.values_of(state):
            for gear_mesh in document.kind("cylindrical_stage"):
                stated = {k: v.value for k, v in gear_mesh.attributes.items() if "_factor" in k}
                k_h_beta = of_ring if ".ring" in gear_mesh.name else None
                assert stated.pop("face_load_factor_contact_stress_iso_6336_2006", None) == (
                    k_h_beta and str(k_h_beta)
                )
                k_a = 1.35 if k_h_beta else 1.25
                assert stated == {
                    "application_factor_iso_6336_2006": str(k_a),
                    "dynamic_factor_iso_6336_2006": str(k_v),
                }
    lines = {line for line in not_written(case) if "rating" in line or "load_cases" in line}
    unwritten = ("edition", "least_root_safety", "gear_meshes.0.face_width")
    assert lines == {f"rating.{key}" for key in unwritten}
    for each in (case, case_of_file(path)[0]):
        rules = [case_in_bin(each, load).rating for load in bins_of_load_cases(each)]
        applied = [
            [r.forced("stage", k).application_factor for k in ("sun", "ring")] for r in rules
        ]
        assert applied == [[1.25, 1.35], [1.25, 1.25]]


def test_place_relative_to_another_component(tmp_path):
    """Places that a file gives in a turned and shifted component's frame mean the same machine."""
    expected = planetary().case(tmp_path)[0]
    m = planetary()
    m.set(m.unit, support_vector=((0.0, 0.0, 0.0), "mm"), u_axis_vector=((1.0, 0.0, 0.0), "mm"))
    base = m.add(
        "gear_casing", "turned", support_vector=((10.0, 20.0, 30.0), "mm"),
        u_axis_vector=((-1.0, 0.0, 0.0), "mm"), w_axis_vector=((0.0, 0.0, 1.0), "mm"),
    )  # fmt: skip
    for number, (kind, _, attributes) in list(m.components.items()):
        if kind in ("shaft", "cylindrical_gear", "ring_gear", "concept_bearing", "coupling"):
            u, v, w = attributes["support_vector"][0]
            # rows of the base's axes: u = −x, w = z, v = w × u = −y
            m.set(
                number,
                support_vector=((10.0 - u, 20.0 - v, w - 30.0), "mm"),
                u_axis_vector=((-1.0, 0.0, 0.0), "mm"),
                reference_component_for_position=(base, "none"),
            )
    case = m.case(tmp_path)[0]
    assert case.content_hash() == expected.content_hash()


def test_bearings_of_shafts_come_back_with_their_ratings(tmp_path):
    """Each at its place, with the same life under thrust; the format has no X_0."""
    case = load_case("nrel-5mw")
    copy = again(case, tmp_path)[0]
    for part in ("pinion", "gear"):
        pairs = zip(
            case.stages[2].member(part).support, copy.stages[2].member(part).support, strict=True
        )
        for bearing, back in pairs:
            assert back.matrix == pytest.approx(bearing.matrix, rel=1e-9)
            for key in ("z", "dynamic_rating", "static_rating"):
                assert getattr(back, key) == pytest.approx(getattr(bearing, key), rel=1e-9)
            assert back.rolling == bearing.rolling
    lines = not_written(case)
    assert "stages.stage_3.pinion.support.1.thrust: static factors" in lines
    pair = copy.stages[2].pinion.support[1].thrust
    tangent = math.tan(math.radians(14))  # two tapered rows, ISO 281, table 8
    expected = (1.5 * tangent, 0.67, 0.67 / tangent, 0.45 / tangent)
    assert (pair.e, pair.x, pair.y, pair.y_1) == pytest.approx(expected, rel=1e-9)
