"""What can hardly be meant is said, and nothing else."""

import math

import pytest

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.implausible import implausible
from flexgear.gears.nominal_stress import pitch_point_pressure
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import InputError
from flexgear.model.load import bundled_cases, load_case


def doubts(name, changes=()):
    case = load_case(name, dict(changes))
    return implausible(case, power_flow(case))


@pytest.mark.parametrize("name", bundled_cases())
def test_bundled_cases_are_plausible(name):
    """But for the one whose paper gives tooth numbers that do not assemble."""
    lines = doubts(name)
    assert len(lines) == (name == "herringbone")
    assert all("do not assemble: a tooth of planet 2 is 0.333 pitches off" in one for one in lines)


CLOSE = {"stage.planets": "4", "stage.planet_positions_deg": "[0, 45, 180, 270]"}
LOW = {f"stage.{gear}.addendum": "0.6" for gear in ("sun", "planet", "ring")}
THICK = {"stage.sun.profile_shift": "0.2", "stage.sun.addendum": "0.8"}
UNDERCUT = {  # reference distance as it is
    "stage.sun.teeth": "13", "stage.planet.teeth": "47",
    "stage.sun.addendum": "0.8", "stage.ring.teeth": "107", "stage.planets": "3",
}  # fmt: skip
THIN = {
    "stage.sun.profile_shift": "0.5", "stage.planet.profile_shift": "-0.5",
    "stage.ring.profile_shift": "0.5", "stage.sun.addendum": "1.4",
    "stage.planet.dedendum": "1.8", "stage.planet.root_fillet": "0.2",
}  # fmt: skip
SHAFT = {
    "stage.sun.shaft.sections.0.outer_diameter_mm": "190",
    "stage.sun.shaft.sections.0.inner_diameter_mm": "0",
    "stage.sun.shaft.sections.1.outer_diameter_mm": "190",
    "stage.sun.shaft.sections.1.inner_diameter_mm": "0",
}  # fmt: skip
PULLING = {"stage.gear_mesh.contact_law": "linear", "stage.sun.modifications.lead_crowning_um": "5"}
RATED = {"stage.planet_bearing.rolling": "roller"}
SIZES = {"count": 22, "diameter_mm": 60, "pitch_diameter_mm": 500, "length_mm": 100,
         "spacing_mm": 120}  # fmt: skip
