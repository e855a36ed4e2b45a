"""Neighbouring tooth pairs of a gear mesh yield to each other through the bodies below them."""

from dataclasses import replace

import numpy as np
import pytest
from train_contexts import coarse_teeth, rigid_stage

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.line_loads import gear_mesh_stiffness, line_loads
from flexgear.analysis.modes import rows_at
from flexgear.coupling.kernels.elements import row_stiffness
from flexgear.coupling.pair_data import LINE_COLUMNS
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.results.sinks import ranges_of
from flexgear.results.time_figures import energy_balance, largest_residual
from flexgear.solve.transient import simulate
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions
from flexgear.structures.tooth_influence import of_case
from flexgear.structures.tooth_influence.of_case import pair_bending

CASE = load_case(
    "wind-5mw",
    {
        "stage.gear_mesh.model": "face_load", "stage.gear_mesh.tooth_compliance": "fe",
        "stage.gear_mesh.slices": "7", "stage.face_width_mm": "150", "stage.ring.fe.fits": "[]",
        **{f"stage.errors.{gear}_tooth_um": "0" for gear in ("ring", "planet", "sun")},
    },
)  # fmt: skip
CYCLE = 2 * np.pi / CASE.view().stage.ring.teeth * np.arange(4) / 4
COARSE = SegmentDivisions(flank=4, fillet=2, tooth=2, rim=2, layers=4)


