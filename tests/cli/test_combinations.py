"""Keys of a case with commands: each key with every command, on two cases in turn."""

import json
import re

import h5py
import numpy as np
import pytest
from cli.test_every_command import COMMANDS, WRITES, on_cheap_bodies, short

from flexgear.results.quantities import MISSING

CASES = ("herringbone", "wind-5mw")
PAIRS = {"stage.gear_mesh": '{ model = "per_pair", contact_law = "one-sided" }'}
WAVES = {"stage.gear_mesh": '{ model = "rectangular", contact_law = "one-sided" }'}
LINEAR = {"stage.gear_mesh": '{ model = "fourier", contact_law = "linear" }'}
BEARING = """{ radial_n_per_m = 4e9, axial_n_per_m = 1e9, tilt_nm_per_rad = 1e8,
    dynamic_rating_kn = 4000, rolling = "roller", PARTS }"""
RACES = "diameter_mm = 40, pitch_diameter_mm = 300"
ROWS = "count = 20, rows = 2, spacing_mm = 150, length_mm = 100"
ROLLERS = BEARING.replace("PARTS", f"rollers = {{ {ROWS} }}, elements = {{ {RACES} }}")
ELEMENTS = BEARING.replace("PARTS", f"elements = {{ {ROWS}, {RACES}, clearance_um = 20 }}")
HOUSING = """{ kind = "lumped", mass_kg = 1e4, inertia_kg_m2 = [1e4, 1e4, 1e4], mount = {
    radial_n_per_m = 1e10, axial_n_per_m = 1e10, tilt_nm_per_rad = 1e9,
    torsion_nm_per_rad = 1e9 } }"""
LOADS = """[{ member = "stage.carrier", force_n = [1e3, 2e3, 10], frame = "carrier" },
    { member = "stage.sun", times_s = [0, 0.003], forces_n = [[0, 0, 0], [1e3, 0, 50]] }]"""
SENSORS = """[
    { name = "probe", on = "stage.sun", measures = "displacement", direction = "x" },
    { name = "pin", on = "stage.planet_2", measures = "acceleration", vector = [1, 1, 0] },
    { name = "spin", on = "stage.ring", measures = "speed" },
    { name = "shaft", on = "stage.carrier", measures = "torque" }]"""
FAULTS = """[{ kind = "missing_tooth", gear = "sun", tooth = 3 %s },
    { kind = "wear", gear = "planet", planet = 2, flank = "ring", depth_um = 5 %s },
    { kind = "inner_race", bearing = "planet_bearing", planet = 1, width_mm = 3, depth_um = 9 }]"""
LOAD_CASES = """[{ name = "rated", hours = 100 },
    { name = "coasting", hours = 10, torque_nm = 0 },
    { name = "back", hours = 10, torque_nm = -1e5, back_driven = true },
    { name = "gust", extreme = true, torque_nm = 2e5, moment_nm = [100, 10, 0] }]"""
SOFT = '{ law = "speed", kind = "soft", times_s = [0, 0.01], speeds_rpm = [12, 11] }'
FLANKS = "{ lead_crowning_um = 5, tip_relief = { amount_um = 20, length_mm = 5 } }"
TORQUE = {"inputs.0.torque_knm": "", "inputs.0.torque_nm": "0", "drive": ""}
KEYS = {
    "loads and sensors": {
        "loads": LOADS,
        "gravity_m_per_s2": "[1, -9.81, 0]",
        "sensors": SENSORS,
        "housing": HOUSING,
        "drive": "",
        "inputs.0.machine": SOFT,
    },
    "faults": {**PAIRS, "stage.planet_bearing": ROLLERS, "faults": FAULTS},
    "bearings": {
        **WAVES,
        "stage.planet_bearing": ELEMENTS,
        "lubricant": "{ viscosity_40_mm2_per_s = 320, temperature_c = 60, contamination = 0.5 }",
        "load_cases": LOAD_CASES,
    },
    "line loads": {
        "stage.gear_mesh": '{ model = "face_load", slices = 3 }',
        "stage.sun.modifications": FLANKS,
    },
    "no load": {**WAVES, **TORQUE, "stage.planet_bearing.damping": "{ radial_n_s_per_m = 1e4 }"},
    "reversed": {
        **TORQUE,
        "inputs.0.torque_nm": "-1e4",
        "damping": '{ kind = "rayleigh", alpha_per_s = 1, beta_s = 1e-6 }',
        "solver.step_tolerance": "0.01",
    },
    "no speed": {**LINEAR, "inputs.0.speed_rpm": "0", "stage.errors.planet_thickness_um": "-20"},
}
LONG = (  # with FE bodies
    "response", "response --linear", "stability", "modify", "sweep", "run", "compare", "tolerance",
    "modes --campbell",
)  # fmt: skip
MORE = {
    "run": ["-q", "--no-pictures"],
    "modify": ["-q", "--trials", 2],
    "response": ["-q", "--speed-range", 0.999, 1, "--harmonics", 1],
    "response --linear": ["-q", "--speed-range", 0.999, 1],
}
NO_STATE = "no steady state was found"  # teeth that carry nothing rattle
FILES = ("static", "modes", "stability", "response", "simulate")
REFUSED = re.compile(r"flexgear: \S+: [a-z_]+(\[?\.?\w+\]?)*: .+ -- .+")


@pytest.fixture(autouse=True)
def cheap(flexgear, no_pixels, monkeypatch, tmp_path):
    on_cheap_bodies(monkeypatch, tmp_path / "cache")


def undeclared(folder):
    """Values of files that are NaN where their quantity declares none."""
    wrong = []
    for path in folder.rglob("*.nc"):
        with h5py.File(path) as data:
            for name, x in data.items():
                if x.dtype.kind == "f" and MISSING not in x.attrs and np.isnan(x[()]).any():
                    wrong.append(f"{path.name}: {name}")
    for path in folder.rglob("*.json"):
        json.loads(
            path.read_text(encoding="utf-8"),
            parse_constant=lambda x, at=path: wrong.append(f"{at.name}: {x}"),
        )
    return wrong


@pytest.mark.slow
@pytest.mark.parametrize("key", KEYS)
def test_each_key_works_with_every_command_or_is_refused(flexgear, tmp_path, key):
    wrong, row = [], list(KEYS).index(key)
    for number, (command, options) in enumerate((COMMANDS | MORE).items()):
        name, *more = command.split()
        if name in ("mesh", "reduce") or command == "export --reduced":
            continue  # of bodies alone
        case = CASES[0 if command in LONG else (number + row) % 2]
        side = ', side = "left"' if case == "herringbone" else ""
        texts = {k: " ".join(text.replace("%s", side).split()) for k, text in KEYS[key].items()}
        sets = [word for k, text in texts.items() for word in ("--set", f"{k}={text}")]
        if name in (*WRITES, "run"):
            more += ["--out", tmp_path / command]
        elif name in FILES:
            more += ["--out", tmp_path / f"{command}.nc"]
        elif name == "export":
            more.append(tmp_path / "box.rexs")
        code, text, err = flexgear(name, case, *more, *options, *short(name, case), *sets)
        refused = code == 2 and not text and REFUSED.fullmatch(err.splitlines()[-1])
        if code and not refused and not (name == "response" and NO_STATE in err):
            wrong.append(f"{command} {case}: {code} {err}")
    wrong += undeclared(tmp_path)
    assert not wrong, "\n".join(wrong)
