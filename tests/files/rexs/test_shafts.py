"""Shaft sections of files become beams of cases and go back, with their bearings and splines."""

import math

import numpy as np
import pytest
from rexs_samples import (
    MM,
    again,
    at,
    bearing,
    case_of_file,
    exported,
    planetary,
    three_stages,
)  # fmt: skip
from rexs_schema import require_valid
from scipy import optimize

import flexgear as fg
from flexgear.files.rexs.from_case import not_written
from flexgear.gears.implausible import implausible
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case

YOUNG, DENSITY = 206e9, 7800.0  # of the samples' steel
STEPPED = ((500.0, 40.0, 40.0, 0.0), (500.0, 50.0, 50.0, 20.0), (400.0, 32.0, 32.0, 0.0))
BELOW = (30.0, 60.0, 60.0, 0.0)  # below the gear, from its middle back: not in the beam
KIND = ("length", "outer_diameter_begin", "outer_diameter_end", "inner_diameter_begin",
        "inner_diameter_end")  # fmt: skip
CONSTANT = '{model = "constant", contact_law = "linear"}'


def add_sections(m, shaft, start, sections):
    """Sections one behind the other; returns where the last one ends, mm."""
    for length, *diameters, inner in sections:
        sizes = (length, *diameters, inner, inner)
        values = {key: (size, MM) for key, size in zip(KIND, sizes, strict=True)}
        m.part(shaft, "shaft_section", u_coordinate_on_shaft=(start, MM), **values)
        start += length
    return start


def clamped(sections=STEPPED, tilt=0.0, turned=False):
    """The planetary stage, its sun clamped by a bearing at the gear; its shaft goes from there
    through sections to a coupling, behind which a bearing carries a small rotor."""
    m = planetary()
    way = -1.0 if turned else 1.0
    m.set(m.unit, **at(0))
    m.set(m.sun_shaft, support_vector=((50.0 - way * 50.0, 0.0, 0.0), MM),
          u_axis_vector=((way, 0.0, 0.0), MM))  # fmt: skip
    end = add_sections(m, m.sun_shaft, 20.0, [BELOW, *sections])
    place = 50.0 + way * (end - 50.0)
    rotor = m.part(m.unit, "shaft", "rotor", **at(place))
    m.coupling = m.side(
        "coupling", m.sun_shaft, rotor, "coupling", **at(place), radial_stiffness=(1e11, "N / m"),
        axial_stiffness=(1e11, "N / m"), bending_stiffness=(1e3 * tilt, "N mm / rad"),
        rotational_stiffness=(1e11, "N mm / rad"), u_coordinate_on_shaft_inner_side=(end, MM),
        u_coordinate_on_shaft_outer_side=(0.0, MM),
    )  # fmt: skip
    rigid = {**bearing(1e12, 1e12, 50.0), "bending_stiffness": (1e15, "N mm / rad")}
    m.gear_bearing = m.side("concept_bearing", m.sun_shaft, m.casing, **rigid)
    m.end_bearing = m.side("concept_bearing", rotor, m.casing, **bearing(1e12, 1e11, place))
    m.relations = [r for r in m.relations if r[1].get("part") != m.brake]
    m.relate("assembly", assembly=rotor, part=m.brake)
    m.mass = m.part(
        rotor, "additional_mass", mass_of_component=(0.2, "kg"), u_coordinate_on_shaft=(0.0, MM),
        **{f"moment_of_inertia_{axis}_axis": (2e-3, "kg m^2") for axis in "uvw"},
    )  # fmt: skip
    return m


def bending_frequencies(sections, count):
    """Natural frequencies (Hz) of a stepped Euler-Bernoulli beam, clamped and pinned: zeros of the
    determinant of transfer matrices of (w, w', M, Q), by the solution in each section,

        w = a cos βx + b sin βx + c cosh βx + d sinh βx, β⁴ = ρA ω²/(E I).
    """

    def fields(x, beta, stiffness):
        c, s, ch, sh = np.cos(beta * x), np.sin(beta * x), np.cosh(beta * x), np.sinh(beta * x)
        k2, k3 = stiffness * beta**2, stiffness * beta**3
        return np.array([
            [c, s, ch, sh],
            [-beta * s, beta * c, beta * sh, beta * ch],
            [-k2 * c, -k2 * s, k2 * ch, k2 * sh],
            [k3 * s, -k3 * c, k3 * sh, k3 * ch],
        ])  # fmt: skip

    def determinant(frequency):
        total = np.eye(4)
        for length, outer, _, inner in np.array(sections) * 1e-3:
            area = math.pi / 4 * (outer**2 - inner**2)
            stiffness = YOUNG * math.pi / 64 * (outer**4 - inner**4)
            beta = (DENSITY * area * (2 * math.pi * frequency) ** 2 / stiffness) ** 0.25
            along = fields(length, beta, stiffness) @ np.linalg.inv(fields(0.0, beta, stiffness))
            total = along @ total
        # w = w' = 0 at the clamp, w = M = 0 at the pin
        return np.linalg.det(total[np.ix_([0, 2], [2, 3])])

    grid = np.linspace(5.0, 3000.0, 6000)
    values = [determinant(f) for f in grid]
    zeros = [
        optimize.brentq(determinant, grid[i], grid[i + 1])
        for i in range(len(grid) - 1)
        if values[i] * values[i + 1] < 0
    ]
    return zeros[:count]