ELEMENTS = {f"stages.stage_1.planet_bearing.elements.{k}": str(v) for k, v in SIZES.items()}


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        ("lin-parker", CLOSE, ["planets collide", "38.4 mm"]),
        ("lin-parker", {"stage.planets": "7"}, ["planets collide", "do not assemble"]),
        ("lin-parker", {"stage.normal_module_mm": "3"}, ["sun gear mesh", "tips reach 0.85 mm"]),
        ("lin-parker", {"stage.normal_module_mm": "2"}, ["tips end", "above the roots", "ring"]),
        ("lin-parker", LOW, ["contact ratio of 0.929", "sun", "contact ratio of 0.99", "ring"]),
        ("lin-parker", THICK, ["teeth overlap by", "sun gear mesh"]),
        ("wind-5mw", UNDERCUT, ["sun: its tool undercuts"]),
        (
            "wind-5mw",
            {"stage.sun.modifications.drive.lead_crowning_mm": "1.2"},
            ["stage.sun.modifications", "1200 µm missing on the drive flank", "0.067 modules"],
        ),
        (
            "wind-5mw",
            {"stage.planet.modifications.ring.helix_slope_mm": "-2"},
            ["stage.planet.modifications", "1000 µm", "ring flank"],
        ),
        (
            "wind-5mw",
            {"stage.planet_bearing.clearance_mm": "2"},
            ["stage.planet_bearing.clearance: 2 mm on every side is 0.11 modules", "unit"],
        ),
        (
            "grc-750kw",
            {"stages.0.planet_bearing.rollers.clearance_mm": "0.4"},
            ["planet_bearing.rollers.clearance: 0.4 mm on every side is 0.04 modules"],
        ),
        ("wind-5mw", PULLING, ["stage.gear_mesh.contact_law", "teeth pull", "one-sided"]),
        ("wind-5mw", THIN, ["tips of the sun", "addendum"]),
        ("wind-5mw", {"inputs.0.torque_knm": "4e4"}, ["sun gear mesh", "MPa", "check torque"]),
        ("wind-5mw", SHAFT, ["sun's shaft", "section 0", "yields"]),
        (  # 18 mm (27/cos 7.5° + 2)
            "wind-5mw",
            {"stage.sun.shaft.sections.0.outer_diameter_mm": "600"},
            ["section 0 of the sun's shaft is 600.00 mm thick, and the sun's tip circle has 526."],
        ),
        (
            "wind-5mw",
            {"stage.sun.shaft.sections.0.outer_diameter_mm": "401"},
            ["is 401.00 mm thick, and the carrier's hub_bore, in both plates, has 400.00 mm"],
        ),
        (
            "wind-5mw",
            {"stage.planet_bearing.radial_n_per_m": "6e6"},
            ["stage.planet_bearing.radial", "unit"],
        ),
        (
            "wind-5mw",
            {"stage.planet_bearing.radial_n_per_m": "6e12"},
            ["stage.planet_bearing.radial"],
        ),
        (
            "wind-5mw",
            {"stage.carrier.bearing_far.radial_n_per_m": "1.1e13"},
            ["stage.carrier.bearing_far"],
        ),
        (
            "wind-5mw",
            RATED | {"stage.planet_bearing.dynamic_rating_kn": "4"},
            ["planet_bearing.dynamic_rating is", "times the load on it"],
        ),
        ("wind-5mw", {"gravity_m_per_s2": "[0, -9810, 0]"}, ["gravity is 9810 m/s²"]),
        ("wind-5mw", {"gravity_m_per_s2": "[0, -0.00981, 0]"}, ["gravity is 0.00981 m/s²"]),
        (  # 4e6 N m · 11.27 · 2π/60 rad/s; two inputs of which one only brakes are no doubt
            "wind-5mw",
            {"inputs.0.speed_rpm": "-11.27"},
            ["the inputs take 4721 kW out of the train", "and the output drives"],
        ),
        (
            "nrel-5mw",
            {"material.young_modulus_gpa": "3"},
            ["stages.stage_1.planet.rating.steel has the strength", "modulus is 3 GPa"],
        ),
        (  # N mm/rad for N m/rad
            "wind-5mw",
            {"stage.planet_bearing.tilt_nm_per_rad": "1.6e11"},
            ["stage.planet_bearing.tilt is 1.6e+11 N m/rad", "check its unit"],
        ),
        (
            "wind-5mw",
            {"stage.planet_bearing.axial_n_per_m": "1e12"},
            ["stage.planet_bearing.axial is 1e+12 N/m", "check its unit, unless it is to be rigid"],
        ),
        (
            "nrel-5mw",
            {"stages.stage_1.planet_bearing.z_mm": "3000"},
            ["planet_bearing.z is 3000 mm from the middle of a planet of 491 mm width"],
        ),
        (  # 22 rollers of 60 mm on a circle of 600 mm, in a planet for bearings of 600 mm
            "nrel-5mw",
            ELEMENTS | {"stages.stage_1.planet_bearing.elements.pitch_diameter_mm": "600"},
            ["is 660 mm across", "the seat in its planet, bore_diameter, is 600 mm"],
        ),
        (
            "nrel-5mw",
            ELEMENTS | {"stages.stage_1.planet_bearing.elements.spacing_mm": "1300"},
            ["is 1400 mm long", "gear width and tip diameter"],
        ),
        (  # π 0.863² · 0.491 · 7850 kg
            "nrel-5mw",
            {"stages.stage_1.carrier.mass_kg": "10"},
            ["stages.stage_1.carrier.mass is 10 kg", "9e+03; check its unit"],
        ),
        (  # 5 MW / (12.1 · 2π/60 rad/s) · 19/75 = 1.0e6 N m
            "nrel-5mw",
            {"joints.0.torsion_nm_per_rad": "5e5"},
            ["joints.0.torsion: 5e+05 N m/rad twist by 2 rad under the 1e+06 N m"],
        ),
        (  # 93 · 11270/60 · π · 18 mm/cos 7.5°
            "wind-5mw",
            {"inputs.0.speed_rpm": "11270"},
            ["teeth mesh at 996.3 m/s", "check the unit of speeds"],
        ),
        (
            "nrel-5mw",
            {"stages.stage_3.face_width_mm": "3"},
            ["stage_3: the contact pressure of the gear mesh"],
        ),
        (  # 325 kN m / (120/21 · 82/23 · 88/22) / (5 mm · 22/(2 cos 14°)) tan 14°
            "grc-750kw",
            {"stages.hss.pinion.kinematics": "planar"},
            ["hss: stages.hss.pinion.support carries no thrust", "(planar)", "1.75e+04 N"],
        ),
        (
            "grc-750kw",
            {"stages.hss.gear_mesh.model": "face_load", "stages.hss.pinion.kinematics": "axial"},
            ["stages.hss.pinion.kinematics is not", "K_Hβ counts no tilt"],
        ),
    ],
)
def test_implausible_values_are_warned_of(name, changes, words):
    lines = doubts(name, changes)
    assert lines
    assert all(word in " / ".join(lines) for word in words), lines


