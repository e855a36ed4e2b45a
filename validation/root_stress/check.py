"""Root stress: submodel of three teeth against plane FE of teeth cut by brute force, against plane
FE contact, its cut, and ISO 6336-3 beside it."""

import csv
import json
import math
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from cut_teeth.gear import Gear
from matplotlib.figure import Figure
from plane_contact.body import Elastic

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.nominal_stress import (
    outer_single_contact,
    root_stress,
    virtual_tooth,
)
from flexgear.gears.power_flow import power_flow
from flexgear.gears.radii import gears_by_role
from flexgear.gears.tool import PlainTool
from flexgear.gears.tooth import base_helix_angle, tooth_geometry, transverse_angle
from flexgear.model.load import bundled_cases, load_case
from flexgear.structures.fe_mesh.tooth_segment import SegmentParameters
from flexgear.structures.tooth_influence.roots import (
    DEPTH,
    FINE,
    root_influence,
    root_parameters,
)
from flexgear.views.style import save_figure
from root_stress.plane import plane_tooth

HERE = Path(__file__).parent
CONTACT = json.loads((HERE.parent / "plane_contact" / "reference.json").read_text("utf-8"))
SPUR = load_case(HERE.parent / "plane_contact" / "case.toml")
STEEL = (CONTACT["material"]["young"], CONTACT["material"]["poisson"])
HELD = 3.0  # modules below the root, where plane_contact holds its bodies
LEAST_LOAD = 0.3  # of the largest pair load, below which a pair is not compared


def accepted(what):
    with (HERE / "reference.csv").open() as stream:
        return {r["what"]: float(r["accepted"]) for r in csv.DictReader(stream)}[what]


@lru_cache(maxsize=32)
def plane_root(tooth, module, depth=HELD):
    """Submodel of a spur tooth in plane strain, of a tenth of a module's width."""
    alone = SegmentParameters(tooth, 0.1 * module, 0.0, None, 0.1 * module, 1)
    parameters = root_parameters(alone, module, depth)
    fine = replace(FINE, rim=parameters.divisions.rim, layers=1)
    parameters = replace(parameters, divisions=fine)
    return root_influence(parameters, *STEEL, plane_strain=True)


def stress(influence, roll, line_load):
    """Largest tension on the fillet, Pa, under a line load, N/m."""
    return line_load * float(both_fillets(influence, roll)[0].max())


def both_fillets(influence, roll):
    """Stress per line load, Pa m/N, in the fillet under the loaded flank and in the other one, (2,
    rows)."""
    width = float(np.ptp(influence.z))
    place = np.array([[roll], [0.0], [width]])
    return width * influence.per_force(*place)[0, 1, :, :, 0]


def stress_of_three(influence, outward, rolls, line_loads):
    """The same with the loads of the pairs beside it, at rolls (3,); tips carry off the path."""
    width = float(np.ptp(influence.z))
    # of a tooth further on in +θ the −θ flank touches a base pitch nearer to the root outside
    teeth = (1 - outward * np.sign(rolls - rolls[1])).astype(int)
    place = np.clip(rolls, *np.sort(influence.roll[[0, -1]]))
    stress = influence.per_force(place, np.zeros(3), np.full(3, width))[range(3), teeth, 0]
    return float(np.tensordot(line_loads * width, stress, axes=1).max())


HEIGHTS = (0.4, 0.7, 1.0)  # of the flank's length, from the root
MODULE = 1e-2  # m
CUT = {  # three tooth numbers each; of a planet the rack of ISO 53 profile D, of a ring z_0 = z/3
    "sun 17": Gear(17, MODULE, shift=0.3),
    "sun 27": Gear(27, MODULE),
    "sun 45": Gear(45, MODULE, shift=-0.1),
    "planet 24": Gear(24, MODULE, shift=0.2, dedendum=1.4, rounding=0.39),
    "planet 33": Gear(33, MODULE, dedendum=1.4, rounding=0.39),
    "planet 90": Gear(90, MODULE, shift=0.1, dedendum=1.4, rounding=0.39),
    "ring 60": Gear(60, MODULE, True, -0.2, rounding=0.3, cutter_teeth=20),
    "ring 93": Gear(93, MODULE, True, cutter_teeth=31),
    "ring 150": Gear(150, MODULE, True, 0.1, cutter_teeth=50),
    "undercut 13": Gear(13, MODULE),
    "protuberance 27": Gear(
        27, MODULE, dedendum=1.4, protuberance=0.04 * MODULE, allowance=0.02 * MODULE
    ),
}


@dataclass(frozen=True)
class Numbers:
    """What ``tooth_geometry`` takes, of a gear for the brute-force cutter."""

    gear: Gear

    def __getattr__(self, name):
        g = self.gear
        same = {
            "normal_module": g.module, "pressure_angle": g.alpha, "helix_angle": g.helix,
            "profile_shift": g.shift, "root_fillet": g.rounding, "teeth": g.teeth,
            "addendum": g.addendum, "dedendum": g.dedendum,
        }  # fmt: skip
        if name == "tool":
            teeth = g.cutter_teeth or None
            return PlainTool(teeth, g.cutter_shift, None, g.protuberance, g.ramp, g.allowance)
        return same[name]


