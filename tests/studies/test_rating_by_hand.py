"""A whole rating against a calculation that shares nothing with it: every factor of ISO 6336 in 42
load cases and two extreme ones, Miner's sums, lives and safeties of two editions."""

import json
import math

import numpy as np
import pytest
from studies.gearbox_by_hand import K_A, RATED, SPEED, STAGES, VISCOSITY, ByHand, loads

from flexgear.model.load import load_case
from flexgear.results.rating_files import rating_rows
from flexgear.studies.rating import rate

RANDOM = np.random.default_rng(7)
BINS = [
    (f"b{k}", round(float(hours), 1), round(share * RATED), round(speed * SPEED, 2))
    for k, (hours, share, speed) in enumerate(
        zip(RANDOM.uniform(200, 9000, 42), np.linspace(0.1, 2.6, 42), np.linspace(0.4, 1.1, 42),
            strict=True)
    )
]  # fmt: skip
EXTREME = [("stop", None, 5 * RATED, 60.0), ("brake", None, 4 * RATED, 0.0)]
HOURS = sum(hours for _, hours, *_ in BINS)


MORE = {  # keys of some gears' ratings
    ("low", "planet"): {"core_rockwell_hardness": 31, "face_width_mm": 290},
    ("high", "ring"): {"yield_strength_mpa": 750, "face_width_mm": 200},
}


def toml(value):
    """As a value of a TOML file."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(x)}" for key, x in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value)


def springs(stiffness, **more):
    return {"radial_n_per_m": stiffness, "axial_n_per_m": 1e9, "tilt_nm_per_rad": 5e7, **more}


def bearing(rolling, ratings, sizes):
    keys = ("dynamic_rating_kn", "static_rating_kn", "fatigue_load_limit_kn")
    of_elements = ("count", "rows", "spacing_mm", "diameter_mm", "pitch_diameter_mm",
                   "length_mm", "clearance_um")  # fmt: skip
    elements = {k: x for k, x in zip(of_elements, sizes, strict=True) if x}
    return springs(3e9, rolling=rolling, elements=elements, **dict(zip(keys, ratings, strict=True)))


BEARINGS = {
    "low": bearing("roller", (1900, 3300, 350), (21, 2, 120, 34, 250, 100, 45)),
    "high": bearing("ball", (400, 300, 12), (10, 1, 0, 40, 140, 0, 12)),
}


def stage_of(name, edition):
    """A stage as a user writes it."""
    data, hand = STAGES[name], ByHand(name, edition)
    stage = {
        "name": name, "planets": hand.n, "normal_module_mm": hand.m, "pressure_angle_deg": 20,
        "face_width_mm": hand.b, "planet_bearing": BEARINGS[name],
        "carrier": {"mass_kg": 2000, "equivalent_mass_kg": 1500, "support": springs(1e10)},
        "gear_mesh": {"model": "constant", "contact_law": "linear"},
    }  # fmt: skip
    if data["beta"]:
        stage |= {"helix_angle_deg": data["beta"], "planet_hand": "right"}
    for part, g in hand.of.items():
        keys = {"rz_flank": "flank_rz_um", "rz_root": "root_rz_um", "accuracy": "accuracy_grade",
                "hv": "vickers_hardness", "steel": "steel", "grade": "grade"}  # fmt: skip
        rating = {key: g[of] for of, key in keys.items()} | MORE.get((name, part), {})
        stage[part] = {"teeth": g["z"], "profile_shift": g["x"], "root_fillet": g["fillet"]}
        size = "rim_thickness_mm" if part == "ring" else "bore_diameter_mm"
        stage[part] |= {size: g["size"], "rating": rating}
    stage["sun"]["support"] = springs(1e8)
    stage["ring"]["support"] = springs(1e10, tangential_n_per_m=1e10)
    tip = {"teeth": hand.z0, "profile_shift": hand.x0, "tip_diameter_mm": hand.cutter_tip}
    return stage | {"ring": stage["ring"] | {"tool": tip}}


def as_toml(edition, load_cases):
    """The case; load_cases: name, hours (none: extreme), N m, r/min."""
    forced = [
        {"stage": name, "kind": role, "k_gamma": data["k_gamma"], "k_h_beta": k_h_beta}
        for name, data in STAGES.items()
        for role, k_h_beta in data["k_h_beta"].items()
    ]
    bins = [
        {"name": name, "torque_nm": torque, "speed_rpm": speed}
        | ({"extreme": True} if hours is None else {"hours": hours})
        for name, hours, torque, speed in load_cases
    ]
    sections = {
        "kinematics": "spatial",
        "material": {"young_modulus_gpa": 206, "poisson_ratio": 0.3,
                     "density_kg_per_m3": 7830},
        "lubricant": {"viscosity_40_mm2_per_s": VISCOSITY, "temperature_c": 60,
                      "cleanliness": "-/15/12"},
        "rating": {"edition": edition, "application_factor": K_A, "gear_meshes": forced},
        "stages": [stage_of(name, edition) for name in STAGES],
        "joints": [{"first": "low.sun", "second": "high.carrier", "torsion_nm_per_rad": 2e8,
                    "axial_n_per_m": 1e6}],
        "inputs": [{"member": "low.carrier", "speed_rpm": SPEED, "torque_nm": RATED}],
        "output": {"member": "high.sun"},
        "load_cases": bins,
    }  # fmt: skip
    return "\n".join(f"{key} = {toml(value)}" for key, value in sections.items())


def safety(curves, cycles):
    """Factor on all stresses with a Miner's sum of one, by halving."""
    low, high = 1e-3, 1e3
    for _ in range(100):
        middle = math.sqrt(low * high)
        damages = (c.damage(n, middle) for c, n in zip(curves, cycles, strict=True))
        low, high = (low, middle) if sum(damages) > 1 else (middle, high)
    return low


