"""Weber and Banaschek's tooth and tooth pair against plane-strain finite elements."""

import csv
from pathlib import Path

import numpy as np
import pytest
from cut_teeth.of_case import gear_of
from cut_teeth.shape import shape
from matplotlib.figure import Figure
from plane_teeth import HELD, Load, deflections, hertz, load_at

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.stiffness import compliance, line_load
from flexgear.gears.weber_banaschek import tooth_compliance
from flexgear.model.load import load_case
from flexgear.views.style import save_figure

HERE = Path(__file__).parent
HEIGHTS = np.linspace(0.1, 0.95, 8)  # of the flank, from the fillet to the tip
DEEPER = 2.0  # root thicknesses at which the body is held, for comparison
PLACES = (0.05, 0.25, 0.5, 0.75, 0.95)  # of the path of contact
SIZE = 0.3  # of the elements at the tooth, modules


@pytest.fixture(scope="module")
def case():
    return load_case("wind-5mw", {"stage.helix_angle_deg": "0"}).view()


def accepted(gear, part):
    with (HERE / "reference.csv").open() as stream:
        rows = {(r["gear"], r["part"]): float(r["accepted_error"]) for r in csv.DictReader(stream)}
    return rows[gear, part]


def by_fe(case, gear, loads, held=HELD):
    """Deflections by finite elements of a tooth cut by brute force, the body held at so many root
    thicknesses."""
    m = case.material
    size, depth = SIZE * case.stage.normal_module, held * shape(gear).root_thickness
    return deflections(gear, loads, m.young_modulus, m.poisson_ratio, held=depth, size=size)


@pytest.mark.parametrize("name", ["sun", "planet", "ring"])
def test_tooth_and_foundation(name, case, results):
    """Over the flank; what is accepted holds from mid-height up."""
    tooth, p, m = getattr(stage_geometry(case), name), gear_of(case, name), case.material
    radii = tooth.form_radius + HEIGHTS * (tooth.tip_radius - tooth.form_radius)
    theory = tooth_compliance(tooth.outline(), radii, m.young_modulus, m.poisson_ratio)
    loads = [load_at(p, r, 0.06 * case.stage.normal_module) for r in radii]
    fe, deeper = (by_fe(case, p, loads, held) for held in (HELD, DEEPER))
    computed = {part: np.array([getattr(d, part) for d in fe]) for part in ("tooth", "foundation")}
    computed["both"] = np.array([d.total for d in fe])
    expected = {"tooth": theory.bending, "foundation": theory.foundation}
    expected["both"] = theory.bending + theory.foundation
    deep = np.array([d.total for d in deeper])
    errors = {part: expected[part] / value - 1 for part, value in computed.items()}
    print(f"\n{name}, theory over finite elements less one, heights {np.round(HEIGHTS, 2)}")
    for part, error in errors.items():
        print(f"  {part:<10} {np.round(100 * error, 1)} %")
    print(f"  both, held at {DEEPER:g} s_f {np.round(100 * (expected['both'] / deep - 1), 1)} %")
    draw(p, m, (expected, computed, deep), results / "weber_banaschek" / f"{name}.png")
    upper = HEIGHTS > 0.45
    for part in ("tooth", "both"):
        assert np.abs(errors[part][upper]).max() < accepted(name, part)


def draw(p, m, compliances, file):
    """Theory as lines, finite elements as marks, over the height of the load."""
    unit = (1 - m.poisson_ratio**2) / m.young_modulus
    expected, computed, deep = compliances
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    for k, part in enumerate(expected):
        axes.plot(HEIGHTS, expected[part] / unit, "-", color=f"C{k}", label=f"{part}, theory")
        axes.plot(HEIGHTS, computed[part] / unit, "o", color=f"C{k}", label="finite elements")
    axes.plot(HEIGHTS, deep / unit, "x", color="C2", label=f"body held at {DEEPER:g} s_f")
    axes.set(
        xlabel="height of the load on the flank (–)",
        ylabel="compliance over (1 − ν²)/E (–)",
        title=f"z = {p.teeth}, body held {HELD:g} root thicknesses s_f below the root",
    )
    axes.legend(fontsize=7, ncols=2)
    save_figure(figure, file, dpi=120)


@pytest.mark.parametrize("gear", ["sun", "ring"])
def test_compliance_of_a_pair_over_its_path(gear, case):
    """Both flanks pressed with Hertz's width at the rated line load, over the path of contact."""
    g, m = stage_geometry(case), case.material
    gear_mesh = g.ring_gear_mesh if gear == "ring" else g.sun_gear_mesh
    force = power_flow(case.case).stages[0].gear_mesh_forces[gear]
    theory = compliance(case, g, gear, force)
    load = line_load(case, g, gear, force)
    expected = np.interp(PLACES, theory.xi, theory.total)
    reach = g.center_distance * np.sin(gear_mesh.working_angle)
    loads: dict[str, list[Load]] = {name: [] for name in ("planet", gear)}
    for s in gear_mesh.s_lo + np.array(PLACES) * (gear_mesh.s_hi - gear_mesh.s_lo):
        curvatures = {"planet": s, gear: s + reach if gear == "ring" else reach - s}
        mean = s * curvatures[gear] / (reach if gear == "sun" else curvatures[gear] - s)
        width = np.sqrt(8 * load * mean * (1 - m.poisson_ratio**2) / m.young_modulus / np.pi)
        for name, curvature in curvatures.items():
            p = gear_of(case, name)
            loads[name].append(load_at(p, float(np.hypot(p.base_radius, curvature)), width))
    computed = np.zeros(len(PLACES))
    for name, of_gear in loads.items():
        computed += [d.total for d in by_fe(case, gear_of(case, name), of_gear)]
        computed += [hertz(one, m.young_modulus, m.poisson_ratio) for one in of_gear]
    error = expected / computed - 1
    print(
        f"\n{gear} and planet, theory over finite elements less one: {np.round(100 * error, 1)} %"
    )
    assert np.abs(error).max() < accepted(gear, "pair")