@pytest.mark.parametrize("name", CUT)
def test_against_plane_fe_of_teeth_cut_by_brute_force(name):
    """A line load at three heights; five teeth, held where the submodel is cut."""
    gear = CUT[name]
    blank = Numbers(gear)
    tooth = tooth_geometry(blank, blank, internal=gear.internal)
    influence = plane_root(tooth, gear.module, DEPTH)
    plane = plane_tooth(gear, Elastic(*STEEL), DEPTH)
    errors = [stress(influence, plane.roll(h), 1.0) / plane.stress(h) - 1 for h in HEIGHTS]
    print(f"\n{name}, load at {HEIGHTS} of the flank: {np.round(100 * np.array(errors), 1)} %")
    assert np.abs(errors).max() < accepted("teeth cut by brute force")


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
    low, high = sorted(influence.roll[[0, -1]])
    for name, loading in stored["loadings"].items():
        loads = np.array(loading["loads"])
        enough = loads[:, 1] > LEAST_LOAD * loads[:, 1].max()
        inside = enough & (rolls >= low) & (rolls <= high)
        pairs = zip(s[inside], loads[inside], strict=True)
        computed = [stress_of_three(influence, tooth.outward, *at) for at in pairs]
        errors = np.array(computed) / np.array(loading[f"{slot}_stress"])[inside, 1] - 1
        print(f"{mesh} {slot}, {name}: {100 * errors.min():+.1f} … {100 * errors.max():+.1f} %")
        assert np.abs(errors).max() < accepted("plane contact")


@pytest.mark.parametrize("slot", ["sun", "planet", "ring"])
def test_depth_of_the_cut_does_not_matter(slot):
    """Anywhere in the stretched fillet and in the compressed one, by the largest of each."""
    view = SPUR.view()
    module, tooth = view.stage.normal_module, stage_geometry(view).gears[slot]
    for height in (0.3, 0.7):
        roll = tooth.form_radius + height * (tooth.tip_radius - tooth.form_radius)
        some, deeper = (
            both_fillets(plane_root(tooth, module, depth), tooth.roll_length(roll))
            for depth in (DEPTH, DEPTH + 1.5)
        )
        change = np.abs(deeper - some).max(axis=1) / np.abs(some).max(axis=1)
        print(f"\n{slot}: {100 * change[0]:.2f} % stretched, {100 * change[1]:.2f} % compressed")
        assert change.max() < accepted("depth of the cut")


def side_by_side(case):
    """Rows of a case: gear, ISO, FE; MPa without Y_β, as the FE is of the
    virtual spur gear, with the whole number of teeth that is nearest."""
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
                iso = root_stress(tooth, gear, stage, gear_mesh, force)
                virtual = virtual_tooth(tooth, gear, stage)
                pitch = math.pi * stage.normal_module * math.cos(stage.pressure_angle)
                ratio = gear_mesh.transverse_contact_ratio / cos_b**2
                roll = virtual.roll_length(outer_single_contact(virtual, pitch, ratio))
                line_load = force * cos_b * math.cos(transverse_angle(stage))
                line_load /= stage.face_width * math.cos(stage.pressure_angle)
                fe = stress(plane_root(virtual, stage.normal_module), roll, line_load)
                name = f"{view.part(part)} with {view.part(slot if part == 'planet' else 'planet')}"
                name = f"{flow.name} {name}" if len(case.stages) > 1 else name
                yield name, 1e-6 * iso.stress / iso.helix_factor, 1e-6 * fe


@pytest.mark.parametrize("name", bundled_cases())
def test_iso_beside_fe(name, results):
    rows = list(side_by_side(load_case(name)))
    for gear, iso, fe in rows:
        off = 100 * (iso / fe - 1)
        print(f"{name} {gear}: ISO {iso:.1f}, FE {fe:.1f} MPa, ISO over FE {off:+.1f} %")
        assert -accepted("ISO below FE") < iso / fe - 1 < accepted("ISO over FE")
    if rows:  # a case without load, or with radii of its own, has none
        draw(name, rows, results / "root_stress" / f"{name}.png")


def draw(name, rows, file):
    figure = Figure(figsize=(7, 1.2 + 0.4 * len(rows)), layout="constrained")
    axes, at = figure.subplots(), np.arange(len(rows))
    for k, label in enumerate(("ISO 6336-3:2006", "FE")):
        axes.barh(at + 0.36 * (k - 0.5), [row[1 + k] for row in rows], 0.34, label=label)
    axes.set_yticks(at, [row[0] for row in rows])
    axes.invert_yaxis()
    axes.set(xlabel="nominal root stress without $Y_β$ (MPa)", title=name)
    axes.legend(fontsize=7)
    save_figure(figure, file)