@pytest.mark.parametrize("turned", [False, True])
def test_bending_frequencies_of_a_stepped_shaft(imported, turned):
    """Two bending modes in each of both planes, within what shear and rotary inertia lower."""
    case, conversion = imported(clamped(turned=turned))
    shaft = case.stages[0].sun.shaft
    assert shaft.direction == ("-z" if turned else "+z")
    sizes = [(s.length, s.outer_diameter, s.inner_diameter) for s in shaft.sections]
    sections = [(1e-3 * s[0], 1e-3 * s[1], 1e-3 * s[3]) for s in STEPPED]
    assert sizes == [pytest.approx(size) for size in sections]
    frequencies = fg.Case.of(case).assemble().modes()["frequency"].values
    for expected in bending_frequencies(STEPPED, 2):
        pair = np.sort(np.abs(frequencies / expected - 1.0))[:2]
        assert pair[1] < 0.01, (expected, frequencies)
    assert any("30 mm of its sections" in line for line in conversion.left_out)
    assert not any("concept_bearing" in line for line in conversion.assumed)


def test_closed_form_of_the_beam_script():
    """A uniform beam, clamped and pinned: βL = 3.9266, 7.0686."""
    uniform = ((700.0, 40.0, 40.0, 0.0), (300.0, 40.0, 40.0, 0.0))
    radius = 0.25 * 0.04  # of gyration
    expected = [
        b**2 / (2 * math.pi) * math.sqrt(YOUNG / DENSITY) * radius for b in (3.926602, 7.068583)
    ]
    assert bending_frequencies(uniform, 2) == pytest.approx(expected, rel=1e-6)


def test_spline_bearings_and_body_behind(imported):
    case, conversion = imported(clamped(tilt=7e4))
    sun, port = case.stages[0].sun, case.output
    assert sun.shaft.spline.stiffness == pytest.approx((1e11, 1e11, 1e11, 7e4, 7e4, 1e8))
    assert (port.mass, port.tilt_inertia, port.inertia) == (0.2, 2e-3, 2e-3)
    assert port.bearing.radial == sun.support.radial == pytest.approx(10 * YOUNG * 0.06)
    assert case.kinematics == "spatial"
    assert not any("support." in line for line in implausible(case, power_flow(case)))
    m = clamped(tilt=7e4)
    m.part(m.sun_shaft, "external_load", "push", force_v_direction=(10.0, "N"))
    case, conversion = imported(m)
    assert case.loads[0].force == (10, 0, 0)
    assert any("acts behind the shaft of low.sun" in line for line in conversion.assumed)
    m = clamped(tilt=7e4)
    m.components[m.mass] = ("additional_mass", "none", {})
    case, conversion = imported(m)
    d = 0.032
    mass = 7850 * math.pi / 4 * d**3
    assert case.output.mass == pytest.approx(mass)
    assert case.output.tilt_inertia == pytest.approx(mass * (d**2 / 16 + d**2 / 12))
    assert sum("as long and wide as the shaft's end" in line for line in conversion.assumed) == 3
    m = clamped(tilt=7e4)
    m.set(m.end_bearing, support_vector=((1350.0, 0.0, 0.0), MM))  # 100 mm before the end
    case, conversion = imported(m)
    assert case.output.bearing.z == pytest.approx(-0.1)
    assert any("100 mm from the end of the shaft of low.sun" in line for line in conversion.assumed)


