"""Contact of a tooth pair by CalculiX: what is stored, and its deck."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from cut_teeth.shape import shape
from plane_contact.cases import material, pair, stage

from solid_contact import stored
from solid_contact.cases import APPROACH, RUNS
from solid_contact.deck import (
    Motion,
    both_bodies,
    displacement,
    normal_of,
    reaction,
    run,
    slice_forces,
    write_deck,
)
from solid_contact.statements import K_WITHIN

GEARS = pair("ring")
TILTED = RUNS["tilted"]


@pytest.fixture(scope="module")
def small():
    """Three slices on a coarse section."""
    solid = replace(TILTED.solid, slices=3, grid=replace(TILTED.solid.grid, flank=10, coarse=1.4))
    return solid, both_bodies(GEARS, stage().stage.normal_module, solid)


@pytest.mark.parametrize("name", RUNS)
def test_stored_forces_balance_the_held_body(name):
    """Those of slices along their normals, which differ by less than a degree, and the reaction."""
    run = stored.run(name)
    assert run.forces.sum() == pytest.approx(run.reaction, rel=1e-3)
    assert (run.tilt, run.s) == pytest.approx((RUNS[name].motion.tilt, RUNS[name].solid.s))


def test_even_load_is_symmetric():
    forces = stored.run("even").forces
    assert forces == pytest.approx(forces[::-1], rel=1e-5)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("five slices", "tilted"),
        ("five slices", "five slices, finer section"),
        ("five slices", "five slices, stiffer contact"),
        ("short face", "short face, twice the layers"),
    ],
)
def test_stored_figures_are_converged(one, other):
    """Three times the layers or, with ends as in the other runs, twice as many, a section about 1.6
    times as fine, ten times the contact stiffness change K_Hβ by less than a third of what is asked
    of flexgear."""
    few, fine = stored.run(one), stored.run(other)
    same = fine.forces.reshape(len(few.forces), -1).sum(axis=1)
    factor, force = same.max() / same.mean(), same.sum() / few.forces.sum() - 1
    print(f"\n{other}: K_Hβ {few.k_h_beta:.4f} to {factor:.4f}, force {100 * force:+.2f} %")
    assert factor == pytest.approx(few.k_h_beta, abs=K_WITHIN / 3)


def test_flanks_of_the_deck_touch_in_a_line(small):
    """On the involutes, and no overlap but rounding where both gears have rolled to."""
    solid, fe_mesh = small
    turn = np.exp(-1j * GEARS.working)
    line = (GEARS.planet.base_radius + 1j * solid.s) * turn
    for name, tooth, centre in (
        ("planet", GEARS.planet, 0j),
        ("ring", GEARS.gear, complex(-GEARS.distance)),
    ):
        nodes = fe_mesh.points[np.unique(fe_mesh.facets[f"{name}_flank"])]
        seen = nodes[:, :2] @ np.array([1, 1j]) - centre
        radius = abs(seen)
        side = 1 if name == "planet" else GEARS.gear_side
        angle = np.angle(seen) - side * tooth.half_angle(radius)
        at_line = np.angle(line - centre) - side * tooth.half_angle(abs(line - centre))
        assert angle == pytest.approx(np.full(len(angle), at_line), abs=1e-12)


def test_body_comes_nearer_by_what_slices_are_given(small):
    """w₀ + w₁ z along the normal, nothing along the contact line."""
    solid, _ = small
    turn = np.exp(-1j * GEARS.working)
    line = (GEARS.planet.base_radius + 1j * solid.s) * turn
    points = np.array([[line.real, line.imag, z] for z in (-0.2, 0.0, 0.2)])
    motion = Motion(APPROACH, 1e-4)
    u = displacement(GEARS, solid.s, motion, points)
    assert u @ normal_of(GEARS) == pytest.approx(APPROACH + 1e-4 * points[:, 2], abs=1e-18)
    assert u[:, 2] == pytest.approx(np.zeros(3), abs=1e-18)


def test_patches_of_the_deck_are_whole(small):
    """Held and loaded faces have the area of their lines over the face, and point outward."""
    solid, fe_mesh = small
    for name in ("planet", "ring"):
        a, b, _, d = np.moveaxis(fe_mesh.points[fe_mesh.facets[f"{name}_flank"]], 1, 0)
        area = np.cross(b - a, d - a)
        outward = area.sum(axis=0) @ normal_of(GEARS)
        height = np.linalg.norm(area, axis=1).sum() / solid.face_width
        tooth = GEARS.planet if name == "planet" else GEARS.gear
        rolls = [tooth.roll_length(r) for r in (tooth.tip_radius, shape(tooth).form_radius)]
        arc = abs(rolls[0] ** 2 - rolls[1] ** 2) / (2 * tooth.base_radius)
        assert height == pytest.approx(arc, rel=1e-3)
        assert (outward > 0) == (name == "planet")


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_calculix_presses_the_deck_evenly(small, tmp_path):
    """Symmetric about mid-face, in balance, and as stiff as what is stored within 10 %."""
    solid, fe_mesh = small
    deck = tmp_path / "pair.inp"
    write_deck(deck, fe_mesh, GEARS, solid, material(), RUNS["even"].motion)
    printed = run("ccx", deck)
    forces = slice_forces(printed, fe_mesh, solid)
    assert forces == pytest.approx(forces[::-1], rel=1e-5)
    assert forces.sum() == pytest.approx(reaction(printed, GEARS), rel=1e-3)
    assert forces.sum() == pytest.approx(stored.run("even").forces.sum(), rel=0.1)