def test_a_clearance_is_compared_with_the_size_of_its_bearing_too():
    """50 µm are 0.033 modules of 1.5 mm: much in a bore of 26 mm, usual in one of 43 mm."""
    for bore, warned in ((26, True), (43, False)):
        changes = {"stage.planet_bearing.clearance_um": "50", "stage.planet.bore_diameter_mm": bore}
        lines = doubts("ev-reducer", {key: str(value) for key, value in changes.items()})
        assert any("clearance: 0.05 mm" in line for line in lines) == warned, lines


RIGID = {f"stage.carrier.bearing_far.{k}": "1e12" for k in ("axial_n_per_m", "tilt_nm_per_rad")}
BESIDE = {"stages.stage_1.planet.bore_diameter_mm": "60"} | ELEMENTS  # the bore is for oil


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        *[("wind-5mw", {"gravity_m_per_s2": f"[0, {-size}, 0]"}) for size in (1.62, 9.81, 60)],
        ("wind-5mw", RIGID),  # springs that hold
        ("nrel-5mw", {"joints.0.torsion_nm_per_rad": "1e6"}),  # a dual-mass flywheel's angle
        ("pitch-drive", {"stages.0.sun.mass_kg": "20"}),  # with a motor's rotor, 144 discs
        (  # rollers on raceways in the planet, 540 mm + 60 mm
            "nrel-5mw",
            ELEMENTS | {"stages.stage_1.planet_bearing.elements.pitch_diameter_mm": "540"},
        ),
        (  # planet shafts in bearings beside the gear
            "nrel-5mw",
            BESIDE | {"stages.stage_1.planet_bearing.elements.spacing_mm": "620"},
        ),
        ("wind-5mw", {"stage.planet_bearing.z_mm": "700"}),
    ],
)
def test_unusual_designs_are_none_to_doubt(name, changes):
    assert not doubts(name, changes)


def test_pointed_teeth_are_refused():
    changes = {**THIN, "stage.sun.addendum": "1.8", "stage.planet.dedendum": "2.1"}
    with pytest.raises(InputError, match=r"sun\.addendum: flanks meet below the tip circle"):
        doubts("wind-5mw", changes)


@pytest.mark.parametrize("role", ["sun", "ring"])
@pytest.mark.parametrize("name", ["ev-reducer", "wind-5mw", "lin-parker"])
def test_flank_pressure_is_that_of_iso_6336_2(name, role):
    """σ_H0 = Z_H Z_E Z_ε √(F_t/(d_1 b) (u ± 1)/u) in the standard's own factors; Z_E of steel."""
    case = load_case(name)
    view, flow = case.view(), power_flow(case).stages[0]
    g, stage = stage_geometry(view), view.stage
    gear_mesh, base_helix = g.gear_meshes[role], g.base_helix_angle
    first, second = sorted((g.planet, g.gears[role]), key=lambda tooth: tooth.teeth)
    force = abs(flow.gear_mesh_forces[role])
    tangential = force * math.cos(base_helix) * math.cos(g.transverse_angle)
    at, aw = g.transverse_angle, gear_mesh.working_angle
    z_h = math.sqrt(2 * math.cos(base_helix) / math.tan(aw)) / math.cos(at)
    elastic = 2 * (1 - view.material.poisson_ratio**2) / view.material.young_modulus
    z_e = math.sqrt(1 / (math.pi * elastic))
    assert z_e / 1e3 == pytest.approx(189.8, rel=0.02)  # √(N/mm²)
    ratio, overlap = gear_mesh.transverse_contact_ratio, min(gear_mesh.overlap_ratio, 1)
    z_ratio = math.sqrt((4 - ratio) / 3 * (1 - overlap) + overlap / ratio)
    u = second.teeth / first.teeth
    sign = -1 if role == "ring" else 1
    diameter = 2 * first.base_radius / math.cos(at)
    load = tangential / (diameter * stage.face_width) * (u + sign) / u
    expected = z_h * z_e * z_ratio * math.sqrt(load)
    assert pitch_point_pressure(view, g, role, force) == pytest.approx(expected, rel=1e-9)