@pytest.fixture(scope="module")
def model():
    """Rigid bodies, with influences of coarse segments of three teeth, a ring's too."""
    view = CASE.view()
    teeth = coarse_teeth(view, COARSE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(of_case, "tooth_influence", lambda view, slot: teeth[slot])
        forces = power_flow(CASE).stages[0].gear_mesh_forces
        paths = stage_paths(view, forces)
        bends = {
            k: pair_bending(view, paths[k, ""], paths[k, ""].slices, force)
            for k, force in forces.items()
        }
        yield rigid_stage(CASE), paths, bends


@pytest.fixture(scope="module")
def turned(model):
    """Positions over a gear-mesh cycle at the rated torque."""
    return revolution(model[0].modal, CYCLE, model[0].system.rated_torque)


def whole_lines(bends, path, lines, where, closer=0.0):
    """Forces of all slices of the pairs of one gear mesh at once, with all their influences, where
    the bodies are ``closer``, m, than the equilibrium puts them."""
    position, m = where
    slots = np.flatnonzero(np.isfinite(lines.approach[position, m]))
    first = lines.path[position, m, slots] - path.slope * lines.z[position, m, slots]
    slots = slots[np.argsort(first[:, 0])]
    s, count = np.sort(first[:, 0]), lines.z.shape[-1]
    z, gap = lines.z[position, m, slots].ravel(), lines.gap[position, m, slots].ravel()
    approach, tilt = (np.repeat(a[position, m, slots], count) for a in (lines.approach, lines.tilt))
    x = approach + closer + tilt * z - gap
    flexibility = np.zeros((len(x), len(x)))
    for k, place in enumerate(s):
        block = slice(k * count, (k + 1) * count)
        flexibility[block, block] = at(bends.flexibility, place, path)
        for distance, between in enumerate(at(bends.beside, place, path)[: len(s) - k - 1], k + 1):
            after = slice(distance * count, (distance + 1) * count)
            flexibility[block, after], flexibility[after, block] = between, between.T
    scale = np.concatenate([at(bends.scale, place, path) for place in s])
    limit = np.concatenate([at(bends.limit, place, path) for place in s])
    return slots, pressed(flexibility, scale, limit, x).reshape(-1, count)


def at(table, place, path):
    """Row of a table over the path coordinate."""
    flat = table.reshape(len(table), -1).T
    return np.array([np.interp(place, path.slices.s, v) for v in flat]).reshape(table.shape[1:])


def pressed(flexibility, scale, limit, x):
    """Newton's method on the slices that touch."""
    f, touch = np.full(len(x), 1e-6 * limit.min()), x > 0
    for _ in range(60):
        f[~touch] = 0.0
        some = np.flatnonzero(touch)
        force = np.maximum(f[some], 1e-9 * limit[some])
        ratio = np.log(limit[some] / force)
        left = (x - flexibility @ f)[some] - scale[some] * force * ratio
        tangent = flexibility[np.ix_(some, some)] + np.diag(scale[some] * (ratio - 1))
        f[some] += np.linalg.solve(tangent, left)
        wrong = (f < 0) | (~touch & (x - flexibility @ f > 1e-12 * x.max()))
        touch = np.where(f < 0, False, touch | wrong)
        if not wrong.any() and np.abs(left).max() < 1e-10 * x.max():
            return np.where(touch, f, 0.0)
    raise AssertionError("no answer")


@pytest.mark.parametrize(("kind", "m"), [("ring", 0), ("sun", 5)])
def test_the_whole_set_of_slices_says_the_same(model, turned, kind, m):
    """Resultants are enough between pairs: all slices of all pairs solved at once, for the bodies
    where the equilibrium puts them, carry the same; without neighbours they would carry more."""
    case_model, paths, bends = model
    assert case_model.system.pairs.kind[m] == ("ring", "sun").index(kind)
    lines, worst, alone = line_loads(turned), 0.0, []
    for position in range(len(CYCLE)):
        slots, force = whole_lines(bends[kind], paths[kind, ""], lines, (position, m))
        by_lines, largest = lines.force[position, m, slots], turned.pair_load[:, m].max()
        load = by_lines.sum(axis=1)
        assert force.sum(axis=1) == pytest.approx(load, abs=0.01 * largest)
        worst = max(worst, np.abs(force - by_lines).max() / by_lines.max())
        single = replace(bends[kind], beside=np.zeros_like(bends[kind].beside))
        _, force = whole_lines(single, paths[kind, ""], lines, (position, m))
        alone.append(force.sum() / load.sum() - 1)
    print(f"\n{kind}: slices within {100 * worst:.1f} %, without neighbours {alone}")
    assert worst < 0.03
    assert min(alone) > 0.03


def test_mean_springs_have_the_stiffness_of_the_gear_mesh(model):
    """At every position over the cycle, which the slope of all slices bears out (below)."""
    case_model, cycles = model[0], model[0].mean_springs.cycles
    count = len(cycles[0].stiffness)
    angles = 2 * np.pi / CASE.view().stage.ring.teeth * np.arange(count) / count
    turned = revolution(case_model.modal, angles, case_model.system.rated_torque)
    stiffness = gear_mesh_stiffness(turned, line_loads(turned))
    for m, cycle in cycles.items():
        assert cycle.stiffness == pytest.approx(stiffness[:, m], rel=1e-6)
        assert np.abs(cycle.force).max() > 0.0


@pytest.mark.parametrize(("kind", "m"), [("ring", 0), ("sun", 5)])
def test_stiffness_of_the_gear_mesh_is_the_slope_of_all_slices(model, turned, kind, m):
    """Central difference of the whole set of slices, neighbours and line contact included."""
    _, paths, bends = model
    lines, step = line_loads(turned), 1e-8
    stiffness = gear_mesh_stiffness(turned, lines)[:, m]
    for position in range(len(CYCLE)):
        forces = [
            whole_lines(bends[kind], paths[kind, ""], lines, (position, m), closer)[1].sum()
            for closer in (-step, step)
        ]
        slope = (forces[1] - forces[0]) / (2.0 * step)
        assert stiffness[position] == pytest.approx(slope, rel=0.02)
        assert np.nansum(lines.tangent[position, m]) > 1.03 * slope  # each pair for itself


def test_equilibria_close_and_slices_add_up(model, turned):
    assert turned.closure.max() < 1e-8
    total = np.nansum(line_loads(turned).force, axis=-1)
    np.testing.assert_allclose(total, turned.pair_load, atol=1e-8 * turned.pair_load.max())


def test_modes_have_the_flexibility_that_rows_have(model):
    """(1/k and B)⁻¹ of the rows on the path; what is off it has no nominal stiffness."""
    rows, n = rows_at(model[0].system)
    stiffness, k = row_stiffness(rows, n), rows.row["stiffness"][:n]
    np.testing.assert_allclose(stiffness, stiffness.T, rtol=1e-9, atol=1e-9 * k.max())
    on = np.flatnonzero(k > 1e-6 * k.max())
    flexibility = np.linalg.inv(stiffness[np.ix_(on, on)])
    diagonal = np.diag(1 / k[on])
    beside = flexibility - diagonal
    assert np.diag(beside) == pytest.approx(0.0, abs=1e-9 * diagonal.max())
    table = model[0].system.pairs.slice_table
    assert 0.0 < beside.max() <= (1 + 1e-9) * table[:, :, 2:LINE_COLUMNS].max()


def test_a_torque_drop_keeps_its_energy(model):
    rated, drop = model[0].system.rated_torque, model[0].case.drive.drop
    drive = drop(0.2 * rated, 0.005, 0.01, rated)
    run = simulate(model[0], duration=0.03, drive=drive, energy=True).data
    assert largest_residual(ranges_of(run, energy_balance)) < 1e-6
