"""Bundled trains against what their papers print."""

import math
import re

import pytest

from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import Case
from flexgear.model.load import bundled_cases, bundled_text, load_case

TRAINS = ["double-rotor-5mw", "herringbone", "lin-parker", "nrel-5mw", "pitch-drive"]
COORDINATES = {"fixed": 0, "torsional": 1, "planar": 3, "axial": 4, "spatial": 6}


def dofs(train):
    """Coordinates of all lumped bodies; ring halves count twice."""
    total = 0
    for stage in train.stages:
        for part in stage.members:
            halves = 2 if part == "ring" and stage.double_helical else 1
            total += halves * COORDINATES[train.kinematics_of(f"{stage.name}.{part}")]
        if stage.kind == "planetary":
            total += stage.planets * COORDINATES[train.kinematics_of(f"{stage.name}.planet")]
    return total


@pytest.mark.parametrize("name", TRAINS)
def test_bundled_trains_are_complete(name):
    train = load_case(name)
    assert name in bundled_cases()
    assert isinstance(train, Case)
    assert train.name == train.source == name
    assert Case.model_validate_json(train.model_dump_json(), strict=False) == train
    for stage in train.stages:
        if stage.kind == "planetary":
            geometry = stage_geometry(train.view(stage.name))
            if not stage.allow_unassemblable:
                assert geometry.assembly == round(geometry.assembly)


@pytest.mark.parametrize("name", [*TRAINS, "ev-reducer", "star-ring", "grc-750kw"])
def test_every_value_is_labelled(name):
    """A label on the line, on its section's line or in the comment above either."""
    covered = False
    unlabelled = []
    for line in bundled_text(name).splitlines():
        value, _, comment = line.partition("#")
        labelled = re.search(r"\b([Pp]aper|[Pp]ublic|[Dd]erived|[Cc]hosen)\b", comment) is not None
        if not value.strip():
            if comment.startswith(" ---"):
                covered = False
            elif labelled:
                covered = True
        elif value.startswith("["):
            covered = covered or labelled if value.startswith("[[inputs") else labelled
        elif value.split("=")[0].strip() not in (
            "kind",
            "title",
            "name",
            "member",
            "first",
            "second",
        ):
            free = value.split("=")[0].strip() in ("model", "contact_law", "output_interval_ms")
            if not (labelled or covered or free):
                unlabelled.append(line)
    assert unlabelled == []


@pytest.mark.parametrize(("planets", "count"), [(3, 18), (4, 21), (6, 27)])
def test_lin_parker(planets, count):
    train = load_case("lin-parker", {"stage.planets": str(planets)})
    assert dofs(train) == count
    stage = train.stages[0]
    masses = {
        "sun": (0.4, 0.39),
        "ring": (2.35, 3.0),
        "carrier": (5.43, 6.29),
        "planet": (0.66, 0.61),
    }
    for name, printed in masses.items():
        member = stage.member(name)
        assert (member.mass, member.equivalent_mass) == printed
    # base circles, distance and working angle belong together at both gear meshes
    base = {n: stage.normal_module * stage.member(n).teeth / 2 * math.cos(stage.pressure_angle)
            for n in ("sun", "planet", "ring")}  # fmt: skip
    reach = stage.center_distance * math.cos(stage.sun_pressure_angle)
    assert base["sun"] + base["planet"] == pytest.approx(reach, rel=1e-12)
    assert base["ring"] - base["planet"] == pytest.approx(reach, rel=1e-12)
    for name, printed in (("sun", 77.42e-3), ("planet", 100.35e-3), ("ring", 275.03e-3)):
        assert stage.normal_module * stage.member(name).teeth == pytest.approx(printed, rel=0.011)
    assert train.held_members() == ("stage.ring",)


