"""Root stress: the submodel of three teeth against plane FE contact, its cut, and ISO 6336-3."""

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.radii import gears_by_role
from flexgear.gears.root_stress import (
    outer_single_contact,
    root_stress,
    virtual_teeth,
    virtual_tooth,
)
from flexgear.gears.tooth import base_helix_angle, transverse_angle
from flexgear.model.bundled import bundled_cases
from flexgear.model.load import load_case
from flexgear.structures.fe_mesh import SegmentParameters
from flexgear.structures.tooth_influence.root_stress import (
    DEPTH,
    FINE,
    root_influence,
    root_parameters,
)
from flexgear.views.style import save_figure

HERE = Path(__file__).parent
CONTACT = json.loads((HERE.parent / "plane_contact" / "reference.json").read_text("utf-8"))
SPUR = load_case(HERE.parent / "plane_contact" / "case.toml")
STEEL = (CONTACT["material"]["young"], CONTACT["material"]["poisson"])
HELD = 3.0  # modules below the root, where plane_contact holds its bodies
LEAST_LOAD = 0.3  # of the largest pair load, below which a pair is not compared


def accepted(what):
    with (HERE / "reference.csv").open() as stream:
        return {r["what"]: float(r["accepted"]) for r in csv.DictReader(stream)}[what]


def plane_root(tooth, module, depth=HELD):
    """Submodel of a spur tooth in plane strain, of a tenth of a module's width."""
    alone = SegmentParameters(tooth, 0.1 * module, 0.0, None, 0.1 * module, 1)
    parameters = root_parameters(alone, module, depth)
    fine = replace(FINE, rim=parameters.divisions.rim, layers=1)
    parameters = replace(parameters, divisions=fine)
    return root_influence(parameters, *STEEL, plane_strain=True)


def stress(influence, roll, line_load):
    """Largest tension on the fillet, Pa, under a line load, N/m."""
    width = float(np.ptp(influence.flank.z))
    slices = np.array([[roll], [0.0], [width], [line_load * width]])
    return float(influence.of_slices(*slices).max())


def both_fillets(influence, roll):
    """Stress per line load, Pa m/N, in the fillet under the loaded flank and in the other one, (2,
    rows)."""
    width = float(np.ptp(influence.flank.z))
    place = np.array([[roll], [0.0], [width]])
    return width * influence.per_force(*place)[0, 1, :, :, 0]


def stress_of_three(influence, outward, rolls, line_loads):
    """The same with the loads of the pairs beside it, at rolls (3,); tips carry off the path."""
    width, flank = float(np.ptp(influence.flank.z)), influence.flank
    # of a tooth further on in +θ the −θ flank touches a base pitch nearer to the root outside
    teeth = (1 - outward * np.sign(rolls - rolls[1])).astype(int)
    place = np.clip(rolls, *np.sort(flank.roll[[0, -1]]))
    found = influence.per_force(place, np.zeros(3), np.full(3, width))[range(3), teeth, 0]
    return float(np.tensordot(line_loads * width, found, axes=1).max())


@pytest.mark.parametrize("mesh", ["sun", "ring"])
@pytest.mark.parametrize("slot", ["planet", "gear"])
def test_against_plane_contact_at_every_place(mesh, slot):
    """The loads of its own pair and of those beside it, as the contact found them."""
    view, stored = SPUR.view(), CONTACT["pairs"][mesh]
    g, module = stage_geometry(view), view.stage.normal_module
    tooth = g.planet if slot == "planet" else g.gears[mesh]
    influence = plane_root(tooth, module)
    between = g.planet.tangent_distance(g.gears[mesh], stored["working_angle"])
    s = np.array(stored["s"])[:, None] + stored["base_pitch"] * np.array([-1, 0, 1])
    if slot == "gear":
        s = between + s if mesh == "ring" else between - s
    rolls = s[:, 1]
    low, high = sorted(influence.flank.roll[[0, -1]])
    for name, found in stored["loadings"].items():
        loads = np.array(found["loads"])
        enough = loads[:, 1] > LEAST_LOAD * loads[:, 1].max()
        there = enough & (rolls >= low) & (rolls <= high)
        pairs = zip(s[there], loads[there], strict=True)
        computed = [stress_of_three(influence, tooth.outward, *at) for at in pairs]
        errors = np.array(computed) / np.array(found[f"{slot}_stress"])[there, 1] - 1
        print(f"{mesh} {slot}, {name}: {100 * errors.min():+.1f} … {100 * errors.max():+.1f} %")
        assert np.abs(errors).max() < accepted("plane contact")


