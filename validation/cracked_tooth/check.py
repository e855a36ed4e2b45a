"""What a crack adds to the compliance of a tooth, against plane finite elements of another mesh."""

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cut_teeth.of_case import gear_of
from matplotlib.figure import Figure
from plane_crack import crack_compliance
from plane_teeth import load_at

from flexgear.gears.geometry import stage_geometry
from flexgear.model.faults import Fault
from flexgear.model.load import load_case
from flexgear.structures.tooth_influence.of_case import added_compliance, crack_parameters
from flexgear.views.style import save_figure

HERE = Path(__file__).parent
STEEL = (2.1e11, 0.3)
DEPTHS = (0.1, 0.3, 0.5)  # of the root section
HEIGHTS = (0.2, 0.5, 0.8)  # of the flank, from its root
ANGLES = (60.0, 90.0)  # to the tooth's middle line, degrees


@pytest.fixture(scope="module")
def case():
    return load_case("wind-5mw", {"stage.helix_angle_deg": "0"}).view()


def accepted(name):
    with (HERE / "reference.csv").open() as stream:
        return {r["figure"]: float(r["accepted"]) for r in csv.DictReader(stream)}[name]


def parameters(case, role, depth, angle):
    """Segment of a gear with a crack; depth in root sections."""
    section = stage_geometry(case).gears[role].root.section.thickness
    fault = Fault(
        kind="root_crack",
        gear=role,
        planet=1 if role == "planet" else None,
        tooth=1,
        flank="sun" if role == "planet" else "drive",
        depth=depth * section,
        angle=math.radians(angle),
    )
    return crack_parameters(case, role, fault, 1.0)


def in_plane(p):
    """One layer of it in plane strain: compliance of a metre of face by roll length, m²/N."""
    width = 0.1 * p.tooth.reference_radius / p.tooth.teeth
    divisions = replace(p.divisions, layers=1)
    thin = replace(p, face_width=width, divisions=divisions, depths=p.depths[:1])
    added = added_compliance(thin, *STEEL, plane_strain=True)
    return lambda roll: added.matrix(*np.array([[roll], [0.0], [width]]))[0, 0] * width


@pytest.mark.parametrize("role", ["sun", "planet", "ring"])
@pytest.mark.parametrize("angle", ANGLES)
def test_depths_and_heights(role, angle, case, results):
    tooth, module = stage_geometry(case).gears[role], case.stage.normal_module
    low, high = sorted(map(tooth.roll_length, (tooth.form_radius, tooth.tip_radius)))
    root, tip = (high, low) if tooth.internal else (low, high)
    gear, rolls = gear_of(case, role), [root + height * (tip - root) for height in HEIGHTS]
    loads = [load_at(gear, math.hypot(tooth.base_radius, r), 0.05 * module) for r in rolls]
    figure = Figure(figsize=(7, 4))
    axis = figure.subplots()
    for depth in DEPTHS:
        p = parameters(case, role, depth, angle)
        plane = crack_compliance(
            gear, loads, *STEEL,
            held=4 * module, size=0.4 * module, depth=p.depths[0], angle=p.angle,
        )  # fmt: skip
        errors = np.array(list(map(in_plane(p), rolls))) / plane - 1
        print(f"{role}, {angle:g}°, depth {depth:g}: {np.round(100 * errors, 1)} %")
        axis.plot(HEIGHTS, 100 * errors, "o-", label=f"depth {depth:g} root sections")
        assert np.abs(errors).max() <= accepted("plane")
    axis.set(xlabel="height on the flank", ylabel="added compliance over that of triangles / %")
    axis.set_title(f"{role}, crack at {angle:g}°")
    axis.legend()
    save_figure(figure, results / f"cracked_{role}_{angle:.0f}.png")


def test_a_wide_tooth_lies_between_plane_strain_and_plane_stress(case):
    """Even load on a face of ten modules: between plane strain and plane stress, (1 − ν²)."""
    p = parameters(case, "sun", 0.3, 60.0)
    width = 10 * case.stage.normal_module
    wide = replace(p, face_width=width, depths=p.depths[:1] * 8)
    wide = replace(wide, divisions=replace(p.divisions, layers=8))
    added, plane = added_compliance(wide, *STEEL), in_plane(p)
    roll = float(np.mean(added.roll))
    line = np.array([[roll], [0.0], [width]])
    share = added.matrix(*line)[0, 0] * width / plane(roll)
    print(f"over plane strain: {share:.4f}")
    assert 1.0 <= share <= 1.0 / (1.0 - STEEL[1] ** 2)
