"""Any two members, each lumped or a body of its own, go through every command."""

import json

import pytest
from report_pages import OF_RUNS, require_sound
from stage_samples import made_of, stiff_stage

from flexgear.cli import exchange_commands

STAGE = """
title = "Small stage"
[material]
young_modulus_gpa = 206
poisson_ratio = 0.3
density_kg_per_m3 = 7850
[stage]
planets = 3
normal_module_mm = 1.8
pressure_angle_deg = 20
face_width_mm = 20
backlash_ring_mm = 0.05
backlash_sun_mm = 0.05
planet_bearing = { radial_n_per_m = 2e8, axial_n_per_m = 5e7, tilt_nm_per_rad = 1e4 }
errors = { pin_tangential_um = [20, 0, 0] }
[stage.planet]
teeth = 21
bore_diameter_mm = 16
[stage.sun]
teeth = 18
support = { radial_n_per_m = 1e6, axial_n_per_m = 1e8, tilt_nm_per_rad = 1e3 }
[stage.ring]
teeth = 60
[stage.carrier]
[[inputs]]
member = "stage.carrier"
speed_rpm = 1500
torque_nm = 300
[output]
member = "stage.sun"
[solver]
fidelity = "quick"
gear_mesh_orders = 1
settle_s = 2e-4
duration_s = 1e-3
"""
LUMPED = {
    "ring": """
[stage.ring.support]
radial_n_per_m = 1e9
tangential_n_per_m = 1e9
axial_n_per_m = 1e9
tilt_nm_per_rad = 1e6
""",
    "carrier": """
[stage.carrier.support]
radial_n_per_m = 3e8
axial_n_per_m = 1e8
tilt_nm_per_rad = 2e4
""",
    "sun": "",
    "planet": "",
}
BODIES = {
    "ring": """
[stage.ring.fe]
rim_thickness_mm = 9
end = "-z"
[stage.ring.fe.bolts]
number = 8
circle_diameter_mm = 122
diameter_mm = 4
stiffness_radial_n_per_m = 2e8
stiffness_tangential_n_per_m = 2e8
stiffness_axial_n_per_m = 3e8
""",
    "carrier": """
[stage.carrier]
bearing_drive = { radial_n_per_m = 3e8, axial_n_per_m = 1e8, tilt_nm_per_rad = 2e4 }
bearing_far = { radial_n_per_m = 3e8, axial_n_per_m = 5e7, tilt_nm_per_rad = 2e4 }
[stage.carrier.fe]
drive_side = "-z"
plate_diameter_mm = 98
plate_thickness_drive_mm = 8
plate_thickness_far_mm = 8
plate_gap_mm = 24
web_width_mm = 16
web_clearance_mm = 1
pin_diameter_mm = 12
hub_outer_diameter_mm = 46
hub_bore_mm = 26
hub_length_mm = 14
seat_drive = { diameter_mm = 50, width_mm = 8 }
seat_far = { diameter_mm = 45, width_mm = 6 }
""",
    "sun": """
[stage.sun.shaft]
direction = "+z"
[[stage.sun.shaft.sections]]
length_mm = 60
outer_diameter_mm = 22
[stage.sun.shaft.spline]
radial_n_per_m = 1e8
axial_n_per_m = 1e8
tilt_nm_per_rad = 1e3
torsion_nm_per_rad = 1e5
""",
    "planet": "[stage.planet.fe]\n",
}
BEHIND_A_SHAFT = """inertia_kg_m2 = 0.002
mass_kg = 1
tilt_inertia_kg_m2 = 0.001
bearing = { radial_n_per_m = 2e8, axial_n_per_m = 1e8, tilt_nm_per_rad = 1e4 }
"""
CHOICES = {  # of any two members all four combinations
    "+".join(bends): bends
    for bends in (("ring", "carrier", "sun"), ("ring",), ("carrier",), ("sun",))
}


def text(flexible):
    """The case with the members that ``flexible`` names as bodies of their own, others lumped."""
    case = STAGE
    if "carrier" in flexible:
        case = case.replace("[stage.carrier]\n", "")
    if "sun" in flexible:
        case = case.replace('"stage.sun"\n', f'"stage.sun"\n{BEHIND_A_SHAFT}')
    return case + "".join((BODIES if m in flexible else LUMPED)[m] for m in BODIES)


@pytest.fixture
def case(request, flexgear, tmp_path, monkeypatch):
    """The case file of a choice of what has a body of its own; no body is reduced."""
    monkeypatch.setenv("FLEXGEAR_CACHE", str(tmp_path / "cache"))
    for place in ("solve.bodies", "studies.sweep"):
        monkeypatch.setattr(f"flexgear.{place}.stage_bodies", lambda s, *_: stiff_stage(s))
    monkeypatch.setattr(exchange_commands, "fe_sources", made_of(stiff_stage))
    path = tmp_path / "mine.toml"
    path.write_text(text(CHOICES.get(request.param, (request.param,))))
    monkeypatch.chdir(tmp_path)
    return path


DRAWN = "tolerance.errors.pin_tangential.standard_deviation_um=10"
COMMANDS = {
    "check": [],
    "static": ["-q", "--angle-deg", 0],
    "modes": ["-q", "--campbell"],
    "simulate": ["-q"],
    "compare": ["-q"],
    "sweep": ["-q", "damping.ratio=0.01,0.02", "--workers", 1, "--no-pictures", "--out", "swept"],
    "tolerance": ["-q", "--samples", 2, "--set", DRAWN, "--workers", 1, "--no-pictures",
                  "--set", "tolerance.positions_per_gear_mesh=4", "--out", "drawn"],
    "export": ["--rexs", "box.rexs"],
}  # fmt: skip
OF_FE_BODIES = {
    "mesh": ["-q"],
    "reduce": ["-q"],
    "export": ["--reduced", "matrices", "-q"],
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CHOICES, indirect=True)
def test_every_command_takes_it(case, flexgear):
    for command, options in COMMANDS.items():
        code, out, err = flexgear(command, case, *options)
        assert (code, bool(out)) == (0, True), (command, err)
    has_fe_bodies = ".fe]" in case.read_text()
    for command, options in OF_FE_BODIES.items():
        code, _, err = flexgear(command, case, *options)
        assert code == (0 if has_fe_bodies else 2), (command, err)
        assert has_fe_bodies or err.count("\n") == 1


@pytest.mark.parametrize("case", ["planet"], indirect=True)
def test_commands_take_fe_planets_beside_lumped_members(case, flexgear):
    for command in ("check", "static", "modes", "simulate", "compare"):
        code, out, err = flexgear(command, case, *COMMANDS[command])
        assert (code, bool(out)) == (0, True), (command, err)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["carrier"], indirect=True)
def test_a_run_is_drawn_and_replaced_as_a_whole(case, flexgear):
    """A run in place of another leaves nothing of that: no report, no pictures, no datasets."""
    out = case.parent / "out"
    flexgear.out("run", case, "-q", "--out", out, "--no-pictures")
    first = json.loads((out / "summary.json").read_text())
    flexgear.out("render", out, "-q")
    require_sound(out / "report.html", *OF_RUNS)
    changed = ("--set", "stage.errors.pin_tangential_um=[0, 0, 0]", "--no-pictures")
    assert flexgear("run", case, "-q", "--out", out, *changed)[0] == 0
    assert not (out / "report.html").exists() and not (out / "pictures").exists()
    assert "transient_without_errors.nc" not in {f.name for f in out.iterdir()}
    assert json.loads((out / "summary.json").read_text())["content_hash"] != first["content_hash"]