@pytest.mark.parametrize("slot", ["sun", "planet", "ring"])
def test_depth_of_the_cut_does_not_matter(slot):
    """Anywhere in both fillets, stretched and compressed, by the largest stress."""
    view = SPUR.view()
    module, tooth = view.stage.normal_module, stage_geometry(view).gears[slot]
    for height in (0.3, 0.7):
        roll = tooth.form_radius + height * (tooth.tip_radius - tooth.form_radius)
        some, deeper = (
            both_fillets(plane_root(tooth, module, depth), tooth.roll_length(roll))
            for depth in (DEPTH, DEPTH + 1.5)
        )
        change = np.abs(deeper - some).max(axis=1) / some.max()
        print(f"\n{slot}: {100 * change[0]:.2f} % stretched, {100 * change[1]:.2f} % compressed")
        assert change.max() < accepted("depth of the cut")


def side_by_side(case):
    """Rows of a case: gear, ISO, ISO with the drawn fillet, FE, FE cut as deep as in a run; MPa
    without Y_β, as the FE is of the virtual spur gear, with the whole number of teeth that is
    nearest."""
    for flow in power_flow(case).stages:
        view = case.view(flow.name)
        g, stage = stage_geometry(view), view.stage
        if g.overridden:
            continue
        cos_b, gears = math.cos(base_helix_angle(stage)), gears_by_role(stage)
        for slot, gear_mesh in g.gear_meshes.items():
            force = abs(flow.gear_mesh_forces[slot])
            for part in ("planet", slot):
                tooth, gear = g.gears[part], gears[part]
                iso, drawn = (
                    root_stress(tooth, gear, stage, gear_mesh, force, drawn=arc)
                    for arc in (False, True)
                )
                virtual = virtual_tooth(tooth, gear, stage)
                virtual = replace(virtual, teeth=round(virtual_teeth(tooth.teeth, stage)))
                pitch = math.pi * stage.normal_module * math.cos(stage.pressure_angle)
                ratio = gear_mesh.transverse_contact_ratio / cos_b**2
                roll = virtual.roll_length(outer_single_contact(virtual, pitch, ratio))
                line_load = force * cos_b * math.cos(transverse_angle(stage))
                line_load /= stage.face_width * math.cos(stage.pressure_angle)
                roots = (plane_root(virtual, stage.normal_module, d) for d in (HELD, DEPTH))
                fe, deep = (stress(root, roll, line_load) for root in roots)
                name = f"{view.part(part)} with {view.part(slot if part == 'planet' else 'planet')}"
                name = f"{flow.name} {name}" if len(case.stages) > 1 else name
                sigma = [one.stress / one.helix_factor for one in (iso, drawn)]
                yield name, tooth.internal, *(1e-6 * value for value in (*sigma, fe, deep))


@pytest.mark.parametrize("name", bundled_cases())
def test_iso_beside_fe(name, results):
    rows = list(side_by_side(load_case(name)))
    for gear, internal, iso, drawn, fe, deep in rows:
        print(
            f"{name} {gear}: ISO {iso:.1f}, ISO with the drawn fillet {drawn:.1f}, FE {fe:.1f} MPa,"
            f" ISO over FE {100 * (iso / fe - 1):+.1f} %, drawn {100 * (drawn / fe - 1):+.1f} %;"
            f" cut {DEPTH} modules below the root, as in a run, {100 * (drawn / deep - 1):+.1f} %"
        )
        assert abs(deep / fe - 1) < accepted("depth of the cut")
        assert -accepted("ISO below FE, drawn fillet") < drawn / fe - 1
        assert drawn / fe - 1 < accepted("ISO over FE, drawn fillet")
        assert internal or iso <= drawn
    if rows:  # a case without load, or with radii of its own, has none
        draw(name, rows, results / "root_stress" / f"{name}.png")


def draw(name, rows, file):
    figure = Figure(figsize=(7, 1.2 + 0.5 * len(rows)), layout="constrained")
    axes, at = figure.subplots(), np.arange(len(rows))
    labels = (
        "ISO 6336-3:2006 (rack's fillet)",
        "ISO, fillet as drawn (arc)",
        "FE, fillet as drawn",
    )
    for k, label in enumerate(labels):
        axes.barh(at + 0.27 * (k - 1), [row[2 + k] for row in rows], 0.25, label=label)
    axes.set_yticks(at, [row[0] for row in rows])
    axes.invert_yaxis()
    axes.set(xlabel="nominal root stress without $Y_β$ (MPa)", title=name)
    axes.legend(fontsize=7)
    save_figure(figure, file)