def test_cones_and_gaps(imported):
    """A cone becomes four cylinders; a shaft ends where its sections have a gap, and says so."""
    case, conversion = imported(clamped(((800.0, 40.0, 80.0, 0.0), (400.0, 80.0, 80.0, 0.0))))
    sections = case.stages[0].sun.shaft.sections
    assert [s.length for s in sections] == pytest.approx([0.2] * 4 + [0.4])
    assert [1e3 * s.outer_diameter for s in sections] == pytest.approx([45, 55, 65, 75, 80])
    assert "4 cylinders in place of a cone" in conversion.text
    m = clamped()
    m.set(m.of("shaft_section")[-1], u_coordinate_on_shaft=(1060.0, MM))
    case, conversion = imported(m)
    assert len(case.stages[0].sun.shaft.sections) == 2
    assert any("has no sections in 400 mm" in line for line in conversion.left_out)
    m.set(m.of("shaft_section")[1], u_coordinate_on_shaft=(200.0, MM))
    assert imported(m)[0].stages[0].sun.shaft is None


def lumped(name, stage, held, **more):
    """A bundled case whose ring and carrier are lumped, and whose gear meshes are constant."""
    supports = {
        member: "{radial_n_per_m = 8e8, axial_n_per_m = 2e8, tilt_nm_per_rad = 2e6"
        + (", torsion_nm_per_rad = 3e7}" if member == held else "}")
        for member in ("ring", "carrier")
    }
    keys = ("ring.fe", "ring.hub", "carrier.fe", "carrier.bearing_drive", "carrier.bearing_far",
            "errors", "planet_bearing.rollers", "sun.shaft.elements_per_section")  # fmt: skip
    out = {f"{stage}.{key}": "" for key in keys}
    out |= {f"{stage}.{member}.support": text for member, text in supports.items()}
    return load_case(name, out | {f"{stage}.gear_mesh": CONSTANT, "solver": "", **more})


GRC = {"stages.1.gear_mesh": CONSTANT, "stages.2.gear_mesh": CONSTANT}
SHAFTED = {
    "ev-reducer": ("stage", "ring", {"drive": "", "tolerance": ""}),
    "star-ring": ("stage", "carrier", {"drive": "", "tolerance": ""}),
    "wind-5mw": ("stage", "ring", {"drive": "", "tolerance": ""}),
    "grc-750kw": ("stages.0", "ring", GRC),
}


@pytest.mark.parametrize("name", SHAFTED)
def test_bundled_shafts_come_back(tmp_path, name):
    """The same statics and modes, of suns on their port and before a joint, on either side."""
    stage, held, more = SHAFTED[name]
    case = lumped(name, stage, held, **more)
    require_same_system(case, again(case, tmp_path)[0])
    require_valid(tmp_path / "out.rexs")


def require_same_system(first, second):
    models = [fg.Case.of(case).assemble() for case in (first, second)]
    a, b = (np.sort(model.modes()["frequency"].values) for model in models)
    assert b == pytest.approx(a, rel=1e-9, abs=1e-6 * a.max())
    a, b = (model.static() for model in models)
    for figure in ("gear_mesh_force", "planet_bearing_force", "body_displacement"):
        size = float(np.abs(a[figure]).max())
        assert b[figure].values == pytest.approx(a[figure].values, rel=1e-8, abs=1e-9 * size)


def test_held_sun_and_beam_between_members_come_back(tmp_path):
    """The spline of a held sun is that in the housing; a joint that is a shaft is one again, and a
    casing without parts, which comes first in the file, is none of its ends."""
    case = load_case(solar(tmp_path))
    assert case.held_members() == ("a.sun",)
    file = exported(case, tmp_path / "out.rexs")
    other = b'<component id="999" type="gear_casing" />'
    file.write_bytes(file.read_bytes().replace(b"<components>", b"<components>" + other))
    copy, _ = case_of_file(file)
    assert copy.held_members() == ("a.sun",) and copy.joints[0].length == pytest.approx(0.5)
    require_same_system(case, copy)
    require_valid(tmp_path / "out.rexs")