@pytest.fixture(scope="module", params=[2006, 2019])
def sheets(request, tmp_path_factory):
    """Edition, and rows of rating.csv by part or gear mesh, load case and quantity."""
    folder = tmp_path_factory.mktemp("by_hand")
    (folder / "mine.toml").write_text(as_toml(request.param, [*BINS, *EXTREME]), encoding="utf-8")
    rating = rate(load_case(folder / "mine.toml"), workers=1)
    return request.param, {tuple(row[:3]): row[3] for row in rating_rows(rating)}


def test_every_factor_and_every_sum_is_that_of_a_calculation_by_hand(sheets):
    edition, rows = sheets
    ratios = []  # computed over by hand

    def compare(owner, load_case, by_hand):
        ratios.extend(
            (float(rows[owner, load_case, symbol]) / value, owner, load_case, symbol)
            for symbol, value in by_hand.items()
        )

    for stage in STAGES:
        hand = ByHand(stage, edition)
        for part, role in (("planet", "sun"), ("sun", "sun"), ("planet", "ring"), ("ring", "ring")):
            curves, cycles = {"flank": [], "root": []}, []
            for label, hours, torque, speed in (*BINS, *EXTREME):
                force, v, turns = loads(torque, speed)[stage]
                k = hand.factors(role, force, v)
                compare(f"{stage} {role}", label, {s: x for s, x in k.items() if x})
                n = 60 * (hours or 0.0) * turns[part] * (1 if part == "planet" else hand.n)
                cycles.append(n)
                flank, root = hand.flank(part, role, force, v, k), hand.root(part, role, force, k)
                for kind, letter, life, (factors, curve) in (
                    ("flank", "H", "Z_NT", flank), ("root", "F", "Y_NT", root),
                ):  # fmt: skip
                    end = f" to the {role}" if part == "planet" else ""
                    owner = f"{stage}.{part} {kind}{end}"
                    of_life = dict(zip((life, f"S_{letter}"), curve.at(n or 1.0), strict=True))
                    compare(owner, label, {s: x for s, x in (factors | of_life).items() if x})
                    if hours:
                        curves[kind].append(curve)
                        damage = {"load_cycles": n, "damage": curve.damage(n)}
                        compare(owner, label, damage)
            for kind in curves:
                owner = f"{stage}.{part} {kind}" + (f" to the {role}" if part == "planet" else "")
                total = sum(c.damage(n) for c, n in zip(curves[kind], cycles, strict=False))
                sums = {"damage_sum": total, "life": HOURS / total}
                compare(owner, "all", sums | {"spectrum_safety": safety(curves[kind], cycles[:42])})
    assert len(ratios) > 15000
    # fillets of the ring are followed point by point
    wrong = [line for line in ratios if line[0] != pytest.approx(1.0, rel=1e-4)]
    assert not wrong, wrong[:10]


def test_loads_of_planets_bearings_are_those_of_their_gear_meshes(sheets):
    """The force that turns the carrier, and of helical teeth the couple of both axial forces at the
    pitch points, each times the key K_γ."""
    edition, rows = sheets
    for stage, data in STAGES.items():
        hand = ByHand(stage, edition)
        sun, planet, ring = (data[gear][0] for gear in ("sun", "planet", "ring"))
        distance = hand.mesh["sun"]["a"]
        for label, _, torque, speed in BINS:
            force = hand.k_gamma * loads(torque, speed)[stage][0]
            radial = force * hand.d["sun"] / 2 * (1 + ring / sun) / distance
            moment = force * math.tan(hand.beta) * 2 * distance * planet / (planet + sun) / 1e3
            for number in range(1, hand.n + 1):
                owner = f"{stage}.planet_bearing_{number}"
                computed = [rows[owner, label, symbol] for symbol in ("F_r", "M")]
                assert computed == pytest.approx([radial, moment], rel=1e-6, abs=1.0)
