"""Derived rows of a train's stages."""

import json
import math

import pytest
from gears.stages import UNLOADED, flexible_paths, helical, lin_parker, parallel, planetary, seen

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.report import case_reports, stage_report
from flexgear.model.errors import InputError
from flexgear.model.load import load_case


def test_a_planetary_stage_tells_what_its_geometry_says():
    stage = helical(gear_mesh={"model": "rectangular", "sun_stiffness": 3e9}, backlash_sun=2e-4)
    g, report = stage_geometry(seen(stage)), stage_report(seen(stage), UNLOADED)
    names = ["assembly", "sun", "planet", "ring", "sun_gear_mesh", "ring_gear_mesh", "not_modelled"]
    assert list(report) == names
    assembly, sun, contact = report["assembly"], report["sun"], report["sun_gear_mesh"]
    assert assembly["assembles"] is True
    assert assembly["(z_sun + z_ring)/N"] == 36
    assert assembly["planet_clearance_mm"] == pytest.approx(1e3 * g.planet_clearance)
    assert assembly["center_distance_mm"] == pytest.approx(270 / math.cos(stage.helix_angle))
    assert sun["tip_diameter_mm"] - sun["reference_diameter_mm"] == pytest.approx(20)
    assert contact["contact_ratio"] == pytest.approx(g.sun_mesh.total_contact_ratio)
    assert contact["backlash_um"] == pytest.approx(200)
    assert contact["mean_stiffness_n_per_m"] == pytest.approx(3e9)
    ratio = contact["transverse_contact_ratio"]
    assert contact["largest_stiffness_n_per_m"] == pytest.approx(2 / ratio * 3e9)
    assert contact["least_stiffness_n_per_m"] == pytest.approx(1 / ratio * 3e9)
    assert contact["phase_of_planets_in_pitches"] == [0, 0, 0]  # 84 / 3 is whole
    # c_γ b = c' (0.75 ε_α + 0.25) b
    ring = report["ring_gear_mesh"]
    peak = ring["iso_single_stiffness_n_per_mm_um"] * 1e9
    mean = peak * (0.75 * ring["transverse_contact_ratio"] + 0.25) * 0.1
    assert ring["mean_stiffness_n_per_m"] == pytest.approx(mean)


def test_phases_of_planets_that_are_not_in_phase():
    stage = planetary(sun={"teeth": 26}, planet={"teeth": 29})
    report = stage_report(seen(stage.model_copy(update={"allow_unassemblable": True})), UNLOADED)
    assert report["assembly"]["assembles"] is False
    assert report["assembly"]["largest_misfit_of_a_sun_tooth_in_pitches"] == pytest.approx(1 / 3)
    stage = planetary(planets=4, sun={"teeth": 30}, planet={"teeth": 28}, ring={"teeth": 86})
    report = stage_report(seen(stage), UNLOADED)
    assert report["ring_gear_mesh"]["phase_of_planets_in_pitches"] == [0, 0.5, 0, 0.5]
    assert report["sun_gear_mesh"]["phase_of_planets_in_pitches"] == [0, 0.5, 0, 0.5]


def test_printed_radii_are_said_to_be_given():
    report = stage_report(seen(lin_parker(4)), UNLOADED)
    assert report["assembly"]["radii"].startswith("as given")
    assert report["sun"]["base_diameter_mm"] == pytest.approx(77.42)
    assert report["ring"]["base_diameter_mm"] == pytest.approx(275.03)
    assert report["sun_gear_mesh"]["mean_stiffness_n_per_m"] == 5e8


def test_pinion_and_gear_and_one_gear_mesh():
    report = stage_report(seen(parallel(gear_mesh={"model": "per_pair"})), UNLOADED)
    assert list(report) == ["assembly", "pinion", "gear", "gear_mesh", "not_modelled"]
    assert "planets" not in report["assembly"]
    rows = report["gear_mesh"]
    assert rows["least_stiffness_n_per_m"] < rows["mean_stiffness_n_per_m"]
    assert rows["mean_stiffness_n_per_m"] < rows["largest_stiffness_n_per_m"]
    assert rows["pair_stiffness_peak_n_per_m"] < rows["largest_stiffness_n_per_m"]
    json.dumps(report, default=float, allow_nan=False)


def test_halves_are_said():
    rows = stage_report(seen(helical(double_helical=True, planets=1)), UNLOADED)["assembly"]
    assert rows["halves"] == 2
    assert rows["face_width_of_a_half_mm"] == pytest.approx(100)
    assert "planet_clearance_mm" not in rows


def test_a_flexible_stage_tells_its_paths_stiffness():
    case = load_case("wind-5mw").view()
    report = stage_report(case, power_flow(case.case).stages[0].gear_mesh_forces)
    peak = flexible_paths(case)["ring"].k_grid.max()
    assert report["ring_gear_mesh"]["pair_stiffness_peak_n_per_m"] == peak


@pytest.mark.parametrize(
    "name", ["lin-parker", "double-rotor-5mw", "nrel-5mw", "herringbone", "pitch-drive"]
)
def test_bundled_trains_have_a_report_without_gaps(name):
    train = load_case(name)
    reports = case_reports(train)
    text = json.dumps(reports, default=float, allow_nan=False)
    assert len(text) > 500
    assert all("assembly" in report for report in reports.values())
    assert len(reports) == len(train.stages)


def test_the_stage_that_does_not_assemble_is_named():
    train = load_case("nrel-5mw", {"stages.stage_2.planet_positions_deg": "[0, 100, 240]"})
    with pytest.raises(InputError, match=r"nrel-5mw: stages.stage_2.planets: .* do not assemble"):
        case_reports(train)