def solar(folder):
    """A stage with a held sun on a shaft, whose ring drives; a shaft from its carrier to a pair."""
    steel = "young_modulus_gpa = 206\npoisson_ratio = 0.3\ndensity_kg_per_m3 = 7850\n"
    support = "{ radial_n_per_m = 8e8, axial_n_per_m = 2e8, tilt_nm_per_rad = 2e6 }"
    path = folder / "solar.toml"
    path.write_text(
        f"""
kinematics = "spatial"
held = ["a.sun"]
[material]
{steel}
[[stages]]
name = "a"
planets = 3
normal_module_mm = 4
pressure_angle_deg = 20
helix_angle_deg = 10
planet_hand = "right"
face_width_mm = 60
planet = {{ teeth = 24, dedendum = 1.4, root_fillet = 0.39 }}
ring = {{ teeth = 69, support = {support} }}
carrier = {{ support = {support} }}
planet_bearing = {{ radial_n_per_m = 8e8, axial_n_per_m = 2e8, tilt_nm_per_rad = 2e5 }}
gear_mesh = {CONSTANT}
[stages.sun]
teeth = 21
bore_diameter_mm = 20
[stages.sun.shaft]
direction = "-z"
[[stages.sun.shaft.sections]]
length_mm = 90
outer_diameter_mm = 50
[[stages.sun.shaft.sections]]
length_mm = 300
outer_diameter_mm = 40
[stages.sun.shaft.spline]
radial_n_per_m = 2e8
axial_n_per_m = 2e8
tilt_nm_per_rad = 1e4
torsion_nm_per_rad = 4e6
[[stages]]
name = "b"
kind = "parallel"
normal_module_mm = 4
pressure_angle_deg = 20
helix_angle_deg = 10
planet_hand = "left"
face_width_mm = 60
pinion = {{ teeth = 25, support = {support} }}
gear = {{ teeth = 61, support = {support} }}
gear_mesh = {CONSTANT}
[[joints]]
first = "a.carrier"
second = "b.gear"
length_mm = 500
outer_diameter_mm = 60
inner_diameter_mm = 20
[[inputs]]
member = "a.ring"
speed_rpm = 100
torque_nm = 500
inertia_kg_m2 = 2
[output]
member = "b.pinion"
inertia_kg_m2 = 1
""",
        encoding="utf-8",
    )
    return path


def test_shafts_between_members_of_a_file(imported):
    """One diameter is a beam; steps are springs of Σ l/(G J), and their bending is listed."""
    m = three_stages()
    shaft = m.of("shaft")[-2]
    add_sections(m, shaft, 250.0, [(200.0, 70.0, 70.0, 10.0)])
    case, conversion = imported(m)
    joint = next(j for j in case.joints if j.first == "stage_2.pinion")
    assert (joint.length, joint.outer_diameter, joint.inner_diameter) == pytest.approx(
        (0.1, 0.07, 0.01)
    )
    # a bearing each holds both against tilt, as planets and a bearing do the wheel and the sun
    tilts = [line for line in conversion.assumed if "support.tilt" in line]
    assert [line.split(".support")[0] for line in tilts] == [
        "stages.stage_1.ring", "stages.stage_3.pinion"
    ]  # fmt: skip
    m = three_stages()
    m.relate("reference", origin=shaft, referenced=m.steel)
    add_sections(m, shaft, 250.0, [(90.0, 70.0, 70.0, 10.0), (110.0, 50.0, 50.0, 0.0)])
    case, conversion = imported(m)
    joint = next(j for j in case.joints if j.first == "stage_2.pinion")
    lengths = ((0.04, 0.07, 0.01), (0.06, 0.05, 0.0))
    compliance = sum(32 * n / (math.pi * (d**4 - i**4)) for n, d, i in lengths)
    assert joint.stiffness[5] == pytest.approx(case_shear(case) / compliance)
    assert any("bending between stage_2.pinion and stage_3.gear" in x for x in conversion.left_out)


def test_u_coordinates_of_faces(imported):
    """Some files give the begin of a gear's face as u, its middle as place: the middle counts."""
    expected = imported(three_stages())[0]
    m = three_stages()
    m.set(m.wheels[0][0], u_coordinate_on_shaft=(270.0, MM))
    assert imported(m)[0].content_hash() == expected.content_hash()


def test_bearings_without_places_hold_no_shaft_straight(imported):
    """Two bearings that the file does not place hold no shaft straight; what is free is held."""
    m = planetary()
    add_sections(m, m.sun_shaft, 20.0, [BELOW, *STEPPED])
    for _ in range(2):
        m.side("concept_bearing", m.sun_shaft, m.casing, **bearing(1e9, 1e8, 50.0))
    for number in list(m.components):
        m.set(number, support_vector=None)
    case, conversion = imported(m)
    assert len(case.stages[0].sun.shaft.sections) == 3
    assert any(line.startswith("output.bearing.radial") for line in conversion.assumed)
    assert any("carrier.support.tilt" in line for line in conversion.assumed)
    assert fg.Case.of(case).assemble().modes()["frequency"].values[1] > 1.0


def case_shear(case):
    return case.material.young_modulus / (2 * (1 + case.material.poisson_ratio))


def test_keys_of_a_shaft_that_rexs_does_not_hold_are_listed(tmp_path):
    keys = {"stage.sun.shaft.elements_per_section": "4", "stage.sun.shaft.flexible": "false"}
    lost = not_written(load_case("ev-reducer", keys))
    assert {"stages.stage.sun.shaft.flexible", "stages.stage.sun.shaft.elements_per_section"} <= {
        *lost
    }