def test_pitch_drive():
    train = load_case("pitch-drive")
    assert dofs(train) == 43
    printed = [(12, 30, 75, 2.5, 26.24, 16.04), (18, 28, 75, 2.5, 22.54, 19.32),
               (16, 23, 65, 4.0, 26.07, 14.69)]  # fmt: skip
    for stage, (sun, planet, ring, module, outer, inner) in zip(train.stages, printed, strict=True):
        assert (stage.sun.teeth, stage.planet.teeth, stage.ring.teeth) == (sun, planet, ring)
        assert stage.normal_module == pytest.approx(1e-3 * module)
        geometry = stage_geometry(train.view(stage.name))
        assert math.degrees(geometry.sun_gear_mesh.working_angle) == pytest.approx(outer, abs=0.006)
        assert math.degrees(geometry.ring_gear_mesh.working_angle) == pytest.approx(
            inner, abs=0.006
        )
        # shifts fit the distance: hardly any backlash is left
        assert geometry.sun_gear_mesh.backlash < 5e-6
        assert geometry.ring_gear_mesh.backlash < 5e-6
        errors = stage.errors
        assert errors.of_planets("planet_eccentricity", 3) == (21e-6,) * 3
        assert errors.planet_eccentricity_phase == pytest.approx(
            [0, 2 * math.pi / 3, 4 * math.pi / 3]
        )
        assert (errors.sun_gear_mesh, errors.ring_gear_mesh) == ((15e-6,), (20e-6,))
    assert [s.errors.sun_eccentricity for s in train.stages] == [17e-6, 17e-6, 22e-6]
    assert [s.errors.ring_offset for s in train.stages] == [20e-6, 20e-6, 30e-6]
    assert [j.tangential for j in train.joints] == [1.3e9, 1.32e9]
    assert train.inputs[0].given_torque == pytest.approx(38.197, rel=1e-4)
    assert all(not stage.sun.support.matrix.any() for stage in train.stages)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_herringbone(planets):
    train = load_case("herringbone", {"stage.planets": str(planets)})
    assert dofs(train) == 16 + 4 * planets
    stage = train.stages[0]
    assert 2 * stage.face_width + stage.half_gap == pytest.approx(0.36)
    assert (stage.sun.teeth + stage.ring.teeth) % 3
    assert train.gyroscopic
    assert train.held_members() == ("stage.ring",)


def test_the_module_of_the_herringbone_stage_fits_printed_masses():
    """A hollow cylinder of the ring half's mass and J/r² ends at its tips; the sun's solid
    cylinder lies between its reference and tip circles."""
    train = load_case("herringbone")
    stage, density = train.stages[0], train.material.density
    g = stage_geometry(train.view(stage.name))
    gyration = stage.ring.equivalent_mass / stage.ring.mass * g.ring.base_radius**2
    area = stage.ring.mass / (density * math.pi * stage.face_width)
    bore = math.sqrt(gyration - area / 2)
    assert bore == pytest.approx(g.ring.tip_radius, rel=0.005)
    width = 2 * stage.face_width + stage.half_gap
    radius = math.sqrt(stage.sun.mass / (density * math.pi * width))
    assert g.sun.reference_radius < radius < g.sun.tip_radius


@pytest.mark.parametrize("name", ["nrel-5mw", "double-rotor-5mw"])
def test_wind_gearboxes_have_the_printed_gears(name):
    train = load_case(name)
    printed = [
        (0.863, {"sun": (855.0, 978.839), "planet": (765.0, 905.440), "ring": (2520.0, 2475.087)}),
        (0.584, {"sun": (378.0, 432.845), "planet": (756.0, 815.655), "ring": (1953.0, 1906.074)}),
    ]
    for stage, (distance, diameters) in zip(train.stages[:2], printed, strict=True):
        geometry = stage_geometry(train.view(stage.name))
        assert geometry.center_distance == distance
        for gear, (pitch, tip) in diameters.items():
            radii = getattr(geometry, gear)
            assert 2e3 * radii.reference_radius == pytest.approx(pitch, abs=1e-3)
            assert 2e3 * radii.tip_radius == pytest.approx(tip, abs=0.06)
        # the printed shifts and distances belong together: no more play than was chosen
        assert geometry.sun_gear_mesh.backlash == pytest.approx(0.5e-3, abs=6e-6)
        assert geometry.ring_gear_mesh.backlash == pytest.approx(0.5e-3, abs=6e-6)
    last = train.stages[2]
    for gear, (pitch, tip) in {"pinion": (341.183, 380.751), "gear": (1350.517, 1395.372)}.items():
        part = last.member(gear)
        reference = 1e3 * last.normal_module * part.teeth / math.cos(last.helix_angle)
        assert reference == pytest.approx(pitch, abs=1e-3)
        outer = reference + 2e3 * last.normal_module * (part.addendum + part.profile_shift)
        assert outer == pytest.approx(tip, abs=0.06)


def test_double_rotor_has_two_inputs():
    train = load_case("double-rotor-5mw")
    assert train.held_members() == ("stage_2.ring",)
    speeds = {port.member: port.speed * 30 / math.pi for port in train.inputs}
    assert speeds == pytest.approx({"stage_1.carrier": 12.1, "stage_1.ring": -16.21})
    assert sum(port.given_torque is not None for port in train.inputs) == 1
    assert load_case("nrel-5mw").held_members() == ("stage_1.ring", "stage_2.ring")


def test_the_bearing_behind_a_suns_shaft_is_named_by_its_port():
    for case, key, label in (("ev-reducer", "inputs.0", "input"), ("wind-5mw", "output", "output")):
        places = {p.key: p.labels for p in load_case(case).view("stage").bearings}
        assert places[f"{key}.bearing"] == (f"{label}_bearing",)
